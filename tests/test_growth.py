"""The cost model: slopes by hand, and the page and figures of a measurement at tiny sizes."""

from dataclasses import replace
from pathlib import Path

import pytest

from tests.benchmarks import bench_growth
from tests.benchmarks.bench_growth import Fleet, Series, needs, quantity, write_all
from tests.benchmarks.bench_loading import life, same
from tests.benchmarks.worlds import World

LINEAR = Series("count", "instances", "s", (1.0, 2.0, 4.0), (3.0, 6.0, 12.0))


def test_a_slope_is_the_exponent_of_growth() -> None:
    assert LINEAR.slope == pytest.approx(1.0)
    square = Series("pairs", "classes", "s", (10.0, 20.0), (1.0, 4.0))
    assert square.slope == pytest.approx(2.0)
    assert square.at(40) == pytest.approx(16.0)
    constant = Series("open", "classes", "s", (10.0, 100.0), (1.0, 1.0))
    assert constant.slope == pytest.approx(0.0)
    assert constant.at(1000) == pytest.approx(10.0)  # never less than linear


def test_what_a_fleet_needs_follows_from_the_measured() -> None:
    names = {
        "instances": (
            "count",
            "write a directory",
            "room on disk",
            "N-Triples to send",
            "observe one object",
        ),
        "classes": ("N-Triples of class knowledge", "first answer", "warm answer"),
    }
    known = {
        (cost, over): replace(
            LINEAR, cost=cost, over=over, unit="B" if "N-Tr" in cost or "room" in cost else "s"
        )
        for over, costs in names.items()
        for cost in costs
    }
    fleet = Fleet(robots=10, objects=100, classes=1_000, properties=3, new=2, questions=1, trip=0.5)
    found = {what: much for what, _, much in needs(known, fleet)}
    assert found["time: count all objects (class knowledge only)"] == quantity(3.0 * 1_000, "s")
    assert found["storage: all objects as triples"] == "3 kB"
    assert found["storage: all objects as columns (Parquet)"] == "24 kB"
    assert found["latency: warm answer of a server"] == quantity(3_000.5, "s")
    assert found["time: one server answers all robots"] == "30,000 cores"
    assert all("slope" in how for what, how, _ in needs(known, fleet) if "count" in what)


def test_the_page_and_its_figures_are_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        bench_growth, "machine", lambda: {"processor": "x", "cores": 2, "python": "3", "load": []}
    )
    sizes = [100, 200]
    found = [
        replace(LINEAR, cost="count"),
        *bench_growth.over_instances(tmp_path, sizes),
        *bench_growth.over_classes(sizes),
        *bench_growth.over_queries([1, 2]),
    ]
    write_all(found, tmp_path / "out")
    assert {one.name for one in (tmp_path / "out").iterdir()} == {
        f"growth.{s}" for s in ("md", "json", "png", "svg")
    }
    text = (tmp_path / "out" / "growth.md").read_text(encoding="utf-8")
    assert "| latency: warm answer on a robot | warm answer:" in text
    assert (tmp_path / "out" / "growth.png").read_bytes().startswith(b"\x89PNG")


def test_a_large_knowledge_base_goes_through_its_life(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    world = World(20, 3, 1)
    life(tmp_path, world, ["write", "question", "substitute", "export_nt", "bulk_nt"])
    out = capsys.readouterr().out
    assert "20 classes, 60 instances, 2 properties" in out
    assert out.count("\n| ") == 6
    assert (tmp_path / "loading.md").read_text(encoding="utf-8").strip() == out.strip()
    (tmp_path / "kb").rename(tmp_path / "created")
    (tmp_path / "again").rename(tmp_path / "bulk")
    assert same(tmp_path)
