"""The SPARQL functions of degrees, against the reference in fractions."""

from decimal import Decimal
from fractions import Fraction

import pyoxigraph as ox
import pytest

from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.vocabulary import KB, XSD, term
from ersatz.service.functions import Function, function_iris, similarity_functions
from tests.reasoner.reference import Degrees, World, nearness, ratio_of, rounded
from tests.reasoner.worlds import world_of_kb

KITCHEN = ("Tray", "Plate", "Sponge", "support_4", "containment_1", "ycb_029_plate")


@pytest.fixture(scope="module")
def kb() -> KnowledgeBase:
    return KnowledgeBase.open("household")


@pytest.fixture(scope="module")
def functions(kb: KnowledgeBase) -> dict[ox.NamedNode, Function]:
    return similarity_functions(kb)


@pytest.fixture(scope="module")
def world(kb: KnowledgeBase) -> World:
    return world_of_kb(kb)


def degrees(kb: KnowledgeBase, world: World, name: str) -> Degrees:
    """Return what is known of a class, a function or an instance, physical and in fractions."""
    of = world.classes.get(name.lower()) or world.functions.get(name)
    if of is None:
        rows = kb.ask("instance_qualities", instances=[KB + name])
        of = {str(row["quality"]).rpartition("#")[2]: Fraction(1) for row in rows}
    return {q: degree for q, degree in of.items() if q in world.physical}


@pytest.mark.parametrize("one", KITCHEN)
@pytest.mark.parametrize("other", KITCHEN)
def test_they_are_those_of_the_reference(
    kb: KnowledgeBase, functions: dict[ox.NamedNode, Function], world: World, one: str, other: str
) -> None:
    a, b = degrees(kb, world, one), degrees(kb, world, other)
    observed = {world.property_of[q]: q for q in world.physical}
    expected = {
        "ordinal": nearness(world, dict.fromkeys(observed.values(), Fraction(1)), a, b),
        "ruzicka": ratio_of(
            {q: rounded(d) for q, d in a.items()},
            {q: rounded(d) for q, d in b.items()},
            Fraction(1),
            Fraction(1),
        ),
    }
    for name, value in expected.items():
        found = functions[term(name)](ox.NamedNode(KB + one), ox.NamedNode(KB + other))
        assert found is not None
        assert found.datatype.value == XSD + "decimal"
        assert abs(Decimal(found.value) - Decimal(value.numerator) / value.denominator) <= Decimal(
            "0.0000005"
        )


@pytest.mark.parametrize("name", ["ruzicka", "ordinal"])
def test_wrong_calls_give_nothing(functions: dict[ox.NamedNode, Function], name: str) -> None:
    tray, theta = ox.NamedNode(KB + "Tray"), ox.Literal("0.35")
    for arguments in ((tray,), (tray, ox.NamedNode(KB + "Nothing")), (tray, theta), (tray, tray, theta)):
        assert functions[term(name)](*arguments) is None


def test_all_are_told() -> None:
    names = {iri.value.rpartition("#")[2] for iri in function_iris()}
    assert names == {"jaccard", "coverage", "tversky", "ruzicka", "ordinal"}
