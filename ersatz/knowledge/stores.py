"""Stores: where triples live, behind one door. One file in memory is here; `directory`, `remote` are others.

A store answers queries and applies a change as a whole or not at all. All of them speak pyoxigraph's
terms. Nothing here knows what the triples mean.
"""

import gzip
import sys
import zlib
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final, Protocol, TypeAlias

import pyoxigraph as ox

from ersatz.errors import InputError, KnowledgeBaseError, LockedError

Results: TypeAlias = ox.QuerySolutions | ox.QueryBoolean | ox.QueryTriples

FORMATS: Final = {
    ".ttl": ox.RdfFormat.TURTLE,
    ".owl": ox.RdfFormat.RDF_XML,
    ".rdf": ox.RdfFormat.RDF_XML,
    ".nt": ox.RdfFormat.N_TRIPLES,
    ".jsonld": ox.RdfFormat.JSON_LD,
}
"""RDF formats by file suffix; each may be followed by `.gz`."""


class Store(Protocol):
    """What a knowledge base needs of the place it lives in."""

    location: str

    def query(self, text: str) -> Results:
        """Answer a SPARQL 1.1 query over the default graph."""

    def change(self, remove: Iterable[str], add: Iterable[str], guard: str) -> None:
        """Remove and add lines of N-Triples at once, if the triple `guard` still holds."""

    def close(self) -> None:
        """Let go of files and locks."""


def format_of(path: Path) -> tuple[ox.RdfFormat, bool] | None:
    """Return the RDF format a file name stands for and whether it is compressed, or None."""
    packed = path.suffix == ".gz"
    suffix = path.with_suffix("").suffix if packed else path.suffix
    return (FORMATS[suffix.lower()], packed) if suffix.lower() in FORMATS else None


class MemoryStore:
    """Triples in memory, read from a file or just made; changes stay there until they are saved."""

    def __init__(self, engine: ox.Store, location: str, stamp: tuple[int, ...] = ()) -> None:
        self.engine = engine
        self.location = location
        self._stamp = stamp

    @classmethod
    def read(cls, path: Path) -> "MemoryStore":
        """Load a file.

        Raises
        ------
        InputError
            If its name says no RDF format.
        KnowledgeBaseError
            If it does not exist, cannot be read, or is not what its name says.
        """
        known = format_of(path)
        if known is None:
            raise InputError(
                f"{path.name!r} is no RDF file by its name: use {', '.join(FORMATS)}, each also with .gz"
            )
        format_, packed = known
        engine = ox.Store()
        try:
            stamp = _stamp(path)
            raw = path.read_bytes()
            engine.bulk_load(gzip.decompress(raw) if packed else raw, format=format_)
        except FileNotFoundError:
            raise KnowledgeBaseError(f"there is no file {str(path)!r}: check the path") from None
        except (SyntaxError, ValueError, EOFError, zlib.error, gzip.BadGzipFile) as error:
            raise KnowledgeBaseError(
                f"{str(path)!r} is not valid {format_.name}: {one_line(error)}"
            ) from None
        except OSError as error:
            raise KnowledgeBaseError(f"cannot read {str(path)!r}: {error.strerror or error}") from None
        return cls(engine, str(path), stamp)

    def save(self, write: Callable[[], None]) -> None:
        """Write back to the file it was read from.

        Raises
        ------
        LockedError
            If the file is not the one that was read: somebody's changes would be lost.
        """
        path = Path(self.location)
        with _held(path):
            if self._stamp and path.exists() and _stamp(path) != self._stamp:
                raise LockedError(f"{self.location!r} was changed by another writer meanwhile: open it again")
            write()
            self._stamp = _stamp(path)

    def query(self, text: str) -> Results:
        """Answer a SPARQL 1.1 query."""
        return self.engine.query(text)

    def change(self, remove: Iterable[str], add: Iterable[str], guard: str) -> None:
        """Apply one transaction in memory."""
        if not self.engine.query(f"ASK {{ {guard} }}"):
            raise KnowledgeBaseError(
                f"{self.location!r} does not state its revision as ERSATZ writes it: build it again"
            )
        self.engine.update(change_text(remove, add, guard))

    def close(self) -> None:
        """Nothing is held."""


def _stamp(path: Path) -> tuple[int, ...]:
    """Return what tells whether a file was replaced or written to."""
    known = path.stat()
    return known.st_ino, known.st_size, known.st_mtime_ns


@contextmanager
def _held(path: Path) -> Iterator[None]:
    """Keep others who save this file waiting until they can see that it was replaced."""
    if sys.platform == "win32" or not path.exists():
        yield
        return
    import fcntl

    with path.open("rb") as handle:
        with suppress(OSError):  # not every file system has locks
            fcntl.flock(handle, fcntl.LOCK_EX)
        yield


def read_into(store: ox.Store, path: Path) -> None:
    """Read an RDF file in the format its name says.

    Raises
    ------
    KnowledgeBaseError
        If there is no such file.
    InputError
        If its name says no format we read, or its content is not in that format.
    """
    kind = ox.RdfFormat.from_extension(path.suffix.removeprefix(".").replace("owl", "rdf"))
    if kind is None:
        raise InputError(f"{path.name!r} says no RDF format: use .ttl, .nt, .owl, .rdf or .jsonld")
    try:
        # The base makes relative IRIs of foreign files harmless; ours have none.
        store.bulk_load(path=str(path), format=kind, base_iri="https://example.org/")
    except SyntaxError as error:
        raise InputError(f"{path.name!r} is no {kind.name}: {error}") from None
    except OSError as error:
        raise KnowledgeBaseError(f"cannot read {path}: {error.strerror or error}") from None


def change_text(remove: Iterable[str], add: Iterable[str], guard: str, graph: str | None = None) -> str:
    """Return one SPARQL update that does everything, or nothing if the guard does not hold."""
    opening, closing = (f"GRAPH <{graph}> {{", "}") if graph else ("", "")
    return (
        f"DELETE {{ {opening} {' '.join(remove)} {closing} }}\n"
        f"INSERT {{ {opening} {' '.join(add)} {closing} }}\n"
        f"WHERE {{ {opening} {guard} {closing} }}"
    )


def load_own(engine: ox.Store, lines: bytes) -> None:
    """Load lines of N-Triples whose IRIs were checked when they were made, so not once more."""
    engine.bulk_load(lines, format=ox.RdfFormat.N_TRIPLES, lenient=True)


def one_line(error: object) -> str:
    """Return the beginning of a message as one line."""
    return " ".join(str(error).split())[:300]
