"""Sink: an answer on its way to the service in pieces, its rows and bytes counted."""

import socket
from collections.abc import Callable
from typing import Final

from ersatz.service.frames import DATA, Job, frame

PIECE: Final = 1 << 16
"""Bytes sent at once."""


class LimitError(Exception):
    """The answer is larger than allowed."""


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
