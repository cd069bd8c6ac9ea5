"""Sources: everything a knowledge base is grounded in, read and measured into one table."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Final, TypeAlias

from ersatz.acquisition.engine import Engine
from ersatz.acquisition.tables.sheets import in_parts
from ersatz.errors import InputError
from ersatz.measurements import Block, Measurements, instance_names, unmeasured
from ersatz.resources import ONTOLOGY

if TYPE_CHECKING:
    from ersatz.acquisition.scans import Scan
    from ersatz.acquisition.shape_concepts import ShapeConcepts

Progress: TypeAlias = Callable[[str, float], None]
"""Told the name of the stage and the share of the work done, in [0, 1]."""

CONCEPTS: Final = "concepts.npz"
"""Name, or ending of the name, of the file of shape concepts beside a knowledge base."""


@dataclass(frozen=True, slots=True)
class AcquisitionSettings:
    """How values are acquired.

    Attributes
    ----------
    expert_seed : int
        Of the draws from expert distributions.
    shape_concepts : int
        Concepts to learn from unlabelled scans; the paper has 4.
    views : int
        Virtual views of an object that is known from all sides.
    paper_selection : bool
        Of a folder of scans take the categories and numbers of the paper's Table 1 only.
    keep_going : bool
        Leave broken scans out, with a warning.
    workers : int
        Processes that measure scans.
    """

    expert_seed: int = 0
    shape_concepts: int = 4
    views: int = 6
    paper_selection: bool = False
    keep_going: bool = False
    workers: int = 1

    def __post_init__(self) -> None:
        """Refuse numbers below one."""
        if min(self.shape_concepts, self.views, self.workers) < 1:
            raise InputError(
                f"shape concepts, views and workers must be 1 or more, not {self.shape_concepts}, "
                f"{self.views} and {self.workers}"
            )


@dataclass(frozen=True, slots=True)
class Sources:
    """Where values come from; any of them may be left out.

    Attributes
    ----------
    blocks : sequence of Block
        Measurements made elsewhere.
    tables : sequence of paths
        Property tables, CSV or Parquet.
    rocs : path
        A folder laid out as the RoCS data set.
    scans : path or iterable of Scan
        A folder of scans, see `ersatz.acquisition.layouts`, or scans.
    models : mapping of category to a number
        Parametric models to measure like scans; synthetic.
    unlabelled : path
        A folder of scans to learn shape concepts from, without their labels.
    concepts : path
        Shape concepts learned before; without it and `unlabelled`, those of the shipped knowledge base.
    expert : path
        Expert distributions to draw from, for what was not measured.
    """

    blocks: Sequence[Block] = ()
    tables: Sequence[str | Path] = ()
    rocs: str | Path | None = None
    scans: "str | Path | Iterable[Scan] | None" = None
    models: Mapping[str, int] = field(default_factory=dict)
    unlabelled: str | Path | None = None
    concepts: str | Path | None = None
    expert: str | Path | None = None


def tables_in_parts(sources: Sources, *, anyway: bool = False) -> bool:
    """Tell whether all there is are tables to be read part by part; `anyway` also where they are small."""
    others = (sources.blocks, sources.rocs, sources.scans, sources.models, sources.expert)
    if not sources.tables or any(one is not None and one not in ((), {}) for one in others):
        return False
    return all(in_parts(table, anyway=anyway) for table in sources.tables)


def acquire(
    sources: Sources, settings: AcquisitionSettings, progress: Progress, engine: Engine | None = None
) -> "tuple[Measurements, ShapeConcepts | None]":
    """Read and measure everything, and draw from the expert's distributions what was not measured.

    Returns
    -------
    measurements : Measurements
    concepts : ShapeConcepts or None
        Those the scans were compared with, if there were scans.

    Raises
    ------
    InputError
        If there is nothing to measure, or a value, a name or a file is not what it should be.
    """
    progress("reading measurements", 0.0)
    found, concepts = list(sources.blocks), None
    if sources.tables:
        from ersatz.acquisition.tables import read_table
        from ersatz.acquisition.tables.parts import read_whole

        found += chain.from_iterable(
            read_whole(table) if in_parts(table) else read_table(Path(table)) for table in sources.tables
        )
    if sources.rocs is not None:
        from ersatz.acquisition.rocs import read_rocs

        found += read_rocs(Path(sources.rocs))
    if sources.scans is not None or sources.models:
        concepts = find_concepts(sources, settings, progress)
        found += _scanned(sources, settings, concepts, progress, engine)
    if sources.expert is not None:
        from ersatz.acquisition.expert import read_expert

        expert = read_expert(Path(sources.expert)).of_instances(instance_names(found))
        found += unmeasured(expert.sample(settings.expert_seed), found)
    return Measurements.collect(found), concepts


def find_concepts(sources: Sources, settings: AcquisitionSettings, progress: Progress) -> "ShapeConcepts":
    """Return the shape concepts to use: given, newly learned, or those of the shipped knowledge base."""
    from ersatz.acquisition.concept_learning import learn_shape_concepts
    from ersatz.acquisition.shape_concepts import ConceptSettings

    if sources.unlabelled is None:
        return shape_concepts(sources.concepts)
    progress("learning shape concepts", 0.02)
    scans = unlabelled_scans(sources.unlabelled, settings)
    return learn_shape_concepts(scans, ConceptSettings(concepts=settings.shape_concepts))


def unlabelled_scans(folder: str | Path, settings: AcquisitionSettings | None = None) -> "Iterator[Scan]":
    """Yield the views shape concepts are learned from: four times as many an object as are measured.

    The objects are few and nobody knows how they stand, so every side of them should be seen.
    """
    from ersatz.acquisition.camera import CameraSettings
    from ersatz.acquisition.layouts import FolderSettings, iter_scans

    settings = settings or AcquisitionSettings()
    camera = CameraSettings(views=4 * settings.views, upper=False)
    return iter_scans(folder, FolderSettings(camera, whole=False, keep_going=settings.keep_going))


def shape_concepts(path: str | Path | None = None) -> "ShapeConcepts":
    """Return the shape concepts in a file; without one, those of the shipped knowledge base."""
    from ersatz.acquisition.shape_concepts import ShapeConcepts

    return ShapeConcepts.load(path or ONTOLOGY / f"household.{CONCEPTS}")


def concepts_beside(location: Path) -> Path:
    """Return where the shape concepts of a knowledge base lie: beside a file, inside a directory."""
    if location.is_dir():
        return location / CONCEPTS
    stem = location.with_suffix("") if location.suffix == ".gz" else location
    return stem.with_suffix(f".{CONCEPTS}")


def _scanned(
    sources: Sources,
    settings: AcquisitionSettings,
    concepts: "ShapeConcepts",
    progress: Progress,
    engine: Engine | None,
) -> list[Block]:
    """Measure the scans, and the models as if they had been scanned."""
    from ersatz.acquisition.camera import CameraSettings
    from ersatz.acquisition.layouts import FolderSettings, iter_scans, views_of
    from ersatz.acquisition.measuring import MeasuringSettings, measure_scans
    from ersatz.acquisition.parametric import model_scans

    folder = FolderSettings(
        CameraSettings(views=settings.views),
        paper_selection=settings.paper_selection,
        keep_going=settings.keep_going,
    )
    scans = sources.scans or ()
    given = iter_scans(scans, folder) if isinstance(scans, str | Path) else scans
    models = enumerate(model_scans(sources.models))
    modelled = (view for number, scan in models for view in views_of(scan, folder, number))
    done = 0

    def tell(scan: "Scan") -> None:
        nonlocal done
        done += 1
        progress(f"measuring {scan.label}", 0.05 + 0.55 * done / (done + 100))

    measuring = MeasuringSettings(workers=settings.workers, keep_going=settings.keep_going)
    return measure_scans(chain(given, modelled), concepts, measuring, tell, engine)
