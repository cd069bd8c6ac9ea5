"""Counts to triples: each thing the knowledge base holds, as lines of N-Triples.

Every function here is pure: the same knowledge gives the same lines. An update is therefore the
difference between the lines of the old and the new knowledge of what changed.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import lru_cache
from hashlib import sha256
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ersatz.grounding.attribution import Attribution, most_held
from ersatz.grounding.conceptualization import Counts
from ersatz.grounding.subcategorization import Qualities
from ersatz.grounding.units import ObservationUnit, Units, unit_values
from ersatz.knowledge import vocabulary as v
from ersatz.knowledge.names import (
    class_iri,
    class_name,
    distinct,
    local_name,
    model_iri,
    snake_iri,
    snake_name,
)
from ersatz.knowledge.terms import (
    decimal,
    degree,
    degree_text,
    english,
    finite,
    individual,
    integer,
    iri,
    proportion_text,
    text,
)
from ersatz.measurements import ORIGINS, Column, Kind, Measurements, Property, Source

BUILD: Final = iri(v.KB + "build_1")
_INDIVIDUAL: Final = str(v.NAMED_INDIVIDUAL)
_LABEL: Final = str(v.LABEL)
_DECIMAL: Final = f"^^<{v.XSD}decimal>"
# As text once: entries are most of a large knowledge base.
_ENTRY, _HAS_ENTRY, _QUALITY, _COUNT, _TOTAL, _PROPORTION, _REPRESENTATIVE = (
    str(term)
    for term in (
        v.ENTRY,
        v.HAS_ENTRY,
        v.QUALITY,
        v.COUNT,
        v.TOTAL,
        v.PROPORTION,
        v.REPRESENTATIVE_QUALITY,
    )
)


@dataclass(frozen=True, slots=True)
class BuildRecord:
    """How a knowledge base came about; metadata, not knowledge.

    Attributes
    ----------
    unit : ObservationUnit
    theta : Fraction
        The representative threshold at which `ersatz:representativeQuality` is written down.
    clusters, seed : int
    settings : str
        All settings of the build as JSON.
    software : str
        Version of ERSATZ.
    time : str or None
        xsd:dateTime of the build; only where asked for, since it makes every build different.
    sources : tuple of Source
    """

    unit: ObservationUnit = ObservationUnit.INSTANCE
    theta: Fraction = Fraction(35, 100)
    clusters: int = 4
    seed: int = 0
    settings: str = "{}"
    software: str = ""
    time: str | None = None
    sources: tuple[Source, ...] = field(default=())


def knowledge(
    measurements: Measurements,
    units: Units,
    attribution: Attribution,
    counts: Counts,
    record: BuildRecord,
    *,
    classes_only: bool = False,
) -> Iterator[str]:
    """Yield the whole knowledge base but for its revision, one triple a line."""
    distinct(named(measurements, counts, classes_only=classes_only))
    yield from _header()
    yield from _build(record)
    for prop in (quality.property for quality in counts.qualities):
        yield from _property(prop)
    for quality in counts.qualities:
        yield from _qualities(quality)
    for row in range(len(counts.classes)):
        yield from class_knowledge(counts, row, record.theta)
    for row in range(len(counts.functions)):
        yield from function_knowledge(counts, row, record.theta)
    if not classes_only:
        yield from instance_knowledge(measurements, units, attribution)


def class_knowledge(counts: Counts, row: int, theta: Fraction) -> Iterator[str]:
    """Yield one class and its model <O, t, m>; nothing for a class without a unit."""
    label = counts.classes[row]
    if not counts.units[row]:
        return
    local, concept = class_name(label), iri(class_iri(label))
    model = iri(model_iri(label))
    yield from _node(
        concept,
        (v.TYPE, v.OWL_CLASS),
        (v.SUBCLASS_OF, v.OBJECT),
        (v.LABEL, english(label)),
    )
    yield from individual(model, v.CLASS_MODEL, f"what is known of {label}")
    yield f"{model} {v.DESCRIBES_CLASS} {concept} .\n"
    yield f"{model} {v.INSTANCE_COUNT} {integer(int(counts.units[row]))} .\n"
    yield from _entries(
        model, local, label, counts, counts.class_counts[row], counts.class_totals[row], theta
    )


def function_knowledge(counts: Counts, row: int, theta: Fraction) -> Iterator[str]:
    """Yield one function model <f, p, d>, of physical qualities; nothing if no unit holds f."""
    name = counts.functions[row]
    if not counts.function_totals[row].any():
        return
    model = iri(f"{v.KB}model_{snake_name(name)}")
    yield from individual(model, v.FUNCTION_MODEL, f"what goes with {name}")
    yield f"{model} {v.FOR_FUNCTION} {iri(snake_iri(name))} .\n"
    observed, totals = counts.function_counts[row], counts.function_totals[row]
    yield from _entries(model, snake_name(name), name, counts, observed, totals, theta)


def instance_knowledge(measurements: Measurements, units: Units, attribution: Attribution) -> Iterator[str]:
    """Yield every instance, what it holds, and what was measured of it."""
    for instance, label in zip(
        measurements.instances.tolist(), measurements.instance_class.tolist(), strict=True
    ):
        yield from individual(iri(snake_iri(instance)), iri(class_iri(measurements.classes[label])), instance)
    columns = {column.property.name: column for column in measurements.columns}
    for quality, held in zip(attribution.qualities, attribution.held, strict=True):
        column = columns.get(quality.property.name)
        if column is None:
            continue
        qualities = [iri(snake_iri(name)) for name in quality.names]
        labels = most_held(held)
        pairs = sorted({(int(units.instance[u]), int(labels[u])) for u in np.flatnonzero(labels >= 0)})
        for instance_index, rank in pairs:
            instance = snake_iri(str(measurements.instances[instance_index]))
            yield f"{iri(instance)} {v.HOLDS} {qualities[rank]} .\n"
        if units.kind is ObservationUnit.INSTANCE:
            yield from _means(column, measurements, units, held, qualities)
        yield from _observations(column, measurements, units.kind, quality, qualities)


def revision_of(lines: Iterable[str], start: int = 0) -> int:
    """Return the sum of the SHA-256 of all lines that state knowledge, modulo 2^256.

    The sum does not depend on the order, and an update changes it by what it adds and takes away.
    """
    digests = b"".join([sha256(line.encode()).digest() for line in lines if is_knowledge(line)])
    words = np.frombuffer(digests, dtype=">u4").reshape(-1, 8).sum(axis=0, dtype=np.uint64)
    for place, word in enumerate(reversed(words)):
        start += int(word) << 32 * place
    return start % (1 << 256)


def is_knowledge(line: str) -> bool:
    """Tell whether a triple says something of the world; labels and build records do not."""
    _, predicate, value = line.split(" ", 2)
    return predicate in _KNOWLEDGE or (predicate == _TYPE and not value.startswith(_SCHEMA))


def revision_line(revision: int) -> str:
    """Return the triple that states the revision."""
    return f"{BUILD} {v.REVISION} {text(f'{revision:064x}')} .\n"


_TYPE: Final = str(v.TYPE)
_SCHEMA: Final = (f"<{v.OWL}", f"<{v.ERSATZ}")
_KNOWLEDGE: Final = frozenset(
    map(
        str,
        (
            v.SUBCLASS_OF,
            v.DESCRIBES_CLASS,
            v.FOR_FUNCTION,
            v.HAS_ENTRY,
            v.QUALITY,
            v.COUNT,
            v.TOTAL,
            v.INSTANCE_COUNT,
            v.HOLDS,
            v.HAS_MEASUREMENT,
            v.MEASURED_PROPERTY,
            v.ASSIGNED_QUALITY,
            v.HAS_ASSIGNMENT,
            v.DEGREE,
            v.RAW_VALUE,
            v.HAS_COORDINATE,
            v.ON_AXIS,
            v.COORDINATE,
            v.OBSERVATION,
            v.ORIGIN,
            v.QUALITY_OF,
            v.RANK,
            v.CENTROID,
            v.LOWER_BOUND,
            v.UPPER_BOUND,
            v.UNIT,
            v.HAS_AXIS,
            v.POSITION,
            v.FUZZIFIER,
            v.HAS_NORM_ELEMENT,
            v.ROW_AXIS,
            v.COLUMN_AXIS,
            v.ELEMENT,
        ),
    )
)


def _node(subject: str, *pairs: tuple[object, object]) -> Iterator[str]:
    for predicate, value in pairs:
        yield f"{subject} {predicate} {value} .\n"


def _header() -> Iterator[str]:
    yield from _node(
        str(v.KB_ONTOLOGY),
        (v.TYPE, v.OWL_ONTOLOGY),
        (v.IMPORTS, v.ONTOLOGY),
        (v.TITLE, english("What stands in for a missing tool: a grounded knowledge base")),
    )


def _build(record: BuildRecord) -> Iterator[str]:
    yield from individual(BUILD, v.KNOWLEDGE_BUILD, "the build of this knowledge base")
    yield from _node(
        BUILD,
        (v.FORMAT, integer(v.FORMAT_VERSION)),
        (v.OBSERVATION_UNIT, text(record.unit)),
        (v.THETA, decimal(finite(record.theta))),
        (v.CLUSTERS, integer(record.clusters)),
        (v.SEED, integer(record.seed)),
        (v.SETTINGS, text(record.settings)),
        (v.SOFTWARE_VERSION, text(record.software)),
    )
    if record.time:
        yield f'{BUILD} {v.ENDED_AT} "{record.time}"^^<{v.XSD}dateTime> .\n'
    for source in record.sources:
        yield f"{BUILD} {v.USED_SOURCE} {source_iri(source)} .\n"
        yield from source_lines(source)


def source_iri(source: Source) -> str:
    """Return the IRI of a source in N-Triples; its content tells two files of one name apart."""
    return iri(f"{v.KB}source_{snake_name(source.name)}{'_' + source.sha256[:8] if source.sha256 else ''}")


def source_lines(source: Source) -> Iterator[str]:
    """Yield a source: its file name, content hash and credit."""
    subject = source_iri(source)
    yield from individual(subject, v.SOURCE_CLASS, source.name)
    yield f"{subject} {v.FILE_NAME} {text(source.name)} .\n"
    if source.sha256:
        yield f"{subject} {v.SHA256} {text(source.sha256)} .\n"
    if source.credit:
        yield f"{subject} {v.CREDIT} {text(source.credit)} .\n"


def _property(prop: Property) -> Iterator[str]:
    subject = iri(snake_iri(prop.name))
    physical = prop.kind is Kind.PHYSICAL
    yield from individual(subject, v.PHYSICAL_PROPERTY if physical else v.FUNCTIONAL_PROPERTY, prop.label)
    yield f"{subject} {v.UNIT} {text(prop.unit)} .\n"
    for predicate, words in (
        (v.ADJECTIVE, prop.adjective),
        (v.ORIENTATION, prop.orientation),
        (v.COMMENT, prop.definition),
    ):
        if words:
            yield f"{subject} {predicate} {english(words)} .\n"
    for position, component in enumerate(prop.components, start=1):
        axis = _axis(prop, component)
        yield f"{subject} {v.HAS_AXIS} {axis} .\n"
        yield from individual(axis, v.AXIS, component)
        yield f"{axis} {v.POSITION} {integer(position)} .\n"


def _axis(prop: Property, component: str) -> str:
    return iri(f"{snake_iri(prop.name)}-{snake_name(component)}")


def _qualities(qualities: Qualities) -> Iterator[str]:
    prop = qualities.property
    type_ = v.PHYSICAL_QUALITY if prop.kind is Kind.PHYSICAL else v.FUNCTIONAL_QUALITY
    bounds = (None, *qualities.bounds, None)
    for rank, (name, centroid) in enumerate(zip(qualities.names, qualities.centroids, strict=True), start=1):
        subject = iri(snake_iri(name))
        yield from individual(subject, type_, name)
        yield f"{subject} {v.QUALITY_OF} {iri(snake_iri(prop.name))} .\n"
        yield f"{subject} {v.RANK} {integer(rank)} .\n"
        yield f"{subject} {v.METHOD} {text(qualities.method)} .\n"
        yield f"{subject} {v.WAS_GENERATED_BY} {BUILD} .\n"
        if qualities.fuzzy:
            yield f"{subject} {v.FUZZIFIER} {decimal(qualities.fuzzifier)} .\n"
        if qualities.norms is not None:
            yield from _norm(snake_iri(name), prop, qualities.norms[rank - 1])
        if prop.components:
            yield from _coordinates(snake_iri(name), prop, centroid.tolist())
            continue
        yield f"{subject} {v.CENTROID} {decimal(float(centroid[0]))} .\n"
        for predicate, bound in ((v.LOWER_BOUND, bounds[rank - 1]), (v.UPPER_BOUND, bounds[rank])):
            if bound is not None:
                yield f"{subject} {predicate} {decimal(bound)} .\n"


def _norm(owner: str, prop: Property, norm: NDArray[np.float64]) -> Iterator[str]:
    """Yield the symmetric matrix of a quality's distances, its diagonal and what is above."""
    for row, one in enumerate(prop.components):
        for column, other in list(enumerate(prop.components))[row:]:
            value = float(norm[row, column])
            subject = iri(f"{owner}-{snake_name(one)}-{snake_name(other)}")
            yield f"{iri(owner)} {v.HAS_NORM_ELEMENT} {subject} .\n"
            yield from individual(subject, v.NORM_ELEMENT, f"{one} by {other} = {value:.4g}")
            yield f"{subject} {v.ROW_AXIS} {_axis(prop, one)} .\n"
            yield f"{subject} {v.COLUMN_AXIS} {_axis(prop, other)} .\n"
            yield f"{subject} {v.ELEMENT} {decimal(value)} .\n"


def _coordinates(owner: str, prop: Property, values: Sequence[float]) -> Iterator[str]:
    for component, value in zip(prop.components, values, strict=True):
        subject = iri(f"{owner}-{snake_name(component)}")
        yield f"{iri(owner)} {v.HAS_COORDINATE} {subject} .\n"
        yield from individual(subject, v.COORDINATE_CLASS, f"{component} = {value:.4g}")
        yield f"{subject} {v.ON_AXIS} {_axis(prop, component)} .\n"
        yield f"{subject} {v.COORDINATE} {decimal(value)} .\n"


def _entries(
    model: str,
    local: str,
    label: str,
    counts: Counts,
    observed: np.ndarray[tuple[int], np.dtype[np.int64]],
    totals: np.ndarray[tuple[int], np.dtype[np.int64]],
    theta: Fraction,
) -> Iterator[str]:
    columns = _columns(counts.qualities)
    opening = english(label).removesuffix('"@en')
    all_totals = totals.tolist()
    for (owner, name, quality), count in zip(columns, observed.tolist(), strict=True):
        if not count:
            continue
        total = all_totals[owner]
        entry = f"<{v.KB}{local}__{name}>"
        few, all_, proportion = degree_text(count), degree_text(total), proportion_text(count, total)
        yield f"{model} {_HAS_ENTRY} {entry} .\n"
        yield f"{entry} {_TYPE} {_INDIVIDUAL} .\n"
        yield f"{entry} {_TYPE} {_ENTRY} .\n"
        yield f'{entry} {_LABEL} {opening}: {name} = {proportion} ({few} of {all_})"@en .\n'
        yield f"{entry} {_QUALITY} {quality} .\n"
        yield f'{entry} {_COUNT} "{few}"{_DECIMAL} .\n'
        yield f'{entry} {_TOTAL} "{all_}"{_DECIMAL} .\n'
        yield f'{entry} {_PROPORTION} "{proportion}"{_DECIMAL} .\n'
        if count * theta.denominator >= theta.numerator * total:
            yield f"{model} {_REPRESENTATIVE} {quality} .\n"


@lru_cache(maxsize=8)
def _columns(qualities: tuple[Qualities, ...]) -> tuple[tuple[int, str, str], ...]:
    """Return the row of the property, the local name and the IRI in N-Triples of every quality."""
    return tuple(
        (owner, snake_name(name), iri(snake_iri(name)))
        for owner, quality in enumerate(qualities)
        for name in quality.names
    )


def _means(
    column: Column,
    measurements: Measurements,
    units: Units,
    held: NDArray[np.int8] | NDArray[np.int64],
    qualities: Sequence[str],
) -> Iterator[str]:
    """Yield the value of each instance with named observations: their mean, which holds the quality."""
    prop = column.property
    first = np.concatenate([[0], np.flatnonzero(np.diff(column.instance)) + 1, [len(column)]])
    rows, values = unit_values(column, units, measurements)
    for unit, value, start, stop in zip(rows, values, first, first[1:], strict=False):
        if measurements.observations[column.observation[start]] == "":
            continue
        name = snake_iri(str(measurements.instances[units.instance[unit]]))
        node = f"{name}__{snake_name(prop.name)}"
        origins = {int(origin) for origin in column.origin[start:stop]}
        yield from _measurement(name, node, prop, value.tolist(), f"mean of {stop - start}")
        yield from _assigned(node, held[unit : unit + 1], qualities)
        for origin in sorted(origins):
            yield f"{iri(node)} {v.ORIGIN} {v.term(ORIGINS[origin])} .\n"
        for row in range(start, stop):
            raw = _observed_iri(node, measurements.observations[column.observation[row]])
            yield f"{iri(node)} {v.WAS_DERIVED_FROM} {iri(raw)} .\n"


def _observations(
    column: Column,
    measurements: Measurements,
    kind: ObservationUnit,
    quality: Qualities,
    qualities: Sequence[str],
) -> Iterator[str]:
    """Yield every value as it was measured."""
    prop = column.property
    held = quality.held(column.values)
    for row, value in enumerate(column.values.tolist()):
        name = snake_iri(str(measurements.instances[column.instance[row]]))
        node = f"{name}__{snake_name(prop.name)}"
        observation = measurements.observations[column.observation[row]]
        if observation:
            node = _observed_iri(node, observation)
        yield from _measurement(name, node, prop, value, observation)
        if observation:
            yield f"{iri(node)} {v.OBSERVATION} {text(observation)} .\n"
        if not observation or kind is ObservationUnit.OBSERVATION:
            yield from _assigned(node, held[row : row + 1], qualities)
        yield f"{iri(node)} {v.ORIGIN} {v.term(ORIGINS[column.origin[row]])} .\n"
        yield f"{iri(node)} {v.SOURCE} {source_iri(measurements.sources[column.source[row]])} .\n"


def _assigned(
    node: str, held: NDArray[np.int8] | NDArray[np.int64], qualities: Sequence[str]
) -> Iterator[str]:
    """Yield the quality a value belongs to most and, of fuzzy ones, every degree above 0."""
    yield f"{iri(node)} {v.ASSIGNED_QUALITY} {qualities[int(most_held(held)[0])]} .\n"
    if held.ndim == 1:
        return
    for quality, part in zip(qualities, held[0].tolist(), strict=True):
        if not part:
            continue
        name = local_name(quality[1:-1])
        subject = iri(f"{node}-{name}")
        yield f"{iri(node)} {v.HAS_ASSIGNMENT} {subject} .\n"
        yield from individual(subject, v.ASSIGNMENT, f"{name} to {degree_text(part)}")
        yield f"{subject} {v.QUALITY} {quality} .\n"
        yield f"{subject} {v.DEGREE} {degree(part)} .\n"


def _observed_iri(node: str, observation: str) -> str:
    return f"{node}__{snake_name(observation).lstrip('_')}"


def _measurement(
    instance: str, node: str, prop: Property, value: Sequence[float], note: str
) -> Iterator[str]:
    subject = iri(node)
    unit = "" if prop.unit == "1" else f" {prop.unit}"
    shown = " x ".join(f"{component:.4g}" for component in value)
    yield f"{iri(instance)} {v.HAS_MEASUREMENT} {subject} .\n"
    yield from individual(
        subject, v.MEASUREMENT, f"{prop.label} = {shown}{unit}{f' ({note})' if note else ''}"
    )
    yield f"{subject} {v.MEASURED_PROPERTY} {iri(snake_iri(prop.name))} .\n"
    if prop.components:
        yield from _coordinates(node, prop, value)
    else:
        yield f"{subject} {v.RAW_VALUE} {decimal(value[0])} .\n"


def named(
    measurements: Measurements, counts: Counts, *, classes_only: bool = False
) -> Iterator[tuple[str, str]]:
    """Yield every IRI that a label of the user's gives, and what it names."""
    yield f"{v.KB}build_1", "the build"
    for source in measurements.sources:
        yield source_iri(source)[1:-1], f"source {source.name!r}"
    for label in counts.classes:
        yield class_iri(label), f"class {label!r}"
        yield model_iri(label), f"the model of class {label!r}"
    for function in counts.functions:
        yield f"{v.KB}model_{snake_name(function)}", f"the model of {function!r}"
    for quality in counts.qualities:
        prop = quality.property
        yield snake_iri(prop.name), f"property {prop.name!r}"
        for component in prop.components:
            yield (
                f"{snake_iri(prop.name)}-{snake_name(component)}",
                f"component {component!r} of {prop.name!r}",
            )
        for name in quality.names:
            yield snake_iri(name), f"quality {name!r}"
            if quality.fuzzy:  # <measurement>-<quality> is a degree, <measurement>-<component> a coordinate
                yield f"{snake_iri(prop.name)}-{snake_name(name)}", f"a degree of {name!r}"
    if not classes_only:
        for instance in measurements.instances.tolist():
            yield snake_iri(instance), f"instance {instance!r}"
        for observation in measurements.observations:
            if observation:
                yield f"observation {snake_name(observation)}", f"observation {observation!r}"
