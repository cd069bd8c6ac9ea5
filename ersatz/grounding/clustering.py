"""Crisp clusters: the centroids of values, in the order of their ranks.

One dimension is solved exactly: the partition of least inertia, by dynamic programming. Several
dimensions take the best of many k-means starts, then Lloyd's steps in exact arithmetic. Arrays only;
`subcategorization` knows what they stand for, and `fuzzy` goes on from here.
"""

import itertools
from fractions import Fraction
from math import fsum
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ersatz.measurements import DIGITS, rounded

FRACTION_LIMIT: Final = 2_000
"""Up to this many distinct values a 1-D fit that floats cannot decide is repeated in whole numbers.

Where there are more, neighbours are first brought to about as many groups; so are the bins of a histogram.
"""

_Numbers: TypeAlias = NDArray[Any]
"""float64, or Python's whole numbers as objects."""

_Sums: TypeAlias = tuple[_Numbers, _Numbers, _Numbers]
"""Of w, w x and w x^2 over the values before each border, n + 1 of each."""


def cluster_line(
    x: NDArray[np.float64], weights: NDArray[np.int64], k: int, *, exact: bool
) -> tuple[NDArray[np.float64], str]:
    """Return the centroids of the partition of least inertia, and how it was found.

    Parameters
    ----------
    x : (n,) array, in the property's unit
        Distinct, ascending.
    weights : (n,) array
        How often each value occurs.
    k : int
        1 <= k <= n.
    exact : bool
        Whether the values are as measured; else they are bins, and only their histogram is solved.

    Returns
    -------
    centroids : (k, 1) array, `rounded`
    method : {"optimal", "histogram"}
    """
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


def cluster_space(
    values: NDArray[np.float64], distinct: NDArray[np.float64], k: int, *, restarts: int, seed: int
) -> tuple[NDArray[np.float64], str]:
    """Return the centroids of vectors by k-means, and how they were found.

    Parameters
    ----------
    values : (n, d) array, in the property's unit
        Sorted; repeated vectors count.
    distinct : (m, d) array
        The same without repetitions.
    k : int
        1 <= k <= m.
    restarts, seed : int
        Of scikit-learn's k-means.

    Returns
    -------
    centroids : (k, d) array, `rounded`
    method : {"optimal", "k-means"}
    """
    if len(distinct) == k:
        return distinct[rank_order(distinct, values)], "optimal"
    from sklearn.cluster import KMeans

    fitted = KMeans(k, n_init=restarts, random_state=seed).fit(values)
    centroids = np.asarray(fitted.cluster_centers_, dtype=np.float64)
    for _ in range(1000):
        labels = nearest(values, centroids)
        moved = np.array(
            [_mean_vector(values[labels == c]) if (labels == c).any() else centroids[c] for c in range(k)]
        )
        if np.array_equal(moved, centroids):
            break
        centroids = moved
    return centroids[rank_order(centroids, values)], "k-means"


def rank_order(centroids: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return the order along the first principal axis of the values, its first component ascending."""
    if values.shape[1] == 1:
        return np.argsort(centroids[:, 0])
    axis = np.linalg.eigh(np.cov(values.T) if len(values) > 1 else np.eye(values.shape[1]))[1][:, -1]
    leading = axis[np.flatnonzero(np.abs(axis) > 1e-9)[0]]
    projection = np.round(centroids @ (axis * np.sign(leading)), DIGITS)
    return np.lexsort((*centroids.T[::-1], projection))


def nearest(values: NDArray[np.float64], centroids: NDArray[np.float64]) -> NDArray[np.int8]:
    """Return (n,): the index of the centroid nearest to each value, ties to the first."""
    distance = np.stack([((values - centroid) ** 2).sum(axis=1) for centroid in centroids], axis=1)
    labels: NDArray[np.int8] = distance.argmin(axis=1).astype(np.int8)
    return labels


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


def _prefix_sums(x: _Numbers, weights: _Numbers) -> _Sums:
    """Return the sums of w, w x and w x^2 over the values before each border, n + 1 of each."""
    one, two, three = (np.append(0 * w[:1], np.cumsum(w)) for w in (weights, weights * x, weights * x * x))
    return one, two, three


def _cost(sums: _Sums, i: NDArray[np.int64], j: NDArray[np.int64]) -> _Numbers:
    """Return the inertia of the values between two borders; as fractions if the sums are whole numbers."""
    w, wx, wxx = (part[j] - part[i] for part in sums)
    if w.dtype == object:
        fractions: _Numbers = np.frompyfunc(Fraction, 2, 1)(wxx * w - wx * wx, w)
        return fractions
    inertia: _Numbers = wxx - wx**2 / w
    return inertia


def _cheapest(sums: _Sums, k: int) -> NDArray[np.int64]:
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


def _layer(sums: _Sums, best: _Numbers, clusters: int) -> tuple[_Numbers, NDArray[np.int64]]:
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


def _mean(x: NDArray[np.float64], weights: NDArray[np.int64]) -> float:
    return fsum(x * weights) / int(weights.sum())


def _mean_vector(values: NDArray[np.float64]) -> NDArray[np.float64]:
    return rounded(np.array([fsum(component) / len(values) for component in values.T]))
