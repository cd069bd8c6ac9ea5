"""What strangers may try: each is refused with the right status, and the service still answers."""

# ruff: noqa: E501  # a case is a line

import socket
import time
from concurrent.futures import ThreadPoolExecutor
from urllib.parse import quote, urlencode

import pytest

from ersatz.service.inspection import Dataset, RefusedError, inspect_query, inspect_update
from tests.service.conftest import TOKEN, Server

FORM = {"Content-Type": "application/x-www-form-urlencoded"}
DIRECT = {"Content-Type": "application/sparql-query"}
UPDATE = {"Content-Type": "application/sparql-update"}
LARGE = 2 << 20


def q(query: str) -> str:
    return f"/sparql?{urlencode({'query': query})}"


ATTACKS = [
    # The network and the file system, by query
    ("service", "GET", q("SELECT * { SERVICE <http://127.0.0.1:9/> { ?s ?p ?o } }"), None, {}, 403),
    ("service silent", "GET", q("SELECT * { SERVICE SILENT <http://127.0.0.1:9/> { ?s ?p ?o } }"), None, {}, 403),
    ("service by variable", "GET", q("SELECT * { VALUES ?e { <http://127.0.0.1:9/> } SERVICE ?e { ?s ?p ?o } }"), None, {}, 403),
    ("service by prefix", "GET", q("PREFIX e: <http://127.0.0.1:9/> SELECT * { SERVICE e:x { ?s ?p ?o } }"), None, {}, 403),
    ("service without spaces", "GET", q("SELECT*{?s ?p ?o.SERVICE<http://127.0.0.1:9/>{?a ?b ?c}}"), None, {}, 403),
    ("service in mixed case", "GET", q("SELECT * { sErViCe <http://127.0.0.1:9/> { ?s ?p ?o } }"), None, {}, 403),
    ("service after a comment", "GET", q("SELECT * { SERVICE # <\n <http://127.0.0.1:9/> { ?s ?p ?o } }"), None, {}, 403),
    ("service escaped", "GET", q("SELECT * { \\u0053ERVICE <http://127.0.0.1:9/> { ?s ?p ?o } }"), None, {}, 403),
    ("service behind a false string", "GET", q("SELECT * { ?s ?p ?o FILTER(1<2||'>'='x') SERVICE <http://127.0.0.1:9/> {} # '\n}"), None, {}, 403),
    ("service behind a false IRI", "GET", q("PREFIX a: <x:> SELECT * { FILTER(?x<a:#>'''\n) SERVICE <http://127.0.0.1:9/> {} #'''\n}"), None, {}, 403),
    ("service after true", "GET", q("SELECT * { ?s ?p trueSERVICE <http://127.0.0.1:9/> {} }"), None, {}, 403),
    ("service silent in one word", "GET", q("SELECT * {SERVICESILENT<http://127.0.0.1:9/>{}}"), None, {}, 403),
    ("service and prefix in one word", "GET", q("PREFIX e: <http://127.0.0.1:9/> SELECT * {SERVICEe:x{}}"), None, {}, 403),
    ("service in a subquery", "POST", "/sparql", "ASK { { SELECT * { SERVICE <http://127.0.0.1:9/> {} } } }", DIRECT, 403),
    ("from a file", "GET", q("SELECT * FROM <file:///etc/passwd> { ?s ?p ?o }"), None, {}, 403),
    ("from named", "GET", q("SELECT * FROM NAMED <file:///etc/passwd> { GRAPH ?g { ?s ?p ?o } }"), None, {}, 403),
    ("from the network", "GET", q("SELECT * FROM <http://127.0.0.1:9/x> { ?s ?p ?o }"), None, {}, 403),
    ("from a relative file", "GET", q("SELECT * FROM <../../etc/passwd> { ?s ?p ?o }"), None, {}, 403),
    ("from by prefix", "GET", q("PREFIX f: <file:///etc/> SELECT * FROM f:passwd { ?s ?p ?o }"), None, {}, 403),
    ("default graph in the URL", "GET", q("ASK {}") + "&default-graph-uri=file:///etc/passwd", None, {}, 403),
    ("named graph in the form", "POST", "/sparql", urlencode({"query": "ASK {}", "named-graph-uri": "http://x.example/"}), FORM, 403),
    ("graph store file", "GET", "/data?graph=file:///etc/passwd", None, {}, 404),
    # Writing
    ("insert", "POST", "/update", "INSERT DATA { <x:a> <x:b> <x:c> }", UPDATE, 403),
    ("insert as query", "POST", "/sparql", "INSERT DATA { <x:a> <x:b> <x:c> }", DIRECT, 400),
    ("drop by get", "GET", "/sparql?update=DROP%20ALL", None, {}, 405),
    ("load", "POST", "/update", "LOAD <file:///etc/passwd>", UPDATE, 403),
    ("put a graph", "PUT", "/data?default", "<x:a> <x:b> <x:c> .", {"Content-Type": "text/turtle"}, 405),
    ("delete a graph", "DELETE", "/data?default", None, {}, 405),
    ("remember", "POST", "/substitutes", '{"missing": "tray"}', {"Content-Type": "application/json"}, 403),
    ("token in the URL", "POST", f"/update?access_token={quote(TOKEN)}", "CLEAR ALL", UPDATE, 403),
    # Too much
    ("large body", "POST", "/sparql", "#" * LARGE, DIRECT, 413),
    ("large form", "POST", "/sparql", "query=" + "a" * LARGE, FORM, 413),
    ("large JSON", "POST", "/substitutes", "[" * LARGE, {"Content-Type": "application/json"}, 413),
    ("many parameters", "GET", "/sparql?" + "a=1&" * 200 + urlencode({"query": "ASK {}"}), None, {}, 400),
    ("deep nesting", "POST", "/sparql", "ASK " + "{" * 20_000 + "}" * 20_000, DIRECT, 400),
    ("deep parentheses", "POST", "/sparql", "ASK { FILTER" + "(" * 20_000 + "1" + ")" * 20_000 + "}", DIRECT, 400),
    ("deep negation", "POST", "/sparql", "ASK { FILTER(" + "!" * 200_000 + "true) }", DIRECT, 503),
    ("hidden nesting", "POST", "/sparql", "ASK " + "{#}\n" * 60_000 + "}" * 60_000, DIRECT, 503),
    ("cartesian product", "GET", q("SELECT * { ?a ?b ?c . ?d ?e ?f . ?g ?h ?i } ORDER BY ?a ?d"), None, {}, 503),
    ("cartesian count", "GET", q("SELECT (COUNT(*) AS ?n) { ?a ?b ?c . ?d ?e ?f . ?g ?h ?i }"), None, {}, 503),
    ("endless path", "GET", q("SELECT (COUNT(*) AS ?n) { ?a (!<x:>)* ?b . ?c (!<x:>)* ?d }"), None, {}, 503),
    ("memory", "GET", q("SELECT (GROUP_CONCAT(CONCAT(STR(?a), STR(?d))) AS ?x) { ?a ?b ?c . ?d ?e ?f }"), None, {}, 503),
    ("too many rows", "GET", q("SELECT ?x { ?a ?b ?c . VALUES ?x { 1 2 3 } }"), None, {"Accept": "text/csv"}, 422),
    ("slow pattern", "GET", q('SELECT * { ?s ?p ?o . ?a ?b ?c FILTER (REGEX(CONCAT(STR(?s), STR(?o), STR(?a)), "(a+)+$x")) }'), None, {}, 503),
    # Text that is none
    ("malformed UTF-8 in the URL", "GET", "/sparql?query=ASK%20%7B%20%22%ff%fe%22%20%7D", None, {}, 400),
    ("malformed UTF-8 in the body", "POST", "/sparql", b"ASK { ?s ?p '\xc3\x28' }", DIRECT, 400),
    ("malformed UTF-8 in a form", "POST", "/sparql", b"query=ASK%7B%7D%c3%28", FORM, 400),
    ("raw bytes in a form", "POST", "/sparql", b"query=ASK{}\xff", FORM, 400),
    ("null character", "GET", "/sparql?query=ASK%20%7B%7D%00", None, {}, 400),
    ("malformed UTF-8 in the path", "GET", "/kb/%ff%fe", None, {}, 400),
    # Paths and headers
    ("path up", "GET", "/kb/..%2f..%2fetc%2fpasswd", None, {}, 404),
    ("path up, plain", "GET", "/kb/../../../../etc/passwd", None, {}, 404),
    ("static path up", "GET", "/_nicegui/../../../../etc/passwd", None, {}, 404),
    ("an IRI that is none", "GET", "/kb/%3Cscript%3E", None, {}, 404),
    ("quotes in a name", "GET", "/kb/Plate%3E%20%3Fp%20%3Fo%20%7D%20%23", None, {}, 404),
    ("query in the name of a node", "GET", "/graph?node=" + quote("x> ?p ?o . ?a ?b ?c . ?d ?e ?f } #"), None, {}, 200),
    ("long path", "GET", "/kb/" + "a" * 5000, None, {}, 414),
    ("foreign host", "GET", "/health", None, {"Host": "evil.example"}, 421),
    ("strange accept", "GET", q("ASK {}"), None, {"Accept": "text/turtle;q=abc;;,,"}, 406),
    ("accept with a line break in the graph name", "GET", "/data?graph=x%0d%0aSet-Cookie:%20a=b", None, {}, 404),
    ("other charset", "POST", "/sparql", "ASK {}", {"Content-Type": "application/sparql-query; charset=utf-7"}, 415),
    ("method override", "POST", "/data?default", "", {"X-HTTP-Method-Override": "PUT"}, 405),
    ("trace", "TRACE", "/sparql", None, {}, 405),
    ("wrong content", "POST", "/sparql", "<a/>", {"Content-Type": "application/xml"}, 415),
]  # fmt: skip


def test_there_are_enough_of_them() -> None:
    assert len(ATTACKS) >= 40
    assert len({name for name, *_ in ATTACKS}) == len(ATTACKS)


@pytest.mark.parametrize(
    ("method", "target", "body", "headers", "status"), [a[1:] for a in ATTACKS], ids=[a[0] for a in ATTACKS]
)
def test_attack(
    server: Server, method: str, target: str, body: str | bytes | None, headers: dict[str, str], status: int
) -> None:
    sent = body.encode() if isinstance(body, str) else body
    try:
        got, text, answer = server.send(method, target, sent, headers)
    except (BrokenPipeError, ConnectionResetError):
        assert status == 413, "only a body that is not read may be cut off"
    else:
        assert got == status, text[:500]
        assert b"root:" not in text
        assert b"Traceback" not in text
        assert answer.getheader("X-Content-Type-Options") == "nosniff"
        assert answer.getheader("Set-Cookie") is None
    assert server.send("GET", q("ASK {}"))[0] == 200


def test_queries_of_others_go_on_while_one_runs_away(server: Server) -> None:
    runaway = q("SELECT (COUNT(*) AS ?n) { ?a ?b ?c . ?d ?e ?f . ?g ?h ?i }")
    with ThreadPoolExecutor(2) as others:
        bad = [others.submit(server.send, "GET", runaway) for _ in range(2)]
        time.sleep(0.3)
        begun = time.monotonic()
        for _ in range(10):
            assert server.send("GET", q("SELECT * { ?s ?p ?o } LIMIT 5"))[0] == 200
        took = time.monotonic() - begun
        assert not any(one.done() for one in bad) or took < 3
        assert {one.result()[0] for one in bad} == {503}


def test_a_cut_answer_is_not_taken_for_a_whole_one(server: Server) -> None:
    """Beyond its first part an answer can only be broken off; the client must see that."""
    from http.client import IncompleteRead

    with pytest.raises((IncompleteRead, ConnectionError)):
        server.send("GET", q("SELECT * { ?a ?b ?c . ?d ?e ?f . ?g ?h ?i }"))
    assert server.send("GET", q("ASK {}"))[0] == 200


@pytest.mark.parametrize(
    ("data", "answer"),
    [
        (b"GARBAGE\r\n\r\n", b"400"),
        (b"GET /health HTTP/1.1\r\nHost: localhost\r\nX: " + b"a" * 100_000 + b"\r\n\r\n", b"4"),
        (b"POST /sparql HTTP/1.1\r\nHost: localhost\r\nContent-Length: 5\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n", b"4"),
        (b"POST /sparql HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/sparql-query\r\nContent-Length: -5\r\n\r\n", b"4"),
        (b"GET /health HTTP/1.1\r\nHost: localhost\r\nHost: evil.example\r\nConnection: close\r\n\r\n", b"4"),
        (b"GET /sparql?query=ASK\xff HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n", b"400"),
        (b"GET / HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nOrigin: https://evil.example\r\n"
         b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n", b"403"),
    ],
    ids=["garbage", "long header", "two lengths", "negative length", "two hosts", "raw bytes in the URL", "foreign websocket"],
)  # fmt: skip
def test_malformed_requests(server: Server, data: bytes, answer: bytes) -> None:
    got = server.raw(data, wait=3)
    assert got == b"" or got.split(b" ")[1].startswith(answer), got[:200]
    assert server.send("GET", "/health")[0] == 200


def test_slow_bodies_are_ended(tmp_path_factory: pytest.TempPathFactory) -> None:
    from tests.service.conftest import start

    server = start("household", tmp_path_factory.mktemp("slow") / "log", body_seconds=0.5, pages=False)
    try:
        head = b"POST /sparql HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/sparql-query\r\nContent-Length: 100\r\n\r\nASK"
        lines = [socket.create_connection(("127.0.0.1", server.port), timeout=10) for _ in range(30)]
        for line in lines:
            line.sendall(head)
        assert server.send("GET", q("ASK {}"))[0] == 200
        assert {line.recv(200).split(b" ")[1] for line in lines} == {b"408"}
    finally:
        for line in lines:
            line.close()
        assert server.stop() in (0, -15)


def test_a_client_that_does_not_read_holds_no_worker(server: Server) -> None:
    request = f"GET {q('SELECT * { ?s ?p ?o }')} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode()
    lines = [socket.create_connection(("127.0.0.1", server.port), timeout=5) for _ in range(8)]
    try:
        for line in lines:
            line.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            line.sendall(request)
        time.sleep(1.0)
        begun = time.monotonic()
        assert server.send("GET", q("ASK {}"))[0] == 200
        assert time.monotonic() - begun < 2
    finally:
        for line in lines:
            line.close()


def test_headers_forbid_foreign_scripts(server: Server) -> None:
    for target, accept in (("/", "text/html"), (q("ASK {}"), "*/*")):
        _, _, answer = server.send("GET", target, headers={"Accept": accept})
        policy = answer.getheader("Content-Security-Policy") or ""
        assert "default-src 'self'" in policy or "default-src 'none'" in policy
        assert "http" not in policy
        assert answer.getheader("X-Frame-Options") == "DENY"
        assert answer.getheader("Referrer-Policy") == "no-referrer"


def test_the_log_holds_no_query_and_no_token(server: Server) -> None:
    server.send("POST", "/update", b"CLEAR ALL", UPDATE | {"Authorization": "Bearer very-secret-token-1234"})
    server.send("GET", q('ASK { ?s ?p "private-words" }'))
    server.send("GET", "/kb/a%0d%0aFAKE%20LINE")
    log = server.log.read_text()
    assert "GET /sparql 200" in log
    for words in ("very-secret", "private-words", "\nFAKE LINE"):
        assert words not in log


# Inspection


@pytest.mark.parametrize(
    "query",
    [
        'SELECT * { ?s ?p "our customer service" }',
        'SELECT * { ?service ?p ?o FILTER(CONTAINS(?o, "SERVICE")) }',
        "PREFIX s: <x:> SELECT * { ?a s:service ?b . ?a s:my-service ?c }",
        "SELECT ?from ?load { ?from <http://x.example/service> ?load }",
        "SELECT * FROM <https://w3id.org/ersatz/kb> { ?s ?p ?o }",
    ],
)
def test_inspection_lets_innocent_queries_pass(query: str) -> None:
    inspect_query(query, Dataset(), 64)


@pytest.mark.parametrize(
    ("update", "status"),
    [
        ("LOAD <http://127.0.0.1/> INTO GRAPH <x:y>", 403),
        ("load silent <file:///etc/passwd>", 403),
        ("\\u004cOAD <file:///x>", 403),
        ("DELETE { ?s ?p ?o } USING <x:other> WHERE { ?s ?p ?o }", 403),
        ("INSERT { ?s ?p ?o } WHERE { SERVICE <x:y> { ?s ?p ?o } }", 403),
        ("INSERT DATA { " * 100, 400),
    ],
)
def test_inspection_of_updates(update: str, status: int) -> None:
    with pytest.raises(RefusedError) as caught:
        inspect_update(update, 64)
    assert caught.value.status == status
