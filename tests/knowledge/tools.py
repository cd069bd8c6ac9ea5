"""Small knowledge bases for the tests of `knowledge/`, and the ways to compare two."""

from collections.abc import Iterable, Sequence

import numpy as np

from ersatz.grounding.attribution import attribute
from ersatz.grounding.conceptualization import conceptualize
from ersatz.grounding.subcategorization import Qualities, SubcategorizationSettings
from ersatz.grounding.units import ObservationUnit, find_units
from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.builds import BuildRecord
from ersatz.knowledge.revision import is_knowledge, revision_of
from ersatz.knowledge.writer import knowledge
from ersatz.measurements import PROPERTIES, Block, Kind, Measurements, Origin, Property, Source
from ersatz.pipeline import Settings, build

SIZE, WEIGHT, RIGIDITY, SUPPORT = (PROPERTIES[name] for name in ("size", "weight", "rigidity", "support"))
Row = tuple[Property, str, str, str, tuple[float, ...]]
"""(property, class, instance, observation, value vector)"""

ROWS: Sequence[Row] = (
    (WEIGHT, "tray", "tray 1", "", (0.8,)),
    (RIGIDITY, "tray", "tray 1", "", (0.9,)),
    (SUPPORT, "tray", "tray 1", "", (0.12,)),
    (SIZE, "tray", "tray 1", "", (0.45, 0.3, 0.03)),
    (WEIGHT, "tray", "tray 2", "", (0.7,)),
    (RIGIDITY, "tray", "tray 2", "", (0.8,)),
    (SUPPORT, "tray", "tray 2", "", (0.1,)),
    (WEIGHT, "plate", "plate 1", "", (0.5,)),
    (RIGIDITY, "plate", "plate 1", "", (1.0,)),
    (SUPPORT, "plate", "plate 1", "", (0.03,)),
    (SIZE, "plate", "plate 1", "", (0.25, 0.25, 0.02)),
    (WEIGHT, "plate", "plate 2", "a", (0.45,)),
    (WEIGHT, "plate", "plate 2", "b", (0.46,)),
    (SUPPORT, "plate", "plate 2", "", (0.035,)),
    (WEIGHT, "sponge", "sponge 1", "", (0.02,)),
    (RIGIDITY, "sponge", "sponge 1", "", (0.1,)),
    (SUPPORT, "sponge", "sponge 1", "", (0.005,)),
    (SIZE, "sponge", "sponge 1", "", (0.1, 0.07, 0.03)),
)


def blocks(rows: Iterable[Row]) -> list[Block]:
    """Return one block a row."""
    source = Source("table.csv", "ab" * 32)
    return [
        Block(prop, [label], [name], [seen], np.array([value]), Origin.MACHINE, source)
        for prop, label, name, seen, value in rows
    ]


def small(
    rows: Iterable[Row] = ROWS,
    unit: ObservationUnit = ObservationUnit.INSTANCE,
    *,
    classes_only: bool = False,
    fuzzifier: float = 1.0,
) -> KnowledgeBase:
    """Build a knowledge base of three classes in memory."""
    cuts = SubcategorizationSettings(clusters=2, fuzzifier=fuzzifier)
    settings = Settings(cuts, unit=unit, classes_only=classes_only)
    return build(blocks=blocks(rows), settings=settings)


def lines_of(kb: KnowledgeBase) -> set[str]:
    """Return all triples as lines of N-Triples."""
    return {f"{t.subject} {t.predicate} {t.object} .\n" for t in kb.triples()}


def facts_of(kb: KnowledgeBase) -> set[str]:
    """Return the triples that state knowledge."""
    return {line for line in lines_of(kb) if is_knowledge(line)}


def assert_whole(kb: KnowledgeBase) -> None:
    """Check that the revision stated is that of what is there."""
    assert kb.revision == f"{revision_of(lines_of(kb)):064x}"


def ground(
    rows: Sequence[Row], qualities: tuple[Qualities, ...], unit: ObservationUnit = ObservationUnit.INSTANCE
) -> KnowledgeBase:
    """Ground rows with given cut points: what incremental updates must equal."""
    measurements = Measurements.collect(blocks(rows))
    units = find_units(measurements, unit)
    attribution = attribute(measurements, qualities, units)
    counts = conceptualize(attribution, measurements.classes)
    return KnowledgeBase.create(knowledge(measurements, units, attribution, counts, BuildRecord(unit)))


__all__ = ["ROWS", "Kind", "Row", "assert_whole", "blocks", "facts_of", "ground", "lines_of", "small"]
