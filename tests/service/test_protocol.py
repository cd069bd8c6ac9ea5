"""The SPARQL 1.1 Protocol, asked by the clients people have, and by the W3C's own cases.

The cases are those of the W3C's data-sparql11/protocol test suite, re-expressed; where it wants several
graphs, it is checked that this service, which has one, says so.
"""

# ruff: noqa: E501  # a case is a line

import json
import subprocess
import xml.etree.ElementTree as ET
from typing import Any
from urllib.parse import quote, urlencode

import pytest
import rdflib
from rdflib.plugins.stores.sparqlstore import SPARQLStore
from SPARQLWrapper import CSV, JSON, POST, POSTDIRECTLY, TURTLE, XML, SPARQLWrapper

from ersatz.knowledge.base import KnowledgeBase
from tests.service.conftest import Server

ERSATZ = "https://w3id.org/ersatz#"
KB_GRAPH = "https://w3id.org/ersatz/kb"
PREFIXES = f"PREFIX ersatz: <{ERSATZ}> PREFIX kb: <{KB_GRAPH}#> PREFIX owl: <http://www.w3.org/2002/07/owl#>"
COUNT = f"{PREFIXES} SELECT (COUNT(?c) AS ?n) {{ ?m ersatz:describesClass ?c }}"
PLATE = f"{PREFIXES} CONSTRUCT {{ kb:Plate ?p ?o }} WHERE {{ kb:Plate ?p ?o }}"
FORM = {"Content-Type": "application/x-www-form-urlencoded"}
DIRECT = {"Content-Type": "application/sparql-query"}
CLASSES = 23


def get(server: Server, accept: str = "", **fields: str) -> tuple[int, bytes, str]:
    headers = {"Accept": accept} if accept else {}
    status, body, answer = server.send("GET", f"/sparql?{urlencode(fields)}", headers=headers)
    return status, body, answer.getheader("Content-Type", "") or ""


def number(body: bytes) -> int:
    return int(json.loads(body)["results"]["bindings"][0]["n"]["value"])


# Clients


@pytest.mark.parametrize("method", ["GET", "POST form", "POST direct"])
def test_sparqlwrapper_reads_json(server: Server, method: str) -> None:
    client = SPARQLWrapper(f"{server.url}/sparql")
    client.setQuery(COUNT)
    client.setReturnFormat(JSON)
    if method != "GET":
        client.setMethod(POST)
    if method == "POST direct":
        client.setRequestMethod(POSTDIRECTLY)
    found: Any = client.query().convert()
    assert found["results"]["bindings"][0]["n"]["value"] == str(CLASSES)


def test_sparqlwrapper_reads_xml_csv_and_turtle(server: Server) -> None:
    client = SPARQLWrapper(f"{server.url}/sparql")
    client.setQuery(COUNT)
    client.setReturnFormat(XML)
    document: Any = client.query().convert()
    assert f">{CLASSES}<" in document.toxml()
    client.setReturnFormat(CSV)
    rows: Any = client.query().convert()
    assert rows.split() == [b"n", str(CLASSES).encode()]
    client.setQuery(PLATE)
    client.setReturnFormat(TURTLE)
    turtle: Any = client.query().convert()
    graph = rdflib.Graph().parse(data=turtle, format="turtle")
    assert (rdflib.URIRef(f"{KB_GRAPH}#Plate"), rdflib.RDFS.label, rdflib.Literal("plate", "en")) in graph


def test_rdflibs_store_queries_and_iterates(server: Server) -> None:
    store = SPARQLStore(f"{server.url}/sparql", returnFormat="json")
    graph = rdflib.Graph(store)
    found: Any = list(graph.query(COUNT))
    assert int(found[0][0]) == CLASSES
    labels = list(graph.objects(rdflib.URIRef(f"{KB_GRAPH}#Plate"), rdflib.RDFS.label))
    assert labels == [rdflib.Literal("plate", "en")]


def test_our_own_client_opens_it_as_a_knowledge_base(server: Server) -> None:
    from ersatz import rank_substitutes

    here, there = KnowledgeBase.open("household"), KnowledgeBase.open(f"{server.url}/sparql")
    one, two = (rank_substitutes(kb, "tray", ["plate", "sponge", "bowl"]).to_json() for kb in (here, there))
    assert one == two
    assert len(one["substitutes"]) == 3


@pytest.mark.parametrize(
    "arguments",
    [
        ["-G", "--data-urlencode", f"query={COUNT}"],
        ["--data-urlencode", f"query={COUNT}"],
        ["-H", "Content-Type: application/sparql-query", "--data-binary", COUNT],
    ],
    ids=["get", "form", "direct"],
)
def test_curl(server: Server, arguments: list[str]) -> None:
    done = subprocess.run(
        ["curl", "-sS", "--fail", "-H", "Accept: text/csv", *arguments, f"{server.url}/sparql"],
        capture_output=True,
        check=True,
    )
    assert done.stdout.split() == [b"n", str(CLASSES).encode()]


# Formats


def rows_of_xml(body: bytes) -> int:
    return len(ET.fromstring(body).findall(".//{http://www.w3.org/2005/sparql-results#}result"))


@pytest.mark.parametrize(
    ("accept", "kind", "count"),
    [
        ("", "application/sparql-results+json", lambda b: len(json.loads(b)["results"]["bindings"])),
        ("*/*", "application/sparql-results+json", lambda b: len(json.loads(b)["results"]["bindings"])),
        ("application/json", "application/sparql-results+json", lambda b: len(json.loads(b)["results"]["bindings"])),
        ("application/sparql-results+xml", "application/sparql-results+xml", rows_of_xml),
        ("application/xml;q=0.9, text/html", "application/sparql-results+xml", rows_of_xml),
        ("text/csv", "text/csv; charset=utf-8", lambda b: len(b.splitlines()) - 1),
        ("text/tab-separated-values", "text/tab-separated-values; charset=utf-8", lambda b: len(b.splitlines()) - 1),
        ("text/*;q=0.1, image/png", "text/csv; charset=utf-8", lambda b: len(b.splitlines()) - 1),
    ],
)  # fmt: skip
def test_tables(server: Server, accept: str, kind: str, count: object) -> None:
    query = f"{PREFIXES} SELECT ?c {{ ?m ersatz:describesClass ?c }} ORDER BY ?c"
    status, body, media = get(server, accept, query=query)
    assert (status, media) == (200, kind)
    assert callable(count)
    assert count(body) == CLASSES


@pytest.mark.parametrize(
    ("accept", "kind", "format_"),
    [
        ("", "text/turtle; charset=utf-8", "turtle"),
        ("application/n-triples", "application/n-triples", "nt"),
        ("application/ld+json", "application/ld+json", "json-ld"),
        ("application/rdf+xml", "application/rdf+xml", "xml"),
    ],
)
@pytest.mark.parametrize(
    "form", ["CONSTRUCT { kb:Plate ?p ?o } WHERE { kb:Plate ?p ?o }", "DESCRIBE kb:Plate"]
)
def test_graphs(server: Server, accept: str, kind: str, format_: str, form: str) -> None:
    status, body, media = get(server, accept, query=f"{PREFIXES} {form}")
    assert (status, media) == (200, kind)
    graph = rdflib.Graph().parse(data=body, format=format_)
    assert (rdflib.URIRef(f"{KB_GRAPH}#Plate"), rdflib.RDF.type, rdflib.OWL.Class) in graph


@pytest.mark.parametrize(("accept", "yes"), [("application/json", b"true"), ("application/xml", b"true"), ("text/csv", b"true\n")])  # fmt: skip
def test_ask(server: Server, accept: str, yes: bytes) -> None:
    status, body, _ = get(server, accept, query=f"{PREFIXES} ASK {{ kb:Plate a owl:Class }}")
    assert status == 200
    assert yes in body


def test_the_order_of_variables_is_kept(server: Server) -> None:
    _, body, _ = get(server, "text/csv", query="SELECT ?z ?a ?m { VALUES (?z ?a ?m) { (1 2 3) } }")
    assert body.split() == [b"z,a,m", b"1,2,3"]


@pytest.mark.parametrize(
    ("accept", "query"), [("image/png", COUNT), ("text/turtle", COUNT), ("text/csv", PLATE)]
)
def test_not_acceptable(server: Server, accept: str, query: str) -> None:
    assert get(server, accept, query=query)[0] == 406


# W3C protocol cases


ASK = "ASK {}"
FOREIGN = urlencode({"default-graph-uri": "http://example.org/data/data1.rdf"})


@pytest.mark.parametrize(
    ("method", "target", "body", "headers", "status"),
    [
        pytest.param("GET", f"/sparql?query={quote(ASK)}", None, {}, 200, id="query_get"),
        pytest.param("POST", "/sparql", urlencode({"query": ASK}), FORM, 200, id="query_post_form"),
        pytest.param("POST", "/sparql", ASK, DIRECT, 200, id="query_post_direct"),
        pytest.param("POST", "/sparql", ASK, {"Content-Type": "application/sparql-query; charset=UTF-8"}, 200,
                     id="query_post_direct_charset"),
        pytest.param("GET", f"/sparql?{FOREIGN}&query={quote(ASK)}", None, {}, 403, id="query_dataset_default_graphs_get"),
        pytest.param("POST", f"/sparql?{FOREIGN}", ASK, DIRECT, 403, id="query_dataset_default_graphs_post"),
        pytest.param("GET", f"/sparql?{urlencode({'named-graph-uri': 'http://example.org/1'})}&query={quote(ASK)}", None,
                     {}, 403, id="query_dataset_named_graphs_get"),
        pytest.param("GET", f"/sparql?{urlencode({'default-graph-uri': KB_GRAPH})}&query={quote(ASK)}", None, {}, 200,
                     id="query_dataset_our_graph"),
        pytest.param("GET", f"/sparql?query={quote('SELECT (1 AS ?v) {}')}", None, {}, 200, id="query_content_type_select"),
        pytest.param("GET", f"/sparql?query={quote('DESCRIBE <http://example.org/>')}", None, {}, 200,
                     id="query_content_type_describe"),
        pytest.param("GET", f"/sparql?query={quote('CONSTRUCT {<s> <p> 1} WHERE {}')}", None, {}, 400,
                     id="relative_iris_without_base"),
        pytest.param("PUT", f"/sparql?query={quote(ASK)}", None, {}, 405, id="bad_query_method"),
        pytest.param("DELETE", "/sparql", None, {}, 405, id="bad_query_method_delete"),
        pytest.param("GET", f"/sparql?query={quote(ASK)}&query={quote('SELECT * {}')}", None, {}, 400, id="bad_multiple_queries"),
        pytest.param("POST", "/sparql", urlencode([("query", ASK), ("query", ASK)]), FORM, 400, id="bad_multiple_queries_form"),
        pytest.param("POST", "/sparql", urlencode({"query": ASK}), {"Content-Type": "text/plain"}, 415,
                     id="bad_query_wrong_media_type"),
        pytest.param("POST", "/sparql", urlencode({"query": ASK}), {}, 415, id="bad_query_missing_form_type"),
        pytest.param("POST", "/sparql", ASK, {}, 415, id="bad_query_missing_direct_type"),
        pytest.param("POST", "/sparql", ASK.encode("utf-16"), {"Content-Type": "application/sparql-query; charset=UTF-16"}, 415,
                     id="bad_query_non_utf8"),
        pytest.param("POST", "/sparql", b"ASK { ?s ?p '\xff\xfe' }", DIRECT, 400, id="bad_query_malformed_utf8"),
        pytest.param("GET", f"/sparql?query={quote('ASK { WHERE')}", None, {}, 400, id="bad_query_syntax"),
        pytest.param("POST", "/sparql", "query=", FORM, 400, id="empty_query"),
        pytest.param("POST", "/sparql", "", FORM, 400, id="no_query"),
        pytest.param("GET", f"/sparql?update={quote('CLEAR NAMED')}", None, {}, 405, id="bad_update_get"),
        pytest.param("GET", "/update", None, {}, 405, id="bad_update_get_there"),
        pytest.param("POST", "/update", urlencode({"update": "CLEAR NAMED"}), FORM, 403, id="update_read_only"),
        pytest.param("POST", "/sparql", "CLEAR NAMED", {"Content-Type": "application/sparql-update"}, 403,
                     id="update_direct_read_only"),
        pytest.param("POST", "/sparql", urlencode({"update": "CLEAR NAMED"}), FORM, 403, id="update_form_read_only"),
        pytest.param("HEAD", f"/sparql?query={quote(ASK)}", None, {}, 200, id="head"),
        pytest.param("GET", "/nothing.here", None, {}, 404, id="no_such_path"),
    ],
)  # fmt: skip
def test_w3c_cases(
    server: Server, method: str, target: str, body: str | bytes | None, headers: dict[str, str], status: int
) -> None:
    sent = body.encode() if isinstance(body, str) else body
    got, text, answer = server.send(method, target, sent, headers)
    assert got == status, text
    if status == 405:
        assert answer.getheader("Allow")
    if status >= 400 and "html" not in (answer.getheader("Content-Type") or ""):
        assert text.count(b"\n") <= 1, "an error is one line"


# Service description, graphs, things


def test_service_description(server: Server) -> None:
    _, body, answer = server.send("GET", "/sparql")
    assert answer.getheader("Content-Type") == "text/turtle"
    graph = rdflib.Graph().parse(data=body, format="turtle")
    sd = rdflib.Namespace("http://www.w3.org/ns/sparql-service-description#")
    (service,) = graph.subjects(rdflib.RDF.type, sd.Service)
    assert str(graph.value(service, sd.endpoint)) == f"{server.url}/sparql"
    assert (service, sd.supportedLanguage, sd.SPARQL11Query) in graph
    assert rdflib.URIRef(f"{ERSATZ}jaccard") in set(graph.objects(service, sd.extensionFunction))


def test_graph_store_reads(server: Server) -> None:
    here = {
        str(t.subject) + str(t.predicate) + str(t.object) for t in KnowledgeBase.open("household").triples()
    }
    for target in ("/data?default", f"/data?{urlencode({'graph': KB_GRAPH})}", "/kb"):
        status, body, _ = server.send("GET", target, headers={"Accept": "application/n-triples"})
        assert (status, len(body.splitlines())) == (200, len(here))
    _, terms, _ = server.send("GET", f"/data?{urlencode({'graph': 'https://w3id.org/ersatz'})}")
    assert b"ersatz:Quality a owl:Class" in terms
    for target, status in (
        ("/data", 400),
        ("/data?default&graph=x", 400),
        ("/data?graph=file:///etc/passwd", 404),
    ):
        assert server.send("GET", target)[0] == status
    for method in ("PUT", "POST", "DELETE"):
        assert server.send(method, "/data?default", b"")[0] == 405


@pytest.mark.parametrize(("name", "type_"), [("Plate", "Class"), ("gso_plate", "NamedIndividual"), ("rigidity_4", "NamedIndividual")])  # fmt: skip
def test_iris_are_dereferenced(server: Server, name: str, type_: str) -> None:
    status, body, answer = server.send("GET", f"/kb/{name}", headers={"Accept": "text/turtle"})
    assert status == 200
    assert "Accept" in (answer.getheader("Vary") or "")
    graph = rdflib.Graph().parse(data=body, format="turtle")
    assert (rdflib.URIRef(f"{KB_GRAPH}#{name}"), rdflib.RDF.type, rdflib.OWL[type_]) in graph
    browser = {"Accept": "text/html,application/xhtml+xml,application/xml;q=0.9,*/*;q=0.8"}
    status, _, answer = server.send("GET", f"/kb/{name}", headers=browser)
    assert (status, answer.getheader("Location")) == (303, f"/thing/{name}")


def test_cors_is_off_unless_set(server: Server) -> None:
    _, _, answer = server.send("GET", "/health", headers={"Origin": "https://elsewhere.example"})
    assert answer.getheader("Access-Control-Allow-Origin") is None


# The functions


def test_jaccard_is_the_jaccard_of_the_stored_question(server: Server) -> None:
    """`sparql/jaccard.rq` is pure SPARQL and knows nothing of our code."""
    kb = KnowledgeBase.open("household")
    theta = str(kb.build.theta)
    qualities = [str(row["quality"]) for row in kb.ask(
        "representative_qualities", concept="tray", kind="physical", threshold=theta)]  # fmt: skip
    oracle = {str(row["class"]): row for row in kb.ask("jaccard", qualities=qualities, threshold=theta)}
    query = (
        f"{PREFIXES} SELECT ?c (ersatz:jaccard(kb:Tray, ?c) AS ?j) (ersatz:jaccard(?c, kb:Tray, {theta}) AS ?k) "
        "{ ?m ersatz:describesClass ?c }"
    )
    _, body, _ = get(server, "text/csv", query=query)
    rows = [line.split(",") for line in body.decode().split()[1:]]
    assert len(rows) == CLASSES
    assert any(0 < float(j) < 1 for _, j, _ in rows)
    for iri, one, other in rows:
        want = oracle.get(iri)
        ratio = int(str(want["both"])) / int(str(want["either"])) if want else 0.0
        assert float(one) == float(other) == pytest.approx(ratio, abs=5e-7)


@pytest.mark.parametrize(
    "call",
    ["kb:Tray", "kb:Tray, 1", "kb:Tray, kb:Nothing", 'kb:Tray, kb:Plate, "x"', "kb:a, kb:b, kb:c, kb:d"],
)
def test_a_wrong_call_leaves_the_variable_unbound(server: Server, call: str) -> None:
    _, body, _ = get(server, "text/csv", query=f"{PREFIXES} SELECT (ersatz:jaccard({call}) AS ?j) {{}}")
    assert body.strip() in (b"j", b'j\r\n""') or body.split() == [b"j"]


# REST


def test_substitutes_are_those_of_the_library(server: Server) -> None:
    from ersatz import rank_substitutes

    _, body, _ = server.send(
        "GET", "/substitutes?missing=tray&available=plate&available=sponge&tolerance=1/3"
    )
    found = json.loads(body)
    from ersatz.reasoner.relevance import ReasonerSettings

    settings = ReasonerSettings(tolerance="1/3")  # type: ignore[arg-type]
    want = rank_substitutes(KnowledgeBase.open("household"), "tray", ["plate", "sponge"], settings=settings)
    assert found == json.loads(json.dumps(want.to_json()))


def test_graded_substitutes_are_those_of_the_library_to_the_last_weight(server: Server) -> None:
    from ersatz import ReasonerSettings, rank_substitutes

    asked = "/substitutes?missing=tray&available=plate&available=sponge&graded=true&confidence=true"
    found = json.loads(server.send("GET", asked)[1])
    want = rank_substitutes(
        KnowledgeBase.open("household"),
        "tray",
        ["plate", "sponge"],
        settings=ReasonerSettings(graded=True),
        draws=200,
    )
    assert found == json.loads(json.dumps(want.to_json()))
    assert 0 < found["substitutes"][0]["shared"][0]["weight"] <= 1


@pytest.mark.parametrize(
    ("query", "status", "message"),
    [
        ("missing=tary", 404, b"did you mean 'tray'"),
        ("missing=tray&tolerance=often", 400, b"'often'"),
        ("missing=tray&representative=7", 400, b"7"),
        ("", 422, b"missing"),
        ("missing=tray&similarity=cosine", 422, b"jaccard"),
        ("missing=tray&available=tray", 400, b"nothing is available"),
        ("missing=tray&toleranc=0.9", 400, b"unknown parameter 'toleranc': did you mean 'tolerance'"),
        ("missing=tray&certainty=2", 400, b"certainty is 2"),
        ("missing=tray&spacing=wide", 422, b"centroid"),
    ],
)
def test_bad_questions(server: Server, query: str, status: int, message: bytes) -> None:
    got, body, _ = server.send("GET", f"/substitutes?{query}")
    assert got == status
    assert message in body
