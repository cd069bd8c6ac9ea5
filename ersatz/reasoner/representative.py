"""Representative models (paper: O_rp, O_rf, f_rp): what is typical of a class or goes with a function.

The counts of all classes are read from the knowledge base in one query and kept as arrays; the
representative qualities at a threshold are sets of bits packed into 64-bit words.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.models import ClassModel, Entry, FunctionModel
from ersatz.knowledge.names import local_name
from ersatz.knowledge.queries import Value
from ersatz.knowledge.terms import millionths
from ersatz.measurements import Kind


@dataclass(frozen=True, slots=True)
class QualityTerm:
    """A quality as the reasoner knows it."""

    iri: str
    name: str
    property: str
    adjective: str
    kind: Kind
    rank: int
    centroid: tuple[float, ...] = ()
    """In the property's unit; empty where it is not known."""


@dataclass(frozen=True, slots=True, eq=False)
class Memberships:
    """The counts behind the memberships of all concepts of one sort, classes or functions.

    Attributes
    ----------
    iris : tuple of c str
    names : tuple of c str
    counts, totals : (c, q) int64 arrays, in millionths of a degree
        total is 0 where nothing was observed.
    """

    iris: tuple[str, ...]
    names: tuple[str, ...]
    counts: NDArray[np.int64]
    totals: NDArray[np.int64]

    def representative(self, theta: Fraction) -> NDArray[np.bool_]:
        """Return (c, q): whether count / total >= theta, decided exactly.

        A quality never observed is not representative, whatever the threshold.
        """
        return (self.counts > 0) & at_least(self.counts, self.totals, theta)

    def only(self, rows: Sequence[int]) -> "Memberships":
        """Return the memberships of some concepts."""
        chosen = list(rows)
        return Memberships(
            tuple(self.iris[row] for row in chosen),
            tuple(self.names[row] for row in chosen),
            self.counts[chosen],
            self.totals[chosen],
        )


@dataclass(frozen=True, slots=True, eq=False)
class Knowledge:
    """What the reasoner needs of a knowledge base, in arrays.

    Attributes
    ----------
    qualities : tuple of q QualityTerm, ascending by (property, rank)
    classes, functions : Memberships
        Classes ascend by name: so do candidates of equal similarity.
    units : (c,) int64 array
        Instances (or observations) each class is known from.
    row_of_class, row_of_name : mappings of class IRI and label to its row
    """

    qualities: tuple[QualityTerm, ...]
    classes: Memberships
    functions: Memberships
    units: NDArray[np.int64]
    row_of_class: Mapping[str, int]
    row_of_name: Mapping[str, int]

    @property
    def columns(self) -> NDArray[np.int64]:
        """Which quality each function is, (f,)."""
        position = {quality.iri: at for at, quality in enumerate(self.qualities)}
        return np.array([position[iri] for iri in self.functions.iris], dtype=np.int64)

    def mask(self, kind: Kind, properties: Sequence[str] | None = None) -> NDArray[np.bool_]:
        """Return (q,): which qualities are of the kind, and of the given properties."""
        return np.array(
            [q.kind is kind and (properties is None or q.property in properties) for q in self.qualities],
            dtype=bool,
        )


def load_knowledge(kb: KnowledgeBase) -> Knowledge:
    """Read all class knowledge and function models, one query each."""
    kinds = {row["property"]: row for row in kb.ask("properties")}
    qualities, centroids = [], _vectors(kb)
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
                centroids.get(str(row["quality"])) or (float(str(row["centroid"])),),
            )
        )
    qualities.sort(key=lambda q: (q.property, q.rank))
    column = {quality.iri: at for at, quality in enumerate(qualities)}
    classes = kb.ask("classes")
    by_name = sorted(classes.rows, key=lambda row: str(row[1]))
    iris, names, units = zip(*by_name, strict=True) if by_name else ((), (), ())
    functions = [q for q in qualities if q.kind is Kind.FUNCTIONAL]
    return Knowledge(
        tuple(qualities),
        _memberships(tuple(map(str, iris)), tuple(map(str, names)), column, kb.ask("memberships").rows),
        _memberships(
            tuple(q.iri for q in functions),
            tuple(q.name for q in functions),
            column,
            kb.ask("function_models").rows,
        ),
        np.array(units, dtype=np.int64),
        {str(iri): at for at, iri in enumerate(iris)},
        {str(name): at for at, name in enumerate(names)},
    )


def _vectors(kb: KnowledgeBase) -> dict[str, tuple[float, ...]]:
    """Return the centroids of qualities of vector-valued properties."""
    found: dict[str, dict[int, float]] = {}
    for row in kb.ask("quality_coordinates"):
        found.setdefault(str(row["quality"]), {})[int(str(row["position"]))] = float(str(row["coordinate"]))
    return {quality: tuple(of[at] for at in sorted(of)) for quality, of in found.items()}


def class_model(kb: KnowledgeBase, name: str) -> ClassModel:
    """Return what is known of a class.

    Raises
    ------
    UnknownNameError
        If no class has the name.
    """
    known = kb.view(load_knowledge)
    row = known.row_of_class[kb.resolve(name, "class")]
    return ClassModel(
        known.classes.names[row],
        known.classes.iris[row],
        int(known.units[row]),
        _entries(known, known.classes, row),
    )


def function_model(kb: KnowledgeBase, name: str) -> FunctionModel:
    """Return what goes with a functional quality.

    Raises
    ------
    UnknownNameError
        If no functional quality has the name.
    """
    known = kb.view(load_knowledge)
    row = known.functions.iris.index(kb.resolve(name, "quality"))
    return FunctionModel(
        known.functions.names[row], known.functions.iris[row], _entries(known, known.functions, row)
    )


def at_least(counts: NDArray[np.int64], totals: NDArray[np.int64], theta: Fraction) -> NDArray[np.bool_]:
    """Return whether counts / totals >= theta, in whole numbers however large."""
    a, b = theta.denominator, theta.numerator
    largest = max(int(counts.max(initial=0)), int(totals.max(initial=0)))
    if max(a, b) * largest >= 2**63:
        exact: NDArray[np.bool_] = (counts.astype(object) * a >= totals.astype(object) * b).astype(bool)
        return exact
    return counts * a >= totals * b


def pack(bits: NDArray[np.bool_]) -> NDArray[np.uint64]:
    """Return sets given as (..., q) bits as (..., w) words of 64 bits."""
    width = -(-bits.shape[-1] // 64) * 64
    padded = np.zeros((*bits.shape[:-1], max(width, 64)), dtype=bool)
    padded[..., : bits.shape[-1]] = bits
    return np.packbits(padded, axis=-1).view(np.uint64)


def _memberships(
    iris: tuple[str, ...],
    names: tuple[str, ...],
    column: Mapping[str, int],
    rows: Sequence[tuple[Value, ...]],
) -> Memberships:
    row_of = {iri: at for at, iri in enumerate(iris)}
    counts = np.zeros((len(iris), len(column)), dtype=np.int64)
    totals = np.zeros_like(counts)
    for concept, quality, count, total in rows:
        at = row_of[str(concept)], column[str(quality)]
        counts[at], totals[at] = millionths(_decimal(count)), millionths(_decimal(total))
    return Memberships(iris, names, counts, totals)


def _decimal(value: Value) -> Decimal:
    assert isinstance(value, Decimal | int), value
    return Decimal(value)


def _entries(known: Knowledge, concepts: Memberships, row: int) -> tuple[Entry, ...]:
    return tuple(
        Entry(
            q.name, q.property, q.kind, q.rank, int(concepts.counts[row, at]), int(concepts.totals[row, at])
        )
        for at, q in enumerate(known.qualities)
        if concepts.counts[row, at]
    )
