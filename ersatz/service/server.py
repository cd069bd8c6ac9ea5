"""Serving: uvicorn with time limits on slow clients, and a clean stop."""

import asyncio
import socket
from typing import Final

import uvicorn
from fastapi import FastAPI
from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

from ersatz.errors import InputError
from ersatz.knowledge.base import KnowledgeBase
from ersatz.service.app import create_app
from ersatz.service.safety import MOST_HEAD
from ersatz.service.settings import LOOPBACK, ServiceSettings

GRACE_SECONDS: Final = 5
"""How long answers under way may take when the service ends."""

HEAD_SECONDS: Final = 10.0
"""How long a client may take to send the head of its first request."""


class PatientProtocol(HttpToolsProtocol):
    """HTTP/1.1 that hangs up on a client whose request's head never ends, in time or in length."""

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Start the clock."""
        super().connection_made(transport)
        self._head = 0
        self._complete = False
        asyncio.get_running_loop().call_later(HEAD_SECONDS, self._hang_up_if_silent)

    def data_received(self, data: bytes) -> None:
        """Take bytes, and count those of a head."""
        self._head += len(data)
        super().data_received(data)
        if self._complete:
            self._head = 0
        elif self._head > MOST_HEAD and not self.transport.is_closing():
            self.transport.write(b"HTTP/1.1 431 Request Header Fields Too Large\r\nConnection: close\r\n\r\n")
            self.transport.close()

    def on_message_begin(self) -> None:
        """Note that a head has begun."""
        self._complete = False
        super().on_message_begin()

    def on_headers_complete(self) -> None:
        """Note that it is complete."""
        self._complete = True
        super().on_headers_complete()

    def _hang_up_if_silent(self) -> None:
        if not self._complete and not self.transport.is_closing():
            self.transport.close()


def serve(kb: KnowledgeBase, settings: ServiceSettings, host: str = "127.0.0.1", port: int = 8000) -> None:
    """Serve a knowledge base until the process is asked to end.

    Parameters
    ----------
    kb : KnowledgeBase
    settings : ServiceSettings
    host, port : str, int
        Where to listen; loopback unless asked.

    Raises
    ------
    InputError
        If nobody can listen there.
    """
    app = create_app(kb, settings)
    config = server_config(app, settings)
    bound = _bind(host, port)
    try:
        uvicorn.Server(config).run(sockets=[bound])
    finally:
        bound.close()


def server_config(app: FastAPI, settings: ServiceSettings) -> uvicorn.Config:
    """Return how uvicorn is to run the application."""
    return uvicorn.Config(
        app,
        http=PatientProtocol,
        access_log=False,  # it would write query strings; `safety.Guard` has its own
        server_header=False,
        proxy_headers=False,
        limit_concurrency=settings.connections,
        timeout_keep_alive=15,
        timeout_graceful_shutdown=GRACE_SECONDS,
        ws_max_size=4 << 20,
        log_level="warning",
    )


def hosts_for(host: str) -> tuple[str, ...]:
    """Return the names to answer to: those of loopback, or any where the service is opened to a network."""
    return LOOPBACK if host in LOOPBACK else ()


def _bind(host: str, port: int) -> socket.socket:
    try:
        family, kind, number, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        bound = socket.socket(family, kind, number)
        bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        bound.bind(address)
    except (OSError, OverflowError) as error:
        raise InputError(f"cannot listen on {host}:{port}: {error}") from None
    return bound
