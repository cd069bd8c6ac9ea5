"""Measured geometry: what the surface of an object alone tells, and nothing where it does not tell.

Every number has a unit and a definition in `Geometry`. A single view measures the size and flatness of what
it sees, and refuses the rest: nobody knows from one side how deep a cup is.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError, cKDTree

from ersatz.acquisition.cavities import Filling, SurfaceSamples, fill, rotation_to, sample_densely
from ersatz.acquisition.meshes import Mesh
from ersatz.acquisition.scans import Scan, check_extent
from ersatz.errors import InputError


@dataclass(frozen=True, slots=True)
class GeometrySettings:
    """How finely and with what tolerances geometry is measured.

    Attributes
    ----------
    voxels : int
        In the box around the object when volumes are measured.
    coarse_voxels : int
        The same while the best up-direction is searched.
    level : float, metres
        Thickness of what counts as one plane.
    slope : float, degrees
        A surface this steep still carries things.
    doubt : float, dimensionless
        Share of the hull's volume beyond which contradictory surfaces make hollowness unknown.
    """

    voxels: int = 250_000
    coarse_voxels: int = 12_000
    level: float = 0.005
    slope: float = 15.0
    doubt: float = 0.05

    def __post_init__(self) -> None:
        """Refuse what makes no sense."""
        if not 5_000 <= self.coarse_voxels <= self.voxels <= 50_000_000:
            raise InputError(f"voxels = {self.voxels}, coarse_voxels = {self.coarse_voxels}: out of range")


@dataclass(frozen=True, slots=True, eq=False)
class Geometry:
    """What was measured; None is "the surface does not tell".

    Attributes
    ----------
    size : (3,) float64 array, metres
        Edges of the smallest box around it, longest first. A lower bound if `partial`.
    hull_volume : float, m³
        Of the convex hull.
    volume : float or None, m³
        Enclosed by the outer surface, if that is closed and oriented.
    elongation : float, [0, 1)
        1 - width / length.
    flatness : float, [0, 1]
        Share of the upper surface, seen from above, in its dominant plane, in the best stable pose; from
        one view, share of the visible points in their dominant plane.
    hollowness : float or None, [0, 1)
        Volume of the open cavity over the volume of the convex hull.
    containment : float or None, litres
        What can be filled in from the best direction.
    enclosed : float or None, litres
        Of voids that the surface closes in and faces: what a vessel holds under its lid.
    support : float or None, m²
        Largest level area that faces up in a stable pose.
    silhouette : float or None, m²
        Mean area of the shadow over all directions.
    symmetry : float or None, [0, 1]
        Share of the surface that lies on its own mirror image, for the best of three mirrors.
    up : (3,) float64 array or None
        Direction from which most can be filled in, in the scan's frame.
    partial : bool
        Whether one view was all there was.
    """

    size: NDArray[np.float64]
    hull_volume: float
    volume: float | None
    elongation: float
    flatness: float
    hollowness: float | None
    containment: float | None
    enclosed: float | None
    support: float | None
    silhouette: float | None
    symmetry: float | None
    up: NDArray[np.float64] | None
    partial: bool


def measure_geometry(scan: Scan, settings: GeometrySettings | None = None) -> Geometry:
    """Measure the geometry of a scan.

    Parameters
    ----------
    scan : Scan
        With a mesh everything is measured; a cloud of all sides leaves cavities and volume unknown; one
        view leaves all but size, elongation and flatness unknown.
    settings : GeometrySettings or None

    Returns
    -------
    Geometry

    Raises
    ------
    ScanError
        If there are too few points, or they lie on one line.
    """
    settings = settings or GeometrySettings()
    if scan.mesh is not None:
        return _of_mesh(scan.mesh, settings)
    check_extent(scan.points, scan.label)
    hull = _hull(scan.points)
    size, _ = oriented_box(hull)
    elongation = 1 - float(size[1] / size[0])
    if scan.partial:
        flat = _visible_flatness(scan.points, settings)
        volume = _volume_of(hull)
        return Geometry(
            size, volume, None, elongation, flat, None, None, None, None, None, None, None, partial=True
        )
    samples = _splats(scan.points)
    support, flatness = best_support(samples, hull, settings)
    return Geometry(
        size,
        _volume_of(hull),
        None,
        elongation,
        flatness,
        None,
        None,
        None,
        support,
        silhouette(samples),
        symmetry(scan.points),
        None,
        False,
    )


def _of_mesh(mesh: Mesh, settings: GeometrySettings) -> Geometry:
    points, _ = mesh.sampled(4000, 0)
    used = mesh.vertices[np.unique(mesh.triangles)]
    hull = _hull(np.concatenate([used, points]))
    size, axes = oriented_box(hull)
    samples = sample_densely(mesh, max(float(size[0]) / 120, 2e-4))
    support, flatness = best_support(samples, hull, settings)
    up, filling = best_filling(mesh, hull, axes, settings)
    volume = _volume_of(hull)
    known = volume > 0 and filling.doubtful < settings.doubt * volume
    return Geometry(
        size,
        volume,
        enclosed_volume(mesh),
        1 - float(size[1] / size[0]),
        flatness,
        filling.open / volume if known else None,
        filling.open * 1000 if known else None,
        filling.closed * 1000 if known else None,
        support,
        silhouette(samples),
        symmetry(points),
        up,
        False,
    )


def _hull(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the corners of the convex hull of at most a few thousand points; a flat cloud as it is."""
    if len(points) > 20_000:
        points = points[np.linspace(0, len(points) - 1, 20_000).astype(np.int64)]
    try:
        corners: NDArray[np.float64] = points[ConvexHull(points).vertices]
    except QhullError:
        return points
    return corners


def _volume_of(corners: NDArray[np.float64]) -> float:
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


def best_filling(
    mesh: Mesh, corners: NDArray[np.float64], axes: NDArray[np.float64], settings: GeometrySettings
) -> tuple[NDArray[np.float64], Filling]:
    """Return the up-direction in which most can be filled in, and the filling there.

    An opening is a facet of the convex hull, so the largest facets' normals and the box's axes are tried
    first, and the best of them is then tilted in ever smaller steps.
    """
    coarse = _edge(mesh, axes, settings.coarse_voxels)
    samples = sample_densely(mesh, coarse / 2)
    tried = np.concatenate([axes, -axes, facet_normals(corners, 8, 15.0)])
    fillings = [fill(samples, up, coarse) for up in tried]
    held = [_held(filling) for filling in fillings]
    up, most = tried[int(np.argmax(held))], max(held)
    if most > 0:
        for tilt in (0.12, 0.06, 0.03):
            sides = rotation_to(up)[:2]
            around = [
                up + tilt * (np.cos(t) * sides[0] + np.sin(t) * sides[1]) for t in np.arange(6) * np.pi / 3
            ]
            held = [_held(fill(samples, one, coarse)) for one in around]
            # A tilt must be clearly better than noise between voxels to be preferred.
            if max(held) > most * 1.01:
                up, most = around[int(np.argmax(held))], max(held)
                up = up / np.linalg.norm(up)
    fine = _edge(mesh, axes, settings.voxels)
    best = fill(sample_densely(mesh, fine / 2), up, fine)
    # Doubt counts from whatever direction it arises: what is nothing from here may be a bowl from there.
    return up, replace(best, doubtful=max(best.doubtful, *(filling.doubtful for filling in fillings)))


def _held(filling: Filling) -> float:
    return filling.open + filling.closed


def _edge(mesh: Mesh, axes: NDArray[np.float64], voxels: int) -> float:
    """Return the edge of voxels of which so many fill the box around the mesh, metres."""
    spans = np.ptp(mesh.vertices @ axes.T, axis=0)
    volume = float(np.prod(np.maximum(spans, spans.max() / 30)))
    return float(np.cbrt(volume / voxels))


def enclosed_volume(mesh: Mesh) -> float | None:
    """Return the volume inside a closed, consistently oriented surface, m³; None if it is not that."""
    directed = np.concatenate([mesh.triangles[:, [i, (i + 1) % 3]] for i in range(3)])
    points, names = np.unique(mesh.vertices, axis=0, return_inverse=True)
    edges = names.ravel()[directed]
    edges = edges[edges[:, 0] != edges[:, 1]]
    ahead = np.sort(edges[:, 0] * len(points) + edges[:, 1])
    back = np.sort(edges[:, 1] * len(points) + edges[:, 0])
    unmatched = len(np.setdiff1d(ahead, back)) / max(len(ahead), 1)
    a, b, c = (mesh.corners - mesh.centre).transpose(1, 0, 2)
    volume = float((a * np.cross(b, c)).sum() / 6)
    return volume if unmatched < 0.01 and volume > 0 else None


def best_support(
    samples: SurfaceSamples, corners: NDArray[np.float64], settings: GeometrySettings
) -> tuple[float, float]:
    """Return the largest level area in a stable pose (m²), and its share of all that is seen from above."""
    area, share = 0.0, 0.0
    middle = (samples.points * samples.weights[:, None]).sum(axis=0) / samples.weights.sum()
    for down in facet_normals(corners, 10, 8.0):
        rotation = rotation_to(-down)
        if not _stable(corners @ rotation.T, rotation @ middle):
            continue
        found = _level_area(samples, rotation, settings)
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
    samples: SurfaceSamples, rotation: NDArray[np.float64], settings: GeometrySettings
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
    level = np.sort(points[top[upward[top] > np.cos(np.radians(settings.slope))], 2])
    if not len(level):
        return 0.0, 0.0
    count = (np.searchsorted(level, level + settings.level, "right") - np.arange(len(level))).max()
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


def _splats(points: NDArray[np.float64]) -> SurfaceSamples:
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


def _visible_flatness(points: NDArray[np.float64], settings: GeometrySettings) -> float:
    """Return the share of points within half a level of their dominant plane, by seeded sampling."""
    rng = np.random.default_rng(0)
    points = points[np.linspace(0, len(points) - 1, min(len(points), 2000)).astype(np.int64)]
    a, b, c = points[rng.integers(0, len(points), (3, 200))]
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1)
    normals = normals[lengths > 0] / lengths[lengths > 0, None]
    offsets = (normals * a[lengths > 0]).sum(axis=1)
    inside = np.abs(points @ normals.T - offsets) <= settings.level / 2
    return float(inside.mean(axis=0).max())
