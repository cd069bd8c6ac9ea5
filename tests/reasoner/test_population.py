"""Objects drawn as wholes: their limits, and what goes together."""

from dataclasses import replace

import numpy as np
import pytest

from ersatz.knowledge.base import KnowledgeBase
from ersatz.reasoner import population
from ersatz.reasoner.confidence import confidences
from ersatz.reasoner.population import Population, load_population
from ersatz.reasoner.relevance import ReasonerSettings
from ersatz.reasoner.representative import Knowledge, load_knowledge
from ersatz.reasoner.sampling import Question, samples
from tests.reasoner.test_confidence import MEASURED
from tests.reasoner.test_substitution import HELD, TRAY
from tests.reasoner.worlds import make


def known_of(kb: KnowledgeBase) -> tuple[Knowledge, Population]:
    found = kb.view(load_population)
    assert found is not None
    return kb.view(load_knowledge), found


def test_the_objects_are_those_that_were_counted() -> None:
    known, objects = known_of(make(HELD))
    sums = np.zeros_like(known.classes.counts, dtype=np.float64)
    np.add.at(sums, objects.of_class, objects.held)
    assert np.array_equal(sums * 1e6, known.classes.counts)


@pytest.mark.parametrize("further", [None, 1.0])
def test_degrees_are_shares_around_what_was_observed(further: float | None) -> None:
    known, objects = known_of(make(MEASURED))
    classes, functions = objects.draw(known, 4000, np.random.default_rng(0), further)
    for drawn, table in ((classes, known.classes), (functions, known.functions)):
        assert np.all((drawn >= 0) & (drawn <= 1 + 1e-12))
        never = (table.totals == 0).all(axis=0)
        assert not drawn[..., never].any()
    row = known.row_of_name["tray"]
    size = int(known.units[row])
    observed = objects.held[objects.of_class == row].sum(axis=0)
    everything = objects.held.mean(axis=0)
    expected = (observed + population.PRIOR * everything) / (size + population.PRIOR)
    if further is not None:
        expected = (observed + further * size * expected) / (size + further * size)
    first = [at for at, quality in enumerate(known.qualities) if quality.property == "alpha"]
    assert classes[:, row, first].mean(axis=0) == pytest.approx(expected[first], abs=0.02)


def test_nothing_to_come_leaves_what_was_counted() -> None:
    known, objects = known_of(make(HELD))
    classes, functions = objects.draw(known, 2, np.random.default_rng(0), 0.0)
    for drawn, table in ((classes, known.classes), (functions, known.functions)):
        assert np.allclose(drawn[0], table.counts / np.maximum(table.totals, 1))


def test_what_goes_together_in_objects_goes_together_in_draws() -> None:
    """Half of the cups have both alpha_3 and beta_3, the others neither."""
    held: dict[str, tuple[str, dict[str, int]]] = {f"tray {at}": ("tray", TRAY) for at in range(4)}
    for at in range(8):
        held[f"cup {at}"] = ("cup", TRAY | {"alpha": 1 + 2 * (at % 2), "beta": 1 + 2 * (at % 2)})
    known, objects = known_of(make(held))
    classes, _ = objects.draw(known, 500, np.random.default_rng(0))
    names = [quality.name for quality in known.qualities]
    cup = classes[:, known.row_of_name["cup"]]
    one, two = cup[:, names.index("alpha_1")], cup[:, names.index("beta_1")]
    assert one.std() > 0.1
    assert np.abs(one - two).mean() < 0.05


def test_too_many_objects_are_not_read(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(population, "MOST_CELLS", 3)
    assert make(HELD).view(load_population) is None


def test_numbers_of_objects_to_come_are_not_drawn_as_wholes() -> None:
    known, objects = known_of(make(HELD))
    rows, nothing = np.array([known.row_of_name["plate"]]), np.zeros((1, len(known.qualities)))
    asked = Question(known, ReasonerSettings(), 0, rows, nothing, population=objects)
    assert 0 <= confidences(asked, 20).accepted[0] <= 1
    with pytest.raises(ValueError, match="endless"):
        next(samples(replace(asked, further=np.zeros_like(known.classes.counts)), 2, 0))
