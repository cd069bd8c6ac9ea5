"""Agreement of a method's answer with the experts' choices, or with the accepted answers, of a scenario.

The paper counts "the same substitutes" without saying what counts as the same; here every reading is a
metric of its own, beside what chance would give. Ties in a ranking are never broken: a metric is its mean
over all orders of what is tied.

Where a metric does not apply it is None and stays out of the means. An answer that is undetermined scores
0, as a robot left without an answer does.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import comb, log2
from typing import Final, TypeVar

from ersatz.evaluation.scenarios import NONE, Scenario

T = TypeVar("T")

METRICS: Final = {
    "top1": "the best-ranked object is the experts' choice (the mode), or an accepted one",
    "mass": "share of votes on the best-ranked object",
    "rr": "1 / rank of the first object that is the mode, or accepted",
    "ndcg": "gain of the whole ranking by vote shares: 1 ideal, 0 chance",
    "precision": "share of what the method accepts that experts chose, or that is accepted",
    "recall": "share of what experts chose, or of what is accepted, that the method accepts",
    "f1": "harmonic mean of precision and recall",
    "tau": "Kendall's tau-b of scores and vote shares",
    "same_top": "the best-ranked object was chosen by some expert",
    "same_mode": "the mode is among what the method accepts",
    "same_any": "something chosen by some expert is among what the method accepts",
}
"""The metrics and what each says; all lie in [0, 1], but ndcg and tau may be negative."""

HEADINGS: Final = {
    "top1": "top-1",
    "mass": "vote mass",
    "rr": "MRR",
    "ndcg": "nDCG above chance",
    "precision": "precision of the set",
    "recall": "recall of the set",
    "f1": "F1 of the set",
    "tau": "Kendall's τ-b",
}
"""What the metrics are called in tables and figures."""


@dataclass(frozen=True, slots=True)
class Answer:
    """What a method says of a scenario.

    Attributes
    ----------
    scores : tuple of float or None
        One for each available object, more is better; None if it is undetermined.
    accepted : frozenset of str or None
        What stands in; None of a method that only ranks.
    """

    scores: tuple[float, ...] | None
    accepted: frozenset[str] | None = None

    def best(self, scenario: Scenario) -> frozenset[str]:
        """Return the best-ranked objects, several if tied, none if it is undetermined."""
        if self.scores is None:
            return frozenset()
        most = max(self.scores)
        return frozenset(n for n, s in zip(scenario.available, self.scores, strict=True) if s == most)


@dataclass(frozen=True, slots=True)
class Agreement:
    """The metrics of one scenario and what chance gives: a random order, as many accepted at random."""

    scenario: str
    value: dict[str, float | None]
    chance: dict[str, float | None]


def agree(scenario: Scenario, answer: Answer) -> Agreement:
    """Compare a method's answer with the experts' choices, or with the accepted answers.

    Raises
    ------
    ValueError
        If nothing is known of the scenario, or the number of scores is not that of its objects.
    """
    if not scenario.judged:
        raise ValueError(f"scenario {scenario.id!r} has neither votes nor accepted answers")
    if answer.scores is not None and len(answer.scores) != len(scenario.available):
        raise ValueError(f"{len(answer.scores)} scores for {len(scenario.available)} objects")
    value, chance = _ranked(scenario, answer), _ranked(scenario, Answer((0.0,) * len(scenario.available)))
    if answer.accepted is None:
        sets = by_chance = dict.fromkeys(("precision", "recall", "f1", "same_mode", "same_any"))
    else:
        sets, by_chance = _sets(scenario, answer.accepted)
    joined, expected = value | sets, chance | by_chance
    return Agreement(scenario.id, {m: joined[m] for m in METRICS}, {m: expected[m] for m in METRICS})


def _ranked(scenario: Scenario, answer: Answer) -> dict[str, float | None]:
    modes, best, shares = scenario.modes(), answer.best(scenario), scenario.shares()
    objects = modes - {NONE}
    rejects = answer.accepted is not None and not answer.accepted and answer.scores is not None
    top = 1.0 if rejects and NONE in modes else len(best & modes) / len(best) if best else 0.0
    share = dict(zip(scenario.available, shares, strict=True))
    chosen = {name for name, part in share.items() if part > 0}
    determined = answer.scores is not None
    return {
        "top1": top,
        "mass": None if not scenario.voters else _mean([share[name] for name in sorted(best)]),
        "rr": None if not objects else _reciprocal(answer, scenario, objects) if determined else 0.0,
        "ndcg": None if not _varied(shares) else _gain(answer.scores, shares) if answer.scores else 0.0,
        "tau": None if not _varied(shares) else kendall_tau(answer.scores, shares) if answer.scores else 0.0,
        "same_top": len(best & chosen) / len(best) if best else 0.0,
    }


def _sets(
    scenario: Scenario, accepted: frozenset[str]
) -> tuple[dict[str, float | None], dict[str, float | None]]:
    truth, n, k = scenario.chosen(), len(scenario.available), len(accepted)
    v, hit = len(truth), len(truth & accepted)
    objects = scenario.modes() - {NONE}
    value = {
        "precision": hit / k if k else float(not v),
        "recall": hit / v if v else float(not k),
        "f1": 2 * hit / (k + v) if k + v else 1.0,
        "same_mode": float(bool(objects & accepted)) if objects else float(not k),
        "same_any": float(bool(hit)) if v else float(not k),
    }
    nothing = float(not k)
    chance = {
        "precision": v / n if k else float(not v),
        "recall": k / n if v else nothing,
        "f1": 2 * k * v / n / (k + v) if k + v else 1.0,
        "same_mode": _overlap(n, k, len(objects)) if objects else nothing,
        "same_any": _overlap(n, k, v) if v else nothing,
    }
    return dict(value), dict(chance)


def _overlap(n: int, k: int, v: int) -> float:
    """Return the chance that k of n drawn at random hold at least one of v."""
    return 1 - comb(n - v, k) / comb(n, k)


def _reciprocal(answer: Answer, scenario: Scenario, wanted: frozenset[str]) -> float:
    """Return the mean of 1 / rank of the first wanted object over all orders of what is tied."""
    before = 0
    for group in _groups(answer.scores or (), scenario.available):
        n, r = len(group), len(wanted & set(group))
        if r:
            return sum(comb(n - k, r - 1) / comb(n, r) / (before + k) for k in range(1, n - r + 2))
        before += n
    raise AssertionError("nothing wanted is available")


def _gain(scores: Sequence[float], shares: Sequence[float]) -> float:
    """Return nDCG of the ranking, corrected so that a random order gives 0 and the ideal 1."""
    discounts = [1 / log2(rank + 1) for rank in range(1, len(shares) + 1)]
    ideal = sum(d * s for d, s in zip(discounts, sorted(shares, reverse=True), strict=True))
    random = _mean(shares) * sum(discounts) / ideal
    gained, at = 0.0, 0
    for group in _groups(scores, shares):
        gained += _mean(group) * sum(discounts[at : at + len(group)])
        at += len(group)
    return (gained / ideal - random) / (1 - random)


def kendall_tau(a: Sequence[float], b: Sequence[float]) -> float:
    """Return Kendall's tau-b of two lists; 0 where one of them is all tied."""
    pairs = [(i, j) for i in range(len(a)) for j in range(i)]
    x = [(a[i] > a[j]) - (a[i] < a[j]) for i, j in pairs]
    y = [(b[i] > b[j]) - (b[i] < b[j]) for i, j in pairs]
    both = sum(map(abs, x)) * sum(map(abs, y))
    return float(sum(p * q for p, q in zip(x, y, strict=True)) / both**0.5) if both else 0.0


def _groups(scores: Sequence[float], things: Sequence[T]) -> list[list[T]]:
    """Return the things in groups of equal score, best first."""
    return [
        [thing for thing, score in zip(things, scores, strict=True) if score == level]
        for level in sorted(set(scores), reverse=True)
    ]


def _varied(shares: Sequence[float]) -> bool:
    return max(shares) > min(shares)


def _mean(values: Sequence[float]) -> float:
    return sum(values) / len(values) if values else 0.0
