"""Mesh: a triangulated surface in metres, and what can be said of it without any library but numpy."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ersatz.errors import ScanError

FLATTEST: Final = 1e-3
"""Thickness of a surface, as a share of its length, below which it is one side of an object and no whole.

On things of up to half a metre that is less than the half millimetre by which a depth sensor errs
(`depth_sensor.SensorNoise`): no other side was seen. The thinnest whole scans, notebooks, are at 0.05.
"""


@dataclass(frozen=True, slots=True, eq=False)
class Mesh:
    """A surface of triangles, outward normals by the right-hand rule.

    Attributes
    ----------
    vertices : (v, 3) float64 array, metres
    triangles : (t, 3) int64 array
        Indices into `vertices`.

    Raises
    ------
    ScanError
        If there is no triangle with an area, a coordinate is not finite, an index points nowhere, or the
        surface is flat: nothing is measured on one side of a thing that would be true of the whole.
    """

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int64]

    def __post_init__(self) -> None:
        """Refuse what makes no sense."""
        vertices, triangles = self.vertices, self.triangles
        if vertices.ndim != 2 or vertices.shape[1] != 3 or triangles.ndim != 2 or triangles.shape[1] != 3:
            raise ScanError(
                f"a mesh needs vertices (v, 3) and triangles (t, 3), "
                f"not {vertices.shape} and {triangles.shape}"
            )
        if not len(triangles):
            raise ScanError("a mesh needs at least one triangle; this one has none")
        if triangles.min() < 0 or triangles.max() >= len(vertices):
            raise ScanError(
                f"a triangle names vertex {triangles.max()} (smallest {triangles.min()}) "
                f"of {len(vertices)} vertices"
            )
        if not np.isfinite(vertices).all():
            raise ScanError(
                f"{int((~np.isfinite(vertices)).any(axis=1).sum())} vertices are not finite numbers"
            )
        if not self.areas.sum() > 0:
            raise ScanError("the mesh has no surface: the area of all its triangles is 0")
        length, thickness = self._reach()
        if thickness < FLATTEST * length:
            raise ScanError(
                f"flat: the mesh is {length:.3g} m long and {thickness:.1g} m thick; it shows one side of an "
                "object, leave it out or scan the object whole"
            )

    def _reach(self) -> tuple[float, float]:
        """Return the extents of the surface along its first and last principal axes, metres."""
        used = self.vertices[np.unique(self.triangles)]
        centred = used - used.mean(axis=0)
        _, axes = np.linalg.eigh(centred.T @ centred)
        thickness, _, length = np.ptp(centred @ axes, axis=0)
        return float(length), float(thickness)

    @property
    def corners(self) -> NDArray[np.float64]:
        """The (t, 3, 3) corner points of the triangles, metres."""
        return self.vertices[self.triangles]

    @property
    def crosses(self) -> NDArray[np.float64]:
        """The (t, 3) normals of the triangles, their length twice the area, m²."""
        a, b, c = self.corners.transpose(1, 0, 2)
        return np.cross(b - a, c - a)

    @property
    def areas(self) -> NDArray[np.float64]:
        """The (t,) areas of the triangles, m²."""
        lengths: NDArray[np.float64] = np.linalg.norm(self.crosses, axis=1)
        return lengths / 2

    @property
    def centre(self) -> NDArray[np.float64]:
        """The (3,) middle of the axis-parallel bounding box, metres."""
        middle: NDArray[np.float64] = (self.vertices.min(axis=0) + self.vertices.max(axis=0)) / 2
        return middle

    @property
    def diagonal(self) -> float:
        """The diagonal of the axis-parallel bounding box, metres."""
        return float(np.linalg.norm(np.ptp(self.vertices[np.unique(self.triangles)], axis=0)))

    def moved(self, rotation: NDArray[np.float64], shift: NDArray[np.float64] | float = 0.0) -> "Mesh":
        """Return the mesh with every vertex v at `rotation @ v + shift` (metres)."""
        return Mesh(self.vertices @ rotation.T + shift, self.triangles)

    def scaled(self, factor: float) -> "Mesh":
        """Return the mesh `factor` times as large about the origin."""
        return Mesh(self.vertices * factor, self.triangles)

    def joined(self, *others: "Mesh") -> "Mesh":
        """Return one mesh with the triangles of all."""
        meshes = (self, *others)
        starts = np.cumsum([0, *(len(m.vertices) for m in meshes[:-1])])
        return Mesh(
            np.concatenate([m.vertices for m in meshes]),
            np.concatenate([m.triangles + start for m, start in zip(meshes, starts, strict=True)]),
        )

    def sampled(self, count: int, seed: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return points spread evenly over the surface, and the normals there.

        Parameters
        ----------
        count : int
        seed : int

        Returns
        -------
        points : (count, 3) array, metres
        normals : (count, 3) array, unit length
        """
        rng = np.random.default_rng(seed)
        areas = self.areas
        # Stratified along the summed areas, so that small faces are not left out by chance.
        ticks = (np.arange(count) + rng.random(count)) / count * areas.sum()
        chosen = np.minimum(np.searchsorted(np.cumsum(areas), ticks), len(areas) - 1)
        u, v = rng.random((2, count))
        root = np.sqrt(u)
        a, b, c = self.corners[chosen].transpose(1, 0, 2)
        points = a * (1 - root)[:, None] + b * (root * (1 - v))[:, None] + c * (root * v)[:, None]
        crosses = self.crosses[chosen]
        return points, crosses / np.maximum(np.linalg.norm(crosses, axis=1, keepdims=True), 1e-300)
