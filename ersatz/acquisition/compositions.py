"""Compositions: segments joined step by step, from components over groups to the whole (paper: compositions).

Neighbouring segments unite in the order of how alike they are. Every union is a group, and the last one
is the whole object: the 0-dimensional persistence of the segment graph.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ersatz.acquisition.segments import Segments
from ersatz.acquisition.symbols import HISTOGRAMS, Dictionary, Standard, describe, members


@dataclass(frozen=True, slots=True)
class CompositionSettings:
    """What a motif holds.

    Attributes
    ----------
    pair_levels : int
        Levels, from the most generic, at which touching pairs of symbols are counted.
    pair_weight : float
        Weight of the pairs against the symbols.
    form_weight : float
        Weight of the group's own descriptor (how pairs of its points lie to one another) against the symbols.
    groups : bool
        Whether groups count, or the whole object only (ablation).
    smallest : float
        Share of the visible area from which on a group is compared with concepts, the nearest of them
        counting. At 1 the whole object is compared only: half a thing looks like too many others.
    """

    pair_levels: int = 2
    pair_weight: float = 1.0
    form_weight: float = 1.0
    groups: bool = True
    smallest: float = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Compositions:
    """The groups of one scan, in the order of their making; the last is the whole object.

    Attributes
    ----------
    groups : tuple of tuple of int
        Segments of each group.
    areas : (g,) float64 array
        Share of the visible area.
    births : (g,) float64 array
        Descriptor distance at which the group came about.
    motifs : (g, d) float64 array
        Their numbers, to be compared by Euclidean distance.
    symbols : (s, levels) int64 array
        Of the segments.
    """

    groups: tuple[tuple[int, ...], ...]
    areas: NDArray[np.float64]
    births: NDArray[np.float64]
    motifs: NDArray[np.float64]
    symbols: NDArray[np.int64]


def unions(
    edges: NDArray[np.int64], distances: NDArray[np.float64], count: int
) -> list[tuple[tuple[int, ...], float]]:
    """Return every group and the distance at which it came about; the last holds all `count` segments."""
    parts: dict[int, tuple[int, ...]] = {i: (i,) for i in range(count)}
    home = list(range(count))
    found: list[tuple[tuple[int, ...], float]] = []
    for edge in np.lexsort((edges[:, 1], edges[:, 0], distances)):
        a, b = home[edges[edge, 0]], home[edges[edge, 1]]
        if a == b:
            continue
        parts[a] = tuple(sorted(parts[a] + parts.pop(b)))
        for member in parts[a]:
            home[member] = a
        found.append((parts[a], float(distances[edge])))
    if not found or len(found[-1][0]) < count:
        # Pieces that do not touch, as behind an occlusion, still belong to one object.
        found.append((tuple(range(count)), float(distances.max()) if len(distances) else 0.0))
    return found


def compose(
    segments: Segments,
    descriptors: NDArray[np.float64],
    dictionary: Dictionary,
    forms: Standard,
    settings: CompositionSettings,
) -> Compositions:
    """Join the segments of a scan into groups and describe each by its motif.

    Parameters
    ----------
    segments : Segments
    descriptors : (s, 27) array
        Of the segments.
    dictionary : Dictionary
    forms : Standard
        Of the descriptors of whole objects in training.
    settings : CompositionSettings

    Returns
    -------
    Compositions
    """
    place = dictionary.standard(descriptors)
    symbols = dictionary.assign(descriptors)
    edges = segments.edges
    distances = np.linalg.norm(place[edges[:, 0]] - place[edges[:, 1]], axis=1)
    found = unions(edges, distances, len(segments))
    areas = np.array([segments.areas[list(group)].sum() for group, _ in found])
    if not settings.groups:
        found, areas = found[-1:], areas[-1:]
    kept = [i for i, area in enumerate(areas) if area >= settings.smallest or i == len(areas) - 1]
    found, areas = [found[i] for i in kept], areas[kept]
    inside = np.zeros((len(found), len(segments)))
    for row, (group, _) in enumerate(found):
        inside[row, list(group)] = 1
    motifs = [
        _symbol_motif(inside, segments.areas, symbols, dictionary.levels),
        settings.pair_weight * _pair_motif(inside, edges, symbols, dictionary.levels[: settings.pair_levels]),
    ]
    if settings.form_weight:
        own = forms(describe_groups(segments, [group for group, _ in found]))
        motifs.append(settings.form_weight * own / np.sqrt(own.shape[1]))
    return Compositions(
        tuple(group for group, _ in found),
        areas,
        np.array([birth for _, birth in found]),
        np.concatenate(motifs, axis=1),
        symbols,
    )


def _symbol_motif(
    inside: NDArray[np.float64],
    areas: NDArray[np.float64],
    symbols: NDArray[np.int64],
    levels: tuple[int, ...],
) -> NDArray[np.float64]:
    """Return square roots of area-weighted symbol histograms; each level weighs half of the next."""
    parts = []
    for level, size in enumerate(levels):
        counts = inside @ (np.eye(size)[symbols[:, level]] * areas[:, None])
        shares = counts / counts.sum(axis=1, keepdims=True)
        parts.append(np.sqrt(shares * 2.0 ** (level + 1 - len(levels))))
    return np.concatenate(parts, axis=1)


def _pair_motif(
    inside: NDArray[np.float64],
    edges: NDArray[np.int64],
    symbols: NDArray[np.int64],
    levels: tuple[int, ...],
) -> NDArray[np.float64]:
    """Return square roots of the shares of symbol pairs among the touching segments of each group."""
    parts = [np.zeros((len(inside), 0))]
    both = inside[:, edges[:, 0]] * inside[:, edges[:, 1]]
    for level, size in enumerate(levels):
        ends = np.sort(symbols[edges, level], axis=1)
        upper = np.flatnonzero(np.triu(np.ones((size, size))).ravel())
        counts = both @ np.eye(size * size)[ends[:, 0] * size + ends[:, 1]][:, upper]
        shares = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
        parts.append(np.sqrt(shares / len(levels)))
    return np.concatenate(parts, axis=1)


def describe_groups(segments: Segments, groups: list[tuple[int, ...]]) -> NDArray[np.float64]:
    """Return the (g, 27) descriptors of groups as if each were one segment; histograms as square roots."""
    points = members(segments)
    sets = [np.concatenate([points[i] for i in group]) for group in groups]
    surface = segments.surface
    form = describe(surface.points, surface.normals, sets, surface.diagonal)
    form[:, :HISTOGRAMS] = np.sqrt(form[:, :HISTOGRAMS])
    return form
