"""Time writing and opening a large directory knowledge base beside what its engine and rdflib need.

Run `python -m tests.benchmarks.bench_store [--classes N]`. Every way is measured in a process of its own,
with its peak memory, on the same triples in one run; the numbers of triples are compared.
"""

import argparse
import json
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

import pyoxigraph as ox
import rdflib

from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.writer import revision_line, revision_of
from tests.benchmarks.bench_query import lines, random_counts

SAMPLE: Final = 1_000
"""Classes that rdflib parses; its time is linear in their number."""


def write_lines(folder: Path, classes: int) -> int:
    """Write the triples of so many classes as N-Triples, with their revision; what the others read."""
    count, revision = 1, 0
    with (folder / f"{classes}.nt").open("w", encoding="utf-8") as file:
        for line in lines(random_counts(classes)):
            revision = revision_of([line], revision)
            file.write(line)
            count += 1
        file.write(revision_line(revision))
    return count


def generate(_: Path, classes: int) -> int:
    """Only make the lines: the share of `create` that is not storing."""
    return sum(1 for _ in lines(random_counts(classes))) + 1


def create(folder: Path, classes: int) -> int:
    """Make a directory knowledge base from lines as they are generated."""
    with KnowledgeBase.create(lines(random_counts(classes)), folder / "kb") as kb:
        return size(kb)


def stored(folder: Path, classes: int) -> int:
    """Make a directory knowledge base from lines that lie in the same file the engine reads."""
    with (folder / f"{classes}.nt").open(encoding="utf-8") as file:
        made = (line for line in file if "#revision>" not in line)
        with KnowledgeBase.create(made, folder / "copy") as kb:
            return size(kb)


def memory(folder: Path, classes: int) -> int:
    """Open the same triples as a file, into memory: what rdflib does."""
    return size(KnowledgeBase.open(folder / f"{classes}.nt"))


def read(folder: Path, classes: int) -> int:
    """Open that knowledge base and read all class knowledge."""
    with KnowledgeBase.open(folder / "kb") as kb:
        assert len(kb.ask("classes")) == classes
        assert len(kb.ask("memberships")) == classes * 8
        return size(kb)


def bulk(folder: Path, classes: int) -> int:
    """Load the same triples from a file with the engine's own bulk loader."""
    engine = ox.Store(str(folder / "bulk"))
    engine.bulk_load(path=str(folder / f"{classes}.nt"), format=ox.RdfFormat.N_TRIPLES)
    engine.flush()
    return len(engine)


def rdflib_parse(folder: Path, classes: int) -> int:
    """Parse the same triples with rdflib, into memory."""
    return len(rdflib.Graph().parse(folder / f"{classes}.nt", format="nt"))


def size(kb: KnowledgeBase) -> int:
    """Return the number of triples."""
    return int(str(kb.query("SELECT (COUNT(*) AS ?n) WHERE { ?s ?p ?o }")[0]["n"]))


WAYS: Final[dict[str, Callable[[Path, int], int]]] = {
    way.__name__: way for way in (write_lines, generate, create, stored, memory, read, bulk, rdflib_parse)
}


def measured(way: str, folder: Path, classes: int) -> dict[str, float]:
    """Return triples, seconds by the clock and of processors, and peak memory in MB of one way."""
    command = [sys.executable, "-m", __spec__.name, "--way", way, "--folder", str(folder)]
    out = subprocess.run(
        [*command, "--classes", str(classes)], check=True, capture_output=True, text=True
    ).stdout
    found: dict[str, float] = json.loads(out.splitlines()[-1])
    return found


def compare(classes: int) -> None:
    """Print all figures and the ratios the design asks for."""
    sample = min(SAMPLE, classes)
    with TemporaryDirectory() as name:
        folder = Path(name)
        triples = measured("write_lines", folder, classes)["triples"]
        few = measured("write_lines", folder, sample)["triples"]
        print(f"{classes} classes, {triples} triples; rdflib: {sample} classes, {few} triples")
        clock, work = {}, {}
        for way in ("bulk", "generate", "create", "stored", "memory", "read", "rdflib_parse"):
            number = sample if way == "rdflib_parse" else classes
            found = measured(way, folder, number)
            assert found["triples"] == (few if way == "rdflib_parse" else triples), (way, found)
            clock[way], work[way] = (found[unit] / found["triples"] for unit in ("clock", "work"))
            print(
                f"{way:12} {found['clock']:7.2f} s by the clock {found['work']:7.2f} s of processors "
                f"{found['memory']:6.0f} MB"
            )
    for way, other in (
        ("create", "bulk"),
        ("stored", "bulk"),
        ("create", "rdflib_parse"),
        ("memory", "rdflib_parse"),
    ):
        print(
            f"{way} against {other}: {clock[other] / clock[way]:.2f} x the speed by the clock, "
            f"{work[other] / work[way]:.2f} x by processors' time"
        )


def main() -> None:
    """Compare, or run one way and print its figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--classes", type=int, default=20_000)
    parser.add_argument("--way", choices=WAYS, help=argparse.SUPPRESS)
    parser.add_argument("--folder", type=Path, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.way is None:
        compare(given.classes)
        return
    start, before = time.perf_counter(), time.process_time()
    triples = WAYS[given.way](given.folder, given.classes)
    clock, work = time.perf_counter() - start, time.process_time() - before
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1e6 if sys.platform == "darwin" else 1e3)
    print(json.dumps({"triples": triples, "clock": clock, "work": work, "memory": peak}))


if __name__ == "__main__":
    main()
