"""Updates: observe and forget one instance. Re-grounding with the saved cut points, of what changed only.

The knowledge of the instance, its class and the function models is read back, counted anew, and the
difference between the lines of the old and the new knowledge is told in one transaction.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from decimal import Decimal
from typing import TYPE_CHECKING, Any

import numpy as np
import pyoxigraph as ox
from numpy.typing import NDArray

from ersatz.errors import InputError
from ersatz.grounding.attribution import Attribution, attribute
from ersatz.grounding.conceptualization import Counts, conceptualize
from ersatz.grounding.subcategorization import Qualities
from ersatz.grounding.units import ObservationUnit, Units, find_units
from ersatz.knowledge import vocabulary as v
from ersatz.knowledge.names import class_iri, distinct, local_name, model_iri, snake_iri
from ersatz.knowledge.queries import Answer, Value, exact, stored_query, value_of
from ersatz.knowledge.substitutions import all_substitution_lines
from ersatz.knowledge.terms import english, millionths
from ersatz.knowledge.writer import (
    class_knowledge,
    function_knowledge,
    instance_knowledge,
    is_knowledge,
    named,
    source_lines,
)
from ersatz.measurements import DIGITS, Block, Kind, Measurements, Origin, Property, Source, out_of_range

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
    properties = {quality.property.name: quality.property for quality in read_qualities(kb)}
    source = source or Source("observation")
    blocks = []
    for name, value in values.items():
        if name not in properties:
            raise InputError(
                f"property {name!r} has no qualities here: known are {', '.join(sorted(properties))}"
            )
        row = _vector(name, value)
        wrong, allowed = out_of_range(properties[name], row)
        if wrong.any():
            raise InputError(f"{name!r} is {value!r}: it is {allowed}; correct the value or its unit")
        blocks.append(Block(properties[name], [object_class], [instance], [observation], row, origin, source))
    observe_blocks(kb, object_class, instance, blocks)


def qualities_of(kb: "KnowledgeBase", values: Mapping[str, float | Sequence[float]]) -> list[str]:
    """Return the names of the qualities that values stand for, one a property; nothing is written.

    Raises
    ------
    InputError
        If a property is not known, or a value does not fit it.
    """
    known = {quality.property.name: quality for quality in read_qualities(kb)}
    found = []
    for name, value in values.items():
        if name not in known:
            raise InputError(f"property {name!r} has no qualities here: known are {', '.join(sorted(known))}")
        row, width = _vector(name, value), known[name].centroids.shape[1]
        if row.shape[1] != width or not np.isfinite(row).all():
            raise InputError(f"{name} is {value!r}: give {width} finite number{'s' if width > 1 else ''}")
        found.append(known[name].names[int(known[name].assign(np.round(row, DIGITS))[0])])
    return found


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
    qualities = read_qualities(kb)
    old = _read_instance(kb, instance, qualities)
    if old is not None and (known := str(old.instances[0])) != instance:
        raise InputError(f"instance {instance!r} would be called like {known!r}: use that name")
    new = Measurements.collect([*(old.blocks() if old else ()), *blocks])
    _replace(kb, qualities, old, new)


def forget(kb: "KnowledgeBase", instance: str) -> None:
    """Take the instance out of the counts, and away."""
    qualities = read_qualities(kb)
    iri = kb.resolve(instance, "instance")
    old = _read_instance(kb, iri, qualities)
    if old is None:
        raise InputError(f"nothing was measured of {instance!r}: there is nothing to forget")
    _replace(kb, qualities, old, None, all_substitution_lines(kb))


def read_qualities(kb: "KnowledgeBase") -> tuple[Qualities, ...]:
    """Return the saved cut points."""
    components: dict[str, list[str]] = {}
    for row in kb.ask("axes"):
        components.setdefault(str(row["property"]), []).append(str(row["component"]))
    properties = {
        str(row["property"]): Property(
            local_name(str(row["property"])),
            Kind(str(row["kind"])),
            str(row["unit"]),
            tuple(components.get(str(row["property"]), ())),
            *(str(row[name] or "") for name in ("adjective", "orientation", "definition")),
        )
        for row in kb.ask("properties")
    }
    places: dict[str, list[Value]] = {}
    for row in kb.ask("quality_coordinates"):
        places.setdefault(str(row["quality"]), []).append(row["coordinate"])
    centroids: dict[str, list[list[float]]] = {}
    methods: dict[str, str] = {}
    fuzzifiers: dict[str, float] = {}
    for row in kb.ask("qualities"):
        name = str(row["property"])
        place = places.get(str(row["quality"])) or [row["centroid"]]
        centroids.setdefault(name, []).append([float(_number(value)) for value in place])
        methods[name] = str(row["method"] or "given")
        fuzzifiers[name] = float(_number(row["fuzzifier"] if row["fuzzifier"] is not None else 1))
    norms = _read_norms(kb) if max(fuzzifiers.values(), default=1) > 1 else {}
    return tuple(
        Qualities(properties[name], np.array(rows), methods[name], fuzzifiers[name], norms.get(name))
        for name, rows in centroids.items()
    )


def _read_norms(kb: "KnowledgeBase") -> dict[str, NDArray[np.float64]]:
    """Return the matrices of the qualities' distances by property, ranks in order."""
    found: dict[str, dict[tuple[int, int, int], float]] = {}
    for row in kb.ask("quality_norms"):
        rank, one, other = (int(_number(row[name])) - 1 for name in ("rank", "row", "column"))
        elements = found.setdefault(str(row["property"]), {})
        elements[rank, one, other] = elements[rank, other, one] = float(_number(row["element"]))
    norms = {}
    for name, elements in found.items():
        norms[name] = np.zeros(np.max([*elements], axis=0) + 1)
        norms[name][tuple(np.transpose([*elements]))] = [*elements.values()]
    return norms


def read_counts(kb: "KnowledgeBase", qualities: tuple[Qualities, ...], label: str) -> Counts:
    """Return the counts of one class, which may be new, and of all functions."""
    names = [name for quality in qualities for name in quality.names]
    owner = np.repeat(np.arange(len(qualities)), [len(quality.names) for quality in qualities])
    position = {snake_iri(name): at for at, name in enumerate(names)}
    functions = [n for q in qualities if q.property.kind is Kind.FUNCTIONAL for n in q.names]
    row_of = {snake_iri(name): at for at, name in enumerate(functions)}
    concept = class_iri(label)
    units = [int(_number(row["instances"])) for row in _row(kb, "class", concept)]

    def tables(
        rows: int, found: Iterable[Mapping[str, Value]], row_number: Mapping[str, int], key: str
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        counts = np.zeros((rows, len(names)), dtype=np.int64)
        totals = np.zeros((rows, len(qualities)), dtype=np.int64)
        for row in found:
            at, column = row_number[str(row[key])], position[str(row["quality"])]
            counts[at, column] = millionths(_number(row["count"]))
            totals[at, owner[column]] = millionths(_number(row["total"]))
        return counts, totals

    mine = [{**row, "class": concept} for row in _row(kb, "class_knowledge", concept)]
    class_counts, class_totals = tables(1, mine, {concept: 0}, "class")
    function_counts, function_totals = tables(len(functions), kb.ask("function_models"), row_of, "function")
    return Counts(
        qualities,
        (label,),
        np.array(units or [0], dtype=np.int64),
        class_counts,
        class_totals,
        function_counts,
        function_totals,
    )


def _read_instance(kb: "KnowledgeBase", name: str, qualities: tuple[Qualities, ...]) -> Measurements | None:
    """Return what was measured of an instance, exactly as it was; None if it is not known."""
    iri = name if name.startswith(v.KB) else snake_iri(name)
    known = _row(kb, "instance", iri)
    if not known:
        if kb.query(
            f"ASK {{ ?model {v.DESCRIBES_CLASS} ?class "
            f"FILTER NOT EXISTS {{ ?thing {v.HAS_MEASUREMENT} ?measurement }} }}"
        )[0]["answer"]:
            raise InputError(
                f"{kb.location!r} holds classes only: build it with instances to observe or forget one"
            )
        return None
    instance, label = str(known[0]["name"]), str(known[0]["className"])
    if len(classes := sorted({local_name(str(row["class"])) for row in known})) > 1:
        raise InputError(
            f"{instance!r} is of the classes {' and '.join(classes)}: leave it the one it was counted in"
        )
    for row in known:
        _refuse_renamed(iri, str(row["name"]), snake_iri)
        _refuse_renamed(str(row["class"]), str(row["className"]), class_iri)
    properties = {snake_iri(quality.property.name): quality.property for quality in qualities}
    vectors: dict[tuple[str, str], dict[Value, float]] = {}
    notes: dict[tuple[str, str], tuple[Origin, Source]] = {}
    for row in _row(kb, "instance_measurements", iri):
        key = (str(row["property"]), str(row["observation"] or ""))
        vectors.setdefault(key, {})[row["position"]] = float(_number(row["value"]))
        credit = Source(str(row["file"] or ""), str(row["sha256"] or ""), str(row["credit"] or ""))
        notes[key] = (Origin(local_name(str(row["origin"]))), credit)
    return Measurements.collect(
        Block(properties[key[0]], [label], [instance], [key[1]], np.array([[*vector.values()]]), *notes[key])
        for key, vector in vectors.items()
    )


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
    for row in _row(kb, "class", class_iri(label)):
        _refuse_renamed(class_iri(label), name := str(row["name"]), class_iri)
        if name != label:
            raise InputError(f"class {label!r} would be called like class {name!r}: use that name")
    labelled = f"{v.LABEL} {english(label)}"
    for row in kb.query(f"SELECT ?class {{ ?model {v.DESCRIBES_CLASS} ?class . ?class {labelled} }}"):
        _refuse_renamed(str(row["class"]), label, class_iri)
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


def _row(kb: "KnowledgeBase", query: str, iri: str) -> Answer:
    """Answer a stored question about one thing that may not be known yet."""
    parameter = next(iter(stored_query(query).parameters))
    return kb.query(stored_query(query).bind(lambda name, _: name, {parameter: iri}))


def _refuse_taken(kb: "KnowledgeBase", new: Measurements, after: Counts, old: Measurements | None) -> None:
    """Raise if what is new would be called like something else."""
    distinct(named(new, after))
    label = new.classes[0]
    wanted = {snake_iri(str(new.instances[0])): str(new.instances[0])} if old is None else {}
    if not _row(kb, "class", class_iri(label)):
        wanted |= {class_iri(label): label, model_iri(label): label}
    for iri, name in wanted.items():
        if kb.query(f"ASK {{ <{iri}> a ?type }}")[0]["answer"]:
            raise InputError(f"{name!r} would be called {local_name(iri)!r}, which is taken: rename it")


def _refuse_renamed(iri: str, label: str, named: Callable[[str], str]) -> None:
    """Raise if a label is not the one an IRI was made of: what is to be removed could not be found by it."""
    if named(label) != iri:
        raise InputError(
            f"{local_name(iri)!r} has been given the label {label!r}, of which {local_name(named(label))!r} "
            "would be made: give it back its one English rdfs:label, and say other names as skos:altLabel"
        )


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


def _number(value: Value) -> Decimal:
    if isinstance(value, Decimal | int) and not isinstance(value, bool):
        return Decimal(value)
    raise InputError(f"the knowledge base says {value!r} where a number belongs: run `ersatz check`")
