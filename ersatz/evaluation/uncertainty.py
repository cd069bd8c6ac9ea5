"""How sure a figure is: intervals, paired tests, agreement among experts, their ceiling."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ersatz.evaluation.agreement import Answer, agree
from ersatz.evaluation.scenarios import NONE, Scenario


@dataclass(frozen=True, slots=True)
class Estimate:
    """A mean and the interval it lies in with 95 % confidence; None where nothing was measured."""

    mean: float | None
    low: float | None
    high: float | None
    count: int

    def to_json(self) -> dict[str, float | int | None]:
        """Return it in JSON's types, rounded so that it is the same on every machine."""
        return {
            "mean": six_digits(self.mean),
            "low": six_digits(self.low),
            "high": six_digits(self.high),
            "count": self.count,
        }


def estimate(
    values: Sequence[float | None], groups: Sequence[str], draws: int = 2000, seed: int = 0
) -> Estimate:
    """Return the mean over scenarios with its bootstrap interval (percentiles).

    Scenarios of one missing tool are not independent: whole groups are drawn, never single scenarios.

    Parameters
    ----------
    values : one number a scenario, or None where the metric does not apply
    groups : the missing tool of each
    draws, seed : int
    """
    sums, counts = _by_group(values, groups)
    if not counts.sum():
        return Estimate(None, None, None, 0)
    drawn = np.random.default_rng(seed).integers(len(sums), size=(draws, len(sums)))
    known = counts[drawn].sum(axis=1)
    means = sums[drawn].sum(axis=1)[known > 0] / known[known > 0]
    low, high = np.quantile(means, (0.025, 0.975))
    return Estimate(float(sums.sum() / counts.sum()), float(low), float(high), int(counts.sum()))


def paired_test(
    a: Sequence[float | None],
    b: Sequence[float | None],
    groups: Sequence[str],
    draws: int = 9999,
    seed: int = 0,
) -> float:
    """Return the two-sided p of a sign-flip permutation test of the paired differences a - b.

    The unit is the missing tool, whose scenarios' differences are averaged; 1 where none differs.
    """
    pairs = [None if x is None or y is None else x - y for x, y in zip(a, b, strict=True)]
    sums, counts = _by_group(pairs, groups)
    differences = sums[counts > 0] / counts[counts > 0]
    if not differences.any():
        return 1.0
    signs = np.random.default_rng(seed).choice((-1.0, 1.0), (draws, len(differences)))
    observed = abs(differences.sum()) - 1e-12
    return float((1 + (abs(signs @ differences) >= observed).sum()) / (1 + draws))


def holm(p_values: Mapping[str, float]) -> dict[str, float]:
    """Return p-values corrected for many tests (Holm 1979), in the order given."""
    ordered = sorted(p_values, key=lambda name: (p_values[name], name))
    corrected, most = {}, 0.0
    for at, name in enumerate(ordered):
        most = max(most, min(1.0, p_values[name] * (len(ordered) - at)))
        corrected[name] = most
    return {name: corrected[name] for name in p_values}


def krippendorff_alpha(ratings: Sequence[Sequence[str | None]]) -> float | None:
    """Return Krippendorff's alpha for nominal data (Krippendorff 2011, Computing Krippendorff's Alpha).

    Parameters
    ----------
    ratings : one sequence a unit, with the values its raters gave (None: did not rate)

    Returns
    -------
    float or None
        1 full agreement, 0 chance; None with fewer than two values that can be paired, or all the same.
    """
    units = [[value for value in unit if value is not None] for unit in ratings]
    units = [unit for unit in units if len(unit) > 1]
    totals = Counter(value for unit in units for value in unit)
    n = sum(totals.values())
    expected = n * n - sum(count * count for count in totals.values())
    if not expected:
        return None
    observed = sum(
        (len(unit) ** 2 - sum(c * c for c in Counter(unit).values())) / (len(unit) - 1) for unit in units
    )
    return 1 - (n - 1) * observed / expected


def experts_alpha(scenarios: Sequence[Scenario]) -> dict[str, float | None]:
    """Return alpha of the experts' choices, and of choosing each object or not.

    The first takes every choice as a name; as few objects are offered each time, chance agreement is
    small and alpha high. The second asks of each object offered whether it was chosen: the stricter view.
    """
    choices = [[s.ballots[e] for e in sorted(s.ballots)] for s in scenarios]
    objects = [
        [str(s.ballots[e] == name) for e in sorted(s.ballots)] for s in scenarios for name in s.available
    ]
    return {
        "choices": six_digits(krippendorff_alpha(choices)),
        "objects": six_digits(krippendorff_alpha(objects)),
    }


def leave_one_out(scenarios: Sequence[Scenario]) -> dict[str, Estimate]:
    """Return how well one expert agrees with the mode of the others: what a method can hope for."""
    top: list[float | None] = []
    mass: list[float | None] = []
    groups = []
    for scenario in scenarios:
        for expert, choice in sorted(scenario.ballots.items()):
            others = Counter(c for e, c in scenario.ballots.items() if e != expert)
            if others:
                most = max(others.values())
                modes = [name for name, count in others.items() if count == most]
                top.append((choice in modes) / len(modes))
                mass.append(others[choice] / others.total())
                groups.append(scenario.missing)
    return {"top1": estimate(top, groups), "mass": estimate(mass, groups)}


def blind_ceiling(scenarios: Sequence[Scenario]) -> Estimate:
    """Return top-1 of one ranking a tool made from the answers themselves: who knows all but the task."""
    gains: dict[tuple[str, str], list[float]] = {}
    for scenario in scenarios:
        for name, share in zip(scenario.available, scenario.shares(), strict=True):
            gains.setdefault((scenario.missing, name), []).append(share)
    values: list[float | None] = []
    for scenario in scenarios:
        known = [gains[scenario.missing, name] for name in scenario.available]
        scores = tuple(sum(one) / len(one) for one in known)
        nothing = scenario.modes() == {NONE}
        values.append(agree(scenario, Answer(scores, frozenset() if nothing else None)).value["top1"])
    return estimate(values, [scenario.missing for scenario in scenarios])


def _by_group(
    values: Sequence[float | None], groups: Sequence[str]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return (g,) sums and (g,) counts of the values of each group, in the order of their names."""
    row = {name: at for at, name in enumerate(sorted(set(groups)))}
    sums, counts = np.zeros(len(row)), np.zeros(len(row), dtype=np.int64)
    for value, group in zip(values, groups, strict=True):
        if value is not None:
            sums[row[group]] += value
            counts[row[group]] += 1
    return sums, counts


def six_digits(value: float | None) -> float | None:
    """Return a number as it is printed: with six fraction digits, and never as minus zero."""
    return None if value is None else round(value, 6) + 0.0
