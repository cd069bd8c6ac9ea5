"""One rule from labels to IRIs: scripts, digits, marks, collisions."""

import unicodedata

import pyoxigraph as ox
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from ersatz.errors import InputError
from ersatz.knowledge import vocabulary as v
from ersatz.knowledge.names import (
    class_iri,
    class_name,
    distinct,
    local_name,
    model_iri,
    snake_iri,
    snake_name,
)
from ersatz.knowledge.turtle import turtle


@pytest.mark.parametrize(
    ("label", "snake", "camel"),
    [
        ("tray", "tray", "Tray"),
        ("coffee mug", "coffee_mug", "CoffeeMug"),
        ("Coffee-Mug/3", "coffee_mug_3", "CoffeeMug3"),
        ("  spaced\tout\n", "spaced_out", "SpacedOut"),
        ("7up can", "_7up_can", "_7upCan"),
        ("café crème", "café_crème", "CaféCrème"),
        ("cafe\u0301", "café", "Café"),
        ("茶碗", "茶碗", "茶碗"),
        ("कटोरी", "कटोरी", "कटोरी"),
        ("m² plate", "m2_plate", "M2Plate"),
        ("µ", "μ", "Μ"),
        ("ﬁsh", "fish", "Fish"),
        ("٣ cups", "_٣_cups", "_٣Cups"),
        ("size_2", "size_2", "Size2"),
        ("a__b", "a_b", "AB"),
    ],
)
def test_labels_become_names(label: str, snake: str, camel: str) -> None:
    assert snake_name(label) == unicodedata.normalize("NFC", snake)
    assert class_name(label) == unicodedata.normalize("NFC", camel)
    assert class_iri(label) == v.KB + class_name(label)
    assert snake_iri(label) == v.KB + snake_name(label)
    assert model_iri(label) == f"{v.KB}model_{class_name(label)}"


@pytest.mark.parametrize("label", ["", " ", "__", "-/.", "\u0301", "¯", "🥄", "\x00"])
def test_a_label_without_letter_or_digit_is_refused(label: str) -> None:
    for rule in (snake_name, class_name):
        with pytest.raises(InputError, match="neither letter nor digit"):
            rule(label)


@given(st.text(max_size=12))
@example("0\U000e0100")  # a glyph's variant, which no IRI can have
def test_every_name_is_stable_and_survives_turtle(label: str) -> None:
    try:
        names = [snake_name(label), class_name(label)]
    except InputError:
        return
    assert snake_name(names[0]) == names[0]
    assert class_name(names[1]) == names[1]
    for name in names:
        assert "__" not in name
        assert "-" not in name
        subject = ox.NamedNode(v.KB + name)
        triple = ox.Triple(subject, v.TYPE, v.OBJECT)
        written = "".join(turtle([triple])).encode()
        assert [quad.triple for quad in ox.parse(written, format=ox.RdfFormat.TURTLE)] == [triple]


def test_local_name() -> None:
    assert local_name("https://w3id.org/ersatz/kb#Tray") == "Tray"
    assert local_name("http://example.org/a/b") == "b"


def test_distinct_names_both_things() -> None:
    distinct([(snake_iri("a b"), "instance 'a b'"), (snake_iri("a b"), "instance 'a b'")])
    with pytest.raises(InputError, match=r"instance 'a b' and instance 'a-b' would both be called 'a_b'"):
        distinct([(snake_iri("a b"), "instance 'a b'"), (snake_iri("a-b"), "instance 'a-b'")])
