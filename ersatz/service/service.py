"""Service: one knowledge base, its workers, and who may change it."""

import asyncio
import logging
from collections.abc import Callable
from hmac import compare_digest
from pathlib import Path
from typing import TypeVar

import pyoxigraph as ox

from ersatz.errors import ErsatzError, InputError, KnowledgeBaseError, LockedError, UnknownNameError
from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.names import local_name
from ersatz.knowledge.opening import SHIPPED
from ersatz.knowledge.vocabulary import FORMAT
from ersatz.resources import ONTOLOGY
from ersatz.service.frames import Job
from ersatz.service.inspection import RefusedError
from ersatz.service.scans import ScanFolder
from ersatz.service.settings import ServiceSettings
from ersatz.service.workers import Pool

log = logging.getLogger("ersatz.service")
T = TypeVar("T")


class Service:
    """What the endpoint and the pages share.

    Queries of strangers go to the workers. Questions of our own, whose cost is known, are answered by the
    knowledge base in a thread. Whatever writes does so one at a time, and the workers read anew.
    """

    def __init__(self, kb: KnowledgeBase, settings: ServiceSettings) -> None:
        place = Path(kb.location)
        if settings.writable and place.parent == ONTOLOGY and place.stem in SHIPPED:
            raise InputError(
                f"{place.stem!r} is shipped with ERSATZ and is not written to: "
                f"`ersatz export {place.stem} ./{place.name}` makes a copy to serve"
            )
        if settings.writable and kb.location.startswith(("http://", "https://")):
            raise InputError(f"{kb.location!r} is changed at its own endpoint: serve it without --writable")
        self.kb = kb
        self.settings = settings
        self.scans = ScanFolder(settings.scans) if settings.scans is not None else None
        self.pool = Pool(kb, settings)
        self._writing = asyncio.Lock()

    async def start(self) -> None:
        """Start the workers."""
        await self.pool.start()

    async def stop(self) -> None:
        """Finish what is being written, then end the workers."""
        async with self._writing:
            await self.pool.stop()

    def job(self, action: str, text: str, table: str | None, graph: str | None) -> Job:
        """Return a job within the limits."""
        return Job(action, text, table, graph, self.settings.rows, self.settings.answer_bytes)

    def authorize(self, header: str) -> None:
        """Raise unless the Authorization header carries the token.

        Raises
        ------
        RefusedError
            403 on a read-only service, 401 without the token.
        """
        if self.settings.token is None:
            raise RefusedError(403, "this service is read-only: start it with --writable")
        scheme, _, token = header.partition(" ")
        if scheme.lower() != "bearer" or not self.has_token(token.strip()):
            raise RefusedError(
                401, "send the token: Authorization: Bearer …", {"WWW-Authenticate": 'Bearer realm="ersatz"'}
            )

    def has_token(self, token: str) -> bool:
        """Tell whether this is the token; takes the same time whatever is wrong with it."""
        return self.settings.token is not None and compare_digest(
            token.encode(), self.settings.token.encode()
        )

    async def read(self, question: Callable[[], T]) -> T:
        """Return the answer to a question of our own without holding up others."""
        return await asyncio.to_thread(question)

    async def knows(self, iri: str) -> bool:
        """Tell whether anything is said of an IRI."""
        node = ox.NamedNode(iri)
        rows = await self.read(lambda: self.kb.query(f"ASK {{ {node} ?p ?o }}"))
        return bool(rows[0]["answer"])

    async def write(self, change: Callable[[], T]) -> T:
        """Change the knowledge base, save it, and let the workers read it anew.

        A change that has begun is finished even if whoever asked for it hangs up.

        Raises
        ------
        RefusedError
            409 if another process writes, 404 if a name is unknown, 400 if the change is not possible.
        """

        async def alone() -> T:
            async with self._writing:
                return await self._keep(change)

        return await asyncio.shield(asyncio.create_task(alone()))

    async def update(self, text: str) -> None:
        """Make a SPARQL update: a worker finds out what it would change, then that is told.

        Raises
        ------
        RefusedError
            If it is not valid, takes too long, or changes what may not be changed.
        """

        async def alone() -> None:
            async with self._writing:
                remove, add = await self._difference(text)
                if any(FORMAT.value in line for line in remove):
                    raise RefusedError(400, "the build record says how to read all else: it must stay")
                if remove or add:
                    await self._keep(lambda: self.kb.tell(remove, add))

        await asyncio.shield(asyncio.create_task(alone()))

    async def _difference(self, text: str) -> tuple[list[str], list[str]]:
        spool, task = self.pool.evaluate(self.job("update", text, None, None))
        try:
            changed = b"".join([piece async for piece in spool.pieces()]).decode().split("\n")
        finally:
            task.cancel()
            spool.close()
        return tuple([f"{line[1:]}\n" for line in changed if line.startswith(mark)] for mark in "-+")  # type: ignore[return-value]

    async def _keep(self, change: Callable[[], T]) -> T:
        try:
            done = await asyncio.to_thread(change)
            await asyncio.to_thread(self.kb.save)
        except LockedError as error:
            raise RefusedError(409, str(error)) from None
        except KnowledgeBaseError as error:
            raise RefusedError(500, str(error)) from None
        except UnknownNameError as error:
            raise RefusedError(404, str(error)) from None
        except ErsatzError as error:
            raise RefusedError(400, str(error)) from None
        await self.pool.reload()
        log.info("changed: revision %s", self.kb.revision[:12])
        return done

    def name(self) -> str:
        """Return what the knowledge base is called."""
        return local_name(self.kb.location.rstrip("/")).rsplit(".", 1)[0]
