"""Asking for more, simulated: how many measurements it takes to decide as all of them would.

What can be measured is finite: certain properties of certain objects. What all of them together say is the
decision to reach; on the way there it is the most probable one, given what was measured and how many objects
are still to come. The order is that of `outlook`, or random: each of the measurements left alike.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Final, Protocol, TypeAlias

import numpy as np

from ersatz.acquisition.engine import Engine, Here
from ersatz.reasoner.gain import Doubt, Outlook, outlook
from ersatz.reasoner.sampling import Question

DRAWS: Final = 400
"""Fewer than `gain.DRAWS`, for it is asked very often; with 100, chance makes asking look worse."""

SURE: Final = 0.9
"""Enough to stop."""

ROUND: Final = 10
"""Measured in rounds, each a tenth of what was measured before: counts of both orders are that coarse."""

Slot: TypeAlias = tuple[int | None, str]
"""Candidate (None: the tool) and property, as in `Measurement`."""


class Case(Protocol):
    """A decision to be made, and what can be measured for it."""

    @property
    def about(self) -> Doubt:
        """What is decided."""

    @property
    def slots(self) -> Counter[Slot]:
        """What can be measured, and how often."""

    def ask(self, measured: Counter[Slot]) -> Question:
        """Return the question about all that can be measured when some of it has been."""


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
        After so many the decision has a probability of `SURE` or more.
    confirmed : bool
        Whether the decision is then that of all measurements.
    """

    possible: int
    right: int
    sure: int
    confirmed: bool


@dataclass(frozen=True, slots=True)
class Ratio:
    """Measurements asked for, as a share of those in random order, and its 95 % interval.

    Attributes
    ----------
    asked, random : float
        Mean number.
    ratio, low, high : float
        Decisions are drawn again for the interval.
    """

    asked: float
    random: float
    ratio: float
    low: float
    high: float

    @classmethod
    def of(cls, asked: Sequence[float], random: Sequence[float], draws: int = 2000) -> "Ratio":
        """Return the ratio of the means of paired numbers."""
        pairs = np.array([asked, random], dtype=np.float64)
        rows = np.random.default_rng(0).integers(pairs.shape[1], size=(draws, pairs.shape[1]))
        one, two = pairs[:, rows].mean(axis=-1)
        low, high = np.quantile(one / np.maximum(two, 1e-9), (0.025, 0.975)).tolist()
        a, b = pairs.mean(axis=1).tolist()
        return cls(a, b, a / b if b else 1.0, low, high)

    def to_json(self) -> dict[str, float]:
        """Return it in JSON's types."""
        return {name: round(getattr(self, name), 6) for name in self.__slots__}


@dataclass(frozen=True, slots=True)
class Inquiry:
    """The same decisions with measurements in both orders.

    Attributes
    ----------
    asked : tuple of n Effort
    random : tuple of n tuples of Effort
        One a repetition.
    """

    asked: tuple[Effort, ...]
    random: tuple[tuple[Effort, ...], ...]

    def ratio(self, name: str) -> Ratio:
        """Return how the two orders compare in `right` or `sure`."""
        random = [float(np.mean([getattr(one, name) for one in each])) for each in self.random]
        return Ratio.of([getattr(one, name) for one in self.asked], random)

    def to_json(self) -> dict[str, Any]:
        """Return it in JSON's types."""
        return {
            "decisions": len(self.asked),
            "possible": round(float(np.mean([one.possible for one in self.asked])), 6),
            "confirmed": round(float(np.mean([one.confirmed for one in self.asked])), 6),
            "confirmed_random": round(
                float(np.mean([one.confirmed for each in self.random for one in each])), 6
            ),
            **{name: self.ratio(name).to_json() for name in ("right", "sure")},
        }


def inquire(
    cases: Sequence[Case],
    repetitions: int = 1,
    seed: int = 0,
    *,
    draws: int = DRAWS,
    engine: Engine | None = None,
) -> Inquiry:
    """Make all measurements of every case, in the order asked for and so many times in random order.

    Parameters
    ----------
    cases : sequence of Case
    repetitions, seed : int
    draws : int
        Of each outlook on the way.
    engine : Engine, optional
        What goes through the cases, this process unless told; the numbers are the same with any.
    """
    chances = np.random.default_rng(seed).spawn(len(cases))
    efforts = partial(_efforts, repetitions=repetitions, draws=draws)
    found = list((engine or Here()).map(efforts, zip(cases, chances, strict=True)))
    return Inquiry(tuple(asked for asked, _ in found), tuple(random for _, random in found))


def _efforts(
    one: tuple[Case, np.random.Generator], repetitions: int, draws: int
) -> tuple[Effort, tuple[Effort, ...]]:
    case, chance = one
    return _effort(case, None, draws), tuple(_effort(case, chance, draws) for _ in range(repetitions))


def decided(case: Case, found: Outlook) -> tuple[int, float]:
    """Return the most probable decision and its probability: the best candidate, or whether it stands in."""
    if case.about is Doubt.BEST:
        best = int(np.argmax(found.best))
        return best, found.best[best]
    share = found.accepted[0]
    return int(share >= 0.5), max(share, 1 - share)


def _effort(case: Case, chance: np.random.Generator | None, draws: int) -> Effort:
    """Measure in random order, or without chance in that asked for."""
    measured: Counter[Slot] = Counter()
    left = case.slots
    made, steps = [], []
    while True:
        found = outlook(case.ask(measured), draws, about=case.about)
        made.append(measured.total())
        steps.append(decided(case, found))
        if not left:
            break
        size = min(max(1, measured.total() // ROUND), left.total())
        chosen = Counter(_random(left, size, chance) if chance else _asked(found, measured, left, size))
        measured, left = measured + chosen, left - chosen
    truth = steps[-1][0]
    wrong = [at for at, (what, _) in enumerate(steps) if what != truth]
    sure = next(at for at, (_, share) in enumerate(steps) if share >= SURE or at == len(steps) - 1)
    right = made[wrong[-1] + 1] if wrong else 0
    return Effort(made[-1], right, made[sure], steps[sure][0] == truth)


def _random(left: Counter[Slot], size: int, chance: np.random.Generator) -> list[Slot]:
    slots = list(left.elements())
    return [slots[at] for at in chance.choice(len(slots), size, replace=False).tolist()]


def _asked(found: Outlook, measured: Counter[Slot], left: Counter[Slot], size: int) -> Iterator[Slot]:
    """Yield the most telling measurements left; one more of the same tells less, by how many are known."""
    gain = {(one.candidate, one.property): one.gain for one in found.measurements}
    known, room = measured.copy(), left.copy()
    for _ in range(size):
        best = max(room, key=lambda one: (gain.get(one, -1.0), str(one)))
        yield best
        known[best] += 1
        gain[best] = gain.get(best, -1.0) * (known[best] + 1) / (known[best] + 3)
        room -= Counter([best])
