"""Explanations: word for word on a small knowledge base, and changes that really turn the decision."""

import itertools
import json
from dataclasses import replace
from fractions import Fraction

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from ersatz.reasoner.relevance import ReasonerSettings
from ersatz.reasoner.similarity import CRISP
from ersatz.reasoner.substitution import Ranking, Status, Substitute, rank_substitutes
from tests.making import Held
from tests.reasoner.reference import Options, Qualities, reason, similar
from tests.reasoner.test_reference import settings_of
from tests.reasoner.test_substitution import HELD
from tests.reasoner.worlds import held_by, helds, make, options, world_of_held


def test_explanations_word_for_word() -> None:
    found = rank_substitutes(make(HELD), "tray", ["plate", "sponge", "ghost"], instances=["plate 1"])
    assert [one.explain() for one in found] == [
        "plate, 0.50: as alphic (1 of 1) as a tray, like a tray in beta (1 of 1); lacks its gamma. "
        "What counts follows from hold_1 and use_3. "
        "Refused at a tolerance of 0.5 or without beta_2.",
        "plate 1, 0.50: as alphic (1 of 1) as a tray, like a tray in beta (1 of 1); lacks its gamma. "
        "What counts follows from hold_1 and use_3. "
        "Refused at a tolerance of 0.5 or without beta_2.",
        "sponge, 0.20: like a tray in gamma (1 of 1); lacks its alpha and its beta. "
        "What counts follows from hold_1 and use_3. "
        "Accepted at a tolerance below 0.2 or with alpha_3.",
        "ghost, 0.00: nothing that counts in a tray; lacks its alpha, its beta and its gamma. "
        "What counts follows from hold_1 and use_3. "
        "Accepted with alpha_3 and beta_2.",
    ]


@pytest.mark.parametrize("tolerance", [Fraction(1, 5), Fraction(1, 2), Fraction(2, 4)])
def test_a_similarity_of_just_the_tolerance_is_refused_in_words_too(tolerance: Fraction) -> None:
    """0.2 as a float is a little more than 1/5: words must follow the decision, not the float."""
    chosen = ReasonerSettings(tolerance=tolerance)
    for one in rank_substitutes(make(HELD), "tray", settings=chosen):
        assert ("Refused" in one.explain()) is one.accepted
        assert ("Accepted" in one.explain()) is not one.accepted


def test_evidence_counts_what_was_observed() -> None:
    held: Held = {
        **HELD,
        "plate 2": ("plate", {"alpha": 3, "beta": 1}),
        "plate 3": ("plate", {"alpha": 1}),
    }
    (plate,) = rank_substitutes(make(held), "tray", ["plate"])
    assert [(e.quality, e.count // 10**6, e.total // 10**6, e.functions) for e in plate.shared] == [
        ("alpha_3", 2, 3, ("hold_1", "use_3")),
        ("beta_2", 1, 2, ("hold_1", "use_3")),
    ]
    assert [(e.quality, e.count, e.total // 10**6, e.tool_count // 10**6) for e in plate.lacking] == [
        ("gamma_1", 0, 1, 2)
    ]
    assert [e.quality for e in plate.extra] == ["beta_1", "gamma_2"]


def test_an_instance_without_a_value_is_said_to_be_observed_in_none() -> None:
    held: Held = {**HELD, "pan 1": ("pan", {"alpha": 3, "gamma": 2})}
    (pan,) = rank_substitutes(make(held), "tray", instances=["pan 1"])
    assert [(e.quality, e.count // 10**6, e.total // 10**6) for e in pan.lacking] == [
        ("beta_2", 0, 0),
        ("gamma_1", 0, 1),
    ]


def test_the_layout_of_json_is_stable() -> None:
    (plate,) = rank_substitutes(make(HELD), "tray", ["plate"])
    found = json.loads(json.dumps(plate.to_json()))
    tray = {"tool_observed": [2, 2], "functions": ["hold_1", "use_3"]}
    assert found == {
        "name": "plate",
        "iri": "https://w3id.org/ersatz/kb#Plate",
        "kind": "class",
        "similarity": 0.5,
        "similarity_fraction": [1, 2],
        "accepted": True,
        "flags": [],
        "shared": [
            {"quality": "alpha_3", "property": "alpha", "observed": [1, 1], **tray},
            {"quality": "beta_2", "property": "beta", "observed": [1, 1], **tray},
        ],
        "lacking": [{"quality": "gamma_1", "property": "gamma", "observed": [0, 1], **tray}],
        "extra": [
            {
                "quality": "gamma_2",
                "property": "gamma",
                "observed": [1, 1],
                "tool_observed": [0, 2],
                "functions": [],
            }
        ],
        "counterfactual": {"tolerance": "1/2", "representative": None, "gain": [], "lose": ["beta_2"]},
        "explanation": plate.explain(),
    }
    ranking = rank_substitutes(make(HELD), "tray", ["plate"]).to_json()
    assert list(ranking) == [
        "version",
        "missing",
        "iri",
        "status",
        "settings",
        "revision",
        "reused",
        "relevant_functional",
        "relevant_physical",
        "substitutes",
    ]
    assert json.dumps(ranking) == json.dumps(rank_substitutes(make(HELD), "tray", ["plate"]).to_json())


def holds(one: Substitute) -> Qualities:
    return frozenset(e.quality for e in (*one.shared, *one.extra))


def fewest(relevant: int, shared: int, extra: int, spare: int, form: str, phi: Fraction) -> int | None:
    """Return the fewest qualities to gain or lose that turn the decision, by trying all numbers."""

    def accepts(shared: int, extra: int) -> bool:
        a = frozenset(f"a{n}" for n in range(relevant))
        b = frozenset(f"a{n}" for n in range(shared)) | frozenset(f"x{n}" for n in range(extra))
        return similar(a, b, form) > phi

    before = accepts(shared, extra)
    changes = itertools.product(range(-shared, relevant - shared + 1), range(-extra, spare + 1))
    turning = [abs(s) + abs(e) for s, e in changes if accepts(shared + s, extra + e) != before]
    return min(turning, default=None)


def check_counterfactual(ranking: Ranking, one: Substitute, chosen: Options, held: Held, tool: str) -> None:
    change, world = one.counterfactual(), world_of_held(held)
    instances = {one.name: held_by(held)[one.name]} if one.kind == "instance" else {}
    classes = [] if instances else [one.name]

    def decision(other: Options) -> bool:
        return reason(world, tool, classes, instances, other).accepted[one.name]

    if change.tolerance is not None:
        at = decision(replace(chosen, phi=change.tolerance))
        assert at is False
        if not one.accepted:
            assert decision(replace(chosen, phi=change.tolerance - Fraction(1, 10**6)))
    else:
        assert not one.accepted
        assert not decision(replace(chosen, phi=Fraction(0)))
    models = (*world.classes.values(), *world.functions.values())
    steps = sorted({degree for model in models for degree in model.values()})
    tried = [s for s in steps if s != chosen.theta] + ([Fraction(1)] if chosen.theta < 1 else [])
    if change.representative is None:
        assert all(decision(replace(chosen, theta=s)) is one.accepted for s in tried)
    else:
        side, threshold = change.representative
        above = [s for s in (*steps, Fraction(1)) if s > threshold]
        turned = threshold if side == "at most" else min(above)
        assert decision(replace(chosen, theta=turned)) is not one.accepted
        distance = abs(threshold - chosen.theta)
        for s in tried:  # nothing nearer turns it
            if s < chosen.theta and chosen.theta - s < distance:
                assert decision(replace(chosen, theta=s)) is one.accepted
    if ranking.status is Status.UNDETERMINED:
        assert change.gain == change.lose == ()
        return
    relevant = frozenset(ranking.relevant_physical)
    before, after = holds(one), (holds(one) | set(change.gain)) - set(change.lose)
    assert set(change.gain) <= relevant - before
    assert set(change.lose) <= before
    assert (similar(relevant, before, chosen.similarity) > chosen.phi) is one.accepted
    number = len(change.gain) + len(change.lose)
    least = fewest(
        len(relevant), len(before & relevant), len(before - relevant), 3, chosen.similarity, chosen.phi
    )
    assert number == (least or 0)
    if number:
        assert (similar(relevant, after, chosen.similarity) > chosen.phi) is not one.accepted


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(helds(), options(), st.data())
def test_every_change_named_turns_the_decision(held: Held, chosen: Options, data: st.DataObject) -> None:
    kb = make(held)
    labels = sorted({label for label, _ in held.values()})
    tool = data.draw(st.sampled_from(labels))
    others = [label for label in labels if label != tool]
    assume(others)
    ranking = rank_substitutes(kb, tool, others, instances=list(held)[:2], settings=settings_of(chosen))
    for one in ranking:
        check_counterfactual(ranking, one, chosen, held, tool)
        assert one.explain()


def test_all_forms_of_similarity_have_a_case() -> None:
    assert {form.value for form in CRISP} == {"jaccard", "coverage", "tversky"}
