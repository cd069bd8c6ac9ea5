"""Explanation: what speaks for a candidate, what against, and what would turn the decision."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ersatz.grounding.conceptualization import DEGREE
from ersatz.knowledge.terms import degree_text, plain
from ersatz.measurements import Kind
from ersatz.reasoner.relevance import ReasonerSettings, Relevance, build_index, relevance
from ersatz.reasoner.representative import Knowledge, pack
from ersatz.reasoner.similarity import Similarity, above, compare


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """One candidate beside the missing tool.

    Attributes
    ----------
    knowledge : Knowledge
    settings : ReasonerSettings
    tool : int
        Row of the missing tool's class.
    relevance : Relevance
    candidate : (q,) bool array
        The candidate's typical (or held) physical qualities.
    row : int
        Row of the candidate's class; -1 for an instance.
    thresholds : dict of Relevance
        The tool's, at other representative thresholds; worked out once for all candidates.
    """

    knowledge: Knowledge
    settings: ReasonerSettings
    tool: int
    relevance: Relevance
    candidate: NDArray[np.bool_]
    row: int
    thresholds: dict[Fraction, Relevance]

    @property
    def relevant(self) -> NDArray[np.bool_]:
        """O_P' of the tool."""
        return self.relevance.physical


@dataclass(frozen=True, slots=True)
class Evidence:
    """One quality and how often it was observed, in millionths of a degree.

    Attributes
    ----------
    quality, property, adjective : str
    tool_count, tool_total : int
        In the missing tool's class.
    count, total : int
        In the candidate's class; of an instance 1 of 1 or 0 of 1. total is 0 where there was no value.
    functions : tuple of str
        The relevant functional qualities that made it relevant.
    """

    quality: str
    property: str
    adjective: str
    tool_count: int
    tool_total: int
    count: int
    total: int
    functions: tuple[str, ...]

    def to_json(self) -> dict[str, Any]:
        """Return it in JSON's types, counts as numbers of units."""
        return {
            "quality": self.quality,
            "property": self.property,
            "tool_observed": [_units(self.tool_count), _units(self.tool_total)],
            "observed": [_units(self.count), _units(self.total)],
            "functions": list(self.functions),
        }


@dataclass(frozen=True, slots=True)
class Counterfactual:
    """The smallest changes that would turn the decision, each on its own.

    Attributes
    ----------
    tolerance : Fraction or None
        An accepted candidate is refused from this tolerance on; a refused one is accepted below it.
        None if no tolerance would do.
    representative : tuple or None
        ("at most" or "above", threshold): the nearest representative threshold that would.
    gain, lose : tuples of quality names
        The fewest qualities the candidate would have to have, and not to have, besides.
    """

    tolerance: Fraction | None
    representative: tuple[str, Fraction] | None
    gain: tuple[str, ...]
    lose: tuple[str, ...]

    def to_json(self) -> dict[str, Any]:
        """Return it in JSON's types."""
        threshold = self.representative
        return {
            "tolerance": None if self.tolerance is None else str(self.tolerance),
            "representative": None if threshold is None else [threshold[0], str(threshold[1])],
            "gain": list(self.gain),
            "lose": list(self.lose),
        }


def evidence(comparison: Comparison, chosen: NDArray[np.bool_]) -> tuple[Evidence, ...]:
    """Return the counts behind the chosen qualities."""
    known, tool, row = comparison.knowledge, comparison.tool, comparison.row
    functions = [known.functions.names[at] for at in comparison.relevance.functions]
    found = []
    for at in np.flatnonzero(chosen).tolist():
        quality = known.qualities[at]
        through = comparison.relevance.through[:, at]
        found.append(
            Evidence(
                quality.name,
                quality.property,
                quality.adjective,
                *_observed(known, tool, at),
                *(_observed(known, row, at) if row >= 0 else _perceived(comparison, at)),
                tuple(f for f, makes in zip(functions, through, strict=True) if makes),
            )
        )
    return tuple(found)


def counterfactual(comparison: Comparison, similarity: Fraction, *, accepted: bool) -> Counterfactual:
    """Return the smallest changes of threshold or qualities that would turn the decision."""
    if not comparison.relevance.determined:
        return Counterfactual(None, _nearest_theta(comparison, accepted=accepted), (), ())
    gain, lose = _fewest_qualities(comparison, accepted=accepted)
    tolerance = similarity if accepted or similarity > 0 else None
    return Counterfactual(tolerance, _nearest_theta(comparison, accepted=accepted), gain, lose)


def reasons(comparison: Comparison, shared: Sequence[Evidence], lacking: Sequence[Evidence]) -> str:
    """Return in words what a candidate shares with the tool, how often that was seen, and what it lacks."""
    tool = comparison.knowledge.classes.names[comparison.tool]
    if not comparison.relevance.determined:
        return f"undetermined, no function of {_article(tool)} is relevant"
    return "; ".join(part for part in (_likeness(shared, tool), _lack(shared, lacking)) if part)


def origin(comparison: Comparison) -> str:
    """Return in words which functions of the tool made its qualities relevant."""
    functions = [comparison.knowledge.functions.names[at] for at in comparison.relevance.functions]
    return f"What counts follows from {_join(functions)}." if functions else ""


def turning(change: Counterfactual, *, accepted: bool) -> str:
    """Return in words what would turn the decision."""
    words = _change(change, accepted=accepted)
    return f"{'Refused' if accepted else 'Accepted'} {words}." if words else ""


def _likeness(shared: Sequence[Evidence], tool: str) -> str:
    adjectives, others = [], []
    for prop in dict.fromkeys(one.property for one in shared):
        same = [one for one in shared if one.property == prop]
        often = f"({degree_text(sum(one.count for one in same))} of {degree_text(same[0].total)})"
        if same[0].adjective:
            adjectives.append(f"{same[0].adjective} {often}")
        else:
            others.append(f"{prop.replace('_', ' ')} {often}")
    parts = []
    if adjectives:
        parts.append(f"as {_join(adjectives)} as {_article(tool)}")
    if others:
        parts.append(f"like {_article(tool)} in {_join(others)}")
    return ", ".join(parts) or f"nothing that counts in {_article(tool)}"


def _lack(shared: Sequence[Evidence], lacking: Sequence[Evidence]) -> str:
    if not lacking:
        return ""
    partly = {one.property for one in shared}
    named = dict.fromkeys(
        one.quality if one.property in partly else f"its {one.property.replace('_', ' ')}" for one in lacking
    )
    return f"lacks {_join(list(named))}"


def _change(change: Counterfactual, *, accepted: bool) -> str:
    parts = []
    if change.tolerance is not None:
        parts.append(f"at a tolerance {'of' if accepted else 'below'} {_short(change.tolerance)}")
    if change.representative is not None:
        side, threshold = change.representative
        parts.append(f"at a representative threshold {side.replace('at most', 'of')} {_short(threshold)}")
    quality = " and ".join(
        part
        for part in (
            f"with {_join(list(change.gain))}" if change.gain else "",
            f"without {_join(list(change.lose))}" if change.lose else "",
        )
        if part
    )
    if quality:
        parts.append(quality)
    return _join(parts, "or")


def _fewest_qualities(comparison: Comparison, *, accepted: bool) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the fewest qualities to gain and to lose.

    Which ones: those whose observed share is nearest to the representative threshold. An accepted
    candidate turns by losing shared ones; a refused one by gaining lacking ones and losing others.
    """
    relevant, held = comparison.relevant, comparison.candidate
    share = _shares(comparison)
    order = np.argsort(-share, kind="stable")
    lacking = [int(at) for at in order if relevant[at] and not held[at]]
    losable = [int(at) for at in order[::-1] if held[at] and relevant[at] == accepted]
    options = (
        (gain, lose)
        for size in range(1, len(lacking) + len(losable) + 1)
        for gain in (range(1) if accepted else range(min(size, len(lacking)), -1, -1))
        if (lose := size - gain) <= len(losable)
    )
    for gain, lose in options:
        changed = held.copy()
        changed[lacking[:gain]], changed[losable[:lose]] = True, False
        if _accepts(relevant, changed, comparison.settings) != accepted:
            names = comparison.knowledge.qualities
            return (
                tuple(names[at].name for at in lacking[:gain]),
                tuple(names[at].name for at in losable[:lose]),
            )
    return (), ()


def _nearest_theta(comparison: Comparison, *, accepted: bool) -> tuple[str, Fraction] | None:
    """Return the nearest representative threshold at which the decision is the other one.

    A decision can only change where the threshold crosses an observed proportion, so only those of the
    tool, the candidate and the functions are tried; above one of them, it is as at the next.
    """
    theta = comparison.settings.representative
    steps = sorted(set(_proportions(comparison)))
    lower = [(theta - step, "at most", step, step) for step in steps if step < theta]
    higher = [*(step for step in steps if step >= theta), Fraction(1)]
    upper = [(low - theta, "above", low, high) for low, high in pairwise(higher) if low < high]
    for _, side, threshold, tried in sorted(lower + upper):
        if _decide(comparison, tried) != accepted:
            return side, threshold
    return None


def _decide(comparison: Comparison, theta: Fraction) -> bool:
    """Return whether the candidate would be accepted at another representative threshold."""
    found, row = _relevance_at(comparison, theta), comparison.row
    if not found.determined:
        return False
    held = comparison.candidate
    if row >= 0:
        known, names = comparison.knowledge, comparison.settings.properties
        held = known.classes.only([row]).representative(theta)[0] & known.mask(Kind.PHYSICAL, names)
    return _accepts(found.physical, held, comparison.settings)


def _relevance_at(comparison: Comparison, theta: Fraction) -> Relevance:
    """Return what would be relevant in the tool at another representative threshold."""
    if theta not in comparison.thresholds:
        known = comparison.knowledge
        settings = replace(comparison.settings, representative=theta)
        index = build_index(replace(known, classes=known.classes.only([comparison.tool])), settings)
        comparison.thresholds[theta] = relevance(index, 0, settings)
    return comparison.thresholds[theta]


def _accepts(relevant: NDArray[np.bool_], held: NDArray[np.bool_], settings: ReasonerSettings) -> bool:
    numerators, denominators = compare(pack(relevant), pack(held[None]), Similarity(settings.similarity))
    return bool(above(numerators, denominators, settings.tolerance)[0])


def _proportions(comparison: Comparison) -> Iterator[Fraction]:
    known = comparison.knowledge
    rows = [comparison.tool, *([comparison.row] if comparison.row >= 0 else [])]
    for table, chosen in ((known.classes, rows), (known.functions, range(len(known.functions.iris)))):
        for row in chosen:
            seen = np.flatnonzero(table.counts[row])
            for count, total in zip(
                table.counts[row, seen].tolist(), table.totals[row, seen].tolist(), strict=True
            ):
                yield Fraction(count, total)


def _shares(comparison: Comparison) -> NDArray[np.float64]:
    if comparison.row < 0:
        return comparison.candidate.astype(np.float64)
    counts = comparison.knowledge.classes.counts[comparison.row]
    share: NDArray[np.float64] = counts / np.maximum(comparison.knowledge.classes.totals[comparison.row], 1)
    return share


def _observed(known: Knowledge, row: int, at: int) -> tuple[int, int]:
    """Return how often a class was observed to hold a quality, out of how often it could have been.

    Where it never was, the total is that of the property's other qualities; zero counts are not stored.
    """
    same = _of_one_property(known, at)
    return int(known.classes.counts[row, at]), int(known.classes.totals[row, same].max(initial=0))


def _perceived(comparison: Comparison, at: int) -> tuple[int, int]:
    """Return the same of an instance: 1 of 1, 0 of 1, or 0 of 0 where it has no value of the property."""
    held = comparison.candidate
    same = _of_one_property(comparison.knowledge, at)
    return DEGREE * int(held[at]), DEGREE * int(held[same].any())


def _of_one_property(known: Knowledge, at: int) -> list[int]:
    prop = known.qualities[at].property
    return [i for i, quality in enumerate(known.qualities) if quality.property == prop]


def _units(count: int) -> int | float:
    return count // DEGREE if count % DEGREE == 0 else count / DEGREE


def _short(value: Fraction) -> str:
    return plain(round(float(value), 4))


def _article(noun: str) -> str:
    return f"{'an' if noun[:1].lower() in 'aeiou' else 'a'} {noun}"


def _join(words: Sequence[str], last: str = "and") -> str:
    return f" {last} ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)
