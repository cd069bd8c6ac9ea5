"""What may stand in: classes by what is known of them, perceived instances by what they hold."""

from collections.abc import Sequence
from dataclasses import dataclass
from decimal import ROUND_HALF_EVEN, Decimal
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ersatz.errors import InputError
from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.names import local_name
from ersatz.reasoner.quantised import GradedIndex, Grades, held_grades
from ersatz.reasoner.relevance import Index
from ersatz.reasoner.representative import Knowledge, class_row, pack

DIGITS: Final = Decimal("0.000001")


@dataclass(frozen=True, slots=True, eq=False)
class Candidates:
    """What may stand in: classes, and perceived instances with what they hold.

    Attributes
    ----------
    names, iris : sequences of n str
        Ascending by name. Where all classes are candidates, the tool is among them; it is left out
        when they are ranked.
    bits : (n, q) bool array
        O_rp of a class; the physical qualities an instance holds. Graded: those had to any degree.
    packed : (n, w) uint64 array, or Grades of n things
        The same, packed; graded, the degrees.
    rows : (n,) int64 array
        Row of the class among `Knowledge.classes`; -1 for an instance.
    same_class : (n,) bool array
        Whether it is an instance of the missing tool's class.
    """

    names: Sequence[str]
    iris: Sequence[str]
    bits: NDArray[np.bool_]
    packed: NDArray[np.uint64] | Grades
    rows: NDArray[np.int64]
    same_class: NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class Instance:
    """A perceived instance: its names, its class's IRI, and the degree to which it holds each quality."""

    name: str
    iri: str
    object_class: str
    held: dict[str, Decimal]


def gather(
    kb: KnowledgeBase,
    known: Knowledge,
    index: Index | GradedIndex,
    tool: int,
    available: Sequence[str] | None,
    instances: Sequence[str],
) -> Candidates:
    """Return what may stand in for the class in the tool's row.

    Raises
    ------
    UnknownNameError
        If the knowledge base does not know a name.
    InputError
        If nothing is available.
    """
    if isinstance(available, str) or isinstance(instances, str):
        raise InputError("available and instances take lists of names, not one string")
    packed = index.classes if isinstance(index, GradedIndex) else index.body
    if available is None and not instances:
        everything = np.arange(len(known.classes.iris))
        if len(everything) == 1:
            raise InputError(
                f"{known.classes.names[tool]!r} is the only class known: there is nothing to choose from"
            )
        return Candidates(
            known.classes.names, known.classes.iris, index.body_bits, packed, everything, everything < 0
        )
    named = {class_row(kb, known, name) for name in available or ()}
    rows = np.array(sorted(named - {tool}), dtype=np.int64)
    if not len(rows) and not instances:
        raise InputError(f"nothing is available but {known.classes.names[tool]!r} itself: name other things")
    names = [known.classes.names[row] for row in rows.tolist()]
    iris = [known.classes.iris[row] for row in rows.tolist()]
    chosen = packed.only(rows) if isinstance(packed, Grades) else packed[rows]
    found = Candidates(names, iris, index.body_bits[rows], chosen, rows, np.zeros(len(rows), dtype=bool))
    wanted = dict.fromkeys(kb.resolve(name, "instance") for name in instances)
    read = perceived if isinstance(index, GradedIndex) else _held
    extra = [_instance(kb, iri, read(kb, iri)) for iri in wanted]
    return _joined(known, index, found, extra, known.classes.iris[tool]) if extra else found


def _joined(
    known: Knowledge, index: Index | GradedIndex, classes: Candidates, extra: Sequence[Instance], tool: str
) -> Candidates:
    """Return classes and instances together, by name."""
    names = [*classes.names, *(one.name for one in extra)]
    iris = [*classes.iris, *(one.iri for one in extra)]
    same = np.concatenate([classes.same_class, [one.object_class == tool for one in extra]])
    rows = np.concatenate([classes.rows, np.full(len(extra), -1)])
    order = sorted(range(len(names)), key=names.__getitem__)
    physical = index.layout.physical if isinstance(index, GradedIndex) else index.body_mask
    holds = [[q.iri in one.held for q in known.qualities] for one in extra]
    bits = np.vstack([classes.bits, np.array(holds, dtype=bool) & physical])[order]
    packed: NDArray[np.uint64] | Grades = pack(bits)
    if isinstance(index, GradedIndex) and isinstance(classes.packed, Grades):
        packed = classes.packed
        for one in extra:
            packed = packed.join(held_grades(known, one.held, index.layout))
        packed = packed.only(order)
    return Candidates(
        [names[at] for at in order], [iris[at] for at in order], bits, packed, rows[order], same[order]
    )


def perceived(kb: KnowledgeBase, iri: str) -> dict[str, Decimal]:
    """Return the degree to which an instance holds qualities, by IRI, rounded half-even to 6 places.

    It is the mean over the values of the property; an instance without values holds what it holds wholly.
    """
    degrees = {
        str(row["quality"]): Decimal(str(row["count"])) / Decimal(str(row["total"]))
        for row in kb.ask("instance_memberships", instances=[iri])
    }
    if not degrees:
        return _held(kb, iri)
    return {quality: degree.quantize(DIGITS, ROUND_HALF_EVEN) for quality, degree in degrees.items()}


def _held(kb: KnowledgeBase, iri: str) -> dict[str, Decimal]:
    return {str(row["quality"]): Decimal(1) for row in kb.ask("instance_qualities", instances=[iri])}


def _instance(kb: KnowledgeBase, iri: str, held: dict[str, Decimal]) -> Instance:
    rows = kb.ask("instance", instance=iri)
    if not rows:
        raise InputError(f"{local_name(iri)!r} or its class has no English label: run `ersatz check`")
    row = rows[0]
    return Instance(str(row["name"]), iri, str(row["class"]), held)
