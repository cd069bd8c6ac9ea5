"""Spool: an answer between the worker that makes it and the client that takes it, however slowly."""

import asyncio
import tempfile
from collections.abc import AsyncIterator
from typing import Final

from ersatz.service.inspection import RefusedError

HELD: Final = 1 << 18
"""Bytes of an answer that are waited for, so that an early failure has a proper status."""

IN_MEMORY: Final = 1 << 20
PIECE: Final = 1 << 16


class Spool:
    """Bytes written once and read once, at different speeds; beyond a megabyte on disk.

    Attributes
    ----------
    media : str
        Content type of the answer, once it is known.
    """

    def __init__(self) -> None:
        self.media = ""
        self._file = tempfile.SpooledTemporaryFile(max_size=IN_MEMORY)  # noqa: SIM115 # closed by `close`
        self._written = self._read = 0
        self._changed = asyncio.Event()
        self._done = False
        self._error: RefusedError | None = None

    @property
    def size(self) -> int | None:
        """Length of the whole answer in bytes, or None while it grows."""
        return self._written if self._done else None

    def write(self, data: bytes) -> None:
        """Append."""
        self._file.seek(self._written)
        self._file.write(data)
        self._written += len(data)
        self._changed.set()

    def finish(self, error: RefusedError | None = None) -> None:
        """Say that all is written, or why not."""
        self._done, self._error = True, self._error or error
        self._changed.set()

    async def ready(self) -> None:
        """Wait until the answer is complete, or long enough to begin sending it.

        Raises
        ------
        RefusedError
            If it failed before.
        """
        while not self._done and self._written < HELD:
            await self._next()
        if self._error is not None:
            raise self._error

    async def pieces(self) -> AsyncIterator[bytes]:
        """Yield what is written, as it comes.

        Raises
        ------
        RefusedError
            If the rest will never come.
        """
        while True:
            if self._read < self._written:
                self._file.seek(self._read)
                data = self._file.read(min(PIECE, self._written - self._read))
                self._read += len(data)
                yield data
            elif self._error is not None:
                raise self._error
            elif self._done:
                return
            else:
                await self._next()

    async def _next(self) -> None:
        self._changed.clear()
        await self._changed.wait()

    def close(self) -> None:
        """Free the memory and the file."""
        self._file.close()
