"""Explanation: what speaks for a candidate and what against, with the counts behind it, and in words."""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ersatz.grounding.fuzzy import DEGREE
from ersatz.knowledge.terms import plain, rough_text
from ersatz.reasoner.counterfactual import Comparison, Counterfactual
from ersatz.reasoner.graded import ONE
from ersatz.reasoner.representative import Knowledge

VISIBLE: Final = 0.005
"""Smaller shares would be printed as 0.00: they are left out."""


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
    weight : float in [0, 1], or None
        How relevant it is; of graded reasoning only.
    """

    quality: str
    property: str
    adjective: str
    tool_count: int
    tool_total: int
    count: int
    total: int
    functions: tuple[str, ...]
    weight: float | None = None

    def to_json(self) -> dict[str, Any]:
        """Return it in JSON's types, counts as numbers of units."""
        return {
            "quality": self.quality,
            "property": self.property,
            "tool_observed": [_units(self.tool_count), _units(self.tool_total)],
            "observed": [_units(self.count), _units(self.total)],
            "functions": list(self.functions),
        } | ({} if self.weight is None else {"weight": round(self.weight, 6)})


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
                comparison.weight(at),
            )
        )
    return tuple(found)


def reasons(comparison: Comparison, shared: Sequence[Evidence], lacking: Sequence[Evidence]) -> str:
    """Return in words what a candidate shares with the tool, how often that was seen, and what it lacks."""
    tool = comparison.knowledge.classes.names[comparison.tool]
    if not comparison.relevance.determined:
        return f"undetermined, no function of {article(tool)} is relevant"
    return "; ".join(part for part in (_likeness(shared, tool), _lack(shared, lacking)) if part)


def origin(comparison: Comparison) -> str:
    """Return in words which functions of the tool made its qualities relevant."""
    if comparison.graded is not None:
        weights = comparison.graded.wanted.weights.functions / ONE
        strongest = sorted(comparison.relevance.functions, key=lambda at: -weights[at])
        told = [at for at in strongest[:4] if weights[at] >= VISIBLE] or strongest[:1]
        named = [f"{comparison.knowledge.functions.names[at]} ({weights[at]:.2f})" for at in told]
        return f"What counts follows most from {join(named)}." if named else ""
    functions = [comparison.knowledge.functions.names[at] for at in comparison.relevance.functions]
    return f"What counts follows from {join(functions)}." if functions else ""


def turning(change: Counterfactual, *, accepted: bool) -> str:
    """Return in words what would turn the decision."""
    words = _change(change, accepted=accepted)
    return f"{'Refused' if accepted else 'Accepted'} {words}." if words else ""


def article(noun: str) -> str:
    """Return a noun with its article."""
    return f"{'an' if noun[:1].lower() in 'aeiou' else 'a'} {noun}"


def join(words: Sequence[str], last: str = "and") -> str:
    """Return words as a list in a sentence."""
    return f" {last} ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def _likeness(shared: Sequence[Evidence], tool: str) -> str:
    adjectives, others = [], []
    for prop in dict.fromkeys(one.property for one in shared):
        same = [one for one in shared if one.property == prop]
        often = f"({rough_text(sum(one.count for one in same))} of {rough_text(same[0].total)})"
        if same[0].adjective:
            adjectives.append(f"{same[0].adjective} {often}")
        else:
            others.append(f"{prop.replace('_', ' ')} {often}")
    parts = []
    if adjectives:
        parts.append(f"as {join(adjectives)} as {article(tool)}")
    if others:
        parts.append(f"like {article(tool)} in {join(others)}")
    return ", ".join(parts) or f"nothing that counts in {article(tool)}"


def _lack(shared: Sequence[Evidence], lacking: Sequence[Evidence]) -> str:
    if not lacking:
        return ""
    partly = {one.property for one in shared}
    named = dict.fromkeys(
        one.quality if one.property in partly else f"its {one.property.replace('_', ' ')}" for one in lacking
    )
    return f"lacks {join(list(named))}"


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
            f"with {join(list(change.gain))}" if change.gain else "",
            f"without {join(list(change.lose))}" if change.lose else "",
        )
        if part
    )
    if quality:
        parts.append(quality)
    return join(parts, "or")


def _observed(known: Knowledge, row: int, at: int) -> tuple[int, int]:
    """Return how often a class was observed to hold a quality, out of how often it could have been.

    Where it never was, the total is that of the property's other qualities; zero counts are not stored.
    """
    same = _of_one_property(known, at)
    return int(known.classes.counts[row, at]), int(known.classes.totals[row, same].max(initial=0))


def _perceived(comparison: Comparison, at: int) -> tuple[int, int]:
    """Return the same of an instance: 1 of 1, 0 of 1, or 0 of 0 where it has no value of the property."""
    same = _of_one_property(comparison.knowledge, at)
    if comparison.graded is not None:
        held = comparison.graded.held.degrees[0]
        return (DEGREE * int(held[at]) + ONE // 2) // ONE, DEGREE * int(held[same].any())
    bits = comparison.candidate
    return DEGREE * int(bits[at]), DEGREE * int(bits[same].any())


def _of_one_property(known: Knowledge, at: int) -> list[int]:
    prop = known.qualities[at].property
    return [i for i, quality in enumerate(known.qualities) if quality.property == prop]


def _units(count: int) -> int | float:
    return count // DEGREE if count % DEGREE == 0 else count / DEGREE


def _short(value: Fraction) -> str:
    return plain(round(float(value), 4))
