"""The benchmarks' table: its layout, its ratios, and that the README has the one the command writes."""

import inspect
import json
import re
from dataclasses import replace

from tests.benchmarks.__main__ import BEGIN, END, HEAD, benchmarks, markdown, report
from tests.benchmarks.measuring import Rival, Row, race
from tests.conftest import ROOT

ROW = Row("ask", "3 classes", "sets", (0.5, 1.0, 2.0), (4.0, 2.0, 3.0), 2.0, package="numpy")


def test_a_ratio_is_of_medians_with_the_extremes_of_few_rounds() -> None:
    assert ROW.ratio == 3.0
    assert ROW.spread == (1.5, 8.0)
    assert markdown([ROW]) == HEAD + "| ask | 3 classes | sets | 1 s | 3 s | 3 (1.5–8) | ≥ 2 ✓ |\n"


def test_a_limit_is_held_or_missed_by_the_median() -> None:
    assert ROW.aim == "≥ 2 ✓"
    assert replace(ROW, limit=1.0).aim == "≤ 1 s ✓"
    assert replace(ROW, limit=0.9).aim == "≤ 900 ms missed"
    assert replace(ROW, theirs=()).aim == "≥ 2"
    assert replace(ROW, target=None).aim == ""


def test_times_are_of_one_piece_and_the_limit_stands_in_the_first_row() -> None:
    clock = iter(range(100))
    rivals = [Rival("one", lambda: None, scale=2.0), Rival("other", lambda: None)]
    first, second = race(
        "ask", "4", lambda: None, rivals, 2, clock=lambda: float(next(clock)), limit=3.0, pieces=4
    )
    assert (first.ours, first.theirs, second.theirs) == ((0.25, 0.25), (0.5, 0.5), (0.25, 0.25))
    assert (first.limit, second.limit) == (3.0, None)


def test_a_rival_that_is_not_there_is_a_row_without_figures() -> None:
    calls: list[str] = []
    rivals = [
        Rival("absent", None, package="no-such-package"),
        Rival("slow", lambda: calls.append("slow"), most=1, scale=10.0),
    ]
    absent, slow = race("ask", "small", lambda: calls.append("ours"), rivals, rounds=3)
    assert calls.count("slow") == 1
    assert (absent.theirs, absent.ratio, absent.note) == ((), None, "not installed: no-such-package")
    assert len(slow.theirs) == 1
    assert len(slow.ours) == 3
    said = report([absent, ROW], quick=True)
    assert said["versions"]["no-such-package"] == "not installed"
    assert json.loads(json.dumps(said))["rows"][1]["ratio"] == 3.0


def test_every_benchmark_of_the_convention_is_found() -> None:
    found = benchmarks()
    assert "query" in found
    assert all(list(inspect.signature(run).parameters) == ["quick"] for run in found.values())


def test_the_readme_has_the_table_as_the_command_writes_it() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    table = text.partition(f"{BEGIN}\n")[2].partition(END)[0]
    assert table.startswith(HEAD)
    lines = table.removeprefix(HEAD).splitlines()
    assert lines
    number = r"[\d.e+]+"
    time = rf"(?:{number} (?:s|ms|µs)|—)"
    ratio = rf"(?:{number} \({number}–{number}\)|not installed: \S+)"
    aim = rf"(?:≥ {number}|≤ {time}) (?:✓|missed)"
    for line in lines:
        assert re.fullmatch(
            rf"\| [^|]+ \| [^|]+ \| [^|]+ \| {time} \| {time} \| {ratio} \| (?:{aim})? ?\|",
            line,
        ), line
