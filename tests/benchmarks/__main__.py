"""Run all benchmarks and write their table; see the package's docstring for the convention."""

import argparse
import json
import os
import pkgutil
import platform
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from statistics import median
from typing import Any, Final

import tests.benchmarks
from tests.benchmarks.measuring import Row, versions
from tests.readme import put

BEGIN: Final = "<!-- how fast -->"
END: Final = "<!-- end of how fast -->"
HEAD: Final = (
    "| work | size | rival | ERSATZ | rival | rival / ERSATZ | target |\n|---|---|---|---|---|---|---|\n"
)


def benchmarks() -> dict[str, Callable[[bool], list[Row]]]:
    """Return the `run` of every module that has one, by its name without `bench_`."""
    names = [module.name for module in pkgutil.iter_modules(tests.benchmarks.__path__)]
    modules = {name: import_module(f"tests.benchmarks.{name}") for name in names if name.startswith("bench_")}
    return {
        name.removeprefix("bench_"): module.run for name, module in modules.items() if hasattr(module, "run")
    }


def markdown(rows: list[Row]) -> str:
    """Return the table: medians, and the ratio with its quartiles."""
    return HEAD + "".join(_line(row) for row in rows)


def machine() -> dict[str, Any]:
    """Return what the figures were measured on."""
    pages = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") if hasattr(os, "sysconf") else 0
    return {
        "processor": _processor(),
        "cores": os.cpu_count(),
        "memory_gib": round(pages / 2**30, 1),
        "system": platform.system(),
        "python": platform.python_version(),
        "load": [round(one, 1) for one in os.getloadavg()] if hasattr(os, "getloadavg") else [],
    }


def report(rows: list[Row], *, quick: bool) -> dict[str, Any]:
    """Return all that was measured, in JSON's types."""
    return {
        "quick": quick,
        "machine": machine(),
        "versions": dict(versions(rows)),
        "rows": [
            {
                "work": row.work,
                "size": row.size,
                "rival": row.rival,
                "ersatz_seconds": list(row.ours),
                "rival_seconds": list(row.theirs),
                "ratio": row.ratio,
                "ratio_quartiles": row.spread,
                "target": row.target,
                "note": row.note,
            }
            for row in rows
        ],
    }


def time_text(times: tuple[float, ...]) -> str:
    """Return a median time with its unit.

    >>> time_text((0.00012, 0.00014, 0.00013))
    '130 µs'
    """
    if not times:
        return "—"
    middle = median(times)
    for unit, size in (("s", 1.0), ("ms", 1e-3)):
        if middle >= size:
            return f"{middle / size:.3g} {unit}"
    return f"{middle * 1e6:.3g} µs"


def _line(row: Row) -> str:
    ratio, spread = row.ratio, row.spread
    found = f"{ratio:.3g} ({spread[0]:.2g}–{spread[1]:.2g})" if ratio and spread else row.note
    target = "" if row.target is None else f"≥ {row.target:.2g}"
    if ratio is not None and row.target is not None:
        target += " ✓" if ratio >= row.target else " missed"
    cells = (row.work, row.size, row.rival, time_text(row.ours), time_text(row.theirs), found, target)
    return f"| {' | '.join(cells)} |\n"


def _processor() -> str:
    info = Path("/proc/cpuinfo")
    if info.exists():
        for line in info.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def main() -> None:
    """Run, print, and write where asked."""
    known = benchmarks()
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="small sizes: seconds rather than minutes")
    parser.add_argument("--only", action="append", choices=known, help="one benchmark; may be repeated")
    parser.add_argument("--out", type=Path, help="folder for benchmarks.md and benchmarks.json")
    parser.add_argument("--readme", action="store_true", help="put the table into the README")
    options = parser.parse_args()
    rows: list[Row] = []
    for name in options.only or known:
        print(f"{name} ...", file=sys.stderr, flush=True)
        rows += known[name](options.quick)
        if options.out:  # after each, for a run takes long
            options.out.mkdir(parents=True, exist_ok=True)
            (options.out / "benchmarks.md").write_text(markdown(rows), encoding="utf-8")
            text = json.dumps(report(rows, quick=options.quick), indent=1, ensure_ascii=False)
            (options.out / "benchmarks.json").write_text(text + "\n", encoding="utf-8")
    print(markdown(rows), end="", flush=True)
    if options.readme:
        put(markdown(rows), BEGIN, END)


if __name__ == "__main__":
    main()
