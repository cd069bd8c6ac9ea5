"""The experiment as a whole: the same bytes twice, everything written, wrong answers explained."""

import csv
import json
import re
from pathlib import Path

import pytest

from ersatz.errors import InputError, UnknownNameError
from ersatz.evaluation.agreement import METRICS
from ersatz.evaluation.analysis import CAUSES
from ersatz.evaluation.experiment import NESTED, run
from ersatz.evaluation.report import markdown_table, write, write_tables
from ersatz.evaluation.resampling import read_values, resampled, to_blocks
from ersatz.evaluation.results import Results
from ersatz.evaluation.scenario_files import load_scenarios
from ersatz.evaluation.scenarios import Scenario
from ersatz.evaluation.sweeps import over_objects
from ersatz.knowledge.base import KnowledgeBase
from ersatz.measurements import Measurements
from tests.conftest import ROOT
from tests.evaluation.conftest import ground

BASELINES = ["chance", "heaviest", "box-size"]


@pytest.fixture(scope="module")
def results(kb: KnowledgeBase, scenarios: tuple[Scenario, ...]) -> Results:
    return run(kb, scenarios, baselines=BASELINES, ground=ground, resamples=3)


def test_what_was_run(results: Results) -> None:
    assert [s.name for s in results.standings] == ["ersatz", NESTED, "chance", "heaviest"]
    assert set(results.left_out) == {"box-size"}
    assert (len(results.scenarios), results.unjudged) == (3, 1)
    assert results.standings[2].decides is False
    assert all(answer.accepted is not None for answer in results.standings[2].answers)
    assert {cell.parameter for cell in results.cells} >= {
        "theta",
        "phi of substitutes",
        "left out",
        "eta",
        "seed",
    }
    assert len(results.resamples) == 3
    assert set(results.ceilings) == {"blind", "expert_top1", "expert_mass"}


def test_the_same_input_gives_the_same_bytes(
    results: Results, kb: KnowledgeBase, scenarios: tuple[Scenario, ...], tmp_path: Path
) -> None:
    write_tables(results, tmp_path / "one")
    with KnowledgeBase.open(kb.location) as again:
        other = run(again, scenarios, baselines=BASELINES, ground=ground, resamples=3)
    write_tables(other, tmp_path / "two")
    for name in ("results.json", "sweeps.csv", "table.md"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()
    text = (tmp_path / "one" / "results.json").read_text()
    assert str(tmp_path) not in text
    assert json.loads(text)["methods"][0]["metrics"].keys() == METRICS.keys()


def test_what_was_written(results: Results, tmp_path: Path) -> None:
    written = {path.name for path in write(results, tmp_path / "out")}
    assert {f"{one}.{kind}" for one in ("heat_maps", "methods", "thresholds", "sweeps", "stability")
            for kind in ("png", "svg")} <= written  # fmt: skip
    page = (tmp_path / "out" / "report.html").read_text()
    assert set(re.findall(r"(?:src|href)=['\"]?(.{5})", page)) == {"data:"}, "the report fetches something"
    assert page.count("data:image/png;base64,") == len([name for name in written if name.endswith(".png")])
    rows = list(csv.DictReader((tmp_path / "out" / "sweeps.csv").open()))
    assert {row["metric"] for row in rows} == {"top1", "ndcg", "f1"}
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot write"):
        write_tables(results, tmp_path / "file" / "out")


def test_the_table_names_every_method(results: Results) -> None:
    table = markdown_table(results)
    assert all(one.label in table for one in results.standings)
    assert "left out: box-size" in table
    assert len({line.count("|") for line in table.splitlines()}) == 1


def test_every_wrong_answer_is_explained(results: Results) -> None:
    wrong = [a.scenario for a in results.first.agreements if (a.value["top1"] or 0) < 1]
    assert [miss.scenario.id for miss in results.misses] == wrong
    for miss in results.misses:
        assert miss.cause in CAUSES
        assert miss.mend or miss.cause == "none"


def test_refuses_what_it_cannot_judge(kb: KnowledgeBase, scenarios: tuple[Scenario, ...]) -> None:
    with pytest.raises(InputError, match="run the survey first"):
        run(kb, scenarios[3:])
    with pytest.raises(UnknownNameError, match="scenario 'q'"):
        run(kb, [Scenario("q", "spoon", ("tray",), accepted=frozenset())])
    with pytest.raises(UnknownNameError, match="baseline"):
        run(kb, scenarios, baselines=["nonsense"])


def test_grounding_again_gives_the_knowledge_back(kb: KnowledgeBase) -> None:
    values, properties = read_values(kb)
    again = ground(to_blocks(values, properties), 2, 0)
    assert again.ask("memberships").rows == kb.ask("memberships").rows


def test_objects_are_drawn_within_their_class(kb: KnowledgeBase) -> None:
    values, properties = read_values(kb)
    drawn = resampled(values, 1)
    measured = Measurements.collect(to_blocks(drawn, properties))
    assert measured.classes == ("plate", "sponge", "tray")
    assert len(measured.instances) == 9
    known = {(v.object_class, v.property, v.vector) for v in values}
    assert {(v.object_class, v.property, v.vector) for v in drawn} <= known
    assert resampled(values, 1) == drawn != resampled(values, 2)


def test_the_shipped_benchmark_runs_on_the_shipped_knowledge_base() -> None:
    """ERSATZ alone, in a moment; the whole table is made by tests/benchmarks."""
    from ersatz.evaluation.agreement import agree
    from ersatz.evaluation.methods import Ersatz

    with KnowledgeBase.open("household") as kb:
        for scenario in load_scenarios("benchmark"):
            assert 0 <= (agree(scenario, Ersatz(kb).answer(scenario)).value["top1"] or 0) <= 1


def test_the_table_in_the_readme_is_current() -> None:
    """Its first figure is; the rest is made by the same command."""
    from ersatz.evaluation.agreement import agree
    from ersatz.evaluation.methods import Ersatz
    from tests.benchmarks.bench_evaluation import BEGIN

    text = (ROOT / "README.md").read_text(encoding="utf-8")
    if BEGIN not in text:
        pytest.skip("the README has no table of methods")
    with KnowledgeBase.open("household") as kb:
        values = [agree(s, Ersatz(kb).answer(s)).value["top1"] or 0 for s in load_scenarios("benchmark")]
    row = next(line for line in text.splitlines() if line.startswith("| **ERSATZ"))
    assert f"| {sum(values) / len(values):.2f} (" in row, (
        "run python -m tests.benchmarks.bench_evaluation --readme"
    )


def test_several_processes_give_the_same(kb: KnowledgeBase, scenarios: tuple[Scenario, ...]) -> None:
    def quiet(_stage: str, _share: float) -> None:
        pass

    one = over_objects(kb, scenarios, ground, quiet, resamples=2)
    assert over_objects(kb, scenarios, ground, quiet, resamples=2, workers=2) == one
