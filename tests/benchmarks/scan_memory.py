"""How memory and time grow with the number of scans, each measured in a fresh process, from files to values.

    python -m tests.benchmarks.scan_memory [--scans 50 200 800] [--workers 2]

The scans are views of parametric boxes, cans and cups by the virtual camera, about 2,000 points each.
"""

import argparse
import multiprocessing
import resource
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from itertools import cycle, islice
from pathlib import Path

import numpy as np

from ersatz.acquisition.layouts import iter_scans
from ersatz.acquisition.measuring import MeasuringSettings, measure_scans
from ersatz.acquisition.sources import shape_concepts
from tests.acquisition.shapes import views


def write_scans(folder: Path, count: int) -> None:
    """Write `<class>/<instance>/<scan>.npz`, each file a view from one side."""
    some = list(views(("box", "can", "cup"), range(2), 2))
    for number, scan in enumerate(islice(cycle(some), count)):
        place = folder / scan.object_class / f"{scan.object_class}_{number // len(some)}_{scan.instance}"
        place.mkdir(parents=True, exist_ok=True)
        np.savez(place / f"{number}.npz", points=scan.points, sensor=np.asarray(scan.sensor))


def measure(folder: str, workers: int) -> tuple[int, float, float, float]:
    """Return values measured, seconds, and peak memory of this process and the largest worker, MB."""
    start = time.perf_counter()
    blocks = measure_scans(iter_scans(folder), shape_concepts(), MeasuringSettings(workers=workers))
    spent = time.perf_counter() - start
    own, worker = (
        resource.getrusage(who).ru_maxrss / 1024 for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    )
    return sum(len(block.values) for block in blocks), spent, own, worker


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scans", type=int, nargs="+", default=[50, 200, 800])
    parser.add_argument("--workers", type=int, default=2)
    given = parser.parse_args()
    print("| scans | values | s | peak MB, this process | peak MB, a worker |\n|---|---|---|---|---|")
    for count in given.scans:
        with tempfile.TemporaryDirectory() as folder:
            write_scans(Path(folder), count)
            # Peak memory never falls: every number needs a process of its own.
            with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
                values, spent, own, worker = pool.submit(measure, folder, given.workers).result()
        print(f"| {count} | {values} | {spent:.1f} | {own:.0f} | {worker:.0f} |", flush=True)


if __name__ == "__main__":
    main()
