"""Shape concepts: patterns of composition that persist over many objects, learned without labels.

A re-implementation in the spirit of Mueller and Birk (ICRA 2016, IROS 2018), who publish no code: segments
become symbols, symbols compositions, and what persists among the compositions of *other* objects is a
concept. Of the patterns that persist, those are kept that several views of one object agree on most. An
unknown object's concept responses are its machine-generated property values (paper: Knowledge Acquisition).
"""

import hashlib
import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ersatz.acquisition.compositions import Compositions, CompositionSettings, compose
from ersatz.acquisition.repeatability import pattern_distances, relative_responses
from ersatz.acquisition.scans import Scan
from ersatz.acquisition.segments import Segments, SegmentSettings, prepare, segment
from ersatz.acquisition.symbols import Dictionary, Standard, SymbolSettings, describe_segments
from ersatz.errors import InputError

FORMAT: Final = 2
"""Version of the saved file."""


@dataclass(frozen=True, slots=True)
class ConceptSettings:
    """How shape concepts are learned; the defaults are the paper's where it gives any.

    Attributes
    ----------
    concepts : int
        Responses an object gets; 4 in the paper.
    patterns : int
        Patterns sought for each concept; the most repeatable become concepts. 1 takes the most prominent.
    persistence : bool
        Whether patterns are persistent modes, or clusters of plain k-means (ablation).
    neighbours : int
        Motifs that make a density.
    fewest_objects : int
        Different objects, not views, that a pattern must be seen on.
    nearest : int
        Exemplar objects whose mean distance is the response's.
    relative : bool
        Whether the scale of a response is the view's mean distance from all patterns, or the same for all
        views (ablation).
    softness : float
        That scale, in medians of the distance to the eighth neighbour in training.
    seed : int
        Of k-means.
    segments, symbols, compositions : the settings of these steps
    """

    concepts: int = 4
    patterns: int = 4
    persistence: bool = True
    neighbours: int = 12
    fewest_objects: int = 5
    nearest: int = 3
    relative: bool = True
    softness: float = 2.0
    seed: int = 0
    segments: SegmentSettings = field(default_factory=SegmentSettings)
    symbols: SymbolSettings = field(default_factory=SymbolSettings)
    compositions: CompositionSettings = field(default_factory=CompositionSettings)

    def __post_init__(self) -> None:
        """Refuse what makes no sense."""
        if not 1 <= self.concepts <= 64:
            raise InputError(f"concepts = {self.concepts}: between 1 and 64 can be learned")
        if not 1 <= self.patterns <= 64:
            raise InputError(f"patterns = {self.patterns}: between 1 and 64 for each concept can be sought")


@dataclass(frozen=True, slots=True, eq=False)
class ShapeConcepts:
    """What was learned: a dictionary of symbols, and exemplars of patterns, of which the first are concepts.

    Attributes
    ----------
    settings : ConceptSettings
    dictionary : Dictionary
    forms : Standard
        Of the descriptors of whole objects.
    exemplars : (e, d) float64 array
        Motifs of training views.
    patterns : (e,) int64 array
        Pattern of each exemplar. The first `settings.concepts` of them are the concepts, the most repeatable
        first; the others only say how far from anything known a view is.
    names : tuple of str
        Object of each exemplar; the nearest *objects* make a response.
    views : tuple of str
        Observation of each exemplar.
    width : float
        Standard deviation of a response that is not relative, in the unit of motif distances.
    prominences : (k,) float64 array
        Persistence of each pattern; inf for the strongest, 0 without persistence.
    repeatabilities : (k,) float64 array
        Intraclass correlation of each pattern's response on the training views.
    """

    settings: ConceptSettings
    dictionary: Dictionary
    forms: Standard
    exemplars: NDArray[np.float64]
    patterns: NDArray[np.int64]
    names: tuple[str, ...]
    views: tuple[str, ...]
    width: float
    prominences: NDArray[np.float64]
    repeatabilities: NDArray[np.float64]

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
            exp(-d²/2s²), d the mean distance to the nearest exemplar objects, s the root mean square of d
            over all patterns.

        Raises
        ------
        ScanError
            If the cloud is too poor to be segmented.
        """
        return self.respond(self.compositions(scan).motifs)

    def respond(self, motifs: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the (concepts,) responses of one object from the (g, d) motifs of its groups."""
        owners = np.unique(np.array(self.names), return_inverse=True)[1].astype(np.int64)
        groups = pattern_distances(
            motif_distances(motifs, self.exemplars), self.patterns, owners, self.settings.nearest
        )
        nearest = groups.min(axis=0, keepdims=True)
        return concept_responses(nearest, self.settings, self.width).ravel()

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
            "patterns": self.patterns,
            "prominences": self.prominences,
            "repeatabilities": self.repeatabilities,
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
                    f"{path}: shape concepts of format {head['format']}, this ERSATZ reads {FORMAT}: "
                    "learn them again"
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
                arrays["patterns"],
                tuple(head["names"]),
                tuple(head["views"]),
                float(head["width"]),
                arrays["prominences"],
                arrays["repeatabilities"],
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


def motif_distances(one: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the (n, m) Euclidean distances of (n, d) to (m, d) motifs."""
    squares = (one**2).sum(axis=1)[:, None] + (other**2).sum(axis=1)
    distances: NDArray[np.float64] = np.sqrt(np.maximum(squares - 2 * one @ other.T, 0))
    return distances


def concept_responses(
    distances: NDArray[np.float64], settings: ConceptSettings, width: float
) -> NDArray[np.float64]:
    """Return the (n, concepts) responses from (n, patterns) distances, or those of all patterns if fewer."""
    found = relative_responses(distances) if settings.relative else np.exp(-(distances**2) / (2 * width**2))
    return found[:, : settings.concepts]
