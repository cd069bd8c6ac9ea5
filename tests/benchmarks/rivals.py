"""Many random classes for benchmarks, and the rivals that compare their packed bits."""

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.shelf import keep
from ersatz.reasoner.representative import Knowledge, Memberships, load_knowledge
from ersatz.reasoner.shelving import to_arrays
from tests.benchmarks.bench_query import TOOL, lines, random_counts
from tests.benchmarks.measuring import Rival

THETA = Fraction(35, 100)
Found = NDArray[np.floating]
"""Jaccard distances of n relevant sets and c classes, (n, c)."""


def shelved(folder: Path, classes: int) -> KnowledgeBase:
    """Open a directory knowledge base with the arrays of so many classes on its shelf.

    The triples are those of a few: a query needs the arrays only, and making millions of triples takes
    an hour (`bench_loading` times that).
    """
    counts = random_counts(classes)
    with KnowledgeBase.create(lines(random_counts(3)), folder / f"kb{classes}") as kb:
        few: Knowledge = kb.view(load_knowledge)
        names = counts.classes
        iris = tuple(f"https://w3id.org/ersatz/kb#Thing{name.removeprefix('thing ')}" for name in names)
        totals = np.repeat(counts.class_totals, 4, axis=1)
        functions = replace(
            few.functions,
            counts=counts.function_counts,
            totals=np.repeat(counts.function_totals, 4, axis=1),
        )
        known = replace(
            few,
            classes=Memberships(iris, names, counts.class_counts, totals),
            functions=functions,
            units=counts.units,
        )
        assert kb.shelf is not None
        keep(kb.shelf, kb.revision, *to_arrays(known, THETA))
    return KnowledgeBase.open(folder / f"kb{classes}")


def bit_rivals(
    relevant: NDArray[np.uint64],
    body: NDArray[np.uint64],
    check: Callable[[Found], None],
    scale: float = 1.0,
    **more: int,
) -> list[Rival]:
    """Return who else computes Jaccard distances of packed bits; each is checked before it is timed.

    Parameters
    ----------
    relevant : (n, 1) uint64 array
    body : (c, 1) uint64 array
    check : function
        Raises where distances are not ERSATZ's similarities.
    scale : float
        How many times these n are the whole work.
    more
        Further settings of every `Rival`.
    """
    some, bytes_ = (np.ascontiguousarray(one).view(np.uint8) for one in (relevant, body))
    bits, all_bits = (np.unpackbits(one, axis=1).astype(bool) for one in (some, bytes_))
    ways: list[tuple[str, str, Callable[[], Found]]] = [
        ("scipy cdist", "scipy", lambda: _scipy(bits, all_bits)),
        ("scikit-learn pairwise", "scikit-learn", lambda: _sklearn(bits, all_bits)),
        ("numkong cdist", "numkong", lambda: _numkong(some, bytes_)),
        ("simsimd cdist", "simsimd", lambda: _simsimd(some, bytes_)),
    ]
    rivals = []
    for name, package, way in ways:
        module = {"scikit-learn": "sklearn"}.get(package, package)
        if find_spec(module) is None:
            rivals.append(Rival(name, None, package=package))
            continue
        check(way())
        rivals.append(Rival(name, way, None, "the similarities only", package, scale, **more))
    return rivals


def _scipy(some: NDArray[np.bool_], every: NDArray[np.bool_]) -> Found:
    from scipy.spatial.distance import cdist

    found: Found = cdist(some, every, "jaccard")
    return found


def _sklearn(some: NDArray[np.bool_], every: NDArray[np.bool_]) -> Found:
    from sklearn.metrics import pairwise_distances

    found: Found = pairwise_distances(some, every, metric="jaccard")
    return found


def _numkong(some: NDArray[np.uint8], every: NDArray[np.uint8]) -> Found:
    import numkong

    found: Found = np.atleast_2d(np.asarray(numkong.cdist(some, every, "jaccard", dtype="uint1")))
    return found


def _simsimd(some: NDArray[np.uint8], every: NDArray[np.uint8]) -> Found:
    import simsimd

    found: Found = np.atleast_2d(np.asarray(simsimd.cdist(some, every, metric="jaccard", dtype="bin8")))
    return found


def search_rivals(
    relevant: NDArray[np.uint64],
    body: NDArray[np.uint64],
    check: Callable[[Found], None],
    scale: float = 1.0,
    **more: int,
) -> list[Rival]:
    """Return who else finds the ten nearest by Jaccard distance, exactly; `check` gets (n, 10)."""
    some, bytes_ = (np.ascontiguousarray(one).view(np.uint8) for one in (relevant, body))
    rivals = []
    if find_spec("usearch") is None:
        rivals.append(Rival("usearch exact search, top 10", None, package="usearch"))
    else:
        from usearch.compiled import MetricKind
        from usearch.index import search

        def usearch() -> Found:
            found: Found = search(bytes_, some, 10, MetricKind.Tanimoto, exact=True).distances
            return np.atleast_2d(found)

        check(usearch())
        rivals.append(Rival("usearch exact search, top 10", usearch, None, "", "usearch", scale, **more))
    if find_spec("faiss") is None:
        rivals.append(Rival("faiss IndexFlat Jaccard, top 10", None, package="faiss-cpu"))
    else:
        import faiss

        queries, vectors = (np.unpackbits(one, axis=1).astype(np.float32) for one in (some, bytes_))
        index = faiss.IndexFlat(vectors.shape[1], faiss.METRIC_Jaccard)
        index.add(vectors)

        def flat() -> Found:
            found: Found = 1 - index.search(queries, 10)[0]
            return found

        check(flat())
        rivals.append(Rival("faiss IndexFlat Jaccard, top 10", flat, None, "", "faiss-cpu", scale, **more))
    return rivals


__all__ = ["TOOL", "bit_rivals", "search_rivals", "shelved"]
