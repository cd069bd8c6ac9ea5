"""rank_substitutes: its answer's order and flags, what it refuses, what it remembers and when it forgets."""

import json
from fractions import Fraction

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ersatz.errors import InputError, KnowledgeBaseError, UnknownNameError
from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.validation import check
from ersatz.knowledge.vocabulary import ERSATZ, KB, OWL, RDF, RDFS
from ersatz.reasoner.asking import ask_for_more
from ersatz.reasoner.relevance import Combine, ReasonerSettings
from ersatz.reasoner.similarity import CRISP, Similarity
from ersatz.reasoner.substitution import Ranking, Status, rank_substitutes
from tests.making import Held, held_kb, prop
from tests.reasoner.worlds import PROPERTIES, RANKS, helds, make

TRAY = {"alpha": 3, "beta": 2, "gamma": 1, "hold": 1, "use": 3}
HELD: Held = {
    "tray 1": ("tray", TRAY),
    "tray 2": ("tray", TRAY),
    "plate 1": ("plate", {"alpha": 3, "beta": 2, "gamma": 2, "use": 3}),
    "sponge 1": ("sponge", {"alpha": 1, "beta": 1, "gamma": 1, "use": 1}),
    "book 1": ("book", {"alpha": 3, "beta": 2, "gamma": 2, "use": 3}),
    "ghost 1": ("ghost", {"hold": 2}),
}


@pytest.fixture
def kb() -> KnowledgeBase:
    return make(HELD)


def names(ranking: Ranking) -> list[str]:
    return [one.name for one in ranking]


def plain(ranking: Ranking) -> str:
    """Return the answer as text, but for whether it was remembered and by which revision."""
    return json.dumps({k: v for k, v in ranking.to_json().items() if k != "reused"}, sort_keys=True)


def test_candidates_come_by_similarity_then_name(kb: KnowledgeBase) -> None:
    found = rank_substitutes(kb, "tray")
    assert [(one.name, one.fraction, one.accepted) for one in found] == [
        ("book", Fraction(2, 4), True),
        ("plate", Fraction(2, 4), True),
        ("sponge", Fraction(1, 5), False),
        ("ghost", Fraction(0), False),
    ]
    assert found.status is Status.OK
    assert found.relevant_functional == ("hold_1", "use_3")
    assert found.relevant_physical == ("alpha_3", "beta_2", "gamma_1")


def test_the_tool_itself_is_never_a_candidate(kb: KnowledgeBase) -> None:
    assert "tray" not in names(rank_substitutes(kb, "tray"))
    assert names(rank_substitutes(kb, "tray", ["tray", "plate", "tray"])) == ["plate"]
    assert names(rank_substitutes(kb, "kb:Tray", ["kb:Tray", "sponge"])) == ["sponge"]


def test_nothing_available_is_an_error(kb: KnowledgeBase) -> None:
    with pytest.raises(InputError, match="nothing is available but 'tray' itself"):
        rank_substitutes(kb, "tray", ["tray"])
    with pytest.raises(InputError, match="nothing is available"):
        rank_substitutes(kb, "tray", [])
    alone = make({"tray 1": ("tray", TRAY)})
    with pytest.raises(InputError, match="'tray' is the only class known"):
        rank_substitutes(alone, "tray")


def test_one_string_is_not_a_list_of_names(kb: KnowledgeBase) -> None:
    with pytest.raises(InputError, match="lists of names"):
        rank_substitutes(kb, "tray", "plate")
    with pytest.raises(InputError, match="lists of names"):
        rank_substitutes(kb, "tray", instances="plate 1")
    with pytest.raises(InputError, match="properties is 'alpha': give a list of names, not one string"):
        ReasonerSettings(properties="alpha")  # type: ignore[arg-type]


def test_unknown_names_are_refused_with_the_nearest(kb: KnowledgeBase) -> None:
    with pytest.raises(UnknownNameError, match="unknown class 'tary': did you mean 'tray'"):
        rank_substitutes(kb, "tary")
    with pytest.raises(UnknownNameError, match="unknown class 'plat': did you mean 'plate'"):
        rank_substitutes(kb, "tray", ["book", "plat"])
    with pytest.raises(UnknownNameError, match="unknown instance 'plate 7': did you mean 'plate 1'"):
        rank_substitutes(kb, "tray", instances=["plate 7"])
    with pytest.raises(UnknownNameError, match="unknown class 'plate 1'"):
        rank_substitutes(kb, "tray", ["plate 1"])
    with pytest.raises(InputError, match="property 'alphas' is not in this knowledge base"):
        rank_substitutes(kb, "tray", settings=ReasonerSettings(properties=("alphas",)))


def test_what_was_added_or_broken_by_hand_is_one_clear_error(kb: KnowledgeBase) -> None:
    kb.tell([], [f"<{KB}Vessel> <{RDF}type> <{OWL}Class> .\n", f'<{KB}Vessel> <{RDFS}label> "vessel"@en .\n'])
    for missing, available in (("vessel", ["tray"]), ("tray", ["vessel"])):
        with pytest.raises(InputError, match="class 'vessel' has no model, or no English label"):
            rank_substitutes(kb, missing, available)
    with pytest.raises(InputError, match="class 'vessel' has no model, or no English label"):
        ask_for_more(kb, "vessel", held=[])
    kb.tell([f'<{KB}plate_1> <{RDFS}label> "plate 1"@en .\n'], [])
    with pytest.raises(InputError, match="'plate_1' or its class has no English label"):
        rank_substitutes(kb, "tray", instances=["kb:plate_1"])
    kb.tell([f"<{KB}alpha_1> <{ERSATZ}qualityOf> <{KB}alpha> .\n"], [])
    with pytest.raises(KnowledgeBaseError, match="counts 'alpha_1', which is no quality it describes"):
        rank_substitutes(kb, "tray")


@pytest.mark.parametrize("top", [1, 2, 3, 4, 5, 100])
def test_top_is_the_beginning_of_the_whole(kb: KnowledgeBase, top: int) -> None:
    assert names(rank_substitutes(kb, "tray", top=top)) == names(rank_substitutes(kb, "tray"))[:top]


@pytest.mark.parametrize("top", [0, -1])
def test_top_of_nothing_is_an_error(kb: KnowledgeBase, top: int) -> None:
    with pytest.raises(InputError, match=f"top is {top}"):
        rank_substitutes(kb, "tray", top=top)


def test_instances_are_judged_by_what_they_hold(kb: KnowledgeBase) -> None:
    found = rank_substitutes(kb, "tray", ["sponge"], instances=["tray 2", "plate 1"])
    assert [(o.name, o.kind, o.fraction, o.flags) for o in found] == [
        ("tray 2", "instance", Fraction(1), ("same_class",)),
        ("plate 1", "instance", Fraction(2, 4), ()),
        ("sponge", "class", Fraction(1, 5), ()),
    ]
    assert names(rank_substitutes(kb, "tray", instances=["plate 1"])) == ["plate 1"]


def test_an_instance_named_twice_is_one_candidate(kb: KnowledgeBase) -> None:
    found = rank_substitutes(kb, "tray", instances=["plate 1", "kb:plate_1", "plate 1"])
    assert names(found) == ["plate 1"]


def test_a_candidate_of_which_nothing_physical_is_known_is_flagged(kb: KnowledgeBase) -> None:
    (ghost,) = rank_substitutes(kb, "tray", ["ghost"])
    assert (ghost.fraction, ghost.accepted, ghost.flags) == (Fraction(0), False, ("unknown",))


def test_without_a_relevant_function_the_answer_is_undetermined(kb: KnowledgeBase) -> None:
    found = rank_substitutes(kb, "ghost")
    assert found.status is Status.UNDETERMINED
    assert found.relevant_physical == found.relevant_functional == ()
    assert not any(one.accepted for one in found)
    assert all("undetermined" in one.flags for one in found)
    assert all("undetermined, no function of a ghost is relevant" in one.explain() for one in found)


def test_fallback_compares_with_all_that_is_typical_and_says_so(kb: KnowledgeBase) -> None:
    chosen = ReasonerSettings(relevance_tolerance=Fraction(1), fallback=True)
    found = rank_substitutes(kb, "tray", settings=chosen)
    assert found.status is Status.OK
    assert found.relevant_physical == ("alpha_3", "beta_2", "gamma_1")
    assert found.relevant_functional == ()
    assert all("fallback" in one.flags for one in found)


def test_a_tool_of_which_nothing_physical_is_known_has_empty_sets(kb: KnowledgeBase) -> None:
    """J of two empty sets is 0, also with the fallback."""
    found = rank_substitutes(kb, "ghost", settings=ReasonerSettings(fallback=True, tolerance=Fraction(0)))
    assert [one.fraction for one in found] == [0, 0, 0, 0]
    assert not any(one.accepted for one in found)


REMEMBERED = [
    ReasonerSettings(),
    ReasonerSettings(combine=Combine.INTERSECTION, similarity=Similarity.TVERSKY),
    ReasonerSettings(above_lowest=True),
    ReasonerSettings(relevance_tolerance=Fraction(1), fallback=True),
    ReasonerSettings(tolerance=Fraction(1, 4), properties=("alpha", "beta", "use")),
]


@pytest.mark.parametrize("chosen", REMEMBERED)
@pytest.mark.parametrize("available", [None, ["plate", "sponge"]])
def test_a_remembered_answer_is_found_again_and_is_the_same(
    kb: KnowledgeBase, chosen: ReasonerSettings, available: list[str] | None
) -> None:
    first = rank_substitutes(kb, "tray", available, settings=chosen, remember=True)
    assert not first.reused
    again = rank_substitutes(kb, "tray", available, settings=chosen)
    assert again.reused
    assert plain(again) == plain(first)
    assert [one.explain() for one in again] == [one.explain() for one in first]
    assert again.model() == first.model() == kb.substitution_model("tray")


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(helds(), st.sampled_from(list(Combine)), st.sampled_from(CRISP))
def test_remembering_never_changes_an_answer(held: Held, combine: Combine, form: Similarity) -> None:
    kb = make(held)
    chosen = ReasonerSettings(combine=combine, similarity=form, relevance_tolerance=Fraction(0))
    instances = list(held)[:2]
    every = [label for label, _ in held.values()]
    first = rank_substitutes(kb, every[0], every, instances=instances, settings=chosen, remember=True)
    again = rank_substitutes(kb, every[0], every, instances=instances, settings=chosen)
    assert again.reused is (first.status is Status.OK)
    assert plain(again) == plain(first)


def test_an_answer_is_not_reused_under_other_settings_or_for_other_tools(kb: KnowledgeBase) -> None:
    rank_substitutes(kb, "tray", remember=True)
    assert not rank_substitutes(kb, "tray", settings=ReasonerSettings(tolerance=Fraction(1, 2))).reused
    assert not rank_substitutes(kb, "plate").reused


def test_an_answer_is_reused_only_if_it_covers_what_is_available(kb: KnowledgeBase) -> None:
    rank_substitutes(kb, "tray", ["plate", "book"], remember=True)
    assert rank_substitutes(kb, "tray", ["plate"]).reused
    assert names(rank_substitutes(kb, "tray", ["plate"])) == ["plate"]
    assert not rank_substitutes(kb, "tray", ["plate", "sponge"]).reused
    assert not rank_substitutes(kb, "tray").reused


def test_answers_under_the_same_settings_are_joined(kb: KnowledgeBase) -> None:
    rank_substitutes(kb, "tray", ["plate"], remember=True)
    rank_substitutes(kb, "tray", ["sponge"], instances=["book 1"], remember=True)
    model = kb.substitution_model("tray")
    assert model is not None
    assert [c.iri.rpartition("#")[2] for c in model.candidates] == ["Plate", "Sponge", "book_1"]
    assert [iri.rpartition("#")[2] for iri in model.substitutes] == ["Plate", "book_1"]
    assert rank_substitutes(kb, "tray", ["plate", "sponge"], instances=["book 1"]).reused


def test_an_answer_is_out_of_date_when_knowledge_changes(kb: KnowledgeBase) -> None:
    before = kb.revision
    rank_substitutes(kb, "tray", remember=True)
    assert kb.revision == before
    kb.observe("plate", "plate 2", {"alpha": 1.0, "beta": 1.0})
    assert kb.revision != before
    assert kb.substitution_model("tray") is None
    assert not rank_substitutes(kb, "tray").reused
    kb.forget("plate 2")
    assert kb.revision == before


def test_forgetting_takes_remembered_answers_away_and_nothing_else(kb: KnowledgeBase) -> None:
    before = set(map(str, kb.triples()))
    kb.observe("plate", "plate 2", {"alpha": 1.0, "beta": 1.0})
    rank_substitutes(kb, "tray", remember=True)
    kb.forget("plate 2")
    after = {line for line in map(str, kb.triples()) if "kb#source_observation" not in line}
    assert after == before


def test_answers_are_remembered_for_classes_in_any_script() -> None:
    """Some scripts have no capital letters, and some names begin with digits."""
    kb = make({"one": ("杯子", TRAY), "two": ("7up can", TRAY), "three": ("plate", TRAY)})
    for tool in ("杯子", "7up can"):
        first = rank_substitutes(kb, tool, instances=["two"], remember=True)
        again = rank_substitutes(kb, tool, instances=["two"])
        assert again.reused
        assert again.model() == first.model() == kb.substitution_model(tool)
    assert check(kb.triples(), rules=["candidate_kind", "punned_class"]).ok


def test_answers_for_tools_whose_names_differ_in_case_are_kept_apart() -> None:
    kb = make({"one": ("food can", TRAY), "two": ("foodcan", HELD["plate 1"][1]), "three": ("plate", TRAY)})
    for tool in ("food can", "foodcan"):
        first = rank_substitutes(kb, tool, ["plate"], remember=True)
        assert not first.reused
        assert kb.substitution_model(tool) == first.model()


def test_asking_without_remembering_writes_nothing(kb: KnowledgeBase) -> None:
    before = set(map(str, kb.triples()))
    rank_substitutes(kb, "tray").to_json()
    rank_substitutes(kb, "ghost", remember=True)  # undetermined: there is nothing to remember
    assert set(map(str, kb.triples())) == before


def test_functions_keep_the_order_of_their_ranks_when_remembered() -> None:
    """With ten ranks and more, the order of names is another one."""
    held = {f"tray {n}": ("tray", {"alpha": 1, "use": n}) for n in (2, 10)}
    kb = held_kb({**held, "cup 1": ("cup", {"alpha": 1})}, PROPERTIES, 10)
    first = rank_substitutes(kb, "tray", remember=True)
    assert first.relevant_functional == ("use_2", "use_10")
    again = rank_substitutes(kb, "tray")
    assert again.reused
    assert plain(again) == plain(first)


def test_labels_that_differ_in_writing_are_one_class() -> None:
    kb = held_kb({**HELD, "mug 1": ("coffee mug", TRAY)}, PROPERTIES, RANKS)
    for name in ("coffee mug", "Coffee Mug", "CoffeeMug", "kb:CoffeeMug"):
        assert names(rank_substitutes(kb, "tray", [name])) == ["coffee mug"]


def test_more_than_64_qualities() -> None:
    """More than one word of packed bits."""
    properties = [prop(f"p{n}") for n in range(40)] + [prop("use", "functional")]
    full = {p.name: 2 for p in properties}
    half = {p.name: 1 + (n % 2) for n, p in enumerate(properties)}
    held: Held = {"a 1": ("apple", full), "b 1": ("bean", half), "c 1": ("corn", full)}
    found = rank_substitutes(held_kb(held, properties, 3), "apple")
    assert [(one.name, one.fraction) for one in found] == [("corn", 1), ("bean", Fraction(20, 60))]
