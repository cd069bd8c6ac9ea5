"""Sub-categorization against brute force, other software, and its own promises."""

import itertools
import os
import subprocess
import sys
from collections.abc import Sequence
from fractions import Fraction
from random import Random

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from ersatz.errors import ErsatzWarning, InputError
from ersatz.grounding import summaries
from ersatz.grounding.subcategorization import Qualities, SubcategorizationSettings, learn_qualities
from ersatz.measurements import DIGITS
from tests.making import prop

Floats = NDArray[np.float64]
PROP = prop("weight")
SPACE = prop("size", "physical", "length", "width")


def inertia(clusters: Sequence[Sequence[float]]) -> Fraction:
    """Return the exact sum of squared distances to the clusters' means."""
    total = Fraction(0)
    for cluster in clusters:
        exact = [Fraction(x) for x in cluster]
        mean = sum(exact, Fraction(0)) / len(exact)
        total += sum(((x - mean) ** 2 for x in exact), Fraction(0))
    return total


def least_inertia(values: Sequence[float], k: int) -> Fraction:
    """Try every partition of the sorted values into k intervals; optimal clusters are intervals."""
    ordered = sorted(values)
    borders = itertools.combinations(range(1, len(ordered)), k - 1)
    return min(
        inertia([ordered[a:b] for a, b in itertools.pairwise((0, *cuts, len(ordered)))]) for cuts in borders
    )


def fit(values: Sequence[float], clusters: int = 4) -> Qualities:
    chosen = SubcategorizationSettings(clusters=min(clusters, len(set(values))))
    return learn_qualities(np.array(values)[:, None], PROP, chosen)


def partition(values: Sequence[float], qualities: Qualities) -> list[list[float]]:
    labels = qualities.assign(np.array(values)[:, None])
    return [[v for v, label in zip(values, labels, strict=True) if label == k] for k in sorted(set(labels))]


tidy = st.floats(-1e6, 1e6).map(lambda x: round(x, DIGITS) + 0.0)
wide = st.floats(-1e14, 1e14).map(lambda x: float(np.round(x, DIGITS)) + 0.0)
grid = st.integers(-20, 20).map(float)


@settings(max_examples=300, deadline=None)
@given(st.lists(st.one_of(grid, tidy, wide), min_size=1, max_size=9), st.integers(1, 4))
@example([0.0, 1.0, 10.0, 11.0, 1e9, 1e9 + 1], 4)
@example([0.0, 0.001, 0.002, 0.01, 0.011, 1e12, 1e12 + 1], 4)
def test_the_partition_of_a_line_is_the_best_of_all(values: list[float], clusters: int) -> None:
    k = min(clusters, len(set(values)))
    found = inertia(partition(values, fit(values, clusters)))
    assert found <= least_inertia(values, k) * (1 + Fraction(1, 10**9))


@settings(max_examples=200, deadline=None)
@given(st.lists(st.one_of(grid, tidy), min_size=1, max_size=30), st.randoms(use_true_random=False))
def test_the_order_of_values_does_not_matter(values: list[float], random: Random) -> None:
    shuffled = list(values)
    random.shuffle(shuffled)
    assert np.array_equal(fit(values).centroids, fit(shuffled).centroids)


@settings(max_examples=200, deadline=None)
@given(st.lists(st.one_of(grid, tidy, wide), min_size=1, max_size=30), st.integers(1, 5))
def test_saved_centroids_reproduce_the_assignment(values: list[float], clusters: int) -> None:
    """Each cluster's mean, rounded, is its centroid: so a fit is a fixed point of k-means."""
    qualities = fit(values, clusters)
    clusters_found = partition(values, qualities)
    assert len(clusters_found) == len(qualities.centroids)
    for cluster, centroid in zip(clusters_found, qualities.centroids[:, 0], strict=True):
        mean = float(sum(map(Fraction, cluster), Fraction(0)) / len(cluster))
        assert centroid == pytest.approx(mean, rel=1e-12, abs=10.0**-DIGITS)
    again = Qualities(PROP, np.array([[float(repr(float(c)))] for c in qualities.centroids[:, 0]]))
    x = np.array(values)[:, None]
    assert np.array_equal(again.assign(x), qualities.assign(x))


@settings(max_examples=300, deadline=None)
@given(
    st.lists(st.one_of(grid, tidy, wide), min_size=2, max_size=5, unique=True),
    st.lists(st.one_of(grid, tidy, wide), min_size=1, max_size=20),
)
@example([1e14, 1e14 + 0.03125], [1e14, 1e14 + 0.015625, 1e14 + 0.03125])
@example([1e14, 1e14 + 0.015625], [1e14, 1e14 + 0.015625])
@example([1e14 + 0.015625, 1e14 + 0.03125], [1e14 + 0.015625, 1e14 + 0.03125])
def test_values_take_the_nearest_centroid_and_ties_the_lower(
    centroids: list[float], values: list[float]
) -> None:
    """Distances are those of the numbers as they are written down, not of their binary neighbours."""
    ordered = sorted(centroids)
    middles = [(a + b) / 2 for a, b in itertools.pairwise(ordered)]
    values = [*values, *(float(np.round(m, DIGITS)) for m in middles)]
    labels = Qualities(PROP, np.array(ordered)[:, None]).assign(np.array(values)[:, None])
    for value, label in zip(values, labels.tolist(), strict=True):
        distances = [abs(Fraction(repr(value)) - Fraction(repr(c))) for c in ordered]
        assert label == distances.index(min(distances)), value


def test_a_value_between_two_centroids_is_of_the_lower_rank() -> None:
    assert Qualities(PROP, np.array([[0.1], [0.2]])).assign(np.array([[0.15]])).tolist() == [0]
    square = Qualities(SPACE, np.array([[0.0, 0.0], [0.0, 2.0], [2.0, 0.0]]))
    assert square.assign(np.array([[1.0, 1.0], [0.0, 1.0], [1.0, 2.0]])).tolist() == [0, 0, 1]


def test_fewer_distinct_values_than_clusters_warn_and_give_fewer_qualities() -> None:
    with pytest.warns(ErsatzWarning, match=r"'weight' has 2 distinct value\(s\): 2 instead of 4"):
        line = learn_qualities(np.array([[1.0], [2.0], [1.0]]), PROP)
    assert line.centroids.tolist() == [[1.0], [2.0]]
    with pytest.warns(ErsatzWarning, match=r"'size' has 1 distinct value\(s\): 1 instead of 4"):
        space = learn_qualities(np.array([[1.0, 2.0]] * 3), SPACE)
    assert space.centroids.tolist() == [[1.0, 2.0]]


@pytest.mark.parametrize("clusters", [0, -1, 128, 1000])
def test_a_number_of_clusters_no_label_can_hold_is_refused(clusters: int) -> None:
    """Labels are int8: with 200 clusters they would turn negative, which means "no value"."""
    with pytest.raises(InputError, match=str(clusters)):
        SubcategorizationSettings(clusters=clusters)


def test_as_many_clusters_as_allowed_are_told_apart() -> None:
    qualities = fit([float(i) for i in range(127)], 127)
    assert qualities.assign(np.arange(127.0)[:, None]).tolist() == list(range(127))


def cloud(seed: int, n: int = 120) -> Floats:
    rng = np.random.default_rng(seed)
    centres = rng.uniform(0, 10, (6, 2))
    return np.round(centres[rng.integers(0, 6, n)] + rng.normal(0, 1, (n, 2)), DIGITS)


@pytest.mark.parametrize("seed", range(5))
def test_a_fit_in_space_is_no_worse_than_ten_starts_of_scikit_learn(seed: int) -> None:
    from sklearn.cluster import KMeans

    values = cloud(seed)
    ours = learn_qualities(values, SPACE)
    theirs = KMeans(4, n_init=10, random_state=seed).fit(values)
    assert ours.inertia(values) <= theirs.inertia_ * (1 + 1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_a_fit_in_space_does_not_depend_on_the_order_of_rows(seed: int) -> None:
    values = cloud(seed)
    shuffled = values[np.random.default_rng(seed + 100).permutation(len(values))]
    one, two = (learn_qualities(v, SPACE, SubcategorizationSettings(restarts=40)) for v in (values, shuffled))
    assert np.array_equal(one.centroids, two.centroids)
    labels = one.assign(values)
    for k in range(4):
        assert np.allclose(values[labels == k].mean(axis=0), one.centroids[k], atol=1e-11)


def test_a_fit_in_space_does_not_depend_on_the_number_of_threads() -> None:
    code = (
        "import numpy as np; from tests.grounding.test_subcategorization import cloud, SPACE;"
        "from ersatz.grounding.subcategorization import learn_qualities, SubcategorizationSettings;"
        "q = learn_qualities(cloud(1, 3000), SPACE, SubcategorizationSettings(restarts=5));"
        "print(q.centroids.tobytes().hex())"
    )
    found = {
        subprocess.run(
            [sys.executable, "-c", code],
            env={**os.environ, "OMP_NUM_THREADS": threads, "OPENBLAS_NUM_THREADS": threads},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for threads in ("1", "2")
    }
    assert len(found) == 1


def test_a_large_fit_in_space_is_of_a_seeded_sample(monkeypatch: pytest.MonkeyPatch) -> None:
    values = cloud(2, 4000)
    habits = SubcategorizationSettings(restarts=5)
    whole = learn_qualities(values, SPACE, habits)
    monkeypatch.setattr(summaries, "SAMPLE_LIMIT", 1000)
    fitted = [learn_qualities(v, SPACE, habits) for v in (values, values[::-1])]
    assert (whole.method, fitted[0].method) == ("k-means", "sampled k-means")
    assert np.array_equal(fitted[0].centroids, fitted[1].centroids)
    assert whole.inertia(values) <= fitted[0].inertia(values) <= 1.01 * whole.inertia(values)


def test_ranks_in_space_ascend_along_the_longest_axis() -> None:
    values = np.array([[x + d, -x] for x in (0.0, 10.0, 20.0, 30.0) for d in (0.0, 1.0)])
    assert (np.diff(learn_qualities(values, SPACE).centroids[:, 0]) > 0).all()
