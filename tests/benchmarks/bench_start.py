"""Time cold starts: the whole process of one question, and opening a large directory.

Part of `python -m tests.benchmarks`. Processes share a cache of compiled modules, made before anything is
timed, as `pip install` leaves it.
"""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from shutil import rmtree
from tempfile import TemporaryDirectory

from ersatz.knowledge.base import KnowledgeBase
from ersatz.reasoner.representative import load_knowledge
from ersatz.reasoner.substitution import rank_substitutes
from ersatz.resources import ONTOLOGY
from tests.benchmarks.bench_query import TOOL, jaccard_text, lines, random_counts
from tests.benchmarks.measuring import Rival, Row, race
from tests.conftest import ROOT

WITH_RDFLIB = """
import sys, rdflib
graph = rdflib.Graph().parse(sys.argv[1])
rows = [(str(row[0]), int(row[1]) / int(row[2])) for row in graph.query(sys.argv[2])]
print(max(rows, key=lambda row: row[1] if not row[0].endswith("#Tray") else -1)[0].rpartition("#")[2].lower())
"""
WITH_OXIGRAPH = """
import sys, pyoxigraph
store = pyoxigraph.Store()
store.bulk_load(path=sys.argv[1], format=pyoxigraph.RdfFormat.TURTLE)
rows = [(row[0].value, int(row[1].value) / int(row[2].value)) for row in store.query(sys.argv[2])]
print(max(rows, key=lambda row: row[1] if not row[0].endswith("#Tray") else -1)[0].rpartition("#")[2].lower())
"""


def run(quick: bool) -> list[Row]:
    """Time the command line and a directory's shelf."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        return _process(folder, 2 if quick else 7) + _directory(folder, 300 if quick else 10_000, quick)


def _process(folder: Path, rounds: int) -> list[Row]:
    kb = KnowledgeBase.open("household")
    ranking = rank_substitutes(kb, "tray", ["plate", "sponge", "bowl"])
    text, file = jaccard_text(kb, rank_substitutes(kb, "tray")), str(ONTOLOGY / "household.ttl")
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
    environment["PYTHONPYCACHEPREFIX"] = str(folder / "compiled")

    def process(*arguments: str) -> Callable[[], str]:
        command = [sys.executable, *arguments]
        return lambda: (
            subprocess.run(
                command, capture_output=True, text=True, check=True, cwd=ROOT, env=environment
            ).stdout
        )

    ask = "from ersatz.cli.main import run; run()"
    available = ("--available", "plate", "--available", "sponge", "--available", "bowl")
    ours = process("-c", ask, "substitute", "household", "--missing", "tray", *available)
    with_rdflib, with_oxigraph = (process("-c", code, file, text) for code in (WITH_RDFLIB, WITH_OXIGRAPH))
    empty, numpy, click = (
        process("-c", code) for code in ("pass", "import numpy", "import click, rich.table")
    )
    rdflib = process("-c", "import rdflib")
    assert f"stands in {ranking[0].name} " in " ".join(ours().split())
    best = rank_substitutes(kb, "tray")[0].name
    for other in (with_rdflib, with_oxigraph):
        assert other().strip().replace("_", "") == best.replace(" ", "")
    for other in (empty, numpy, click, rdflib):
        other()
    return race(
        "cold start: ersatz substitute",
        "3 candidates of 23 classes",
        ours,
        [
            Rival("rdflib: parse the file, Jaccard in SPARQL", with_rdflib, package="rdflib", most=2),
            Rival("pyoxigraph: load the file, Jaccard in SPARQL", with_oxigraph, package="pyoxigraph"),
            Rival("python -c 'import rdflib'", rdflib, note="nothing done", package="rdflib"),
            Rival("python -c 'import click, rich.table'", click, note="nothing done", package="click"),
            Rival("python -c 'import numpy'", numpy, note="nothing done", package="numpy"),
            Rival("python -c pass", empty, note="nothing done"),
        ],
        rounds,
        limit=0.6,
    )


def _directory(folder: Path, classes: int, quick: bool) -> list[Row]:
    path = folder / "kb"
    KnowledgeBase.create(lines(random_counts(classes)), path).close()

    def opened() -> list[tuple[str, object]]:
        with KnowledgeBase.open(path) as kb:
            return [(one.name, one.fraction) for one in rank_substitutes(kb, TOOL, top=10)]

    def read_anew() -> list[tuple[str, object]]:
        for index in path.glob("snapshots/*/index"):
            rmtree(index)
        return opened()

    assert read_anew() == opened()
    rows = race(
        "open a directory, first query",
        f"{classes:,} classes",
        opened,
        [Rival("the same, read from its triples", read_anew, most=2)],
        rounds=2,
    )
    kb = KnowledgeBase.open(path)
    rank_substitutes(kb, TOOL, top=10)
    label = "<http://www.w3.org/2000/01/rdf-schema#label>"
    turn = iter(range(10**6))

    def told() -> object:
        kb.tell([], [f'<https://w3id.org/ersatz/kb#Thing1> {label} "Ding {next(turn)}"@de .\n'])
        return rank_substitutes(kb, TOOL, top=10)[0].name

    def told_anew() -> object:
        for index in path.glob("snapshots/*/index"):
            rmtree(index)
        kb.tell([], [f'<https://w3id.org/ersatz/kb#Thing1> {label} "Ding {next(turn)}"@de .\n'])
        kb._outdated.clear()
        return rank_substitutes(kb, TOOL, top=10)[0].name

    assert told() == told_anew()
    before = kb.view(load_knowledge)
    assert len(before.classes.names) == classes
    rows += race(
        "a change of one class, then a query",
        f"{classes:,} classes",
        told,
        [Rival("the same, all read again", told_anew, most=2)],
        rounds=2 if quick else 4,
    )
    kb.close()
    return rows
