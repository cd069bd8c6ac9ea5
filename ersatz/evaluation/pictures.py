"""Pictures of objects for the survey, rendered from scans where there are any."""

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ersatz.evaluation.facts import read_points
from ersatz.knowledge.names import local_name, snake_iri

SIDE: Final = 220
"""Pixels of a picture's edge."""


def find_scans(folder: Path, classes: Sequence[str]) -> dict[str, Path]:
    """Return for each class the first mesh (.ply), else cloud (.npz), in the folder of its name, where "
    "there is one."""
    found = {}
    for name in classes:
        inside = folder / local_name(snake_iri(name))
        files = [*sorted(inside.glob("*.ply")), *sorted(inside.glob("*.npz"))] if inside.is_dir() else []
        if files:
            found[name] = files[0]
    return found


def picture(scan: Path) -> bytes:
    """Return a PNG of a scan, seen from the side and a little from above."""
    from matplotlib import image

    out = io.BytesIO()
    image.imsave(out, render(read_points(scan)), cmap="gray", vmin=0, vmax=1, format="png")
    return out.getvalue()


def render(points: NDArray[np.float64], side: int = SIDE) -> NDArray[np.float64]:
    """Return a (side, side) grey picture in [0, 1] of (n, 3) points in any unit, lit from the upper left."""
    turn, tilt = np.radians((35, 28))
    about = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    nod = np.array([[1, 0, 0], [0, np.cos(tilt), -np.sin(tilt)], [0, np.sin(tilt), np.cos(tilt)]])
    seen = (points - (points.max(axis=0) + points.min(axis=0)) / 2) @ about.T @ nod.T
    scale = 0.88 * side / float(max(np.ptp(seen[:, 0]), np.ptp(seen[:, 2])))
    column = (seen[:, 0] * scale + side / 2).astype(int)
    row = (side / 2 - seen[:, 2] * scale).astype(int)
    depth = np.full((side, side), -np.inf)
    reach = 1 if len(points) > 20_000 else 3
    for below in range(-reach, reach + 1):
        for beside in range(-reach, reach + 1):
            at = np.clip(row + below, 0, side - 1), np.clip(column + beside, 0, side - 1)
            np.maximum.at(depth, at, -seen[:, 1] * scale)
    body = np.isfinite(depth)
    smooth = _blurred(np.where(body, depth, depth[body].min()), body)
    down, right = np.gradient(smooth)
    light = (1 + 0.7 * down + 0.5 * right) / np.sqrt(1 + down**2 + right**2) / 1.32
    return np.where(body, np.clip(0.15 + 0.75 * light, 0.05, 0.92), 1.0)


def _blurred(depth: NDArray[np.float64], body: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Smooth depth inside the body, three times over the neighbours."""
    for _ in range(3):
        sums, counts = np.zeros_like(depth), np.zeros_like(depth)
        for axis in (0, 1):
            for step in (-1, 0, 1):
                inside = np.roll(body, step, axis)
                sums += np.where(inside, np.roll(depth, step, axis), 0)
                counts += inside
        depth = np.where(body, sums / np.maximum(counts, 1), depth)
    return depth
