"""Symbols: segments in numbers, named after a dictionary from generic to specific (paper: symbols).

The dictionary is one Ward tree of training segments cut at several heights, so that every specific
symbol has exactly one generic parent.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ersatz.acquisition.segments import Segments
from ersatz.errors import InputError

PAIRS: Final = 300
"""Point pairs that describe a patch."""

BINS: Final = 7

HISTOGRAMS: Final = 3 * BINS
"""The first numbers of a descriptor: shares of point pairs."""

NAMES: Final = (
    *(f"normal {i}" for i in range(BINS)),
    *(f"slope {i}" for i in range(BINS)),
    *(f"distance {i}" for i in range(BINS)),
    "linearity",
    "planarity",
    "scatter",
    "length",
    "width",
    "convexity",
)
"""What the numbers of a descriptor are."""


@dataclass(frozen=True, slots=True)
class SymbolSettings:
    """Sizes of the dictionary, generic to specific; each must be larger than the one before."""

    levels: tuple[int, ...] = (4, 8, 16, 32)

    def __post_init__(self) -> None:
        """Refuse what makes no sense."""
        if not self.levels or any(b <= a for a, b in pairwise(self.levels)) or self.levels[0] < 2:
            raise InputError(f"levels = {self.levels}: give growing numbers of symbols, e.g. (4, 8, 16, 32)")


def describe(
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    members: list[NDArray[np.int64]],
    diagonal: float,
) -> NDArray[np.float64]:
    """Describe sets of points by how pairs of them lie to one another.

    Invariant to rotation, translation and scale.

    Parameters
    ----------
    points : (n, 3) array, metres
    normals : (n, 3) array, unit length
    members : list of (k,) int arrays, k >= 1
        Indices of the points of each set.
    diagonal : float, metres
        Length by which extents are divided.

    Returns
    -------
    (len(members), 27) array, dimensionless, columns as in `NAMES`
    """
    rng = np.random.default_rng(0)
    draws = rng.random((2, PAIRS))
    pick = np.stack([[m[(d * len(m)).astype(np.int64)] for m in members] for d in draws])
    apart = points[pick[1]] - points[pick[0]]
    length = np.linalg.norm(apart, axis=2)
    line = apart / np.maximum(length, 1e-12)[..., None]
    one, other = normals[pick[0]], normals[pick[1]]
    turned = (one * other).sum(axis=2)
    slopes = np.stack([(one * line).sum(axis=2), (other * line).sum(axis=2)])
    longest = np.maximum(length.max(axis=1, keepdims=True), 1e-12)
    valid = length > 0
    parts = [
        _histograms(turned, -1, 1, valid),
        _histograms(np.abs(slopes).mean(axis=0), 0, 1, valid),
        _histograms(length / longest, 0, 1, valid),
        np.array([_extents(points[m], diagonal) for m in members]),
        # The far point's normal leans away from the near one's where the surface is convex.
        (((slopes[1] - slopes[0]) > 0.02) & valid).sum(axis=1, keepdims=True) / PAIRS,
    ]
    return np.concatenate(parts, axis=1)


def _histograms(
    values: NDArray[np.float64], low: float, high: float, valid: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Return (sets, BINS) shares of the values in equal bins, one histogram a row."""
    bins = np.clip(((values - low) / (high - low) * BINS).astype(np.int64), 0, BINS - 1)
    flat = bins + np.arange(len(values))[:, None] * BINS
    counts = np.bincount(flat[valid], minlength=len(values) * BINS).reshape(len(values), BINS)
    shares: NDArray[np.float64] = counts / np.maximum(valid.sum(axis=1, keepdims=True), 1)
    return shares


def _extents(points: NDArray[np.float64], diagonal: float) -> list[float]:
    """Return linearity, planarity, scatter and two extents of a set of points."""
    centred = points - points.mean(axis=0)
    values, vectors = np.linalg.eigh(centred.T @ centred)
    large, middle, small = np.sqrt(np.maximum(values[::-1], 0))
    spans = np.ptp(centred @ vectors[:, ::-1], axis=0) / diagonal
    large = max(large, 1e-12)
    return [(large - middle) / large, (middle - small) / large, small / large, spans[0], spans[1]]


def members(segments: Segments) -> list[NDArray[np.int64]]:
    """Return the indices of the points of each segment."""
    order = np.argsort(segments.labels, kind="stable")
    labels = segments.labels[order]
    return np.split(order[labels >= 0], np.flatnonzero(np.diff(labels[labels >= 0])) + 1)


def describe_segments(segments: Segments) -> NDArray[np.float64]:
    """Return the (s, 27) descriptors of segments."""
    surface = segments.surface
    return describe(surface.points, surface.normals, members(segments), surface.diagonal)


@dataclass(frozen=True, slots=True, eq=False)
class Standard:
    """What is usual in training: numbers are compared after subtraction of `mean` and division by `scale`.

    Attributes
    ----------
    mean, scale : (d,) float64 arrays
    """

    mean: NDArray[np.float64]
    scale: NDArray[np.float64]

    @classmethod
    def of(cls, values: NDArray[np.float64]) -> "Standard":
        """Return the standard of (n, d) values."""
        return cls(values.mean(axis=0), np.maximum(values.std(axis=0), 1e-6))

    def __call__(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (n, d) values in units of the training set's deviation."""
        return (values - self.mean) / self.scale


@dataclass(frozen=True, slots=True, eq=False)
class Dictionary:
    """Symbols of segments at several levels.

    Attributes
    ----------
    standard : Standard
        Of the training descriptors.
    centres : (k, 27) float64 array
        The most specific symbols.
    parents : (levels, k) int64 array
        Symbol of each level, generic first, that a most specific symbol belongs to.
    """

    standard: Standard
    centres: NDArray[np.float64]
    parents: NDArray[np.int64]

    @property
    def levels(self) -> tuple[int, ...]:
        """The number of symbols of each level, generic first."""
        return tuple(int(row.max()) + 1 for row in self.parents)

    def assign(self, descriptors: NDArray[np.float64]) -> NDArray[np.int64]:
        """Return the (s, levels) symbols of (s, 27) descriptors, generic first."""
        place = self.standard(descriptors)
        specific = ((self.centres**2).sum(axis=1) - 2 * place @ self.centres.T).argmin(axis=1)
        symbols: NDArray[np.int64] = self.parents[:, specific].T
        return symbols


def learn_dictionary(descriptors: NDArray[np.float64], settings: SymbolSettings) -> Dictionary:
    """Learn symbols from segments of training scans.

    Parameters
    ----------
    descriptors : (s, 27) array
    settings : SymbolSettings

    Returns
    -------
    Dictionary

    Raises
    ------
    InputError
        If there are fewer different segments than symbols.
    """
    from sklearn.cluster import AgglomerativeClustering

    distinct = np.unique(descriptors, axis=0)
    if len(distinct) < settings.levels[-1]:
        raise InputError(
            f"{len(distinct)} different segments cannot make {settings.levels[-1]} symbols: give more scans"
        )
    standard = Standard.of(distinct)
    place = standard(distinct)
    # Ward's tree needs memory quadratic in its leaves; an even sample of them makes the same symbols.
    place = place[np.linspace(0, len(place) - 1, min(len(place), 4000)).astype(np.int64)]
    cuts = [AgglomerativeClustering(size, linkage="ward").fit_predict(place) for size in settings.levels]
    leaves = cuts[-1]
    centres = np.stack([place[leaves == leaf].mean(axis=0) for leaf in range(settings.levels[-1])])
    first = [int(np.flatnonzero(leaves == leaf)[0]) for leaf in range(settings.levels[-1])]
    return Dictionary(standard, centres, np.stack([cut[first] for cut in cuts]).astype(np.int64))
