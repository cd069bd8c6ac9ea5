"""Ordinal similarity with qualities spaced by their centroids."""

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from ersatz.errors import InputError
from ersatz.grounding.subcategorization import SubcategorizationSettings
from ersatz.measurements import Block, Origin
from ersatz.pipeline import Settings, build
from ersatz.reasoner.graded import SPAN
from ersatz.reasoner.relevance import ReasonerSettings, Spacing, layout_of
from ersatz.reasoner.representative import load_knowledge
from ersatz.reasoner.substitution import rank_substitutes
from tests.making import HERE, prop

RANKED = ReasonerSettings(graded=True)
SPACED = ReasonerSettings(graded=True, spacing=Spacing.CENTROID)
VALUES = {"tray": 0.0, "plate": 1.0, "anvil": 100.0}


def known(vectors: bool = False) -> Any:
    """Return a knowledge base of three things, two nearly as heavy, the third of another order."""
    weight = prop("weight", "physical", *(("x", "y") if vectors else ()))
    use = prop("use", "functional")
    rows = [[value, 0.0] if vectors else [value] for value in VALUES.values()]
    names = list(VALUES)
    ones = [f"{name} 1" for name in names]
    made = [
        Block(weight, names, ones, [""] * 3, np.array(rows), Origin.MACHINE, HERE),
        Block(use, names, ones, [""] * 3, np.ones((3, 1)), Origin.MACHINE, HERE),
    ]
    return build(blocks=made, settings=Settings(SubcategorizationSettings(3, restarts=2)))


@pytest.mark.parametrize("vectors", [False, True])
@pytest.mark.filterwarnings("ignore")
def test_near_centroids_are_near_qualities(vectors: bool) -> None:
    kb = known(vectors)
    ranked = {one.name: one.fraction for one in rank_substitutes(kb, "tray", settings=RANKED)}
    spaced = {one.name: one.fraction for one in rank_substitutes(kb, "tray", settings=SPACED)}
    assert ranked == {"plate": Fraction(1, 2), "anvil": Fraction(0)}
    assert spaced == {"plate": Fraction(99, 100), "anvil": Fraction(0)}
    layout = layout_of(kb.view(load_knowledge), SPACED)
    assert layout.gaps is not None
    for start, length in zip(layout.starts.tolist(), layout.lengths.tolist(), strict=True):
        assert layout.gaps[start : start + length].sum() == (SPAN if length > 1 else 0)


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
    with pytest.raises(InputError, match="'wide' is not one of rank, centroid"):
        ReasonerSettings(graded=True, spacing=wrong)
