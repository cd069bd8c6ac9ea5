"""Sending: an answer as it grows, and a refusal as one clear line."""

import asyncio
from collections.abc import Mapping

from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.types import Receive, Scope, Send

from ersatz.service.frames import Job
from ersatz.service.inspection import RefusedError
from ersatz.service.spool import Spool
from ersatz.service.workers import Pool


class SpooledResponse(Response):
    """An answer streamed from its spool.

    Where it fails after its beginning was sent, the connection is closed without the last chunk, so that
    the client knows that it has only a part.
    """

    def __init__(self, spool: Spool, task: asyncio.Task[None], seconds: float) -> None:
        headers = {"Vary": "Accept", "Cache-Control": "no-cache"}
        if spool.size is not None:
            headers["Content-Length"] = str(spool.size)
        super().__init__(headers=headers)
        if spool.size is None:
            del self.headers["content-length"]
        self.headers["content-type"] = spool.media
        self._spool, self._task, self._seconds = spool, task, seconds

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send it; stop the evaluation where the client has gone."""
        try:
            await send({"type": "http.response.start", "status": 200, "headers": self.raw_headers})
            if scope["method"] != "HEAD":
                async for piece in self._spool.pieces():
                    async with asyncio.timeout(self._seconds):
                        await send({"type": "http.response.body", "body": piece, "more_body": True})
            await send({"type": "http.response.body", "body": b""})
        except (RefusedError, TimeoutError, OSError):
            return
        finally:
            self._task.cancel()
            self._spool.close()


def refusal(error: RefusedError) -> Response:
    """Return an error as plain text, with nothing in it a browser would run."""
    return PlainTextResponse(f"{error}\n", error.status, headers=_safe(error.headers))


def _safe(headers: Mapping[str, str]) -> dict[str, str]:
    return {name: value for name, value in headers.items() if "\n" not in value and "\r" not in value}


async def evaluated(request: Request, pool: Pool, job: Job, seconds: float) -> Response:
    """Return the answer to a job once it has begun; end the job if the client hangs up before.

    Raises
    ------
    RefusedError
        If it is refused, fails or takes too long.
    """
    spool, task = pool.evaluate(job)
    ready = asyncio.create_task(spool.ready())
    gone = asyncio.create_task(_hung_up(request))
    try:
        await asyncio.wait({ready, gone}, return_when=asyncio.FIRST_COMPLETED)
        if not ready.done():
            raise RefusedError(499, "the client hung up")
        ready.result()
    except BaseException:
        task.cancel()
        spool.close()
        raise
    finally:
        gone.cancel()
        ready.cancel()
    return SpooledResponse(spool, task, seconds)


async def _hung_up(request: Request) -> None:
    while (await request.receive())["type"] != "http.disconnect":
        pass
