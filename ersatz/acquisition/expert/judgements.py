"""Expert knowledge: a distribution of each property per object class, and objects drawn from it.

Paper, Knowledge Acquisition: "human-generated properties". An object's value is one draw from its class's
distribution; scans of it may differ from that value by a small noise. Draws of one class and property depend
on the seed and their two names, so that a class added to the file changes no other.
"""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ersatz.acquisition.expert.distributions import Distribution
from ersatz.errors import InputError
from ersatz.measurements import Block, Origin, Property, Source

Correlations: TypeAlias = tuple[tuple[str, str, float], ...]
"""Two scalars ("weight", "size.length") and the correlation of their normal scores, in (-1, 1)."""

DESCENDING: Final = ("size",)
"""Vectors whose components are ordered by definition, largest first."""


EXTENTS: Final = {"footprint": ("m2", 2, 1.0), "box": ("l", 3, 1000.0)}
"""What a share may be of: the unit it gives, how many of the extents it multiplies, and units per m^n."""


@dataclass(frozen=True, slots=True)
class Noise:
    """How scans of one object scatter around its value: a standard deviation, or a share of the value."""

    amount: float = 0.0
    relative: bool = False


@dataclass(frozen=True, slots=True)
class Silhouette:
    """Blockage that follows from the drawn weight and size: mass times mean silhouette area.

    The mean silhouette of a convex body over all directions is a quarter of its surface (Cauchy); of a box
    it is (lw + lh + wh) / 2.

    Attributes
    ----------
    fill : float in (0, 1]
        The body's mean silhouette over its bounding box's: box 1, upright cylinder 0.79, ball 0.52.
    """

    fill: float

    low: float = 0.0
    high: float = np.inf


@dataclass(frozen=True, slots=True)
class Judgement:
    """What an expert says of one property of one class.

    Attributes
    ----------
    property : Property
    distributions : tuple of Distribution, or Silhouette
        One a component, in the property's unit.
    noise : Noise
    reason : str
        The evidence.
    of : str
        "" or a key of EXTENTS: what the distribution, then of a share, is multiplied by.
    """

    property: Property
    distributions: tuple[Distribution, ...] | Silhouette
    noise: Noise
    reason: str
    of: str = ""

    def scalars(self) -> tuple[str, ...]:
        """Return the names of the numbers drawn: "weight", or "size.length" and so on, or none."""
        if isinstance(self.distributions, Silhouette):
            return ()
        return scalars(self.property)


@dataclass(frozen=True, slots=True)
class ExpertClass:
    """What an expert says of one object class.

    Attributes
    ----------
    name : str
    instances : tuple of str
        Names of the objects to draw.
    scans : int
        Observations of each, of properties with noise.
    judgements : tuple of Judgement
    correlations : Correlations
        Of this class, file-wide ones included.
    note : str
    """

    name: str
    instances: tuple[str, ...]
    scans: int
    judgements: tuple[Judgement, ...]
    correlations: Correlations = ()
    note: str = ""

    def draw(self, seed: int) -> dict[str, NDArray[np.float64]]:
        """Return property name -> (instances, components) values in its unit, one draw an instance."""
        shares = self._shares(seed)
        drawn: dict[str, NDArray[np.float64]] = {}
        for judgement in self.judgements:
            if not isinstance(judgement.distributions, Silhouette):
                parts = zip(judgement.scalars(), judgement.distributions, strict=True)
                values = np.stack([d.quantile(shares[scalar]) for scalar, d in parts], axis=1)
                drawn[judgement.property.name] = _ordered(judgement.property, values)
        for judgement in self.judgements:
            if isinstance(judgement.distributions, Silhouette):
                length, width, height = drawn["size"].T
                area = judgement.distributions.fill * (length * width + length * height + width * height) / 2
                drawn[judgement.property.name] = drawn["weight"] * area[:, None]
            elif judgement.of:
                _, extents, per = EXTENTS[judgement.of]
                drawn[judgement.property.name] *= per * drawn["size"][:, :extents].prod(axis=1, keepdims=True)
        return drawn

    def _shares(self, seed: int) -> dict[str, NDArray[np.float64]]:
        """Return scalar -> (instances,) numbers in (0, 1), tied by a Gaussian copula."""
        from scipy.special import ndtr

        names = sorted(scalar for judgement in self.judgements for scalar in judgement.scalars())
        normal = [_normal(seed, self.name, name).standard_normal(len(self.instances)) for name in names]
        factor = np.linalg.cholesky(correlation_matrix(names, self.correlations))
        shares: dict[str, NDArray[np.float64]] = {}
        for row, name in enumerate(names):
            # Summed one by one, not by BLAS: a scalar tied to nothing must not change a bit of the rest.
            mixed = np.zeros(len(self.instances))
            for column in np.flatnonzero(factor[row, : row + 1]):
                mixed = mixed + factor[row, column] * normal[column]
            shares[name] = ndtr(mixed)
        return shares


@dataclass(frozen=True, slots=True)
class Expert:
    """All an expert says, as `read_expert` returns it."""

    classes: tuple[ExpertClass, ...]
    origin: Origin
    source: Source

    def sample(self, seed: int) -> list[Block]:
        """Draw every instance of every class.

        Parameters
        ----------
        seed : int, 0 or more

        Returns
        -------
        list of Block
            One a class and property, sorted by both. Without noise the observation is ""; with noise there
            are `scans` observations "1", "2", ... around each instance's value, within its limits.

        Raises
        ------
        InputError
            If the seed is negative.
        """
        if seed < 0:
            raise InputError(f"seed = {seed} must be 0 or more")
        return [
            self._block(judged, judgement, values, seed)
            for judged in sorted(self.classes, key=lambda c: c.name)
            for drawn in [judged.draw(seed)]
            for judgement in sorted(judged.judgements, key=lambda j: j.property.name)
            for values in [drawn[judgement.property.name]]
        ]

    def of_instances(self, names: Mapping[str, Sequence[str]]) -> "Expert":
        """Return the same expert asked about these objects; classes that are not named keep their own.

        Parameters
        ----------
        names : mapping of class name to instance names
        """
        asked = (
            replace(judged, instances=tuple(names[judged.name])) if judged.name in names else judged
            for judged in self.classes
        )
        return replace(self, classes=tuple(asked))

    def _block(
        self, judged: ExpertClass, judgement: Judgement, values: NDArray[np.float64], seed: int
    ) -> Block:
        repeats = judged.scans if judgement.noise.amount else 1
        if judgement.noise.amount:
            values = _scattered(judged, judgement, values, seed)
        seen = [str(scan + 1) if judgement.noise.amount else "" for scan in range(repeats)]
        return Block(
            judgement.property,
            [judged.name] * len(values),
            [name for name in judged.instances for _ in range(repeats)],
            seen * len(judged.instances),
            values,
            self.origin,
            self.source,
        )


def scalars(prop: Property) -> tuple[str, ...]:
    """Return the names of a property's numbers: "weight", or "size.length", "size.width", ..."""
    return tuple(f"{prop.name}.{component}" for component in prop.components) or (prop.name,)


def correlation_matrix(names: list[str], correlations: Correlations) -> NDArray[np.float64]:
    """Return the (n, n) correlation matrix of n scalars; those not mentioned are independent."""
    matrix = np.eye(len(names))
    for one, two, strength in correlations:
        if one in names and two in names:
            row, column = names.index(one), names.index(two)
            matrix[row, column] = matrix[column, row] = strength
    return matrix


def _normal(seed: int, *names: str) -> np.random.Generator:
    digest = hashlib.sha256("\0".join(names).encode()).digest()
    words = [int.from_bytes(digest[i : i + 4], "little") for i in range(0, len(digest), 4)]
    return np.random.default_rng(np.random.SeedSequence([seed, *words]))


def _scattered(
    judged: ExpertClass, judgement: Judgement, values: NDArray[np.float64], seed: int
) -> NDArray[np.float64]:
    """Return (instances·scans, components) values around the (instances, components) ones."""
    limits = judgement.distributions
    bounds: Sequence[Distribution | Silhouette]
    bounds = [Silhouette(1.0)] if isinstance(limits, Silhouette) or judgement.of else limits
    columns = []
    for scalar, bound, column in zip(scalars(judgement.property), bounds, values.T, strict=True):
        noise = _normal(seed, judged.name, scalar, "noise").standard_normal((len(column), judged.scans))
        size = judgement.noise.amount * (column[:, None] if judgement.noise.relative else 1.0)
        columns.append(np.clip(column[:, None] + size * noise, bound.low, bound.high).ravel())
    return _ordered(judgement.property, np.stack(columns, axis=1))


def _ordered(prop: Property, values: NDArray[np.float64]) -> NDArray[np.float64]:
    return -np.sort(-values, axis=1) if prop.name in DESCENDING else values
