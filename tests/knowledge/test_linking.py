"""Linking with other ontologies: questions across the border, and what is refused."""

import re
from pathlib import Path
from typing import Any

import pyoxigraph as ox
import pytest

from ersatz.errors import InputError, UnknownNameError
from ersatz.knowledge import linking
from tests.knowledge import answers
from tests.knowledge.linked import ONTOLOGIES, linked
from tests.readme import between
from tests.reasoners import ROOT

QUESTIONS = sorted((ROOT / "sparql" / "linked").glob("*.rq"))

# Two bowls, two cereal boxes, ...: the answers can be read off the comments of the kitchen's data.
BOWLS = ("bowl_01", "bowl_02")
BOWL_REGIONS = ("containment_3", "hollowness_2", "rigidity_2", "support_1", "weight_2")
ANSWERS: dict[str, set[tuple[str, ...]]] = {
    "cora_objects": {("CorpuscularObject", "20")},
    "isaac_containment": {("Bowl", "3"), ("CoffeeMug", "2"), ("WaterBottle", "2")},
    "isaac_schemas_of_answers": {
        ("Flashlight", "CONTAINMENT", "1"),
        ("Flashlight", "SUPPORT", "1"),
        ("Tray", "CONTAINMENT", "1"),
        ("Tray", "SUPPORT", "2"),
        ("WaterBottle", "CONTAINMENT", "2"),
        ("WaterBottle", "SUPPORT", "1"),
    },
    "knowrob_flashlight": {
        ("CerealBox", "1"),
        ("FoodCan", "1"),
        ("Plate", "1"),
        ("Tray", "0.75"),
        ("Bowl", "0.5"),
        ("CoffeeMug", "0.5"),
    },
    "knowrob_limp_things": {("HandTowel", "Towel")},
    "knowrob_tools_with_support": {("Flashlight", "Plate"), ("Flashlight", "Tray")},
    "oro_bottle_stand_ins": {("WaterBottle", "Bowl"), ("WaterBottle", "CoffeeMug"), ("WaterBottle", "Tray")},
    "oro_containers": {("CerealBox", "1", "2", "2"), ("WaterBottle", "2", "2", "2")},
    "prov_builds": {("build_1", "Measurement", "100")},
    "soma_mass_of_crockery": {("Bowl", "0.35", "2"), ("CoffeeMug", "0.325", "2"), ("Plate", "0.4", "2")},
    "soma_poor_containers": {(name, "containment 1 of 3") for name in ("CerealBox", "FoodCan", "Plate")},
    "soma_regions": {(bowl, region) for bowl in BOWLS for region in BOWL_REGIONS},
    "soma_tableware_for_support": {("WaterBottle", "Tray")},
    "soma_unknown_classes": {("Flashlight",), ("HandTowel",), ("Sponge",), ("Tray",)},
    "soma_unrelated_substitutes": {
        *(("Flashlight", name) for name in ("Bowl", "CerealBox", "CoffeeMug", "FoodCan", "Plate", "Tray")),
        *(("Tray", name) for name in ("Bowl", "CerealBox", "CoffeeMug", "Flashlight", "FoodCan", "Plate")),
        ("WaterBottle", "Tray"),
    },
    "sosa_observations": {
        *(
            ("bowl_01", *pair)
            for pair in (("containment", "1.1"), ("hollowness", "0.8"), ("rigidity", "0.95"))
        ),
        *(("bowl_01", *pair) for pair in (("support", "0.004"), ("weight", "0.3"))),
        *(
            ("bowl_02", *pair)
            for pair in (("containment", "1.3"), ("hollowness", "0.85"), ("rigidity", "0.9"))
        ),
        *(("bowl_02", *pair) for pair in (("support", "0.005"), ("weight", "0.4"))),
    },
}
SURE: dict[str, tuple[str, ...]] = {
    "cora_objects": ("corpuscular object", "126"),
    "isaac_containment": ("tray", "3"),
    "isaac_schemas_of_answers": ("tray", "SUPPORT", "4"),
    "knowrob_flashlight": ("shampoo",),
    "knowrob_limp_things": ("hand towel", "towel"),
    "oro_bottle_stand_ins": ("water bottle", "soda can"),
    "oro_containers": ("food box", "1"),
    "prov_builds": ("build_1", "substitution model"),
    "soma_mass_of_crockery": ("coffee mug",),
    "soma_poor_containers": ("cereal box", "containment_1"),
    "soma_regions": ("gso_red_bowl", "rigidity_4"),
    "soma_tableware_for_support": ("plate", "tray"),
    "soma_unknown_classes": ("sponge",),
    "soma_unrelated_substitutes": ("food can", "soda can"),
    "sosa_observations": ("a16_platinum_pets_dog_bowl", "weight", "0.039"),
}
"""One row of each answer of household that does not hang on where a quality's border lies; where none is
named, there is no answer: nothing long and round supports much."""


def local(term: Any) -> str:
    return re.split(r"[#/]", term.value)[-1]


def test_every_bridge_is_tried() -> None:
    assert set(linking.BRIDGES) == set(ONTOLOGIES)
    assert {file.stem for file in QUESTIONS} == set(ANSWERS)
    assert len(QUESTIONS) >= 12


@pytest.mark.parametrize("question", QUESTIONS, ids=lambda file: file.stem)
def test_question_across_the_border(question: Path, shared_data: Path) -> None:
    text = question.read_text()
    head = re.match(r"#\+ summary: .*\?\n#\+ description: .*\.\n#\+ bridge: (\w+)\n", text)
    assert head, "a question, its description, its bridge"
    rows: Any = linked(head[1], shared_data).query(text)
    names = [variable.value for variable in rows.variables]
    assert {tuple(local(row[name]) for name in names) for row in rows} == ANSWERS[question.stem]


@pytest.mark.parametrize("question", QUESTIONS, ids=lambda file: file.stem)
def test_household_answers_across_the_border(question: Path, shared_data: Path) -> None:
    """What a person finds right of some rows; the README shows the rest."""
    names, rows = answers.ask(question, shared_data)
    assert bool(rows) == (question.stem in SURE)
    for sure in filter(None, [SURE.get(question.stem)]):
        assert sure in {row[: len(sure)] for row in rows}, (names, rows)


def test_readme_shows_the_answers_of_household(shared_data: Path) -> None:
    shown = between(answers.BEGIN, answers.END)
    assert shown == answers.table(shared_data), "python -m tests.knowledge.answers --readme"


def test_what_the_knowledge_base_does_not_hold_is_left_out(shared_data: Path) -> None:
    kb = "https://w3id.org/ersatz/kb#"
    graph = linked("soma", shared_data)
    assert any(graph.quads_for_pattern(ox.NamedNode(kb + "Bowl"), None, None))
    assert not any(graph.quads_for_pattern(ox.NamedNode(kb + "FoodJar"), None, None))
    headers: Any = graph.query("SELECT ?o { ?o a <http://www.w3.org/2002/07/owl#Ontology> }")
    assert len(list(headers)) == 1
    assert not any(graph.quads_for_pattern(None, ox.NamedNode("http://www.w3.org/2002/07/owl#imports"), None))


def test_bad_bridges_and_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(UnknownNameError, match="soma"):
        linking.link([], "sooma")
    junk = tmp_path / "junk.owl"
    junk.write_bytes(b"\x00junk")
    with pytest.raises(InputError, match=r"junk\.owl"):
        linking.link([], "soma", [junk])
