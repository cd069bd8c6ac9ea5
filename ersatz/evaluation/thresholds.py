"""Nested selection: no threshold is chosen on the scenarios it is judged on.

The scenarios of one missing tool are set aside, the choice is made on those of all others, and judged on
the ones set aside; every tool has its turn.
"""

from collections.abc import Mapping, Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ersatz.evaluation.agreement import Answer, agree
from ersatz.evaluation.scenarios import Scenario

T = TypeVar("T")
LEVELS = 40
"""Thresholds tried, at most: quantiles of the scores."""


def nested_choice(values: NDArray[np.float64], tools: Sequence[str]) -> NDArray[np.int64]:
    """Return for each scenario which option is best on the scenarios of all other tools.

    Parameters
    ----------
    values : (options, scenarios) array
        How good each option is for each scenario.
    tools : sequence of str
        The missing tool of each scenario.

    Returns
    -------
    (scenarios,) int64 array
        The first of the best options; with one tool only, the first option.
    """
    names = np.array(tools)
    chosen = np.zeros(len(tools), dtype=np.int64)
    for tool in sorted(set(tools)):
        others = names != tool
        if others.any():
            chosen[~others] = int(np.argmax(np.round(values[:, others].mean(axis=1), 12)))
    return chosen


def accept_by_score(scenarios: Sequence[Scenario], answers: Sequence[Answer]) -> list[Answer]:
    """Let a method that only ranks decide: accept scores from a threshold on, chosen by nested F1."""
    scores = sorted({score for answer in answers for score in answer.scores or ()})
    if len(scores) > LEVELS:
        scores = [scores[round(at * (len(scores) - 1) / (LEVELS - 1))] for at in range(LEVELS)]
    if not scores:
        return list(answers)
    options = [[_cut(s, a, level) for s, a in zip(scenarios, answers, strict=True)] for level in scores]
    values = np.array([[_f1(s, a) for s, a in zip(scenarios, o, strict=True)] for o in options])
    chosen = nested_choice(values, [scenario.missing for scenario in scenarios])
    return [options[option][at] for at, option in enumerate(chosen)]


def nested_settings(
    scenarios: Sequence[Scenario], grid: Mapping[T, Sequence[Answer]]
) -> tuple[list[Answer], list[T]]:
    """Return the answers of the settings that do best on all other tools (top-1 and F1), and which they "
    "are."""
    settings = list(grid)
    values = np.array([[_worth(s, a) for s, a in zip(scenarios, grid[one], strict=True)] for one in settings])
    chosen = nested_choice(values, [scenario.missing for scenario in scenarios])
    picked = [settings[option] for option in chosen]
    return [grid[one][at] for at, one in enumerate(picked)], picked


def _cut(scenario: Scenario, answer: Answer, level: float) -> Answer:
    pairs = zip(scenario.available, answer.scores or (), strict=False)
    return Answer(answer.scores, frozenset(name for name, score in pairs if score >= level))


def _f1(scenario: Scenario, answer: Answer) -> float:
    """Return F1 without the rest of the metrics: this runs for every threshold."""
    truth, accepted = scenario.chosen(), answer.accepted or frozenset()
    both = len(truth) + len(accepted)
    return 2 * len(truth & accepted) / both if both else 1.0


def _worth(scenario: Scenario, answer: Answer) -> float:
    value = agree(scenario, answer).value
    return ((value["top1"] or 0.0) + (value["f1"] or 0.0)) / 2
