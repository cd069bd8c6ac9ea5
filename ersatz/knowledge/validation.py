"""What is wrong with a knowledge base, found by queries, shapes and a reasoner, and how to mend it.

Every query of `sparql/checks/` finds one kind of fault and is named after it; the OWL 2 DL and RL
profiles are among them (`owl_*`). Core SHACL looks at single nodes, HermiT at contradictions.
"""

import re
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, field
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

import pyoxigraph as ox

from ersatz.errors import InputError, MissingDependencyError
from ersatz.knowledge.contradictions import consistent, explain
from ersatz.knowledge.stores import read_into
from ersatz.resources import ONTOLOGY, SPARQL

CORE: Final = "https://w3id.org/ersatz"
"""The IRI of the ontology; that of a knowledge base is `CORE + "/kb"`."""

SHOWN: Final = 12
"""Statements of a contradiction that are shown; a minimal one has rarely more than five."""


@dataclass(frozen=True, slots=True, order=True)
class Finding:
    """One fault: what is wrong where, by which rule, and what to do about it.

    Attributes
    ----------
    rule : str
        The stem of the query in `sparql/checks/`; `shape_<name>` for a SHACL shape; `syntax`, `inconsistent`.
    entity : str
        The IRI at fault; the name of the file for `syntax`.
    message : str
        What should be, and what is.
    mend : str
        What to do.
    """

    rule: str
    entity: str
    message: str
    mend: str


@dataclass(frozen=True, slots=True)
class Report:
    """What was looked for and what was found.

    Attributes
    ----------
    findings : tuple of Finding
        Sorted by rule and entity; empty if all is well.
    ran : tuple of str
        The rules that were tried.
    skipped : tuple of str
        What could not be tried, and why: an optional package or Java is missing.
    """

    findings: tuple[Finding, ...] = ()
    ran: tuple[str, ...] = ()
    skipped: tuple[str, ...] = ()

    @property
    def ok(self) -> bool:
        """Whether nothing was found."""
        return not self.findings

    def as_dict(self) -> dict[str, Any]:
        """Return the report as `ersatz check --json` prints it."""
        findings = [asdict(finding) for finding in self.findings]
        return {
            "version": 1,
            "ok": self.ok,
            "findings": findings,
            "ran": [*self.ran],
            "skipped": [*self.skipped],
        }


@dataclass(frozen=True, slots=True)
class Check:
    """One query that must return nothing.

    Attributes
    ----------
    rule : str
        The stem of its file.
    summary, description, mend : str
        What must be, why, and what to do if it is not.
    query : str
        SPARQL 1.1 SELECT of ?entity and ?detail, over a knowledge base together with the ontology.
    """

    rule: str
    summary: str
    description: str
    mend: str
    query: str = field(repr=False)

    def run(self, store: ox.Store) -> Iterator[Finding]:
        """Yield what the query finds."""
        for row in _select(store, self.query):
            yield Finding(
                self.rule, _name(row["entity"]), f"{self.summary} Here: {_name(row['detail'])}", self.mend
            )


def check(
    knowledge: Iterable[ox.Triple | ox.Quad], reason: bool = False, rules: Iterable[str] | None = None
) -> Report:
    """Look for everything that can be wrong with a knowledge base.

    Parameters
    ----------
    knowledge : pyoxigraph.Store, or iterable of triples
        The knowledge base (`KnowledgeBase.triples()`), with or without the ontology it imports; it is not
        changed.
    reason : bool
        Also ask HermiT for contradictions; needs Java.
    rules : iterable of str, optional
        Only these queries; default all, and the shapes.

    Returns
    -------
    Report
    """
    store = with_ontology(knowledge)
    wanted = None if rules is None else set(rules)
    chosen = [each for each in checks() if wanted is None or each.rule in wanted]
    findings = {finding for each in chosen for finding in each.run(store)}
    ran = [each.rule for each in chosen]
    skipped = []
    further = [("shapes", shapes)] * (wanted is None) + [("inconsistent", contradictions)] * reason
    with ThreadPoolExecutor() as pool:  # HermiT is a process of its own: the shapes need not wait for it
        for name, found in [(name, pool.submit(_all, look, store)) for name, look in further]:
            try:
                findings.update(found.result())
                ran.append(name)
            except MissingDependencyError as error:
                skipped.append(f"{name}: {error}")
    return Report(tuple(sorted(findings)), tuple(ran), tuple(skipped))


def check_file(path: Path, reason: bool = False) -> Report:
    """Read a file and look for everything that can be wrong with it, its syntax first.

    Raises
    ------
    KnowledgeBaseError
        If there is no such file.
    """
    store = ox.Store()
    try:
        read_into(store, path)
    except InputError as error:
        return Report(
            (Finding("syntax", path.name, str(error), "Correct the file at the place named."),), ("syntax",)
        )
    found = check(store, reason)
    return Report(found.findings, ("syntax", *found.ran), found.skipped)


@cache
def checks() -> tuple[Check, ...]:
    """Return the queries of `sparql/checks/`, by name."""
    return tuple(_parse(file) for file in sorted((SPARQL / "checks").glob("*.rq")))


def _parse(file: Path) -> Check:
    text = file.read_text(encoding="utf-8")
    head = dict(re.findall(r"^#\+ (\w+): (.*)$", text, re.MULTILINE))
    return Check(file.stem, head["summary"], head["description"], head["mend"], text)


def shapes(store: ox.Store) -> Iterator[Finding]:
    """Yield the nodes that do not conform to `ontology/shapes/`.

    Raises
    ------
    MissingDependencyError
        If pyshacl is not installed.
    """
    if find_spec("pyshacl") is None:
        raise MissingDependencyError("pyshacl is not installed: pip install 'ersatz[check]'")
    import pyshacl
    import rdflib

    data = rdflib.Graph().parse(
        data=ox.serialize(_triples(store), format=ox.RdfFormat.N_TRIPLES), format="nt"
    )
    shape_graph = rdflib.Graph().parse(ONTOLOGY / "shapes" / "ersatz.shacl.ttl")
    # In place: without inference nothing is added, and a copy takes seconds.
    _, report, _ = pyshacl.validate(data, shacl_graph=shape_graph, inference="none", inplace=True)
    named = {node: shape for shape in shape_graph.subjects(rdflib.RDF.type, rdflib.SH.NodeShape)
             for node in (shape, *shape_graph.objects(shape, rdflib.SH.property))}  # fmt: skip
    for result in report.subjects(rdflib.RDF.type, rdflib.SH.ValidationResult):
        shape = named.get(report.value(result, rdflib.SH.sourceShape))
        should = str(report.value(result, rdflib.SH.resultMessage))
        value = report.value(result, rdflib.SH.value)
        entity = str(report.value(result, rdflib.SH.focusNode))
        here = "missing or too many" if value is None else str(value)
        rule = "shape_" + str(shape).rpartition("#")[2]
        yield Finding(rule, entity, f"Shape: {should}. Here: {here}", f"Change the node so that {should}.")


def contradictions(store: ox.Store) -> Iterator[Finding]:
    """Yield a finding if HermiT proves that the knowledge base contradicts itself, with what makes it so.

    Raises
    ------
    MissingDependencyError
        If Java is not installed.
    KnowledgeBaseError
        If HermiT refuses the knowledge base or takes too long.
    """
    if consistent(_triples(store)):
        return
    found = explain(_triples(store))
    shown = [*found.texts()[:SHOWN], *["…"] * (len(found.statements) > SHOWN)]
    among = "" if found.minimal else f"among {len(found.statements)} statements, narrowed down no further: "
    yield Finding(
        "inconsistent",
        found.entity,
        "The knowledge base does not contradict itself. Here HermiT proves that these cannot all be true: "
        f"{among}{' | '.join(shown)}",
        "Correct or take back one of these; the last are axioms of the ontology, so look at the first.",
    )


def with_ontology(knowledge: Iterable[ox.Triple | ox.Quad]) -> ox.Store:
    """Return a copy in memory, all in the default graph, together with the ontology itself."""
    store = ox.Store()
    store.bulk_extend(ox.Quad(t.subject, t.predicate, t.object) for t in knowledge)
    read_into(store, ONTOLOGY / "ersatz.ttl")
    return store


def _all(look: Callable[[ox.Store], Iterator[Finding]], store: ox.Store) -> list[Finding]:
    return list(look(store))


def _triples(store: ox.Store) -> Iterator[ox.Triple]:
    return (quad.triple for quad in store)


def _select(store: ox.Store, query: str) -> ox.QuerySolutions:
    rows = store.query(query)
    assert isinstance(rows, ox.QuerySolutions)
    return rows


def _name(term: Any) -> str:
    return str(term) if term is None or isinstance(term, ox.BlankNode) else str(term.value)
