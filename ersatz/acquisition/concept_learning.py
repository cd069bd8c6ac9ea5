"""Learning shape concepts from scans of unknown objects, without labels.

Patterns that persist among the compositions of whole objects are sought, more of them than concepts are
wanted; those that several views of one object agree on most become concepts.
"""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ersatz.acquisition.compositions import compose, describe_groups
from ersatz.acquisition.persistence import Modes, filter_modes
from ersatz.acquisition.repeatability import intraclass, pattern_distances
from ersatz.acquisition.scans import Scan
from ersatz.acquisition.segments import Segments, prepare, segment
from ersatz.acquisition.shape_concepts import (
    ConceptSettings,
    ShapeConcepts,
    concept_responses,
    motif_distances,
)
from ersatz.acquisition.symbols import Standard, describe_segments, learn_dictionary
from ersatz.errors import InputError, ScanError


def learn_shape_concepts(scans: Iterable[Scan], settings: ConceptSettings | None = None) -> ShapeConcepts:
    """Learn symbols and shape concepts from scans of unknown objects.

    Only the scans' `instance` (or `group`) is used, to count objects instead of views; never their class.
    The thinned surfaces of all scans are held in memory (about 50 kB each).

    Parameters
    ----------
    scans : iterable of Scan
        Single views; at least `fewest_objects` different objects for every concept to be.
    settings : ConceptSettings or None

    Returns
    -------
    ShapeConcepts

    Raises
    ------
    InputError
        If fewer concepts persist than asked for.
    ScanError
        If a scan is too poor to be segmented.
    """
    settings = settings or ConceptSettings()
    cut: list[Segments] = []
    names: list[str] = []
    views: list[str] = []
    for scan in scans:
        cut.append(segment(prepare(scan, settings.segments), settings.segments))
        names.append(scan.group or scan.instance)
        views.append(scan.observation)
    if not cut:
        raise ScanError("no scans to learn shape concepts from")
    return learn_from_segments(cut, names, views, settings)


def learn_from_segments(
    cut: list[Segments], names: list[str], views: list[str], settings: ConceptSettings
) -> ShapeConcepts:
    """Learn from scans that are segmented already; see `learn_shape_concepts`."""
    described = [describe_segments(one) for one in cut]
    dictionary = learn_dictionary(np.concatenate(described), settings.symbols)
    wholes = np.concatenate([describe_groups(one, [tuple(range(len(one)))]) for one in cut])
    forms = Standard.of(wholes)
    whole_only = replace(settings.compositions, groups=False)
    motifs = np.concatenate(
        [compose(one, d, dictionary, forms, whole_only).motifs for one, d in zip(cut, described, strict=True)]
    )
    distances = motif_distances(motifs, motifs)
    np.fill_diagonal(distances, 0)
    owners = np.unique(np.array(names), return_inverse=True)[1].astype(np.int64)
    eighth = min(8, len(motifs) - 1)
    width = settings.softness * float(np.median(np.sort(distances, axis=1)[:, eighth]))
    modes = _modes(motifs, distances, owners, settings)
    modes, repeatabilities = _by_repeatability(modes, distances, owners, settings, width)
    kept = np.flatnonzero(modes.labels >= 0)
    return ShapeConcepts(
        settings,
        dictionary,
        forms,
        motifs[kept],
        modes.labels[kept],
        tuple(names[i] for i in kept),
        tuple(views[i] for i in kept),
        width,
        modes.prominences,
        repeatabilities,
    )


def _by_repeatability(
    modes: Modes,
    distances: NDArray[np.float64],
    owners: NDArray[np.int64],
    settings: ConceptSettings,
    width: float,
) -> tuple[Modes, NDArray[np.float64]]:
    """Return the patterns in the order of their repeatability, the best first, and the repeatabilities.

    Every view is compared with the exemplars of other objects only: it would recognise its own.
    """
    kept = np.flatnonzero(modes.labels >= 0)
    away = pattern_distances(
        distances[:, kept], modes.labels[kept], owners[kept], settings.nearest, own=owners
    )
    everything = replace(settings, concepts=away.shape[1])
    found = intraclass(concept_responses(away, everything, width), owners)
    # Rounded, so that the order does not hang on the last bit.
    order = np.argsort(-found.round(9), kind="stable")
    place = np.empty(len(order) + 1, dtype=np.int64)
    place[order] = np.arange(len(order))
    place[-1] = -1
    return Modes(place[modes.labels], modes.prominences[order]), found[order]


def _modes(
    motifs: NDArray[np.float64],
    distances: NDArray[np.float64],
    owners: NDArray[np.int64],
    settings: ConceptSettings,
) -> Modes:
    """Return at least `settings.concepts` patterns among motifs, or raise."""
    fewest = max(settings.fewest_objects, 2) if settings.persistence else 2
    for each in range(settings.patterns, 0, -1):
        count = each * settings.concepts
        if settings.persistence:
            modes = filter_modes(distances, owners, count, settings.neighbours, fewest)
        else:
            modes = _clusters(motifs, owners, min(count, len(motifs)), settings.seed)
        # Of few scans, many patterns are too small to count; then fewer and larger ones are sought.
        if len(modes.prominences) >= settings.concepts:
            return modes
    raise InputError(
        f"{len(modes.prominences)} shape concept(s) persist on at least {fewest} of "
        f"{len(np.unique(owners))} objects, {settings.concepts} were asked for: give scans of more "
        "objects, or ask for fewer concepts"
    )


def _clusters(motifs: NDArray[np.float64], owners: NDArray[np.int64], count: int, seed: int) -> Modes:
    """Return clusters of k-means that are seen on two objects or more."""
    from sklearn.cluster import KMeans

    labels = KMeans(count, n_init=10, random_state=seed).fit_predict(motifs)
    kept = [group for group in range(count) if len(np.unique(owners[labels == group])) >= 2]
    place = np.full(count, -1, dtype=np.int64)
    place[kept] = np.arange(len(kept))
    return Modes(place[labels], np.zeros(len(kept)))
