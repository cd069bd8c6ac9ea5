"""Fetching the public data sets: resumed where it broke off, and checked against a recorded digest.

The publishers give no checksums, so the first complete fetch records them in `checksums.json` beside the
files, and later fetches are held to it. Copied into another folder, it holds that one to the same files.
"""

import hashlib
import json
import tarfile
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from ersatz.acquisition.download import Progress, download
from ersatz.acquisition.layouts import PAPER_SELECTION, YCB
from ersatz.errors import InputError, UnknownNameError

RECORD: Final = "checksums.json"
"""Name of the file of checksums."""


@dataclass(frozen=True, slots=True)
class DataSet:
    """A public data set of one archive an object.

    Attributes
    ----------
    base : str
        Address that the file names are appended to.
    objects : dict of str to str
        Class of each object.
    ending : str
        What a file's name has after the object's.
    credit : str
        Whom to cite, and the terms.
    """

    base: str
    objects: dict[str, str]
    ending: str
    credit: str

    @property
    def classes(self) -> dict[str, int]:
        """Number of objects of each class."""
        named = list(self.objects.values())
        return {name: named.count(name) for name in dict.fromkeys(named)}

    def files(self, classes: Sequence[str] = (), objects: Sequence[str] = ()) -> tuple[str, ...]:
        """Return the files of some classes and of some objects; of all where neither is named.

        Raises
        ------
        UnknownNameError
            If there is no such class or object; it offers the nearest name.
        """
        hint = "(ersatz fetch --list names all)"
        for what, given, known in (("class", classes, self.classes), ("object", objects, self.objects)):
            for name in given:
                if name not in known:
                    raise UnknownNameError(what, name, known, hint)
        everything = not (classes or objects)
        return tuple(
            f"{name}{self.ending}"
            for name, object_class in self.objects.items()
            if everything or name in objects or object_class in classes
        )


_YCB_OBJECTS: Final = (  # noqa: SIM905 (a list literal of as many lines reads worse)
    "003_cracker_box 004_sugar_box 005_tomato_soup_can 006_mustard_bottle 007_tuna_fish_can "
    "010_potted_meat_can 019_pitcher_base 024_bowl 025_mug 026_sponge 029_plate "
    "053_mini_soccer_ball 056_tennis_ball 065-g_cups"
).split()

DATA_SETS: Final[dict[str, DataSet]] = {
    "washington": DataSet(
        "https://rgbd-dataset.cs.washington.edu/dataset/rgbd-dataset_pcd_ascii/",
        {
            f"{name.replace(' ', '_')}_{number}": name
            for name, (instances, _) in PAPER_SELECTION.items()
            for number in range(1, instances + 1)
        },
        ".tar",
        "Lai, Bo, Ren, Fox, A Large-Scale Hierarchical Multi-View RGB-D Object Dataset, ICRA 2011; "
        "non-commercial research",
    ),
    "ycb": DataSet(
        "https://ycb-benchmarks.s3.amazonaws.com/data/google/",
        {name: match["class"].replace("_", " ") for name in _YCB_OBJECTS if (match := YCB.fullmatch(name))},
        "_google_16k.tgz",
        "Calli et al., The YCB Object and Model Set, ICAR 2015; CC-BY-4.0",
    ),
}
"""What the paper's experiment needs of the public data sets, at the publishers' own addresses."""


def data_set(name: str) -> DataSet:
    """Return a data set by its name.

    Raises
    ------
    UnknownNameError
        If there is none of that name.
    """
    if name not in DATA_SETS:
        raise UnknownNameError("data set", name, DATA_SETS, f"(known are {', '.join(DATA_SETS)})")
    return DATA_SETS[name]


def fetch(
    name: str,
    folder: str | Path,
    *,
    base: str | None = None,
    files: Sequence[str] | None = None,
    unpack: bool = True,
    progress: Progress | None = None,
) -> list[Path]:
    """Fetch a data set into a folder; what is there and whole is not fetched again.

    Parameters
    ----------
    name : str
        "washington" or "ycb".
    folder : str or Path
        Made if missing.
    base : str or None
        Address of a mirror, http or https.
    files : sequence of str or None
        Only these files; see `DataSet.files`.
    unpack : bool
        Whether archives are unpacked beside themselves; what is unpacked already stays as it is.
    progress : callable or None
        Called with (file, bytes here, bytes in all; 0 if the server does not say).

    Returns
    -------
    list of Path
        The archives, in the order of `files`.

    Raises
    ------
    UnknownNameError
        If there is no such data set.
    InputError
        If the server fails, a file is no archive or differs from its recorded checksum, or the folder
        cannot be written.
    """
    data = data_set(name)
    base = base or data.base
    if not base.startswith(("http://", "https://")):
        raise InputError(f"{base!r} is no address of a mirror: give one that begins with https://")
    folder = Path(folder)
    paths = []
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for file in data.files() if files is None else files:
            path = folder / Path(file).name
            if not path.is_file():
                download(f"{base.rstrip('/')}/{file}", path, progress)
            _check(path)
            if unpack:
                _unpack(path)
            paths.append(path)
    except OSError as error:
        where = error.filename or folder
        raise InputError(f"{where}: cannot be written: {error.strerror or error}") from error
    return paths


def _check(path: Path) -> None:
    """Compare a file with its recorded checksum, or record it; a file that is no archive is deleted."""
    with path.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
    record = path.with_name(RECORD)
    known = _recorded(record)
    if known.get(path.name, digest) != digest:
        raise InputError(
            f"{path}: its SHA-256 is {digest}, recorded was {known[path.name]}: delete it and fetch "
            f"again, or take its line out of {RECORD} if the publisher has changed the file"
        )
    if path.name in known:
        return
    if not tarfile.is_tarfile(path):
        with path.open("rb") as file:
            start = file.read(20)
        path.unlink()
        raise InputError(f"{path}: what the server sent is no archive, it begins with {start!r}; deleted")
    text = json.dumps(known | {path.name: digest}, indent=1, sort_keys=True) + "\n"
    fresh = record.with_name(f"{RECORD}.new")
    fresh.write_text(text, encoding="utf-8")
    fresh.replace(record)


def _recorded(record: Path) -> dict[str, str]:
    if not record.is_file():
        return {}
    try:
        known = json.loads(record.read_text(encoding="utf-8"))
    except ValueError as error:
        raise InputError(f"{record}: not a file of checksums ({error}); delete it to record anew") from error
    if not isinstance(known, dict) or not all(isinstance(digest, str) for digest in known.values()):
        raise InputError(f"{record}: not a file of names with their SHA-256; delete it to record anew")
    return known


def _unpack(path: Path) -> None:
    """Unpack what is not there yet of an archive, beside it."""
    try:
        with tarfile.open(path) as archive:
            new = [one for one in archive if not _unpacked(one, path.parent / one.name)]
            # The filter refuses names that lead out of the folder.
            archive.extractall(path.parent, new, filter="data")
    except (tarfile.TarError, EOFError, ValueError, zlib.error) as error:
        raise InputError(f"{path}: cannot be unpacked: {error}; delete it and fetch again") from error


def _unpacked(member: tarfile.TarInfo, path: Path) -> bool:
    return member.isfile() and path.is_file() and path.stat().st_size == member.size
