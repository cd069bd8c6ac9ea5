"""What others load: KnowRob, ORO's real knowledge_core, Protégé and owlready2."""

import io
import json
import re
import shutil
import subprocess
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import owlready2
import pyoxigraph as ox
import pytest
import rdflib
from rdflib.compare import isomorphic

from ersatz.knowledge import exports
from ersatz.knowledge.defined import defined_classes
from ersatz.knowledge.views import owlready2_ontology
from tests.knowledge.linked import store_of
from tests.reasoners import ROOT, java, owlapi

KITCHEN = ROOT / "ontology" / "examples" / "kitchen.ttl"
TERMS = ROOT / "ontology" / "ersatz.ttl"
KNOWROB = rdflib.Namespace(exports.KNOWROB)


def triples(*files: Path) -> list[ox.Triple]:
    return [quad.triple for quad in store_of(*files)]


def graph(some: Any) -> rdflib.Graph:
    data: Any = ox.serialize(some, format=ox.RdfFormat.N_TRIPLES)
    return rdflib.Graph().parse(data=data, format="nt")


def test_knowrob_reads_every_membership_with_its_confidence() -> None:
    knowledge = graph(triples(KITCHEN))
    exported = graph(exports.knowrob(triples(KITCHEN)))
    kb = rdflib.Namespace("https://w3id.org/ersatz/kb#")
    ersatz = rdflib.Namespace("https://w3id.org/ersatz#")
    entries = [
        e for m in knowledge.subjects(ersatz.describesClass) for e in knowledge.objects(m, ersatz.hasEntry)
    ]
    relations = set(exported.subjects(rdflib.RDF.type, ersatz.Reified_holds))
    assert len(relations) == len(entries) > 40
    one = rdflib.URIRef(exports.REIFIED + "Plate__rigidity_2")
    said = dict(exported.predicate_objects(one))
    assert said[KNOWROB.hasSubject] == kb.Plate
    assert said[KNOWROB.hasObject] == kb.rigidity_2
    assert said[KNOWROB.hasConfidence] == rdflib.Literal("1", datatype=rdflib.XSD.double)
    assert said[KNOWROB.isOccasional] == rdflib.Literal(True)
    answers = set(exported.subjects(rdflib.RDF.type, ersatz.Reified_substitutes))
    accepted = set(knowledge.subjects(ersatz.accepted, rdflib.Literal(True)))
    assert len(answers) == len(accepted) > 10
    assert all((answer, KNOWROB.isOccasional, None) not in exported for answer in answers)
    assert KNOWROB.ReifiedRelation in set(exported.objects(None, rdflib.RDFS.subClassOf))


@pytest.mark.parametrize("export", [exports.knowrob, exports.oro])
def test_answers_that_are_out_of_date_are_not_exported(export: Callable[..., Iterable[ox.Triple]]) -> None:
    store = ox.Store()
    store.bulk_extend(ox.Quad(*triple) for triple in triples(KITCHEN))
    build = "https://w3id.org/ersatz/kb#build_1"
    store.update(
        f"DELETE WHERE {{ <{build}> <https://w3id.org/ersatz#revision> ?r }} ; "
        f'INSERT DATA {{ <{build}> <https://w3id.org/ersatz#revision> "{"0" * 64}" }}'
    )
    lines = [str(triple) for triple in export(quad.triple for quad in store)]
    assert len(lines) > 40
    assert not [line for line in lines if "reified.owl#substitution" in line or "canSubstituteFor" in line]


@pytest.fixture(scope="module")
def knowrob_export(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The kitchen as `ersatz export --to knowrob` writes it."""
    file = tmp_path_factory.mktemp("knowrob") / "kitchen.owl"
    ox.serialize(exports.knowrob(triples(KITCHEN)), str(file), format=ox.RdfFormat.RDF_XML)
    return file


def run(program: str, *arguments: str) -> list[str]:
    """Run what KnowRob builds on, or skip; the lines it prints."""
    found = shutil.which(program)
    if found is None:
        pytest.skip(f"no {program}: Debian's swi-prolog-nox and raptor2-utils read RDF as KnowRob does")
    done = subprocess.run([found, *arguments], capture_output=True, text=True, check=True, timeout=60)
    return done.stdout.splitlines()


def test_prolog_loads_the_knowrob_export(knowrob_export: Path) -> None:
    count, *relations = run("swipl", "-q", str(Path(__file__).with_name("knowrob.pl")), str(knowrob_export))
    exported = graph(triples(knowrob_export))
    assert int(count) == len(exported)
    kb = "https://w3id.org/ersatz/kb#"
    assert f"['{kb}Plate','{kb}rigidity_2','1']" in relations
    assert len(relations) == len(list(exported.subjects(KNOWROB.hasConfidence))) > 50


def test_raptor_reads_the_knowrob_export(knowrob_export: Path) -> None:
    """KnowRob 2's own parser."""
    lines = run("rapper", "--quiet", "--output", "ntriples", str(knowrob_export))
    assert len(lines) == len(graph(triples(knowrob_export)))


def test_knowrob_settings_name_the_file() -> None:
    settings = json.loads(exports.knowrob_settings("household.owl"))
    assert settings["data-sources"] == [{"path": "household.owl", "language": "owl", "format": "xml"}]


def test_oro_never_says_holds_and_stays_in_its_namespace() -> None:
    facts = list(exports.oro(triples(KITCHEN)))
    assert len(facts) > 200
    assert not [fact for fact in facts if "openrobots.org#holds" in str(fact) or "w3id.org" in str(fact)]


def test_knowledge_core_finds_what_was_exported(tmp_path: Path) -> None:
    core = pytest.importorskip("knowledge_core.kb", reason="pip install KnowledgeCore")
    file = tmp_path / "kitchen.owl"
    ox.serialize(exports.oro(triples(KITCHEN)), str(file), format=ox.RdfFormat.RDF_XML)
    kb = core.KnowledgeCore(enable_reasoner=False)
    kb.load(str(file))
    found = {row["x"] for row in kb.find(["?x canSubstituteFor Tray"])}
    assert found == {"Bowl", "CerealBox", "CoffeeMug", "Flashlight", "FoodCan", "Plate"}
    assert kb.classesof("bowl_01") == ["Bowl"]
    assert ["bowl_01", "hasQuality", "containment_3"] in kb.about("bowl_01")
    assert {row["x"] for row in kb.find(["?x rdf:type Bowl", "?x hasQuality containment_3"])} == {
        "bowl_01",
        "bowl_02",
    }


def test_defined_classes_are_owl_2_rl(tmp_path: Path) -> None:
    merged = tmp_path / "classes.ttl"
    text = "".join(defined_classes(triples(KITCHEN)))
    own = re.sub(r"owl:imports <[^>]*>", "owl:imports <https://w3id.org/ersatz>", text)
    merged.write_text(
        own + re.sub(r"(?s)<https://w3id.org/ersatz/kb> a .*?\.\n", "", KITCHEN.read_text(), count=1)
    )
    said = owlapi([merged])[merged.name]
    assert set(said) == {"format", "axioms", "imports", "HermiT", "ELK"}, said
    assert said["HermiT"] == ["true"]


def test_reasoner_finds_the_members_of_defined_classes() -> None:
    java()
    store = ox.Store()
    for triple in triples(KITCHEN):
        store.add(ox.Quad(triple.subject, triple.predicate, triple.object))
    store.load("".join(defined_classes(triples(KITCHEN))).encode(), format=ox.RdfFormat.TURTLE)
    kept = [quad.triple for quad in store if not quad.predicate.value.endswith("#imports")]
    onto = owlready2_ontology(kept)
    kb = onto.world.get_namespace("https://w3id.org/ersatz/kb#")
    owlready2.sync_reasoner_hermit(onto.world, debug=0)
    assert {one.name for one in kb.Holds_containment_3.instances()} == {"bowl_01", "bowl_02"}
    assert {one.name for one in kb.Model_support_2.instances()} == {"model_Plate", "model_Tray"}
    assert {one.name for one in kb.Model_rigidity_1.instances()} == {"model_HandTowel", "model_Sponge"}


def test_owl_view_walks_reasons_and_saves_twice_in_a_row(tmp_path: Path) -> None:
    java()
    onto = owlready2_ontology(triples(KITCHEN))
    for _ in range(2):
        assert {one.name for one in onto.Bowl.instances()} == {"bowl_01", "bowl_02"}
        assert onto.containment_3 in onto.bowl_01.holds
        assert onto.Bowl__weight_2.count == 2
        assert onto.model_Bowl.hasEntry
        owlready2.sync_reasoner_hermit(onto.world, debug=0)
        file = tmp_path / "view.nt"
        onto.save(str(file), format="ntriples")
        assert set(triples(KITCHEN)) <= set(triples(file))


@pytest.mark.parametrize("file", [*sorted(KITCHEN.parent.glob("*.ttl")), TERMS], ids=lambda file: file.stem)
def test_round_trip_through_owlready2_loses_nothing(file: Path, tmp_path: Path) -> None:
    before = rdflib.Graph().parse(file)
    before.remove((None, rdflib.OWL.imports, None))  # owlready2 would fetch it
    iri = "https://w3id.org/ersatz" + ("" if file == TERMS else "/kb")
    onto = (
        owlready2.World()
        .get_ontology(f"{iri}#")
        .load(fileobj=io.BytesIO(before.serialize(format="nt").encode()))
    )
    onto.save(str(tmp_path / "trip.owl"), format="rdfxml")
    rdflib.Graph().parse(tmp_path / "trip.owl", format="xml").serialize(
        tmp_path / "trip.ttl", format="turtle"
    )
    before.serialize(tmp_path / "before.ttl", format="turtle")
    # Through Oxigraph, so that 3.0 and 3, a plain text and an xsd:string are the same, as RDF 1.1 says.
    assert isomorphic(graph(triples(tmp_path / "before.ttl")), graph(triples(tmp_path / "trip.ttl")))
