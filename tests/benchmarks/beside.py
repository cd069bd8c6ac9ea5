"""Time this version beside an earlier one: `python -m tests.benchmarks.beside REF [--rounds N]`.

REF is any name git knows, such as a tag; its files are checked out beside, and both versions run with the
packages of this environment. Each job is a process of its own that prints the processors' time of its part;
the versions take turns. The ratio is of medians: above 1, this version is faster.
"""

import argparse
import subprocess
import sys
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Final

import numpy as np

from tests.benchmarks.measuring import time_text
from tests.conftest import ROOT

OPENING: Final = """
import sys, time
from pathlib import Path
from ersatz.grounding.subcategorization import SubcategorizationSettings
from ersatz.knowledge.base import KnowledgeBase
from ersatz.pipeline import Settings, build
from ersatz.reasoner.substitution import rank_substitutes
folder = Path(sys.argv[1])
"""
CLOSING: Final = "\nprint(time.process_time() - start)\n"

COLD: Final = """
import time, sys
start = 0.0
try:
    from ersatz.cli.main import main
except ImportError:  # before it was a package
    from ersatz.cli import main
sys.argv = ["ersatz", "substitute", "household", "--missing", "tray", "--available", "plate", "--json"]
out, sys.stdout = sys.stdout, open("/dev/null", "w")
try:
    main()
except SystemExit:
    pass
sys.stdout = out
"""
JOBS: Final = {
    "cold start of `ersatz substitute`": COLD,
    "open the shipped file": OPENING + "start = time.process_time()\nKnowledgeBase.open('household')",
    "1,000 warm questions of it": OPENING
    + """
kb = KnowledgeBase.open('household')
rank_substitutes(kb, 'tray')
start = time.process_time()
for _ in range(1000):
    rank_substitutes(kb, 'tray')
""",
    "100 explained answers": OPENING
    + """
kb = KnowledgeBase.open('household')
start = time.process_time()
for _ in range(100):
    rank_substitutes(kb, 'tray', ['plate', 'bowl'])[0].explain()
""",
    "ground a table of 300,000 values, classes only": OPENING
    + """
start = time.process_time()
settings = Settings(SubcategorizationSettings(4), classes_only=True)
build(tables=[folder / 'large.csv'], settings=settings)
""",
    "ground and write 3,000 objects": OPENING
    + """
start = time.process_time()
settings = Settings(SubcategorizationSettings(4))
build(tables=[folder / 'small.csv'], settings=settings, out=folder / sys.argv[2])
""",
    "observe and forget 20 objects": OPENING
    + """
kb = build(tables=[folder / 'small.csv'], settings=Settings(SubcategorizationSettings(4)))
start = time.process_time()
for at in range(20):
    kb.observe('thing 1', f'fresh {at}', {'weight': 0.5, 'rigidity': 0.5, 'support': 0.5})
for at in range(20):
    kb.forget(f'fresh {at}')
""",
    "save the shipped knowledge as Turtle": OPENING
    + """
kb = KnowledgeBase.open('household')
start = time.process_time()
kb.save(folder / f'{sys.argv[2]}.ttl')
""",
    "ask 20 stored questions": OPENING
    + """
kb = KnowledgeBase.open('household')
start = time.process_time()
for _ in range(20):
    kb.ask('class_knowledge', **{'class': 'tray'})
""",
    "responses of ten views": OPENING
    + """
import numpy as np
from ersatz.acquisition.scans import Scan
from ersatz.acquisition.shape_concepts import ShapeConcepts
from ersatz.resources import ONTOLOGY
concepts = ShapeConcepts.load(ONTOLOGY / 'household.concepts.npz')
points = np.random.default_rng(0).normal(size=(2000, 3))
points *= 0.1 / np.linalg.norm(points, axis=1, keepdims=True)
view = Scan(points[points[:, 2] > 0], sensor=np.array([0, 0, 1.0]))
concepts.responses(view)
start = time.process_time()
for _ in range(10):
    concepts.responses(view)
""",
}


def table(path: Path, objects: int) -> None:
    """Write a table of objects with three properties, ten objects a class."""
    chance = np.random.default_rng(0)
    values = chance.random((objects, 3))
    rows = ["object_class,instance,weight [kg],rigidity,support [m2]"]
    rows += [
        f"thing {at // 10},thing_{at},{row[0]:.4f},{row[1]:.4f},{row[2]:.4f}" for at, row in enumerate(values)
    ]
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")


def spent(job: str, version: Path, folder: Path, turn: str) -> float:
    """Return the seconds of processors' time that a version needs for a job."""
    command = [sys.executable, "-c", JOBS[job] + CLOSING, str(folder), turn]
    out = subprocess.run(command, check=True, capture_output=True, text=True, cwd=version).stdout
    return float(out.split()[-1])


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("ref", help="the earlier version")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--only", choices=JOBS, action="append")
    given = parser.parse_args()
    with TemporaryDirectory() as name:
        folder, before = Path(name), Path(name) / "before"
        git = ["git", "-C", str(ROOT), "worktree"]
        subprocess.run([*git, "add", "-q", "--detach", str(before), given.ref], check=True)
        try:
            table(folder / "small.csv", 3_000)
            table(folder / "large.csv", 100_000)
            print("| work, processors' time | before | now | before / now |\n|---|---|---|---|", flush=True)
            for job in given.only or JOBS:
                old, new = [], []
                for turn in range(given.rounds):
                    old.append(spent(job, before, folder, f"old{turn}"))
                    new.append(spent(job, ROOT, folder, f"new{turn}"))
                ratio = median(old) / median(new)
                cells = (job, time_text(tuple(old)), time_text(tuple(new)), f"{ratio:.2f}")
                print(f"| {' | '.join(cells)} |", flush=True)
        finally:
            subprocess.run([*git, "remove", "--force", str(before)], check=True)


if __name__ == "__main__":
    main()
