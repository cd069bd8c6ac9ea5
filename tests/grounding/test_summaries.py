"""Summaries merge without a loss, and what is fitted to them is as good as what is fitted to all values."""

import itertools
from collections.abc import Sequence
from functools import reduce

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from ersatz.grounding import clustering, summaries
from ersatz.grounding.subcategorization import SubcategorizationSettings, fit_qualities
from ersatz.grounding.summaries import Histogram, Sample, Summary, hash_names, merge, summarize
from ersatz.grounding.units import ObservationUnit, find_units
from ersatz.measurements import Kind, Property, rounded
from tests.making import prop, table

PROP = Property("weight", Kind.PHYSICAL, "kg")
Floats = NDArray[np.float64]
N = 40_000
RNG = np.random.default_rng(1)
MASSES = np.array([0.0, 0.3, 0.30001, 7.0])

# Each a list of lumps so far apart that no cluster of a good partition reaches over two of them.
NASTY: dict[str, list[Floats]] = {
    "uniform": [RNG.uniform(size=N)],
    "normal": [RNG.normal(size=N)],
    "tails": [RNG.pareto(1.5, N)],
    "tails without a mean": [np.minimum(RNG.pareto(0.5, N), 9e14)],
    "cauchy": [np.clip(RNG.standard_cauchy(N), -9e14, 9e14)],
    "ten decades": [10 ** RNG.uniform(-5, 5, N)],
    "log-normal over ten decades": [RNG.lognormal(0, 3, N)],
    "masses": [np.where(RNG.random(N) < 0.7, RNG.choice(MASSES, N), RNG.uniform(0, 1, N))],
    "heavy masses": [np.concatenate([RNG.choice(MASSES, 30 * N), RNG.uniform(0, 1, N)])],
    "two far clusters": [RNG.normal(1, 0.1, N // 2), RNG.normal(1e6, 0.1, N // 2)],
    "two very far clusters": [RNG.normal(1, 0.1, N // 2), RNG.normal(1e10, 0.2, N // 2)],
    "three far clusters": [RNG.normal(at, 0.01, N // 3) for at in (-1e9, 3, 1e9)],
    "outliers": [RNG.normal(0, 1, N), RNG.uniform(1e8, 1e9, 5)],
    "tiny": [RNG.uniform(0, 1e-6, N)],
    "far from zero": [1e14 + RNG.uniform(0, 1e6, N)],
    "cantor": [sum((2 * RNG.integers(0, 2, N) / 3.0**i for i in range(1, 24)), np.zeros(N))],
}


def spread(values: Floats, centroids: Floats) -> float:
    """Return the squared distances of values to the nearest centroids' cluster means, lump by lump."""
    labels = np.abs(values[:, None] - centroids).argmin(axis=1)
    clusters = (values[labels == label] for label in np.unique(labels))
    return sum(float(((c - c[0] - (c - c[0]).mean()) ** 2).sum()) for c in clusters)


def exact(lump: Floats, k: int) -> float:
    """Return the least inertia of k clusters, by the exact fit of all values."""
    x, weights = np.unique(lump, return_counts=True)
    k = min(k, len(x))
    heavy = weights.astype(np.float64)
    middle = x - x[len(x) // 2]
    cuts = clustering._cheapest(clustering._prefix_sums(middle, heavy), k)
    means = [np.average(middle[a:b], weights=heavy[a:b]) for a, b in itertools.pairwise(cuts)]
    return spread(np.repeat(middle, weights), np.array(means))


def least_inertia(lumps: Sequence[Floats], k: int) -> float:
    """Return the least inertia over all ways to deal k clusters out to the lumps."""
    ways = itertools.product(range(1, k + 1), repeat=len(lumps))
    return min(
        sum(exact(lump, number) for lump, number in zip(lumps, way, strict=True))
        for way in ways
        if sum(way) == k
    )


@pytest.mark.parametrize("name", NASTY)
def test_a_histogram_is_as_good_as_all_values(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """With a sixteenth of the bins there are by default, the inertia is within a thousandth."""
    monkeypatch.setattr(summaries, "BIN_LIMIT", 1 << 13)
    lumps = [rounded(lump) for lump in NASTY[name]]
    qualities = fit_qualities(Histogram.of(np.concatenate(lumps)), PROP)
    assert qualities.method == "histogram"
    cuts = np.array([float(bound) for bound in qualities.bounds])
    parts = [part for lump in lumps for part in np.split(np.sort(lump), np.searchsorted(np.sort(lump), cuts))]
    found = sum(spread(part, part[:1]) for part in parts if len(part))
    assert found <= 1.001 * least_inertia(lumps, 4)


def test_more_values_than_the_exact_fit_takes() -> None:
    values = rounded(np.random.default_rng(0).lognormal(0, 3, 300_000))
    summary = Histogram.of(values)
    assert summary.shift is not None
    assert summaries.BIN_LIMIT / 2 < len(summary.keys) <= summaries.BIN_LIMIT
    qualities = fit_qualities(summary, PROP)
    assert qualities.method == "histogram"
    assert qualities.inertia(values[:, None]) <= 1.001 * exact(values, 4)


def test_clusters_too_tight_for_floats_are_found_in_whole_numbers() -> None:
    """Not so many values that they are binned, but too far apart for differences of their squares."""
    lumps = [rounded(lump[:3000]) for lump in NASTY["three far clusters"]]
    values = np.concatenate(lumps)
    summary = Histogram.of(values)
    assert summary.shift is None
    qualities = fit_qualities(summary, PROP, SubcategorizationSettings(4))
    cuts = [float(bound) for bound in qualities.bounds]
    parts = [p for lump in lumps for p in np.split(np.sort(lump), np.searchsorted(np.sort(lump), cuts))]
    assert sum(spread(p, p[:1]) for p in parts if len(p)) <= 1.001 * least_inertia(lumps, 4)


def equal(one: Summary, two: Summary) -> bool:
    if isinstance(one, Histogram):
        assert isinstance(two, Histogram)
        same = one.shift == two.shift and one.keys.dtype == two.keys.dtype
        return same and np.array_equal(one.keys, two.keys) and np.array_equal(one.counts, two.counts)
    assert isinstance(two, Sample)
    same = one.seen == two.seen and np.array_equal(one.hashes, two.hashes)
    return same and np.array_equal(one.vectors, two.vectors)


numbers = st.one_of(
    st.integers(-20, 20).map(float),
    st.floats(-1, 1),
    st.floats(-9e14, 9e14),
    st.floats(1e9, 1e9 + 1e-3),
    st.floats(-1e-9, 1e-9),
).map(lambda value: float(rounded(np.array([value]))[0]))


@settings(max_examples=300, deadline=None)
@given(st.lists(st.lists(numbers, min_size=1, max_size=20), min_size=1, max_size=8), st.randoms())
def test_parts_of_numbers_merge_in_any_order_to_the_same_bits(parts: list[list[float]], rng: object) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(summaries, "BIN_LIMIT", 8)
        whole = Histogram.of(np.concatenate(parts))
        made: list[Summary] = [Histogram.of(np.array(part)) for part in parts]
        rng.shuffle(made)  # type: ignore[attr-defined]
        assert equal(reduce(merge, made), whole)
        assert equal(reduce(merge, made[::-1]), whole)
        middle = len(made) // 2
        if middle:
            assert equal(merge(reduce(merge, made[:middle]), reduce(merge, made[middle:])), whole)
        running = Histogram.of(np.array(parts[0]))
        for part in parts[1:]:
            running = running + Histogram.of(np.array(part), running.shift)
        assert equal(running, whole)
        assert whole.counts.sum() == sum(map(len, parts))
        assert len(whole.keys) <= 8


@settings(max_examples=100, deadline=None)
@given(st.lists(st.integers(0, 2), min_size=1, max_size=60), st.integers(-3, 3))
def test_parts_of_vectors_merge_to_the_same_sample(groups: list[int], seed: int) -> None:
    rows = [("cup", f"cup_{n}", "", "size", (float(n), float(n % 7))) for n in range(len(groups))]
    size = prop("size", "physical", "length", "width")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(summaries, "SAMPLE_LIMIT", 10)
        made = []
        for chosen in ([0, 1, 2], [0], [1], [2]):
            part = [row for row, group in zip(rows, groups, strict=True) if group in chosen]
            if part:
                measured = table(part, [size])
                units = find_units(measured, ObservationUnit.INSTANCE)
                made.append(summarize(measured.columns[0], units, measured, seed))
        whole, *parts = made
        assert equal(reduce(merge, parts), whole)
        assert equal(reduce(merge, parts[::-1]), whole)
        assert isinstance(whole, Sample)
        assert len(whole.hashes) == min(len(rows), 10)


def test_a_sample_is_drawn_fairly_and_anew_with_another_seed() -> None:
    names = [f"thing_{n:05d}" for n in range(20_000)]
    rank = np.arange(20_000)
    for seed in (0, 1, -5):
        low = rank[hash_names(names, seed) < np.uint64(1 << 60)]  # a sixteenth
        assert 1100 < len(low) < 1400
        assert abs(low.mean() - 10_000) < 800
    assert not np.array_equal(hash_names(names, 0), hash_names(names, 1))


def test_observations_are_drawn_one_by_one() -> None:
    size = prop("size", "physical", "length", "width")
    rows = [("cup", f"cup_{n % 5}", f"view_{n // 5}", "size", (1.0 * n, 2.0)) for n in range(20)]
    measured = table(rows, [size])
    units = find_units(measured, ObservationUnit.OBSERVATION)
    assert len(set(summaries.unit_hashes(units, measured).tolist())) == 20


def test_numbers_and_vectors_do_not_merge() -> None:
    with pytest.raises(TypeError):
        merge(Histogram.of(np.array([1.0])), Sample.of(np.ones((1, 2)), np.zeros(1, np.uint64)))
