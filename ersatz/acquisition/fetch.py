"""Fetching the public data sets: resumed where it broke off, and checked against a recorded digest.

The publishers give no checksums, so the first complete fetch records them in `checksums.json` beside the
files, and later fetches are held to it.
"""

import hashlib
import json
import shutil
import tarfile
import urllib.error
import urllib.request
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from ersatz.acquisition.layouts import PAPER_SELECTION
from ersatz.errors import InputError, UnknownNameError

CHUNK: Final = 1 << 20
RECORD: Final = "checksums.json"


@dataclass(frozen=True, slots=True)
class DataSet:
    """A public data set.

    Attributes
    ----------
    base : str
        Address that the file names are appended to.
    files : tuple of str
    credit : str
        Whom to cite, and the terms.
    """

    base: str
    files: tuple[str, ...]
    credit: str


_YCB_OBJECTS: Final = (  # noqa: SIM905 (a list literal of as many lines reads worse)
    "003_cracker_box 004_sugar_box 005_tomato_soup_can 006_mustard_bottle 007_tuna_fish_can "
    "010_potted_meat_can 019_pitcher_base 024_bowl 025_mug 026_sponge 029_plate "
    "053_mini_soccer_ball 056_tennis_ball 065-g_cups"
).split()

DATA_SETS: Final[dict[str, DataSet]] = {
    "washington": DataSet(
        "https://rgbd-dataset.cs.washington.edu/dataset/rgbd-dataset_pcd_ascii/",
        tuple(
            f"{name.replace(' ', '_')}_{number}.tar"
            for name, (instances, _) in PAPER_SELECTION.items()
            for number in range(1, instances + 1)
        ),
        "Lai, Bo, Ren, Fox, A Large-Scale Hierarchical Multi-View RGB-D Object Dataset, ICRA 2011; "
        "non-commercial research",
    ),
    "ycb": DataSet(
        "https://ycb-benchmarks.s3.amazonaws.com/data/google/",
        tuple(f"{name}_google_16k.tgz" for name in _YCB_OBJECTS),
        "Calli et al., The YCB Object and Model Set, ICAR 2015; CC-BY-4.0",
    ),
}
"""The publishers' own addresses; `fetch` takes another base for a mirror.

Both name one archive an object: users of the Washington data set fetch apple_1.tar, banana_1.tar and
camera_1.tar from this folder.
"""


def fetch(
    name: str,
    folder: str | Path,
    *,
    base: str | None = None,
    files: tuple[str, ...] | None = None,
    unpack: bool = True,
    progress: Callable[[str, int, int], None] | None = None,
) -> list[Path]:
    """Fetch a data set into a folder; what is there and whole is not fetched again.

    Parameters
    ----------
    name : str
        "washington" or "ycb".
    folder : str or Path
        Made if missing.
    base : str or None
        Address of a mirror.
    files : tuple of str or None
        Only these files.
    unpack : bool
        Whether archives are unpacked beside themselves.
    progress : callable or None
        Called with (file, bytes here, bytes in all; 0 if the server does not say).

    Returns
    -------
    list of Path
        The files fetched.

    Raises
    ------
    UnknownNameError
        If there is no such data set.
    InputError
        If the server fails, or a file differs from its recorded checksum.
    """
    if name not in DATA_SETS:
        raise UnknownNameError("data set", name, DATA_SETS)
    data = DATA_SETS[name]
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    record = folder / RECORD
    known: dict[str, str] = json.loads(record.read_text(encoding="utf-8")) if record.is_file() else {}
    paths = []
    for file in files or data.files:
        path = folder / Path(file).name
        if not path.is_file():
            _download((base or data.base) + file, path, progress)
        digest = _digest(path)
        if known.setdefault(path.name, digest) != digest:
            raise InputError(
                f"{path}: its SHA-256 is {digest}, recorded was {known[path.name]}: delete it and fetch again"
            )
        record.write_text(json.dumps(known, indent=1, sort_keys=True) + "\n", encoding="utf-8")
        if unpack and tarfile.is_tarfile(path):
            with tarfile.open(path) as archive:
                # The filter refuses names that lead out of the folder.
                archive.extractall(folder, filter="data")
        paths.append(path)
    return paths


def _download(address: str, path: Path, progress: Callable[[str, int, int], None] | None) -> None:
    """Fetch one file into `<path>.part`, going on where an earlier try stopped, and rename it when whole."""
    part = path.with_name(path.name + ".part")
    have = part.stat().st_size if part.is_file() else 0
    request = urllib.request.Request(address, headers={"Range": f"bytes={have}-"} if have else {})
    try:
        with urllib.request.urlopen(request, timeout=60) as answer:
            resumed = answer.status == 206
            have = have if resumed else 0
            total = have + int(answer.headers.get("Content-Length") or 0)
            with part.open("ab" if resumed else "wb") as file:
                while chunk := answer.read(CHUNK):
                    file.write(chunk)
                    have += len(chunk)
                    if progress is not None:
                        progress(path.name, have, total)
    except urllib.error.HTTPError as error:
        # 416: nothing is left to fetch, the earlier try stopped just before the renaming.
        if error.code != 416 or not have:
            raise InputError(f"{address}: the server answers {error.code} {error.reason}") from error
        total = have
    except (urllib.error.URLError, OSError) as error:
        raise InputError(f"{address}: {error}; {have} bytes are kept, fetch again to go on") from error
    if total and have < total:
        raise InputError(
            f"{address}: the connection ended after {have} of {total} bytes; fetch again to go on"
        )
    shutil.move(part, path)


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
