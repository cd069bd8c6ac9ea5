"""The remote store: the same knowledge over HTTP from two engines, and one clear error from a bad one."""

import shlex
import time
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler
from pathlib import Path

import pyoxigraph as ox
import pytest

from ersatz.errors import ErsatzError, InputError, KnowledgeBaseError, LockedError
from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.queries import Argument, query_names, stored_query
from ersatz.knowledge.remote import RemoteStore
from ersatz.reasoner.substitution import Substitute, rank_substitutes
from ersatz.resources import ONTOLOGY
from tests.cli import Shell
from tests.knowledge.endpoints import Endpoint, Respond, evaluate, misbehaving, oxigraph, send, virtuoso
from tests.knowledge.tools import assert_whole, facts_of, lines_of, small

FILES = (
    ONTOLOGY / "examples" / "kitchen.ttl",
    ONTOLOGY / "examples" / "substitution.ttl",
    ONTOLOGY / "household.ttl",
)
QUESTIONS = tuple(name for name in query_names() if "/" not in name)


@pytest.fixture(scope="module", params=[oxigraph, virtuoso], ids=["oxigraph", "virtuoso"])
def endpoint(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Endpoint]:
    with request.param(tmp_path_factory.mktemp("engine")) as running:
        yield running


@pytest.fixture(scope="module")
def pairs(
    endpoint: Endpoint, tmp_path_factory: pytest.TempPathFactory
) -> list[tuple[KnowledgeBase, KnowledgeBase]]:
    """Each knowledge base as a file and over HTTP; one is fuzzy and remembers how sure an answer is."""
    remembering = tmp_path_factory.mktemp("kb") / "remembering.ttl"
    kb = small(fuzzifier=2)
    rank_substitutes(kb, "tray", remember=True, draws=20)
    kb.save(remembering)
    files = (*FILES, remembering)
    urls = [endpoint.load(file, f"urn:{file.stem}") for file in files]
    return [
        (KnowledgeBase.open(file), KnowledgeBase.open(url)) for file, url in zip(files, urls, strict=True)
    ]


@pytest.fixture(scope="module")
def oxigraph_server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Endpoint]:
    with oxigraph(tmp_path_factory.mktemp("oxigraph")) as running:
        yield running


@pytest.fixture
def writable(oxigraph_server: Endpoint, tmp_path: Path) -> str:
    """The URL of a small knowledge base in the default graph of an Oxigraph server."""
    small().save(tmp_path / "small.ttl")
    oxigraph_server.put((tmp_path / "small.ttl").read_bytes(), "?default")
    return oxigraph_server.query


def arguments_of(name: str) -> dict[str, Argument]:
    """Return the arguments of the example in a question's header."""
    query = stored_query(name)
    given = dict(word.split("=", 1) for word in shlex.split(query.example))
    assert set(given) == set(query.parameters), name
    return {
        key: value.split(",") if query.parameters[key] == "iris" else value for key, value in given.items()
    }


def outcome(kb: KnowledgeBase, name: str) -> object:
    """Return the rows of an answer in some fixed order, or what is wrong with the question."""
    arguments = arguments_of(name)
    remembered = kb.ask("substitution_models") if "model" in arguments else ()
    if remembered:
        arguments["model"] = str(remembered[0]["model"])
    try:
        return sorted((tuple(map(plain, row)) for row in kb.ask(name, **arguments).rows), key=repr)
    except InputError as error:
        return type(error), str(error).replace(kb.location, "")
    except KeyError as error:
        return type(error), str(error).replace(kb.location, "")


def fields(one: Substitute) -> tuple[object, ...]:
    """Return what a ranking says of one candidate."""
    return one.iri, one.kind, one.fraction, one.accepted, one.flags


def plain(value: object) -> object:
    """Return a number as a float, for Virtuoso's decimals are of another scale and its booleans numbers."""
    return value if isinstance(value, str) or value is None else round(float(str(value * 1)), 12)  # type: ignore[operator]


@pytest.mark.parametrize("name", QUESTIONS)
def test_every_stored_question_has_the_same_answer(
    pairs: list[tuple[KnowledgeBase, KnowledgeBase]], endpoint: Endpoint, name: str
) -> None:
    if name == "relevant_functions" and "/sparql" in endpoint.query:
        pytest.xfail("Virtuoso 7.2.5 adds up the wrong rows in this question, now and then")
    rows = 0
    for file, remote in pairs:
        expected = outcome(file, name)
        assert outcome(remote, name) == expected, file.location
        rows += len(expected) if isinstance(expected, list) else 0
    assert rows > 0


def test_the_questions_are_there() -> None:
    assert len(QUESTIONS) >= 25


def test_every_ranking_is_the_same(pairs: list[tuple[KnowledgeBase, KnowledgeBase]]) -> None:
    compared = 0
    for file, remote in pairs:
        for tool in file.known_names("class"):
            expected, found = rank_substitutes(file, tool), rank_substitutes(remote, tool)
            assert [fields(one) for one in found] == [fields(one) for one in expected]
            assert found.status == expected.status
            compared += len(expected)
    assert compared > 200


def test_all_triples_come_or_none(pairs: list[tuple[KnowledgeBase, KnowledgeBase]]) -> None:
    for file, remote in pairs:
        assert remote.revision == file.revision
        expected = lines_of(file)
        if len(expected) > 10_000 and "/sparql?" in remote.location:
            with pytest.raises(KnowledgeBaseError, match=rf"10000 of {len(expected)} rows: ask for less"):
                remote.triples()
            with pytest.raises(KnowledgeBaseError, match="10000 of"):
                remote.query("CONSTRUCT { ?s ?p ?o } WHERE { ?s ?p ?o }")
        else:
            assert len(lines_of(remote)) == len(expected)
            assert facts_of(remote) == facts_of(file)


def test_virtuoso_refuses_updates_in_one_clear_error(endpoint: Endpoint) -> None:
    if "/sparql" not in endpoint.query:
        pytest.skip("Oxigraph takes updates from anyone")
    with KnowledgeBase.open(endpoint.load(FILES[0], "urn:refused")) as kb:
        before = lines_of(kb)
        with pytest.raises(KnowledgeBaseError, match=r"answered \d{3}") as error:
            kb.observe("mug", "mug 99", {kb.known_names("property")[0]: 0.5})
        assert "\n" not in str(error.value)
        assert lines_of(kb) == before


def test_observe_and_forget_at_an_endpoint_equal_those_in_memory(writable: str) -> None:
    kb, expected = KnowledgeBase.open(writable), small()
    for one in (kb, expected):
        one.observe("tray", "tray 3", {"weight": 0.75, "rigidity": 0.2})
        one.forget("plate 2")
    assert facts_of(kb) == facts_of(expected)
    assert kb.revision == expected.revision
    assert_whole(kb)
    assert KnowledgeBase.open(writable).revision == expected.revision


def test_an_answer_remembered_at_an_endpoint_is_found_until_knowledge_changes(writable: str) -> None:
    kb = KnowledgeBase.open(writable)
    ranking = rank_substitutes(kb, "tray", remember=True)
    again = KnowledgeBase.open(writable)
    assert again.substitution_model("tray") is not None
    assert [fields(one) for one in rank_substitutes(again, "tray")] == [fields(one) for one in ranking]
    again.forget("plate 1")
    assert KnowledgeBase.open(writable).substitution_model("tray") is None


def test_who_read_before_another_wrote_is_told(writable: str) -> None:
    stale, writer = KnowledgeBase.open(writable), KnowledgeBase.open(writable)
    writer.observe("tray", "tray 3", {"weight": 0.75})
    with pytest.raises(LockedError, match="changed by another writer meanwhile: open it again"):
        stale.forget("plate 1")
    assert facts_of(KnowledgeBase.open(writable)) == facts_of(writer)


# One answer of a bad server each -------------------------------------------------------------------------

JSON = "application/sparql-results+json"


def empty_page(handler: BaseHTTPRequestHandler, _: dict[str, str]) -> None:
    send(handler, b"", "text/html")


def empty_text(handler: BaseHTTPRequestHandler, _: dict[str, str]) -> None:
    send(handler, b"", "text/plain")


def empty_json(handler: BaseHTTPRequestHandler, _: dict[str, str]) -> None:
    send(handler, b"", JSON)


def page(handler: BaseHTTPRequestHandler, _: dict[str, str]) -> None:
    send(handler, b"<html><body>Please log in</body></html>", "text/html; charset=utf-8")


def binary(handler: BaseHTTPRequestHandler, _: dict[str, str]) -> None:
    send(handler, b"\xff\x00\xfe", JSON)


def boolean(handler: BaseHTTPRequestHandler, _: dict[str, str]) -> None:
    send(handler, b'{"head": {}, "boolean": true}', JSON)


def other_json(handler: BaseHTTPRequestHandler, _: dict[str, str]) -> None:
    send(handler, b'{"error": "quota exceeded"}', JSON)


def missing(handler: BaseHTTPRequestHandler, _: dict[str, str]) -> None:
    send(handler, b"<h1>Not\nfound</h1>", "text/html", 404)


def failing(handler: BaseHTTPRequestHandler, _: dict[str, str]) -> None:
    send(handler, b"out of\nmemory", "text/plain", 500)


def hanging_up(handler: BaseHTTPRequestHandler, _: dict[str, str]) -> None:
    handler.close_connection = True


def not_http(handler: BaseHTTPRequestHandler, _: dict[str, str]) -> None:
    handler.wfile.write(b"SSH-2.0-OpenSSH_9.2\r\n")


def household_engine() -> ox.Store:
    engine = ox.Store()
    engine.load(path=str(FILES[0]), format=ox.RdfFormat.TURTLE)
    return engine


def truncated(handler: BaseHTTPRequestHandler, form: dict[str, str]) -> None:
    body, media = evaluate(household_engine(), form["query"])
    send(handler, body[: len(body) * 2 // 3], media)


def breaking_off(handler: BaseHTTPRequestHandler, form: dict[str, str]) -> None:
    body, media = evaluate(household_engine(), form["query"])
    handler.send_response(200)
    handler.send_header("Content-Type", media)
    handler.send_header("Content-Length", str(len(body)))
    handler.end_headers()
    handler.wfile.write(body[: len(body) // 2])


BAD: dict[str, tuple[Respond, str]] = {
    "empty text/html": (empty_page, "did not answer in SPARQL: text/html for results as JSON; check the URL"),
    "empty text/plain": (empty_text, "did not answer in SPARQL: text/plain"),
    "empty JSON": (empty_json, "did not answer in SPARQL"),
    "a page": (page, "did not answer in SPARQL: text/html"),
    "binary": (binary, "did not answer in SPARQL"),
    "a truth for a table": (boolean, "another kind of result"),
    "other JSON": (other_json, "did not answer in SPARQL"),
    "404": (missing, "answered 404 Not Found: <h1>Not found</h1>"),
    "500": (failing, "answered 500 Internal Server Error: out of memory"),
    "no answer": (hanging_up, "cannot reach|broke off"),
    "not HTTP": (not_http, "broke off its answer: BadStatusLine"),
    "truncated JSON": (truncated, "did not answer in SPARQL"),
    "broken off": (breaking_off, "broke off its answer: IncompleteRead"),
}


@pytest.mark.parametrize("what", BAD)
def test_a_bad_answer_is_one_clear_error(what: str, ersatz: Shell) -> None:
    respond, message = BAD[what]
    with misbehaving(respond) as url:
        with pytest.raises(KnowledgeBaseError, match=message):
            KnowledgeBase.open(url)
        run = ersatz("show", url)
    assert (run.code, run.out) == (2, "")
    assert url in run.err.replace("\n", "")
    assert "Traceback" not in run.err


def test_nobody_there_is_one_clear_error(ersatz: Shell) -> None:
    with misbehaving(page) as url:
        pass
    run = ersatz("show", url)
    assert (run.code, run.out) == (2, "")
    assert "cannot reach" in run.err


def test_the_deadline_holds_for_a_server_that_sends_a_byte_now_and_then() -> None:
    def dripping(handler: BaseHTTPRequestHandler, form: dict[str, str]) -> None:
        try:
            for _ in range(200):
                handler.wfile.write(b"x")
                time.sleep(0.05)
        except OSError:
            pass

    with misbehaving(dripping) as url:
        began = time.monotonic()
        with pytest.raises(KnowledgeBaseError, match=r"did not answer within 0.5 s: ask for less"):
            RemoteStore(url, timeout=0.5).query("ASK {}")
        assert time.monotonic() - began < 3


def limited(rows: int, seen: list[str]) -> Respond:
    """Return a server that leaves out rows beyond a limit and says nothing, as Virtuoso does."""
    engine = household_engine()

    def respond(handler: BaseHTTPRequestHandler, form: dict[str, str]) -> None:
        text = form["query"]
        seen.append(text)
        cut = "" if "COUNT(*)" in text or "LIMIT" in text or "ASK" in text else f"\nLIMIT {rows}"
        send(handler, *evaluate(engine, text + cut))

    return respond


def test_a_silent_row_limit_is_noticed(ersatz: Shell) -> None:
    seen: list[str] = []
    whole = len(household_engine())
    with misbehaving(limited(300, seen)) as url:
        kb = KnowledgeBase.open(url)
        with pytest.raises(KnowledgeBaseError, match=f"cut its answer to 300 of {whole} rows: ask for less"):
            kb.triples()
        for text in (
            "SELECT ?s ?p WHERE { ?s ?p ?o } # of all\n",
            "PREFIX a: <urn:a> # a comment\nselect distinct ?s ?o { ?s ?p ?o }",
            "CONSTRUCT { ?s a <urn:thing> } WHERE { ?s ?p ?o }",
            "CONSTRUCT WHERE { ?s ?p ?o }",
        ):
            with pytest.raises(KnowledgeBaseError, match="cut its answer to 300 of"):
                kb.query(text)
        run = ersatz("export", url, "--to", "copy.ttl")
        assert run.code == 2
        assert len(kb.query("SELECT ?s ?p WHERE { ?s ?p ?o } LIMIT 200")) == 200
        seen.clear()
        kb.query("SELECT ?s ?o WHERE { ?s ?p ?o } LIMIT 100")
        assert len(seen) == 1  # as more rows have come whole before, these need no counting


def test_what_is_no_query_never_reaches_the_server() -> None:
    seen: list[str] = []
    with misbehaving(limited(1000, seen)) as url:
        kb = KnowledgeBase.open(url)
        seen.clear()
        for text in (
            "DELETE WHERE { ?s ?p ?o }",
            "DROP ALL",
            "SELEKT * { ?s ?p ?o }",
            "",
            "SELECT * { ?s ?p ?o } ; DELETE WHERE { ?s ?p ?o }",
            "SELECT * { SERVICE <http://127.0.0.1:9/> { ?s ?p ?o } }",
        ):
            with pytest.raises(InputError):
                kb.query(text)
        assert seen == []


@pytest.mark.parametrize(
    "url",
    [
        "http://",
        "http://127.0.0.1:port/query",
        "http://127.0.0.1:99999/query",
        "http://[::1/query",
        "http://127.0.0.1/a b",
        "http://dba:secret@127.0.0.1/sparql",
    ],
)
def test_a_url_that_is_none(url: str, ersatz: Shell) -> None:
    with pytest.raises(InputError) as error:
        KnowledgeBase.open(url)
    assert "secret" not in str(error.value)
    assert ersatz("show", url).code == 2


def test_errors_are_of_ersatz() -> None:
    assert issubclass(KnowledgeBaseError, ErsatzError)
