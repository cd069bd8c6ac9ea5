"""Properties and their qualities as lines of N-Triples."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from ersatz.grounding.subcategorization import Qualities
from ersatz.knowledge import vocabulary as v
from ersatz.knowledge.names import snake_iri, snake_name
from ersatz.knowledge.terms import decimal, english, individual, integer, iri, text
from ersatz.measurements import Kind, Property


def property_lines(prop: Property) -> Iterator[str]:
    """Yield a property and its axes."""
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


def quality_lines(qualities: Qualities) -> Iterator[str]:
    """Yield the qualities of a property and where its values were cut."""
    prop = qualities.property
    type_ = v.PHYSICAL_QUALITY if prop.kind is Kind.PHYSICAL else v.FUNCTIONAL_QUALITY
    bounds = (None, *qualities.bounds, None)
    for rank, (name, centroid) in enumerate(zip(qualities.names, qualities.centroids, strict=True), start=1):
        subject = iri(snake_iri(name))
        yield from individual(subject, type_, name)
        yield f"{subject} {v.QUALITY_OF} {iri(snake_iri(prop.name))} .\n"
        yield f"{subject} {v.RANK} {integer(rank)} .\n"
        yield f"{subject} {v.METHOD} {text(qualities.method)} .\n"
        yield f"{subject} {v.WAS_GENERATED_BY} {v.BUILD} .\n"
        if qualities.fuzzy:
            yield f"{subject} {v.FUZZIFIER} {decimal(qualities.fuzzifier)} .\n"
        if qualities.norms is not None:
            yield from _norm(snake_iri(name), prop, qualities.norms[rank - 1])
        if prop.components:
            yield from coordinate_lines(snake_iri(name), prop, centroid.tolist())
            continue
        yield f"{subject} {v.CENTROID} {decimal(float(centroid[0]))} .\n"
        for predicate, bound in ((v.LOWER_BOUND, bounds[rank - 1]), (v.UPPER_BOUND, bounds[rank])):
            if bound is not None:
                yield f"{subject} {predicate} {decimal(bound)} .\n"


def coordinate_lines(owner: str, prop: Property, values: Sequence[float]) -> Iterator[str]:
    """Yield a vector, one node a component; `owner` is an IRI."""
    for component, value in zip(prop.components, values, strict=True):
        subject = iri(f"{owner}-{snake_name(component)}")
        yield f"{iri(owner)} {v.HAS_COORDINATE} {subject} .\n"
        yield from individual(subject, v.COORDINATE_CLASS, f"{component} = {value:.4g}")
        yield f"{subject} {v.ON_AXIS} {_axis(prop, component)} .\n"
        yield f"{subject} {v.COORDINATE} {decimal(value)} .\n"


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


def _axis(prop: Property, component: str) -> str:
    return iri(f"{snake_iri(prop.name)}-{snake_name(component)}")
