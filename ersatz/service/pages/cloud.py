"""Clouds of points that a hand can turn."""

from typing import Final

import numpy as np
from nicegui import ui
from numpy.typing import NDArray

from ersatz.service.pages.frame import COLOURS, show
from ersatz.service.pages.markup import tag

DRAWN: Final = 8_000
"""Points that are drawn."""

_GROUND: Final = "#131b22"
"""Behind the points, on light pages and dark ones."""

_LOW, _HIGH = np.array([0.03, 0.16, 0.34]), np.array([0.35, 0.85, 0.55])
_BRIGHT: Final = np.array([[int(one[at : at + 2], 16) / 255 for at in (1, 3, 5)] for one in COLOURS])


def by_height(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (n, 3) colours in [0, 1] of (n, 3) points: the higher, the lighter."""
    height = points[:, 2] - points[:, 2].min()
    share = (height / max(float(height.max()), 1e-12))[:, None]
    colours: NDArray[np.float64] = (1 - share) * _LOW + share * _HIGH
    return colours


def by_segment(segments: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return (n, 3) colours in [0, 1]: one a segment."""
    colours: NDArray[np.float64] = _BRIGHT[segments % len(_BRIGHT)]
    return colours


def draw_cloud(points: NDArray[np.float64], colours: NDArray[np.float64]) -> None:
    """Draw points and say how large the box around them is.

    Parameters
    ----------
    points : (n, 3) array, metres
    colours : (n, 3) array in [0, 1]
    """
    extent = np.ptp(points, axis=0)
    chosen = np.linspace(0, len(points) - 1, min(DRAWN, len(points))).astype(int)
    middle = (points.max(axis=0) + points.min(axis=0)) / 2
    # The largest distance from the middle becomes 1, so that the camera at 2 sees all of it.
    placed = (points[chosen] - middle) / max(float(np.linalg.norm(points - middle, axis=1).max()), 1e-12)
    camera = ui.scene.perspective_camera(fov=55)
    with ui.scene(width=520, height=380, grid=False, camera=camera, background_color=_GROUND) as scene:
        # Points about as large as the gaps between them on a surface.
        size = float(np.clip(1.6 / np.sqrt(len(chosen)), 0.012, 0.06))
        scene.point_cloud(placed.round(4).tolist(), colours[chosen].round(3).tolist(), point_size=size)
        scene.move_camera(x=1.25, y=-1.25, z=1.0, look_at_x=0, look_at_y=0, look_at_z=0, duration=0)
    scene.classes("cloud").props('role="img" aria-label="Point cloud; drag to turn it"')
    box = " × ".join(f"{edge:.3f}" for edge in extent)
    show(
        tag(
            "div",
            f"{len(chosen)} points in a box of {box} m. Drag to turn, scroll to come nearer.",
            class_="faint",
        )
    )
