"""Instances: what each holds, and what was measured of it, as lines of N-Triples."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from ersatz.grounding.attribution import Attribution, most_held
from ersatz.grounding.subcategorization import Qualities
from ersatz.grounding.units import ObservationUnit, Units, unit_values
from ersatz.knowledge import vocabulary as v
from ersatz.knowledge.builds import source_iri
from ersatz.knowledge.names import class_iri, local_name, snake_iri, snake_name
from ersatz.knowledge.qualities import coordinate_lines
from ersatz.knowledge.terms import decimal, degree, degree_text, individual, iri, text
from ersatz.measurements import ORIGINS, Column, Measurements, Property


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
        yield from coordinate_lines(node, prop, value)
    else:
        yield f"{subject} {v.RAW_VALUE} {decimal(value[0])} .\n"


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
