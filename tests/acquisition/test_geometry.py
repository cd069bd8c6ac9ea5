"""Measured geometry against closed forms, against real objects, and where it must refuse."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from ersatz.acquisition.geometry import GeometrySettings, measure_geometry
from ersatz.acquisition.layouts import list_scans
from ersatz.acquisition.meshes import Mesh
from ersatz.acquisition.parametric import (
    MODELS,
    Vessel,
    box,
    cylinder,
    hemisphere_bowl,
    model,
    sphere,
    tray,
    tumbler,
)
from ersatz.acquisition.scans import Scan
from ersatz.errors import InputError, ScanError

VESSELS: dict[str, Callable[[], Vessel]] = {
    "tumbler": lambda: tumbler(0.06, 0.08, 0.1, 0.003),
    "thick beaker": lambda: tumbler(0.06, 0.06, 0.1, 0.012),
    "with a lid": lambda: tumbler(0.06, 0.08, 0.1, 0.004, lid=True),
    "bowl": lambda: hemisphere_bowl(0.15, 0.003),
    "tray": lambda: tray(0.3, 0.2, 0.04, 0.004),
}

BROKEN = {
    "kit_Glassbowl": "a single sheet without thickness, with holes",
    "kit_FlowerCup": "a single sheet without thickness, with holes",
    "kit_CondensedMilk": "solid: no interior",
    "kit_ChocoIcing": "solid: no interior",
    "kit_Margarine": "solid: no interior",
}
"""Scanned vessels and boxes whose surface is not that of the thing, each with its reason."""


def scan_of(mesh: Mesh) -> Scan:
    return Scan(mesh.vertices, mesh=mesh)


def turn(seed: int) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    rotation = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    turned: np.ndarray[tuple[int, ...], np.dtype[np.float64]] = rotation * np.sign(np.linalg.det(rotation))
    return turned


@pytest.mark.parametrize(
    ("name", "pose"),
    [
        *((name, "tilted") for name in VESSELS),
        ("tumbler", "upright"),
        ("tray", "upright"),
        ("tumbler", "small"),
    ],
)
def test_fill_volume_is_the_capacity(name: str, pose: str) -> None:
    vessel = VESSELS[name]()
    scale = 0.5 if pose == "small" else 1.0
    mesh = vessel.mesh.scaled(scale) if pose != "tilted" else vessel.mesh.moved(turn(7), 0.4)
    geometry = measure_geometry(scan_of(mesh))
    assert (
        geometry.containment is not None and geometry.enclosed is not None and geometry.hollowness is not None
    )
    inside, outside = geometry.containment, geometry.enclosed
    if "lid" in name:
        inside, outside = outside, inside
    assert inside == pytest.approx(vessel.capacity * scale**3, rel=0.05)
    assert outside == 0
    assert (geometry.hollowness > 0.4) == ("lid" not in name)


def test_solids_hold_nothing() -> None:
    for mesh in (box(0.2, 0.1, 0.05), cylinder(0.07, 0.12), sphere(0.1)):
        geometry = measure_geometry(scan_of(mesh))
        assert geometry.containment == 0
        assert geometry.hollowness == 0


def test_box_measures() -> None:
    geometry = measure_geometry(scan_of(box(0.1, 0.2, 0.05).moved(turn(1), 0.3)))
    assert geometry.size == pytest.approx([0.2, 0.1, 0.05], abs=0.002)
    assert geometry.volume == pytest.approx(0.001, rel=0.01)
    assert geometry.hull_volume == pytest.approx(0.001, rel=0.01)
    assert geometry.elongation == pytest.approx(0.5, abs=0.02)
    assert geometry.support == pytest.approx(0.02, rel=0.1)
    assert geometry.flatness > 0.95
    assert geometry.symmetry == pytest.approx(1)
    # Cauchy: the mean shadow of a convex body is a quarter of its surface.
    assert geometry.silhouette == pytest.approx(2 * (0.02 + 0.005 + 0.01) / 4, rel=0.05)


def test_ball_measures() -> None:
    geometry = measure_geometry(scan_of(sphere(0.1)))
    assert geometry.size == pytest.approx([0.1, 0.1, 0.1], abs=0.001)
    assert geometry.silhouette == pytest.approx(np.pi * 0.05**2, rel=0.03)
    assert geometry.flatness < 0.15
    assert geometry.volume == pytest.approx(np.pi / 6 * 0.001, rel=0.01)


def test_a_single_sheet_does_not_tell() -> None:
    """A cup without thickness, outside out: water touches only the back of its surface."""
    mesh = tumbler(0.06, 0.08, 0.1, 0.003).mesh
    outside = Mesh(mesh.vertices, mesh.triangles[: len(mesh.triangles) // 2 - 32])
    geometry = measure_geometry(scan_of(outside))
    assert geometry.hollowness is None
    assert geometry.containment is None
    assert geometry.volume is None


def test_a_scan_hole_does_not_make_a_box_hollow() -> None:
    mesh = box(0.1, 0.1, 0.1)
    geometry = measure_geometry(scan_of(Mesh(mesh.vertices, mesh.triangles[:-1])))
    assert geometry.hollowness is None


def test_one_view_refuses_what_it_cannot_see() -> None:
    points = np.random.default_rng(0).uniform(-0.05, 0.05, (1000, 3)) * [1, 2, 0.01]
    geometry = measure_geometry(Scan(points, sensor=np.array([0, 0, 1.0])))
    assert geometry.partial
    assert geometry.flatness > 0.9
    assert geometry.size[0] == pytest.approx(0.2, abs=0.01)
    unknown = (
        geometry.hollowness,
        geometry.containment,
        geometry.support,
        geometry.silhouette,
        geometry.volume,
    )
    assert unknown == (None,) * 5


def test_a_cloud_of_all_sides_leaves_cavities_unknown() -> None:
    points, _ = box(0.2, 0.1, 0.05).sampled(4000, 0)
    geometry = measure_geometry(Scan(points))
    assert geometry.hollowness is None
    assert geometry.support == pytest.approx(0.02, rel=0.35)
    assert geometry.size == pytest.approx([0.2, 0.1, 0.05], abs=0.005)


@pytest.mark.filterwarnings("ignore::ersatz.errors.ErsatzWarning")
def test_degenerate_clouds() -> None:
    flat = np.random.default_rng(0).uniform(0, 0.1, (100, 3)) * [1, 1, 0]
    geometry = measure_geometry(Scan(flat))
    assert geometry.size[2] == pytest.approx(0, abs=1e-6)
    assert geometry.hull_volume == pytest.approx(0, abs=1e-9)
    assert geometry.hollowness is None
    with pytest.raises(ScanError, match="on one line"):
        measure_geometry(Scan(np.linspace(0, 0.1, 50)[:, None] * [1.0, 2, 3]))
    with pytest.raises(InputError, match="voxels = 10"):
        GeometrySettings(voxels=10)


@pytest.mark.parametrize("category", MODELS)
def test_parametric_models_are_metric_and_seeded(category: str) -> None:
    one, same, other = model(category, 0), model(category, 0), model(category, 1)
    np.testing.assert_array_equal(one.vertices, same.vertices)
    assert one.diagonal != other.diagonal
    size = measure_geometry(scan_of(one)).size
    assert 0.15 < size[0] < 0.5
    with pytest.raises(InputError, match="no parametric model of 'unicorn'"):
        model("unicorn", 0)


def auc(positive: list[float], negative: list[float]) -> float:
    a, b = np.array(positive)[:, None], np.array(negative)
    return float(((a > b) + 0.5 * (a == b)).mean())


def test_hollowness_separates_real_vessels_from_solids(shared_data: Path) -> None:
    """A sample of real meshes; the report command measures all of them."""
    vessels: list[float] = []
    solids: list[float] = []
    settings = GeometrySettings(voxels=100_000, coarse_voxels=8_000)
    for file in list_scans(shared_data / "objects")[::2]:
        hollow = file.object_class in {"bowl", "coffee mug"} or file.instance.startswith("ycb_065")
        solid = file.object_class in {"food box", "food can", "ball"}
        scan = file.load() if (hollow or solid) and file.instance not in BROKEN else None
        if scan is None or scan.mesh is None or (solid and not file.instance.startswith("ycb")):
            continue
        value = measure_geometry(scan, settings).hollowness
        if value is not None:
            (vessels if hollow else solids).append(value)
    assert len(vessels) >= 5 and len(solids) >= 4
    assert auc(vessels, solids) >= 0.97
