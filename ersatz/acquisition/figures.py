"""Pictures of a scan's segments, symbols, compositions and responses, and of the concepts' exemplars."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ersatz.acquisition.compositions import unions
from ersatz.acquisition.extras import pyplot
from ersatz.acquisition.scans import Scan
from ersatz.acquisition.segments import Segments
from ersatz.acquisition.shape_concepts import ShapeConcepts
from ersatz.acquisition.symbols import describe_segments
from ersatz.errors import InputError

EXEMPLARS: Final = 6
"""Exemplars of a concept on a contact sheet."""


def scan_figures(scan: Scan, concepts: ShapeConcepts, folder: str | Path) -> list[Path]:
    """Draw a scan: `segments.png`, `symbols.png`, `compositions.png` and `responses.png`.

    Parameters
    ----------
    scan : Scan
        One view.
    concepts : ShapeConcepts
    folder : str or Path
        Made if missing.

    Returns
    -------
    list of Path
        The files written.

    Raises
    ------
    ScanError
        If the cloud is too poor.
    MissingDependencyError
        If matplotlib is missing.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    cut = concepts.segments(scan)
    symbols = concepts.dictionary.assign(describe_segments(cut))
    levels = concepts.dictionary.levels
    titles = ["segments", *(f"{size} symbols" for size in levels)]
    columns = [np.arange(len(cut)), *symbols.T]
    sheet = _clouds(cut, columns[1:], titles[1:], [size - 1 for size in levels])
    return [
        save(_clouds(cut, columns[:1], titles[:1], [len(cut) - 1]), folder / "segments.png"),
        save(sheet, folder / "symbols.png"),
        save(_tree(cut, concepts), folder / "compositions.png"),
        save(_bars(concepts.responses(scan), scan.label), folder / "responses.png"),
    ]


def concept_figure(concepts: ShapeConcepts, scans: Iterable[Scan], path: str | Path) -> Path:
    """Draw a contact sheet: one row a concept, with the exemplars nearest to the concept's middle.

    Parameters
    ----------
    concepts : ShapeConcepts
    scans : iterable of Scan
        The views the concepts were learned from; others are passed over.
    path : str or Path
        PNG.

    Returns
    -------
    Path

    Raises
    ------
    InputError
        If none of the exemplars is among the scans.
    """
    wanted = _exemplars(concepts)
    found: dict[tuple[str, str], Segments] = {}
    for scan in scans:
        key = (scan.group or scan.instance, scan.observation)
        if any(key in row for row in wanted):
            found[key] = concepts.segments(scan)
    if not found:
        raise InputError(
            "none of the scans is an exemplar of these concepts: give those they were learned from"
        )
    plot = pyplot()
    figure = plot.figure(figsize=(2.2 * EXEMPLARS, 2.4 * len(wanted)))
    for row, keys in enumerate(wanted):
        for column, key in enumerate(keys):
            if key not in found:
                continue
            axes = figure.add_subplot(len(wanted), EXEMPLARS, row * EXEMPLARS + column + 1)
            _cloud(axes, found[key], np.arange(len(found[key])), len(found[key]) - 1)
            axes.set_title(f"{row + 1}: {key[0]}" if column == 0 else key[0], fontsize=8)
    return save(figure, Path(path))


def _exemplars(concepts: ShapeConcepts) -> list[list[tuple[str, str]]]:
    """Return for each concept the most central exemplar of each object, nearest first."""
    rows = []
    for concept in range(concepts.settings.concepts):
        mine = np.flatnonzero(concepts.patterns == concept)
        middle = concepts.exemplars[mine].mean(axis=0)
        order = mine[np.argsort(np.linalg.norm(concepts.exemplars[mine] - middle, axis=1), kind="stable")]
        first = {concepts.names[i]: concepts.views[i] for i in order[::-1]}
        names = list(dict.fromkeys(concepts.names[i] for i in order))[:EXEMPLARS]
        rows.append([(name, first[name]) for name in names])
    return rows


def _view_plane(segments: Segments) -> NDArray[np.float64]:
    """Return (n, 2) coordinates of the points as seen along their mean normal."""
    points, normals = segments.surface.points, segments.surface.normals
    towards = normals.mean(axis=0)
    towards = towards / max(float(np.linalg.norm(towards)), 1e-9)
    side = np.cross([0.0, 0, 1] if abs(towards[2]) < 0.9 else [0.0, 1, 0], towards)
    side /= np.linalg.norm(side)
    return np.stack([points @ side, points @ np.cross(towards, side)], axis=1)


def _cloud(axes: Any, segments: Segments, values: NDArray[np.int64], highest: int) -> None:
    plane = _view_plane(segments)
    kept = segments.labels >= 0
    axes.scatter(*plane[~kept].T, s=1, c="lightgrey")
    colours = values[segments.labels[kept]]
    axes.scatter(*plane[kept].T, s=3, c=colours, cmap="tab20", vmin=0, vmax=max(highest, 1))
    axes.set_aspect("equal")
    axes.set_axis_off()


def _clouds(cut: Segments, columns: list[NDArray[np.int64]], titles: list[str], highest: list[int]) -> Any:
    figure = pyplot().figure(figsize=(3 * len(columns), 3))
    for number, (values, title, top) in enumerate(zip(columns, titles, highest, strict=True), start=1):
        axes = figure.add_subplot(1, len(columns), number)
        _cloud(axes, cut, values, top)
        axes.set_title(title)
    return figure


def _tree(cut: Segments, concepts: ShapeConcepts) -> Any:
    """Return the unions of segments as a dendrogram; the height is the descriptor distance."""
    place = concepts.dictionary.standard(describe_segments(cut))
    edges = cut.edges
    found = unions(edges, np.linalg.norm(place[edges[:, 0]] - place[edges[:, 1]], axis=1), len(cut))
    # The last union holds the order in which the leaves must stand so that no lines cross.
    leaves: list[tuple[int, ...]] = [(i,) for i in range(len(cut))]
    for group, _ in found:
        parts = [leaf for leaf in leaves if set(leaf) <= set(group)]
        leaves = [leaf for leaf in leaves if leaf not in parts] + [sum(parts, ())]
    where = {frozenset((leaf,)): (float(x), 0.0) for x, leaf in enumerate(leaves[-1])}
    figure = pyplot().figure(figsize=(6, 4))
    axes = figure.add_subplot()
    for group, height in found:
        parts_of = [key for key in where if key <= set(group)]
        spots = [where.pop(key) for key in parts_of]
        for x, low in spots:
            axes.plot([x, x], [low, height], "k-", linewidth=1)
        axes.plot([min(x for x, _ in spots), max(x for x, _ in spots)], [height, height], "k-", linewidth=1)
        where[frozenset(group)] = (float(np.mean([x for x, _ in spots])), height)
    axes.set_xticks(range(len(cut)), [str(leaf) for leaf in leaves[-1]])
    axes.set_xlabel("segment")
    axes.set_ylabel("descriptor distance")
    return figure


def _bars(responses: NDArray[np.float64], title: str) -> Any:
    figure = pyplot().figure(figsize=(4, 3))
    axes = figure.add_subplot()
    axes.bar([f"shape {i}" for i in range(1, len(responses) + 1)], responses)
    axes.set_ylim(0, 1)
    axes.set_title(title, fontsize=8)  # names of scans are long
    axes.set_ylabel("response")
    return figure


def save(figure: Any, path: Path) -> Path:
    """Write a figure as PNG: the same figure gives the same bytes."""
    figure.tight_layout()
    # No date and no version in the file.
    figure.savefig(path, dpi=120, metadata={"Software": None})
    pyplot().close(figure)
    return path
