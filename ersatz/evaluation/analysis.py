"""Every scenario ERSATZ gets wrong: what it said, why, and what would mend it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from ersatz.evaluation.agreement import Agreement
from ersatz.evaluation.methods import Ersatz
from ersatz.evaluation.scenarios import NONE, Scenario
from ersatz.knowledge.base import KnowledgeBase
from ersatz.reasoner.relevance import ReasonerSettings
from ersatz.reasoner.substitution import Ranking, Status, Substitute, rank_substitutes

CAUSES = {
    "undetermined": "no function of the tool is relevant: there is no answer",
    "conflict": "the tool is good for several tasks, and the best-ranked object is right for another of them",
    "tie": "a right object shares the first place with a wrong one",
    "below": "a right object stands in, but a wrong one is ranked above it",
    "rejected": "no right object is similar enough to stand in",
    "none": "nothing will do, but something was accepted",
}
"""Why an answer is wrong; the first that holds."""


@dataclass(frozen=True, slots=True)
class Miss:
    """A scenario that ERSATZ gets wrong, wholly or in part.

    Attributes
    ----------
    scenario : Scenario
    top1 : float in [0, 1)
    cause : str
        One of `CAUSES`.
    functions, relevant : tuple of str
        O_F' and O_P'.
    wrong, right : str
        The best wrong object and the best right one, explained by the reasoner; empty if there is none.
    lacking : tuple of str
        Relevant qualities the best right object lacks.
    mend : str
        The least change of a threshold that gives an answer, or the qualities in the way.
    variants, rivals : tuple of str
        Labels of the methods that get it right.
    """

    scenario: Scenario
    top1: float
    cause: str
    functions: tuple[str, ...]
    relevant: tuple[str, ...]
    wrong: str
    right: str
    lacking: tuple[str, ...]
    mend: str
    variants: tuple[str, ...]
    rivals: tuple[str, ...]

    def to_json(self) -> dict[str, Any]:
        """Return it in JSON's types."""
        return {
            "scenario": self.scenario.id,
            "top1": round(self.top1, 6),
            "cause": self.cause,
            "relevant_functional": list(self.functions),
            "relevant_physical": list(self.relevant),
            "wrong": self.wrong,
            "right": self.right,
            "lacking": list(self.lacking),
            "mend": self.mend,
            "variants": list(self.variants),
            "rivals": list(self.rivals),
        }


def misses(
    kb: KnowledgeBase,
    scenarios: Sequence[Scenario],
    standings: Mapping[str, tuple[str, Sequence[Agreement]]],
    method: Ersatz,
) -> tuple[Miss, ...]:
    """Return what ERSATZ gets wrong, in the order of the scenarios.

    Parameters
    ----------
    standings : mapping of method name to its label and agreements; "ersatz" is the method looked at
    """
    mine = standings["ersatz"][1]
    good_for: dict[str, set[str]] = {}
    for scenario in scenarios:
        good_for.setdefault(scenario.missing, set()).update(scenario.chosen())
    found = []
    for at, scenario in enumerate(scenarios):
        top1 = mine[at].value["top1"] or 0.0
        if top1 < 1:
            right_by = [
                (name, label)
                for name, (label, agreements) in standings.items()
                if (agreements[at].value["top1"] or 0.0) == 1
            ]
            found.append(_miss(kb, scenario, top1, good_for[scenario.missing], right_by, method.settings))
    return tuple(found)


def _miss(
    kb: KnowledgeBase,
    scenario: Scenario,
    top1: float,
    good_for: set[str],
    right_by: Sequence[tuple[str, str]],
    settings: ReasonerSettings,
) -> Miss:
    ranking = rank_substitutes(kb, scenario.missing, scenario.available, settings=settings)
    goals = scenario.modes() - {NONE}
    right = next((one for one in ranking if one.name in goals), None)
    wrong = next((one for one in ranking if one.name not in goals), None)
    cause = _cause(ranking, wrong, right, good_for)
    determined = ranking.status is Status.OK
    ours = [label for _, label in right_by if label.startswith("ERSATZ")]
    return Miss(
        scenario,
        top1,
        cause,
        ranking.relevant_functional,
        ranking.relevant_physical,
        wrong.explain() if wrong and determined else "",
        right.explain() if right and determined else "",
        tuple(one.quality for one in right.lacking) if right and determined else (),
        _mend(kb, scenario, ranking, wrong, right),
        tuple(ours),
        tuple(label for _, label in right_by if label not in ours),
    )


def _cause(ranking: Ranking, wrong: Substitute | None, right: Substitute | None, good_for: set[str]) -> str:
    if ranking.status is Status.UNDETERMINED:
        return "undetermined"
    if right is None:
        return "none"
    if wrong and wrong.similarity > right.similarity and wrong.name in good_for:
        return "conflict"
    if wrong and wrong.similarity == right.similarity:
        return "tie" if right.accepted else "rejected"
    return "below" if right.accepted else "rejected"


def _mend(
    kb: KnowledgeBase,
    scenario: Scenario,
    ranking: Ranking,
    wrong: Substitute | None,
    right: Substitute | None,
) -> str:
    if ranking.status is Status.UNDETERMINED:
        for level in (Fraction(at, 100) for at in range(34, -1, -1)):
            settings = ReasonerSettings(relevance_tolerance=level)
            lower = rank_substitutes(kb, scenario.missing, scenario.available, settings=settings)
            if lower.status is Status.OK:
                fits = "then right" if lower[0].name in scenario.modes() else "then wrong all the same"
                return f"an answer at a relevance tolerance of {float(level):g} or less, {fits}"
        return "no relevance tolerance gives an answer: no function typical of it shares a quality with it"
    if wrong is None or right is None:
        return ""
    have, want = {one.quality for one in wrong.shared}, {one.quality for one in right.shared}
    burden = sorted(one.quality for one in right.extra)
    parts = []
    if have - want:
        parts.append(f"{right.name} would need {', '.join(sorted(have - want))}")
    if burden:
        parts.append(f"is held back by {', '.join(burden)}")
    return "; ".join(parts) or "only other qualities could tell them apart"
