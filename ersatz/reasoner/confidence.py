"""Confidence: how sure an answer is, with the degrees it rests on known from a few objects only."""

from dataclasses import dataclass
from decimal import ROUND_HALF_EVEN, Decimal
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ersatz.errors import InputError
from ersatz.knowledge.models import Chances, Drawing
from ersatz.reasoner import population, posterior
from ersatz.reasoner.sampling import Question, samples

DRAWS: Final = 200
"""A probability of one half is then known to within 0.035 (one standard error)."""

MASS: Final = 0.9
"""Of the credible intervals."""

_PLACES: Final = Decimal("0.000001")

MOST_DRAWS: Final = 1_000_000
"""A probability is then known to within 0.0005: more tell nothing that degrees of a few objects can bear."""

MOST_NUMBERS: Final = 100_000_000
"""Draws times candidates, whose similarities are kept for the intervals: 2 GB for a moment."""

SURE: Final = 0.95
PROBABLE: Final = 0.75
"""What is called sure and probable, from this probability on."""


@dataclass(frozen=True, slots=True)
class Confidence:
    """How sure it is what a candidate is.

    Attributes
    ----------
    accepted : float in [0, 1]
        Probability that it stands in: that the rule, with endlessly many more objects, accepts it.
    best : float in [0, 1]
        Probability that it is the most similar of the candidates; they add up to 1, ties shared.
    low, high : float in [0, 1]
        Its similarity lies between them with probability `MASS`.
    draws, seed : int
        How the figures were made.
    """

    accepted: float
    best: float
    low: float
    high: float
    draws: int
    seed: int

    def words(self) -> str:
        """Return it in words, such as "probably: accepted in 164 of 200 draws"."""
        more = max(self.accepted, 1 - self.accepted)
        word = "almost surely" if more >= SURE else "probably" if more >= PROBABLE else "uncertain"
        negated = " not" if more >= PROBABLE and self.accepted < more else ""
        return f"{word}{negated}: accepted in {round(self.accepted * self.draws)} of {self.draws} draws"

    def sentence(self) -> str:
        """Return all of it in words."""
        words = self.words()
        return (
            f"{words[0].upper()}{words[1:]}, most similar in {self.best:.0%}; "
            f"its similarity lies between {self.low:.2f} and {self.high:.2f} ({MASS:.0%})."
        )

    def chances(self) -> Chances:
        """Return it as it is written down, rounded half-even to 6 places."""
        figures = (self.accepted, self.best, self.low, self.high)
        return Chances(*(Decimal(repr(one)).quantize(_PLACES, ROUND_HALF_EVEN) for one in figures))

    def to_json(self) -> dict[str, Any]:
        """Return it in JSON's types."""
        return {
            "accepted": round(self.accepted, 6),
            "best": round(self.best, 6),
            "similarity": [round(self.low, 6), round(self.high, 6)],
            "mass": MASS,
            "draws": self.draws,
            "seed": self.seed,
        }


@dataclass(frozen=True, slots=True, eq=False)
class Confidences:
    """The same of all candidates, in the order of the question.

    Attributes
    ----------
    accepted, best, low, high : (n,) float64 arrays
    expected : (n,) float64 array
        Mean similarity over the draws.
    draws, seed : int
    prior : float, in objects
        What the prior weighs beside them.
    """

    accepted: NDArray[np.float64]
    best: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    expected: NDArray[np.float64]
    draws: int
    seed: int
    prior: float

    def of(self, at: int) -> Confidence:
        """Return the confidence of one candidate."""
        accepted, best = float(self.accepted[at]), float(self.best[at])
        return Confidence(accepted, best, float(self.low[at]), float(self.high[at]), self.draws, self.seed)

    def drawing(self) -> Drawing:
        """Return how the figures were made, as it is written down."""
        return Drawing(self.draws, Decimal(repr(MASS)), Decimal(repr(self.prior)), self.seed)


def confidences(question: Question, draws: int = DRAWS, seed: int = 0) -> Confidences:
    """Answer a question with degrees drawn from their posteriors, and count the answers.

    Parameters
    ----------
    question : Question
    draws : int
        Each is the whole answer: what is typical, what is relevant, how similar.
    seed : int
        The same seed gives the same figures.

    Raises
    ------
    InputError
        If draws is less than 1 or too many, or the seed is negative.
    """
    check_draws(draws, seed)
    if draws * len(question.rows) > MOST_NUMBERS:
        raise InputError(
            f"draws is {draws}: of {len(question.rows)} candidates, give at most "
            f"{MOST_NUMBERS // len(question.rows)}"
        )
    similarity = np.empty((draws, len(question.rows)), dtype=np.float32)
    accepted, best, at = np.zeros(len(question.rows)), np.zeros(len(question.rows)), 0
    for sample in samples(question, draws, seed):
        similarity[at : at + len(sample.similarity)] = sample.similarity
        at += len(sample.similarity)
        accepted += sample.accepted.sum(axis=0)
        best += sample.best.sum(axis=0)
    tails = (1 - MASS) / 2, (1 + MASS) / 2
    low, high = np.quantile(similarity.astype(np.float64), tails, axis=0)
    expected = similarity.mean(axis=0, dtype=np.float64)
    prior = posterior.PRIOR if question.population is None else population.PRIOR
    return Confidences(accepted / draws, best / draws, low, high, expected, draws, seed, prior)


def check_draws(draws: int, seed: int) -> None:
    """Refuse numbers that make no sense."""
    if not 1 <= draws <= MOST_DRAWS:
        raise InputError(f"draws is {draws}: give 1 to {MOST_DRAWS}")
    if seed < 0:
        raise InputError(f"seed is {seed}: give 0 or more")
