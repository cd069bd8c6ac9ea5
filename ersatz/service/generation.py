"""Generation: the workers that read one state of the knowledge base, and the process they are forked from."""

import asyncio
import json
import os
import sys
from collections.abc import Awaitable, Callable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import pyoxigraph as ox

from ersatz.errors import KnowledgeBaseError
from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.directory import is_directory_store
from ersatz.knowledge.stores import format_of

Greet = Callable[["Generation", asyncio.StreamReader, asyncio.StreamWriter], Awaitable[None]]

START_SECONDS: Final = 120.0
"""How long reading the knowledge base may take before the first worker answers."""


@dataclass(eq=False, slots=True)
class Worker:
    """A worker process and the line to it."""

    pid: int
    reader: asyncio.StreamReader
    writer: asyncio.StreamWriter
    generation: "Generation"


@dataclass(eq=False, slots=True)
class Generation:
    """The parent of the workers that read one state of the knowledge base."""

    number: int
    process: asyncio.subprocess.Process
    server: asyncio.Server
    busy: int = 0
    ready: asyncio.Event = field(default_factory=asyncio.Event)

    def tell(self, command: str) -> None:
        """Send a line to the parent; one that has gone needs none."""
        if self.process.stdin is not None and not self.process.stdin.is_closing():
            with suppress(ConnectionError, RuntimeError):
                self.process.stdin.write(f"{command}\n".encode())


async def begin(kb: KnowledgeBase, folder: Path, number: int, memory: int, greet: Greet) -> Generation:
    """Start a parent of workers and wait until its first worker says hello.

    The file the knowledge base was opened from is read again, beside us, if it is in the same state;
    otherwise the parent reads a copy made for it.

    Parameters
    ----------
    kb : KnowledgeBase
    folder : Path
        For the socket and the copy; nobody else may look into it.
    number : int
        Of the generation.
    memory : int
        Bytes a worker may take beyond the knowledge base.
    greet : callable
        Told of each worker that says hello.

    Raises
    ------
    KnowledgeBaseError
        If no worker can be started.
    """
    spec = {
        "address": str(folder / f"{number}.socket"),
        "directory": _is_directory(kb),
        "memory": memory,
        "revision": kb.revision,
    }
    place = Path(kb.location)
    if spec["directory"] or (place.is_file() and format_of(place) is not None):
        generation = await _start(number, {**spec, "path": str(place.absolute())}, greet)
        if await _said_hello(generation):
            return generation
    copy = folder / f"{number}.nt"
    await asyncio.to_thread(_dump, kb, copy)
    try:
        generation = await _start(number, {**spec, "directory": False, "path": str(copy)}, greet)
        if await _said_hello(generation):
            return generation
    finally:
        copy.unlink()
    raise KnowledgeBaseError("no worker could be started: see the messages above")


def _is_directory(kb: KnowledgeBase) -> bool:
    return not kb.location.startswith("http") and is_directory_store(Path(kb.location))


async def _start(number: int, spec: dict[str, object], greet: Greet) -> Generation:
    address = Path(str(spec["address"]))
    address.unlink(missing_ok=True)
    holder: list[Generation] = []
    server = await asyncio.start_unix_server(
        lambda reader, writer: greet(holder[0], reader, writer), address, limit=1 << 18
    )
    process = await asyncio.create_subprocess_exec(
        sys.executable,
        *("-m", "ersatz.service.worker"),
        stdin=asyncio.subprocess.PIPE,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"},
        start_new_session=True,
    )
    generation = Generation(number, process, server)
    holder.append(generation)
    generation.tell(json.dumps(spec))
    generation.tell("fork")
    return generation


async def _said_hello(generation: Generation) -> bool:
    """Wait for the first worker; end the generation if none comes."""
    hello = asyncio.create_task(generation.ready.wait())
    gone = asyncio.create_task(generation.process.wait())
    await asyncio.wait({hello, gone}, timeout=START_SECONDS, return_when=asyncio.FIRST_COMPLETED)
    gone.cancel()
    if hello.done():
        return True
    hello.cancel()
    await end(generation)
    return False


async def end(generation: Generation) -> None:
    """Let the parent end its workers and itself; if it will not, end it."""
    generation.server.close()
    if generation.process.stdin is not None:
        generation.process.stdin.close()
    try:
        async with asyncio.timeout(5):
            await generation.process.wait()
    except TimeoutError:
        generation.process.kill()
        await generation.process.wait()


def _dump(kb: KnowledgeBase, path: Path) -> None:
    ox.serialize(kb.triples(), str(path), format=ox.RdfFormat.N_TRIPLES)
