"""Remembered answers: substitution models to triples and back."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from decimal import Decimal
from hashlib import sha256
from typing import TYPE_CHECKING, Any

from ersatz.knowledge import vocabulary as v
from ersatz.knowledge.models import Candidate, Chances, Drawing, SubstitutionModel
from ersatz.knowledge.names import local_name, snake_iri, snake_name
from ersatz.knowledge.queries import exact
from ersatz.knowledge.terms import decimal, finite, individual, integer, iri, lines_of, text

if TYPE_CHECKING:
    from ersatz.knowledge.base import KnowledgeBase


def substitution_iri(tool: str, settings: str, revision: str) -> str:
    """Return the IRI of the answer for a tool's IRI under these settings and this state of knowledge."""
    # The tool as well: "mug" and "MUG" are two classes of one snake_case name.
    key = sha256(f"{tool}\n{settings}\n{revision}".encode()).hexdigest()[:16]
    return f"{v.KB}substitution_{snake_name(local_name(tool))}_{key}"


def substitution_lines(model: SubstitutionModel) -> Iterator[str]:
    """Yield a substitution model as lines of N-Triples."""
    subject = iri(model.iri)
    tool = local_name(model.missing)
    yield from individual(subject, v.SUBSTITUTION_MODEL, f"what stands in for {tool}")
    for predicate, value in (
        (v.MISSING_TOOL, _model_of(model.missing)),
        (v.THETA, decimal(finite(model.theta))),
        (v.RELEVANCE_PHI, decimal(finite(model.relevance_phi))),
        (v.PHI, decimal(finite(model.phi))),
        (v.SETTINGS, text(model.settings)),
        (v.REVISION, text(model.revision)),
        (v.WAS_GENERATED_BY, v.BUILD),
    ):
        yield f"{subject} {predicate} {value} .\n"
    if model.drawing:
        yield f"{subject} {v.DRAWS} {integer(model.drawing.draws)} .\n"
        yield f"{subject} {v.CREDIBLE_LEVEL} {decimal(model.drawing.level)} .\n"
        yield f"{subject} {v.PRIOR_COUNT} {decimal(model.drawing.prior)} .\n"
        if model.drawing.seed is not None:
            yield f"{subject} {v.SEED} {integer(model.drawing.seed)} .\n"
    for predicate, names in (
        (v.RELEVANT_PHYSICAL_QUALITY, model.relevant_physical),
        (v.RELEVANT_FUNCTIONAL_QUALITY, model.relevant_functional),
    ):
        for name in names:
            yield f"{subject} {predicate} {iri(snake_iri(name))} .\n"
    for name, weight in model.weights:
        quality = snake_iri(name)
        node = iri(f"{model.iri}-{local_name(quality)}")
        yield f"{subject} {v.HAS_RELEVANCE} {node} .\n"
        yield from individual(node, v.RELEVANCE, f"{name} for {tool}: {weight}")
        yield f"{node} {v.RELEVANT_QUALITY} {iri(quality)} .\n"
        yield f"{node} {v.RELEVANCE_WEIGHT} {decimal(weight)} .\n"
    for candidate in model.candidates:
        yield from _candidate_lines(subject, model.iri, tool, candidate)


def load_substitution(kb: "KnowledgeBase", model_iri: str) -> SubstitutionModel:
    """Return a remembered substitution model."""
    row = kb.ask("substitution_model", model=model_iri)[0]
    relevance = kb.ask("substitution_relevance", model=model_iri)
    parts: dict[str, dict[str, list[str]]] = {}
    decisions: dict[str, tuple[Decimal, bool]] = {}
    classes = {
        str(found["class"])
        for found in kb.query(
            f"SELECT ?class WHERE {{ {iri(model_iri)} "
            f"{v.HAS_CANDIDATE}/{v.CANDIDATE}/{v.DESCRIBES_CLASS} ?class }}"
        )
    }
    for found in kb.ask("substitution_candidates", model=model_iri):
        key = str(found["candidate"])
        decisions[key] = Decimal(str(found["similarity"])), found["accepted"] in (True, 1)
        sets = parts.setdefault(key, {"shared": [], "lacking": [], "extra": []})
        if found["quality"]:
            sets[str(found["part"])].append(local_name(str(found["quality"])))
    chances, drawing = _chances(kb, model_iri)
    return SubstitutionModel(
        model_iri,
        str(row["tool"]),
        str(row["settings"]),
        exact(_decimal(row["theta"])),
        exact(_decimal(row["relevancePhi"])),
        exact(_decimal(row["phi"])),
        str(row["revision"]),
        tuple(local_name(str(one["quality"])) for one in relevance if one["kind"] == "physical"),
        tuple(local_name(str(one["quality"])) for one in relevance if one["kind"] == "functional"),
        tuple(
            _candidate(key, key in classes, *decisions[key], parts[key], chances.get(key))
            for key in sorted(decisions)
        ),
        drawing,
        _weights(relevance),
    )


def _weights(relevance: Iterable[Mapping[str, object]]) -> tuple[tuple[str, Decimal], ...]:
    weighed = ((local_name(str(one["quality"])), one["weight"]) for one in relevance)
    return tuple(sorted((name, _decimal(weight)) for name, weight in weighed if weight is not None))


def _candidate(
    name: str,
    is_class: bool,
    similarity: Decimal,
    accepted: bool,
    parts: Mapping[str, list[str]],
    chances: Chances | None,
) -> Candidate:
    shared, lacking, extra = (tuple(sorted(parts[part])) for part in ("shared", "lacking", "extra"))
    return Candidate(name, is_class, similarity, accepted, shared, lacking, extra, chances)


def _chances(kb: "KnowledgeBase", model_iri: str) -> tuple[dict[str, Chances], Drawing | None]:
    rows = kb.ask("substitution_confidence", model=model_iri)
    chances = {
        str(row["candidate"]): Chances(*(_decimal(row[name]) for name in ("accepted", "best", "low", "high")))
        for row in rows
    }
    return chances, _drawing(rows[0]) if rows else None


def _drawing(row: Mapping[str, object]) -> Drawing:
    seed = None if row["seed"] is None else int(str(row["seed"]))
    return Drawing(int(str(row["draws"])), _decimal(row["level"]), _decimal(row["prior"]), seed)


def remember(kb: "KnowledgeBase", model: SubstitutionModel) -> None:
    """Write an answer into the knowledge base, joined with what is remembered under the same IRI.

    How sure an answer is holds for its own candidates together: others lose theirs.
    """
    old: list[str] = []
    candidates = {candidate.iri: candidate for candidate in model.candidates}
    if model.iri in kb.view(remembered):
        before = load_substitution(kb, model.iri)
        old = list(substitution_lines(before))
        others = (replace(candidate, chances=None) for candidate in before.candidates)
        candidates = {candidate.iri: candidate for candidate in others} | candidates
    joined = tuple(candidates[key] for key in sorted(candidates))
    kb.tell(old, substitution_lines(replace(model, candidates=joined)))


def remembered(kb: "KnowledgeBase") -> dict[str, str]:
    """Return the IRIs of the remembered answers that are up to date, each with its tool's IRI."""
    rows = kb.ask("substitution_models")
    return {str(row["model"]): str(row["tool"]) for row in rows if row["revision"] == row["current"]}


def all_substitution_lines(kb: "KnowledgeBase") -> Iterator[str]:
    """Yield every triple of every substitution model, up to date or not."""
    model = f"?model a {v.SUBSTITUTION_MODEL}"
    results: Any = kb.construct(
        f"CONSTRUCT {{ ?s ?p ?o }} WHERE {{ {{ {model} ; ?p ?o . BIND (?model AS ?s) }} "
        f"UNION {{ {model} ; {v.HAS_CANDIDATE}|{v.HAS_RELEVANCE} ?s . ?s ?p ?o }} }}"
    )
    return lines_of(results)


def _candidate_lines(subject: str, model_iri: str, tool: str, candidate: Candidate) -> Iterator[str]:
    name = local_name(candidate.iri)
    node = iri(f"{model_iri}__{name}")
    thing = _model_of(candidate.iri) if candidate.is_class else iri(candidate.iri)
    yield f"{subject} {v.HAS_CANDIDATE} {node} .\n"
    yield f"{subject} {v.SUBSTITUTE if candidate.accepted else v.NON_SUBSTITUTE} {thing} .\n"
    yield from individual(node, v.CANDIDATE_CLASS, f"{name} for {tool}: {candidate.similarity}")
    yield f"{node} {v.CANDIDATE} {thing} .\n"
    yield f"{node} {v.SIMILARITY} {decimal(candidate.similarity)} .\n"
    yield f'{node} {v.ACCEPTED} "{str(candidate.accepted).lower()}"^^<{v.XSD}boolean> .\n'
    if sure := candidate.chances:
        yield f"{node} {v.ACCEPTANCE_PROBABILITY} {decimal(sure.accepted)} .\n"
        yield f"{node} {v.BEST_PROBABILITY} {decimal(sure.best)} .\n"
        yield f"{node} {v.SIMILARITY_LOW} {decimal(sure.low)} .\n"
        yield f"{node} {v.SIMILARITY_HIGH} {decimal(sure.high)} .\n"
    for predicate, names in (
        (v.SHARED, candidate.shared),
        (v.LACKING, candidate.lacking),
        (v.EXTRA, candidate.extra),
    ):
        for one in names:
            yield f"{node} {predicate} {iri(snake_iri(one))} .\n"


def _model_of(concept: str) -> str:
    """Return the individual that stands for a class, which is none itself: its model."""
    return iri(f"{v.KB}model_{local_name(concept)}")


def _decimal(value: object) -> Decimal:
    assert isinstance(value, Decimal | int), value
    return Decimal(value)
