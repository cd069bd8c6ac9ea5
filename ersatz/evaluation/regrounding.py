"""Grounding in memory, again and again: the values of objects to what the reasoner reads, without a store.

The steps are those of the pipeline; only the triples between counting and reasoning are left out.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ersatz.grounding.attribution import Attribution
from ersatz.grounding.conceptualization import Counts, conceptualize
from ersatz.grounding.subcategorization import Qualities, SubcategorizationSettings, learn_qualities
from ersatz.grounding.units import ObservationUnit, find_units, unit_values
from ersatz.measurements import Block, Kind, Measurements, Property
from ersatz.reasoner.quantised import build_graded, compare_graded, graded_relevance
from ersatz.reasoner.relevance import ReasonerSettings, build_index, relevance
from ersatz.reasoner.representative import Knowledge, Memberships, QualityTerm, pack
from ersatz.reasoner.similarity import compare


@dataclass(frozen=True, slots=True, eq=False)
class Objects:
    """Objects with the mean value of each property.

    Attributes
    ----------
    classes : tuple of c str, ascending
    of_class : (u,) int32 array
        Row of each object's class.
    values : mapping of property name to (u, d) float64 array, in the property's unit
        nan throughout where nothing was measured.
    properties : mapping of name to Property, ascending by name
    """

    classes: tuple[str, ...]
    of_class: NDArray[np.int32]
    values: Mapping[str, NDArray[np.float64]]
    properties: Mapping[str, Property]

    @classmethod
    def of(cls, blocks: Sequence[Block]) -> "Objects":
        """Return the objects of blocks of measurements."""
        measurements = Measurements.collect(blocks)
        units = find_units(measurements, ObservationUnit.INSTANCE)
        of_class = measurements.instance_class[units.instance]
        values, properties = {}, {}
        for column in sorted(measurements.columns, key=lambda one: one.property.name):
            rows, found = unit_values(column, units, measurements)
            every = np.full((len(of_class), found.shape[1]), np.nan)
            every[rows] = found
            values[column.property.name], properties[column.property.name] = every, column.property
        return cls(tuple(measurements.classes), of_class, values, properties)

    def take(self, rows: NDArray[np.int64]) -> "Objects":
        """Return some of the objects, each as often as it is named."""
        values = {name: one[rows] for name, one in self.values.items()}
        return Objects(self.classes, self.of_class[rows], values, self.properties)

    def resampled(self, seed: int, times: int = 1) -> "Objects":
        """Return so many times as many objects of each class, drawn with replacement."""
        chance = np.random.default_rng(seed)
        rows = [np.flatnonzero(self.of_class == row) for row in range(len(self.classes))]
        return self.take(np.concatenate([chance.choice(of, times * len(of)) for of in rows]))


def learn(objects: Objects, settings: SubcategorizationSettings) -> tuple[Qualities, ...]:
    """Return the qualities of every property."""
    found = []
    for name, prop in objects.properties.items():
        values = objects.values[name]
        found.append(learn_qualities(values[~np.isnan(values[:, 0])], prop, settings))
    return tuple(found)


def reground(objects: Objects, qualities: Sequence[Qualities]) -> Knowledge:
    """Return what the reasoner would read of a knowledge base of the objects with these qualities."""
    sizes = np.cumsum([len(quality.names) for quality in qualities])[:-1]
    held = tuple(np.split(held_degrees(objects, qualities), sizes, axis=1))
    return _knowledge(conceptualize(Attribution(tuple(qualities), objects.of_class, held), objects.classes))


def held_degrees(objects: Objects, qualities: Sequence[Qualities]) -> NDArray[np.int64]:
    """Return (u, q): how far each object holds each quality, in millionths of a degree."""
    parts = []
    for quality in qualities:
        values = objects.values[quality.property.name]
        known = ~np.isnan(values[:, 0])
        degrees = np.zeros((len(values), len(quality.names)), dtype=np.int64)
        degrees[known] = quality.degrees(values[known])
        parts.append(degrees)
    return np.hstack(parts)


def similarities(knowledge: Knowledge, settings: ReasonerSettings) -> NDArray[np.float64]:
    """Return (c, c): how similar each class (column) is to each missing tool (row); 0 if undetermined."""
    every = range(len(knowledge.classes.names))
    rows = []
    if settings.graded:
        graded = build_graded(knowledge, settings)
        for row in every:
            wanted = graded_relevance(graded, row, settings)
            assert wanted.demand is not None
            above, below = compare_graded(wanted.demand, graded.classes, settings)
            rows.append(above / below * wanted.determined)
    else:
        index = build_index(knowledge, settings)
        for row in every:
            found = relevance(index, row, settings)
            above, below = compare(pack(found.physical), index.body, settings.similarity)
            rows.append(above / below * found.determined)
    return np.array(rows)


def accepted(knowledge: Knowledge, settings: ReasonerSettings) -> NDArray[np.bool_]:
    """Return (c, c): whether each class stands in for each missing tool; rounded as similarities are."""
    return similarities(knowledge, settings) > float(settings.tolerance)


def _knowledge(counts: Counts) -> Knowledge:
    terms, sizes = [], [len(quality.names) for quality in counts.qualities]
    for quality in counts.qualities:
        prop = quality.property
        terms += [
            QualityTerm(name, name, prop.name, prop.adjective, prop.kind, rank, tuple(centroid), prop.unit)
            for rank, (name, centroid) in enumerate(
                zip(quality.names, quality.centroids.tolist(), strict=True), 1
            )
        ]
    functions = tuple(term.name for term in terms if term.kind is Kind.FUNCTIONAL)
    row = {name: at for at, name in enumerate(counts.classes)}
    totals, together = (np.repeat(of, sizes, axis=1) for of in (counts.class_totals, counts.function_totals))
    return Knowledge(
        tuple(terms),
        Memberships(counts.classes, counts.classes, counts.class_counts, totals),
        Memberships(functions, functions, counts.function_counts, together),
        counts.units,
        row,
        row,
    )
