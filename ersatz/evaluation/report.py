"""What the experiment leaves behind: results.json, sweeps.csv, figures, one self-contained page, a table."""

import csv
import io
import json
from collections.abc import Iterable, Sequence
from pathlib import Path

from ersatz.errors import InputError
from ersatz.evaluation.agreement import HEADINGS
from ersatz.evaluation.figures import draw_all
from ersatz.evaluation.page import html_report, shown
from ersatz.evaluation.results import Results, Standing
from ersatz.evaluation.sweeps import tidy

TABLE = ("top1", "rr", "ndcg", "f1")
"""Metrics of the short table."""


def write(results: Results, out: Path) -> list[Path]:
    """Write everything to a folder; return what was written.

    Raises
    ------
    InputError
        If the folder cannot be made.
    MissingDependencyError
        If matplotlib is not installed.
    """
    tables = write_tables(results, out)
    drawn = draw_all(results, out)
    (out / "report.html").write_text(html_report(results, out, drawn), encoding="utf-8")
    pictures = [out / f"{one}.{kind}" for one in drawn for kind in ("png", "svg")]
    return [out / "report.html", *tables, *pictures]


def write_tables(results: Results, out: Path) -> list[Path]:
    """Write what is not a picture; the same input gives the same bytes.

    Raises
    ------
    InputError
        If the folder cannot be made.
    """
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"cannot write to {str(out)!r}: {error}") from None
    texts = {
        "results.json": json.dumps(results.to_json(), indent=1, ensure_ascii=False) + "\n",
        "sweeps.csv": _csv(tidy(results.cells)),
        "table.md": markdown_table(results),
    }
    for name, text in texts.items():
        (out / name).write_text(text, encoding="utf-8")
    return [out / name for name in texts]


def markdown_table(results: Results) -> str:
    """Return the methods and their agreement as a table in Markdown, best first by top-1."""
    lines = [
        f"| method | {' | '.join(HEADINGS[metric] for metric in TABLE)} | top-1 against ERSATZ |",
        "|---|---|---|---|---|---|",
    ]
    for one in sorted(results.standings, key=lambda s: -(s.metrics["top1"].mean or 0)):
        numbers = " | ".join(shown(one.metrics[metric]) for metric in TABLE)
        hollow = "" if one.decides else " *"
        name = f"**{one.label}**" if one is results.first else one.label
        lines.append(f"| {name} | {numbers}{hollow} | {_difference(one, results.first)} |")
    lines += [
        f"| *left out: {name}* | {reason} | | | | |" for name, reason in sorted(results.left_out.items())
    ]
    return "\n".join(lines) + "\n"


def _difference(one: Standing, first: Standing) -> str:
    if one is first or "top1" not in one.p:
        return ""
    gap = (one.metrics["top1"].mean or 0) - (first.metrics["top1"].mean or 0)
    return f"{gap:+.2f} (p = {one.corrected['top1']:.3f})"


def _csv(rows: Iterable[Sequence[str]]) -> str:
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows(rows)
    return out.getvalue()
