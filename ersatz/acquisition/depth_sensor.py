"""A structured-light depth sensor as of the Washington RGB-D data set, and how it errs.

Its intrinsics, its depth steps (1/8 pixel of disparity) and the noise that Nguyen, Izadi and Lovell
measured of it ("Modeling Kinect Sensor Noise for Improved 3D Reconstruction and Tracking", 2012).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Intrinsics:
    """A pinhole camera; the defaults are those of the Washington RGB-D data set's sensor.

    Attributes
    ----------
    width, height : int, pixels
    fx, fy : float, pixels
        Focal lengths.
    cx, cy : float, pixels
        Principal point.
    """

    width: int = 640
    height: int = 480
    fx: float = 570.3
    fy: float = 570.3
    cx: float = 320.0
    cy: float = 240.0


@dataclass(frozen=True, slots=True)
class SensorNoise:
    """How a depth sensor errs. `SensorNoise.none()` is a perfect one.

    Attributes
    ----------
    axial : float, dimensionless
        Factor on the axial deviation 0.0012 + 0.0019 (z - 0.4)² metres of a surface at depth z metres.
        Theirs includes the depth steps; 0.35 makes the residuals to local quadrics (0.46 mm) of a real
        Washington scan (an apple at 0.74 m) equal to those of a simulated ball.
    lateral : float, pixels
        Standard deviation of a ray's direction.
    correlation : int, pixels
        Width of the window over which the sensor matches its pattern: errors within it are alike.
    baseline : float, metres
        Distance between projector and camera.
    disparity_step : float, pixels
        Disparities are multiples of it; 0 for no quantisation.
    grazing : float, degrees
        Surfaces seen at an angle larger than this to their normal are lost.
    edge_dropout : float, dimensionless
        Share of the pixels beside a depth jump that are lost.
    """

    axial: float = 0.35
    lateral: float = 0.3
    correlation: int = 3
    baseline: float = 0.075
    disparity_step: float = 0.125
    grazing: float = 80.0
    edge_dropout: float = 0.5

    @classmethod
    def none(cls) -> "SensorNoise":
        """Return a sensor without error."""
        return cls(0.0, 0.0, 1, 0.075, 0.0, 90.0, 0.0)


def add_noise(
    depth: NDArray[np.float64],
    slant: NDArray[np.float64],
    intrinsics: Intrinsics,
    noise: SensorNoise,
    rng: np.random.Generator,
) -> NDArray[np.float64]:
    """Return a depth image as the sensor would deliver it.

    Parameters
    ----------
    depth : (h, w) array, metres
        Along the optical axis; inf where nothing is.
    slant : (h, w) array, dimensionless
        Cosine of the angle between the ray and the surface normal.
    intrinsics : Intrinsics
    noise : SensorNoise
    rng : numpy.random.Generator

    Returns
    -------
    (h, w) array, metres
        inf where nothing is or the sensor fails.
    """
    seen = np.isfinite(depth) & (slant > np.cos(np.radians(noise.grazing)))
    if noise.edge_dropout:
        far = np.where(seen, depth, 1e3)
        around = np.stack([np.roll(far, shift, axis) for shift, axis in ((1, 0), (-1, 0), (1, 1), (-1, 1))])
        # A jump is a step that a surface at 75 degrees would not make between two pixels.
        jump = np.abs(around - far).max(axis=0) > 0.005 + depth / intrinsics.fx * 4
        seen &= ~(jump & (rng.random(depth.shape) < noise.edge_dropout))
    z = np.where(seen, depth, 1.0)
    deviation = noise.axial * (0.0012 + 0.0019 * (z - 0.4) ** 2)
    z = z + deviation * _correlated(depth.shape, noise.correlation, rng)
    if noise.disparity_step:
        unit = intrinsics.fx * noise.baseline
        steps = np.maximum(np.round(unit / z / noise.disparity_step), 1)
        z = unit / (steps * noise.disparity_step)
    return np.where(seen, z, np.inf)


def _correlated(shape: tuple[int, ...], width: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """Return noise of unit deviation that is alike within windows of `width` pixels."""
    white = rng.normal(size=(shape[0] + width - 1, shape[1] + width - 1))
    windows = np.lib.stride_tricks.sliding_window_view(white, (width, width))
    smooth: NDArray[np.float64] = windows.sum(axis=(2, 3)) / width
    return smooth
