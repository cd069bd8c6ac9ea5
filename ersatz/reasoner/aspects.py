"""A graded similarity taken apart by property: how much each counts, how alike the two are in it, and why."""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, Final

import numpy as np

from ersatz.reasoner.counterfactual import Comparison
from ersatz.reasoner.explanation import article, join
from ersatz.reasoner.graded import ONE, importance
from ersatz.reasoner.quantised import compare_by_property
from ersatz.reasoner.relevance import Demand
from ersatz.reasoner.representative import Knowledge

LEVELS: Final = (
    (Fraction(9, 10), ""),
    (Fraction(2, 3), "nearly"),
    (Fraction(1, 3), "half"),
    (Fraction(0), "not"),
)
"""What is said of a likeness from each level on: nothing less than like it."""

MAJOR: Final = Fraction(1, 25)
"""Properties that count for less, and for less than half of the weightiest, are not put into words."""


@dataclass(frozen=True, slots=True)
class Aspect:
    """One property in a graded comparison.

    Attributes
    ----------
    property : str
    weight : Fraction in [0, 1]
        How much it counts; those of all aspects add up to 1.
    likeness : Fraction in [0, 1]
        The similarity in this property alone. The whole is the sum of weight times likeness, exactly.
    observed : bool
        Whether the candidate has a value of it.
    functions : tuple of (name, share in [0, 1])
        The functions that make it relevant, the strongest first; what share of its relevance each would
        give by itself.
    """

    property: str
    weight: Fraction
    likeness: Fraction
    observed: bool
    functions: tuple[tuple[str, float], ...]

    def to_json(self) -> dict[str, Any]:
        """Return it in JSON's types."""
        return {
            "property": self.property,
            "weight": round(float(self.weight), 6),
            "likeness": round(float(self.likeness), 6),
            "observed": self.observed,
            "functions": {name: round(share, 6) for name, share in self.functions},
        }


@dataclass(frozen=True, slots=True)
class PropertyWeight:
    """How relevant a property of the tool is: the sum of the weights of its qualities.

    Attributes
    ----------
    property : str
    weight : float in [0, 1]
    functions : tuple of (name, share in [0, 1])
        As in `Aspect`.
    """

    property: str
    weight: float
    functions: tuple[tuple[str, float], ...]


def aspects(comparison: Comparison) -> tuple[Aspect, ...]:
    """Return the properties that take part, those that count most first; none in a crisp comparison."""
    graded, known = comparison.graded, comparison.knowledge
    if graded is None:
        return ()
    numerators, denominators = compare_by_property(graded.wanted, graded.held, comparison.settings)
    total = int(denominators.sum())
    layout = graded.wanted.layout
    starts, lengths = layout.starts, layout.lengths
    found = []
    for at in np.flatnonzero(denominators).tolist():
        own = slice(int(starts[at]), int(starts[at] + lengths[at]))
        found.append(
            Aspect(
                known.qualities[own.start].property,
                Fraction(int(denominators[at]), total),
                Fraction(int(numerators[at]), int(denominators[at])),
                bool(graded.held.shares[0, own.stop - 1]),
                _functions(known, graded.wanted, own),
            )
        )
    return tuple(sorted(found, key=lambda one: (-one.weight, one.property)))


def in_words(found: Sequence[Aspect], tool: str) -> str:
    """Return how like the tool a candidate is, property by property, the weightiest first."""
    groups: dict[str, list[str]] = {word: [] for _, word in LEVELS}
    unknown = []
    least = min(MAJOR, max((one.weight for one in found), default=MAJOR) / 2)
    for one in (one for one in found if one.weight >= least):
        name = one.property.replace("_", " ")
        if one.observed:
            word = next(word for level, word in LEVELS if one.likeness >= level)
            groups[word].append(f"{name} ({float(one.likeness):.2f})")
        else:
            unknown.append(name)
    told = [(word, names) for word, names in groups.items() if names]
    parts = [f"{word} in {join(names)}" for word, names in told]
    if told:  # what all of it is compared with is said once
        word, names = told[0]
        parts[0] = f"{word} like {article(tool)} in {join(names)}".lstrip()
    parts += [f"{join(unknown)} unknown"] if unknown else []
    return "; ".join(parts)


def property_weights(known: Knowledge, wanted: Demand) -> tuple[PropertyWeight, ...]:
    """Return the relevant properties, the most relevant first."""
    layout, weights = wanted.layout, importance(wanted.weights.qualities, wanted.layout) / ONE
    found = [
        PropertyWeight(
            known.qualities[start].property,
            float(weights[at]),
            _functions(known, wanted, slice(start, start + int(layout.lengths[at]))),
        )
        for at, start in enumerate(layout.starts.tolist())
        if weights[at] > 0
    ]
    return tuple(sorted(found, key=lambda one: (-one.weight, one.property)))


def _functions(known: Knowledge, wanted: Demand, own: slice) -> tuple[tuple[str, float], ...]:
    """Return the functions behind the weight of a property, the strongest first."""
    weights = wanted.weights
    whole = int(weights.qualities[own].sum())
    shares = weights.through[:, own].sum(axis=-1) / max(whole, 1)
    names = known.functions.names
    order = np.argsort(-shares, kind="stable")
    return tuple((names[at], float(shares[at])) for at in order if shares[at] > 0)
