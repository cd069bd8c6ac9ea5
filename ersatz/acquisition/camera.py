"""A virtual RGB-D camera: what a real depth sensor would see of a mesh from one side."""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ersatz.acquisition.depth_sensor import Intrinsics, SensorNoise, add_noise
from ersatz.acquisition.extras import open3d
from ersatz.acquisition.meshes import Mesh
from ersatz.errors import InputError, ScanError


@dataclass(frozen=True, slots=True)
class CameraSettings:
    """Where the camera stands and what it is.

    Attributes
    ----------
    views : int
        Number of views of an object, spread evenly over the viewing sphere.
    distance : float, metres
        From the sensor to the object's middle (Washington: about 0.7).
    upper : bool
        Only look from 20 to 70 degrees above the file's xy-plane, as Washington's camera did; else from all
        sides.
    fewest : int
        Pixels below which a view is not taken, but one from 20 degrees beside it.
    seed : int
    intrinsics : Intrinsics
    noise : SensorNoise
    """

    views: int = 6
    distance: float = 0.7
    upper: bool = True
    fewest: int = 200
    seed: int = 0
    intrinsics: Intrinsics = field(default_factory=Intrinsics)
    noise: SensorNoise = field(default_factory=SensorNoise)

    def __post_init__(self) -> None:
        """Refuse what makes no sense."""
        if self.views < 1:
            raise InputError(f"views = {self.views}: at least one view of an object is needed")
        if not 0.2 <= self.distance <= 10:
            raise InputError(f"distance = {self.distance} m: the sensor sees from 0.2 m to 10 m")


def viewing_directions(settings: CameraSettings, seed: int = 0) -> NDArray[np.float64]:
    """Return unit vectors from the object to the camera.

    They lie on a Fibonacci spiral, turned at random about a random axis (about z if only from above).

    Returns
    -------
    (views, 3) array, dimensionless
    """
    rng = np.random.default_rng([settings.seed, seed])
    index = np.arange(settings.views) + 0.5
    turn = np.pi * (1 + np.sqrt(5)) * index + rng.uniform(0, 2 * np.pi)
    height = 1 - 2 * index / settings.views
    if settings.upper:
        # Elevations between 20 and 70 degrees: Washington's turntable was seen from 30, 45 and 60.
        height = np.sin(np.radians(20 + 50 * index / settings.views))
    radius = np.sqrt(1 - height**2)
    directions = np.stack([radius * np.cos(turn), radius * np.sin(turn), height], axis=1)
    if settings.upper:
        return directions
    rotation, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turned: NDArray[np.float64] = directions @ rotation.T
    return turned


def look_at(eye: NDArray[np.float64], target: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the (3, 3) rotation whose rows are the camera's right, down and forward axes."""
    forward = (target - eye) / np.linalg.norm(target - eye)
    up = np.array([0.0, 0.0, 1.0]) if abs(forward[2]) < 0.99 else np.array([0.0, 1.0, 0.0])
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(forward, right), forward])


class VirtualCamera:
    """Takes pictures of one mesh."""

    def __init__(self, mesh: Mesh, settings: CameraSettings) -> None:
        self.mesh = mesh
        self.settings = settings
        library = open3d()
        self._scene = library.t.geometry.RaycastingScene(1)
        self._scene.add_triangles(
            library.core.Tensor(mesh.vertices.astype(np.float32)),
            library.core.Tensor(mesh.triangles.astype(np.uint32)),
        )

    def views(self, seed: int = 0) -> Iterator[tuple[NDArray[np.float64], NDArray[np.float64]]]:
        """Yield (points, eye) of each view, in the mesh's frame, metres; `seed` tells objects apart."""
        for number, first in enumerate(viewing_directions(self.settings, seed)):
            direction = first
            rng = np.random.default_rng([self.settings.seed, seed, number])
            for _ in range(10):
                eye = self.mesh.centre + direction * self.settings.distance
                points = self.view(eye, [self.settings.seed, seed, number])
                if len(points) >= self.settings.fewest:
                    break
                # A sheet seen from its edge: a robot would step aside, and so does the camera.
                aside = direction + np.tan(np.radians(20)) * np.cross(direction, rng.normal(size=3))
                direction = aside / np.linalg.norm(aside)
            yield points, eye

    def view(self, eye: NDArray[np.float64], seed: int | list[int] = 0) -> NDArray[np.float64]:
        """Return what is seen from `eye`, looking at the mesh's middle.

        Parameters
        ----------
        eye : (3,) array, metres
            The sensor's position in the mesh's frame.
        seed : int or list of int
            Of the noise.

        Returns
        -------
        (n, 3) array, metres
            Points in the mesh's frame, one a pixel that hit the surface; possibly none.

        Raises
        ------
        ScanError
            If the camera stands inside the object.
        """
        camera = self.settings.intrinsics
        axes = look_at(eye, self.mesh.centre)
        rays, rows, columns = self._rays(axes, eye, np.random.default_rng(seed))
        depth, slant = self._cast(rays, axes, eye)
        noisy = add_noise(depth, slant, camera, self.settings.noise, np.random.default_rng(seed))
        seen = np.isfinite(noisy)
        z = noisy[seen]
        x = (np.broadcast_to(columns, depth.shape)[seen] - camera.cx) / camera.fx * z
        y = (np.broadcast_to(rows[:, None], depth.shape)[seen] - camera.cy) / camera.fy * z
        points: NDArray[np.float64] = np.stack([x, y, z], axis=1) @ axes + eye
        return points

    def _rays(
        self, axes: NDArray[np.float64], eye: NDArray[np.float64], rng: np.random.Generator
    ) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.int64]]:
        """Return ray directions (h, w, 3), and the rows and columns of the pixels that can meet the mesh."""
        camera = self.settings.intrinsics
        local = (self.mesh.vertices - eye) @ axes.T
        if local[:, 2].min() <= 0.05:
            raise ScanError(
                f"the camera stands inside the object or within 5 cm of it: {local[:, 2].min():.3f} m"
            )
        u = local[:, 0] / local[:, 2] * camera.fx + camera.cx
        v = local[:, 1] / local[:, 2] * camera.fy + camera.cy
        columns = np.arange(max(int(u.min()) - 2, 0), min(int(u.max()) + 3, camera.width))
        rows = np.arange(max(int(v.min()) - 2, 0), min(int(v.max()) + 3, camera.height))
        shape = (len(rows), len(columns))
        jitter = rng.normal(0, self.settings.noise.lateral, (2, *shape)) if self.settings.noise.lateral else 0
        grid = np.stack(np.broadcast_arrays(columns[None, :], rows[:, None])) + jitter
        rays = np.stack(
            [(grid[0] - camera.cx) / camera.fx, (grid[1] - camera.cy) / camera.fy, np.ones(shape)], axis=-1
        )
        return rays, rows, columns

    def _cast(
        self, rays: NDArray[np.float64], axes: NDArray[np.float64], eye: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return depth (h, w) along the optical axis, metres, inf where nothing is; and cos of the slant."""
        library = open3d()
        world = rays @ axes
        packed = np.concatenate([np.broadcast_to(eye, world.shape), world], axis=-1).astype(np.float32)
        hit = self._scene.cast_rays(library.core.Tensor(packed), nthreads=1)
        depth = hit["t_hit"].numpy().astype(np.float64)
        normals = hit["primitive_normals"].numpy().astype(np.float64)
        lengths = np.linalg.norm(world, axis=-1)
        return depth, np.abs((normals * world).sum(axis=-1)) / lengths


def cloud_view(points: NDArray[np.float64], eye: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return those points of a cloud of all sides that are seen from `eye`.

    By hidden point removal (Katz, Tal, Basri, 2007); the sensor's noise is already in the points.

    Parameters
    ----------
    points : (n, 3) array, metres
    eye : (3,) array, metres

    Returns
    -------
    (m, 3) array, metres

    Raises
    ------
    ScanError
        If nothing is seen.
    """
    library = open3d()
    cloud = library.geometry.PointCloud(library.utility.Vector3dVector(points))
    reach = float(np.linalg.norm(np.ptp(points, axis=0))) * 1000
    try:
        _, index = cloud.hidden_point_removal(eye, reach)
    except RuntimeError as error:
        raise ScanError(
            f"{len(points)} points cannot be seen from {np.round(eye, 3).tolist()} m: {error}"
        ) from error
    seen: NDArray[np.float64] = points[np.sort(np.asarray(index))]
    return seen
