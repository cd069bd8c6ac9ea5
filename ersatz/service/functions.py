"""Similarity as SPARQL functions: `ersatz:jaccard(?a, ?b)` and its kin.

Each takes two things of the knowledge base (classes, functional qualities or instances). `jaccard`,
`coverage` and `tversky` compare sets of physical qualities (paper: Reasoner) and take, as an optional third
argument, the threshold from which on a quality is representative; by default that of the knowledge base.
`ruzicka` and `ordinal` compare degrees, which no threshold cuts. All return an xsd:decimal rounded half-even
to 6 places; on anything else they are an error, so that the variable stays unbound.
"""

from collections.abc import Callable
from fractions import Fraction
from functools import cache
from typing import Final

import numpy as np
import pyoxigraph as ox
from numpy.typing import NDArray

from ersatz.errors import ErsatzError
from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.queries import exact
from ersatz.knowledge.terms import proportion_text
from ersatz.knowledge.vocabulary import XSD, term
from ersatz.measurements import Kind
from ersatz.reasoner.candidates import perceived
from ersatz.reasoner.quantised import Grades, alike, build_graded, held_grades
from ersatz.reasoner.relevance import ReasonerSettings
from ersatz.reasoner.representative import Knowledge, load_knowledge, pack
from ersatz.reasoner.similarity import CRISP, Similarity, compare

DECIMAL: Final = ox.NamedNode(XSD + "decimal")
DEGREES: Final = (Similarity.RUZICKA, Similarity.ORDINAL)
"""The similarities of degrees; coverage and tversky are those of sets."""

Function = Callable[..., ox.Literal | None]


def function_iris() -> tuple[ox.NamedNode, ...]:
    """Return the IRIs of the functions."""
    return tuple(term(form.value) for form in (*CRISP, *DEGREES))


class QualitySets:
    """The physical qualities of everything, as bits; looked up once."""

    def __init__(self, kb: KnowledgeBase) -> None:
        self._kb = kb
        self._known: Knowledge = kb.view(load_knowledge)
        self._physical = self._known.mask(Kind.PHYSICAL)
        self._functions = {iri: row for row, iri in enumerate(self._known.functions.iris)}
        self._representative: dict[Fraction, tuple[NDArray[np.bool_], NDArray[np.bool_]]] = {}
        self._held: dict[str, NDArray[np.bool_] | None] = {}
        self.theta: Final = exact(kb.build.theta)
        self._at(self.theta)

    def of(self, iri: str, theta: Fraction) -> NDArray[np.bool_] | None:
        """Return (q,): the qualities of a class, a functional quality or an instance; None if unknown."""
        classes, functions = self._at(theta)
        if iri in self._known.row_of_class:
            of_class: NDArray[np.bool_] = classes[self._known.row_of_class[iri]]
            return of_class
        if iri in self._functions:
            of_function: NDArray[np.bool_] = functions[self._functions[iri]]
            return of_function
        if iri not in self._held:
            self._held[iri] = self._of_instance(iri)
        return self._held[iri]

    def _at(self, theta: Fraction) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        if theta not in self._representative:
            if len(self._representative) > 8:
                self._representative.clear()
            known = self._known
            self._representative[theta] = (
                known.classes.representative(theta) & self._physical,
                known.functions.representative(theta) & self._physical,
            )
        return self._representative[theta]

    def _of_instance(self, iri: str) -> NDArray[np.bool_] | None:
        rows = self._kb.ask("instance_qualities", instances=[iri])
        if not rows:
            return None
        held = {row["quality"] for row in rows}
        bits = np.array([quality.iri in held for quality in self._known.qualities], dtype=bool)
        return bits & self._physical


class QualityDegrees:
    """The degrees of everything, by property; looked up once."""

    def __init__(self, kb: KnowledgeBase) -> None:
        self._kb = kb
        self._known: Knowledge = kb.view(load_knowledge)
        self._index = build_graded(self._known, ReasonerSettings(graded=True))
        self._functions = {iri: row for row, iri in enumerate(self._known.functions.iris)}
        self._held: dict[str, Grades | None] = {}

    def alike(self, one: str, other: str, form: Similarity) -> Fraction | None:
        """Return how similar two things are in all physical qualities; None if one is unknown."""
        a, b = self._of(one), self._of(other)
        return None if a is None or b is None else alike(a, b, self._index.layout, form)[0]

    def _of(self, iri: str) -> Grades | None:
        if iri in self._known.row_of_class:
            return self._index.classes.only([self._known.row_of_class[iri]])
        if iri in self._functions:
            return self._index.functions.only([self._functions[iri]])
        if iri not in self._held:
            held = perceived(self._kb, iri)
            self._held[iri] = held_grades(self._known, held, self._index.layout) if held else None
        return self._held[iri]


def similarity_functions(kb: KnowledgeBase) -> dict[ox.NamedNode, Function]:
    """Return the functions for pyoxigraph; the knowledge is read when one is first called."""
    sets, degrees = cache(lambda: QualitySets(kb)), cache(lambda: QualityDegrees(kb))

    def function(form: Similarity) -> Function:
        def similarity(*arguments: object) -> ox.Literal | None:
            try:
                if form in DEGREES:
                    return _alike(degrees(), form, arguments)
                return _compared(sets(), form, arguments)
            except (ErsatzError, ValueError):
                return None

        return similarity

    return {term(form.value): function(form) for form in (*CRISP, *DEGREES)}


def _alike(degrees: QualityDegrees, form: Similarity, arguments: tuple[object, ...]) -> ox.Literal | None:
    iris = [one.value for one in arguments if isinstance(one, ox.NamedNode)]
    if len(arguments) != 2 or len(iris) != 2:
        return None
    found = degrees.alike(iris[0], iris[1], form)
    return None if found is None else _decimal(found.numerator, found.denominator)


def _compared(sets: QualitySets, form: Similarity, arguments: tuple[object, ...]) -> ox.Literal | None:
    if len(arguments) not in (2, 3):
        return None
    theta = sets.theta
    if len(arguments) == 3:
        if not isinstance(arguments[2], ox.Literal):
            return None
        theta = exact(arguments[2].value)
    found = [sets.of(one.value, theta) if isinstance(one, ox.NamedNode) else None for one in arguments[:2]]
    if found[0] is None or found[1] is None:
        return None
    numerators, denominators = compare(pack(found[0]), pack(found[1][None]), form)
    return _decimal(int(numerators[0]), int(denominators[0]))


def _decimal(numerator: int, denominator: int) -> ox.Literal:
    return ox.Literal(proportion_text(numerator, denominator), datatype=DECIMAL)
