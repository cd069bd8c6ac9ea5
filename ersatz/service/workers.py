"""Pool: warm worker processes; one that takes too long is ended, and another takes its place.

No SPARQL engine for Python can cancel a query, so that only ending its process does. The processes share
the memory of their parent (see `worker`): a new one costs milliseconds.
"""

import asyncio
import json
import logging
import shutil
import tempfile
from collections import deque
from contextlib import suppress
from dataclasses import replace
from itertools import count
from pathlib import Path

from ersatz.knowledge.base import KnowledgeBase
from ersatz.service.frames import DATA, END, HEADER, HELLO, JOB, KIND, REFUSED, Job, frame
from ersatz.service.generation import Generation, Worker, begin, end
from ersatz.service.inspection import RefusedError
from ersatz.service.settings import ServiceSettings
from ersatz.service.spool import Spool

log = logging.getLogger("ersatz.service")


class Pool:
    """Evaluates jobs in worker processes within the limits of the settings."""

    def __init__(self, kb: KnowledgeBase, settings: ServiceSettings) -> None:
        self._kb = kb
        self._settings = settings
        self._idle: deque[Worker] = deque()
        self._waiting: deque[asyncio.Future[Worker]] = deque()
        self._current: Generation | None = None
        self._older: set[Generation] = set()
        self._folder = Path()
        self._count = 0
        self._numbers = count(1)
        self._tasks: set[asyncio.Task[None]] = set()
        self._reloading = asyncio.Lock()

    async def start(self) -> None:
        """Start the workers; return when the first is ready.

        Raises
        ------
        KnowledgeBaseError
            If none becomes ready.
        """
        self._folder = Path(tempfile.mkdtemp(prefix="ersatz-"))
        await self.reload()

    async def reload(self) -> None:
        """Read the knowledge base anew; queries under way end on the old state, the next see the new one."""
        async with self._reloading:
            self._count += 1
            memory = self._settings.worker_bytes
            generation = await begin(self._kb, self._folder, self._count, memory, self._greet)
            before, self._current = self._current, generation
            self._retire_idle()
            if before is not None:
                self._older.add(before)
                self._end_if_unused(before)
            for _ in range(self._settings.workers - 1):
                generation.tell("fork")

    async def stop(self) -> None:
        """End all workers, and wait until they are gone."""
        for future in self._waiting:
            if not future.done():
                future.set_exception(RefusedError(503, "the service is ending"))
        for task in tuple(self._tasks):
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        generations = [*self._older, *([self._current] if self._current else [])]
        self._current = None
        self._retire_idle()
        for generation in generations:
            await end(generation)
        shutil.rmtree(self._folder, ignore_errors=True)

    def evaluate(self, job: Job) -> tuple[Spool, asyncio.Task[None]]:
        """Begin a job.

        Returns
        -------
        spool, task
            Where the answer appears; cancelling the task ends the evaluation.
        """
        spool = Spool()
        task = asyncio.create_task(self._run(job, spool))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return spool, task

    async def _run(self, job: Job, spool: Spool) -> None:
        try:
            worker = await self._acquire()
        except RefusedError as error:
            spool.finish(error)
            return
        except asyncio.CancelledError:
            spool.finish(RefusedError(503, "the service is ending"))
            raise
        whole = False
        worker.generation.busy += 1
        try:
            async with asyncio.timeout(self._settings.seconds):
                whole = await self._transfer(worker, job, spool)
        except TimeoutError:
            spool.finish(RefusedError(503, f"it took longer than {self._settings.seconds:g} s and was ended"))
        except (ConnectionError, asyncio.IncompleteReadError):
            spool.finish(
                RefusedError(503, "its evaluation broke off: it needs more memory or nesting than allowed")
            )
        except asyncio.CancelledError:
            spool.finish(RefusedError(503, "it was cancelled"))
            raise
        finally:
            worker.generation.busy -= 1
            self._release(worker, whole=whole)

    async def _transfer(self, worker: Worker, job: Job, spool: Spool) -> bool:
        """Send a job and take its answer; raise ConnectionError if it is not the answer to this job."""
        number = next(self._numbers)
        worker.writer.write(frame(JOB, json.dumps(replace(job, number=number).as_dict()).encode()))
        while True:
            letter, size = HEADER.unpack(await worker.reader.readexactly(HEADER.size))
            payload = await worker.reader.readexactly(size) if size else b""
            if letter == DATA and spool.media:
                spool.write(payload)
                continue
            of, _, rest = payload.decode().partition(" ")
            if of != str(number):
                raise ConnectionError("a worker answered another job")
            if letter == KIND:
                spool.media = rest
                continue
            if letter == REFUSED:
                status, _, message = rest.partition(" ")
                spool.finish(RefusedError(int(status), message))
            elif letter == END:
                spool.finish()
            return True

    async def _acquire(self) -> Worker:
        while self._idle:
            worker = self._idle.pop()
            if not worker.reader.at_eof():
                return worker
            self._release(worker, whole=False)
        if len(self._waiting) >= self._settings.waiting:
            raise RefusedError(503, "too many queries are waiting", {"Retry-After": "5"})
        future: asyncio.Future[Worker] = asyncio.get_running_loop().create_future()
        self._waiting.append(future)
        try:
            async with asyncio.timeout(self._settings.queue_seconds):
                return await future
        except (TimeoutError, asyncio.CancelledError) as error:
            if future.done() and not future.cancelled() and future.exception() is None:
                self._release(future.result(), whole=True)  # it came at the very moment
            if isinstance(error, asyncio.CancelledError):
                raise
            wait = f"{self._settings.queue_seconds:g}"
            raise RefusedError(503, f"no worker was free for {wait} s", {"Retry-After": "5"}) from None
        finally:
            with suppress(ValueError):
                self._waiting.remove(future)

    def _release(self, worker: Worker, *, whole: bool) -> None:
        """Give a worker to the next job, or end it and have another one made."""
        current = worker.generation is self._current
        if whole and current and not worker.reader.at_eof():
            while self._waiting:
                future = self._waiting.popleft()
                if not future.done():
                    future.set_result(worker)
                    return
            self._idle.append(worker)
            return
        worker.generation.tell(f"kill {worker.pid}")
        worker.writer.close()
        if current:
            worker.generation.tell("fork")
        self._end_if_unused(worker.generation)

    def _retire_idle(self) -> None:
        kept = [worker for worker in self._idle if worker.generation is self._current]
        for worker in self._idle:
            if worker not in kept:
                worker.generation.tell(f"kill {worker.pid}")
                worker.writer.close()
        self._idle = deque(kept)

    def _end_if_unused(self, generation: Generation) -> None:
        if generation in self._older and generation.busy == 0:
            self._older.discard(generation)
            task = asyncio.create_task(end(generation))
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)

    async def _greet(
        self, generation: Generation, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        with suppress(asyncio.IncompleteReadError, ConnectionError):
            letter, size = HEADER.unpack(await reader.readexactly(HEADER.size))
            pid = int(await reader.readexactly(size))
            if letter != HELLO:
                return
            first = not generation.ready.is_set()
            generation.ready.set()
            if first:
                await asyncio.sleep(0)  # let `reload` make this generation the current one
            worker = Worker(pid, reader, writer, generation)
            while first and self._current is not generation and generation.process.returncode is None:
                await asyncio.sleep(0.001)
            self._release(worker, whole=True)
