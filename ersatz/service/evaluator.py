"""A worker: a process of its own that evaluates one query at a time, and may be ended at any moment.

`python -m ersatz.service.evaluator` is the parent of all workers. It reads the knowledge base once and
forks a worker for every line "fork" it is told, so that a new worker is ready in milliseconds and shares
the parent's memory. It does nothing else and holds no threads, which makes forking safe.
"""

import json
import os
import signal
import socket
import sys
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any, Final

import pyoxigraph as ox

from ersatz.errors import ErsatzError
from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.stores import DirectoryStore, MemoryStore, Store
from ersatz.knowledge.vocabulary import KB_ONTOLOGY, REVISION
from ersatz.resources import ONTOLOGY
from ersatz.service.confinement import confine
from ersatz.service.frames import DATA, END, HEADER, HELLO, JOB, KIND, REFUSED, Job, frame
from ersatz.service.functions import Function, similarity_functions

PIECE: Final = 1 << 16
"""Bytes sent at once."""


class LimitError(Exception):
    """The answer is larger than allowed."""


class UnacceptableError(Exception):
    """The client takes no format the answer has."""


class Sink:
    """A file that sends what is written in pieces, and counts rows and bytes."""

    def __init__(self, connection: socket.socket, job: Job, count: Callable[[bytes], int] | None) -> None:
        self._connection = connection
        self._job = job
        self._count = count
        self._pieces: list[bytes] = []
        self._waiting = self._bytes = self._rows = 0

    def write(self, data: bytes) -> int:
        """Take some bytes.

        Raises
        ------
        LimitError
            If the answer has become too large.
        """
        self._bytes += len(data)
        if self._bytes > self._job.answer_bytes:
            raise LimitError(f"the answer is larger than {self._job.answer_bytes >> 20} MiB")
        if self._count is not None:
            self.counted(self._count(data))
        self._pieces.append(bytes(data))
        self._waiting += len(data)
        if self._waiting >= PIECE:
            self.flush()
        return len(data)

    def counted(self, rows: int) -> None:
        """Add rows; raise LimitError if there are too many."""
        self._rows += rows
        if self._rows > self._job.rows:
            raise LimitError(f"the answer has more than {self._job.rows} rows")

    def flush(self) -> None:
        """Send what is waiting."""
        if self._pieces:
            self._connection.sendall(frame(DATA, b"".join(self._pieces)))
            self._pieces.clear()
            self._waiting = 0


def row_counter(media: str) -> Callable[[bytes], int]:
    """Return what counts the rows in successive pieces of a table; rows without a value count as none."""
    if media == "text/tab-separated-values":
        return lambda data: data.count(b"\n")  # line breaks in values are escaped
    if media == "text/csv":
        return _csv_rows()
    # Within a string of JSON or of XML neither mark can appear, for " and < are escaped there.
    mark = b'},{"' if media == "application/sparql-results+json" else b"</result>"
    return _marks(mark)


def _marks(mark: bytes) -> Callable[[bytes], int]:
    tail = b""

    def count(data: bytes) -> int:
        nonlocal tail
        seen = tail + data
        tail = seen[-len(mark) + 1 :]
        return seen.count(mark)

    return count


def _csv_rows() -> Callable[[bytes], int]:
    quoted = False

    def count(data: bytes) -> int:
        nonlocal quoted
        rows = 0
        for at, part in enumerate(data.split(b'"')):
            if at:
                quoted = not quoted
            if not quoted:
                rows += part.count(b"\n")
        return rows

    return count


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
    for quad in engine:
        if quad.predicate != REVISION or not str(quad.subject).endswith("build_1>"):
            yield f"{quad.subject} {quad.predicate} {quad.object} .\n"


def _content_type(media: str) -> str:
    return f"{media}; charset=utf-8" if media.startswith("text/") else media


def _begin(connection: socket.socket, job: Job, media: str) -> None:
    connection.sendall(frame(KIND, f"{job.number} {media}".encode()))


def _refuse(connection: socket.socket, job: Job, status: int, message: str) -> None:
    connection.sendall(frame(REFUSED, f"{job.number} {status} {message}".encode()))


def _line(error: object) -> str:
    return " ".join(str(error).split())[:500]


def _receive(connection: socket.socket, size: int) -> bytes:
    data = bytearray()
    while len(data) < size:
        piece = connection.recv(size - len(data))
        if not piece:
            raise EOFError
        data += piece
    return bytes(data)


def work(evaluator: Evaluator, address: str, memory: int) -> None:
    """Connect to the service and answer jobs until it hangs up."""
    connection = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    connection.connect(address)
    confine(memory)
    connection.sendall(frame(HELLO, str(os.getpid()).encode()))
    while True:
        letter, size = HEADER.unpack(_receive(connection, HEADER.size))
        fields = json.loads(_receive(connection, size))
        assert letter == JOB
        evaluator.run(Job(**fields), connection)


def open_store(spec: dict[str, Any]) -> tuple[Store, ox.Store]:
    """Open what the workers read: a directory, or a copy of the knowledge base in N-Triples."""
    if spec["directory"]:
        directory = DirectoryStore(Path(spec["path"]))
        return directory, directory.engine
    memory = MemoryStore.read(Path(spec["path"]))
    return memory, memory.engine


def _become_worker(evaluator: Evaluator | None, spec: dict[str, Any]) -> None:
    """Run as a worker; never return."""
    code = 1
    try:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        os.close(0)
        work(evaluator or Evaluator(*open_store(spec)), spec["address"], spec["memory"])
    except (EOFError, ConnectionError):
        code = 0
    finally:
        os._exit(code)


def main() -> None:
    """Read the knowledge base, then fork and end workers as told on standard input."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    spec = json.loads(sys.stdin.readline())
    # RocksDB has threads, which a fork would lose: there every worker opens the snapshot itself.
    evaluator = None if spec["directory"] else Evaluator(*open_store(spec))
    if evaluator is not None:
        evaluator.warm()
        Path(spec["path"]).unlink()
    children: set[int] = set()
    for line in iter(sys.stdin.readline, ""):
        command, _, argument = line.strip().partition(" ")
        if command == "fork":
            pid = os.fork()
            if pid == 0:
                _become_worker(evaluator, spec)
            children.add(pid)
        elif command == "kill" and int(argument) in children:
            # A child not yet waited for keeps its number, so this can meet nobody else.
            os.kill(int(argument), signal.SIGKILL)
            os.waitpid(int(argument), 0)
            children.discard(int(argument))
        _bury(children)
    for pid in children:
        os.kill(pid, signal.SIGKILL)


def _bury(children: set[int]) -> None:
    for pid in tuple(children):
        if os.waitpid(pid, os.WNOHANG)[0]:
            children.discard(pid)


if __name__ == "__main__":
    main()
