"""What outcomes tell of decisions: all where they decide, nothing where they do not."""

import numpy as np
import pytest

from ersatz.reasoner.tally import Tally, tally

DRAWS, QUALITIES = 400, 60


@pytest.mark.parametrize("rivals", [True, False])
def test_what_is_unrelated_tells_nothing_in_the_mean(rivals: bool) -> None:
    gains, by_chance = np.zeros(3), np.zeros(3)
    for seed in range(20):
        chance = np.random.default_rng(seed)
        told = chance.dirichlet(np.full(QUALITIES, 0.01), (DRAWS, 3))
        found = tally(told, (chance.random((DRAWS, 2)) < 0.3).astype(np.float64), rivals=rivals)
        seen, expected = found.taken(DRAWS) / found.variance(DRAWS).sum()
        gains, by_chance = gains + seen.sum(axis=-1), by_chance + expected.sum(axis=-1)
    assert by_chance.min() > 0.5
    assert (abs(gains) < by_chance / 4).all()


@pytest.mark.parametrize(("rivals", "share"), [(True, 1.0), (False, 0.5)])
def test_what_decides_takes_all_variance_away(rivals: bool, share: float) -> None:
    """Of two candidates one is the best: who knows the one's fate knows the other's, if rivals are told."""
    one = np.random.default_rng(1).random(DRAWS) < 0.5
    told = np.zeros((DRAWS, 3, 2))
    told[:, :, 0] = 1
    told[:, 1] = np.stack([one, ~one], axis=1)
    found = tally(told, np.stack([one, ~one], axis=1).astype(np.float64), rivals=rivals)
    gains = found.taken(DRAWS)[0] / found.variance(DRAWS).sum()
    assert gains[1].sum() == pytest.approx(share, abs=0.02)
    assert gains[[0, 2]] == pytest.approx(0, abs=1e-9)


def test_draws_may_come_in_parts() -> None:
    chance = np.random.default_rng(2)
    told, decided = chance.dirichlet(np.ones(4), (DRAWS, 3)), chance.random((DRAWS, 2))
    parts = [tally(told[of], decided[of], rivals=True) for of in (slice(0, 150), slice(150, DRAWS))]
    whole = tally(told, decided, rivals=True)
    assert sum(parts, Tally.nothing()).taken(DRAWS) == pytest.approx(whole.taken(DRAWS))
