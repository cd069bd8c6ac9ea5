"""What every method is: it answers a scenario. Also ERSATZ itself, and what methods are made from."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, Protocol, TypeAlias

from ersatz.evaluation.agreement import Answer
from ersatz.evaluation.scenarios import Scenario
from ersatz.knowledge.base import KnowledgeBase
from ersatz.reasoner.confidence import DRAWS
from ersatz.reasoner.relevance import PAPER_PROPERTIES, ReasonerSettings
from ersatz.reasoner.substitution import Status, rank_substitutes

LIKELY: Final = 0.5
"""What stands in with this probability is accepted."""


class Method(Protocol):
    """Answers scenarios, without seeing what experts said of them."""

    def answer(self, scenario: Scenario) -> Answer:
        """Return scores of the available objects and, where the method decides, what it accepts."""


@dataclass(frozen=True, slots=True)
class Context:
    """What methods are made from.

    Attributes
    ----------
    kb : KnowledgeBase
    scenarios : sequence of Scenario
        For methods that learn from the experts' choices; they leave out those of the tool asked for.
    sources : mapping of baseline name to a file the user gives for it
    """

    kb: KnowledgeBase
    scenarios: Sequence[Scenario]
    sources: Mapping[str, Path] = field(default_factory=dict)


Maker: TypeAlias = Callable[[Context], Method]


@dataclass(frozen=True, slots=True)
class Entrant:
    """A method under its name.

    Attributes
    ----------
    name : str
        As given to `--baseline`.
    label : str
        As shown in tables and figures.
    make : callable
        Raises ErsatzError where something it needs is not there.
    """

    name: str
    label: str
    make: Maker


@dataclass(frozen=True, slots=True)
class Ersatz:
    """The reasoner of this package, at some settings."""

    kb: KnowledgeBase
    settings: ReasonerSettings = field(default_factory=ReasonerSettings)

    def answer(self, scenario: Scenario) -> Answer:
        """Return similarities and what is accepted; undetermined where no function is relevant."""
        ranking = rank_substitutes(self.kb, scenario.missing, scenario.available, settings=self.settings)
        if ranking.status is Status.UNDETERMINED:
            return Answer(None, frozenset())
        found = {substitute.name: substitute for substitute in ranking}
        return Answer(
            tuple(found[name].similarity for name in scenario.available),
            frozenset(name for name in scenario.available if found[name].accepted),
        )


@dataclass(frozen=True, slots=True)
class Expected:
    """The same with what is not known drawn: by expected similarity, accepted if that is probable."""

    kb: KnowledgeBase
    settings: ReasonerSettings = field(default_factory=ReasonerSettings)

    def answer(self, scenario: Scenario) -> Answer:
        """Return expected similarities, and what stands in with a probability of one half or more."""
        ranking = rank_substitutes(
            self.kb, scenario.missing, scenario.available, settings=self.settings, draws=DRAWS
        )
        assert ranking.sure is not None
        names = [substitute.name for substitute in ranking]
        scores = dict(zip(names, ranking.sure.expected.tolist(), strict=True))
        sure = dict(zip(names, ranking.sure.accepted.tolist(), strict=True))
        if not any(scores.values()):
            return Answer(None, frozenset())
        return Answer(
            tuple(scores[name] for name in scenario.available),
            frozenset(name for name in names if sure[name] >= LIKELY),
        )


def ersatz_with(**settings: object) -> Maker:
    """Return a maker of ERSATZ at settings other than the paper's."""
    return lambda context: Ersatz(context.kb, ReasonerSettings(**settings))  # type: ignore[arg-type]


def expected_with(**settings: object) -> Maker:
    """Return the same of answers by expected similarity."""
    return lambda context: Expected(context.kb, ReasonerSettings(**settings))  # type: ignore[arg-type]


def papers_properties(context: Context) -> Ersatz:
    """Return ERSATZ with the paper's properties only, as far as the knowledge base has them."""
    known = set(context.kb.known_names("property"))
    return Ersatz(context.kb, ReasonerSettings(properties=tuple(p for p in PAPER_PROPERTIES if p in known)))
