"""What the service allows, and how much of it."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from ersatz.errors import InputError

LOOPBACK: Final = ("127.0.0.1", "::1", "localhost")
FEWEST_TOKEN_CHARACTERS: Final = 16
_ORIGIN: Final = re.compile(r"https?://[^\s/?#@]+")


@dataclass(frozen=True, slots=True)
class ServiceSettings:
    """Limits and permissions of the service.

    Attributes
    ----------
    seconds : float
        How long one query may be evaluated before its process is ended.
    queue_seconds : float
        How long a query may wait for a free worker.
    rows : int
        Solutions or triples one answer may have.
    answer_bytes, body_bytes, upload_bytes : int
        Size of an answer, of a request's body, and of an uploaded scan, bytes.
    body_seconds : float
        How long a client may take to send its request, or to take a piece of the answer.
    worker_bytes : int
        Memory a worker may take beyond the knowledge base itself, bytes.
    workers : int
        Processes that evaluate queries.
    waiting : int
        Queries that may wait; one more is sent away at once.
    connections : int
        Connections at one time.
    depth : int
        Brackets within brackets in a query.
    token : str or None
        Who sends it may write; without one nobody may.
    origins : tuple of str
        Web origins whose scripts may read ("*" for all); the CORS setting.
    hosts : tuple of str
        Names the service answers to; empty for any.
    pages : bool
        Whether there are pages beside the endpoint.
    scans : Path or None
        Folder of the scans the knowledge base was built from, shown on the pages of individuals.
    """

    seconds: float = 20.0
    queue_seconds: float = 20.0
    rows: int = 1_000_000
    answer_bytes: int = 512 << 20
    body_bytes: int = 1 << 20
    upload_bytes: int = 64 << 20
    body_seconds: float = 10.0
    worker_bytes: int = 1 << 30
    workers: int = 3
    waiting: int = 256
    connections: int = 1024
    depth: int = 64
    token: str | None = None
    origins: tuple[str, ...] = ()
    hosts: tuple[str, ...] = LOOPBACK
    pages: bool = True
    scans: Path | None = None

    def __post_init__(self) -> None:
        """Check the values."""
        for name in ("seconds", "queue_seconds", "rows", "answer_bytes", "body_bytes", "workers", "depth"):
            if getattr(self, name) <= 0:
                raise InputError(f"{name} is {getattr(self, name)!r}: give a positive number")
        for origin in self.origins:
            if origin != "*" and not _ORIGIN.fullmatch(origin):
                raise InputError(
                    f"{origin!r} is no web origin: give scheme and host, such as https://example.org, or *"
                )
        if self.token is not None and len(self.token) < FEWEST_TOKEN_CHARACTERS:
            raise InputError(
                f"the token has {len(self.token)} characters: give at least {FEWEST_TOKEN_CHARACTERS}, "
                "such as `openssl rand -hex 24` makes"
            )

    @property
    def writable(self) -> bool:
        """Whether anybody may write."""
        return self.token is not None


def read_token(path: Path) -> str:
    """Return the token in the first line of a file.

    Raises
    ------
    InputError
        If the file cannot be read, or others may read it too.
    """
    try:
        if path.stat().st_mode & 0o077:
            raise InputError(f"{str(path)!r} can be read by others: chmod 600 it")
        lines = path.read_text(encoding="utf-8").split("\n")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"cannot read the token file {str(path)!r}: {reason}") from None
    return lines[0].strip()
