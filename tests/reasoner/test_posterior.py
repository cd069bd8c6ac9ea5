"""The posterior of degrees: exact where it can be, and the limits of nothing and of everything observed."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.stats import beta, kstest

from ersatz.grounding.conceptualization import DEGREE
from ersatz.measurements import Kind
from ersatz.reasoner.posterior import PRIOR, Posterior, beta_above, posterior
from ersatz.reasoner.representative import Memberships, QualityTerm, load_knowledge
from tests.knowledge.tools import small

SIZES = (4, 1, 3)
"""Qualities of each property."""


def terms() -> tuple[QualityTerm, ...]:
    names = [(f"p{p}", rank) for p, size in enumerate(SIZES) for rank in range(1, size + 1)]
    return tuple(QualityTerm(f"{p}_{r}", f"{p}_{r}", p, "", Kind.PHYSICAL, r) for p, r in names)


def of(*rows: tuple[int, ...]) -> Posterior:
    """Return the posterior of classes whose objects hold the qualities so often."""
    counts = np.array(rows, dtype=np.int64) * DEGREE
    names = tuple(f"c{at}" for at in range(len(rows)))
    return posterior(Memberships(names, names, counts, counts), terms())


@pytest.mark.parametrize("theta", [1e-9, 0.05, 0.35, 0.5, 0.999])
def test_the_beta_is_that_of_scipy(theta: float) -> None:
    chance = np.random.default_rng(0)
    a, b = 10 ** chance.uniform(-3, 5, (2, 2000))
    np.testing.assert_allclose(beta_above(a, b, theta), beta.sf(theta, a, b), atol=1e-8)


@given(arrays(float, 3, elements=st.floats(1e-8, 1e9)), st.floats(0, 1))
def test_no_corner_gives_nan(a: np.ndarray[tuple[int], np.dtype[np.float64]], theta: float) -> None:
    for b in (a[::-1], np.zeros(3)):
        found = beta_above(a, b, theta)
        assert np.all((found >= 0) & (found <= 1))


def test_what_was_never_observed_has_the_prior() -> None:
    found = of((0,) * 8)
    assert found.alpha.tolist() == [[PRIOR / 4] * 4 + [PRIOR] + [PRIOR / 3] * 3]
    np.testing.assert_allclose(found.at_least(0.35)[0, 0], beta.sf(0.35, 0.25, 0.75), atol=1e-9)


def test_a_property_with_one_quality_is_certain() -> None:
    found = of((3, 1, 0, 0, 2, 0, 0, 1))
    assert found.at_least(1.0)[0, 4] == 1
    assert np.all(found.draw(10, np.random.default_rng(0))[:, 0, 4] == 1)


def test_draws_have_the_marginals_of_the_posterior() -> None:
    found = of((3, 1, 0, 6, 10, 0, 10, 0), (0,) * 8)
    drawn = found.draw(4000, np.random.default_rng(0))
    np.testing.assert_allclose(found.of_property(drawn), 1)
    np.testing.assert_allclose(drawn.mean(axis=0), found.mean(), atol=0.02)
    assert kstest(drawn[:, 0, 0], beta(3.25, 7.75).cdf).pvalue > 0.001
    assert kstest(drawn[:, 1, 5], beta(1 / 3, 2 / 3).cdf).pvalue > 0.001


def test_draws_do_not_hang_on_how_many_are_made_at_once() -> None:
    found, one, two = of((3, 1, 0, 6, 10, 0, 10, 0)), *(np.random.default_rng(5) for _ in range(2))
    both = np.concatenate([found.draw(3, one), found.draw(4, one)])
    assert np.array_equal(both, found.draw(7, two))


@given(st.integers(0, 20), st.integers(0, 20))
def test_more_objects_make_a_degree_surer(yes: int, no: int) -> None:
    """With ten times the data, the posterior's spread is smaller."""
    few, many = of((yes, no, 0, 0, 0, 0, 0, 0)), of((10 * yes + 10, 10 * no, 0, 0, 0, 0, 0, 0))
    spreads = []
    for one in (few, many):
        a, total = one.alpha[0, 1], one.of_property(one.alpha)[0, 1]
        spreads.append(a * (total - a) / total**2 / (total + 1))
    assert spreads[1] <= spreads[0] + 1e-12


def test_with_endless_data_the_threshold_decides() -> None:
    n = 10**9
    found = of((36 * n, 34 * n, 30 * n, 0, n, n, 0, 0))
    assert (found.at_least(0.35)[0] > 0.5).tolist() == [True, False, False, False, True, True, False, False]
    assert np.all(np.minimum(found.at_least(0.35), 1 - found.at_least(0.35)) < 1e-9)


def test_the_stored_question_tells_the_same() -> None:
    """SPARQL and the reasoner know the same posterior, of fractional counts too."""
    kb = small(fuzzifier=2.0)
    known = kb.view(load_knowledge)
    for table in (known.classes, known.functions):
        found = posterior(table, known.qualities)
        for row, iri in enumerate(table.iris):
            told = {str(one["quality"]): one for one in kb.ask("posterior", concept=iri, prior=1)}
            for at, quality in enumerate(known.qualities):
                if one := told.get(quality.iri):
                    assert abs(float(str(one["alpha"])) - found.alpha[row, at]) < 1e-6
                    assert abs(float(str(one["mean"])) - found.mean()[row, at]) < 1e-6
                else:
                    assert not table.counts[row, at]
