"""Responses change gracefully when points are lost or noise is added, and the figure shows it."""

from pathlib import Path

import numpy as np
import pytest

from ersatz.acquisition.drift import SHARES, SIGMAS, drift, drift_figure
from ersatz.acquisition.sources import shape_concepts
from ersatz.errors import InputError
from tests.acquisition.shapes import views


def test_responses_drift_gracefully(tmp_path: Path) -> None:
    import matplotlib.image

    found = drift(views(("box", "can", "cup"), range(7, 8), 2), shape_concepts())
    assert found.thinned.shape == (len(SHARES), 6)
    assert found.noisy.shape == (len(SIGMAS), 6)
    # Nothing taken away and nothing added: nothing moves.
    assert np.allclose(found.thinned[0], 0)
    assert np.allclose(found.noisy[0], 0)
    # Half of the points, or a millimetre of noise: nearer to itself than to another object.
    assert np.median(found.thinned[SHARES.index(0.5)]) < found.other
    assert np.median(found.noisy[SIGMAS.index(0.001)]) < found.other
    path = drift_figure(found, tmp_path / "drift.png")
    assert np.asarray(matplotlib.image.imread(path))[..., :3].std() > 0.02


def test_nothing_to_thin_out_is_an_error() -> None:
    with pytest.raises(InputError, match="no views"):
        drift([], shape_concepts())
