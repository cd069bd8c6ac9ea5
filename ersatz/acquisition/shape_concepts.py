"""Shape concepts: patterns of composition that persist over many objects, learned without labels.

A re-implementation in the spirit of Mueller and Birk (ICRA 2016, IROS 2018), who publish no code: segments
become symbols, symbols compositions, and what persists among the compositions of *other* objects is a
concept. An unknown object's concept responses are its machine-generated property values (paper:
Knowledge Acquisition).
"""

import hashlib
import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ersatz.acquisition.compositions import Compositions, CompositionSettings, compose, describe_groups
from ersatz.acquisition.persistence import Modes, filter_modes
from ersatz.acquisition.scans import Scan
from ersatz.acquisition.segments import Segments, SegmentSettings, prepare, segment
from ersatz.acquisition.symbols import (
    Dictionary,
    Standard,
    SymbolSettings,
    describe_segments,
    learn_dictionary,
)
from ersatz.errors import InputError, ScanError

FORMAT: Final = 1
"""Version of the saved file."""


@dataclass(frozen=True, slots=True)
class ConceptSettings:
    """How shape concepts are learned; the defaults are the paper's where it gives any.

    Attributes
    ----------
    concepts : int
        Responses an object gets; 4 in the paper.
    persistence : bool
        Whether concepts are persistent modes, or clusters of plain k-means (ablation).
    neighbours : int
        Motifs that make a density.
    fewest_objects : int
        Different objects, not views, that a concept must be seen on.
    nearest : int
        Exemplar objects whose mean distance is the response's.
    softness : float
        Width of the response, in medians of the distance to the eighth neighbour in training.
    seed : int
        Of k-means.
    segments, symbols, compositions : the settings of these steps
    """

    concepts: int = 4
    persistence: bool = True
    neighbours: int = 12
    fewest_objects: int = 5
    nearest: int = 3
    softness: float = 2.0
    seed: int = 0
    segments: SegmentSettings = field(default_factory=SegmentSettings)
    symbols: SymbolSettings = field(default_factory=SymbolSettings)
    compositions: CompositionSettings = field(default_factory=CompositionSettings)

    def __post_init__(self) -> None:
        """Refuse what makes no sense."""
        if not 1 <= self.concepts <= 64:
            raise InputError(f"concepts = {self.concepts}: between 1 and 64 can be learned")


@dataclass(frozen=True, slots=True, eq=False)
class ShapeConcepts:
    """What was learned: a dictionary of symbols and exemplars of each concept.

    Attributes
    ----------
    settings : ConceptSettings
    dictionary : Dictionary
    forms : Standard
        Of the descriptors of whole objects.
    exemplars : (e, d) float64 array
        Motifs of training views.
    concepts : (e,) int64 array
        Concept of each exemplar.
    names : tuple of str
        Object of each exemplar; the nearest *objects* make a response.
    views : tuple of str
        Observation of each exemplar.
    width : float
        Standard deviation of a response, in the unit of motif distances.
    prominences : (k,) float64 array
        Persistence of each concept; inf for the strongest, 0 without persistence.
    """

    settings: ConceptSettings
    dictionary: Dictionary
    forms: Standard
    exemplars: NDArray[np.float64]
    concepts: NDArray[np.int64]
    names: tuple[str, ...]
    views: tuple[str, ...]
    width: float
    prominences: NDArray[np.float64]

    def segments(self, scan: Scan) -> Segments:
        """Return the segments of a scan (at least one)."""
        return segment(prepare(scan, self.settings.segments), self.settings.segments)

    def compositions(self, scan: Scan) -> Compositions:
        """Return the groups of a scan with their motifs, the last of the whole object."""
        return self._compose(self.segments(scan))

    def _compose(self, segments: Segments) -> Compositions:
        settings = self.settings.compositions
        return compose(segments, describe_segments(segments), self.dictionary, self.forms, settings)

    def motif(self, scan: Scan) -> NDArray[np.float64]:
        """Return the (d,) motif of a whole scan."""
        motif: NDArray[np.float64] = self.compositions(scan).motifs[-1]
        return motif

    def responses(self, scan: Scan) -> NDArray[np.float64]:
        """Return how much the object looks like each concept.

        Parameters
        ----------
        scan : Scan
            One view, or a cloud of all sides.

        Returns
        -------
        (concepts,) array, dimensionless, in [0, 1]
            exp(-d²/2w²), d the mean distance of the most similar group to the nearest exemplar objects.

        Raises
        ------
        ScanError
            If the cloud is too poor to be segmented.
        """
        return self.respond(self.compositions(scan).motifs)

    def respond(self, motifs: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the (concepts,) responses of one object from the (g, d) motifs of its groups."""
        squares = (motifs**2).sum(axis=1)[:, None] + (self.exemplars**2).sum(axis=1)
        distances = np.sqrt(np.maximum(squares - 2 * motifs @ self.exemplars.T, 0))
        owners = np.unique(np.array(self.names), return_inverse=True)[1]
        values = []
        for concept in range(self.settings.concepts):
            mine = self.concepts == concept
            order = np.argsort(owners[mine], kind="stable")
            starts = np.flatnonzero(np.diff(owners[mine][order], prepend=-1))
            nearest = np.sort(np.minimum.reduceat(distances[:, mine][:, order], starts, axis=1), axis=1)
            values.append(nearest[:, : self.settings.nearest].mean(axis=1).min())
        return np.exp(-(np.array(values) ** 2) / (2 * self.width**2))

    def save(self, path: str | Path) -> None:
        """Write everything to an .npz file of plain arrays and one JSON text; the same bytes every time."""
        with Path(path).open("wb") as file:
            np.savez_compressed(file, allow_pickle=False, **self._arrays())

    @property
    def sha256(self) -> str:
        """The digest of all that was learned, as a knowledge base names it."""
        digest = hashlib.sha256()
        for name, array in sorted(self._arrays().items()):
            digest.update(f"{name} {array.dtype} {array.shape}".encode() + array.tobytes())
        return digest.hexdigest()

    def _arrays(self) -> dict[str, NDArray[Any]]:
        head = {
            "format": FORMAT,
            "settings": asdict(self.settings),
            "names": self.names,
            "views": self.views,
            "width": self.width,
        }
        return {
            "head": np.frombuffer(json.dumps(head, sort_keys=True).encode(), dtype=np.uint8),
            "symbol_mean": self.dictionary.standard.mean,
            "symbol_scale": self.dictionary.standard.scale,
            "symbol_centres": self.dictionary.centres,
            "symbol_parents": self.dictionary.parents,
            "form_mean": self.forms.mean,
            "form_scale": self.forms.scale,
            "exemplars": self.exemplars,
            "concepts": self.concepts,
            "prominences": self.prominences,
        }

    @classmethod
    def load(cls, path: str | Path) -> "ShapeConcepts":
        """Read what `save` wrote. Nothing in the file is executed.

        Raises
        ------
        InputError
            If the file is missing, not of this kind, or of a later version.
        """
        try:
            with np.load(path, allow_pickle=False) as stored:
                arrays = {name: np.asarray(stored[name]) for name in stored.files}
            head = json.loads(arrays["head"].tobytes())
            if head["format"] != FORMAT:
                raise InputError(
                    f"{path}: shape concepts of format {head['format']}; this is format {FORMAT}"
                )
            return cls(
                _settings(head["settings"]),
                Dictionary(
                    Standard(arrays["symbol_mean"], arrays["symbol_scale"]),
                    arrays["symbol_centres"],
                    arrays["symbol_parents"],
                ),
                Standard(arrays["form_mean"], arrays["form_scale"]),
                arrays["exemplars"],
                arrays["concepts"],
                tuple(head["names"]),
                tuple(head["views"]),
                float(head["width"]),
                arrays["prominences"],
            )
        except InputError:
            raise
        except (OSError, ValueError, KeyError, TypeError, EOFError) as error:
            raise InputError(f"{path}: not a file of shape concepts ({error})") from error


def _settings(stored: dict[str, Any]) -> ConceptSettings:
    return ConceptSettings(
        **{
            **stored,
            "segments": SegmentSettings(**stored["segments"]),
            "symbols": SymbolSettings(tuple(stored["symbols"]["levels"])),
            "compositions": CompositionSettings(**stored["compositions"]),
        }
    )


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
    squares = (motifs**2).sum(axis=1)
    distances = np.sqrt(np.maximum(squares[:, None] + squares - 2 * motifs @ motifs.T, 0))
    np.fill_diagonal(distances, 0)
    owners = np.unique(np.array(names), return_inverse=True)[1].astype(np.int64)
    modes = _modes(motifs, distances, owners, settings)
    kept = np.flatnonzero(modes.labels >= 0)
    eighth = min(8, len(motifs) - 1)
    width = settings.softness * float(np.median(np.sort(distances, axis=1)[:, eighth]))
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
    )


def _largest(modes: Modes, owners: NDArray[np.int64], count: int) -> Modes:
    """Return the groups seen on most objects, where more are apart than are wanted; drop the others."""
    groups = range(len(modes.prominences))
    seen = [len(np.unique(owners[modes.labels == group])) for group in groups]
    kept = sorted(sorted(groups, key=lambda group: -seen[group])[:count])
    labels = np.full(len(modes.labels), -1, dtype=np.int64)
    for number, group in enumerate(kept):
        labels[modes.labels == group] = number
    return Modes(labels, modes.prominences[kept])


def _modes(
    motifs: NDArray[np.float64],
    distances: NDArray[np.float64],
    owners: NDArray[np.int64],
    settings: ConceptSettings,
) -> Modes:
    """Return `settings.concepts` groups of motifs, or raise."""
    if settings.persistence:
        modes = filter_modes(
            distances, owners, settings.concepts, settings.neighbours, settings.fewest_objects
        )
    else:
        from sklearn.cluster import KMeans

        model = KMeans(settings.concepts, n_init=10, random_state=settings.seed)
        modes = Modes(model.fit_predict(motifs).astype(np.int64), np.zeros(settings.concepts))
    if len(modes.prominences) > settings.concepts:
        modes = _largest(modes, owners, settings.concepts)
    if len(modes.prominences) < settings.concepts:
        raise InputError(
            f"{len(modes.prominences)} shape concept(s) persist on at least {settings.fewest_objects} of "
            f"{len(np.unique(owners))} objects, {settings.concepts} were asked for: give scans of more "
            "objects, or ask for fewer concepts"
        )
    return modes
