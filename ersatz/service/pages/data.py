"""What the pages show, read from the knowledge base by stored questions and kept until it changes."""

from dataclasses import dataclass

from pyoxigraph import NamedNode

from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.queries import Value
from ersatz.knowledge.vocabulary import DESCRIBES_CLASS


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


def superclasses(kb: KnowledgeBase) -> dict[str, list[str]]:
    """Return the named superclasses of each class, by IRI."""
    return kb.view(_superclasses)


def is_individual(kb: KnowledgeBase, iri: str) -> bool:
    """Tell whether an IRI is a thing that was measured, rather than a statement about one."""
    rows = kb.query(f"ASK {{ {NamedNode(iri)} a ?class . ?model <{DESCRIBES_CLASS.value}> ?class }}")
    return bool(rows[0]["answer"])


def warm(kb: KnowledgeBase) -> None:
    """Read what most pages need."""
    overview(kb)
    superclasses(kb)
    units(kb)


def _overview(kb: KnowledgeBase) -> Overview:
    classes = sorted(
        ((str(row["class"]), str(row["name"]), int(str(row["instances"]))) for row in kb.ask("classes")),
        key=lambda one: one[1],
    )
    return Overview(tuple(classes), len(individuals(kb)), len(kb.ask("properties")), len(kb.ask("qualities")))


def _individuals(kb: KnowledgeBase) -> tuple[tuple[str, str, str], ...]:
    return tuple((str(i), str(n), str(c)) for i, n, c in kb.ask("all_instances").rows)


def _units(kb: KnowledgeBase) -> dict[str, dict[str, Value]]:
    return {str(row["property"]): dict(row) for row in kb.ask("properties")}


def _superclasses(kb: KnowledgeBase) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for row in kb.query(
        "PREFIX rdfs: <http://www.w3.org/2000/01/rdf-schema#> "
        "SELECT ?c ?s { ?c rdfs:subClassOf ?s FILTER (ISIRI(?s)) } ORDER BY ?s"
    ):
        found.setdefault(str(row["c"]), []).append(str(row["s"]))
    return found
