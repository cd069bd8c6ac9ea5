"""The families an expert may choose from, given by their quantiles, so that a copula can tie them together.

Parameters are what a person would say: a mean and a spread, not a shape. `low` and `high` cut a family off.
"""

import math
from dataclasses import dataclass, fields
from typing import Any, Final, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from ersatz.errors import InputError, nearest


@runtime_checkable
class Distribution(Protocol):
    """A continuous distribution between two limits, in the unit of its property."""

    low: float
    high: float

    def quantile(self, share: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the (n,) values below which the (n,) shares, in (0, 1), of the distribution lie."""


@dataclass(frozen=True, slots=True)
class Normal:
    """A normal distribution of `mean` and `sd`, cut off at `low` and `high` (its mean moves with the cut)."""

    mean: float
    sd: float
    low: float
    high: float

    def __post_init__(self) -> None:
        """Check the parameters."""
        _demand(self.sd > 0, "sd", self.sd, "above 0")
        _demand(self.low < self.high, "low", self.low, f"below high = {self.high:g}")
        _demand(self.low <= self.mean <= self.high, "mean", self.mean, f"in [{self.low:g}, {self.high:g}]")

    def quantile(self, share: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the values below which the shares lie."""
        return _truncated(share, self.mean, self.sd, self.low, self.high)


@dataclass(frozen=True, slots=True)
class LogNormal:
    """A lognormal distribution: half lies below `median`, two thirds within a factor of `spread` of it."""

    median: float
    spread: float
    low: float
    high: float

    def __post_init__(self) -> None:
        """Check the parameters."""
        _demand(self.spread > 1, "spread", self.spread, "a factor above 1")
        _demand(self.low >= 0, "low", self.low, "0 or more")
        _demand(self.low < self.high, "low", self.low, f"below high = {self.high:g}")
        _demand(self.median > 0, "median", self.median, "above 0")
        _demand(
            self.low <= self.median <= self.high, "median", self.median, f"in [{self.low:g}, {self.high:g}]"
        )

    def quantile(self, share: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the values below which the shares lie."""
        low = math.log(self.low) if self.low else -math.inf
        high = math.log(self.high)
        values = np.exp(_truncated(share, math.log(self.median), math.log(self.spread), low, high))
        return np.clip(values, self.low, self.high)


@dataclass(frozen=True, slots=True)
class Beta:
    """A beta distribution of `mean` and `sd` between `low` and `high`, for shares near an end."""

    mean: float
    sd: float
    low: float
    high: float

    def __post_init__(self) -> None:
        """Check the parameters."""
        _demand(math.isfinite(self.high - self.low), "high", self.high, "given, as low must be, for a beta")
        _demand(self.low < self.high, "low", self.low, f"below high = {self.high:g}")
        _demand(
            self.low < self.mean < self.high, "mean", self.mean, f"between {self.low:g} and {self.high:g}"
        )
        widest = math.sqrt((self.mean - self.low) * (self.high - self.mean))
        _demand(0 < self.sd < widest, "sd", self.sd, f"above 0 and below {widest:.3g}")

    def quantile(self, share: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the values below which the shares lie."""
        from scipy.special import betaincinv

        width = self.high - self.low
        mean, sd = (self.mean - self.low) / width, self.sd / width
        size = mean * (1 - mean) / sd**2 - 1
        values: NDArray[np.float64] = betaincinv(mean * size, (1 - mean) * size, share)
        return self.low + width * values


@dataclass(frozen=True, slots=True)
class Uniform:
    """Everything between `low` and `high` is as likely."""

    low: float
    high: float

    def __post_init__(self) -> None:
        """Check the parameters."""
        _demand(math.isfinite(self.high - self.low), "high", self.high, "given, as low must be")
        _demand(self.low < self.high, "low", self.low, f"below high = {self.high:g}")

    def quantile(self, share: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the values below which the shares lie."""
        return self.low + (self.high - self.low) * share


@dataclass(frozen=True, slots=True)
class Constant:
    """All objects have the same value; `low` and `high` only say where noise ends."""

    value: float
    low: float
    high: float

    def __post_init__(self) -> None:
        """Check the parameters."""
        _demand(self.low <= self.value <= self.high, "value", self.value, f"in [{self.low:g}, {self.high:g}]")

    def quantile(self, share: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the value, as often as there are shares."""
        return np.full_like(share, self.value)


FAMILIES: Final[dict[str, type]] = {
    "normal": Normal,
    "lognormal": LogNormal,
    "beta": Beta,
    "uniform": Uniform,
    "constant": Constant,
}
PURE: Final = ("spread",)
"""Parameters that are factors: a unit does not scale them."""


def parameters(family: str) -> tuple[str, ...]:
    """Return the names of a family's parameters.

    >>> parameters("normal")
    ('mean', 'sd', 'low', 'high')

    Raises
    ------
    InputError
        If there is no such family.
    """
    if family not in FAMILIES:
        near = nearest(family, FAMILIES)
        hint = f"did you mean {near[0]!r}?" if near else f"choose one of {', '.join(FAMILIES)}"
        raise InputError(f"unknown family {family!r}: {hint}")
    return tuple(field.name for field in fields(FAMILIES[family]))


def make(family: str, **values: float) -> Distribution:
    """Return the distribution of a family with its parameters.

    Raises
    ------
    InputError
        If a parameter is missing, unknown or impossible.
    """
    names = parameters(family)
    for name in values:
        if name not in names:
            raise InputError(f"{family} has no parameter {name!r}: it has {', '.join(names)}")
    for name in names:
        if name not in values:
            raise InputError(f"{family} lacks its parameter {name!r}: give it")
    made: Any = FAMILIES[family](**values)
    assert isinstance(made, Distribution)
    return made


def _demand(holds: bool, name: str, value: float, what: str) -> None:
    if not holds:
        raise InputError(f"{name} = {value:g} must be {what}")


def _truncated(
    share: NDArray[np.float64], mean: float, sd: float, low: float, high: float
) -> NDArray[np.float64]:
    """Return quantiles of a normal distribution between two limits around its mean."""
    from scipy.special import ndtr, ndtri

    bottom, top = ndtr((low - mean) / sd), ndtr((high - mean) / sd)
    values: NDArray[np.float64] = np.clip(mean + sd * ndtri(bottom + share * (top - bottom)), low, high)
    return values
