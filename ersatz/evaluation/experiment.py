"""The experiment: all methods on the same scenarios, how sure the figures are, and what hangs on what."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ersatz.errors import InputError
from ersatz.evaluation.agreement import METRICS, Answer, agree
from ersatz.evaluation.analysis import misses
from ersatz.evaluation.baselines import OURS, assemble, select
from ersatz.evaluation.methods import Context, Ersatz
from ersatz.evaluation.resampling import Grounder
from ersatz.evaluation.results import Results, Standing, mean_of, means_of
from ersatz.evaluation.scenarios import Scenario, check_names
from ersatz.evaluation.sweeps import (
    SHOWN,
    Progress,
    answers_on_grid,
    over_objects,
    sweep_grounding,
    sweep_reasoner,
)
from ersatz.evaluation.thresholds import accept_by_score, nested_settings
from ersatz.evaluation.uncertainty import (
    blind_ceiling,
    estimate,
    experts_alpha,
    holm,
    leave_one_out,
    paired_test,
)
from ersatz.knowledge.base import KnowledgeBase

NESTED = "nested"
"""Name of ERSATZ with theta and phi chosen by nested selection."""


def run(
    kb: KnowledgeBase,
    scenarios: Sequence[Scenario],
    *,
    baselines: Sequence[str] = (),
    ground: Grounder | None = None,
    resamples: int = 20,
    workers: int = 1,
    progress: Progress = lambda _stage, _share: None,
) -> Results:
    """Run the experiment.

    Parameters
    ----------
    kb : KnowledgeBase
    scenarios : sequence of Scenario
    baselines : sequence of str
        NAME or NAME=FILE; without names, all that can take part.
    ground : callable, optional
        Grounds measurements; without it, or with classes only, nothing is grounded again.
    resamples : int
        How often the objects are drawn again.
    workers : int
        Processes.

    Raises
    ------
    UnknownNameError
        If a baseline or a class is not known.
    InputError
        If nothing is known of any scenario.
    """
    check_names(scenarios, kb.known_names("class"))
    judged = tuple(scenario for scenario in scenarios if scenario.judged)
    if not judged:
        raise InputError("no scenario has votes or accepted answers: run the survey first")
    entrants, sources = select(baselines)
    progress("methods", 0.0)
    methods, left_out = assemble(entrants, Context(kb, judged, sources))
    standings = []
    for at, (entrant, method) in enumerate(methods.items()):
        progress(entrant.label, at / len(methods))
        answers = [method.answer(scenario) for scenario in judged]
        standings.append(_standing(entrant.name, entrant.label, entrant.name in OURS, judged, answers))
    grid = answers_on_grid(kb, judged, progress)
    picked, chosen = nested_settings(judged, grid)
    nested = _standing(NESTED, "ERSATZ, thresholds chosen on other tools", True, judged, picked)
    standings.insert(next((i for i, s in enumerate(standings) if not s.ours), len(standings)), nested)
    can_ground = ground is not None and bool(kb.known_names("instance"))
    cells = sweep_reasoner(kb, judged, progress)
    again: list[list[Answer]] = []
    if ground is not None and can_ground:
        cells += sweep_grounding(kb, judged, ground, progress, workers)
        again = over_objects(kb, judged, ground, progress, resamples, workers)
    ballots = [scenario for scenario in judged if scenario.ballots]
    return Results(
        Path(kb.location).name,
        kb.revision,
        judged,
        len(scenarios) - len(judged),
        _compared(standings, judged),
        left_out,
        {"blind": blind_ceiling(judged)} | ({f"expert_{k}": e for k, e in leave_one_out(ballots).items()}),
        experts_alpha(ballots),
        {key: _grid_metrics(judged, answers) for key, answers in grid.items()},
        tuple(cells),
        tuple(map(tuple, again)),
        misses(kb, judged, {s.name: (s.label, s.agreements) for s in standings}, Ersatz(kb)),
        tuple(chosen),
    )


def _standing(
    name: str, label: str, ours: bool, scenarios: Sequence[Scenario], answers: Sequence[Answer]
) -> Standing:
    decides = any(answer.accepted is not None for answer in answers)
    if not decides:
        answers = accept_by_score(scenarios, answers)
    agreements = [agree(scenario, answer) for scenario, answer in zip(scenarios, answers, strict=True)]
    tools = [scenario.missing for scenario in scenarios]
    return Standing(
        name,
        label,
        ours,
        decides,
        tuple(answers),
        tuple(agreements),
        {metric: estimate([one.value[metric] for one in agreements], tools) for metric in METRICS},
        {metric: mean_of([one.chance[metric] for one in agreements]) for metric in METRICS},
    )


def _compared(standings: Sequence[Standing], scenarios: Sequence[Scenario]) -> tuple[Standing, ...]:
    """Add the tests against the first method, corrected over all methods for each metric."""
    tools = [scenario.missing for scenario in scenarios]
    first, *others = standings
    p: dict[str, dict[str, float]] = {}
    for metric in SHOWN:
        mine = [one.value[metric] for one in first.agreements]
        p[metric] = {
            s.name: paired_test(mine, [one.value[metric] for one in s.agreements], tools) for s in others
        }
    corrected = {metric: holm(of) for metric, of in p.items()}
    return (
        first,
        *(
            replace(
                s,
                p={metric: p[metric][s.name] for metric in p},
                corrected={metric: corrected[metric][s.name] for metric in p},
            )
            for s in others
        ),
    )


def _grid_metrics(scenarios: Sequence[Scenario], answers: Sequence[Answer]) -> dict[str, float]:
    means = means_of(scenarios, answers)
    return {metric: means[metric] or 0.0 for metric in SHOWN}
