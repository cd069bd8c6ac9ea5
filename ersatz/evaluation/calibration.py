"""Calibration: whether answers said to be so probable are that often true.

Two ways to know what is true. All objects: half of the objects of every class are hidden, the other half
answers with confidence, foreseeing as many more, and all of them together tell what is true. The long run:
the objects are taken for the whole world, as many of each class are drawn from it with replacement and
answer, foreseeing endlessly many more, and the world tells what is true. The qualities are those of all
objects throughout: what is in doubt is how often they are held.

Answers are not independent: what is true of a pair of classes is the same in every split, and all answers
of a split come from the same objects. Errors are therefore clustered by split and by tool (Cameron, Gelbach
and Miller 2011), and many splits do not make up for few tools.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ersatz.evaluation.regrounding import Objects, accepted, held_degrees, reground
from ersatz.grounding.conceptualization import DEGREE
from ersatz.grounding.subcategorization import Qualities
from ersatz.reasoner.confidence import DRAWS, confidences
from ersatz.reasoner.population import Population
from ersatz.reasoner.relevance import USUAL, ReasonerSettings
from ersatz.reasoner.sampling import Question

Z: Final = 1.96
"""Two-sided normal quantile of 95 %."""


@dataclass(frozen=True, slots=True)
class Bin:
    """Answers said with about the same probability.

    Attributes
    ----------
    said, true : float in [0, 1]
        Their mean probability, and the share that is true.
    low, high : float in [0, 1]
        95 % interval of that share, with errors clustered by split and tool, and never narrower than
        Wilson's (1927) of as many independent answers as there are.
    count : int
    """

    said: float
    true: float
    low: float
    high: float
    count: int

    @property
    def off(self) -> bool:
        """Whether what was said lies outside of the interval."""
        return not self.low <= self.said <= self.high


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """What was said from some of the objects, and what is true.

    Attributes
    ----------
    said : (s, t, n) float64 array
        Probability that a candidate stands in: of each split, tool and candidate.
    crisp : (s, t, n) bool array
        Whether the objects of the split accept it.
    true : (s, t, n) bool array
        Whether it is true.
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
        """The same of the decisions 0 and 1: the share that is not true."""
        return float((self.crisp != self.true).mean())

    @property
    def error(self) -> float:
        """Expected calibration error: how far said and true are apart in the mean over ten bins."""
        count, said, true, *_ = self._binned(10)
        return float(np.abs(said - true) @ count / self.said.size)

    @property
    def error_by_chance(self) -> float:
        """The error to expect of a perfect forecaster, with as many splits and tools and such answers.

        The bins' differences are then normal around 0, with their standard errors.
        """
        count, _, _, spread, _ = self._binned(10)
        return float((2 / np.pi) ** 0.5 * spread @ count / self.said.size)

    def bins(self, number: int = 10) -> tuple[Bin, ...]:
        """Return the answers in bins of equal width by what was said; empty ones are left out."""
        found = []
        for count, said, true, spread, independent in self._binned(number).T.tolist():
            if count:
                low, high = wilson(true, independent)
                ends = max(0.0, min(low, true - Z * spread)), min(1.0, max(high, true + Z * spread))
                found.append(Bin(said, true, *ends, int(count)))
        return tuple(found)

    def to_json(self) -> dict[str, Any]:
        """Return it in JSON's types."""
        rows = [(one.said, one.true, one.low, one.high, one.count) for one in self.bins()]
        return {
            "answers": self.said.size,
            "brier": round(self.brier, 6),
            "brier_crisp": round(self.brier_crisp, 6),
            "calibration_error": round(self.error, 6),
            "calibration_error_by_chance": round(self.error_by_chance, 6),
            "bins": [[round(value, 6) for value in row] for row in rows],
        }

    def _binned(self, number: int) -> NDArray[np.float64]:
        """Return (5, number): answers, means of said and of true, standard error, independent answers.

        Where a pair has the same truth in every split, its answers are one, weighed unequally (Kish 1965).
        """
        at = np.minimum((self.said * number).astype(int), number - 1)
        inside = (at[..., None] == np.arange(number)).astype(np.float64)
        values = np.stack([np.ones_like(self.said), self.said, self.true])
        sums = np.einsum("kstn,stnb->kstb", values, inside)  # of each split, tool and bin
        count, said, true = sums.sum(axis=(1, 2))
        many = np.maximum(count, 1)
        strays = sums[2] - sums[1] - sums[0] * ((true - said) / many)
        splits, tools = (_clusters(strays, by) for by in (0, 1))
        cells = (strays**2).sum(axis=(0, 1))
        variance = np.maximum(splits + tools - cells, cells)  # as the difference may be below 0
        same = bool((self.true == self.true[0]).all())
        squares = (inside.sum(axis=0) if same else inside).reshape(-1, number) ** 2
        independent = count**2 / np.maximum(squares.sum(axis=0), 1)
        return np.stack([count, said / many, true / many, variance**0.5 / many, independent])


def _clusters(strays: NDArray[np.float64], by: int) -> NDArray[np.float64]:
    """Return the variance of sums of (s, t, bins) strays if those of a split (0) or tool (1) go together."""
    number = strays.shape[by]
    variance: NDArray[np.float64] = (strays.sum(axis=1 - by) ** 2).sum(axis=0) * number / max(number - 1, 1)
    return variance


def wilson(share: float, number: float) -> tuple[float, float]:
    """Return the 95 % interval of a share of so many independent answers (Wilson 1927)."""
    middle = (share + Z * Z / 2 / number) / (1 + Z * Z / number)
    reach = Z / (1 + Z * Z / number) * (share * (1 - share) / number + Z * Z / 4 / number / number) ** 0.5
    return min(share, max(0.0, middle - reach)), max(share, min(1.0, middle + reach))


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
    classes = range(len(objects.classes))
    said, crisp, true = [], [], []
    for seed in range(splits):
        endless = truth is Truth.LONG_RUN
        shown = objects.resampled(seed) if endless else objects.take(half(objects, seed))
        further = None if endless else len(objects.of_class) / len(shown.of_class) - 1
        known = reground(shown, qualities)
        population = _population(shown, qualities) if wholes else None
        decided = accepted(known, settings)
        for tool in classes:
            others = np.delete(classes, tool)
            held = np.zeros((len(others), len(known.qualities)))
            question = Question(known, settings, tool, others, held, further, population)
            said.append(confidences(question, draws, seed).accepted)
            crisp.append(decided[tool, others])
            true.append(right[tool, others])
    shape = splits, len(classes), len(classes) - 1
    return Calibration(*(np.reshape(one, shape) for one in (said, crisp, true)))


def _population(objects: Objects, qualities: Sequence[Qualities]) -> Population:
    return Population(objects.of_class.astype(np.int64), held_degrees(objects, qualities) / DEGREE)


def half(objects: Objects, seed: int) -> NDArray[np.int64]:
    """Return the rows of half of the objects of every class, rounded up, drawn without replacement."""
    chance = np.random.default_rng(seed)
    rows = [np.flatnonzero(objects.of_class == row) for row in range(len(objects.classes))]
    return np.concatenate([chance.choice(of, -(-len(of) // 2), replace=False) for of in rows])
