"""Scenario files: read, refused with reasons, written, generated."""

import json
from pathlib import Path

import pytest

from ersatz.errors import InputError, UnknownNameError
from ersatz.evaluation.scenario_files import load_scenarios, save_scenarios
from ersatz.evaluation.scenarios import NONE, Scenario, check_names, generate, with_ballots

GOOD = """\
id,missing,available,task,accepted,ballots,votes
q1,tray,plate; sponge,"carry, quickly",plate,,
q2,plate,tray;sponge,,-,,
q3,bowl,cup;plate,,,e1=cup;e2=none,
q4,bowl,cup;plate,,,,cup=3;none=1
"""


def test_csv_and_json_say_the_same(tmp_path: Path) -> None:
    (tmp_path / "s.csv").write_text(GOOD, encoding="utf-8")
    scenarios = load_scenarios(tmp_path / "s.csv")
    assert [s.id for s in scenarios] == ["q1", "q2", "q3", "q4"]
    assert scenarios[0].available == ("plate", "sponge")
    assert scenarios[0].accepted == frozenset({"plate"})
    assert scenarios[1].accepted == frozenset()
    assert scenarios[2].accepted is None
    assert scenarios[2].votes == {"cup": 1, NONE: 1}
    assert scenarios[3].voters == 4
    for name in ("again.csv", "again.json"):
        save_scenarios(scenarios, tmp_path / name)
        assert load_scenarios(tmp_path / name) == scenarios


def test_shares_modes_and_chosen() -> None:
    voted = Scenario("q", "tray", ("a", "b", "c"), votes={"a": 2, "b": 2, NONE: 1})
    assert voted.shares() == (0.4, 0.4, 0.0)
    assert voted.modes() == {"a", "b"}
    assert voted.chosen() == {"a", "b"}
    stated = Scenario("q", "tray", ("a", "b"), accepted=frozenset({"b"}))
    assert (stated.shares(), stated.modes(), stated.chosen()) == (
        (0.0, 1.0),
        frozenset({"b"}),
        frozenset({"b"}),
    )
    nothing = Scenario("q", "tray", ("a", "b"), accepted=frozenset())
    assert nothing.modes() == {NONE}
    assert nothing.judged
    assert not Scenario("q", "tray", ("a",)).judged


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "header of a scenario file"),
        ("id,missing,available\n", "holds no scenario"),
        ("id,missing\nq,tray\n", "'available' is missing"),
        ("id,missing,available,colour\nq,tray,a,red\n", "'colour' is not a column"),
        ("id,missing,available\nq,tray,a;a\n", "row 2: scenario 'q'"),
        ("id,missing,available\nq,tray,a;tray\n", "'tray' cannot be among"),
        ("id,missing,available\nq,tray,none\n", "'none' cannot be among"),
        ("id,missing,available\nq,tray,\n", "'available' is missing"),
        ("id,missing,available\nq,tray,a\nq,tray,b\n", "two scenarios are called 'q'"),
        ("id,missing,available\nq,tray,a,b\n", "more fields than the header"),
        ("id,missing,available,accepted\nq,tray,plate,plat\n", "did you mean 'plate'"),
        ("id,missing,available,votes\nq,tray,a,a=few\n", "not whole numbers"),
        ("id,missing,available,votes\nq,tray,a,a\n", "write name=choice"),
        ("id,missing,available,votes\nq,tray,a,a=-1\n", "negative"),
        ("id,missing,available,ballots\nq,tray,a,e=b\n", "unknown choice 'b'"),
        ("id,missing,available,ballots,votes\nq,tray,a,e=a,a=2\n", "give one of them"),
        ('id,missing,available\n"q\nr",tray,a\n', "no line breaks"),
    ],
)
def test_refuses_with_a_reason(tmp_path: Path, text: str, says: str) -> None:
    (tmp_path / "s.csv").write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as error:
        load_scenarios(tmp_path / "s.csv")
    assert says in str(error.value)


@pytest.mark.parametrize(
    ("value", "says"),
    [
        ({}, "holds no scenario"),
        ([1], "object with fields"),
        ([{"id": "q", "missing": "tray", "available": "plate"}], "lists of names"),
        ([{"id": "q", "missing": "tray", "available": ["a"], "x": 1}], "unknown field 'x'"),
    ],
)
def test_refuses_json_with_a_reason(tmp_path: Path, value: object, says: str) -> None:
    (tmp_path / "s.json").write_text(json.dumps(value), encoding="utf-8")
    with pytest.raises(InputError) as error:
        load_scenarios(tmp_path / "s.json")
    assert says in str(error.value)


def test_refuses_files_that_are_not_there(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="benchmark"):
        load_scenarios(tmp_path / "nothing.csv")


def test_generates_the_papers_design() -> None:
    names = [f"class {at}" for at in range(22)]
    queries = generate(names, seed=3)
    assert len(queries) == 22
    assert {q.missing for q in queries} == set(names)
    assert all(len(set(q.available)) == 5 and q.missing not in q.available for q in queries)
    assert generate(names[::-1], seed=3) == queries
    assert generate(names, seed=4) != queries
    for wrong in (0, 22):
        with pytest.raises(InputError, match="candidates"):
            generate(names, wrong)
    with pytest.raises(InputError, match="twice"):
        generate(["a", "a", "b"], 1)


def test_joins_ballots_and_checks_names() -> None:
    scenario = Scenario("q", "tray", ("a", "b"))
    (joined,) = with_ballots([scenario], {"q": {"e1": "a", "e2": "a", "e3": NONE}})
    assert joined.votes == {"a": 2, NONE: 1}
    with pytest.raises(UnknownNameError):
        with_ballots([scenario], {"x": {"e1": "a"}})
    check_names([scenario], ["tray", "a", "b"])
    with pytest.raises(UnknownNameError, match="scenario 'q'"):
        check_names([scenario], ["tray", "a"])
