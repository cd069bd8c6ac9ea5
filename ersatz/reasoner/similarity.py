"""Similarity of quality sets: Jaccard and its kin over packed bits, as exact fractions."""

from enum import StrEnum
from fractions import Fraction
from typing import Final

import numpy as np
from numpy.typing import NDArray


class Similarity(StrEnum):
    """How a candidate's qualities B are compared with the relevant ones A.

    - jaccard: |A & B| / |A | B|, the paper's rule.
    - coverage: |A & B| / |A|; what a candidate has beyond the relevant does not count against it.
    - tversky: |A & B| / (|A & B| + 1 |A - B| + 1/2 |B - A|); lacking weighs twice as much as extra
      (Tversky 1977, Features of Similarity).
    """

    JACCARD = "jaccard"
    COVERAGE = "coverage"
    TVERSKY = "tversky"


_WEIGHTS: Final = {Similarity.JACCARD: (2, 2), Similarity.COVERAGE: (2, 0), Similarity.TVERSKY: (2, 1)}
"""Twice the weights of |A - B| and |B - A| beside |A & B|."""


def compare(
    relevant: NDArray[np.uint64], candidates: NDArray[np.uint64], form: Similarity = Similarity.JACCARD
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Return the similarity of each candidate with the relevant set as numerators and denominators.

    Parameters
    ----------
    relevant : (w,) or (n, w) uint64 array
        One set of qualities as packed bits, or one for each candidate.
    candidates : (n, w) uint64 array
    form : Similarity

    Returns
    -------
    numerators, denominators : (n,) int32 arrays
        Empty with empty is 0 / 1.
    """
    shared, size, wanted = _size(candidates & relevant), _size(candidates), _size(relevant)
    one, two = _WEIGHTS[form]
    # shared + lacking + extra, weighed; with lacking = wanted - shared and extra = size - shared.
    denominators = (2 - one - two) * shared + two * size + one * wanted
    return 2 * shared, denominators if np.all(wanted) else np.maximum(denominators, 1)


def above(
    numerators: NDArray[np.int32], denominators: NDArray[np.int32], tolerance: Fraction
) -> NDArray[np.bool_]:
    """Return whether numerators / denominators > tolerance, decided exactly."""
    a, b = tolerance.denominator, tolerance.numerator
    if a.bit_length() > 48:
        return np.array(
            [Fraction(int(n), int(d)) > tolerance for n, d in zip(numerators, denominators, strict=True)],
            dtype=bool,
        )
    exact: NDArray[np.bool_] = numerators.astype(np.int64) * a > denominators.astype(np.int64) * b
    return exact


def _size(sets: NDArray[np.uint64]) -> NDArray[np.int32]:
    counted = np.bitwise_count(sets)
    size: NDArray[np.int32] = (
        counted[..., 0].astype(np.int32) if sets.shape[-1] == 1 else counted.sum(axis=-1, dtype=np.int32)
    )
    return size
