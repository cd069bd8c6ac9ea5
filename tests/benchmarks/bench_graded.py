"""Time graded answers beside crisp ones and beside numpy's plain pass, on many random classes.

Run `python -m tests.benchmarks.bench_graded [CLASSES]`. Ratios are of medians within one run.
"""

import sys
from collections.abc import Callable

import numpy as np

from ersatz.grounding.conceptualization import DEGREE, Counts
from ersatz.grounding.subcategorization import Qualities
from ersatz.knowledge.base import KnowledgeBase
from ersatz.reasoner.relevance import ReasonerSettings
from ersatz.reasoner.representative import load_knowledge
from ersatz.reasoner.similarity import GRADED, Similarity
from ersatz.reasoner.substitution import rank_substitutes
from tests.benchmarks.bench_query import PROPERTIES, TOOL, lines
from tests.benchmarks.measuring import Rival, Row, race
from tests.making import ranked

OBJECTS = 5
RANKS = 4
WITHIN = 5
"""Graded reasoning may take so many times as long as crisp."""


def random_counts(classes: int) -> Counts:
    """Return counts of classes of five objects, spread around a rank of each property; likewise functions."""
    rng = np.random.default_rng(0)
    qualities: tuple[Qualities, ...] = tuple(ranked(PROPERTIES, RANKS))
    class_counts = _counts(rng, classes, len(PROPERTIES))
    functions = [at for at, one in enumerate(qualities) if one.property.kind == "functional"]
    function_counts = _counts(rng, RANKS * len(functions), len(PROPERTIES))
    totals = np.full((len(function_counts), len(PROPERTIES)), OBJECTS * DEGREE)
    for at in functions:  # function models are of physical qualities
        function_counts[:, RANKS * at : RANKS * (at + 1)] = 0
        totals[:, at] = 0
    return Counts(
        qualities,
        tuple(sorted(f"thing {n}" for n in range(classes))),
        np.full(classes, OBJECTS, dtype=np.int64),
        class_counts,
        np.full((classes, len(PROPERTIES)), OBJECTS * DEGREE),
        function_counts,
        totals,
    )


def compared(classes: int, rounds: int) -> list[Row]:
    """Time every similarity at so many classes, all ranked, ten returned."""
    kb = KnowledgeBase.create(lines(random_counts(classes)))
    found = [_race(kb, form, classes, rounds) for form in GRADED]
    return [row for rows in found for row in rows]


def run(quick: bool) -> list[Row]:
    """Time a warm graded query beside the crisp one of the same question."""
    return compared(500, 3) if quick else compared(10_000, 30)


def _race(kb: KnowledgeBase, form: Similarity, classes: int, rounds: int) -> list[Row]:
    graded = ReasonerSettings(graded=True, similarity=form)
    crisp = ReasonerSettings(fallback=True)
    return race(
        f"graded query ({form}), ten best",
        f"{classes:,} classes, {RANKS * len(PROPERTIES)} qualities",
        lambda: rank_substitutes(kb, TOOL, settings=graded, top=10),
        [
            Rival(
                "crisp query (Jaccard)",
                lambda: rank_substitutes(kb, TOOL, settings=crisp, top=10),
                target=1 / WITHIN,
            ),
            Rival("one pass of numpy, float64", _plain_pass(kb)),
        ],
        rounds,
    )


def _plain_pass(kb: KnowledgeBase) -> Callable[[], object]:
    """Return Ruzicka as anyone would write it, on the physical degrees of all classes."""
    known = kb.view(load_knowledge)
    mask = known.mask(known.qualities[0].kind)
    degrees = (known.classes.counts / np.maximum(known.classes.totals, 1))[:, mask]
    tool = degrees[known.row_of_name[TOOL]]
    return lambda: np.minimum(degrees, tool).sum(axis=1) / np.maximum(degrees, tool).sum(axis=1)


def _counts(rng: np.random.Generator, rows: int, properties: int) -> np.ndarray[tuple[int, int], np.dtype]:
    found = np.zeros((rows, RANKS * properties), dtype=np.int64)
    centres = rng.integers(0, RANKS, (rows, properties))
    for _ in range(OBJECTS):
        held = np.clip(centres + rng.integers(-1, 2, (rows, properties)), 0, RANKS - 1)
        found[np.arange(rows)[:, None], held + RANKS * np.arange(properties)] += DEGREE
    return found


if __name__ == "__main__":
    for row in compared(int(sys.argv[1]) if len(sys.argv) > 1 else 10_000, 50):
        ours, theirs = (1e3 * float(np.median(of)) for of in (row.ours, row.theirs))
        print(f"{row.work}, {row.size}: {ours:.2f} ms; {row.rival} {theirs:.2f} ms; ratio {row.ratio:.2f}")
