"""Similarity of quality sets: Jaccard and its kin over packed bits, as exact fractions.

Their graded forms are in `graded`.
"""

from enum import StrEnum
from fractions import Fraction
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray


class Similarity(StrEnum):
    """How a candidate's qualities B are compared with the relevant ones A.

    - jaccard: |A & B| / |A | B|, the paper's rule.
    - coverage: |A & B| / |A|; what a candidate has beyond the relevant does not count against it.
    - tversky: |A & B| / (|A & B| + 1 |A - B| + 1/2 |B - A|); lacking weighs twice as much as extra
      (Tversky 1977, Features of Similarity).
    - ruzicka: sum min(A, B) / sum max(A, B) of degrees, the Jaccard index of graded sets; graded only,
      as are the next and the graded forms of coverage and tversky.
    - ordinal: how near the two are on the ordered qualities of each property, by earth mover's distance.
    """

    JACCARD = "jaccard"
    COVERAGE = "coverage"
    TVERSKY = "tversky"
    RUZICKA = "ruzicka"
    ORDINAL = "ordinal"


CRISP: Final = (Similarity.JACCARD, Similarity.COVERAGE, Similarity.TVERSKY)
"""Similarities of sets."""

GRADED: Final = (Similarity.RUZICKA, Similarity.ORDINAL, Similarity.COVERAGE, Similarity.TVERSKY)
"""Similarities of degrees."""

RATIOS: Final = {
    Similarity.JACCARD: (Fraction(1), Fraction(1)),
    Similarity.RUZICKA: (Fraction(1), Fraction(1)),
    Similarity.COVERAGE: (Fraction(1), Fraction(0)),
    Similarity.TVERSKY: (Fraction(1), Fraction(1, 2)),
}
"""Tversky's alpha and beta: the weights of |A - B| and |B - A| beside |A & B|."""

_TWICE: Final = {form: (int(2 * alpha), int(2 * beta)) for form, (alpha, beta) in RATIOS.items()}


def compare(
    relevant: NDArray[np.uint64],
    candidates: NDArray[np.uint64],
    form: Similarity = Similarity.JACCARD,
    sizes: NDArray[np.int32] | None = None,
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Return the similarity of each candidate with the relevant set as numerators and denominators.

    Parameters
    ----------
    relevant : (w,) or (n, w) uint64 array
        One set of qualities as packed bits, or one for each candidate.
    candidates : (n, w) uint64 array
    form : Similarity
    sizes : (n,) int32 array, optional
        Of the candidates (`set_sizes`), where they are compared more than once.

    Returns
    -------
    numerators, denominators : (n,) int32 arrays
        Empty with empty is 0 / 1.
    """
    shared, wanted = set_sizes(candidates & relevant), set_sizes(relevant)
    size = set_sizes(candidates) if sizes is None else sizes
    one, two = _TWICE[form]
    # shared + lacking + extra, weighed; with lacking = wanted - shared and extra = size - shared.
    denominators = (2 - one - two) * shared + two * size + one * wanted
    return 2 * shared, denominators if np.all(wanted) else np.maximum(denominators, 1)


def above(numerators: NDArray[Any], denominators: NDArray[Any], tolerance: Fraction) -> NDArray[np.bool_]:
    """Return whether numerators / denominators > tolerance; of whole numbers, decided exactly."""
    a, b = tolerance.denominator, tolerance.numerator
    if numerators.dtype.kind == "f":
        near: NDArray[np.bool_] = numerators > denominators * float(tolerance)
        return near
    largest = (
        2**31 if numerators.dtype == denominators.dtype == np.int32 else _largest(numerators, denominators)
    )
    room = np.int64 if max(a, b) * largest < 2**63 else object
    exact: NDArray[np.bool_] = numerators.astype(room) * a > denominators.astype(room) * b
    return exact.astype(bool)


def _largest(*arrays: NDArray[Any]) -> int:
    return max(int(array.max(initial=0)) for array in arrays)


def ratios(numerators: NDArray[Any], denominators: NDArray[Any]) -> NDArray[np.float32] | NDArray[np.float64]:
    """Return quotients of which equal ones are equal and others in order.

    Quotients in [0, 1] with denominators below 2^11 are at least 2^-22 apart, and single precision
    errs by 2^-25; so are those below 2^25 in double precision.
    """
    if numerators.dtype == np.int32 and int(denominators.max(initial=0)) < 1 << 11:
        return np.asarray(np.divide(numerators, denominators, dtype=np.float32))
    return np.asarray(numerators / denominators, dtype=np.float64)


def best_first(
    similarity: NDArray[np.float32] | NDArray[np.float64], top: int | None = None
) -> NDArray[np.int64]:
    """Return the rows of the most similar candidates; of equal ones the first; none that is below 0."""
    if top is None or top >= len(similarity):
        order = np.argsort(-similarity, kind="stable")
        return order[similarity[order] >= 0][:top]
    least = np.partition(similarity, -top)[-top]
    better = np.flatnonzero(similarity > least)
    equal = np.flatnonzero(similarity == least)
    best = better[np.argsort(-similarity[better], kind="stable")]
    return np.concatenate([best, equal[: top - len(best)]])


def set_sizes(sets: NDArray[np.uint64]) -> NDArray[np.int32]:
    """Return how many qualities each set of packed bits has."""
    counted = np.bitwise_count(sets)
    size: NDArray[np.int32] = (
        counted[..., 0].astype(np.int32) if sets.shape[-1] == 1 else counted.sum(axis=-1, dtype=np.int32)
    )
    return size
