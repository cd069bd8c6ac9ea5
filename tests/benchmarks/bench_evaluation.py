"""Regenerate the README's table of methods on the shipped benchmark.

    python -m tests.benchmarks.bench_evaluation [--readme] [--out DIR] [--workers 1]
    python -m tests.benchmarks.bench_evaluation --steps [--readme]

Without `--readme` it prints the table. `--out` also writes the whole experiment, sweeps and resampling too.
`--steps` makes the other table: every step of the paper's rule kept or exchanged, in all combinations.
The affordance rival takes part where the shared data is.
"""

import argparse
import sys
from pathlib import Path

from ersatz.evaluation.ablation import ablate, markdown
from ersatz.evaluation.experiment import run
from ersatz.evaluation.report import markdown_table, write
from ersatz.evaluation.scenario_files import load_scenarios
from ersatz.knowledge.base import KnowledgeBase
from ersatz.pipeline import ground_blocks
from tests.conftest import DATA
from tests.readme import put

BEGIN, END = "<!-- methods on the benchmark -->", "<!-- end of methods -->"
STEPS = "<!-- steps of the rule -->", "<!-- end of steps -->"
AFFORDANCES = DATA / "affordances" / "affordance_data.csv"


def main() -> None:
    """Run the experiment and put its table where it belongs."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--readme", action="store_true")
    parser.add_argument("--out", type=Path)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--steps", action="store_true")
    options = parser.parse_args()
    table, place = (
        (steps(), STEPS) if options.steps else (methods(options.out, options.workers), (BEGIN, END))
    )
    if options.readme:
        put(table, *place)
    else:
        print(table)


def steps() -> str:
    """Return the table of all combinations of the rule's steps."""
    scenarios = load_scenarios("benchmark")
    return markdown(scenarios, ablate(KnowledgeBase.open("household"), scenarios))


def methods(out: Path | None, workers: int) -> str:
    """Run the experiment and return its table."""
    results = run(
        KnowledgeBase.open("household"),
        load_scenarios("benchmark"),
        baselines=[f"affordances={AFFORDANCES}"] if AFFORDANCES.is_file() else [],
        ground=ground_blocks if out else None,
        workers=workers,
        progress=lambda stage, share: print(f"{share:4.0%} {stage}", file=sys.stderr),
    )
    if out:
        write(results, out)
    return markdown_table(results)


if __name__ == "__main__":
    main()
