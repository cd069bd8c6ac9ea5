"""Parametric models of objects nobody scanned, and of vessels whose capacity is known in closed form.

They are ours and of no real thing: what is measured of them is of synthetic origin.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ersatz.acquisition.meshes import Mesh
from ersatz.errors import InputError


@dataclass(frozen=True, slots=True, eq=False)
class Vessel:
    """A vessel that stands on z = 0, open to +z unless it has a lid.

    Attributes
    ----------
    mesh : Mesh
    capacity : float, litres
        What fits in up to the brim, of the ideal round shape.
    """

    mesh: Mesh
    capacity: float


def box(length: float, width: float, height: float, middle: tuple[float, float, float] = (0, 0, 0)) -> Mesh:
    """Return a box with edges along the axes, metres."""
    corners = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    return Mesh(corners * (length, width, height) + middle, np.array(triangles, dtype=np.int64))


def turned(profile: list[tuple[float, float]], sides: int = 64) -> Mesh:
    """Return a solid of revolution about z.

    Parameters
    ----------
    profile : list of (radius, height), metres
        From the axis at the bottom outside, up, and (for a vessel) back down inside, to the axis.
    sides : int

    Returns
    -------
    Mesh
        Closed if the profile begins and ends on the axis.
    """
    angles = np.arange(sides) * 2 * np.pi / sides
    rings = [
        np.stack([r * np.cos(angles), r * np.sin(angles), np.full(sides, z)], axis=1) for r, z in profile
    ]
    here = np.arange(sides)
    beside = (here + 1) % sides
    strips = []
    for ring in range(len(profile) - 1):
        low, high = ring * sides, (ring + 1) * sides
        if profile[ring][0] > 0:
            strips.append(np.stack([low + here, low + beside, high + beside], axis=1))
        if profile[ring + 1][0] > 0:
            strips.append(np.stack([low + here, high + beside, high + here], axis=1))
    return Mesh(np.concatenate(rings), np.concatenate(strips).astype(np.int64))


def sphere(diameter: float) -> Mesh:
    """Return a ball, metres."""
    turn = np.linspace(-np.pi / 2, np.pi / 2, 33)
    profile = [(float(max(np.cos(t), 0)), float(np.sin(t))) for t in turn]
    profile[0], profile[-1] = (0.0, -1.0), (0.0, 1.0)
    return turned(profile).scaled(diameter / 2)


def cylinder(diameter: float, height: float) -> Mesh:
    """Return a solid cylinder on z = 0, metres."""
    return turned([(0, 0), (diameter / 2, 0), (diameter / 2, height), (0, height)])


def tumbler(bottom: float, top: float, height: float, wall: float, lid: bool = False) -> Vessel:
    """Return a cup: a truncated cone with walls and floor of thickness `wall`.

    Parameters
    ----------
    bottom, top : float, metres
        Inner diameters at the floor and at the brim.
    height : float, metres
        Of the inside.
    wall : float, metres
    lid : bool
        Whether it is closed by a lid as thick as the walls.

    Returns
    -------
    Vessel
        Capacity pi h (R² + R r + r²) / 3.
    """
    r, R = bottom / 2, top / 2
    outer = [(0.0, 0.0), (r + wall, 0.0)]
    inner = [(R, wall + height), (r, wall), (0.0, wall)]
    if lid:
        shell = turned([*outer, (R + wall, 2 * wall + height), (0.0, 2 * wall + height)])
        # The void's surface faces inwards, away from the wall's material.
        void = turned([(0.0, wall + height), *inner])
        mesh = shell.joined(void)
    else:
        mesh = turned([*outer, (R + wall, wall + height), *inner])
    return Vessel(mesh, float(np.pi * height * (R * R + R * r + r * r) / 3 * 1000))


def hemisphere_bowl(diameter: float, wall: float) -> Vessel:
    """Return half a ball shell, open to +z; inner diameter and wall in metres. Capacity 2 pi r³ / 3."""
    r = diameter / 2
    turn = np.linspace(0, np.pi / 2, 24)
    out = [(float(np.sin(t)) * (r + wall), float(-np.cos(t)) * (r + wall)) for t in turn]
    back = [(float(np.sin(t)) * r, float(-np.cos(t)) * r) for t in turn[::-1]]
    out[0], back[-1] = (0.0, -(r + wall)), (0.0, -r)
    out[-1], back[0] = (r + wall, 0.0), (r, 0.0)
    mesh = turned([*out, *back])
    return Vessel(
        Mesh(mesh.vertices + np.array([0, 0, r + wall]), mesh.triangles), float(2 / 3 * np.pi * r**3 * 1000)
    )


def tray(length: float, width: float, height: float, wall: float) -> Vessel:
    """Return a rectangular tray: inner edges, inner height and wall in metres. Capacity l w h."""
    floor = box(length + 2 * wall, width + 2 * wall, wall, (0, 0, wall / 2))
    middle = wall + height / 2
    sides = [
        box(wall, width + 2 * wall, height, (sign * (length + wall) / 2, 0, middle)) for sign in (-1, 1)
    ] + [box(length, wall, height, (0, sign * (width + wall) / 2, middle)) for sign in (-1, 1)]
    return Vessel(floor.joined(*sides), length * width * height * 1000)


def binder(rng: np.random.Generator) -> Mesh:
    """Return a ring binder that lies on its back: two covers, a spine, and the paper between them."""
    length, width = rng.uniform(0.28, 0.32), rng.uniform(0.24, 0.28)
    thick, card = rng.uniform(0.03, 0.08), 0.003
    covers = [box(width, length, card, (0, 0, z)) for z in (card / 2, thick - card / 2)]
    spine = box(card, length, thick, (-width / 2 + card / 2, 0, thick / 2))
    paper = thick * rng.uniform(0.3, 0.9)
    sheets = box(0.21, 0.297 * length / 0.32, paper, (0.005, 0, card + paper / 2))
    return covers[0].joined(covers[1], spine, sheets)


def cap(rng: np.random.Generator) -> Mesh:
    """Return a baseball cap: a thin dome, open below, with a curved peak in front."""
    radius, wall = rng.uniform(0.085, 0.1), 0.0025
    flat = rng.uniform(0.75, 1.0)
    turn = np.linspace(0, np.pi / 2, 16)
    outside = [(float(np.cos(t)) * radius, float(np.sin(t)) * radius * flat) for t in turn]
    inside = [(a * (1 - wall / radius), b * (1 - wall / radius)) for a, b in outside[::-1]]
    outside[-1], inside[0] = (0.0, radius * flat), (0.0, radius * flat * (1 - wall / radius))
    dome = turned([*inside, *outside])
    reach, droop = rng.uniform(0.06, 0.08), rng.uniform(0.005, 0.02)
    across = np.linspace(-1, 1, 21)
    near = np.sqrt(np.maximum(radius**2 - (across * radius * 0.85) ** 2, 0))
    far = near + reach * np.sqrt(np.maximum(1 - across**2, 0))
    rows = []
    for share in np.linspace(0, 1, 5):
        x = near + share * (far - near)
        z = -droop * across**2 - droop * share**2
        rows.append(np.stack([x, across * radius * 0.85, z], axis=1))
    return dome.joined(_sheet(np.stack(rows), wall))


def keyboard(rng: np.random.Generator) -> Mesh:
    """Return a computer keyboard: a flat body and five rows of keys."""
    length, width = rng.uniform(0.36, 0.46), rng.uniform(0.13, 0.17)
    thick, high = rng.uniform(0.012, 0.025), rng.uniform(0.004, 0.009)
    body = box(length, width, thick, (0, 0, thick / 2))
    columns = int(length / 0.021)
    keys = [
        box(0.015, 0.015, high, ((c - (columns - 1) / 2) * 0.0195, (r - 2) * 0.0195, thick + high / 2))
        for c in range(columns)
        for r in range(5)
    ]
    return body.joined(*keys)


def _sheet(grid: NDArray[np.float64], thickness: float) -> Mesh:
    """Return a closed sheet of some thickness over a (rows, columns, 3) grid of points."""
    rows, columns, _ = grid.shape
    top = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = (x.ravel() for x in (top[:-1, :-1], top[1:, :-1], top[1:, 1:], top[:-1, 1:]))
    upper = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    rim = np.concatenate([top[0, :], top[1:, -1], top[-1, -2::-1], top[-2:0:-1, 0]])
    after = np.roll(rim, -1)
    below = rows * columns
    walls = np.concatenate(
        [np.stack([rim, after, after + below], axis=1), np.stack([rim, after + below, rim + below], axis=1)]
    )
    points = np.concatenate([grid.reshape(-1, 3), grid.reshape(-1, 3) - [0, 0, thickness]])
    return Mesh(points, np.concatenate([upper, upper[:, ::-1] + below, walls]).astype(np.int64))


MODELS: Final[dict[str, Callable[[np.random.Generator], Mesh]]] = {
    "binder": binder,
    "cap": cap,
    "keyboard": keyboard,
}
"""Models of the paper's categories without a scan."""


def model(category: str, number: int, seed: int = 0) -> Mesh:
    """Return the parametric model number `number` of a category; the same for the same seed.

    Raises
    ------
    InputError
        If there is no model of the category.
    """
    if category not in MODELS:
        raise InputError(
            f"no parametric model of {category!r}; there are models of {', '.join(sorted(MODELS))}"
        )
    rng = np.random.default_rng([seed, number, sorted(MODELS).index(category)])
    return MODELS[category](rng)
