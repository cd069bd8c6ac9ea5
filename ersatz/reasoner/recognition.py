"""Recognition: what an object nobody named is like, and what it could stand in for.

Only the properties that were measured of it take part: what is unknown is neither shared nor lacking.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from fractions import Fraction
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from ersatz.errors import InputError, UnknownNameError
from ersatz.knowledge.base import KnowledgeBase
from ersatz.reasoner.indices import crisp_index, graded_index
from ersatz.reasoner.quantised import (
    GradedIndex,
    alike,
    compare_graded,
    graded_relevance,
    grades,
    held_grades,
)
from ersatz.reasoner.relevance import USUAL, Index, ReasonerSettings, layout_of, relevance
from ersatz.reasoner.representative import Knowledge, load_knowledge, pack
from ersatz.reasoner.similarity import Similarity, compare

Held: TypeAlias = Sequence[str] | Mapping[str, float | Decimal]
"""Qualities held wholly, or each with a degree."""

Judge: TypeAlias = Callable[[int], Fraction | None]
"""Says how well the object fits the tool in a row; None where there is nothing to compare."""


@dataclass(frozen=True, slots=True)
class Likeness:
    """A class and how similar the object is to what is typical of it.

    Attributes
    ----------
    name, iri : str
    similarity : Fraction in [0, 1]
        Of what it holds and what is representative of the class, physical and functional; graded, of the
        degrees.
    """

    name: str
    iri: str
    similarity: Fraction


@dataclass(frozen=True, slots=True)
class Role:
    """A missing tool the object was compared with.

    Attributes
    ----------
    tool, iri : str
    similarity : Fraction in [0, 1]
    accepted : bool
        Whether the object could stand in for the tool.
    """

    tool: str
    iri: str
    similarity: Fraction
    accepted: bool


def nearest_classes(
    kb: KnowledgeBase, held: Held, settings: ReasonerSettings | None = None
) -> tuple[Likeness, ...]:
    """Return all classes, the most similar first.

    Parameters
    ----------
    kb : KnowledgeBase
    held : sequence of str, or mapping of str to a degree in [0, 1]
        Names of the qualities the object holds, at most one or a few a property.
    settings : ReasonerSettings, optional
        Graded: by ordinal or Ruzicka similarity of degrees; else by the Jaccard index of sets.

    Raises
    ------
    UnknownNameError
        If a quality is not known.
    InputError
        If the object holds nothing.
    """
    known = kb.view(load_knowledge)
    degrees, settings = _held(known, held, settings)
    if settings.graded:
        layout = layout_of(known, settings)
        layout = replace(layout, physical=layout.physical | layout.functional)
        form = Similarity.ORDINAL if settings.similarity is Similarity.ORDINAL else Similarity.RUZICKA
        found = alike(held_grades(known, degrees, layout), grades(known.classes, layout), layout, form)
    else:
        index = crisp_index(kb, settings)
        pairs = compare(pack(_bits(known, degrees)), pack(index.bits))
        found = [Fraction(n, d) for n, d in zip(*(of.tolist() for of in pairs), strict=True)]
    likes = map(Likeness, known.classes.names, known.classes.iris, found)
    return tuple(sorted(likes, key=lambda one: (-one.similarity, one.name)))


def possible_roles(
    kb: KnowledgeBase, held: Held, settings: ReasonerSettings | None = None
) -> tuple[Role, ...]:
    """Return the tools the object was compared with, those it fits best first.

    Tools with no relevant function among what was measured are left out: there is nothing to compare.
    Parameters and errors are those of `nearest_classes`; graded settings may have any similarity.
    """
    known = kb.view(load_knowledge)
    degrees, settings = _held(known, held, settings)
    if settings.graded:
        judge = _by_degrees(known, graded_index(kb, settings), degrees, settings)
    else:
        judge = _by_sets(known, crisp_index(kb, settings), degrees, settings)
    roles = []
    for row, (name, iri) in enumerate(zip(known.classes.names, known.classes.iris, strict=True)):
        found = judge(row)
        if found is not None:
            roles.append(Role(name, iri, found, found > settings.tolerance))
    return tuple(sorted(roles, key=lambda role: (-role.similarity, role.tool)))


def _by_sets(
    known: Knowledge, index: Index, degrees: Mapping[str, Decimal], settings: ReasonerSettings
) -> Judge:
    body = pack((_bits(known, degrees) & index.body_mask)[None])

    def judge(row: int) -> Fraction | None:
        found = relevance(index, row, settings)
        numerators, denominators = compare(pack(found.physical), body, settings.similarity)
        return Fraction(int(numerators[0]), int(denominators[0])) if found.determined else None

    return judge


def _by_degrees(
    known: Knowledge, index: GradedIndex, degrees: Mapping[str, Decimal], settings: ReasonerSettings
) -> Judge:
    body = held_grades(known, degrees, index.layout)

    def judge(row: int) -> Fraction | None:
        found = graded_relevance(index, row, settings)
        assert found.demand is not None
        numerators, denominators = compare_graded(found.demand, body, settings)
        return Fraction(int(numerators[0]), int(denominators[0])) if found.determined else None

    return judge


def _held(
    known: Knowledge, held: Held, settings: ReasonerSettings | None
) -> tuple[Mapping[str, Decimal], ReasonerSettings]:
    """Return the degrees held by quality IRI, and settings that reason with what was measured only."""
    exactly = _degrees(known, held)
    if not exactly:
        raise InputError("the object holds no quality: measure at least one property of it")
    settings = settings or USUAL
    measured = {quality.property for quality in known.qualities if quality.iri in exactly}
    allowed = measured if settings.properties is None else measured & set(settings.properties)
    return exactly, replace(settings, properties=tuple(sorted(allowed)))


def _degrees(known: Knowledge, held: Held) -> dict[str, Decimal]:
    """Return the degrees held by quality IRI."""
    degrees = held if isinstance(held, Mapping) else dict.fromkeys(held, 1)
    qualities = {quality.name: quality.iri for quality in known.qualities}
    for name, degree in degrees.items():
        if name not in qualities:
            raise UnknownNameError("quality", name, qualities)
        if not 0 <= degree <= 1:
            raise InputError(f"the object holds {name} to the degree {degree}: degrees lie between 0 and 1")
    return {qualities[name]: Decimal(str(degree)) for name, degree in degrees.items()}


def _bits(known: Knowledge, degrees: Mapping[str, Decimal]) -> NDArray[np.bool_]:
    """Return the qualities held to any degree."""
    return np.array([degrees.get(quality.iri, 0) > 0 for quality in known.qualities], dtype=bool)


def held_degrees(known: Knowledge, held: Held) -> NDArray[np.float64]:
    """Return (q,): how far one object holds each quality; nothing is no error.

    Raises
    ------
    UnknownNameError
        If a quality is not known.
    """
    degrees = _degrees(known, held)
    return np.array([float(degrees.get(quality.iri, 0)) for quality in known.qualities])
