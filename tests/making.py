"""Small tables of measurements and knowledge bases for tests, from plain Python values."""

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import TypeAlias

import numpy as np

from ersatz.grounding.attribution import attribute
from ersatz.grounding.conceptualization import conceptualize
from ersatz.grounding.subcategorization import Qualities
from ersatz.grounding.units import find_units
from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.builds import BuildRecord
from ersatz.knowledge.writer import knowledge
from ersatz.measurements import Block, Kind, Measurements, Origin, Property, Source

Row: TypeAlias = tuple[str, str, str, str, float | Sequence[float]]
"""(class, instance, observation, property, value)."""

HERE = Source("test")


def prop(name: str, kind: str = "physical", *components: str, adjective: str = "") -> Property:
    return Property(name, Kind(kind), "1", components, adjective)


def table(rows: Sequence[Row], properties: Sequence[Property]) -> Measurements:
    """Collect rows of values, each a block of its own."""
    known = {p.name: p for p in properties}
    return Measurements.collect(
        Block(known[p], [c], [i], [o], np.atleast_1d(np.array(v, dtype=float))[None], Origin.MACHINE, HERE)
        for c, i, o, p, v in rows
    )


def ranked(properties: Sequence[Property], ranks: int) -> list[Qualities]:
    """Return qualities whose centroids are their ranks, so that the value 3.0 is the third quality."""
    centroids = np.arange(1.0, ranks + 1)[:, None]
    return [Qualities(p, centroids) for p in sorted(properties, key=lambda p: p.name)]


Held: TypeAlias = Mapping[str, tuple[str, Mapping[str, int]]]
"""instance -> (class, property -> rank of the quality it holds); a property not there has no value."""


def held_kb(held: Held, properties: Sequence[Property], ranks: int) -> KnowledgeBase:
    """Return the knowledge base in memory of instances that hold exactly these qualities."""
    rows = [(c, i, "", p, float(rank)) for i, (c, ps) in held.items() for p, rank in ps.items()]
    measured = table(rows, properties)
    record = BuildRecord(theta=Fraction(35, 100), sources=measured.sources)
    units = find_units(measured, record.unit)
    attribution = attribute(measured, ranked(properties, ranks), units)
    counts = conceptualize(attribution, measured.classes)
    return KnowledgeBase.create(knowledge(measured, units, attribution, counts, record))
