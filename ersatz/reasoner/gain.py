"""Gain: how much a measurement is expected to tell about a decision.

A decision is 0 or 1 for each candidate: whether it stands in, or whether it is the most similar. Its doubt
is its variance, P (1 - P), the error to be expected of saying P (Brier 1950), summed over the candidates.
The gain of a measurement is the share of the doubt that its outcome is expected to take away,
Var E[decision | outcome] / Var decision. Unlike the expected number of wrong decisions it does not vanish
where no single outcome can turn the decision.
"""

from dataclasses import dataclass
from enum import StrEnum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ersatz.errors import InputError
from ersatz.reasoner.confidence import check_draws
from ersatz.reasoner.relevance import in_use
from ersatz.reasoner.sampling import Question, outcomes, samples
from ersatz.reasoner.tally import Tally, tally

DRAWS: Final = 1000
"""More than an answer needs: gains are small."""

MOST_PAIRS: Final = 100_000_000
"""Candidates times candidates times qualities."""

CLEAR: Final = 3.0
"""So many times what finitely many draws show of unrelated things must a gain be to be told from none."""

TINY: Final = 1e-12
"""Less is none."""


class Doubt(StrEnum):
    """What is in doubt.

    - accepted: of each candidate whether it stands in.
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
    gain : float in [0, 1]
        Share of the doubt that it is expected to take away.
    clear : bool
        Whether the gain can be told from none.
    """

    candidate: int | None
    property: str
    gain: float
    clear: bool


@dataclass(frozen=True, slots=True)
class Outlook:
    """How sure a decision is, and what measurements would tell about it.

    Attributes
    ----------
    doubt : float >= 0
        As things stand: P (1 - P), summed over the candidates.
    accepted : tuple of n float
        Probability that each candidate stands in, as things stand.
    best : tuple of n float
        Probability that each is the most similar.
    measurements : tuple of Measurement
        Of all properties in use, the most telling first.
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
    told, accepted, best = Tally.nothing(), np.zeros(n), np.zeros(n)
    rivals = about is Doubt.BEST
    for sample in samples(question, draws, seed):
        shares = sample.best
        accepted += sample.accepted.sum(axis=0)
        best += shares.sum(axis=0)
        decided = shares if rivals else sample.accepted.astype(np.float64)
        told += tally(outcomes(question, sample), decided, rivals=rivals)
    doubt = float(told.variance(draws).sum())
    return Outlook(
        doubt,
        tuple((accepted / draws).tolist()),
        tuple((best / draws).tolist()),
        _measurements(question, told.taken(draws), doubt),
    )


def _measurements(question: Question, taken: NDArray[np.float64], doubt: float) -> tuple[Measurement, ...]:
    """Return the measurements, the most telling first; row 0 is the tool.

    Parameters
    ----------
    question : Question
    taken : (2, 1 + n, q) array
        Variance taken away, and what chance shows of it, by outcome.
    doubt : float
    """
    known = question.knowledge
    physical, functional = in_use(known, question.settings)
    columns: dict[str, list[int]] = {}
    for column, quality in enumerate(known.qualities):
        columns.setdefault(quality.property, []).append(column)
    found = []
    for row in range(taken.shape[1]):
        used = physical | functional if row == 0 else physical
        for name, at in columns.items():
            if used[at].any():
                gain, chance = (taken[:, row, at].sum(axis=-1) / max(doubt, TINY)).tolist()
                clear = doubt > TINY and gain > max(CLEAR * chance, TINY)
                found.append(Measurement(row - 1 if row else None, name, max(gain, 0.0), clear))
    return tuple(sorted(found, key=lambda one: -one.gain))
