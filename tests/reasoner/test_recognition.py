"""What an unnamed object is like, and what it could stand in for."""

from fractions import Fraction
from pathlib import Path

import pytest

from ersatz.errors import InputError, UnknownNameError
from ersatz.knowledge.base import KnowledgeBase
from ersatz.reasoner.recognition import nearest_classes, possible_roles


def test_an_object_like_a_plate(small_kb: Path) -> None:
    """Plates hold weight_1, rigidity_2, support_1; trays support_2, and mostly weight_2."""
    kb = KnowledgeBase.open(small_kb)
    likes = nearest_classes(kb, ["weight_1", "rigidity_2", "support_1"])
    assert [(one.name, one.similarity) for one in likes] == [
        ("plate", Fraction(1)),
        ("sponge", Fraction(1, 2)),
        ("tray", Fraction(1, 5)),
    ]


def test_what_was_not_measured_does_not_count(small_kb: Path) -> None:
    kb = KnowledgeBase.open(small_kb)
    likes = nearest_classes(kb, ["rigidity_2"])
    assert [(one.name, float(one.similarity)) for one in likes] == [("plate", 1), ("tray", 1), ("sponge", 0)]


def test_roles_need_a_measured_function(small_kb: Path) -> None:
    kb = KnowledgeBase.open(small_kb)
    assert possible_roles(kb, ["weight_1", "rigidity_2"]) == ()
    roles = possible_roles(kb, ["weight_2", "rigidity_2", "support_1"])
    assert roles[0].tool == "tray"
    assert roles[0].similarity == 1
    assert roles[0].accepted


def test_errors(small_kb: Path) -> None:
    kb = KnowledgeBase.open(small_kb)
    with pytest.raises(InputError, match="measure at least one"):
        nearest_classes(kb, [])
    with pytest.raises(UnknownNameError, match="weight_1"):
        possible_roles(kb, ["weigth_1"])
