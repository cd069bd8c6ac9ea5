"""Calibration: whether answers said to be so probable are that often confirmed by more objects.

Half of the objects of every class are hidden, the other half answers with confidence, and all of them
together tell what is true. The qualities are those of all objects throughout: what is in doubt is how
often they are held.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ersatz.evaluation.regrounding import Objects, accepted, reground
from ersatz.grounding.subcategorization import Qualities
from ersatz.reasoner.confidence import DRAWS, confidences
from ersatz.reasoner.relevance import ReasonerSettings
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


def calibrate(
    objects: Objects,
    qualities: Sequence[Qualities],
    settings: ReasonerSettings | None = None,
    splits: int = 20,
    draws: int = DRAWS,
) -> Calibration:
    """Ask for every tool with half of the objects, many times, and compare with all of them."""
    settings = settings or ReasonerSettings()
    truth = accepted(reground(objects, qualities), settings)
    said, crisp, true = [], [], []
    for seed in range(splits):
        shown = half(objects, seed)
        further = len(objects.of_class) / len(shown) - 1
        known = reground(objects.take(shown), qualities)
        decided = accepted(known, settings)
        for tool in range(len(objects.classes)):
            others = np.delete(np.arange(len(objects.classes)), tool)
            held = np.zeros((len(others), len(known.qualities)))
            question = Question(known, settings, tool, others, held, further)
            said.append(confidences(question, draws, seed).accepted)
            crisp.append(decided[tool, others])
            true.append(truth[tool, others])
    return Calibration(np.concatenate(said), np.concatenate(crisp), np.concatenate(true))


def half(objects: Objects, seed: int) -> NDArray[np.int64]:
    """Return the rows of half of the objects of every class, rounded up, drawn without replacement."""
    chance = np.random.default_rng(seed)
    rows = [np.flatnonzero(objects.of_class == row) for row in range(len(objects.classes))]
    return np.concatenate([chance.choice(of, -(-len(of) // 2), replace=False) for of in rows])
