"""Files: the knowledge base written down, one paragraph a thing, the same bytes for the same knowledge."""

import gzip
import io
import os
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Final

import pyoxigraph as ox

from ersatz.knowledge import vocabulary as v
from ersatz.knowledge.stores import format_of

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
}
_INSTANCES: Final = (7, "Instances and what was measured of them")
_TYPE: Final = str(v.TYPE)
_FIRST: Final = {_TYPE: 0, str(v.SUBCLASS_OF): 1, str(v.LABEL): 2}
_NUMBER: Final = re.compile(rf'"([+-]?[0-9.]+)"\^\^<{re.escape(v.XSD)}(integer|decimal)>$')
_LETTERS: Final = (
    r"A-Z_a-z\u00c0-\u00d6\u00d8-\u00f6\u00f8-\u02ff\u0370-\u037d\u037f-\u1fff"
    r"\u2c00-\u2fef\u3001-\ud7ff"
)
_LOCAL: Final = re.compile(rf"[{_LETTERS}][{_LETTERS}0-9-]*\Z")
"""What may follow a prefix in Turtle; of its PN_LOCAL the part we need, anything else stays a full IRI."""
_NAMESPACES: Final = {namespace: prefix for prefix, namespace in v.PREFIXES.items()}

Statements = dict[str, list[tuple[str, str]]]


def write_file(triples: Iterable[ox.Triple | ox.Quad], path: Path) -> None:
    """Write triples to a file in the format its name says; an older file stays until the new is complete."""
    known = format_of(path)
    assert known is not None, path
    format_, packed = known
    if format_ is ox.RdfFormat.TURTLE:
        data = "".join(turtle(triples)).encode()
    else:
        data = _serialize(triples, format_)
    pending = path.with_name(f".{path.name}.new-{os.getpid()}")
    try:
        pending.write_bytes(gzip.compress(data, mtime=0) if packed else data)
        pending.replace(path)
    finally:
        pending.unlink(missing_ok=True)


def turtle(triples: Iterable[ox.Triple | ox.Quad]) -> Iterator[str]:
    """Yield the triples as Turtle, sorted: header, properties, qualities, classes, models, instances."""
    for prefix, namespace in v.PREFIXES.items():
        yield f"@prefix {prefix}: <{namespace}> .\n"
    heading = ""
    for (_, title, *_rest), subject, pairs in _paragraphs(triples):
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


def _serialize(triples: Iterable[ox.Triple | ox.Quad], format_: ox.RdfFormat) -> bytes:
    ordered = ox.parse(
        io.BytesIO(
            "".join(
                f"{subject} {predicate} {value} .\n"
                for _, subject, pairs in _paragraphs(triples)
                for predicate, value in pairs
            ).encode()
        ),
        format=ox.RdfFormat.N_TRIPLES,
    )
    data = ox.serialize((quad.triple for quad in ordered), format=format_, prefixes=dict(v.PREFIXES))
    assert data is not None
    return data


def _paragraphs(
    triples: Iterable[ox.Triple | ox.Quad],
) -> list[tuple[tuple[int, str, list[str]], str, list[tuple[str, str]]]]:
    """Return (place, subject, sorted pairs) in the order of the file."""
    about: Statements = {}
    for triple in triples:
        about.setdefault(str(triple.subject), []).append((str(triple.predicate), str(triple.object)))
    places: dict[str, tuple[int, str]] = {}
    for subject, pairs in about.items():
        named = (_SECTIONS[value] for predicate, value in pairs if predicate == _TYPE and value in _SECTIONS)
        places[subject] = next(named, _INSTANCES)
    models = {_parts(subject)[0]: place for subject, place in places.items() if place[0] in (5, 6)}
    rows = []
    for subject, pairs in about.items():
        place, parts = places[subject], _parts(subject)
        if place == _INSTANCES:
            owner, dash, _ = subject.rpartition("-")
            place = places.get(f"{owner}>", place) if dash else models.get(parts[0], place)
        rows.append(((*place, parts), subject, sorted(pairs, key=_pair_order)))
    return sorted(rows)


def _parts(subject: str) -> list[str]:
    """Return the parts of a local name, so that a thing's details follow it: Bowl, then Bowl__size_2."""
    local = re.split(r"[#/]", subject.strip("<>"))[-1]
    return local.removeprefix("model_").replace("-", "__").split("__")


def _pair_order(pair: tuple[str, str]) -> tuple[int, str, str]:
    return _FIRST.get(pair[0], 3), pair[0], pair[1].rstrip(">")


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
