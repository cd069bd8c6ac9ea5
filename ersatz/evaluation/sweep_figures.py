"""Figures of what hangs on the settings: agreement over both thresholds, and one choice changed at a time."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ersatz.evaluation.agreement import HEADINGS
from ersatz.evaluation.palette import BLUE, GREEN, GREY, ORANGE
from ersatz.evaluation.results import Results
from ersatz.evaluation.sweeps import SHOWN, Cell

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def thresholds(results: Results, figure: "Figure") -> bool:
    """Draw the agreement over theta and phi; the paper's pair is framed."""
    thetas, phis = (sorted({key[at] for key in results.grid}) for at in (0, 1))
    figure.set_size_inches(11.5, 3.9)
    axes = figure.subplots(1, 3, sharey=True)
    for axis, metric in zip(axes, SHOWN, strict=True):
        values = np.array([[results.grid[t, p][metric] for p in phis] for t in thetas])
        image = axis.imshow(values, cmap="viridis", origin="lower", aspect="auto")
        middle = (values.max() + values.min()) / 2
        for row, column in np.ndindex(values.shape):
            tone = "black" if values[row, column] > middle else "white"
            text = f"{values[row, column]:.2f}"
            axis.text(column, row, text, ha="center", va="center", fontsize=7.5, color=tone)
        axis.set_xticks(range(len(phis)), [f"{float(p):g}" for p in phis])
        axis.set_yticks(range(len(thetas)), [f"{float(t):g}" for t in thetas])
        axis.set(title=HEADINGS[metric], xlabel="φ (relevance and substitutes)")
        for at in [at for at, theta in enumerate(thetas) if float(theta) == 0.35]:
            axis.add_patch(_frame(at))
        figure.colorbar(image, ax=axis, shrink=0.8)
    axes[0].set_ylabel("θ (representative)")
    return True


def sweeps(results: Results, figure: "Figure") -> bool:
    """Draw every sweep and ablation: one panel a parameter."""
    parameters = list(dict.fromkeys(cell.parameter for cell in results.cells))
    if not parameters:
        return False
    wide = 4
    tall = -(-len(parameters) // wide)
    figure.set_size_inches(12.5, 2.75 * tall)
    axes = np.asarray(figure.subplots(tall, wide, sharey=True, squeeze=False)).ravel()
    for axis, parameter in zip(axes, parameters, strict=False):
        _panel(axis, [cell for cell in results.cells if cell.parameter == parameter])
        axis.set_title(parameter, fontsize=9)
        axis.grid(axis="y", color="#EEEEEE")
    for axis in axes[len(parameters) :]:
        axis.set_visible(False)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper right", ncols=4, frameon=False)
    return True


def _panel(axis: "Axes", cells: Sequence[Cell]) -> None:
    """Draw one sweep: bands over numbers, bars beside one another over names."""
    ordered = all(_is_number(cell.value) for cell in cells)
    if not ordered:
        cells = list({cell.value: cell for cell in cells}.values())
    line, dashes, apart = ("-", "--", 0.0) if ordered else ("", "", 0.12)
    at = np.arange(len(cells))
    for place, (metric, colour, mark) in enumerate(zip(SHOWN, (BLUE, ORANGE, GREEN), "os^", strict=True)):
        x = at + place * apart - apart
        found = [cell.metrics[metric] for cell in cells]
        means, low, high = np.array([(one.mean or 0, one.low or 0, one.high or 0) for one in found]).T
        if ordered:
            axis.fill_between(x, low, high, color=colour, alpha=0.12, lw=0)
        else:
            axis.vlines(x, low, high, color=colour, alpha=0.5)
        axis.plot(x, means, mark + line, color=colour, ms=4, lw=1, label=HEADINGS[metric])
    determined = [cell.determined for cell in cells]
    axis.plot(at, determined, color=GREY, lw=1, ls=dashes, marker="_", ms=10, label="share answered")
    axis.set_xlim(-0.5, len(cells) - 0.5)
    turned = not ordered and len(cells) > 3
    axis.set_xticks(
        at, [c.value for c in cells], rotation=40 if turned else 0, ha="right" if turned else "center"
    )


def _frame(at: int) -> Any:
    from matplotlib.patches import Rectangle

    return Rectangle((at - 0.5, at - 0.5), 1, 1, fill=False, ec=ORANGE, lw=2)


def _is_number(text: str) -> bool:
    return text.replace(".", "", 1).isdigit()
