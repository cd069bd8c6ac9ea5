"""The paper's two heat maps, side by side: what experts choose, and what ERSATZ finds similar."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from ersatz.evaluation.results import Results
from ersatz.evaluation.scenarios import Scenario

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

NOT_OFFERED: Final = "#D9D9D9"


def heat_maps(results: Results, figure: "Figure") -> bool:
    """Draw the paper's two heat maps: the experts' choices, and ERSATZ's similarity."""
    names = sorted({n for s in results.scenarios for n in (s.missing, *s.available)})
    answers = results.first.answers
    experts = _matrix(names, results.scenarios, [s.shares() for s in results.scenarios])
    scores = [a.scores or (0.0,) * len(s.available) for s, a in zip(results.scenarios, answers, strict=True)]
    ours = _matrix(names, results.scenarios, scores)
    dots = _both(names, results)
    side = 1.7 + 0.27 * len(names)
    figure.set_size_inches(2 * side + 1.0, side + 1.3)
    axes = figure.subplots(1, 2)
    voted = any(s.voters for s in results.scenarios)
    what = "experts' choices (share of votes)" if voted else "right answers (share of scenarios)"
    for axis, values, title in ((axes[0], experts, what), (axes[1], ours, "ERSATZ (similarity)")):
        image = _map(axis, values, names, title)
        rows, columns = np.nonzero(dots)
        for row, column in zip(rows, columns, strict=True):
            light = values[row, column] > 0.55
            axis.plot(column, row, "o", ms=6, color="black" if light else "white", mec="none")
    for missing, offered in sorted(_unanswered(names, results)):
        axes[1].plot(offered, missing, "x", ms=4, color="white", mew=0.8)
    axes[0].set_ylabel("missing tool", fontsize=11)
    figure.colorbar(image, ax=list(axes), shrink=0.6, aspect=30, pad=0.01)
    for axis in axes:
        axis.set_xlabel("available object", fontsize=11)
    legend = "grey: not offered      dot: chosen by both      cross: no answer"
    figure.suptitle(legend, fontsize=10, color="#444444")
    return True


def _map(axis: "Axes", values: NDArray[np.float64], names: Sequence[str], title: str) -> Any:
    axis.set_facecolor(NOT_OFFERED)
    image = axis.imshow(np.ma.masked_invalid(values), cmap="viridis", vmin=0, vmax=1)
    axis.set_xticks(range(len(names)), names, rotation=90, fontsize=10.5)
    axis.set_yticks(range(len(names)), names, fontsize=10.5)
    axis.set_xticks(np.arange(-0.5, len(names)), minor=True)
    axis.set_yticks(np.arange(-0.5, len(names)), minor=True)
    axis.grid(which="minor", color="white", lw=0.8)
    axis.tick_params(which="both", length=0)
    axis.set_title(title, fontsize=12)
    for spine in axis.spines.values():
        spine.set_visible(False)
    return image


def _matrix(
    names: Sequence[str], scenarios: Sequence[Scenario], values: Sequence[Sequence[float]]
) -> NDArray[np.float64]:
    """Return (missing, available) means over scenarios; nan where never offered."""
    row = {name: at for at, name in enumerate(names)}
    sums, counts = np.zeros((2, len(names), len(names)))
    for scenario, numbers in zip(scenarios, values, strict=True):
        columns = [row[name] for name in scenario.available]
        sums[row[scenario.missing], columns] += numbers
        counts[row[scenario.missing], columns] += 1
    return np.where(counts > 0, sums / np.maximum(counts, 1), np.nan)


def _both(names: Sequence[str], results: Results) -> NDArray[np.bool_]:
    row = {name: at for at, name in enumerate(names)}
    dots = np.zeros((len(names), len(names)), dtype=bool)
    for scenario, answer in zip(results.scenarios, results.first.answers, strict=True):
        for name in scenario.chosen() & (answer.accepted or frozenset()):
            dots[row[scenario.missing], row[name]] = True
    return dots


def _unanswered(names: Sequence[str], results: Results) -> set[tuple[int, int]]:
    """Return the cells of scenarios without an answer."""
    row = {name: at for at, name in enumerate(names)}
    return {
        (row[scenario.missing], row[name])
        for scenario, answer in zip(results.scenarios, results.first.answers, strict=True)
        if answer.scores is None
        for name in scenario.available
    }
