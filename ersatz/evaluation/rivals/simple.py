"""Rivals that know next to nothing: chance, popularity, weight. What is not better is no method."""

from dataclasses import dataclass

from ersatz.evaluation.agreement import Answer
from ersatz.evaluation.features import ClassFeatures, class_features
from ersatz.evaluation.methods import Context
from ersatz.evaluation.scenarios import Scenario


@dataclass(frozen=True, slots=True)
class Chance:
    """All objects are equal; every metric is its exact mean over random orders."""

    def answer(self, scenario: Scenario) -> Answer:
        """Score all the same."""
        return Answer((0.0,) * len(scenario.available))


@dataclass(frozen=True, slots=True)
class MostPopular:
    """The object chosen most often when it is offered, in the scenarios of all *other* tools."""

    context: Context

    def answer(self, scenario: Scenario) -> Answer:
        """Score by the share of choices when offered; unknown objects score 0."""
        offered: dict[str, list[float]] = {}
        for other in self.context.scenarios:
            if other.missing != scenario.missing and other.judged:
                for name, share in zip(other.available, other.shares(), strict=True):
                    offered.setdefault(name, []).append(share)
        known = {name: sum(shares) / len(shares) for name, shares in offered.items()}
        return Answer(tuple(known.get(name, 0.0) for name in scenario.available))


@dataclass(frozen=True, slots=True)
class Heaviest:
    """The heaviest object, whatever is missing."""

    features: ClassFeatures

    def answer(self, scenario: Scenario) -> Answer:
        """Score by mean weight."""
        weight = self.features.of(["weight"])[:, 0]
        return Answer(tuple(float(weight[self.features.row[name]]) for name in scenario.available))


def chance(_: Context) -> Chance:
    """Return the method."""
    return Chance()


def most_popular(context: Context) -> MostPopular:
    """Return the method."""
    return MostPopular(context)


def heaviest(context: Context) -> Heaviest:
    """Return the method; the knowledge base must hold weights."""
    features = context.kb.view(class_features)
    features.of(["weight"])
    return Heaviest(features)
