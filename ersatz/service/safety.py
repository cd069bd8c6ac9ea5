"""The guard in front of everything: hosts, origins, body sizes, headers, and a log without secrets."""

import logging
import time
from collections.abc import Iterable
from typing import Final
from urllib.parse import urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from ersatz.service.settings import ServiceSettings

log = logging.getLogger("ersatz.access")

_PAGES: Final = (
    "default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; font-src 'self' data:; connect-src 'self' ws: wss:; "
    "worker-src 'self' blob:; object-src 'none'; base-uri 'self'; form-action 'self'; frame-ancestors 'none'"
)
"""What a page may load: only what this service sends. NiceGUI's Vue templates need inline scripts."""

_DATA: Final = "default-src 'none'; frame-ancestors 'none'; sandbox"
"""Data opened in a browser runs nothing."""

_HEADERS: Final = {
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Permissions-Policy": "camera=(), geolocation=(), microphone=()",
}

MOST_HEAD: Final = 64 << 10
"""Bytes the head of a request may have."""

_LONGEST_PATH: Final = 2048


class Guard:
    """ASGI middleware around the whole application."""

    def __init__(self, app: ASGIApp, settings: ServiceSettings) -> None:
        self._app = app
        self._settings = settings

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Check a request, pass it on, and mark the answer."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        refused = self._refused(scope)
        if scope["type"] == "websocket":
            if refused is not None:
                await send({"type": "websocket.close", "code": 1008})
                return
            await self._app(scope, receive, send)
            return
        begun = time.perf_counter()
        status = 500

        async def marked(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                self._mark(message)
            await send(message)

        try:
            if refused is not None:
                await PlainTextResponse(f"{refused[1]}\n", refused[0])(scope, receive, marked)
            else:
                await self._app(scope, self._bounded(scope, receive), marked)
        finally:
            # The query string stays out of the log: it may hold what is nobody's business.
            log.info(
                "%s %s %d %.0f ms",
                scope["method"],
                _printable(scope["path"]),
                status,
                1000 * (time.perf_counter() - begun),
            )

    def _refused(self, scope: Scope) -> tuple[int, str] | None:  # noqa: PLR0911 # one line a rule
        headers = Headers(scope=scope)
        if sum(len(name) + len(value) for name, value in scope["headers"]) > MOST_HEAD:
            return 431, "the head of the request is too long"
        if len(headers.getlist("host")) != 1:
            return 400, "a request names one host"
        host = _host(headers.get("host", ""))
        if self._settings.hosts and host not in self._settings.hosts:
            return 421, "this service does not answer to that host name"
        if len(scope["path"]) > _LONGEST_PATH:
            return 414, "the path is too long"
        if "\0" in scope["path"] or "\ufffd" in scope["path"]:
            return 400, "the path is not UTF-8 text"
        origin = headers.get("origin")
        if scope["type"] == "websocket" and origin and urlsplit(origin).netloc != headers.get("host", ""):
            return 403, "another site's page may not connect"
        declared = headers.get("content-length", "0")
        if not declared.isdigit():
            return 400, "the content length is no number"
        if int(declared) > self._most(scope):
            return 413, f"the body is larger than {self._most(scope)} bytes"
        return None

    def _most(self, scope: Scope) -> int:
        upload = scope["path"].startswith("/_nicegui/")
        return self._settings.upload_bytes if upload else self._settings.body_bytes

    def _bounded(self, scope: Scope, receive: Receive) -> Receive:
        """Return a `receive` that ends a body beyond the limit, whatever length it declared."""
        taken = 0

        async def bounded() -> Message:
            nonlocal taken
            message = await receive()
            taken += len(message.get("body", b""))
            if taken > self._most(scope):
                return {"type": "http.disconnect"}
            return message

        return bounded

    @staticmethod
    def _mark(message: Message) -> None:
        headers = MutableHeaders(scope=message)
        for name, value in _HEADERS.items():
            headers.setdefault(name, value)
        page = headers.get("content-type", "").startswith("text/html")
        headers.setdefault("Content-Security-Policy", _PAGES if page else _DATA)
        headers["Server"] = "ersatz"


def _host(value: str) -> str:
    """Return the name in a Host header, without the port."""
    if value.startswith("["):
        return value[1:].partition("]")[0]
    return value.partition(":")[0].lower()


def _printable(path: str) -> str:
    return "".join(_shown(path[:200]))


def _shown(text: str) -> Iterable[str]:
    return (c if c.isprintable() else repr(c)[1:-1] for c in text)
