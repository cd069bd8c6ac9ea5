"""Regenerate the README's table of methods on the shipped benchmark.

    python -m tests.benchmarks.bench_evaluation [--readme] [--out DIR] [--workers 1]

Without `--readme` it prints the table. `--out` also writes the whole experiment, sweeps and resampling too.
The affordance rival takes part where the shared data is.
"""

import argparse
import sys
from pathlib import Path

from ersatz.evaluation.experiment import run
from ersatz.evaluation.report import markdown_table, write
from ersatz.evaluation.scenarios import load_scenarios
from ersatz.knowledge.base import KnowledgeBase
from ersatz.pipeline import ground_blocks
from tests.conftest import DATA
from tests.readme import put

BEGIN, END = "<!-- methods on the benchmark -->", "<!-- end of methods -->"
AFFORDANCES = DATA / "affordances" / "affordance_data.csv"


def main() -> None:
    """Run the experiment and put its table where it belongs."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--readme", action="store_true")
    parser.add_argument("--out", type=Path)
    parser.add_argument("--workers", type=int, default=1)
    options = parser.parse_args()
    results = run(
        KnowledgeBase.open("household"),
        load_scenarios("benchmark"),
        baselines=[f"affordances={AFFORDANCES}"] if AFFORDANCES.is_file() else [],
        ground=ground_blocks if options.out else None,
        workers=options.workers,
        progress=lambda stage, share: print(f"{share:4.0%} {stage}", file=sys.stderr),
    )
    if options.out:
        write(results, options.out)
    table = markdown_table(results)
    if options.readme:
        put(table, BEGIN, END)
    else:
        print(table)


if __name__ == "__main__":
    main()
