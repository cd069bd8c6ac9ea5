"""Fetching from a server on this machine: whole, resumed, spoiled, missing."""

import functools
import http.server
import io
import json
import tarfile
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import ClassVar

import pytest

from ersatz.acquisition.fetch import DATA_SETS, RECORD, fetch
from ersatz.errors import InputError, UnknownNameError


class Server(http.server.SimpleHTTPRequestHandler):
    """Serves a folder, with ranges; breaks off after `limit` bytes if that is set."""

    limit: ClassVar[int | None] = None
    asked: ClassVar[list[str | None]] = []

    def do_GET(self) -> None:
        path = Path(self.translate_path(self.path))
        if not path.is_file():
            self.send_error(404)
            return
        data = path.read_bytes()
        wanted = self.headers.get("Range")
        Server.asked.append(wanted)
        start = int(wanted.removeprefix("bytes=").rstrip("-")) if wanted else 0
        if start >= len(data):
            self.send_error(416)
            return
        self.send_response(206 if wanted else 200)
        self.send_header("Content-Length", str(len(data) - start))
        self.end_headers()
        self.wfile.write(data[start:][: Server.limit])

    def log_message(self, *_: object) -> None:
        """Stay silent."""


@pytest.fixture
def site(tmp_path: Path) -> Iterator[tuple[str, Path]]:
    folder = tmp_path / "site"
    folder.mkdir()
    content = io.BytesIO()
    with tarfile.open(fileobj=content, mode="w") as archive:
        info = tarfile.TarInfo("bowl/bowl_1/bowl_1_1_1.pcd")
        info.size = 300_000
        archive.addfile(info, io.BytesIO(bytes(range(250)) * 1200))
    (folder / "bowl_1.tar").write_bytes(content.getvalue())
    Server.limit, Server.asked = None, []
    server = http.server.ThreadingHTTPServer(
        ("127.0.0.1", 0), functools.partial(Server, directory=str(folder))
    )
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    yield f"http://127.0.0.1:{server.server_port}/", folder
    server.shutdown()
    server.server_close()
    thread.join()


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
    with pytest.raises(InputError, match=r"refused|kept"):
        fetch("ycb", tmp_path / "out", base="http://127.0.0.1:9/", files=("a.tgz",))


def test_archives_cannot_write_outside(site: tuple[str, Path], tmp_path: Path) -> None:
    base, folder = site
    with tarfile.open(folder / "evil.tar", "w") as archive:
        archive.addfile(tarfile.TarInfo("../evil.txt"))
    with pytest.raises((tarfile.TarError, InputError)):
        fetch("washington", tmp_path / "out", base=base, files=("evil.tar",))
    assert not (tmp_path / "evil.txt").exists()


def test_the_paper_needs_146_washington_archives() -> None:
    assert len(DATA_SETS["washington"].files) == 146
    assert all(data.credit for data in DATA_SETS.values())
