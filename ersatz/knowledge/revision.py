"""The revision: one number for all that a knowledge base says of the world; a change brings it up to date."""

from collections.abc import Iterable
from hashlib import sha256
from typing import Final

import numpy as np

from ersatz.knowledge import vocabulary as v
from ersatz.knowledge.terms import text

_TYPE: Final = str(v.TYPE)
_SCHEMA: Final = (f"<{v.OWL}", f"<{v.ERSATZ}")
_KNOWLEDGE: Final = frozenset(
    map(
        str,
        (
            v.SUBCLASS_OF,
            v.DESCRIBES_CLASS,
            v.FOR_FUNCTION,
            v.HAS_ENTRY,
            v.QUALITY,
            v.COUNT,
            v.TOTAL,
            v.INSTANCE_COUNT,
            v.HOLDS,
            v.HAS_MEASUREMENT,
            v.MEASURED_PROPERTY,
            v.ASSIGNED_QUALITY,
            v.HAS_ASSIGNMENT,
            v.DEGREE,
            v.RAW_VALUE,
            v.HAS_COORDINATE,
            v.ON_AXIS,
            v.COORDINATE,
            v.OBSERVATION,
            v.ORIGIN,
            v.QUALITY_OF,
            v.RANK,
            v.CENTROID,
            v.LOWER_BOUND,
            v.UPPER_BOUND,
            v.UNIT,
            v.HAS_AXIS,
            v.POSITION,
            v.FUZZIFIER,
            v.HAS_NORM_ELEMENT,
            v.ROW_AXIS,
            v.COLUMN_AXIS,
            v.ELEMENT,
        ),
    )
)


def revision_of(lines: Iterable[str], start: int = 0) -> int:
    """Return the sum of the SHA-256 of all lines that state knowledge, modulo 2^256.

    The sum does not depend on the order, and an update changes it by what it adds and takes away.
    """
    digests = b"".join([sha256(line.encode()).digest() for line in lines if is_knowledge(line)])
    words = np.frombuffer(digests, dtype=">u4").reshape(-1, 8).sum(axis=0, dtype=np.uint64)
    for place, word in enumerate(reversed(words)):
        start += int(word) << 32 * place
    return start % (1 << 256)


def is_knowledge(line: str) -> bool:
    """Tell whether a triple says something of the world; labels and build records do not."""
    _, predicate, value = line.split(" ", 2)
    return predicate in _KNOWLEDGE or (predicate == _TYPE and not value.startswith(_SCHEMA))


def revision_line(revision: int) -> str:
    """Return the triple that states the revision."""
    return f"{v.BUILD} {v.REVISION} {text(f'{revision:064x}')} .\n"
