"""Bridges add nothing bad to the real ontologies: undeclared terms, violations, contradictions, mergers."""

import re
from collections import defaultdict
from pathlib import Path

import pyoxigraph as ox
import pytest

from ersatz.knowledge import linking
from ersatz.knowledge.contradictions import consistent
from tests.knowledge.linked import ONTOLOGIES, alone, linked, store_of, triples, write
from tests.reasoners import ROOT, java, owlapi

OWL = "http://www.w3.org/2002/07/owl#"
EMPTY_ALONE = {
    *(f"http://www.ease-crc.org/ont/SOMA.owl#{n}" for n in ("Color", "PreferenceOrder", "PreferenceRegion")),
    *(
        f"http://knowrob.org/kb/knowrob.owl#{kind}Argument"
        for kind in ("Atom", "Atomic", "Float", "Integer", "Number", "String", "Variable")
    ),
}
"""Classes of SOMA and KnowRob that contradict themselves without us, as HermiT says of each alone."""


def test_every_bridge_is_tried() -> None:
    assert set(linking.BRIDGES) == set(ONTOLOGIES)


@pytest.mark.parametrize("bridge", linking.BRIDGES)
def test_every_foreign_term_of_a_bridge_is_declared_by_its_owner(bridge: str, shared_data: Path) -> None:
    ours = store_of(ROOT / "ontology" / "bridges" / f"{bridge}.ttl")
    foreign = alone(bridge, shared_data)
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


def test_no_bridge_adds_a_violation_or_an_empty_class(shared_data: Path, tmp_path: Path) -> None:
    """Whatever the OWL API and ELK find in a linked graph, they find in the other ontology alone."""
    files = [
        write(graph(bridge, shared_data), tmp_path / f"{bridge}-{graph.__name__}.nt")
        for bridge in linking.BRIDGES
        for graph in (alone, linked)
    ]
    found: dict[str, set[tuple[str, str]]] = defaultdict(set)
    for name, said in owlapi(files, "profile,elk").items():
        assert said["ELK"] == ["true"], name
        for kind in ("OWL 2 DL", "OWL 2 RL", "unsatisfiable"):
            # Names of blank nodes and of the merged graph are given anew each time.
            lines = (re.sub(r"_:genid\S+?\b| in OntologyID\(.*", "", line) for line in said.get(kind, ()))
            found[name] |= {(kind, line) for line in lines}
    assert found["soma-alone.nt"]
    assert found["knowrob-alone.nt"]
    assert {b: found[f"{b}-linked.nt"] - found[f"{b}-alone.nt"] for b in ONTOLOGIES} == {
        bridge: set() for bridge in ONTOLOGIES
    }


@pytest.mark.parametrize("bridge", linking.BRIDGES)
def test_consistent_with_all_apart_and_no_class_empty(bridge: str, shared_data: Path) -> None:
    """HermiT agrees that all our individuals are different and that every class has a member.

    Two that a bridge merges could not be different; a class it makes unsatisfiable could have no member.
    """
    java()
    graph = linked(bridge, shared_data)
    ours = [t for t in _named(graph, "NamedIndividual") if t.value.startswith("https://w3id.org/ersatz")]
    assert len(ours) > 200
    # With a member of each of its 700 classes HermiT takes two minutes on SOMA: ELK looks there.
    classes = [] if bridge == "soma" else [c for c in _named(graph, "Class") if c.value not in EMPTY_ALONE]
    members = [
        ox.Triple(ox.NamedNode(f"https://example.org/member{number}"), ox.NamedNode(_TYPE), one)
        for number, one in enumerate(classes)
        if one.value != OWL + "Nothing"
    ]
    assert consistent([*triples(graph), *_all_different(ours), *members])


def test_a_bridge_that_merges_is_noticed(shared_data: Path) -> None:
    java()
    graph = triples(linked("sosa", shared_data))
    one, two = (ox.NamedNode(f"https://w3id.org/ersatz/kb#bowl_0{number}") for number in (1, 2))
    graph.append(ox.Triple(one, ox.NamedNode(OWL + "sameAs"), two))
    assert not consistent([*graph, *_all_different([one, two])])


def test_aligning_qualities_with_inhering_ones_is_a_contradiction(shared_data: Path) -> None:
    java()
    wrong = ox.Store()
    wrong.extend(linked("soma", shared_data))
    wrong.update(
        "PREFIX e: <https://w3id.org/ersatz#> PREFIX soma: <http://www.ease-crc.org/ont/SOMA.owl#>"
        " PREFIX rdfs: <http://www.w3.org/2000/01/rdf-schema#>"
        " INSERT DATA { e:PhysicalQuality rdfs:subClassOf soma:PhysicalQuality }"
    )
    assert not consistent(triples(wrong))


_TYPE = "http://www.w3.org/1999/02/22-rdf-syntax-ns#type"


def _named(graph: ox.Store, kind: str) -> list[ox.NamedNode]:
    typed = graph.quads_for_pattern(None, ox.NamedNode(_TYPE), ox.NamedNode(OWL + kind))
    found = {quad.subject for quad in typed if isinstance(quad.subject, ox.NamedNode)}
    return sorted(found, key=lambda term: term.value)


def _all_different(individuals: list[ox.NamedNode]) -> list[ox.Triple]:
    store = ox.Store()
    members = " ".join(map(str, individuals))
    store.update(f"INSERT DATA {{ [] a <{OWL}AllDifferent> ; <{OWL}distinctMembers> ( {members} ) }}")
    return triples(store)
