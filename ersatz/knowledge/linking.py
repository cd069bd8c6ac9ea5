"""Bridges: one graph of a knowledge base and another ontology of robots, and the mappings between them.

A bridge (`ontology/bridges/`) holds axioms that were tried with a reasoner; what is merely similar is a
mapping (`ontology/mappings/`, SSSOM). The other ontology is the user's file: nothing is downloaded.
"""

import csv
from collections.abc import Iterable, Iterator, Sequence, Set
from pathlib import Path
from typing import Final

import pyoxigraph as ox

from ersatz.errors import InputError, UnknownNameError
from ersatz.knowledge import vocabulary as v
from ersatz.knowledge.stores import read_into
from ersatz.resources import ONTOLOGY

BRIDGES: Final = tuple(sorted(file.stem for file in (ONTOLOGY / "bridges").glob("*.ttl")))
"""The ontologies there is a bridge to."""

MAPPINGS: Final = ONTOLOGY / "mappings" / "ersatz.sssom.tsv"

_MATCHES: Final = "http://www.w3.org/2004/02/skos/core#"


def link(knowledge: Iterable[ox.Triple], bridge: str, ontologies: Sequence[Path] = ()) -> ox.Store:
    """Merge a knowledge base, the terms, a bridge and the files of the other ontology into one graph.

    Parameters
    ----------
    knowledge : iterable of pyoxigraph.Triple
        The knowledge base, such as `KnowledgeBase.triples()`.
    bridge : str
        One of `BRIDGES`.
    ontologies : sequence of Path
        Files of the other ontology with what it imports, RDF/XML or Turtle; without them the bridge's
        foreign terms stay undeclared.

    Returns
    -------
    pyoxigraph.Store
        One ontology with one header and no imports: it loads anywhere, offline. Axioms and mappings
        about things this knowledge base does not hold are left out.

    Raises
    ------
    UnknownNameError
        If there is no such bridge.
    InputError
        If a file is not RDF.
    """
    if bridge not in BRIDGES:
        raise UnknownNameError("bridge", bridge, BRIDGES, f"(there are {', '.join(BRIDGES)})")
    store = ox.Store()
    store.bulk_extend(ox.Quad(t.subject, t.predicate, t.object) for t in knowledge)
    held = {quad.subject for quad in store.quads_for_pattern(None, v.TYPE, None)}
    read_into(store, ONTOLOGY / "ersatz.ttl")
    _keep_held(store, _triples_of(ONTOLOGY / "bridges" / f"{bridge}.ttl"), held)
    for path in ontologies:
        _read_foreign(store, path)
    namespaces = {_namespace(term) for term in _foreign(store)}
    _keep_held(store, (t for t in mapping_triples() if _namespace(t.object) in namespaces), held)
    _one_header(store, bridge)
    return store


def mappings() -> Iterator[dict[str, str]]:
    """Yield the rows of the SSSOM file, with IRIs for CURIEs."""
    prefixes, rows = read_sssom(MAPPINGS.read_text(encoding="utf-8"))
    for row in rows:
        yield row | {key: _expand(row[key], prefixes) for key in ("subject_id", "predicate_id", "object_id")}


def mapping_triples() -> Iterator[ox.Triple]:
    """Yield the mappings as triples; axioms are left to the bridges."""
    for row in mappings():
        if row["predicate_id"].startswith(_MATCHES):
            yield ox.Triple(*(ox.NamedNode(row[key]) for key in ("subject_id", "predicate_id", "object_id")))


def mappings_as_turtle() -> str:
    """Return the mappings as an ontology of annotations: the content of `ontology/mappings/ersatz.ttl`."""
    prefixes, rows = read_sssom(MAPPINGS.read_text(encoding="utf-8"))
    kept = [row for row in rows if row["predicate_id"].startswith("skos:")]
    used = {row[key].partition(":")[0] for row in kept for key in ("subject_id", "object_id")} | {"skos"}
    lines = [f"@prefix {prefix}: <{prefixes[prefix]}> ." for prefix in sorted(used)]
    lines += [f"@prefix owl: <{v.OWL}> .", "", "# Generated from ersatz.sssom.tsv: change that file.", ""]
    lines += [f"<{v.ONTOLOGY.value}/mappings> a owl:Ontology .", ""]
    lines += [
        f"{match} a owl:AnnotationProperty ." for match in sorted({row["predicate_id"] for row in kept})
    ]
    lines.append("")
    lines += [
        f"{row['subject_id']} {row['predicate_id']} {_safe(row['object_id'], prefixes)} ." for row in kept
    ]
    return "\n".join(lines) + "\n"


def read_sssom(table: str) -> tuple[dict[str, str], list[dict[str, str]]]:
    """Return the prefixes and the rows of an SSSOM table."""
    text = table.splitlines()
    head = [line[1:] for line in text if line.startswith("#")]
    pairs = (line.strip().split(": ", 1) for line in head[head.index("curie_map:") + 1 :])
    prefixes = dict(pairs)
    return prefixes, list(csv.DictReader((line for line in text if not line.startswith("#")), delimiter="\t"))


def _expand(curie: str, prefixes: dict[str, str]) -> str:
    prefix, _, local = curie.partition(":")
    return prefixes[prefix] + local


def _safe(curie: str, prefixes: dict[str, str]) -> str:
    """Return a CURIE, or the whole IRI where Turtle has no short form for it."""
    return curie if curie.partition(":")[2].replace("_", "").isalnum() else f"<{_expand(curie, prefixes)}>"


def _triples_of(path: Path) -> Iterator[ox.Triple]:
    store = ox.Store()
    read_into(store, path)
    return (quad.triple for quad in store)


def _keep_held(store: ox.Store, triples: Iterable[ox.Triple], held: Set[object]) -> None:
    """Add triples, but not those about things of a knowledge base that this one does not hold."""
    for triple in triples:
        if not str(triple.subject).startswith(f"<{v.KB}") or triple.subject in held:
            store.add(ox.Quad(triple.subject, triple.predicate, triple.object))


def _read_foreign(store: ox.Store, path: Path) -> None:
    try:
        read_into(store, path)
    except InputError:
        # Some publish Turtle under the name .owl.
        with path.open("rb") as handle:
            try:
                store.bulk_load(handle, format=ox.RdfFormat.TURTLE, base_iri="https://example.org/")
            except SyntaxError as error:
                raise InputError(f"{path.name!r} is neither RDF/XML nor Turtle: {error}") from None


def _foreign(store: ox.Store) -> Iterator[ox.NamedNode]:
    """Yield the terms of others that the graph declares."""
    for kind in ("Class", "ObjectProperty", "DatatypeProperty", "NamedIndividual"):
        for quad in store.quads_for_pattern(None, v.TYPE, ox.NamedNode(v.OWL + kind)):
            if isinstance(quad.subject, ox.NamedNode) and not quad.subject.value.startswith((v.ERSATZ, v.KB)):
                yield quad.subject


def _namespace(term: object) -> str:
    iri = str(term).strip("<>")
    return iri[: max(iri.rfind("#"), iri.rfind("/")) + 1]


def _one_header(store: ox.Store, bridge: str) -> None:
    """Replace the headers of all parts, and their imports, by one header that names them."""
    parts = [quad.subject for quad in store.quads_for_pattern(None, v.TYPE, v.OWL_ONTOLOGY)]
    for quad in [quad for part in parts for quad in store.quads_for_pattern(part, None, None)]:
        store.remove(quad)
    header = ox.NamedNode(f"{v.KB_ONTOLOGY.value}/linked/{bridge}")
    store.add(ox.Quad(header, v.TYPE, v.OWL_ONTOLOGY))
    for part in parts:
        if isinstance(part, ox.NamedNode):
            store.add(ox.Quad(header, ox.NamedNode(v.DCTERMS + "source"), part))
    annotations = {v.DCTERMS + "source", *(row["predicate_id"] for row in mappings())}
    for name in annotations:
        if name.startswith((_MATCHES, v.DCTERMS)):
            store.add(ox.Quad(ox.NamedNode(name), v.TYPE, ox.NamedNode(v.OWL + "AnnotationProperty")))
