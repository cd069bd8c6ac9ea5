"""What files of points and triangles hold, and the pieces every format is read with."""

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ersatz.errors import ScanError

MOST_POINTS: Final = 20_000_000
"""Points a file may hold; a count beyond it is taken for a broken header rather than for a scan."""


@dataclass(frozen=True, slots=True, eq=False)
class Cloud:
    """What a file holds, unchecked.

    Attributes
    ----------
    points : (n, 3) float64 array, in the file's unit
    triangles : (t, 3) int64 array or None
    normals : (n, 3) float64 array or None
    colours : (n, 3) float64 array in [0, 1], or None
    viewpoint : (3,) float64 array or None
        Position of the sensor, in the file's unit, where the format records one.
    """

    points: NDArray[np.float64]
    triangles: NDArray[np.int64] | None = None
    normals: NDArray[np.float64] | None = None
    colours: NDArray[np.float64] | None = None
    viewpoint: NDArray[np.float64] | None = None


def split_header(data: bytes, last: bytes) -> tuple[list[list[str]], bytes]:
    """Return the words of each header line up to the one that starts with `last`, and the bytes after it."""
    lines: list[list[str]] = []
    start = 0
    while start < len(data):
        end = data.find(b"\n", start)
        end = len(data) if end < 0 else end
        words = data[start:end].decode("ascii").split()
        start = end + 1
        if words and not words[0].startswith("#"):
            lines.append(words)
        if words and words[0] == last.decode():
            return lines, data[start:]
    raise ScanError(f"the header has no line {last.decode()!r}")


def columns(body: bytes, count: int, width: int) -> NDArray[np.float64]:
    """Return the first `count` rows of a text table as a (count, width) array."""
    rows = body.split()
    if len(rows) < count * width:
        raise ScanError(f"truncated: {count} rows of {width} numbers announced, {len(rows) // width} found")
    return np.array(rows[: count * width], dtype=np.float64).reshape(count, width)


def records(body: bytes, count: int, dtype: np.dtype[Any]) -> NDArray[Any]:
    """Return `count` binary records."""
    if len(body) < count * dtype.itemsize:
        raise ScanError(
            f"truncated: {count} records of {dtype.itemsize} bytes announced, {len(body)} bytes found"
        )
    return np.frombuffer(body, dtype=dtype, count=count)


def triple(fields: dict[str, NDArray[Any]], names: str = "x y z") -> NDArray[np.float64] | None:
    """Return three fields side by side, or None if one is missing."""
    wanted = names.split()
    if not all(name in fields for name in wanted):
        return None
    return np.stack([fields[name].astype(np.float64) for name in wanted], axis=1)
