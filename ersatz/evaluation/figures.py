"""Figures of the experiment, as PNG and SVG. matplotlib is imported when a figure is drawn."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeVar

import numpy as np

from ersatz.errors import MissingDependencyError
from ersatz.evaluation.agreement import HEADINGS
from ersatz.evaluation.calibration import Calibration, wilson
from ersatz.evaluation.heat_maps import heat_maps
from ersatz.evaluation.palette import BLUE, GREEN, GREY, ORANGE, STYLE
from ersatz.evaluation.results import Results, Standing
from ersatz.evaluation.sweep_figures import sweeps, thresholds
from ersatz.evaluation.sweeps import SHOWN

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

T = TypeVar("T")


def draw_all(results: Results, folder: Path) -> list[str]:
    """Draw every figure there is data for, as PNG and SVG; return their names in the report's order.

    Raises
    ------
    MissingDependencyError
        If matplotlib is not installed.
    """
    return [name for name, draw in FIGURES.items() if draw_one(name, draw, results, folder)]


def draw_one(name: str, draw: Callable[[T, "Figure"], bool], data: T, folder: Path) -> bool:
    """Draw a figure, if there is data for it, as PNG and SVG.

    Raises
    ------
    MissingDependencyError
        If matplotlib is not installed.
    """
    try:
        import matplotlib as mpl
        from matplotlib.figure import Figure
    except ImportError as error:
        raise MissingDependencyError(f"figures need matplotlib ({error}): install ersatz[figures]") from None
    with mpl.rc_context(STYLE):
        figure = Figure(layout="constrained")
        if not draw(data, figure):
            return False
        figure.savefig(folder / f"{name}.png", metadata={"Software": ""})
        figure.savefig(folder / f"{name}.svg", metadata={"Date": None, "Creator": None})
    return True


def methods(results: Results, figure: "Figure") -> bool:
    """Draw every method's agreement with its interval, beside chance and ceiling."""
    rows = list(results.standings)
    figure.set_size_inches(11, 1.2 + 0.3 * len(rows))
    axes = figure.subplots(1, 3, sharey=True)
    at = np.arange(len(rows))[::-1]
    for axis, metric in zip(axes, SHOWN, strict=True):
        for y, one in zip(at, rows, strict=True):
            _interval(axis, y, one, metric)
        axis.set_xlabel(HEADINGS[metric])
        axis.axvline(rows[0].metrics[metric].mean or 0, color=BLUE, lw=0.8, ls=":")
        axis.grid(axis="x", color="#EEEEEE")
        axis.set_axisbelow(True)
    axes[0].set_yticks(at, [one.label for one in rows])
    chance = next((one for one in rows if one.name == "chance"), None)
    if chance:
        axes[0].axvline(chance.metrics["top1"].mean or 0, color=GREY, lw=1, ls="--")
    ceiling = results.ceilings["blind"].mean
    if ceiling is not None:
        axes[0].axvline(ceiling, color=GREEN, lw=1, ls="--")
        axes[0].annotate("ceiling", (ceiling, len(rows) - 0.4), color=GREEN, ha="right", fontsize=8)
    axes[1].axvline(0, color=GREY, lw=1, ls="--")
    axes[2].plot([], [], "o", color=BLUE, label="ERSATZ and variants")
    axes[2].plot([], [], "s", color=ORANGE, label="rivals")
    axes[2].plot([], [], "s", color=ORANGE, mfc="white", label="threshold chosen on other tools")
    figure.legend(loc="outside upper right", ncols=3, frameon=False, fontsize=8)
    return True


def calibration(results: Results, figure: "Figure") -> bool:
    """Draw how often an object is chosen, by how similar ERSATZ finds it."""
    pairs = [
        (score, share)
        for scenario, answer in zip(results.scenarios, results.first.answers, strict=True)
        for score, share in zip(answer.scores or (), scenario.shares(), strict=False)
    ]
    if not pairs:
        return False
    scores, shares = np.array(pairs).T
    figure.set_size_inches(5.2, 4.6)
    axis, counts = figure.subplots(2, 1, sharex=True, height_ratios=(4, 1))
    edges = np.linspace(0, 1, 11)
    bins = np.minimum(np.digitize(scores, edges) - 1, 9)
    for one in sorted(set(bins.tolist())):
        inside = shares[bins == one]
        mean = float(inside.mean())
        low, high = wilson(mean, len(inside))
        x = float(scores[bins == one].mean())
        axis.errorbar(x, mean, [[mean - low], [high - mean]], fmt="o", color=BLUE, capsize=3)
    axis.plot((0, 1), (0, 1), color=GREY, lw=1, ls="--")
    axis.axvline(0.35, color=ORANGE, lw=1, ls=":")
    axis.annotate("paper's φ", (0.36, 0.96), color=ORANGE, fontsize=8, va="top")
    axis.set(ylabel="share chosen by experts, or right", xlim=(-0.02, 1.02), ylim=(-0.02, 1.02))
    counts.hist(scores, edges.tolist(), color=BLUE, alpha=0.6)
    counts.set(xlabel="ERSATZ's similarity", ylabel="pairs")
    return True


def reliability(calibrations: Mapping[str, Calibration], figure: "Figure") -> bool:
    """Draw how often answers were confirmed, by how probable they were said to be, and how many they were."""
    if not calibrations:
        return False
    wide = min(4, len(calibrations))
    tall = -(-len(calibrations) // wide)
    figure.set_size_inches(0.6 + 2 * wide, 3.3 * tall)
    ratios = (3, 1) * tall
    axes = figure.subplots(2 * tall, wide, sharex=True, sharey="row", squeeze=False, height_ratios=ratios)
    pairs = [(above, below) for row in range(tall) for above, below in zip(*axes[2 * row :][:2], strict=True)]
    for (axis, counts), (name, found) in zip(pairs, calibrations.items(), strict=False):
        _reliability(axis, counts, found)
        axis.set_title(f"{name}\n{found.error:.3f} off, {found.error_by_chance:.3f} by chance", fontsize=8)
    for unused in pairs[len(calibrations) :]:
        for axis in unused:
            axis.set_visible(False)
    for above, below in pairs[::wide]:
        above.set_ylabel("share that is true (95 %)")
        below.set_ylabel("answers")
    figure.supxlabel("P(accepted) that was said", fontsize=9)
    return True


def _reliability(axis: "Axes", counts: "Axes", found: Calibration) -> None:
    """Draw one calibration; bins whose interval does not reach what was said are orange and square."""
    axis.plot((0, 1), (0, 1), color=GREY, lw=1, ls="--")
    for one in found.bins():
        colour, mark = (ORANGE, "s") if one.off else (BLUE, "o")
        reach = [[one.true - one.low], [one.high - one.true]]
        axis.errorbar(one.said, one.true, reach, fmt=mark, ms=4, color=colour, capsize=2, lw=1.2)
        bar = counts.bar(one.said, one.count, 0.075, color=colour, alpha=0.6)
        counts.bar_label(bar, rotation=90, fontsize=6, padding=2)
    axis.set(xlim=(-0.04, 1.04), ylim=(-0.02, 1.02), xticks=(0, 0.5, 1), yticks=(0, 0.5, 1))
    axis.tick_params(labelbottom=True)
    counts.set(yscale="log", ylim=(1, found.said.size**1.8), yticks=[])
    counts.minorticks_off()


def stability(results: Results, figure: "Figure") -> bool:
    """Draw what becomes of the answers when the objects of every class are drawn again."""
    if not results.resamples:
        return False
    tools = sorted({s.missing for s in results.scenarios})
    same = {tool: [] for tool in tools}  # type: dict[str, list[float]]
    spreads = []
    for at, scenario in enumerate(results.scenarios):
        before = results.first.answers[at].best(scenario)
        after = [answers[at] for answers in results.resamples]
        same[scenario.missing] += [
            float(bool(a.best(scenario) & before) or not before | a.best(scenario)) for a in after
        ]
        known = [a.scores for a in after if a.scores is not None]
        if len(known) > 1:
            spreads += np.std(np.array(known), axis=0).tolist()
    figure.set_size_inches(10.5, 4.4)
    axis, spread, overall = figure.subplots(1, 3, width_ratios=(2, 1.2, 1.2))
    kept = sorted(((float(np.mean(same[tool])), tool) for tool in tools), reverse=True)
    axis.bar(range(len(kept)), [share for share, _ in kept], color=BLUE)
    axis.set_xticks(range(len(kept)), [tool for _, tool in kept], rotation=55, ha="right")
    axis.set(ylabel="resamples with the same best object", ylim=(0, 1))
    spread.hist(spreads, 15, color=BLUE)
    spread.set(xlabel="standard deviation of a similarity", ylabel="pairs")
    _over_objects(results, overall)
    return True


FIGURES: Final[dict[str, Callable[[Results, Any], bool]]] = {
    "heat_maps": heat_maps,
    "methods": methods,
    "calibration": calibration,
    "thresholds": thresholds,
    "sweeps": sweeps,
    "stability": stability,
}
"""In the order of the report."""

CAPTIONS: Final = {
    "heat_maps": "Which objects are chosen for which missing tool, by the experts (or by the stated answers) "
    "and by ERSATZ's similarity; means over the scenarios of a tool. Grey: never offered together. Dots: a "
    "choice of the experts that ERSATZ accepts. Crosses: ERSATZ gives no answer.",
    "methods": "Agreement of every method with 95 % intervals (tools drawn again). Dashed: chance (grey) and "
    "what one ranking a tool can reach at best (green); dotted: ERSATZ. Hollow: the method only ranks, its "
    "threshold was chosen on other tools.",
    "calibration": "How often an object is chosen, or right, by its similarity (Wilson intervals).",
    "thresholds": "Agreement over the two thresholds of the paper; its own pair is framed. Nothing was "
    "chosen from it.",
    "sweeps": "One choice changed at a time; bands and bars are 95 % intervals, grey is the share of "
    "scenarios with an answer.",
    "stability": "The objects of every class drawn again with replacement, and the knowledge base grounded "
    "again.",
}


def _interval(axis: "Axes", y: float, one: Standing, metric: str) -> None:
    e = one.metrics[metric]
    if e.mean is not None and e.low is not None and e.high is not None:
        colour, mark = (BLUE, "o") if one.ours else (ORANGE, "s")
        face = "white" if metric == "f1" and not one.decides else colour
        axis.plot((e.low, e.high), (y, y), color=colour, lw=1.2)
        axis.plot(e.mean, y, mark, color=colour, mfc=face, ms=5)


def _over_objects(results: Results, axis: "Axes") -> None:
    found = results.over_objects()
    for at, metric in enumerate(SHOWN):
        e, fixed = found[metric], results.first.metrics[metric]
        for x, one, colour in ((at - 0.12, fixed, ORANGE), (at + 0.12, e, BLUE)):
            axis.plot((x, x), (one.low or 0, one.high or 0), color=colour, lw=2)
            axis.plot(x, one.mean or 0, "o", color=colour)
    axis.plot([], [], color=ORANGE, lw=2, label="tools drawn again")
    axis.plot([], [], color=BLUE, lw=2, label="objects drawn again")
    axis.set_xticks(range(len(SHOWN)), [HEADINGS[m].replace(" ", "\n", 1) for m in SHOWN])
    axis.set_xlim(-0.5, len(SHOWN) - 0.5)
    axis.legend(frameon=False, fontsize=8)
