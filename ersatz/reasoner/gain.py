"""Gain: how much a measurement is expected to reduce the doubt about a decision.

Doubt is the entropy of the answer, in bits; the gain of a measurement is how much less of it is expected
once its outcome is known (mutual information of outcome and answer, Lindley 1956). Nothing is drawn again
for that: given an outcome, the draws of the question count by how probable each made it.
"""

from dataclasses import dataclass
from enum import StrEnum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ersatz.errors import InputError
from ersatz.reasoner.confidence import check_draws
from ersatz.reasoner.posterior import posterior
from ersatz.reasoner.relevance import in_use
from ersatz.reasoner.sampling import Question, samples

DRAWS: Final = 1000
"""More than an answer needs: gains are differences."""

MOST_PAIRS: Final = 100_000_000
"""Candidates times candidates times qualities."""

LEAST: Final = 1e-3
"""Bits; a smaller expected gain is not told from none."""


class Doubt(StrEnum):
    """What is in doubt.

    - accepted: of each candidate whether it stands in; their entropies are added up.
    - best: which candidate is the most similar.
    """

    ACCEPTED = "accepted"
    BEST = "best"


@dataclass(frozen=True, slots=True)
class Measurement:
    """Something that could be measured.

    Attributes
    ----------
    candidate : int or None
        Number of the candidate to measure (another object of its class, or the single object); None for
        the missing tool's class.
    property : str
    gain : float >= 0, bits
        How much less doubt is expected afterwards.
    """

    candidate: int | None
    property: str
    gain: float


@dataclass(frozen=True, slots=True)
class Outlook:
    """How sure a decision is, and what measurements would tell about it.

    Attributes
    ----------
    doubt : float >= 0, bits
        As things stand.
    accepted : tuple of n float
        Probability that each candidate stands in, as things stand.
    best : tuple of n float
        Probability that each is the most similar.
    measurements : tuple of Measurement
        Those whose expected gain is at least `LEAST`, the most telling first.
    """

    doubt: float
    accepted: tuple[float, ...]
    best: tuple[float, ...]
    measurements: tuple[Measurement, ...]


def outlook(question: Question, draws: int = DRAWS, seed: int = 0, about: Doubt = Doubt.ACCEPTED) -> Outlook:
    """Return how sure a decision is, and which measurements would tell most about it.

    Asked are the properties in use: of the tool and of candidate classes one more object each, of single
    objects what is not known of them.

    Parameters
    ----------
    question : Question
    draws, seed : int
    about : Doubt

    Raises
    ------
    InputError
        If draws is less than 1, the seed is negative, or there are too many candidates to compare all.
    """
    check_draws(draws, seed)
    n, q = question.held.shape
    if about is Doubt.BEST and n * n * q > MOST_PAIRS:
        raise InputError(f"{n} candidates are too many to ask which is best: name those that are at hand")
    tool = theirs = _Told.nothing()
    accepted, best = np.zeros(n), np.zeros(n)
    for sample in samples(question, draws, seed):
        accepted += sample.accepted.sum(axis=0)
        best += sample.best.sum(axis=0)
        yes = sample.accepted.astype(np.float64)
        answers = sample.best[:, None] if about is Doubt.BEST else np.stack([yes, 1 - yes], axis=-1)
        tool += _told(sample.tool[:, None], answers[:, None])
        own = answers[:, None] if about is Doubt.BEST else answers[:, :, None]
        theirs += _told(sample.candidates, own)
    return Outlook(
        float(_entropy(theirs.base / draws).sum()),
        tuple((accepted / draws).tolist()),
        tuple((best / draws).tolist()),
        _worth_asking(question, np.concatenate([tool.gain(draws), theirs.gain(draws)])),
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Told:
    """Sums over draws that tell how answers hang on the outcomes of measurements.

    Answers stand in g groups of k, in each of which they exclude each other.

    Attributes
    ----------
    weight, square : (o, q) arrays
        Of the probability of each outcome, and of its square.
    base : (o or 1, g, k) array
        Of the answers.
    joint : (o, q, g, k) array
        Of the products of both.
    """

    weight: NDArray[np.float64]
    square: NDArray[np.float64]
    base: NDArray[np.float64]
    joint: NDArray[np.float64]

    @classmethod
    def nothing(cls) -> "_Told":
        return cls(*(np.zeros(()) for _ in range(4)))

    def __add__(self, other: "_Told") -> "_Told":
        return _Told(
            self.weight + other.weight,
            self.square + other.square,
            self.base + other.base,
            self.joint + other.joint,
        )

    def gain(self, draws: int) -> NDArray[np.float64]:
        """Return (o, q) parts of the expected gain, in bits; it is their sum over a property.

        Finitely many draws seem to tell something even of what is unrelated; what they do in the mean
        (by the second-order term of the entropy) is taken off.
        """
        base = self.base / draws
        weight = np.where(self.weight > 0, self.weight, 1)
        after = _entropy(self.joint / weight[..., None, None]).sum(axis=(-2, -1))
        share = self.weight / draws
        free = np.maximum((base > 0).sum(axis=-1) - 1, 0).sum(axis=-1)[:, None]
        spread = np.maximum(self.square / draws - share**2, 0) / np.where(share > 0, share, 1)
        chance = free * spread / (2 * draws * np.log(2))
        found: NDArray[np.float64] = share * (_entropy(base).sum(axis=(-2, -1))[:, None] - after) - chance
        return found


def _told(outcomes: NDArray[np.float64], answers: NDArray[np.float64]) -> _Told:
    """Sum over some draws.

    Parameters
    ----------
    outcomes : (s, o, q) array
        How probable each quality is if o is measured.
    answers : (s, o or 1, g, k) array
    """
    o, groups = max(outcomes.shape[1], answers.shape[1]), answers.shape[2:]
    flat = answers.reshape(*answers.shape[:2], -1).transpose(1, 0, 2)
    joint = outcomes.transpose(1, 2, 0) @ flat
    return _Told(
        outcomes.sum(axis=0),
        (outcomes**2).sum(axis=0),
        answers.sum(axis=0),
        joint.reshape(o, -1, *groups),
    )


def _entropy(share: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return -p log2 p, 0 at 0."""
    held = np.clip(share, 0, 1)
    found: NDArray[np.float64] = -held * np.log2(np.where(held > 0, held, 1))
    return found


def _worth_asking(question: Question, gain: NDArray[np.float64]) -> tuple[Measurement, ...]:
    """Return the measurements whose gain can be told from none, the largest first; row 0 is the tool."""
    known = question.knowledge
    physical, functional = in_use(known, question.settings)
    classes = posterior(known.classes.only([question.tool]), known.qualities)
    gains = classes.of_property(gain)
    column = {quality.property: at for at, quality in enumerate(known.qualities)}
    used = {
        row: {known.qualities[at].property for at in np.flatnonzero(mask).tolist()}
        for row, mask in ((0, physical | functional), (1, physical))
    }
    found = [
        Measurement(row - 1 if row else None, name, float(gains[row, column[name]]))
        for row in range(len(gains))
        for name in sorted(used[min(row, 1)])
        if gains[row, column[name]] >= LEAST
    ]
    return tuple(sorted(found, key=lambda one: -one.gain))
