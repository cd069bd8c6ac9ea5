"""The shipped benchmark is what its rules derive from its sources."""

from pathlib import Path

import numpy as np
import pytest

from ersatz.errors import InputError
from ersatz.evaluation import facts
from ersatz.evaluation.benchmark import TASKS, draw, verdicts, write
from ersatz.evaluation.facts import Facts, read_facts
from ersatz.evaluation.rivals.wordnet import SENSES
from ersatz.evaluation.scenario_files import SHIPPED, load_scenarios

NOTHING = Facts(None, None, None, None, None, None, None, frozenset())


@pytest.fixture(scope="module")
def sources(shared_data: Path) -> dict[str, Facts]:
    return read_facts(shared_data)


def test_the_shipped_files_are_derived(sources: dict[str, Facts], tmp_path: Path) -> None:
    write(sources, tmp_path / "scenarios.csv")
    for made in (tmp_path / "scenarios.csv", tmp_path / "scenarios.md"):
        assert made.read_bytes() == SHIPPED["benchmark"].with_name(made.name).read_bytes()


def test_it_covers_the_categories() -> None:
    scenarios = load_scenarios("benchmark")
    assert len(scenarios) >= 66
    tools = [s.missing for s in scenarios]
    assert set(tools) == set(SENSES) - {"tray"}
    assert min(map(tools.count, tools)) >= 3
    for s in scenarios:
        assert len(s.available) == 5
        assert s.accepted is not None
        assert 1 <= len(s.accepted) <= 3
        assert s.task


def test_nothing_is_known_of_nothing() -> None:
    assert all(task.judge(NOTHING) is None for task in TASKS)
    assert draw({"thing": NOTHING}) == ()


def test_rules_by_hand() -> None:
    can = Facts((0.11, 0.08, 0.08), 1.0, 0.78, None, 0.35, 0.9, 1, frozenset({"roll"}))
    towel = Facts((0.2, 0.16, 0.03), 0.2, 0.5, 0.0, 0.05, 0.1, 3, frozenset({"dry"}))
    said = verdicts({"can": can, "towel": towel})
    can_do = {task: v["can"] for task, v in said.items() if v["can"] is not None}
    fit = {task for task, verdict in can_do.items() if verdict}
    assert fit == {"dough", "toy", "hold_open", "raise"}
    assert set(can_do) - fit == {"wipe", "pad", "carry", "cover"}
    assert {task for task, v in said.items() if v["towel"]} == {"wipe", "pad", "cover"}


def test_hardness_is_undecided_where_sources_differ() -> None:
    def hard(rigid: float | None, softness: int | None) -> bool | None:
        return Facts(None, None, None, None, None, rigid, softness, frozenset()).hard

    assert [hard(0.9, 1), hard(0.2, 3), hard(0.5, None), hard(0.9, 3), hard(None, 1), hard(None, 2)] == [
        True, False, None, None, True, None,
    ]  # fmt: skip


def test_cavity_of_a_cup_and_of_a_ball() -> None:
    """A cylinder of 4 cm radius and 8 cm depth, open at the top, holds 0.40 l; a closed ball nothing."""
    chance = np.random.default_rng(0)
    turn, height, radius = chance.random((3, 60_000))
    angle = 2 * np.pi * turn
    wall = np.stack([0.04 * np.cos(angle), 0.04 * np.sin(angle), 0.08 * height], axis=1)
    r = 0.04 * np.sqrt(radius)
    floor = np.stack([r * np.cos(angle), r * np.sin(angle), np.zeros_like(r)], axis=1)
    assert facts._cavity(np.vstack([wall, floor])) == pytest.approx(0.40, rel=0.15)
    sphere = chance.normal(size=(60_000, 3))
    assert facts._cavity(0.04 * sphere / np.linalg.norm(sphere, axis=1, keepdims=True)) < 0.01


def test_facts_are_the_sources(sources: dict[str, Facts]) -> None:
    found = sources
    assert set(found) == set(SENSES) - {"tray"}
    assert found["binder"].extents is None
    assert found["binder"].mass == 0.739
    assert found["water bottle"].mass == 0.499
    assert found["pitcher"].affordances == {"grasp", "wrap", "contain", "pour"}
    assert "support" not in found["ball"].affordances


def test_sources_that_are_not_there(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="sources are not here"):
        read_facts(tmp_path)
