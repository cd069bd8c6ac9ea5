"""Segments, symbols and compositions: what they find, and what they do not depend on."""

import numpy as np
import pytest
from numpy.typing import NDArray

from ersatz.acquisition.camera import CameraSettings, VirtualCamera
from ersatz.acquisition.compositions import unions
from ersatz.acquisition.depth_sensor import SensorNoise
from ersatz.acquisition.parametric import box, cylinder, sphere
from ersatz.acquisition.scans import Scan
from ersatz.acquisition.segments import Segments, SegmentSettings, prepare, segment
from ersatz.acquisition.symbols import NAMES, SymbolSettings, describe_segments, learn_dictionary
from ersatz.errors import InputError, ScanError

EYE = np.array([0.35, -0.4, 0.45])
PERFECT = CameraSettings(noise=SensorNoise.none())


def cut(points: NDArray[np.float64], sensor: NDArray[np.float64] | None = EYE) -> Segments:
    settings = SegmentSettings()
    return segment(prepare(Scan(points, sensor=sensor), settings), settings)


def test_a_box_seen_from_a_corner_has_three_sides() -> None:
    mesh = box(0.2, 0.15, 0.1)
    segments = cut(VirtualCamera(mesh, PERFECT).view(EYE))
    large = np.flatnonzero(segments.areas > 0.1)
    assert len(large) == 3
    normals = [segments.surface.normals[segments.labels == i].mean(axis=0) for i in large]
    assert np.abs(np.array(normals) @ np.array(normals).T - np.eye(3)).max() < 0.15
    assert {tuple(edge) for edge in segments.edges.tolist()} >= {(0, 1), (0, 2), (1, 2)}


def test_normals_look_to_the_sensor() -> None:
    surface = prepare(Scan(VirtualCamera(sphere(0.1), PERFECT).view(EYE), sensor=EYE), SegmentSettings())
    outward = surface.points - surface.points.mean(axis=0)
    assert np.linalg.norm(surface.normals, axis=1) == pytest.approx(1)
    assert surface.normals.mean(axis=0) @ surface.normals[0] > 0
    assert ((surface.normals * outward).sum(axis=1) > -0.02).mean() > 0.9


def rotations(count: int) -> list[NDArray[np.float64]]:
    rng = np.random.default_rng(5)
    found = [np.linalg.qr(rng.normal(size=(3, 3)))[0] for _ in range(count)]
    return [q * np.sign(np.linalg.det(q)) for q in found]


@pytest.mark.parametrize("rotation", rotations(4))
def test_segments_turn_and_move_with_the_object(rotation: NDArray[np.float64]) -> None:
    points = VirtualCamera(cylinder(0.08, 0.15), CameraSettings()).view(EYE, 1)
    shift = np.array([1.0, -2.0, 0.5])
    here = cut(points)
    there = cut(points @ rotation.T + shift, EYE @ rotation.T + shift)
    np.testing.assert_allclose(there.surface.points, here.surface.points, atol=1e-9)
    np.testing.assert_array_equal(there.labels, here.labels)
    np.testing.assert_allclose(describe_segments(there), describe_segments(here), atol=1e-6)


def test_segments_do_not_depend_on_the_order_of_points() -> None:
    points = VirtualCamera(box(0.1, 0.12, 0.05), CameraSettings()).view(EYE, 2)
    shuffled = np.random.default_rng(0).permutation(points)
    np.testing.assert_allclose(describe_segments(cut(shuffled)), describe_segments(cut(points)), atol=1e-9)


def test_descriptors_do_not_depend_on_scale() -> None:
    points = VirtualCamera(box(0.1, 0.12, 0.05), PERFECT).view(EYE)
    np.testing.assert_allclose(
        describe_segments(cut(3 * points, 3 * EYE)), describe_segments(cut(points)), atol=1e-6
    )


def test_descriptors_tell_flat_from_round() -> None:
    flat = describe_segments(cut(VirtualCamera(box(0.2, 0.15, 0.1), PERFECT).view(EYE)))[0]
    round_ = describe_segments(cut(VirtualCamera(sphere(0.1), PERFECT).view(EYE)))[0]
    assert len(flat) == len(NAMES) == 27
    assert flat[NAMES.index("normal 6")] > 0.95
    assert flat[NAMES.index("convexity")] < 0.3
    assert round_[NAMES.index("convexity")] > 0.6


@pytest.mark.parametrize(
    ("points", "message"),
    [
        (np.random.default_rng(0).normal(size=(20, 3)) * 0.1, "20 distinct"),
        (np.linspace(0, 0.1, 99)[:, None] * [1.0, 2, 3], "on one line"),
        (np.random.default_rng(0).uniform(0, 0.1, (14, 3)).repeat(9, axis=0), "14 points remain|distinct"),
    ],
)
def test_poor_clouds_are_refused(points: NDArray[np.float64], message: str) -> None:
    with pytest.raises(ScanError, match=message):
        cut(points)


def test_the_dictionary_is_nested() -> None:
    rng = np.random.default_rng(0)
    descriptors = rng.normal(size=(400, 27)) + rng.integers(0, 4, 400)[:, None] * 5
    dictionary = learn_dictionary(descriptors, SymbolSettings((4, 8, 16)))
    symbols = dictionary.assign(descriptors)
    assert dictionary.levels == (4, 8, 16)
    for coarse, fine in ((0, 1), (1, 2)):
        pairs = np.unique(symbols[:, [fine, coarse]], axis=0)
        assert len(pairs) == len(np.unique(pairs[:, 0]))
    assert len(np.unique(symbols[:, 0])) == 4
    with pytest.raises(InputError, match="3 different segments cannot make 32 symbols"):
        learn_dictionary(descriptors[:3], SymbolSettings())
    with pytest.raises(InputError, match="growing numbers"):
        SymbolSettings((8, 4))


def test_unions_end_with_the_whole() -> None:
    edges = np.array([[0, 1], [1, 2], [3, 4]])
    found = unions(edges, np.array([2.0, 1.0, 3.0]), 5)
    assert found == [((1, 2), 1.0), ((0, 1, 2), 2.0), ((3, 4), 3.0), ((0, 1, 2, 3, 4), 3.0)]
    assert unions(np.zeros((0, 2), dtype=np.int64), np.zeros(0), 1) == [((0,), 0.0)]
