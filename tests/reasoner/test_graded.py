"""Graded relevance and similarity over arrays: crisp limits, bounds, symmetry, monotonicity, no nan."""

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from ersatz.reasoner.graded import (
    ONE,
    SPAN,
    Layout,
    cumulative,
    importance,
    ordinal,
    overlap,
    similarities,
    weigh,
)
from ersatz.reasoner.representative import pack
from ersatz.reasoner.similarity import CRISP, GRADED, RATIOS, Similarity, above, compare

LENGTHS = (3, 1, 4, 2, 3)
"""Qualities of each property; the last two are functional."""
PHYSICAL = np.repeat([True, True, True, False, False], LENGTHS)
COLUMNS = np.flatnonzero(~PHYSICAL)
LAYOUT = Layout(PHYSICAL, ~PHYSICAL, np.cumsum([0, *LENGTHS[:-1]]), COLUMNS)
Q, F = len(PHYSICAL), len(COLUMNS)

seeds = st.integers(0, 2**32 - 1)
few = settings(max_examples=50, deadline=None)


def bits(seed: int, *shape: int) -> NDArray[np.bool_]:
    return np.random.default_rng(seed).random((*shape, Q)) < 0.4


def degrees(seed: int, *shape: int, whole: bool = False) -> NDArray[Any]:
    """Draw shares of objects, some properties not observed, some degrees 0 and 1."""
    chance = np.random.default_rng(seed)
    counts = chance.integers(0, 4, (*shape, Q)) * (chance.random((*shape, Q)) < 0.6)
    observed = np.repeat(chance.random((*shape, len(LENGTHS))) < 0.8, LENGTHS, axis=-1)
    counts = counts * observed
    totals = np.repeat(np.add.reduceat(counts, LAYOUT.starts, axis=-1), LENGTHS, axis=-1)
    if whole:
        return np.asarray((2 * counts * ONE + np.maximum(totals, 1)) // (2 * np.maximum(totals, 1)), np.int32)
    return np.asarray(counts / np.maximum(totals, 1))


def whole(held: NDArray[np.bool_]) -> NDArray[np.int32]:
    return held.astype(np.int32) * np.int32(ONE)


@pytest.mark.parametrize("form", CRISP)
@few
@given(seeds)
def test_on_sets_the_graded_ratio_is_the_crisp_one(form: Similarity, seed: int) -> None:
    relevant, held = bits(seed) & PHYSICAL, bits(seed + 1, 5) & PHYSICAL
    expected = compare(pack(relevant), pack(held), form)
    candidates = whole(held)
    found = overlap(whole(relevant), candidates, candidates.sum(axis=-1, dtype=np.int64), *RATIOS[form])
    for n, d, m, e in zip(*found, *expected, strict=True):
        assert Fraction(int(n), int(d)) == Fraction(int(m), int(e))


@few
@given(seeds, st.sampled_from([Fraction(n, 20) for n in (0, 5, 7, 10)] + [Fraction(1, 3)]))
def test_on_sets_what_has_weight_is_what_is_crisply_relevant(seed: int, tolerance: Fraction) -> None:
    """{q: w_q > 0} is the union of O_rp & f_rp over the functions with J > phi."""
    mine, models = bits(seed), bits(seed + 1, F)
    body, goes = mine & PHYSICAL, models & PHYSICAL
    functions = mine[COLUMNS] & above(*compare(pack(body), pack(goes)), tolerance)
    relevant = (goes[functions] & body).any(axis=0)
    for tool, known in ((whole(mine), whole(models)), (mine.astype(float), models.astype(float))):
        found = weigh(tool, known, LAYOUT, tolerance)
        assert ((found.functions > 0) == (functions & (goes & body).any(axis=1))).all()
        assert ((found.qualities > 0) == relevant).all()
        assert bool(found.determined) == relevant.any()


@few
@given(seeds)
def test_equally_similar_functions_weigh_as_sets(seed: int) -> None:
    """With one representative function the weights are 0 and 1: O_rp & f_rp itself."""
    mine, models = bits(seed) & PHYSICAL, bits(seed + 1, F)
    mine[COLUMNS[2]] = True
    found = weigh(whole(mine), whole(models), LAYOUT)
    assert (found.qualities == whole(mine & models[2] & PHYSICAL)).all()


@pytest.mark.parametrize("form", GRADED)
@few
@given(seeds)
def test_bounds_and_no_nan_at_any_corner(form: Similarity, seed: int) -> None:
    tool, models, candidates = degrees(seed, 3), degrees(seed + 1, 3, F), degrees(seed + 2, 3, 4)
    corner = np.random.default_rng(seed).integers(5)
    for at, array in enumerate((tool, models, candidates)):
        if corner in (at, 4):
            array[:] = 0
    with np.errstate(all="raise"):
        weights = weigh(tool, models, LAYOUT, fallback=corner == 3)
        found = similarities(weights.qualities, tool, candidates, LAYOUT, form)
    assert found.shape == (3, 4)
    assert ((found >= 0) & (found <= 1)).all()
    assert ((weights.qualities >= 0) & (weights.qualities <= tool + 1e-12)).all()


@pytest.mark.parametrize("form", GRADED)
@few
@given(seeds)
def test_draws_are_the_answers_one_by_one(form: Similarity, seed: int) -> None:
    tool, models, candidates = degrees(seed, 3), degrees(seed + 1, 3, F), degrees(seed + 2, 3, 4)
    weights = weigh(tool, models, LAYOUT).qualities
    together = similarities(weights, tool, candidates, LAYOUT, form)
    for at in range(3):
        alone = weigh(tool[at], models[at], LAYOUT).qualities
        assert np.allclose(
            together[at], similarities(alone, tool[at], candidates[at], LAYOUT, form), rtol=1e-12
        )


@few
@given(seeds)
def test_whole_numbers_and_floats_agree(seed: int) -> None:
    tool, models = degrees(seed, whole=True), degrees(seed + 1, F, whole=True)
    candidates = degrees(seed + 2, 4, whole=True) * PHYSICAL
    exact = weigh(tool, models, LAYOUT).qualities
    near = weigh(tool / ONE, models / ONE, LAYOUT).qualities
    assert np.allclose(exact / ONE, near, atol=3 / ONE * np.where(near.max(initial=0) > 0, 30, 1))
    sizes = candidates.sum(axis=-1, dtype=np.int64)
    numerators, denominators = overlap(exact, candidates, sizes, Fraction(1), Fraction(1, 2))
    floats = similarities(exact / ONE, tool / ONE, candidates / ONE, LAYOUT, Similarity.TVERSKY)
    assert np.allclose(numerators / denominators, floats, atol=1e-9)


@few
@given(seeds)
def test_ruzicka_and_ordinal_are_symmetric(seed: int) -> None:
    a, b = degrees(seed) * PHYSICAL, degrees(seed + 1) * PHYSICAL
    one = Fraction(1)
    there, back = (overlap(x, y[None], y.sum()[None], one, one) for x, y in ((a, b), (b, a)))
    assert np.isclose(there[0] / there[1], back[0] / back[1])
    shares = cumulative(a, LAYOUT), cumulative(b, LAYOUT)
    weight = importance(degrees(seed + 2), LAYOUT)
    there, back = (ordinal(weight, x, y[None], LAYOUT) for x, y in (shares, shares[::-1]))
    assert np.isclose(there[0] / there[1], back[0] / back[1])


@pytest.mark.parametrize("form", GRADED)
@few
@given(seeds)
def test_a_tool_is_most_similar_to_itself(form: Similarity, seed: int) -> None:
    """Under coverage and ordinal it is so wholly; Ruzicka of w with m is 1 only where w is m."""
    tool, models = degrees(seed), degrees(seed + 1, F)
    weights = weigh(tool, models, LAYOUT)
    found = similarities(weights.qualities, tool, tool[None], LAYOUT, form)
    if weights.determined and form in (Similarity.COVERAGE, Similarity.ORDINAL):
        assert np.isclose(found[0], 1)
    same = similarities(tool * PHYSICAL, tool, tool[None], LAYOUT, form)
    assert np.isclose(same[0], 1) or not (tool * PHYSICAL).any()


@pytest.mark.parametrize("form", [f for f in GRADED if f is not Similarity.ORDINAL])
@few
@given(seeds, st.integers(0, Q - 1))
def test_more_of_what_is_wanted_is_more_similar(form: Similarity, seed: int, at: int) -> None:
    """The ratio rises with a degree up to what is wanted, and does not rise beyond."""
    wanted, held = degrees(seed) * PHYSICAL, degrees(seed + 1) * PHYSICAL
    path = np.repeat(held[None], 11, axis=0)
    path[:, at] = np.linspace(0, 1, 11)
    path = path * PHYSICAL
    found = similarities(wanted, wanted, path, LAYOUT, form)
    for less, more, reached in zip(found, found[1:], path[1:, at], strict=False):
        assert more >= less - 1e-12 if reached <= wanted[at] else True
    for less, more, start in zip(found, found[1:], path[:-1, at], strict=False):
        assert more <= less + 1e-12 if start >= wanted[at] else True


@pytest.mark.parametrize("spaced", [False, True])
def test_many_different_numbers_of_qualities_do_not_overflow(spaced: bool) -> None:
    """The common denominator of 2 to 60 qualities a property has 25 digits, too many for 64 bits."""
    lengths = np.arange(2, 61)
    starts, q = np.cumsum([0, *lengths[:-1]]), int(lengths.sum())
    gaps = np.zeros(q, np.int64)
    gaps[starts] = SPAN  # the first two qualities of each are all the way apart
    layout = Layout(
        np.ones(q, bool), np.zeros(q, bool), starts, np.zeros(0, np.int64), gaps if spaced else None
    )
    tool, other = np.zeros((2, q), np.int32)
    tool[starts], other[starts + 1] = ONE, ONE
    shares = cumulative(tool, layout, ONE), cumulative(other[None], layout, ONE)
    numerators, denominators = ordinal(np.full(len(lengths), ONE), *shares, layout)
    near = sum(1 - (Fraction(1) if spaced else Fraction(1, int(length) - 1)) for length in lengths)
    assert Fraction(int(numerators[0]), int(denominators[0])) == near / len(lengths)
    drawn = similarities(np.ones(q), tool / ONE, other[None] / ONE, layout, Similarity.ORDINAL)
    assert drawn.dtype == np.float64
    weights = Fraction(1, int(lengths.sum())) * sum(
        int(length) * (1 - (Fraction(1) if spaced else Fraction(1, int(length) - 1))) for length in lengths
    )
    assert np.isclose(drawn[0], float(weights))


def test_whole_numbers_are_rounded_half_up() -> None:
    layout = Layout(np.ones(4, bool), np.zeros(4, bool), np.array([0]), np.zeros(0, np.int64))
    assert cumulative(np.array([1, 1, 1, 1]), layout, 10).tolist() == [3, 5, 8, 10]


@few
@given(seeds, st.sampled_from([(0, 0), (2, 0), (0, 3), (5, 1)]))
def test_draws_weigh_what_lacks_and_what_is_extra(seed: int, ratio: tuple[int, int]) -> None:
    wanted, held = degrees(seed) * PHYSICAL, degrees(seed + 1, 4) * PHYSICAL
    alpha, beta = map(Fraction, ratio)
    found = similarities(wanted, wanted, held, LAYOUT, Similarity.TVERSKY, (alpha, beta))
    for one, other in zip(found, held, strict=True):
        shared = np.minimum(wanted, other).sum()
        below = shared + ratio[0] * (wanted - other).clip(0).sum() + ratio[1] * (other - wanted).clip(0).sum()
        assert np.isclose(one, shared / below if below > 0 else 0)


def test_only_physical_qualities_weigh() -> None:
    assert importance(np.ones(Q), LAYOUT).tolist() == [3, 1, 4, 0, 0]


def test_a_neighbour_in_rank_is_nearer_than_one_far_off() -> None:
    """size_2 is nearer to size_3 than to size_4; sets and their ratios cannot tell."""
    layout = Layout(np.ones(4, bool), np.zeros(4, bool), np.array([0]), np.zeros(0, np.int64))
    candidates = np.eye(4)
    found = similarities(candidates[1], candidates[1], candidates, layout, Similarity.ORDINAL)
    assert np.allclose(found, [2 / 3, 1, 2 / 3, 1 / 3])
    ratio = similarities(candidates[1], candidates[1], candidates, layout, Similarity.RUZICKA)
    assert np.allclose(ratio, [0, 1, 0, 0])


def test_a_property_not_observed_counts_as_far() -> None:
    layout = Layout(np.ones(4, bool), np.zeros(4, bool), np.array([0, 2]), np.zeros(0, np.int64))
    tool = np.array([1.0, 0, 1, 0])
    candidates = np.array([[1.0, 0, 1, 0], [1, 0, 0, 0], [1, 0, 0, 1], [0, 0, 0, 0]])
    weights = np.array([3.0, 0, 1, 0])
    assert np.allclose(
        similarities(weights, tool, candidates, layout, Similarity.ORDINAL), [1, 0.75, 0.75, 0]
    )
    half = np.array([1.0, 0, 0, 0])  # of neither: takes no part
    found = similarities(weights, half, candidates, layout, Similarity.ORDINAL)
    assert np.allclose(found, [0.75, 1, 0.75, 0])


def test_earth_movers_distance_by_hand() -> None:
    """Half of the mass moves one rank of three, a quarter two ranks."""
    layout = Layout(np.ones(4, bool), np.zeros(4, bool), np.array([0]), np.zeros(0, np.int64))
    tool, other = np.array([0.75, 0.25, 0, 0]), np.array([[0.25, 0.5, 0.25, 0]])
    found = similarities(tool, tool, other, layout, Similarity.ORDINAL)
    assert np.allclose(found, 1 - (0.5 + 0.25) / 3)
