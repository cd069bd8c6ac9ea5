"""What a query or an update may not contain, decided before it is evaluated.

The text is searched, not tokenised, as `knowledge.queries.refuse_foreign_access` does and says why. Workers
cannot open a socket anyway.
"""

import re
from dataclasses import dataclass
from typing import Final

from ersatz.errors import InputError
from ersatz.knowledge.queries import refuse_foreign_access, unescaped
from ersatz.knowledge.vocabulary import KB_ONTOLOGY

GRAPHS: Final = frozenset({KB_ONTOLOGY.value, KB_ONTOLOGY.value + "#"})
"""Names of the knowledge base as a graph; it is the default graph."""

_GAP: Final = r"(?:\s|#[^\n\r]*)*"
_NAME: Final = r"(<[^<>\s]*>?|[^\W\d]?[\w.\-]*:)"
_LOAD: Final = re.compile(rf"(?<![?$:@\w-])LOAD\b{_GAP}(?:SILENT\b)?{_GAP}{_NAME}", re.IGNORECASE)
_FROM: Final = re.compile(rf"(?<![?$:@\w-])(?:FROM|USING)\b{_GAP}(?:NAMED\b)?{_GAP}{_NAME}", re.IGNORECASE)
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
    try:
        refuse_foreign_access(text)
    except InputError as error:
        raise RefusedError(403, str(error)) from None
    plain = unescaped(text)
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


def _check_graph(name: str, where: str) -> None:
    if name not in GRAPHS:
        shown = name if len(name) < 200 else name[:200] + "…"
        raise RefusedError(
            403,
            f"{where} names the graph {shown!r}: there is only {KB_ONTOLOGY.value}, the default graph, "
            "and no other is fetched",
        )
