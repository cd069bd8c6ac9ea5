"""Fuzzy sub-categorization against the textbook's formulas, its limits, and its promises."""

import itertools
from collections.abc import Sequence
from pathlib import Path
from random import Random

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from ersatz.acquisition.rocs import read_rocs
from ersatz.errors import ErsatzWarning, InputError
from ersatz.grounding import fuzzy, summaries
from ersatz.grounding.attribution import attribute, most_held
from ersatz.grounding.conceptualization import conceptualize
from ersatz.grounding.fuzzy import DEGREE
from ersatz.grounding.subcategorization import Qualities, SubcategorizationSettings, learn_qualities
from ersatz.grounding.units import ObservationUnit, find_units, unit_values
from ersatz.measurements import DIGITS, Measurements, Property, rounded
from tests.making import prop, table

Floats = NDArray[np.float64]
PROP = prop("weight")
SPACE = prop("size", "physical", "length", "width")
FUZZIFIERS = (1.0 + 1e-12, 1.25, 2.0, 3.0, 10.0)


def fit(values: Floats, prop: Property = PROP, m: float = 2.0, clusters: int = 4) -> Qualities:
    clusters = min(clusters, len(np.unique(values, axis=0)))
    return learn_qualities(values, prop, SubcategorizationSettings(clusters, restarts=5, fuzzifier=m))


def column(values: Sequence[float]) -> Floats:
    return np.array(values, dtype=float)[:, None]


def cloud(seed: int, n: int = 80, d: int = 2) -> Floats:
    """Four long clusters, each in a direction of its own."""
    rng = np.random.default_rng(seed)
    groups = [
        rng.normal(0, 1, (n // 4, d)) @ rng.normal(0, 1, (d, d)) + rng.uniform(0, 12, d) for _ in range(4)
    ]
    return rounded(np.concatenate(groups))


# ------------------------------------------------------------------------------------------ textbook


def textbook_degrees(distances: Sequence[float], m: float) -> list[float]:
    """Return u_i = 1 / sum_j (d_i / d_j)^(2 / (m - 1)) of one value (Bezdek 1981)."""
    if 0 in distances:
        return [float(d == 0) for d in distances]
    return [1 / sum((one / other) ** (2 / (m - 1)) for other in distances) for one in distances]


def textbook_norm(values: Floats, shares: Sequence[float], centre: Floats) -> Floats:
    """Return A = det(F)^(1/d) F^-1 (Gustafson and Kessel 1979), F shrunk as by Babuska et al. (2002)."""
    d = values.shape[1]
    covariance = sum(s * np.outer(x - centre, x - centre) for x, s in zip(values, shares, strict=True)) / sum(
        shares
    )
    variance = float(np.mean(np.var(values, axis=0)))
    shrunk = 0.9 * np.asarray(covariance) + 0.1 * variance * np.eye(d)
    return np.asarray(np.linalg.det(shrunk) ** (1 / d) * np.linalg.inv(shrunk))


def textbook(
    values: Floats, start: Floats, m: float, steps: int = 400
) -> tuple[Floats, list[Floats], Floats]:
    """Return the centroids, norms and degrees of Gustafson and Kessel, one value and cluster at a time."""
    k, d = start.shape
    centres, norms = start, [np.eye(d)] * k
    for _ in range(steps):
        degrees = []
        for x in values:
            distances = [float((x - c) @ a @ (x - c)) ** 0.5 for c, a in zip(centres, norms, strict=True)]
            degrees.append(textbook_degrees(distances, m))
        powers = np.array(degrees) ** m
        moved = np.array([(powers[:, i, None] * values).sum(axis=0) / powers[:, i].sum() for i in range(k)])
        if d > 1:
            norms = [textbook_norm(values, powers[:, i].tolist(), moved[i]) for i in range(k)]
        if np.allclose(moved, centres, rtol=0, atol=1e-11):
            break
        centres = moved
    return moved, norms, np.array(degrees)


@pytest.mark.parametrize(("seed", "m"), [(0, 2.0), (1, 1.5), (2, 3.0)])
def test_numbers_are_clustered_as_in_the_textbook(seed: int, m: float) -> None:
    rng = np.random.default_rng(seed)
    values = rounded(np.repeat(rng.lognormal(0, 1, 40), rng.integers(1, 3, 40)))[:, None]
    found = fit(values, m=m)
    centres, _, degrees = textbook(values, fit(values, m=1.0).centroids, m)
    assert found.method == "fuzzy c-means"
    assert found.norms is None
    assert np.allclose(found.centroids, centres, rtol=1e-7)
    inside = ((values >= found.centroids[0]) & (values <= found.centroids[-1]))[:, 0]
    assert 10 < inside.sum() < len(values)
    assert np.allclose(found.degrees(values)[inside] / DEGREE, degrees[inside], atol=2e-6)


@pytest.mark.parametrize(("seed", "m", "d"), [(0, 2.0, 2), (1, 1.5, 2), (2, 2.0, 3)])
def test_vectors_are_clustered_as_in_the_textbook(seed: int, m: float, d: int) -> None:
    values = cloud(seed, 60, d)
    prop_ = prop("size", "physical", *"abc"[:d])
    found = fit(values, prop_, m)
    centres, norms, degrees = textbook(values, fit(values, prop_, 1.0).centroids, m)
    assert found.method == "Gustafson-Kessel"
    assert found.norms is not None
    order = [int(np.abs(centres - centroid).sum(axis=1).argmin()) for centroid in found.centroids]
    assert sorted(order) == [0, 1, 2, 3]
    assert np.allclose(found.centroids, centres[order], atol=1e-6)
    assert np.allclose(found.norms, np.array(norms)[order], atol=1e-5)
    assert np.allclose(np.linalg.det(found.norms), 1)
    inside = ((values >= found.centroids.min(axis=0)) & (values <= found.centroids.max(axis=0))).all(axis=1)
    assert inside.sum() > 5
    assert np.allclose(found.degrees(values)[inside] / DEGREE, degrees[inside][:, order], atol=1e-5)


def test_long_thin_clusters_are_told_apart_where_round_ones_are_not() -> None:
    rng = np.random.default_rng(0)
    ends = ((0.0, 0.0), (3.0, 2.5))
    rods = [np.stack([rng.uniform(x, x + 8, 60), rng.normal(y, 0.1, 60)], axis=1) for x, y in ends]
    values, truth = rounded(np.concatenate(rods)), np.repeat([0, 1], 60)

    def agree(m: float) -> float:
        share = float((fit(values, SPACE, m, clusters=2).assign(values) == truth).mean())
        return max(share, 1 - share)

    assert agree(1.0) < 0.75
    assert agree(2.0) > 0.98


# ---------------------------------------------------------------------------------------- any values

grid = st.integers(-20, 20).map(float)
tidy = st.floats(-1e6, 1e6).map(lambda x: round(x, DIGITS) + 0.0)
huge = st.floats(-9e14, 9e14).map(lambda x: float(np.round(x, DIGITS)) + 0.0)
tiny = st.integers(-50, 50).map(lambda n: n * 1e-12)
NUMBERS = st.lists(st.one_of(grid, tidy, huge, tiny), min_size=1, max_size=25)


@pytest.mark.filterwarnings("ignore::ersatz.errors.ErsatzWarning")
@settings(max_examples=300, deadline=None)
@given(NUMBERS, st.lists(huge, max_size=4), st.sampled_from(FUZZIFIERS), st.integers(1, 5))
@example([0.0, 1e-12], [0.0], 2.0, 4)
@example([5.0] * 7, [5.0, 6.0], 2.0, 4)
@example([0.0] * 20 + [1.0] * 20 + [0.5], [0.25], 10.0, 2)
def test_degrees_of_any_number_add_up_to_one(
    values: list[float], others: list[float], m: float, clusters: int
) -> None:
    with np.errstate(divide="raise", invalid="raise", over="raise"):
        found = fit(column(values), m=m, clusters=clusters)
        degrees = found.degrees(column([*values, *others, *found.centroids[:, 0]]))
    assert np.isfinite(found.centroids).all()
    assert (np.diff(found.centroids[:, 0]) > 0).all()
    assert degrees.dtype == np.int64
    assert (degrees.sum(axis=1) == DEGREE).all()
    assert (degrees >= 0).all()
    k = len(found.centroids)
    assert np.array_equal(degrees[-k:], DEGREE * np.eye(k, dtype=np.int64))  # a centroid is its own


@pytest.mark.filterwarnings("ignore::ersatz.errors.ErsatzWarning")
@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.tuples(*[st.one_of(grid, tiny, huge)] * 2), min_size=1, max_size=14),
    st.sampled_from([1.5, 2.0, 10.0]),
)
@example([(float(n), 2.0 * n) for n in range(12)], 2.0)  # all on a line: every covariance is singular
@example([(0.0, 0.0)] * 9 + [(1.0, 1.0)] * 9 + [(2.0, 0.0)] * 3 + [(2.0, 1.0), (5.0, 5.0)], 2.0)
@example([(1e14, 1e-12 * n) for n in range(9)], 2.0)
def test_degrees_of_any_vector_add_up_to_one(values: list[tuple[float, float]], m: float) -> None:
    x = np.array(values)
    with np.errstate(divide="raise", invalid="raise", over="raise"):
        found = fit(x, SPACE, m)
        degrees = found.degrees(np.concatenate([x, x * -3, found.centroids]))
    assert np.isfinite(found.centroids).all()
    assert found.norms is None or (np.linalg.eigvalsh(found.norms) > 0).all()
    assert (degrees.sum(axis=1) == DEGREE).all()
    assert (degrees >= 0).all()
    assert np.array_equal(found.assign(x), degrees[: len(x)].argmax(axis=1))


@settings(max_examples=100, deadline=None)
@given(
    st.lists(st.one_of(grid, tidy), min_size=2, max_size=25),
    st.sampled_from([1.0, *FUZZIFIERS]),
    st.randoms(use_true_random=False),
)
@pytest.mark.filterwarnings("ignore::ersatz.errors.ErsatzWarning")
def test_the_order_of_values_does_not_matter(values: list[float], m: float, chance: Random) -> None:
    shuffled = list(values)
    chance.shuffle(shuffled)
    one, two = fit(column(values), m=m), fit(column(shuffled), m=m)
    assert one.same_cuts(two)
    # Neither does what else is asked at the same time.
    together = one.degrees(column(values))
    assert all(
        np.array_equal(one.degrees(column([v]))[0], row) for v, row in zip(values, together, strict=True)
    )


@pytest.mark.parametrize("seed", range(3))
def test_the_order_of_vectors_does_not_matter(seed: int) -> None:
    values = cloud(seed)
    shuffled = values[np.random.default_rng(seed).permutation(len(values))]
    one, two = fit(values, SPACE), fit(shuffled, SPACE)
    assert one.same_cuts(two)
    assert np.array_equal(one.degrees(shuffled), np.concatenate([one.degrees(row[None]) for row in shuffled]))


# -------------------------------------------------------------------------------------------- limits


@settings(max_examples=150, deadline=None)
@given(st.lists(st.one_of(grid, tidy), min_size=1, max_size=25), st.integers(1, 4))
@pytest.mark.filterwarnings("ignore::ersatz.errors.ErsatzWarning")
def test_towards_a_fuzzifier_of_one_the_crisp_qualities_come_back(values: list[float], clusters: int) -> None:
    x = column(values)
    crisp, limit = fit(x, m=1.0, clusters=clusters), fit(x, m=1 + 1e-12, clusters=clusters)
    scale = float(np.ptp(x)) or 1.0
    assert np.allclose(limit.centroids, crisp.centroids, rtol=0, atol=1e-11 * scale + 1e-12)
    assert np.array_equal(limit.degrees(x), crisp.degrees(x))
    assert np.array_equal(limit.assign(x), crisp.assign(x))


def test_a_fuzzifier_of_one_is_crisp() -> None:
    values = cloud(0)
    found = fit(values, SPACE, 1.0)
    assert (found.method, found.norms, found.fuzzy) == ("k-means", None, False)
    assert np.array_equal(found.degrees(values), DEGREE * np.eye(4, dtype=np.int64)[found.assign(values)])


def test_vectors_belong_to_one_quality_alone_towards_a_fuzzifier_of_one() -> None:
    """The limit is crisp, but with norms of their own: only a fuzzifier of 1 itself is k-means."""
    degrees = fit(cloud(1), SPACE, 1 + 1e-12).degrees(cloud(1))
    assert set(degrees.ravel().tolist()) == {0, DEGREE}


@pytest.mark.filterwarnings("ignore::ersatz.errors.ErsatzWarning")
@settings(max_examples=150, deadline=None)
@given(st.lists(st.one_of(grid, tidy), min_size=2, max_size=25), st.sampled_from(FUZZIFIERS))
def test_degrees_run_from_one_centroid_to_the_next_and_stay_beyond_the_last(
    values: list[float], m: float
) -> None:
    found = fit(column(values), m=m)
    centroids = found.centroids[:, 0]
    for rank, (low, high) in enumerate(itertools.pairwise(centroids)):
        degrees = found.degrees(np.linspace(low, high, 41)[:, None])
        assert degrees[0, rank] == degrees[-1, rank + 1] == DEGREE
        assert (np.diff(degrees[:, rank]) <= 1).all()  # a millionth is what rounding may add
        assert (np.diff(degrees[:, rank + 1]) >= -1).all()
    spread = np.ptp(centroids) + 1
    beyond = found.degrees(column([centroids[0] - spread, centroids[-1] + spread, 9e14]))
    assert beyond[0, 0] == beyond[1, -1] == beyond[2, -1] == DEGREE


def test_an_enormous_thing_is_not_a_bit_of_everything() -> None:
    values = cloud(0)
    found = fit(values, SPACE)
    far = np.array([[1e6, 1e6]])
    corner = found.centroids.max(axis=0)[None]
    assert np.array_equal(found.degrees(far), found.degrees(corner))
    assert found.degrees(far).max() > 0.5 * DEGREE


# -------------------------------------------------------------------------------------- what is kept


def test_two_clusters_that_become_one_leave_the_crisp_centroids() -> None:
    values = column([0.0] * 40 + [1.0, 1.01, 1.02] + [2.0] * 40)
    with pytest.warns(ErsatzWarning, match="'weight' has fewer than 4 fuzzy clusters"):
        found = fuzzy_of_merging(values)
    crisp = fit(values, m=1.0)
    assert np.array_equal(found.centroids, crisp.centroids)
    assert (found.method, found.fuzzifier) == (crisp.method, 2.0)
    assert found.degrees(values).sum(axis=1).tolist() == [DEGREE] * len(values)


def fuzzy_of_merging(values: Floats) -> Qualities:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(fuzzy, "APART", 10.0)
        return fit(values)


@pytest.mark.parametrize("m", [0.5, 0.0, -1.0, 10.5, float("nan"), float("inf")])
def test_a_fuzzifier_out_of_range_is_refused(m: float) -> None:
    with pytest.raises(InputError, match=rf"fuzzifier is {m}: it lies between 1 \(crisp\) and 10"):
        SubcategorizationSettings(fuzzifier=m)


def test_large_fits_take_a_histogram_or_a_sample(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(4)
    line, plane = rounded(rng.lognormal(0, 1, (6000, 1))), cloud(4, 6000)
    whole = [fit(line), fit(plane, SPACE)]
    monkeypatch.setattr(summaries, "SAMPLE_LIMIT", 2000)
    monkeypatch.setattr(summaries, "BIN_LIMIT", 1 << 10)
    fewer = [fit(line), fit(plane, SPACE)]
    assert [q.method for q in fewer] == ["sampled fuzzy c-means", "sampled Gustafson-Kessel"]
    assert np.allclose(whole[0].centroids, fewer[0].centroids, rtol=1e-3)
    assert np.allclose(whole[1].centroids, fewer[1].centroids, atol=0.5)
    assert fit(plane, SPACE).same_cuts(fewer[1])


def test_units_hold_degrees_and_none_where_there_is_no_value() -> None:
    measured = table(
        [("bowl", "b1", "", "weight", 1.5), ("bowl", "b2", "", "use", 2.0), ("cup", "c1", "", "weight", 9.0)],
        [PROP, prop("use", "functional")],
    )
    qualities = [
        Qualities(prop("use", "functional"), column([1.0, 2.0])),
        Qualities(PROP, column([1.0, 2.0, 3.0]), fuzzifier=2.0),
    ]
    held = attribute(measured, qualities, find_units(measured, ObservationUnit.INSTANCE)).held
    assert held[0].tolist() == [-1, 1, -1]
    assert held[1].tolist() == [[473684, 473684, 52632], [0, 0, 0], [0, 0, DEGREE]]
    assert [most_held(h).tolist() for h in held] == [[-1, 1, -1], [0, -1, 2]]


def test_rocs_is_grounded_fuzzily(shared_data: Path) -> None:
    measured = Measurements.collect(read_rocs(shared_data / "rocs"))
    units = find_units(measured, ObservationUnit.INSTANCE)
    qualities = []
    for measured_column in measured.columns:
        values = unit_values(measured_column, units, measured)[1]
        soft = fit(values, measured_column.property)
        qualities.append(soft)
        assert soft.method in ("fuzzy c-means", "Gustafson-Kessel")
        # Where a value is clearly of one quality, fuzzy and crisp mostly agree on it.
        clear = soft.degrees(values).max(axis=1) > 0.8 * DEGREE
        same = soft.assign(values)[clear] == fit(values, measured_column.property, 1.0).assign(values)[clear]
        assert clear.mean() > 0.3
        if not measured_column.property.components:
            assert same.mean() > 0.85
    counts = conceptualize(attribute(measured, qualities, units), measured.classes)
    totals = np.add.reduceat(counts.class_counts, counts.offsets[:-1], axis=1)
    assert np.array_equal(totals, counts.class_totals)
    assert (counts.class_counts % DEGREE).any()
