"""Ground a large Parquet table: time, memory, the same revision everywhere; beside scikit-learn and pandas.

`python -m tests.benchmarks.bench_grounding [--instances N] [--folder DIR]` writes a table of N things with
ten properties (see `tests.large`), builds a knowledge base of its classes in one process and on Dask with
one and two workers, and prints seconds, values per second and the peak memory of all processes together.
"""

import argparse
import itertools
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import psutil

from ersatz.acquisition.engine import Here
from ersatz.acquisition.tables.parts import find_parts
from ersatz.grounding.conceptualization import DEGREE
from ersatz.grounding.parts import Grounding, ground_parts
from ersatz.grounding.subcategorization import SubcategorizationSettings
from ersatz.grounding.units import ObservationUnit
from ersatz.knowledge.base import KnowledgeBase
from tests import large
from tests.benchmarks.measuring import Rival, Row, race

PROPERTY: Final = "weight"
"""The one of the ten that the rivals cluster and count; their time is scaled."""


def ground(folder: Path) -> Grounding:
    """Return all that a knowledge base of classes holds."""
    settings = SubcategorizationSettings()
    return ground_parts(
        [find_parts(folder)], ObservationUnit.INSTANCE, settings, Here(), lambda _stage, _share: None
    )


def clustered(folder: Path, make: Callable[[], Any]) -> tuple[Any, Any]:
    """Return scikit-learn's fit of one property, and how often each cluster occurs in each class."""
    import pandas as pd

    table = pd.read_parquet(folder, columns=["object_class", PROPERTY]).dropna()
    fitted = make().fit(table[[PROPERTY]].to_numpy())
    table["label"] = fitted.predict(table[[PROPERTY]].to_numpy())
    return fitted, table.groupby(["object_class", "label"], observed=True).size()


def check(folder: Path, makers: list[Callable[[], Any]]) -> float:
    """Assert that pandas counts the same with the same cut points; return the worst ratio of inertias."""
    import pandas as pd

    ours = ground(folder)
    at = [quality.property.name for quality in ours.qualities].index(PROPERTY)
    quality = ours.qualities[at]
    table = pd.read_parquet(folder, columns=["object_class", PROPERTY]).dropna()
    values = table[[PROPERTY]].to_numpy()
    table["label"] = quality.assign(values)
    theirs = table.groupby(["object_class", "label"], observed=True).size()
    start, stop = ours.counts.offsets[at : at + 2]
    mine = ours.counts.class_counts[:, start:stop] // DEGREE
    rows = {name: row for row, name in enumerate(ours.counts.classes)}
    assert int(mine.sum()) == int(theirs.sum()) == len(table)
    assert all(mine[rows[name], label] == count for (name, label), count in theirs.items())
    inertia = quality.inertia(values)
    worst = 0.0
    for make in makers:
        fitted, _ = clustered(folder, make)
        labels = fitted.predict(values)
        parts = (values[labels == label, 0] for label in range(4))
        worst = max(worst, inertia / sum(float(((part - part.mean()) ** 2).sum()) for part in parts))
    assert worst <= 1.001, worst
    return worst


def run(quick: bool) -> list[Row]:
    """Return the rows of the table."""
    from sklearn.cluster import KMeans, MiniBatchKMeans

    instances = 20_000 if quick else 1_000_000
    full = lambda: KMeans(4, n_init=10, random_state=0)  # noqa: E731
    batches = lambda: MiniBatchKMeans(4, n_init=10, random_state=0)  # noqa: E731
    with TemporaryDirectory() as directory:
        folder = large.write(Path(directory) / "table", instances, 4)
        worst = check(folder, [full, batches])
        scale = float(len(large.PAPERS_TEN))
        note = (
            f"from Parquet; inertia {worst:.6f} of the rival's or less, equal counts by pandas with equal "
            "cut points; the rival does one property of ten, and no co-occurrence"
        )
        rivals = [
            Rival(
                "scikit-learn KMeans(n_init=10) + pandas group-by",
                lambda: clustered(folder, full),
                target=20.0,
                note=note,
                package="scikit-learn",
                scale=scale,
                most=1,
            ),
            Rival(
                "scikit-learn MiniBatchKMeans(n_init=10) + pandas group-by",
                lambda: clustered(folder, batches),
                note=note,
                package="scikit-learn",
                scale=scale,
                most=1,
            ),
        ]
        size = f"{instances:,} instances, 10 properties"
        return race("ground: qualities and counts", size, lambda: ground(folder), rivals, 2)


def watched(command: list[str]) -> tuple[float, float]:
    """Run a command; return seconds, and the peak of the memory of all its processes together in GiB."""
    start, peak = time.perf_counter(), 0
    process = psutil.Popen(command)
    while process.poll() is None:
        total = 0
        for one in (process, *_children(process)):
            try:
                total += one.memory_info().rss
            except psutil.Error:
                continue
        peak = max(peak, total)
        time.sleep(0.1)
    if process.returncode:
        raise subprocess.CalledProcessError(process.returncode, command)
    return time.perf_counter() - start, peak / 2**30


def _children(process: psutil.Process) -> list[psutil.Process]:
    try:
        return list(process.children(recursive=True))
    except psutil.Error:
        return []


def main() -> None:
    """Measure the command line on a table of the size asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--instances", type=int, default=100_000)
    parser.add_argument("--files", type=int, default=10)
    parser.add_argument("--folder", type=Path, default=None, help="where to put it; else a temporary one")
    given = parser.parse_args()
    ersatz = str(Path(sys.executable).with_name("ersatz"))
    with TemporaryDirectory(dir=given.folder) as directory:
        needed = given.instances * 100
        free = shutil.disk_usage(directory).free
        if free < 2 * needed:
            raise SystemExit(f"{free / 1e9:.0f} GB are free, {2 * needed / 1e9:.0f} GB are needed")
        start = time.perf_counter()
        table = large.write(Path(directory) / "table", given.instances, given.files)
        size = sum(file.stat().st_size for file in table.iterdir())
        values = given.instances * len(large.PAPERS_TEN)
        print(f"{values:,} cells, {size / 1e6:,.0f} MB, in {time.perf_counter() - start:.0f} s", flush=True)
        revisions = set()
        for number, scheduler in enumerate((None, "local:1", "local:2")):
            out = Path(directory) / f"kb_{number}"
            options = ["--scheduler", scheduler] if scheduler else []
            command = [ersatz, "build", str(out), "--tables", str(table), "--classes-only", *options]
            seconds, peak = watched(command)
            with KnowledgeBase.open(out) as kb:
                revisions.add(kb.revision)
            speed = values / seconds / 1e6
            print(
                f"{scheduler or 'one process'}: {seconds:.1f} s, {speed:.2f} million values/s, peak"
                f" {peak:.2f} GiB, revision {next(itertools.islice(revisions, 1))[:12]}",
                flush=True,
            )
        assert len(revisions) == 1, revisions


if __name__ == "__main__":
    main()
