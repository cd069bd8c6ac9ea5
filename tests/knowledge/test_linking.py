"""Bridges to other ontologies: declared targets, no contradiction, and questions across the border."""

import re
from functools import cache
from pathlib import Path
from typing import Any

import pyoxigraph as ox
import pytest
import rdflib

from ersatz.errors import InputError, UnknownNameError
from ersatz.knowledge import linking, validation
from tests.reasoners import ROOT, java, owlapi

KITCHEN = ROOT / "ontology" / "examples" / "kitchen.ttl"
QUESTIONS = sorted((ROOT / "sparql" / "linked").glob("*.rq"))
ONTOLOGIES = {
    "cora": ("ieee1872/cora.owl", "ieee1872/cora-bare.owl", "ieee1872/corax.owl", "ieee1872/sumo-cora.owl"),
    "isaac": ("isaac/hed.owl", "isaac/j87.owl"),
    "knowrob": ("soma/DUL.owl", "knowrob/knowrob.owl"),
    "oro": ("oro/oro.owl",),
    "prov": ("prov/prov-o.ttl",),
    "soma": ("soma/DUL.owl", "soma/SOMA-HOME.owl"),
    "sosa": ("ssn/sosa-2017.ttl",),
}
UNSATISFIABLE_ALONE = {"Color", "PreferenceOrder", "PreferenceRegion"}
"""Classes of SOMA that contradict themselves without us."""

# Two bowls, two cereal boxes, ...: the answers can be read off the comments of the kitchen's data.
BOWLS = ("bowl_01", "bowl_02")
BOWL_REGIONS = ("containment_3", "hollowness_2", "rigidity_2", "support_1", "weight_2")
ANSWERS: dict[str, set[tuple[str, ...]]] = {
    "cora_objects": {("CorpuscularObject", "20")},
    "isaac_containment": {("Bowl", "3"), ("CoffeeMug", "2"), ("WaterBottle", "2")},
    "isaac_schemas_of_answers": {
        ("Flashlight", "CONTAINMENT", "1"),
        ("Flashlight", "SUPPORT", "1"),
        ("Tray", "CONTAINMENT", "1"),
        ("Tray", "SUPPORT", "2"),
        ("WaterBottle", "CONTAINMENT", "2"),
        ("WaterBottle", "SUPPORT", "1"),
    },
    "knowrob_flashlight": {
        ("CerealBox", "1"),
        ("FoodCan", "1"),
        ("Plate", "1"),
        ("Tray", "0.75"),
        ("Bowl", "0.5"),
        ("CoffeeMug", "0.5"),
    },
    "knowrob_limp_things": {("HandTowel", "Towel")},
    "knowrob_tools_with_support": {("Flashlight", "Plate"), ("Flashlight", "Tray")},
    "oro_bottle_stand_ins": {("WaterBottle", "Bowl"), ("WaterBottle", "CoffeeMug"), ("WaterBottle", "Tray")},
    "oro_containers": {("CerealBox", "1", "2", "2"), ("WaterBottle", "2", "2", "2")},
    "prov_builds": {("build_1", "100")},
    "soma_mass_of_crockery": {("Bowl", "0.35", "2"), ("CoffeeMug", "0.325", "2"), ("Plate", "0.4", "2")},
    "soma_poor_containers": {(name, "containment 1 of 3") for name in ("CerealBox", "FoodCan", "Plate")},
    "soma_regions": {(bowl, region) for bowl in BOWLS for region in BOWL_REGIONS},
    "soma_tableware_for_support": {("WaterBottle", "Tray")},
    "soma_unknown_classes": {("Flashlight",), ("HandTowel",), ("Sponge",), ("Tray",)},
    "soma_unrelated_substitutes": {
        *(("Flashlight", name) for name in ("Bowl", "CerealBox", "CoffeeMug", "FoodCan", "Plate", "Tray")),
        *(("Tray", name) for name in ("Bowl", "CerealBox", "CoffeeMug", "Flashlight", "FoodCan", "Plate")),
        ("WaterBottle", "Tray"),
    },
    "sosa_observations": {
        *(
            ("bowl_01", *pair)
            for pair in (("containment", "1.1"), ("hollowness", "0.8"), ("rigidity", "0.95"))
        ),
        *(("bowl_01", *pair) for pair in (("support", "0.004"), ("weight", "0.3"))),
        *(
            ("bowl_02", *pair)
            for pair in (("containment", "1.3"), ("hollowness", "0.85"), ("rigidity", "0.9"))
        ),
        *(("bowl_02", *pair) for pair in (("support", "0.005"), ("weight", "0.4"))),
    },
}


def store_of(*files: Path) -> ox.Store:
    store = ox.Store()
    for file in files:
        validation.read_into(store, file)
    return store


def triples(store: ox.Store) -> list[ox.Triple]:
    return [quad.triple for quad in store]


@cache
def linked(bridge: str, data: Path) -> ox.Store:
    files = [data / "ontologies" / file for file in ONTOLOGIES[bridge]]
    return linking.link(triples(store_of(KITCHEN)), bridge, files)


def local(term: Any) -> str:
    return re.split(r"[#/]", term.value)[-1]


def test_every_bridge_is_tried() -> None:
    assert set(linking.BRIDGES) == set(ONTOLOGIES)
    assert {file.stem for file in QUESTIONS} == set(ANSWERS)
    assert len(QUESTIONS) >= 12


@pytest.mark.parametrize("question", QUESTIONS, ids=lambda file: file.stem)
def test_question_across_the_border(question: Path, shared_data: Path) -> None:
    text = question.read_text()
    head = re.match(r"#\+ summary: .*\?\n#\+ description: .*\.\n#\+ bridge: (\w+)\n", text)
    assert head, "a question, its description, its bridge"
    rows: Any = linked(head[1], shared_data).query(text)
    names = [variable.value for variable in rows.variables]
    assert {tuple(local(row[name]) for name in names) for row in rows} == ANSWERS[question.stem]


@pytest.mark.parametrize("bridge", linking.BRIDGES)
def test_every_foreign_term_of_a_bridge_is_declared_by_its_owner(bridge: str, shared_data: Path) -> None:
    ours = store_of(ROOT / "ontology" / "bridges" / f"{bridge}.ttl")
    foreign = ox.Store()
    for file in ONTOLOGIES[bridge]:
        linking._read_foreign(foreign, shared_data / "ontologies" / file)
    own = ("https://w3id.org/ersatz", "http://www.w3.org/2004/02/skos/core#", "https://spdx.org/")
    used = {
        quad.object
        for quad in ours
        if isinstance(quad.object, ox.NamedNode)
        and not quad.object.value.startswith((*own, "http://www.w3.org/2002/"))
    }
    assert used
    assert {term for term in used if not any(foreign.quads_for_pattern(term, None, None))} == set()
    declared = {quad.subject for quad in ours if quad.predicate.value.endswith("#type")}
    assert all(term.value.startswith(own) for term in declared if isinstance(term, ox.NamedNode))


@pytest.mark.parametrize("bridge", ["soma", "oro", "isaac", "sosa", "cora", "prov"])
def test_linked_graph_is_consistent(bridge: str, shared_data: Path) -> None:
    java()
    assert list(validation.contradictions(linked(bridge, shared_data))) == []


def test_aligning_qualities_with_inhering_ones_is_a_contradiction(shared_data: Path) -> None:
    java()
    wrong = ox.Store()
    wrong.extend(linked("soma", shared_data))
    wrong.update(
        "PREFIX e: <https://w3id.org/ersatz#> PREFIX soma: <http://www.ease-crc.org/ont/SOMA.owl#>"
        " PREFIX rdfs: <http://www.w3.org/2000/01/rdf-schema#>"
        " INSERT DATA { e:PhysicalQuality rdfs:subClassOf soma:PhysicalQuality }"
    )
    assert [finding.rule for finding in validation.contradictions(wrong)] == ["inconsistent"]


def test_no_individual_is_merged(shared_data: Path) -> None:
    java()
    apart = ox.Store()
    apart.extend(linked("soma", shared_data))
    apart.update("""
        PREFIX owl: <http://www.w3.org/2002/07/owl#> PREFIX e: <https://w3id.org/ersatz#>
        INSERT { ?one owl:differentFrom ?two } WHERE {
          VALUES ?kind { e:PhysicalQuality e:FunctionalQuality e:ClassModel e:FunctionModel }
          ?one a ?kind . ?two a ?kind . FILTER(STR(?one) < STR(?two)) }""")
    assert list(validation.contradictions(apart)) == []


@pytest.mark.parametrize("bridge", ["soma", "knowrob"])
def test_no_class_becomes_unsatisfiable(bridge: str, shared_data: Path, tmp_path: Path) -> None:
    file = tmp_path / f"{bridge}.nt"
    ox.serialize(triples(linked(bridge, shared_data)), str(file), format=ox.RdfFormat.N_TRIPLES)
    said = owlapi([file], "elk")[file.name]
    assert said["ELK"] == ["true"]
    assert {local(rdflib.Literal(iri)) for iri in said.get("unsatisfiable", [])} <= UNSATISFIABLE_ALONE


@pytest.mark.parametrize("bridge", ["oro", "cora", "isaac", "sosa"])
def test_our_part_stays_in_the_profile(bridge: str, shared_data: Path, tmp_path: Path) -> None:
    file = tmp_path / f"{bridge}.nt"
    ox.serialize(triples(linked(bridge, shared_data)), str(file), format=ox.RdfFormat.N_TRIPLES)
    said = owlapi([file], "profile")[file.name]
    assert [line for line in said.get("OWL 2 DL", []) if re.search(r"w3id\.org/ersatz(/kb)?#", line)] == []


def test_what_the_knowledge_base_does_not_hold_is_left_out(shared_data: Path) -> None:
    kb = "https://w3id.org/ersatz/kb#"
    graph = linked("soma", shared_data)
    assert any(graph.quads_for_pattern(ox.NamedNode(kb + "Bowl"), None, None))
    assert not any(graph.quads_for_pattern(ox.NamedNode(kb + "FoodJar"), None, None))
    headers: Any = graph.query("SELECT ?o { ?o a <http://www.w3.org/2002/07/owl#Ontology> }")
    assert len(list(headers)) == 1
    assert not any(graph.quads_for_pattern(None, ox.NamedNode("http://www.w3.org/2002/07/owl#imports"), None))


def test_bad_bridges_and_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(UnknownNameError, match="soma"):
        linking.link([], "sooma")
    junk = tmp_path / "junk.owl"
    junk.write_bytes(b"\x00junk")
    with pytest.raises(InputError, match=r"junk\.owl"):
        linking.link([], "soma", [junk])


def test_mappings_are_valid_sssom() -> None:
    pytest.importorskip("sssom")
    from sssom.parsers import parse_sssom_table
    from sssom.validators import validate

    found = validate(parse_sssom_table(str(linking.MAPPINGS)), fail_on_error=False)
    assert [result for report in found.values() for result in report.results] == []


def test_mappings_and_their_turtle_agree() -> None:
    turtle = ROOT / "ontology" / "mappings" / "ersatz.ttl"
    assert turtle.read_text() == linking.mappings_as_turtle()
    stated = {
        t for t in triples(store_of(turtle)) if t.predicate.value.startswith("http://www.w3.org/2004/02/skos")
    }
    assert stated == set(linking.mapping_triples())
    assert len(stated) >= 100


def test_axioms_of_mappings_are_in_a_bridge() -> None:
    bridges = store_of(*sorted((ROOT / "ontology" / "bridges").glob("*.ttl")))
    axioms = [row for row in linking.mappings() if "rdf-schema" in row["predicate_id"]]
    assert len(axioms) >= 20
    for row in axioms:
        nodes = [ox.NamedNode(row[key]) for key in ("subject_id", "predicate_id", "object_id")]
        assert any(bridges.quads_for_pattern(*nodes)), row
