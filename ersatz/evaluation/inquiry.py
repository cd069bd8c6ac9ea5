"""Asking for more, simulated: how many measurements it takes to decide as all of them would.

Two situations, each with measurements made in the order of `outlook` or in random order. An unknown object:
its properties are measured one by one, knowledge of the classes is complete. Two classes: the tool
and one candidate are known from one object each at first; then properties of further objects are measured.
The decision is whether the probability that the candidate stands in is at least one half.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ersatz.evaluation.calibration import half
from ersatz.evaluation.regrounding import Objects, held_degrees, reground
from ersatz.grounding.conceptualization import DEGREE
from ersatz.grounding.subcategorization import Qualities
from ersatz.reasoner.confidence import SURE, confidences
from ersatz.reasoner.gain import outlook
from ersatz.reasoner.relevance import ReasonerSettings, in_use
from ersatz.reasoner.representative import Knowledge
from ersatz.reasoner.sampling import Question

DRAWS: Final = 100

_Slot: TypeAlias = tuple[int | None, str]
_Choice: TypeAlias = Callable[[Question, Sequence[_Slot]], _Slot]


@dataclass(frozen=True, slots=True)
class Effort:
    """How many measurements one decision took.

    Attributes
    ----------
    possible : int
        All that could be made.
    right : int
        After so many the decision is that of all of them, and stays so.
    sure : int
        After so many the decision has a probability of `SURE` or more; all, if never.
    """

    possible: int
    right: int
    sure: int


@dataclass(frozen=True, slots=True)
class Inquiry:
    """The same decisions with measurements in both orders.

    Attributes
    ----------
    asked, random : tuple of Effort
        One a decision; of random order, one a decision and repetition.
    """

    asked: tuple[Effort, ...]
    random: tuple[Effort, ...]

    def means(self) -> dict[str, tuple[float, float, float]]:
        """Return for `right` and `sure` the mean number asked, at random, and their ratio."""
        found = {}
        for name in ("right", "sure"):
            one, two = (
                float(np.mean([getattr(effort, name) for effort in efforts]))
                for efforts in (self.asked, self.random)
            )
            found[name] = (one, two, one / two if two else 1.0)
        return found

    def to_json(self) -> dict[str, Any]:
        """Return it in JSON's types."""
        return {
            "decisions": len(self.asked),
            "possible": float(np.mean([effort.possible for effort in self.asked])),
            **{name: [round(x, 6) for x in of] for name, of in self.means().items()},
        }


@dataclass(frozen=True, slots=True, eq=False)
class _Case:
    """A decision to be made, and what can be measured for it.

    Attributes
    ----------
    slots : tuple of (candidate or None, property)
        As in `Measurement`; one as often as it can be measured.
    ask : callable
        Returns the question when the given slots have been measured.
    """

    slots: tuple[_Slot, ...]
    ask: Callable[[Sequence[_Slot]], Question]


def unknown_objects(
    objects: Objects,
    qualities: Sequence[Qualities],
    settings: ReasonerSettings,
    decisions: int,
    repetitions: int = 3,
    seed: int = 0,
) -> Inquiry:
    """Half of the objects are known; of the others one is met at a time, and stands in for a tool or not."""
    known_rows = half(objects, seed)
    known = reground(objects.take(known_rows), qualities)
    others = np.setdiff1d(np.arange(len(objects.of_class)), known_rows)
    chance = np.random.default_rng(seed)
    cases = []
    for _ in range(decisions):
        one = int(chance.choice(others))
        tools = np.delete(np.arange(len(objects.classes)), objects.of_class[one])
        degrees = held_degrees(objects.take(np.array([one])), qualities)[0] / DEGREE
        cases.append(_object_case(known, settings, int(chance.choice(tools)), degrees))
    return _inquire(cases, repetitions, chance)


def unknown_classes(
    objects: Objects,
    qualities: Sequence[Qualities],
    settings: ReasonerSettings,
    decisions: int,
    repetitions: int = 3,
    seed: int = 0,
) -> Inquiry:
    """A tool and a candidate known from one object each; the others of both can be measured."""
    known, chance = reground(objects, qualities), np.random.default_rng(seed)
    degrees = held_degrees(objects, qualities)
    cases = []
    for _ in range(decisions):
        pair = chance.choice(len(objects.classes), 2, replace=False)
        parts = [chance.permutation(degrees[objects.of_class == row]) for row in pair]
        cases.append(_class_case(known, settings, pair.tolist(), parts))
    return _inquire(cases, repetitions, chance)


def _object_case(
    known: Knowledge, settings: ReasonerSettings, tool: int, degrees: NDArray[np.float64]
) -> _Case:
    property_of = np.array([quality.property for quality in known.qualities])
    names = sorted(set(property_of[degrees > 0].tolist()))

    def ask(measured: Sequence[_Slot]) -> Question:
        seen = np.isin(property_of, [name for _, name in measured])
        return Question(known, settings, tool, np.array([-1]), (degrees * seen)[None])

    return _Case(tuple((0, name) for name in names), ask)


def _class_case(
    known: Knowledge, settings: ReasonerSettings, pair: list[int], parts: list[NDArray[np.int64]]
) -> _Case:
    physical, functional = in_use(known, settings)
    property_of = np.array([quality.property for quality in known.qualities])
    columns = {name: property_of == name for name in sorted(set(property_of.tolist()))}
    slots: list[_Slot] = []
    for who, part, used in zip((None, 0), parts, (physical | functional, physical), strict=True):
        for name, of in columns.items():
            if (of & used).any():
                slots += [(who, name)] * (int(part[:, of].any(axis=1).sum()) - 1)

    def ask(measured: Sequence[_Slot]) -> Question:
        counts = known.classes.counts.copy()
        for row, part, who in zip(pair, parts, (None, 0), strict=True):
            for name, of in columns.items():
                rows = np.flatnonzero(part[:, of].any(axis=1))[: 1 + measured.count((who, name))]
                counts[row, of] = part[np.ix_(rows, np.flatnonzero(of))].sum(axis=0)
        classes = replace(known.classes, counts=counts)
        rows_ = np.array(pair[1:])
        return Question(
            replace(known, classes=classes), settings, pair[0], rows_, np.zeros((1, len(property_of)))
        )

    return _Case(tuple(slots), ask)


def _inquire(cases: Sequence[_Case], repetitions: int, chance: np.random.Generator) -> Inquiry:
    asked, random = [], []
    for case in cases:
        truth = _probability(case.ask(case.slots)) >= 0.5
        asked.append(_effort(case, _asked, truth))
        for _ in range(repetitions):
            random.append(_effort(case, _shuffled(case, chance), truth))
    return Inquiry(tuple(asked), tuple(random))


def _shuffled(case: _Case, chance: np.random.Generator) -> _Choice:
    order = [case.slots[at] for at in chance.permutation(len(case.slots))]
    return lambda _, left: order[-len(left)]


def _asked(question: Question, left: Sequence[_Slot]) -> _Slot:
    """Return the most telling measurement that can still be made."""
    wished = [(one.candidate, one.property) for one in outlook(question, DRAWS).measurements]
    return next((one for one in wished if one in left), left[0])


def _effort(
    case: _Case,
    choose: _Choice,
    truth: bool,
) -> Effort:
    measured: list[_Slot] = []
    left = list(case.slots)
    shares = []
    while True:
        question = case.ask(measured)
        shares.append(_probability(question))
        if not left:
            break
        chosen = choose(question, left)
        left.remove(chosen)
        measured.append(chosen)
    wrong = [at for at, share in enumerate(shares) if (share >= 0.5) != truth]
    sure = [at for at, share in enumerate(shares) if max(share, 1 - share) >= SURE]
    possible = len(case.slots)
    return Effort(possible, wrong[-1] + 1 if wrong else 0, sure[0] if sure else possible)


def _probability(question: Question) -> float:
    return float(confidences(question, DRAWS).accepted[0])
