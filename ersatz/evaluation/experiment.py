"""The experiment: all methods on the same scenarios, how sure the figures are, and what hangs on what."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from hashlib import sha256
from json import dumps
from pathlib import Path
from typing import Any

from ersatz.errors import InputError
from ersatz.evaluation.agreement import METRICS, Agreement, Answer, agree
from ersatz.evaluation.analysis import Miss, misses
from ersatz.evaluation.baselines import OURS, assemble, select
from ersatz.evaluation.methods import Context, Ersatz
from ersatz.evaluation.resampling import Grounder
from ersatz.evaluation.scenarios import Scenario, check_names
from ersatz.evaluation.sweeps import (
    SHOWN,
    Cell,
    Progress,
    answers_on_grid,
    over_objects,
    sweep_grounding,
    sweep_reasoner,
)
from ersatz.evaluation.thresholds import accept_by_score, nested_settings
from ersatz.evaluation.uncertainty import (
    Estimate,
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


@dataclass(frozen=True, slots=True)
class Standing:
    """How one method does.

    Attributes
    ----------
    name, label : str
    ours : bool
        ERSATZ or a variant of it.
    decides : bool
        Whether it accepts by itself; else a threshold was chosen for it by nested selection.
    answers : tuple of Answer
    agreements : tuple of Agreement
        One a scenario each.
    metrics, chance : mapping of metric to Estimate, to float
    p, corrected : mapping of metric to float
        Of the difference to the first method; by itself, and corrected for all methods (Holm).
    """

    name: str
    label: str
    ours: bool
    decides: bool
    answers: tuple[Answer, ...]
    agreements: tuple[Agreement, ...]
    metrics: Mapping[str, Estimate]
    chance: Mapping[str, float | None]
    p: Mapping[str, float] = field(default_factory=dict)
    corrected: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Results:
    """All there is to show.

    Attributes
    ----------
    scenarios : tuple of Scenario
        Those with votes or accepted answers.
    unjudged : int
        Scenarios left out because nothing is known of them.
    standings : tuple of Standing
        ERSATZ first.
    left_out : mapping of method name to the reason
    ceilings : mapping of name to Estimate
    alpha : mapping of name to float or None
    grid : mapping of (theta, phi) to the metrics of ERSATZ
    cells : tuple of Cell
    resamples : tuple of answer lists
        With the objects of every class drawn again.
    misses : tuple of Miss
    chosen : tuple of (theta, phi)
        By nested selection, one a scenario.
    """

    location: str
    revision: str
    scenarios: tuple[Scenario, ...]
    unjudged: int
    standings: tuple[Standing, ...]
    left_out: Mapping[str, str]
    ceilings: Mapping[str, Estimate]
    alpha: Mapping[str, float | None]
    grid: Mapping[tuple[Fraction, Fraction], Mapping[str, float]]
    cells: tuple[Cell, ...]
    resamples: tuple[tuple[Answer, ...], ...]
    misses: tuple[Miss, ...]
    chosen: tuple[tuple[Fraction, Fraction], ...]

    @property
    def first(self) -> Standing:
        """ERSATZ at the paper's settings."""
        return self.standings[0]

    def over_objects(self) -> dict[str, Estimate]:
        """Return ERSATZ's metrics with the interval that drawing the objects again gives."""
        found = {}
        every = [_means(self.scenarios, answers) for answers in self.resamples]
        for metric, known in self.first.metrics.items():
            means = sorted(mean for one in every if (mean := one[metric]) is not None)
            if means:
                low, high = (means[round(q * (len(means) - 1))] for q in (0.025, 0.975))
                found[metric] = Estimate(known.mean, low, high, len(means))
        return found

    def to_json(self) -> dict[str, Any]:
        """Return everything but pictures in JSON's types; the same input gives the same bytes."""
        return {
            "version": 1,
            "revision": self.revision,
            "scenarios_sha256": sha256(
                dumps([s.to_json() for s in self.scenarios], sort_keys=True).encode()
            ).hexdigest(),
            "scenarios": len(self.scenarios),
            "unjudged": self.unjudged,
            "tools": len({s.missing for s in self.scenarios}),
            "methods": [_standing_json(one) for one in self.standings],
            "left_out": dict(sorted(self.left_out.items())),
            "ceilings": {name: one.to_json() for name, one in sorted(self.ceilings.items())},
            "alpha": dict(sorted(self.alpha.items())),
            "over_objects": {m: e.to_json() for m, e in sorted(self.over_objects().items())},
            "grid": [
                {"theta": float(theta), "phi": float(phi), **{m: _six(v) for m, v in metrics.items()}}
                for (theta, phi), metrics in sorted(self.grid.items())
            ],
            "sweeps": [
                {
                    "parameter": c.parameter,
                    "value": c.value,
                    "determined": _six(c.determined),
                    **{m: e.to_json() for m, e in c.metrics.items()},
                }
                for c in self.cells
            ],
            "misses": [miss.to_json() for miss in self.misses],
        }


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
        {metric: _mean([one.chance[metric] for one in agreements]) for metric in METRICS},
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


def _means(scenarios: Sequence[Scenario], answers: Sequence[Answer]) -> dict[str, float | None]:
    """Return the mean of every metric."""
    values = [agree(scenario, answer).value for scenario, answer in zip(scenarios, answers, strict=True)]
    return {metric: _mean([one[metric] for one in values]) for metric in METRICS}


def _grid_metrics(scenarios: Sequence[Scenario], answers: Sequence[Answer]) -> dict[str, float]:
    means = _means(scenarios, answers)
    return {metric: means[metric] or 0.0 for metric in SHOWN}


def _mean(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return sum(known) / len(known) if known else None


def _standing_json(one: Standing) -> dict[str, Any]:
    return {
        "name": one.name,
        "label": one.label,
        "ours": one.ours,
        "decides": one.decides,
        "metrics": {m: e.to_json() for m, e in one.metrics.items()},
        "chance": {m: _six(v) for m, v in one.chance.items()},
        "p": {m: _six(v) for m, v in one.p.items()},
        "p_corrected": {m: _six(v) for m, v in one.corrected.items()},
        "answers": [
            {
                "scenario": agreed.scenario,
                "scores": None if answer.scores is None else [_six(score) for score in answer.scores],
                "accepted": sorted(answer.accepted or ()),
                **{m: _six(v) for m, v in agreed.value.items()},
            }
            for answer, agreed in zip(one.answers, one.agreements, strict=True)
        ],
    }


def _six(value: float | None) -> float | None:
    return None if value is None else round(value, 6) + 0.0
