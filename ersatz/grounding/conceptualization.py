"""Conceptualization: class knowledge <O, t, m> and function models <f, p, d>, as counts that merge.

m = P(holds(o, t) | o in O) and d = P(holds(o, p) | holds(o, f)) are views of counts. Counts are kept in
whole millionths of a degree, so that crisp and fuzzy ones add up exactly in any order: over files, over
workers, over time.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ersatz.errors import InputError
from ersatz.grounding.attribution import Attribution, most_held
from ersatz.grounding.fuzzy import DEGREE, dealt
from ersatz.grounding.subcategorization import Qualities
from ersatz.measurements import Kind

__all__ = ["DEGREE", "Counts", "conceptualize"]


@dataclass(frozen=True, slots=True, eq=False)
class Counts:
    """How often qualities were observed in classes, and physical qualities together with functional ones.

    All arrays are int64; all but `units` in millionths of a degree. q = number of qualities over all
    properties (in order), p = number of properties, f = number of functional qualities.

    Attributes
    ----------
    qualities : tuple of p Qualities
    classes : tuple of c str, sorted
    units : (c,) array
        Units of each class, whatever was measured of them.
    class_counts : (c, q) array
        Observed degrees of each quality in the units of each class.
    class_totals : (c, p) array
        Units of the class with a value of the property.
    function_counts : (f, q) array
        Observed degrees of each physical quality together with each functional quality; 0 for others.
    function_totals : (f, p) array
        Degrees of the functional quality in units with a value of the physical property; 0 for others.
    """

    qualities: tuple[Qualities, ...]
    classes: tuple[str, ...]
    units: NDArray[np.int64]
    class_counts: NDArray[np.int64]
    class_totals: NDArray[np.int64]
    function_counts: NDArray[np.int64]
    function_totals: NDArray[np.int64]

    @property
    def functions(self) -> tuple[str, ...]:
        """Names of the functional qualities, the rows of `function_counts`."""
        return tuple(n for q in self.qualities if q.property.kind is Kind.FUNCTIONAL for n in q.names)

    @property
    def offsets(self) -> NDArray[np.int64]:
        """(p + 1,) array: where each property's qualities begin among the q."""
        return np.concatenate([[0], np.cumsum([len(q.names) for q in self.qualities])])

    def __add__(self, other: "Counts") -> "Counts":
        """Return the counts of both; exact, commutative and associative."""
        return self._combine(other, 1)

    def __sub__(self, other: "Counts") -> "Counts":
        """Return the counts without the others."""
        return self._combine(other, -1)

    def _combine(self, other: "Counts", sign: int) -> "Counts":
        if len(self.qualities) != len(other.qualities) or not all(
            a.same_cuts(b) for a, b in zip(self.qualities, other.qualities, strict=True)
        ):
            raise InputError(
                "counts of different qualities cannot be added: ground both with the same cut points"
            )
        classes = tuple(sorted({*self.classes, *other.classes}))
        one, two = self._spread(classes), other._spread(classes)
        return Counts(
            self.qualities,
            classes,
            one.units + sign * two.units,
            one.class_counts + sign * two.class_counts,
            one.class_totals + sign * two.class_totals,
            one.function_counts + sign * two.function_counts,
            one.function_totals + sign * two.function_totals,
        )

    def _spread(self, classes: tuple[str, ...]) -> "Counts":
        """Return the same counts over a larger set of classes."""
        row = {name: at for at, name in enumerate(classes)}
        rows = [row[name] for name in self.classes]

        def spread(counts: NDArray[np.int64]) -> NDArray[np.int64]:
            wide = np.zeros((len(classes), *counts.shape[1:]), dtype=np.int64)
            wide[rows] = counts
            return wide

        return replace(
            self,
            classes=classes,
            units=spread(self.units),
            class_counts=spread(self.class_counts),
            class_totals=spread(self.class_totals),
        )


def conceptualize(attribution: Attribution, classes: tuple[str, ...]) -> Counts:
    """Count what the units of each class hold, and what they hold together.

    Degrees of two qualities held together multiply: in every unit the degree of a function is divided
    among the qualities of a property, in whole millionths that add up to it. Crisp co-occurrence is the
    special case of degrees 0 and 1.

    Parameters
    ----------
    attribution : Attribution
    classes : tuple of c str
        What the indices of `attribution.unit_class` stand for.
    """
    unit_class, held, qualities = attribution.unit_class, attribution.held, attribution.qualities
    present = [most_held(h) >= 0 for h in held]
    physical = [q.property.kind is Kind.PHYSICAL for q in qualities]
    class_counts = [
        _count(unit_class, len(classes), h, len(q.names)) for h, q in zip(held, qualities, strict=True)
    ]
    class_totals = [np.bincount(unit_class[p], minlength=len(classes)) * DEGREE for p in present]
    function_counts, function_totals = [], []
    for f, quality in enumerate(qualities):
        if quality.property.kind is not Kind.FUNCTIONAL:
            continue
        k = len(quality.names)
        everyone = np.zeros(len(unit_class), dtype=np.int32)
        counts = [
            _together(held[f], k, h, len(q.names)) if body else np.zeros((k, len(q.names)), np.int64)
            for h, q, body in zip(held, qualities, physical, strict=True)
        ]
        totals = [
            _count(everyone[p], 1, held[f][p], k)[0] if body else np.zeros(k, np.int64)
            for p, body in zip(present, physical, strict=True)
        ]
        function_counts.append(np.hstack(counts))
        function_totals.append(np.stack(totals, axis=1))
    width = sum(len(q.names) for q in qualities)
    return Counts(
        qualities,
        classes,
        np.bincount(unit_class, minlength=len(classes)).astype(np.int64),
        np.hstack(class_counts).astype(np.int64),
        np.stack(class_totals, axis=1).astype(np.int64),
        np.vstack([np.empty((0, width), np.int64), *function_counts]),
        np.vstack([np.empty((0, len(qualities)), np.int64), *function_totals]),
    )


def _count(
    group: NDArray[np.int32], groups: int, held: NDArray[np.int8] | NDArray[np.int64], k: int
) -> NDArray[np.int64]:
    """Return (groups, k): the degrees of each quality in each group of units."""
    if held.ndim == 1:
        rows = held >= 0
        codes = group[rows].astype(np.int64) * k + held[rows]
        return (np.bincount(codes, minlength=groups * k) * DEGREE).reshape(groups, k)
    counts = np.zeros((groups, k), dtype=np.int64)
    np.add.at(counts, group, held)
    return counts


def _together(
    one: NDArray[np.int8] | NDArray[np.int64], k: int, two: NDArray[np.int8] | NDArray[np.int64], m: int
) -> NDArray[np.int64]:
    """Return (k, m): the degrees with which qualities of two properties are held together."""
    if one.ndim == 1:
        rows = one >= 0
        return _count(one[rows].astype(np.int32), k, two[rows], m)
    if two.ndim == 1:
        return _together(two, m, one, k).T
    valued = two.any(axis=1)
    shares, held = one[valued].astype(np.int64, copy=False), two[valued].astype(np.int64, copy=False)
    return np.stack([_divided(share, held).sum(axis=0) for share in shares.T])


def _divided(share: NDArray[np.int64], held: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return (u, m): each unit's share divided in proportion to the degrees it holds."""
    whole, rest = np.divmod(share[:, None] * held, DEGREE)
    return dealt(whole, rest, share)
