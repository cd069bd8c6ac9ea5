"""Substitution (paper: Reasoning about a Substitute): which of the available things will do."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from enum import StrEnum
from fractions import Fraction
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from ersatz.errors import InputError
from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.models import Candidate, SubstitutionModel
from ersatz.knowledge.substitutions import load_substitution, remembered, substitution_iri
from ersatz.knowledge.substitutions import remember as write_model
from ersatz.knowledge.terms import plain, proportion_text
from ersatz.reasoner.aspects import Aspect, PropertyWeight, aspects, in_words, property_weights
from ersatz.reasoner.candidates import Candidates, gather
from ersatz.reasoner.confidence import Confidence, Confidences, confidences
from ersatz.reasoner.counterfactual import Comparison, Counterfactual, Graded, Steps, counterfactual
from ersatz.reasoner.explanation import Evidence, evidence, origin, reasons, turning
from ersatz.reasoner.graded import ONE
from ersatz.reasoner.indices import crisp_index, graded_index
from ersatz.reasoner.population import load_population
from ersatz.reasoner.quantised import (
    GradedIndex,
    Grades,
    compare_graded,
    graded_relevance,
)
from ersatz.reasoner.relevance import (
    USUAL,
    Index,
    ReasonerSettings,
    Relevance,
    Spacing,
    relevance,
)
from ersatz.reasoner.representative import Knowledge, class_row, load_knowledge, pack
from ersatz.reasoner.sampling import Question
from ersatz.reasoner.similarity import best_first, compare, ratios


class Status(StrEnum):
    """Whether the tool has a relevant function to judge candidates by."""

    OK = "ok"
    UNDETERMINED = "undetermined"


@dataclass(frozen=True, slots=True, eq=False)
class Substitute:
    """One candidate and how it compares with the missing tool.

    Attributes
    ----------
    name, iri : str
    kind : {"class", "instance"}
    similarity : float in [0, 1]
    fraction : Fraction
        The same, exact.
    accepted : bool
        Whether it stands in: similarity > tolerance.
    flags : tuple of str
        "undetermined": no function of the tool is relevant; "fallback": compared with all that is
        typical of the tool; "unknown": nothing is typical of the candidate; "same_class": it is an
        instance of the missing tool's class.
    confidence : Confidence, optional
        How sure that is, where it was asked.
    """

    name: str
    iri: str
    kind: str
    similarity: float
    fraction: Fraction
    accepted: bool
    flags: tuple[str, ...]
    comparison: Comparison = field(repr=False)
    confidence: Confidence | None = None

    @property
    def shared(self) -> tuple[Evidence, ...]:
        """Relevant qualities it has, with the counts behind them."""
        return evidence(self.comparison, self.comparison.relevant & self.comparison.candidate)

    @property
    def lacking(self) -> tuple[Evidence, ...]:
        """Relevant qualities it lacks."""
        return evidence(self.comparison, self.comparison.relevant & ~self.comparison.candidate)

    @property
    def extra(self) -> tuple[Evidence, ...]:
        """Its typical qualities that are not relevant in the tool."""
        return evidence(self.comparison, self.comparison.candidate & ~self.comparison.relevant)

    @property
    def aspects(self) -> tuple[Aspect, ...]:
        """The similarity taken apart by property, the weightiest first; of graded reasoning only."""
        return aspects(self.comparison)

    def counterfactual(self) -> Counterfactual:
        """Return the smallest changes that would turn the decision."""
        return counterfactual(self.comparison, self.fraction, accepted=self.accepted)

    def reasons(self) -> str:
        """Return in words what speaks for it and what against."""
        if self.comparison.graded is not None and self.comparison.relevance.determined:
            return in_words(self.aspects, self.comparison.knowledge.classes.names[self.comparison.tool])
        return reasons(self.comparison, self.shared, self.lacking)

    def turning(self) -> str:
        """Return in words what would turn the decision."""
        return turning(self.counterfactual(), accepted=self.accepted)

    def explain(self) -> str:
        """Return all of it in words: reasons, the functions they rest on, what would turn the decision."""
        return self._explained(self.turning())

    def _explained(self, turning: str) -> str:
        sure = f"{self.confidence.sentence()}" if self.confidence else ""
        if not self.comparison.relevance.determined:
            return " ".join(part for part in (f"{self.name}: {self.reasons()}.", sure) if part)
        judged = f"{self.name}, {self.similarity:.2f}: {self.reasons()}."
        parts = (judged, sure, origin(self.comparison), turning)
        return " ".join(part for part in parts if part)

    def to_json(self) -> dict[str, Any]:
        """Return everything about it in JSON's types."""
        ratio, change = self.fraction, self.counterfactual()
        return {
            "name": self.name,
            "iri": self.iri,
            "kind": self.kind,
            "similarity": round(self.similarity, 6),
            "similarity_fraction": [ratio.numerator, ratio.denominator],
            "accepted": self.accepted,
            "flags": list(self.flags),
            "shared": [one.to_json() for one in self.shared],
            "lacking": [one.to_json() for one in self.lacking],
            "extra": [one.to_json() for one in self.extra],
            "counterfactual": change.to_json(),
            "explanation": self._explained(turning(change, accepted=self.accepted)),
            **({"aspects": [one.to_json() for one in found]} if (found := self.aspects) else {}),
            **({"confidence": self.confidence.to_json()} if self.confidence else {}),
        }


@dataclass(frozen=True, slots=True, eq=False)
class Ranking(Sequence[Substitute]):
    """The answer: candidates by similarity, then name; each is worked out when it is looked at.

    Attributes
    ----------
    missing, iri : str
        Name and IRI of the missing tool.
    status : Status
    settings : ReasonerSettings
    revision : str
        State of knowledge it was computed from.
    reused : bool
        Whether it was remembered.
    sure : Confidences, optional
        How sure it is, in the order of the candidates ranked.
    """

    missing: str
    iri: str
    status: Status
    settings: ReasonerSettings
    revision: str
    reused: bool
    knowledge: Knowledge = field(repr=False)
    relevance: Relevance = field(repr=False)
    candidates: Candidates = field(repr=False)
    order: NDArray[np.int64] = field(repr=False)
    numerators: NDArray[Any] = field(repr=False)
    denominators: NDArray[Any] = field(repr=False)
    memo: list[Steps] = field(repr=False, default_factory=list)
    sure: Confidences | None = field(repr=False, default=None)

    @property
    def question(self) -> Question:
        """What was asked, for questions about the answer: its candidates are in the order ranked."""
        known, packed = self.candidates, self.candidates.packed
        held = packed.degrees / ONE if isinstance(packed, Grades) else known.bits.astype(np.float64)
        row = self.knowledge.row_of_class[self.iri]
        return Question(self.knowledge, self.settings, row, known.rows[self.order], held[self.order])

    @property
    def relevant_physical(self) -> tuple[str, ...]:
        """O_P': names of the relevant physical qualities."""
        return tuple(self.knowledge.qualities[at].name for at in np.flatnonzero(self.relevance.physical))

    @property
    def relevant_functional(self) -> tuple[str, ...]:
        """O_F': names of the relevant functional qualities."""
        return tuple(self.knowledge.functions.names[at] for at in self.relevance.functions)

    def weights(self) -> dict[str, dict[str, float]]:
        """Return how relevant functions, physical qualities and properties are, the most relevant first.

        In [0, 1] each; what has no weight is left out, and of crisp reasoning everything. A property has
        the sum of its qualities.
        """
        if self.relevance.demand is None:
            return {"functions": {}, "qualities": {}, "properties": {}}
        found, qualities = self.relevance.demand.weights, self.knowledge.qualities
        return {
            "functions": _strongest(self.knowledge.functions.names, found.functions.tolist()),
            "qualities": _strongest([one.name for one in qualities], found.qualities.tolist()),
            "properties": {one.property: round(one.weight, 6) for one in self.property_weights},
        }

    @property
    def property_weights(self) -> tuple[PropertyWeight, ...]:
        """The relevant properties and the functions behind them; of graded reasoning only."""
        wanted = self.relevance.demand
        return () if wanted is None else property_weights(self.knowledge, wanted)

    def __len__(self) -> int:
        """Return the number of candidates ranked."""
        return len(self.order)

    def __iter__(self) -> Iterator[Substitute]:
        """Yield the candidates, best first."""
        return (self[at] for at in range(len(self)))

    @overload
    def __getitem__(self, at: int) -> Substitute: ...
    @overload
    def __getitem__(self, at: slice) -> Sequence[Substitute]: ...
    def __getitem__(self, at: int | slice) -> Substitute | Sequence[Substitute]:
        """Return one candidate, or some."""
        if isinstance(at, slice):
            return [self[one] for one in range(*at.indices(len(self)))]
        at = range(len(self))[at]
        row = int(self.order[at])
        ratio = self._ratio(row)
        known = self.candidates
        bits = known.bits[row]
        flags = (
            (self.status is Status.UNDETERMINED, "undetermined"),
            (self.relevance.fallback, "fallback"),
            (not bits.any(), "unknown"),
            (bool(known.same_class[row]), "same_class"),
        )
        comparison = Comparison(
            self.knowledge,
            self.settings,
            self.knowledge.row_of_class[self.iri],
            self.relevance,
            bits,
            int(known.rows[row]),
            self.memo,
            self._graded(row),
        )
        return Substitute(
            known.names[row],
            known.iris[row],
            "class" if known.rows[row] >= 0 else "instance",
            float(ratio),
            ratio,
            self._accepts(ratio),
            tuple(flag for holds, flag in flags if holds),
            comparison,
            self.sure.of(at) if self.sure else None,
        )

    def _graded(self, row: int) -> Graded | None:
        wanted, held = self.relevance.demand, self.candidates.packed
        if wanted is None or not isinstance(held, Grades):
            return None
        return Graded(wanted, held.only([row]))

    def _ratio(self, row: int) -> Fraction:
        return Fraction(int(self.numerators[row]), int(self.denominators[row]))

    def _accepts(self, similarity: Fraction) -> bool:
        return self.relevance.determined and similarity > self.settings.tolerance

    def model(self) -> SubstitutionModel:
        """Return the answer as the substitution model <O_P', O_F', substitutes, non-substitutes>."""
        names = [quality.name for quality in self.knowledge.qualities]
        relevant, rows = self.relevance.physical, self.candidates.bits

        def named(bits: NDArray[np.bool_]) -> tuple[str, ...]:
            return tuple(sorted(names[at] for at in np.flatnonzero(bits)))

        found = (
            Candidate(
                self.candidates.iris[row],
                bool(self.candidates.rows[row] >= 0),
                Decimal(proportion_text(int(self.numerators[row]), int(self.denominators[row]))),
                self._accepts(self._ratio(row)),
                named(relevant & rows[row]),
                named(relevant & ~rows[row]),
                named(rows[row] & ~relevant),
                self.sure.of(at).chances() if self.sure else None,
            )
            for at, row in enumerate(self.order.tolist())
        )
        settings = settings_json(self.settings)
        return SubstitutionModel(
            substitution_iri(self.iri, settings, self.revision),
            self.iri,
            settings,
            self.settings.representative,
            self.settings.relevance_tolerance,
            self.settings.tolerance,
            self.revision,
            tuple(sorted(self.relevant_physical)),
            tuple(sorted(self.relevant_functional)),
            tuple(sorted(found, key=lambda candidate: candidate.iri)),
            self.sure.drawing() if self.sure else None,
            self._relevance_weights(),
        )

    def _relevance_weights(self) -> tuple[tuple[str, Decimal], ...]:
        """Return the weights of relevant functions and qualities by name, as they are written down."""
        if self.relevance.demand is None:
            return ()
        found = self.relevance.demand.weights
        named = (
            *zip(self.knowledge.functions.names, found.functions.tolist(), strict=True),
            *zip((one.name for one in self.knowledge.qualities), found.qualities.tolist(), strict=True),
        )
        return tuple(sorted((name, Decimal(proportion_text(one, ONE))) for name, one in named if one))

    def to_json(self) -> dict[str, Any]:
        """Return the answer in JSON's types; the layout is stable."""
        return {
            "version": 1,
            "missing": self.missing,
            "iri": self.iri,
            "status": str(self.status),
            "settings": json.loads(settings_json(self.settings)),
            "revision": self.revision,
            "reused": self.reused,
            "relevant_functional": list(self.relevant_functional),
            "relevant_physical": list(self.relevant_physical),
            **({"weights": self.weights()} if self.settings.graded else {}),
            "substitutes": [substitute.to_json() for substitute in self],
        }


def rank_substitutes(
    kb: KnowledgeBase,
    missing: str,
    available: Sequence[str] | None = None,
    *,
    instances: Sequence[str] = (),
    settings: ReasonerSettings | None = None,
    remember: bool = False,
    top: int | None = None,
    draws: int | None = None,
    seed: int = 0,
) -> Ranking:
    """Rank the available things by how well they stand in for a missing tool (paper: Reasoner).

    Parameters
    ----------
    kb : KnowledgeBase
    missing : str
        The missing tool's class; it is never its own substitute.
    available : sequence of str, optional
        Classes at hand; without it, and without instances, all classes.
    instances : sequence of str
        Perceived instances at hand; judged by what they hold rather than by what is typical.
    settings : ReasonerSettings, optional
    remember : bool
        Write the answer into the knowledge base; asked again, it is looked up until knowledge changes.
    top : int, optional
        Rank only so many.
    draws : int, optional
        Also tell how sure the answer is, from so many draws of what is not known; see `Confidence`.
    seed : int
        Of the draws.

    Raises
    ------
    UnknownNameError
        If the knowledge base does not know a name; the nearest is offered.
    InputError
        If nothing is available.
    """
    if top is not None and top < 1:
        raise InputError(f"top is {top}: rank at least one")
    settings = settings or USUAL
    known = kb.view(load_knowledge)
    tool = class_row(kb, known, missing)
    index = (graded_index if settings.graded else crisp_index)(kb, settings)
    candidates = gather(kb, known, index, tool, available, instances)
    iri = known.classes.iris[tool]
    model = _recall(kb, settings, iri, candidates)
    if isinstance(index, GradedIndex):
        found = graded_relevance(index, tool, settings)  # remembered or not: degrees are not in the answer
    elif model is None:
        found = relevance(index, tool, settings)
    else:
        found, candidates = _recalled(known, index, tool, model, candidates)
    ranking = _rank(kb, known, iri, settings, found, candidates, top, reused=model is not None)
    if draws is not None:
        question = replace(ranking.question, population=kb.view(load_population))
        ranking = replace(ranking, sure=confidences(question, draws, seed))
    if remember and (model is None or draws is not None) and ranking.status is Status.OK:
        write_model(kb, ranking.model())
    return ranking


def settings_json(settings: ReasonerSettings) -> str:
    """Return the settings as canonical JSON; thresholds as exact decimal or fraction text."""
    return json.dumps(
        {
            "representative": _number(settings.representative),
            "tolerance": _number(settings.tolerance),
            "relevance_tolerance": _number(settings.relevance_tolerance),
            "combine": str(settings.combine),
            "similarity": str(settings.similarity),
            "above_lowest": settings.above_lowest,
            "fallback": settings.fallback,
            "properties": list(settings.properties) if settings.properties is not None else None,
        }
        | ({} if settings.spacing is Spacing.RANK else {"spacing": str(settings.spacing)})
        | ({} if settings.certainty is None else {"certainty": _number(settings.certainty)})
        | (
            {"graded": True, "alpha": _number(settings.alpha), "beta": _number(settings.beta)}
            if settings.graded
            else {}
        ),
        sort_keys=True,
    )


def _rank(
    kb: KnowledgeBase,
    known: Knowledge,
    iri: str,
    settings: ReasonerSettings,
    found: Relevance,
    candidates: Candidates,
    top: int | None,
    *,
    reused: bool,
) -> Ranking:
    numerators, denominators = _compared(settings, found, candidates)
    similarity = ratios(numerators, denominators)
    similarity[candidates.rows == known.row_of_class[iri]] = -1.0
    return Ranking(
        known.classes.names[known.row_of_class[iri]],
        iri,
        Status.OK if found.determined else Status.UNDETERMINED,
        settings,
        kb.revision,
        reused,
        known,
        found,
        candidates,
        best_first(similarity, top),
        numerators,
        denominators,
    )


def _compared(
    settings: ReasonerSettings, found: Relevance, candidates: Candidates
) -> tuple[NDArray[Any], NDArray[Any]]:
    if isinstance(candidates.packed, Grades):
        assert found.demand is not None
        return compare_graded(found.demand, candidates.packed, settings)
    return compare(pack(found.physical), candidates.packed, settings.similarity)


def _strongest(names: Sequence[str], weights: Sequence[int]) -> dict[str, float]:
    """Return the weights above 0 in [0, 1], the largest first."""
    pairs = sorted(zip(names, weights, strict=True), key=lambda pair: -pair[1])
    return {name: round(weight / ONE, 6) for name, weight in pairs if weight}


def _recall(
    kb: KnowledgeBase, settings: ReasonerSettings, iri: str, candidates: Candidates
) -> SubstitutionModel | None:
    """Return the remembered answer, if there is one that covers the candidates."""
    up_to_date = kb.view(remembered)
    if not up_to_date:
        return None
    name = substitution_iri(iri, settings_json(settings), kb.revision)
    if name not in up_to_date:
        return None
    model = load_substitution(kb, name)
    covered = {iri, *(candidate.iri for candidate in model.candidates)}
    return model if covered.issuperset(candidates.iris) else None


def _recalled(
    known: Knowledge, index: Index, tool: int, model: SubstitutionModel, candidates: Candidates
) -> tuple[Relevance, Candidates]:
    """Return relevance and candidates as the remembered answer has them."""
    column = {quality.name: at for at, quality in enumerate(known.qualities)}

    def bits(names: Sequence[str]) -> NDArray[np.bool_]:
        row = np.zeros(len(column), dtype=bool)
        row[[column[name] for name in names]] = True
        return row

    of = {one.iri: (*one.shared, *one.extra) for one in model.candidates}
    rows = np.array([bits(of.get(iri, ())) for iri in candidates.iris])
    functions = tuple(sorted(known.functions.names.index(name) for name in model.relevant_functional))
    physical = bits(model.relevant_physical)
    through = index.function_bits[list(functions)] & index.bits[tool]
    found = Relevance(physical, functions, through, fallback=not functions)
    same = candidates.same_class
    return found, Candidates(candidates.names, candidates.iris, rows, pack(rows), candidates.rows, same)


def _number(value: Fraction) -> str:
    as_float = float(value)
    return plain(as_float) if Fraction(plain(as_float)) == value else str(value)
