"""Relevance (paper: O_F' and O_P'): which functions a tool is about, and which qualities they rest on."""

from dataclasses import dataclass
from enum import StrEnum
from fractions import Fraction
from itertools import groupby
from typing import Any, Final, cast

import numpy as np
from numpy.typing import NDArray

from ersatz.errors import InputError
from ersatz.knowledge.queries import exact
from ersatz.measurements import Kind
from ersatz.reasoner.graded import SPAN, Layout, Weights
from ersatz.reasoner.posterior import posterior
from ersatz.reasoner.representative import Knowledge, Memberships, pack
from ersatz.reasoner.similarity import CRISP, GRADED, RATIOS, Similarity, above, compare

PAPER_PROPERTIES: Final = (
    *(f"shape_{rank}" for rank in range(1, 5)),
    "weight",
    "rigidity",
    "hollowness",
    "support",
    "containment",
    "blockage",
)
"""The ten properties of the paper's experiment."""


_PAPER: Final = Fraction(35, 100)
_USUAL: Final = Fraction(35, 100)
"""Stands for the threshold that is usual with the similarity; told by identity."""

_BY_MODE: Final = cast("Similarity", "")
"""Stands for the similarity that is usual in crisp or graded reasoning."""

ORDINAL_TOLERANCE: Final = Fraction(67, 100)
"""Of four qualities a property, less than one rank apart in the mean (which is 2/3)."""


class Combine(StrEnum):
    """What O_P' is when several functions are relevant; the paper writes it for one."""

    UNION = "union"
    INTERSECTION = "intersection"


class Spacing(StrEnum):
    """How far apart the qualities of a property are, where their order counts.

    - rank: each as far from the next as any other.
    - centroid: as far as their centroids; of vectors, along the way from one to the next.
    - ratio: amounts, which have a unit and are above 0, as far as the ratios of their centroids, so that
      0.2 kg is as far from 0.4 as 1 kg from 2 (Weber's law); dimensionless numbers as by centroid.
    """

    RANK = "rank"
    CENTROID = "centroid"
    RATIO = "ratio"


@dataclass(frozen=True, slots=True)
class ReasonerSettings:
    """How substitutes are found.

    Thresholds are given as str, int, Decimal, Fraction or float (taken by its repr) and kept exactly.

    Attributes
    ----------
    representative : Fraction
        theta: a quality is representative from this degree on; in (0, 1]. Paper: 0.35.
    tolerance : Fraction
        phi: a candidate stands in if its similarity is above; in [0, 1]. Paper: 0.35. Ordinal: 0.67, less
        than one rank apart in the mean, of the paper's four qualities a property.
    relevance_tolerance : Fraction
        The same phi for relevant functions; a setting of its own, with the same default. Graded: 0, for
        a function counts by its weight.
    combine : Combine
    similarity : Similarity
        By default jaccard, the paper's rule; graded, ordinal.
    above_lowest : bool
        Leave out the lowest quality of each functional property: it says what an object cannot do.
    fallback : bool
        With no relevant function, take O_P' = O_rp, flagged, instead of leaving the answer undetermined.
    properties : tuple of str or None
        Reason with these properties only.
    graded : bool
        Reason with degrees rather than with what is representative.
    alpha, beta : Fraction
        Of graded tversky: what a lacking and what an extra degree weigh beside a shared one.
    spacing : Spacing
        Of ordinal: how far apart two qualities of a property are.
    certainty : Fraction or None
        Instead of m >= theta, ask for P(m >= theta) >= certainty given what was observed: 1 of 1 object is
        less sure than 10 of 10. In (0, 1); the paper's rule is without it.
    """

    representative: Fraction = _PAPER
    tolerance: Fraction = _USUAL
    relevance_tolerance: Fraction = _USUAL
    combine: Combine = Combine.UNION
    similarity: Similarity = _BY_MODE
    above_lowest: bool = False
    fallback: bool = False
    properties: tuple[str, ...] | None = None
    graded: bool = False
    alpha: Fraction = RATIOS[Similarity.TVERSKY][0]
    beta: Fraction = RATIOS[Similarity.TVERSKY][1]
    spacing: Spacing = Spacing.RANK
    certainty: Fraction | None = None

    def __post_init__(self) -> None:
        """Fill in what is usual, make thresholds exact and check their ranges."""
        self._fill()
        for name in ("representative", "tolerance", "relevance_tolerance"):
            object.__setattr__(self, name, exact(getattr(self, name), name))
            if not 0 <= getattr(self, name) <= 1:
                raise InputError(f"{name} is {getattr(self, name)}: thresholds lie between 0 and 1")
        if self.representative == 0:
            raise InputError(
                "representative is 0: every quality ever observed would be typical; give more than 0"
            )
        kinds = ("combine", Combine), ("similarity", Similarity), ("spacing", Spacing)
        for name, options in kinds:
            try:
                object.__setattr__(self, name, options(getattr(self, name)))
            except ValueError:
                choice = ", ".join(options)
                raise InputError(f"{name} {getattr(self, name)!r} is not one of {choice}") from None
        if isinstance(self.properties, str):
            raise InputError(f"properties is {self.properties!r}: give a list of names, not one string")
        if self.properties is not None:
            object.__setattr__(self, "properties", tuple(sorted(self.properties)))
        self._check_combination()

    @classmethod
    def written(cls, properties: str | None = None, **chosen: Any) -> "ReasonerSettings":
        """Return the settings somebody wrote down: None is as usual.

        Parameters
        ----------
        properties : str, optional
            "paper", or names with commas.
        **chosen
            Other attributes.
        """
        given = {name: value for name, value in chosen.items() if value is not None}
        if properties:
            listed = tuple(name.strip() for name in properties.split(","))
            given["properties"] = PAPER_PROPERTIES if properties == "paper" else listed
        return cls(**given)

    def __hash__(self) -> int:
        """Return a hash of what usually differs: those of five fractions would take as long as an answer."""
        return hash(
            (self.representative.as_integer_ratio(), self.similarity, self.properties, self.certainty)
        )

    @property
    def ratio(self) -> tuple[Fraction, Fraction]:
        """Tversky's alpha and beta of the similarity, where it is a ratio of shares."""
        return (self.alpha, self.beta) if self.similarity is Similarity.TVERSKY else RATIOS[self.similarity]

    def _fill(self) -> None:
        if not self.similarity:
            object.__setattr__(self, "similarity", "ordinal" if self.graded else "jaccard")
        usual = ORDINAL_TOLERANCE if self.similarity == Similarity.ORDINAL else _PAPER
        for name, value in (
            ("tolerance", usual),
            ("relevance_tolerance", Fraction(0) if self.graded else _PAPER),
        ):
            if getattr(self, name) is _USUAL:
                object.__setattr__(self, name, value)

    def _check_combination(self) -> None:
        """Refuse what has no meaning, rather than ignore it."""
        forms = GRADED if self.graded else CRISP
        if self.similarity not in forms:
            raise InputError(
                f"similarity {self.similarity} is not for {'graded' if self.graded else 'crisp'} reasoning, "
                f"which takes {', '.join(forms)}: {'leave graded out' if self.graded else 'add graded'}"
            )
        if self.graded and self.combine is not Combine.UNION:
            raise InputError(f"combine {self.combine} is crisp: graded reasoning weighs every function")
        if self.certainty is not None:
            object.__setattr__(self, "certainty", exact(self.certainty, "certainty"))
            if not 0 < self.certainty < 1:
                raise InputError(f"certainty is {self.certainty}: it lies between 0 and 1, without them")
            if self.graded:
                raise InputError(f"certainty {self.certainty} is crisp: graded reasoning has no cut")
        if self.graded and self.representative != _PAPER:
            raise InputError(f"representative {self.representative} is crisp: graded reasoning has no cut")
        if self.spacing is not Spacing.RANK and self.similarity is not Similarity.ORDINAL:
            raise InputError(f"spacing {self.spacing} is of ordinal similarity only: leave it out")
        for name, usual in zip(("alpha", "beta"), RATIOS[Similarity.TVERSKY], strict=True):
            object.__setattr__(self, name, exact(getattr(self, name), name))
            value = getattr(self, name)
            if value < 0:
                raise InputError(f"{name} is {value}: a weight is at least 0")
            if value != usual and not (self.graded and self.similarity is Similarity.TVERSKY):
                raise InputError(f"{name} {value} is of graded tversky only: leave it out")


USUAL: Final = ReasonerSettings()
"""The paper's settings; made once, for a planner asks in its inner loop."""


@dataclass(frozen=True, slots=True, eq=False)
class Demand:
    """What a tool asks of a candidate.

    Attributes
    ----------
    layout : Layout
    weights : Weights
        Graded relevance, in whole numbers.
    degrees, shares : (q,) int32 arrays
        Of the tool itself.
    """

    layout: Layout
    weights: Weights
    degrees: NDArray[np.int32]
    shares: NDArray[np.int32]


@dataclass(frozen=True, slots=True, eq=False)
class Relevance:
    """What is relevant in a missing tool.

    Attributes
    ----------
    physical : (q,) bool array
        O_P'.
    functions : tuple of int
        Rows of the relevant functional qualities O_F' among `Knowledge.functions`.
    through : (f, q) bool array
        For each of them the physical qualities it makes relevant, O_rp & f_rp.
    fallback : bool
        Whether no function was relevant and O_P' is O_rp.
    demand : Demand or None
        Graded reasoning: how far each is relevant; the above are then those relevant to any degree.
    """

    physical: NDArray[np.bool_]
    functions: tuple[int, ...]
    through: NDArray[np.bool_]
    fallback: bool
    demand: Demand | None = None

    @property
    def determined(self) -> bool:
        """Whether there is anything to compare candidates with."""
        return bool(self.functions) or self.fallback


@dataclass(frozen=True, slots=True, eq=False)
class Index:
    """The representative models of a knowledge base at one threshold, as bits; made once, used often.

    Attributes
    ----------
    bits : (c, q) bool array
        Representative qualities of every class, physical and functional, of the properties in use.
    body_mask : (q,) bool array
        The physical qualities in use.
    body_bits : (c, q) bool array
        O_rp of every class.
    body : (c, w) uint64 array
        The same, packed.
    function_bits : (f, q) bool array
        f_rp.
    function_body : (f, w) uint64 array
        f_rp packed.
    columns : (f,) int64 array
        Which quality each function is.
    """

    bits: NDArray[np.bool_]
    body_mask: NDArray[np.bool_]
    body_bits: NDArray[np.bool_]
    body: NDArray[np.uint64]
    function_bits: NDArray[np.bool_]
    function_body: NDArray[np.uint64]
    columns: NDArray[np.int64]


def build_index(knowledge: Knowledge, settings: ReasonerSettings) -> Index:
    """Decide and pack what is representative of every class and function."""
    physical, functional = in_use(knowledge, settings)
    bits = typical(knowledge.classes, knowledge, settings)
    function_bits = typical(knowledge.functions, knowledge, settings) & physical
    return Index(
        bits & (physical | functional),
        physical,
        bits & physical,
        pack(bits & physical),
        function_bits,
        pack(function_bits),
        knowledge.columns,
    )


def in_use(knowledge: Knowledge, settings: ReasonerSettings) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return the physical and the functional qualities to reason with, (q,) each.

    Raises
    ------
    InputError
        If a property to reason with is not known.
    """
    if settings.properties is not None:
        known = {quality.property for quality in knowledge.qualities}
        for name in settings.properties:
            if name not in known:
                raise InputError(
                    f"property {name!r} is not in this knowledge base; it has {', '.join(sorted(known))}"
                )
    physical = knowledge.mask(Kind.PHYSICAL, settings.properties)
    functional = knowledge.mask(Kind.FUNCTIONAL, settings.properties)
    if settings.above_lowest:
        functional &= np.array([quality.rank > 1 for quality in knowledge.qualities], dtype=bool)
    return physical, functional


def typical(concepts: Memberships, knowledge: Knowledge, settings: ReasonerSettings) -> NDArray[np.bool_]:
    """Return (c, q): what is representative; by its degree or, with certainty, by its posterior.

    What was never observed is not representative, whatever the prior says of it.
    """
    if settings.certainty is None:
        return concepts.representative(settings.representative)
    sure = posterior(concepts, knowledge.qualities).at_least(float(settings.representative))
    return (concepts.counts > 0) & (sure >= float(settings.certainty))


def layout_of(knowledge: Knowledge, settings: ReasonerSettings) -> Layout:
    """Return which columns of the knowledge's arrays are what, for graded reasoning."""
    physical, functional = in_use(knowledge, settings)
    names = [quality.property for quality in knowledge.qualities]
    starts = [at for at, name in enumerate(names) if at == 0 or name != names[at - 1]]
    position = {quality.iri: at for at, quality in enumerate(knowledge.qualities)}
    columns = [position[iri] for iri in knowledge.functions.iris]
    gaps = None if settings.spacing is Spacing.RANK else _gaps(knowledge, settings.spacing)
    return Layout(
        physical, functional, np.array(starts, dtype=np.int64), np.array(columns, dtype=np.int64), gaps
    )


def _gaps(knowledge: Knowledge, spacing: Spacing) -> NDArray[np.int64]:
    """Return `Layout.gaps` from the centroids; whole numbers that add up to `SPAN` over a property."""
    gaps = []
    for _, group in groupby(knowledge.qualities, key=lambda quality: quality.property):
        terms = list(group)
        centroids = np.array([quality.centroid for quality in terms])
        if spacing is Spacing.RATIO and terms[0].unit != "1" and np.all(centroids > 0):
            centroids = np.log(centroids)
        way = np.linalg.norm(np.diff(centroids, axis=0), axis=1).cumsum()
        places = np.rint(SPAN * way / way[-1]).astype(np.int64) if len(way) else way.astype(np.int64)
        gaps += [*np.diff(places, prepend=0).tolist(), 0]
    return np.array(gaps, dtype=np.int64)


def relevance(index: Index, row: int, settings: ReasonerSettings) -> Relevance:
    """Return the relevant functional and physical qualities of one class.

    f in O_rf is relevant if J(O_rp, f_rp) > phi; O_P' joins (or intersects) O_rp & f_rp over them.
    """
    mine = index.bits[row]
    functions = np.flatnonzero(mine[index.columns])
    numerators, denominators = compare(index.body[row], index.function_body[functions])
    relevant = functions[above(numerators, denominators, settings.relevance_tolerance)]
    through = index.function_bits[relevant] & mine
    if len(relevant):
        join = np.logical_or if settings.combine is Combine.UNION else np.logical_and
        return Relevance(join.reduce(through), tuple(relevant.tolist()), through, fallback=False)
    body = index.body_bits[row] if settings.fallback else np.zeros_like(mine)
    return Relevance(body, (), through, fallback=settings.fallback)


def relevant_sets(
    mine: NDArray[np.bool_],
    goes: NDArray[np.bool_],
    columns: NDArray[np.int64],
    physical: NDArray[np.bool_],
    functional: NDArray[np.bool_],
    settings: ReasonerSettings,
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return O_P' of a tool for many states of knowledge at once; the formulas are those of `relevance`.

    Parameters
    ----------
    mine : (s, q) bool array
        What is representative of the tool in each state.
    goes : (s, f, q) bool array
        What is representative of each function.
    columns : (f,) int64 array
        Which quality each function is.
    physical, functional : (q,) bool arrays
        The qualities to reason with.

    Returns
    -------
    (s, q) bool array, (s,) bool array
        O_P', and whether the answer is determined.
    """
    body, goes = mine & physical, goes & physical
    numerators, denominators = compare(pack(body)[:, None], pack(goes))
    relevant = (mine & functional)[:, columns] & above(numerators, denominators, settings.relevance_tolerance)
    through = goes & body[:, None]
    if settings.combine is Combine.UNION:
        joined = (through & relevant[..., None]).any(axis=1)
    else:
        joined = (through | ~relevant[..., None]).all(axis=1)
    found: NDArray[np.bool_] = np.any(relevant, axis=1)
    otherwise = body if settings.fallback else np.zeros_like(body)
    return np.where(found[:, None], joined, otherwise), found | settings.fallback
