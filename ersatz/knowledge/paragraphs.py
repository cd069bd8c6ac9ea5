"""Paragraphs: all that is said of one thing, in the order of a file; sorted on disk where they are many.

A file lists the same knowledge in the same order, however large it is. What does not fit into one batch
is grouped and sorted batch by batch in temporary files, which are then merged.
"""

import marshal
import re
from collections.abc import Iterable, Iterator
from heapq import merge
from itertools import chain, groupby, islice
from pathlib import Path
from typing import IO, Any, Final, TypeAlias, TypeVar

import pyoxigraph as ox

from ersatz.knowledge import vocabulary as v

BATCH: Final = 250_000
"""Triples sorted in memory at once, some 150 MB of them."""
_BLOCK: Final = 64
"""Things read from a temporary file at once."""

_SECTIONS: Final = {
    str(v.OWL_ONTOLOGY): (0, "Header"),
    str(v.KNOWLEDGE_BUILD): (1, "How this came about"),
    str(v.SOURCE_CLASS): (1, "How this came about"),
    str(v.PHYSICAL_PROPERTY): (2, "Properties"),
    str(v.FUNCTIONAL_PROPERTY): (2, "Properties"),
    str(v.AXIS): (2, "Properties"),
    str(v.PHYSICAL_QUALITY): (3, "Qualities"),
    str(v.FUNCTIONAL_QUALITY): (3, "Qualities"),
    str(v.OWL_CLASS): (4, "Object classes"),
    str(v.CLASS_MODEL): (5, "Class knowledge"),
    str(v.FUNCTION_MODEL): (6, "Function models"),
    str(v.SUBSTITUTION_MODEL): (8, "Substitution models"),
    str(v.CANDIDATE_CLASS): (8, "Substitution models"),
    str(v.RELEVANCE): (8, "Substitution models"),
}
_INSTANCES: Final = (7, "Instances and what was measured of them")
_TYPE: Final = str(v.TYPE)
_FIRST: Final = {_TYPE: 0, str(v.SUBCLASS_OF): 1, str(v.LABEL): 2}

T = TypeVar("T")

Pairs: TypeAlias = list[tuple[str, str]]
"""(predicate, object) in N-Triples."""
Place: TypeAlias = tuple[int, str]
"""Number and title of a section."""
Paragraph: TypeAlias = tuple[tuple[int, str, list[str]], str, Pairs]
"""((section, title, parts of the name), subject, pairs)."""


def paragraphs(triples: Iterable[ox.Triple | ox.Quad], folder: Path | None = None) -> Iterator[Paragraph]:
    """Yield all that is said of each thing, in the order of the file.

    Parameters
    ----------
    triples : iterable of pyoxigraph.Triple or Quad
    folder : Path, optional
        Where temporary files go if there are more than `BATCH` triples; they have no names.
    """
    places: dict[str, Place] = {}
    groups = _groups(triples, places)
    first, second = next(groups, []), next(groups, None)
    if second is None:
        yield from sorted(_placed(first, places))
        return
    spilled = [_spill(group, folder) for group in chain([first], [second], groups)]
    first, second = [], []
    runs = [_spill(sorted(_placed(_unspill(file), places)), folder) for file in spilled]
    yield from _joined(merge(*map(_unspill, runs)))


def lines(triples: Iterable[ox.Triple | ox.Quad], folder: Path | None = None) -> Iterator[str]:
    """Yield the triples as lines of N-Triples, in the order of the file."""
    for _, subject, pairs in paragraphs(triples, folder):
        for predicate, value in pairs:
            yield f"{subject} {predicate} {value} .\n"


def batched(items: Iterable[T], size: int) -> Iterator[list[T]]:
    """Yield the items in lists of at most `size` (Python 3.12 has this in itertools)."""
    rest = iter(items)
    while piece := list(islice(rest, size)):
        yield piece


def _groups(
    triples: Iterable[ox.Triple | ox.Quad], places: dict[str, Place]
) -> Iterator[list[tuple[str, Pairs]]]:
    """Yield batches of things with their pairs; note the sections of those that have one of their own."""
    terms: dict[str, str] = {}  # one copy of each predicate
    for batch in batched(triples, BATCH):
        about: dict[str, Pairs] = {}
        for triple in batch:
            predicate = str(triple.predicate)
            pair = terms.setdefault(predicate, predicate), str(triple.object)
            about.setdefault(str(triple.subject), []).append(pair)
        for subject, pairs in about.items():
            for predicate, value in pairs:
                if predicate == _TYPE and value in _SECTIONS:
                    places[subject] = _SECTIONS[value]
                    break
        yield list(about.items())


def _placed(group: Iterable[tuple[str, Pairs]], places: dict[str, Place]) -> Iterator[Paragraph]:
    """Yield things with what they are sorted by."""
    for subject, pairs in group:
        names = _parts(subject)
        place = places.get(subject)
        if place is None:
            owner, dash, _ = subject.partition("-")
            place = places.get(f"{owner}>" if dash else _model(subject, names[0]), _INSTANCES)
        yield (*place, names), subject, sorted(pairs, key=_pair_order)


def _joined(ordered: Iterable[Paragraph]) -> Iterator[Paragraph]:
    """Yield each thing once, though its triples were in several batches."""
    for (key, subject), same in groupby(ordered, key=lambda paragraph: paragraph[:2]):
        parts = [pairs for *_, pairs in same]
        yield key, subject, parts[0] if len(parts) == 1 else sorted(chain(*parts), key=_pair_order)


def _spill(rows: Iterable[object], folder: Path | None) -> IO[bytes]:
    """Write rows to a temporary file in blocks, each after its length."""
    from tempfile import TemporaryFile

    file = TemporaryFile(dir=folder)  # noqa: SIM115  closed by who reads it
    for block in batched(rows, _BLOCK):
        data = marshal.dumps(block)
        file.write(len(data).to_bytes(8, "big"))
        file.write(data)
    return file


def _unspill(file: IO[bytes]) -> Iterator[Any]:
    with file:
        file.seek(0)
        while head := file.read(8):
            yield from marshal.loads(file.read(int.from_bytes(head, "big")))


def _parts(subject: str) -> list[str]:
    """Return the parts of a local name, so that a thing's details follow it: Bowl, then Bowl__size_2."""
    local = re.split(r"[#/]", subject.strip("<>"))[-1]
    return local.removeprefix("model_").replace("-", "__").split("__")


def _model(subject: str, name: str) -> str:
    """Return the model whose entry this would be: kb:model_Bowl for kb:Bowl__size_2."""
    namespace = subject[: max(subject.rfind("#"), subject.rfind("/")) + 1]
    return f"{namespace}model_{name}>"


def _pair_order(pair: tuple[str, str]) -> tuple[int, str, str]:
    return _FIRST.get(pair[0], 3), pair[0], pair[1].rstrip(">")
