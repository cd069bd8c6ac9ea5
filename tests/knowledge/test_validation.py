"""Planted faults, each found by the check that names it; and what is skipped is said."""

from pathlib import Path
from typing import Any

import pyoxigraph as ox
import pytest
import rdflib

from ersatz.errors import KnowledgeBaseError
from ersatz.grounding.units import ObservationUnit
from ersatz.knowledge import validation
from ersatz.knowledge.contradictions import consistent, explain
from ersatz.knowledge.stores import read_into
from tests.knowledge.tools import WEIGHT, small
from tests.reasoners import ROOT, java

EXAMPLES = ROOT / "ontology" / "examples"
PREFIXES = """
PREFIX ersatz: <https://w3id.org/ersatz#>
PREFIX kb: <https://w3id.org/ersatz/kb#>
PREFIX owl: <http://www.w3.org/2002/07/owl#>
PREFIX rdf: <http://www.w3.org/1999/02/22-rdf-syntax-ns#>
PREFIX rdfs: <http://www.w3.org/2000/01/rdf-schema#>
PREFIX skos: <http://www.w3.org/2004/02/skos/core#>
PREFIX xsd: <http://www.w3.org/2001/XMLSchema#>
PREFIX prov: <http://www.w3.org/ns/prov#>
PREFIX dcterms: <http://purl.org/dc/terms/>
PREFIX dul: <http://www.ontologydesignpatterns.org/ont/dul/DUL.owl#>
PREFIX soma: <http://www.ease-crc.org/ont/SOMA.owl#>
"""


def insert(triples: str) -> str:
    return f"INSERT DATA {{ {triples} }}"


def delete(pattern: str) -> str:
    return f"DELETE WHERE {{ {pattern} }}"


def replace(subject: str, predicate: str, value: str) -> str:
    return f"DELETE WHERE {{ {subject} {predicate} ?o }} ; INSERT DATA {{ {subject} {predicate} {value} }}"


def new(name: str, kind: str, more: str = "") -> str:
    return insert(f'kb:{name} a owl:NamedIndividual , {kind} ; rdfs:label "{name}"@en {more}')


TRAY = "kb:substitution_Tray_1"
RELEVANCE = f"{TRAY}-q a owl:NamedIndividual , ersatz:Relevance ; rdfs:label 'how relevant'@en"
FAULTS = [
    # (fault, example, update, rule, entity)
    ("no label", "two_classes", delete("kb:bowl_01 rdfs:label ?l"), "missing_label", "bowl_01"),
    ("label in German only", "two_classes", replace("kb:Bowl", "rdfs:label", '"Schale"@de'),
     "missing_label", "Bowl"),
    ("term without definition", "two_classes", insert('ersatz:weird a owl:Class ; rdfs:label "weird"@en'),
     "missing_definition", "https://w3id.org/ersatz#weird"),
    ("two classes of one name", "two_classes", replace("kb:Plate", "rdfs:label", '"bowl"@en'),
     "duplicate_label", "Plate"),
    ("space at the end", "two_classes", replace("kb:Plate", "rdfs:label", '"plate "@en'), "untidy_text",
     "Plate"),
    ("individual not declared", "two_classes", delete("kb:bowl_01 a owl:NamedIndividual"),
     "untyped_individual", "bowl_01"),
    ("misspelt property", "two_classes", insert("kb:bowl_01 ersatz:hold kb:weight_1"),
     "undeclared_term", "https://w3id.org/ersatz#hold"),
    ("annotation property not declared", "two_classes", insert('kb:Bowl dcterms:rights "mine"'),
     "undeclared_term", "http://purl.org/dc/terms/rights"),
    ("misspelt class", "two_classes", insert("kb:bowl_01 a kb:Bowll"), "undeclared_term", "Bowll"),
    ("blank entry", "two_classes", insert("kb:model_Bowl ersatz:hasEntry [ ersatz:quality kb:weight_1 ]"),
     "blank_node", None),
    ("class forgotten, model left", "two_classes", delete("kb:Plate ?p ?o"), "dangling_iri", "Plate"),
    ("integer for a decimal", "two_classes", replace("kb:weight_1", "ersatz:centroid", "1"),
     "wrong_datatype", "weight_1"),
    ("double for a decimal", "two_classes", replace("kb:bowl_01__weight", "ersatz:rawValue", "2e-1"),
     "binary_number", "bowl_01__weight"),
    ("two centroids", "two_classes", insert("kb:weight_1 ersatz:centroid 0.26"), "two_values", "weight_1"),
    ("quality of two properties", "two_classes", insert("kb:weight_1 ersatz:qualityOf kb:rigidity"),
     "two_values", "weight_1"),
    ("punned class", "two_classes", insert("kb:Bowl a owl:NamedIndividual"), "punned_class", "Bowl"),
    ("class as a value", "two_classes", insert("kb:model_Bowl ersatz:quality kb:Bowl"), "punned_class",
     "Bowl"),
    ("count over total", "two_classes", replace("kb:Bowl__weight_1", "ersatz:count", "3.0"),
     "count_over_total", "Bowl__weight_1"),
    ("count of zero", "two_classes", replace("kb:Bowl__weight_1", "ersatz:count", "0.0"),
     "zero_count", "Bowl__weight_1"),
    ("proportion changed alone", "two_classes", replace("kb:Bowl__rigidity_1", "ersatz:proportion", "0.6"),
     "wrong_proportion", "Bowl__rigidity_1"),
    ("third to seven places", "substitution", replace("kb:Tray__weight_1", "ersatz:proportion", "0.3333333"),
     "wrong_proportion", "Tray__weight_1"),
    ("half rounded up", "two_classes", replace("kb:Bowl__rigidity_1", "ersatz:total", "128.0") + " ; "
     + replace("kb:Bowl__rigidity_1", "ersatz:proportion", "0.007813"), "wrong_proportion",
     "Bowl__rigidity_1"),
    ("entry without total", "two_classes", delete("kb:Bowl__weight_1 ersatz:total ?t"),
     "incomplete_entry", "Bowl__weight_1"),
    ("entry of no model", "two_classes", delete("?m ersatz:hasEntry kb:Bowl__weight_1"),
     "stray_entry", "Bowl__weight_1"),
    ("entry of two models", "two_classes", insert("kb:model_Plate ersatz:hasEntry kb:Bowl__weight_1"),
     "stray_entry", "Bowl__weight_1"),
    ("two entries for one quality", "two_classes", replace("kb:Bowl__rigidity_2", "ersatz:quality",
     "kb:rigidity_1"),
     "repeated_entry", "Bowl__rigidity_2"),
    ("entry moved to another quality", "two_classes", replace("kb:Bowl__weight_1", "ersatz:quality",
     "kb:weight_2"),
     "misnamed_entry", "Bowl__weight_1"),
    ("function explained by a function", "two_classes", new("containment_1__containment_1", "ersatz:Entry",
     "; ersatz:quality kb:containment_1 ; ersatz:count 1.0 ; ersatz:total 1.0 ; ersatz:proportion 1.0 ."
     " kb:model_containment_1 ersatz:hasEntry kb:containment_1__containment_1"),
     "function_model_kind", "containment_1__containment_1"),
    ("entry of unknown quality", "two_classes", replace("kb:Bowl__weight_1", "ersatz:quality", "kb:weight_9"),
     "unknown_quality", "Bowl__weight_1"),
    ("entry lost", "substitution", delete("?m ersatz:hasEntry kb:Tray__weight_1"),
     "counts_short_of_total", "model_Tray"),
    ("totals of one property differ", "two_classes", replace("kb:Bowl__rigidity_1", "ersatz:total", "3.0"),
     "two_totals", "model_Bowl"),
    ("more values than objects", "two_classes", replace("kb:model_Bowl", "ersatz:instanceCount", "1"),
     "total_over_instances", "Bowl__weight_1"),
    ("count differs from the objects", "two_classes", replace("kb:Bowl__weight_1", "ersatz:count", "1.0"),
     "class_count_differs", "model_Bowl"),
    ("function count differs", "two_classes", replace("kb:containment_2__rigidity_1", "ersatz:count", "2.0"),
     "function_count_differs", "model_containment_2"),
    ("instance count differs", "two_classes", replace("kb:model_Bowl", "ersatz:instanceCount", "3"),
     "instance_count_differs", "model_Bowl"),
    ("representative below theta", "substitution",
     insert("kb:model_Tray ersatz:representativeQuality kb:weight_1"), "wrong_representative", "model_Tray"),
    ("representative left out", "substitution",
     delete("kb:model_Tray ersatz:representativeQuality kb:weight_2"), "wrong_representative", "model_Tray"),
    ("representative without entry", "substitution",
     insert("kb:model_Tray ersatz:representativeQuality kb:rigidity_1"), "baseless_representative",
     "model_Tray"),
    ("measurement without property", "two_classes", delete("kb:bowl_01__weight ersatz:measuredProperty ?p"),
     "incomplete_measurement", "bowl_01__weight"),
    ("measurement without value", "two_classes", delete("kb:bowl_01__weight ersatz:rawValue ?v"),
     "incomplete_measurement", "bowl_01__weight"),
    ("number and vector", "vector", insert("kb:bowl_01__size ersatz:rawValue 0.14"),
     "incomplete_measurement", "bowl_01__size"),
    ("measurement of no object", "two_classes", delete("?o ersatz:hasMeasurement kb:bowl_01__weight"),
     "stray_measurement", "bowl_01__weight"),
    ("measurement of two objects", "two_classes",
     insert("kb:bowl_02 ersatz:hasMeasurement kb:bowl_01__weight"),
     "stray_measurement", "bowl_01__weight"),
    ("origin unknown", "two_classes", delete("kb:bowl_01__weight ersatz:origin ?o"),
     "unknown_origin", "bowl_01__weight"),
    ("holds without measurement", "two_classes", insert("kb:plate_02 ersatz:holds kb:containment_1"),
     "holds_without_measurement", "plate_02"),
    ("assigned but not held", "two_classes", delete("kb:bowl_01 ersatz:holds kb:weight_1"),
     "assigned_but_not_held", "bowl_01"),
    ("measured but in no count", "two_classes", delete("kb:bowl_01__weight ersatz:assignedQuality ?q") + " ; "
     + delete("kb:bowl_01 ersatz:holds kb:weight_1"), "unassigned_property", "bowl_01"),
    ("weight taken for rigidity", "two_classes",
     replace("kb:bowl_01__weight", "ersatz:assignedQuality", "kb:rigidity_1"),
     "quality_of_other_property", "bowl_01__weight"),
    ("two qualities", "two_classes",
     insert("kb:bowl_01__weight ersatz:assignedQuality kb:weight_2"),
     "two_qualities", "bowl_01__weight"),
    ("value above its quality", "two_classes", replace("kb:bowl_01__weight", "ersatz:rawValue", "0.5"),
     "value_outside_bounds", "bowl_01__weight"),
    ("value below its quality", "two_classes", replace("kb:plate_01__weight", "ersatz:rawValue", "0.3"),
     "value_outside_bounds", "plate_01__weight"),
    ("degree over one", "fuzzy", replace("kb:bowl_01__weight-weight_2", "ersatz:degree", "1.5"),
     "wrong_assignment", "bowl_01__weight-weight_2"),
    ("degree of another property", "fuzzy",
     replace("kb:bowl_01__weight-weight_2", "ersatz:quality", "kb:size_2"),
     "wrong_assignment", "bowl_01__weight-weight_2"),
    ("degree of two values", "fuzzy",
     insert("kb:bowl_02__weight ersatz:hasAssignment kb:bowl_01__weight-weight_2"),
     "wrong_assignment", "bowl_01__weight-weight_2"),
    ("two degrees of one quality", "fuzzy",
     replace("kb:bowl_02__weight-weight_2", "ersatz:quality", "kb:weight_1"),
     "wrong_assignment", "bowl_02__weight"),
    ("degree lost", "fuzzy", delete("kb:coffee_mug_01__weight-weight_2 ?p ?o") + " ; "
     + delete("?m ersatz:hasAssignment kb:coffee_mug_01__weight-weight_2"),
     "degrees_short_of_one", "coffee_mug_01__weight"),
    ("assigned what it belongs to less", "fuzzy",
     replace("kb:coffee_mug_01__weight", "ersatz:assignedQuality", "kb:weight_2"),
     "not_most_assigned", "coffee_mug_01__weight"),
    ("assigned the higher of equal ones", "fuzzy",
     replace("kb:coffee_mug_01__weight", "ersatz:assignedQuality", "kb:weight_2") + " ; "
     + replace("kb:coffee_mug_01__weight-weight_1", "ersatz:degree", "0.5") + " ; "
     + replace("kb:coffee_mug_01__weight-weight_2", "ersatz:degree", "0.5"),
     "not_most_assigned", "coffee_mug_01__weight"),
    ("fuzzy value without degrees", "fuzzy", delete("kb:bowl_01__weight ersatz:hasAssignment ?a"),
     "degrees_left_out", "bowl_01__weight"),
    ("degrees of a crisp quality", "fuzzy", delete("?q ersatz:qualityOf kb:weight ; ersatz:fuzzifier ?m"),
     "degrees_left_out", "bowl_01__weight"),
    ("one property, two fuzzifiers", "fuzzy", replace("kb:weight_2", "ersatz:fuzzifier", "1.5"),
     "degrees_left_out", "weight_2"),
    ("fuzzy count differs from the degrees", "fuzzy",
     replace("kb:CoffeeMug__weight_1", "ersatz:count", "1.8"), "class_count_differs", "model_CoffeeMug"),
    ("fuzzy function count differs", "fuzzy",
     replace("kb:containment_1__weight_1", "ersatz:count", "1.81001"), "function_count_differs",
     "model_containment_1"),
    ("fuzzy entry lost", "fuzzy", delete("?m ersatz:hasEntry kb:CoffeeMug__weight_2"),
     "counts_short_of_total", "model_CoffeeMug"),
    ("matrix without an element", "fuzzy", delete("kb:size_2 ersatz:hasNormElement kb:size_2-length-height"),
     "wrong_norm", "size_2"),
    ("element given twice", "fuzzy",
     replace("kb:size_2-length-height", "ersatz:columnAxis", "kb:size-length"), "wrong_norm", "size_2"),
    ("element below the diagonal", "fuzzy",
     replace("kb:size_2-length-height", "ersatz:rowAxis", "kb:size-height") + " ; "
     + replace("kb:size_2-length-height", "ersatz:columnAxis", "kb:size-length"),
     "wrong_norm", "size_2"),
    ("vector without its width", "vector",
     delete("kb:bowl_01__size ersatz:hasCoordinate kb:bowl_01__size-width"),
     "wrong_coordinates", "bowl_01__size"),
    ("coordinate without number", "vector", delete("kb:bowl_01__size-width ersatz:coordinate ?n"),
     "stray_coordinate", "bowl_01__size-width"),
    ("coordinate of two vectors", "vector",
     insert("kb:bowl_02__size ersatz:hasCoordinate kb:bowl_01__size-width"),
     "stray_coordinate", "bowl_01__size-width"),
    ("quality of no property", "two_classes", delete("kb:weight_1 ersatz:qualityOf ?p"),
     "stray_quality", "weight_1"),
    ("physical quality of a function", "two_classes", replace("kb:weight_1", "ersatz:qualityOf",
     "kb:containment"),
     "quality_kind", "weight_1"),
    ("two ranks alike", "two_classes", replace("kb:weight_2", "ersatz:rank", "1"), "duplicate_rank",
     "weight_2"),
    ("rank skipped", "two_classes", replace("kb:weight_2", "ersatz:rank", "3"), "rank_gap", "weight"),
    ("rank lost", "two_classes", delete("kb:weight_2 ersatz:rank ?r"), "rank_gap", "weight"),
    ("centroids in the wrong order", "two_classes", replace("kb:weight_2", "ersatz:centroid", "0.2"),
     "centroid_order", "weight_2"),
    ("centroid beyond its bounds", "two_classes", replace("kb:weight_1", "ersatz:centroid", "0.41"),
     "centroid_outside_bounds", "weight_1"),
    ("gap between qualities", "two_classes", replace("kb:weight_1", "ersatz:upperBound", "0.35"),
     "bounds_gap", "weight_1"),
    ("inner bound lost", "two_classes", delete("kb:weight_2 ersatz:lowerBound ?b"), "bounds_gap", "weight_1"),
    ("quality without centroid", "two_classes", delete("kb:weight_1 ersatz:centroid ?c"),
     "missing_centroid", "weight_1"),
    ("property without unit", "two_classes", delete("kb:weight ersatz:unit ?u"), "property_without_unit",
     "weight"),
    ("two axes at one place", "vector", replace("kb:size-width", "ersatz:position", "1"), "wrong_axes",
     "size"),
    ("model of no class", "two_classes", delete("kb:model_Bowl ersatz:describesClass ?c"),
     "class_model_without_class", "model_Bowl"),
    ("class without model", "two_classes",
     insert('kb:Cup a owl:Class ; rdfs:subClassOf ersatz:Object ; rdfs:label "cup"@en'),
     "class_without_model", "Cup"),
    ("model of no function", "two_classes", delete("kb:model_containment_1 ersatz:forFunction ?f"),
     "function_model_without_function", "model_containment_1"),
    ("object of two classes", "two_classes", insert("kb:bowl_01 a kb:Plate"), "object_class", "bowl_01"),
    ("object of no class", "two_classes", delete("kb:bowl_01 a kb:Bowl"), "object_class", "bowl_01"),
    ("build without its theta", "two_classes", delete("kb:build_1 ersatz:theta ?t"), "incomplete_build",
     "build_1"),
    ("substitute and not", "substitution", insert(f"{TRAY} ersatz:nonSubstitute kb:model_Plate"),
     "substitute_and_not", TRAY[3:]),
    ("answer without tool", "substitution", delete(f"{TRAY} ersatz:missingTool ?t"),
     "incomplete_substitution_model", TRAY[3:]),
    ("candidate without similarity", "substitution", delete(f"{TRAY}__Plate ersatz:similarity ?s"),
     "incomplete_candidate", TRAY[3:] + "__Plate"),
    ("candidate of no answer", "substitution", delete(f"{TRAY} ersatz:hasCandidate {TRAY}__Plate"),
     "stray_candidate", TRAY[3:] + "__Plate"),
    ("accepted, yet no substitute", "substitution", replace(f"{TRAY}__Sponge", "ersatz:accepted", "true"),
     "candidate_decision", TRAY[3:] + "__Sponge"),
    ("tray for tray", "substitution", insert(f"{TRAY} ersatz:substitute kb:model_Tray"),
     "own_substitute", TRAY[3:]),
    ("probability over one", "substitution",
     insert(f"{TRAY}__Plate ersatz:acceptanceProbability 1.2"), "wrong_confidence", TRAY[3:] + "__Plate"),
    ("interval turned round", "substitution",
     insert(f"{TRAY}__Plate ersatz:similarityLow 0.7 ; ersatz:similarityHigh 0.6"), "wrong_confidence",
     TRAY[3:] + "__Plate"),
    ("interval of one end", "substitution", insert(f"{TRAY}__Plate ersatz:similarityHigh 0.6"),
     "wrong_confidence", TRAY[3:] + "__Plate"),
    ("prior of nothing", "substitution", insert(f"{TRAY} ersatz:priorCount 0.0"), "wrong_confidence",
     TRAY[3:]),
    ("relevance of nothing", "substitution", insert(f"{TRAY} ersatz:hasRelevance {TRAY}-q . {RELEVANCE}"),
     "wrong_relevance", TRAY[3:] + "-q"),
    ("relevance of no answer", "substitution",
     insert(f"{RELEVANCE} ; ersatz:relevantQuality kb:weight_2 ; ersatz:relevanceWeight 0.5"),
     "wrong_relevance", TRAY[3:] + "-q"),
    ("a quality as candidate", "substitution", insert(f"{TRAY} ersatz:substitute kb:weight_1"),
     "candidate_kind", TRAY[3:]),
    ("shares what is not relevant", "substitution", insert(f"{TRAY}__Plate ersatz:shared kb:weight_1"),
     "relevance_and_candidates", TRAY[3:] + "__Plate"),
    ("chain on holds", "two_classes",
     insert("ersatz:holds owl:propertyChainAxiom ( ersatz:hasMeasurement ersatz:assignedQuality )"),
     "holds_not_simple", "https://w3id.org/ersatz#holds"),
    ("quality as an inhering one", "two_classes",
     insert('ersatz:PhysicalQuality rdfs:subClassOf soma:PhysicalQuality . soma:PhysicalQuality a owl:Class'),
     "inhering_quality", "https://w3id.org/ersatz#PhysicalQuality"),
    ("a date OWL 2 does not know", "two_classes", insert('kb:build_1 rdfs:comment "2026-11-22"^^xsd:date'),
     "owl_datatype", "build_1"),
    ("object and data property", "two_classes", insert("ersatz:rank a owl:ObjectProperty"),
     "owl_two_kinds", "https://w3id.org/ersatz#rank"),
    ("text for an individual", "two_classes", insert('kb:bowl_01 ersatz:holds "weight_1"'),
     "owl_wrong_value", "bowl_01"),
    ("transitive and disjoint", "two_classes", insert("ersatz:substitute a owl:TransitiveProperty"),
     "owl_not_simple", "https://w3id.org/ersatz#substitute"),
    ("beyond OWL 2 RL", "two_classes",
     insert("ersatz:Object rdfs:subClassOf [ a owl:Restriction ; owl:onProperty ersatz:holds ;"
            " owl:someValuesFrom ersatz:Quality ]"), "owl_rl_class", "https://w3id.org/ersatz#Object"),
]  # fmt: skip
SHAPE_FAULTS = [
    ("count over total", "two_classes", replace("kb:Bowl__weight_1", "ersatz:count", "3.0"), "shape_Entry"),
    ("similarity over one", "substitution", replace(f"{TRAY}__Plate", "ersatz:similarity", "1.5"),
     "shape_Candidate"),
    ("level over one", "substitution", insert(f"{TRAY} ersatz:credibleLevel 90.0"),
     "shape_SubstitutionModel"),
    ("theta over one", "substitution", replace(TRAY, "ersatz:theta", "35.0"), "shape_SubstitutionModel"),
    ("measured by a class", "two_classes",
     replace("kb:bowl_01__weight", "ersatz:measuredProperty", "kb:weight_1"), "shape_Measurement"),
    ("unit of observation unknown", "two_classes",
     replace("kb:build_1", "ersatz:observationUnit", '"day"'), "shape_KnowledgeBuild"),
    ("fuzzifier below one", "fuzzy", replace("kb:weight_1", "ersatz:fuzzifier", "0.5"), "shape_Quality"),
    ("element of no quality", "fuzzy", delete("?q ersatz:hasNormElement kb:size_2-length-height"),
     "shape_NormElement"),
    ("degree of nothing", "fuzzy", delete("?m ersatz:hasAssignment kb:bowl_01__weight-weight_2"),
     "shape_Assignment"),
    ("SHA of seven digits", "two_classes", insert('kb:source_by_hand ersatz:sha256 "0123456"'),
     "shape_Source"),
]  # fmt: skip
CONTRADICTIONS = [
    ("physical and functional", "two_classes", insert("kb:weight_1 a ersatz:FunctionalQuality")),
    ("a quality that is an object", "two_classes", insert("kb:weight_1 a ersatz:Object")),
    ("substitute and not", "substitution", insert(f"{TRAY} ersatz:nonSubstitute kb:model_Plate")),
    ("candidates merged", "substitution", insert("kb:model_Plate owl:sameAs kb:model_Sponge")),
    ("two counts", "two_classes", insert("kb:Bowl__weight_1 ersatz:count 2.5")),
    ("two ranks", "two_classes", insert("kb:weight_1 ersatz:rank 2")),
    ("two degrees", "fuzzy", insert("kb:bowl_01__weight-weight_2 ersatz:degree 0.5")),
]

EXPLAINED = [
    (
        *CONTRADICTIONS[4][1:],
        "https://w3id.org/ersatz/kb#Bowl__weight_1",
        {"kb:Bowl__weight_1 ersatz:count 2", "kb:Bowl__weight_1 ersatz:count 2.5",
         "ersatz:count a owl:FunctionalProperty"},
    ),
    (
        *CONTRADICTIONS[0][1:],
        "https://w3id.org/ersatz/kb#weight_1",
        {"kb:weight_1 a ersatz:FunctionalQuality", "kb:weight_1 a ersatz:PhysicalQuality",
         "ersatz:FunctionalQuality owl:disjointWith ersatz:PhysicalQuality"},
    ),
]  # fmt: skip


def planted(example: str, update: str) -> ox.Store:
    store = ox.Store()
    read_into(store, EXAMPLES / f"{example}.ttl")
    store.update(PREFIXES + update)
    return store


def test_every_check_has_a_fault_it_finds() -> None:
    assert {fault[3] for fault in FAULTS} == {check.rule for check in validation.checks()}


@pytest.mark.parametrize(
    ("example", "update", "rule", "entity"), [f[1:] for f in FAULTS], ids=[f[0] for f in FAULTS]
)
def test_planted_fault_is_found_by_name(example: str, update: str, rule: str, entity: str | None) -> None:
    store = planted(example, update)
    found = [finding for finding in validation.check(store, rules=[rule]).findings if finding.rule == rule]
    entities = {finding.entity for finding in found}
    assert entities
    if entity is not None:
        assert (entity if entity.startswith("http") else validation.CORE + "/kb#" + entity) in entities
    assert all(finding.mend.endswith(".") and finding.message for finding in found)
    # The other engine finds the same.
    data: Any = ox.serialize(
        (quad.triple for quad in validation.with_ontology(store)), format=ox.RdfFormat.N_TRIPLES
    )
    check = next(check for check in validation.checks() if check.rule == rule)
    rows: Any = rdflib.Graph().parse(data=data, format="nt").query(check.query)
    if entity is not None:
        assert {str(row.entity) for row in rows} == entities
    else:
        assert len(rows) > 0


@pytest.mark.parametrize(("_", "example", "update", "rule"), SHAPE_FAULTS, ids=[f[0] for f in SHAPE_FAULTS])
def test_shapes_find_planted_fault(_: str, example: str, update: str, rule: str) -> None:
    pytest.importorskip("pyshacl")
    assert rule in {finding.rule for finding in validation.check(planted(example, update)).findings}


@pytest.mark.parametrize(("_", "example", "update"), CONTRADICTIONS, ids=[f[0] for f in CONTRADICTIONS])
def test_hermit_finds_contradiction(_: str, example: str, update: str) -> None:
    java()
    assert not consistent(quad.triple for quad in validation.with_ontology(planted(example, update)))


@pytest.mark.parametrize(("example", "update", "entity", "statements"), EXPLAINED, ids=["count", "kind"])
def test_contradiction_is_named(example: str, update: str, entity: str, statements: set[str]) -> None:
    java()
    report = validation.check(planted(example, update), reason=True, rules=[])
    assert [(finding.rule, finding.entity) for finding in report.findings] == [("inconsistent", entity)]
    said = report.findings[0].message.partition("cannot all be true: ")[2]
    assert set(said.split(" | ")) == statements


def test_contradiction_is_shown_as_far_as_time_allows() -> None:
    java()
    store = validation.with_ontology(planted(*CONTRADICTIONS[0][1:]))
    found = explain((quad.triple for quad in store), seconds=0)
    assert not found.minimal
    assert "kb:weight_1 a ersatz:FunctionalQuality" in found.texts()
    whole = next(text for text in found.texts() if text.startswith("ersatz:FunctionModel rdfs:subClassOf ("))
    assert "owl:allValuesFrom ersatz:PhysicalQuality" in whole


@pytest.mark.parametrize(
    "file", sorted((ROOT / "ontology").glob("*.ttl")) + sorted(EXAMPLES.glob("*.ttl")), ids=str
)
def test_nothing_is_found_on_what_is_shipped(file: Path) -> None:
    report = validation.check_file(file, reason=True)
    assert report.findings == ()
    assert report.ok
    assert len(report.ran) > 70
    assert report.as_dict() == {
        "version": 1, "ok": True, "findings": [], "ran": [*report.ran], "skipped": [*report.skipped]
    }  # fmt: skip


def test_counted_observations_are_not_compared_with_the_number_of_objects() -> None:
    rows = [(WEIGHT, "mug", "mug 1", seen, (0.2,)) for seen in ("a", "b")] + [
        (WEIGHT, "plate", "plate 1", "a", (0.9,))
    ]
    assert validation.check(
        small(rows, ObservationUnit.OBSERVATION).triples(), rules=[one.rule for one in validation.checks()]
    ).ok


def test_syntax_is_a_finding_with_its_place(tmp_path: Path) -> None:
    file = tmp_path / "broken.ttl"
    file.write_text("@prefix : <https://example.org/> .\n:a :b\n")
    report = validation.check_file(file)
    assert [(finding.rule, finding.entity) for finding in report.findings] == [("syntax", "broken.ttl")]
    assert "broken.ttl" in report.findings[0].message
    file.write_bytes(b"\x00\xff\x00 junk")
    assert not validation.check_file(file).ok
    assert not validation.check_file(tmp_path / "what.xyz").ok
    with pytest.raises(KnowledgeBaseError, match="nowhere"):
        validation.check_file(tmp_path / "nowhere.ttl")


def test_what_is_missing_is_said_and_the_rest_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("shutil.which", lambda _: None)
    monkeypatch.setattr(validation, "find_spec", lambda _: None)
    report = validation.check(planted("two_classes", delete("kb:bowl_01 rdfs:label ?l")), reason=True)
    assert {finding.rule for finding in report.findings} == {"missing_label"}
    assert [line.split(":")[0] for line in report.skipped] == ["shapes", "inconsistent"]
    assert "ersatz[check]" in report.skipped[0]
    assert "Java" in report.skipped[1]


def test_the_store_is_not_changed() -> None:
    store = planted("two_classes", "")
    before = set(store)
    report = validation.check(store)
    assert set(store) == before
    assert validation.check(quad.triple for quad in store) == report
