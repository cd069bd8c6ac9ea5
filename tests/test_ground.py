"""A scan nobody trained on: its qualities, the nearest classes, and what it could stand in for."""

import json
import multiprocessing
from pathlib import Path

import numpy as np
import pytest

from ersatz.acquisition.layouts import FolderSettings, list_scans, views_of
from ersatz.acquisition.measuring import measure_scans
from ersatz.acquisition.shape_concepts import ShapeConcepts
from ersatz.acquisition.sources import AcquisitionSettings
from ersatz.errors import ErsatzWarning
from ersatz.knowledge.base import KnowledgeBase
from ersatz.measurements import rounded
from ersatz.pipeline import Settings, build, ground
from ersatz.resources import DATA, ONTOLOGY
from tests.cli import Shell

APPLE = Path("washington_sample") / "apple_1_1_1.pcd"


def test_one_view_of_an_apple(shared_data: Path) -> None:
    """The apple is in no part of the shipped knowledge base; one view tells its size, form and flatness."""
    kb = KnowledgeBase.open("household")
    revision = kb.revision
    grounded = ground(kb, shared_data / APPLE)
    held = {one.property: one for one in grounded.held}
    assert {"size", "shape_1", "shape_2", "shape_3", "shape_4"} <= set(held)
    assert held["size"].unit == "m"
    assert 0.04 < max(held["size"].value) < 0.12
    assert all(0 <= held[f"shape_{rank}"].value[0] <= 1 for rank in range(1, 5))
    assert "containment" not in held  # one view does not show whether it is hollow
    similarities = [one.similarity for one in grounded.classes]
    assert similarities == sorted(similarities, reverse=True)
    assert similarities[0] > 0
    assert kb.revision == revision


def test_a_whole_mesh_tells_more(shared_data: Path, ersatz: Shell) -> None:
    """Every function can be measured on a barrel known from all sides; with its mass also what it blocks."""
    path = next((shared_data / "unlabelled").glob("becks-barrel1*"))
    run = ersatz("ground", "household", path, "--mass", "1.2", "--json")
    assert run.code == 0, run.err
    answer = json.loads(run.out)
    measured = {one["property"]: one["value"] for one in answer["held"]}
    assert {"size", "flatness", "support", "weight", "blockage"} <= set(measured)
    assert measured["weight"] == [1.2]
    assert [one["similarity"] for one in answer["stands_in_for"]] == sorted(
        (one["similarity"] for one in answer["stands_in_for"]), reverse=True
    )
    shown = ersatz("ground", "household", path, "--mass", "1.2")
    assert "could stand in for" in shown.out or "stands in for nothing" in shown.out


def test_other_concepts_are_refused(shared_data: Path, tmp_path: Path, ersatz: Shell) -> None:
    with np.load(ONTOLOGY / "household.concepts.npz") as stored:
        arrays = dict(stored)
    name = next(name for name, array in arrays.items() if array.dtype.kind == "f" and array.size)
    arrays[name] = arrays[name] * 0.5
    np.savez_compressed(tmp_path / "other.npz", allow_pickle=False, **arrays)
    run = ersatz("ground", "household", shared_data / APPLE, "--concepts", tmp_path / "other.npz")
    assert run.code == 2
    assert "other.npz" in run.err


@pytest.mark.parametrize("number", [3, 41, 77])
def test_shipped_values_are_what_the_scans_give(number: int, shared_data: Path) -> None:
    """Measured again, an object of the shipped knowledge base has the same values, to the last digit."""
    file = list_scans(shared_data / "objects")[number]
    concepts = ShapeConcepts.load(ONTOLOGY / "household.concepts.npz")
    blocks = measure_scans(views_of(file.load(), FolderSettings(), number), concepts)
    again = {
        (block.property.name, str(observation)): rounded(np.atleast_1d(value)).tolist()
        for block in blocks
        for observation, value in zip(block.observation, block.values, strict=True)
    }
    stored: dict[tuple[str, str], list[float]] = {}
    for row in KnowledgeBase.open("household").ask("instance_measurements", instance=file.instance):
        if str(row["origin"]).endswith("human"):
            continue
        key = str(row["property"]).rpartition("#")[2], str(row["observation"] or "")
        stored.setdefault(key, []).append(float(str(row["value"])))
    assert len(stored) > 10
    assert stored == again


@pytest.mark.parametrize("content", [b"", b"ply\nformat ascii 1.0\n", bytes(range(256)) * 9])
def test_a_broken_scan_is_one_error(content: bytes, tmp_path: Path, ersatz: Shell) -> None:
    path = tmp_path / "scan.ply"
    path.write_bytes(content)
    run = ersatz("ground", "household", path)
    assert run.code == 2
    assert run.err.count("\n") == 1
    assert "scan.ply" in run.err


def test_workers_measure_the_scans(shared_data: Path, tmp_path: Path) -> None:
    """Two processes work where two are asked for; one of them would do, so only looking at them tells."""
    source = next((shared_data / "objects" / "bowl").glob("ycb_024*"))
    (tmp_path / "scans" / "bowl").mkdir(parents=True)
    (tmp_path / "scans" / "bowl" / source.name).symlink_to(source)
    seen: list[int] = []
    with pytest.warns(ErsatzWarning, match="1 instead of 4 qualities"):
        build(
            scans=tmp_path / "scans",
            settings=Settings(acquisition=AcquisitionSettings(views=2, workers=2)),
            progress=lambda stage, share: seen.append(len(multiprocessing.active_children())),
        )
    assert max(seen) == 2


def test_measurement_beats_judgement(shared_data: Path, tmp_path: Path) -> None:
    """A folder of one scanned bowl and the expert: size is measured, rigidity judged, each says so."""
    source = next((shared_data / "objects" / "bowl").glob("ycb_024*"))
    folder = tmp_path / "scans" / "bowl" / "bowl_x"
    folder.mkdir(parents=True)
    (folder / source.name).symlink_to(source)
    out = tmp_path / "kb.ttl"
    with pytest.warns(ErsatzWarning, match="1 instead of 4 qualities"):
        kb = build(scans=tmp_path / "scans", expert=DATA / "expert.toml", out=out)
    origin = {
        str(row["property"]).rpartition("#")[2]: str(row["origin"]).rpartition("#")[2]
        for row in kb.ask("instance_measurements", instance="bowl_x")
    }
    assert origin["size"] == "machine"
    assert origin["shape_1"] == "machine"
    assert origin["rigidity"] == "human"
    assert out.with_suffix(".concepts.npz").exists()
    assert ground(KnowledgeBase.open(out), shared_data / APPLE).held
