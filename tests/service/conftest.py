"""Servers in processes of their own, on loopback, shared by the tests of a session."""

import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from http.client import HTTPConnection, HTTPResponse
from pathlib import Path

import pytest

from ersatz.grounding.subcategorization import SubcategorizationSettings
from ersatz.pipeline import Settings, build
from tests.conftest import ROOT, TABLE
from tests.knowledge.endpoints import free_port

TOKEN = "a token of twenty-four c"
SCRIPT = """\
import logging, sys
from pathlib import Path, PosixPath
from ersatz.knowledge.base import KnowledgeBase
from ersatz.service.server import serve
from ersatz.service.settings import ServiceSettings
logging.basicConfig(level=logging.INFO)
serve(KnowledgeBase.open(sys.argv[1]), ServiceSettings(**eval(sys.argv[3])), port=int(sys.argv[2]))
"""


@dataclass
class Server:
    """A running service, and what a client of it needs."""

    port: int
    process: subprocess.Popen[bytes]
    log: Path

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    def send(
        self, method: str, target: str, body: bytes | None = None, headers: dict[str, str] | None = None
    ) -> tuple[int, bytes, HTTPResponse]:
        """Send a request as it is, however odd, and return status, body and answer."""
        connection = HTTPConnection("127.0.0.1", self.port, timeout=30)
        try:
            connection.request(method, target, body, headers or {})
            answer = connection.getresponse()
            return answer.status, answer.read(), answer
        finally:
            connection.close()

    def raw(self, data: bytes, wait: float = 5.0) -> bytes:
        """Send bytes on a socket of their own and return what comes until the end, or the time is up."""
        with socket.create_connection(("127.0.0.1", self.port), timeout=wait) as line:
            received = b""
            try:
                line.sendall(data)
                while piece := line.recv(65536):
                    received += piece
            except (TimeoutError, ConnectionResetError):
                pass
            return received

    def stop(self) -> int:
        """Ask it to end, as an operator would, and return its exit code."""
        self.process.send_signal(signal.SIGTERM)
        return self.process.wait(timeout=30)


def start(location: str | Path, log: Path, *, patience: int = 60, **settings: object) -> Server:
    """Start a service and wait until it answers."""
    port = free_port()
    with log.open("wb") as out:
        process = subprocess.Popen(
            [sys.executable, "-c", SCRIPT, str(location), str(port), repr(settings)],
            stdout=out,
            stderr=subprocess.STDOUT,
            cwd=ROOT,
            env={**os.environ, "OMP_NUM_THREADS": "1"},
        )
    server = Server(port, process, log)
    for _ in range(10 * patience):
        if process.poll() is not None:
            raise AssertionError(f"the service ended: {log.read_text()}")
        try:
            if server.send("GET", "/health")[0] == 200:
                return server
        except OSError:
            time.sleep(0.1)
    process.kill()
    raise AssertionError(f"the service did not start within {patience} s")


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """The household, read-only, with pages; queries may take two seconds."""
    running = start("household", tmp_path_factory.mktemp("service") / "log", seconds=2.0, rows=60_000)
    yield running
    assert running.process.poll() is None, running.log.read_text()
    running.stop()


@pytest.fixture(scope="session")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small knowledge base of three classes, as a file not to be changed."""
    folder = tmp_path_factory.mktemp("small")
    table = folder / "objects.csv"
    table.write_text(TABLE, encoding="utf-8")
    settings = Settings(SubcategorizationSettings(2, restarts=5), time="2026-01-01T00:00:00Z")
    build(tables=[table], settings=settings, out=folder / "small.ttl")
    return folder / "small.ttl"


@pytest.fixture(scope="module")
def writable(tmp_path_factory: pytest.TempPathFactory, small: Path) -> Iterator[Server]:
    """A copy of the small knowledge base, writable with a token, without pages; shared by a module."""
    folder = tmp_path_factory.mktemp("writable")
    shutil.copy(small, folder / "kb.ttl")
    running = start(folder / "kb.ttl", folder / "log", token=TOKEN, pages=False)
    yield running
    if running.process.poll() is None:
        running.stop()


@pytest.fixture
def fresh(tmp_path: Path, small: Path) -> Iterator[Server]:
    """The same, for one test, which may stop it."""
    shutil.copy(small, tmp_path / "kb.ttl")
    running = start(tmp_path / "kb.ttl", tmp_path / "log", token=TOKEN, pages=False)
    yield running
    if running.process.poll() is None:
        running.stop()
