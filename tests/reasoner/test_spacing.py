"""Ordinal similarity with qualities spaced by their centroids, or by the ratios of these."""

from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ersatz.errors import InputError
from ersatz.grounding.subcategorization import SubcategorizationSettings
from ersatz.knowledge.base import KnowledgeBase
from ersatz.measurements import Block, Origin
from ersatz.pipeline import Settings, build
from ersatz.reasoner.graded import SPAN
from ersatz.reasoner.relevance import ReasonerSettings, Spacing, layout_of
from ersatz.reasoner.representative import load_knowledge
from ersatz.reasoner.substitution import rank_substitutes
from tests.making import HERE, prop

RANKED = ReasonerSettings(graded=True)
SPACED = ReasonerSettings(graded=True, spacing=Spacing.CENTROID)
RATIO = ReasonerSettings(graded=True, spacing=Spacing.RATIO)
VALUES = {"tray": 0.0, "plate": 1.0, "anvil": 100.0}
DOUBLED = {"plate": 1.0, "tray": 2.0, "anvil": 8.0}
"""The tray weighs twice as much as the plate, the anvil four times as much as the tray."""


def known(
    vectors: bool = False,
    values: Mapping[str, float] = VALUES,
    unit: str = "1",
    second: float = 0.0,
    target: Path | None = None,
) -> Any:
    """Return a knowledge base of three things; as usual, two nearly as heavy, the third of another order."""
    weight = replace(prop("weight", "physical", *(("x", "y") if vectors else ())), unit=unit)
    use = prop("use", "functional")
    rows = [[value, second] if vectors else [value] for value in values.values()]
    names = list(values)
    ones = [f"{name} 1" for name in names]
    made = [
        Block(weight, names, ones, [""] * 3, np.array(rows), Origin.MACHINE, HERE),
        Block(use, names, ones, [""] * 3, np.ones((3, 1)), Origin.MACHINE, HERE),
    ]
    return build(blocks=made, settings=Settings(SubcategorizationSettings(3, restarts=2)), out=target)


def likeness(kb: Any, settings: ReasonerSettings) -> dict[str, Fraction]:
    return {one.name: one.fraction for one in rank_substitutes(kb, "tray", settings=settings)}


@pytest.mark.parametrize("vectors", [False, True])
@pytest.mark.filterwarnings("ignore")
def test_near_centroids_are_near_qualities(vectors: bool) -> None:
    kb = known(vectors)
    assert likeness(kb, RANKED) == {"plate": Fraction(1, 2), "anvil": Fraction(0)}
    assert likeness(kb, SPACED) == {"plate": Fraction(99, 100), "anvil": Fraction(0)}
    layout = layout_of(kb.view(load_knowledge), SPACED)
    assert layout.gaps is not None
    for start, length in zip(layout.starts.tolist(), layout.lengths.tolist(), strict=True):
        assert layout.gaps[start : start + length].sum() == (SPAN if length > 1 else 0)


@pytest.mark.parametrize("vectors", [False, True])
@pytest.mark.filterwarnings("ignore")
def test_amounts_are_as_far_apart_as_their_ratios(vectors: bool) -> None:
    """Of three doublings from plate to anvil the tray is one from the plate and two from the anvil."""
    kb = known(vectors, DOUBLED, "kg", second=1.0)
    assert likeness(kb, RATIO) == {"plate": Fraction(667, 1000), "anvil": Fraction(333, 1000)}
    assert likeness(kb, SPACED) == {"plate": Fraction(857, 1000), "anvil": Fraction(143, 1000)}
    heavier = known(vectors, {name: 5 * one for name, one in DOUBLED.items()}, "kg", second=1.0)
    assert likeness(heavier, RATIO) == likeness(kb, RATIO)


@pytest.mark.parametrize(
    ("values", "unit"),
    [
        pytest.param(DOUBLED, "1", id="a dimensionless number"),
        pytest.param(VALUES, "kg", id="an amount of nothing"),
    ],
)
@pytest.mark.filterwarnings("ignore")
def test_what_has_no_ratios_is_spaced_by_centroids(values: Mapping[str, float], unit: str) -> None:
    kb = known(values=values, unit=unit)
    assert likeness(kb, RATIO) == likeness(kb, SPACED)


@pytest.mark.filterwarnings("ignore")
def test_units_are_kept_on_the_shelf(tmp_path: Path) -> None:
    kb = known(values=DOUBLED, unit="kg", target=tmp_path / "kb")
    before = likeness(kb, RATIO)
    kb.close()
    again = KnowledgeBase.open(tmp_path / "kb")
    assert {one.property: one.unit for one in again.view(load_knowledge).qualities} == {
        "use": "1",
        "weight": "kg",
    }
    assert likeness(again, RATIO) == before


@pytest.mark.filterwarnings("ignore")
def test_the_spacing_is_remembered_with_the_answer() -> None:
    kb = known()
    rank_substitutes(kb, "tray", settings=SPACED, remember=True)
    assert rank_substitutes(kb, "tray", settings=SPACED).reused
    assert not rank_substitutes(kb, "tray", settings=RANKED).reused
    assert '"spacing": "centroid"' in str(kb.substitution_model("tray"))


def test_spacing_of_what_has_no_order_is_refused() -> None:
    with pytest.raises(InputError, match="ordinal similarity only"):
        ReasonerSettings(spacing=Spacing.CENTROID)
    wrong: Any = "wide"
    with pytest.raises(InputError, match="'wide' is not one of rank, centroid, ratio"):
        ReasonerSettings(graded=True, spacing=wrong)
