"""Every metric against values computed by hand, and at the edges."""

from collections.abc import Sequence
from itertools import permutations
from math import isnan, log2, sqrt

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ersatz.evaluation.agreement import METRICS, Answer, agree, kendall_tau
from ersatz.evaluation.scenarios import NONE, Scenario

VOTED = Scenario("q", "tray", ("a", "b", "c"), votes={"a": 3, "b": 1})
STATED = Scenario("q", "tray", ("a", "b", "c", "d"), accepted=frozenset({"a", "b"}))


def test_by_hand_with_a_tie() -> None:
    value = agree(VOTED, Answer((0.5, 0.5, 0.1), frozenset({"b", "c"}))).value
    ideal = 0.75 + 0.25 / log2(3)
    gained = 0.5 * (1 + 1 / log2(3)) / ideal
    random = (1 + 1 / log2(3) + 0.5) / 3 / ideal
    assert value == pytest.approx(
        {
            "top1": 0.5,
            "mass": 0.5,
            "rr": (1 + 1 / 2) / 2,
            "ndcg": (gained - random) / (1 - random),
            "tau": 2 / sqrt(2 * 3),
            "same_top": 1.0,
            "precision": 1 / 2,
            "recall": 1 / 2,
            "f1": 1 / 2,
            "same_mode": 0.0,
            "same_any": 1.0,
        }
    )


def test_by_hand_without_a_tie() -> None:
    agreement = agree(STATED, Answer((0.1, 0.4, 0.9, 0.2), frozenset({"c"})))
    dcg = [1, 1 / log2(3), 1 / 2, 1 / log2(5)]
    ideal, gained, random = dcg[0] + dcg[1], dcg[1] + dcg[3], sum(dcg) / 2
    assert agreement.value == pytest.approx(
        {
            "top1": 0.0,
            "mass": None,
            "rr": 1 / 2,
            "ndcg": (gained - random) / (ideal - random),
            "tau": (1 - 3) / sqrt(6 * 4),
            "same_top": 0.0,
            "precision": 0.0,
            "recall": 0.0,
            "f1": 0.0,
            "same_mode": 0.0,
            "same_any": 0.0,
        }
    )
    assert agreement.chance["f1"] == pytest.approx(2 * 0.5 / 3)
    assert agreement.chance["same_any"] == pytest.approx(0.5)
    assert agreement.chance["top1"] == pytest.approx(0.5)
    assert agreement.chance["rr"] == pytest.approx((1 + 1 + 1 + 1 / 2 + 1 / 2 + 1 / 3) / 6)


def test_all_metrics_are_there() -> None:
    agreement = agree(VOTED, Answer((1.0, 2.0, 3.0)))
    assert list(agreement.value) == list(agreement.chance) == list(METRICS)
    assert agreement.value["f1"] is None


def test_an_ideal_answer_is_ideal() -> None:
    value = agree(VOTED, Answer((3.0, 2.0, 1.0), frozenset({"a", "b"}))).value
    assert {m: v for m, v in value.items() if m != "mass"} == pytest.approx(
        dict.fromkeys(set(METRICS) - {"mass"}, 1)
    )
    assert value["mass"] == 0.75


def test_an_undetermined_answer_scores_nothing() -> None:
    value = agree(VOTED, Answer(None, frozenset())).value
    assert value == {"top1": 0, "mass": 0, "rr": 0, "ndcg": 0, "precision": 0, "recall": 0, "f1": 0, "tau": 0,
                     "same_top": 0, "same_mode": 0, "same_any": 0}  # fmt: skip


def test_all_none() -> None:
    """Every expert would take nothing: right is who accepts nothing."""
    nothing = Scenario("q", "tray", ("a", "b"), votes={NONE: 4})
    right = agree(nothing, Answer((0.2, 0.1), frozenset())).value
    assert (right["top1"], right["f1"], right["same_mode"], right["same_any"]) == (1, 1, 1, 1)
    assert right["rr"] is right["ndcg"] is right["tau"] is None
    assert right["mass"] == 0
    wrong = agree(nothing, Answer((0.2, 0.1), frozenset({"a"}))).value
    assert (wrong["top1"], wrong["f1"], wrong["precision"], wrong["recall"]) == (0, 0, 0, 0)
    assert agree(nothing, Answer(None, frozenset())).value["top1"] == 0
    assert agree(nothing, Answer((0.2, 0.1))).value["top1"] == 0


def test_one_candidate_and_one_expert() -> None:
    one = Scenario("q", "tray", ("a",), ballots={"e": "a"})
    value = agree(one, Answer((0.0,), frozenset({"a"}))).value
    assert (value["top1"], value["mass"], value["rr"], value["f1"]) == (1, 1, 1, 1)
    assert value["ndcg"] is value["tau"] is None


def test_tied_modes_and_none_among_them() -> None:
    tied = Scenario("q", "tray", ("a", "b"), votes={"a": 1, NONE: 1})
    assert agree(tied, Answer((0.9, 0.1), frozenset())).value["top1"] == 1
    assert agree(tied, Answer((0.9, 0.1), frozenset({"a"}))).value["top1"] == 1
    assert agree(tied, Answer((0.1, 0.9), frozenset({"b"}))).value["top1"] == 0


def test_refuses_what_cannot_be_compared() -> None:
    with pytest.raises(ValueError, match="neither votes"):
        agree(Scenario("q", "tray", ("a",)), Answer((1.0,)))
    with pytest.raises(ValueError, match="2 scores for 3 objects"):
        agree(VOTED, Answer((1.0, 2.0)))


@pytest.mark.parametrize("metric", ["top1", "mass", "rr", "ndcg", "same_top"])
@given(
    votes=st.lists(st.integers(0, 3), min_size=2, max_size=5).filter(any),
    levels=st.lists(st.integers(0, 2), min_size=5, max_size=5),
)
@settings(max_examples=25, deadline=None)
def test_a_tie_is_the_mean_over_its_orders(metric: str, votes: list[int], levels: list[int]) -> None:
    names = tuple("abcde"[: len(votes)])
    scenario = Scenario("q", "tray", names, votes=dict(zip(names, votes, strict=True)))
    scores = levels[: len(votes)]
    orders = [
        order
        for order in permutations(range(len(votes)))
        if [scores[at] for at in order] == sorted(scores, reverse=True)
    ]
    values = []
    for order in orders:
        untied = [0.0] * len(votes)
        for rank, at in enumerate(order):
            untied[at] = -float(rank)
        values.append(agree(scenario, Answer(tuple(untied))).value[metric])
    tied = agree(scenario, Answer(tuple(map(float, scores)))).value[metric]
    known = [value for value in values if value is not None]
    assert tied is None if not known else tied == pytest.approx(sum(known) / len(known))


@given(st.lists(st.tuples(st.integers(0, 3), st.integers(0, 3)), min_size=2, max_size=8))
@settings(max_examples=50, deadline=None)
def test_tau_is_scipys(pairs: Sequence[tuple[int, int]]) -> None:
    from scipy.stats import kendalltau

    a, b = zip(*pairs, strict=True)
    theirs = float(kendalltau(a, b).statistic)
    assert kendall_tau(a, b) == pytest.approx(0 if isnan(theirs) else theirs)
