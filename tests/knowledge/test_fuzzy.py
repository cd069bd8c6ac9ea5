"""A fuzzy knowledge base: degrees written, read back, taken back, checked and exported."""

from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np
import pyoxigraph as ox
import pytest
import rdflib

from ersatz.errors import InputError
from ersatz.grounding.fuzzy import DEGREE
from ersatz.grounding.subcategorization import SubcategorizationSettings
from ersatz.grounding.units import ObservationUnit
from ersatz.knowledge import exports, validation
from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.defined import defined_classes
from ersatz.knowledge.reader import read_qualities
from ersatz.knowledge.terms import millionths
from ersatz.knowledge.updates import observe_blocks
from ersatz.measurements import Block, Origin, Source
from ersatz.pipeline import Settings, build
from ersatz.reasoner.substitution import rank_substitutes
from tests.knowledge.tools import assert_whole, facts_of, small
from tests.making import prop, table
from tests.reasoners import ROOT

EXAMPLES = sorted((ROOT / "ontology" / "examples").glob("*.ttl"))
FUZZY = ROOT / "ontology" / "examples" / "fuzzy.ttl"


def degrees(kb: KnowledgeBase, instance: str) -> dict[str, int]:
    rows = kb.ask("instance_memberships", instances=[instance])
    assert all(row["total"] == 1 for row in rows)
    return {str(row["quality"]).rpartition("#")[2]: millionths(Decimal(str(row["count"]))) for row in rows}


@pytest.mark.parametrize("file", EXAMPLES, ids=lambda file: file.stem)
def test_every_example_opens_and_answers(file: Path) -> None:
    kb = KnowledgeBase.open(file)
    assert_whole(kb)
    classes = [str(row["name"]) for row in kb.ask("classes")]
    assert len(classes) >= 2
    assert len(rank_substitutes(kb, missing=classes[0], available=classes[1:])) in (0, len(classes) - 1)
    assert len(kb.ask("memberships")) >= 4


def test_the_example_says_what_its_own_qualities_give() -> None:
    kb = KnowledgeBase.open(FUZZY)
    facts, revision = facts_of(kb), kb.revision
    things = {str(row["name"]): label(kb, str(row["class"])) for row in kb.ask("all_instances")}
    measured = {name: measurements(kb, name, of) for name, of in things.items()}
    for name in things:
        kb.forget(name)
    assert len(kb.ask("classes")) == 0
    for name, of in things.items():
        observe_blocks(kb, of, name, measured[name])
    assert (facts_of(kb), kb.revision) == (facts, revision)


def label(kb: KnowledgeBase, iri: str) -> str:
    return str(kb.ask("class", **{"class": iri})[0]["name"])


def measurements(kb: KnowledgeBase, name: str, of: str) -> list[Block]:
    vectors: dict[str, list[float]] = {}
    for row in kb.ask("instance_measurements", instance=name):
        vectors.setdefault(str(row["property"]).rpartition("#")[2], []).append(float(str(row["value"])))
    source = Source(str(kb.ask("sources")[0]["file"]))
    return [
        Block(q.property, [of], [name], [""], np.array([vectors[q.property.name]]), Origin.HUMAN, source)
        for q in read_qualities(kb)
    ]


@pytest.mark.parametrize("suffix", [".ttl", ".nt", ".owl", ".jsonld", ""])
def test_a_reopened_knowledge_base_gives_the_same_degrees(tmp_path: Path, suffix: str) -> None:
    kb = small(fuzzifier=1.7)
    kb.save(tmp_path / f"fuzzy{suffix}")
    again = KnowledgeBase.open(tmp_path / f"fuzzy{suffix}")
    for one, other in zip(read_qualities(kb), read_qualities(again), strict=True):
        assert one.fuzzy
        assert one.same_cuts(other)
        assert one.method == other.method
    for each in (kb, again):
        each.observe("bowl", "bowl 7", {"weight": 0.41, "size": [0.2, 0.21, 0.1], "support": 0.05})
    found = degrees(again, "bowl 7")
    assert found == degrees(kb, "bowl 7")
    assert len(found) == 6
    assert sum(found.values()) == 3 * DEGREE
    assert facts_of(kb) == facts_of(again)


def test_an_object_holds_what_it_belongs_to_most() -> None:
    kb = KnowledgeBase.open(FUZZY)
    held = kb.ask("instance_qualities", instances=["coffee mug 01"])
    names = {str(row["quality"]).rpartition("#")[2] for row in held}
    assert names == {"weight_1", "containment_1", "size_1"}
    found = degrees(kb, "coffee mug 01")
    assert found["weight_1"] == 900_000
    assert all(found[name] > DEGREE / 2 for name in names)
    kb.observe("bowl", "bowl 3", {"weight": 0.4})  # between the centroids: the lower rank
    assert degrees(kb, "bowl 3") == {"weight_1": DEGREE // 2, "weight_2": DEGREE // 2}
    assert [str(row["quality"])[-8:] for row in kb.ask("instance_qualities", instances=["bowl 3"])] == [
        "weight_1"
    ]


def test_the_counts_of_a_class_are_the_sums_of_its_degrees() -> None:
    kb = small(fuzzifier=2.0)
    rows = kb.ask("class_knowledge", **{"class": "tray"})
    sums: dict[str, int] = {}
    for name in ("tray 1", "tray 2"):
        for quality, degree in degrees(kb, name).items():
            sums[quality] = sums.get(quality, 0) + degree
    assert {str(r["quality"]).rpartition("#")[2]: millionths(Decimal(str(r["count"]))) for r in rows} == sums


def test_observations_that_count_each_share_their_object() -> None:
    kb = small(unit=ObservationUnit.OBSERVATION, fuzzifier=2.0)
    rows = kb.ask("instance_memberships", instances=["plate 2"])
    weights = [row for row in rows if "weight" in str(row["quality"])]
    assert [row["total"] for row in weights] == [2] * len(weights)
    assert sum(Decimal(str(row["count"])) for row in weights) == 2


def test_checks_find_nothing_and_shapes_conform() -> None:
    for kb in (small(fuzzifier=2.0), small(fuzzifier=1.01)):
        report = validation.check(kb.triples())
        assert report.findings == ()


def test_rocs_fuzzy_passes_every_check(shared_data: Path) -> None:
    kb = build(
        rocs=shared_data / "rocs", settings=Settings(SubcategorizationSettings(restarts=10, fuzzifier=2.0))
    )
    assert '"fuzzifier": 2.0' in kb.build.settings
    assert {q.method for q in read_qualities(kb)} == {"fuzzy c-means", "Gustafson-Kessel"}
    rules = [each.rule for each in validation.checks()]  # shapes are as slow as they are many
    assert validation.check(kb.triples(), rules=rules).findings == ()
    ranking = rank_substitutes(kb, missing="plate")
    assert len(ranking) in (0, len(kb.ask("classes")) - 1)
    name = str(kb.ask("all_instances")[0]["name"])
    before, facts = kb.revision, facts_of(kb)
    kb.observe(
        "plate", "another plate", {q.property.name: q.centroids[0].tolist() for q in read_qualities(kb)}
    )
    kb.forget("another plate")
    assert (kb.revision, facts_of(kb)) == (before, facts)
    assert sum(degrees(kb, name).values()) % DEGREE == 0


def test_exports_take_degrees_along() -> None:
    kb = KnowledgeBase.open(FUZZY)
    data: Any = ox.serialize(exports.knowrob(kb.triples()), format=ox.RdfFormat.N_TRIPLES)
    exported = rdflib.Graph().parse(data=data, format="nt")
    entry = rdflib.URIRef(exports.REIFIED + "CoffeeMug__weight_1")
    confidence = exported.value(entry, rdflib.URIRef(exports.KNOWROB + "hasConfidence"))
    assert confidence == rdflib.Literal("0.95", datatype=rdflib.XSD.double)
    mug = rdflib.URIRef("https://w3id.org/ersatz/kb#coffee_mug_01")
    part = rdflib.URIRef(exports.REIFIED + "coffee_mug_01__weight-weight_2")
    assert exported.value(part, rdflib.URIRef(exports.KNOWROB + "hasSubject")) == mug
    assert exported.value(part, rdflib.URIRef(exports.KNOWROB + "hasConfidence")) == rdflib.Literal(
        "0.1", datatype=rdflib.XSD.double
    )
    facts = list(exports.oro(kb.triples()))
    held = [
        t for t in facts if t.predicate.value.endswith("hasQuality") and "coffee_mug_01" in str(t.subject)
    ]
    assert len(held) == 3
    assert "kb:Holds_weight_1" in "".join(defined_classes(kb.triples()))


def test_a_component_called_like_a_quality_is_refused() -> None:
    flat = prop("size", "physical", "size_1", "size_2")
    rows = [("cup", f"cup {n}", "", "size", (float(n), float(n * n))) for n in range(6)]
    measured = table(rows, [flat])
    with pytest.raises(InputError, match="would both be called"):
        build(blocks=[*measured.blocks()], settings=Settings(SubcategorizationSettings(2, 5, fuzzifier=2.0)))
