"""What asking for more is tried on: an unknown object, several of them, several classes hardly known.

A case is drawn at random among those where all measurements together say one thing: one candidate is the
best, or one object stands in or not.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ersatz.evaluation.calibration import half
from ersatz.evaluation.inquiry import Case, Slot, decided
from ersatz.evaluation.regrounding import Objects, held_degrees, reground
from ersatz.grounding.fuzzy import DEGREE
from ersatz.grounding.subcategorization import Qualities
from ersatz.reasoner.gain import Doubt, outlook
from ersatz.reasoner.relevance import ReasonerSettings
from ersatz.reasoner.representative import Knowledge
from ersatz.reasoner.sampling import Question

AVAILABLE: Final = 5
"""Things to choose from, as in the paper's experiment."""


@dataclass(frozen=True, slots=True, eq=False)
class ObjectsCase:
    """Objects never met stand on the table; classes are known. Their properties can be measured.

    Attributes
    ----------
    known : Knowledge
    settings : ReasonerSettings
    tool : int
    degrees : (n, q) float64 array
        What the objects hold.
    about : Doubt
    """

    known: Knowledge
    settings: ReasonerSettings
    tool: int
    degrees: NDArray[np.float64]
    about: Doubt

    @property
    def slots(self) -> Counter[Slot]:
        """Every property an object has a value of, once."""
        names = np.array([quality.property for quality in self.known.qualities])
        return Counter(
            (row, name)
            for row, held in enumerate(self.degrees)
            for name in sorted(set(names[held > 0].tolist()))
        )

    def ask(self, measured: Counter[Slot]) -> Question:
        """Return the question with what was measured of the objects."""
        names = [quality.property for quality in self.known.qualities]
        seen = np.array([[(row, name) in measured for name in names] for row in range(len(self.degrees))])
        rows, nothing = np.full(len(seen), -1), np.zeros_like(self.known.classes.counts)
        return Question(self.known, self.settings, self.tool, rows, self.degrees * seen, nothing)


@dataclass(frozen=True, slots=True, eq=False)
class ClassesCase:
    """A tool's class and several others are known from one object each; their other objects can be measured.

    Attributes
    ----------
    known : Knowledge
        With all objects.
    settings : ReasonerSettings
    rows : tuple of int
        The tool and the candidates.
    met : mapping of Slot to (o, k) int64 array
        What the first, the first two, ... of the objects that have a value of the property hold together
        of its k qualities, in millionths.
    columns : mapping of property to (k,) int64 array
        Its qualities.
    about : Doubt
    """

    known: Knowledge
    settings: ReasonerSettings
    rows: tuple[int, ...]
    met: Mapping[Slot, NDArray[np.int64]]
    columns: Mapping[str, NDArray[np.int64]]
    about: Doubt = Doubt.BEST

    @property
    def slots(self) -> Counter[Slot]:
        """Every property of all objects but the first that has a value of it."""
        return Counter({slot: len(sums) - 1 for slot, sums in self.met.items() if len(sums) > 1})

    def ask(self, measured: Counter[Slot]) -> Question:
        """Return the question with what was measured of the classes."""
        counts, further = self.known.classes.counts.copy(), np.zeros_like(self.known.classes.counts)
        for (who, name), sums in self.met.items():
            row, of = self.rows[0 if who is None else who + 1], self.columns[name]
            if len(sums):
                counts[row, of] = sums[measured[who, name]]
                further[row, of] = len(sums) - 1 - measured[who, name]
        known = replace(self.known, classes=replace(self.known.classes, counts=counts))
        rows = np.array(self.rows[1:])
        held = np.zeros((len(rows), counts.shape[1]))
        return Question(known, self.settings, self.rows[0], rows, held, further)


def unknown_object(
    objects: Objects, qualities: Sequence[Qualities], settings: ReasonerSettings, number: int, seed: int = 0
) -> list[Case]:
    """Draw cases of one object that stands in or not; classes are known from any half of the objects."""
    return _objects(objects, qualities, settings, (number, seed), 1, Doubt.ACCEPTED)


def unknown_objects(
    objects: Objects, qualities: Sequence[Qualities], settings: ReasonerSettings, number: int, seed: int = 0
) -> list[Case]:
    """Draw cases of several such objects, each of another class, of which one is the best."""
    return _objects(objects, qualities, settings, (number, seed), AVAILABLE, Doubt.BEST)


def unknown_classes(
    objects: Objects, qualities: Sequence[Qualities], settings: ReasonerSettings, number: int, seed: int = 0
) -> list[Case]:
    """Draw cases of classes known from one object each, of which one is the best."""
    known, chance = reground(objects, qualities), np.random.default_rng(seed)
    degrees = held_degrees(objects, qualities)
    names = np.array([quality.property for quality in known.qualities])
    columns = {name: np.flatnonzero(names == name) for name in dict.fromkeys(names.tolist())}

    def draw() -> Case:
        rows = chance.choice(len(objects.classes), min(1 + AVAILABLE, len(objects.classes)), replace=False)
        met: dict[Slot, NDArray[np.int64]] = {}
        for at, row in enumerate(rows.tolist()):
            part = chance.permutation(degrees[objects.of_class == row])
            for name, of in columns.items():
                held = part[:, of]
                met[at - 1 if at else None, name] = held[held.any(axis=1)].cumsum(axis=0)
        return ClassesCase(known, settings, tuple(rows.tolist()), met, columns)

    return _clear(draw, number)


def _objects(
    objects: Objects,
    qualities: Sequence[Qualities],
    settings: ReasonerSettings,
    sample: tuple[int, int],
    many: int,
    about: Doubt,
) -> list[Case]:
    number, seed = sample
    chance, degrees = np.random.default_rng(seed), held_degrees(objects, qualities) / DEGREE

    def draw() -> Case:
        shown = half(objects, int(chance.integers(2**32)))
        known = reground(objects.take(shown), qualities)
        hidden = np.setdiff1d(np.arange(len(objects.of_class)), shown)
        of = objects.of_class[hidden]
        tool, *classes = chance.permutation(np.unique(of))[: 1 + many].tolist()
        chosen = [int(chance.choice(hidden[of == row])) for row in classes]
        return ObjectsCase(known, settings, tool, degrees[chosen], about)

    return _clear(draw, number)


def _clear(draw: Callable[[], Case], number: int) -> list[Case]:
    """Draw so many cases where all measurements together leave no doubt: a tie is no decision."""
    found: list[Case] = []
    for _ in range(100 * number):
        case = draw()
        if decided(case, outlook(case.ask(case.slots), 1, about=case.about))[1] == 1:
            found.append(case)
        if len(found) == number:
            break
    return found
