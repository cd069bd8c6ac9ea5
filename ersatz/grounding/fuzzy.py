"""Fuzzy qualities: the degrees to which a value belongs to each, in whole millionths that add up to one.

Fuzzy c-means (Bezdek 1981) for numbers, its extension by Gustafson and Kessel (1979) for vectors: every
cluster measures distances by a norm of its own, so that it may be long and thin. In one dimension all
norms are the same and the two are one. Arrays only; `subcategorization` knows what they stand for.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from ersatz.measurements import rounded

DEGREE: Final = 1_000_000
"""A full degree of membership in the unit of all counts."""

SHRINKAGE: Final = 0.1
"""Share of a round norm mixed into every cluster's covariance (Babuska et al. 2002, there gamma). With it
no covariance of a few objects is singular, and no cluster is more than some five times as long as wide."""

TOLERANCE: Final = 1e-10
"""Centroids that move less than this, in standard deviations of the values, have come to rest."""

MOST_STEPS: Final = 1000

APART: Final = 1e-6
"""Centroids nearer than this, in standard deviations, are one cluster found twice."""


def degrees(
    values: NDArray[np.float64],
    centroids: NDArray[np.float64],
    norms: NDArray[np.float64] | None,
    fuzzifier: float,
) -> NDArray[np.int64]:
    """Return how far each value belongs to each cluster.

    Between the centroids the degrees are those of fuzzy c-means. Far outside, those would tend to 1/k: an
    enormous thing would be a bit of everything. Qualities are ranks on a scale, so nothing changes beyond
    the outermost centroids: every component is clamped to their range first, and in one dimension what
    lies beyond belongs to the outermost quality alone.

    Parameters
    ----------
    values : (n, d) array, in the property's unit
    centroids : (k, d) array, in the property's unit, all different
    norms : (k, d, d) array, dimensionless, or None
        Positive definite matrices of determinant 1; None where distances are Euclidean.
    fuzzifier : float
        m > 1; the nearer to 1, the more of a value belongs to the nearest centroid.

    Returns
    -------
    (n, k) int64 array
        In millionths of a degree; each row adds up to `DEGREE`.
    """
    clamped = np.clip(values, centroids.min(axis=0), centroids.max(axis=0))
    shares = _memberships(_distances(clamped, centroids, norms), fuzzifier).T * DEGREE
    whole = np.floor(shares)
    return dealt(whole.astype(np.int64), shares - whole, np.full(len(values), DEGREE))


def dealt(
    whole: NDArray[np.int64], rest: NDArray[np.float64] | NDArray[np.int64], total: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Return the whole parts with what is left of the total dealt to the largest remainders, one each.

    Parameters
    ----------
    whole : (n, k) array
    rest : (n, k) array
        What rounding down took away; of equal ones the lower rank comes first.
    total : (n,) array
        What each row must add up to.
    """
    order = np.argsort(-rest, axis=1, kind="stable")
    place = np.empty_like(order)
    np.put_along_axis(place, order, np.arange(rest.shape[1])[None, :], axis=1)
    left: NDArray[np.int64] = total - whole.sum(axis=1)
    return whole + (place < left[:, None])


def soften(
    values: NDArray[np.float64], weights: NDArray[np.int64], centroids: NDArray[np.float64], fuzzifier: float
) -> tuple[NDArray[np.float64], NDArray[np.float64] | None] | None:
    """Return the centroids and norms of the fuzzy clusters that the crisp ones lead to.

    Centroids, covariances and degrees follow from one another in turn, from the crisp centroids and round
    norms on, until nothing moves: no random start, and the sums are over the values in the order given.

    Parameters
    ----------
    values : (n, d) array, in the property's unit, distinct
    weights : (n,) array
        How often each value occurs.
    centroids : (k, d) array
        Of the crisp clusters; k < n.
    fuzzifier : float
        m > 1.

    Returns
    -------
    centroids : (k, d) array, `rounded`
    norms : (k, d, d) array, `rounded`, or None in one dimension
        None instead of both if two clusters became one.
    """
    heavy = weights / weights.sum()
    middle = (heavy[:, None] * values).sum(axis=0)
    scale = np.sqrt((heavy[:, None] * (values - middle) ** 2).sum() / values.shape[1])
    z, centres = (values - middle) / scale, (centroids - middle) / scale
    norms = None
    for _ in range(MOST_STEPS):
        shares = _memberships(_distances(z, centres, norms), fuzzifier) ** fuzzifier * heavy
        shares /= shares.sum(axis=1, keepdims=True)
        moved = np.array([(share[:, None] * z).sum(axis=0) for share in shares])
        if z.shape[1] > 1:
            norms = np.array([_norm(z - c, share) for c, share in zip(moved, shares, strict=True)])
        at_rest = np.abs(moved - centres).max() <= TOLERANCE
        centres = moved
        if at_rest:
            break
    if _nearest_pair(centres) < APART:
        return None
    return rounded(centres * scale + middle), None if norms is None else rounded(norms)


def _memberships(distances: NDArray[np.float64], fuzzifier: float) -> NDArray[np.float64]:
    """Return (k, n): the degrees of fuzzy c-means; with m = 2 by exactly rounded arithmetic alone.

    They are taken relative to the nearest centroid, so that neither a distance of 0 nor m close to 1
    divides by zero or overflows.
    """
    near = np.ones_like(distances)
    np.divide(distances.min(axis=0), distances, out=near, where=distances > 0)
    if fuzzifier != 2:
        near **= 1 / (fuzzifier - 1)
    total = near[0].copy()
    for row in near[1:]:  # in this order for one value as for a million
        total += row
    near /= total
    return near


def _distances(
    values: NDArray[np.float64], centroids: NDArray[np.float64], norms: NDArray[np.float64] | None
) -> NDArray[np.float64]:
    """Return (k, n): the squared distance of each value from each centroid by that centroid's norm."""
    found = np.zeros((len(centroids), len(values)))
    size = centroids.shape[1]
    for cluster, centroid in enumerate(centroids):
        away = (values - centroid).T
        for i in range(size):
            for j in range(size):
                if norms is not None:
                    found[cluster] += norms[cluster, i, j] * away[i] * away[j]
                elif i == j:
                    found[cluster] += away[i] * away[i]
    return np.maximum(found, 0)


def _norm(away: NDArray[np.float64], share: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the matrix of determinant 1 that measures along a cluster's axes; for values of variance 1."""
    size = away.shape[1]
    covariance = np.array([[(share * a * b).sum() for a in away.T] for b in away.T])
    covariance = (1 - SHRINKAGE) * covariance + SHRINKAGE * np.eye(size)
    inverse = np.linalg.inv(covariance) * np.linalg.det(covariance) ** (1 / size)
    symmetric: NDArray[np.float64] = (inverse + inverse.T) / 2
    return symmetric


def _nearest_pair(centres: NDArray[np.float64]) -> float:
    return min(
        (float(np.abs(one - other).max()) for at, one in enumerate(centres) for other in centres[:at]),
        default=np.inf,
    )
