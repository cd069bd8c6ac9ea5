"""Files: the knowledge base written down, one paragraph a thing, the same bytes for the same knowledge."""

import gzip
import os
import re
from collections.abc import Iterable, Iterator
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import IO, Final, cast

import pyoxigraph as ox

from ersatz.knowledge import vocabulary as v
from ersatz.knowledge.paragraphs import batched, lines, paragraphs
from ersatz.knowledge.stores import format_of

_PIECE: Final = 10_000
"""Words or lines that are written at once."""

_TYPE: Final = str(v.TYPE)
_NUMBER: Final = re.compile(rf'"([+-]?[0-9.]+)"\^\^<{re.escape(v.XSD)}(integer|decimal)>$')
_LETTERS: Final = (
    r"A-Z_a-z\u00c0-\u00d6\u00d8-\u00f6\u00f8-\u02ff\u0370-\u037d\u037f-\u1fff"
    r"\u2c00-\u2fef\u3001-\ud7ff"
)
_LOCAL: Final = re.compile(rf"[{_LETTERS}][{_LETTERS}0-9-]*\Z")
"""What may follow a prefix in Turtle; of its PN_LOCAL the part we need, anything else stays a full IRI."""
_NAMESPACES: Final = {namespace: prefix for prefix, namespace in v.PREFIXES.items()}


def write_file(triples: Iterable[ox.Triple | ox.Quad], path: Path) -> None:
    """Write triples to a file in the format its name says; an older file stays until the new is complete.

    Memory does not grow with their number (but with that of classes); more than a batch of them are sorted
    in temporary files beside it, which need about twice its room.
    """
    known = format_of(path)
    assert known is not None, path
    format_, packed = known
    pending = path.with_name(f".{path.name}.new-{os.getpid()}")
    try:
        with pending.open("wb") as raw, _packed(raw) if packed else nullcontext(raw) as file:
            if format_ is ox.RdfFormat.TURTLE:
                _write(turtle(triples, path.parent), file)
            elif format_ is ox.RdfFormat.N_TRIPLES:
                _write(lines(triples, path.parent), file)
            else:
                ox.serialize(_ordered(triples, path.parent), file, format_, prefixes=dict(v.PREFIXES))
        pending.replace(path)
    finally:
        pending.unlink(missing_ok=True)


def turtle(triples: Iterable[ox.Triple | ox.Quad], folder: Path | None = None) -> Iterator[str]:
    """Yield the triples as Turtle, sorted: header, properties, qualities, classes, models, instances."""
    for prefix, namespace in v.PREFIXES.items():
        yield f"@prefix {prefix}: <{namespace}> .\n"
    heading = ""
    for (_, title, *_rest), subject, pairs in paragraphs(triples, folder):
        if title != heading:
            yield f"\n\n# {title}\n"
            heading = title
        yield f"\n{_short(subject)}"
        previous = ""
        for predicate, value in pairs:
            if predicate == previous:
                yield f" , {_short(value)}" if predicate == _TYPE else f" ,\n        {_short(value)}"
            else:
                yield " a" if predicate == _TYPE else f"{' ;' if previous else ''}\n    {_short(predicate)}"
                yield f" {_short(value)}"
                previous = predicate
        yield " .\n"


def _ordered(triples: Iterable[ox.Triple | ox.Quad], folder: Path) -> Iterator[ox.Triple]:
    for piece in batched(lines(triples, folder), _PIECE):
        for quad in ox.parse("".join(piece).encode(), format=ox.RdfFormat.N_TRIPLES, lenient=True):
            yield quad.triple


def _packed(raw: IO[bytes]) -> AbstractContextManager[IO[bytes]]:
    return cast("AbstractContextManager[IO[bytes]]", gzip.GzipFile("", "wb", 9, raw, mtime=0))


def _write(words: Iterable[str], file: IO[bytes]) -> None:
    for piece in batched(words, _PIECE):
        file.write("".join(piece).encode())


def _short(term: str) -> str:
    """Return a term of N-Triples as Turtle abbreviates it."""
    if term[0] == "<":
        namespace = next((n for n in _NAMESPACES if term.startswith(n, 1)), None)
        if namespace is not None and _LOCAL.match(local := term[1 + len(namespace) : -1]):
            return f"{_NAMESPACES[namespace]}:{local}"
        return term
    if number := _NUMBER.match(term):
        return number[1] if number[2] == "integer" or "." in number[1] else f"{number[1]}.0"
    if term[0] == '"' and "^^<" + v.XSD in term:
        text, _, datatype = term.rpartition("^^")
        return f"{text}^^{_short(datatype)}"
    return term
