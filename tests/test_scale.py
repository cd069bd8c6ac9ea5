"""Data sets in parts give the knowledge base that everything at once gives, whoever does the work."""

import os
import signal
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import dask
import numpy as np
import polars as pl
import pytest
from distributed import Client, LocalCluster
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ersatz.acquisition.sources import AcquisitionSettings
from ersatz.errors import InputError
from ersatz.grounding import summaries
from ersatz.grounding.subcategorization import SubcategorizationSettings
from ersatz.grounding.units import ObservationUnit
from ersatz.knowledge.base import KnowledgeBase
from ersatz.pipeline import Settings, build
from tests import large
from tests.cli import Shell
from tests.knowledge.tools import lines_of

HABITS = SubcategorizationSettings(3, restarts=2)
CLASSES = Settings(HABITS, classes_only=True)
N = 140_000  # more values than are kept exactly


@dataclass(frozen=True, slots=True)
class Fleet:
    """One table in several forms, and what it grounds to."""

    whole: Path
    parts: Path
    revision: str


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Fleet:
    folder = tmp_path_factory.mktemp("fleet")
    frame = pl.concat([pl.DataFrame(large.chunk(n, N, chunk_size=10_000)) for n in range(N // 10_000)])
    assert isinstance(frame, pl.DataFrame)
    frame = frame.select("object_class", "instance", "weight", "support")
    frame.write_parquet(folder / "whole.parquet")
    (folder / "parts").mkdir()
    for number in range(14):
        mine = frame[number * 10_000 : (number + 1) * 10_000]
        mine.write_parquet(folder / "parts" / f"{13 - number:02d}.parquet", row_group_size=3_000)
    kb = build(tables=[folder / "whole.parquet"], settings=CLASSES)
    assert {row["method"] for row in kb.ask("qualities")} == {"histogram"}
    return Fleet(folder / "whole.parquet", folder / "parts", kb.revision)


@pytest.fixture(scope="module")
def cluster() -> Iterator[Client]:
    workers = LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None)
    with (
        dask.config.set({"distributed.deploy.lost-worker-timeout": "10 minutes"}),
        workers,
        Client(workers) as client,
    ):
        yield client


def test_part_by_part(fleet: Fleet, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ersatz.acquisition.tables.sheets.LARGE", 1)
    assert build(tables=[fleet.parts], settings=CLASSES).revision == fleet.revision
    assert build(tables=[fleet.whole], settings=CLASSES).revision == fleet.revision


def test_on_a_cluster_of_one_worker(fleet: Fleet) -> None:
    assert build(tables=[fleet.parts], settings=CLASSES, scheduler="local:1").revision == fleet.revision


def test_on_a_cluster_of_two_workers_one_of_which_is_killed(fleet: Fleet, cluster: Client) -> None:
    processes = cluster.run(os.getpid)
    killed: list[int] = []

    def kill(stage: str, _: float) -> None:
        if not killed and stage == "assigning and counting":
            killed.append(next(iter(processes.values())))
            os.kill(killed[0], signal.SIGKILL)

    address = cluster.scheduler_info()["address"]
    kb = build(tables=[fleet.parts], settings=CLASSES, scheduler=address, progress=kill)
    assert killed
    assert kb.revision == fleet.revision


def test_scans_are_measured_on_the_cluster(cluster: Client) -> None:
    chosen = Settings(SubcategorizationSettings(1), acquisition=AcquisitionSettings(views=2))
    address = cluster.scheduler_info()["address"]
    here, there = (build(models={"binder": 1}, settings=chosen, scheduler=one) for one in (None, address))
    assert len(here.ask("all_instances")) == 1
    assert here.revision == there.revision


names = st.sampled_from(["a", "b", "c", "d", "e", "f"])
values = st.one_of(st.none(), st.integers(0, 9).map(float), st.floats(0, 1))
rows = st.lists(st.tuples(names, st.sampled_from(["x", "y", "z", "w"]), values, values, values), min_size=1)


@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    rows=rows,
    borders=st.lists(st.booleans(), min_size=6, max_size=6),
    by_observation=st.booleans(),
    classes_only=st.booleans(),
    rng=st.randoms(),
)
@pytest.mark.filterwarnings("ignore::ersatz.errors.ErsatzWarning")
def test_any_table_in_any_parts(
    rows: list[tuple[str, str, float | None, float | None, float | None]],
    borders: list[bool],
    by_observation: bool,
    classes_only: bool,
    rng: object,
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    """Several observations, missing values and vectors; instances dealt out to files whole, in any order."""
    known = {(row[0], row[1]): row for row in rows}
    if not any(value is not None for row in known.values() for value in row[2:]):
        return
    order = list("abcdef")
    rng.shuffle(order)  # type: ignore[attr-defined]
    folder = tmp_path_factory.mktemp("any")
    (folder / "parts").mkdir()
    file: list[tuple[str, str, float | None, float | None, float | None]] = []
    whole = []
    for number, (name, border) in enumerate(zip(order, borders, strict=True)):
        mine = [row for key, row in known.items() if key[0] == name]
        file += mine
        whole += mine
        if border or number == 5:
            frame(file).write_parquet(folder / "parts" / f"{number}.parquet")
            file = []
    frame(whole[::-1]).write_parquet(folder / "whole.parquet")
    unit = ObservationUnit.OBSERVATION if by_observation else ObservationUnit.INSTANCE
    chosen = Settings(HABITS, unit=unit, classes_only=classes_only)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(summaries, "BIN_LIMIT", 6)
        patch.setattr(summaries, "SAMPLE_LIMIT", 5)
        one = build(tables=[folder / "whole.parquet"], settings=chosen)
        two = build(tables=[folder / "parts"], settings=chosen)
    assert facts(one) == facts(two)
    assert one.revision == two.revision


def frame(rows: list[tuple[str, str, float | None, float | None, float | None]]) -> pl.DataFrame:
    columns = list(zip(*rows, strict=True)) if rows else [()] * 5
    number = pl.Float64
    return pl.DataFrame(
        {
            "object_class": pl.Series([f"class {name in 'abc'}" for name in columns[0]], dtype=pl.String),
            "instance": pl.Series(columns[0], dtype=pl.String),
            "observation": pl.Series(columns[1], dtype=pl.String),
            "weight": pl.Series(columns[2], dtype=number),
            "support": pl.Series(columns[3], dtype=number),
            "size.length": pl.Series(columns[4], dtype=number),
            "size.width": pl.Series(columns[4], dtype=number),
            "size.height": pl.Series(columns[4], dtype=number),
        }
    )


def facts(kb: KnowledgeBase) -> list[str]:
    """Return all lines but those about sources, which differ: one file, or a directory of them."""
    return sorted(line for line in lines_of(kb) if "ource" not in line and "sha256" not in line)


def scattered(tmp_path: Path) -> Path:
    (tmp_path / "parts").mkdir()
    some = pl.DataFrame({"object_class": ["cup"] * 3, "instance": ["a", "b", "c"], "weight": [1.0, 2.0, 3.0]})
    some.write_parquet(tmp_path / "parts" / "0.parquet")
    some.with_columns(instance=pl.Series(["d", "b", "e"])).write_parquet(tmp_path / "parts" / "1.parquet")
    return tmp_path / "parts"


def test_an_instance_in_two_files_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"'b' are apart in 'parts/0.parquet' and 'parts/1.parquet'.*sort"):
        build(tables=[scattered(tmp_path)], settings=CLASSES)


def test_an_instance_that_comes_back_in_a_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    pl.DataFrame(
        {
            "object_class": ["cup"] * 4,
            "instance": ["b", "b", "a", "b"],
            "observation": list("wxyz"),
            "weight": 1.0,
        }
    ).write_parquet(tmp_path / "parts" / "0.parquet")
    with pytest.raises(InputError, match=r"'b' are apart in 'parts/0.parquet'.*sort"):
        build(tables=[tmp_path / "parts"], settings=CLASSES)


def test_equal_hashes_of_different_names_are_no_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "parts").mkdir()
    pl.DataFrame(
        {"object_class": "cup", "instance": ["c", "b", "a"], "weight": [1.0, 2.0, 3.0]}
    ).write_parquet(tmp_path / "parts" / "0.parquet")
    same: Callable[[list[str]], object] = lambda names: np.zeros(len(names), np.uint64)  # noqa: E731
    monkeypatch.setattr("ersatz.grounding.apart.hash_names", same)
    kb = build(tables=[tmp_path / "parts"], settings=CLASSES)
    assert [row["instances"] for row in kb.ask("classes")] == [3]


def test_a_data_set_without_a_value_is_refused(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    pl.DataFrame({"object_class": ["cup"], "instance": ["a"], "weight": [None]}).write_parquet(
        tmp_path / "parts" / "0.parquet"
    )
    with pytest.raises(InputError, match="no measurements"):
        build(tables=[tmp_path / "parts"], settings=CLASSES)


def test_names_that_collide_are_refused_in_parts_too(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    for number, name in enumerate(("cup 1", "cup_1")):
        pl.DataFrame({"object_class": ["cup"], "instance": [name], "weight": [1.0]}).write_parquet(
            tmp_path / "parts" / f"{number}.parquet"
        )
    with pytest.raises(InputError, match="would both be called"), pytest.warns(match="distinct value"):
        build(tables=[tmp_path / "parts"], settings=Settings(HABITS))


def test_the_expert_joins_a_data_set(fleet: Fleet, tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    pl.DataFrame(
        {"object_class": ["plate"] * 4, "instance": list("abcd"), "weight": [1.0, 2, 3, 4]}
    ).write_parquet(tmp_path / "parts" / "0.parquet")
    expert = tmp_path / "expert.toml"
    expert.write_text(
        'format = 1\norigin = "human"\n[classes.plate]\ninstances = 1\n'
        'rigidity = { family = "beta", mean = 0.5, sd = 0.1, reason = "a guess" }\n',
        encoding="utf-8",
    )
    kb = build(tables=[tmp_path / "parts"], expert=expert, settings=CLASSES)
    assert {str(row["property"]).partition("#")[2] for row in kb.ask("properties")} == {"weight", "rigidity"}


@pytest.fixture
def shell(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Shell:
    return Shell(capsys, monkeypatch)


def test_the_command_line(shell: Shell, fleet: Fleet, cluster: Client, tmp_path: Path) -> None:
    address = cluster.scheduler_info()["address"]
    out = tmp_path / "kb"
    done = shell(
        "build", out, "--tables", fleet.parts, "--clusters", "3", "--classes-only", "--scheduler", address
    )
    assert done.code == 0, done.err
    said = " ".join(done.err.split())
    # Not 140,000: some have neither value.
    assert "1000 classes, 139645 instances, 2 properties, 6 qualities" in said
    assert fleet.revision[:12] in said
    (source,) = KnowledgeBase.open(out).ask("sources")
    assert source["file"] == "parts"
    bad = shell("build", tmp_path / "no", "--tables", scattered(tmp_path), "--classes-only")
    assert (bad.code, bad.out) == (2, "")
    assert "'b' are apart" in bad.err
    assert shell("build", tmp_path / "no", "--tables", fleet.parts, "--scheduler", "local:0").code == 2
