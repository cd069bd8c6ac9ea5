"""A server of archives on this machine, as a publisher of data sets has one."""

import functools
import http.server
import io
import tarfile
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import ClassVar


class Server(http.server.SimpleHTTPRequestHandler):
    """Serves a folder, with ranges; breaks off after `limit` bytes, or claims `claims`, if that is set."""

    limit: ClassVar[int | None] = None
    claims: ClassVar[int | None] = None
    version: ClassVar[str] = ""
    asked: ClassVar[list[str | None]] = []

    def do_GET(self) -> None:
        path = Path(self.translate_path(self.path))
        if not path.is_file():
            self.send_error(404)
            return
        data = path.read_bytes()
        wanted = self.headers.get("Range")
        Server.asked.append(wanted)
        if self.headers.get("If-Range", Server.version) != Server.version:
            wanted = None
        start = int(wanted.removeprefix("bytes=").rstrip("-")) if wanted else 0
        if start >= len(data):
            self.send_error(416)
            return
        self.send_response(206 if wanted else 200)
        self.send_header("Content-Length", str(Server.claims or len(data) - start))
        if Server.version:
            self.send_header("ETag", Server.version)
        self.end_headers()
        self.wfile.write(data[start:][: Server.limit])

    def log_message(self, *_: object) -> None:
        """Stay silent."""


@contextmanager
def served(folder: Path) -> Iterator[str]:
    """Serve a folder; yield its address."""
    Server.limit, Server.claims, Server.version, Server.asked = None, None, "", []
    server = http.server.ThreadingHTTPServer(
        ("127.0.0.1", 0), functools.partial(Server, directory=str(folder))
    )
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}/"
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


def archive(path: Path, files: Mapping[str, bytes]) -> None:
    """Write a tar file, compressed if its name says so."""
    with tarfile.open(path, "w:gz" if path.suffix == ".tgz" else "w") as file:
        for name, content in files.items():
            info = tarfile.TarInfo(name)
            info.size = len(content)
            file.addfile(info, io.BytesIO(content))
