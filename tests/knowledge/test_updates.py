"""Incremental equals batch, and an update that is refused changes nothing."""

from collections.abc import Mapping
from decimal import Decimal
from fractions import Fraction

import pyoxigraph as ox
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ersatz.errors import ErsatzError, InputError
from ersatz.grounding.units import ObservationUnit
from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.models import SubstitutionModel
from ersatz.knowledge.reader import read_qualities
from ersatz.knowledge.stores import MemoryStore
from ersatz.knowledge.substitutions import remember, substitution_iri
from ersatz.knowledge.updates import observe_blocks
from ersatz.knowledge.vocabulary import KB, LABEL
from ersatz.measurements import Kind
from tests.knowledge.tools import (
    RIGIDITY,
    ROWS,
    SIZE,
    SUPPORT,
    WEIGHT,
    Row,
    assert_whole,
    blocks,
    facts_of,
    ground,
    lines_of,
    small,
)

PROPERTIES = [WEIGHT, RIGIDITY, SIZE, SUPPORT]
VALUES = st.floats(-1, 2).map(lambda x: round(x, 4))
BOWL = "<https://w3id.org/ersatz/kb#Bowl>"


@st.composite
def things(draw: st.DrawFn) -> dict[str, list[Row]]:
    """Draw some instances, each with whole or repeated values of some properties."""
    found: dict[str, list[Row]] = {}
    for number in range(draw(st.integers(1, 4))):
        label = draw(st.sampled_from(["tray", "bowl", "coffee mug"]))
        name = f"thing {number}"
        rows: list[Row] = []
        for prop in draw(
            st.lists(st.sampled_from([WEIGHT, RIGIDITY, SIZE, SUPPORT]), min_size=1, unique=True)
        ):
            for seen in draw(st.sampled_from([[""], ["a"], ["a", "b c", "3"]])):
                value = tuple(draw(VALUES) for _ in range(prop.dimensions))
                rows.append((prop, label, name, seen, value))
        found[name] = rows
    return found


@settings(max_examples=20, deadline=None)
@given(
    things(),
    st.randoms(use_true_random=False),
    st.sampled_from(ObservationUnit),
    st.sampled_from([1.0, 1.3, 2.0]),
)
def test_any_order_of_observing_and_forgetting_equals_grounding_what_is_left(
    found: dict[str, list[Row]], chance: "object", unit: ObservationUnit, fuzzifier: float
) -> None:
    kb = small(unit=unit, fuzzifier=fuzzifier)
    qualities = read_qualities(kb)
    steps = [row for rows in found.values() for row in rows]
    chance.shuffle(steps)  # type: ignore[attr-defined]
    for row in steps:
        observe_blocks(kb, row[1], row[2], blocks([row]))
    gone = [name for at, name in enumerate([*found, "tray 1", "sponge 1"]) if at % 2]
    chance.shuffle(gone)  # type: ignore[attr-defined]
    for name in gone:
        kb.forget(name)
    left = [row for row in [*ROWS, *steps] if row[2] not in gone]
    expected = ground(left, qualities, unit)
    assert facts_of(kb) == facts_of(expected)
    assert kb.revision == expected.revision
    assert_whole(kb)


@pytest.mark.parametrize("fuzzifier", [1.0, 2.0])
def test_all_can_be_forgotten_and_learned_again(fuzzifier: float) -> None:
    kb = small(fuzzifier=fuzzifier)
    facts, revision = facts_of(kb), kb.revision
    names = sorted({row[2] for row in ROWS})
    for name in names:
        kb.forget(name)
    assert len(kb.ask("classes")) == len(kb.ask("all_instances")) == len(kb.ask("function_models")) == 0
    assert_whole(kb)
    for row in reversed(ROWS):
        observe_blocks(kb, row[1], row[2], blocks([row]))
    assert (facts_of(kb), kb.revision) == (facts, revision)


@pytest.mark.parametrize(
    ("name", "label"), [("Tray", "serving tray"), ("tray_1", "the old tray")], ids=["class", "instance"]
)
@pytest.mark.parametrize("beside", [False, True], ids=["instead", "beside"])
def test_what_was_renamed_by_hand_is_not_torn(name: str, label: str, beside: bool) -> None:
    kb = small()
    subject = f"<{KB}{name}> {LABEL}"
    was = kb.query(f"SELECT ?label {{ {subject} ?label }}")[0]["label"]
    kb.tell([] if beside else [f'{subject} "{was}"@en .\n'], [f'{subject} "{label}"@en .\n'])
    facts = facts_of(kb)
    object_class = label if name == "Tray" else "tray"
    refused = f"'{name}' has been given the label '{label}'"
    with pytest.raises(InputError, match=refused):
        kb.forget("tray_1")
    for instance in ("tray 1", "tray 9") if name == "Tray" else ("tray 1",):
        with pytest.raises(InputError, match=refused):
            kb.observe(object_class, instance, {"weight": 1.0})
    assert facts_of(kb) == facts


@pytest.mark.parametrize(
    ("label", "name", "values", "seen", "message"),
    [
        ("plate", "tray 1", {"weight": 1.0}, "x", "instance 'tray 1' is said to be of class 'plate'"),
        ("tray", "tray 1", {"weight": 1.0}, "", "has two values"),
        ("tray", "tray 1", {"weight": 1.0}, "x", "name every observation, or none"),
        ("plate", "plate 2", {"weight": 1.0}, "a", "two values for observation 'a'"),
        ("plate", "plate 2", {"weight": 1.0}, "A", "would both be called"),
        ("tray", "tray 3", {"size": [1.0, 2.0]}, "", "3 component"),
        ("tray", "tray 3", {"weight": [1.0, 2.0]}, "", "component"),
        ("tray", "tray 3", {"weight": float("nan")}, "", "finite"),
        ("tray", "tray 3", {"weight": float("inf")}, "", "finite"),
        ("tray", "tray 3", {"weight": "heavy"}, "", "'weight' is 'heavy': give a number"),
        ("tray", "tray 3", {"colour": 1.0}, "", "property 'colour' has no qualities here"),
        ("tray", "tray 3", {}, "", "no measurements"),
        ("tray", "", {"weight": 1.0}, "", "."),
        ("tray", "-", {"weight": 1.0}, "", "cannot be a name"),
        ("Tray", "tray 3", {"weight": 1.0}, "", "would be called like class 'tray'"),
        ("tray", "tray-1", {"weight": 1.0}, "x", "would be called like 'tray 1'"),
        ("tray", "weight", {"weight": 1.0}, "", "would both be called|taken"),
        ("tray", "build 1", {"weight": 1.0}, "", "would both be called|taken"),
        ("tray", "model support 1", {"weight": 1.0}, "", "would both be called|taken"),
        ("茶碗", "茶碗", {"weight": 1.0}, "", "would both be called"),
    ],
)
def test_a_refused_observation_changes_nothing(
    label: str, name: str, values: Mapping[str, float], seen: str, message: str
) -> None:
    kb = small()
    before, revision = lines_of(kb), kb.revision
    with pytest.raises(ErsatzError, match=message) as error:
        kb.observe(label, name, values, observation=seen)
    assert "\n" not in str(error.value)
    assert (lines_of(kb), kb.revision) == (before, revision)


def test_forgetting_what_is_not_there_changes_nothing() -> None:
    kb = small()
    before = lines_of(kb)
    for name in ("tray 3", "tray", "weight", "kb:nothing"):
        with pytest.raises(ErsatzError):
            kb.forget(name)
    assert lines_of(kb) == before


def test_classes_alone_cannot_be_updated() -> None:
    kb = small(classes_only=True)
    before = lines_of(kb)
    with pytest.raises(ErsatzError, match="holds classes only"):
        kb.observe("tray", "tray 3", {"weight": 1.0})
    with pytest.raises(ErsatzError):
        kb.forget("tray 1")
    assert lines_of(kb) == before
    assert_whole(kb)


def test_forget_takes_remembered_answers_with_it() -> None:
    kb = small()
    tool = kb.resolve("tray", "class")
    share = Fraction(7, 20)
    iri = substitution_iri(tool, "{}", kb.revision)
    model = SubstitutionModel(iri, tool, "{}", share, share, share, kb.revision, (), (), ())
    revision = kb.revision
    remember(kb, model)
    assert kb.revision == revision
    assert kb.substitution_model("tray") == model
    assert_whole(kb)
    kb.forget("sponge 1")
    assert kb.substitution_model("tray") is None
    assert not any("substitution" in line for line in lines_of(kb))
    without = small()
    without.forget("sponge 1")
    assert lines_of(kb) == lines_of(without)


@pytest.mark.parametrize(
    ("name", "value", "allowed"),
    [("rigidity", 96, "between 0 and 1"), ("weight", -0.3, "0 or more"), ("size", [1, -1, 1], "0 or more")],
)
def test_what_no_table_may_say_is_not_observed_either(name: str, value: float, allowed: str) -> None:
    kb = small()
    with pytest.raises(InputError, match=f"{name}.*: it is {allowed}; correct the value or its unit"):
        kb.observe("tray", "tray 9", {name: value})
    assert_whole(kb)


def test_what_people_wrote_about_a_class_survives() -> None:
    kb = small()
    qualities = read_qualities(kb)
    assert {quality.property.kind for quality in qualities} == {Kind.PHYSICAL, Kind.FUNCTIONAL}
    tray = "<https://w3id.org/ersatz/kb#Tray>"
    notes = {
        f"{tray} <http://www.w3.org/2000/01/rdf-schema#subClassOf> <http://example.org/Tray> .\n",
        f'{tray} <http://www.w3.org/2000/01/rdf-schema#label> "Tablett"@de .\n',
        '<https://w3id.org/ersatz/kb#tray_1> <http://www.w3.org/2000/01/rdf-schema#label> "Tablett 1"@de .\n',
    }
    length = f'<{KB}size-length> {LABEL} "the longest side"@en .\n'
    kb.tell([f'<{KB}size-length> {LABEL} "length"@en .\n'], notes | {length})
    kb.observe("tray", "tray 3", {"weight": 0.8})
    assert notes | {length} <= lines_of(kb)
    assert kb.ask("class", **{"class": "tray"})[0]["instances"] == Decimal(3)
    kb.forget("tray 3")
    for name in ("tray 1", "tray 2"):
        kb.forget(name)
    assert len(kb.ask("classes")) == 2
    kb.observe("tray", "tray 1", {"weight": 0.8})
    assert len(kb.ask("classes")) == 3
    assert_whole(kb)


@pytest.mark.parametrize(
    ("edit", "problem"),
    [
        ("DELETE { ?m e:rawValue ?x } INSERT { ?m e:rawValue 0.1 } "
         "WHERE { BIND (kb:tray_1__weight AS ?m) ?m e:rawValue ?x }", "more was measured of 'tray'"),
        ("DELETE WHERE { kb:tray_1__weight e:origin ?x }", "says of 'tray_1': hasMeasurement tray_1__weight"),
        ("DELETE WHERE { kb:tray_1 e:hasMeasurement kb:tray_1__weight }", "says of 'tray_1': holds weight_2"),
        ("DELETE WHERE { kb:model_Tray e:hasEntry ?entry }", "more was measured of 'tray' than is counted"),
        ("DELETE { ?y e:count ?n } INSERT { ?y e:count 2 } "
         "WHERE { kb:model_Tray e:hasEntry ?y . ?y e:count ?n FILTER (?n = 2) }", "of 'Tray__.*': count 2"),
        ("INSERT DATA { kb:tray_1 a kb:Plate }", "'tray 1' is of the classes Plate and Tray"),
    ],
)  # fmt: skip
def test_what_was_edited_by_hand_is_not_counted_on(edit: str, problem: str) -> None:
    kb = small()
    store = ox.Store()
    store.bulk_extend(ox.Quad(*triple) for triple in kb.triples())
    store.update(f"PREFIX kb: <{KB}> PREFIX e: <https://w3id.org/ersatz#> {edit}")
    edited = KnowledgeBase(MemoryStore(store, "edited.ttl"))
    before = lines_of(edited)
    with pytest.raises(InputError, match=problem):
        edited.forget("tray 1")
    assert lines_of(edited) == before
