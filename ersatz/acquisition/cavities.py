"""Cavities: what a surface holds when water is poured over it, and whether that is a hollow or a scan hole.

The surface is cut into voxels. For an up-direction, a voxel of air holds water if every way out of it leads
over something higher. The surface's own orientation tells air from material: water that only touches
the back of the surface has entered through a hole in the scan.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from ersatz.acquisition.meshes import Mesh


@dataclass(frozen=True, slots=True, eq=False)
class Filling:
    """Water in and on an object, for one up-direction.

    Attributes
    ----------
    open : float, m³
        Held by cavities open to above.
    closed : float, m³
        In voids that the surface encloses and faces, such as under a lid.
    doubtful : float, m³
        Held where the surface does not tell air from material: its sides contradict each other.
    """

    open: float
    closed: float
    doubtful: float


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceSamples:
    """Points dense enough on a surface that no voxel it crosses is missed.

    Attributes
    ----------
    points : (n, 3) array, metres
    normals : (n, 3) array, unit length
    weights : (n,) array, m²
        Area that each point stands for.
    spacing : float, metres
        Distance below which every point of the surface has a sample.
    """

    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    weights: NDArray[np.float64]
    spacing: float


def sample_densely(mesh: Mesh, spacing: float) -> SurfaceSamples:
    """Return rows of samples over each triangle, rows and samples at most `spacing` (metres) apart."""
    solid = mesh.areas > 1e-9 * spacing**2
    corners, areas = mesh.corners[solid], mesh.areas[solid]
    unit = mesh.crosses[solid] / (2 * areas)[:, None]
    edges = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    turn = (edges.argmax(axis=1)[:, None] + np.arange(3)) % 3
    a, b, c = np.take_along_axis(corners, turn[:, :, None], axis=1).transpose(1, 0, 2)
    along = np.ceil(edges.max(axis=1) / spacing).astype(np.int64)
    # The first row lies on the longest edge: the tips of thin triangles have no other.
    rows = np.ceil(2 * areas / edges.max(axis=1) / spacing).astype(np.int64) + 1
    owner = np.repeat(np.arange(len(areas)), along * rows)
    number = np.arange(len(owner)) - np.repeat(np.cumsum(along * rows) - along * rows, along * rows)
    up = (number // along[owner] + 0.02) / (rows[owner] - 0.48)
    across = (number % along[owner] + 0.5) / along[owner]
    base = a[owner] + across[:, None] * (b - a)[owner]
    points = base + up[:, None] * (c[owner] - base)
    weights = areas[owner] * (1 - up) / np.bincount(owner, 1 - up)[owner]
    return SurfaceSamples(points, unit[owner], weights, spacing)


@dataclass(frozen=True, slots=True, eq=False)
class _Grid:
    """Voxels around a surface; axis 2 points up, one empty voxel on every side.

    `facing` is the share of a voxel's surface that looks along -x, +x, -y, +y, -z, +z; `offset` is the signed
    distance from the surface to the voxel's centre in edges, positive on the outer side.
    """

    wall: NDArray[np.bool_]
    facing: NDArray[np.float32]
    offset: NDArray[np.float32]
    edge: float


def _voxels(samples: SurfaceSamples, rotation: NDArray[np.float64], edge: float) -> _Grid:
    """Return the voxels a surface crosses, with their area-weighted normal and distance to the centre."""
    points = samples.points @ rotation.T
    cells = np.floor((points - points.min(axis=0)) / edge).astype(np.int64) + 1
    shape = tuple(int(n) for n in cells.max(axis=0) + 2)
    key = np.ravel_multi_index(tuple(cells.T), shape)
    filled, inverse = np.unique(key, return_inverse=True)
    weight = np.bincount(inverse, samples.weights)
    normals = samples.normals @ rotation.T
    sides = [np.bincount(inverse, samples.weights * np.maximum(s * n, 0)) for n in normals.T for s in (-1, 1)]
    middle = (cells - 0.5) * edge + points.min(axis=0)
    ahead = ((middle - points) * normals).sum(axis=1) / edge
    offset = np.bincount(inverse, samples.weights * ahead) / weight
    wall = np.zeros(shape, dtype=bool)
    wall.ravel()[filled] = True
    facing = np.zeros((6, *shape), dtype=np.float32)
    facing.reshape(6, -1)[:, filled] = np.stack(sides) / weight
    offset_grid = np.zeros(shape, dtype=np.float32)
    offset_grid.ravel()[filled] = offset
    return _Grid(wall, facing, offset_grid, edge)


def _wet(wall: NDArray[np.bool_], plug: int) -> NDArray[np.bool_]:
    """Return the air voxels that hold water once holes up to `plug` voxels around are closed.

    Walls are thickened sideways only, so that neither brim nor floor rises, and thinned again.
    """
    if plug == 0:
        return ~wall & ~_drained(wall)
    sideways = np.zeros((3, 3, 3), dtype=bool)
    sideways[:, 1, 1] = sideways[1, :, 1] = True
    wide = np.pad(wall, ((plug, plug), (plug, plug), (0, 0)))
    thick = ndimage.binary_dilation(wide, sideways, plug)
    wet = ~thick & ~_drained(thick)
    grown: NDArray[np.bool_] = ndimage.binary_dilation(wet, sideways, plug, mask=~wide)
    return grown[plug:-plug, plug:-plug]


def _drained(wall: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the air voxels from which water flows away, never climbing.

    Slice by slice upwards: the air of a slice falls into connected parts, which join the parts below
    them. What is joined to the border of the grid at that height is drained.
    """
    shape = wall.shape
    drained = np.zeros(shape, dtype=bool)
    parent = [0]  # Number 0 is the outside.
    below = np.zeros(shape[:2], dtype=np.int64)
    below_air = np.zeros(shape[:2], dtype=bool)
    for height in range(shape[2]):
        air = ~wall[:, :, height]
        parts, count = ndimage.label(air)
        start = len(parent)
        parent.extend(range(start, start + count))
        numbers = np.where(air, parts + start - 1, -1)
        pairs = np.unique(numbers[air & below_air] * (start + count) + below[air & below_air])
        for pair in pairs.tolist():
            _unite(parent, *divmod(pair, start + count))
        border = np.concatenate([numbers[0], numbers[-1], numbers[:, 0], numbers[:, -1]])
        for part in np.unique(border[border >= 0]).tolist():
            _unite(parent, part, 0)
        if height in (0, shape[2] - 1):
            for part in np.unique(numbers[air]).tolist():
                _unite(parent, part, 0)
        outside = np.array([_find(parent, i) == 0 for i in range(start, start + count)] or [False])
        drained[:, :, height] = air & outside[np.maximum(numbers - start, 0)]
        below, below_air = numbers, air
    return drained


def _find(parent: list[int], item: int) -> int:
    while parent[item] != item:
        parent[item] = parent[parent[item]]
        item = parent[item]
    return item


def _unite(parent: list[int], one: int, other: int) -> None:
    one, other = _find(parent, one), _find(parent, other)
    parent[max(one, other)] = min(one, other)


def rotation_to(up: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the (3, 3) rotation that turns the direction `up` to +z."""
    up = up / np.linalg.norm(up)
    side = np.cross(up, [1.0, 0, 0] if abs(up[0]) < 0.9 else [0, 1.0, 0])
    side /= np.linalg.norm(side)
    return np.stack([side, np.cross(up, side), up])


def fill(samples: SurfaceSamples, up: NDArray[np.float64], edge: float, plug: float = 0.003) -> Filling:
    """Pour water over a surface and return what stays.

    Parameters
    ----------
    samples : SurfaceSamples
        At most half an edge apart.
    up : (3,) array
        Direction the water comes from.
    edge : float, metres
        Of a voxel.
    plug : float, metres
        Radius of holes that are taken for faults of the scan and closed.

    Returns
    -------
    Filling
    """
    grid = _voxels(samples, rotation_to(up), edge)
    wet = _wet(grid.wall, round(plug / edge))
    if not wet.any():
        return Filling(0.0, 0.0, 0.0)
    reachable, _ = ndimage.label(~grid.wall)
    outside = reachable == reachable[0, 0, 0]
    pools, count = ndimage.label(wet)
    facing, touching, partial = _banks(grid, pools, count)
    sizes = np.bincount(pools.ravel(), minlength=count + 1)[1:] + partial
    volumes = sizes * edge**3
    # A pool of fewer voxels than this is a dent between voxels, not a cavity.
    real = sizes >= 30
    share = facing / np.maximum(touching, 1e-12)
    enclosed = ~ndimage.labeled_comprehension(outside, pools, np.arange(1, count + 1), np.any, bool, False)
    air = real & (share > 0.7)
    # Water from outside that touches the back of the surface: a scan hole, or a vessel of one sheet.
    doubtful = real & ~air & ((share > 0.3) | ~enclosed)
    return Filling(
        float(volumes[air & ~enclosed].sum()),
        float(volumes[air & enclosed].sum()),
        float(volumes[doubtful].sum()),
    )


def _banks(
    grid: _Grid, pools: NDArray[np.int32], count: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return for each pool: bank faces that look at it, all bank faces, and its share of bank voxels.

    A voxel that the surface crosses is partly water: the part on the outer side of the surface.
    """
    facing, touching = np.zeros(count + 1), np.zeros(count + 1)
    owner = np.zeros(grid.wall.shape, dtype=np.int64)
    thin = np.zeros(grid.wall.shape, dtype=bool)
    for axis, step in product(range(3), (0, 1)):
        beside = np.roll(pools, 1 - 2 * step, axis)
        bank = grid.wall & (beside > 0)
        towards, away = grid.facing[2 * axis + step][bank], grid.facing[2 * axis + 1 - step][bank]
        pool = beside[bank]
        # A wall thinner than a voxel looks both ways; a hole's other side only ever looks away.
        looks = towards > 0.25 * (towards + away)
        facing += np.bincount(pool, (towards + away) * looks, count + 1)
        touching += np.bincount(pool, towards + away, count + 1)
        owner[bank] = np.where(towards > 0, pool, owner[bank])
        thin[bank] |= np.minimum(towards, away) > 0.1
    banks = owner > 0
    shares = np.clip(0.5 + grid.offset[banks], 0, 1) * ~thin[banks]
    partial: NDArray[np.float64] = np.bincount(owner[banks], shares, count + 1).astype(np.float64)
    return facing[1:], touching[1:], partial[1:]
