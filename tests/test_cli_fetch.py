"""`ersatz fetch`, from a server on this machine, and a knowledge base built from what it fetched."""

import json
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from ersatz.acquisition.fetch import RECORD
from ersatz.knowledge.base import KnowledgeBase
from tests.acquisition.shapes import mesh_of, views
from tests.acquisition.test_scans import pcd, ply
from tests.archives import Server, archive, served
from tests.cli import Shell


@pytest.fixture
def site(tmp_path: Path) -> Iterator[str]:
    """A publisher of two bowls as Washington has them, each seen three times."""
    folder = tmp_path / "site"
    folder.mkdir()
    for number in (1, 2):
        name = f"bowl_{number}"
        archive(
            folder / f"{name}.tar",
            {
                f"rgbd-dataset/bowl/{name}/{name}_{video}_1.pcd": pcd(view.points - view.sensor)
                for video, view in enumerate(views(("cup",), range(number, number + 1)), start=1)
                if view.sensor is not None
            },
        )
    with served(folder) as base:
        yield base


def classes(kb: Path) -> dict[object, object]:
    """Return the number of instances of each class."""
    return {row["name"]: row["instances"] for row in KnowledgeBase.open(kb).ask("classes")}


def test_fetched_views_are_built_from(site: str, tmp_path: Path, ersatz: Shell) -> None:
    """What broke off goes on, all is checked, and the folder is what `build --scans` takes."""
    ask = ("fetch", "washington", tmp_path / "scans", "--class", "bowl", "--url", site.rstrip("/"))
    Server.limit = 20_000
    run = ersatz(*ask, "--object", "bowl_1")
    assert run.code == 2 and "20000 bytes are kept, fetch again to go on" in run.err
    Server.limit = None
    run = ersatz(*ask[:3], "--object", "bowl_1", "--object", "bowl_2", *ask[5:])
    assert run.code == 0, run.err
    assert Server.asked == [None, "bytes=20000-", None]
    assert "2 archives of washington, checked" in run.err and "Lai" in run.err
    assert sorted(json.loads((tmp_path / "scans" / RECORD).read_text())) == ["bowl_1.tar", "bowl_2.tar"]

    run = ersatz("build", tmp_path / "kb.ttl", "--scans", tmp_path / "scans")
    assert run.code == 0, run.err
    assert classes(tmp_path / "kb.ttl") == {"bowl": 2}


def test_fetched_meshes_are_built_from(tmp_path: Path, ersatz: Shell) -> None:
    site = tmp_path / "site"
    site.mkdir()
    mesh = mesh_of("cup", 1)
    inside = {"024_bowl/google_16k/nontextured.ply": ply(mesh.vertices, mesh.triangles, "ascii")}
    archive(site / "024_bowl_google_16k.tgz", inside)
    with served(site) as base:
        assert ersatz("fetch", "ycb", tmp_path / "ycb", "--class", "bowl", "--url", base).code == 0
    run = ersatz("build", tmp_path / "kb.ttl", "--scans", tmp_path / "ycb", "--views", 1)
    assert run.code == 0, run.err
    assert classes(tmp_path / "kb.ttl") == {"bowl": 1}


def test_list_says_what_there_is_and_whom_to_cite(ersatz: Shell) -> None:
    run = ersatz("fetch", "--list")
    assert run.code == 0
    words = " ".join(run.out.split())
    assert "washington: 146 objects of 22 classes" in words
    assert "coffee mug 8 coffee_mug_1 ... coffee_mug_8" in words
    assert "CC-BY-4.0" in words and "non-commercial" in words
    assert "washington" not in ersatz("fetch", "ycb", "--list").out


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("washingtn", "scans"), "unknown data set 'washingtn': did you mean 'washington'?"),
        (("washington", "scans", "--class", "bowls"), "unknown class 'bowls': did you mean 'bowl'?"),
        (("washington", "scans", "--object", "bowl_11"), "unknown object 'bowl_11': did you mean 'bowl_1'"),
        (("washington",), "name a data set and a folder"),
        (("ycb", "scans", "--url", "mirror"), "'mirror' is no address of a mirror"),
    ],
)
def test_what_cannot_be_meant(
    words: tuple[str, ...], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, ersatz: Shell
) -> None:
    monkeypatch.chdir(tmp_path)
    run = ersatz("fetch", *words)
    assert run.code == 2 and message in run.err and run.err.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_a_server_that_is_not_there(tmp_path: Path, ersatz: Shell) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))  # Bound and not listening: nobody else can answer there.
        run = ersatz("fetch", "ycb", tmp_path / "ycb", "--url", f"http://127.0.0.1:{taken.getsockname()[1]}")
    assert run.code == 2 and "Connection refused; 0 bytes are kept" in run.err


def test_a_recorded_checksum_binds(site: str, tmp_path: Path, ersatz: Shell) -> None:
    """Copied from elsewhere, too: before anything of that file is unpacked."""
    (tmp_path / "scans").mkdir()
    (tmp_path / "scans" / RECORD).write_text(json.dumps({"bowl_1.tar": "0" * 64}))
    run = ersatz("fetch", "washington", tmp_path / "scans", "--object", "bowl_1", "--url", site)
    assert run.code == 2 and f"recorded was {'0' * 64}" in run.err
    assert not (tmp_path / "scans" / "rgbd-dataset").exists()


def test_a_folder_that_cannot_be_written(site: str, tmp_path: Path, ersatz: Shell) -> None:
    (tmp_path / "scans").write_text("a file")
    run = ersatz("fetch", "washington", tmp_path / "scans", "--url", site)
    assert run.code == 2 and "scans: cannot be written" in run.err
    assert (tmp_path / "scans").read_text() == "a file"


def test_archives_may_stay_packed(site: str, tmp_path: Path, ersatz: Shell) -> None:
    run = ersatz("fetch", "washington", tmp_path, "--object", "bowl_1", "--url", site, "--no-unpack")
    assert run.code == 0 and "ersatz build" not in run.err
    assert not (tmp_path / "rgbd-dataset").exists()
