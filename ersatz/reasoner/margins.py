"""Margins: what the outcome of a measurement would tell of how far one similarity lies above another.

Sums over draws, from which the expected loss of each margin's variance follows: nothing is kept of a draw,
and nothing is drawn again. Given an outcome, the draws count by how probable each made it.
"""

from dataclasses import dataclass
from math import erfc, sqrt
from typing import Final

import numpy as np
from numpy.typing import NDArray

TINY: Final = 1e-12
"""A smaller variance or share is none."""


@dataclass(frozen=True, slots=True, eq=False)
class Sums:
    """Sums over draws that tell how similarities hang on the outcomes of measurements.

    Attributes
    ----------
    weight, square : (1 + n, q) arrays
        Of the probability of each outcome, and of its square; the tool first.
    similarity : (n,) array
    product : (n, n) array, or (n,) of squares only
        Of two similarities.
    tool : (q, n) array
        Of the tool's outcomes times the similarities.
    theirs : (n, q, n) array, or (n, q) with the candidate's own similarity only
        Of the candidates' outcomes times the similarities.
    """

    weight: NDArray[np.float64]
    square: NDArray[np.float64]
    similarity: NDArray[np.float64]
    product: NDArray[np.float64]
    tool: NDArray[np.float64]
    theirs: NDArray[np.float64]

    @classmethod
    def nothing(cls) -> "Sums":
        """Return the sums of no draws."""
        return cls(*(np.zeros(()) for _ in range(6)))

    def __add__(self, other: "Sums") -> "Sums":
        """Return the sums of both."""
        return Sums(*(getattr(self, name) + getattr(other, name) for name in self.__slots__))

    def leads(self, draws: int) -> NDArray[np.float64]:
        """Return (2, 1 + n, q): gains, and what chance shows of them, for the leader's margins."""
        lead = int(self.similarity.argmax())
        margin = (self.similarity[lead] - self.similarity) / draws
        squares = np.diagonal(self.product)
        variance = (squares[lead] + squares - 2 * self.product[lead]) / draws - margin**2
        counts = _counts(margin, variance) * (np.arange(len(margin)) != lead)
        joint = np.concatenate([self.tool[None], self.theirs])
        taken = _taken(
            self.weight[..., None],
            self.square[..., None],
            joint[..., [lead]] - joint,
            margin,
            variance,
            draws,
        )
        return taken @ _shares(counts)

    def passes(self, draws: int, tolerance: float) -> NDArray[np.float64]:
        """Return the same for the margins of all candidates over the tolerance."""
        mean = self.similarity / draws
        variance = self.product / draws - mean**2
        counts = _shares(_counts(mean - tolerance, variance))
        w, s = self.weight, self.square
        tool = _taken(w[0][:, None], s[0][:, None], self.tool, mean, variance, draws) @ counts
        own = (w[1:], s[1:], self.theirs, mean[:, None], variance[:, None], draws)
        return np.concatenate([tool[:, None], _taken(*own) * counts[:, None]], axis=1)


def sums(told: NDArray[np.float64], similarity: NDArray[np.float64], *, rivals: bool) -> Sums:
    """Sum over some draws.

    Parameters
    ----------
    told : (s, 1 + n, q) array
        How probable each outcome is; the tool first.
    similarity : (s, n) array
    rivals : bool
        Whether candidates are compared with one another.
    """
    theirs = told[:, 1:]
    if rivals:
        product = similarity.T @ similarity
        joint = theirs.transpose(1, 2, 0) @ similarity
    else:
        product = (similarity**2).sum(axis=0)
        joint = np.einsum("snq,sn->nq", theirs, similarity)
    return Sums(
        told.sum(axis=0),
        np.einsum("snq,snq->nq", told, told),
        similarity.sum(axis=0),
        product,
        told[:, 0].T @ similarity,
        joint,
    )


def _taken(
    weight: NDArray[np.float64],
    square: NDArray[np.float64],
    joint: NDArray[np.float64],
    margin: NDArray[np.float64],
    variance: NDArray[np.float64],
    draws: int,
) -> NDArray[np.float64]:
    """Return the share of a margin's variance that outcomes take away, and what chance shows of it.

    Finitely many draws seem to tell something even of what is unrelated; what they do in the mean is taken
    off. All arguments broadcast.
    """
    share, safe = weight / draws, np.where(weight > 0, weight, 1)
    below = np.where(variance > TINY, variance, 1)
    seen = share * (joint / safe - margin) ** 2 / below
    chance = share * np.maximum(square / safe**2 - 1 / draws, 0)
    open_ = (weight > 0) & (variance > TINY)
    return np.stack(np.broadcast_arrays((seen - chance) * open_, chance * open_))


def _counts(margin: NDArray[np.float64], variance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how probable it is that each margin's sign is wrong, as if it were normal."""
    spread = np.sqrt(np.maximum(variance, TINY))
    wrong: NDArray[np.float64] = np.array([erfc(z / sqrt(2)) / 2 for z in np.abs(margin) / spread])
    return wrong * (variance > TINY)


def _shares(counts: NDArray[np.float64]) -> NDArray[np.float64]:
    whole = counts.sum()
    return counts / whole if whole > 0 else counts
