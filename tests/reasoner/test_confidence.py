"""How sure an answer is, and what to ask next: the limits, and answers known by thought alone."""

from dataclasses import replace
from decimal import Decimal
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
import rdflib
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ersatz.errors import InputError, UnknownNameError
from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.exports import KNOWROB, knowrob
from ersatz.knowledge.models import Drawing
from ersatz.knowledge.terms import integer
from ersatz.knowledge.validation import check
from ersatz.knowledge.vocabulary import ERSATZ, SEED
from ersatz.reasoner import confidence, sampling
from ersatz.reasoner.asking import ask_for_more
from ersatz.reasoner.confidence import Confidence, confidences
from ersatz.reasoner.gain import Doubt, outlook
from ersatz.reasoner.posterior import PRIOR, beta_above
from ersatz.reasoner.relevance import Combine, ReasonerSettings, typical
from ersatz.reasoner.representative import load_knowledge
from ersatz.reasoner.sampling import Question, outcomes, samples
from ersatz.reasoner.similarity import Similarity
from ersatz.reasoner.substitution import rank_substitutes
from tests.making import Held
from tests.reasoner.test_substitution import HELD, TRAY
from tests.reasoner.worlds import PROPERTIES, helds, make

MEASURED: Held = {
    name: (label, {p.name: 1 for p in PROPERTIES} | dict(ranks))
    for name, (label, ranks) in HELD.items()
    if label != "ghost"
}
"""With a value of every property of every object."""


def question(kb: KnowledgeBase, tool: str, chosen: ReasonerSettings | None = None, **many: int) -> Question:
    """Ask about all classes, with all counts so many times what they are."""
    ranking = rank_substitutes(kb, tool, settings=chosen)
    known, times = kb.view(load_knowledge), many.get("times", 1)
    for table in (known.classes, known.functions):
        table.counts[:] *= times
        table.totals[:] *= times
    rows = np.sort(ranking.candidates.rows[ranking.order])
    none = np.zeros((len(rows), len(known.qualities)))
    return Question(known, ranking.settings, known.row_of_name[tool], rows, none)


SETTINGS = [
    ReasonerSettings(),
    ReasonerSettings(combine=Combine.INTERSECTION, similarity=Similarity.TVERSKY, fallback=True),
    ReasonerSettings(graded=True),
    ReasonerSettings(graded=True, similarity=Similarity.RUZICKA, fallback=True),
    ReasonerSettings(graded=True, relevance_tolerance=Fraction(99, 100), fallback=True),
    ReasonerSettings(graded=True, similarity=Similarity.TVERSKY, properties=("alpha", "use")),
]


@settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(helds(), st.sampled_from(SETTINGS))
def test_probabilities_are_probabilities(held: Held, chosen: ReasonerSettings) -> None:
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
        assert all(0 <= one.gain <= 1 + 1e-9 for one in wished.measurements)


@pytest.mark.parametrize("chosen", SETTINGS)
def test_endless_data_gives_the_answer_at_the_observed_degrees(chosen: ReasonerSettings) -> None:
    for tool in ("tray", "plate", "sponge"):
        ranking = rank_substitutes(make(MEASURED), tool, settings=chosen)
        exact = {one.name: (one.accepted, one.similarity) for one in ranking}
        asked = question(make(MEASURED), tool, chosen, times=10**6)
        found = confidences(asked, 20)
        for at, row in enumerate(asked.rows.tolist()):
            accepted, similarity = exact[asked.knowledge.classes.names[row]]
            assert found.accepted[at] == accepted
            assert found.low[at] == pytest.approx(similarity, abs=5e-3)
            assert found.high[at] == pytest.approx(similarity, abs=5e-3)


@pytest.mark.parametrize("graded", [False, True])
def test_more_data_makes_the_interval_narrower(graded: bool) -> None:
    chosen = ReasonerSettings(graded=graded)
    few, many = (
        confidences(question(make(MEASURED), "tray", chosen, times=times), 400) for times in (1, 100)
    )
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
    held = np.array([[float(q.name == "alpha_3") for q in known.qualities]])
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
    chosen = ReasonerSettings(tolerance=0.7)  # type: ignore[arg-type]
    asked = question(make(held), "tray", chosen)
    wished = outlook(asked, 2000)
    first = wished.measurements[0]
    assert (first.candidate, first.property) == (0, "gamma")
    assert all(one.gain < first.gain / 5 for one in wished.measurements[1:])
    # P(m >= theta) now, and once an object of plate was seen to hold gamma_1, or another gamma.
    theta = float(chosen.representative)
    many = sum(one.property == "gamma" for one in asked.knowledge.qualities)
    now, held_it, other = (
        float(beta_above(np.array(PRIOR / many + a), np.array(PRIOR - PRIOR / many + b), theta))
        for a, b in ((0, 0), (1, 0), (0, 1))
    )
    taken = ((held_it - now) ** 2 + (many - 1) * (other - now) ** 2) / many
    assert wished.doubt == pytest.approx(now * (1 - now), abs=0.02)
    assert first.gain == pytest.approx(taken / (now * (1 - now)), abs=0.03)


def test_doubt_is_about_what_is_asked() -> None:
    """Both stand in, surely; which is the best, is open."""
    held = {f"{name} {at}": (name, TRAY) for name in ("tray", "plate", "cup") for at in range(4)}
    held |= {f"{name} 4": (name, TRAY | {"gamma": 3}) for name in ("plate", "cup")}
    asked = question(make(held), "tray", ReasonerSettings(graded=True, tolerance=Fraction(1, 100)))
    stands_in, best = (outlook(asked, 300, about=about) for about in (Doubt.ACCEPTED, Doubt.BEST))
    assert stands_in.doubt == 0
    assert best.doubt == pytest.approx(sum(share * (1 - share) for share in best.best), abs=1e-6)
    assert best.doubt > 0.4


def test_nothing_is_asked_where_nothing_is_in_doubt() -> None:
    held = {f"{name} {at}": (name, TRAY) for name in ("tray", "plate") for at in range(3)}
    wished = outlook(question(make(held), "tray", times=10**6), 200)
    assert wished.doubt == 0
    assert not any(one.clear for one in wished.measurements)


def test_only_what_bears_on_the_decision_is_asked_of_an_unknown_object() -> None:
    """Of what the tool's functions rest on; beta is no part of it."""
    held: dict[str, tuple[str, dict[str, int]]] = {}
    for at in range(30):
        held[f"tray {at}"] = ("tray", {"alpha": 3, "gamma": 1, "beta": 1 + at % 3, "use": 3})
        held[f"cup {at}"] = ("cup", {"alpha": 1, "gamma": 3, "beta": 1 + at % 3, "use": 1})
    known = make(held).view(load_knowledge)
    chosen = ReasonerSettings(representative=0.5)  # type: ignore[arg-type]
    nothing = np.zeros((1, len(known.qualities)))
    asked = Question(known, chosen, known.row_of_name["tray"], np.array([-1]), nothing)
    wished = [one for one in outlook(asked, 2000).measurements if one.clear and one.candidate == 0]
    assert sorted(one.property for one in wished) == ["alpha", "gamma"]


def test_the_last_thing_not_known_of_an_object_tells_all() -> None:
    held = {f"{name} {at}": (name, TRAY) for name in ("tray", "plate") for at in range(3)}
    held["cup 1"] = ("cup", TRAY | {"alpha": 1})
    known = make(held).view(load_knowledge)
    some = np.array([[float(q.name in ("beta_2", "gamma_1")) for q in known.qualities]])
    graded = ReasonerSettings(graded=True, tolerance=Fraction(9, 10))
    none = np.zeros_like(known.classes.counts)
    for about in Doubt:
        asked = Question(
            known, graded, known.row_of_name["tray"], np.array([-1, -1]), np.vstack([some] * 2), none
        )
        wished = [one for one in outlook(asked, 300, about=about).measurements if one.clear]
        assert {(one.candidate, one.property) for one in wished} == {(0, "alpha"), (1, "alpha")}
        assert sum(one.gain for one in wished) == pytest.approx(1, abs=0.05)


def test_of_so_many_objects_to_come_the_next_is_one() -> None:
    """Three plates are known, two are to come: the degrees lie on fifths, the outcome on halves."""
    held = {f"{name} {at}": (name, TRAY) for name in ("tray", "plate") for at in range(3)}
    known = make(held).view(load_knowledge)
    further = np.zeros_like(known.classes.counts)
    plate, tray = known.row_of_name["plate"], known.row_of_name["tray"]
    further[plate] = 2
    nothing = np.zeros((1, len(known.qualities)))
    asked = Question(known, ReasonerSettings(), tray, np.array([plate]), nothing, further)
    (sample,) = samples(asked, 200, 0)
    assert np.allclose(sample.tool, known.classes.counts[tray] / 3e6)
    fifths = 5 * sample.candidates[:, 0]
    assert np.allclose(fifths, np.rint(fifths))
    told = outcomes(asked, sample)[:, 1]
    seen = known.classes.counts[plate] / 1e6
    assert np.allclose(told * 2 + seen, fifths)
    assert set(np.unique(np.rint(told * 2))) == {0.0, 1.0, 2.0}
    assert confidences(replace(asked, further=np.zeros_like(further)), 50).accepted[0] == 1


def test_typical_with_certainty_asks_for_more_than_one_object() -> None:
    """All of one plate and of twenty trays are alike; only of the trays that is sure."""
    held: dict[str, tuple[str, dict[str, int]]] = {f"tray {at}": ("tray", TRAY) for at in range(20)}
    kb = make(held | {"plate 1": ("plate", TRAY)})
    (crisp,) = rank_substitutes(kb, "tray")
    (sure,) = rank_substitutes(kb, "tray", settings=ReasonerSettings(certainty=Fraction(95, 100)))
    (unsure,) = rank_substitutes(kb, "tray", settings=ReasonerSettings(certainty=Fraction(1, 2)))
    assert (crisp.similarity, unsure.similarity, sure.similarity) == (1, 1, 0)
    assert sure.flags == ("unknown",)
    assert sure.counterfactual().representative is None


@settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(helds(), st.sampled_from([Fraction(1, 10), Fraction(35, 100), Fraction(2, 3)]))
def test_more_certainty_leaves_less_and_endless_data_what_is_typical(held: Held, theta: Fraction) -> None:
    """Between two objects and endlessly many alike: nothing never observed, and less with more certainty."""
    known = make(held).view(load_knowledge)

    def at(certainty: Fraction | None, times: int = 1) -> Any:
        classes = replace(
            known.classes, counts=known.classes.counts * times, totals=known.classes.totals * times
        )
        return typical(classes, known, ReasonerSettings(theta, certainty=certainty))

    little, much = at(Fraction(1, 100)), at(Fraction(99, 100))
    assert not (much & ~little).any()
    assert not (little & (known.classes.counts == 0)).any()
    shares = known.classes.counts / np.maximum(known.classes.totals, 1)
    clear = np.abs(shares - float(theta)) > 0.01
    for certainty in (Fraction(1, 100), Fraction(99, 100)):
        assert (at(certainty, 10**6) == at(None))[clear].all()


@pytest.mark.parametrize("certainty", [0, 1, -0.1, "nan"])
def test_a_senseless_certainty_is_refused(certainty: Any) -> None:
    with pytest.raises(InputError):
        ReasonerSettings(certainty=certainty)
    with pytest.raises(InputError, match="graded reasoning has no cut"):
        ReasonerSettings(certainty=Fraction(1, 2), graded=True)


def test_a_remembered_answer_says_how_sure_it_is() -> None:
    kb = make(HELD)
    first = rank_substitutes(kb, "tray", ["plate", "book"], remember=True, draws=40, seed=1)
    model = kb.substitution_model("tray")
    assert model == first.model()
    assert model is not None
    assert model.drawing == Drawing(40, Decimal("0.9"), Decimal("0.5"), 1)
    for one in first:
        (written,) = (c for c in model.candidates if c.iri == one.iri)
        assert one.confidence is not None
        assert written.chances == one.confidence.chances()
        assert one.confidence.words().partition(":")[2] in one.explain()
        assert one.to_json()["confidence"]["draws"] == 40
    again = rank_substitutes(kb, "tray", ["plate", "book"], draws=40, seed=1)
    assert again.reused
    assert [one.confidence for one in again] == [one.confidence for one in first]


def test_an_answer_remembered_without_a_seed_is_read() -> None:
    """As written before the seed was told."""
    kb = make(HELD)
    model = rank_substitutes(kb, "tray", remember=True, draws=40, seed=7).model()
    kb.tell([f"<{model.iri}> {SEED} {integer(7)} .\n"], [])
    read = kb.substitution_model("tray")
    assert read is not None and read.drawing is not None and model.drawing is not None
    assert (model.drawing.seed, read.drawing.seed) == (7, None)
    assert read.candidates == model.candidates


def test_confidence_is_added_to_a_remembered_answer_and_lost_by_what_was_not_asked_with_it() -> None:
    kb = make(HELD)
    rank_substitutes(kb, "tray", ["plate", "book"], remember=True)
    rank_substitutes(kb, "tray", ["plate", "book"], remember=True, draws=10)
    model = kb.substitution_model("tray")
    assert model is not None
    assert all(candidate.chances for candidate in model.candidates)
    rank_substitutes(kb, "tray", ["plate", "sponge"], remember=True, draws=10)
    model = kb.substitution_model("tray")
    assert model is not None
    sure = [candidate.iri.rpartition("#")[2] for candidate in model.candidates if candidate.chances]
    assert sure == ["Plate", "Sponge"]


def test_what_is_remembered_with_confidence_passes_all_checks_and_is_exported() -> None:
    kb = make(HELD)
    model = rank_substitutes(kb, "tray", remember=True, draws=50).model()
    assert not check(kb.triples()).findings
    accepted = {float(c.chances.accepted) for c in model.candidates if c.accepted and c.chances}
    graph = rdflib.Graph()
    for triple in knowrob(kb.triples()):
        graph.parse(data=f"{triple} .", format="nt")
    answers = graph.subjects(rdflib.RDF.type, rdflib.URIRef(f"{ERSATZ}Reified_substitutes"))
    told = {float(str(graph.value(one, rdflib.URIRef(f"{KNOWROB}hasConfidence")))) for one in answers}
    assert told == accepted


def test_an_unnamed_object_is_asked_for_what_is_not_known_of_it() -> None:
    kb = make(HELD)
    nothing = ask_for_more(kb, "tray", held=[])
    some = ask_for_more(kb, "tray", held=["alpha_3"])
    assert [one.kind for one in nothing.candidates] == ["object"]
    assert {one.property for one in nothing.wishes} == {"alpha", "beta", "gamma"}
    assert {one.property for one in some.wishes} == {"beta", "gamma"}
    assert some.candidates[0].accepted > nothing.candidates[0].accepted
    assert ask_for_more(kb, "tray", held=["alpha_3", "beta_2", "gamma_1"]).wishes == ()
    assert nothing.to_json()["measure"][0]["gain"] == round(nothing.wishes[0].gain, 6)


def test_what_is_known_of_an_object_counts_by_its_degrees() -> None:
    """Nearer to what the tool holds, it is accepted more often; not graded, every degree is one."""
    kb, by_degrees = make(MEASURED), ReasonerSettings(graded=True)

    def accepted(far: float, chosen: ReasonerSettings | None) -> float:
        held = {"alpha_3": 1 - far, "alpha_1": far, "gamma_1": 1}
        return ask_for_more(kb, "tray", held=held, settings=chosen, draws=300).candidates[0].accepted

    shares = [accepted(far, by_degrees) for far in (0, 0.25, 0.5, 1)]
    assert shares == sorted(shares, reverse=True)
    assert shares[0] > shares[2] > shares[-1]
    assert shares[1] > shares[2]
    assert accepted(0.25, None) == accepted(0.5, None)
    with pytest.raises(InputError, match="alpha_3 to the degree 2"):
        ask_for_more(kb, "tray", held={"alpha_3": 2})


def test_things_at_hand_are_asked_by_name() -> None:
    asked = ask_for_more(make(HELD), "tray", ["plate"], instances=["sponge 1"], about=Doubt.BEST)
    assert {(one.name, one.kind) for one in asked.candidates} == {
        ("plate", "class"),
        ("sponge 1", "instance"),
    }
    kinds = {one.thing: (one.kind, one.known) for one in asked.wishes}
    assert set(kinds) <= {"tray", "plate"}
    assert kinds["plate"] == ("class", 1)


def test_asking_refuses_what_makes_no_sense() -> None:
    kb = make(HELD)
    with pytest.raises(InputError, match="not both"):
        ask_for_more(kb, "tray", ["plate"], held=[])
    with pytest.raises(UnknownNameError, match="alpha_9"):
        ask_for_more(kb, "tray", held=["alpha_9"])
    with pytest.raises(UnknownNameError, match="did you mean 'tray'"):
        ask_for_more(kb, "tary", held=[])


@pytest.mark.parametrize(
    ("draws", "seed", "message"),
    [
        (0, 0, "draws is 0: give 1 to"),
        (-1, 0, "draws is -1"),
        (10**11, 0, "draws is 100000000000: give 1 to 1000000"),
        (1, -1, "seed is -1: give 0 or more"),
    ],
)
def test_senseless_numbers_are_refused(draws: int, seed: int, message: str) -> None:
    with pytest.raises(InputError, match=message):
        confidences(question(make(HELD), "tray"), draws, seed)


@pytest.mark.parametrize("chosen", [None, ReasonerSettings(graded=True)])
def test_intervals_leave_a_twentieth_of_the_draws_out_on_either_side(chosen: ReasonerSettings | None) -> None:
    asked = question(make(HELD), "tray", chosen)
    found = confidences(asked, 101, 3)
    drawn = np.sort(np.concatenate([one.similarity for one in samples(asked, 101, 3)]), axis=0)
    np.testing.assert_allclose(found.low, drawn[5], atol=1e-6)
    np.testing.assert_allclose(found.high, drawn[95], atol=1e-6)
    np.testing.assert_allclose(found.expected, drawn.mean(axis=0), atol=1e-6)
    assert (found.low < found.high).any()


def test_more_numbers_than_fit_into_memory_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = question(make(HELD), "tray")
    many = len(asked.rows)
    monkeypatch.setattr(confidence, "MOST_NUMBERS", 10 * many)
    assert confidences(asked, 10).draws == 10
    with pytest.raises(InputError, match=f"draws is 11: of {many} candidates, give at most 10"):
        confidences(asked, 11)


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
