"""Sweeps and ablations: how much the answer hangs on each choice. One tidy table."""

import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import chain
from typing import Final, TypeAlias

from ersatz.errors import ErsatzWarning
from ersatz.evaluation.agreement import Answer, agree
from ersatz.evaluation.methods import Ersatz
from ersatz.evaluation.resampling import Grounder, Value, read_values, resampled, to_blocks
from ersatz.evaluation.scenarios import Scenario
from ersatz.evaluation.uncertainty import Estimate, estimate
from ersatz.knowledge.base import KnowledgeBase
from ersatz.measurements import Block, Kind
from ersatz.reasoner.relevance import Combine, ReasonerSettings
from ersatz.reasoner.similarity import CRISP

Progress: TypeAlias = Callable[[str, float], None]

THRESHOLDS: Final = tuple(Fraction(at, 20) for at in (2, 4, 5, 6, 7, 8, 10, 12, 14, 16))
"""Of theta and phi; 7/20 is the paper's."""

GRID: Final = tuple(Fraction(at, 10) for at in range(2, 9))
"""Of their joint grid, beside the paper's."""

CLUSTERS: Final = (2, 3, 4, 5, 6, 8)
SEEDS: Final = tuple(range(5))
SHOWN: Final = ("top1", "ndcg", "f1")
"""Metrics in the table."""


@dataclass(frozen=True, slots=True)
class Cell:
    """One setting of one parameter, and how it does.

    Attributes
    ----------
    parameter, value : str
    metrics : mapping of metric to its Estimate
    determined : float, in [0, 1]
        Share of scenarios with an answer.
    """

    parameter: str
    value: str
    metrics: dict[str, Estimate]
    determined: float


def thresholds_grid() -> tuple[Fraction, ...]:
    """Return the thresholds of the joint grid, ascending; the paper's among them."""
    return tuple(sorted({*GRID, Fraction(7, 20)}))


def answers_on_grid(
    kb: KnowledgeBase, scenarios: Sequence[Scenario], progress: Progress
) -> dict[tuple[Fraction, Fraction], list[Answer]]:
    """Return ERSATZ's answers for every pair of theta and phi (one phi, as in the paper)."""
    levels = thresholds_grid()
    found = {}
    for theta in levels:
        progress("theta and phi", levels.index(theta) / len(levels))
        for phi in levels:
            method = Ersatz(kb, _paper(representative=theta, tolerance=phi, relevance_tolerance=phi))
            found[theta, phi] = [method.answer(scenario) for scenario in scenarios]
    return found


def sweep_reasoner(kb: KnowledgeBase, scenarios: Sequence[Scenario], progress: Progress) -> list[Cell]:
    """Change one setting of the reasoner at a time."""
    cells = list(_reasoner_settings(kb))
    found = []
    for at, (parameter, value, settings) in enumerate(cells):
        progress(f"sweep of {parameter}", at / len(cells))
        found.append(_cell(parameter, value, scenarios, Ersatz(kb, settings)))
    return found


def sweep_grounding(
    kb: KnowledgeBase, scenarios: Sequence[Scenario], ground: Grounder, progress: Progress, workers: int = 1
) -> list[Cell]:
    """Change eta, the seed or the origin of values, and ground the knowledge base again for each."""
    jobs = list(_groundings(kb))
    blocks = [job[2] for job in jobs]
    found = []
    settings = [(clusters, seed) for _, _, _, clusters, seed in jobs]
    results = _each(_ground_and_answer, ground, blocks, settings, scenarios, workers)
    for at, ((parameter, value, *_), answers) in enumerate(zip(jobs, results, strict=True)):
        progress(f"sweep of {parameter}", at / len(jobs))
        found.append(_summary(parameter, value, scenarios, answers))
    return found


def over_objects(
    kb: KnowledgeBase,
    scenarios: Sequence[Scenario],
    ground: Grounder,
    progress: Progress,
    resamples: int = 20,
    workers: int = 1,
) -> list[list[Answer]]:
    """Return ERSATZ's answers with the objects of every class drawn again, one list a resample."""
    values, properties = read_values(kb)
    clusters = _clusters(kb)
    blocks = [to_blocks(resampled(values, seed), properties) for seed in range(resamples)]
    settings = [(clusters, 0)] * resamples
    found = []
    for at, answers in enumerate(_each(_ground_and_answer, ground, blocks, settings, scenarios, workers)):
        progress("objects drawn again", at / resamples)
        found.append(answers)
    return found


def _reasoner_settings(kb: KnowledgeBase) -> Iterator[tuple[str, str, ReasonerSettings]]:
    for level in THRESHOLDS:
        text = f"{float(level):g}"
        yield "theta", text, _paper(representative=level)
        yield "phi of substitutes", text, _paper(tolerance=level)
        yield "phi of relevance", text, _paper(relevance_tolerance=level)
    for combine in Combine:
        yield "functions", str(combine), _paper(combine=combine)
    for similarity in CRISP:
        yield "similarity", str(similarity), _paper(similarity=similarity)
    for yes in (False, True):
        yield "lowest qualities are functions", "no" if yes else "yes", _paper(above_lowest=yes)
        yield "fallback", "yes" if yes else "no", _paper(fallback=yes)
    names = sorted(kb.known_names("property"))
    yield "left out", "nothing", _paper()
    for name in names:
        yield "left out", name, _paper(properties=tuple(one for one in names if one != name))
    shapes = [name for name in names if name.startswith("shape_")]
    for count in range(len(shapes) + 1) if shapes else ():
        kept = tuple(name for name in names if name not in shapes[count:])
        yield "shape concepts", str(count), _paper(properties=kept)


def _groundings(kb: KnowledgeBase) -> Iterator[tuple[str, str, list[Block], int, int]]:
    """Yield parameter, value, blocks, clusters and seed."""
    values, properties = read_values(kb)
    clusters, everything = _clusters(kb), to_blocks(values, properties)
    for eta in CLUSTERS:
        yield "eta", str(eta), everything, eta, 0
    for seed in SEEDS:
        yield "seed", str(seed), everything, clusters, seed
    functional = {name for name, one in properties.items() if one.kind is Kind.FUNCTIONAL}
    if len({value.origin for value in values}) > 1:
        yield "origin", "all", everything, clusters, 0
        for origin in sorted({value.origin for value in values}):
            kept = [value for value in values if value.origin is origin]
            if {value.property for value in kept} & functional and _physical(kept, functional):
                yield "origin", f"{origin} only", to_blocks(kept, properties), clusters, 0


def _physical(values: Iterable[Value], functional: set[str]) -> bool:
    return any(value.property not in functional for value in values)


def _clusters(kb: KnowledgeBase) -> int:
    """Return the largest number of qualities of a property."""
    names = [str(row["property"]) for row in kb.ask("qualities")]
    return max(names.count(name) for name in set(names))


def _each(
    work: Callable[[Grounder, list[Block], tuple[int, int], Sequence[Scenario]], list[Answer]],
    ground: Grounder,
    blocks: Sequence[list[Block]],
    settings: Sequence[tuple[int, int]],
    scenarios: Sequence[Scenario],
    workers: int,
) -> Iterator[list[Answer]]:
    """Yield the results in order, from this process or from several."""
    count = len(blocks)
    arguments = ([ground] * count, blocks, settings, [scenarios] * count)
    if workers <= 1:
        yield from map(work, *arguments)
    else:
        with ProcessPoolExecutor(workers) as pool:
            yield from pool.map(work, *arguments)


def _ground_and_answer(
    ground: Grounder, blocks: list[Block], settings: tuple[int, int], scenarios: Sequence[Scenario]
) -> list[Answer]:
    """Ground and answer; a class that lost all its values leaves its scenarios undetermined."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ErsatzWarning)  # fewer values than qualities: part of the sweep
        kb = ground(blocks, *settings)
    known = set(kb.known_names("class"))
    method = Ersatz(kb)
    return [
        method.answer(scenario)
        if {scenario.missing, *scenario.available} <= known
        else Answer(None, frozenset())
        for scenario in scenarios
    ]


def _cell(parameter: str, value: str, scenarios: Sequence[Scenario], method: Ersatz) -> Cell:
    return _summary(parameter, value, scenarios, [method.answer(scenario) for scenario in scenarios])


def _summary(parameter: str, value: str, scenarios: Sequence[Scenario], answers: Sequence[Answer]) -> Cell:
    agreed = [agree(scenario, answer) for scenario, answer in zip(scenarios, answers, strict=True)]
    tools = [scenario.missing for scenario in scenarios]
    return Cell(
        parameter,
        value,
        {metric: estimate([one.value[metric] for one in agreed], tools, draws=500) for metric in SHOWN},
        sum(answer.scores is not None for answer in answers) / len(answers),
    )


def _paper(**changed: object) -> ReasonerSettings:
    return replace(ReasonerSettings(), **changed)  # type: ignore[arg-type]


def tidy(cells: Iterable[Cell]) -> list[list[str]]:
    """Return the table: one row a parameter, value and metric, after its header."""
    rows = (
        [c.parameter, c.value, metric, *_numbers(e), f"{c.determined:.4f}"]
        for c in cells
        for metric, e in c.metrics.items()
    )
    return list(chain([["parameter", "value", "metric", "mean", "low", "high", "determined"]], rows))


def _numbers(e: Estimate) -> list[str]:
    return ["" if x is None else f"{x:.4f}" for x in (e.mean, e.low, e.high)]
