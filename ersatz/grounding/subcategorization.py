"""Sub-categorization: from continuous to discrete (paper: Knowledge about Objects, P_n to P_eta).

The values of a property are clustered into eta qualities, `size_1` to `size_4`. The clusters' centroids
are all that is kept: a new value takes the quality of the nearest centroid, without a refit. Fuzzy
clusters keep a fuzzifier and norms too, and a new value belongs to several qualities, to degrees.
"""

import builtins
import itertools
import warnings
from dataclasses import dataclass, replace
from decimal import Decimal
from math import fsum, inf, nextafter
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ersatz.errors import ErsatzWarning, InputError
from ersatz.grounding import clustering, fuzzy
from ersatz.grounding.summaries import Histogram, Sample, Summary
from ersatz.measurements import Property

MOST_CLUSTERS: Final = 127
"""More qualities than this per property have no place in the int8 labels."""

USUAL_FUZZIFIER: Final = 2.0
"""In the middle of what is recommended, 1.5 to 2.5 (Pal and Bezdek 1995); and with it, degrees need no
powers, so that they are the same on every machine."""

MOST_FUZZY: Final = 10.0
"""With a greater fuzzifier everything belongs to everything alike."""


@dataclass(frozen=True, slots=True)
class SubcategorizationSettings:
    """How values become qualities.

    Attributes
    ----------
    clusters : int
        eta, qualities per property; the paper's value is 4.
    restarts : int
        Starts of k-means in several dimensions; with few of them the result depends on the seed.
    seed : int
        Of those starts. A single dimension is solved exactly and needs none.
    fuzzifier : float
        m; 1 is crisp, as in the paper. Above 1 values belong to several qualities: fuzzy c-means for
        numbers, Gustafson-Kessel for vectors, both from the crisp clusters on.
    """

    clusters: int = 4
    restarts: int = 200
    seed: int = 0
    fuzzifier: float = 1.0

    def __post_init__(self) -> None:
        """Refuse counts out of range."""
        if not 1 <= self.clusters <= MOST_CLUSTERS:
            raise InputError(f"clusters is {self.clusters}: it lies between 1 and {MOST_CLUSTERS}")
        if self.restarts < 1:
            raise InputError(f"restarts is {self.restarts}: it must be 1 or more")
        if not 1 <= self.fuzzifier <= MOST_FUZZY:
            raise InputError(
                f"fuzzifier is {self.fuzzifier}: it lies between 1 (crisp) and {MOST_FUZZY:g}, "
                f"usually at {USUAL_FUZZIFIER:g}"
            )


@dataclass(frozen=True, slots=True, eq=False)
class Qualities:
    """The qualities of one property: where its values were cut.

    Attributes
    ----------
    property : Property
    centroids : (k, d) float64 array, in the property's unit, rounded to `DIGITS` fraction digits
        Ascending in 1-D; else in the order of their projections on the values' first principal axis.
    method : str
        How they were found: "optimal", "histogram", "k-means", "sampled k-means" or "given"; fuzzy ones
        by "fuzzy c-means" or "Gustafson-Kessel", each perhaps "sampled".
    fuzzifier : float
        m; 1 where a value belongs to one quality alone.
    norms : (k, d, d) float64 array, dimensionless, or None
        By which each centroid's distances are measured (`fuzzy.degrees`); None if Euclidean.
    """

    property: Property
    centroids: NDArray[np.float64]
    method: str = "given"
    fuzzifier: float = 1.0
    norms: NDArray[np.float64] | None = None

    @builtins.property
    def names(self) -> tuple[str, ...]:
        """The qualities' names, lowest rank first."""
        return tuple(f"{self.property.name}_{rank}" for rank in range(1, len(self.centroids) + 1))

    @builtins.property
    def bounds(self) -> tuple[Decimal, ...]:
        """The k - 1 cut points of a 1-D property, exact midpoints of the centroids; () if not 1-D."""
        if self.centroids.shape[1] != 1:
            return ()
        exact = [Decimal(repr(float(c))) for c in self.centroids[:, 0]]
        return tuple((low + high) / 2 for low, high in itertools.pairwise(exact))

    @builtins.property
    def fuzzy(self) -> bool:
        """Whether a value may belong to several of them."""
        return self.fuzzifier > 1

    def same_cuts(self, other: "Qualities") -> bool:
        """Return whether both give every value the same degrees."""
        if self.norms is None or other.norms is None:
            same_norms = self.norms is other.norms
        else:
            same_norms = np.array_equal(self.norms, other.norms)
        return (
            self.names == other.names
            and self.fuzzifier == other.fuzzifier
            and np.array_equal(self.centroids, other.centroids)
            and same_norms
        )

    def degrees(self, values: NDArray[np.float64]) -> NDArray[np.int64]:
        """Return (n, k): how far each value belongs to each quality, in millionths; rows add up to one.

        Parameters
        ----------
        values : (n, d) array, in the property's unit
        """
        if self.fuzzy:
            return fuzzy.degrees(values, self.centroids, self.norms, self.fuzzifier)
        return fuzzy.DEGREE * np.eye(len(self.centroids), dtype=np.int64)[self.assign(values)]

    def held(self, values: NDArray[np.float64]) -> NDArray[np.int8] | NDArray[np.int64]:
        """Return what units with these values hold: the labels of `assign`, of fuzzy ones the `degrees`."""
        return self.degrees(values) if self.fuzzy else self.assign(values)

    def assign(self, values: NDArray[np.float64]) -> NDArray[np.int8]:
        """Return the index (rank - 1) of the quality each value belongs to most, ties to the lower rank.

        For crisp qualities that is the one with the nearest centroid.

        Parameters
        ----------
        values : (n, d) array, in the property's unit

        Returns
        -------
        (n,) int8 array
        """
        if self.fuzzy:
            return most(self.degrees(values))
        if self.centroids.shape[1] == 1:
            cuts = np.array([_at_most(bound) for bound in self.bounds])
            return np.searchsorted(cuts, values[:, 0], side="left").astype(np.int8)
        return clustering.nearest(values, self.centroids)

    def inertia(self, values: NDArray[np.float64]) -> float:
        """Return the sum of squared distances of the values to the means of the clusters they fall in."""
        labels = self.assign(values)
        clusters = (values[labels == label] for label in np.unique(labels))
        return fsum(float(((c - c.mean(axis=0)) ** 2).sum()) for c in clusters)


def most(degrees: NDArray[np.int64]) -> NDArray[np.int8]:
    """Return the index of the greatest degree of each row, ties to the lower rank."""
    greatest: NDArray[np.int8] = degrees.argmax(axis=1).astype(np.int8)
    return greatest


def learn_qualities(
    values: NDArray[np.float64], prop: Property, settings: SubcategorizationSettings | None = None
) -> Qualities:
    """Cluster the values of one property into qualities; as `fit_qualities` with all of them at hand.

    Parameters
    ----------
    values : (n, d) array, in the property's unit; n >= 1, repeated values count
    """
    if values.shape[1] == 1:
        return fit_qualities(Histogram.of(values[:, 0]), prop, settings)
    ordered = values[np.lexsort(values.T[::-1])]
    drawn = np.random.default_rng((settings or SubcategorizationSettings()).seed).permutation(len(values))
    return fit_qualities(Sample.of(ordered, drawn.astype(np.uint64)), prop, settings)


def fit_qualities(
    summary: Summary, prop: Property, settings: SubcategorizationSettings | None = None
) -> Qualities:
    """Cluster the summarized values of one property into qualities.

    One dimension is solved exactly: the partition of least inertia, by dynamic programming. Where there
    are too many values for that, their histogram is solved, within a thousandth of the least inertia.
    Several dimensions take the best of many k-means starts, then Lloyd's steps in exact arithmetic until
    nothing moves; where vectors are too many, on a sample of them. With a fuzzifier above 1 fuzzy clusters
    are then found, from the crisp ones on. The result depends neither on the order of the values nor on
    the number of threads.

    Warns
    -----
    ErsatzWarning
        If there are fewer distinct values than clusters: there will be fewer qualities.
    """
    settings = settings or SubcategorizationSettings()
    if isinstance(summary, Histogram):
        distinct, weights = summary.points, summary.counts
    else:
        vectors = summary.vectors[np.lexsort(summary.vectors.T[::-1])]
        distinct, weights = np.unique(vectors, axis=0, return_counts=True)
    k = min(settings.clusters, len(distinct))
    if k < settings.clusters:
        warnings.warn(
            f"{prop.name!r} has {len(distinct)} distinct value(s): "
            f"{k} instead of {settings.clusters} qualities",
            ErsatzWarning,
            stacklevel=2,
        )
    if isinstance(summary, Histogram):
        centroids, method = clustering.cluster_line(distinct, weights, k, exact=summary.shift is None)
    else:
        centroids, method = clustering.cluster_space(
            vectors, distinct, k, restarts=settings.restarts, seed=settings.seed
        )
        if summary.seen > len(vectors):
            method = "sampled k-means"
    crisp = Qualities(prop, centroids, method)
    return crisp if settings.fuzzifier == 1 else _softened(crisp, distinct, weights, settings.fuzzifier)


def _softened(
    crisp: Qualities, distinct: NDArray[np.float64], weights: NDArray[np.int64], fuzzifier: float
) -> Qualities:
    """Return the fuzzy qualities that the crisp ones lead to; the crisp centroids if two become one."""
    values = distinct[:, None] if distinct.ndim == 1 else distinct
    given = replace(crisp, fuzzifier=fuzzifier)
    if len(crisp.centroids) in (1, len(values)):
        return given
    found = fuzzy.soften(values, weights, crisp.centroids, fuzzifier)
    if found is None or len(np.unique(found[0], axis=0)) < len(crisp.centroids):
        warnings.warn(
            f"{crisp.property.name!r} has fewer than {len(crisp.centroids)} fuzzy clusters: the crisp "
            "ones are kept, with degrees",
            ErsatzWarning,
            stacklevel=4,
        )
        return given
    centroids, norms = found
    order = clustering.rank_order(
        centroids, np.repeat(values, weights, axis=0) if norms is not None else values
    )
    method = "fuzzy c-means" if norms is None else "Gustafson-Kessel"
    if crisp.method in ("histogram", "sampled k-means"):
        method = f"sampled {method}"
    return Qualities(
        crisp.property, centroids[order], method, fuzzifier, None if norms is None else norms[order]
    )


def _at_most(bound: Decimal) -> float:
    """Return the largest float whose decimal notation is not above the bound."""
    cut = float(bound)
    return cut if Decimal(repr(cut)) <= bound else nextafter(cut, -inf)
