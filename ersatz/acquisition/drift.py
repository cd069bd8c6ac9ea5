"""Graceful change: how far the responses of a view move when points are lost or the sensor gets noisier.

The yardstick is in the figure: how far apart the responses of other views of the same object are, and those
of other objects. Below the first line a change is smaller than walking around the object.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ersatz.acquisition.extras import pyplot
from ersatz.acquisition.figures import save
from ersatz.acquisition.scans import Scan
from ersatz.acquisition.shape_concepts import ShapeConcepts
from ersatz.errors import InputError, ScanError

SHARES: Final = (1.0, 0.7, 0.5, 0.3, 0.2, 0.1, 0.05)
"""Shares of the points kept."""

SIGMAS: Final = (0.0, 0.0005, 0.001, 0.002, 0.003, 0.005)
"""Standard deviations of noise added to every coordinate, metres; a depth camera at 1 m has about 0.002."""

Change = Callable[[Scan, float, np.random.Generator], Scan]


@dataclass(frozen=True, slots=True, eq=False)
class Drift:
    """Distances between the (concepts,) responses of views.

    Attributes
    ----------
    thinned : (shares, views) array, dimensionless
        Of each view to itself with a share of its points; NaN where too few were left.
    noisy : (sigmas, views) array, dimensionless
        Of each view to itself with noise.
    same, other : float, dimensionless
        Median distance of two views of one object, and of two objects; NaN if there are none.
    """

    thinned: NDArray[np.float64]
    noisy: NDArray[np.float64]
    same: float
    other: float


def drift(views: Iterable[Scan], concepts: ShapeConcepts, seed: int = 0) -> Drift:
    """Measure how far responses move when views lose points (`SHARES`) or gain noise (`SIGMAS`).

    Raises
    ------
    InputError
        If there are no views.
    """
    scans = list(views)
    if not scans:
        raise InputError("there are no views to thin out: give scans of objects")
    rng = np.random.default_rng(seed)
    before = np.stack([concepts.responses(scan) for scan in scans])
    pairs = list(combinations(range(len(scans)), 2))
    apart = np.array([np.linalg.norm(before[a] - before[b]) for a, b in pairs])
    same = np.array([scans[a].instance == scans[b].instance for a, b in pairs], dtype=bool)

    def moved(change: Change, amounts: Sequence[float]) -> NDArray[np.float64]:
        after = [[_responses(concepts, change(scan, amount, rng)) for scan in scans] for amount in amounts]
        distances: NDArray[np.float64] = np.linalg.norm(np.array(after) - before, axis=2)
        return distances

    return Drift(moved(_thin, SHARES), moved(_shake, SIGMAS), _median(apart[same]), _median(apart[~same]))


def drift_figure(found: Drift, path: str | Path) -> Path:
    """Draw medians and quartiles of the drift against the share of points kept and against the noise.

    Raises
    ------
    MissingDependencyError
        If matplotlib is missing.
    """
    figure, panels = pyplot().subplots(1, 2, figsize=(9, 3.6), sharey=True)
    _draw(panels[0], [100 * share for share in SHARES], found.thinned, found)
    _draw(panels[1], [1000 * sigma for sigma in SIGMAS], found.noisy, found)
    panels[0].set(xlabel="points kept, %", ylabel="distance of the responses", ylim=(0, None))
    panels[0].invert_xaxis()
    panels[1].set(xlabel="noise, mm")
    panels[1].legend(frameon=False)
    return save(figure, Path(path))


def _thin(scan: Scan, share: float, rng: np.random.Generator) -> Scan:
    chosen = np.sort(rng.permutation(len(scan.points))[: max(round(share * len(scan.points)), 1)])
    normals = None if scan.normals is None else scan.normals[chosen]
    return replace(scan, points=scan.points[chosen], normals=normals, colours=None)


def _shake(scan: Scan, sigma: float, rng: np.random.Generator) -> Scan:
    return replace(scan, points=scan.points + rng.normal(0.0, sigma, scan.points.shape))


def _responses(concepts: ShapeConcepts, scan: Scan) -> NDArray[np.float64]:
    try:
        return concepts.responses(scan)
    except ScanError:
        return np.full(concepts.settings.concepts, np.nan)


def _median(distances: NDArray[np.float64]) -> float:
    return float(np.median(distances)) if len(distances) else float("nan")


def _draw(axes: Any, amounts: list[float], distances: NDArray[np.float64], found: Drift) -> None:
    low, middle, high = np.nanquantile(distances, (0.25, 0.5, 0.75), axis=1)
    axes.fill_between(amounts, low, high, alpha=0.25, linewidth=0)
    axes.plot(amounts, middle, marker="o", label="the same view, changed")
    for distance, style, label in ((found.same, "--", "another view"), (found.other, ":", "another object")):
        if np.isfinite(distance):
            axes.axhline(distance, linestyle=style, color="black", linewidth=1, label=label)
    axes.spines[["top", "right"]].set_visible(False)
