"""Charts of properties and function models, as options of ECharts; plain data, no scripts."""

from dataclasses import dataclass
from typing import Any, Final

from ersatz.knowledge.base import KnowledgeBase
from ersatz.measurements import Kind
from ersatz.reasoner.representative import load_knowledge
from ersatz.service.pages.frame import COLOURS, INK
from ersatz.service.pages.markup import words_of

BINS: Final = 40


@dataclass(frozen=True, slots=True)
class Values:
    """Where the values of a property lie.

    Attributes
    ----------
    axes : tuple of str
        Names of the components; empty for a property of one number.
    points : list of (value or vector in the property's unit, quality)
    names : tuple of str
        Of the qualities, by rank.
    cuts : tuple of float
        Upper bounds between qualities, in the unit.
    """

    axes: tuple[str, ...]
    points: list[tuple[list[float], str]]
    names: tuple[str, ...]
    cuts: tuple[float, ...]


def value_chart(found: Values, unit: str) -> dict[str, Any]:
    """Return a histogram with the cut points, or the first two components of vectors."""
    return _scatter(found, unit) if found.axes else _histogram(found, unit)


def _axis(name: str) -> dict[str, Any]:
    return {
        "name": name,
        "nameLocation": "middle",
        "nameGap": 30,
        "nameTextStyle": {"color": INK},
        "axisLabel": {"color": INK},
        "axisLine": {"lineStyle": {"color": INK}},
        "splitLine": {"lineStyle": {"color": INK, "opacity": 0.18}},
    }


def _histogram(found: Values, unit: str) -> dict[str, Any]:
    values = [point[0][0] for point in found.points]
    low, high = min(values), max(values)
    width = (high - low) / BINS or 1.0
    counts: dict[str, dict[int, int]] = {name: {} for name in found.names}
    for (value,), quality in found.points:
        at = min(int((value - low) / width), BINS - 1)
        counts.setdefault(quality, {})[at] = counts.setdefault(quality, {}).get(at, 0) + 1
    series: list[dict[str, Any]] = [
        {
            "name": words_of(name),
            "type": "bar",
            "stack": "all",
            "barWidth": "96%",
            "itemStyle": {"color": COLOURS[at % len(COLOURS)]},
            "data": [[round(low + (k + 0.5) * width, 6), bins.get(k, 0)] for k in range(BINS)],
        }
        for at, (name, bins) in enumerate(counts.items())
    ]
    if series:
        series[0]["markLine"] = {
            "symbol": "none",
            "lineStyle": {"color": INK, "type": "dashed", "width": 1.5},
            "label": {"formatter": "{c}", "color": INK},
            "data": [{"xAxis": float(f"{cut:.4g}")} for cut in found.cuts],
        }
    return _frame_of_chart(
        series, {**_axis(f"value, {unit}"), "type": "value", "scale": True}, _axis("measurements")
    )


def _scatter(found: Values, unit: str) -> dict[str, Any]:
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
        "legend": {"top": 0, "textStyle": {"color": INK}},
        "tooltip": {},
        "animation": False,
        "xAxis": x,
        "yAxis": y,
        "series": series,
    }


def heat_map(kb: KnowledgeBase) -> dict[str, Any]:
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
        "axisLabel": {"color": INK, "fontSize": 11},
        "splitArea": {"show": False},
        "axisTick": {"show": False},
    }
    names = [words_of(known.qualities[at].name) for at in columns]
    return {
        "grid": {"left": 116, "right": 20, "top": 16, "bottom": 150},
        "tooltip": {"position": "top", "formatter": "{b}: {c}"},
        "animation": False,
        "xAxis": {
            "type": "category",
            "data": names,
            **axis,
            "axisLabel": {"color": INK, "rotate": 60, "fontSize": 11},
        },
        "yAxis": {"type": "category", "data": [words_of(name) for name in table_.names], **axis},
        "visualMap": {
            "min": 0,
            "max": 1,
            "orient": "horizontal",
            "left": "center",
            "bottom": 6,
            "calculable": True,
            "text": ["all that have the function", "none"],
            "textStyle": {"color": INK},
            "inRange": {"color": ["rgba(38,160,146,0.05)", "rgba(38,160,146,0.55)", "rgba(13,110,100,1)"]},
        },
        "series": [
            {
                "type": "heatmap",
                "data": data,
                "itemStyle": {"borderWidth": 1, "borderColor": "rgba(133,149,162,0.25)"},
            }
        ],
    }
