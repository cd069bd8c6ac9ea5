"""The virtual camera sees what is there, and errs as a real sensor does."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ersatz.acquisition.camera import (
    CameraSettings,
    VirtualCamera,
    cloud_view,
    viewing_directions,
)
from ersatz.acquisition.depth_sensor import Intrinsics, SensorNoise, add_noise
from ersatz.acquisition.parametric import box, sphere
from ersatz.acquisition.scans import read_scan
from ersatz.errors import InputError, ScanError

PERFECT = CameraSettings(noise=SensorNoise.none())


def test_a_perfect_camera_sees_the_near_half_of_a_ball() -> None:
    eye = np.array([0.0, -0.5, 0.5])
    points = VirtualCamera(sphere(0.1), PERFECT).view(eye)
    assert np.linalg.norm(points, axis=1) == pytest.approx(0.05, abs=0.0003)
    assert ((points @ eye) / np.linalg.norm(eye) > -0.001).all()
    # The disc of a ball 0.1 m wide at 0.7071 m, in pixels of 1/570.3.
    assert len(points) == pytest.approx(np.pi * (0.05 / 0.7071 * 570.3) ** 2, rel=0.02)


def test_noise_has_the_size_and_steps_of_the_sensor() -> None:
    flat = np.full((100, 100), 0.7)
    noisy = add_noise(flat, np.ones_like(flat), Intrinsics(), SensorNoise(), np.random.default_rng(0))
    unit = 570.3 * 0.075
    assert (unit / noisy / 0.125) == pytest.approx(np.round(unit / noisy / 0.125), abs=1e-6)
    expected = np.hypot(0.35 * (0.0012 + 0.0019 * 0.3**2), 0.7**2 * 0.125 / unit / np.sqrt(12))
    assert noisy.std() == pytest.approx(expected, rel=0.3)
    assert noisy.mean() == pytest.approx(0.7, abs=0.001)


def test_grazing_surfaces_and_edges_drop_out() -> None:
    depth = np.full((50, 50), 0.7)
    depth[:, 25:] = 0.8
    slant = np.ones_like(depth)
    slant[:10] = np.cos(np.radians(85))
    noisy = add_noise(depth, slant, Intrinsics(), SensorNoise(), np.random.default_rng(0))
    assert not np.isfinite(noisy[:10]).any()
    beside = np.isfinite(noisy[11:-1, 24:26])
    assert 0.3 < beside.mean() < 0.7
    assert np.isfinite(noisy[11:-1, 5:20]).all()


def test_the_seed_decides_everything() -> None:
    mesh = box(0.1, 0.08, 0.05)
    first, again, other = (
        [points for points, _ in VirtualCamera(mesh, CameraSettings(views=2, seed=seed)).views(3)]
        for seed in (0, 0, 1)
    )
    for one, same in zip(first, again, strict=True):
        np.testing.assert_array_equal(one, same)
    assert first[0].shape != other[0].shape or (first[0] != other[0]).any()


@pytest.mark.parametrize("upper", [True, False])
def test_directions_are_spread(upper: bool) -> None:
    directions = viewing_directions(CameraSettings(views=40, upper=upper))
    assert np.linalg.norm(directions, axis=1) == pytest.approx(1)
    nearest = np.sort(directions @ directions.T, axis=1)[:, -2]
    assert np.degrees(np.arccos(nearest)).min() > (8 if upper else 15)
    assert (directions[:, 2] > 0.3).all() if upper else abs(directions.mean(axis=0)).max() < 0.05


def test_a_sheet_is_not_seen_from_its_edge() -> None:
    camera = VirtualCamera(box(0.2, 0.2, 0.0005), CameraSettings(views=12, upper=False))
    assert min(len(points) for points, _ in camera.views()) >= 200


def test_a_camera_within_the_object_is_an_error() -> None:
    with pytest.raises(ScanError, match="stands inside"):
        VirtualCamera(box(1, 1, 1), CameraSettings()).view(np.array([0, 0, 0.1]))
    with pytest.raises(InputError, match="views = 0"):
        CameraSettings(views=0)
    with pytest.raises(InputError, match=r"distance = 0.0 m"):
        CameraSettings(distance=0.0)


def test_hidden_points_of_a_cloud_are_removed() -> None:
    points, _ = sphere(0.1).sampled(4000, 0)
    eye = np.array([0.0, 0.0, 1.0])
    seen = cloud_view(points, eye)
    assert (seen[:, 2] > -0.01).all()
    assert len(seen) == pytest.approx(2000, rel=0.15)


def residual(points: NDArray[np.float64]) -> float:
    """Return the median deviation from local quadrics through 60 neighbours, metres."""
    around = points[cKDTree(points).query(points[::5], 60)[1]]
    centred = around - around.mean(axis=1, keepdims=True)
    _, axes = np.linalg.eigh(np.einsum("nki,nkj->nij", centred, centred))
    z, y, x = (centred @ axes).transpose(2, 0, 1)
    basis = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=-1)
    fits = [
        float(np.std(b - a @ np.linalg.lstsq(a, b, rcond=None)[0])) for a, b in zip(basis, z, strict=True)
    ]
    return float(np.median(fits))


def test_noise_is_like_a_real_washington_scan(shared_data: Path) -> None:
    """An apple at 0.74 m against a ball of its size: the same roughness within a fifth."""
    apple = read_scan(shared_data / "washington_sample" / "apple_1_1_1.pcd").points
    settings = CameraSettings(distance=0.738, intrinsics=Intrinsics())
    ball = VirtualCamera(sphere(0.075), settings).view(np.array([0.0, -0.5, 0.54]))
    assert residual(ball) == pytest.approx(residual(apple), rel=0.2)
