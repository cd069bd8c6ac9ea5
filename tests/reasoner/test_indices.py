"""Indices: made once for each settings, anew after a change, and never more than a few of them."""

from fractions import Fraction

import pytest

from ersatz.reasoner.indices import MOST, crisp_index, graded_index
from ersatz.reasoner.recognition import nearest_classes, possible_roles
from ersatz.reasoner.relevance import ReasonerSettings, build_index
from ersatz.reasoner.representative import Knowledge
from ersatz.reasoner.substitution import rank_substitutes
from tests.knowledge.tools import small

CRISP, GRADED = ReasonerSettings(), ReasonerSettings(graded=True)


def test_an_index_is_made_once_and_anew_after_a_change() -> None:
    kb = small()
    crisp, graded = crisp_index(kb, CRISP), graded_index(kb, GRADED)
    assert crisp_index(kb, ReasonerSettings()) is crisp
    assert graded_index(kb, ReasonerSettings(graded=True)) is graded
    kb.observe("tray", "tray 3", {"weight": 0.9})
    assert crisp_index(kb, CRISP) is not crisp
    assert graded_index(kb, GRADED) is not graded


def test_all_who_ask_with_the_same_settings_share_one(monkeypatch: pytest.MonkeyPatch) -> None:
    made = counted(monkeypatch)
    kb = small()
    every = ["weight_1", "rigidity_1", "support_1", "size_1"]
    nearest_classes(kb, every)
    possible_roles(kb, every)
    rank_substitutes(kb, "tray")
    rank_substitutes(kb, "plate")
    assert len(made) == 2  # one of what was measured of the object, one of all


def test_trying_many_thresholds_keeps_few(monkeypatch: pytest.MonkeyPatch) -> None:
    made = counted(monkeypatch)
    kb = small()
    tried = [ReasonerSettings(representative=Fraction(n, 100)) for n in range(1, MOST + 2)]
    first = [[one.fraction for one in rank_substitutes(kb, "tray", settings=one)] for one in tried]
    assert len(made) == MOST + 1
    rank_substitutes(kb, "tray", settings=tried[-1])
    assert len(made) == MOST + 1
    assert [one.fraction for one in rank_substitutes(kb, "tray", settings=tried[0])] == first[0]
    assert len(made) == MOST + 2


def counted(monkeypatch: pytest.MonkeyPatch) -> list[ReasonerSettings]:
    """Return the list of settings an index is made for from now on."""
    made: list[ReasonerSettings] = []

    def build(known: Knowledge, settings: ReasonerSettings) -> object:
        made.append(settings)
        return build_index(known, settings)

    monkeypatch.setattr("ersatz.reasoner.indices.build_index", build)
    return made
