"""Summaries of values that merge: a histogram of numbers, a sample of vectors.

Both depend on the values alone: not on their order, on how they were divided, or on who merged what
first. All that is added up are whole numbers, so equal input gives equal bits.
"""

from bisect import bisect_left
from collections.abc import Iterable
from dataclasses import dataclass
from hashlib import blake2b
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ersatz.grounding.units import ObservationUnit, Units, unit_values
from ersatz.measurements import Column, Measurements

BIN_LIMIT: Final = 1 << 17
"""Up to this many distinct numbers a histogram is exact; above, it has at most as many bins."""

SAMPLE_LIMIT: Final = 20_000
"""Up to this many vectors a sample is complete; above, it has as many."""


@dataclass(frozen=True, slots=True, eq=False)
class Histogram:
    """How often each number was seen, or how many numbers lie in each bin where they are too many.

    Bins are [key, key + 1) 2^shift. The shift is the least that leaves at most `BIN_LIMIT` bins occupied;
    no part of the values needs a larger one than all of them, which is why parts merge without a loss.
    Empty bins cost nothing, so far clusters are resolved as finely as if they were near. As more than half
    of `BIN_LIMIT` bins are occupied, a bin is thousands of times narrower than the spread of the values.

    Attributes
    ----------
    keys : (n,) array, ascending
        float64, the distinct numbers, if `shift` is None; else int64, the occupied bins.
    counts : (n,) int64 array
    shift : int or None
    """

    keys: NDArray[Any]
    counts: NDArray[np.int64]
    shift: int | None = None

    @classmethod
    def of(cls, values: NDArray[np.float64], shift: int | None = None) -> "Histogram":
        """Return the histogram of (n,) finite numbers, in bins of 2^shift or more if that is given."""
        if shift is None:
            return cls(*_counted(values))._limited()
        shift = max(shift, _least_shift(values))
        return cls(*_counted(_bins(values, shift)), shift)._limited()

    def __add__(self, other: "Histogram") -> "Histogram":
        """Return the histogram of both; exact, commutative and associative."""
        shift = None
        if self.shift is not None or other.shift is not None:
            shift = max(_least_shift(one.keys) if one.shift is None else one.shift for one in (self, other))
        keys = np.concatenate([self._keys_at(shift), other._keys_at(shift)])
        return Histogram(*_merged(keys, np.concatenate([self.counts, other.counts])), shift)._limited()

    @property
    def points(self) -> NDArray[np.float64]:
        """(n,) array, ascending: the numbers, or the middles of the bins."""
        return self.keys if self.shift is None else np.ldexp(self.keys + 0.5, self.shift)

    def _keys_at(self, shift: int | None) -> NDArray[Any]:
        if shift is None:
            return self.keys
        return _bins(self.keys, shift) if self.shift is None else self.keys >> (shift - self.shift)

    def _limited(self) -> "Histogram":
        if len(self.keys) <= BIN_LIMIT:
            return self
        shift = _least_shift(self.keys) if self.shift is None else self.shift
        keys = self._keys_at(shift)
        coarser = bisect_left(range(64), True, key=lambda by: _occupied(keys >> by) <= BIN_LIMIT)
        return Histogram(*_merged(keys >> coarser, self.counts), shift + coarser)


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """The vectors whose hashes are smallest: as good as drawn, and drawn again by anyone.

    Attributes
    ----------
    hashes : (n,) uint64 array, ascending
        Of what the vectors were measured of.
    vectors : (n, d) float64 array
    seen : int
        How many vectors there are in all.
    """

    hashes: NDArray[np.uint64]
    vectors: NDArray[np.float64]
    seen: int

    @classmethod
    def of(cls, vectors: NDArray[np.float64], hashes: NDArray[np.uint64]) -> "Sample":
        """Return a sample of (n, d) vectors with their (n,) hashes."""
        seen = len(vectors)
        if seen > SAMPLE_LIMIT:
            rows = np.flatnonzero(hashes <= np.partition(hashes, SAMPLE_LIMIT - 1)[SAMPLE_LIMIT - 1])
            hashes, vectors = hashes[rows], vectors[rows]
        order = np.lexsort((*vectors.T[::-1], hashes))[:SAMPLE_LIMIT]
        return cls(hashes[order], vectors[order], seen)

    def __add__(self, other: "Sample") -> "Sample":
        """Return the sample of both; commutative and associative."""
        both = Sample.of(
            np.concatenate([self.vectors, other.vectors]), np.concatenate([self.hashes, other.hashes])
        )
        return Sample(both.hashes, both.vectors, self.seen + other.seen)


Summary: TypeAlias = Histogram | Sample


def summarize(
    column: Column,
    units: Units,
    measurements: Measurements,
    seed: int = 0,
    so_far: Summary | None = None,
) -> Summary:
    """Return the summary of the values of a property: of one component a histogram, of several a sample.

    Parameters
    ----------
    column, units, measurements
    seed : int
        Of the sample.
    so_far : Summary, optional
        Of other values of the property, to be added.
    """
    rows, values = unit_values(column, units, measurements)
    summary: Summary
    if values.shape[1] == 1:
        shift = so_far.shift if isinstance(so_far, Histogram) else None
        summary = Histogram.of(values[:, 0], shift)
    else:
        summary = Sample.of(values, unit_hashes(units, measurements, seed)[rows])
    return summary if so_far is None else merge(so_far, summary)


def merge(one: Summary, two: Summary) -> Summary:
    """Return the summary of the values of both.

    Raises
    ------
    TypeError
        If one has numbers and the other vectors.
    """
    if isinstance(one, Histogram) and isinstance(two, Histogram):
        return one + two
    if isinstance(one, Sample) and isinstance(two, Sample):
        return one + two
    raise TypeError("numbers and vectors have no summary in common")


def unit_hashes(units: Units, measurements: Measurements, seed: int = 0) -> NDArray[np.uint64]:
    """Return (u,) hashes of what each unit is: the instance's name, and the observation's if that counts."""
    hashes = hash_names(measurements.instances.tolist(), seed)[units.instance]
    if units.kind is ObservationUnit.INSTANCE:
        return hashes
    # Not equal factors, so that neither name can undo the other.
    return hashes + _ODD * hash_names(list(measurements.observations), seed)[units.observation]


def hash_names(names: Iterable[str], seed: int = 0) -> NDArray[np.uint64]:
    """Return (n,) hashes of names, the same on every machine."""
    key = seed.to_bytes(16, "big", signed=True)
    digests = (blake2b(name.encode(), digest_size=8, key=key).digest() for name in names)
    return np.frombuffer(b"".join(digests), dtype="<u8").astype(np.uint64)


_ODD: Final = np.uint64(0x9E3779B97F4A7C15)


def _counted(values: NDArray[Any]) -> tuple[NDArray[Any], NDArray[np.int64]]:
    """Return the distinct values, ascending, and how often each occurs."""
    ordered = np.sort(values)
    starts = _starts(ordered)
    return ordered[starts], np.diff(starts, append=len(ordered))


def _merged(keys: NDArray[Any], counts: NDArray[np.int64]) -> tuple[NDArray[Any], NDArray[np.int64]]:
    """Return the distinct keys, ascending, and the sum of the counts of each."""
    order = np.argsort(keys, kind="stable")  # which merges runs that are sorted already
    keys, counts = keys[order], counts[order]
    starts = _starts(keys)
    return keys[starts], np.add.reduceat(counts, starts) if len(counts) else counts


def _starts(ordered: NDArray[Any]) -> NDArray[np.int64]:
    return np.flatnonzero(np.concatenate([[True] * bool(len(ordered)), ordered[1:] != ordered[:-1]]))


def _occupied(keys: NDArray[np.int64]) -> int:
    return 1 + int(np.count_nonzero(keys[1:] != keys[:-1]))


def _bins(values: NDArray[np.float64], shift: int) -> NDArray[np.int64]:
    return np.floor(np.ldexp(values, -shift)).astype(np.int64)


def _least_shift(values: NDArray[np.float64]) -> int:
    """Return the least shift at which the bins of all values can be counted in int64."""
    return int(np.frexp(np.abs(values).max(initial=0.0))[1]) - 62
