"""rank_substitutes by degrees: settings, weights, words, JSON, what is remembered; recognition too."""

import json
from dataclasses import replace
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ersatz.errors import InputError, UnknownNameError
from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.validation import check
from ersatz.reasoner.asking import ask_for_more
from ersatz.reasoner.aspects import Aspect, in_words
from ersatz.reasoner.explanation import origin
from ersatz.reasoner.quantised import quantise
from ersatz.reasoner.recognition import nearest_classes, possible_roles
from ersatz.reasoner.relevance import ReasonerSettings
from ersatz.reasoner.representative import Memberships
from ersatz.reasoner.similarity import GRADED, Similarity
from ersatz.reasoner.substitution import Ranking, Status, rank_substitutes
from tests.knowledge.tools import small
from tests.making import Held
from tests.reasoner.test_reference import settings_of
from tests.reasoner.test_substitution import HELD, plain
from tests.reasoner.worlds import graded_options, helds, make

ORDINAL = ReasonerSettings(graded=True)
RUZICKA = ReasonerSettings(graded=True, similarity=Similarity.RUZICKA)


@pytest.fixture(scope="module")
def kb() -> KnowledgeBase:
    return make(HELD)


def test_usual_settings() -> None:
    crisp = ReasonerSettings()
    assert (crisp.similarity, crisp.tolerance, crisp.relevance_tolerance) == (
        Similarity.JACCARD,
        Fraction(35, 100),
        Fraction(35, 100),
    )
    assert (ORDINAL.similarity, ORDINAL.tolerance, ORDINAL.relevance_tolerance) == (
        Similarity.ORDINAL,
        Fraction(67, 100),
        Fraction(0),
    )
    assert RUZICKA.tolerance == Fraction(35, 100)
    assert ReasonerSettings(graded=True, tolerance=Fraction(35, 100)).tolerance == Fraction(35, 100)
    assert replace(ORDINAL, properties=("weight",)).tolerance == ORDINAL.tolerance


@pytest.mark.parametrize(
    "given, message",
    [
        ({"similarity": "ruzicka"}, "ruzicka is not for crisp reasoning.*add graded"),
        ({"similarity": "ordinal"}, "ordinal is not for crisp reasoning"),
        ({"graded": True, "similarity": "jaccard"}, "jaccard is not for graded reasoning.*leave graded out"),
        ({"graded": True, "combine": "intersection"}, "combine intersection is crisp"),
        ({"graded": True, "representative": "0.5"}, "representative 1/2 is crisp"),
        ({"graded": True, "alpha": 2}, "alpha 2 is of graded tversky only"),
        ({"similarity": "tversky", "beta": "0.3"}, "beta 3/10 is of graded tversky only"),
        ({"graded": True, "similarity": "tversky", "beta": -1}, "beta is -1: a weight is at least 0"),
        ({"graded": True, "tolerance": 2}, "tolerance is 2"),
        ({"tolerance": -1}, "tolerance is -1"),
        ({"graded": True, "similarity": "cosine"}, "similarity 'cosine' is not one of"),
    ],
)
def test_what_makes_no_sense_is_one_clear_error(given: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        ReasonerSettings(**given)  # type: ignore[arg-type]


@pytest.mark.parametrize("chosen", [ORDINAL, RUZICKA])
def test_a_property_nobody_knows_is_refused(kb: KnowledgeBase, chosen: ReasonerSettings) -> None:
    unknown = replace(chosen, properties=("alpha", "alphas"))
    with pytest.raises(InputError, match="property 'alphas' is not in this knowledge base; it has alpha"):
        rank_substitutes(kb, "tray", settings=unknown)
    with pytest.raises(InputError, match="property 'alphas'"):
        ask_for_more(kb, "tray", held=["beta_2"], settings=unknown)


def test_the_paper_s_rule_is_what_jaccard_means(kb: KnowledgeBase) -> None:
    assert plain(rank_substitutes(kb, "tray")) == plain(
        rank_substitutes(kb, "tray", settings=ReasonerSettings(similarity=Similarity.JACCARD))
    )


@pytest.mark.parametrize("form", GRADED)
def test_aspects_add_up_to_the_similarity(kb: KnowledgeBase, form: Similarity) -> None:
    chosen = ReasonerSettings(graded=True, similarity=form)
    for one in rank_substitutes(kb, "tray", instances=["plate 1", "ghost 1"], settings=chosen):
        assert sum(aspect.weight * aspect.likeness for aspect in one.aspects) == one.fraction
        assert sum(aspect.weight for aspect in one.aspects) == 1


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(helds(), st.data())
def test_aspects_of_random_knowledge_add_up_and_answers_are_remembered(
    held: Held, data: st.DataObject
) -> None:
    kb, chosen = make(held), settings_of(data.draw(graded_options()))
    finite = replace(
        chosen,
        tolerance=Fraction(1, 4),
        relevance_tolerance=Fraction(0),
        alpha=Fraction(1),
        beta=Fraction(1, 2),
    )
    every = [label for label, _ in held.values()]
    first = rank_substitutes(kb, every[0], every, instances=list(held)[:2], settings=finite, remember=True)
    for one in first:
        parts = one.aspects
        assert sum(aspect.weight * aspect.likeness for aspect in parts) == one.fraction
        assert all(0 <= aspect.likeness <= 1 for aspect in parts)
        assert all(0 <= share <= 1 for aspect in parts for _, share in aspect.functions)
        assert one.explain()
    again = rank_substitutes(kb, every[0], every, instances=list(held)[:2], settings=finite)
    assert again.reused is (first.status is Status.OK)
    assert plain(again) == plain(first)
    json.dumps(first.to_json(), allow_nan=False)


def test_words(kb: KnowledgeBase) -> None:
    found = rank_substitutes(kb, "tray", ["plate", "sponge", "ghost"], settings=ORDINAL)
    assert [one.explain() for one in found] == [
        "plate, 0.83: like a tray in alpha (1.00) and beta (1.00); half in gamma (0.50). "
        "What counts follows most from hold_1 (1.00) and use_3 (0.71). Refused at a tolerance of 0.8333.",
        "sponge, 0.50: like a tray in gamma (1.00); half in beta (0.50); not in alpha (0.00). "
        "What counts follows most from hold_1 (1.00) and use_3 (0.71). Accepted at a tolerance below 0.5.",
        "ghost, 0.00: alpha, beta and gamma unknown. "
        "What counts follows most from hold_1 (1.00) and use_3 (0.71).",
    ]


def aspect(name: str, weight: Fraction, likeness: float, *, observed: bool = True) -> Aspect:
    return Aspect(name, weight, Fraction(likeness), observed, ())


def test_what_is_nowhere_like_the_tool_is_still_compared_with_it() -> None:
    half = Fraction(1, 2)
    assert in_words([aspect("size", half, 0.75), aspect("weight", half, 0.1)], "tray") == (
        "nearly like a tray in size (0.75); not in weight (0.10)"
    )
    assert in_words([aspect("size", Fraction(1), 0.1)], "axe") == "not like an axe in size (0.10)"
    assert in_words([aspect("size", Fraction(1), 0, observed=False)], "axe") == "size unknown"


def test_of_many_properties_the_weightiest_are_told() -> None:
    """Each of 50 counts for a fiftieth: less than what is told of a few."""
    told = in_words([aspect(f"p {at}", Fraction(1, 50), 1) for at in range(50)], "tray")
    assert told.count("(1.00)") == 50
    light = [aspect("heavy", Fraction(97, 100), 1), aspect("light", Fraction(3, 100), 1)]
    assert in_words(light, "tray") == "like a tray in heavy (1.00)"


def test_functions_that_hardly_matter_are_left_out_of_words(kb: KnowledgeBase) -> None:
    found = rank_substitutes(kb, "tray", ["plate"], settings=ORDINAL)
    comparison, wanted = found[0].comparison, found.relevance.demand
    assert wanted is not None
    few = replace(wanted.weights, functions=wanted.weights.functions // 150)
    graded = replace(comparison.graded, wanted=replace(wanted, weights=few))  # type: ignore[type-var]
    assert origin(comparison).count("(") == 2
    assert origin(replace(comparison, graded=graded)) == "What counts follows most from hold_1 (0.01)."


def test_weights(kb: KnowledgeBase) -> None:
    """hold_1 is of trays only; half of what has use_3 has another gamma: R = 2.5 / 3.5."""
    found = rank_substitutes(kb, "tray", settings=RUZICKA)
    assert found.weights() == {
        "functions": {"hold_1": 1.0, "use_3": 0.714286},
        "qualities": {"alpha_3": 1.0, "beta_2": 1.0, "gamma_1": 1.0},
        "properties": {"alpha": 1.0, "beta": 1.0, "gamma": 1.0},
    }
    (gamma,) = (one for one in found.property_weights if one.property == "gamma")
    assert gamma.functions[0] == ("hold_1", 1.0)
    assert gamma.functions[1][1] == pytest.approx(2.5 / 3.5 / 2, abs=1e-4)
    assert found.to_json()["weights"] == found.weights()
    evidence = found[0].shared[0]
    assert (evidence.quality, evidence.weight) == ("alpha_3", 1.0)
    assert evidence.to_json()["weight"] == 1.0
    crisp = rank_substitutes(kb, "tray")
    assert crisp.weights() == {"functions": {}, "qualities": {}, "properties": {}}
    assert not crisp[0].aspects
    assert not crisp.property_weights
    assert "weight" not in crisp[0].shared[0].to_json()


def test_without_a_function_the_answer_is_undetermined(kb: KnowledgeBase) -> None:
    """Nothing physical is known of a ghost, so no function is like it."""
    found = rank_substitutes(kb, "ghost", settings=ORDINAL)
    assert found.status is Status.UNDETERMINED
    assert {one.flags for one in found} == {("undetermined",)}
    assert not any(one.accepted for one in found)
    chosen = ReasonerSettings(graded=True, relevance_tolerance=Fraction(1), fallback=True)
    all_of_it = rank_substitutes(kb, "tray", settings=chosen)
    assert all_of_it.status is Status.OK
    assert all("fallback" in one.flags for one in all_of_it)
    needless = rank_substitutes(kb, "tray", settings=ReasonerSettings(graded=True, fallback=True))
    assert not any("fallback" in one.flags for one in needless)


def test_the_tolerance_named_turns_the_decision(kb: KnowledgeBase) -> None:
    for form in GRADED:
        chosen = ReasonerSettings(graded=True, similarity=form)
        for one in rank_substitutes(kb, "tray", settings=chosen):
            turn = one.counterfactual().tolerance
            if turn is None:
                assert one.fraction == 0
                continue
            other = turn if one.accepted else turn - Fraction(1, 10**9)
            assert judged(kb, one.name, replace(chosen, tolerance=other)) != one.accepted
            same = turn - Fraction(1, 10**9) if one.accepted else turn
            assert judged(kb, one.name, replace(chosen, tolerance=same)) == one.accepted


def judged(kb: KnowledgeBase, name: str, chosen: ReasonerSettings) -> bool:
    (one,) = rank_substitutes(kb, "tray", [name], settings=chosen)
    return one.accepted


def test_an_instance_is_judged_by_the_degrees_it_holds() -> None:
    kb = make(HELD)
    (one,) = rank_substitutes(kb, "tray", instances=["plate 1"], settings=ORDINAL)
    (of_class,) = rank_substitutes(kb, "tray", ["plate"], settings=ORDINAL)
    assert one.fraction == of_class.fraction
    assert one.flags == ()
    assert [(e.quality, e.count, e.total) for e in one.shared] == [
        ("alpha_3", 10**6, 10**6),
        ("beta_2", 10**6, 10**6),
    ]


def test_a_fuzzy_instance_is_judged_by_its_degrees_and_not_by_the_best_of_them() -> None:
    kb = small(fuzzifier=2.0)
    rows = kb.ask("instance_memberships", instances=["plate 2"])
    held = {str(row["quality"]).rpartition("#")[2]: Fraction(str(row["count"])) for row in rows}
    assert any(0 < degree < 1 for degree in held.values())
    (found,) = rank_substitutes(kb, "tray", instances=["plate 2"], settings=RUZICKA)
    told = {one.quality: Fraction(one.count, 10**6) for one in (*found.shared, *found.extra)}
    for quality, degree in told.items():
        assert abs(degree - held[quality]) < Fraction(1, 50_000)
    (wholly,) = rank_substitutes(kb, "tray", instances=["plate 2"])
    assert {one.count for one in wholly.shared} <= {10**6}


def test_remembered_graded_answers_are_not_those_of_other_settings() -> None:
    kb = make(HELD)
    rank_substitutes(kb, "tray", settings=ORDINAL, remember=True)
    assert rank_substitutes(kb, "tray", settings=ORDINAL).reused
    assert not rank_substitutes(kb, "tray", settings=RUZICKA).reused
    assert not rank_substitutes(kb, "tray").reused
    model = kb.substitution_model("tray")
    assert model is not None
    assert json.loads(model.settings)["graded"] is True
    assert [iri.rpartition("#")[2] for iri in model.substitutes] == ["Book", "Plate"]


def test_remembered_graded_answers_say_how_much_each_quality_counts() -> None:
    kb = make(HELD)
    first = rank_substitutes(kb, "tray", settings=RUZICKA, remember=True, draws=20)
    model = kb.substitution_model("tray")
    assert model == first.model()
    assert model is not None
    told = first.weights()
    assert {name: float(weight) for name, weight in model.weights} == told["functions"] | told["qualities"]
    rows = kb.ask("substitution_relevance", model=model.iri)
    assert {str(row["quality"]).rpartition("#")[2]: str(row["weight"]) for row in rows} == {
        name: str(weight) for name, weight in model.weights
    }
    assert not check(kb.triples()).findings
    kb.forget("plate 1")
    assert not kb.query("SELECT ?s { ?s a <https://w3id.org/ersatz#Relevance> }")
    rank_substitutes(kb, "tray", remember=True)
    crisp = kb.substitution_model("tray")
    assert crisp is not None
    assert crisp.weights == ()


def test_degrees_of_up_to_twelve_objects_are_exact() -> None:
    for total in range(1, 13):
        counts = np.arange(total + 1, dtype=np.int64)[None] * 10**6
        found = quantise(Memberships(("a",), ("a",), counts, np.full_like(counts, total * 10**6)))
        assert [Fraction(int(one), 55440) for one in found[0]] == [
            Fraction(n, total) for n in range(total + 1)
        ]


def test_degrees_are_rounded_half_up() -> None:
    counts = np.array([[1, 3, 7]], dtype=np.int64) * 10**6
    for total, found in ((13, [4265, 12794, 29852]), (55440 * 2, [1, 2, 4])):
        totals = np.full_like(counts, total * 10**6)
        assert quantise(Memberships(("a",), ("a",), counts, totals)).tolist() == [found]


def test_millions_of_objects_do_not_overflow() -> None:
    counts = np.array([[1, 2, 3]], dtype=np.int64) * 10**6 * 10**9
    found = quantise(Memberships(("a",), ("a",), counts, np.full_like(counts, 4 * 10**15)))
    assert found.tolist() == [[13860, 27720, 41580]]


def test_nearest_classes_by_degrees(kb: KnowledgeBase) -> None:
    near = nearest_classes(kb, ["alpha_3", "beta_2", "gamma_2", "use_3"], ORDINAL)
    assert [(one.name, one.similarity) for one in near] == [
        ("book", 1),
        ("plate", 1),
        ("tray", Fraction(7, 8)),
        ("sponge", Fraction(1, 4)),
        ("ghost", 0),
    ]
    half = nearest_classes(kb, {"alpha_3": Decimal("0.5"), "alpha_2": Decimal("0.5")}, RUZICKA)
    assert half[0].similarity == Fraction(1, 3)


def test_possible_roles_by_degrees(kb: KnowledgeBase) -> None:
    roles = possible_roles(kb, {"alpha_3": 1, "beta_2": 0.75, "beta_1": 0.25, "use_3": 1}, ORDINAL)
    assert [(role.tool, role.accepted) for role in roles[:3]] == [
        ("book", True),
        ("plate", True),
        ("tray", True),
    ]
    with pytest.raises(InputError, match=r"holds alpha_3 to the degree 1\.5"):
        possible_roles(kb, {"alpha_3": 1.5}, ORDINAL)
    with pytest.raises(UnknownNameError):
        possible_roles(kb, {"alpah_3": 1}, ORDINAL)


def names(ranking: Ranking) -> list[str]:
    return [one.name for one in ranking]


def test_top_is_the_beginning_of_the_whole() -> None:
    kb = KnowledgeBase.open("household")
    every = names(rank_substitutes(kb, "bowl", settings=ORDINAL))
    assert len(every) == 22
    assert names(rank_substitutes(kb, "bowl", settings=ORDINAL, top=5)) == every[:5]
