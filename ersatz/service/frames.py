"""How the service and its workers speak: a letter, a length, and as many bytes."""

import struct
from dataclasses import asdict, dataclass
from typing import Final

HEADER: Final = struct.Struct(">cI")

HELLO: Final = b"I"
"""Worker: its process id, as text."""
JOB: Final = b"J"
"""Service: a `Job` as JSON."""
KIND: Final = b"K"
"""Worker: the job's number and the media type of the answer, before its bytes."""
DATA: Final = b"D"
END: Final = b"E"
"""Worker: the job's number, after all bytes."""
REFUSED: Final = b"X"
"""Worker: the job's number, status and message, as "7 400 what is wrong"."""


@dataclass(frozen=True, slots=True)
class Job:
    """One thing for a worker to do.

    Attributes
    ----------
    action : {"query", "dump", "terms", "describe", "update"}
        "dump" gives all triples, "terms" those of the ontology, "describe" those about the IRI in `text`,
        "update" the lines of N-Triples an update would remove and add, each after "-" or "+".
    text : str
    table, graph : str or None
        Media types of an answer that is a table or a graph; None if the client takes none we have.
    rows, answer_bytes : int
        Limits.
    number : int
        Of this job; it comes back with the first and the last message of the answer, so that no client
        can be given another's.
    """

    action: str
    text: str
    table: str | None
    graph: str | None
    rows: int
    answer_bytes: int
    number: int = 0

    def as_dict(self) -> dict[str, object]:
        """Return the fields for JSON."""
        return asdict(self)


def frame(letter: bytes, payload: bytes = b"") -> bytes:
    """Return one message."""
    return HEADER.pack(letter, len(payload)) + payload
