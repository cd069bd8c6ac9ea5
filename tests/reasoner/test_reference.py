"""The reasoner against the reference, on real and on random knowledge; and the same in SPARQL."""

import os
from collections.abc import Mapping
from decimal import Decimal
from fractions import Fraction
from functools import cache
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ersatz.errors import InputError
from ersatz.grounding.subcategorization import SubcategorizationSettings
from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.queries import stored_query
from ersatz.pipeline import Settings, build
from ersatz.reasoner.relevance import Combine, ReasonerSettings
from ersatz.reasoner.similarity import Similarity
from ersatz.reasoner.substitution import Ranking, rank_substitutes
from tests.making import Held
from tests.reasoner.reference import Options, Qualities, World, jaccard, reason, typical
from tests.reasoner.worlds import (
    THRESHOLDS,
    graded_options,
    held_by,
    helds,
    make,
    options,
    world_of_held,
    world_of_kb,
)

EXPERT = Path(__file__).resolve().parents[2] / "ersatz" / "data" / "expert.toml"
EXAMPLES = int(os.environ.get("ERSATZ_EXAMPLES", "400"))
"""Random knowledge bases to try; 1,500 take minutes."""

QUICK = Settings(SubcategorizationSettings(restarts=3))


def settings_of(chosen: Options) -> ReasonerSettings:
    return ReasonerSettings(
        chosen.theta,
        chosen.phi,
        chosen.relevance_phi,
        Combine(chosen.combine),
        Similarity(chosen.similarity),
        chosen.above_lowest,
        chosen.fallback,
        None if chosen.properties is None else tuple(chosen.properties),
        chosen.graded,
        chosen.alpha,
        chosen.beta,
    )


def check(
    kb: KnowledgeBase, world: World, tool: str, held: Mapping[str, Qualities], chosen: Options
) -> Ranking:
    """Assert that the product and the reference say the same of every candidate."""
    others = [name for name in world.classes if name != tool]
    expected = reason(world, tool, world.classes, held, chosen)
    found = rank_substitutes(kb, tool, others, instances=list(held), settings=settings_of(chosen))
    assert (str(found.status) == "ok") == expected.determined
    assert set(found.relevant_functional) == expected.functional
    assert set(found.relevant_physical) == expected.physical
    assert {one.name: one.fraction for one in found} == expected.similarity
    assert {one.name: one.accepted for one in found} == expected.accepted
    assert [one.name for one in found] == sorted(
        expected.similarity, key=lambda name: (-expected.similarity[name], name)
    )
    assert all(one.similarity == float(one.fraction) for one in found)
    assert len(found) == len(others) + len(held)
    return found


@settings(max_examples=EXAMPLES, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(helds(), st.lists(options(), min_size=3, max_size=3))
def test_random_knowledge(held: Held, chosen: list[Options]) -> None:
    kb, world, holding = make(held), world_of_held(held), held_by(held)
    written = world_of_kb(kb)
    assert (written.classes, written.functions) == (world.classes, world.functions)
    few = dict(list(holding.items())[:2])
    for one in chosen:
        for tool in world.classes:
            check(kb, world, tool, few, one)


@settings(max_examples=EXAMPLES // 4, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(helds(), st.lists(graded_options(), min_size=2, max_size=2))
def test_random_knowledge_by_degrees(held: Held, chosen: list[Options]) -> None:
    kb, world, holding = make(held), world_of_held(held), held_by(held)
    few = dict(list(holding.items())[:2])
    for one in chosen:
        for tool in world.classes:
            check(kb, world, tool, few, one)


@cache
def expert_kb() -> KnowledgeBase:
    return build(expert=EXPERT, settings=QUICK)


@cache
def rocs_kb(folder: Path) -> KnowledgeBase:
    return build(rocs=folder, settings=QUICK)


SWEEP = [
    Options(),
    *(Options(theta=Fraction(1, d), phi=Fraction(1, d)) for d in (2, 3, 4, 5, 10)),
    *(Options(relevance_phi=Fraction(n, 4)) for n in range(5)),
    *(Options(combine="intersection", similarity=form) for form in ("jaccard", "coverage", "tversky")),
    *(Options(above_lowest=True, fallback=flag) for flag in (True, False)),
    Options(properties=frozenset({"weight", "rigidity", "containment"})),
]


@pytest.mark.parametrize("chosen", SWEEP, ids=range(len(SWEEP)))
def test_the_expert_s_knowledge(chosen: Options) -> None:
    kb = expert_kb()
    world = world_of_kb(kb)
    assert len(world.classes) == 23
    instances = [str(row["name"]) for row in kb.ask("all_instances")][:5]
    held = {name: instance_holds(kb, name) for name in instances}
    for tool in world.classes:
        check(kb, world, tool, held, chosen)


GRADED_SWEEP = [
    *(
        Options(phi=phi, relevance_phi=Fraction(0), similarity=form, graded=True)
        for form, phi in (
            ("ruzicka", Fraction(7, 20)),
            ("ordinal", Fraction(2, 3)),
            ("coverage", Fraction(7, 20)),
            ("tversky", Fraction(7, 20)),
        )
    ),
    Options(relevance_phi=Fraction(1, 5), similarity="ordinal", above_lowest=True, graded=True),
]


@pytest.mark.parametrize("chosen", GRADED_SWEEP, ids=range(len(GRADED_SWEEP)))
def test_the_shipped_knowledge_by_degrees(chosen: Options) -> None:
    kb = household()
    world = world_of_kb(kb)
    instances = [str(row["name"]) for row in kb.ask("all_instances")][:5]
    held = {name: instance_holds(kb, name) for name in instances}
    for tool in world.classes:
        check(kb, world, tool, held, chosen)


@pytest.mark.parametrize("chosen", GRADED_SWEEP, ids=range(len(GRADED_SWEEP)))
def test_rocs_by_degrees(shared_data: Path, chosen: Options) -> None:
    kb = rocs_kb(shared_data / "rocs")
    world = world_of_kb(kb)
    for tool in world.classes:
        check(kb, world, tool, {}, chosen)


@cache
def household() -> KnowledgeBase:
    return KnowledgeBase.open("household")


def instance_holds(kb: KnowledgeBase, name: str) -> Qualities:
    rows = kb.query(
        "PREFIX e: <https://w3id.org/ersatz#> SELECT ?q WHERE { "
        f"<{kb.resolve(name, 'instance')}> e:holds ?q }}"
    )
    return frozenset(str(row["q"]).rpartition("#")[2] for row in rows)


@pytest.mark.parametrize("chosen", SWEEP, ids=range(len(SWEEP)))
def test_rocs(shared_data: Path, chosen: Options) -> None:
    kb = rocs_kb(shared_data / "rocs")
    world = world_of_kb(kb)
    assert len(world.classes) == 11
    for tool in world.classes:
        check(kb, world, tool, {}, chosen)


def local(iri: object) -> str:
    return str(iri).rpartition("#")[2]


def rows_of(kb: KnowledgeBase, engine: str, query: str, **arguments: object) -> list[dict[str, object]]:
    """Ask Oxigraph or rdflib's own SPARQL engine."""
    if engine == "oxigraph":
        return [dict(row) for row in kb.ask(query, **arguments)]  # type: ignore[arg-type]
    import rdflib

    text = stored_query(query).bind(kb.resolve, arguments)  # type: ignore[arg-type]
    graph = rdflib.Graph()
    for triple in kb.graph:
        graph.add(triple)
    found = graph.query(text)
    assert found.vars is not None
    return [{str(v): row[v].toPython() for v in found.vars} for row in found]  # type: ignore[union-attr, index, call-overload]


def check_sparql(kb: KnowledgeBase, world: World, engine: str, chosen: Options) -> None:
    theta, phi = chosen.theta, chosen.relevance_phi
    name = {str(row["class"]): str(row["name"]) for row in kb.ask("classes")}
    for tool in world.classes:
        expected = reason(world, tool, world.classes, {}, chosen)
        for kind in ("physical", "functional"):
            rows = rows_of(kb, engine, "representative_qualities", concept=tool, kind=kind, threshold=theta)
            found = {local(r["quality"]): Fraction(str(r["count"])) / Fraction(str(r["total"])) for r in rows}
            wanted = typical(world.classes[tool], theta)
            wanted = wanted & world.physical if kind == "physical" else wanted - world.physical
            assert found == {q: world.classes[tool][q] for q in wanted}
        rows = rows_of(kb, engine, "relevant_functions", tool=tool, threshold=theta, tolerance=phi)
        body = typical(world.classes[tool], theta) & world.physical
        assert {local(r["function"]): exact(r) for r in rows} == {
            f: jaccard(body, typical(world.functions[f], theta)) for f in expected.functional
        }
        rows = rows_of(kb, engine, "relevant_qualities", tool=tool, threshold=theta, tolerance=phi)
        assert {(local(r["quality"]), local(r["function"])) for r in rows} == {
            (q, f) for f in expected.functional for q in body & typical(world.functions[f], theta)
        }
        if not expected.physical:
            continue
        relevant = sorted(expected.physical)
        rows = rows_of(kb, engine, "jaccard", qualities=relevant, threshold=theta)
        assert len(rows) == len({r["class"] for r in rows})
        assert {name[str(r["class"])]: exact(r) for r in rows if name[str(r["class"])] != tool} == {
            c: score for c, score in expected.similarity.items() if score
        }


def exact(row: Mapping[str, object]) -> Fraction:
    """Return the quotient, and check the engine's own rounding of it."""
    found = Fraction(int(str(row["both"])), int(str(row["either"])))
    assert abs(Fraction(Decimal(str(row["jaccard"]))) - found) < Fraction(1, 10**12)
    return found


DECIMAL_THRESHOLDS = THRESHOLDS.filter(lambda t: t and 10**6 % t.denominator == 0)


@settings(max_examples=120, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(helds(), DECIMAL_THRESHOLDS, DECIMAL_THRESHOLDS)
def test_sparql_on_oxigraph(held: Held, theta: Fraction, phi: Fraction) -> None:
    check_sparql(make(held), world_of_held(held), "oxigraph", Options(theta=theta, relevance_phi=phi))


@settings(max_examples=6, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(helds(), DECIMAL_THRESHOLDS, DECIMAL_THRESHOLDS)
def test_sparql_on_rdflib(held: Held, theta: Fraction, phi: Fraction) -> None:
    check_sparql(make(held), world_of_held(held), "rdflib", Options(theta=theta, relevance_phi=phi))


def test_sparql_on_the_expert_s_knowledge() -> None:
    check_sparql(expert_kb(), world_of_kb(expert_kb()), "oxigraph", Options())


def test_sparql_on_rocs(shared_data: Path) -> None:
    kb = rocs_kb(shared_data / "rocs")
    for theta in (Fraction(35, 100), Fraction(1, 2), Fraction(1, 10)):
        check_sparql(kb, world_of_kb(kb), "oxigraph", Options(theta=theta))


def test_a_threshold_without_finite_decimals_is_no_question_for_sparql() -> None:
    with pytest.raises(InputError, match="1/3 has no finite decimal notation"):
        expert_kb().ask("relevant_functions", tool="tray", threshold=Fraction(1, 3), tolerance="0.35")
