"""Shape concepts: what they separate, repeat, survive and store; and measurements of many scans."""

import io
import json
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ersatz.acquisition.camera import CameraSettings
from ersatz.acquisition.concept_learning import learn_shape_concepts
from ersatz.acquisition.layouts import FolderSettings, views_of
from ersatz.acquisition.measuring import MeasuringSettings, measure_object, measure_scans
from ersatz.acquisition.persistence import filter_modes, seek_modes
from ersatz.acquisition.repeatability import intraclass, pattern_distances, relative_responses
from ersatz.acquisition.scans import Scan
from ersatz.acquisition.shape_concepts import ConceptSettings, ShapeConcepts
from ersatz.errors import ErsatzWarning, InputError, ScanError
from ersatz.measurements import Measurements, Origin
from tests.acquisition.shapes import views, whole

KINDS = ("box", "can", "ball", "cup")


@pytest.fixture(scope="module")
def concepts() -> ShapeConcepts:
    return learn_shape_concepts(views(KINDS, range(7)), ConceptSettings(persistence=False))


@pytest.fixture(scope="module")
def unseen() -> list[Scan]:
    return list(views(KINDS, range(20, 25), count=4))


def test_responses_tell_unseen_objects_apart(concepts: ShapeConcepts, unseen: list[Scan]) -> None:
    responses = np.stack([concepts.responses(scan) for scan in unseen])
    assert responses.shape == (len(unseen), 4)
    assert ((responses >= 0) & (responses <= 1)).all()
    kinds = np.array([scan.object_class for scan in unseen])
    names = np.array([scan.instance for scan in unseen])
    distances = np.linalg.norm(responses[:, None] - responses, axis=2)
    distances[names[:, None] == names] = np.inf
    assert (kinds[distances.argmin(axis=1)] == kinds).mean() > 0.7


def test_views_of_one_object_respond_alike(concepts: ShapeConcepts, unseen: list[Scan]) -> None:
    responses = np.stack([concepts.responses(scan) for scan in unseen])
    groups = responses.reshape(-1, 4, 4)
    within = groups.var(axis=1, ddof=1).mean(axis=0)
    between = groups.mean(axis=1).var(axis=0, ddof=1)
    assert ((between - within / 4) / (between + 3 * within / 4) > 0.5).all()


def test_responses_do_not_depend_on_pose_or_order(concepts: ShapeConcepts, unseen: list[Scan]) -> None:
    rng = np.random.default_rng(3)
    for scan in unseen[::9]:
        assert scan.sensor is not None
        expected = concepts.responses(scan)
        shuffled = replace(scan, points=rng.permutation(scan.points))
        np.testing.assert_allclose(concepts.responses(shuffled), expected, atol=1e-9)
        rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        rotation *= np.sign(np.linalg.det(rotation))
        moved = replace(scan, points=scan.points @ rotation.T + 0.7, sensor=rotation @ scan.sensor + 0.7)
        np.testing.assert_allclose(concepts.responses(moved), expected, atol=1e-6)


def test_responses_change_gracefully(concepts: ShapeConcepts, unseen: list[Scan]) -> None:
    rng = np.random.default_rng(4)
    everyone = np.stack([concepts.responses(scan) for scan in unseen])
    shifts = []
    for scan, expected in zip(unseen, everyone, strict=True):
        half = replace(scan, points=rng.permutation(scan.points)[: len(scan.points) // 2])
        shifts.append(np.abs(concepts.responses(half) - expected).mean())
    apart = np.abs(everyone[:, None] - everyone).mean()
    assert np.median(shifts) < apart / 2


def test_concepts_are_saved_without_code_and_reproduced(
    concepts: ShapeConcepts, tmp_path: Path, unseen: list[Scan]
) -> None:
    one, two = tmp_path / "a.npz", tmp_path / "b.npz"
    concepts.save(one)
    loaded = ShapeConcepts.load(one)
    loaded.save(two)
    assert one.read_bytes() == two.read_bytes()
    assert loaded.sha256 == concepts.sha256
    assert loaded.settings == concepts.settings
    np.testing.assert_array_equal(loaded.responses(unseen[0]), concepts.responses(unseen[0]))
    with zipfile.ZipFile(one) as archive:
        for name in archive.namelist():
            np.lib.format.read_array(io.BytesIO(archive.read(name)), allow_pickle=False)


def test_learning_twice_gives_the_same() -> None:
    settings = ConceptSettings(persistence=False, concepts=2)
    first, again = (learn_shape_concepts(views(KINDS, range(3)), settings) for _ in range(2))
    assert first.sha256 == again.sha256


def test_wrong_files_are_refused(concepts: ShapeConcepts, tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    with pytest.raises(InputError, match="not a file of shape concepts"):
        ShapeConcepts.load(path)
    path.write_bytes(b"nonsense")
    with pytest.raises(InputError, match="not a file of shape concepts"):
        ShapeConcepts.load(path)
    arrays = concepts._arrays()
    head = json.loads(arrays["head"].tobytes()) | {"format": 99}
    np.savez(
        path,
        allow_pickle=False,
        **(arrays | {"head": np.frombuffer(json.dumps(head).encode(), dtype=np.uint8)}),
    )
    with pytest.raises(InputError, match=r"format 99.*learn them again"):
        ShapeConcepts.load(path)


def test_modes_are_found_by_prominence() -> None:
    rng = np.random.default_rng(0)
    centres = np.array([[0.0, 0], [10, 0], [0, 10]])
    points = np.concatenate([rng.normal(c, 1, (40, 2)) for c in centres])
    distances = np.linalg.norm(points[:, None] - points, axis=2)
    modes = seek_modes(distances, 3, 8)
    truth = np.arange(3).repeat(40)
    assert len(np.unique(np.stack([modes.labels, truth]), axis=1).T) == 3
    assert len(modes.prominences) == 3


def test_patterns_of_few_objects_are_filtered() -> None:
    """The third cluster has many views of only two objects: objects count, not views."""
    rng = np.random.default_rng(0)
    points = np.concatenate([rng.normal(c, 1, (60, 2)) for c in ((0, 0), (12, 0), (0, 12))])
    distances = np.linalg.norm(points[:, None] - points, axis=2)
    owners = np.concatenate([np.arange(120) // 6, 20 + np.arange(60) % 2])
    modes = filter_modes(distances, owners, 2, 8, 5)
    assert (modes.labels[120:] == -1).all()
    assert len(np.unique(modes.labels[:120])) == 2


def test_too_few_objects_are_an_error() -> None:
    with pytest.raises(InputError, match="asked for: give scans of more objects"):
        learn_shape_concepts(views(KINDS, range(2)), ConceptSettings(fewest_objects=9))
    with pytest.raises(ScanError, match="no scans"):
        learn_shape_concepts([])
    with pytest.raises(InputError, match="concepts = 0"):
        ConceptSettings(concepts=0)
    with pytest.raises(InputError, match="patterns = 0"):
        ConceptSettings(patterns=0)


def test_persistence_learns_from_enough_objects() -> None:
    found = learn_shape_concepts(
        views(KINDS, range(6)), ConceptSettings(concepts=2, neighbours=6, fewest_objects=4)
    )
    assert len(found.prominences) == len(found.repeatabilities) >= 2
    for pattern in range(len(found.prominences)):
        names = {n for n, p in zip(found.names, found.patterns, strict=True) if p == pattern}
        assert len(names) >= 4


def test_the_most_repeatable_patterns_become_concepts() -> None:
    """Without labels: only which views are of one object is known."""
    scans = list(views(KINDS, range(6), count=4))
    settings = ConceptSettings(concepts=2, neighbours=4, fewest_objects=3)
    found = learn_shape_concepts(scans, settings)
    assert len(found.prominences) > 2
    assert (np.diff(found.repeatabilities.round(9)) <= 0).all()
    assert (found.patterns.min(), found.patterns.max()) == (0, len(found.prominences) - 1)
    anonymous = [replace(scan, object_class="", group=f"{scan.instance}?") for scan in scans]
    assert (learn_shape_concepts(anonymous, settings).exemplars == found.exemplars).all()
    assert found.responses(scans[0]).shape == (2,)


def test_intraclass_correlation() -> None:
    """A column that only the object decides, one of noise, and one whose value is known by hand."""
    objects = np.arange(200).repeat(5)
    rng = np.random.default_rng(0)
    values = np.stack([objects * 1.0, rng.normal(size=1000)], axis=1)
    same, noise = intraclass(values, objects)
    assert same == pytest.approx(1)
    assert abs(noise) < 0.05
    # Means 1 and 3 about 2: between 2·(1 + 1) / 1 = 4; within (1 + 1 + 1 + 1) / 2 = 2; (4 - 2) / (4 + 2).
    (known,) = intraclass(np.array([[0.0], [2], [2], [4]]), np.array(["a", "a", "b", "b"]))
    assert known == pytest.approx(1 / 3)
    assert intraclass(values[::5], objects[::5]).tolist() == [0, 0]


def test_own_exemplars_do_not_count() -> None:
    distances = np.array([[0.0, 1, 2, 9], [1, 0, 3, 9]])
    owners, patterns = np.array([0, 1, 1, 2]), np.array([0, 0, 1, 1])
    assert pattern_distances(distances, patterns, owners, 3).tolist() == [[0.5, 5.5], [0.5, 6]]
    own = pattern_distances(distances, patterns, owners, 3, own=np.array([0, 1]))
    assert own.tolist() == [[1, 5.5], [1, 9]]


def test_relative_responses_do_not_fall_with_an_unusual_side() -> None:
    near, far = relative_responses(np.array([[0.1, 0.2, 0.3], [1, 2, 3]]))
    assert near == pytest.approx(far)
    assert (np.diff(near) < 0).all()
    assert relative_responses(np.full((1, 3), 2.0)) == pytest.approx(np.exp(-0.5))
    assert relative_responses(np.zeros((1, 3))).tolist() == [[1, 1, 1]]


def mixed() -> list[Scan]:
    found = []
    for kind in ("box", "cup"):
        found += [whole(kind, 30), *views((kind,), range(30, 31), 2)]
    return found


def test_measurements_of_wholes_and_views(concepts: ShapeConcepts) -> None:
    seen: list[str] = []
    blocks = measure_scans(mixed(), concepts, progress=lambda scan: seen.append(scan.label))
    assert len(seen) == 6
    table = Measurements.collect(blocks)
    counts = {column.property.name: len(column) for column in table.columns}
    assert counts == {
        "blockage": 2, "containment": 2, "flatness": 2, "hollowness": 2, "size": 2, "support": 2, "weight": 2,
        "shape_1": 4, "shape_2": 4, "shape_3": 4, "shape_4": 4,
    }  # fmt: skip
    assert all(block.origin is Origin.SYNTHETIC for block in blocks)
    size = next(column for column in table.columns if column.property.name == "size")
    assert (np.diff(size.values, axis=1) <= 0).all()


def test_an_unknown_object_is_looked_at_from_several_sides(concepts: ShapeConcepts) -> None:
    whole_cup, *_ = views_of(whole("cup", 31), FolderSettings(CameraSettings(views=3)))
    values = measure_object(whole_cup, concepts, folder=FolderSettings(CameraSettings(views=3)))
    assert {"shape_1", "shape_4", "size", "hollowness", "weight"} <= values.keys()
    seen = [concepts.responses(view) for view in views(("cup",), range(31, 32))]
    expected = np.mean(seen, axis=0)
    assert np.array([values[f"shape_{i}"][0] for i in range(1, 5)]) == pytest.approx(expected, abs=0.1)


def test_workers_give_the_same(concepts: ShapeConcepts) -> None:
    one = Measurements.collect(measure_scans(mixed(), concepts))
    two = Measurements.collect(measure_scans(mixed(), concepts, MeasuringSettings(workers=2)))
    for a, b in zip(one.columns, two.columns, strict=True):
        np.testing.assert_array_equal(a.values, b.values)


def test_poor_scans_stop_or_are_left_out(concepts: ShapeConcepts) -> None:
    poor = Scan(np.linspace(0, 0.1, 50)[:, None] * [1.0, 1, 1], "stick", "stick_1", sensor=np.zeros(3))
    with pytest.raises(ScanError, match="stick_1: all 50 points lie on one line"):
        measure_scans([poor], concepts)
    with pytest.warns(ErsatzWarning, match="skipped stick_1"):
        assert len(measure_scans([poor, *mixed()[1:2]], concepts, MeasuringSettings(keep_going=True))) == 4
