"""Evaluator: answers one job at a time over a store, frame by frame."""

import socket
from collections.abc import Iterable, Iterator
from typing import Final

import pyoxigraph as ox

from ersatz.errors import ErsatzError
from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.stores import Store
from ersatz.knowledge.terms import lines_of
from ersatz.knowledge.vocabulary import BUILD, KB_ONTOLOGY, REVISION
from ersatz.resources import ONTOLOGY
from ersatz.service.frames import DATA, END, KIND, REFUSED, Job, frame
from ersatz.service.functions import Function, similarity_functions
from ersatz.service.sink import LimitError, Sink, row_counter


class UnacceptableError(Exception):
    """The client takes no format the answer has."""


class Evaluator:
    """Answers jobs over a store."""

    def __init__(self, store: Store, engine: ox.Store) -> None:
        self._engine = engine
        self._functions: dict[ox.NamedNode, Function] = similarity_functions(KnowledgeBase(store))

    def warm(self) -> None:
        """Read what the functions need, once, before forking."""
        for function in self._functions.values():
            function(KB_ONTOLOGY, KB_ONTOLOGY)

    def run(self, job: Job, connection: socket.socket) -> None:
        """Answer one job, frame by frame."""
        try:
            if job.action == "update":
                self._send_lines(self._difference(job.text), job, connection)
            elif job.action == "query":
                self._query(job, connection)
            else:
                self._send_triples(self._triples(job), job, connection)
            connection.sendall(frame(END, str(job.number).encode()))
        except UnacceptableError as error:
            _refuse(connection, job, 406, str(error))
        except LimitError as error:
            _refuse(connection, job, 422, f"{error}: ask for less, with LIMIT and OFFSET")
        except SyntaxError as error:
            _refuse(connection, job, 400, f"not valid SPARQL: {_line(error)}")
        except (ValueError, RuntimeError) as error:
            _refuse(connection, job, 400, f"it cannot be evaluated: {_line(error)}")
        except (OSError, ErsatzError) as error:
            _refuse(connection, job, 500, f"the knowledge base cannot be read: {_line(error)}")

    def _query(self, job: Job, connection: socket.socket) -> None:
        # The dataset is set whatever FROM says: the only graph it may name is the default one.
        results = self._engine.query(
            job.text,
            default_graph=[ox.DefaultGraph()],
            named_graphs=[],
            custom_functions=self._functions,  # type: ignore[arg-type]
        )
        if isinstance(results, ox.QueryTriples):
            self._send_triples(results, job, connection)
            return
        format_ = ox.QueryResultsFormat.from_media_type(job.table) if job.table else None
        if isinstance(results, ox.QueryBoolean) and job.table in ("text/csv", "text/tab-separated-values"):
            _begin(connection, job, f"{job.table}; charset=utf-8")
            connection.sendall(frame(DATA, b"true\n" if results else b"false\n"))
            return
        if format_ is None:
            raise UnacceptableError("the answer is a table: accept JSON, XML, CSV or TSV")
        sink = Sink(connection, job, row_counter(str(job.table)))
        if str(job.table).startswith("text/"):
            sink.counted(-1)  # the line of names is no row
        _begin(connection, job, _content_type(str(job.table)))
        results.serialize(sink, format=format_)  # type: ignore[arg-type]
        sink.flush()

    def _triples(self, job: Job) -> Iterable[ox.Triple]:
        if job.action == "terms":
            return (quad.triple for quad in ox.parse(path=str(ONTOLOGY / "ersatz.ttl")))
        if job.action == "describe":
            return _about(self._engine, ox.NamedNode(job.text))
        return (quad.triple for quad in self._engine.quads_for_pattern(None, None, None, ox.DefaultGraph()))

    def _send_triples(self, triples: Iterable[ox.Triple], job: Job, connection: socket.socket) -> None:
        if job.graph is None:
            raise UnacceptableError("the answer is a graph: accept Turtle, N-Triples, JSON-LD or RDF/XML")
        sink = Sink(connection, job, None)
        _begin(connection, job, _content_type(job.graph))
        ox.serialize(
            _each(triples, sink),
            sink,  # type: ignore[arg-type]
            format=ox.RdfFormat.from_media_type(job.graph),
            prefixes=_PREFIXES,
        )
        sink.flush()

    def _difference(self, update: str) -> Iterator[bytes]:
        """Yield what an update removes and adds, without making it last.

        The revision is left out: whoever applies the difference computes it.
        """
        scratch = ox.Store()
        scratch.bulk_extend(quad for quad in self._engine if isinstance(quad.graph_name, ox.DefaultGraph))
        scratch.update(update)
        if any(True for _ in scratch.named_graphs()):
            raise ValueError("there is only the default graph, and the update writes to another")
        before, after = set(_lines(self._engine)), set(_lines(scratch))
        for mark, lines in (("-", before - after), ("+", after - before)):
            yield from (f"{mark}{line}".encode() for line in sorted(lines))

    def _send_lines(self, lines: Iterable[bytes], job: Job, connection: socket.socket) -> None:
        sink = Sink(connection, job, None)
        _begin(connection, job, "application/n-triples")
        for line in lines:
            sink.counted(1)
            sink.write(line)
        sink.flush()


_PREFIXES: Final = {
    "ersatz": "https://w3id.org/ersatz#",
    "kb": "https://w3id.org/ersatz/kb#",
    "owl": "http://www.w3.org/2002/07/owl#",
    "rdfs": "http://www.w3.org/2000/01/rdf-schema#",
    "prov": "http://www.w3.org/ns/prov#",
}


def _each(triples: Iterable[ox.Triple], sink: Sink) -> Iterator[ox.Triple]:
    for triple in triples:
        sink.counted(1)
        yield triple


def _about(engine: ox.Store, node: ox.NamedNode) -> Iterator[ox.Triple]:
    """Yield the triples a thing is the subject of, and those that refer to it."""
    for quad in engine.quads_for_pattern(node, None, None):
        yield quad.triple
    for quad in engine.quads_for_pattern(None, None, node):
        yield quad.triple


def _lines(engine: ox.Store) -> Iterator[str]:
    """Yield all that is said but for the revision."""
    return lines_of(quad for quad in engine if quad.predicate != REVISION or quad.subject != BUILD)


def _content_type(media: str) -> str:
    return f"{media}; charset=utf-8" if media.startswith("text/") else media


def _begin(connection: socket.socket, job: Job, media: str) -> None:
    connection.sendall(frame(KIND, f"{job.number} {media}".encode()))


def _refuse(connection: socket.socket, job: Job, status: int, message: str) -> None:
    connection.sendall(frame(REFUSED, f"{job.number} {status} {message}".encode()))


def _line(error: object) -> str:
    return " ".join(str(error).split())[:500]
