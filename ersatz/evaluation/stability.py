"""Stability: what is left of the answers when the objects of every class are drawn again.

Every class is asked for as the missing tool, all others are candidates. Stability alone is cheap, for a
constant is stable: beside it stands how well the same variant agrees with scenarios.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ersatz.evaluation.agreement import Answer, agree, kendall_tau
from ersatz.evaluation.regrounding import Objects, learn, reground, similarities
from ersatz.evaluation.scenarios import Scenario
from ersatz.grounding.subcategorization import USUAL_FUZZIFIER, Qualities, SubcategorizationSettings
from ersatz.reasoner.relevance import ReasonerSettings, Spacing
from ersatz.reasoner.similarity import Similarity

SAME: Final = 1e-9
"""Similarities nearer than this are tied."""


@dataclass(frozen=True, slots=True)
class Variant:
    """A way to ground and to reason.

    Attributes
    ----------
    label : str
    settings : ReasonerSettings
    fuzzifier : float
        1 is crisp grounding.
    clusters : int
        Qualities a property.
    """

    label: str
    settings: ReasonerSettings
    fuzzifier: float = 1.0
    clusters: int = 4

    def grounding(self, restarts: int) -> SubcategorizationSettings:
        """Return how values become qualities."""
        return SubcategorizationSettings(self.clusters, restarts, fuzzifier=self.fuzzifier)


_RUZICKA: Final = ReasonerSettings(graded=True, similarity=Similarity.RUZICKA)
_ORDINAL: Final = ReasonerSettings(graded=True)
_SPACED: Final = ReasonerSettings(graded=True, spacing=Spacing.CENTROID)
_BY_RATIO: Final = ReasonerSettings(graded=True, spacing=Spacing.RATIO)

VARIANTS: Final = (
    Variant("k-means, the paper's rule", ReasonerSettings()),
    Variant("k-means, graded, Ruzicka", _RUZICKA),
    Variant("k-means, graded, ordinal", _ORDINAL),
    Variant("k-means, graded, ordinal, spaced by centroids", _SPACED),
    Variant("fuzzy, graded, Ruzicka", _RUZICKA, USUAL_FUZZIFIER),
    Variant("fuzzy, graded, ordinal", _ORDINAL, USUAL_FUZZIFIER),
    Variant("fuzzy, graded, ordinal, spaced by centroids", _SPACED, USUAL_FUZZIFIER),
    Variant("k-means, 8 qualities, graded, ordinal", _ORDINAL, clusters=8),
    Variant("k-means, 8 qualities, graded, ordinal, spaced by centroids", _SPACED, clusters=8),
    Variant("fuzzy, 8 qualities, graded, ordinal", _ORDINAL, USUAL_FUZZIFIER, 8),
    Variant("fuzzy, 8 qualities, graded, ordinal, spaced by centroids", _SPACED, USUAL_FUZZIFIER, 8),
    Variant("fuzzy, 8 qualities, graded, ordinal, spaced by ratios", _BY_RATIO, USUAL_FUZZIFIER, 8),
    Variant("fuzzy, 20 qualities, graded, ordinal, spaced by centroids", _SPACED, USUAL_FUZZIFIER, 20),
    Variant("fuzzy, 20 qualities, graded, ordinal, spaced by ratios", _BY_RATIO, USUAL_FUZZIFIER, 20),
)


@dataclass(frozen=True, slots=True)
class Stability:
    """How much of a variant's answers stays.

    Attributes
    ----------
    label : str
    top1 : float in [0, 1]
        How often the best candidate is the same; of tied ones any is taken.
    tau : float in [-1, 1]
        Mean of Kendall's tau-b of the rankings.
    ties : float in [0, 1]
        Share of answers whose first place is shared.
    refitted_top1, refitted_tau, refitted_ties : float or None
        The same with the qualities found anew in each resample, too.
    agreement : float in [0, 1] or None
        Top-1 on scenarios, with all objects of another knowledge base.
    """

    label: str
    top1: float
    tau: float
    ties: float
    refitted_top1: float | None = None
    refitted_tau: float | None = None
    refitted_ties: float | None = None
    agreement: float | None = None

    def to_json(self) -> dict[str, Any]:
        """Return it in JSON's types."""
        numbers = {name: getattr(self, name) for name in self.__slots__[1:]}
        return {"variant": self.label} | {
            name: None if one is None else round(one, 6) for name, one in numbers.items()
        }


def stability(
    objects: Objects,
    variants: Sequence[Variant] = VARIANTS,
    resamples: int = 100,
    refits: int = 100,
    restarts: int = 3,
    progress: Callable[[str, float], None] = lambda _stage, _share: None,
    times: int = 1,
) -> tuple[Stability, ...]:
    """Draw the objects again many times and compare every variant's rankings with those of all objects.

    Parameters
    ----------
    objects : Objects
    variants : sequence of Variant
    resamples : int
    refits : int
        In so many of them the qualities are found anew, too, perhaps in none: the slower part.
    restarts : int
        Starts of k-means in several dimensions.
    progress : callable
    times : int
        Draw so many times as many objects: what would stay if more were known.
    """
    cutting = {one: one.grounding(restarts) for one in variants}
    fixed = {settings: learn(objects, settings) for settings in dict.fromkeys(cutting.values())}
    full = _scores(objects, cutting, fixed)
    rows: dict[tuple[Variant, bool], list[tuple[float, ...]]] = {}
    for seed in range(resamples):
        progress("objects drawn again", seed / resamples)
        again = objects.resampled(seed, times)
        for refitted in (False, True)[: 1 + (seed < refits)]:
            cuts = {settings: learn(again, settings) for settings in fixed} if refitted else fixed
            for one, scores in _scores(again, cutting, cuts).items():
                rows.setdefault((one, refitted), []).append(_compare(full[one], scores))
    means = {key: np.mean(each, axis=0).tolist() for key, each in rows.items()}
    return tuple(Stability(one.label, *means[one, False], *means.get((one, True), ())) for one in variants)


def _scores(
    objects: Objects,
    cutting: Mapping[Variant, SubcategorizationSettings],
    cuts: Mapping[SubcategorizationSettings, tuple[Qualities, ...]],
) -> dict[Variant, NDArray[np.float64]]:
    """Return the similarities by each variant."""
    known = {settings: reground(objects, qualities) for settings, qualities in cuts.items()}
    return {one: similarities(known[settings], one.settings) for one, settings in cutting.items()}


def with_agreement(
    found: Sequence[Stability],
    variants: Sequence[Variant],
    objects: Objects,
    scenarios: Sequence[Scenario],
    restarts: int = 200,
) -> tuple[Stability, ...]:
    """Add how well each variant, with all objects of a knowledge base, agrees with the scenarios."""
    cutting = {one: one.grounding(restarts) for one in variants}
    cuts = {settings: learn(objects, settings) for settings in dict.fromkeys(cutting.values())}
    agreed = []
    for scores in _scores(objects, cutting, cuts).values():
        values = [agree(s, _answer(scores, objects, s)).value["top1"] or 0.0 for s in scenarios]
        agreed.append(sum(values) / len(values))
    return tuple(replace(one, agreement=mean) for one, mean in zip(found, agreed, strict=True))


def markdown(found: Sequence[Stability]) -> str:
    """Return the table in Markdown."""
    lines = [
        "| variant | same top-1 | Kendall τ | ties | same top-1, refitted | Kendall τ, refitted | ties, "
        "refitted | top-1 on the benchmark |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for one in found:
        numbers = [getattr(one, name) for name in Stability.__slots__[1:]]
        cells = ["" if number is None else f"{number:.2f}" for number in numbers]
        lines.append(f"| {one.label} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def _compare(full: NDArray[np.float64], again: NDArray[np.float64]) -> tuple[float, float, float]:
    """Return the mean over tools of: the same best candidate, tau-b, a shared first place."""
    rows = []
    for tool in range(len(full)):
        before, after = (np.round(np.delete(one[tool], tool) / SAME) for one in (full, again))
        best, still = before == before.max(), after == after.max()
        kept = (best & still).sum() / (best.sum() * still.sum())
        rows.append((kept, kendall_tau(before.tolist(), after.tolist()), still.sum() > 1))
    top1, tau, ties = np.mean(rows, axis=0).tolist()
    return top1, tau, ties


def _answer(scores: NDArray[np.float64], objects: Objects, scenario: Scenario) -> Answer:
    row = {name: at for at, name in enumerate(objects.classes)}
    found = scores[row[scenario.missing], [row[name] for name in scenario.available]]
    everything = np.delete(scores[row[scenario.missing]], row[scenario.missing])
    return Answer(tuple(np.round(found, 9).tolist()) if everything.any() else None)
