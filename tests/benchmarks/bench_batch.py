"""Time many missing tools at once: a thousand of them, and all pairs of ten thousand classes.

Part of `python -m tests.benchmarks`. The rivals are given the relevant qualities of every tool and do the
similarities only; their figures are of a share of the tools, scaled.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from ersatz.knowledge.base import KnowledgeBase
from ersatz.reasoner.batch import _relevant, rank_many
from ersatz.reasoner.relevance import ReasonerSettings, build_index
from ersatz.reasoner.representative import load_knowledge
from ersatz.reasoner.substitution import rank_substitutes
from tests.benchmarks.measuring import Rival, Row, race
from tests.benchmarks.rivals import Found, bit_rivals, search_rivals, shelved

SAMPLE = 100
"""Tools the rivals are asked for; their time is linear in these."""


def run(quick: bool) -> list[Row]:
    """Time a batch and all pairs."""
    classes, tools = (1_000, 200) if quick else (10_000, 1_000)
    with TemporaryDirectory() as folder, shelved(Path(folder), classes) as kb:
        names = list(kb.view(load_knowledge).classes.names)
        rows = _raced(kb, names[:tools], f"{tools:,} tools, {classes:,} classes", "batch, top 10 of each", 5)
        return rows + _raced(kb, names, f"{classes:,} × {classes:,} classes", "all pairs, top 10 of each", 2)


def _raced(kb: KnowledgeBase, tools: list[str], size: str, work: str, rounds: int) -> list[Row]:
    known = kb.view(load_knowledge)
    few = tools[:SAMPLE]
    settings = ReasonerSettings()
    index = build_index(known, settings)
    places = np.array([known.row_of_name[name] for name in few])
    relevant = np.array([words for words, _ in _relevant(index, places, settings)])
    batch = rank_many(kb, few)
    best = batch.numerators / batch.denominators
    scale = len(tools) / len(few)

    def one_by_one() -> list[list[tuple[str, object, bool]]]:
        rankings = [rank_substitutes(kb, name, top=10) for name in few]
        return [[(one.name, one.fraction, one.accepted) for one in ranking] for ranking in rankings]

    def products() -> Found:
        some, every = (
            np.unpackbits(one.view(np.uint8), axis=1).astype(np.float32) for one in (relevant, index.body)
        )
        both = some @ every.T
        either: Found = some.sum(axis=1)[:, None] + every.sum(axis=1) - both
        found: Found = 1 - both / np.maximum(either, 1)
        return found

    def check(distances: Found) -> None:
        similarity = 1 - np.asarray(distances, dtype=np.float64)
        similarity[np.arange(len(few)), places] = -1
        assert np.allclose(-np.sort(-similarity, axis=1)[:, :10], best, atol=1e-6)

    def check_ten(distances: Found) -> None:
        theirs = np.sort(1 - np.asarray(distances, dtype=np.float64), axis=1)[:, ::-1]
        ours = -np.sort(-best, axis=1)
        assert theirs.shape == ours.shape
        assert (theirs >= ours - 1e-6).all()  # the tool itself may be among theirs
        assert (
            np.allclose(theirs[:, 1:], ours[:, :-1], atol=1e-6) or (theirs[:, 1:] >= ours[:, 1:] - 1e-6).all()
        )

    assert one_by_one() == batch[:]
    check(products())
    rivals = [
        Rival("rank_substitutes, one by one", one_by_one, scale=scale, most=2),
        Rival("numpy's matrix product, not ranked", products, package="numpy", scale=scale),
    ]
    rivals += bit_rivals(relevant, index.body, check, scale, most=2)
    rivals += search_rivals(relevant, index.body, check_ten, scale, most=2)
    return race(work, size, lambda: rank_many(kb, tools), rivals, rounds)
