"""The shelf: arrays made of a snapshot of a directory knowledge base, kept inside it for the next to open.

Layout: `index/` in the snapshot's folder holds one `.npy` file an array, never changed once written, and
`manifest.json`: its own SHA-256 on the first line, then JSON with the format, the snapshot and the revision
it belongs to, the CRC-32 of each file, and the subjects of triples that were changed since the arrays were
made. A change gives the next snapshot the same files as hard links, with a longer list of subjects.

A shelf is a folder renamed into place, so it is whole or not there. What is stale, of another format or
damaged is not believed: it is as if nothing were there. Nothing is lost with a shelf; it may be deleted.
"""

import json
import mmap
import os
import shutil
import threading
import zlib
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from numpy.typing import NDArray

FORMAT: Final = 2
FOLDER: Final = "index"
MANIFEST: Final = "manifest.json"
MOST: Final = 10_000
"""Changed subjects a shelf may carry: with more, reading all anew is not slower."""


@dataclass(frozen=True, slots=True)
class Shelf:
    """Arrays as they were kept, and what has changed since.

    Attributes
    ----------
    arrays : mapping of name to array
        Mapped from the files, not read; read-only.
    about : JSON
        What was kept beside them.
    changed : frozenset of str
        IRIs of the subjects of all triples added or removed since the arrays were made.
    """

    arrays: "Mapping[str, NDArray[Any]]"
    about: Any
    changed: frozenset[str]


def subjects(lines: Iterable[str]) -> set[str]:
    """Return the IRIs of the subjects of lines of N-Triples.

    >>> subjects(["<urn:a> <urn:b> <urn:c> ."])
    {'urn:a'}
    """
    return {line.split(" ", 1)[0].strip("<>") for line in lines}


def keep(snapshot: Path, revision: str, arrays: "Mapping[str, NDArray[Any]]", about: Any) -> None:
    """Keep arrays in a snapshot, in place of what is kept there; do nothing where one may not write."""
    import numpy as np

    def fill(folder: Path) -> None:
        for name, array in arrays.items():
            np.save(folder / f"{name}.npy", array, allow_pickle=False)
        files = {name: _checksum(folder / f"{name}.npy") for name in arrays}
        _write_manifest(folder, snapshot, revision, {"files": files, "about": about, "changed": []})

    _put(snapshot, fill)


def find(snapshot: Path, revision: str) -> Shelf | None:
    """Return what is kept in a snapshot, if it is whole and of this revision."""
    import numpy as np

    try:
        found = _read_manifest(snapshot)
        if found is None or found["revision"] != revision:
            return None
        arrays = {}
        for name, checksum in found["files"].items():
            path = snapshot / FOLDER / f"{name}.npy"
            if _checksum(path) != checksum:
                return None
            arrays[name] = np.load(path, mmap_mode="r", allow_pickle=False)
        return Shelf(arrays, found["about"], frozenset(found["changed"]))
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return None


def carry(old: Path, new: Path, revision: str, changed: Iterable[str]) -> None:
    """Give a newer snapshot what an older one keeps, and the subjects that were changed in between."""
    try:
        found = _read_manifest(old)
    except (OSError, ValueError, KeyError, TypeError):
        return
    if found is None or len(everything := {*found["changed"], *changed}) > MOST:
        return

    def fill(folder: Path) -> None:
        for name in found["files"]:
            os.link(old / FOLDER / f"{name}.npy", folder / f"{name}.npy")
        _write_manifest(folder, new, revision, found | {"changed": sorted(everything)})

    _put(new, fill)


def _put(snapshot: Path, fill: Callable[[Path], None]) -> None:
    """Fill a folder and rename it into place."""
    fresh = snapshot / f".{FOLDER}-{os.getpid()}-{threading.get_ident()}"
    with suppress(OSError):
        try:
            fresh.mkdir()
            fill(fresh)
            with suppress(FileNotFoundError):
                (snapshot / FOLDER).rename(fresh / "old")
            fresh.rename(snapshot / FOLDER)
        finally:
            shutil.rmtree(fresh, ignore_errors=True)
            shutil.rmtree(snapshot / FOLDER / "old", ignore_errors=True)


def _write_manifest(folder: Path, snapshot: Path, revision: str, rest: dict[str, Any]) -> None:
    text = json.dumps(rest | {"format": FORMAT, "snapshot": snapshot.name, "revision": revision})
    (folder / MANIFEST).write_text(f"{sha256(text.encode()).hexdigest()}\n{text}\n", encoding="utf-8")


def _read_manifest(snapshot: Path) -> Any:
    """Return what the manifest says, or None if it is of another format or snapshot, or damaged."""
    checksum, text = (snapshot / FOLDER / MANIFEST).read_text(encoding="utf-8").splitlines()
    if sha256(text.encode()).hexdigest() != checksum:
        return None
    found = json.loads(text)
    return found if (found["format"], found["snapshot"]) == (FORMAT, snapshot.name) else None


def _checksum(path: Path) -> int:
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as whole:
        return zlib.crc32(whole)
