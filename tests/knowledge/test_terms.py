"""Literals are canonical: what we write is what every store gives back."""

from decimal import Decimal
from fractions import Fraction

import pyoxigraph as ox
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ersatz.errors import InputError
from ersatz.knowledge import terms
from ersatz.knowledge.answers import value_of
from ersatz.knowledge.queries import exact
from ersatz.measurements import DIGITS, LARGEST

XSD = "http://www.w3.org/2001/XMLSchema#"


def stored(literal: str) -> ox.Literal:
    """Return a literal as it comes back out of a store."""
    store = ox.Store()
    store.load(f"<http://s> <http://p> {literal} .\n".encode(), format=ox.RdfFormat.N_TRIPLES)
    found = next(iter(store)).object
    assert isinstance(found, ox.Literal)
    return found


@given(st.floats(-LARGEST, LARGEST, exclude_min=True, exclude_max=True).map(lambda x: round(x, DIGITS)))
def test_a_measured_value_is_stored_as_written_and_read_back_exactly(value: float) -> None:
    literal = terms.decimal(value)
    assert str(stored(literal)) == literal
    found = value_of(stored(literal))
    assert isinstance(found, Decimal)
    assert float(found) == value
    assert "e" not in terms.plain(value).lower()


def test_plain_numbers() -> None:
    assert [terms.plain(x) for x in (0.0, -0.0, 1e-12, 3.0, 100.0, -2.50)] == [
        "0", "0", "0.000000000001", "3", "100", "-2.5",
    ]  # fmt: skip


@given(st.integers(0, 10**15))
def test_degrees_are_read_back_as_the_same_millionths(count: int) -> None:
    literal = terms.degree(count)
    assert str(stored(literal)) == literal
    found = value_of(stored(literal))
    assert isinstance(found, Decimal)
    assert terms.millionths(found) == count


@given(st.integers(1, 10**12), st.integers(1, 10**12))
def test_proportions_are_rounded_half_to_even(count: int, total: int) -> None:
    count = min(count, total)
    assert Fraction(terms.proportion_text(count, total)) == round(Fraction(count, total), 6)


def test_proportions_at_the_half() -> None:
    assert terms.proportion_text(1, 2_000_000) == "0"
    assert terms.proportion_text(3, 2_000_000) == "0.000002"


def test_finite() -> None:
    assert terms.finite(Fraction(7, 20)) == Decimal("0.35")
    with pytest.raises(InputError, match="1/3 has no finite decimal notation"):
        terms.finite(Fraction(1, 3))


@given(st.text(st.characters(exclude_categories=["Cs"])))
def test_texts_survive_a_store(value: str) -> None:
    assert stored(terms.text(value)).value == value
    assert stored(terms.english(value)).language == "en"
    assert "\n" not in terms.text(value)


def test_an_iri_that_could_break_out_is_refused() -> None:
    for hostile in ("http://x> <y", "http://x y", "no scheme", "http://x\n", 'http://x"'):
        with pytest.raises(ValueError, match="IRI"):
            terms.iri(hostile)


def test_values_of_terms() -> None:
    def typed(text: str, kind: str) -> ox.Literal:
        return ox.Literal(text, datatype=ox.NamedNode(XSD + kind))

    assert value_of(typed("1.50", "decimal")) == Decimal("1.5")
    assert value_of(typed("7", "integer")) == 7
    assert value_of(typed("true", "boolean")) is True
    assert value_of(typed("1", "boolean")) is True
    assert value_of(typed("0", "boolean")) is False
    assert value_of(typed("x", "decimal")) == "x"
    assert value_of(typed("x", "integer")) == "x"
    assert value_of(typed("0.1", "double")) == Decimal("0.1")
    assert value_of(ox.Literal("chat", language="fr")) == "chat"
    assert value_of(None) is None


@pytest.mark.parametrize("value", [True, None, "x", float("nan"), float("inf"), "1/0", Decimal("NaN"), [1]])
def test_what_is_no_number_is_refused(value: object) -> None:
    with pytest.raises(InputError, match="is not a number"):
        exact(value)  # type: ignore[arg-type]
