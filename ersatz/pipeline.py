"""The line once, one call a stage: scan, shape, measurement, quality, membership, knowledge base."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ersatz import __version__
from ersatz.acquisition.engine import Engine, open_engine
from ersatz.acquisition.sources import (
    AcquisitionSettings,
    Progress,
    Sources,
    acquire,
    concepts_beside,
    tables_in_parts,
)
from ersatz.acquisition.tables.parts import find_parts, read_batches
from ersatz.errors import InputError
from ersatz.grounding.attribution import Attribution, attribute
from ersatz.grounding.conceptualization import DEGREE, conceptualize
from ersatz.grounding.parts import batch_units, ground_parts
from ersatz.grounding.subcategorization import Qualities, SubcategorizationSettings, fit_qualities
from ersatz.grounding.summaries import summarize
from ersatz.grounding.units import ObservationUnit, Units, find_units
from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.builds import BuildRecord
from ersatz.knowledge.instances import instance_knowledge
from ersatz.knowledge.names import distinct
from ersatz.knowledge.queries import exact
from ersatz.knowledge.reader import read_qualities
from ersatz.knowledge.saving import check_target
from ersatz.knowledge.terms import finite, plain
from ersatz.knowledge.writer import knowledge, named
from ersatz.measurements import DIGITS, Block, Measurements, Source
from ersatz.reasoner.recognition import Likeness, Role, nearest_classes, possible_roles
from ersatz.reasoner.relevance import ReasonerSettings

if TYPE_CHECKING:
    from collections.abc import Iterable

    from ersatz.acquisition.scans import Scan
    from ersatz.acquisition.shape_concepts import ShapeConcepts

CONCEPTS_SOURCE = "shape concepts"
"""Name of the source that states the SHA-256 of the shape concepts."""


def silent(_stage: str, _share: float) -> None:
    """Say nothing of progress."""


@dataclass(frozen=True, slots=True)
class Settings:
    """How a knowledge base is built.

    Attributes
    ----------
    subcategorization : SubcategorizationSettings
        Qualities per property, restarts, seed; crisp, or fuzzy by a fuzzifier above 1.
    unit : ObservationUnit
        What is counted: instances (default), or every observation of them.
    theta : Fraction
        Representative threshold at which `ersatz:representativeQuality` is written down; in (0, 1].
    acquisition : AcquisitionSettings
        Views, number of shape concepts, seed of the expert's draws.
    classes_only : bool
        Leave the instances out; then nothing can be observed or forgotten later.
    time : str or None
        xsd:dateTime of the build.
    """

    subcategorization: SubcategorizationSettings = field(default_factory=SubcategorizationSettings)
    unit: ObservationUnit = ObservationUnit.INSTANCE
    theta: Fraction = Fraction(35, 100)
    acquisition: AcquisitionSettings = field(default_factory=AcquisitionSettings)
    classes_only: bool = False
    time: str | None = None

    def __post_init__(self) -> None:
        """Check and normalise."""
        try:
            object.__setattr__(self, "unit", ObservationUnit(self.unit))
        except ValueError:
            raise InputError(f"unit {self.unit!r} is not one of {', '.join(ObservationUnit)}") from None
        object.__setattr__(self, "theta", exact(self.theta, "theta"))
        if not 0 < self.theta <= 1:
            raise InputError(f"theta is {self.theta}: it lies above 0 and up to 1")

    def to_json(self) -> str:
        """Return what decides the result as JSON."""
        cuts = self.subcategorization
        return json.dumps(
            {
                "expert_seed": self.acquisition.expert_seed,
                "shape_concepts": self.acquisition.shape_concepts,
                "views": self.acquisition.views,
                "clusters": cuts.clusters,
                "restarts": cuts.restarts,
                "seed": cuts.seed,
                **({"fuzzifier": cuts.fuzzifier} if cuts.fuzzifier > 1 else {}),
                "unit": str(self.unit),
                "theta": plain(finite(self.theta)),
                "classes_only": self.classes_only,
            },
            sort_keys=True,
        )


def build(
    *,
    blocks: Sequence[Block] = (),
    tables: Sequence[str | Path] = (),
    rocs: str | Path | None = None,
    scans: "str | Path | Iterable[Scan] | None" = None,
    models: Mapping[str, int] | None = None,
    unlabelled: str | Path | None = None,
    concepts: str | Path | None = None,
    expert: str | Path | None = None,
    settings: Settings | None = None,
    out: str | Path | None = None,
    scheduler: str | None = None,
    progress: Progress = silent,
) -> KnowledgeBase:
    """Ground a knowledge base: from scanned, measured and judged values to class knowledge and functions.

    Parameters
    ----------
    blocks, tables, rocs, scans, models, unlabelled, concepts, expert
        Where values come from; see `ersatz.acquisition.sources.Sources`.
    settings : Settings
    out : path
        File or directory to write; without it the knowledge base lives in memory.
    scheduler : str
        Who does the work, see `ersatz.acquisition.engine.open_engine`; the result is the same.
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
    sources = Sources(blocks, tables, rocs, scans, models or {}, unlabelled, concepts, expert)
    with open_engine(scheduler) as engine:
        if tables_in_parts(sources, anyway=scheduler is not None):
            lines, learned = _ground_parts(sources, settings, engine, progress), None
        else:
            # Without a scheduler, `settings.acquisition.workers` measure.
            given = None if scheduler is None else engine
            measurements, learned = acquire(sources, settings.acquisition, progress, given)
            lines = _ground_table(measurements, learned, settings, progress)
    kb = KnowledgeBase.create(lines, Path(out) if out is not None else None)
    if learned is not None and out is not None:
        learned.save(concepts_beside(Path(out)))
    return kb


def _ground_table(
    measurements: Measurements, learned: "ShapeConcepts | None", settings: Settings, progress: Progress
) -> Iterator[str]:
    """Return the knowledge of what is all in memory."""
    units = find_units(measurements, settings.unit)
    qualities = []
    for done, column in enumerate(measurements.columns):
        progress(
            f"finding the qualities of {column.property.name}", 0.6 + 0.3 * done / len(measurements.columns)
        )
        summary = summarize(column, units, measurements, settings.subcategorization.seed)
        qualities.append(fit_qualities(summary, column.property, settings.subcategorization))
    progress("counting and writing", 0.9)
    attribution = attribute(measurements, qualities, units)
    counts = conceptualize(attribution, measurements.classes)
    concepts = () if learned is None else (Source(CONCEPTS_SOURCE, learned.sha256),)
    record = _record(settings, (*measurements.sources, *concepts))
    return knowledge(measurements, units, attribution, counts, record, classes_only=settings.classes_only)


def _ground_parts(sources: Sources, settings: Settings, engine: Engine, progress: Progress) -> Iterator[str]:
    """Return the knowledge of data sets that are read part by part."""
    tables = [find_parts(table) for table in sources.tables]
    grounding = ground_parts(tables, settings.unit, settings.subcategorization, engine, progress)
    record = _record(settings, grounding.sources)
    nothing = Measurements((), np.empty(0, np.dtypes.StringDType()), np.empty(0, np.int32), (), (), ())
    nobody = Units(settings.unit, np.empty(0, np.int32), np.empty(0, np.int32))
    held = Attribution(grounding.qualities, np.empty(0, np.int32), ())
    classes = knowledge(
        replace(nothing, sources=grounding.sources), nobody, held, grounding.counts, record, classes_only=True
    )
    if settings.classes_only:
        return classes

    def batches() -> Iterator[Measurements]:
        for table, source in zip(tables, grounding.sources, strict=True):
            for batch in chain.from_iterable(map(read_batches, table)):
                yield replace(batch.named(), sources=(source,))

    def instances(measurements: Measurements) -> Iterator[str]:
        units = batch_units(measurements, settings.unit)
        attribution = attribute(measurements, grounding.qualities, units)
        return instance_knowledge(measurements, units, attribution)

    distinct(chain.from_iterable(named(measurements, grounding.counts) for measurements in batches()))
    return chain(classes, chain.from_iterable(map(instances, batches())))


def ground_blocks(blocks: Sequence[Block], clusters: int, seed: int) -> KnowledgeBase:
    """Ground values in memory, with another number of qualities or another seed; for experiments."""
    qualities = SubcategorizationSettings(clusters, restarts=20, seed=seed)
    return build(blocks=blocks, settings=Settings(qualities))


@dataclass(frozen=True, slots=True)
class Held:
    """A quality an object holds, and the value it was assigned by, in the property's unit.

    With fuzzy qualities it is the one the value belongs to most, and `degrees` says how far it belongs to
    this and others: (name, degree above 0), lowest rank first, adding up to 1. Crisp ones have no degrees.
    """

    quality: str
    property: str
    value: tuple[float, ...]
    unit: str
    degrees: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True, slots=True)
class Grounded:
    """What a scan of an object nobody named tells.

    Attributes
    ----------
    scan : str
        The file's name.
    held : tuple of Held
    classes : tuple of Likeness
        Most similar first; of the measured properties.
    roles : tuple of Role
        The missing tools it could stand in for, best first.
    """

    scan: str
    held: tuple[Held, ...]
    classes: tuple[Likeness, ...]
    roles: tuple[Role, ...]

    def to_json(self) -> dict[str, Any]:
        """Return it in JSON's types."""
        return {
            "version": 1,
            "scan": self.scan,
            "held": [
                {"quality": one.quality, "property": one.property, "value": list(one.value), "unit": one.unit}
                | ({"degrees": dict(one.degrees)} if one.degrees else {})
                for one in self.held
            ],
            "classes": [
                {"name": one.name, "iri": one.iri, "similarity": float(one.similarity)}
                for one in self.classes
            ],
            "stands_in_for": [
                {
                    "name": role.tool,
                    "iri": role.iri,
                    "similarity": float(role.similarity),
                    "accepted": role.accepted,
                }
                for role in self.roles
            ],
        }


def ground(
    kb: KnowledgeBase,
    scan: "str | Path | Scan",
    *,
    concepts: str | Path | None = None,
    mass: float | None = None,
    settings: ReasonerSettings | None = None,
) -> Grounded:
    """Ground one scan of an unknown object in a knowledge base; nothing is written.

    Parameters
    ----------
    kb : KnowledgeBase
    scan : path or Scan
    concepts : path, optional
        The shape concepts the knowledge base was built with; without it, the file beside it.
    mass : float, kg, optional
        Where the object was weighed.
    settings : ReasonerSettings, optional

    Raises
    ------
    ScanError
        If the scan cannot be read or is too poor.
    InputError
        If the shape concepts are not those of the knowledge base.
    """
    from ersatz.acquisition.measuring import measure_object
    from ersatz.acquisition.scans import read_scan

    seen = read_scan(Path(scan)) if isinstance(scan, str | Path) else scan
    seen = seen if mass is None else replace(seen, mass=mass)
    return ground_values(kb, measure_object(seen, concepts_of(kb, concepts)), seen.source.name, settings)


def ground_values(
    kb: KnowledgeBase,
    values: Mapping[str, tuple[float, ...]],
    scan: str,
    settings: ReasonerSettings | None = None,
) -> Grounded:
    """Ground what was measured of an unknown object.

    Parameters
    ----------
    kb : KnowledgeBase
    values : mapping of property to its components, in the property's unit
        Properties the knowledge base does not know are left out.
    scan : str
        The file's name.
    settings : ReasonerSettings, optional

    Raises
    ------
    InputError
        If the knowledge base knows none of the properties.
    """
    held = []
    for qualities in read_qualities(kb):
        name = qualities.property.name
        if name in values:
            held.append(_held(qualities, values[name]))
    names = [one.quality for one in held]
    return Grounded(
        scan,
        tuple(held),
        nearest_classes(kb, names, settings),
        possible_roles(kb, names, settings),
    )


def _held(qualities: Qualities, value: tuple[float, ...]) -> Held:
    row = np.round([value], DIGITS)
    names, degrees = qualities.names, qualities.degrees(row)[0].tolist() if qualities.fuzzy else []
    return Held(
        names[qualities.assign(row)[0]],
        qualities.property.name,
        value,
        qualities.property.unit,
        tuple((name, part / DEGREE) for name, part in zip(names, degrees, strict=False) if part),
    )


def concepts_of(kb: KnowledgeBase, given: str | Path | None = None) -> "ShapeConcepts | None":
    """Return the shape concepts a knowledge base was built with; None if it was built without scans.

    Raises
    ------
    InputError
        If they are not at `given`, or beside the knowledge base, or are others.
    """
    from ersatz.acquisition.shape_concepts import ShapeConcepts

    wanted = [row["sha256"] for row in kb.ask("sources") if row["file"] == CONCEPTS_SOURCE]
    if not wanted:
        return None
    path = Path(given) if given is not None else concepts_beside(Path(kb.location))
    if not path.exists():
        raise InputError(f"there are no shape concepts at {str(path)!r}: say where they are with --concepts")
    concepts = ShapeConcepts.load(path)
    if concepts.sha256 not in wanted:
        raise InputError(f"{str(path)!r} holds other shape concepts than {kb.location!r} was built with")
    return concepts


def _record(settings: Settings, sources: tuple[Source, ...]) -> BuildRecord:
    return BuildRecord(
        settings.unit,
        settings.theta,
        settings.subcategorization.clusters,
        settings.subcategorization.seed,
        settings.to_json(),
        __version__,
        settings.time,
        sources,
    )
