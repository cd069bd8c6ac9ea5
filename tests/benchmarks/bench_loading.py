"""Time writing, opening, asking and exporting large knowledge bases beside what engine and libraries need.

`run` is the table's part: class knowledge, against pyoxigraph's bulk load, rdflib's parser and owlready2.
`python -m tests.benchmarks.bench_loading FOLDER [--classes N] [--instances N]` takes a knowledge base of any
size through its life, one process a step, and writes `FOLDER/loading.md` and `.json` with the time by the
clock, that of processors and the peak memory of each.
"""

import argparse
import json
import resource
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import pyoxigraph as ox
import rdflib

from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.revision import revision_line, revision_of
from ersatz.knowledge.vocabulary import KB_ONTOLOGY, ONTOLOGY
from ersatz.reasoner.substitution import rank_substitutes
from tests.benchmarks.bench_query import lines, random_counts
from tests.benchmarks.measuring import Row
from tests.benchmarks.worlds import World

TOOL: Final = "thing 0000000"


class Counted:
    """Lines that are counted while they pass; the revision is one more."""

    def __init__(self, made: Iterable[str]) -> None:
        self._made = made
        self.number = 1

    def __iter__(self) -> Iterator[str]:
        """Pass them on."""
        for line in self._made:
            self.number += 1
            yield line


# The ways of one table: the same class knowledge, each as (folder, world) -> triples -----------------------


def file(folder: Path, world: World) -> int:
    """Write the class knowledge as N-Triples with its revision: what the others read."""
    made = Counted(lines(random_counts(world.classes)))
    revision = 0
    with (folder / f"{world.classes}.nt").open("w", encoding="utf-8") as out:
        for line in made:
            revision = revision_of([line], revision)
            out.write(line)
        out.write(revision_line(revision))
    return made.number


def create(folder: Path, world: World) -> int:
    """Make a directory knowledge base from counts."""
    made = Counted(lines(random_counts(world.classes)))
    KnowledgeBase.create(made, folder / "created").close()
    return made.number


def bulk(folder: Path, world: World) -> int:
    """Load the file with the engine's own bulk loader."""
    engine = ox.Store(str(folder / "bulk"))
    engine.bulk_load(path=str(folder / f"{world.classes}.nt"), format=ox.RdfFormat.N_TRIPLES)
    engine.flush()
    return 0


def opened(folder: Path, world: World) -> int:
    """Open the file as a knowledge base, into memory."""
    KnowledgeBase.open(folder / f"{world.classes}.nt")
    return 0


def rdflib_parse(folder: Path, world: World) -> int:
    """Parse the file with rdflib, into memory."""
    return len(rdflib.Graph().parse(folder / f"{world.classes}.nt", format="nt"))


def owlready2_load(folder: Path, world: World) -> int:
    """Load the file with owlready2, into its quad store in memory."""
    import owlready2

    store = owlready2.World()
    store.get_ontology(ONTOLOGY.value).loaded = True  # or it would fetch the import from the network
    with (folder / f"{world.classes}.nt").open("rb") as handle:
        ontology = store.get_ontology(f"{KB_ONTOLOGY.value}#").load(fileobj=handle)
    return len(ontology.graph)


# The life of one large knowledge base ----------------------------------------------------------------------


def write(folder: Path, world: World) -> int:
    """Ground the world and write it as a stream into a directory."""
    made = Counted(world.lines())
    KnowledgeBase.create(made, folder / "kb").close()
    return made.number


def write_classes(folder: Path, world: World) -> int:
    """The same without instances."""
    made = Counted(world.lines(classes_only=True))
    KnowledgeBase.create(made, folder / "classes").close()
    return made.number


def make(_: Path, world: World) -> int:
    """Only ground the world and make its lines: the share of writing that is not storing."""
    made = Counted(world.lines())
    for _line in made:
        pass
    return made.number


def question(folder: Path, _: World) -> int:
    """Open the directory and answer two stored questions: of a class, and of an object."""
    with KnowledgeBase.open(folder / "kb") as kb:
        assert len(kb.ask("class_knowledge", **{"class": TOOL})) > 0
        assert len(kb.ask("instance_measurements", instance=f"{TOOL} no 0000")) > 0
    return 0


def substitute(folder: Path, _: World) -> int:
    """Open the directory and rank all classes once, from a cold start."""
    with KnowledgeBase.open(folder / "kb") as kb:
        assert rank_substitutes(kb, TOOL, top=10).status == "ok"
    return 0


def export(folder: Path, suffix: str) -> int:
    """Write the directory as a file."""
    with KnowledgeBase.open(folder / "kb") as kb:
        kb.save(folder / f"kb.{suffix}")
    return 0


def export_nt(folder: Path, _: World) -> int:
    """Write the directory as N-Triples, sorted."""
    return export(folder, "nt")


def export_ttl(folder: Path, _: World) -> int:
    """Write the directory as Turtle, sorted."""
    return export(folder, "ttl")


def export_owl(folder: Path, _: World) -> int:
    """Write the directory as RDF/XML, sorted."""
    return export(folder, "owl")


def bulk_nt(folder: Path, _: World) -> int:
    """Load the exported file with the engine's own bulk loader, and count."""
    engine = ox.Store(str(folder / "again"))
    engine.bulk_load(path=str(folder / "kb.nt"), format=ox.RdfFormat.N_TRIPLES)
    engine.flush()
    return len(engine)


LIFE: Final = (make, write, write_classes, question, substitute, export_nt, export_ttl, export_owl, bulk_nt)
WAYS: Final[dict[str, Callable[[Path, World], int]]] = {
    way.__name__: way for way in (file, create, bulk, opened, rdflib_parse, owlready2_load, *LIFE)
}


def measured(way: str, folder: Path, world: World) -> dict[str, Any]:
    """Run one way in a process of its own; return triples, seconds by clock and processors, peak MB."""
    size = ["--classes", str(world.classes), "--instances", str(world.instances)]
    size += ["--physical", str(world.physical)]
    command = [sys.executable, "-m", "tests.benchmarks.bench_loading", str(folder), "--way", way, *size]
    out = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    found: dict[str, Any] = json.loads(out.splitlines()[-1])
    return found


def run(quick: bool) -> list[Row]:
    """Compare writing with bulk loading, and opening with what libraries need; by processors' time."""
    classes, rounds = (300, 2) if quick else (20_000, 3)
    world = World(classes)
    with TemporaryDirectory() as name:
        folder = Path(name)
        triples = measured("file", folder, world)["triples"]
        work: dict[str, list[float]] = {}
        for turn in range(rounds):
            for way in ("create", "bulk", "opened", *(() if turn else ("rdflib_parse", "owlready2_load"))):
                found = measured(way, folder, world)
                assert found["triples"] in (0, triples), (way, found)
                work.setdefault(way, []).append(found["work"])
            assert same(folder)
            shutil.rmtree(folder / "created")
            shutil.rmtree(folder / "bulk")
    size = f"{classes:,} classes, {triples:,} triples"
    made, read = "write a directory from counts, processors' time", "open a file, processors' time"
    create, opened_ = tuple(work["create"]), tuple(work["opened"])

    def row(what: str, ours: tuple[float, ...], way: str, rival: str, target: float | None, note: str) -> Row:
        return Row(what, size, rival, ours, tuple(work[way]), target, note, rival.split(maxsplit=1)[0])

    return [
        row(made, create, "bulk", "pyoxigraph bulk load of the file", 0.7, "the same triples"),
        row(read, opened_, "rdflib_parse", "rdflib parser", 15.0, "once"),
        row(read, opened_, "owlready2_load", "owlready2 load", None, "once"),
    ]


def same(folder: Path) -> bool:
    """Tell whether what was created and what the engine loaded are the same triples."""
    with KnowledgeBase.open(folder / "created") as kb:
        found = sum(hash(str(triple)) for triple in kb.triples())
    engine = ox.Store.read_only(str(folder / "bulk"))
    return found == sum(hash(str(quad.triple)) for quad in engine)


def life(folder: Path, world: World, steps: Iterable[str]) -> None:
    """Take a knowledge base through its life; write the table after each step."""
    folder.mkdir(parents=True, exist_ok=True)
    known = folder / "loading.json"
    rows: dict[str, dict[str, Any]] = json.loads(known.read_text("utf-8")) if known.exists() else {}
    for step in steps:
        print(f"{step} ...", file=sys.stderr, flush=True)
        rows[step] = measured(step, folder, world)
        rows[step]["bytes"] = sum(one.stat().st_size for one in made_by(step, folder))
        known.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
        (folder / "loading.md").write_text(table(world, rows), encoding="utf-8")
    print(table(world, rows))


def made_by(step: str, folder: Path) -> list[Path]:
    """Return the files a step left; those that snapshots share with the store, once."""
    places = {"write": "kb/store", "write_classes": "classes/store", "bulk_nt": "again"}
    if step.startswith("export_"):
        return [folder / f"kb.{step.removeprefix('export_')}"]
    return [one for one in (folder / places[step]).rglob("*") if one.is_file()] if step in places else []


def table(world: World, rows: dict[str, dict[str, Any]]) -> str:
    """Return the steps as Markdown."""
    whole = rows.get("write", {}).get("triples", 0)
    text = f"{world}; {whole:,} triples.\n\n"
    text += "| step | by the clock | of processors | µs a triple | peak memory | size |\n"
    text += "|---|---|---|---|---|---|\n"
    for step, row in rows.items():
        triples = row["triples"] or (whole if step.startswith("export") else 0)
        each = f"{row['work'] / triples * 1e6:.1f}" if triples else ""
        size = f"{row['bytes'] / 1e9:.2f} GB" if row["bytes"] else ""
        words = (WAYS[step].__doc__ or "").strip().rstrip(".").replace("\n", " ")
        text += f"| {words} | {row['clock']:.1f} s | {row['work']:.1f} s | {each} "
        text += f"| {row['memory']:.0f} MB | {size} |\n"
    return text


def main() -> None:
    """Take one through its life, or run one way and print its figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--classes", type=int, default=10_000)
    parser.add_argument("--instances", type=int, default=10, help="of each class")
    parser.add_argument("--physical", type=int, default=1, help="properties, beside a functional one")
    parser.add_argument("--step", action="append", choices=[way.__name__ for way in LIFE])
    parser.add_argument("--way", choices=WAYS, help=argparse.SUPPRESS)
    given = parser.parse_args()
    world = World(given.classes, given.instances, given.physical)
    if given.way is None:
        life(given.folder, world, given.step or [way.__name__ for way in LIFE])
        return
    start, before = time.perf_counter(), time.process_time()
    triples = WAYS[given.way](given.folder, world)
    clock, work = time.perf_counter() - start, time.process_time() - before
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1e6 if sys.platform == "darwin" else 1e3)
    print(json.dumps({"triples": triples, "clock": clock, "work": work, "memory": peak}))


if __name__ == "__main__":
    main()
