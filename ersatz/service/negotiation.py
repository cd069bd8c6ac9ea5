"""Content negotiation: which of our formats a client likes best (RFC 9110, 12.5.1)."""

from collections.abc import Sequence
from typing import Final

TABLES: Final = (
    "application/sparql-results+json",
    "application/sparql-results+xml",
    "text/csv",
    "text/tab-separated-values",
)
GRAPHS: Final = ("text/turtle", "application/n-triples", "application/ld+json", "application/rdf+xml")
HTML: Final = "text/html"

_ALIASES: Final = {
    "application/json": "application/sparql-results+json",
    "text/json": "application/sparql-results+json",
    "application/xml": "application/sparql-results+xml",
    "text/xml": "application/sparql-results+xml",
}
_GRAPH_ALIASES: Final = {
    "application/json": "application/ld+json",
    "application/x-turtle": "text/turtle",
    "text/plain": "application/n-triples",
    "application/xml": "application/rdf+xml",
    "text/xml": "application/rdf+xml",
}


def best(accept: str, offered: Sequence[str], aliases: dict[str, str] | None = None) -> str | None:
    """Return the offered media type a client likes best, the first of equals, or None.

    >>> best("text/turtle;q=0.5, application/rdf+xml", GRAPHS)
    'application/rdf+xml'
    >>> best("text/*", TABLES), best("image/png", TABLES), best("", TABLES)
    ('text/csv', None, 'application/sparql-results+json')
    """
    ranges = _ranges(accept)
    if not ranges:
        return offered[0]
    scored = [(_quality(media, ranges, aliases or {}), -at) for at, media in enumerate(offered)]
    quality, at = max(scored)
    return offered[-at] if quality > 0 else None


def best_table(accept: str) -> str | None:
    """Return the format of a table, or None if the client takes none we have."""
    return best(accept, TABLES, _ALIASES)


def best_graph(accept: str) -> str | None:
    """Return the format of a graph, or None if the client takes none we have."""
    return best(accept, GRAPHS, _GRAPH_ALIASES)


def wants_page(accept: str) -> bool:
    """Tell whether a client would rather have a page than data: a browser."""
    return best(accept, (*GRAPHS, HTML)) == HTML and HTML in accept.lower()


def _ranges(accept: str) -> dict[str, float]:
    found: dict[str, float] = {}
    for part in accept.split(","):
        media, *parameters = (piece.strip().lower() for piece in part.split(";"))
        if not media:
            continue
        quality = 1.0
        for parameter in parameters:
            if parameter.startswith("q="):
                try:
                    quality = float(parameter[2:])
                except ValueError:
                    quality = 0.0
        found[media] = max(found.get(media, 0.0), quality)
    return found


def _quality(media: str, ranges: dict[str, float], aliases: dict[str, str]) -> float:
    exact = [q for name, q in ranges.items() if name == media or aliases.get(name) == media]
    if exact:
        return max(exact)
    kind = media.split("/", maxsplit=1)[0]
    return ranges.get(f"{kind}/*", ranges.get("*/*", 0.0))
