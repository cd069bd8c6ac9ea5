"""Time a warm query: on the shipped expert's classes, and on many random ones beside numpy and SPARQL.

Run `python -m tests.benchmarks.bench_query [CLASSES]`. Figures are medians, compared within one run.
"""

import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from statistics import median

import numpy as np

import ersatz
from ersatz.grounding.conceptualization import DEGREE, Counts
from ersatz.grounding.subcategorization import SubcategorizationSettings
from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.queries import stored_query
from ersatz.knowledge.writer import BuildRecord, class_knowledge, function_knowledge, knowledge
from ersatz.measurements import Kind
from ersatz.pipeline import Settings, build
from ersatz.reasoner.relevance import ReasonerSettings, build_index
from ersatz.reasoner.representative import load_knowledge, pack
from ersatz.reasoner.substitution import rank_substitutes
from tests.benchmarks.measuring import Rival, Row, race
from tests.making import prop, ranked, table

PROPERTIES = [prop(f"body_{n}") for n in range(6)] + [prop(f"use_{n}", "functional") for n in range(2)]
TOOL = "thing 0"


def seconds(work: Callable[[], object], times: int) -> float:
    """Return the median time of one run."""
    found = []
    for _ in range(times):
        start = time.perf_counter()
        work()
        found.append(time.perf_counter() - start)
    return median(found)


def small() -> None:
    """Time the query of every robot: few classes, all ranked."""
    expert = Path(ersatz.__file__).parent / "data" / "expert.toml"
    kb = build(expert=expert, settings=Settings(SubcategorizationSettings(restarts=3)))
    classes = [str(row["name"]) for row in kb.ask("classes")]
    rank_substitutes(kb, "tray")
    everything = seconds(lambda: rank_substitutes(kb, "tray"), 2000)
    named = seconds(lambda: rank_substitutes(kb, "tray", classes), 2000)
    told = seconds(lambda: [one.explain() for one in rank_substitutes(kb, "tray")], 20)
    print(f"{len(classes)} classes, all ranked: {everything * 1e6:.0f} us; named: {named * 1e6:.0f} us")
    print(f"the same, every candidate explained: {told * 1e3:.1f} ms")


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


def large(classes: int) -> None:
    """Time many classes, all ranked, ten returned; the same in SPARQL, and one pass of numpy."""
    kb = KnowledgeBase.create(lines(random_counts(classes)))
    first = seconds(lambda: rank_substitutes(kb, TOOL, top=10), 1)
    found = rank_substitutes(kb, TOOL, top=10)
    assert len(found.relevant_physical) == 6, found.relevant_physical
    ours = seconds(lambda: rank_substitutes(kb, TOOL, top=10), 100)
    body = build_index(kb.view(load_knowledge), ReasonerSettings()).body
    relevant = pack(found.relevance.physical)

    def one_pass() -> object:
        both = np.bitwise_count(body & relevant).sum(axis=1, dtype=np.int64)
        either = np.bitwise_count(body | relevant).sum(axis=1, dtype=np.int64)
        return both / either

    numpy_pass = seconds(one_pass, 100)
    text = stored_query("jaccard").bind(
        kb.resolve, {"qualities": found.relevant_physical, "threshold": ReasonerSettings().representative}
    )
    start = time.perf_counter()
    rows = list(kb.query(text))
    sparql = time.perf_counter() - start
    check_equal(kb, rows)
    print(f"{classes} classes, all ranked, top 10: {ours * 1e3:.2f} ms (first, reading all: {first:.1f} s)")
    print(f"one pass of numpy over the packed bits: {numpy_pass * 1e3:.2f} ms; ratio {ours / numpy_pass:.1f}")
    print(f"the same in SPARQL on Oxigraph: {sparql:.2f} s; ratio {sparql / ours:.0f}")


def run(quick: bool) -> list[Row]:
    """Time the warm query of the shipped knowledge base beside plain Python sets."""
    kb = KnowledgeBase.open("household")
    known, theta = kb.view(load_knowledge), ReasonerSettings().representative
    names = [quality.name for quality in known.qualities]
    typical = known.classes.representative(theta) & known.mask(Kind.PHYSICAL)
    sets = [frozenset(names[at] for at in np.flatnonzero(bits)) for bits in typical]
    relevant = frozenset(rank_substitutes(kb, "tray").relevant_physical)

    def with_sets() -> list[tuple[Fraction, str]]:
        pairs = zip(sets, known.classes.names, strict=True)
        found = [(-Fraction(len(s & relevant), len(s | relevant)), name) for s, name in pairs]
        return sorted(one for one in found if one[1] != "tray")

    ours = [(-one.fraction, one.name) for one in rank_substitutes(kb, "tray")]
    assert ours == with_sets()
    return race(
        "warm query, all ranked",
        f"{len(sets)} classes",
        lambda: rank_substitutes(kb, "tray"),
        [Rival("Python sets and Fractions, relevance not counted", with_sets)],
        rounds=5 if quick else 50,
        repeat=20,
    )


def check_equal(kb: KnowledgeBase, rows: Iterable[Mapping[str, object]]) -> None:
    """Assert that SPARQL and the reasoner say the same of every class."""
    theirs = {str(row["class"]): (int(str(row["both"])), int(str(row["either"]))) for row in rows}
    ranking = rank_substitutes(kb, TOOL)
    halves = zip(ranking.order.tolist(), ranking.numerators[ranking.order].tolist(), strict=True)
    ours = {
        ranking.candidates.iris[row]: (number // 2, int(ranking.denominators[row]) // 2)
        for row, number in halves
        if number
    }
    theirs.pop(ranking.iri, None)
    assert ours == theirs, "the reasoner and SPARQL differ"


if __name__ == "__main__":
    small()
    large(int(sys.argv[1]) if len(sys.argv) > 1 else 100_000)
