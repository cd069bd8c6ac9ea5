"""Whether said p is confirmed in p: by hand, and in worlds of which it is known what is true."""

from collections.abc import Sequence
from fractions import Fraction

import numpy as np
import pytest
from numpy.typing import NDArray

from ersatz.evaluation.calibration import Calibration
from ersatz.evaluation.regrounding import accepted
from ersatz.grounding.conceptualization import DEGREE
from ersatz.measurements import Kind
from ersatz.reasoner.confidence import confidences
from ersatz.reasoner.population import Population
from ersatz.reasoner.relevance import ReasonerSettings
from ersatz.reasoner.representative import Knowledge, Memberships, QualityTerm
from ersatz.reasoner.sampling import Question

CLASSES, RANKS, SEEN, SURE = 5, 3, 5, 10**6
PROPERTIES = ("alpha", "beta", "delta", "gamma", "use")
TERMS = tuple(
    QualityTerm(f"{name}_{rank}", f"{name}_{rank}", name, "", kind, rank)
    for name in PROPERTIES
    for kind in [Kind.FUNCTIONAL if name == "use" else Kind.PHYSICAL]
    for rank in range(1, RANKS + 1)
)
FUNCTIONS = tuple(term.name for term in TERMS if term.kind is Kind.FUNCTIONAL)
NAMES = tuple(f"class {at}" for at in range(CLASSES))
SETTINGS = pytest.mark.parametrize(
    "settings", [ReasonerSettings(tolerance=Fraction(1, 5)), ReasonerSettings(graded=True)]
)


def known(classes: NDArray[np.float64], functions: NDArray[np.float64]) -> Knowledge:
    """Return the knowledge that so many objects, (n, properties, ranks), make."""
    row = {name: at for at, name in enumerate(NAMES)}
    units = np.full(CLASSES, SEEN)
    return Knowledge(TERMS, counted(NAMES, classes), counted(FUNCTIONS, functions), units, row, row)


def counted(names: tuple[str, ...], counts: NDArray[np.float64]) -> Memberships:
    whole = np.rint(counts * DEGREE).astype(np.int64)
    totals = np.repeat(whole.sum(axis=-1), RANKS, axis=-1)
    return Memberships(names, names, whole.reshape(len(names), -1), totals)


def said(
    seen: Knowledge, settings: ReasonerSettings, seed: int, objects: Population | None, further: float | None
) -> NDArray[np.float64]:
    """Return (tools, candidates): P(accepted) of all other classes for each."""
    nothing = np.zeros((CLASSES - 1, len(TERMS)))
    others = (np.delete(np.arange(CLASSES), tool) for tool in range(CLASSES))
    asked = (
        Question(seen, settings, tool, rows, nothing, further, objects) for tool, rows in enumerate(others)
    )
    return np.array([confidences(one, 200, seed).accepted for one in asked])


def judged(told: Sequence[NDArray[np.float64]], answers: Sequence[NDArray[np.bool_]]) -> Calibration:
    """Return what was said in each world beside what is true of it, (c, c)."""
    true = np.array([one[~np.eye(CLASSES, dtype=bool)].reshape(CLASSES, -1) for one in answers])
    return Calibration(np.array(told), true, true)


def independent(
    settings: ReasonerSettings, times: float = 1.0, further: float | None = None, worlds: int = 60
) -> Calibration:
    """Answer in worlds drawn from the prior itself, as if so many times as many objects were seen."""
    told, answers = [], []
    for seed in range(worlds):
        chance = np.random.default_rng(seed)
        degrees = chance.dirichlet(np.full(RANKS, 1 / RANKS), (CLASSES + RANKS, len(PROPERTIES)))
        counts = chance.multinomial(SEEN, degrees).astype(np.float64)
        all_of_it = degrees * SURE if further is None else counts + chance.multinomial(SEEN, degrees)
        told.append(said(known(*np.split(counts * times, [CLASSES])), settings, seed, None, further))
        answers.append(accepted(known(*np.split(all_of_it, [CLASSES])), settings))
    return judged(told, answers)


def together(
    settings: ReasonerSettings, wholes: bool, further: float | None = None, worlds: int = 60
) -> Calibration:
    """Answer in worlds where an object has the same rank of every property."""
    told, answers = [], []
    for seed in range(worlds):
        chance = np.random.default_rng(seed)
        degrees = chance.dirichlet(np.full(RANKS, 1 / RANKS), CLASSES)
        rank = np.concatenate([chance.choice(RANKS, SEEN, p=one) for one in degrees])
        held = np.repeat(np.eye(RANKS)[rank][:, None], len(PROPERTIES), axis=1)
        of_class = np.repeat(np.arange(CLASSES), SEEN)
        counts = held.reshape(CLASSES, SEEN, len(PROPERTIES), RANKS).sum(axis=1)
        functions = np.repeat(np.diag(np.bincount(rank, minlength=RANKS))[:, None], len(PROPERTIES), axis=1)
        objects = Population(of_class, held.reshape(len(held), -1))
        seen = known(counts, functions.astype(np.float64))
        told.append(said(seen, settings, seed, objects if wholes else None, further))
        to_come = degrees * SURE if further is None else chance.multinomial(SEEN, degrees)
        all_of_it = np.repeat(to_come[:, None], len(PROPERTIES), axis=1) + counts
        surely = np.repeat(np.eye(RANKS)[:, None] * SURE, len(PROPERTIES), axis=1)
        answers.append(accepted(known(all_of_it, surely), settings))
    return judged(told, answers)


def off(found: Calibration) -> int:
    return sum(one.off for one in found.bins())


@SETTINGS
@pytest.mark.parametrize("further", [None, 1.0])
def test_said_p_is_confirmed_in_p_where_the_prior_is_true(
    settings: ReasonerSettings, further: float | None
) -> None:
    found = independent(settings, further=further)
    assert off(found) <= 1
    assert found.error < 1.6 * found.error_by_chance
    for one in found.bins():
        assert abs(one.true - one.said) < 4 * (one.said * (1 - one.said) / one.count) ** 0.5


@SETTINGS
def test_a_posterior_that_is_too_narrow_is_seen(settings: ReasonerSettings) -> None:
    found = independent(settings, times=5)
    assert off(found) >= 5
    assert found.error > 3 * found.error_by_chance
    assert found.bins()[0].true > found.bins()[0].said
    assert found.bins()[-1].true < found.bins()[-1].said


def test_a_posterior_that_is_too_wide_is_seen() -> None:
    found = independent(ReasonerSettings(graded=True), times=0.2)
    assert off(found) >= 5
    assert found.error > 4 * found.error_by_chance
    assert all(one.true < one.said for one in found.bins() if one.said < 0.4)
    assert all(one.true > one.said for one in found.bins() if one.said > 0.6)


@SETTINGS
def test_properties_that_go_together_are_calibrated_only_in_whole_objects(settings: ReasonerSettings) -> None:
    wholes, singly = (together(settings, one) for one in (True, False))
    assert off(wholes) <= 1
    assert off(singly) >= 3
    assert wholes.error < 1.5 * wholes.error_by_chance
    assert singly.error > 2 * singly.error_by_chance
    assert wholes.brier < singly.brier


def test_whole_objects_to_come_are_calibrated() -> None:
    found = together(ReasonerSettings(graded=True), wholes=True, further=1.0)
    assert off(found) <= 1
    assert found.error < 1.5 * found.error_by_chance


def by_hand(said: Sequence[float], crisp: Sequence[int], true: Sequence[int]) -> Calibration:
    """Return the calibration of one split and tool."""
    return Calibration(np.array([[said]]), np.array([[crisp]], dtype=bool), np.array([[true]], dtype=bool))


def test_scores_by_hand() -> None:
    found = by_hand([0.25, 0.25, 0.25, 0.25, 1.0], [1, 0, 0, 0, 1], [0, 0, 0, 1, 1])
    assert found.brier == pytest.approx((3 * 0.0625 + 0.5625) / 5)
    assert found.brier_crisp == pytest.approx(2 / 5)
    assert found.error == pytest.approx(0)
    assert [(one.said, one.true, one.count) for one in found.bins()] == [(0.25, 0.25, 4), (1.0, 1.0, 1)]
    assert by_hand([0.9], [1], [0]).error == pytest.approx(0.9)
    assert found.to_json()["answers"] == 5


def test_a_single_answer_has_wilsons_interval() -> None:
    (one,) = by_hand([0.9], [1], [1]).bins()
    assert (one.low, one.high) == pytest.approx((1 / (1 + 1.96**2), 1.0))
    assert not one.off


def forecasts(again: bool, seed: int, splits: int = 20) -> Calibration:
    """Forecast perfectly: what is true is drawn in every split, or once and for all."""
    chance = np.random.default_rng(seed)
    said = np.repeat(chance.random((1, 12, 11)), splits, axis=0)
    true = chance.random(said.shape if again else (1, 12, 11)) < said
    return Calibration(said, said > 0.5, np.broadcast_to(true, said.shape))


@pytest.mark.parametrize("again", [True, False])
def test_a_perfect_forecaster_is_off_by_chance_only(again: bool) -> None:
    """As far as foretold, and in one of twenty bins or so, whether or not splits repeat what is true."""
    many = [forecasts(again, seed) for seed in range(60)]
    foretold = np.mean([one.error_by_chance for one in many])
    assert np.mean([one.error for one in many]) == pytest.approx(foretold, rel=0.15)
    assert 0.02 < np.mean([off(one) / len(one.bins()) for one in many]) < 0.11


def test_splits_that_repeat_a_truth_tell_nothing_new() -> None:
    few, many = (forecasts(again=False, seed=0, splits=number) for number in (2, 50))
    for one, other in zip(few.bins(), many.bins(), strict=True):
        assert other.high - other.low > 0.7 * (one.high - one.low)
