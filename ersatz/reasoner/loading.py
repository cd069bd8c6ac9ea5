"""From a knowledge base to the reasoner's arrays: read in one stream, or found on its shelf; kept up to date.

A directory keeps the arrays on its shelf (`ersatz.knowledge.shelf`). After a change, in this process or
between two, only what belongs to the changed triples is read again.
"""

from array import array
from collections.abc import Iterable, Set
from dataclasses import dataclass, field, replace
from decimal import Decimal, InvalidOperation
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ersatz.errors import KnowledgeBaseError
from ersatz.grounding.fuzzy import DEGREE
from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.names import local_name
from ersatz.knowledge.queries import exact, stored_query
from ersatz.knowledge.shelf import MOST, find, keep
from ersatz.knowledge.terms import millionths
from ersatz.measurements import Kind
from ersatz.reasoner.representative import Knowledge, Memberships, QualityTerm, pack
from ersatz.reasoner.shelving import from_arrays, to_arrays

MANY: Final = 2_000
"""Changed subjects from which on the arrays are kept anew, so that the next to open has none to read."""


@dataclass(slots=True)
class Read:
    """Rows of the questions `index` and `index_of`, as they come in.

    Attributes
    ----------
    units : mapping of class IRI to (name, number of instances)
    concepts : mapping of IRI to its number
        In the order in which they were met.
    concept, quality, count, total : arrays of n int64
        The entries.
    """

    units: dict[str, tuple[str, int]] = field(default_factory=dict)
    concepts: dict[str, int] = field(default_factory=dict)
    concept: "array[int]" = field(default_factory=lambda: array("q"))
    quality: "array[int]" = field(default_factory=lambda: array("q"))
    count: "array[int]" = field(default_factory=lambda: array("q"))
    total: "array[int]" = field(default_factory=lambda: array("q"))

    def table(self, iris: Iterable[str], width: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return counts and totals of some concepts, (c, width) each."""
        rows = {iri: at for at, iri in enumerate(iris)}
        row_of = np.full(len(self.concepts) + 1, -1, dtype=np.int64)
        for iri, number in self.concepts.items():
            row_of[number] = rows.get(iri, -1)
        row = row_of[np.frombuffer(self.concept, dtype=np.int64)]
        mine = row >= 0
        cells = row[mine], np.frombuffer(self.quality, dtype=np.int64)[mine]
        counts = np.zeros((len(rows), width), dtype=np.int64)
        totals = np.zeros_like(counts)
        counts[cells] = np.frombuffer(self.count, dtype=np.int64)[mine]
        totals[cells] = np.frombuffer(self.total, dtype=np.int64)[mine]
        return counts, totals


def load(kb: KnowledgeBase) -> Knowledge:
    """Return all class knowledge and function models: from the shelf, or read in one stream."""
    found = find(kb.shelf, kb.revision) if kb.shelf is not None else None
    known = None
    if found is not None:
        known = from_arrays(found.arrays, found.about)
        known = refresh(known, kb, found.changed) if found.changed else known
    if known is None or found is None or len(found.changed) > MANY:
        known = known or _read_all(kb)
        _keep(kb, known)
    return known


def refresh(old: Knowledge, kb: KnowledgeBase, changed: frozenset[str]) -> Knowledge | None:
    """Return knowledge as it is after a change; None if the qualities changed, or too much.

    Parameters
    ----------
    old : Knowledge
        Not changed: earlier answers refer to it.
    kb : KnowledgeBase
    changed : frozenset of str
        IRIs of the subjects of all triples that were added or removed since.
    """
    if len(changed) > MOST or changed & {quality.iri for quality in old.qualities}:
        return None
    classes = changed & old.row_of_class.keys()
    for row in kb.query(_bound("index_touched", "things", changed)):
        if row["property"] is not None:
            return None
        classes |= {str(row["class"])}
    found = _read(kb, _bound("index_of", "concepts", {*classes, *old.functions.iris}), old.qualities)
    functions = _with(old.functions, *found.table(old.functions.iris, len(old.qualities)))
    old = replace(old, functions=functions)
    same = classes == found.units.keys() and all(
        iri in old.row_of_class and old.classes.names[old.row_of_class[iri]] == name
        for iri, (name, _) in found.units.items()
    )
    return _changed_rows(old, found) if same else _other_classes(old, found, classes)


def _keep(kb: KnowledgeBase, known: Knowledge) -> None:
    if kb.shelf is not None:
        arrays, about = to_arrays(known, exact(kb.build.theta))
        keep(kb.shelf, kb.revision, arrays, about)


def _read_all(kb: KnowledgeBase) -> Knowledge:
    qualities = _read_qualities(kb)
    found = _read(kb, stored_query("index").text, qualities)
    by_name = sorted((name, iri, units) for iri, (name, units) in found.units.items())
    iris = tuple(iri for _, iri, _ in by_name)
    names = tuple(name for name, _, _ in by_name)
    functions = [quality for quality in qualities if quality.kind is Kind.FUNCTIONAL]
    function_iris = tuple(quality.iri for quality in functions)
    return Knowledge(
        qualities,
        Memberships(iris, names, *found.table(iris, len(qualities))),
        Memberships(
            function_iris, tuple(q.name for q in functions), *found.table(function_iris, len(qualities))
        ),
        np.array([units for _, _, units in by_name], dtype=np.int64),
        {iri: at for at, iri in enumerate(iris)},
        {name: at for at, name in enumerate(names)},
    )


def _read_qualities(kb: KnowledgeBase) -> tuple[QualityTerm, ...]:
    kinds = {row["property"]: row for row in kb.ask("properties")}
    qualities, vectors = [], _vectors(kb)
    for row in kb.ask("qualities"):
        prop = kinds[row["property"]]
        qualities.append(
            QualityTerm(
                str(row["quality"]),
                local_name(str(row["quality"])),
                local_name(str(row["property"])),
                str(prop["adjective"] or ""),
                Kind(str(prop["kind"])),
                int(row["rank"]) if isinstance(row["rank"], int) else 0,
                vectors.get(str(row["quality"])) or (float(str(row["centroid"])),),
                str(prop["unit"]),
            )
        )
    return tuple(sorted(qualities, key=lambda quality: (quality.property, quality.rank)))


def _vectors(kb: KnowledgeBase) -> dict[str, tuple[float, ...]]:
    """Return the centroids of the qualities of vector-valued properties."""
    found: dict[str, dict[int, float]] = {}
    for row in kb.ask("quality_coordinates"):
        found.setdefault(str(row["quality"]), {})[int(str(row["position"]))] = float(str(row["coordinate"]))
    return {quality: tuple(of[at] for at in sorted(of)) for quality, of in found.items()}


def _read(kb: KnowledgeBase, text: str, qualities: Iterable[QualityTerm]) -> Read:
    found, column = Read(), {quality.iri: at for at, quality in enumerate(qualities)}
    try:
        for concept, name, quality, count, total in kb.stream(text):
            assert concept is not None
            if quality is None:
                one = (str(name), _millionths(count) // DEGREE)
                found.units[concept] = min(found.units.get(concept, one), one)
                continue
            if quality not in column:
                raise KnowledgeBaseError(
                    f"{kb.location!r} counts {local_name(quality)!r}, which is no quality it describes: "
                    "run `ersatz check`"
                )
            found.concept.append(found.concepts.setdefault(concept, len(found.concepts)))
            found.quality.append(column[quality])
            found.count.append(_millionths(count))
            found.total.append(_millionths(total))
    except (InvalidOperation, ValueError, OverflowError) as error:
        raise KnowledgeBaseError(
            f"{kb.location!r} has something else where a count belongs ({error}): run `ersatz check`"
        ) from None
    return found


@lru_cache(1 << 14)
def _millionths(text: str | None) -> int:
    return millionths(Decimal(str(text)))  # of counts of many things, most are the same


def _bound(name: str, parameter: str, iris: Iterable[str]) -> str:
    """Return a stored question about things that may not be there any more."""
    return stored_query(name).bind(lambda iri, _: iri, {parameter: sorted(iris)})


def _with(old: Memberships, counts: NDArray[np.int64], totals: NDArray[np.int64]) -> Memberships:
    fresh = replace(old, counts=counts, totals=totals, packed={})
    return replace(fresh, packed={theta: pack(fresh.representative(theta)) for theta in old.packed})


def _changed_rows(old: Knowledge, found: Read) -> Knowledge:
    """Return the same classes with some rows new."""
    rows = [old.row_of_class[iri] for iri in found.units]
    if not rows:
        return old
    some = _with(old.classes.only(rows), *found.table(found.units, len(old.qualities)))

    def put(before: NDArray[np.int64], new: NDArray[np.int64]) -> NDArray[np.int64]:
        after = np.array(before)
        after[rows] = new
        return after

    packed = {}
    for theta, words in old.classes.packed.items():
        packed[theta] = np.array(words)
        packed[theta][rows] = pack(some.representative(theta))
    counts, totals = put(old.classes.counts, some.counts), put(old.classes.totals, some.totals)
    units = put(old.units, np.array([units for _, units in found.units.values()]))
    return replace(
        old, classes=replace(old.classes, counts=counts, totals=totals, packed=packed), units=units
    )


def _other_classes(old: Knowledge, found: Read, touched: Set[str]) -> Knowledge:
    """Return knowledge with classes gone, come or renamed: by name again."""
    stay = np.array([row for iri, row in old.row_of_class.items() if iri not in touched], dtype=np.int64)
    some = found.table(found.units, len(old.qualities))
    names = [*(old.classes.names[row] for row in stay), *(name for name, _ in found.units.values())]
    iris = [*(old.classes.iris[row] for row in stay), *found.units]
    order = sorted(range(len(iris)), key=lambda at: (names[at], iris[at]))
    units = np.concatenate([old.units[stay], [units for _, units in found.units.values()]])
    counts = np.concatenate([old.classes.counts[stay], some[0]])[order]
    totals = np.concatenate([old.classes.totals[stay], some[1]])[order]
    sorted_iris, sorted_names = (tuple(words[at] for at in order) for words in (iris, names))
    return replace(
        old,
        classes=Memberships(sorted_iris, sorted_names, counts, totals),
        units=units[order].astype(np.int64),
        row_of_class={iri: at for at, iri in enumerate(sorted_iris)},
        row_of_name={name: at for at, name in enumerate(sorted_names)},
    )
