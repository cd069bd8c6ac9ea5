"""Convex hulls: their corners, volume and facets, and the smallest box around them."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from ersatz.acquisition.cavities import rotation_to


def hull_corners(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the corners of the convex hull of at most a few thousand points; a flat cloud as it is."""
    if len(points) > 20_000:
        points = points[np.linspace(0, len(points) - 1, 20_000).astype(np.int64)]
    try:
        corners: NDArray[np.float64] = points[ConvexHull(points).vertices]
    except QhullError:
        return points
    return corners


def hull_volume(corners: NDArray[np.float64]) -> float:
    """Return the volume of the convex hull, m³; 0 of a flat one."""
    try:
        return float(ConvexHull(corners).volume)
    except QhullError:
        return 0.0


def facet_normals(corners: NDArray[np.float64], most: int, apart: float) -> NDArray[np.float64]:
    """Return outward normals of the largest facets of a convex hull.

    Parameters
    ----------
    corners : (n, 3) array, metres
    most : int
    apart : float, degrees
        Facets closer in direction are one.

    Returns
    -------
    (k, 3) array, k <= most, largest facet first; empty if the points are flat
    """
    try:
        hull = ConvexHull(corners)
    except QhullError:
        return np.zeros((0, 3))
    a, b, c = corners[hull.simplices].transpose(1, 0, 2)
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    normals = hull.equations[:, :3]
    near = normals @ normals.T > np.cos(np.radians(apart))
    left = areas.copy()
    chosen: list[NDArray[np.float64]] = []
    while len(chosen) < most and left.max() > 0:
        best = int((near @ left).argmax())
        mine = near[best] & (left > 0)
        mean = (normals[mine] * left[mine, None]).sum(axis=0)
        chosen.append(mean / np.linalg.norm(mean))
        left[mine] = 0
    return np.array(chosen).reshape(-1, 3)


def oriented_box(corners: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the smallest box around points that has a face flush with a facet of their hull.

    Parameters
    ----------
    corners : (n, 3) array, metres
        Corners of the convex hull.

    Returns
    -------
    size : (3,) array, metres, longest first
    axes : (3, 3) array
        Unit directions of the edges, as rows.
    """
    normals = facet_normals(corners, 60, 3.0)
    if not len(normals):
        normals = np.linalg.svd(corners - corners.mean(axis=0))[2][2:]
    best, box = np.inf, (np.zeros(3), np.eye(3))
    for normal in normals:
        frame = rotation_to(normal)
        local = corners @ frame.T
        height = float(np.ptp(local[:, 2]))
        try:
            flat = local[ConvexHull(local[:, :2]).vertices, :2]
        except QhullError:
            flat = local[:, :2]
        sides = np.roll(flat, -1, axis=0) - flat
        angles = np.arctan2(sides[:, 1], sides[:, 0])
        along = flat @ np.stack([np.cos(angles), np.sin(angles)])
        across = flat @ np.stack([-np.sin(angles), np.cos(angles)])
        areas = np.ptp(along, axis=0) * np.ptp(across, axis=0)
        turn = int(areas.argmin())
        if areas[turn] * max(height, 1e-6) < best:
            best = float(areas[turn] * max(height, 1e-6))
            cosine, sine = np.cos(angles[turn]), np.sin(angles[turn])
            plane = np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]])
            box = (np.array([np.ptp(along[:, turn]), np.ptp(across[:, turn]), height]), plane @ frame)
    order = np.argsort(-box[0], kind="stable")
    return box[0][order], box[1][order]
