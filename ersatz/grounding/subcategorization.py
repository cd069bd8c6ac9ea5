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
from fractions import Fraction
from math import fsum, inf, nextafter
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ersatz.errors import ErsatzWarning, InputError
from ersatz.grounding import fuzzy
from ersatz.grounding.summaries import Histogram, Sample, Summary
from ersatz.measurements import DIGITS, Property, rounded

_Numbers: TypeAlias = NDArray[Any]
"""float64, or Python's whole numbers as objects."""

MOST_CLUSTERS: Final = 127
"""More qualities than this per property have no place in the int8 labels."""

FRACTION_LIMIT: Final = 2_000
"""Up to this many distinct values a 1-D fit that floats cannot decide is repeated in whole numbers.

Where there are more, neighbours are first brought to about as many groups; so are the bins of a histogram.
"""

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
        return _nearest(values, self.centroids)

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
        centroids, method = _fit_line(distinct, weights, k, exact=summary.shift is None)
    else:
        centroids, method = _fit_space(vectors, distinct, k, settings)
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
    order = _order(centroids, np.repeat(values, weights, axis=0) if norms is not None else values)
    method = "fuzzy c-means" if norms is None else "Gustafson-Kessel"
    if crisp.method in ("histogram", "sampled k-means"):
        method = f"sampled {method}"
    return Qualities(
        crisp.property, centroids[order], method, fuzzifier, None if norms is None else norms[order]
    )


def _fit_line(
    x: NDArray[np.float64], weights: NDArray[np.int64], k: int, *, exact: bool
) -> tuple[NDArray[np.float64], str]:
    """Return the centroids of the best partition of sorted, weighted, distinct values."""
    heavy, method = weights.astype(np.float64), "optimal"
    cuts = _best_cuts(x, heavy, k) if exact else None
    if cuts is None:
        starts, method = _groups(x), "histogram"
        mass = np.add.reduceat(heavy, starts)
        best = _best_cuts(np.add.reduceat(x * heavy, starts) / mass, mass, k)
        assert best is not None, "whole numbers decide"
        cuts = _settled(x, heavy, np.append(starts, len(x))[best])
    means = [_mean(x[a:b], weights[a:b]) for a, b in itertools.pairwise(cuts)]
    return rounded(np.array(means)[:, None]), method


def _groups(x: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return where groups of values begin: fine where values are many, and where they are sparse."""
    by_number = np.linspace(0, len(x), FRACTION_LIMIT // 2, endpoint=False).astype(np.int64)
    by_width = np.searchsorted(x, np.linspace(x[0], x[-1], FRACTION_LIMIT // 2))
    return np.unique(np.concatenate([by_number, by_width]))


def _settled(
    x: NDArray[np.float64], weights: NDArray[np.float64], cuts: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Return the borders after Lloyd's steps, from bins to single values."""
    for _ in range(1000):
        means = np.add.reduceat(x * weights, cuts[:-1]) / np.add.reduceat(weights, cuts[:-1])
        inner = np.searchsorted(x, (means[1:] + means[:-1]) / 2, side="right")
        moved = np.concatenate([cuts[:1], inner, cuts[-1:]])
        if np.array_equal(moved, cuts) or (np.diff(moved) == 0).any():
            break
        cuts = moved
    return cuts


def _best_cuts(x: NDArray[np.float64], weights: NDArray[np.float64], k: int) -> NDArray[np.int64] | None:
    """Return the k + 1 borders of the partition of sorted weighted values that has the least inertia.

    Where the clusters are so tight beside their distances that differences of floats say nothing, whole
    numbers decide; None where there are too many values for that.
    """
    sums = _prefix_sums(x - np.average(x, weights=weights), weights)
    cuts = _cheapest(sums, k)
    unsure = _cost(sums, cuts[:-1], cuts[1:]).sum() <= 1e-5 * sums[2][-1]
    if unsure and 1 < k < len(x):
        if len(x) > FRACTION_LIMIT:
            return None
        ratios = [value.as_integer_ratio() for value in x.tolist()]
        scale = max(denominator for _, denominator in ratios)
        whole = np.array([n * (scale // d) for n, d in ratios], dtype=object)
        cuts = _cheapest(_prefix_sums(whole, np.array(list(map(int, weights)), dtype=object)), k)
    return cuts


def _prefix_sums(x: _Numbers, weights: _Numbers) -> tuple[_Numbers, _Numbers, _Numbers]:
    """Return the sums of w, w x and w x^2 over the values before each border, n + 1 of each."""
    one, two, three = (np.append(0 * w[:1], np.cumsum(w)) for w in (weights, weights * x, weights * x * x))
    return one, two, three


def _cost(sums: tuple[_Numbers, _Numbers, _Numbers], i: NDArray[np.int64], j: NDArray[np.int64]) -> _Numbers:
    """Return the inertia of the values between two borders; as fractions if the sums are whole numbers."""
    w, wx, wxx = (part[j] - part[i] for part in sums)
    if w.dtype == object:
        fractions: _Numbers = np.frompyfunc(Fraction, 2, 1)(wxx * w - wx * wx, w)
        return fractions
    inertia: _Numbers = wxx - wx**2 / w
    return inertia


def _cheapest(sums: tuple[_Numbers, _Numbers, _Numbers], k: int) -> NDArray[np.int64]:
    """Return the k + 1 borders of least inertia by dynamic programming over the number of clusters."""
    n = len(sums[0]) - 1
    best: _Numbers = np.full(n + 1, np.inf, dtype=sums[0].dtype)
    best[1:] = _cost(sums, np.zeros(n, np.int64), np.arange(1, n + 1))
    borders = []
    for clusters in range(2, k + 1):
        best, border = _layer(sums, best, clusters)
        borders.append(border)
    cuts = [n]
    for border in reversed(borders):
        cuts.append(int(border[cuts[-1]]))
    return np.array([0, *reversed(cuts)])


def _layer(
    sums: tuple[_Numbers, _Numbers, _Numbers], best: _Numbers, clusters: int
) -> tuple[_Numbers, NDArray[np.int64]]:
    """Return, for every prefix of the values, the least inertia with one cluster more, and its last border.

    Because the best last border moves only to the right, a layer is solved by divide and conquer, all
    intervals of one depth at once: O(n log n).
    """
    n = len(best) - 1
    layer, border = np.full(n + 1, np.inf, dtype=best.dtype), np.zeros(n + 1, np.int64)
    low, high = np.array([clusters]), np.array([n])
    first, last = np.array([clusters - 1]), np.array([n - 1])
    while len(low):
        mid = (low + high) // 2
        sizes = np.minimum(last, mid - 1) - first + 1
        offsets = np.concatenate([[0], np.cumsum(sizes)[:-1]])
        i = np.arange(sizes.sum()) - np.repeat(offsets - first, sizes)
        total = best[i] + _cost(sums, i, np.repeat(mid, sizes))
        least = np.minimum.reduceat(total, offsets)
        hits = np.flatnonzero(total == np.repeat(least, sizes))
        choice = i[hits[np.searchsorted(hits, offsets)]]
        layer[mid], border[mid] = least, choice
        low, high, first, last = (
            np.concatenate(pair)
            for pair in ((low, mid + 1), (mid - 1, high), (first, choice), (choice, last))
        )
        unsolved = low <= high
        low, high, first, last = low[unsolved], high[unsolved], first[unsolved], last[unsolved]
    return layer, border


def _fit_space(
    values: NDArray[np.float64], distinct: NDArray[np.float64], k: int, settings: SubcategorizationSettings
) -> tuple[NDArray[np.float64], str]:
    """Return centroids of sorted value vectors, in the order of their ranks."""
    if len(distinct) == k:
        return distinct[_order(distinct, values)], "optimal"
    from sklearn.cluster import KMeans

    fitted = KMeans(k, n_init=settings.restarts, random_state=settings.seed).fit(values)
    centroids = np.asarray(fitted.cluster_centers_, dtype=np.float64)
    for _ in range(1000):
        labels = _nearest(values, centroids)
        moved = np.array(
            [_mean_vector(values[labels == c]) if (labels == c).any() else centroids[c] for c in range(k)]
        )
        if np.array_equal(moved, centroids):
            break
        centroids = moved
    return centroids[_order(centroids, values)], "k-means"


def _order(centroids: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return the order along the first principal axis of the values, its first component ascending."""
    if values.shape[1] == 1:
        return np.argsort(centroids[:, 0])
    axis = np.linalg.eigh(np.cov(values.T) if len(values) > 1 else np.eye(values.shape[1]))[1][:, -1]
    leading = axis[np.flatnonzero(np.abs(axis) > 1e-9)[0]]
    projection = np.round(centroids @ (axis * np.sign(leading)), DIGITS)
    return np.lexsort((*centroids.T[::-1], projection))


def _nearest(values: NDArray[np.float64], centroids: NDArray[np.float64]) -> NDArray[np.int8]:
    distance = np.stack([((values - centroid) ** 2).sum(axis=1) for centroid in centroids], axis=1)
    nearest: NDArray[np.int8] = distance.argmin(axis=1).astype(np.int8)
    return nearest


def _mean(x: NDArray[np.float64], weights: NDArray[np.int64]) -> float:
    return fsum(x * weights) / int(weights.sum())


def _mean_vector(values: NDArray[np.float64]) -> NDArray[np.float64]:
    return rounded(np.array([fsum(component) / len(values) for component in values.T]))


def _at_most(bound: Decimal) -> float:
    """Return the largest float whose decimal notation is not above the bound."""
    cut = float(bound)
    return cut if Decimal(repr(cut)) <= bound else nextafter(cut, -inf)
