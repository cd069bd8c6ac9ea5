"""Figures of scans and concepts are files with something on them."""

from pathlib import Path

import numpy as np
import pytest

from ersatz.acquisition.concept_learning import learn_shape_concepts
from ersatz.acquisition.figures import concept_figure, scan_figures
from ersatz.acquisition.shape_concepts import ConceptSettings
from ersatz.errors import InputError
from tests.acquisition.shapes import views


def test_figures(tmp_path: Path) -> None:
    import matplotlib.image

    scans = list(views(("box", "can", "ball", "cup"), range(4), 2))
    concepts = learn_shape_concepts(scans, ConceptSettings(persistence=False))
    paths = scan_figures(scans[0], concepts, tmp_path / "out")
    assert [path.name for path in paths] == [
        "segments.png",
        "symbols.png",
        "compositions.png",
        "responses.png",
    ]
    paths.append(concept_figure(concepts, scans, tmp_path / "concepts.png"))
    for path in paths:
        image = np.asarray(matplotlib.image.imread(path))
        assert image[..., :3].std() > 0.02, path
    before = paths[0].read_bytes()
    assert scan_figures(scans[0], concepts, tmp_path / "out")[0].read_bytes() == before
    with pytest.raises(InputError, match="none of the scans is an exemplar"):
        concept_figure(concepts, [], tmp_path / "none.png")
