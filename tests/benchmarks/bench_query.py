"""Time a warm query: on the shipped knowledge base, and on many random classes.

Part of `python -m tests.benchmarks`. Every rival's answer is compared with ERSATZ's before it is timed.
"""

import time
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from ersatz.grounding.conceptualization import DEGREE, Counts
from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.builds import BuildRecord
from ersatz.knowledge.memberships import class_knowledge, function_knowledge
from ersatz.knowledge.queries import Argument, stored_query
from ersatz.knowledge.writer import knowledge
from ersatz.measurements import Kind
from ersatz.reasoner.relevance import ReasonerSettings, build_index
from ersatz.reasoner.representative import load_knowledge, pack
from ersatz.reasoner.substitution import Ranking, rank_substitutes
from tests.benchmarks.measuring import Rival, Row, race
from tests.making import prop, ranked, table

PROPERTIES = [prop(f"body_{n}") for n in range(6)] + [prop(f"use_{n}", "functional") for n in range(2)]
TOOL = "thing 0"
THETA = ReasonerSettings().representative
OWLREADY = """
PREFIX e: <https://w3id.org/ersatz#>
SELECT ?class ?quality ?n ?of {
  ?model e:describesClass ?class ; e:hasEntry ?entry .
  ?entry e:quality ?quality ; e:count ?n ; e:total ?of .
  ?quality a e:PhysicalQuality .
}
"""
"""All that is known of physical qualities: what its engine can do without an error. Python does the rest."""


def random_counts(classes: int) -> Counts:
    """Return counts of classes of one object each, which holds a random quality of each property."""
    rng = np.random.default_rng(0)
    qualities = tuple(ranked(PROPERTIES, 4))
    width, rows = 4 * len(PROPERTIES), np.arange(classes)
    counts = np.zeros((classes, width), dtype=np.int64)
    for at in range(len(PROPERTIES)):
        counts[rows, 4 * at + rng.integers(0, 4, classes)] = DEGREE
    function_counts = np.zeros((8, width), dtype=np.int64)
    function_counts[:, :24] = counts[0, :24]  # what goes with a function is what the tool is like
    function_counts[::2, 0:8] = 0
    totals = np.repeat([[DEGREE] * 6 + [0, 0]], 8, axis=0)
    class_totals = np.full((classes, len(PROPERTIES)), DEGREE)
    names = tuple(sorted(f"thing {n}" for n in range(classes)))
    ones = np.ones(classes, dtype=np.int64)
    return Counts(qualities, names, ones, counts, class_totals, function_counts, totals)


def lines(counts: Counts) -> Iterator[str]:
    """Yield a knowledge base with these counts; its first lines are those of a small table."""
    from ersatz.grounding.attribution import attribute
    from ersatz.grounding.units import find_units

    record = BuildRecord()
    measured = table([("thing 0", "some 0", "", p.name, 1.0) for p in PROPERTIES], PROPERTIES)
    units = find_units(measured, record.unit)
    attribution = attribute(measured, counts.qualities, units)
    nobody = replace(
        counts,
        classes=(),
        units=counts.units[:0],
        class_counts=counts.class_counts[:0],
        class_totals=counts.class_totals[:0],
        function_counts=counts.function_counts * 0,
        function_totals=counts.function_totals * 0,
    )
    yield from knowledge(measured, units, attribution, nobody, record, classes_only=True)
    for row in range(len(counts.classes)):
        yield from class_knowledge(counts, row, record.theta)
    for row in range(len(counts.functions)):
        yield from function_knowledge(counts, row, record.theta)


def run(quick: bool) -> list[Row]:
    """Time warm queries from few classes to a million."""
    rows = shipped(quick) + beside_sparql(500 if quick else 5_000)
    for classes in (2_000, 20_000) if quick else (100_000, 1_000_000):
        rows += arrays(classes, quick)
    return rows


def shipped(quick: bool) -> list[Row]:
    """Time the query of every robot: the shipped knowledge base, all ranked."""
    kb = KnowledgeBase.open("household")
    known = kb.view(load_knowledge)
    names = [quality.name for quality in known.qualities]
    typical = known.classes.representative(THETA) & known.mask(Kind.PHYSICAL)
    sets = [frozenset(names[at] for at in np.flatnonzero(bits)) for bits in typical]
    ranking = rank_substitutes(kb, "tray")
    relevant = frozenset(ranking.relevant_physical)
    expected = [(one.name, one.fraction) for one in ranking]
    ontology, graph = kb.owl(), kb.graph
    text = jaccard_text(kb, ranking)

    def with_sets() -> list[tuple[str, Fraction]]:
        pairs = zip(sets, known.classes.names, strict=True)
        return ordered({name: Fraction(len(s & relevant), len(s | relevant)) for s, name in pairs})

    def owlready2() -> list[tuple[str, Fraction]]:
        held: dict[str, set[str]] = {}
        for thing, quality, n, of in ontology.world.sparql(OWLREADY):
            found = held.setdefault(thing.iri, set())
            if Fraction(str(n)) >= THETA * Fraction(str(of)):
                found.add(quality.name)
        named = {known.classes.names[known.row_of_class[iri]]: one for iri, one in held.items()}
        return ordered({name: Fraction(len(s & relevant), len(s | relevant)) for name, s in named.items()})

    def with_rdflib() -> list[dict[str, object]]:
        found: Any = graph.query(text)
        return [{"class": row[0], "both": row[1], "either": row[2]} for row in found]

    assert with_sets() == owlready2() == expected
    check_rows(ranking, list(kb.query(text)))
    check_rows(ranking, with_rdflib())
    given = "the relevant qualities were given to it"
    return race(
        "warm query, all ranked",
        f"{len(sets)} classes",
        lambda: rank_substitutes(kb, "tray"),
        [
            Rival("Python sets and Fractions", with_sets, note=given),
            Rival(
                "SPARQL on Oxigraph", lambda: list(kb.query(text)), note=given, package="pyoxigraph", most=5
            ),
            Rival("SPARQL on rdflib", with_rdflib, note=given, package="rdflib", most=1),
            Rival("owlready2's SPARQL and Python sets", owlready2, note=given, package="owlready2", most=3),
        ],
        rounds=5 if quick else 50,
        repeat=20,
        clock=time.process_time,
        limit=200e-6,
    )


def beside_sparql(classes: int) -> list[Row]:
    """Time many classes, ten returned, beside the same in SPARQL."""
    kb = KnowledgeBase.create(lines(random_counts(classes)))
    ranking = rank_substitutes(kb, TOOL)
    assert ranking.relevant_physical
    text = jaccard_text(kb, ranking)
    check_rows(ranking, list(kb.query(text)))
    return race(
        "warm query, top 10",
        f"{classes:,} classes",
        lambda: rank_substitutes(kb, TOOL, top=10),
        [Rival("SPARQL on Oxigraph", lambda: list(kb.query(text)), 50, "", "pyoxigraph", most=3)],
        rounds=20,
        clock=time.process_time,
    )


def arrays(classes: int, quick: bool) -> list[Row]:
    """Time very many classes, ten returned, beside those who compare packed bits."""
    from tests.benchmarks.rivals import bit_rivals, search_rivals, shelved

    with TemporaryDirectory() as folder, shelved(Path(folder), classes) as kb:
        ranking = rank_substitutes(kb, TOOL)
        body, relevant = (
            build_index(kb.view(load_knowledge), ReasonerSettings()).body,
            pack(ranking.relevance.physical),
        )
        similarities = ranking.numerators / ranking.denominators

        def one_pass() -> object:
            both = np.bitwise_count(body & relevant).sum(axis=1, dtype=np.int64)
            either = np.bitwise_count(body | relevant).sum(axis=1, dtype=np.int64)
            return both / either

        def check(distances: object) -> None:
            assert np.allclose(1 - np.asarray(distances)[0], similarities, atol=1e-6)

        def check_ten(distances: object) -> None:
            best = np.sort(similarities)[-10:]
            assert np.allclose(np.sort(1 - np.asarray(distances)[0]), best, atol=1e-6)

        check([1 - np.asarray(one_pass())])
        limit = Rival("one pass of numpy over the packed bits", one_pass, 1 / 6, "", "numpy")
        rivals = bit_rivals(relevant[None], body, check, most=3)
        rivals += search_rivals(relevant[None], body, check_ten, most=5)
        return race(
            "warm query, top 10",
            f"{classes:,} classes",
            lambda: rank_substitutes(kb, TOOL, top=10),
            [limit, *rivals],
            rounds=5 if quick else 30,
            clock=time.process_time,
        )


def jaccard_text(kb: KnowledgeBase, ranking: Ranking) -> str:
    """Return the question for the same similarities in pure SPARQL."""
    given: dict[str, Argument] = {"qualities": ranking.relevant_physical, "threshold": THETA}
    return stored_query("jaccard").bind(kb.resolve, given)


def ordered(similarity: Mapping[str, Fraction], tool: str = "tray") -> list[tuple[str, Fraction]]:
    """Return candidates by similarity, then name, without the tool."""
    found = sorted(similarity.items(), key=lambda one: (-one[1], one[0]))
    return [one for one in found if one[0] != tool]


def check_rows(ranking: Ranking, rows: Iterable[Mapping[str, object]]) -> None:
    """Assert that SPARQL and the reasoner say the same of every class."""
    theirs = {str(row["class"]): Fraction(int(str(row["both"])), int(str(row["either"]))) for row in rows}
    theirs.pop(ranking.iri, None)
    halves = zip(ranking.numerators.tolist(), ranking.denominators.tolist(), strict=True)
    ours = {iri: Fraction(n, d) for iri, (n, d) in zip(ranking.candidates.iris, halves, strict=True) if n}
    ours.pop(ranking.iri, None)
    assert ours == theirs, "the reasoner and SPARQL differ"
