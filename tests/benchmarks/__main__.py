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
from typing import Any, Final

import tests.benchmarks
from tests.benchmarks.measuring import RESULTS, Row, time_text, versions
from tests.readme import put

BEGIN: Final = "<!-- how fast -->"
END: Final = "<!-- end of how fast -->"
HEAD: Final = (
    "| work | size | rival | ERSATZ | rival | rival / ERSATZ | target |\n|---|---|---|---|---|---|---|\n"
)


def benchmarks() -> dict[str, Callable[[bool], list[Row]]]:
    """Return the `run` of every module that has one, by its name without `bench_`."""
    found = {}
    for module in pkgutil.iter_modules(tests.benchmarks.__path__):
        if not module.name.startswith("bench_"):
            continue
        try:
            loaded = import_module(f"tests.benchmarks.{module.name}")
        except ModuleNotFoundError as missing:
            print(f"{module.name} is left out: {missing.name} is not installed", file=sys.stderr)
            continue
        run = getattr(loaded, "run", None)
        if run is not None and run.__module__ == loaded.__name__:  # one that was imported is none of ours
            found[module.name.removeprefix("bench_")] = run
    return found


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
                "limit_seconds": row.limit,
                "note": row.note,
            }
            for row in rows
        ],
    }


def _line(row: Row) -> str:
    ratio, spread = row.ratio, row.spread
    found = f"{ratio:.3g} ({spread[0]:.2g}–{spread[1]:.2g})" if ratio and spread else row.note
    cells = (row.work, row.size, row.rival, time_text(row.ours), time_text(row.theirs), found, row.aim)
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
    parser.add_argument(
        "--readme", action="store_true", help="put the rows with a target into the README, all into results/"
    )
    options = parser.parse_args()
    folders = [*([options.out] if options.out else []), *([RESULTS] if options.readme else [])]
    rows: list[Row] = []
    for name in options.only or known:
        print(f"{name} ...", file=sys.stderr, flush=True)
        rows += known[name](options.quick)
        for folder in folders:  # after each, for a run takes long
            write(rows, folder, quick=options.quick)
    print(markdown(rows), end="", flush=True)
    if options.readme:
        put(markdown([row for row in rows if row.aim]), BEGIN, END)


def write(rows: list[Row], folder: Path, *, quick: bool) -> None:
    """Write the table as Markdown, and all that was measured as JSON."""
    folder.mkdir(parents=True, exist_ok=True)
    found = report(rows, quick=quick)
    on, with_ = found["machine"], ", ".join(f"{name} {one}" for name, one in found["versions"].items())
    head = (
        "# How fast\n\nMade by `python -m tests.benchmarks`: medians, and ratios with their quartiles over "
        f"the rounds, on {on['processor']}, {on['cores']} cores, Python {on['python']}, load {on['load']} "
        f"at the end. Libraries: {with_}.\n\n"
    )
    (folder / "benchmarks.md").write_text(head + markdown(rows), encoding="utf-8")
    text = json.dumps(found, indent=1, ensure_ascii=False)
    (folder / "benchmarks.json").write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
