"""Calibration: whether answers said to be so probable are that often true.

Two ways to know what is true. All objects: half of the objects of every class are hidden, the other half
answers with confidence, foreseeing as many more, and all of them together tell what is true. The long run:
the objects are taken for the whole world, as many of each class are drawn from it with replacement and
answer, foreseeing endlessly many more, and the world tells what is true. The qualities are those of all
objects throughout: what is in doubt is how often they are held.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ersatz.evaluation.regrounding import Objects, accepted, held_degrees, reground
from ersatz.grounding.conceptualization import DEGREE
from ersatz.grounding.subcategorization import Qualities
from ersatz.reasoner.confidence import DRAWS, confidences
from ersatz.reasoner.population import Population
from ersatz.reasoner.relevance import USUAL, ReasonerSettings
from ersatz.reasoner.sampling import Question


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """What was said from half of the objects, and what all of them say.

    Attributes
    ----------
    said : (n,) float64 array
        Probability that a candidate stands in.
    crisp : (n,) bool array
        Whether half of the objects accept it.
    true : (n,) bool array
        Whether all of them do.
    """

    said: NDArray[np.float64]
    crisp: NDArray[np.bool_]
    true: NDArray[np.bool_]

    @property
    def brier(self) -> float:
        """Mean squared error of the probabilities (Brier 1950); 0 is best."""
        return float(((self.said - self.true) ** 2).mean())

    @property
    def brier_crisp(self) -> float:
        """The same of the decisions 0 and 1: the share that more objects overturn."""
        return float((self.crisp != self.true).mean())

    @property
    def error(self) -> float:
        """Expected calibration error: how far said and true are apart in the mean over ten bins."""
        return float(sum(abs(one.said - one.true) * one.count for one in self.bins()) / len(self.said))

    def bins(self, number: int = 10) -> "tuple[Bin, ...]":
        """Return the answers in bins of equal width by what was said; empty ones are left out."""
        at = np.minimum((self.said * number).astype(int), number - 1)
        rows = [np.flatnonzero(at == one) for one in range(number)]
        return tuple(
            Bin(float(self.said[of].mean()), float(self.true[of].mean()), len(of)) for of in rows if len(of)
        )

    def to_json(self) -> dict[str, Any]:
        """Return it in JSON's types."""
        return {
            "answers": len(self.said),
            "brier": round(self.brier, 6),
            "brier_crisp": round(self.brier_crisp, 6),
            "calibration_error": round(self.error, 6),
            "bins": [[round(one.said, 6), round(one.true, 6), one.count] for one in self.bins()],
        }


@dataclass(frozen=True, slots=True)
class Bin:
    """Answers said with about the same probability.

    Attributes
    ----------
    said, true : float in [0, 1]
        Their mean probability, and the share that is true.
    count : int
    """

    said: float
    true: float
    count: int


class Truth(StrEnum):
    """What an answer is compared with; see above."""

    ALL_OBJECTS = "all objects"
    LONG_RUN = "the long run"


def calibrate(
    objects: Objects,
    qualities: Sequence[Qualities],
    settings: ReasonerSettings | None = None,
    splits: int = 20,
    draws: int = DRAWS,
    *,
    truth: Truth = Truth.ALL_OBJECTS,
    wholes: bool = True,
) -> Calibration:
    """Ask for every tool with some of the objects, many times, and compare with what is true.

    Parameters
    ----------
    objects : Objects
    qualities : sequence of Qualities
    settings : ReasonerSettings, optional
    splits, draws : int
    truth : Truth
    wholes : bool
        Draw objects as wholes, rather than each property by itself.
    """
    settings = settings or USUAL
    right = accepted(reground(objects, qualities), settings)
    said, crisp, true = [], [], []
    for seed in range(splits):
        endless = truth is Truth.LONG_RUN
        shown = objects.resampled(seed) if endless else objects.take(half(objects, seed))
        further = None if endless else len(objects.of_class) / len(shown.of_class) - 1
        known = reground(shown, qualities)
        population = _population(shown, qualities) if wholes else None
        decided = accepted(known, settings)
        for tool in range(len(objects.classes)):
            others = np.delete(np.arange(len(objects.classes)), tool)
            held = np.zeros((len(others), len(known.qualities)))
            question = Question(known, settings, tool, others, held, further, population)
            said.append(confidences(question, draws, seed).accepted)
            crisp.append(decided[tool, others])
            true.append(right[tool, others])
    return Calibration(np.concatenate(said), np.concatenate(crisp), np.concatenate(true))


def _population(objects: Objects, qualities: Sequence[Qualities]) -> Population:
    return Population(objects.of_class.astype(np.int64), held_degrees(objects, qualities) / DEGREE)


def half(objects: Objects, seed: int) -> NDArray[np.int64]:
    """Return the rows of half of the objects of every class, rounded up, drawn without replacement."""
    chance = np.random.default_rng(seed)
    rows = [np.flatnonzero(objects.of_class == row) for row in range(len(objects.classes))]
    return np.concatenate([chance.choice(of, -(-len(of) // 2), replace=False) for of in rows])
