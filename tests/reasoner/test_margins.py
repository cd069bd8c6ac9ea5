"""What outcomes tell of margins: all where they decide, nothing where they do not."""

import numpy as np
import pytest

from ersatz.reasoner.margins import sums

DRAWS, QUALITIES = 400, 60


@pytest.mark.parametrize("rivals", [True, False])
def test_what_is_unrelated_tells_nothing_in_the_mean(rivals: bool) -> None:
    gains, by_chance = np.zeros(3), np.zeros(3)
    for seed in range(20):
        chance = np.random.default_rng(seed)
        told = chance.dirichlet(np.full(QUALITIES, 0.01), (DRAWS, 3))
        found = sums(told, chance.random((DRAWS, 2)), rivals=rivals)
        seen, expected = found.leads(DRAWS) if rivals else found.passes(DRAWS, 0.5)
        gains, by_chance = gains + seen.sum(axis=-1), by_chance + expected.sum(axis=-1)
    assert by_chance.min() > 0.5
    assert (abs(gains) < by_chance / 4).all()


def test_what_decides_takes_all_variance_away() -> None:
    chance = np.random.default_rng(1)
    one = chance.random(DRAWS) < 0.5
    told = np.zeros((DRAWS, 3, 2))
    told[:, :, 0] = 1
    told[:, 1] = np.stack([one, ~one], axis=1)
    similarity = np.stack([one * 1.0, np.full(DRAWS, 0.4)], axis=1)
    gains, _ = sums(told, similarity, rivals=True).leads(DRAWS)
    assert gains[1].sum() == pytest.approx(1, abs=0.02)
    assert gains[[0, 2]] == pytest.approx(0, abs=1e-9)
