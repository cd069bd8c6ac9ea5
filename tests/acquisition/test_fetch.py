"""Fetching from a server on this machine: whole, resumed, spoiled, missing."""

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from ersatz.acquisition.fetch import DATA_SETS, RECORD, fetch
from ersatz.errors import InputError, UnknownNameError
from tests.archives import Server, archive, served


@pytest.fixture
def site(tmp_path: Path) -> Iterator[tuple[str, Path]]:
    folder = tmp_path / "site"
    folder.mkdir()
    archive(folder / "bowl_1.tar", {"bowl/bowl_1/bowl_1_1_1.pcd": bytes(range(250)) * 1200})
    with served(folder) as base:
        yield base, folder


def test_fetch_unpacks_records_and_does_not_fetch_twice(site: tuple[str, Path], tmp_path: Path) -> None:
    base, folder = site
    seen: list[tuple[str, int, int]] = []
    out = tmp_path / "out"
    (path,) = fetch(
        "washington", out, base=base, files=("bowl_1.tar",), progress=lambda *step: seen.append(step)
    )
    size = (folder / "bowl_1.tar").stat().st_size
    assert path.read_bytes() == (folder / "bowl_1.tar").read_bytes()
    assert seen[-1] == ("bowl_1.tar", size, size)
    assert (out / "bowl" / "bowl_1" / "bowl_1_1_1.pcd").stat().st_size == 300_000
    assert set(json.loads((out / RECORD).read_text())) == {"bowl_1.tar"}
    fetch("washington", out, base=base, files=("bowl_1.tar",))
    assert len(Server.asked) == 1


def test_a_broken_download_is_resumed(site: tuple[str, Path], tmp_path: Path) -> None:
    base, folder = site
    Server.limit = 100_000
    with pytest.raises(InputError, match="fetch again to go on"):
        fetch("washington", tmp_path / "out", base=base, files=("bowl_1.tar",))
    assert not (tmp_path / "out" / "bowl_1.tar").exists()
    Server.limit = None
    (path,) = fetch("washington", tmp_path / "out", base=base, files=("bowl_1.tar",))
    assert Server.asked == [None, "bytes=100000-"]
    assert path.read_bytes() == (folder / "bowl_1.tar").read_bytes()


def test_a_complete_part_is_taken(site: tuple[str, Path], tmp_path: Path) -> None:
    base, folder = site
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "bowl_1.tar.part").write_bytes((folder / "bowl_1.tar").read_bytes())
    (path,) = fetch("washington", tmp_path / "out", base=base, files=("bowl_1.tar",))
    assert path.read_bytes() == (folder / "bowl_1.tar").read_bytes()


def test_a_changed_file_is_noticed(site: tuple[str, Path], tmp_path: Path) -> None:
    base, _ = site
    (path,) = fetch("washington", tmp_path / "out", base=base, files=("bowl_1.tar",))
    path.write_bytes(path.read_bytes()[:-1] + b"x")
    with pytest.raises(InputError, match="recorded was"):
        fetch("washington", tmp_path / "out", base=base, files=("bowl_1.tar",))


def test_missing_files_and_names(site: tuple[str, Path], tmp_path: Path) -> None:
    base, _ = site
    with pytest.raises(InputError, match="404"):
        fetch("washington", tmp_path / "out", base=base, files=("nothing.tar",))
    with pytest.raises(UnknownNameError, match="did you mean 'washington'"):
        fetch("Washingtn", tmp_path / "out")
    with pytest.raises(InputError, match=r"refused.*kept"):
        fetch("ycb", tmp_path / "out", base="http://127.0.0.1:9/", files=("a.tgz",))
    with pytest.raises(InputError, match="no address"):
        fetch("ycb", tmp_path / "out", base="file:///etc/", files=("a.tgz",))


def test_a_file_changed_by_its_publisher_is_begun_anew(site: tuple[str, Path], tmp_path: Path) -> None:
    """Else the beginning of one version and the end of another would be recorded as the whole."""
    base, folder = site
    Server.limit, Server.version = 100_000, '"one"'
    with pytest.raises(InputError, match="fetch again to go on"):
        fetch("washington", tmp_path / "out", base=base, files=("bowl_1.tar",))
    Server.limit, Server.version = None, '"two"'
    archive(folder / "bowl_1.tar", {"bowl/bowl_1/bowl_1_1_1.pcd": bytes(300_000)})
    (path,) = fetch("washington", tmp_path / "out", base=base, files=("bowl_1.tar",))
    assert path.read_bytes() == (folder / "bowl_1.tar").read_bytes()
    assert sorted(one.name for one in path.parent.iterdir()) == ["bowl", "bowl_1.tar", RECORD]


def test_what_is_no_archive_is_not_kept(site: tuple[str, Path], tmp_path: Path) -> None:
    """A gateway that asks for a login answers 200 with a page."""
    base, folder = site
    (folder / "bowl_2.tar").write_text("<html>Please log in</html>")
    with pytest.raises(InputError, match="no archive, it begins with b'<html>"):
        fetch("washington", tmp_path / "out", base=base, files=("bowl_2.tar",))
    assert not list((tmp_path / "out").iterdir())


def test_a_spoiled_archive_is_said_to_be_one(site: tuple[str, Path], tmp_path: Path) -> None:
    base, folder = site
    whole = folder / "005_can.tgz"
    archive(whole, {"005_can/cloud.xyz": np.random.default_rng(0).bytes(100_000)})
    whole.write_bytes(whole.read_bytes()[:50_000])
    with pytest.raises(InputError, match="cannot be unpacked"):
        fetch("ycb", tmp_path / "out", base=base, files=("005_can.tgz",))


def test_only_what_is_missing_is_unpacked(site: tuple[str, Path], tmp_path: Path) -> None:
    base, folder = site
    archive(folder / "cap_1.tar", {"cap/one.pcd": b"one", "cap/two.pcd": b"two"})
    fetch("washington", tmp_path, base=base, files=("cap_1.tar",))
    (tmp_path / "cap" / "one.pcd").write_bytes(b"ONE")
    (tmp_path / "cap" / "two.pcd").unlink()
    fetch("washington", tmp_path, base=base, files=("cap_1.tar",))
    assert (tmp_path / "cap" / "one.pcd").read_bytes() == b"ONE"
    assert (tmp_path / "cap" / "two.pcd").read_bytes() == b"two"


def test_a_full_disk_is_said_before_it_is_full(site: tuple[str, Path], tmp_path: Path) -> None:
    base, _ = site
    Server.claims = 10**18
    with pytest.raises(InputError, match=r"1,000,000,000,000,000,000 bytes are to come and .* are free"):
        fetch("washington", tmp_path / "out", base=base, files=("bowl_1.tar",))


@pytest.mark.parametrize("record", ["{", "[]", '{"bowl_1.tar": 7}'])
def test_a_broken_record(record: str, site: tuple[str, Path], tmp_path: Path) -> None:
    base, _ = site
    (tmp_path / RECORD).write_text(record)
    with pytest.raises(InputError, match="not a file of"):
        fetch("washington", tmp_path, base=base, files=("bowl_1.tar",))


def test_archives_cannot_write_outside(site: tuple[str, Path], tmp_path: Path) -> None:
    base, folder = site
    archive(folder / "evil.tar", {"../evil.txt": b"evil"})
    with pytest.raises(InputError, match=r"evil\.txt.*outside"):
        fetch("washington", tmp_path / "out", base=base, files=("evil.tar",))
    assert not (tmp_path / "evil.txt").exists()


def test_the_paper_needs_146_washington_archives() -> None:
    data = DATA_SETS["washington"]
    assert len(data.files()) == 146
    assert sum(data.classes.values()) == 146 and len(data.classes) == 22
    assert all(one.credit and one.objects for one in DATA_SETS.values())


def test_objects_and_classes_are_chosen_by_name() -> None:
    data = DATA_SETS["washington"]
    assert data.files(["binder"], ["cap_2"]) == ("binder_1.tar", "binder_2.tar", "binder_3.tar", "cap_2.tar")
    assert DATA_SETS["ycb"].files(["bowl"]) == ("024_bowl_google_16k.tgz",)
    with pytest.raises(UnknownNameError, match="unknown class 'coffe mug': did you mean 'coffee mug'"):
        data.files(["coffe mug"])
    with pytest.raises(UnknownNameError, match="unknown object 'cap_9': did you mean 'cap_"):
        data.files((), ["cap_9"])
