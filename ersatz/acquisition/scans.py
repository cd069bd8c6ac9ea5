"""Scan: one point cloud of one object, in metres, checked; and how a file becomes one."""

import hashlib
import warnings
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ersatz.acquisition.cloud_files import read_cloud
from ersatz.acquisition.clouds import Cloud
from ersatz.acquisition.meshes import Mesh
from ersatz.errors import ErsatzWarning, ScanError
from ersatz.measurements import Origin, Source

FEWEST_POINTS: Final = 30
"""Distinct points below which a cloud says nothing about a shape."""

LARGEST_OBJECT: Final = 5.0
"""Diagonal in metres beyond which a scan is suspected to be in millimetres."""

SMALLEST_OBJECT: Final = 0.002
"""Diagonal in metres below which a scan is suspected to be in another unit."""

ENOUGH_POINTS: Final = 500_000
"""Points beyond which a cloud is thinned at reading; nothing here needs more."""

UNITS: Final = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254}
"""Units of length a file may be in, metres."""


@dataclass(frozen=True, slots=True, eq=False)
class Scan:
    """A point cloud of one object.

    Attributes
    ----------
    points : (n, 3) float64 array, metres
    object_class, instance, observation : str
        What it is, which one, and which view of it; may be empty for an unknown object.
    normals : (n, 3) float64 array or None
        Unit normals, where the file has them.
    colours : (n, 3) float64 array in [0, 1], or None
    sensor : (3,) float64 array, metres, or None
        Where the sensor stood, in the frame of the points; None if the cloud shows all sides.
    mesh : Mesh or None
        The whole surface, where it is known.
    virtual : bool
        Whether a virtual camera took it of a mesh whose geometry is measured itself.
    group : str
        Scans of one product under several names share it; for honest splits.
    mass : float or None, kg
        Measured mass of the object.
    origin : Origin
        MACHINE for a scan of a thing, SYNTHETIC for a model of one.
    source : Source

    Raises
    ------
    ScanError
        If an array has the wrong shape, there are no points, or a coordinate is not finite.
    """

    points: NDArray[np.float64]
    object_class: str = ""
    instance: str = ""
    observation: str = ""
    normals: NDArray[np.float64] | None = None
    colours: NDArray[np.float64] | None = None
    sensor: NDArray[np.float64] | None = None
    mesh: Mesh | None = None
    virtual: bool = False
    group: str = ""
    mass: float | None = None
    origin: Origin = Origin.MACHINE
    source: Source = field(default_factory=lambda: Source("memory"))

    def __post_init__(self) -> None:
        """Refuse what makes no sense."""
        if self.points.ndim != 2 or self.points.shape[1] != 3 or not len(self.points):
            raise ScanError(
                f"{self.label}: points must have shape (n, 3) with n > 0, not {self.points.shape}"
            )
        if not np.isfinite(self.points).all():
            raise ScanError(f"{self.label}: a coordinate is not a finite number; leave such points out")
        for name, values in (("normals", self.normals), ("colours", self.colours)):
            if values is not None and values.shape != self.points.shape:
                raise ScanError(
                    f"{self.label}: {name} have shape {values.shape}, the points {self.points.shape}"
                )
        if self.mass is not None and not 0 < self.mass < 1000:
            raise ScanError(f"{self.label}: a mass of {self.mass} kg is not between 0 and 1000 kg")

    @property
    def label(self) -> str:
        """How messages call it."""
        return " ".join(filter(None, (self.instance, self.observation))) or self.source.name

    @property
    def partial(self) -> bool:
        """Whether it shows the object from one side only."""
        return self.sensor is not None


def read_scan(
    path: str | Path,
    object_class: str = "",
    instance: str = "",
    observation: str = "",
    *,
    unit: str = "m",
    sensor: NDArray[np.float64] | None = None,
) -> Scan:
    """Read one scan from a PCD, PLY, OBJ, STL, DAE, XYZ or NPZ file.

    A PCD file without triangles is taken for one view from its VIEWPOINT (as RGB-D cameras write it),
    other files without triangles for a view only if they or `sensor` say where the sensor stood.

    Parameters
    ----------
    path : str or Path
    object_class, instance, observation : str
        An empty instance becomes the file's stem.
    unit : str
        Of the file: m, cm, mm or in.
    sensor : (3,) array or None, in the file's unit
        Where the sensor stood, if the file does not say it.

    Returns
    -------
    Scan

    Raises
    ------
    ScanError
        If the file is missing or broken, holds fewer than 30 distinct points, points on one line or a mesh
        in one plane, or its unit is not credible.
    MissingDependencyError
        If a DAE file is read without open3d.

    Warns
    -----
    ErsatzWarning
        If most points are not finite, all points of a cloud lie in one plane, or there are too many.
    """
    path = Path(path)
    if unit not in UNITS:
        raise ScanError(f"unknown unit {unit!r}; known are {', '.join(UNITS)}")
    cloud = read_cloud(path)
    viewpoint = cloud.viewpoint if sensor is None else np.asarray(sensor, dtype=np.float64)
    scan = _from_cloud(cloud, UNITS[unit], str(path))
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    return replace(
        scan,
        object_class=object_class,
        instance=instance or path.stem,
        observation=observation,
        sensor=None if viewpoint is None or cloud.triangles is not None else viewpoint * UNITS[unit],
        source=Source(path.name, digest),
    )


def _from_cloud(cloud: Cloud, scale: float, name: str) -> Scan:
    """Return a scan of the points that are fit for use."""
    if not len(cloud.points):
        raise ScanError(f"{name}: it holds no points")
    if cloud.triangles is not None and len(cloud.triangles):
        try:
            mesh = Mesh(cloud.points * scale, cloud.triangles)
        except ScanError as error:
            raise ScanError(f"{name}: {error}") from error
        check_extent(mesh.vertices, name, fewest=3)
        return Scan(mesh.vertices, mesh=mesh)
    keep = usable(cloud.points * scale, name)
    points = cloud.points[keep] * scale
    check_extent(points, name)
    return Scan(
        points,
        normals=None if cloud.normals is None else cloud.normals[keep],
        colours=None if cloud.colours is None else cloud.colours[keep],
    )


def usable(points: NDArray[np.float64], name: str) -> NDArray[np.int64]:
    """Return the indices of finite, distinct points, thinned if there are very many.

    Depth sensors fill what they do not see with NaN or with the origin, so that is no error by itself.
    """
    finite = np.flatnonzero(np.isfinite(points).all(axis=1) & (points != 0).any(axis=1))
    if len(finite) < len(points) / 2:
        warnings.warn(
            f"{name}: {len(points) - len(finite)} of {len(points)} points are not finite and were left out",
            ErsatzWarning,
            stacklevel=3,
        )
    if len(finite) > ENOUGH_POINTS:
        warnings.warn(
            f"{name}: {len(finite)} points, of which every {-(-len(finite) // ENOUGH_POINTS)}th was used",
            ErsatzWarning,
            stacklevel=3,
        )
        finite = finite[:: -(-len(finite) // ENOUGH_POINTS)]
    _, first = np.unique(points[finite], axis=0, return_index=True)
    return finite[np.sort(first)]


def check_extent(points: NDArray[np.float64], name: str, fewest: int = FEWEST_POINTS) -> None:
    """Refuse points that are too few, on one line, or in another unit than metres; warn of a plane.

    Parameters
    ----------
    points : (n, 3) array, metres
        Distinct points.
    name : str
        How the message calls them.
    fewest : int
        How many points there must be.

    Raises
    ------
    ScanError
        As said above.
    """
    if len(points) < fewest:
        raise ScanError(f"{name}: {len(points)} distinct point(s); a shape needs at least {fewest}")
    diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
    if diagonal > LARGEST_OBJECT:
        raise ScanError(
            f"{name}: {diagonal:.4g} m across: is it in millimetres, or does it show the room? Give its unit"
        )
    if diagonal < SMALLEST_OBJECT:
        raise ScanError(f"{name}: {diagonal:.4g} m across is too small for an object; give its unit")
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False) / np.sqrt(len(points))
    if spread[1] < 1e-4 * diagonal:
        raise ScanError(f"{name}: all {len(points)} points lie on one line")
    if spread[2] < 1e-6 * diagonal:
        warnings.warn(f"{name}: all {len(points)} points lie in one plane", ErsatzWarning, stacklevel=3)
