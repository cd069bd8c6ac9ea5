"""What a query or an update may not contain, decided before it is evaluated.

The text is searched, not tokenised: a scanner that skips strings and comments can be led to skip a
keyword the engine sees (`<` is an operator and opens an IRI; code points may be escaped). Where this is
too strict, for a literal such as "service <", the message says so. Workers cannot open a socket anyway.
"""

import re
from dataclasses import dataclass
from typing import Final

from ersatz.knowledge.vocabulary import KB_ONTOLOGY

GRAPHS: Final = frozenset({KB_ONTOLOGY.value, KB_ONTOLOGY.value + "#"})
"""Names of the knowledge base as a graph; it is the default graph."""

_GAP: Final = r"(?:\s|#[^\n\r]*)*"
_NAME: Final = r"(<[^<>\s]*>?|[^\W\d]?[\w.\-]*:)"
_SERVICE: Final = re.compile(
    rf"(?<![?$:@\w-])SERVICE\b{_GAP}(?:SILENT\b)?{_GAP}(?:{_NAME}|[?$])", re.IGNORECASE
)
_LOAD: Final = re.compile(rf"(?<![?$:@\w-])LOAD\b{_GAP}(?:SILENT\b)?{_GAP}{_NAME}", re.IGNORECASE)
_FROM: Final = re.compile(rf"(?<![?$:@\w-])(?:FROM|USING)\b{_GAP}(?:NAMED\b)?{_GAP}{_NAME}", re.IGNORECASE)
_ESCAPE: Final = re.compile(r"\\u([0-9A-Fa-f]{4})|\\U([0-9A-Fa-f]{8})")
_OPEN, _CLOSE = frozenset("([{"), frozenset(")]}")


class RefusedError(Exception):
    """A request that is understood and not served; `status` is its HTTP status."""

    def __init__(self, status: int, message: str, headers: dict[str, str] | None = None) -> None:
        super().__init__(message)
        self.status = status
        self.headers = headers or {}


@dataclass(frozen=True, slots=True)
class Dataset:
    """The graphs a query is asked of, by the protocol's parameters; none means the default."""

    default: tuple[str, ...] = ()
    named: tuple[str, ...] = ()


def inspect_query(text: str, dataset: Dataset, depth: int) -> None:
    """Raise if a query reaches outside the knowledge base, or is nested too deeply to be parsed.

    Raises
    ------
    RefusedError
        With status 400 or 403.
    """
    plain = _checked(text, depth)
    for graph in (*dataset.default, *dataset.named):
        _check_graph(graph, "the request")
    for found in _FROM.finditer(plain):
        _check_graph(found[1].strip("<>"), "FROM")


def inspect_update(text: str, depth: int) -> None:
    """Raise if an update reaches outside the knowledge base, or is nested too deeply.

    Raises
    ------
    RefusedError
        With status 400 or 403.
    """
    plain = _checked(text, depth)
    if _LOAD.search(plain):
        raise RefusedError(403, "LOAD is not allowed: nothing is fetched; send the triples with INSERT DATA")
    for found in _FROM.finditer(plain):
        _check_graph(found[1].strip("<>"), "USING")


def _checked(text: str, depth: int) -> str:
    if "\0" in text:
        raise RefusedError(400, "the query holds a null character")
    plain = _ESCAPE.sub(_unescape, text)
    if _SERVICE.search(plain):
        raise RefusedError(403, "SERVICE is not allowed: a query may only read this knowledge base")
    deepest = level = 0
    for character in plain:
        if character in _OPEN:
            level += 1
            deepest = max(deepest, level)
        elif character in _CLOSE:
            level -= 1
    if deepest > depth:
        raise RefusedError(400, f"the query has brackets {deepest} deep: at most {depth} are allowed")
    return plain


def _unescape(found: re.Match[str]) -> str:
    code = int(found[1] or found[2], 16)
    return chr(code) if code < 0x110000 else found[0]


def _check_graph(name: str, where: str) -> None:
    if name not in GRAPHS:
        shown = name if len(name) < 200 else name[:200] + "…"
        raise RefusedError(
            403,
            f"{where} names the graph {shown!r}: there is only {KB_ONTOLOGY.value}, the default graph, "
            "and no other is fetched",
        )
