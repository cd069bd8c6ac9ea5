"""Saving: triples to a file, or to a new directory knowledge base."""

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Final

import pyoxigraph as ox

from ersatz.errors import InputError, KnowledgeBaseError
from ersatz.knowledge.directory import DirectoryStore
from ersatz.knowledge.paragraphs import batched
from ersatz.knowledge.revision import revision_line, revision_of
from ersatz.knowledge.stores import FORMATS, format_of
from ersatz.knowledge.terms import lines_of

PIECE: Final = 100_000
"""Triples that are loaded at once: more need more memory, fewer make the engine sort more files."""


def write(triples: Iterable[ox.Triple], target: Path) -> None:
    """Write triples to a file, or to a new directory knowledge base where the name has no suffix."""
    check_target(target)
    if format_of(target) is not None:
        from ersatz.knowledge.turtle import write_file

        try:
            write_file(triples, target)
        except PermissionError as error:
            raise KnowledgeBaseError(f"cannot write {str(target)!r}: {error.strerror}") from None
    else:
        DirectoryStore.create(target, _pieces(lines_of(triples)))


def check_target(target: Path) -> None:
    """Raise if nothing can be written under this name."""
    if not target.parent.is_dir():
        raise KnowledgeBaseError(f"there is no directory {str(target.parent)!r}: create it first")
    if format_of(target) is not None:
        if target.is_dir():
            raise KnowledgeBaseError(f"{str(target)!r} is a directory: choose another name")
    elif target.suffix and not target.is_dir():
        raise InputError(
            f"{target.name!r} says no RDF format: use {', '.join(FORMATS)} (each also with .gz), "
            "or no suffix for a directory"
        )
    elif target.is_file():
        raise KnowledgeBaseError(f"{str(target)!r} is a file: choose another name for the directory")


def with_revision(lines: Iterable[str]) -> Iterator[bytes]:
    """Yield the lines in pieces, and at last the revision that follows from them."""
    revision = 0
    for piece in batched(lines, PIECE):
        revision = revision_of(piece, revision)
        yield "".join(piece).encode()
    yield revision_line(revision).encode()


def _pieces(lines: Iterable[str]) -> Iterator[bytes]:
    return ("".join(piece).encode() for piece in batched(lines, PIECE))
