"""Measured geometry: what the surface of an object alone tells, and nothing where it does not tell.

Every number has a unit and a definition in `Geometry`. A single view measures the size and flatness of what
it sees, and refuses the rest: nobody knows from one side how deep a cup is.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ersatz.acquisition.cavities import Filling, fill, rotation_to, sample_densely
from ersatz.acquisition.hulls import facet_normals, hull_corners, hull_volume, oriented_box
from ersatz.acquisition.meshes import Mesh
from ersatz.acquisition.scans import Scan, check_extent
from ersatz.acquisition.surfaces import best_support, silhouette, splats, symmetry, visible_flatness
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
    hull = hull_corners(scan.points)
    size, _ = oriented_box(hull)
    elongation = 1 - float(size[1] / size[0])
    if scan.partial:
        flat = visible_flatness(scan.points, settings.level)
        volume = hull_volume(hull)
        return Geometry(
            size, volume, None, elongation, flat, None, None, None, None, None, None, None, partial=True
        )
    samples = splats(scan.points)
    support, flatness = best_support(samples, hull, settings.level, settings.slope)
    return Geometry(
        size,
        hull_volume(hull),
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
    hull = hull_corners(np.concatenate([used, points]))
    size, axes = oriented_box(hull)
    samples = sample_densely(mesh, max(float(size[0]) / 120, 2e-4))
    support, flatness = best_support(samples, hull, settings.level, settings.slope)
    up, filling = best_filling(mesh, hull, axes, settings)
    volume = hull_volume(hull)
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
