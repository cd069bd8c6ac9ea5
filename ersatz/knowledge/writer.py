"""Counts to triples: all that a knowledge base holds, as lines of N-Triples.

The lines of each part are in a module of its own. Every function there and here is pure: the same
knowledge gives the same lines. An update is therefore the difference between the lines of the old and
the new knowledge of what changed.
"""

from collections.abc import Iterator

from ersatz.grounding.attribution import Attribution
from ersatz.grounding.conceptualization import Counts
from ersatz.grounding.units import Units
from ersatz.knowledge import vocabulary as v
from ersatz.knowledge.builds import BuildRecord, build_lines, source_iri
from ersatz.knowledge.instances import instance_knowledge
from ersatz.knowledge.memberships import class_knowledge, function_knowledge
from ersatz.knowledge.names import class_iri, distinct, model_iri, snake_iri, snake_name
from ersatz.knowledge.qualities import property_lines, quality_lines
from ersatz.knowledge.terms import english, statements
from ersatz.measurements import Measurements


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
    yield from build_lines(record)
    for prop in (quality.property for quality in counts.qualities):
        yield from property_lines(prop)
    for quality in counts.qualities:
        yield from quality_lines(quality)
    for row in range(len(counts.classes)):
        yield from class_knowledge(counts, row, record.theta)
    for row in range(len(counts.functions)):
        yield from function_knowledge(counts, row, record.theta)
    if not classes_only:
        yield from instance_knowledge(measurements, units, attribution)


def named(
    measurements: Measurements, counts: Counts, *, classes_only: bool = False
) -> Iterator[tuple[str, str]]:
    """Yield every IRI that a label of the user's gives, and what it names."""
    yield v.BUILD.value, "the build"
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


def _header() -> Iterator[str]:
    yield from statements(
        v.KB_ONTOLOGY,
        (v.TYPE, v.OWL_ONTOLOGY),
        (v.IMPORTS, v.ONTOLOGY),
        (v.TITLE, english("What stands in for a missing tool: a grounded knowledge base")),
    )
