"""Why the paper's rule ranks as it does: every step of it kept or exchanged, in all combinations.

Three choices make a rule: what a degree is (cut at theta, or kept), what relevance does (cuts at phi, as in
the paper; weighs qualities, or whole properties; nothing), and how two things are compared (ratio of shared
to joint, as in the paper; coverage; ordinal). All combinations are judged, so that what one choice does can
be read as a mean over the others, and nothing is picked.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import product
from textwrap import fill
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ersatz.evaluation.agreement import Answer, agree
from ersatz.evaluation.scenarios import Scenario
from ersatz.evaluation.thresholds import nested_choice
from ersatz.evaluation.uncertainty import Estimate, estimate
from ersatz.knowledge.base import KnowledgeBase
from ersatz.reasoner.graded import Layout, importance, similarities, weigh
from ersatz.reasoner.relevance import ReasonerSettings, layout_of
from ersatz.reasoner.representative import Memberships, load_knowledge
from ersatz.reasoner.similarity import Similarity


class Degrees(StrEnum):
    """What a degree is."""

    CUT = "cut at θ"
    KEPT = "kept"


class RelevanceStep(StrEnum):
    """What relevance does."""

    CUT = "cut at φ"
    FALLBACK = "cut at φ, else all"
    WEIGHED = "weighed"
    BY_PROPERTY = "weighed by property"
    NONE = "none"


FORMS: Final = (Similarity.RUZICKA, Similarity.COVERAGE, Similarity.ORDINAL)
"""Ruzicka of degrees that are cut is Jaccard."""

METRICS: Final = ("top1", "rr", "ndcg")

WIDTH: Final = 130
"""Of lines of text."""

MANY: Final = 0.1
"""Share of answers with a tied first place that is shown in the table."""


@dataclass(frozen=True, slots=True)
class Rule:
    """One combination; the paper's is cut, cut, Ruzicka."""

    degrees: Degrees
    relevance: RelevanceStep
    similarity: Similarity


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a rule does.

    Attributes
    ----------
    rule : Rule
    metrics : mapping of metric to Estimate
    answered : float in [0, 1]
        Share of scenarios with an answer.
    tied : float in [0, 1]
        Share of the answers whose first place is shared.
    values : mapping of metric to one number a scenario
    """

    rule: Rule
    metrics: dict[str, Estimate]
    answered: float
    tied: float
    values: dict[str, list[float | None]]


def all_rules() -> tuple[Rule, ...]:
    """Return every combination, the paper's first."""
    return tuple(Rule(*one) for one in product(Degrees, RelevanceStep, FORMS))


def ablate(kb: KnowledgeBase, scenarios: Sequence[Scenario]) -> tuple[Outcome, ...]:
    """Judge every combination on the scenarios."""
    return tuple(_outcome(rule, scenarios, answers_of(kb, scenarios, rule)) for rule in all_rules())


def answers_of(kb: KnowledgeBase, scenarios: Sequence[Scenario], rule: Rule) -> list[Answer]:
    """Return a rule's answers at the paper's theta and phi, without decisions."""
    known, settings = kb.view(load_knowledge), ReasonerSettings()
    layout = layout_of(known, settings)
    classes, functions = (_degrees(of, rule, settings) for of in (known.classes, known.functions))
    answers = []
    for scenario in scenarios:
        tool = classes[known.row_of_name[scenario.missing]]
        weights = _weights(tool, functions, layout, rule, settings)
        if weights is None:
            answers.append(Answer(None))
            continue
        available = classes[[known.row_of_name[name] for name in scenario.available]]
        if rule.relevance is RelevanceStep.BY_PROPERTY and rule.similarity is not Similarity.ORDINAL:
            # the tool's own degrees are wanted, and a property counts as a whole: as ordinal has it anyway
            scale = np.repeat(importance(weights, layout), layout.lengths)
            weights, available = scale * tool * layout.physical, available * scale
        found = similarities(weights, tool, available, layout, rule.similarity)
        answers.append(Answer(tuple(np.round(found, 12).tolist())))
    return answers


def by_choice(outcomes: Sequence[Outcome]) -> dict[str, dict[str, float]]:
    """Return the mean of top-1 over all rules with each option of each choice: what it does by itself."""
    found: dict[str, dict[str, list[float]]] = {"degrees": {}, "relevance": {}, "similarity": {}}
    for one in outcomes:
        for choice, options in found.items():
            options.setdefault(str(getattr(one.rule, choice)), []).append(one.metrics["top1"].mean or 0.0)
    return {
        choice: {option: sum(means) / len(means) for option, means in options.items()}
        for choice, options in found.items()
    }


def nested(scenarios: Sequence[Scenario], outcomes: Sequence[Outcome]) -> tuple[float, Rule]:
    """Return the top-1 of rules chosen on all other tools, and the rule chosen most often."""
    values = np.array([[value or 0.0 for value in one.values["top1"]] for one in outcomes])
    chosen = nested_choice(values, [scenario.missing for scenario in scenarios])
    most = int(np.bincount(chosen).argmax())
    return float(values[chosen, np.arange(len(scenarios))].mean()), outcomes[most].rule


def markdown(scenarios: Sequence[Scenario], outcomes: Sequence[Outcome]) -> str:
    """Return top-1 of all combinations as a table, each choice by itself, and what nested selection gives."""
    found = {one.rule: one for one in outcomes}
    lines = [
        "| degrees | relevance | Jaccard / Ruzicka | coverage | ordinal | answered |",
        "|---|---|---|---|---|---|",
    ]
    for degrees, step in product(Degrees, RelevanceStep):
        row = [found[Rule(degrees, step, form)] for form in FORMS]
        cells = [_cell(one, paper=one is outcomes[0]) for one in row]
        lines.append(f"| {degrees} | {step} | {' | '.join(cells)} | {row[0].answered:.2f} |")
    means = (
        f"{choice}: " + ", ".join(f"{option} {mean:.2f}" for option, mean in options.items())
        for choice, options in by_choice(outcomes).items()
    )
    mean, rule = nested(scenarios, outcomes)
    chosen = f"degrees {rule.degrees}, relevance {rule.relevance}, {rule.similarity}"
    text = (
        f"Each choice by itself, the mean over all others: {'; '.join(means)}. The best rule on all other "
        f"tools, judged on the tool left out: {mean:.2f} (most often {chosen})."
    )
    lines += ["", fill(text, WIDTH)]
    return "\n".join(lines) + "\n"


def _cell(one: Outcome, *, paper: bool) -> str:
    top = f"{one.metrics['top1'].mean:.2f}"
    return (f"**{top}**" if paper else top) + (f" ({one.tied:.2f} tied)" if one.tied >= MANY else "")


def _degrees(of: Memberships, rule: Rule, settings: ReasonerSettings) -> NDArray[np.float64]:
    if rule.degrees is Degrees.CUT:
        return of.representative(settings.representative).astype(np.float64)
    found: NDArray[np.float64] = of.counts / np.maximum(of.totals, 1)
    return found


def _weights(
    tool: NDArray[np.float64],
    functions: NDArray[np.float64],
    layout: Layout,
    rule: Rule,
    settings: ReasonerSettings,
) -> NDArray[Any] | None:
    """Return the relevance of qualities, or None where nothing is relevant."""
    body = tool * layout.physical
    if rule.relevance is RelevanceStep.NONE:
        return body
    if rule.relevance in (RelevanceStep.WEIGHED, RelevanceStep.BY_PROPERTY):
        found = weigh(tool, functions, layout)
        return found.qualities if found.determined else None
    cut = weigh(tool, functions, layout, settings.relevance_tolerance).functions > 0
    if not cut.any():
        return body if rule.relevance is RelevanceStep.FALLBACK else None
    # a function above phi counts as far as the tool has it, however similar
    has = tool[layout.columns] * cut
    both = np.minimum(body, functions * layout.physical) * (has / has.max())[:, None]
    joined: NDArray[Any] = both.max(axis=0)
    return joined


def _outcome(rule: Rule, scenarios: Sequence[Scenario], answers: Sequence[Answer]) -> Outcome:
    agreed = [agree(scenario, answer) for scenario, answer in zip(scenarios, answers, strict=True)]
    tools = [scenario.missing for scenario in scenarios]
    values = {metric: [one.value[metric] for one in agreed] for metric in METRICS}
    given = [(s, a) for s, a in zip(scenarios, answers, strict=True) if a.scores is not None]
    return Outcome(
        rule,
        {metric: estimate(of, tools, draws=1000) for metric, of in values.items()},
        len(given) / len(answers),
        sum(len(a.best(s)) > 1 for s, a in given) / max(len(given), 1),
        values,
    )
