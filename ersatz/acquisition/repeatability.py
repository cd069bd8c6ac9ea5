"""Repeatability: which patterns several views of one object agree on.

Two views of one unlabelled object are known to be of one object, so nobody has to name it to tell whether
a number stays the same from view to view. The measure is the intraclass correlation ICC(1) of Shrout and
Fleiss ("Intraclass Correlations: Uses in Assessing Rater Reliability", 1979): the share of a number's
variance that lies between objects and not between the views of one.
"""

import numpy as np
from numpy.typing import NDArray


def intraclass(values: NDArray[np.float64], objects: NDArray[np.generic]) -> NDArray[np.float64]:
    """Return the intraclass correlation of each column over the views of an object.

    Parameters
    ----------
    values : (n, k) array
        One view a row.
    objects : (n,) array
        What each view is of.

    Returns
    -------
    (k,) array, dimensionless, at most 1
        Zeros if no object has two views: nothing is known then.
    """
    _, inverse = np.unique(objects, return_inverse=True)
    counts = np.bincount(inverse)
    if len(counts) < 2 or len(values) == len(counts):
        return np.zeros(values.shape[1])
    means = np.stack([np.bincount(inverse, column) / counts for column in values.T], axis=1)
    between = (counts[:, None] * (means - values.mean(axis=0)) ** 2).sum(axis=0) / (len(counts) - 1)
    within = ((values - means[inverse]) ** 2).sum(axis=0) / (len(values) - len(counts))
    total = between + (counts.mean() - 1) * within
    found: NDArray[np.float64] = (between - within) / np.maximum(total, 1e-300)
    return found


def pattern_distances(
    distances: NDArray[np.float64],
    patterns: NDArray[np.int64],
    owners: NDArray[np.int64],
    nearest: int,
    own: NDArray[np.int64] | None = None,
) -> NDArray[np.float64]:
    """Return the mean distance of motifs to the nearest exemplar objects of each pattern.

    Parameters
    ----------
    distances : (n, e) array
        Between motifs and exemplars.
    patterns : (e,) int array
        Of the exemplars, 0 to k - 1.
    owners : (e,) int array
        Object of each exemplar.
    nearest : int
        Objects that make the mean, each by its nearest exemplar.
    own : (n,) int array or None
        Object of each motif, whose exemplars are left out; a pattern must then be of two objects or more.

    Returns
    -------
    (n, k) array
    """
    if own is not None:
        distances = np.where(own[:, None] == owners, np.inf, distances)
    found = []
    for pattern in range(int(patterns.max()) + 1):
        mine = np.flatnonzero(patterns == pattern)
        mine = mine[np.argsort(owners[mine], kind="stable")]
        starts = np.flatnonzero(np.diff(owners[mine], prepend=-1))
        near = np.sort(np.minimum.reduceat(distances[:, mine], starts, axis=1), axis=1)[:, :nearest]
        known = np.isfinite(near)
        found.append(np.where(known, near, 0).sum(axis=1) / np.maximum(known.sum(axis=1), 1))
    return np.stack(found, axis=1)


def relative_responses(distances: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how near each pattern is, measured by how near patterns are to this view at all.

    A view from an unusual side, as of a can from its end, is far from everything. The scale therefore comes
    from the view itself, as in Zelnik-Manor and Perona, "Self-Tuning Spectral Clustering", 2004.

    Parameters
    ----------
    distances : (n, k) array
        To all patterns.

    Returns
    -------
    (n, k) array, dimensionless, in [0, 1]
        exp(-d²/2s²), s² the mean of d² over the patterns: 0.61 for a pattern as far away as the average.
    """
    squares = distances**2
    responses: NDArray[np.float64] = np.exp(
        -squares / np.maximum(2 * squares.mean(axis=1, keepdims=True), 1e-300)
    )
    return responses
