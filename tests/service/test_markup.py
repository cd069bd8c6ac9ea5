"""Markup: whatever data holds, it reaches the browser as text."""

from decimal import Decimal

import pytest

from ersatz.service.pages.individuals import _read
from ersatz.service.pages.markup import (
    Markup,
    chip,
    joined,
    link,
    shown,
    table_markup,
    tag,
    unit_words,
    words_of,
)
from tests.knowledge.tools import small

EVIL = "<img src=x onerror='alert(1)'>\"&"
HARMLESS = "&lt;img src=x onerror=&#x27;alert(1)&#x27;&gt;&quot;&amp;"


def test_text_and_attributes_are_escaped() -> None:
    assert tag("b", EVIL, title=EVIL) == f'<b title="{HARMLESS}">{HARMLESS}</b>'
    assert joined((EVIL, tag("i"), 3)) == f"{HARMLESS}<i></i>3"
    assert chip(EVIL, title=EVIL).count("<") == 2
    assert table_markup([EVIL], [[EVIL], [(EVIL, "/x")]]).count("<img") == 0


def test_an_individual_is_shown_with_the_degrees_it_holds() -> None:
    degrees = _read(small(fuzzifier=2.0), "plate 2").held
    quality, degree, others = degrees[-1]
    assert quality.endswith("weight_2")
    assert 0.5 <= degree < 1
    assert others == f"weight 1 to {1 - degree:.2f}, weight 2 to {degree:.2f}"
    assert {(degree, others) for _, degree, others in _read(small(), "plate 2").held} == {(Decimal(1), "")}


def test_markup_is_not_escaped_twice_and_false_leaves_an_attribute_out() -> None:
    assert tag("p", tag("b", "1 < 2")) == "<p><b>1 &lt; 2</b></p>"
    assert tag("p", class_="", id=None, hidden=False, data_do="x") == '<p data-do="x"></p>'
    assert isinstance(joined(()), Markup)


@pytest.mark.parametrize("address", ["javascript:alert(1)", "data:text/html,x", "//host", "x", " /x", ""])
def test_links_lead_to_pages_only(address: str) -> None:
    with pytest.raises(ValueError, match="no address of a page"):
        link("x", address)


def test_names_are_written_for_people() -> None:
    assert [words_of(one) for one in ("size_2", "shape_1", "shape_1_3")] == [
        "size 2",
        "shape 1",
        "shape 1 · 3",
    ]
    assert [unit_words(one) for one in ("kg", "m2", "1")] == ["kg", "m²", "dimensionless"]
    assert shown("https://w3id.org/ersatz/kb#Tray") == "Tray"
    assert shown("http://www.w3.org/2000/01/rdf-schema#label") == "rdfs:label"
    assert shown(None) == ""
