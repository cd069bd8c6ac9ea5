"""Answers of queries: as a table, a chart or a graph."""

import json
import re
from dataclasses import dataclass
from typing import Any, Final

from nicegui import ui

from ersatz.knowledge.names import local_name
from ersatz.knowledge.vocabulary import KB
from ersatz.service.pages.frame import COLOURS, INK, card, show, table
from ersatz.service.pages.markup import shown, tag

MOST: Final = 500
"""Rows that are drawn; a download has all."""

Row = list[str | None]


@dataclass(frozen=True, slots=True)
class Answer:
    """Names of the columns and rows of values; a graph has subject, predicate and object."""

    names: list[str]
    rows: list[Row]


def read_answer(media: str, body: bytes) -> Answer:
    """Return an answer from N-Triples or SPARQL results in JSON."""
    if media.startswith("application/n-triples"):
        return Answer(
            ["subject", "predicate", "object"], [_triple(line) for line in body.decode().splitlines()]
        )
    found = json.loads(body)
    if "boolean" in found:
        return Answer(["answer"], [["yes" if found["boolean"] else "no"]])
    names = found["head"].get("vars", [])
    rows = [[row.get(name, {}).get("value") for name in names] for row in found["results"]["bindings"]]
    return Answer(names, rows)


def draw_answer(answer: Answer) -> None:
    """Draw an answer in three forms."""
    numeric = _numeric(answer)
    with card():
        with ui.tabs().props("dense align=left no-caps active-color=teal-8") as tabs:
            first, chart, graph = ui.tab("Table"), ui.tab("Chart"), ui.tab("Graph")
        with ui.tab_panels(tabs, value=first).style("background: transparent").props("keep-alive"):
            with ui.tab_panel(first):
                table(answer.names, ([_cell(one) for one in row] for row in answer.rows[:MOST]), numeric)
                if len(answer.rows) > MOST:
                    words = f"{len(answer.rows) - MOST} more rows: download them all."
                    show(tag("div", words, class_="faint"))
            with ui.tab_panel(chart):
                _chart(answer, numeric)
            with ui.tab_panel(graph):
                _graph(answer.rows)


def _cell(value: str | None) -> Any:
    words = shown(value)
    if value is not None and value.startswith(KB):
        return words, f"/thing/{local_name(value)}"
    return words


def _triple(line: str) -> Row:
    subject, predicate, rest = line.split(" ", 2)
    found = rest.removesuffix(" .")
    literal = re.match(r'"((?:[^"\\]|\\.)*)"', found)
    return [subject.strip("<>"), predicate.strip("<>"), literal[1] if literal else found.strip("<>")]


def _number(value: str | None) -> float | None:
    try:
        return float(value) if value is not None else None
    except ValueError:
        return None


def _numeric(answer: Answer) -> list[int]:
    """Return the columns that hold numbers only."""
    drawn = answer.rows[:MOST]
    return [
        at for at in range(len(answer.names)) if drawn and all(_number(row[at]) is not None for row in drawn)
    ]


def _chart(answer: Answer, numeric: list[int]) -> None:
    """Draw bars of the last column that holds numbers, named by the first that does not."""
    if not numeric:
        show(tag("div", "A chart needs a column of numbers.", class_="soft"))
        return
    value = numeric[-1]
    label = next((at for at in range(len(answer.names)) if at not in numeric), value)
    chosen = answer.rows[:60][::-1]
    name = {
        "name": answer.names[value],
        "nameLocation": "middle",
        "nameGap": 26,
        "nameTextStyle": {"color": INK},
    }
    bars = [_number(row[value]) for row in chosen]
    ui.echart(
        {
            "grid": {"left": 8, "right": 40, "top": 10, "bottom": 40, "containLabel": True},
            "tooltip": {},
            "animation": False,
            "xAxis": {"type": "value", **name, "axisLabel": {"color": INK}},
            "yAxis": {
                "type": "category",
                "data": [shown(row[label]) for row in chosen],
                "axisLabel": {"color": INK, "width": 150, "overflow": "truncate"},
            },
            "series": [{"type": "bar", "data": bars, "itemStyle": {"color": COLOURS[0]}}],
        }
    ).style(f"height: {max(220, 24 * len(chosen) + 70)}px")


def _graph(rows: list[Row]) -> None:
    """Draw rows of two or three things as edges."""
    edges = [(row[0], row[1] if len(row) > 2 else "", row[-1])
             for row in rows[:300] if len(row) in (2, 3) and row[0] and row[-1]]  # fmt: skip
    if not edges:
        show(tag("div", "A graph needs two or three columns: from, by, to.", class_="soft"))
        return
    nodes = sorted({str(one) for edge in edges for one in (edge[0], edge[2])})
    dots = [
        {"name": shown(one), "id": one, "symbolSize": 14, "itemStyle": {"color": COLOURS[0]}} for one in nodes
    ]
    series = {
        "type": "graph",
        "layout": "force",
        "roam": True,
        "force": {"repulsion": 140, "edgeLength": 90},
        "label": {"show": len(nodes) < 80, "position": "right", "color": INK},
        "labelLayout": {"hideOverlap": True},
        "data": dots,
        "edges": [{"source": a, "target": b, "value": shown(p)} for a, p, b in edges],
        "edgeSymbol": ["none", "arrow"],
        "edgeSymbolSize": 6,
    }
    ui.echart({"tooltip": {}, "series": [series]}).style("height: 520px")
