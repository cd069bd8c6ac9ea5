"""The line once, one call a stage: measurement, quality, membership, knowledge base."""

import json
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import TypeAlias

from ersatz import __version__
from ersatz.errors import InputError
from ersatz.grounding.attribution import attribute
from ersatz.grounding.conceptualization import conceptualize
from ersatz.grounding.subcategorization import SubcategorizationSettings, learn_qualities
from ersatz.grounding.units import ObservationUnit, find_units, unit_values
from ersatz.knowledge.base import KnowledgeBase, check_target
from ersatz.knowledge.queries import exact
from ersatz.knowledge.terms import finite, plain
from ersatz.knowledge.writer import BuildRecord, knowledge
from ersatz.measurements import Block, Measurements

Progress: TypeAlias = Callable[[str, float], None]
"""Told the name of the stage and the share of the work done, in [0, 1]."""


def silent(_stage: str, _share: float) -> None:
    """Say nothing of progress."""


@dataclass(frozen=True, slots=True)
class Settings:
    """How a knowledge base is built.

    Attributes
    ----------
    subcategorization : SubcategorizationSettings
        Qualities per property, restarts, seed.
    unit : ObservationUnit
        What is counted: instances (default), or every observation of them.
    theta : Fraction
        Representative threshold at which `ersatz:representativeQuality` is written down; in (0, 1].
    expert_seed : int
        Of the draws from expert distributions.
    classes_only : bool
        Leave the instances out; then nothing can be observed or forgotten later.
    time : str or None
        xsd:dateTime of the build.
    """

    subcategorization: SubcategorizationSettings = field(default_factory=SubcategorizationSettings)
    unit: ObservationUnit = ObservationUnit.INSTANCE
    theta: Fraction = Fraction(35, 100)
    expert_seed: int = 0
    classes_only: bool = False
    time: str | None = None

    def __post_init__(self) -> None:
        """Check and normalise."""
        object.__setattr__(self, "theta", exact(self.theta, "theta"))
        if not 0 < self.theta <= 1:
            raise InputError(f"theta is {self.theta}: it lies above 0 and up to 1")

    def to_json(self) -> str:
        """Return what decides the result as JSON."""
        return json.dumps(
            {
                "clusters": self.subcategorization.clusters,
                "restarts": self.subcategorization.restarts,
                "seed": self.subcategorization.seed,
                "expert_seed": self.expert_seed,
                "unit": str(self.unit),
                "theta": plain(finite(self.theta)),
                "classes_only": self.classes_only,
            },
            sort_keys=True,
        )


def build(
    *,
    blocks: Iterable[Block] = (),
    tables: Sequence[str | Path] = (),
    rocs: str | Path | None = None,
    expert: str | Path | None = None,
    settings: Settings | None = None,
    out: str | Path | None = None,
    progress: Progress = silent,
) -> KnowledgeBase:
    """Ground a knowledge base: from measured and judged values to class knowledge and function models.

    Parameters
    ----------
    blocks : iterable of Block
        Measurements made elsewhere.
    tables : sequence of paths
        Property tables, CSV or Parquet.
    rocs : path
        A folder laid out as the RoCS data set.
    expert : path
        Expert distributions to draw from, for what was not measured.
    settings : Settings
    out : path
        File or directory to write; without it the knowledge base lives in memory.
    progress : callable
        Told the stage and the share of the work done.

    Raises
    ------
    InputError
        If there is nothing to ground, or a value, a name or a file is not what it should be.
    """
    settings = settings or Settings()
    if out is not None:
        check_target(Path(out))
    progress("reading measurements", 0.0)
    measurements = acquire(blocks, tables, rocs, expert, settings.expert_seed)
    units = find_units(measurements, settings.unit)
    qualities = []
    for done, column in enumerate(measurements.columns):
        progress(
            f"finding the qualities of {column.property.name}", 0.1 + 0.6 * done / len(measurements.columns)
        )
        values = unit_values(column, units, measurements)[1]
        qualities.append(learn_qualities(values, column.property, settings.subcategorization))
    progress("counting and writing", 0.7)
    attribution = attribute(measurements, qualities, units)
    counts = conceptualize(attribution, measurements.classes)
    record = BuildRecord(
        settings.unit,
        settings.theta,
        settings.subcategorization.clusters,
        settings.subcategorization.seed,
        settings.to_json(),
        __version__,
        settings.time,
        measurements.sources,
    )
    lines = knowledge(measurements, units, attribution, counts, record, classes_only=settings.classes_only)
    return KnowledgeBase.create(lines, Path(out) if out is not None else None)


def acquire(
    blocks: Iterable[Block],
    tables: Sequence[str | Path],
    rocs: str | Path | None,
    expert: str | Path | None,
    seed: int,
) -> Measurements:
    """Read everything measured, and draw from the expert's distributions what was not."""
    from ersatz.acquisition.expert import read_expert
    from ersatz.acquisition.rocs import read_rocs
    from ersatz.acquisition.tables import read_table

    found = list(blocks)
    for table in tables:
        found += read_table(Path(table))
    if rocs is not None:
        found += read_rocs(Path(rocs))
    if expert is not None:
        found += read_expert(Path(expert)).sample(seed)
    return Measurements.collect(found)
