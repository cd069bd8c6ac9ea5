"""Sampling: one question answered many times, each with degrees drawn from their posteriors.

What is not known is drawn: the degrees of the tool, of the functions and of candidate classes; of a single
object the qualities nobody measured. Where the objects are known, they are drawn as wholes; else draws are
independent between properties and between concepts, as counts of single properties cannot tell what goes
together.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ersatz.reasoner.graded import similarities, weigh
from ersatz.reasoner.population import Population
from ersatz.reasoner.posterior import Posterior, posterior
from ersatz.reasoner.relevance import ReasonerSettings, in_use, layout_of, relevant_sets
from ersatz.reasoner.representative import Knowledge, pack
from ersatz.reasoner.similarity import Similarity, above, compare

CHUNK: Final = 1 << 21
"""Degrees drawn at a time: 16 MiB, and a few times that for what is made of them."""


_Draw: TypeAlias = Callable[[int], tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]]
"""Draws so often: degrees of the tool (s, q), candidate classes (s, n, q) and functions (s, f, q)."""


@dataclass(frozen=True, slots=True, eq=False)
class Question:
    """Whom a question is about.

    Attributes
    ----------
    knowledge : Knowledge
    settings : ReasonerSettings
    tool : int
        Row of the missing tool among `Knowledge.classes`.
    rows : (n,) int64 array
        Row of each candidate's class; -1 for a single object.
    held : (n, q) array of degrees in [0, 1]
        What a single object is known to hold; not looked at for classes.
    further : float or (c, q) int64 array, optional
        Ask not for the answer with endless data, but for the one with more objects: with so many times as
        many as are known, or with so many of each class that have a value of the quality's property,
        functions being known.
    population : Population, optional
        The objects behind the counts; not for numbers of objects to come.
    """

    knowledge: Knowledge
    settings: ReasonerSettings
    tool: int
    rows: NDArray[np.int64]
    held: NDArray[np.float64]
    further: float | NDArray[np.int64] | None = None
    population: Population | None = None

    def degrees(
        self, of: Posterior, rows: NDArray[np.int64] | None, draws: int, chance: "np.random.Generator"
    ) -> NDArray[np.float64]:
        """Return (draws, n, q) degrees drawn, of some classes or of the functions (None)."""
        further = self.to_come(of, rows)
        return of.draw(draws, chance) if further is None else of.foresee(draws, chance, further)

    def to_come(self, of: Posterior, rows: NDArray[np.int64] | None) -> NDArray[np.int64] | None:
        """Return (n, q): how many objects more are asked about; None for endless data."""
        if self.further is None:
            return None
        if isinstance(self.further, float):
            return np.rint(self.further * of.of_property(of.alpha - of.prior)).astype(np.int64)
        return np.zeros(of.alpha.shape, dtype=np.int64) if rows is None else self.further[rows]


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """Several draws, and the answer to the question in each.

    Attributes
    ----------
    tool : (s, q) float64 array
        Degrees of the missing tool.
    candidates : (s, n, q) float64 array
        Degrees of the candidates.
    similarity : (s, n) float64 array
        0 where the answer is undetermined.
    accepted : (s, n) bool array
    """

    tool: NDArray[np.float64]
    candidates: NDArray[np.float64]
    similarity: NDArray[np.float64]
    accepted: NDArray[np.bool_]

    @property
    def best(self) -> NDArray[np.float64]:
        """Share of being the most similar, (s, n): 1 in each draw, divided where several are tied."""
        top = self.similarity == self.similarity.max(axis=1, keepdims=True)
        share: NDArray[np.float64] = top / top.sum(axis=1, keepdims=True)
        return share


def samples(question: Question, draws: int, seed: int) -> Iterator[Sample]:
    """Yield the draws in chunks of bounded size; the same seed gives the same draws.

    Parameters
    ----------
    question : Question
    draws, seed : int
    """
    known, rows = question.knowledge, question.rows
    chances = np.random.default_rng(seed).spawn(4)
    classes = rows >= 0
    objects = None if classes.all() else _objects(question)
    draw, each = _classes(question, chances) if question.population is None else _wholes(question, chances)
    size = max(1, CHUNK // max(each, 1))
    for start in range(0, draws, size):
        number = min(size, draws - start)
        candidates = np.empty((number, len(rows), len(known.qualities)))
        tool, candidates[:, classes], functions = draw(number)
        if objects is not None:
            candidates[:, ~classes] = objects.draw(number, chances[1])
        yield _answer(question, tool, functions, candidates)


def _classes(question: Question, chances: "Sequence[np.random.Generator]") -> tuple[_Draw, int]:
    """Return what draws from the counts, and how many degrees a draw has."""
    known, rows = question.knowledge, question.rows
    chosen = np.concatenate([[question.tool], rows[rows >= 0]])
    tool, theirs = (
        posterior(known.classes.only(of.tolist()), known.qualities) for of in np.split(chosen, [1])
    )
    functions = posterior(known.functions, known.qualities)

    def draw(number: int) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        candidates = question.degrees(theirs, chosen[1:], number, chances[0])
        mine = question.degrees(tool, chosen[:1], number, chances[2])[:, 0]
        return mine, candidates, question.degrees(functions, None, number, chances[3])

    return draw, len(known.qualities) * (1 + len(rows) + len(known.functions.iris))


def _wholes(question: Question, chances: "Sequence[np.random.Generator]") -> tuple[_Draw, int]:
    """Return what draws objects as wholes, and how many numbers a draw has."""
    known, rows, population = question.knowledge, question.rows, question.population
    if population is None or isinstance(question.further, np.ndarray):
        raise ValueError("a population is drawn endless or so many times as large")
    further = question.further

    def draw(number: int) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        classes, functions = population.draw(known, number, chances[0], further)
        return classes[:, question.tool], classes[:, rows[rows >= 0]], functions

    many = len(known.classes.names) + len(known.functions.iris)
    return draw, len(population.of_class) * len(known.classes.names) + len(known.qualities) * many


def outcomes(question: Question, sample: Sample) -> NDArray[np.float64]:
    """Return (s, 1 + n, q): how probable each quality is if the tool or a candidate is measured once more.

    With endless data that is the degree drawn; else the share of the quality in the objects to come.
    """
    drawn = np.concatenate([sample.tool[:, None], sample.candidates], axis=1)
    rows = np.concatenate([[question.tool], question.rows])
    classes = np.flatnonzero(rows >= 0)
    known = question.knowledge
    of = posterior(known.classes.only(rows[classes].tolist()), known.qualities)
    further = question.to_come(of, rows[classes])
    if further is not None:
        seen = of.alpha - of.prior
        future = drawn[:, classes] * (of.of_property(seen) + further) - seen
        drawn[:, classes] = np.maximum(future, 0) / np.maximum(further, 1)
    return drawn


def _answer(
    question: Question,
    tool: NDArray[np.float64],
    functions: NDArray[np.float64],
    candidates: NDArray[np.float64],
) -> Sample:
    """Answer the question at the degrees drawn."""
    settings, known = question.settings, question.knowledge
    if settings.graded:
        layout, form = layout_of(known, settings), settings.similarity
        wanted = weigh(tool, functions, layout, settings.relevance_tolerance, fallback=settings.fallback)
        ratio = None if form is Similarity.ORDINAL else settings.ratio
        found = similarities(wanted.qualities, tool, candidates, layout, form, ratio)
        found = found * (wanted.determined | settings.fallback)[:, None]
        return Sample(tool, candidates, found, found > float(settings.tolerance))
    theta, (physical, functional) = float(settings.representative), in_use(known, settings)
    relevant, determined = relevant_sets(
        tool >= theta, functions >= theta, known.columns, physical, functional, settings
    )
    held = pack((candidates >= theta) & physical)
    numerators, denominators = compare(pack(relevant)[:, None], held, settings.similarity)
    accepted = above(numerators, denominators, settings.tolerance) & determined[:, None]
    return Sample(tool, candidates, numerators / denominators * determined[:, None], accepted)


@dataclass(frozen=True, slots=True, eq=False)
class _Objects:
    """Single objects of which some properties are known.

    What is not known is drawn in two steps: a class, by how well what is known fits it (naive Bayes, all
    classes alike), then for each unknown property a quality, by how often it was observed in that class.

    Attributes
    ----------
    held : (n, q) float64 array
        Degrees in [0, 1].
    measured : (n, q) bool array
        Whether the quality's property is known.
    likely : (n, c) float64 array
        Cumulative chance of each class.
    classes : Posterior
    """

    held: NDArray[np.float64]
    measured: NDArray[np.bool_]
    likely: NDArray[np.float64]
    classes: Posterior

    def draw(self, draws: int, chance: "np.random.Generator") -> NDArray[np.float64]:
        """Return (draws, n, q) degrees; those drawn are 0 and 1."""
        shape = (draws, *self.held.shape)
        uniform = chance.random((draws, len(self.held), 1 + self.held.shape[1]))
        rows = np.minimum((uniform[..., :1] > self.likely).sum(axis=-1), self.likely.shape[1] - 1)
        # The largest of log share + Gumbel noise is each quality with the chance of its share.
        score = np.log(self.classes.mean())[rows] - np.log(-np.log(uniform[..., 1:]))
        starts = np.flatnonzero(np.diff(self.classes.property, prepend=-1))
        largest = np.maximum.reduceat(score, starts, axis=-1)[..., self.classes.property]
        return np.where(np.broadcast_to(self.measured, shape), self.held, score == largest)


def _objects(question: Question) -> _Objects:
    classes = posterior(question.knowledge.classes, question.knowledge.qualities)
    held = question.held[question.rows < 0]
    fit = held @ np.log(classes.mean()).T
    weight = np.exp(fit - fit.max(axis=1, keepdims=True))
    likely = (weight / weight.sum(axis=1, keepdims=True)).cumsum(axis=1)
    return _Objects(held, classes.of_property(held) > 0, likely, classes)
