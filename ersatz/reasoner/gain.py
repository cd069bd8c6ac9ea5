"""Gain: how much a measurement is expected to tell about a decision.

A decision hangs on margins: of the leading candidate over each rival, or of a candidate over the tolerance.
The gain of a measurement is the share of a margin's variance that its outcome is expected to take away
(the first step of the knowledge gradient: Var E[margin | outcome] / Var margin), averaged over the margins
by how probable it is that their sign is wrong. Unlike the expected loss of entropy it does not vanish where
no single outcome can turn the decision.
"""

from dataclasses import dataclass
from enum import StrEnum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ersatz.errors import InputError
from ersatz.reasoner.confidence import check_draws
from ersatz.reasoner.margins import TINY, Sums, sums
from ersatz.reasoner.relevance import in_use
from ersatz.reasoner.sampling import Question, outcomes, samples

DRAWS: Final = 1000
"""More than an answer needs: gains are small."""

MOST_PAIRS: Final = 100_000_000
"""Candidates times candidates times qualities."""

CLEAR: Final = 3.0
"""So many times what finitely many draws show of unrelated things must a gain be to be told from none."""


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
    gain : float in [0, 1]
        Share of the margins' variance that it is expected to take away.
    clear : bool
        Whether something is in doubt, and the gain can be told from none.
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
    doubt : float >= 0, bits
        As things stand.
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
    told, best = Sums.nothing(), np.zeros(n)
    accepted = np.zeros(n)
    for sample in samples(question, draws, seed):
        accepted += sample.accepted.sum(axis=0)
        best += sample.best.sum(axis=0)
        told += sums(outcomes(question, sample), sample.similarity, rivals=about is Doubt.BEST)
    accepted, best = accepted / draws, best / draws
    doubt = float(_entropy(best if about is Doubt.BEST else np.stack([accepted, 1 - accepted])).sum())
    taken = (
        told.leads(draws) if about is Doubt.BEST else told.passes(draws, float(question.settings.tolerance))
    )
    measurements = _measurements(question, taken, doubtful=doubt > 0)
    return Outlook(doubt, tuple(accepted.tolist()), tuple(best.tolist()), measurements)


def _entropy(share: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return -p log2 p, 0 at 0."""
    held = np.clip(share, 0, 1)
    found: NDArray[np.float64] = -held * np.log2(np.where(held > 0, held, 1))
    return found


def _measurements(
    question: Question, taken: NDArray[np.float64], *, doubtful: bool
) -> tuple[Measurement, ...]:
    """Return the measurements, the most telling first; row 0 is the tool.

    Parameters
    ----------
    question : Question
    taken : (2, 1 + n, q) array
        Gains, and what chance shows of them, by outcome.
    doubtful : bool
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
                gain, chance = taken[:, row, at].sum(axis=-1).tolist()
                clear = doubtful and gain > max(CLEAR * chance, TINY)
                found.append(Measurement(row - 1 if row else None, name, max(gain, 0.0), clear))
    return tuple(sorted(found, key=lambda one: -one.gain))
