"""Grounding of data sets larger than memory: one pass to summarize, a fit, one pass to assign and count.

Summaries and counts merge exactly, so what comes out does not depend on how the data were divided or on who
worked on which part: it is what `fit_qualities` and `conceptualize` make of all values at once.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import chain, pairwise

import numpy as np

from ersatz.acquisition.engine import Engine
from ersatz.acquisition.tables.parts import Part, read_batches, sha256, source_of
from ersatz.errors import InputError
from ersatz.grounding.apart import Names, check_apart
from ersatz.grounding.attribution import Attribution, attribute
from ersatz.grounding.conceptualization import Counts, conceptualize
from ersatz.grounding.subcategorization import Qualities, SubcategorizationSettings, fit_qualities
from ersatz.grounding.summaries import Summary, merge, summarize
from ersatz.grounding.units import ObservationUnit, Units, find_units
from ersatz.measurements import Measurements, Property, Source


@dataclass(frozen=True, slots=True, eq=False)
class PartSummary:
    """What the first pass tells of a part.

    Attributes
    ----------
    sha256 : str
    names : Names or None
        None if it has no row.
    summaries : dict of property to Summary
    """

    sha256: str
    names: Names | None
    summaries: dict[Property, Summary]


@dataclass(frozen=True, slots=True, eq=False)
class Grounding:
    """What the passes over data sets leave: all that a knowledge base of classes holds.

    Attributes
    ----------
    qualities : tuple of p Qualities
    counts : Counts
    sources : tuple of Source
        One a data set.
    """

    qualities: tuple[Qualities, ...]
    counts: Counts
    sources: tuple[Source, ...]


def ground_parts(
    tables: Sequence[Sequence[Part]],
    unit: ObservationUnit,
    settings: SubcategorizationSettings,
    engine: Engine,
    progress: Callable[[str, float], None],
) -> Grounding:
    """Ground data sets, each given by its parts.

    Raises
    ------
    InputError
        If a part cannot be read, there is no value at all, or the rows of an instance are apart.
    """
    parts = list(chain.from_iterable(tables))
    names, hashes = [], []
    summaries: dict[Property, Summary] = {}
    work = partial(summarize_part, unit=unit, seed=settings.seed)
    for done, found in enumerate(engine.map(work, parts)):
        for prop, summary in found.summaries.items():
            summaries[prop] = merge(summaries[prop], summary) if prop in summaries else summary
        names.append(found.names)
        hashes.append(found.sha256)
        progress("summarizing values", 0.5 * (done + 1) / len(parts))
    check_apart(parts, names, engine)
    qualities = _fitted(summaries, settings)
    counts = _empty_counts(qualities)
    for done, more in enumerate(engine.map(partial(count_part, unit=unit, qualities=qualities), parts)):
        counts += more
        progress("assigning and counting", 0.55 + 0.4 * (done + 1) / len(parts))
    of_part = dict(zip(parts, hashes, strict=True))
    sources = [source_of((part, of_part[part]) for part in table) for table in tables]
    return Grounding(qualities, counts, tuple(sources))


def summarize_part(part: Part, unit: ObservationUnit, seed: int) -> PartSummary:
    """Return what the first pass tells of a part."""
    names: Names | None = None
    summaries: dict[Property, Summary] = {}
    for batch in read_batches(part):
        ascending = bool((batch.names[1:] > batch.names[:-1]).all())
        here = Names(batch.names[0], batch.names[-1], ascending)
        names = here if names is None else names + here
        # Names are dear, and only a sample of vectors asks for them.
        vectors = any(prop.components for prop in batch.measurements.properties)
        measurements = batch.named() if vectors else batch.measurements
        units = batch_units(measurements, unit)
        for column in measurements.columns:
            so_far = summaries.get(column.property)
            summaries[column.property] = summarize(column, units, measurements, seed, so_far)
    return PartSummary(sha256(part), names, summaries)


def count_part(part: Part, unit: ObservationUnit, qualities: tuple[Qualities, ...]) -> Counts:
    """Return the counts of a part."""
    counts = _empty_counts(qualities)
    for batch in read_batches(part):
        measurements = batch.measurements
        attribution = attribute(measurements, qualities, batch_units(measurements, unit))
        counts += conceptualize(attribution, measurements.classes)
    return counts


def batch_units(measurements: Measurements, unit: ObservationUnit) -> Units:
    """Return the units of a batch, which may hold no value."""
    if measurements.columns:
        return find_units(measurements, unit)
    return Units(unit, np.empty(0, np.int32), np.empty(0, np.int32))


def _fitted(summaries: dict[Property, Summary], settings: SubcategorizationSettings) -> tuple[Qualities, ...]:
    if not summaries:
        raise InputError(
            "no measurements: the data set holds no value at all; give a table with at least one row"
        )
    ordered = sorted(summaries, key=lambda prop: prop.name)
    for one, two in pairwise(ordered):
        if one.name == two.name:
            raise InputError(f"property {one.name!r} comes with two definitions: {one} and {two}")
    return tuple(fit_qualities(summaries[prop], prop, settings) for prop in ordered)


def _empty_counts(qualities: tuple[Qualities, ...]) -> Counts:
    held = tuple(np.empty(0, np.int8) for _ in qualities)
    return conceptualize(Attribution(qualities, np.empty(0, np.int32), held), ())
