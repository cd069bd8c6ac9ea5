"""Properties and qualities: where the values lie, where they were cut, and what goes with a function."""

from decimal import Decimal
from typing import Any

from nicegui import ui

from ersatz.errors import ErsatzError
from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.names import local_name
from ersatz.knowledge.terms import degree_text
from ersatz.knowledge.vocabulary import KB
from ersatz.measurements import Kind
from ersatz.reasoner.representative import function_model, load_knowledge
from ersatz.service.pages.classes import MOST
from ersatz.service.pages.data import units
from ersatz.service.pages.frame import (
    PATIENCE,
    bar,
    card,
    chip,
    chips,
    copyable,
    frame,
    heading,
    link_to,
    notice,
    page_of,
    table,
    text,
    words_of,
)
from ersatz.service.pages.individuals import unit_of
from ersatz.service.service import Service

COLOURS = ["#0d7a6f", "#3d6fb4", "#c98a2b", "#b4552d", "#7a5ba6", "#5b8c3a", "#b04a77", "#4a6670"]
_INK = "#8595a2"
"""Of axes and labels: readable on light and on dark."""


def add(service: Service) -> None:
    """Add the pages."""

    @ui.page("/properties", response_timeout=PATIENCE)
    async def all_of_them() -> None:
        known = await service.read(lambda: units(service.kb))
        heat = await service.read(lambda: _heat_map(service.kb))
        with frame(service, "Properties", "/properties"):
            heading(
                "Properties and qualities",
                "What is measured, in which unit, and how its values were cut into qualities.",
            )
            for kind in ("physical", "functional"):
                with card(f"{kind} properties"):
                    table(
                        ["property", "unit", "from less to more", "what is measured"],
                        [
                            (
                                (words_of(local_name(iri)), page_of("property", iri)),
                                unit_of(known, iri),
                                str(row["orientation"] or ""),
                                str(row["definition"] or ""),
                            )
                            for iri, row in known.items()
                            if row["kind"] == kind
                        ],
                    )
            with card("Function models: which physical qualities go with which functional ones"):
                ui.echart(heat, renderer="canvas").style("height: 620px")

    @ui.page("/properties/{name}", response_timeout=PATIENCE)
    async def prop(name: str) -> None:
        known = await service.read(lambda: units(service.kb))
        iri = KB + name
        if iri not in known:
            with frame(service, "Unknown property", "/properties"):
                notice(f"There is no property {name!r}.", bad=True)
            return
        found = await service.read(lambda: _Values(service.kb, iri))
        unit = unit_of(known, iri)
        with frame(service, words_of(name), "/properties"):
            text(words_of(name), "h1")
            copyable(iri)
            ui.label(f"{known[iri]['definition'] or ''} Unit: {unit}.").classes("lead")
            with card(f"Where the values lie ({unit})"):
                if found.points:
                    ui.echart(_chart(found, unit)).style("height: 360px")
                else:
                    ui.label("This knowledge base holds no single measurements of it.").classes("soft")
            with card("Its qualities"):
                bounds = [] if found.axes else [f"above ({unit})", f"up to ({unit})"]
                table(
                    ["quality", "rank", f"centroid ({unit})", *bounds, "cut by"],
                    found.qualities,
                    numeric=range(1, 3 + len(bounds)),
                )

    _add_qualities(service)


def _add_qualities(service: Service) -> None:
    @ui.page("/qualities/{name}", response_timeout=PATIENCE)
    async def quality(name: str) -> None:
        iri = KB + name
        try:
            rows = await service.read(lambda: service.kb.ask("classes_with_quality", quality=iri).rows)
            holders = await service.read(lambda: service.kb.ask("holders", quality=iri).rows)
            model = await service.read(lambda: _model(service.kb, iri))
            of = await service.read(lambda: _property_of(service.kb, iri))
        except (ErsatzError, ValueError) as error:
            with frame(service, "Unknown quality", "/properties"):
                notice(str(error), bad=True)
            return
        with frame(service, words_of(name), "/properties"):
            text(words_of(name), "h1")
            copyable(iri)
            with ui.element("p").classes("lead"):
                text("A quality of ")
                ui.link(words_of(local_name(of)), page_of("property", of))
                text(".")
            if model:
                with card("What goes with it"):
                    _bars([(KB + n, words_of(n), count, total) for n, count, total in model], "quality")
            with card("Classes that have it"):
                _bars(
                    [
                        (str(c), local_name(str(c)), Decimal(str(n)), Decimal(str(t)))
                        for c, n, t, _ in rows[:MOST]
                    ],
                    "class",
                )
            with card(f"Individuals that hold it ({len(holders)})"), chips():
                for instance, _ in holders[:MOST]:
                    chip(local_name(str(instance)), page_of("instance", str(instance)))
            with card("More"), chips():
                chip("its neighbourhood", link_to("/graph", node=name))
                chip("as Turtle", f"/kb/{name}")


def _bars(rows: list[tuple[str, str, Any, Any]], kind: str) -> None:
    with (
        ui.element("div")
        .classes("bars")
        .style("grid-template-columns: minmax(120px, max-content) 1fr max-content")
    ):
        for iri, name, count, total in rows:
            ui.link(name, page_of(kind, iri))
            bar(float(count) / float(total), typical=True, functional=kind == "quality")
            ui.label(f"{count} of {total}").classes("of")


def _model(kb: KnowledgeBase, iri: str) -> list[tuple[str, str, str]]:
    known = kb.view(load_knowledge)
    if iri not in known.functions.iris:
        return []
    entries = sorted(function_model(kb, iri).entries, key=lambda one: -one.proportion)
    return [(one.quality, degree_text(one.count), degree_text(one.total)) for one in entries[:24]]


def _property_of(kb: KnowledgeBase, iri: str) -> str:
    return next(str(row["property"]) for row in kb.ask("qualities") if row["quality"] == iri)


class _Values:
    """What the page of a property shows.

    Attributes
    ----------
    points : list of (value or vector in the property's unit, quality)
    cuts : list of the upper bounds between qualities
    """

    def __init__(self, kb: KnowledgeBase, iri: str) -> None:
        self.axes = [str(row["name"]) for row in kb.query(_AXES.format(iri=iri))]
        self.points: list[tuple[list[float], str]] = []
        last = ""
        for row in kb.query((_VECTORS if self.axes else _SCALARS).format(iri=iri)):
            value = float(str(row["value"]))
            if self.axes and row["m"] == last:
                self.points[-1][0].append(value)
            else:
                self.points.append(([value], local_name(str(row["quality"] or ""))))
            last = str(row["m"])
        rows = [row for row in kb.ask("qualities") if row["property"] == iri]
        self.names = [local_name(str(row["quality"])) for row in rows]
        self.cuts = [float(str(row["upper"])) for row in rows if row["upper"] is not None]
        places: dict[str, list[str]] = {}
        for row in kb.ask("quality_coordinates") if self.axes else ():
            places.setdefault(str(row["quality"]), []).append(_short(row["coordinate"]))
        self.qualities = [
            (
                (words_of(local_name(str(row["quality"]))), page_of("quality", str(row["quality"]))),
                row["rank"],
                " × ".join(places.get(str(row["quality"]), [])) or _short(row["centroid"]),
                *(_short(row[name]) for name in (() if self.axes else ("lower", "upper"))),
                str(row["method"] or ""),
            )
            for row in rows
        ]


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


def _short(value: Any) -> str:
    return "" if value is None else f"{float(value):.4g}"


def _axis(name: str) -> dict[str, Any]:
    return {
        "name": name,
        "nameLocation": "middle",
        "nameGap": 30,
        "nameTextStyle": {"color": _INK},
        "axisLabel": {"color": _INK},
        "axisLine": {"lineStyle": {"color": _INK}},
        "splitLine": {"lineStyle": {"color": _INK, "opacity": 0.18}},
    }


def _chart(found: _Values, unit: str) -> dict[str, Any]:
    return _scatter(found, unit) if found.axes else _histogram(found, unit)


def _histogram(found: _Values, unit: str) -> dict[str, Any]:
    values = [point[0][0] for point in found.points]
    low, high = min(values), max(values)
    width = (high - low) / 40 or 1.0
    counts: dict[str, dict[int, int]] = {name: {} for name in found.names}
    for (value,), quality in found.points:
        at = min(int((value - low) / width), 39)
        counts.setdefault(quality, {})[at] = counts.setdefault(quality, {}).get(at, 0) + 1
    series: list[dict[str, Any]] = [
        {
            "name": words_of(name),
            "type": "bar",
            "stack": "all",
            "barWidth": "96%",
            "itemStyle": {"color": COLOURS[at % len(COLOURS)]},
            "data": [[round(low + (k + 0.5) * width, 6), bins.get(k, 0)] for k in range(40)],
        }
        for at, (name, bins) in enumerate(counts.items())
    ]
    if series:
        series[0]["markLine"] = {
            "symbol": "none",
            "lineStyle": {"color": _INK, "type": "dashed", "width": 1.5},
            "label": {"formatter": "{c}", "color": _INK},
            "data": [{"xAxis": float(f"{cut:.4g}")} for cut in found.cuts],
        }
    return _frame_of_chart(
        series, {**_axis(f"value, {unit}"), "type": "value", "scale": True}, _axis("measurements")
    )


def _scatter(found: _Values, unit: str) -> dict[str, Any]:
    of: dict[str, list[list[float]]] = {name: [] for name in found.names}
    for point, quality in found.points:
        of.setdefault(quality, []).append([*point[:2], *([0.0] if len(point) == 1 else [])])
    series = [
        {
            "name": words_of(name),
            "type": "scatter",
            "symbolSize": 9,
            "itemStyle": {"color": COLOURS[at % len(COLOURS)], "opacity": 0.8},
            "data": points,
        }
        for at, (name, points) in enumerate(of.items())
    ]
    first, second = [*found.axes, *found.axes][:2]
    return _frame_of_chart(series, _axis(f"{first}, {unit}"), {**_axis(f"{second}, {unit}"), "nameGap": 42})


def _frame_of_chart(series: list[dict[str, Any]], x: dict[str, Any], y: dict[str, Any]) -> dict[str, Any]:
    return {
        "grid": {"left": 60, "right": 24, "top": 64, "bottom": 50},
        "legend": {"top": 0, "textStyle": {"color": _INK}},
        "tooltip": {},
        "animation": False,
        "xAxis": x,
        "yAxis": y,
        "series": series,
    }


def _heat_map(kb: KnowledgeBase) -> dict[str, Any]:
    """Return the function models as a chart: share of a function's holders that have a physical quality."""
    known = kb.view(load_knowledge)
    columns = [at for at, one in enumerate(known.qualities) if one.kind is Kind.PHYSICAL]
    table_ = known.functions
    data = [
        [x, y, round(int(table_.counts[y, at]) / max(int(table_.totals[y, at]), 1), 3)]
        for y in range(len(table_.iris))
        for x, at in enumerate(columns)
        if table_.totals[y, at]
    ]
    axis = {
        "axisLabel": {"color": _INK, "fontSize": 11},
        "splitArea": {"show": False},
        "axisTick": {"show": False},
    }
    names = [words_of(known.qualities[at].name) for at in columns]
    return {
        "grid": {"left": 116, "right": 20, "top": 16, "bottom": 150},
        "tooltip": {},
        "animation": False,
        "xAxis": {
            "type": "category",
            "data": names,
            **axis,
            "axisLabel": {"color": _INK, "rotate": 60, "fontSize": 11},
        },
        "yAxis": {"type": "category", "data": [words_of(name) for name in table_.names], **axis},
        "visualMap": {
            "min": 0,
            "max": 1,
            "orient": "horizontal",
            "left": "center",
            "bottom": 6,
            "calculable": True,
            "text": ["share of the function's holders 1", "0"],
            "textStyle": {"color": _INK},
            "inRange": {"color": ["#eef4f3", "#9fd0c9", "#0d7a6f", "#06403b"]},
        },
        "series": [
            {"type": "heatmap", "data": data, "itemStyle": {"borderWidth": 1, "borderColor": "transparent"}}
        ],
    }
