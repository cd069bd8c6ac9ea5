"""A worker: a process of its own that evaluates one query at a time, and may be ended at any moment.

`python -m ersatz.service.worker` is the parent of all workers. It reads the knowledge base once and
forks a worker for every line "fork" it is told, so that a new worker is ready in milliseconds and shares
the parent's memory. It does nothing else and holds no threads, which makes forking safe.
"""

import json
import os
import signal
import socket
import sys
from pathlib import Path
from typing import Any

import pyoxigraph as ox

from ersatz.errors import ErsatzError
from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.directory import DirectoryStore
from ersatz.knowledge.stores import MemoryStore, Store
from ersatz.service.confinement import confine
from ersatz.service.evaluator import Evaluator
from ersatz.service.frames import HEADER, HELLO, JOB, Job, frame


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
    """Open what the workers read: a directory, or a file.

    Raises
    ------
    KnowledgeBaseError
        If it cannot be read.
    """
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
    evaluator = None if spec["directory"] else _ready(spec)
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


def _ready(spec: dict[str, Any]) -> Evaluator:
    """Read the file, or end if it is not in the state that is served."""
    try:
        store, engine = open_store(spec)
        same = KnowledgeBase(store).revision == spec["revision"]
    except ErsatzError:
        same = False
    if not same:
        sys.exit(1)
    evaluator = Evaluator(store, engine)
    evaluator.warm()
    return evaluator


def _bury(children: set[int]) -> None:
    for pid in tuple(children):
        if os.waitpid(pid, os.WNOHANG)[0]:
            children.discard(pid)


if __name__ == "__main__":
    main()
