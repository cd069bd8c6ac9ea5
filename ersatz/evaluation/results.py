"""Results of the experiment: how each method does, and what hangs on what."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from hashlib import sha256
from json import dumps
from typing import Any

from ersatz.evaluation.agreement import METRICS, Agreement, Answer, agree
from ersatz.evaluation.analysis import Miss
from ersatz.evaluation.scenarios import Scenario
from ersatz.evaluation.sweeps import Cell
from ersatz.evaluation.uncertainty import Estimate, six_digits


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
        every = [means_of(self.scenarios, answers) for answers in self.resamples]
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
                {"theta": float(theta), "phi": float(phi), **{m: six_digits(v) for m, v in metrics.items()}}
                for (theta, phi), metrics in sorted(self.grid.items())
            ],
            "sweeps": [
                {
                    "parameter": c.parameter,
                    "value": c.value,
                    "determined": six_digits(c.determined),
                    **{m: e.to_json() for m, e in c.metrics.items()},
                }
                for c in self.cells
            ],
            "misses": [miss.to_json() for miss in self.misses],
        }


def means_of(scenarios: Sequence[Scenario], answers: Sequence[Answer]) -> dict[str, float | None]:
    """Return the mean of every metric."""
    values = [agree(scenario, answer).value for scenario, answer in zip(scenarios, answers, strict=True)]
    return {metric: mean_of([one[metric] for one in values]) for metric in METRICS}


def mean_of(values: Sequence[float | None]) -> float | None:
    """Return the mean of the values that are known; None if none is."""
    known = [value for value in values if value is not None]
    return sum(known) / len(known) if known else None


def _standing_json(one: Standing) -> dict[str, Any]:
    return {
        "name": one.name,
        "label": one.label,
        "ours": one.ours,
        "decides": one.decides,
        "metrics": {m: e.to_json() for m, e in one.metrics.items()},
        "chance": {m: six_digits(v) for m, v in one.chance.items()},
        "p": {m: six_digits(v) for m, v in one.p.items()},
        "p_corrected": {m: six_digits(v) for m, v in one.corrected.items()},
        "answers": [
            {
                "scenario": agreed.scenario,
                "scores": None if answer.scores is None else [six_digits(score) for score in answer.scores],
                "accepted": sorted(answer.accepted or ()),
                **{m: six_digits(v) for m, v in agreed.value.items()},
            }
            for answer, agreed in zip(one.answers, one.agreements, strict=True)
        ],
    }
