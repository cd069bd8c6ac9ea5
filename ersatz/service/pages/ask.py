"""SPARQL: an editor, the stored questions with their parameters as fields, downloads and a history."""

import json
import re
import time
from typing import Final

from nicegui import ui

from ersatz.errors import ErsatzError
from ersatz.knowledge.queries import Query, query_names, stored_query
from ersatz.service.inspection import Dataset, RefusedError, inspect_query
from ersatz.service.negotiation import GRAPHS, TABLES
from ersatz.service.pages.answer import draw_answer, read_answer
from ersatz.service.pages.frame import PATIENCE, card, frame, heading, notice
from ersatz.service.service import Service

_OWN: Final = "my own query"
_START: Final = """\
PREFIX ersatz: <https://w3id.org/ersatz#>
PREFIX kb: <https://w3id.org/ersatz/kb#>

SELECT ?class (ersatz:jaccard(kb:Tray, ?class) AS ?similarity)
WHERE {
  ?model ersatz:describesClass ?class .
}
ORDER BY DESC(?similarity)
"""
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

    async def draw(self, question: str, run: bool) -> None:
        """Draw the page, with a stored question chosen or not."""
        heading(
            "SPARQL",
            "Ask a stored question, or one of your own; it is evaluated apart and ended at the time limit.",
        )
        names = [one for one in query_names() if "/" not in one]
        with card():
            with ui.tabs().props("dense no-caps align=left outside-arrows mobile-arrows") as tabs:
                for name in (_OWN, *names):
                    ui.tab(name, label=name.replace("_", " "))
            tabs.set_value(question if question in names else _OWN)
            tabs.props('active-color=teal-8 aria-label="Questions"')
            self._fields = ui.element("div").classes("line").style("margin: 12px 0")
            self._editor = ui.codemirror(self._query, language="SPARQL", line_wrapping=True)
            self._editor.style("height: 240px").props('aria-label="Query"')
            self._draw_buttons()
        self._results = ui.element("div").props('aria-live="polite"')
        tabs.on_value_change(lambda: self._choose(str(tabs.value)))
        if question in names:
            self._choose(question)
        if run:
            await self.run()

    def _draw_buttons(self) -> None:
        with ui.element("div").classes("line").style("margin-top: 14px"):
            ui.button("Run", icon="play_arrow").props("unelevated color=teal-8").on_click(self.run)
            self._says = ui.label().classes("soft grow")
            with ui.element("div").classes("line end"):
                ui.button("History", icon="history").props("flat dense color=grey").on_click(self._history)
                for kind, media in (("CSV", "text/csv"), ("JSON", TABLES[0]), ("Turtle", GRAPHS[0])):
                    button = ui.button(kind, icon="download").props("flat dense color=grey")
                    button.on_click(lambda _, m=media, k=kind: self._download(m, k))

    def _choose(self, name: str) -> None:
        self._fields.clear()
        if name == _OWN:
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
            self._says.text = question.summary
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
        answer = read_answer(media, body)
        self._says.text = f"{len(answer.rows)} rows in {took:.0f} ms"
        self._results.clear()
        with self._results:
            draw_answer(answer)

    async def _evaluated(self, query: str, table_: str | None, graph: str | None) -> tuple[str, bytes]:
        inspect_query(query, Dataset(), self._service.settings.depth)
        spool, task = self._service.pool.evaluate(self._service.job("query", query, table_, graph))
        try:
            body = b"".join([piece async for piece in spool.pieces()])
        finally:
            task.cancel()
            spool.close()
        return spool.media, body

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
