"""The nouns of the knowledge base: memberships, class and function models, substitution models."""

import builtins
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction

from ersatz.knowledge.terms import degree_text
from ersatz.measurements import Kind


@dataclass(frozen=True, slots=True)
class Entry:
    """One membership <concept, quality, observed, out of>: the count is the fact, the degree a view.

    Attributes
    ----------
    quality : str
        Name of the quality, `rigidity_4`.
    property : str
        Name of its property.
    kind : Kind
    rank : int
    count, total : int
        In millionths of a degree.
    """

    quality: str
    property: str
    kind: Kind
    rank: int
    count: int
    total: int

    @builtins.property
    def proportion(self) -> Fraction:
        """The exact degree: m of class knowledge, d of a function model."""
        return Fraction(self.count, self.total)

    def __str__(self) -> str:
        """Return "rigidity_4: 9 of 10"."""
        return f"{self.quality}: {degree_text(self.count)} of {degree_text(self.total)}"


@dataclass(frozen=True, slots=True)
class ClassModel:
    """What is known of an object class: the tuples <O, t, m> (paper: Conceptualization, Objects)."""

    name: str
    iri: str
    instances: int
    entries: tuple[Entry, ...]


@dataclass(frozen=True, slots=True)
class FunctionModel:
    """What goes with a functional quality: the tuples <f, p, d> (paper: Functional Properties)."""

    function: str
    iri: str
    entries: tuple[Entry, ...]


@dataclass(frozen=True, slots=True)
class Chances:
    """How sure it is what a candidate is, of an answer with confidence.

    Attributes
    ----------
    accepted, best : Decimal
        Probability that it stands in, and that no other candidate is more similar; in [0, 1].
    low, high : Decimal
        Its similarity lies between them with the probability of `Drawing.level`.
    """

    accepted: Decimal
    best: Decimal
    low: Decimal
    high: Decimal


@dataclass(frozen=True, slots=True)
class Drawing:
    """How the chances of an answer were found.

    Attributes
    ----------
    draws : int
    level : Decimal
        Credible level of the intervals.
    prior : Decimal
        What the prior weighs, in observed units.
    seed : int, optional
        Of the draws: with it, they can be made again.
    """

    draws: int
    level: Decimal
    prior: Decimal
    seed: int | None = None


@dataclass(frozen=True, slots=True)
class Candidate:
    """How one object compares with what is relevant in a missing tool.

    Attributes
    ----------
    iri : str
        Of the candidate's class, or of the instance.
    is_class : bool
    similarity : Decimal
        Rounded half-even to 6 places; in [0, 1].
    accepted : bool
    shared, lacking, extra : tuple of quality names, ascending
    chances : Chances, optional
        How sure that is, where it was asked.
    """

    iri: str
    is_class: bool
    similarity: Decimal
    accepted: bool
    shared: tuple[str, ...]
    lacking: tuple[str, ...]
    extra: tuple[str, ...]
    chances: Chances | None = None


@dataclass(frozen=True, slots=True)
class SubstitutionModel:
    """The remembered answer <O_P', O_F', substitutes, non-substitutes> (paper: Reasoning about a Substitute).

    Attributes
    ----------
    iri : str
        Names the tool and a hash of settings and revision: one that is out of date is never found.
    missing : str
        IRI of the missing tool's class.
    settings : str
        The reasoner's settings as canonical JSON.
    theta, relevance_phi, phi : Fraction
        Thresholds: representative, of relevance, of similarity.
    revision : str
        Of the knowledge it was computed from.
    relevant_physical, relevant_functional : tuple of quality names
    candidates : tuple of Candidate, ascending by IRI
    drawing : Drawing, optional
        Where the candidates have chances.
    weights : tuple of (quality name, weight in (0, 1]), ascending by name
        How relevant each relevant quality is; of graded reasoning only.
    """

    iri: str
    missing: str
    settings: str
    theta: Fraction
    relevance_phi: Fraction
    phi: Fraction
    revision: str
    relevant_physical: tuple[str, ...]
    relevant_functional: tuple[str, ...]
    candidates: tuple[Candidate, ...]
    drawing: Drawing | None = None
    weights: tuple[tuple[str, Decimal], ...] = ()

    @property
    def substitutes(self) -> tuple[str, ...]:
        """IRIs of the candidates accepted."""
        return tuple(candidate.iri for candidate in self.candidates if candidate.accepted)

    @property
    def non_substitutes(self) -> tuple[str, ...]:
        """IRIs of the candidates refused."""
        return tuple(candidate.iri for candidate in self.candidates if not candidate.accepted)
