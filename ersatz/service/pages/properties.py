"""Properties: what is measured, where the values lie, where they were cut, and the function models."""

from typing import Any

from nicegui import ui

from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.names import local_name
from ersatz.knowledge.vocabulary import KB
from ersatz.service.pages.charts import Values, heat_map, value_chart
from ersatz.service.pages.data import qualities, unit_of, units
from ersatz.service.pages.frame import PATIENCE, card, frame, heading, notice, show, table, title_line
from ersatz.service.pages.markup import page_of, tag, words_of
from ersatz.service.service import Service


def add(service: Service) -> None:
    """Add the pages."""

    @ui.page("/properties", response_timeout=PATIENCE)
    async def all_of_them() -> None:
        known = await service.read(lambda: units(service.kb))
        heat = await service.read(lambda: service.kb.view(heat_map))
        with frame(service, "Properties", "/properties"):
            heading(
                "Properties and qualities",
                "What is measured, in which unit, and how its values were cut into qualities.",
            )
            heads = ("property", "unit", "from less to more", "what is measured")
            for kind in ("physical", "functional"):
                with card(f"{kind} properties"):
                    rows = ((iri, row) for iri, row in known.items() if row["kind"] == kind)
                    table(heads, (_row(service.kb, iri, row) for iri, row in rows))
            with card("Function models: which physical qualities go with which functional ones"):
                words = "Of the objects with the functional quality (row), how many have the physical one."
                show(tag("p", f"{words} A share, 0 to 1.", class_="soft"))
                with ui.element("div").classes("scroll"):
                    # ECharts changes the options it is given: each page has its own.
                    ui.echart(dict(heat), renderer="canvas").classes("broad").style("height: 620px")

    @ui.page("/properties/{name}", response_timeout=PATIENCE)
    async def prop(name: str) -> None:
        known = await service.read(lambda: units(service.kb))
        iri = KB + name
        if iri not in known:
            with frame(service, "Unknown property", "/properties"):
                notice(f"There is no property {name!r}.", bad=True)
            return
        found = await service.read(lambda: _values(service.kb, iri))
        unit = unit_of(service.kb, iri)
        with frame(service, words_of(name), "/properties"):
            title_line(words_of(name), iri)
            show(tag("p", f"{known[iri]['definition'] or ''} Unit: {unit}.", class_="lead"))
            with card(f"Where the values lie ({unit})"):
                if found.points:
                    ui.echart(value_chart(found, unit)).style("height: 360px")
                else:
                    show(tag("div", "This knowledge base holds no single measurements of it.", class_="soft"))
            with card("Its qualities"):
                bounds = [] if found.axes else [f"above ({unit})", f"up to ({unit})"]
                heads = ("quality", "rank", f"centroid ({unit})", *bounds, "cut by")
                table(heads, _qualities(service.kb, iri, found), numeric=range(1, 3 + len(bounds)))


def _row(kb: KnowledgeBase, iri: str, row: dict[str, Any]) -> tuple[Any, ...]:
    name = words_of(local_name(iri)), page_of("property", iri)
    return name, unit_of(kb, iri), row["orientation"] or "", row["definition"] or ""


def _values(kb: KnowledgeBase, iri: str) -> Values:
    axes = tuple(str(row["name"]) for row in kb.query(_AXES.format(iri=iri)))
    points: list[tuple[list[float], str]] = []
    last = ""
    for row in kb.query((_VECTORS if axes else _SCALARS).format(iri=iri)):
        value = float(str(row["value"]))
        if axes and row["m"] == last:
            points[-1][0].append(value)
        else:
            points.append(([value], local_name(str(row["quality"] or ""))))
        last = str(row["m"])
    own = _of(kb, iri)
    names = tuple(local_name(quality) for quality, _ in own)
    cuts = tuple(float(str(row["upper"])) for _, row in own if row["upper"] is not None)
    return Values(axes, points, names, cuts)


def _of(kb: KnowledgeBase, iri: str) -> list[tuple[str, dict[str, Any]]]:
    return [(quality, row) for quality, row in qualities(kb).items() if row["property"] == iri]


def _qualities(kb: KnowledgeBase, iri: str, found: Values) -> list[tuple[Any, ...]]:
    """Return a row a quality of a property."""
    places: dict[str, list[str]] = {}
    for row in kb.ask("quality_coordinates") if found.axes else ():
        places.setdefault(str(row["quality"]), []).append(_short(row["coordinate"]))
    return [
        (
            (words_of(local_name(quality)), page_of("quality", quality)),
            row["rank"],
            " × ".join(places.get(quality, [])) or _short(row["centroid"]),
            *(_short(row[name]) for name in (() if found.axes else ("lower", "upper"))),
            row["method"] or "",
        )
        for quality, row in _of(kb, iri)
    ]


def _short(value: Any) -> str:
    return "" if value is None else f"{float(value):.4g}"


_HEAD = "PREFIX ersatz: <https://w3id.org/ersatz#> PREFIX rdfs: <http://www.w3.org/2000/01/rdf-schema#> "
_AXES = _HEAD + (
    "SELECT ?name {{ <{iri}> ersatz:hasAxis ?axis . ?axis ersatz:position ?at ; rdfs:label ?label "
    "BIND (STR(?label) AS ?name) }} ORDER BY ?at"
)
_SCALARS = _HEAD + (
    "SELECT ?m ?value ?quality {{ ?m ersatz:measuredProperty <{iri}> ; ersatz:rawValue ?value ; "
    "ersatz:assignedQuality ?quality }} ORDER BY ?value LIMIT 20000"
)
_VECTORS = _HEAD + (
    "SELECT ?m ?value ?quality {{ ?m ersatz:measuredProperty <{iri}> ; ersatz:assignedQuality ?quality ; "
    "ersatz:hasCoordinate ?c . ?c ersatz:onAxis ?axis ; ersatz:coordinate ?value . "
    "?axis ersatz:position ?at }} ORDER BY ?m ?at LIMIT 60000"
)
