"""The report as one page that needs nothing else: who wins, by how much, and what ERSATZ gets wrong."""

from base64 import b64encode
from collections import Counter
from collections.abc import Sequence
from html import escape
from pathlib import Path

from ersatz.evaluation.agreement import HEADINGS, METRICS
from ersatz.evaluation.analysis import CAUSES, Miss
from ersatz.evaluation.figures import CAPTIONS
from ersatz.evaluation.results import Results, Standing
from ersatz.evaluation.uncertainty import Estimate


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
        "<p class=note>Means over scenarios with 95 % bootstrap intervals (missing tools drawn again). "
        "A tie counts as the mean of its orders; no answer counts 0. p: sign-flip permutation test over "
        "tools, Holm's correction over methods. "
        "* a threshold chosen on the scenarios of the other tools.</p>",
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
th.n{text-align:right}td.n{text-align:right;white-space:nowrap;font-variant-numeric:tabular-nums}
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
    text = f"Best by top-1: <b>{escape(best.label)}</b>, {shown(best.metrics['top1'])}. "
    text += f"ERSATZ at the paper's settings: {shown(first.metrics['top1'])}. "
    text += f"Rivals ahead of it: {escape(', '.join(ahead)) or 'none'}"
    text += f"; beyond doubt (corrected p &lt; 0.05): {escape(', '.join(sure)) or 'none'}." if ahead else "."
    return f"<p>{text}</p>"


def _better(one: Standing, first: Standing) -> bool:
    ahead = (one.metrics["top1"].mean or 0) > (first.metrics["top1"].mean or 0)
    return ahead and one.corrected.get("top1", 1) < 0.05


def _methods_table(results: Results) -> str:
    columns = [m for m in HEADINGS if any(s.metrics[m].mean is not None for s in results.standings)]
    head = "".join(f"<th class=n>{HEADINGS[m]}</th>" for m in columns)
    rows = [f"<tr><th>method</th>{head}<th class=n>p of top-1</th><th class=n>corrected</th></tr>"]
    for one in results.standings:
        cells = "".join(
            f"<td class=n>{shown(one.metrics[m], '<br><small>', '</small>')}</td>" for m in columns
        )
        p = [f"{of['top1']:.3f}" if "top1" in of else "" for of in (one.p, one.corrected)]
        star = "" if one.decides else " *"
        first = " class=first" if one is results.first else ""
        rows.append(
            f"<tr{first}><td>{escape(one.label)}{star}</td>{cells}"
            f"<td class=n>{p[0]}</td><td class=n>{p[1]}</td></tr>"
        )
    out = "".join(f"<li>{escape(n)}: {escape(reason)}</li>" for n, reason in sorted(results.left_out.items()))
    left_out = f"<p class=note>Left out:</p><ul class=note>{out}</ul>" if out else ""
    return f"<div class=scroll><table>{''.join(rows)}</table></div>{left_out}"


def _readings(results: Results) -> str:
    """Show the paper's "same substitute" under each reading, with chance."""
    texts = {m: METRICS[m] for m in ("top1", "same_top", "same_mode", "same_any")}
    rows = "".join(
        f"<tr><td>{escape(text)}</td><td class=n>{shown(results.first.metrics[m])}</td>"
        f"<td class=n>{_two(results.first.chance[m])}</td></tr>"
        for m, text in texts.items()
    )
    return (
        "<h2>“The same substitute”, under each reading</h2>"
        f"<table><tr><th>reading</th><th>ERSATZ</th><th>chance</th></tr>{rows}</table>"
        "<p class=note>Chance: a random order, and as many objects accepted at random. The paper "
        "reports 20 of 22 without saying which reading it is; its queries and votes are not published.</p>"
    )


def _ceilings(results: Results) -> str:
    names = {
        "blind": "one ranking a tool, made from the answers themselves: knows all but the task",
        "expert_top1": "an expert against the mode of the others (top-1)",
        "expert_mass": "an expert against the others (vote mass)",
    }
    rows = "".join(
        f"<tr><td>{escape(names[name])}</td><td class=n>{shown(one)}</td></tr>"
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
        f"<h2>What ERSATZ gets wrong: {len(results.misses)} of {len(results.scenarios)}, "
        f"and what would mend it</h2>"
        f"<table>{summary}</table>{_mended(results)}{_by_task(results)}"
        + "".join(_miss(miss) for miss in results.misses)
    )


def _mended(results: Results) -> str:
    """Count which methods get the misses right, and which qualities stood in the way."""
    by = Counter(label for miss in results.misses for label in (*miss.variants, *miss.rivals))
    lacking = Counter(quality for miss in results.misses for quality in miss.lacking)
    rows = (
        ("got right by", ", ".join(f"{escape(label)} {n}" for label, n in _most(by))),
        ("most often lacking in the right object", ", ".join(f"{q} {n}" for q, n in _most(lacking))),
    )
    return (
        f"<table>{''.join(f'<tr><th>{name}</th><td>{text}</td></tr>' for name, text in rows if text)}</table>"
    )


def _by_task(results: Results) -> str:
    """Show top-1 by task, of ERSATZ and of the rival that is best at it."""
    tasks = list(dict.fromkeys(s.task for s in results.scenarios if s.task))
    if not 1 < len(tasks) < len(results.scenarios):
        return ""
    rivals = [one for one in results.standings if not one.ours]
    rows = []
    for task in tasks:
        at = [i for i, s in enumerate(results.scenarios) if s.task == task]
        scored = [(_top1(one, at), one.label) for one in rivals]
        best = max(scored, key=lambda pair: pair[0], default=(0.0, "–"))
        rows.append(
            f"<tr><td>{escape(task)}</td><td class=n>{len(at)}</td>"
            f"<td class=n>{_top1(results.first, at):.2f}</td><td class=n>{best[0]:.2f}</td>"
            f"<td>{escape(best[1])}</td></tr>"
        )
    head = "<tr><th>task</th><th>scenarios</th><th>ERSATZ</th><th>best rival</th><th></th></tr>"
    return f"<table>{head}{''.join(rows)}</table>"


def _top1(one: Standing, at: Sequence[int]) -> float:
    return sum(one.agreements[i].value["top1"] or 0.0 for i in at) / len(at)


def _most(counted: Counter[str], most: int = 12) -> list[tuple[str, int]]:
    return sorted(counted.items(), key=lambda pair: (-pair[1], pair[0]))[:most]


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
        f"{miss.cause}</small></summary><table>{inner}</table></details>"
    )


def _two(value: float | None) -> str:
    return "–" if value is None else f"{value:.2f}"


def shown(e: Estimate, before: str = " (", after: str = ")") -> str:
    """Return a mean and its interval as people read them."""
    if e.mean is None or e.low is None or e.high is None:
        return "–"
    return f"{e.mean:.2f}{before}{e.low:.2f}–{e.high:.2f}{after}"
