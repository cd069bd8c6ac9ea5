"""Exports: what other knowledge bases of robots can load as their own.

KnowRob 2 reads degrees as confidences of reified relations; knowledge_core (ORO) reads plain facts in
its own namespace. Both are one way: nothing comes back.
"""

import json
from collections.abc import Iterable, Iterator
from typing import Any, Final

import pyoxigraph as ox

from ersatz.knowledge import vocabulary as v

KNOWROB: Final = "http://knowrob.org/kb/knowrob.owl#"
REIFIED: Final = "http://knowrob.org/kb/reified.owl#"
"""KnowRob tells reified relations by this prefix of their names."""
ORO: Final = "http://kb.openrobots.org#"

_MEMBERSHIPS: Final = f"""
SELECT ?thing ?subject ?object ?degree WHERE {{
  ?model {v.DESCRIBES_CLASS} ?subject ; {v.HAS_ENTRY} ?thing .
  ?thing {v.QUALITY} ?object ; {v.PROPORTION} ?degree .
}}"""
_DEGREES: Final = f"""
SELECT ?thing ?subject ?object ?degree WHERE {{
  ?subject {v.HAS_MEASUREMENT} ?value .
  ?value {v.HAS_ASSIGNMENT} ?thing .
  ?thing {v.QUALITY} ?object ; {v.DEGREE} ?degree .
}}"""
_ANSWERS: Final = f"""
SELECT ?thing ?subject ?object (COALESCE(?probability, ?similarity) AS ?degree) WHERE {{
  ?build a {v.KNOWLEDGE_BUILD} ; {v.REVISION} ?current .
  ?answer {v.MISSING_TOOL}/{v.DESCRIBES_CLASS} ?object ; {v.HAS_CANDIDATE} ?thing ; {v.REVISION} ?current .
  ?thing {v.CANDIDATE} ?who ; {v.SIMILARITY} ?similarity ; {v.ACCEPTED} true .
  OPTIONAL {{ ?thing {v.ACCEPTANCE_PROBABILITY} ?probability }}
  OPTIONAL {{ ?who {v.DESCRIBES_CLASS} ?class }}
  BIND(COALESCE(?class, ?who) AS ?subject)
}}"""
_REIFIED: Final = {"holds": (_MEMBERSHIPS, _DEGREES), "substitutes": (_ANSWERS,)}

_FACTS: Final = (
    (v.RDFS + "subClassOf", f"?s rdfs:subClassOf {v.OBJECT} . BIND(oro:Artifact AS ?o)"),
    (v.RDF + "type", f"?o rdfs:subClassOf {v.OBJECT} . ?s a ?o"),
    (v.RDF + "type", f"?s {v.QUALITY_OF} ?property . BIND(oro:Quality AS ?o)"),
    (v.RDFS + "label", f"?s rdfs:subClassOf {v.OBJECT} ; rdfs:label ?o"),
    (v.RDFS + "label", f"?s {v.QUALITY_OF}|{v.HOLDS} ?any ; rdfs:label ?o"),
    (ORO + "hasQuality", f"?s {v.HOLDS} ?o"),
    (ORO + "isTypically", f"?model {v.DESCRIBES_CLASS} ?s ; {v.REPRESENTATIVE_QUALITY} ?o"),
)
"""What ORO is told: the predicate, and where its subjects ?s and objects ?o come from."""


def knowrob(knowledge: Iterable[ox.Triple]) -> Iterator[ox.Triple]:
    """Yield a knowledge base as KnowRob 2 keeps uncertain knowledge; write it as RDF/XML.

    Every membership of a class model becomes a reified `ersatz:holds` of the class with its proportion
    as confidence, and occasional, because some objects of the class do not hold the quality. Every
    accepted substitute of an answer that is up to date becomes a reified `ersatz:substitutes` of the missing
    tool's class; its confidence
    is the probability that it stands in or, where that was not asked, its similarity. With fuzzy grounding
    every degree of an object's value becomes a reified `ersatz:holds` of the object with the degree as
    confidence. Classes, objects and what they hold are kept as they are.

    Parameters
    ----------
    knowledge : iterable of pyoxigraph.Triple
        The knowledge base, such as `KnowledgeBase.triples()`.
    """
    store = _store(knowledge)
    for relation, queries in _REIFIED.items():
        kind = ox.NamedNode(f"{v.ERSATZ}Reified_{relation}")
        yield ox.Triple(kind, v.TYPE, v.OWL_CLASS)
        yield ox.Triple(kind, v.SUBCLASS_OF, ox.NamedNode(KNOWROB + "ReifiedRelation"))
        yield ox.Triple(ox.NamedNode(v.ERSATZ + relation), v.TYPE, ox.NamedNode(v.OWL + "ObjectProperty"))
        for query in queries:
            for row in _rows(store, query):
                yield from _reified(row, kind, occasional=query is _MEMBERSHIPS)
    yield from _plain(store)


def knowrob_settings(file: str) -> str:
    """Return what to put into KnowRob's settings (JSON) so that it loads an export.

    Parameters
    ----------
    file : str
        Path of the exported file as KnowRob will see it.
    """
    settings = {
        "semantic-web": {
            "prefixes": [{"alias": "ersatz", "uri": v.ERSATZ[:-1]}, {"alias": "ersatz_kb", "uri": v.KB[:-1]}]
        },
        "data-sources": [{"path": file, "language": "owl", "format": "xml"}],
    }
    return json.dumps(settings, indent=2) + "\n"


def oro(knowledge: Iterable[ox.Triple]) -> Iterator[ox.Triple]:
    """Yield a knowledge base as facts in the namespace of ORO, for knowledge_core.

    Names stay (`oro:Bowl`, `oro:bowl_01`, `oro:rigidity_4`). What an object holds becomes
    `oro:hasQuality`, because `oro:holds` means a hand; a class's representative quality is said of the
    class by `oro:isTypically`; an accepted substitute of an answer that is up to date is a plain
    `oro:canSubstituteFor`.

    Parameters
    ----------
    knowledge : iterable of pyoxigraph.Triple
        The knowledge base, such as `KnowledgeBase.triples()`.
    """
    store = _store(knowledge)
    for fact, where in _FACTS:
        found = {(row["s"], row["o"]) for row in _rows(store, f"SELECT DISTINCT ?s ?o WHERE {{ {where} }}")}
        for one, other in sorted(found, key=str):
            yield ox.Triple(_oro(one), ox.NamedNode(fact), _oro(other))
    for row in _rows(store, _ANSWERS):
        yield ox.Triple(_oro(row["subject"]), ox.NamedNode(ORO + "canSubstituteFor"), _oro(row["object"]))


def _reified(row: Any, kind: ox.NamedNode, occasional: bool) -> Iterator[ox.Triple]:
    name = ox.NamedNode(REIFIED + row["thing"].value.rpartition("#")[2])
    yield ox.Triple(name, v.TYPE, kind)
    yield ox.Triple(name, ox.NamedNode(KNOWROB + "hasSubject"), row["subject"])
    yield ox.Triple(name, ox.NamedNode(KNOWROB + "hasObject"), row["object"])
    # KnowRob keeps confidences as binary floating point numbers.
    degree = ox.Literal(row["degree"].value, datatype=ox.NamedNode(v.XSD + "double"))
    yield ox.Triple(name, ox.NamedNode(KNOWROB + "hasConfidence"), degree)
    yield ox.Triple(name, ox.NamedNode(KNOWROB + "isUncertain"), ox.Literal(True))
    if occasional:
        yield ox.Triple(name, ox.NamedNode(KNOWROB + "isOccasional"), ox.Literal(True))


def _plain(store: ox.Store) -> Iterator[ox.Triple]:
    """Yield classes, objects and qualities with their labels and what they hold."""
    query = f"""SELECT ?s ?p ?o WHERE {{
      {{ ?s rdfs:subClassOf {v.OBJECT} }} UNION {{ ?s {v.HOLDS} ?any }} UNION {{ ?s {v.QUALITY_OF} ?any }}
      ?s ?p ?o .
      FILTER(?p IN (rdf:type, rdfs:subClassOf, rdfs:label, {v.HOLDS}, {v.QUALITY_OF}, {v.RANK}))
    }}"""
    for s, p, o in sorted({(row["s"], row["p"], row["o"]) for row in _rows(store, query)}, key=str):
        yield ox.Triple(s, p, o)


def _oro(term: Any) -> Any:
    if isinstance(term, ox.NamedNode) and term.value.startswith(v.KB):
        return ox.NamedNode(ORO + term.value[len(v.KB) :])
    return term


def _rows(store: ox.Store, query: str) -> Iterable[Any]:
    prefixes = f"PREFIX rdf: <{v.RDF}> PREFIX rdfs: <{v.RDFS}> PREFIX oro: <{ORO}> "
    rows = store.query(prefixes + query)
    assert isinstance(rows, ox.QuerySolutions)
    return rows


def _store(knowledge: Iterable[ox.Triple]) -> ox.Store:
    store = ox.Store()
    store.bulk_extend(ox.Quad(t.subject, t.predicate, t.object) for t in knowledge)
    return store
