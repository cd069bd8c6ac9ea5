"""Contradictions: whether HermiT proves one, and which few statements make it.

HermiT only says yes or no. The statements are found by asking again about ever smaller parts: the shortest
prefix that contradicts itself ends with a statement no contradiction in it can do without (de Siqueira and
Puget 1988; "insertion-based" extraction of a minimal unsatisfiable set).
"""

import os
import re
import shutil
import subprocess
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Final

import pyoxigraph as ox

from ersatz.errors import KnowledgeBaseError, MissingDependencyError
from ersatz.knowledge import vocabulary as v

HERMIT_SECONDS: Final = 600
"""How long HermiT may think before it is stopped."""

EXPLAIN_SECONDS: Final = 300
"""How long a contradiction is narrowed down; what is left then is shown as it is."""

_PARTS: Final = 16
"""Prefixes asked about in one start of Java, which costs as much as a small question."""

_ONTOLOGY_TERMS: Final = (v.OWL, v.RDFS)
_KINDS: Final = "Class ObjectProperty DatatypeProperty AnnotationProperty NamedIndividual Ontology"
_DECLARATIONS: Final = {ox.NamedNode(v.OWL + kind) for kind in _KINDS.split()}
_ANNOTATIONS: Final = {ox.NamedNode(v.RDFS + name) for name in ("label", "comment", "seeAlso", "isDefinedBy")}
_ANNOTATION_PROPERTY: Final = ox.NamedNode(v.OWL + "AnnotationProperty")
_IMPORTS: Final = ox.NamedNode(v.OWL + "imports")

Statement = tuple[ox.Triple, ...]
"""One axiom or fact: a triple with what hangs on it by blank nodes."""


@dataclass(frozen=True, slots=True)
class Contradiction:
    """Statements that cannot all be true.

    Attributes
    ----------
    statements : tuple of Statement
        Facts first, then axioms of the ontology.
    minimal : bool
        Whether it ceases to be a contradiction without any one of them; otherwise time was up.
    """

    statements: tuple[Statement, ...]
    minimal: bool

    @property
    def entity(self) -> str:
        """The IRI said most about: where to look first."""
        facts = [triple for statement in self.statements for triple in statement[:1]]
        named = Counter(t.subject.value for t in facts if isinstance(t.subject, ox.NamedNode))
        return max(
            named, key=lambda iri: (named[iri], iri.startswith(v.KB), iri), default=v.KB_ONTOLOGY.value
        )

    def texts(self) -> tuple[str, ...]:
        """Return the statements with short names, each in one line."""
        return tuple(_text(statement[0], statement[1:]) for statement in self.statements)


def consistent(triples: Iterable[ox.Triple]) -> bool:
    """Tell whether HermiT finds no contradiction in a graph; what it imports is not fetched.

    Raises
    ------
    MissingDependencyError
        If Java is not installed.
    KnowledgeBaseError
        If HermiT refuses the graph or takes longer than `HERMIT_SECONDS`.
    """
    return _first_contradiction([[triple for triple in triples if triple.predicate != _IMPORTS]]) is None


def explain(triples: Iterable[ox.Triple], seconds: float = EXPLAIN_SECONDS) -> Contradiction:
    """Narrow a graph that contradicts itself down to the statements that do.

    Parameters
    ----------
    triples : iterable of pyoxigraph.Triple
        A graph that is not `consistent`.
    seconds : float
        When to stop narrowing down.
    """
    end = time.monotonic() + seconds
    background, axioms, facts = _parts(list(triples))
    found, done = _narrow(background + _flat(axioms), facts, end)
    used, also_done = _narrow(background + _flat(found), axioms, end) if done else (axioms, False)
    # What is left out here (imports, annotations) might have had a part in it after all.
    sure = done and also_done and not consistent(background + _flat(found) + _flat(used))
    return Contradiction((*found, *used), sure)


def _narrow(
    background: list[ox.Triple], statements: Sequence[Statement], end: float
) -> tuple[list[Statement], bool]:
    """Return those statements a contradiction with the background needs, and whether time sufficed."""
    needed: list[Statement] = []
    rest = list(statements)
    while time.monotonic() < end:
        length = _shortest_prefix(background + _flat(needed), rest, end)
        if length is None:
            break
        if length == 0:
            return needed, True
        needed.append(rest[length - 1])
        rest = rest[: length - 1]
    return needed + rest, False


def _shortest_prefix(fixed: list[ox.Triple], rest: Sequence[Statement], end: float) -> int | None:
    """Return how many statements, in their order, make the contradiction; all of them do."""
    low, high = 0, len(rest)
    while low < high:
        if time.monotonic() > end:
            return None
        lengths = list(range(low, high, max(1, (high - low) // _PARTS)))
        graphs = [fixed + _flat(rest[:length]) for length in lengths]
        first = _first_contradiction(graphs)
        if first is None:
            low = lengths[-1] + 1
        elif first == 0:
            return low
        else:
            low, high = lengths[first - 1] + 1, lengths[first]
    return high


def _parts(triples: list[ox.Triple]) -> tuple[list[ox.Triple], list[Statement], list[Statement]]:
    """Return declarations, the axioms of the ontology, and facts; annotations say nothing to a reasoner."""
    silent = {t.subject for t in triples if t.predicate == v.TYPE and t.object == _ANNOTATION_PROPERTY}
    silent |= _ANNOTATIONS | {_IMPORTS}
    headers = {t.subject for t in triples if t.predicate == v.TYPE and t.object == v.OWL_ONTOLOGY}
    background, axioms, facts = [], [], []
    spoken = [t for t in triples if t.predicate not in silent and t.subject not in headers]
    for statement in _statements(spoken):
        first = statement[0]
        if first.predicate == v.TYPE and first.object in _DECLARATIONS and len(statement) == 1:
            background.append(first)
        elif isinstance(first.subject, ox.BlankNode) or _is_axiom(first):
            axioms.append(statement)
        else:
            facts.append(statement)
    return background, axioms, facts


def _is_axiom(triple: ox.Triple) -> bool:
    told = triple.object if triple.predicate == v.TYPE else triple.predicate
    return isinstance(told, ox.NamedNode) and told.value.startswith(_ONTOLOGY_TERMS)


def _statements(triples: list[ox.Triple]) -> Iterator[Statement]:
    """Yield the triples of each axiom, types first: the shortest prefix then holds the plainest reasons."""
    of_blank: dict[object, list[ox.Triple]] = defaultdict(list)
    for triple in triples:
        if isinstance(triple.subject, ox.BlankNode):
            of_blank[triple.subject].append(triple)
    hanging = {triple.object for triple in triples if isinstance(triple.object, ox.BlankNode)}

    def closure(start: list[ox.Triple]) -> Statement:
        taken = list(start)
        for triple in taken:  # it grows while it is read
            taken += [t for t in of_blank.get(triple.object, ()) if t not in taken]
        return tuple(taken)

    for triple in sorted(triples, key=lambda triple: (triple.predicate != v.TYPE, str(triple))):
        if not isinstance(triple.subject, ox.BlankNode):
            yield closure([triple])
    for root in sorted(of_blank.keys() - hanging, key=str):
        yield closure(sorted(of_blank[root], key=str))


def _flat(statements: Iterable[Statement]) -> list[ox.Triple]:
    return [triple for statement in statements for triple in statement]


def _text(triple: ox.Triple, hanging: Statement) -> str:
    told = _name(triple.object)
    if isinstance(triple.object, ox.BlankNode):
        below = [each for each in hanging if each.subject == triple.object]
        told = f"({'; '.join(_text(each, hanging).partition(' ')[2] for each in below)})"
    relation = "a" if triple.predicate == v.TYPE else _name(triple.predicate)
    return f"{_name(triple.subject)} {relation} {told}"


def _name(term: object) -> str:
    if isinstance(term, ox.Literal):
        return term.value
    if isinstance(term, ox.NamedNode):
        for prefix, space in v.PREFIXES.items():
            if term.value.startswith(space) and "/" not in term.value[len(space) :]:
                return f"{prefix}:{term.value[len(space) :]}"
    return "these" if isinstance(term, ox.BlankNode) else str(term)


def _first_contradiction(graphs: Sequence[Sequence[ox.Triple]]) -> int | None:
    """Return the place of the first graph that contradicts itself."""
    with tempfile.TemporaryDirectory() as folder:
        files = [Path(folder) / f"{place}.nt" for place in range(len(graphs))]
        for graph, file in zip(graphs, files, strict=True):
            ox.serialize(graph, str(file), format=ox.RdfFormat.N_TRIPLES)
        said = _hermit(files)
    # It says of one file after the other that owl:Thing is satisfiable, and stops where it is not.
    place = len(re.findall(r"is satisfiable", said))
    if place == len(graphs):
        return None
    if not re.search(r"not satisfiable|nconsistent", said):
        raise KnowledgeBaseError(f"HermiT refuses the knowledge base: {said.strip().splitlines()[-1:]}")
    return place


def _hermit(files: Sequence[Path]) -> str:
    java = shutil.which("java")
    if java is None:
        raise MissingDependencyError("no Java found: install a JRE, such as Debian's default-jre-headless")
    spec = find_spec("owlready2")
    assert spec is not None
    assert spec.origin is not None
    home = Path(spec.origin).parent / "hermit"
    # Compiling little and collecting garbage in one thread halves the processor time of these short runs.
    command = [java, "-Xmx2000M", "-XX:TieredStopAtLevel=1", "-XX:+UseSerialGC", "-cp"]
    command += [os.pathsep.join((str(home), str(home / "HermiT.jar")))]
    command += ["org.semanticweb.HermiT.cli.CommandLine", "--ignoreUnsupportedDatatypes", "-k"]
    command += [file.as_uri() for file in files]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=HERMIT_SECONDS, check=False)
    except subprocess.TimeoutExpired:
        raise KnowledgeBaseError(f"HermiT was stopped after {HERMIT_SECONDS} s without an answer") from None
    return done.stdout + done.stderr
