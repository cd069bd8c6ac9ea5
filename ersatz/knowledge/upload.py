"""Upload: a knowledge base into a graph of a SPARQL server, in pieces, by the Graph Store Protocol.

A graph is believed to hold a knowledge base once it states format and revision. The revision goes first,
so that a broken upload can be told and gone on with; the format goes last, when the number of triples is
right. Whoever is killed when: the graph holds what it held before, an upload that nobody believes, or all.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote, urlsplit
from urllib.request import Request

from ersatz.errors import InputError, KnowledgeBaseError
from ersatz.knowledge import vocabulary as v
from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.paragraphs import batched, lines
from ersatz.knowledge.remote import RemoteStore
from ersatz.knowledge.revision import revision_line
from ersatz.knowledge.terms import integer
from ersatz.knowledge.transport import Transport, checked

_DEFAULT_STAGE: Final = "https://w3id.org/ersatz/kb/upload"
"""Where a new knowledge base waits for its place in the default graph."""
_FORMAT: Final = f"{v.BUILD} {v.FORMAT} "


@dataclass(frozen=True, slots=True)
class UploadSettings:
    """How a knowledge base is sent.

    Attributes
    ----------
    graphs : str, optional
        URL of the server's Graph Store Protocol; without it the one beside the SPARQL endpoint that
        Oxigraph, Fuseki and Virtuoso have.
    update : str, optional
        URL changes go to; needed only to replace.
    credentials : Path, optional
        File of secrets; else the one that `ERSATZ_CREDENTIALS` names.
    replace : bool
        Whether an older knowledge base, or another unfinished upload, may be replaced.
    piece : int
        Triples a request.
    timeout : float, seconds
        Of one request.
    """

    graphs: str | None = None
    update: str | None = None
    credentials: Path | None = None
    replace: bool = False
    piece: int = 50_000
    timeout: float = 600.0

    def __post_init__(self) -> None:
        """Refuse pieces of nothing."""
        if self.piece < 1:
            raise InputError(f"piece is {self.piece}: it must be 1 or more")


def upload(
    kb: KnowledgeBase,
    url: str,
    settings: UploadSettings | None = None,
    progress: Callable[[str, float], None] = lambda _stage, _share: None,
) -> int:
    """Send a knowledge base to the graph that a URL reads; return its number of triples.

    Parameters
    ----------
    kb : KnowledgeBase
    url : str
        The SPARQL endpoint as it will be opened; its `default-graph-uri` names the graph, without it the
        server's default graph is written.
    settings : UploadSettings, optional
    progress : callable
        Told the stage and the share of the work done.

    Raises
    ------
    InputError
        If the graph holds something that must not be replaced, or the server's addresses are not known.
    KnowledgeBaseError
        If the server refuses, cannot be reached or loses triples; the same command goes on from there.
    """
    settings = settings or UploadSettings()
    server = _Server(url, settings)
    target = server.graph
    state = server.state(target)
    if state.complete:
        if not settings.replace:
            raise InputError(f"{url!r} holds a knowledge base: name another graph, or replace it (--replace)")
        target = f"{target}#upload" if target else _DEFAULT_STAGE
        state = server.state(target)
    if state.triples and (state.complete or state.revision != kb.revision):
        _refuse_foreign(url, state, settings)
        server.drop(target)
        state = _State(0, "", False)
    total = _send(kb, server, target, state, settings.piece, progress)
    if target is not None and target != server.graph:
        server.move(target)
    if (found := server.open().revision) != kb.revision:
        raise KnowledgeBaseError(
            f"{url!r} is of revision {found}, not of {kb.revision}: someone else wrote to it"
        )
    return total


@dataclass(frozen=True, slots=True)
class _State:
    """What a graph holds: triples, the revision it states, and whether it states a format too."""

    triples: int
    revision: str
    complete: bool


class _Server:
    """The three addresses of a server: questions, changes, graphs."""

    def __init__(self, url: str, settings: UploadSettings) -> None:
        self._url = url
        self._settings = settings
        self._graphs = settings.graphs or _graphs_of(url)
        checked(self._graphs)
        self._transport = Transport(settings.timeout, settings.credentials)
        self._store = self._reading(url)
        self.graph = self._store.graph

    def _reading(self, url: str) -> RemoteStore:
        return RemoteStore(url, self._settings.update, self._settings.timeout, self._settings.credentials)

    def open(self) -> KnowledgeBase:
        """Return the knowledge base as anyone finds it."""
        return KnowledgeBase(self._store)

    def state(self, graph: str | None) -> _State:
        """Return what a graph holds."""
        parts = urlsplit(self._url)
        query = f"default-graph-uri={quote(graph, safe='')}" if graph else ""
        store = self._reading(parts._replace(query=query).geturl())
        known: Any = store.query(f"SELECT ?p ?o WHERE {{ {v.BUILD} ?p ?o }}")
        said = {str(row["p"]): row["o"].value for row in known}
        count: Any = store.query("SELECT (COUNT(*) AS ?n) WHERE { ?s ?p ?o }")
        return _State(int(next(iter(count))["n"].value), said.get(str(v.REVISION), ""), str(v.FORMAT) in said)

    def add(self, graph: str | None, piece: list[str]) -> None:
        """Add triples to a graph; those that are there stay as they are."""
        self._send(graph, "POST", "".join(piece).encode())

    def drop(self, graph: str | None) -> None:
        """Delete a graph."""
        self._send(graph, "DELETE", None)

    def move(self, stage: str) -> None:
        """Put a graph in the place of the target, at once."""
        to = f"GRAPH <{self.graph}>" if self.graph else "DEFAULT"
        self._store.update(f"MOVE GRAPH <{stage}> TO {to}")

    def _send(self, graph: str | None, method: str, data: bytes | None) -> None:
        named = f"graph={quote(graph, safe='')}" if graph else "default"
        headers = {"Content-Type": "application/n-triples"} if data else {}
        self._transport.send(Request(f"{self._graphs}?{named}", data, headers, method=method))


def _send(
    kb: KnowledgeBase,
    server: _Server,
    graph: str | None,
    state: _State,
    piece: int,
    progress: Callable[[str, float], None],
) -> int:
    """Send all triples in the order of a file, the format last; go on where an earlier upload stopped."""
    total = int(str(kb.query("SELECT (COUNT(*) AS ?n) WHERE { ?s ?p ?o }")[0]["n"]))
    first, last = revision_line(int(kb.revision, 16)), f"{_FORMAT}{integer(v.FORMAT_VERSION)} .\n"
    there = max(state.triples - 1, 0)
    try:
        server.add(graph, [first])
        for start in dict.fromkeys((there - there % piece, 0)):
            # What is still missing after that came in another order: all goes again, nothing is there twice.
            body = (line for line in lines(kb.triples()) if line not in (first, last))
            for at, some in enumerate(batched(body, piece)):
                if at * piece >= start:
                    server.add(graph, some)
                    progress("sending", min((at + 1) * piece / total, 1.0))
            if (found := server.state(graph).triples) == total - 1:
                break
        else:
            raise KnowledgeBaseError(f"{found} triples arrived of {total - 1}")
        server.add(graph, [last])
    except KnowledgeBaseError as error:
        raise KnowledgeBaseError(
            f"{error}; what was sent is no knowledge base yet: the same command goes on with it"
        ) from None
    return total


def _refuse_foreign(url: str, state: _State, settings: UploadSettings) -> None:
    """Raise unless what is in the way is ours and may go."""
    if not state.revision:
        raise InputError(
            f"the graph of {url!r} holds {state.triples} triples that are no knowledge base: "
            "name an empty one by default-graph-uri"
        )
    if not settings.replace:
        raise InputError(
            f"{url!r} holds an unfinished upload of another knowledge base: "
            "finish that, or replace it (--replace)"
        )


def _graphs_of(url: str) -> str:
    """Return where a server keeps its Graph Store Protocol, by where it answers SPARQL.

    >>> _graphs_of("http://host:7878/query"), _graphs_of("http://host/fleet/sparql?default-graph-uri=urn:a")
    ('http://host:7878/store', 'http://host/fleet/data')
    """
    parts = checked(url)
    head, _, name = parts.path.rpartition("/")
    if name not in ("query", "sparql"):
        raise InputError(f"where is the Graph Store Protocol of {url!r}? Say it (--graphs URL)")
    known = {"/query": "store", "/sparql": "sparql-graph-crud-auth"}
    return parts._replace(path=f"{head}/{known.get(parts.path, 'data')}", query="").geturl()
