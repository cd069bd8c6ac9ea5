"""Lookup: what people say, to the IRIs of what a knowledge base knows."""

from typing import TYPE_CHECKING, Final

import pyoxigraph as ox

from ersatz.errors import InputError, UnknownNameError
from ersatz.knowledge import vocabulary as v
from ersatz.knowledge.names import class_iri, local_name, snake_iri

if TYPE_CHECKING:
    from ersatz.knowledge.base import KnowledgeBase

_TYPES_OF: Final = {
    "class": {v.OWL_CLASS.value},
    "property": {v.PHYSICAL_PROPERTY.value, v.FUNCTIONAL_PROPERTY.value},
    "quality": {v.PHYSICAL_QUALITY.value, v.FUNCTIONAL_QUALITY.value},
}


def resolve(kb: "KnowledgeBase", name: str, kind: str) -> str:
    """Return the IRI a name stands for; see `KnowledgeBase.resolve`."""
    found = _named(kb, name)
    fitting = sorted({thing for thing, types in found.items() if _is_a(types, kind)})
    if len(fitting) > 1:
        raise InputError(f"{name!r} may be {' or '.join(fitting)}: give the IRI")
    if not fitting:
        what = "name" if kind == "iri" else kind
        raise UnknownNameError(what, name, known_names(kb, kind), f"in {kb.location!r}")
    return fitting[0]


def kind_of(kb: "KnowledgeBase", iri: str) -> str:
    """Return "class", "property", "quality" or "instance" for the IRI of something known."""
    rows = kb.query(f"SELECT ?type WHERE {{ {ox.NamedNode(iri)} a ?type }}")
    types = {str(row["type"]) for row in rows}
    return next((kind for kind in _TYPES_OF if _is_a(types, kind)), "instance")


def known_names(kb: "KnowledgeBase", kind: str) -> list[str]:
    """Return the names of all classes, instances, properties or qualities, or of everything."""
    if kind == "class":
        return [str(row["name"]) for row in kb.ask("classes")]
    if kind == "property":
        return [local_name(str(row["property"])) for row in kb.ask("properties")]
    if kind == "quality":
        return [local_name(str(row["quality"])) for row in kb.ask("qualities")]
    if kind == "instance":
        return [str(row["name"]) for row in kb.ask("all_instances")]
    return [name for one in ("class", "property", "quality", "instance") for name in known_names(kb, one)]


def _named(kb: "KnowledgeBase", name: str) -> dict[str, set[str]]:
    """Return what may be meant by a name, with its types."""
    prefix, colon, rest = name.partition(":")
    if name.startswith(("http://", "https://")) or (colon and prefix in v.PREFIXES):
        guesses = [name if name.startswith("http") else v.PREFIXES[prefix] + rest]
    else:
        guesses = _guesses(name)
    found: dict[str, set[str]] = {}
    values = " ".join(str(ox.NamedNode(guess)) for guess in guesses if _valid(guess))
    if values:
        for row in kb.query(f"SELECT ?thing ?type WHERE {{ VALUES ?thing {{ {values} }} ?thing a ?type }}"):
            found.setdefault(str(row["thing"]), set()).add(str(row["type"]))
    if not found:
        for row in kb.ask("lookup", name=name):
            found.setdefault(str(row["thing"]), set()).add(str(row["type"]))
    return found


def _guesses(name: str) -> list[str]:
    try:
        return [class_iri(name), snake_iri(name)]
    except InputError:
        return []


def _valid(iri: str) -> bool:
    try:
        ox.NamedNode(iri)
    except ValueError:
        return False
    return True


def _is_a(types: set[str], kind: str) -> bool:
    if kind == "iri":
        return True
    if kind == "instance":
        return any(not one.startswith((v.ERSATZ, v.OWL)) for one in types)
    return bool(types & _TYPES_OF[kind])
