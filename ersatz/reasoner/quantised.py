"""The degrees of a knowledge base as small whole numbers, in columns: what graded reasoning reads.

A degree is kept in units of 1 / ONE, rounded half up; so are cumulative shares. Every decision follows from
these numbers exactly. Columns lie together in memory, for a tool's weights touch few of them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from ersatz.grounding.fuzzy import DEGREE
from ersatz.knowledge.terms import millionths
from ersatz.reasoner.graded import (
    ONE,
    Degrees,
    Layout,
    cumulative,
    importance,
    ordinal,
    overlap,
    weigh,
)
from ersatz.reasoner.relevance import Demand, ReasonerSettings, Relevance, layout_of
from ersatz.reasoner.representative import Knowledge, Memberships
from ersatz.reasoner.similarity import RATIOS, Similarity


@dataclass(frozen=True, slots=True, eq=False)
class Grades:
    """Degrees of n things, classes or instances.

    Attributes
    ----------
    degrees : (n, q) int32 array, column-major
        m in units of 1 / ONE; 0 of properties not in use.
    shares : (n, q) int32 array, column-major
        Cumulative shares over the qualities of each property; 0 throughout where it was not observed.
    sizes : (n,) int64 array
        Sum of the physical degrees.
    """

    degrees: NDArray[np.int32]
    shares: NDArray[np.int32]
    sizes: NDArray[np.int64]

    def only(self, rows: Sequence[int] | NDArray[np.int64]) -> "Grades":
        """Return the grades of some of the things."""
        return Grades(self.degrees[rows], self.shares[rows], self.sizes[rows])

    def join(self, other: "Grades") -> "Grades":
        """Return these and then the others."""
        return Grades(
            np.concatenate([self.degrees, other.degrees]),
            np.concatenate([self.shares, other.shares]),
            np.concatenate([self.sizes, other.sizes]),
        )


@dataclass(frozen=True, slots=True, eq=False)
class GradedIndex:
    """The degrees of a knowledge base; made once, used often.

    Attributes
    ----------
    layout : Layout
    classes : Grades
    functions : Grades
        d of every function.
    body_bits : (c, q) bool array
        The physical qualities of which a class has any degree.
    """

    layout: Layout
    classes: Grades
    functions: Grades
    body_bits: NDArray[np.bool_]


def build_graded(knowledge: Knowledge, settings: ReasonerSettings) -> GradedIndex:
    """Quantise what is known of every class and function."""
    layout = layout_of(knowledge, settings)
    classes = grades(knowledge.classes, layout)
    functions = grades(knowledge.functions, layout)
    return GradedIndex(layout, classes, functions, (classes.degrees > 0) & layout.physical)


def grades(memberships: Memberships, layout: Layout) -> Grades:
    """Return the grades of classes, or of instances with what they hold as counts."""
    used = layout.physical | layout.functional
    degrees = np.asfortranarray(quantise(memberships) * used)
    counts = memberships.counts
    room = object if int(counts.max(initial=0)) * counts.shape[-1] * 2 * ONE >= 2**63 else np.int64
    shares = cumulative(counts.astype(room), layout, ONE) * used
    sizes = (degrees * layout.physical).sum(axis=-1, dtype=np.int64)
    return Grades(degrees, np.asfortranarray(shares.astype(np.int32)), sizes)


def quantise(memberships: Memberships) -> NDArray[np.int32]:
    """Return (n, q) degrees count / total in units of 1 / ONE, rounded half up; 0 where not observed."""
    counts, totals = memberships.counts, np.maximum(memberships.totals, 1)
    room = object if int(totals.max(initial=0)) * 4 * ONE >= 2**63 else np.int64
    counts, totals = counts.astype(room), totals.astype(room)
    rounded = (2 * ONE * counts + totals) // (2 * totals)
    found: NDArray[np.int32] = np.minimum(rounded, ONE).astype(np.int32)
    return found


def graded_relevance(index: GradedIndex, row: int, settings: ReasonerSettings) -> Relevance:
    """Return what is relevant to any degree in one class, and how far."""
    mine = index.classes.degrees[row]
    weights = weigh(
        mine, index.functions.degrees, index.layout, settings.relevance_tolerance, fallback=settings.fallback
    )
    functions = np.flatnonzero(weights.functions)
    return Relevance(
        weights.qualities > 0,
        tuple(functions.tolist()),
        weights.through[functions] > 0,
        fallback=settings.fallback and not weights.determined,
        demand=Demand(index.layout, weights, mine, index.classes.shares[row]),
    )


def compare_graded(wanted: Demand, candidates: Grades, settings: ReasonerSettings) -> tuple[Degrees, Degrees]:
    """Return the similarity of each candidate as int64 numerators and denominators, (n,) each."""
    layout, qualities = wanted.layout, wanted.weights.qualities
    if settings.similarity is Similarity.ORDINAL:
        return ordinal(importance(qualities, layout), wanted.shares, candidates.shares, layout)
    return overlap(qualities, candidates.degrees, candidates.sizes, *settings.ratio)


def compare_by_property(
    wanted: Demand, candidate: Grades, settings: ReasonerSettings
) -> tuple[Degrees, Degrees]:
    """Return the same of one candidate for each property, (p,): their sums are the whole's.

    A property that takes no part has 0 / 0.
    """
    layout = wanted.layout
    parts = np.repeat(np.eye(len(layout.starts), dtype=bool), layout.lengths, axis=1) & layout.physical
    if settings.similarity is Similarity.ORDINAL:
        weights = np.diag(importance(wanted.weights.qualities, layout))
        found = ordinal(weights, wanted.shares, candidate.shares, layout)
        takes_part = weights.any(axis=1)
    else:
        asked, held = wanted.weights.qualities * parts, candidate.degrees * parts
        sizes = held.sum(axis=-1, dtype=np.int64)
        found = overlap(asked, held[:, None], sizes[:, None], *settings.ratio)
        takes_part = asked.any(axis=1) | ((sizes > 0) & (settings.ratio[1] > 0))
    return found[0][:, 0], found[1][:, 0] * takes_part


def alike(a: Grades, others: Grades, layout: Layout, form: Similarity) -> list[Fraction]:
    """Return how similar a thing is to others in all physical qualities, whatever they are for.

    Parameters
    ----------
    a : Grades of one thing
    others : Grades of n things
    layout : Layout
    form : Similarity
        Ruzicka and ordinal are symmetric; coverage and tversky ask how far the others have what a has.
        Ordinal gives every property that was observed of either the same weight.
    """
    if form is Similarity.ORDINAL:
        every = importance(layout.physical.astype(np.int64), layout).clip(max=1)
        found = ordinal(every, a.shares[0], others.shares, layout)
    else:
        wanted = (a.degrees[0] * layout.physical).astype(np.int64)
        found = overlap(wanted, others.degrees, others.sizes, *RATIOS[form])
    return [Fraction(n, d) for n, d in zip(found[0].tolist(), found[1].tolist(), strict=True)]


def held_grades(knowledge: Knowledge, held: Mapping[str, Decimal], layout: Layout) -> Grades:
    """Return the grades of one object.

    Parameters
    ----------
    knowledge : Knowledge
    held : mapping of quality IRI to the degree held, in [0, 1]
    layout : Layout
    """
    counts = np.zeros((1, len(knowledge.qualities)), dtype=np.int64)
    for at, quality in enumerate(knowledge.qualities):
        counts[0, at] = millionths(held.get(quality.iri, Decimal(0)))
    return grades(Memberships((), (), counts, np.full_like(counts, DEGREE)), layout)
