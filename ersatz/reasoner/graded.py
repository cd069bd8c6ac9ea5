"""Graded reasoning over arrays: how far a quality is relevant, and how similar two graded concepts are.

Degrees are floats in [0, 1] or whole numbers of the unit `ONE`; the same formulas serve both, the whole
numbers exactly. All functions broadcast over leading axes (draws, resamples). With degrees 0 and 1 they are
the crisp formulas; with nothing observed they give 0, never nan.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import lcm
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ersatz.reasoner.similarity import RATIOS, Similarity, above

Degrees: TypeAlias = NDArray[Any]
"""float64 degrees in [0, 1], or whole numbers of ONE (int32 or int64)."""

ONE: Final = 55440
"""A degree of 1 in whole numbers: divisible by 1 to 12, so that what up to twelve objects show is exact."""

ROOM: Final = 2**31 // ONE
"""So many degrees can be added in 32 bits."""


SPAN: Final = 1000
"""The way from the first to the last quality of a property in whole numbers."""


@dataclass(frozen=True, slots=True, eq=False)
class Layout:
    """Which columns of a degree array are what.

    Attributes
    ----------
    physical : (q,) bool array
        The physical qualities in use.
    functional : (q,) bool array
        The functional qualities that may be relevant.
    starts : (p,) int64 array, ascending
        First column of every property; its qualities follow by ascending rank.
    columns : (f,) int64 array
        Which quality each function is.
    gaps : (q,) int64 array, optional
        How far each quality lies from the next of its property, in parts of `SPAN`, which is the way from
        the first to the last; without it all are equally far.
    """

    physical: NDArray[np.bool_]
    functional: NDArray[np.bool_]
    starts: NDArray[np.int64]
    columns: NDArray[np.int64]
    gaps: NDArray[np.int64] | None = None

    @property
    def lengths(self) -> NDArray[np.int64]:
        """Return (p,): how many qualities each property has."""
        return np.diff(self.starts, append=len(self.physical))


@dataclass(frozen=True, slots=True, eq=False)
class Weights:
    """Graded relevance.

    Attributes
    ----------
    functions : (..., f) array
        r_f = m_O(f) R(O, f): how relevant each function is (graded O_F').
    through : (..., f, q) array
        The weight each function gives each physical quality.
    qualities : (..., q) array
        w_q, the largest of them (graded O_P').
    determined : (...) bool array
        Whether any function is relevant; else all weights are 0, or the tool's own degrees as fallback.
    """

    functions: Degrees
    through: Degrees
    qualities: Degrees
    determined: NDArray[np.bool_]


def weigh(
    tool: Degrees,
    functions: Degrees,
    layout: Layout,
    tolerance: Fraction = Fraction(0),
    *,
    fallback: bool = False,
) -> Weights:
    """Return how relevant functions and physical qualities are in a tool O.

        R(O, f) = sum_q min(m_O(q), d_f(q)) / sum_q max(m_O(q), d_f(q))       (Ruzicka, q physical)
        r_f     = m_O(f) R(O, f)   where R > tolerance, else 0
        w_q     = max_f r_f min(m_O(q), d_f(q)) / max_f r_f

    Where the paper cuts, this weighs: a function counts as much as the tool has it and looks like it, and a
    quality as much as it is typical of both. The most relevant function counts fully: R falls with the
    number of properties and the spread within classes, so only its proportions tell. With degrees 0 and 1,
    {q: w_q > 0} is the crisp O_P' (union) at the same tolerance, and all weights are equal to 1 where the
    relevant functions are equally similar.

    Parameters
    ----------
    tool : (..., q) array
        m_O.
    functions : (..., f, q) array
        d_f.
    layout : Layout
    tolerance : Fraction
        phi of relevance; 0 lets every function count by its weight.
    fallback : bool
        Take w = m_O where no function is relevant.
    """
    tool, functions = _wide(tool), _wide(functions)
    body, models = tool * layout.physical, functions * layout.physical
    both = np.minimum(body[..., None, :], models)
    shared = both.sum(axis=-1)
    joint = body.sum(axis=-1)[..., None] + models.sum(axis=-1) - shared
    has = (tool * layout.functional)[..., layout.columns]
    relevant = np.where(above(shared, joint, tolerance), _quotient(has * shared, joint), 0)
    most = relevant.max(axis=-1, initial=0)
    through = _quotient(relevant[..., None] * both, most[..., None, None])
    determined = most > 0
    otherwise = body if fallback else np.zeros_like(body)
    qualities = np.where(determined[..., None], through.max(axis=-2, initial=0), otherwise)
    return Weights(relevant, through, qualities, determined)


def overlap(
    wanted: Degrees, candidates: Degrees, size: Degrees, alpha: Fraction, beta: Fraction
) -> tuple[Degrees, Degrees]:
    """Return Tversky's ratio of graded sets, A wanted and B of each candidate, as numerators, denominators.

        sum min(A, B) / (sum min(A, B) + alpha sum (A - B)+ + beta sum (B - A)+)

    (1, 1) is Ruzicka's weighted Jaccard index, symmetric; (1, 0) coverage. It rises with B where B < A, and
    (for beta > 0) falls with B where B > A. Nothing with nothing is 0 / 1.

    Parameters
    ----------
    wanted : (..., q) array
        Degrees, 0 outside the qualities in use.
    candidates : (..., c, q) array
    size : (..., c) array
        Sum of each candidate's degrees over the qualities in use.
    alpha, beta : Fraction >= 0
        Weight of what is lacking and of what is extra.
    """
    shared = np.zeros(np.broadcast_shapes((*wanted.shape[:-1], 1), size.shape), _sum_type(candidates))
    # min is 0 wherever nothing is wanted: only these columns are touched.
    for at in np.flatnonzero(wanted.reshape(-1, wanted.shape[-1]).any(axis=0)).tolist():
        shared += np.minimum(wanted[..., at, None].astype(candidates.dtype), candidates[..., at])
    scale = lcm(alpha.denominator, beta.denominator)
    lacking, extra = int(scale * alpha), int(scale * beta)
    total = _wide(wanted).sum(axis=-1)[..., None]
    shared = _wide(shared)
    below = (scale - lacking - extra) * shared + lacking * total + extra * size
    return scale * shared, np.where(below > 0, below, 1)


def cumulative(degrees: Degrees, layout: Layout, one: float | int = 1.0) -> Degrees:
    """Return (..., q): the share of a property's total that is at this quality or a lower one.

    The last quality of a property has `one`; a property not observed has 0 throughout.

    Parameters
    ----------
    degrees : (..., q) array
        Degrees or counts; whole numbers give whole numbers, rounded half up.
    layout : Layout
    one : float or int
        What stands for 1.
    """
    parts = np.split(_wide(degrees), layout.starts[1:], axis=-1)
    sums = [part.cumsum(axis=-1) for part in parts]
    shares = [_quotient(part * one, part[..., -1:]) for part in sums]
    return np.concatenate(shares, axis=-1) if shares else np.zeros_like(degrees)


def ordinal(
    importance: Degrees, tool: Degrees, candidates: Degrees, layout: Layout
) -> tuple[Degrees, Degrees]:
    """Return one minus the mean earth mover's distance over properties, as numerators and denominators.

        1 - sum_p W_p EMD_p / sum_p W_p,     EMD_p = sum_j |F_O(j) - F_B(j)| / (k_p - 1)

    F are the cumulative shares over the k_p ordered qualities of a property: EMD_p is how many ranks apart
    the two are in the mean (in one dimension that is the least cost of moving one distribution into the
    other), 1 for opposite ends. A property observed of one of the two only counts as the farthest, 1; of
    neither, it takes no part. Symmetric in tool and candidate. With `Layout.gaps` a difference counts as far
    as its qualities lie apart, EMD_p = sum_j gap_j |F_O(j) - F_B(j)|.

    Parameters
    ----------
    importance : (..., p) array
        W_p >= 0.
    tool : (..., q) array
        Cumulative shares, of `cumulative`.
    candidates : (..., c, q) array
    layout : Layout
    """
    steps = np.maximum(layout.lengths - 1, 1).tolist()
    scale, wide = lcm(*steps) if layout.gaps is None else SPAN, _wide(importance)
    one = 1.0 if wide.dtype.kind == "f" else ONE
    if wide.dtype.kind != "f" and int(wide.max(initial=0)) * len(steps) * scale * ONE >= 2**62:
        wide = wide.astype(object)  # many different numbers of qualities
    kind = np.result_type(wide.dtype, _wide(candidates[..., :0]).dtype)  # of none: the whole takes time
    apart = total = np.zeros((*np.broadcast_shapes(tool.shape[:-1], wide.shape[:-1]), 1), wide.dtype)
    for p in np.flatnonzero(wide.reshape(-1, wide.shape[-1]).any(axis=0)).tolist():
        start = int(layout.starts[p])
        end = start + int(layout.lengths[p]) - 1
        even = [scale // steps[p]] * (end - start)
        gaps = even if layout.gaps is None else layout.gaps[start:end].tolist()
        weight = wide[..., p, None]
        mine, theirs = tool[..., end, None] > 0, candidates[..., end] > 0
        far = _shift(tool[..., start:end], candidates[..., start:end], gaps, kind)
        if mine.all() and theirs.all():
            apart = apart + weight * far
        else:
            weight = weight * (mine | theirs)
            apart = apart + weight * np.where(mine & theirs, far, scale * one)
        total = total + weight * scale * one
    shape = np.broadcast_shapes(apart.shape, total.shape, (*tool.shape[:-1], 1), candidates.shape[:-1])
    apart, total = np.broadcast_to(apart, shape), np.broadcast_to(total, shape)
    return np.where(total > 0, np.maximum(total - apart, 0), 0), np.where(total > 0, total, 1)


def _shift(tool: Degrees, candidates: Degrees, gaps: Sequence[int], kind: np.dtype[Any]) -> Degrees:
    """Return (..., c): the differences of cumulative shares, (..., k) and (..., c, k), times the k gaps.

    They are of a kind with room for them.
    """
    shape = np.broadcast_shapes((*tool.shape[:-1], 1), candidates.shape[:-1])
    even = len(set(gaps)) == 1  # then they are multiplied once: the usual case, and the quickest
    # Gaps that differ add up to SPAN at most, and 32 bits hold SPAN * ONE.
    far = np.zeros(shape, _sum_type(candidates) if even else candidates.dtype)
    for at, gap in enumerate(gaps):
        apart = candidates[..., at] - tool[..., at, None].astype(candidates.dtype)
        np.abs(apart, out=apart)
        if not even:
            apart *= gap
        far += apart
    return (gaps[0] if even else 1) * far.astype(kind, copy=False)


def importance(weights: Degrees, layout: Layout) -> Degrees:
    """Return (..., p): W_p, the sum of the weights of a property's physical qualities."""
    if not len(layout.starts):
        return np.zeros((*weights.shape[:-1], 0))
    return np.add.reduceat(_wide(weights) * layout.physical, layout.starts, axis=-1)


def similarities(
    weights: Degrees,
    tool: Degrees,
    candidates: Degrees,
    layout: Layout,
    form: Similarity,
    ratio: tuple[Fraction, Fraction] | None = None,
) -> Degrees:
    """Return (..., c) similarities in [0, 1] of float degrees: for draws and resamples.

    Parameters
    ----------
    weights : (..., q) array
        w_q of the tool.
    tool : (..., q) array
        m_O.
    candidates : (..., c, q) array
        m of each candidate.
    layout : Layout
    form : Similarity
        ruzicka, coverage, tversky or ordinal.
    ratio : (alpha, beta), optional
        Of tversky, where they are not the usual ones.
    """
    if form is Similarity.ORDINAL:
        shares = cumulative(tool, layout), cumulative(candidates, layout)
        numerators, denominators = ordinal(importance(weights, layout), *shares, layout)
    else:
        body = candidates * layout.physical
        numerators, denominators = overlap(weights, body, body.sum(axis=-1), *(ratio or RATIOS[form]))
    found: Degrees = np.clip(numerators / denominators, 0.0, 1.0)
    return found


def _quotient(numerators: Degrees, denominators: Degrees) -> Degrees:
    """Divide; whole numbers are rounded half up; nothing by nothing is 0."""
    below = np.where(denominators > 0, denominators, 1)
    found: Degrees = (
        numerators / below if numerators.dtype.kind == "f" else (2 * numerators + below) // (2 * below)
    )
    return found


def _wide(degrees: Degrees) -> Degrees:
    """Return floats as they are, and whole numbers with room for products."""
    return degrees if degrees.dtype.kind in "fO" else degrees.astype(np.int64)


def _sum_type(degrees: Degrees) -> np.dtype[Any]:
    """Return a type with room for a sum over qualities; the same, where it has, for adding is then fast."""
    return degrees.dtype if degrees.dtype.kind == "f" or degrees.shape[-1] < ROOM else np.dtype(np.int64)
