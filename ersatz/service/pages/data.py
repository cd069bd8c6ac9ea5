"""What the pages show, read from the knowledge base by stored questions and kept until it changes."""

import re
from dataclasses import dataclass
from functools import cache
from typing import Final
from urllib.parse import urlsplit

from pyoxigraph import NamedNode

from ersatz.knowledge.answers import Value
from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.linking import MAPPINGS, mappings
from ersatz.knowledge.vocabulary import DESCRIBES_CLASS
from ersatz.service.pages.markup import unit_words

_ONTOLOGIES: Final = {
    "SOMA.owl": "SOMA",
    "DUL.owl": "DUL",
    "knowrob": "KnowRob",
    "kb.openrobots": "ORO",
    "en-word.net": "Open English WordNet",
    "globalwordnet": "Interlingual Index of WordNets",
    "wikidata": "Wikidata",
    "dbpedia": "DBpedia",
    "opencyc": "OpenCyc",
    "ieee1872": "CORA",
    "/ont/is/": "ISAAC",
}


@dataclass(frozen=True, slots=True)
class Overview:
    """How much there is.

    Attributes
    ----------
    classes : tuple of (IRI, name, number of objects it is known from), by name
    individuals, properties, qualities : int
    """

    classes: tuple[tuple[str, str, int], ...]
    individuals: int
    properties: int
    qualities: int


def overview(kb: KnowledgeBase) -> Overview:
    """Return how much there is."""
    return kb.view(_overview)


def individuals(kb: KnowledgeBase) -> tuple[tuple[str, str, str], ...]:
    """Return (IRI, name, IRI of the class) of all individuals, by class and name."""
    return kb.view(_individuals)


def units(kb: KnowledgeBase) -> dict[str, dict[str, Value]]:
    """Return what is known of each property, by IRI."""
    return kb.view(_units)


def qualities(kb: KnowledgeBase) -> dict[str, dict[str, Value]]:
    """Return what is known of each quality, by IRI, in the order of properties and ranks."""
    return kb.view(_qualities)


def superclasses(kb: KnowledgeBase) -> dict[str, list[str]]:
    """Return the named superclasses of each class, by IRI."""
    return kb.view(_superclasses)


@cache
def shipped_mappings() -> dict[str, tuple[tuple[str, str, str], ...]]:
    """Return (predicate, other thing, where it comes from) of the mappings ERSATZ ships, by IRI."""
    found: dict[str, list[tuple[str, str, str]]] = {}
    for row in mappings():
        how = row["mapping_justification"].partition(":")[2]
        said = re.sub("([a-z])([A-Z])", r"\1 \2", how).lower() + (
            f"; {row['comment']}" if row["comment"] else ""
        )
        found.setdefault(row["subject_id"], []).append(
            (row["predicate_id"], row["object_id"], f"{MAPPINGS.name}, {said}")
        )
    return {iri: tuple(rows) for iri, rows in found.items()}


def ontology_of(iri: str) -> str:
    """Return what people call the ontology a term of another is from, or its host."""
    return next((name for part, name in _ONTOLOGIES.items() if part in iri), urlsplit(iri).netloc)


def is_individual(kb: KnowledgeBase, iri: str) -> bool:
    """Tell whether an IRI is a thing that was measured, rather than a statement about one."""
    rows = kb.query(f"ASK {{ {NamedNode(iri)} a ?class . ?model <{DESCRIBES_CLASS.value}> ?class }}")
    return bool(rows[0]["answer"])


def unit_of(kb: KnowledgeBase, prop: str) -> str:
    """Return the unit of a property as a person reads it."""
    return unit_words(str(units(kb).get(prop, {}).get("unit") or "1"))


def _overview(kb: KnowledgeBase) -> Overview:
    classes = sorted(
        ((str(row["class"]), str(row["name"]), int(str(row["instances"]))) for row in kb.ask("classes")),
        key=lambda one: one[1],
    )
    return Overview(tuple(classes), len(individuals(kb)), len(units(kb)), len(qualities(kb)))


def _individuals(kb: KnowledgeBase) -> tuple[tuple[str, str, str], ...]:
    return tuple((str(i), str(n), str(c)) for i, n, c in kb.ask("all_instances").rows)


def _units(kb: KnowledgeBase) -> dict[str, dict[str, Value]]:
    return {str(row["property"]): dict(row) for row in kb.ask("properties")}


def _qualities(kb: KnowledgeBase) -> dict[str, dict[str, Value]]:
    return {str(row["quality"]): dict(row) for row in kb.ask("qualities")}


def _superclasses(kb: KnowledgeBase) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for row in kb.query(
        "PREFIX rdfs: <http://www.w3.org/2000/01/rdf-schema#> "
        "SELECT ?c ?s { ?c rdfs:subClassOf ?s FILTER (ISIRI(?s)) } ORDER BY ?s"
    ):
        found.setdefault(str(row["c"]), []).append(str(row["s"]))
    return found
