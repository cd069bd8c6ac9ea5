"""SPARQL: an editor, the stored questions with their parameters as fields, and answers in several forms."""

import json
import re
import time
from typing import Any, Final

from nicegui import ui

from ersatz.errors import ErsatzError
from ersatz.knowledge.names import local_name
from ersatz.knowledge.queries import Query, query_names, stored_query
from ersatz.knowledge.vocabulary import KB
from ersatz.service.inspection import Dataset, RefusedError, inspect_query
from ersatz.service.negotiation import GRAPHS, TABLES
from ersatz.service.pages.frame import PATIENCE, card, copy, frame, heading, notice, shown, table
from ersatz.service.pages.properties import COLOURS
from ersatz.service.service import Service

MOST: Final = 500
"""Rows that are drawn; a download has all."""

_START: Final = """\
PREFIX ersatz: <https://w3id.org/ersatz#>
PREFIX kb: <https://w3id.org/ersatz/kb#>

SELECT ?class (ersatz:jaccard(kb:Tray, ?class) AS ?similarity)
WHERE {
  ?model ersatz:describesClass ?class .
}
ORDER BY DESC(?similarity)
"""
_INK: Final = "#8595a2"
_HISTORY: Final = "(localStorage.getItem('ersatz-history') || '[]')"


def add(service: Service) -> None:
    """Add the page."""

    @ui.page("/ask", response_timeout=PATIENCE)
    async def ask(question: str = "", query: str = "", run: bool = False) -> None:
        with frame(service, "SPARQL", "/ask"):
            await _Page(service, query or _START).draw(question, run)


class _Page:
    """The state of one open page."""

    def __init__(self, service: Service, query: str) -> None:
        self._service = service
        self._query = query
        self._answer: dict[str, Any] | None = None

    async def draw(self, question: str, run: bool) -> None:
        heading(
            "SPARQL",
            "Ask a stored question, or one of your own; it is evaluated apart and ended at the time limit.",
        )
        with card():
            names = {one: stored_query(one).summary for one in query_names() if "/" not in one}
            with ui.element("div").classes("line"):
                chosen = ui.select(
                    {"": "a query of my own", **{n: f"{s}" for n, s in names.items()}},
                    label="Stored question", with_input=True, value=question if question in names else "",
                ).props('outlined dense').classes("grow")  # fmt: skip
                ui.button("History", icon="history").props("flat color=grey").on_click(self._history)
            self._fields = ui.element("div").classes("line").style("margin: 12px 0")
            self._editor = ui.codemirror(self._query, language="SPARQL", line_wrapping=True)
            self._editor.style("height: 240px").props('aria-label="Query"')
            with ui.element("div").classes("line").style("margin-top: 14px"):
                ui.button("Run", icon="play_arrow").props("unelevated color=teal-8").on_click(self.run)
                self._says = ui.label().classes("soft")
                with ui.element("div").classes("line end"):
                    for kind, media in (("CSV", "text/csv"), ("JSON", TABLES[0]), ("Turtle", GRAPHS[0])):
                        button = ui.button(kind, icon="download").props("flat dense color=grey")
                        button.on_click(lambda _, m=media, k=kind: self._download(m, k))
        self._results = ui.element("div")
        chosen.on_value_change(lambda: self._choose(str(chosen.value or "")))
        if question in names:
            self._choose(question)
        if run:
            await self.run()

    def _choose(self, name: str) -> None:
        self._fields.clear()
        if not name:
            return
        question = stored_query(name)
        self._editor.value = question.text
        values = dict(re.findall(r'(\w+)="([^"]*)"', question.example))
        boxes: dict[str, ui.input] = {}

        def fill() -> None:
            self._fill(question, {key: str(box.value) for key, box in boxes.items()})

        with self._fields:
            for key, kind in question.parameters.items():
                box = ui.input(f"{key} ({kind})", value=values.get(key, "")).props(
                    "outlined dense debounce=300"
                )
                boxes[key] = box
                box.on_value_change(fill)
        fill()

    def _fill(self, question: Query, values: dict[str, str]) -> None:
        given = {
            key: value.split(",") if question.parameters[key] == "iris" else value
            for key, value in values.items()
        }
        try:
            self._editor.value = question.bind(self._service.kb.resolve, given)
            self._says.text = question.description
        except ErsatzError as error:
            self._says.text = str(error)

    async def run(self) -> None:
        """Evaluate what the editor holds, in a worker, and draw the answer."""
        query = str(self._editor.value)
        self._results.clear()
        with self._results:
            ui.spinner(size="lg", color="teal-8")
        begun = time.perf_counter()
        try:
            media, body = await self._evaluated(query, TABLES[0], GRAPHS[1])
        except RefusedError as error:
            self._results.clear()
            with self._results:
                notice(str(error), bad=True)
            return
        took = 1000 * (time.perf_counter() - begun)
        ui.run_javascript(
            f"const q = {json.dumps(query)}, h = JSON.parse({_HISTORY}).filter(x => x !== q); h.unshift(q);"
            "localStorage.setItem('ersatz-history', JSON.stringify(h.slice(0, 30)))"
        )
        self._results.clear()
        with self._results:
            self._draw_answer(media, body, took)

    async def _evaluated(self, query: str, table_: str | None, graph: str | None) -> tuple[str, bytes]:
        inspect_query(query, Dataset(), self._service.settings.depth)
        spool, task = self._service.pool.evaluate(self._service.job("query", query, table_, graph))
        try:
            body = b"".join([piece async for piece in spool.pieces()])
        finally:
            task.cancel()
            spool.close()
        return spool.media, body

    def _draw_answer(self, media: str, body: bytes, took: float) -> None:
        if media.startswith("application/n-triples"):
            rows = [_triple(line) for line in body.decode().splitlines()]
            names = ["subject", "predicate", "object"]
        else:
            found = json.loads(body)
            names = found["head"].get("vars", [])
            if "boolean" in found:
                names, rows = ["answer"], [["yes" if found["boolean"] else "no"]]
            else:
                rows = [
                    [row.get(name, {}).get("value") for name in names] for row in found["results"]["bindings"]
                ]
        self._says.text = f"{len(rows)} rows in {took:.0f} ms"
        with card():
            with ui.tabs().props("dense align=left no-caps active-color=teal-8") as tabs:
                first = ui.tab("Table")
                chart = ui.tab("Chart")
                graph = ui.tab("Graph")
            with ui.tab_panels(tabs, value=first).style("background: transparent").props("keep-alive"):
                with ui.tab_panel(first).style("padding: 12px 0"):
                    table(names, [[_cell(value) for value in row] for row in rows[:MOST]])
                    if len(rows) > MOST:
                        ui.label(f"{len(rows) - MOST} more rows: download them all.").classes("faint")
                    text_ = "\n".join(
                        "\t".join("" if v is None else v for v in row) for row in [names, *rows]
                    )
                    button = ui.button("Copy the table", icon="content_copy").props("flat dense color=grey")
                    button.on_click(lambda: copy(text_))
                with ui.tab_panel(chart):
                    _chart(names, rows)
                with ui.tab_panel(graph):
                    _graph(rows)

    async def _download(self, media: str, kind: str) -> None:
        table_, graph = (None, media) if media in GRAPHS else (media, GRAPHS[0])
        try:
            got, body = await self._evaluated(str(self._editor.value), table_, graph)
        except RefusedError as error:
            ui.notify(str(error), type="negative")
            return
        suffix = "ttl" if got.startswith("text/turtle") else kind.lower()
        ui.download(body, f"answer.{suffix}", got)

    async def _history(self) -> None:
        queries = await ui.run_javascript(f"return {_HISTORY}")
        with ui.dialog() as dialog, ui.card().style("min-width: min(700px, 90vw)"):
            ui.label("Queries run in this browser").style("font-weight: 650")
            for query in json.loads(queries)[:30]:
                button = ui.button(" ".join(str(query).split())[:110]).props(
                    "flat dense align=left no-caps color=grey"
                )
                button.on_click(lambda _, q=query: (self._editor.set_value(q), dialog.close()))
        dialog.open()


def _cell(value: str | None) -> Any:
    words = shown(value)
    if value is not None and value.startswith(KB):
        return words, f"/thing/{local_name(value)}"
    return words


def _triple(line: str) -> list[str]:
    subject, predicate, rest = line.split(" ", 2)
    found = rest.removesuffix(" .")
    literal = re.match(r'"((?:[^"\\]|\\.)*)"', found)
    return [subject.strip("<>"), predicate.strip("<>"), literal[1] if literal else found.strip("<>")]


def _number(value: str | None) -> float | None:
    try:
        return float(value) if value is not None else None
    except ValueError:
        return None


def _chart(names: list[str], rows: list[list[Any]]) -> None:
    """Bars of the last column that holds numbers, named by the first that does not."""
    numeric = [
        at for at in range(len(names)) if rows and all(_number(row[at]) is not None for row in rows[:MOST])
    ]
    if not numeric:
        ui.label("A chart needs a column of numbers.").classes("soft")
        return
    value = numeric[-1]
    label = next((at for at in range(len(names)) if at not in numeric), value)
    chosen = rows[:60][::-1]
    ui.echart(
        {
            "grid": {"left": 160, "right": 40, "top": 10, "bottom": 40},
            "tooltip": {},
            "animation": False,
            "xAxis": {
                "type": "value",
                "name": names[value],
                "nameLocation": "middle",
                "nameGap": 26,
                "axisLabel": {"color": _INK},
            },
            "yAxis": {
                "type": "category",
                "data": [shown(row[label]) for row in chosen],
                "axisLabel": {"color": _INK},
            },
            "series": [
                {
                    "type": "bar",
                    "data": [_number(row[value]) for row in chosen],
                    "itemStyle": {"color": COLOURS[0]},
                }
            ],
        }
    ).style(f"height: {max(220, 24 * len(chosen) + 70)}px")


def _graph(rows: list[list[Any]]) -> None:
    """Draw rows of two or three things as edges."""
    edges = [(row[0], row[1] if len(row) > 2 else "", row[2] if len(row) > 2 else row[1])
             for row in rows[:300] if len(row) in (2, 3) and row[0] and row[-1]]  # fmt: skip
    if not edges:
        ui.label("A graph needs two or three columns: from, by, to.").classes("soft")
        return
    nodes = sorted({one for edge in edges for one in (edge[0], edge[2])})
    ui.echart(
        {
            "tooltip": {},
            "series": [
                {
                    "type": "graph",
                    "layout": "force",
                    "roam": True,
                    "force": {"repulsion": 140, "edgeLength": 90},
                    "label": {"show": len(nodes) < 80, "position": "right", "color": _INK},
                    "data": [
                        {"name": shown(one), "id": one, "symbolSize": 14, "itemStyle": {"color": COLOURS[0]}}
                        for one in nodes
                    ],
                    "edges": [{"source": a, "target": b, "value": shown(p)} for a, p, b in edges],
                    "edgeSymbol": ["none", "arrow"],
                    "edgeSymbolSize": 6,
                }
            ],
        }
    ).style("height: 520px")
