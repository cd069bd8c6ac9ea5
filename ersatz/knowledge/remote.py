"""A remote store: a SPARQL 1.1 Protocol endpoint, believed only where its answer is whole.

Public endpoints answer errors as web pages, break off in mid-answer and cut results at a number of rows
without a word. Each of these would read as less knowledge than there is, so each is an error here.
"""

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Final
from urllib.parse import parse_qs, urlencode
from urllib.request import Request

import pyoxigraph as ox

from ersatz.errors import KnowledgeBaseError, LockedError
from ersatz.knowledge.stores import Results, change_text, one_line
from ersatz.knowledge.transport import Transport, checked

_TABLES: Final = ("application/sparql-results+json", "application/json")
_GRAPHS: Final = {
    "application/n-triples": ox.RdfFormat.N_TRIPLES,
    "text/turtle": ox.RdfFormat.TURTLE,
    "application/rdf+xml": ox.RdfFormat.RDF_XML,
}
_PROLOGUE: Final = re.compile(r"(?:\s+|#[^\n]*|BASE\s*<[^>]*>|PREFIX\s*[^\s:]*:\s*<[^>]*>)*", re.IGNORECASE)
_DATASET: Final = re.compile(r"\bFROM\s+(?:NAMED\s+)?(?:<[^>]*>|[^\s{<]+)", re.IGNORECASE)
_TEMPLATE: Final = re.compile(r"CONSTRUCT\s*(?:\{[^{}]*\})?", re.IGNORECASE)

_NO: Final = b'{"head": {}, "boolean": false}'


class RemoteStore:
    """A SPARQL 1.1 Protocol endpoint.

    The URL's own query string is kept with every request; its `default-graph-uri`, if any, is also the
    graph that changes go to. Changes go to `update`; without it to the query endpoint's sibling
    `update`, as Oxigraph and Fuseki have it, where the path ends in `query` or `sparql`. A server that
    wants a login is answered from the file `credentials`, or the one `ERSATZ_CREDENTIALS` names.
    """

    def __init__(
        self, url: str, update: str | None = None, timeout: float = 60.0, credentials: Path | None = None
    ) -> None:
        parts = checked(url)
        self.location = url
        self._transport = Transport(timeout, credentials)
        self._whole = 0
        self.graph = parse_qs(parts.query).get("default-graph-uri", [None])[0]
        head, _, last = parts.path.rpartition("/")
        sibling = f"{head}/update" if last in ("query", "sparql") else parts.path
        self._update = update or parts._replace(path=sibling, query="").geturl()
        checked(self._update)

    def query(self, text: str) -> Results:
        """Answer a SPARQL 1.1 query.

        Raises
        ------
        SyntaxError
            If it is none; the endpoint does not see it then.
        KnowledgeBaseError
            If the endpoint cannot be reached in time, or its answer is an error, broken or cut short.
        """
        kind = type(ox.Store().query(text))
        if kind is ox.QueryTriples:
            self._check_solutions(text)
            accept = ", ".join(_GRAPHS)
            return self._read_graph(*self._post(self.location, {"query": text}, accept))
        body, media = self._post(self.location, {"query": text}, _TABLES[0])
        results, rows = self._read_table(body, media, kind)
        if kind is ox.QuerySolutions:
            self._check_rows(text, rows)
        return results

    def change(self, remove: Iterable[str], add: Iterable[str], guard: str) -> None:
        """Send one update request; raise if someone else's came first."""
        add = list(add)
        self.update(change_text(remove, add, guard, self.graph))
        if add and not self.query(f"ASK {{ {add[-1]} }}"):
            raise LockedError(f"{self.location!r} was changed by another writer meanwhile: open it again")

    def update(self, text: str) -> None:
        """Send a SPARQL 1.1 update."""
        self._post(self._update, {"update": text}, "*/*")

    def close(self) -> None:
        """Nothing is held."""

    def _check_rows(self, select: str, rows: int) -> None:
        """Raise if the answer to a SELECT was cut; fewer rows than once came whole cannot be."""
        if rows < self._whole:
            return
        expected = self._count(select)
        if rows < expected:
            raise KnowledgeBaseError(
                f"{self.location!r} cut its answer to {rows} of {expected} rows: "
                "ask for less, or raise its limit (of Virtuoso, ResultSetMaxRows)"
            )
        self._whole = rows

    def _check_solutions(self, text: str) -> None:
        """Raise if the solutions that a CONSTRUCT fills its template with do not come through whole."""
        prologue, body = _split(text)
        select, found = _TEMPLATE.subn("SELECT *", body, count=1) if _TEMPLATE.match(body) else (body, 0)
        if found and self._count(prologue + select) >= self._whole:
            self.query(prologue + select)

    def _count(self, select: str) -> int:
        """Return how many rows a SELECT has, from the endpoint itself."""
        prologue, body = _split(select)
        head, brace, rest = body.partition("{")
        dataset = " ".join(_DATASET.findall(head))
        inner = _DATASET.sub("", head) + brace + rest
        text = f"{prologue}\nSELECT (COUNT(*) AS ?n) {dataset}\nWHERE {{ {{ {inner}\n}} }}"
        try:
            ox.Store().query(text)
        except SyntaxError:
            raise KnowledgeBaseError(
                f"{self.location!r} may have cut the answer, and this query is in the way of checking it: "
                "write it without comments before its braces"
            ) from None
        body_, media = self._post(self.location, {"query": text}, _TABLES[0])
        results: Any = self._read_table(body_, media, ox.QuerySolutions)[0]
        numbers = [int(row[0].value) for row in results]
        if len(numbers) != 1:
            raise KnowledgeBaseError(f"{self.location!r} did not answer in SPARQL: a count has no number")
        return numbers[0]

    def _read_table(self, body: bytes, media: str, kind: type[Results]) -> tuple[Results, int]:
        """Return the answer to a SELECT or ASK, once it was read to its end, and its number of rows."""
        if media not in _TABLES:
            raise self._nonsense(f"{media} for results as JSON")
        try:
            results = ox.parse_query_results(body, format=ox.QueryResultsFormat.JSON)
            if kind is ox.QueryBoolean and _is_virtuosos_no(results):
                return ox.parse_query_results(_NO, format=ox.QueryResultsFormat.JSON), 1
            if not isinstance(results, kind):
                raise self._nonsense("another kind of result than was asked for")
            rows = sum(1 for _ in results) if isinstance(results, ox.QuerySolutions) else 1
            return ox.parse_query_results(body, format=ox.QueryResultsFormat.JSON), rows
        except (SyntaxError, ValueError) as error:
            raise self._nonsense(one_line(error)) from None

    def _read_graph(self, body: bytes, media: str) -> Results:
        """Return the triples of a CONSTRUCT or DESCRIBE."""
        if media not in _GRAPHS:
            raise self._nonsense(f"{media} for RDF")
        triples = ox.Store()
        try:
            triples.load(body, format=_GRAPHS[media])
        except (SyntaxError, ValueError) as error:
            raise self._nonsense(one_line(error)) from None
        return triples.query("CONSTRUCT { ?s ?p ?o } WHERE { ?s ?p ?o }")

    def _nonsense(self, what: str) -> KnowledgeBaseError:
        return KnowledgeBaseError(f"{self.location!r} did not answer in SPARQL: {what}; check the URL")

    def _post(self, url: str, form: dict[str, str], accept: str) -> tuple[bytes, str]:
        """Return the answer's body and media type."""
        headers = {"Accept": accept, "Content-Type": "application/x-www-form-urlencoded; charset=utf-8"}
        return self._transport.send(Request(url, urlencode(form).encode(), headers))


def _is_virtuosos_no(results: Results) -> bool:
    """Tell whether this is how Virtuoso says no to some an ASK: as a table without rows."""
    if not isinstance(results, ox.QuerySolutions):
        return False
    return [one.value for one in results.variables] == ["__ASK_RETVAL"] and not any(True for _ in results)


def _split(text: str) -> tuple[str, str]:
    """Return a query's prologue and the rest."""
    found = _PROLOGUE.match(text)
    at = found.end() if found else 0
    return text[:at], text[at:]
