"""Directory: a knowledge base on disk, for one writer and any number of readers."""

import ctypes
import os
import shutil
import sys
import time
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO

import pyoxigraph as ox

from ersatz.errors import KnowledgeBaseError, LockedError
from ersatz.knowledge import shelf
from ersatz.knowledge import vocabulary as v
from ersatz.knowledge.stores import Results, change_text, load_own, one_line


class DirectoryStore:
    """Oxigraph on RocksDB: one writer, and any number of readers of the newest published snapshot.

    Layout: `store/` is the writer's database; `snapshots/<n>/` are consistent copies (hard links) that
    readers open; the file `current` names the newest. A change is one transaction, then a snapshot,
    then an atomic swing of `current`: whoever is killed when, the next to open finds the knowledge
    before the change or after it. The file `unpublished` stands while the two may differ, and names the
    subjects of the change; who finds it and no writer publishes what was committed. A snapshot may hold
    a `shelf`, which a change carries over to the next.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.location = str(path)
        self._writer: ox.Store | None = None
        self._reader: ox.Store | None = None
        self._pin: BinaryIO | None = None
        self._snapshot: Path | None = None
        if (path / "unpublished").exists():
            with suppress(KnowledgeBaseError, OSError):  # a writer is at it, or we may only read
                _publish(self._lock(), path)
            self._writer = None
        self._open_reader()

    @classmethod
    def create(cls, path: Path, chunks: Iterable[bytes]) -> None:
        """Write a new directory knowledge base from N-Triples; replace an older one only when complete."""
        if path.exists() and not is_directory_store(path) and any(path.iterdir()):
            raise KnowledgeBaseError(
                f"{str(path)!r} is a directory, but no knowledge base: choose another name"
            )
        fresh = path.with_name(f".{path.name}.new-{os.getpid()}")
        shutil.rmtree(fresh, ignore_errors=True)
        try:
            (fresh / "snapshots").mkdir(parents=True)
            engine = ox.Store(str(fresh / "store"))
            for chunk in chunks:
                load_own(engine, chunk)
            engine.flush()
            _publish(engine, fresh)
            del engine
            _swap(fresh, path)
        except OSError as error:
            if isinstance(error, KnowledgeBaseError):
                raise
            raise KnowledgeBaseError(f"cannot write {str(path)!r}: {one_line(error)}") from None
        finally:
            shutil.rmtree(fresh, ignore_errors=True)

    @property
    def engine(self) -> ox.Store:
        """What is read: the newest snapshot, or the writer's own state once there was a change."""
        engine = self._writer or self._reader
        if engine is None:
            raise KnowledgeBaseError(f"{self.location!r} is closed: open it again")
        return engine

    def query(self, text: str) -> Results:
        """Answer a SPARQL 1.1 query."""
        return self.engine.query(text)

    def change(self, remove: Iterable[str], add: Iterable[str], guard: str) -> None:
        """Commit one transaction and publish it to readers."""
        held, writer = self._writer is not None, self._lock()
        if not writer.query(f"ASK {{ {guard} }}"):
            if not held:
                self._writer = None  # read on from the snapshot that was opened
            raise LockedError(f"{self.location!r} was changed by another writer meanwhile: open it again")
        gone, come, self._snapshot = list(remove), list(add), None
        try:
            with (self.path / "unpublished").open("a", encoding="utf-8") as file:
                file.write("\n" + "\n".join(shelf.subjects([*gone, *come])))
            writer.update(change_text(gone, come, guard))
            self._snapshot = _publish(writer, self.path)
        except OSError as error:
            raise KnowledgeBaseError(f"cannot write to {self.location!r}: {one_line(error)}") from None

    @property
    def snapshot(self) -> Path | None:
        """The folder of the published snapshot that is what is read; None if it is not there any more."""
        if self._snapshot is None or self._writer is not None or self._pin is None:
            return self._snapshot
        with suppress(OSError):
            if os.path.samestat(os.fstat(self._pin.fileno()), (self._snapshot / "CURRENT").stat()):
                return self._snapshot
        return None

    def close(self) -> None:
        """Release the writer's lock and the reader's snapshot."""
        self._writer = self._reader = None
        if self._pin is not None:
            self._pin.close()
            self._pin = None

    def _lock(self) -> ox.Store:
        if self._writer is None:
            self._writer = _open_writer(self.path)
        return self._writer

    def _open_reader(self) -> None:
        for _ in range(10):
            try:
                newest = self.path / "snapshots" / (self.path / "current").read_text().strip()
                self._pin = _pin(newest)
                self._reader = ox.Store.read_only(str(newest))
                self._snapshot = newest
                return
            except FileNotFoundError:
                time.sleep(0.01)  # the snapshot was retired between reading its name and opening it
            except (OSError, ValueError, RuntimeError) as error:
                self.close()
                raise KnowledgeBaseError(
                    f"{self.location!r} is damaged: {one_line(error)}; build it again"
                ) from None
        raise KnowledgeBaseError(f"{self.location!r} holds no complete knowledge base: build it again")


def is_directory_store(path: Path) -> bool:
    """Tell whether a directory is laid out as a directory knowledge base."""
    return (path / "store").is_dir() and (path / "current").is_file()


def _open_writer(path: Path) -> ox.Store:
    try:
        return ox.Store(str(path / "store"))
    except (OSError, RuntimeError) as error:
        if "lock" in str(error).lower():
            raise LockedError(f"{str(path)!r} is being written by another process: try again later") from None
        raise KnowledgeBaseError(f"cannot write to {str(path)!r}: {one_line(error)}") from None


def _publish(engine: ox.Store, path: Path) -> Path:
    """Copy the writer's state for readers, swing `current` to it, and retire what nobody reads."""
    snapshots, current, unpublished = path / "snapshots", path / "current", path / "unpublished"
    numbers = [int(p.name) for p in snapshots.iterdir() if p.name.isdigit()]
    newest = snapshots / f"{max(numbers, default=0) + 1:08d}"
    engine.backup(str(newest))
    stated = next(engine.quads_for_pattern(v.BUILD, v.REVISION, None), None)
    if stated is not None and current.exists() and unpublished.exists():
        changed = unpublished.read_text(encoding="utf-8").split()
        revision = str(stated.object).strip('"')
        shelf.carry(snapshots / current.read_text().strip(), newest, revision, changed)
    pending = path / "current.new"
    pending.write_text(newest.name)
    pending.replace(current)
    unpublished.unlink(missing_ok=True)
    for old in snapshots.iterdir():
        if old != newest:
            _retire(old)
    return newest


def _swap(fresh: Path, path: Path) -> None:
    """Put a new directory in the place of an older one that nobody writes to."""
    old = path.with_name(f".{path.name}.old-{os.getpid()}")
    writer = None
    if is_directory_store(path):
        try:
            writer = _open_writer(path)
        except LockedError:
            raise
        except KnowledgeBaseError:
            pass  # damaged: all the more reason to replace it
    if not (path.exists() and _exchange(fresh, path)):
        if path.exists():
            path.rename(old)
        fresh.rename(path)
    del writer
    shutil.rmtree(old, ignore_errors=True)


def _exchange(one: Path, other: Path) -> bool:
    """Exchange the names of two directories at once, so that neither is missing for a moment.

    False where the system or the file system cannot (any but Linux): a kill between the two renames that
    are needed then leaves the older knowledge base beside its place, as `.NAME.old-PID`.
    """
    if not sys.platform.startswith("linux"):
        return False
    rename = getattr(ctypes.CDLL(None), "renameat2", None)
    here, exchange = -100, 2  # AT_FDCWD, RENAME_EXCHANGE
    return rename is not None and rename(here, os.fsencode(one), here, os.fsencode(other), exchange) == 0


def _pin(snapshot: Path) -> BinaryIO | None:
    """Take a shared lock that keeps the writer from deleting a snapshot while it is read."""
    if sys.platform == "win32":
        return None
    import fcntl

    handle = (snapshot / "CURRENT").open("rb")  # closed with its store even if nobody does it
    fcntl.flock(handle, fcntl.LOCK_SH)
    if not (snapshot / "CURRENT").exists():
        handle.close()
        raise FileNotFoundError(snapshot)
    return handle


def _retire(snapshot: Path) -> None:
    """Delete a snapshot unless it is read; also what a killed writer left of one."""
    if sys.platform == "win32":
        return
    import fcntl

    if not (snapshot / "CURRENT").exists():
        shutil.rmtree(snapshot, ignore_errors=True)
        return
    with suppress(OSError):
        handle = os.open(snapshot / "CURRENT", os.O_RDONLY)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            shutil.rmtree(snapshot)
        finally:
            os.close(handle)
