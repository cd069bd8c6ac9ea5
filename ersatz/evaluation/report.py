"""What the experiment leaves behind: results.json, sweeps.csv, figures, one self-contained page, a table."""

import csv
import io
import json
from base64 import b64encode
from collections import Counter
from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path

from ersatz.errors import InputError
from ersatz.evaluation.agreement import METRICS
from ersatz.evaluation.analysis import CAUSES, Miss
from ersatz.evaluation.experiment import Results, Standing
from ersatz.evaluation.figures import CAPTIONS, draw_all
from ersatz.evaluation.sweeps import tidy
from ersatz.evaluation.uncertainty import Estimate

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
        "| method | top-1 | MRR | nDCG above chance | F1 of the set | top-1 against ERSATZ |",
        "|---|---|---|---|---|---|",
    ]
    for one in sorted(results.standings, key=lambda s: -(s.metrics["top1"].mean or 0)):
        numbers = " | ".join(_shown(one.metrics[metric]) for metric in TABLE)
        hollow = "" if one.decides else " *"
        name = f"**{one.label}**" if one is results.first else one.label
        lines.append(f"| {name} | {numbers}{hollow} | {_difference(one, results.first)} |")
    lines += [
        f"| *left out: {name}* | {reason} | | | | |" for name, reason in sorted(results.left_out.items())
    ]
    return "\n".join(lines) + "\n"


def html_report(results: Results, folder: Path, drawn: Sequence[str]) -> str:
    """Return the page: nothing in it comes from elsewhere."""
    tools = len({s.missing for s in results.scenarios})
    unjudged = (
        f" {results.unjudged} scenarios without votes or answers were left out." if results.unjudged else ""
    )
    body = [
        "<h1>What stands in? The experiment</h1>",
        f"<p>{len(results.scenarios)} scenarios of {tools} missing tools, on "
        f"<code>{escape(results.location)}</code>, "
        f"revision <code>{results.revision[:12]}</code>.{unjudged}</p>",
        _verdict(results),
        "<h2>Methods</h2>",
        _methods_table(results),
        "<p class=note>Means over scenarios with 95 % bootstrap intervals (missing tools drawn again). A "
        "tie counts as "
        "the mean of its orders; no answer counts 0. p: sign-flip permutation test over tools, Holm's "
        "correction over "
        "methods. * a threshold chosen on the scenarios of the other tools.</p>",
        _readings(results),
        _ceilings(results),
        *(_figure(folder, name) for name in drawn),
        _misses(results),
        "<h2>What the metrics say</h2><dl>",
        *(f"<dt>{name}</dt><dd>{escape(text)}</dd>" for name, text in METRICS.items()),
        "</dl>",
    ]
    return (
        "<!doctype html>\n<html lang=en><meta charset=utf-8><title>ERSATZ: the experiment</title>\n"
        f"<meta name=viewport content='width=device-width'><style>{CSS}</style>\n"
        + "\n".join(body)
        + "\n</html>\n"
    )


CSS = """
body{font:15px/1.5 system-ui,sans-serif;max-width:75em;margin:2em auto;padding:0 1em;color:#1b1b1b}
table{border-collapse:collapse;margin:1em 0;font-size:14px}
td,th{padding:.25em .7em;border-bottom:1px solid #ddd;text-align:left;vertical-align:top}
td.n{text-align:right;white-space:nowrap;font-variant-numeric:tabular-nums}
tr.first{font-weight:bold;background:#eef5fb}img{max-width:100%}figure{margin:2em 0}
figcaption,.note{color:#555;font-size:14px}small{color:#666}dt{font-family:monospace}.scroll{overflow-x:auto}
""".strip()


def _verdict(results: Results) -> str:
    """Say in two sentences who wins."""
    best = max(results.standings, key=lambda s: s.metrics["top1"].mean or 0)
    first = results.first
    mine = first.metrics["top1"].mean or 0
    ahead = [s.label for s in results.standings if not s.ours and (s.metrics["top1"].mean or 0) > mine]
    sure = [s.label for s in results.standings if not s.ours and _better(s, first)]
    text = f"Best by top-1: <b>{escape(best.label)}</b>, {_shown(best.metrics['top1'])}. "
    text += f"ERSATZ at the paper's settings: {_shown(first.metrics['top1'])}. "
    text += f"Rivals ahead of it: {escape(', '.join(ahead)) or 'none'}"
    text += f"; beyond doubt (corrected p &lt; 0.05): {escape(', '.join(sure)) or 'none'}." if ahead else "."
    return f"<p>{text}</p>"


def _better(one: Standing, first: Standing) -> bool:
    ahead = (one.metrics["top1"].mean or 0) > (first.metrics["top1"].mean or 0)
    return ahead and one.corrected.get("top1", 1) < 0.05


def _methods_table(results: Results) -> str:
    wanted = ("top1", "mass", "rr", "ndcg", "precision", "recall", "f1", "tau")
    shown = [m for m in wanted if any(s.metrics[m].mean is not None for s in results.standings)]
    rows = [
        f"<tr><th>method</th>{''.join(f'<th>{m}</th>' for m in shown)}<th>p "
        f"(top1)</th><th>corrected</th></tr>"
    ]
    for one in results.standings:
        cells = "".join(
            f"<td class=n>{_shown(one.metrics[m], '<br><small>', '</small>')}</td>" for m in shown
        )
        p = [f"{of['top1']:.3f}" if "top1" in of else "" for of in (one.p, one.corrected)]
        star = "" if one.decides else " *"
        first = " class=first" if one is results.first else ""
        rows.append(
            f"<tr{first}><td>{escape(one.label)}{star}</td>{cells}<td class=n>{p[0]}</td><td "
            f"class=n>{p[1]}</td></tr>"
        )
    out = "".join(f"<li>{escape(n)}: {escape(reason)}</li>" for n, reason in sorted(results.left_out.items()))
    left_out = f"<p class=note>Left out:</p><ul class=note>{out}</ul>" if out else ""
    return f"<div class=scroll><table>{''.join(rows)}</table></div>{left_out}"


def _readings(results: Results) -> str:
    """Show the paper's "same substitute" under each reading, with chance."""
    texts = {m: METRICS[m] for m in ("top1", "same_top", "same_mode", "same_any")}
    rows = "".join(
        f"<tr><td>{escape(text)}</td><td class=n>{_shown(results.first.metrics[m])}</td>"
        f"<td class=n>{_two(results.first.chance[m])}</td></tr>"
        for m, text in texts.items()
    )
    return (
        "<h2>“The same substitute”, under each "
        "reading</h2><table><tr><th>reading</th><th>ERSATZ</th><th>chance</th>"
        f"</tr>{rows}</table><p class=note>Chance: a random order, and as many objects accepted at "
        f"random. The paper "
        "reports 20 of 22 without saying which reading it is; its queries and votes are not published.</p>"
    )


def _ceilings(results: Results) -> str:
    names = {
        "blind": "one ranking a tool, made from the answers themselves: knows all but the task",
        "expert_top1": "an expert against the mode of the others (top-1)",
        "expert_mass": "an expert against the others (vote mass)",
    }
    rows = "".join(
        f"<tr><td>{escape(names[name])}</td><td class=n>{_shown(one)}</td></tr>"
        for name, one in results.ceilings.items()
        if one.mean is not None
    )
    alpha = "".join(
        f"<tr><td>Krippendorff's α of {escape(name)}</td><td class=n>{_two(value)}</td></tr>"
        for name, value in results.alpha.items()
        if value is not None
    )
    return f"<h2>Ceilings</h2><table>{rows}{alpha}</table>"


def _figure(folder: Path, name: str) -> str:
    data = b64encode((folder / f"{name}.png").read_bytes()).decode("ascii")
    caption = escape(CAPTIONS[name])
    image = f"<img alt='{caption}' src='data:image/png;base64,{data}'>"
    return f"<figure>{image}<figcaption>{caption}</figcaption></figure>"


def _misses(results: Results) -> str:
    counted = Counter(miss.cause for miss in results.misses)
    summary = "".join(
        f"<tr><td class=n>{counted[cause]}</td><td>{cause}</td><td>{escape(text)}</td></tr>"
        for cause, text in CAUSES.items()
        if counted[cause]
    )
    return (
        f"<h2>What ERSATZ gets wrong: {len(results.misses)} of {len(results.scenarios)}, and what would "
        f"mend it</h2>"
        f"<table>{summary}</table>" + "".join(_miss(miss) for miss in results.misses)
    )


def _miss(miss: Miss) -> str:
    s = miss.scenario
    right = ", ".join(sorted(s.modes()))
    rows = (
        ("offered", ", ".join(s.available)),
        ("right", right),
        ("functions", ", ".join(miss.functions) or "none relevant"),
        ("what counts", ", ".join(miss.relevant)),
        ("best wrong", miss.wrong),
        ("best right", miss.right),
        ("mend", miss.mend),
        ("variants that get it right", ", ".join(miss.variants) or "none"),
        ("rivals that get it right", ", ".join(miss.rivals) or "none"),
    )
    inner = "".join(f"<tr><th>{name}</th><td>{escape(text)}</td></tr>" for name, text in rows if text)
    task = f" {s.task}" if s.task else ""
    return (
        f"<details><summary><b>{escape(s.missing)}</b>.{escape(task)} <small>{escape(s.id)}: "
        f"{miss.cause}</small>"
        f"</summary><table>{inner}</table></details>"
    )


def _difference(one: Standing, first: Standing) -> str:
    if one is first or "top1" not in one.p:
        return ""
    gap = (one.metrics["top1"].mean or 0) - (first.metrics["top1"].mean or 0)
    return f"{gap:+.2f} (p = {one.corrected['top1']:.3f})"


def _shown(e: Estimate, before: str = " (", after: str = ")") -> str:
    if e.mean is None or e.low is None or e.high is None:
        return "–"
    return f"{e.mean:.2f}{before}{e.low:.2f}–{e.high:.2f}{after}"


def _two(value: float | None) -> str:
    return "–" if value is None else f"{value:.2f}"


def _csv(rows: Iterable[Sequence[str]]) -> str:
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows(rows)
    return out.getvalue()
