"""Segments: a cloud cut into surface patches, and which patches touch (paper: segmentation).

The paper's authors do not publish their segmentation. Ours grows patches around seeds spread over
positions and normals, then merges neighbours that are nearly parallel.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ersatz.acquisition.scans import Scan, check_extent
from ersatz.errors import InputError, ScanError


@dataclass(frozen=True, slots=True)
class SegmentSettings:
    """How a cloud is cut; lengths are relative, so that segments do not depend on the object's size.

    Attributes
    ----------
    resolution : int
        Voxels along the cloud's diagonal.
    neighbours : int
        Points that make a normal.
    outliers : float
        Standard deviations beyond which a point is too far from its neighbours to be kept.
    seeds : int
        Patches before merging.
    rounds : int
        Lloyd's iterations over the patches.
    normal_weight : float
        Weight of a normal against a position, whose unit is half the diagonal.
    fewest : int
        Points below which a patch is dropped.
    contacts : int
        Pairs of points within two voxels that make two patches neighbours.
    parallel : float, degrees
        Angle between mean normals below which neighbours are one segment.
    """

    resolution: int = 45
    neighbours: int = 15
    outliers: float = 3.0
    seeds: int = 24
    rounds: int = 8
    normal_weight: float = 0.6
    fewest: int = 8
    contacts: int = 3
    parallel: float = 18.0

    def __post_init__(self) -> None:
        """Refuse what makes no sense."""
        if self.resolution < 10 or self.neighbours < 5 or self.seeds < 2:
            raise InputError(f"too coarse to segment anything: {self}")


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """A thinned cloud with normals, in a frame of its own.

    Attributes
    ----------
    points : (n, 3) array, metres
        About the cloud's centroid, along its principal axes: the same for any pose of the object.
    normals : (n, 3) array, unit length
        Towards the sensor; outwards from the centroid where all sides are seen.
    diagonal : float, metres
        Of the cloud's box along its principal axes.
    spacing : float, metres
        Edge of a voxel.
    """

    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    diagonal: float
    spacing: float


@dataclass(frozen=True, slots=True, eq=False)
class Segments:
    """Patches of a surface and their neighbourhood graph.

    Attributes
    ----------
    surface : Surface
    labels : (n,) int64 array
        Segment of each point, -1 for none.
    edges : (e, 2) int64 array
        Touching segments, the smaller index first.
    areas : (s,) float64 array
        Share of the points in each segment; about its share of the visible area.
    """

    surface: Surface
    labels: NDArray[np.int64]
    edges: NDArray[np.int64]
    areas: NDArray[np.float64]

    def __len__(self) -> int:
        """Return the number of segments."""
        return len(self.areas)


def principal_frame(points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the centroid (3,) and the principal axes (3, 3 rows), signed by the points' skewness.

    The axes turn with the object.
    """
    centroid = points.mean(axis=0)
    centred = points - centroid
    _, vectors = np.linalg.eigh(centred.T @ centred)
    axes = vectors.T[::-1].copy()
    skew = ((centred @ axes.T) ** 3).sum(axis=0)
    axes[skew < 0] *= -1
    axes[2] = np.cross(axes[0], axes[1])
    return centroid, axes


def prepare(scan: Scan, settings: SegmentSettings) -> Surface:
    """Thin a cloud, remove stray points and estimate normals.

    Parameters
    ----------
    scan : Scan
    settings : SegmentSettings

    Returns
    -------
    Surface

    Raises
    ------
    ScanError
        If there are too few points to see a surface, or they lie on one line.
    """
    check_extent(scan.points, scan.label)
    centroid, axes = principal_frame(scan.points)
    points = (scan.points - centroid) @ axes.T
    sensor = None if scan.sensor is None else (scan.sensor - centroid) @ axes.T
    diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
    spacing = diagonal / settings.resolution
    points = thinned(points, spacing)
    if len(points) <= settings.neighbours:
        raise ScanError(
            f"{scan.label}: {len(points)} points remain after thinning to {spacing * 1000:.2g} mm"
        )
    distances, index = cKDTree(points).query(points, settings.neighbours)
    reach = distances.mean(axis=1)
    keep = reach <= reach.mean() + settings.outliers * reach.std()
    around = points[index]
    centred = around - around.mean(axis=1, keepdims=True)
    _, vectors = np.linalg.eigh(np.einsum("nki,nkj->nij", centred, centred))
    normals = vectors[:, :, 0]
    towards = points if sensor is None else sensor - points
    normals = np.where(((normals * towards).sum(axis=1) < 0)[:, None], -normals, normals)
    return Surface(points[keep], normals[keep], diagonal, spacing)


def thinned(points: NDArray[np.float64], spacing: float) -> NDArray[np.float64]:
    """Return the mean of the points in each occupied voxel of edge `spacing` (metres)."""
    cells = np.floor(points / spacing + 0.5).astype(np.int64)
    cells -= cells.min(axis=0)
    shape = cells.max(axis=0) + 1
    key = (cells[:, 0] * shape[1] + cells[:, 1]) * shape[2] + cells[:, 2]
    _, cell, count = np.unique(key, return_inverse=True, return_counts=True)
    sums = np.stack([np.bincount(cell, points[:, axis]) for axis in range(3)], axis=1)
    means: NDArray[np.float64] = sums / count[:, None]
    return means


def segment(surface: Surface, settings: SegmentSettings) -> Segments:
    """Cut a surface into patches that are nearly flat, and say which touch.

    Parameters
    ----------
    surface : Surface
    settings : SegmentSettings

    Returns
    -------
    Segments
        At least one.
    """
    place = np.concatenate(
        [surface.points * (2 / surface.diagonal), surface.normals * settings.normal_weight], axis=1
    )
    labels = _lloyd(place, settings)
    pairs = cKDTree(surface.points).query_pairs(2 * surface.spacing, output_type="ndarray")
    count = int(labels.max()) + 1
    touching = _contacts(labels, pairs, count, settings.contacts)
    means = _mean_normals(surface.normals, labels, count)
    parallel = (means[touching[:, 0]] * means[touching[:, 1]]).sum(axis=1) > np.cos(
        np.radians(settings.parallel)
    )
    merged = touching[parallel]
    graph = coo_matrix((np.ones(len(merged)), (merged[:, 0], merged[:, 1])), shape=(count, count))
    _, whole = connected_components(graph, directed=False)
    labels = whole[labels].astype(np.int64)
    sizes = np.bincount(labels)
    kept = np.flatnonzero(sizes >= min(settings.fewest, sizes.max()))
    renumbered = np.full(len(sizes), -1)
    # By size, so that the numbering does not depend on which seed came first.
    kept = kept[np.argsort(-sizes[kept], kind="stable")]
    renumbered[kept] = np.arange(len(kept))
    labels = renumbered[labels]
    edges = _contacts(labels, pairs, len(kept), settings.contacts)
    return Segments(surface, labels, edges, sizes[kept] / sizes[kept].sum())


def _lloyd(place: NDArray[np.float64], settings: SegmentSettings) -> NDArray[np.int64]:
    """Return the nearest of `seeds` centres for each row, the centres spread by farthest points first."""
    distance = ((place - place.mean(axis=0)) ** 2).sum(axis=1)
    nearest = np.full(len(place), np.inf)
    chosen = []
    for _ in range(min(settings.seeds, len(place))):
        chosen.append(int(distance.argmax()))
        nearest = np.minimum(nearest, ((place - place[chosen[-1]]) ** 2).sum(axis=1))
        distance = nearest
    centres = place[chosen]
    labels = np.zeros(len(place), dtype=np.int64)
    for _ in range(settings.rounds):
        labels = ((centres**2).sum(axis=1) - 2 * place @ centres.T).argmin(axis=1)
        counts = np.bincount(labels, minlength=len(centres))
        sums = np.stack([np.bincount(labels, column, len(centres)) for column in place.T], axis=1)
        centres = np.where(counts[:, None] > 0, sums / np.maximum(counts, 1)[:, None], centres)
    _, labels = np.unique(labels, return_inverse=True)
    return labels.astype(np.int64)


def _mean_normals(normals: NDArray[np.float64], labels: NDArray[np.int64], count: int) -> NDArray[np.float64]:
    sums = np.stack([np.bincount(labels, column, count) for column in normals.T], axis=1)
    means: NDArray[np.float64] = sums / np.maximum(np.linalg.norm(sums, axis=1, keepdims=True), 1e-12)
    return means


def _contacts(
    labels: NDArray[np.int64], pairs: NDArray[np.int64], count: int, contacts: int
) -> NDArray[np.int64]:
    """Return (e, 2) pairs of labels that at least `contacts` of the point pairs join."""
    ends = np.sort(labels[pairs], axis=1)
    ends = ends[(ends[:, 0] != ends[:, 1]) & (ends[:, 0] >= 0)]
    key, times = np.unique(ends[:, 0] * count + ends[:, 1], return_counts=True)
    key = key[times >= contacts]
    return np.stack([key // count, key % count], axis=1).astype(np.int64)
