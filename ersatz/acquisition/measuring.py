"""From scans to blocks of measurements: concept responses of views, geometry of whole objects."""

import warnings
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from ersatz.acquisition.engine import Engine, Here, Processes
from ersatz.acquisition.geometry import Geometry, GeometrySettings, measure_geometry
from ersatz.acquisition.layouts import FolderSettings, views_of
from ersatz.acquisition.scans import Scan
from ersatz.acquisition.shape_concepts import ShapeConcepts
from ersatz.errors import ErsatzWarning, InputError, ScanError
from ersatz.measurements import PROPERTIES, Block, Origin, Property, Source


@dataclass(frozen=True, slots=True)
class MeasuringSettings:
    """How scans are measured.

    Attributes
    ----------
    geometry : GeometrySettings
    workers : int
        Processes; 1 measures in this one.
    keep_going : bool
        Skip scans that cannot be measured, with a warning.
    """

    geometry: GeometrySettings = field(default_factory=GeometrySettings)
    workers: int = 1
    keep_going: bool = False

    def __post_init__(self) -> None:
        """Refuse what makes no sense."""
        if self.workers < 1:
            raise InputError(f"workers = {self.workers}: at least one process is needed")


@dataclass(frozen=True, slots=True)
class _Row:
    """One value as it comes from a worker."""

    property: Property
    object_class: str
    instance: str
    observation: str
    value: tuple[float, ...]
    origin: Origin
    source: Source


def measure_scan(
    scan: Scan, concepts: ShapeConcepts | None, settings: MeasuringSettings | None = None
) -> dict[str, tuple[float, ...]]:
    """Return what one scan tells, by property name; what it does not tell is not there.

    A view gives concept responses, and its size and flatness unless a virtual camera took it (then the
    whole object's are better); a whole object gives its geometry.

    Raises
    ------
    ScanError
        If the cloud is too poor.
    """
    settings = settings or MeasuringSettings()
    values: dict[str, tuple[float, ...]] = {}
    if not scan.virtual:
        values |= geometry_values(measure_geometry(scan, settings.geometry), scan.mass)
    if concepts is not None and scan.partial:
        responses = concepts.responses(scan).tolist()
        values |= {f"shape_{rank}": (value,) for rank, value in enumerate(responses, start=1)}
    return values


def measure_object(
    scan: Scan,
    concepts: ShapeConcepts | None,
    settings: MeasuringSettings | None = None,
    folder: FolderSettings | None = None,
) -> dict[str, tuple[float, ...]]:
    """Return what one scan of an unknown object tells, by property name.

    Like `measure_scan`, but a scan of all sides also gets concept responses: the mean over views of it by
    the virtual camera, as an object of a knowledge base has them.

    Raises
    ------
    ScanError
        If the cloud is too poor.
    """
    values = measure_scan(scan, concepts, settings)
    if concepts is not None and not scan.partial:
        folder = replace(folder or FolderSettings(), whole=False)
        means = np.mean([concepts.responses(view) for view in views_of(scan, folder)], axis=0).tolist()
        values |= {f"shape_{rank}": (value,) for rank, value in enumerate(means, start=1)}
    return values


def geometry_values(geometry: Geometry, mass: float | None) -> dict[str, tuple[float, ...]]:
    """Return measured geometry by property name; weight and blockage where the mass (kg) is known."""
    found: dict[str, float | None] = {
        "flatness": geometry.flatness,
        "hollowness": geometry.hollowness,
        "containment": geometry.containment,
        "support": geometry.support,
    }
    if mass is not None and not geometry.partial:
        found["weight"] = mass
        found["blockage"] = None if geometry.silhouette is None else mass * geometry.silhouette
    size = tuple(float(edge) for edge in geometry.size)
    return {"size": size} | {name: (value,) for name, value in found.items() if value is not None}


def measure_scans(
    scans: Iterable[Scan],
    concepts: ShapeConcepts | None,
    settings: MeasuringSettings | None = None,
    progress: Callable[[Scan], None] | None = None,
    engine: Engine | None = None,
) -> list[Block]:
    """Measure many scans, one or a few of them in memory at a time.

    Parameters
    ----------
    scans : iterable of Scan
        Consumed lazily.
    concepts : ShapeConcepts or None
        None leaves shapes out.
    settings : MeasuringSettings or None
    progress : callable or None
        Called with every scan when it is done.
    engine : Engine or None
        Who measures, in place of `settings.workers` processes.

    Returns
    -------
    list of Block
        One a property, origin and source, sorted; the same whatever the number of workers.

    Raises
    ------
    ScanError
        If a scan cannot be measured, unless `settings.keep_going`.

    Warns
    -----
    ErsatzWarning
        Of every scan left out.
    """
    settings = settings or MeasuringSettings()
    rows: dict[tuple[str, Origin, Source], list[_Row]] = {}
    for scan, values in _measured(scans, concepts, settings, engine):
        for name, value in values.items():
            prop = PROPERTIES[name] if name in PROPERTIES else _shape(name)
            row = _Row(
                prop, scan.object_class, scan.instance, scan.observation, value, scan.origin, scan.source
            )
            rows.setdefault((name, scan.origin, scan.source), []).append(row)
        if progress is not None:
            progress(scan)
    ordered = sorted(
        rows.items(), key=lambda item: (item[0][0], item[0][1], item[0][2].name, item[0][2].sha256)
    )
    return [_block(part) for _, part in ordered]


def _shape(name: str) -> Property:
    """Return the property of a concept beyond the paper's four."""
    rank = int(name.removeprefix("shape_"))
    first = PROPERTIES["shape_1"]
    return Property(
        name, first.kind, orientation=first.orientation, definition=first.definition.replace("1", str(rank))
    )


def _block(rows: list[_Row]) -> Block:
    return Block(
        rows[0].property,
        [row.object_class for row in rows],
        [row.instance for row in rows],
        [row.observation for row in rows],
        np.array([row.value for row in rows], dtype=np.float64),
        rows[0].origin,
        rows[0].source,
    )


def _measured(
    scans: Iterable[Scan],
    concepts: ShapeConcepts | None,
    settings: MeasuringSettings,
    engine: Engine | None,
) -> Iterator[tuple[Scan, dict[str, tuple[float, ...]]]]:
    """Yield each scan with its values, in the order of the scans."""
    engine = engine or (Here() if settings.workers == 1 else Processes(settings.workers))
    waiting: deque[Scan] = deque()

    def remembered() -> Iterator[Scan]:
        for scan in scans:
            waiting.append(scan)
            yield scan

    for values in engine.map(partial(_attempt, concepts=concepts, settings=settings), remembered()):
        scan = waiting.popleft()
        if not isinstance(values, ScanError):
            yield scan, values
            continue
        if not settings.keep_going:
            raise values
        warnings.warn(f"skipped {scan.label}: {values}", ErsatzWarning, stacklevel=4)
        yield scan, {}


def _attempt(
    scan: Scan, concepts: ShapeConcepts | None, settings: MeasuringSettings
) -> dict[str, tuple[float, ...]] | ScanError:
    try:
        return measure_scan(scan, concepts, settings)
    except ScanError as error:
        return error
