"""Tally: how often a decision goes with the outcome of a measurement, over many draws.

Sums from which follows how much of the decision's variance an outcome is expected to take away: nothing is
kept of a draw, and nothing is drawn again. Given an outcome, the draws count by how probable each made it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class Tally:
    """Sums over draws.

    Attributes
    ----------
    weight, square : (1 + n, q) arrays
        Of the probability of each outcome, and of its square; the tool first.
    decided, certain : (n,) arrays
        Of what is decided of each candidate, and of its square.
    tool : (q, n) array
        Of the tool's outcomes times the decisions.
    theirs : (n, q, n) array, or (n, q, 1) with the candidate's own decision only
        Of the candidates' outcomes times the decisions.
    """

    weight: NDArray[np.float64]
    square: NDArray[np.float64]
    decided: NDArray[np.float64]
    certain: NDArray[np.float64]
    tool: NDArray[np.float64]
    theirs: NDArray[np.float64]

    @classmethod
    def nothing(cls) -> "Tally":
        """Return the sums of no draws."""
        return cls(*(np.zeros(()) for _ in cls.__slots__))

    def __add__(self, other: "Tally") -> "Tally":
        """Return the sums of both."""
        return Tally(*(getattr(self, name) + getattr(other, name) for name in self.__slots__))

    def variance(self, draws: int) -> NDArray[np.float64]:
        """Return (n,): of each candidate's decision."""
        found: NDArray[np.float64] = self.certain / draws - (self.decided / draws) ** 2
        return found

    def taken(self, draws: int) -> NDArray[np.float64]:
        """Return (2, 1 + n, q): variance that each outcome takes away, and what chance shows of it.

        Summed over all decisions. Finitely many draws seem to tell something even of what is unrelated; what
        they do in the mean is taken off.
        """
        mean, variance = self.decided / draws, self.variance(draws)
        share, safe = self.weight / draws, np.where(self.weight > 0, self.weight, 1)
        noise = np.maximum(self.square / safe**2 - 1 / draws, 0)
        own = self.theirs.shape[-1] == 1
        means = mean[:, None] if own else np.broadcast_to(mean, (len(mean), len(mean)))
        seen = [  # row by row: all at once would take as much memory again
            ((joint / weight[:, None] - expected) ** 2).sum(axis=-1)
            for joint, weight, expected in zip([self.tool, *self.theirs], safe, [mean, *means], strict=True)
        ]
        doubt = np.append(variance.sum(), variance if own else np.full(len(mean), variance.sum()))
        chance = noise * doubt[:, None]
        return np.stack([share * (np.array(seen) - chance), share * chance])


def tally(told: NDArray[np.float64], decided: NDArray[np.float64], *, rivals: bool) -> Tally:
    """Sum over some draws.

    Parameters
    ----------
    told : (s, 1 + n, q) array
        How probable each outcome is; the tool first.
    decided : (s, n) array in [0, 1]
        What is decided of each candidate: whether it stands in, or its share of being the best.
    rivals : bool
        Whether what is known of one candidate bears on the decision about another.
    """
    theirs = told[:, 1:]
    joint = (
        theirs.transpose(1, 2, 0) @ decided if rivals else np.einsum("snq,sn->nq", theirs, decided)[..., None]
    )
    return Tally(
        told.sum(axis=0),
        np.einsum("snq,snq->nq", told, told),
        decided.sum(axis=0),
        (decided**2).sum(axis=0),
        told[:, 0].T @ decided,
        joint,
    )
