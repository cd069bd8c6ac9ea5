"""Graph: what a thing is joined to; a click joins the next."""

from typing import Any, Final

from nicegui import events, ui
from pyoxigraph import NamedNode

from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.names import local_name
from ersatz.knowledge.vocabulary import KB
from ersatz.service.pages.data import is_individual
from ersatz.service.pages.frame import COLOURS, INK, PATIENCE, card, frame, heading, notice, show, table
from ersatz.service.pages.markup import link_to, shown, tag
from ersatz.service.service import Service

MOST: Final = 60
"""Neighbours that are drawn of one thing."""

_SORTS: Final = ("class", "individual", "quality", "property", "other")


def add(service: Service) -> None:
    """Add the page."""

    @ui.page("/graph", response_timeout=PATIENCE)
    async def graph(node: str = "") -> None:
        with frame(service, "Graph", "/graph"):
            heading("Graph", "Click a node to open its neighbours; double click to go to its page.")
            box: ui.input = (
                ui.input("Thing", value=node or "Tray")
                .props("outlined dense")
                .style("margin-bottom: 16px; max-width: 420px")
                .on("keydown.enter", lambda: ui.navigate.to(link_to("/graph", node=box.value)))
            )
            picture = _Picture(service)
            try:
                found = await picture.grow(KB + (node or await service.read(lambda: _first(service.kb))))
            except ValueError:
                found = False
            if not found:
                notice(f"Nothing here is called {node!r}.", bad=True)
                return
            with card():
                chart: ui.echart = ui.echart(
                    picture.options(), on_point_click=lambda e: _clicked(e, picture, chart, rows)
                )
                chart.style("height: 600px").on(
                    "chart:dblclick", lambda e: ui.navigate.to(f"/thing/{local_name(str(e.args))}")
                )
            rows: ui.element = ui.element("section").classes("card")
            with rows:
                _table(picture)


async def _clicked(
    event: events.EChartPointClickEventArguments, picture: "_Picture", chart: Any, rows: Any
) -> None:
    iri = str((event.data or {}).get("id", "")) if isinstance(event.data, dict) else ""
    if iri.startswith(KB) and await picture.grow(iri):
        chart.options.clear()
        chart.options.update(picture.options())
        chart.update()
        rows.clear()
        with rows:
            _table(picture)


def _table(picture: "_Picture") -> None:
    def cell(iri: str) -> Any:
        return (shown(iri), link_to("/graph", node=local_name(iri))) if iri.startswith(KB) else shown(iri)

    show(tag("h2", "What is joined by what"))
    table(["from", "by", "to"], [(cell(a), shown(p), cell(b)) for a, p, b in sorted(picture.edges)[:300]])


class _Picture:
    """The part of the graph that is open."""

    def __init__(self, service: Service) -> None:
        self._service = service
        self._sorts: dict[str, str] = {}
        self.edges: set[tuple[str, str, str]] = set()
        self._open: list[str] = []

    async def grow(self, iri: str) -> bool:
        """Add a thing's neighbours; tell whether it has any."""
        rows = await self._service.read(lambda: _neighbours(self._service.kb, iri))
        for a, p, b in rows:
            self.edges.add((a, p, b))
            for one in (a, b):
                if one not in self._sorts:
                    self._sorts[one] = await self._service.read(lambda one=one: _sort(self._service.kb, one))  # type: ignore[misc]
        if rows and iri not in self._open:
            self._open.append(iri)
        return bool(rows)

    def options(self) -> dict[str, Any]:
        """Return the chart."""
        nodes = [
            {
                "id": iri,
                "name": shown(iri),
                "category": _SORTS.index(sort),
                "symbolSize": 34 if iri in self._open else 15,
                "label": {"fontWeight": "bold" if iri in self._open else "normal"},
            }
            for iri, sort in self._sorts.items()
        ]
        return {
            "color": list(COLOURS),
            "tooltip": {},
            "legend": {"top": 0, "data": list(_SORTS), "textStyle": {"color": INK}},
            "series": [
                {
                    "type": "graph",
                    "layout": "force",
                    "roam": True,
                    "draggable": True,
                    "categories": [{"name": sort} for sort in _SORTS],
                    "zoom": 1.0 if len(nodes) > 16 else 1.8,
                    "force": {"repulsion": 260, "edgeLength": [80, 150], "gravity": 0.08},
                    "label": {"show": True, "position": "right", "color": INK, "fontSize": 11},
                    "labelLayout": {"hideOverlap": True},
                    "lineStyle": {"color": INK, "opacity": 0.45},
                    "edgeSymbol": ["none", "arrow"],
                    "edgeSymbolSize": 6,
                    "data": nodes,
                    "edges": [{"source": a, "target": b, "value": shown(p)} for a, p, b in self.edges],
                }
            ],
        }


def _neighbours(kb: KnowledgeBase, iri: str) -> list[tuple[str, str, str]]:
    """Return up to `MOST` edges from and to a thing; what only says its type is left out."""
    half = MOST // 2
    node = NamedNode(iri)  # raises ValueError for what is no IRI: nothing of a stranger's gets into a query
    text = (
        f"SELECT ?a ?p ?b {{ {{ SELECT ({node} AS ?a) ?p ?b {{ {node} ?p ?b FILTER (ISIRI(?b)) }} "
        f"ORDER BY DESC (STRENDS(STR(?p), '#type')) ?p ?b "
        f"LIMIT {half} }} UNION {{ SELECT ?a ?p ({node} AS ?b) {{ ?a ?p {node} }} LIMIT {half} }} }}"
    )
    boring = "http://www.w3.org/2002/07/owl#"
    return [
        (str(row["a"]), str(row["p"]), str(row["b"]))
        for row in kb.query(text)
        if not str(row["b"]).startswith(boring)
    ]


def _sort(kb: KnowledgeBase, iri: str) -> str:
    if not iri.startswith(KB):
        return "other"
    kind = kb.kind_of(iri)
    if kind == "instance":
        return "individual" if is_individual(kb, iri) else "other"
    return kind


def _first(kb: KnowledgeBase) -> str:
    names = [local_name(str(row["class"])) for row in kb.ask("classes")]
    return "Tray" if "Tray" in names else names[0]
