"""Folders of scans: finding the files, and loading them one after another.

Four layouts are known:

* a folder with a `manifest.csv`: columns `category`, `id`, `file` (relative to the folder; default
  `<id>.ply`), and optionally `kind` ("cad" marks a model of no particular thing), `mass_kg`, `dup_group`
  (scans of one product share it), `licence`, `source`, `unit`;
* `<class>/<instance>/<scan>` or `<class>/<scan>`;
* the Washington RGB-D data set: `<class>/<class>_<n>/<class>_<n>_<video>_<frame>.pcd` (or `_depthcrop.png`),
  with or without a folder `rgbd-dataset` around it;
* the YCB object set: `<number>_<class>/google_16k/nontextured.ply`.

A file with a mesh yields the whole object and some views of it by a virtual camera.
"""

import csv
import re
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ersatz.acquisition.camera import CameraSettings, VirtualCamera, cloud_view, viewing_directions
from ersatz.acquisition.cloud_files import READERS
from ersatz.acquisition.depth_images import read_depth_scan
from ersatz.acquisition.scans import Scan, read_scan
from ersatz.errors import ErsatzWarning, InputError, ScanError
from ersatz.measurements import Origin

PAPER_SELECTION: Final = {
    "ball": (7, 5),
    "binder": (3, 10),
    "bowl": (6, 5),
    "cap": (4, 8),
    "cereal box": (5, 6),
    "coffee mug": (8, 4),
    "flashlight": (5, 6),
    "food bag": (8, 4),
    "food box": (12, 3),
    "food can": (14, 2),
    "food cup": (5, 6),
    "food jar": (6, 5),
    "hand towel": (5, 6),
    "keyboard": (5, 6),
    "kleenex": (5, 6),
    "notebook": (5, 6),
    "pitcher": (3, 10),
    "plate": (7, 5),
    "shampoo": (6, 5),
    "soda can": (6, 5),
    "sponge": (12, 3),
    "water bottle": (9, 4),
}
"""Instances and scans per instance of the paper's Table 1: 692 scans of 146 objects."""

WASHINGTON: Final = re.compile(r"(?P<class>.+)_(?P<number>\d+)_(?P<video>\d+)_(?P<frame>\d+)(_depthcrop)?")

YCB: Final = re.compile(r"\d{3}(-[a-z])?_(?P<class>[a-z_]+)")


@dataclass(frozen=True, slots=True)
class FolderSettings:
    """What to take from a folder of scans.

    Attributes
    ----------
    camera : CameraSettings
        For views of meshes.
    whole : bool
        Whether a mesh also yields the whole object (its geometry is measured on it).
    paper_selection : bool
        Only the categories, instances and numbers of scans of the paper's Table 1.
    keep_going : bool
        Skip broken scans with a warning.
    """

    camera: CameraSettings = field(default_factory=CameraSettings)
    whole: bool = True
    paper_selection: bool = False
    keep_going: bool = False


@dataclass(frozen=True, slots=True)
class ScanFile:
    """A file of a scan and what its place in the folder says of it."""

    path: Path
    object_class: str
    instance: str
    observation: str = ""
    group: str = ""
    mass: float | None = None
    origin: Origin = Origin.MACHINE
    credit: str = ""
    unit: str = "m"

    def load(self) -> Scan:
        """Read the file; see `read_scan`."""
        if self.path.suffix.lower() == ".png":
            scan = read_depth_scan(self.path)
        else:
            scan = read_scan(self.path, unit=self.unit)
        return replace(
            scan,
            object_class=self.object_class,
            instance=self.instance,
            observation=self.observation,
            group=self.group or self.instance,
            mass=self.mass,
            origin=self.origin,
            source=replace(scan.source, credit=self.credit),
        )


def list_scans(folder: str | Path, paper_selection: bool = False) -> list[ScanFile]:
    """Return the scans of a folder, sorted, without reading them.

    Raises
    ------
    InputError
        If there is no such folder, no scan in it, or its manifest is broken.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise InputError(f"{folder}: there is no such folder of scans")
    manifest = folder / "manifest.csv"
    files = _of_manifest(manifest) if manifest.is_file() else _of_tree(folder)
    if paper_selection:
        files = select_paper(files)
    if not files:
        raise InputError(
            f"{folder}: no scans; expected a manifest.csv, or files <class>/<instance>/<scan> "
            f"ending in {', '.join(sorted(READERS))}"
        )
    return files


def _of_manifest(manifest: Path) -> list[ScanFile]:
    with manifest.open(encoding="utf-8", newline="") as file:
        reader = csv.DictReader(file)
        names = reader.fieldnames or []
        if "id" not in names:
            raise InputError(f"{manifest}: no column 'id' among {list(names)}")
        rows = list(reader)
    files = []
    for number, row in enumerate(rows, start=2):
        cells = {key: (value or "").strip() for key, value in row.items() if isinstance(key, str)}
        try:
            mass = float(cells["mass_kg"]) if cells.get("mass_kg") else None
        except ValueError as error:
            raise InputError(
                f"{manifest}, line {number}: mass_kg {cells['mass_kg']!r} is not a number"
            ) from error
        files.append(
            ScanFile(
                manifest.parent / (cells.get("file") or f"{cells['id']}.ply"),
                cells.get("category", ""),
                cells["id"],
                group=cells.get("dup_group", ""),
                mass=mass,
                origin=Origin.SYNTHETIC if cells.get("kind") == "cad" else Origin.MACHINE,
                credit="; ".join(filter(None, (cells.get("source"), cells.get("licence")))),
                unit=cells.get("unit") or "m",
            )
        )
    return files


def _of_tree(folder: Path) -> list[ScanFile]:
    files = []
    inner = folder / "rgbd-dataset"
    folder = inner if inner.is_dir() else folder
    for path in sorted(p for p in folder.glob("*/**/*") if p.is_file()):
        place = path.relative_to(folder).parts
        known = path.suffix.lower() in READERS and path.suffix.lower() != ".txt"
        if not known and not path.name.endswith(("_depthcrop.png", "_depth.png")):
            continue
        match = WASHINGTON.fullmatch(path.stem)
        object_class = place[0].replace("_", " ")
        ycb = YCB.fullmatch(place[0])
        if ycb and place[1] == "google_16k":
            if path.name == "nontextured.ply":
                files.append(
                    ScanFile(path, ycb["class"].replace("_", " "), place[0], credit="YCB; CC-BY-4.0")
                )
        elif match and len(place) == 3:
            seen = f"{match['video']}_{match['frame']}"
            files.append(
                ScanFile(path, object_class, place[1], seen, credit="Washington RGB-D Object Dataset")
            )
        elif len(place) >= 3:
            files.append(ScanFile(path, object_class, place[1], "_".join((*place[2:-1], path.stem))))
        else:
            files.append(ScanFile(path, object_class, path.stem))
    return files


def select_paper(files: list[ScanFile]) -> list[ScanFile]:
    """Return the paper's 22 categories with at most Table 1's instances and scans per instance.

    Instances are taken in the order of their numbers, scans evenly spaced over an instance's.
    """
    chosen = []
    for object_class, (instances, scans) in PAPER_SELECTION.items():
        mine = [f for f in files if f.object_class == object_class]
        names = sorted({f.instance for f in mine}, key=_by_number)[:instances]
        for name in names:
            views = sorted((f for f in mine if f.instance == name), key=lambda f: _by_number(f.observation))
            picks = np.linspace(0, len(views) - 1, min(scans, len(views))).round().astype(int)
            chosen += [views[i] for i in dict.fromkeys(picks.tolist())]
    return chosen


def _by_number(name: str) -> tuple[list[int], str]:
    return [int(digits) for digits in re.findall(r"\d+", name)], name


def iter_scans(folder: str | Path, settings: FolderSettings | None = None) -> Iterator[Scan]:
    """Yield the scans of a folder, one in memory at a time.

    Parameters
    ----------
    folder : str or Path
    settings : FolderSettings or None

    Yields
    ------
    Scan
        Of a file with a mesh: the whole object (observation ""), then its views ("view_0", ...).

    Raises
    ------
    InputError
        If the folder holds no scans.
    ScanError
        If a scan is broken, unless `settings.keep_going`.

    Warns
    -----
    ErsatzWarning
        Of every scan skipped.
    """
    settings = settings or FolderSettings()
    for number, file in enumerate(list_scans(folder, settings.paper_selection)):
        try:
            scan = file.load()
            yield from views_of(scan, settings, number)
        except ScanError as error:
            if not settings.keep_going:
                raise
            warnings.warn(f"skipped: {error}", ErsatzWarning, stacklevel=2)


def views_of(scan: Scan, settings: FolderSettings | None = None, seed: int = 0) -> Iterator[Scan]:
    """Yield a scan as it is if it is one view; of all sides, the whole and views by a virtual camera.

    `seed` tells objects apart: each is seen from other sides.
    """
    settings = settings or FolderSettings()
    if scan.partial:
        yield scan
        return
    if settings.whole:
        yield scan
    for number, (points, eye) in enumerate(_pictures(scan, settings.camera, seed)):
        seen = "_".join(filter(None, (scan.observation, f"view_{number}")))
        yield replace(
            scan,
            points=points,
            observation=seen,
            sensor=eye,
            mesh=None,
            normals=None,
            colours=None,
            virtual=True,
        )


def _pictures(
    scan: Scan, camera: CameraSettings, seed: int
) -> Iterator[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    if scan.mesh is not None:
        yield from VirtualCamera(scan.mesh, camera).views(seed)
        return
    middle = (scan.points.min(axis=0) + scan.points.max(axis=0)) / 2
    for direction in viewing_directions(camera, seed):
        eye = middle + direction * camera.distance
        yield cloud_view(scan.points, eye), eye
