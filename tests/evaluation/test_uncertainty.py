"""Intervals, tests, alpha and ceilings against values computed by hand or published."""

import pytest

from ersatz.evaluation.scenarios import Scenario
from ersatz.evaluation.uncertainty import (
    blind_ceiling,
    estimate,
    experts_alpha,
    holm,
    krippendorff_alpha,
    leave_one_out,
    paired_test,
)


def test_alpha_of_krippendorffs_example() -> None:
    """Computing Krippendorff's Alpha-Reliability (2011), example C: nominal alpha is 0.743."""
    observers = [
        "123321412...",
        "1233224125.3",
        ".3332342251.",
        "12332441251.",
    ]
    units = [[None if o[at] == "." else o[at] for o in observers] for at in range(12)]
    assert krippendorff_alpha(units) == pytest.approx(0.743, abs=5e-4)


def test_alpha_by_hand_and_at_the_edges() -> None:
    assert krippendorff_alpha([["a", "a"], ["b", "b"]]) == 1
    assert krippendorff_alpha([["a", "b"], ["a", "b"]]) == pytest.approx(1 - 3 * 4 / 8)
    assert krippendorff_alpha([["a", "a"], ["a", "a"]]) is None
    assert krippendorff_alpha([["a"], [None, "b"]]) is None
    assert krippendorff_alpha([]) is None
    assert experts_alpha([]) == {"choices": None, "objects": None}


def test_the_interval_holds_the_mean_and_draws_tools() -> None:
    values = [1.0, 1.0, 1.0, 1.0, 0.0, None]
    e = estimate(values, ["a", "a", "a", "a", "b", "c"])
    assert e.mean == pytest.approx(0.8)
    assert (e.low, e.high, e.count) == (0.0, 1.0, 5)
    assert estimate(values, ["a", "a", "a", "a", "b", "c"]) == e
    one = estimate([0.25, 0.75], ["a", "a"])
    assert (one.mean, one.low, one.high) == (0.5, 0.5, 0.5)
    assert estimate([None], ["a"]).mean is None


def test_paired_test_by_hand() -> None:
    """Three tools, all better by one: 2 of 8 sign patterns are as extreme."""
    p = paired_test([1.0, 1.0, 1.0], [0.0, 0.0, 0.0], ["a", "b", "c"])
    assert p == pytest.approx(0.25, abs=0.02)
    assert paired_test([1.0, 0.0], [1.0, 0.0], ["a", "b"]) == 1
    assert paired_test([1.0, None], [None, 0.0], ["a", "b"]) == 1


def test_holm_by_hand() -> None:
    assert holm({"x": 0.01, "y": 0.04, "z": 0.03}) == pytest.approx({"x": 0.03, "y": 0.06, "z": 0.06})
    assert holm({"x": 0.9, "y": 0.8}) == {"x": 1.0, "y": 1.0}
    assert holm({}) == {}


def test_leaving_one_expert_out_by_hand() -> None:
    scenario = Scenario("q", "tray", ("a", "b"), ballots={"e1": "a", "e2": "a", "e3": "b"})
    ceiling = leave_one_out([scenario])
    # e1 and e2 each face one a and one b; e3 faces a twice
    assert ceiling["top1"].mean == pytest.approx((0.5 + 0.5 + 0) / 3)
    assert ceiling["mass"].mean == pytest.approx((0.5 + 0.5 + 0) / 3)
    lonely = Scenario("q", "tray", ("a",), ballots={"e1": "a"})
    assert leave_one_out([lonely])["top1"].mean is None


def test_the_blind_ceiling_is_below_one_where_tasks_disagree() -> None:
    scenarios = [
        Scenario("1", "tray", ("a", "b"), "carry", frozenset({"a"})),
        Scenario("2", "tray", ("a", "b"), "cover", frozenset({"b"})),
        Scenario("3", "tray", ("c",), "float", frozenset()),
    ]
    assert blind_ceiling(scenarios).mean == pytest.approx((0.5 + 0.5 + 1) / 3)
