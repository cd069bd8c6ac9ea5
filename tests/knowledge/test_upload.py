"""Upload: the same answers from a server, whoever is killed when; secrets go to their host alone."""

import threading
from collections.abc import Iterator
from functools import cache
from hashlib import sha256
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from urllib.error import URLError
from urllib.parse import quote, urlsplit
from urllib.request import Request, urlopen

import polars as pl
import pytest

from ersatz.errors import InputError, KnowledgeBaseError
from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.remote import RemoteStore
from ersatz.knowledge.transport import CREDENTIALS, Login, Transport
from ersatz.knowledge.upload import UploadSettings, upload
from ersatz.reasoner.substitution import rank_substitutes
from tests.cli import Shell
from tests.knowledge.endpoints import Endpoint, oxigraph, virtuoso
from tests.knowledge.tools import facts_of, lines_of
from tests.knowledge.tools import small as built

SETTINGS = UploadSettings(piece=40)


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Endpoint]:
    with oxigraph(tmp_path_factory.mktemp("oxigraph")) as running:
        yield running


@pytest.fixture
def url(server: Endpoint, request: pytest.FixtureRequest) -> str:
    """The URL of a graph of this test's own."""
    return reading(server, f"urn:{request.node.name}")


@cache
def once() -> tuple[str, ...]:
    return tuple(line for line in lines_of(built()) if "#revision>" not in line)


def small() -> KnowledgeBase:
    """A copy of the small knowledge base, of this test's own."""
    return KnowledgeBase.create(once())


def reading(server: Endpoint, graph: str) -> str:
    return f"{server.query}?default-graph-uri={quote(graph, safe='')}"


def answers(kb: KnowledgeBase) -> list[object]:
    tools = kb.known_names("class")
    return [(one.iri, one.fraction, one.accepted) for tool in tools for one in rank_substitutes(kb, tool)]


class Relay:
    """A server between us and another, which breaks when it is told to and counts what it takes."""

    def __init__(self, to: str, last: int | None = None) -> None:
        self.posts = 0
        relay, base = self, to.rpartition("/")[0]

        class Handler(BaseHTTPRequestHandler):
            def do_POST(self) -> None:
                body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
                relay.posts += self.path.startswith("/store")
                if last is not None and relay.posts > last:
                    self.close_connection = True  # hangs up
                    return
                kept = {k: v for k, v in self.headers.items() if k in ("Content-Type", "Accept")}
                request = Request(base + self.path, body or None, kept, method=self.command)
                try:
                    with urlopen(request, timeout=30) as answer:
                        found, status = answer.read(), answer.status
                        media = answer.headers.get("Content-Type", "text/plain")
                except URLError as error:
                    found, status, media = str(error).encode(), getattr(error, "code", 502), "text/plain"
                self.send_response(status)
                self.send_header("Content-Type", media)
                self.send_header("Content-Length", str(len(found)))
                self.end_headers()
                self.wfile.write(found)

            def do_DELETE(self) -> None:
                self.do_POST()

            def log_message(self, *_: object) -> None: ...

        self._server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.query = f"http://127.0.0.1:{self._server.server_port}/query"

    def __enter__(self) -> "Relay":
        threading.Thread(target=self._server.serve_forever, args=(0.01,), daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self._server.shutdown()
        self._server.server_close()


def test_what_was_uploaded_is_the_same(url: str) -> None:
    kb = small()
    assert upload(kb, url, SETTINGS) == len(lines_of(kb))
    found = KnowledgeBase.open(url)
    assert lines_of(found) == lines_of(kb)
    assert answers(found) == answers(kb)
    assert found.build == kb.build


def test_the_default_graph_can_be_the_home(tmp_path: Path) -> None:
    with oxigraph(tmp_path) as server:
        upload(small(), server.query, SETTINGS)
        assert answers(KnowledgeBase.open(server.query)) == answers(small())
        changed = small()
        changed.forget("plate 1")
        upload(changed, server.query, UploadSettings(piece=40, replace=True))
        assert lines_of(KnowledgeBase.open(server.query)) == lines_of(changed)


@pytest.mark.parametrize("last", range(5))
def test_a_broken_upload_is_not_believed_and_goes_on(server: Endpoint, last: int) -> None:
    graph, kb = f"urn:broken{last}", small()
    with (
        Relay(server.query, last) as relay,
        pytest.raises(KnowledgeBaseError, match="the same command goes on with it"),
    ):
        upload(kb, f"{relay.query}?default-graph-uri={graph}", SETTINGS)
    with pytest.raises(KnowledgeBaseError, match="no ERSATZ knowledge base"):
        KnowledgeBase.open(reading(server, graph))
    with Relay(server.query) as relay:
        upload(kb, f"{relay.query}?default-graph-uri={graph}", SETTINGS)
    pieces = -(-(len(lines_of(kb)) - 2) // SETTINGS.piece)
    assert relay.posts == 1 + pieces - max(last - 1, 0) + 1  # what had arrived was not sent again
    assert lines_of(KnowledgeBase.open(reading(server, graph))) == lines_of(kb)


def test_triples_that_came_in_another_order_are_completed(server: Endpoint, url: str) -> None:
    kb = small()
    with Relay(server.query, 3) as relay, pytest.raises(KnowledgeBaseError):
        upload(kb, url.replace(server.query, relay.query), UploadSettings(piece=25))
    kept = sorted(lines_of(kb), reverse=True)[:80]
    server.put(
        "".join([*kept, *(one for one in lines_of(kb) if "#revision>" in one)]).encode(), graph_of(url)
    )
    upload(kb, url, SETTINGS)
    assert lines_of(KnowledgeBase.open(url)) == lines_of(kb)


def graph_of(url: str) -> str:
    return "?graph=" + urlsplit(url).query.partition("=")[2]


def test_a_knowledge_base_is_replaced_only_when_asked_and_at_once(server: Endpoint, url: str) -> None:
    old, new = small(), small()
    new.observe("tray", "tray 3", {"weight": 0.75})
    upload(old, url, SETTINGS)
    with pytest.raises(InputError, match="holds a knowledge base: name another graph, or replace it"):
        upload(new, url, SETTINGS)
    with Relay(server.query, 3) as relay, pytest.raises(KnowledgeBaseError):
        upload(new, url.replace(server.query, relay.query), UploadSettings(piece=40, replace=True))
    assert lines_of(KnowledgeBase.open(url)) == lines_of(old)  # while the new one is on its way
    upload(new, url, UploadSettings(piece=40, replace=True))
    assert lines_of(KnowledgeBase.open(url)) == lines_of(new)
    stage = quote(urlsplit(url).query.partition("=")[2] + "#upload", safe="%")
    assert server.client.get(f"{server.graphs}?graph={stage}").status_code == 404


def test_an_unfinished_upload_of_another_is_in_the_way(server: Endpoint, url: str) -> None:
    other = small()
    other.forget("plate 1")
    with Relay(server.query, 3) as relay, pytest.raises(KnowledgeBaseError):
        upload(small(), url.replace(server.query, relay.query), SETTINGS)
    with pytest.raises(InputError, match="unfinished upload of another knowledge base"):
        upload(other, url, SETTINGS)
    upload(other, url, UploadSettings(replace=True))
    assert lines_of(KnowledgeBase.open(url)) == lines_of(other)


def test_foreign_triples_are_never_deleted(server: Endpoint, url: str, ersatz: Shell, tmp_path: Path) -> None:
    foreign = b"<urn:a> <urn:b> <urn:c> .\n"
    server.put(foreign, graph_of(url))
    small().save(tmp_path / "kb.ttl")
    run = ersatz("upload", tmp_path / "kb.ttl", url, "--replace")
    assert run.code == 2
    assert "holds 1 triples that are no knowledge base" in run.err
    assert (
        server.client.get(server.graphs + graph_of(url), headers={"Accept": "text/turtle"}).status_code == 200
    )


def test_the_command_line_uploads_a_directory_and_asks_it(
    server: Endpoint, url: str, ersatz: Shell, tmp_path: Path
) -> None:
    small().save(tmp_path / "kb")
    run = ersatz("upload", tmp_path / "kb", url)
    assert (run.code, run.out) == (0, "")
    assert f"{len(lines_of(small()))} triples, revision {small().revision[:12]}" in run.err
    asked = [ersatz("substitute", where, "--missing", "tray", "--json") for where in (tmp_path / "kb", url)]
    assert asked[0] == asked[1]
    assert asked[0].code in (0, 1)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["http://127.0.0.1:9/repositories/kb"], "where is the Graph Store Protocol"),
        (["ftp://127.0.0.1/query"], "is not the URL of a SPARQL endpoint"),
        (["http://127.0.0.1:9/query", "--piece", "0"], "piece is 0"),
        (["http://127.0.0.1:9/query"], "cannot reach"),
        (["http://127.0.0.1:9/query", "--credentials", "nowhere"], "cannot read the credentials in"),
    ],
)
def test_bad_input_is_one_clear_error(
    ersatz: Shell, tmp_path: Path, arguments: list[str], message: str
) -> None:
    small().save(tmp_path / "kb.ttl")
    run = ersatz("upload", tmp_path / "kb.ttl", *arguments)
    assert (run.code, run.out) == (2, "")
    assert message in run.err
    assert run.err.count("\n") == 1


# Logins --------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def guarded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Endpoint]:
    with virtuoso(tmp_path_factory.mktemp("virtuoso")) as running:
        yield running


def secrets(folder: Path, *lines: str) -> Path:
    file = folder / "secrets"
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    file.chmod(0o600)
    return file


def test_virtuoso_takes_an_upload_and_updates_with_a_digest_login(guarded: Endpoint, tmp_path: Path) -> None:
    url, kb = reading(guarded, "urn:fleet"), small()
    update = guarded.query + "-auth"
    with pytest.raises(KnowledgeBaseError, match="answered 401"):
        upload(kb, url, SETTINGS)
    wrong = secrets(tmp_path, "machine 127.0.0.1 login dba password wr0ng")
    with pytest.raises(KnowledgeBaseError, match="answered 401") as error:
        upload(kb, url, UploadSettings(credentials=wrong))
    assert "wr0ng" not in str(error.value)
    login = secrets(
        tmp_path, "machine elsewhere login dba password no", "machine 127.0.0.1 login dba password dba"
    )
    assert upload(kb, url, UploadSettings(credentials=login, piece=40)) == len(lines_of(kb))
    assert answers(KnowledgeBase.open(url)) == answers(kb)
    changed = small()
    changed.forget("plate 1")
    upload(changed, url, UploadSettings(update=update, credentials=login, replace=True))
    with KnowledgeBase(RemoteStore(url, update, credentials=login)) as found:
        assert facts_of(found) == facts_of(changed)


class Asking(BaseHTTPRequestHandler):
    """Lets in who knows the secret; sends on who asks for that; says what it was told."""

    def do_POST(self) -> None:
        self.rfile.read(int(self.headers["Content-Length"]))
        self.do_GET()

    def do_GET(self) -> None:
        told = self.headers.get("Authorization", "nothing")
        if "?" in self.path:
            self.send_response(302)
            self.send_header("Location", self.path.partition("?")[2])
        elif self.path == "/told":
            self.send_response(400, told)
        elif told in ("Basic cm9ib3Q6czNjcmV0", "Bearer t0ken"):
            self.send_response(200)
        else:
            self.send_response(401)
            self.send_header("WWW-Authenticate", 'Basic realm="robots"')
        self.send_header("Content-Length", "0")
        self.end_headers()

    def log_message(self, *_: object) -> None: ...


def send(port: int, path: str, credentials: Path) -> tuple[bytes, str]:
    return Transport(20, credentials).send(Request(f"http://127.0.0.1:{port}{path}", b"x"))


def test_a_login_goes_to_its_host_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    server = ThreadingHTTPServer(("127.0.0.1", 0), Asking)
    threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True).start()
    port = server.server_port
    try:
        for line in ("login robot password s3cret", "password t0ken"):
            send(port, "/", secrets(tmp_path, f"machine 127.0.0.1:{port} {line}"))
        with pytest.raises(KnowledgeBaseError, match="answered 400 nothing"):
            file = secrets(tmp_path, f"machine 127.0.0.1:{port} password t0ken")
            send(port, f"/?http://localhost:{port}/told", file)
        with pytest.raises(KnowledgeBaseError, match="answered 401"):
            send(port, "/", secrets(tmp_path, f"machine 127.0.0.1:{port + 1} login robot password s3cret"))
        monkeypatch.setenv(
            CREDENTIALS, str(secrets(tmp_path, "machine 127.0.0.1 login robot password s3cret"))
        )
        Transport(20).send(Request(f"http://127.0.0.1:{port}/", b"x"))
        known = Login.find(f"http://127.0.0.1:{port}/")
        assert known is not None
        assert "s3cret" not in repr(known)
        assert Login.find("http://example.org/") is None
    finally:
        server.shutdown()
        server.server_close()


@pytest.mark.parametrize(
    ("line", "mode", "message"),
    [
        ("machine 127.0.0.1 login a password s3cret", 0o644, "can be read by others: chmod 600 it"),
        ("machin 127.0.0.1 login a password s3cret", 0o600, "line 1 of .* is no line of a netrc file"),
    ],
)
def test_bad_credentials_are_one_clear_error(tmp_path: Path, line: str, mode: int, message: str) -> None:
    file = secrets(tmp_path, line)
    file.chmod(mode)
    with pytest.raises(InputError, match=message) as error:
        Login.find("http://127.0.0.1/", file)
    assert "s3cret" not in str(error.value)


def test_classes_alone_name_the_table_they_were_counted_in(ersatz: Shell, tmp_path: Path) -> None:
    table = tmp_path / "objects.parquet"
    pl.DataFrame(
        {"object_class": ["tray", "plate"], "instance": ["tray 1", "plate 1"], "weight [kg]": [0.8, 0.4]}
    ).write_parquet(table)
    assert ersatz("build", tmp_path / "kb", "--tables", table, "--classes-only").code == 0
    with KnowledgeBase.open(tmp_path / "kb") as kb:
        assert [(row["file"], row["sha256"]) for row in kb.ask("sources")] == [
            ("objects.parquet", sha256(table.read_bytes()).hexdigest())
        ]
        assert kb.known_names("instance") == []
        assert len(kb.known_names("class")) == 2
