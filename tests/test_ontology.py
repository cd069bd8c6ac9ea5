"""Everything under ontology/ parses, is OWL 2 DL and RL, is consistent, and says what it must."""

import io
import re
import socket
import xml.etree.ElementTree as ET
from functools import cache
from pathlib import Path
from typing import Any

import owlready2
import pyoxigraph as ox
import pytest
import rdflib
from rdflib import OWL, RDF, RDFS
from rdflib.compare import isomorphic

from ersatz.knowledge.linking import link
from ersatz.knowledge.stores import read_into
from ersatz.knowledge.views import owlready2_ontology
from tests.reasoners import CATALOG, ROOT, java, owlapi

ONTOLOGY = ROOT / "ontology"
TERMS = ONTOLOGY / "ersatz.ttl"
EXAMPLES = sorted((ONTOLOGY / "examples").glob("*.ttl"))
SHAPES = ONTOLOGY / "shapes" / "ersatz.shacl.ttl"
KNOWLEDGE = [*EXAMPLES, *sorted(ONTOLOGY.glob("household*.ttl"))]
BRIDGES = sorted((ONTOLOGY / "bridges").glob("*.ttl"))
OWL_FILES = sorted(ONTOLOGY.glob("*.owl"))
CHECKS = sorted((ROOT / "sparql" / "checks").glob("*.rq"))
ERSATZ = "https://w3id.org/ersatz#"

CONTRACT = {
    OWL.Class: """
        Object Property PhysicalProperty FunctionalProperty Axis Quality PhysicalQuality FunctionalQuality
        Coordinate Model ClassModel FunctionModel SubstitutionModel Statement Entry Measurement Candidate
        Assignment KnowledgeBuild Source Origin NormElement Relevance""",
    OWL.ObjectProperty: """
        holds hasMeasurement measuredProperty assignedQuality hasAssignment origin source usedSource hasAxis
        hasCoordinate onAxis qualityOf hasEntry quality forFunction representativeQuality missingTool
        relevantPhysicalQuality relevantFunctionalQuality hasCandidate candidate shared lacking extra
        substitute nonSubstitute hasNormElement rowAxis columnAxis hasRelevance relevantQuality""",
    OWL.DatatypeProperty: """
        rank position centroid lowerBound upperBound rawValue coordinate count total proportion degree
        similarity theta phi relevancePhi accepted instanceCount unit seed clusters formatVersion
        observationUnit method revision settings sha256 fileName credit softwareVersion fuzzifier element
        acceptanceProbability bestProbability similarityLow similarityHigh credibleLevel draws priorCount
        relevanceWeight""",
    OWL.AnnotationProperty: "describesClass adjective orientation",
    OWL.NamedIndividual: "machine human synthetic",
}
"""Names others query by: a released one never disappears."""


def name(path: Path) -> str:
    return path.stem


@cache
def graph(*files: Path) -> rdflib.Graph:
    merged = rdflib.Graph()
    for file in files:
        merged.parse(file)
    return merged


@cache
def store(*files: Path) -> ox.Store:
    merged = ox.Store()
    for file in files:
        merged.load(path=str(file), format=ox.RdfFormat.TURTLE)
    return merged


def normal(file: Path) -> rdflib.Graph:
    """Read a file through Oxigraph, to which 3.0 and 3 are one number and a plain text is a string."""
    merged = ox.Store()
    read_into(merged, file)
    data: Any = ox.serialize((quad.triple for quad in merged), format=ox.RdfFormat.N_TRIPLES)
    return rdflib.Graph().parse(data=data, format="nt")


def hermit(merged: rdflib.Graph) -> bool:
    """Ask owlready2's HermiT whether a graph is consistent; imports are left out, for it would fetch them."""
    java()
    kept = rdflib.Graph()
    for triple in merged:
        if triple[1] != OWL.imports:
            kept.add(triple)
    world = owlready2.World()
    world.get_ontology("https://w3id.org/ersatz/kb").load(
        fileobj=io.BytesIO(kept.serialize(format="nt").encode())
    )
    try:
        owlready2.sync_reasoner_hermit(world, debug=0)
    except owlready2.OwlReadyInconsistentOntologyError:
        return False
    return True


def test_there_is_something_to_test() -> None:
    assert len(EXAMPLES) >= 6
    assert len(CHECKS) >= 60


@pytest.mark.parametrize("file", [TERMS, SHAPES, *KNOWLEDGE], ids=name)
def test_both_libraries_read_the_same_number_of_triples(file: Path) -> None:
    assert len(store(file)) == len(graph(file)) > 100


@pytest.mark.parametrize("kind", CONTRACT, ids=lambda kind: str(kind).split("#")[1])
def test_promised_terms_are_there(kind: rdflib.URIRef) -> None:
    have = {str(term).removeprefix(ERSATZ) for term in graph(TERMS).subjects(RDF.type, kind)}
    assert set(CONTRACT[kind].split()) <= have


def test_every_term_is_one_paragraph_in_one_order() -> None:
    order = ["a", "rdfs:subClassOf", "owl:equivalentClass", "owl:disjointWith", "owl:propertyDisjointWith"]
    order += ["rdfs:label", "skos:definition", "skos:example", "rdfs:comment", "rdfs:domain", "rdfs:range"]
    order += ["rdfs:isDefinedBy"]
    paragraphs = re.findall(r"^:\w+ a .*?\.$", TERMS.read_text(), flags=re.MULTILINE | re.DOTALL)
    assert len(paragraphs) >= 80
    for paragraph in paragraphs:
        first, *rest = paragraph.split("\n")
        used = [first.split()[1], *(line.split()[0] for line in rest if re.match(r"    \S", line))]
        assert used == sorted(set(used), key=order.index), paragraph
        assert {"rdfs:label", "skos:definition", "skos:example", "rdfs:isDefinedBy"} <= set(used), paragraph


def test_header_says_what_it_is_and_where_it_comes_from() -> None:
    said = {p for p, _ in graph(TERMS).predicate_objects(rdflib.URIRef("https://w3id.org/ersatz"))}
    terms = (
        "title",
        "description",
        "creator",
        "license",
        "created",
        "modified",
        "source",
        "bibliographicCitation",
    )
    assert {rdflib.DCTERMS[term] for term in terms} | {OWL.versionIRI, OWL.versionInfo} <= said


@cache
def owl_api() -> dict[str, dict[str, list[str]]]:
    """Start Java once for all files."""
    return owlapi([TERMS, *KNOWLEDGE, *OWL_FILES])


@pytest.mark.parametrize("file", [TERMS, *KNOWLEDGE, *OWL_FILES], ids=lambda file: file.name)
def test_no_owl_api_violation_and_consistent(file: Path) -> None:
    said = owl_api()[file.name]
    assert set(said) == {"format", "axioms", "imports", "HermiT", "ELK"}, said
    assert said["imports"] == ["0" if file.stem == TERMS.stem else "1"]
    assert (said["HermiT"], said["ELK"]) == (["true"], ["true"])


@pytest.mark.parametrize("file", OWL_FILES, ids=lambda file: file.name)
def test_owl_beside_ttl_says_the_same(file: Path) -> None:
    assert isomorphic(normal(file), normal(file.with_suffix(".ttl")))


def test_no_released_term_has_vanished() -> None:
    released = (ROOT / "tests" / "released_terms.txt").read_text().split()
    assert len(released) >= 80
    assert set(released) <= {str(term) for term in graph(TERMS).subjects(RDF.type, None)}


def test_owl_api_reports_what_is_wrong(tmp_path: Path) -> None:
    bad = tmp_path / "bad.ttl"
    lines = (
        "kb:a ersatz:substitute kb:b ; ersatz:nonSubstitute kb:b .",
        "kb:a <http://purl.org/dc/terms/rights> 'a property nobody declared' .",
    )
    bad.write_text(EXAMPLES[0].read_text() + "\n".join(lines))
    said = owlapi([bad])["bad.ttl"]
    assert said["HermiT"] == ["false"]
    assert any("rights" in violation for violation in said["OWL 2 DL"])


@pytest.mark.parametrize("file", [TERMS, *EXAMPLES], ids=name)
def test_consistent_for_owlready2(file: Path) -> None:
    assert hermit(graph(TERMS, file))


def test_owlready2_notices_a_contradiction() -> None:
    wrong = rdflib.Graph() + graph(TERMS, EXAMPLES[0])
    kb = rdflib.Namespace("https://w3id.org/ersatz/kb#")
    wrong.add((kb.weight_1, RDF.type, rdflib.URIRef(ERSATZ + "FunctionalQuality")))
    assert not hermit(wrong)


@pytest.mark.parametrize("file", KNOWLEDGE, ids=name)
@pytest.mark.parametrize("check", CHECKS, ids=name)
def test_no_check_finds_anything(check: Path, file: Path) -> None:
    query = check.read_text()
    found: Any = store(TERMS, file).query(query)
    assert [(str(row["entity"]), str(row["detail"])) for row in found] == []
    if len(graph(file)) < 5_000:  # rdflib takes minutes where Oxigraph takes a second
        assert list(graph(TERMS, file).query(query)) == []


@pytest.mark.parametrize("check", CHECKS, ids=name)
def test_every_check_has_its_header(check: Path) -> None:
    head = re.match(
        r"#\+ summary: \S.*\.\n#\+ description: \S.*\.\n#\+ mend: \S.*\.\n(PREFIX |\n?SELECT )",
        check.read_text(),
    )
    assert head, f"{check.name}: summary, description and mend, each one sentence"
    assert re.search(r"^SELECT (DISTINCT )?\?entity ", check.read_text(), re.MULTILINE)


@pytest.mark.parametrize("file", KNOWLEDGE, ids=name)
def test_shapes_conform(file: Path) -> None:
    pyshacl = pytest.importorskip("pyshacl")
    conforms, _, text = pyshacl.validate(graph(TERMS, file), shacl_graph=graph(SHAPES), inference="none")
    assert conforms, text


def test_shapes_are_core_shacl_and_notice_a_wrong_entry() -> None:
    pyshacl = pytest.importorskip("pyshacl")
    assert "sh:sparql" not in SHAPES.read_text()
    wrong = rdflib.Graph() + graph(TERMS, EXAMPLES[0])
    entry = next(wrong.subjects(RDF.type, rdflib.URIRef(ERSATZ + "Entry")))
    wrong.remove((entry, rdflib.URIRef(ERSATZ + "total"), None))
    conforms, report, _ = pyshacl.validate(
        wrong, shacl_graph=graph(SHAPES), inference="none", meta_shacl=True
    )
    assert not conforms
    assert entry in set(report.objects(None, rdflib.SH.focusNode))


def test_catalog_finds_every_import_beside_it() -> None:
    entries = {e.attrib["name"]: e.attrib["uri"] for e in ET.parse(CATALOG).getroot()}
    assert all((ONTOLOGY / file).is_file() for file in entries.values())
    imported = {str(o) for file in KNOWLEDGE for o in graph(file).objects(None, OWL.imports)}
    assert imported
    assert imported <= set(entries)
    named = {str(o) for file in BRIDGES for o in graph(file).subjects(RDF.type, OWL.Ontology)}
    assert named <= set(entries)


def test_no_definition_is_used_twice() -> None:
    definitions = list(graph(TERMS).objects(None, rdflib.SKOS.definition))
    assert len(definitions) == len(set(definitions)) >= 80
    assert not list(graph(TERMS).subjects(RDFS.label, rdflib.Literal("")))


def test_reading_touches_no_network(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise AssertionError("the network was asked")

    monkeypatch.setattr(socket.socket, "connect", refuse)
    monkeypatch.setattr(socket, "getaddrinfo", refuse)
    for file in [TERMS, SHAPES, *KNOWLEDGE]:
        rdflib.Graph().parse(file)
        ox.Store().load(path=str(file), format=ox.RdfFormat.TURTLE)
    assert owlready2_ontology(quad.triple for quad in store(EXAMPLES[0])).imported_ontologies
    assert len(link((quad.triple for quad in store(EXAMPLES[0])), "soma")) > 1_000
