"""Recognition: what an object nobody named is like, and what it could stand in for.

Only the properties that were measured of it take part: what is unknown is neither shared nor lacking.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from ersatz.errors import InputError, UnknownNameError
from ersatz.knowledge.base import KnowledgeBase
from ersatz.reasoner.relevance import ReasonerSettings, build_index, relevance
from ersatz.reasoner.representative import Knowledge, load_knowledge, pack
from ersatz.reasoner.similarity import above, compare


@dataclass(frozen=True, slots=True)
class Likeness:
    """A class and how similar the object is to what is typical of it.

    Attributes
    ----------
    name, iri : str
    similarity : Fraction in [0, 1]
        Jaccard index of the qualities held and the class's representative ones, physical and functional.
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
    kb: KnowledgeBase, held: Sequence[str], settings: ReasonerSettings | None = None
) -> tuple[Likeness, ...]:
    """Return all classes, the most similar first.

    Parameters
    ----------
    kb : KnowledgeBase
    held : sequence of str
        Names of the qualities the object holds, at most one or a few a property.

    Raises
    ------
    UnknownNameError
        If a quality is not known.
    InputError
        If the object holds nothing.
    """
    known = kb.view(load_knowledge)
    bits, settings = _held(known, held, settings)
    index = build_index(known, settings)
    numerators, denominators = compare(pack(bits), pack(index.bits))
    found = zip(
        known.classes.names, known.classes.iris, numerators.tolist(), denominators.tolist(), strict=True
    )
    likes = (Likeness(name, iri, Fraction(n, d)) for name, iri, n, d in found)
    return tuple(sorted(likes, key=lambda one: (-one.similarity, one.name)))


def possible_roles(
    kb: KnowledgeBase, held: Sequence[str], settings: ReasonerSettings | None = None
) -> tuple[Role, ...]:
    """Return the tools the object was compared with, those it fits best first.

    Tools with no relevant function among what was measured are left out: there is nothing to compare.
    Parameters and errors are those of `nearest_classes`.
    """
    known = kb.view(load_knowledge)
    bits, settings = _held(known, held, settings)
    index = build_index(known, settings)
    body = pack((bits & index.body_mask)[None])
    roles = []
    for row, (name, iri) in enumerate(zip(known.classes.names, known.classes.iris, strict=True)):
        found = relevance(index, row, settings)
        if not found.determined:
            continue
        numerators, denominators = compare(pack(found.physical), body, settings.similarity)
        accepted = bool(above(numerators, denominators, settings.tolerance)[0])
        roles.append(Role(name, iri, Fraction(int(numerators[0]), int(denominators[0])), accepted))
    return tuple(sorted(roles, key=lambda role: (-role.similarity, role.tool)))


def _held(
    known: Knowledge, held: Sequence[str], settings: ReasonerSettings | None
) -> tuple[NDArray[np.bool_], ReasonerSettings]:
    """Return the qualities as bits, and settings that reason with the measured properties only."""
    if not held:
        raise InputError("the object holds no quality: measure at least one property of it")
    bits = held_bits(known, held)
    settings = settings or ReasonerSettings()
    measured = {known.qualities[at].property for at in np.flatnonzero(bits)}
    allowed = measured if settings.properties is None else measured & set(settings.properties)
    return bits, replace(settings, properties=tuple(sorted(allowed)))


def held_bits(known: Knowledge, held: Sequence[str]) -> NDArray[np.bool_]:
    """Return the named qualities as (q,) bits.

    Raises
    ------
    UnknownNameError
        If a quality is not known.
    """
    column = {quality.name: at for at, quality in enumerate(known.qualities)}
    for name in held:
        if name not in column:
            raise UnknownNameError("quality", name, column)
    bits = np.zeros(len(column), dtype=bool)
    bits[[column[name] for name in held]] = True
    return bits
