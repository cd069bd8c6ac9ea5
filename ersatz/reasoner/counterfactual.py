"""Counterfactual: the smallest change of a threshold or of qualities that would turn a decision."""

from bisect import bisect_left
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ersatz.reasoner.graded import ONE
from ersatz.reasoner.quantised import Grades
from ersatz.reasoner.relevance import Demand, ReasonerSettings, Relevance, in_use, relevant_sets
from ersatz.reasoner.representative import Knowledge, Memberships, pack
from ersatz.reasoner.similarity import above, compare


@dataclass(frozen=True, slots=True, eq=False)
class Graded:
    """The degrees behind a comparison.

    Attributes
    ----------
    wanted : Demand
        Of the tool.
    held : Grades
        Of the candidate alone.
    """

    wanted: Demand
    held: Grades


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """One candidate beside the missing tool.

    Attributes
    ----------
    knowledge : Knowledge
    settings : ReasonerSettings
    tool : int
        Row of the missing tool's class.
    relevance : Relevance
    candidate : (q,) bool array
        The candidate's typical (or held) physical qualities.
    row : int
        Row of the candidate's class; -1 for an instance.
    memo : list of Steps
        Room for the tool's steps, worked out once for all its candidates.
    graded : Graded or None
        What graded reasoning compares.
    """

    knowledge: Knowledge
    settings: ReasonerSettings
    tool: int
    relevance: Relevance
    candidate: NDArray[np.bool_]
    row: int
    memo: "list[Steps]"
    graded: Graded | None = None

    @property
    def relevant(self) -> NDArray[np.bool_]:
        """O_P' of the tool."""
        return self.relevance.physical

    def weight(self, at: int) -> float | None:
        """Return how relevant a quality is, in [0, 1]; None where reasoning is crisp."""
        return None if self.graded is None else float(self.graded.wanted.weights.qualities[at]) / ONE


@dataclass(frozen=True, slots=True)
class Counterfactual:
    """The smallest changes that would turn the decision, each on its own.

    Attributes
    ----------
    tolerance : Fraction or None
        An accepted candidate is refused from this tolerance on; a refused one is accepted below it.
        None if no tolerance would do.
    representative : tuple or None
        ("at most" or "above", threshold): the nearest representative threshold that would.
    gain, lose : tuples of quality names
        The fewest qualities the candidate would have to have, and not to have, besides.
    """

    tolerance: Fraction | None
    representative: tuple[str, Fraction] | None
    gain: tuple[str, ...]
    lose: tuple[str, ...]

    def to_json(self) -> dict[str, Any]:
        """Return it in JSON's types."""
        threshold = self.representative
        return {
            "tolerance": None if self.tolerance is None else str(self.tolerance),
            "representative": None if threshold is None else [threshold[0], str(threshold[1])],
            "gain": list(self.gain),
            "lose": list(self.lose),
        }


@dataclass(frozen=True, slots=True, eq=False)
class Steps:
    """What is relevant in a tool at every representative threshold where that can change.

    Attributes
    ----------
    thresholds : tuple of t Fraction, ascending
        Every proportion of the tool and of the functions, and 1.
    physical : (t, q) bool array
        O_P' at each; between two of them it is as at the higher one.
    determined : (t,) bool array
    """

    thresholds: tuple[Fraction, ...]
    physical: NDArray[np.bool_]
    determined: NDArray[np.bool_]


def counterfactual(comparison: Comparison, similarity: Fraction, *, accepted: bool) -> Counterfactual:
    """Return the smallest changes of threshold or qualities that would turn the decision.

    Graded reasoning has no representative threshold, and a quality is not had or lacked: there, only the
    tolerance is named.
    """
    if comparison.graded is not None:
        reachable = comparison.relevance.determined and (accepted or similarity > 0)
        return Counterfactual(similarity if reachable else None, None, (), ())
    if not comparison.relevance.determined:
        return Counterfactual(None, _nearest_theta(comparison, accepted=accepted), (), ())
    gain, lose = _fewest_qualities(comparison, accepted=accepted)
    tolerance = similarity if accepted or similarity > 0 else None
    return Counterfactual(tolerance, _nearest_theta(comparison, accepted=accepted), gain, lose)


def _fewest_qualities(comparison: Comparison, *, accepted: bool) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the fewest qualities to gain and to lose.

    Which ones: those whose observed share is nearest to the representative threshold. An accepted
    candidate turns by losing shared ones; a refused one by gaining lacking ones and losing others.
    """
    relevant, held = comparison.relevant, comparison.candidate
    share = _shares(comparison)
    order = np.argsort(-share, kind="stable")
    lacking = [int(at) for at in order if relevant[at] and not held[at]]
    losable = [int(at) for at in order[::-1] if held[at] and relevant[at] == accepted]
    options = (
        (gain, lose)
        for size in range(1, len(lacking) + len(losable) + 1)
        for gain in (range(1) if accepted else range(min(size, len(lacking)), -1, -1))
        if (lose := size - gain) <= len(losable)
    )
    for gain, lose in options:
        changed = held.copy()
        changed[lacking[:gain]], changed[losable[:lose]] = True, False
        if _accepts(relevant, changed, comparison.settings) != accepted:
            names = comparison.knowledge.qualities
            return (
                tuple(names[at].name for at in lacking[:gain]),
                tuple(names[at].name for at in losable[:lose]),
            )
    return (), ()


def _nearest_theta(comparison: Comparison, *, accepted: bool) -> tuple[str, Fraction] | None:
    """Return the nearest representative threshold at which the decision is the other one.

    Unknown where not the degrees but their posteriors are compared with it.

    A decision can only change where the threshold crosses an observed proportion, so only those of the
    tool, the candidate and the functions are tried; above one of them, it is as at the next.
    """
    if comparison.settings.certainty is not None:
        return None
    if not comparison.memo:
        comparison.memo.append(_steps(comparison))
    theta, tool = comparison.settings.representative, comparison.memo[0]
    own = _proportions(comparison.knowledge.classes, comparison.row) if comparison.row >= 0 else ()
    steps = sorted({*tool.thresholds, *own}, key=float)
    turned = np.flatnonzero(_decisions(comparison, tool, steps) != accepted).tolist()
    here = bisect_left(
        steps, float(theta), key=float
    )  # what holds at theta holds at steps[here], the first that is not below
    lower = max((at for at in turned if at < here), default=None)
    upper = min((at for at in turned if at > here), default=None)
    found = []
    if lower is not None:
        found.append((theta - steps[lower], "at most", steps[lower]))
    if upper is not None:
        found.append((steps[upper - 1] - theta, "above", steps[upper - 1]))
    return min(found)[1:] if found else None


def _steps(comparison: Comparison) -> Steps:
    """Work out what is relevant in the tool at each threshold; the formulas are those of `relevance`."""
    known, settings = comparison.knowledge, comparison.settings
    everywhere = (_proportions(known.functions, row) for row in range(len(known.functions.iris)))
    own = _proportions(known.classes, comparison.tool)
    thresholds = sorted({Fraction(1), *own, *(one for row in everywhere for one in row)}, key=float)
    physical, functional = in_use(known, settings)
    tool = known.classes.only([comparison.tool])
    mine = tool.representative_at(thresholds)[:, 0]
    goes = known.functions.representative_at(thresholds)
    joined, determined = relevant_sets(mine, goes, known.columns, physical, functional, settings)
    return Steps(tuple(thresholds), joined, determined)


def _decisions(comparison: Comparison, tool: Steps, steps: Sequence[Fraction]) -> NDArray[np.bool_]:
    """Return (s,): whether the candidate would be accepted at each of the ascending thresholds."""
    at = np.searchsorted(np.array(tool.thresholds, dtype=np.float64), np.array(steps, dtype=np.float64))
    relevant = tool.physical[at]
    held = np.broadcast_to(comparison.candidate, relevant.shape)
    if comparison.row >= 0:
        own = comparison.knowledge.classes.only([comparison.row])
        physical, _ = in_use(comparison.knowledge, comparison.settings)
        held = own.representative_at(steps)[:, 0] & physical
    numerators, denominators = compare(pack(relevant), pack(held), comparison.settings.similarity)
    return tool.determined[at] & above(numerators, denominators, comparison.settings.tolerance)


def _accepts(relevant: NDArray[np.bool_], held: NDArray[np.bool_], settings: ReasonerSettings) -> bool:
    numerators, denominators = compare(pack(relevant), pack(held[None]), settings.similarity)
    return bool(above(numerators, denominators, settings.tolerance)[0])


def _proportions(table: Memberships, row: int) -> Iterator[Fraction]:
    seen = np.flatnonzero(table.counts[row])
    for count, total in zip(table.counts[row, seen].tolist(), table.totals[row, seen].tolist(), strict=True):
        yield Fraction(count, total)


def _shares(comparison: Comparison) -> NDArray[np.float64]:
    if comparison.row < 0:
        return comparison.candidate.astype(np.float64)
    counts = comparison.knowledge.classes.counts[comparison.row]
    share: NDArray[np.float64] = counts / np.maximum(comparison.knowledge.classes.totals[comparison.row], 1)
    return share
