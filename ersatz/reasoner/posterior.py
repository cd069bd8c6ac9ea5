"""Posterior: how sure a degree of membership is, given how often it was observed.

An object of a class holds one quality of a property (or shares of several that add up to 1), so the
degrees of a property in a class share a Dirichlet posterior: the counts plus a prior. Each degree by itself
is a Beta.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ersatz.grounding.fuzzy import DEGREE
from ersatz.reasoner.representative import Memberships, QualityTerm

PRIOR: Final = 1.0
"""Weight of the prior in observed units, spread evenly over the qualities of a property (Perks 1947).

Evenly, so that what is said of one class does not hang on which others are known; one unit, so that a
single observation outweighs it whatever the number of qualities, and ten leave little of it.
"""

_STEPS: Final = 400
"""Enough terms of the continued fraction for counts in the tens of thousands."""

_SETTLED: Final = 1e-14


@dataclass(frozen=True, slots=True, eq=False)
class Posterior:
    """Dirichlet posteriors of the degrees of several concepts, one a concept and property.

    Attributes
    ----------
    alpha : (n, q) float64 array, in observed units, > 0
        Observed degrees and the prior's share.
    prior : (q,) float64 array
        The prior's share of it.
    property : (q,) int64 array
        Number of each quality's property; qualities of one property stand together.
    """

    alpha: NDArray[np.float64]
    prior: NDArray[np.float64]
    property: NDArray[np.int64]

    def of_property(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (..., q) sums over the qualities of the same property."""
        return property_sums(values, self.property)

    def mean(self) -> NDArray[np.float64]:
        """Return (n, q) expected degrees."""
        return self.alpha / self.of_property(self.alpha)

    def at_least(self, theta: float) -> NDArray[np.float64]:
        """Return (n, q): P(m >= theta), exact."""
        return beta_above(self.alpha, self.of_property(self.alpha) - self.alpha, theta)

    def draw(self, draws: int, chance: "np.random.Generator") -> NDArray[np.float64]:
        """Return (draws, n, q) degrees; those of a property add up to 1.

        One call for many draws gives the same numbers as several for a few.
        """
        drawn = chance.standard_gamma(self.alpha, (draws, *self.alpha.shape))
        return drawn / np.maximum(self.of_property(drawn), np.finfo(np.float64).tiny)

    def foresee(
        self, draws: int, chance: "np.random.Generator", further: NDArray[np.int64]
    ) -> NDArray[np.float64]:
        """Return (draws, n, q) degrees that would be observed with more objects, those seen among them.

        Parameters
        ----------
        draws : int
        chance : Generator
        further : (n, q) int64 array, >= 0
            How many objects more have a value of the quality's property. Without any, nothing is drawn.
        """
        seen = self.alpha - self.prior
        total = self.of_property(seen)
        drawn = np.zeros((draws, *seen.shape))
        if further.any():
            drawn = self.draw(draws, chance)
            for number in range(int(self.property[-1]) + 1):
                of = self.property == number
                drawn[..., of] = chance.multinomial(further[:, of][:, 0], drawn[..., of])
        return (seen + drawn) / np.maximum(total + further, 1)


def posterior(memberships: Memberships, qualities: Sequence[QualityTerm], prior: float = PRIOR) -> Posterior:
    """Return the posterior of all degrees of some concepts; of a property never observed, the prior.

    Parameters
    ----------
    memberships : Memberships
    qualities : sequence of q QualityTerm
    prior : float > 0, in observed units
    """
    number = property_numbers(qualities)
    each = prior / np.bincount(number)[number]
    return Posterior(memberships.counts / DEGREE + each, each, number)


def property_numbers(qualities: Sequence[QualityTerm]) -> NDArray[np.int64]:
    """Return (q,): the number of each quality's property; qualities of one property stand together."""
    names = [quality.property for quality in qualities]
    number = {name: at for at, name in enumerate(dict.fromkeys(names))}
    return np.array([number[name] for name in names], dtype=np.int64)


def property_sums(values: NDArray[np.float64], number: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return (..., q) sums over the qualities of the same property."""
    starts = np.flatnonzero(np.diff(number, prepend=-1))
    sums: NDArray[np.float64] = np.add.reduceat(values, starts, axis=-1)[..., number]
    return sums


def beta_above(a: NDArray[np.float64], b: NDArray[np.float64], x: float) -> NDArray[np.float64]:
    """Return P(m >= x) of Beta(a, b): the regularised incomplete beta I_{1-x}(b, a).

    By the continued fraction of DLMF 8.17.22 (modified Lentz), on the side where it converges quickly.

    Parameters
    ----------
    a, b : arrays of one shape, a > 0, b >= 0
        b = 0 stands for a degree that is surely 1.
    x : float in [0, 1]
    """
    if x <= 0 or x >= 1:
        return np.where((x <= 0) | (b == 0), 1.0, 0.0)
    safe = np.maximum(b, np.finfo(np.float64).tiny)
    upper = x > (a + 1) / (a + safe + 2)
    p, q, at = np.where(upper, safe, a), np.where(upper, a, safe), np.where(upper, 1 - x, x)
    front = np.exp(_log_gamma(p + q) - _log_gamma(p) - _log_gamma(q) + p * np.log(at) + q * np.log1p(-at))
    tail = np.clip(front / p * _fraction(p, q, at), 0.0, 1.0)
    return np.where(b == 0, 1.0, np.where(upper, tail, 1 - tail))


def _fraction(a: NDArray[np.float64], b: NDArray[np.float64], x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the continued fraction of the incomplete beta."""
    tiny = 1e-300
    c = np.ones_like(a)
    d = 1 / _off_zero(1 - (a + b) * x / (a + 1), tiny)
    value = d.copy()
    for m in range(1, _STEPS):
        even = m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m))
        odd = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1))
        for step in (even, odd):
            d = 1 / _off_zero(1 + step * d, tiny)
            c = _off_zero(1 + step / c, tiny)
            value = value * d * c
        if np.all(np.abs(d * c - 1) < _SETTLED):
            break
    return value


def _off_zero(value: NDArray[np.float64], tiny: float) -> NDArray[np.float64]:
    return np.where(np.abs(value) < tiny, tiny, value)


def _log_gamma(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return ln Gamma(x), x > 0: Stirling's series (DLMF 5.11.1) after eight steps of the recurrence."""
    small = np.log(x)
    for step in range(1, 8):
        small = small + np.log(x + step)
    z = x + 8
    series = 1 / (12 * z) - 1 / (360 * z**3) + 1 / (1260 * z**5) - 1 / (1680 * z**7) + 1 / (1188 * z**9)
    found: NDArray[np.float64] = (z - 0.5) * np.log(z) - z + 0.5 * np.log(2 * np.pi) + series - small
    return found
