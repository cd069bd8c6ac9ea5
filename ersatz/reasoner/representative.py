"""Representative models (paper: O_rp, O_rf, f_rp): what is typical of a class or goes with a function.

The counts of all classes are kept as arrays (`loading` reads them); the representative qualities at a
threshold are sets of bits packed into 64-bit words.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ersatz.errors import InputError
from ersatz.knowledge.base import KnowledgeBase, View
from ersatz.knowledge.models import ClassModel, Entry, FunctionModel
from ersatz.measurements import Kind

BLOCK: Final = 1 << 20
"""Cells that are compared at once: more would not stay in the processor's cache."""


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
    unit: str = "1"
    """Of the property; "1" for a dimensionless number."""


@dataclass(frozen=True, slots=True, eq=False)
class Memberships:
    """The counts behind the memberships of all concepts of one sort, classes or functions.

    Attributes
    ----------
    iris : sequence of c str
    names : sequence of c str
    counts, totals : (c, q) int64 arrays, in millionths of a degree
        total is 0 where nothing was observed.
    packed : mapping of threshold to (c, w) uint64 array
        What is representative, where that was decided before.
    """

    iris: Sequence[str]
    names: Sequence[str]
    counts: NDArray[np.int64]
    totals: NDArray[np.int64]
    packed: Mapping[Fraction, NDArray[np.uint64]] = field(default_factory=dict)

    def representative(self, theta: Fraction) -> NDArray[np.bool_]:
        """Return (c, q): whether count / total >= theta, decided exactly.

        A quality never observed is not representative, whatever the threshold.
        """
        if theta in self.packed:
            return unpack(self.packed[theta], self.counts.shape[1])
        found = np.empty(self.counts.shape, dtype=bool)
        step = max(BLOCK // max(self.counts.shape[1], 1), 1)
        for start in range(0, len(found), step):
            counts, totals = self.counts[start : start + step], self.totals[start : start + step]
            np.logical_and(counts > 0, at_least(counts, totals, [theta])[0], out=found[start : start + step])
        return found

    def representative_at(self, thetas: Sequence[Fraction]) -> NDArray[np.bool_]:
        """Return (t, c, q): what is representative at each of several thresholds."""
        step = max(BLOCK // max(self.counts.size, 1), 1)
        pieces = (thetas[start : start + step] for start in range(0, len(thetas), step))
        return np.concatenate([at_least(self.counts, self.totals, some) for some in pieces]) & (
            self.counts > 0
        )

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


def _load(kb: KnowledgeBase) -> Knowledge:
    from ersatz.reasoner.loading import load  # which fills the classes above

    return load(kb)


def _refresh(old: Knowledge, kb: KnowledgeBase, changed: frozenset[str]) -> Knowledge | None:
    from ersatz.reasoner.loading import refresh

    return refresh(old, kb, changed)


load_knowledge: Final = View(_load, _refresh)
"""All class knowledge and function models of a knowledge base, by `kb.view(load_knowledge)`."""


def class_row(kb: KnowledgeBase, known: Knowledge, name: str) -> int:
    """Return the row of a class among `Knowledge.classes`.

    Raises
    ------
    UnknownNameError
        If there is no such class.
    InputError
        If it is one that somebody added by hand, of which nothing was measured.
    """
    row = known.row_of_name.get(name)
    row = known.row_of_class.get(kb.resolve(name, "class")) if row is None else row
    if row is None:
        raise InputError(f"class {name!r} has no model, or no English label: run `ersatz check`")
    return row


def class_model(kb: KnowledgeBase, name: str) -> ClassModel:
    """Return what is known of a class.

    Raises
    ------
    UnknownNameError
        If no class has the name.
    """
    known = kb.view(load_knowledge)
    row = class_row(kb, known, name)
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


def at_least(
    counts: NDArray[np.int64], totals: NDArray[np.int64], thetas: Sequence[Fraction]
) -> NDArray[np.bool_]:
    """Return (t, ...): whether counts / totals >= each theta, in whole numbers however large."""
    largest = max(int(counts.max(initial=0)), int(totals.max(initial=0)))
    factors = [(theta.denominator, theta.numerator) for theta in thetas]
    kind = np.int64 if max(map(max, factors)) * largest < 2**63 else object
    a, b = np.array(factors, dtype=kind).T.reshape(2, -1, *(1,) * counts.ndim)
    found: NDArray[np.bool_] = (counts * a >= totals * b).astype(bool, copy=False)
    return found


def pack(bits: NDArray[np.bool_]) -> NDArray[np.uint64]:
    """Return sets given as (..., q) bits as (..., w) words of 64 bits."""
    width = -(-bits.shape[-1] // 64) * 64
    padded = np.zeros((*bits.shape[:-1], max(width, 64)), dtype=bool)
    padded[..., : bits.shape[-1]] = bits
    return np.packbits(padded, axis=-1).view(np.uint64)


def unpack(words: NDArray[np.uint64], width: int) -> NDArray[np.bool_]:
    """Return (..., w) words of 64 bits as sets of (..., width) bits."""
    return np.unpackbits(np.ascontiguousarray(words).view(np.uint8), axis=-1, count=width).view(bool)


def _entries(known: Knowledge, concepts: Memberships, row: int) -> tuple[Entry, ...]:
    return tuple(
        Entry(
            q.name, q.property, q.kind, q.rank, int(concepts.counts[row, at]), int(concepts.totals[row, at])
        )
        for at, q in enumerate(known.qualities)
        if concepts.counts[row, at]
    )
