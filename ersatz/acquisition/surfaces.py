"""What a surface offers and shows: stable level area, flatness, silhouette, symmetry."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError, cKDTree

from ersatz.acquisition.cavities import SurfaceSamples, rotation_to
from ersatz.acquisition.hulls import facet_normals


def best_support(
    samples: SurfaceSamples, corners: NDArray[np.float64], level: float, slope: float
) -> tuple[float, float]:
    """Return the largest level area in a stable pose (m²), and its share of all that is seen from above."""
    area, share = 0.0, 0.0
    middle = (samples.points * samples.weights[:, None]).sum(axis=0) / samples.weights.sum()
    for down in facet_normals(corners, 10, 8.0):
        rotation = rotation_to(-down)
        if not _stable(corners @ rotation.T, rotation @ middle):
            continue
        found = _level_area(samples, rotation, level, slope)
        if found[0] > area:
            area, share = found
    return area, share


def _stable(corners: NDArray[np.float64], middle: NDArray[np.float64]) -> bool:
    """Say whether the middle is above what touches the ground."""
    low = corners[:, 2].min() + 0.001 + 0.02 * np.ptp(corners[:, 2])
    base = corners[corners[:, 2] <= low, :2]
    try:
        return bool((ConvexHull(base).equations @ np.append(middle[:2], 1.0) < 0).all())
    except (QhullError, ValueError):
        return False


def _level_area(
    samples: SurfaceSamples, rotation: NDArray[np.float64], thickness: float, slope: float
) -> tuple[float, float]:
    """Return the area (m²) of the level that holds most of what is seen from above, and its share."""
    points = samples.points @ rotation.T
    # What is seen from above looks up, whichever way the file turns its triangles.
    upward = np.abs(samples.normals @ rotation[2])
    edge = 1.5 * samples.spacing
    cells = np.floor((points[:, :2] - points[:, :2].min(axis=0)) / edge).astype(np.int64)
    key = cells[:, 0] * (cells[:, 1].max() + 1) + cells[:, 1]
    order = np.lexsort((points[:, 2], key))
    top = order[np.flatnonzero(np.diff(key[order], append=-1))]
    level = np.sort(points[top[upward[top] > np.cos(np.radians(slope))], 2])
    if not len(level):
        return 0.0, 0.0
    count = (np.searchsorted(level, level + thickness, "right") - np.arange(len(level))).max()
    return float(count * edge**2), float(count / len(top))


def silhouette(samples: SurfaceSamples) -> float:
    """Return the mean area of an object's shadow over all directions, m²."""
    index = np.arange(24) + 0.5
    height = 1 - index / 24
    turn = np.pi * (1 + np.sqrt(5)) * index
    radius = np.sqrt(1 - height**2)
    edge = 1.5 * samples.spacing
    areas = []
    for direction in np.stack([radius * np.cos(turn), radius * np.sin(turn), height], axis=1):
        flat = samples.points @ rotation_to(direction)[:2].T
        cells = np.floor((flat - flat.min(axis=0)) / edge).astype(np.int64)
        shadow = np.zeros(cells.max(axis=0) + 1, dtype=bool)
        shadow[cells[:, 0], cells[:, 1]] = True
        count = int(shadow.sum())
        # Cells on the outline are covered by half; their number follows from the shadow's roundness.
        areas.append((count - 0.5 * np.sqrt(np.pi * count) * 2) * edge**2)
    return float(max(np.mean(areas), 0.0))


def symmetry(points: NDArray[np.float64], tolerance: float = 0.02) -> float:
    """Return the share of points within `tolerance` diagonals of their mirror image, for the best mirror."""
    points = points[np.linspace(0, len(points) - 1, min(len(points), 2000)).astype(np.int64)]
    centred = points - points.mean(axis=0)
    axes = np.linalg.svd(centred, full_matrices=False)[2]
    local = centred @ axes.T
    tree = cKDTree(local)
    reach = tolerance * float(np.linalg.norm(np.ptp(local, axis=0)))
    mirrors = np.ones((3, 3)) - 2 * np.eye(3)
    return float(max((tree.query(local * mirror)[0] <= 2 * reach).mean() for mirror in mirrors))


def splats(points: NDArray[np.float64]) -> SurfaceSamples:
    """Return samples of a cloud of all sides, with normals away from its middle."""
    distances, index = cKDTree(points).query(points, min(15, len(points)))
    around = points[index]
    centred = around - around.mean(axis=1, keepdims=True)
    _, vectors = np.linalg.eigh(np.einsum("nki,nkj->nij", centred, centred))
    normals = vectors[:, :, 0]
    outward = points - points.mean(axis=0)
    normals = np.where(((normals * outward).sum(axis=1) < 0)[:, None], -normals, normals)
    spacing = float(np.median(distances[:, min(4, distances.shape[1] - 1)]))
    return SurfaceSamples(points, normals, np.full(len(points), spacing**2), spacing)


def visible_flatness(points: NDArray[np.float64], level: float) -> float:
    """Return the share of points within half a level of their dominant plane, by seeded sampling."""
    rng = np.random.default_rng(0)
    points = points[np.linspace(0, len(points) - 1, min(len(points), 2000)).astype(np.int64)]
    a, b, c = points[rng.integers(0, len(points), (3, 200))]
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1)
    normals = normals[lengths > 0] / lengths[lengths > 0, None]
    offsets = (normals * a[lengths > 0]).sum(axis=1)
    inside = np.abs(points @ normals.T - offsets) <= level / 2
    return float(inside.mean(axis=0).max())
