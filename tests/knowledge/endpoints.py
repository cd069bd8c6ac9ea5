"""SPARQL servers on loopback for the tests: Oxigraph, Virtuoso, and one that misbehaves."""

import shutil
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from urllib.error import URLError
from urllib.parse import parse_qs, quote
from urllib.request import build_opener

import httpx
import pyoxigraph as ox
import pytest

Respond = Callable[[BaseHTTPRequestHandler, dict[str, str]], None]


@dataclass(frozen=True, slots=True)
class Endpoint:
    """A running server.

    Attributes
    ----------
    query : str
        URL of the SPARQL endpoint.
    graphs : str
        URL of the graph store protocol.
    client : httpx.Client
        Speaks to it, with authentication where it wants that.
    """

    query: str
    graphs: str
    client: httpx.Client

    def load(self, file: Path, graph: str) -> str:
        """Load a file into a named graph and return the URL that reads this graph alone."""
        self.put(file.read_bytes(), f"?graph={quote(graph, safe='')}")
        return f"{self.query}?default-graph-uri={quote(graph, safe='')}"

    def put(self, turtle: bytes, graph: str) -> None:
        """Replace a graph."""
        # Virtuoso hangs up on a large body that comes without credentials: the empty request fetches the
        # challenge that the client answers in advance from then on.
        self.client.get(self.graphs, params={"graph": "urn:nothing"})
        headers = {"Content-Type": "text/turtle"}
        self.client.put(self.graphs + graph, content=turtle, headers=headers).raise_for_status()


def free_port() -> int:
    """Return a port nobody listens at."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@contextmanager
def _running(command: list[str], folder: Path, url: str) -> Iterator[None]:
    """Run a server until the block ends; enter it when it answers."""
    with (folder / "log").open("wb") as log:
        server = subprocess.Popen(command, cwd=folder, stdout=log, stderr=log)
        try:
            _await(server, url, folder / "log")
            yield
        finally:
            server.terminate()
            try:
                server.wait(20)
            except subprocess.TimeoutExpired:
                server.kill()
                server.wait()


def _await(server: "subprocess.Popen[bytes]", url: str, log: Path) -> None:
    for _ in range(600):
        try:
            build_opener().open(url, timeout=5).close()
            return
        except (URLError, OSError):
            if server.poll() is not None:
                break
            time.sleep(0.1)
    raise AssertionError(f"{url} never answered: {log.read_text(errors='replace')[-2000:]}")


@contextmanager
def oxigraph(folder: Path) -> Iterator[Endpoint]:
    """Run Oxigraph's server with an empty store in memory."""
    binary = Path(sys.executable).with_name("oxigraph")
    found = str(binary) if binary.exists() else shutil.which("oxigraph")
    if found is None:
        pytest.skip("no Oxigraph server: pip install oxigraph")
    url = f"http://127.0.0.1:{free_port()}"
    with (
        _running(
            [found, "serve", "--bind", url.removeprefix("http://")], folder, f"{url}/query?query=ASK{{}}"
        ),
        httpx.Client(timeout=60) as client,
    ):
        yield Endpoint(f"{url}/query", f"{url}/store", client)


@contextmanager
def virtuoso(folder: Path) -> Iterator[Endpoint]:
    """Run Virtuoso with an empty database in the folder and its default limit of 10,000 rows."""
    found = shutil.which("virtuoso-t")
    if found is None:
        pytest.skip("no Virtuoso: install it (Debian: virtuoso-opensource) to test against it")
    port = free_port()
    (folder / "virtuoso.ini").write_text(VIRTUOSO.format(sql=free_port(), http=port), encoding="utf-8")
    url = f"http://127.0.0.1:{port}"
    command = [found, "+foreground", "+configfile", str(folder / "virtuoso.ini")]
    with (
        _running(command, folder, f"{url}/sparql?query=ASK{{}}"),
        httpx.Client(auth=httpx.DigestAuth("dba", "dba"), timeout=60) as client,
    ):
        yield Endpoint(f"{url}/sparql", f"{url}/sparql-graph-crud-auth", client)


VIRTUOSO = """\
[Database]
DatabaseFile = virtuoso.db
ErrorLogFile = virtuoso.log
LockFile = virtuoso.lck
TransactionFile = virtuoso.trx
xa_persistent_file = virtuoso.pxa
[TempDatabase]
DatabaseFile = virtuoso-temp.db
TransactionFile = virtuoso-temp.trx
[Parameters]
ServerPort = 127.0.0.1:{sql}
DisableUnixSocket = 1
DirsAllowed = .
NumberOfBuffers = 10000
[HTTPServer]
ServerPort = 127.0.0.1:{http}
ServerThreads = 5
[SPARQL]
ResultSetMaxRows = 10000
"""


@contextmanager
def misbehaving(respond: Respond) -> Iterator[str]:
    """Run a server that answers every request by calling `respond(handler, form)`."""

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            body = self.rfile.read(int(self.headers["Content-Length"])).decode()
            respond(self, {name: values[0] for name, values in parse_qs(body).items()})

        def log_message(self, *_: object) -> None: ...

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True).start()
    try:
        yield f"http://127.0.0.1:{server.server_port}/sparql"
    finally:
        server.shutdown()
        server.server_close()


def send(handler: BaseHTTPRequestHandler, body: bytes, media: str, status: int = 200) -> None:
    """Send a whole answer."""
    handler.send_response(status)
    handler.send_header("Content-Type", media)
    handler.send_header("Content-Length", str(len(body)))
    handler.end_headers()
    handler.wfile.write(body)


def evaluate(engine: ox.Store, text: str) -> tuple[bytes, str]:
    """Return what a server that behaves answers to a query, with its media type."""
    results = engine.query(text)
    if isinstance(results, ox.QueryTriples):
        return results.serialize(format=ox.RdfFormat.N_TRIPLES) or b"", "application/n-triples"
    return results.serialize(format=ox.QueryResultsFormat.JSON) or b"", "application/sparql-results+json"
