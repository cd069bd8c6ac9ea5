"""Persistence: groups of similar things that stay apart the longest as the view of them coarsens.

Mode seeking by persistence (Chazal, Guibas, Oudot, Skraba, "Persistence-Based Clustering in Riemannian
Manifolds", 2013): every point climbs to a denser neighbour; a peak's prominence is the density it loses
before it meets a higher one.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class Modes:
    """Groups around density peaks, the most prominent first.

    Attributes
    ----------
    labels : (n,) int64 array
        Group of each point; -1 if filtered out.
    prominences : (k,) float64 array
        How much density each peak loses before it meets a higher one; inf for the highest.
    """

    labels: NDArray[np.int64]
    prominences: NDArray[np.float64]


def seek_modes(distances: NDArray[np.float64], count: int, neighbours: int) -> Modes:
    """Group points by the `count` most prominent peaks of their density.

    Parameters
    ----------
    distances : (n, n) array
        Symmetric.
    count : int
        Groups wanted; there are fewer if the density has fewer peaks.
    neighbours : int
        Points whose mean distance is the inverse of the density, and that a point may climb to.

    Returns
    -------
    Modes
        Every point has a group.
    """
    size = len(distances)
    near = np.argsort(distances, axis=1, kind="stable")[:, : neighbours + 1]
    density = -np.take_along_axis(distances, near, axis=1)[:, 1:].mean(axis=1)
    linked = np.zeros((size, size), dtype=bool)
    linked[np.arange(size)[:, None], near] = True
    linked |= linked.T
    order = np.lexsort((np.arange(size), -density))
    rank = np.empty(size, dtype=np.int64)
    rank[order] = np.arange(size)
    peak = np.arange(size)
    meets: dict[int, tuple[float, int]] = {}
    home = np.arange(size)
    for point in order:
        higher = np.flatnonzero(linked[point] & (rank < rank[point]))
        if not len(higher):
            continue
        home[point] = home[higher[rank[higher].argmin()]]
        roots = sorted({_root(peak, int(other)) for other in higher}, key=lambda r: int(rank[r]))
        peak[point] = roots[0]
        for lower in roots[1:]:
            meets[lower] = (float(density[lower] - density[point]), roots[0])
            peak[lower] = roots[0]
    alone = [int(p) for p in np.unique(home) if int(p) not in meets]
    prominent = sorted(meets, key=lambda p: (-meets[p][0], p))[: max(count - len(alone), 0)]
    tops = [*alone, *prominent]
    final = {top: number for number, top in enumerate(tops)}
    labels = np.array([final[_climb(int(p), final, meets)] for p in home], dtype=np.int64)
    return Modes(labels, np.array([np.inf] * len(alone) + [meets[p][0] for p in prominent]))


def _root(peak: NDArray[np.int64], point: int) -> int:
    while peak[point] != point:
        point = int(peak[point])
    return point


def _climb(point: int, tops: dict[int, int], meets: dict[int, tuple[float, int]]) -> int:
    while point not in tops:
        point = meets[point][1]
    return point


def filter_modes(
    distances: NDArray[np.float64], owners: NDArray[np.int64], count: int, neighbours: int, fewest: int
) -> Modes:
    """Seek modes, drop groups seen on too few objects, and seek again until all groups are persistent.

    Parameters
    ----------
    distances : (n, n) array
        Between motifs.
    owners : (n,) int array
        Object that each motif is of.
    count, neighbours : int
        As in `seek_modes`.
    fewest : int
        Different objects a group must be seen on.

    Returns
    -------
    Modes
        With -1 for motifs that were dropped; possibly no group at all.
    """
    alive = np.arange(len(distances))
    while len(alive) > neighbours:
        modes = seek_modes(distances[np.ix_(alive, alive)], count, neighbours)
        groups = range(len(modes.prominences))
        rare = [g for g in groups if len(np.unique(owners[alive[modes.labels == g]])) < fewest]
        if not rare:
            labels = np.full(len(distances), -1, dtype=np.int64)
            labels[alive] = modes.labels
            return Modes(labels, modes.prominences)
        alive = alive[~np.isin(modes.labels, rare)]
    return Modes(np.full(len(distances), -1, dtype=np.int64), np.zeros(0))
