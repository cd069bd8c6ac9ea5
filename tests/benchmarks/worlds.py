"""Worlds of any size for benchmarks: classes, their objects, and what was measured of them."""

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from ersatz.grounding.attribution import attribute
from ersatz.grounding.conceptualization import conceptualize
from ersatz.grounding.units import find_units
from ersatz.knowledge.builds import BuildRecord
from ersatz.knowledge.writer import knowledge
from ersatz.measurements import Column, Measurements, Source
from tests.making import prop, ranked

RANKS = 4
SAME = 0.8
"""Share of the objects of a class that hold what is typical of it."""


@dataclass(frozen=True, slots=True)
class World:
    """How large a world is.

    Attributes
    ----------
    classes, instances : int
        Classes, and instances of each.
    physical, functional : int
        Properties; every instance has a value of each, from one observation.
    """

    classes: int
    instances: int = 10
    physical: int = 2
    functional: int = 1

    def __str__(self) -> str:
        """Return its size in words."""
        properties = self.physical + self.functional
        return (
            f"{self.classes:,} classes, {self.classes * self.instances:,} instances, {properties} properties"
        )

    def measurements(self) -> Measurements:
        """Return the measurements: the ranks 1 to 4, a little off, by a seeded draw."""
        rng = np.random.default_rng(0)
        owner = np.repeat(np.arange(self.classes, dtype=np.int32), self.instances)
        n = len(owner)
        names = [prop(f"body_{at}") for at in range(self.physical)]
        names += [prop(f"use_{at}", "functional") for at in range(self.functional)]
        typical = rng.integers(1, RANKS + 1, (self.classes, len(names)))
        for at in range(self.functional):  # what a thing is for goes with what it is like
            typical[:, self.physical + at] = typical[:, at % self.physical]
        columns = []
        for at, property_ in enumerate(names):
            ranks = np.where(rng.random(n) < SAME, typical[owner, at], rng.integers(1, RANKS + 1, n))
            values = np.round(ranks + rng.uniform(-0.3, 0.3, n), 4)[:, None]
            zeros = np.zeros(n, dtype=np.int32)
            rows = np.arange(n, dtype=np.int32)
            columns.append(Column(property_, rows, zeros, values, zeros.astype(np.int8), zeros))
        labels = [f"thing {at:07}" for at in range(self.classes)]
        objects = [f"thing {at // self.instances:07} no {at % self.instances:04}" for at in range(n)]
        return Measurements(
            tuple(labels),
            np.array(objects, dtype=np.dtypes.StringDType()),
            owner,
            ("",),
            (Source("fleet.parquet", "ab" * 32),),
            tuple(sorted(columns, key=lambda column: column.property.name)),
        )

    def lines(self, *, classes_only: bool = False) -> Iterator[str]:
        """Yield the knowledge base of this world, grounded by given cut points."""
        measured = self.measurements()
        record = BuildRecord(theta=Fraction(35, 100), sources=measured.sources)
        units = find_units(measured, record.unit)
        properties = [column.property for column in measured.columns]
        attribution = attribute(measured, ranked(properties, RANKS), units)
        counts = conceptualize(attribution, measured.classes)
        yield from knowledge(measured, units, attribution, counts, record, classes_only=classes_only)
