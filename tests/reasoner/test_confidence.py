"""How sure an answer is, and what to ask next: the limits, and answers known by thought alone."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ersatz.errors import InputError
from ersatz.knowledge.base import KnowledgeBase
from ersatz.reasoner import sampling
from ersatz.reasoner.confidence import Confidence, confidences
from ersatz.reasoner.gain import Doubt, outlook
from ersatz.reasoner.relevance import Combine, ReasonerSettings
from ersatz.reasoner.representative import load_knowledge
from ersatz.reasoner.sampling import Question, samples
from ersatz.reasoner.similarity import Similarity
from ersatz.reasoner.substitution import rank_substitutes
from tests.making import Held
from tests.reasoner.test_substitution import HELD, TRAY
from tests.reasoner.worlds import helds, make


def question(kb: KnowledgeBase, tool: str, chosen: ReasonerSettings | None = None, **many: int) -> Question:
    """Ask about all classes, with all counts so many times what they are."""
    ranking = rank_substitutes(kb, tool, settings=chosen)
    known, times = kb.view(load_knowledge), many.get("times", 1)
    for table in (known.classes, known.functions):
        table.counts[:] *= times
        table.totals[:] *= times
    rows = np.sort(ranking.candidates.rows[ranking.order])
    none = np.zeros((len(rows), len(known.qualities)), dtype=bool)
    return Question(known, ranking.settings, known.row_of_name[tool], rows, none)


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(helds(), st.sampled_from(list(Combine)), st.sampled_from(list(Similarity)), st.booleans())
def test_probabilities_are_probabilities(
    held: Held, combine: Combine, form: Similarity, fallback: bool
) -> None:
    chosen = ReasonerSettings(combine=combine, similarity=form, fallback=fallback)
    tool = next(iter(held.values()))[0]
    asked = question(make(held), tool, chosen)
    found = confidences(asked, 30)
    for figures in (found.accepted, found.best, found.low, found.high, found.expected):
        assert np.all((figures >= 0) & (figures <= 1))
    assert np.all(found.low <= found.high)
    assert found.best.sum() == pytest.approx(1)
    for about in Doubt:
        wished = outlook(asked, 50, about=about)
        assert np.isfinite(wished.doubt) and wished.doubt >= 0
        assert all(np.isfinite(one.gain) and one.gain > 0 for one in wished.measurements)


@pytest.mark.parametrize("fallback", [False, True])
def test_endless_data_gives_the_crisp_answer(fallback: bool) -> None:
    chosen = ReasonerSettings(fallback=fallback)
    for tool in ("tray", "plate", "sponge"):
        ranking = rank_substitutes(make(HELD), tool, settings=chosen)
        crisp = {one.name: (one.accepted, one.similarity) for one in ranking if one.name != "ghost"}
        asked = question(make(HELD), tool, chosen, times=10**6)
        found = confidences(asked, 20)
        for at, row in enumerate(asked.rows.tolist()):
            name = asked.knowledge.classes.names[row]
            if name in crisp:  # of the ghost nothing physical was ever observed
                assert found.accepted[at] == crisp[name][0]
                assert found.low[at] == pytest.approx(found.high[at])
                assert found.low[at] == pytest.approx(crisp[name][1])


def test_more_data_makes_the_interval_narrower() -> None:
    held = {name: of for name, of in HELD.items() if of[0] != "ghost"}
    few, many = (confidences(question(make(held), "tray", times=times), 400) for times in (1, 100))
    assert np.all(many.high - many.low < few.high - few.low)


def test_the_same_seed_gives_the_same_figures_in_chunks_of_any_size(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = question(make(HELD), "tray")
    whole = confidences(asked, 50, seed=3)
    monkeypatch.setattr(sampling, "CHUNK", 1)
    assert len(list(samples(asked, 50, 3))) == 50
    pieces = confidences(asked, 50, seed=3)
    assert np.array_equal(whole.accepted, pieces.accepted)
    assert np.allclose(whole.best, pieces.best)
    assert np.array_equal(whole.low, pieces.low)
    assert not np.array_equal(whole.expected, confidences(asked, 50, seed=4).expected)


def test_what_an_object_is_known_to_hold_is_never_drawn_and_the_rest_is() -> None:
    known = make(HELD).view(load_knowledge)
    held = np.array([[q.name == "alpha_3" for q in known.qualities]])
    asked = Question(known, ReasonerSettings(), known.row_of_name["tray"], np.array([-1]), held)
    (sample,) = samples(asked, 300, 0)
    names = [q.name for q in known.qualities]
    drawn = sample.candidates[:, 0]
    assert np.all(drawn[:, names.index("alpha_3")] == 1)
    assert np.all(drawn[:, names.index("alpha_1")] == 0)
    assert set(np.unique(drawn)) == {0.0, 1.0}
    beta = [names.index(f"beta_{rank}") for rank in (1, 2, 3)]
    assert np.all(drawn[:, beta].sum(axis=1) == 1)
    # All classes that are mostly alpha_3 are mostly beta_2.
    assert drawn[:, beta[1]].mean() > 0.6


def test_the_most_telling_measurement_is_the_one_in_doubt() -> None:
    """All of plate agrees with tray but for gamma, which nobody has measured of it."""
    held: dict[str, tuple[str, dict[str, int]]] = {
        f"{name} {at}": (name, TRAY) for name in ("tray", "plate") for at in range(20)
    }
    for at in range(20):
        held[f"plate {at}"] = ("plate", {k: v for k, v in TRAY.items() if k != "gamma"})
    chosen = ReasonerSettings(tolerance=0.8)  # type: ignore[arg-type]
    asked = question(make(held), "tray", chosen)
    wished = outlook(asked, 2000)
    first = wished.measurements[0]
    assert (first.candidate, first.property) == (0, "gamma")
    assert all(one.gain < first.gain / 5 for one in wished.measurements[1:])
    assert wished.doubt > 0.5
    assert first.gain <= wished.doubt


def test_nothing_is_asked_where_nothing_is_in_doubt() -> None:
    held = {f"{name} {at}": (name, TRAY) for name in ("tray", "plate") for at in range(3)}
    wished = outlook(question(make(held), "tray", times=10**6), 200)
    assert wished.doubt == 0
    assert wished.measurements == ()


def test_only_what_bears_on_the_decision_is_asked_of_an_unknown_object() -> None:
    """Of what the tool's functions rest on; beta is no part of it."""
    held: dict[str, tuple[str, dict[str, int]]] = {}
    for at in range(30):
        held[f"tray {at}"] = ("tray", {"alpha": 3, "gamma": 1, "beta": 1 + at % 3, "use": 3})
        held[f"cup {at}"] = ("cup", {"alpha": 1, "gamma": 3, "beta": 1 + at % 3, "use": 1})
    known = make(held).view(load_knowledge)
    chosen = ReasonerSettings(representative=0.5)  # type: ignore[arg-type]
    nothing = np.zeros((1, len(known.qualities)), dtype=bool)
    asked = Question(known, chosen, known.row_of_name["tray"], np.array([-1]), nothing)
    properties = [one.property for one in outlook(asked, 2000).measurements if one.candidate == 0]
    assert sorted(properties) == ["alpha", "gamma"]


@pytest.mark.parametrize(("draws", "seed"), [(0, 0), (-1, 0), (1, -1)])
def test_senseless_numbers_are_refused(draws: int, seed: int) -> None:
    with pytest.raises(InputError):
        confidences(question(make(HELD), "tray"), draws, seed)


def test_it_is_said_in_words() -> None:
    words = {share: Confidence(share, 0, 0, 1, 200, 0).words() for share in (1.0, 0.82, 0.6, 0.4, 0.1, 0.0)}
    assert words == {
        1.0: "almost surely: accepted in 200 of 200 draws",
        0.82: "probably: accepted in 164 of 200 draws",
        0.6: "uncertain: accepted in 120 of 200 draws",
        0.4: "uncertain: accepted in 80 of 200 draws",
        0.1: "probably not: accepted in 20 of 200 draws",
        0.0: "almost surely not: accepted in 0 of 200 draws",
    }
