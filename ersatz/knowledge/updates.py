"""Updates: observe and forget one instance. Re-grounding with the saved cut points, of what changed only.

The knowledge of the instance, its class and the function models is read back, counted anew, and the
difference between the lines of the old and the new knowledge is told in one transaction.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from decimal import Decimal
from typing import TYPE_CHECKING, Any

import numpy as np
import pyoxigraph as ox
from numpy.typing import NDArray

from ersatz.errors import InputError
from ersatz.grounding.attribution import Attribution, attribute
from ersatz.grounding.conceptualization import DEGREE, Counts, conceptualize
from ersatz.grounding.subcategorization import Qualities
from ersatz.grounding.units import ObservationUnit, Units, find_units
from ersatz.knowledge import vocabulary as v
from ersatz.knowledge.answers import value_of
from ersatz.knowledge.builds import source_lines
from ersatz.knowledge.instances import instance_knowledge
from ersatz.knowledge.memberships import class_knowledge, function_knowledge
from ersatz.knowledge.names import class_iri, distinct, local_name, model_iri, refuse_renamed, snake_iri
from ersatz.knowledge.queries import exact
from ersatz.knowledge.reader import ask_about, read_counts, read_instance, read_qualities
from ersatz.knowledge.revision import is_knowledge
from ersatz.knowledge.substitutions import all_substitution_lines
from ersatz.knowledge.terms import english
from ersatz.knowledge.writer import named
from ersatz.measurements import DIGITS, Block, Measurements, Origin, Source, out_of_range

if TYPE_CHECKING:
    from ersatz.knowledge.base import KnowledgeBase


def observe(
    kb: "KnowledgeBase",
    object_class: str,
    instance: str,
    values: Mapping[str, float | Sequence[float]],
    observation: str,
    origin: Origin,
    source: Source | None,
) -> None:
    """Add the values, one a property, to what is known of the instance."""
    known = {quality.property.name: quality for quality in kb.view(read_qualities)}
    source = source or Source("observation")
    blocks = []
    for name, value in values.items():
        prop, row = _known(name, known).property, _vector(name, value)
        wrong, allowed = out_of_range(prop, row)
        if wrong.any():
            raise InputError(f"{name!r} is {value!r}: it is {allowed}; correct the value or its unit")
        blocks.append(Block(prop, [object_class], [instance], [observation], row, origin, source))
    observe_blocks(kb, object_class, instance, blocks)


def qualities_of(kb: "KnowledgeBase", values: Mapping[str, float | Sequence[float]]) -> list[str]:
    """Return the names of the qualities that values stand for, one a property; nothing is written.

    Raises
    ------
    InputError
        If a property is not known, or a value does not fit it.
    """
    return [quality.names[int(quality.assign(row)[0])] for quality, row in _rows(kb, values)]


def degrees_of(kb: "KnowledgeBase", values: Mapping[str, float | Sequence[float]]) -> dict[str, Decimal]:
    """Return how far values stand for qualities, by their names; of crisp ones 1 each. As `qualities_of`."""
    return {
        name: Decimal(int(degree)) / DEGREE
        for quality, row in _rows(kb, values)
        for name, degree in zip(quality.names, quality.degrees(row)[0], strict=True)
        if degree
    }


def _rows(
    kb: "KnowledgeBase", values: Mapping[str, float | Sequence[float]]
) -> Iterator[tuple[Qualities, NDArray[np.float64]]]:
    """Yield the qualities of each property with its value as a (1, d) array."""
    known = {quality.property.name: quality for quality in kb.view(read_qualities)}
    for name, value in values.items():
        quality, row = _known(name, known), _vector(name, value)
        width = quality.centroids.shape[1]
        if row.shape[1] != width or not np.isfinite(row).all():
            raise InputError(f"{name} is {value!r}: give {width} finite number{'s' if width > 1 else ''}")
        yield quality, np.round(row, DIGITS)


def observe_blocks(kb: "KnowledgeBase", object_class: str, instance: str, blocks: Sequence[Block]) -> None:
    """Add blocks of values, all of one instance, to what is known of it.

    Raises
    ------
    InputError
        If a block is of another object, or its values do not fit what is known.
    """
    for block in blocks:
        others = {(str(c), str(i)) for c, i in zip(block.object_class, block.instance, strict=True)}
        if strays := sorted(others - {(object_class, instance)}):
            raise InputError(
                f"the measurements are also of {strays[0][0]} {strays[0][1]!r}: "
                f"give those of {instance!r} alone"
            )
    qualities = kb.view(read_qualities)
    old = read_instance(kb, instance, qualities)
    if old is not None and (known := str(old.instances[0])) != instance:
        raise InputError(f"instance {instance!r} would be called like {known!r}: use that name")
    new = Measurements.collect([*(old.blocks() if old else ()), *blocks])
    _replace(kb, qualities, old, new)


def forget(kb: "KnowledgeBase", instance: str) -> None:
    """Take the instance out of the counts, and away."""
    qualities = kb.view(read_qualities)
    iri = kb.resolve(instance, "instance")
    old = read_instance(kb, iri, qualities)
    if old is None:
        raise InputError(f"nothing was measured of {instance!r}: there is nothing to forget")
    _replace(kb, qualities, old, None, all_substitution_lines(kb))


def _replace(
    kb: "KnowledgeBase",
    qualities: tuple[Qualities, ...],
    old: Measurements | None,
    new: Measurements | None,
    outdated: Iterable[str] = (),
) -> None:
    """Count and write the difference between two states of one instance."""
    some = new or old
    assert some is not None
    label = some.classes[0]
    _refuse_other_names(kb, label)
    before = read_counts(kb, qualities, label)
    after = before
    remove = list(outdated)
    add: list[str] = []
    unit = ObservationUnit(kb.build.unit)
    if old is not None:
        units, attribution, counts = _ground(old, qualities, unit)
        after = after - counts
        remove += instance_knowledge(old, units, attribution)
    if new is not None:
        units, attribution, counts = _ground(new, qualities, unit)
        after = after + counts
        add += instance_knowledge(new, units, attribution)
        add += (line for source in new.sources for line in source_lines(source))
        _refuse_taken(kb, new, after, old)
    theta = exact(kb.build.theta)
    for lines, counts in ((remove, before), (add, after)):
        lines.extend(class_knowledge(counts, 0, theta))
        for function in _changed(before, after):
            lines.extend(function_knowledge(counts, function, theta))
    _refuse_edited(kb, after, remove)
    kb.tell(remove, add)


def _ground(
    measurements: Measurements, qualities: tuple[Qualities, ...], kind: ObservationUnit
) -> tuple[Units, Attribution, Counts]:
    units = find_units(measurements, kind)
    attribution = attribute(measurements, qualities, units)
    return units, attribution, conceptualize(attribution, measurements.classes)


def _changed(before: Counts, after: Counts) -> Iterator[int]:
    for row in range(len(before.functions)):
        if (before.function_counts[row] != after.function_counts[row]).any() or (
            before.function_totals[row] != after.function_totals[row]
        ).any():
            yield row


def _refuse_other_names(kb: "KnowledgeBase", label: str) -> None:
    """Raise if the class has another label, or another class this one."""
    for row in ask_about(kb, "class", class_iri(label)):
        refuse_renamed(class_iri(label), name := str(row["name"]), class_iri)
        if name != label:
            raise InputError(f"class {label!r} would be called like class {name!r}: use that name")
    labelled = f"{v.LABEL} {english(label)}"
    for row in kb.query(f"SELECT ?class {{ ?model {v.DESCRIBES_CLASS} ?class . ?class {labelled} }}"):
        refuse_renamed(str(row["class"]), label, class_iri)


def _refuse_taken(kb: "KnowledgeBase", new: Measurements, after: Counts, old: Measurements | None) -> None:
    """Raise if what is new would be called like something else."""
    distinct(named(new, after))
    label = new.classes[0]
    wanted = {snake_iri(str(new.instances[0])): str(new.instances[0])} if old is None else {}
    if not ask_about(kb, "class", class_iri(label)):
        wanted |= {class_iri(label): label, model_iri(label): label}
    for iri, name in wanted.items():
        if kb.query(f"ASK {{ <{iri}> a ?type }}")[0]["answer"]:
            raise InputError(f"{name!r} would be called {local_name(iri)!r}, which is taken: rename it")


def _known(name: str, known: Mapping[str, Qualities]) -> Qualities:
    if name not in known:
        raise InputError(f"property {name!r} has no qualities here: known are {', '.join(sorted(known))}")
    return known[name]


def _refuse_edited(kb: "KnowledgeBase", after: Counts, old: Iterable[str]) -> None:
    """Raise if knowledge of what changes was edited by hand: it would neither be found nor add up."""
    problem = "the knowledge base was edited by hand: {}; take the edit back, or build it again"
    if min(after.units.min(), after.class_counts.min(initial=0), after.function_counts.min(initial=0)) < 0:
        raise InputError(problem.format(f"more was measured of {after.classes[0]!r} than is counted"))
    known = ox.parse("".join(filter(is_knowledge, old)), format=ox.RdfFormat.N_TRIPLES)
    expected = {_fact(quad.triple): quad.triple for quad in known}
    things = " ".join({str(subject) for subject, _, _ in expected})
    told = kb.construct(f"CONSTRUCT {{ ?s ?p ?o }} WHERE {{ VALUES ?s {{ {things} }} ?s ?p ?o }}")
    there = {_fact(triple): triple for triple in told}
    added = (
        there[fact]
        for fact in there.keys() - expected.keys()
        if fact[1] not in (v.TYPE, v.SUBCLASS_OF) and is_knowledge(f"{there[fact]} .\n")
    )
    for triple in sorted((*(expected[fact] for fact in expected.keys() - there.keys()), *added), key=str):
        subject, predicate, value = (local_name(term.value) for term in triple)
        said = "says" if _fact(triple) in there else "does not say"
        raise InputError(problem.format(f"it {said} of {subject!r}: {predicate} {value}"))


def _fact(triple: ox.Triple) -> tuple[Any, ...]:
    """Return a triple so that numbers are equal however a server writes them."""
    value = triple.object
    same = (value.datatype, value_of(value)) if isinstance(value, ox.Literal) else value
    return triple.subject, triple.predicate, same


def _vector(name: str, value: Any) -> NDArray[np.float64]:
    try:
        row = np.atleast_1d(np.asarray(value, dtype=np.float64))
    except (TypeError, ValueError):
        raise InputError(f"{name!r} is {value!r}: give a number, or a list of numbers for a vector") from None
    if row.ndim != 1:
        raise InputError(f"{name!r} is {value!r}: give one value for one observation")
    return row[None, :]
