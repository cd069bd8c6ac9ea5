"""Similarity as SPARQL functions: `ersatz:jaccard(?a, ?b)` and its kin.

Each takes two things of the knowledge base (classes, functional qualities or instances) and, as an
optional third argument, the threshold from which on a quality is representative; by default that of the
knowledge base. They compare sets of physical qualities (paper: Reasoner) and return an xsd:decimal
rounded half-even to 6 places; on anything else they are an error, so that the variable stays unbound.
"""

from collections.abc import Callable
from decimal import ROUND_HALF_EVEN, Decimal
from fractions import Fraction
from typing import Final

import numpy as np
import pyoxigraph as ox
from numpy.typing import NDArray

from ersatz.errors import ErsatzError
from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.queries import exact
from ersatz.knowledge.terms import plain
from ersatz.knowledge.vocabulary import XSD, term
from ersatz.measurements import Kind
from ersatz.reasoner.representative import Knowledge, load_knowledge, pack
from ersatz.reasoner.similarity import CRISP, Similarity, compare

DECIMAL: Final = ox.NamedNode(XSD + "decimal")
Function = Callable[..., ox.Literal | None]


def function_iris() -> tuple[ox.NamedNode, ...]:
    """Return the IRIs of the functions."""
    return tuple(term(form.value) for form in CRISP)


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


def similarity_functions(kb: KnowledgeBase) -> dict[ox.NamedNode, Function]:
    """Return the functions for pyoxigraph; the knowledge is read when one is first called."""
    sets: list[QualitySets] = []

    def function(form: Similarity) -> Function:
        def similarity(*arguments: object) -> ox.Literal | None:
            if not sets:
                sets.append(QualitySets(kb))
            try:
                return _compared(sets[0], form, arguments)
            except (ErsatzError, ValueError):
                return None

        return similarity

    return {term(form.value): function(form) for form in CRISP}


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
    ratio = Decimal(int(numerators[0])) / Decimal(int(denominators[0]))
    return ox.Literal(plain(ratio.quantize(Decimal("0.000001"), ROUND_HALF_EVEN)), datatype=DECIMAL)
