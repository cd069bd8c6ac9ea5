"""Population: the objects behind the counts, drawn as wholes, so that what goes together stays together.

The Bayesian bootstrap (Rubin 1981) with a prior: a class is an unknown mixture of the objects seen, its
weights Dirichlet with 1 for every object of its own and PRIOR shared by all objects of all classes, so that
a class may yet show what only others have shown (a Dirichlet process, Ferguson 1973, on what is known of
everything). Degrees of classes and function models follow from the same draw, as their counts do.
"""

from dataclasses import dataclass
from decimal import Decimal
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ersatz.grounding.conceptualization import DEGREE
from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.terms import millionths
from ersatz.measurements import Kind
from ersatz.reasoner.posterior import property_numbers, property_sums
from ersatz.reasoner.representative import Knowledge, load_knowledge

PRIOR: Final = 0.5
"""Weight of the prior in objects.

Objects left out are predicted best with 0.5 to 1.5. With 1 instead of 0.5 the Brier score of graded answers
is worse on both data sets, that of crisp ones the same.
"""

MOST_CELLS: Final = 100_000
"""Classes times objects: of more, properties are drawn one by one from their counts."""


@dataclass(frozen=True, slots=True, eq=False)
class Population:
    """All objects of a knowledge base.

    Attributes
    ----------
    of_class : (u,) int64 array
        Row of each object's class.
    held : (u, q) float64 array, in observed units
        How often each object was observed to hold each quality.
    """

    of_class: NDArray[np.int64]
    held: NDArray[np.float64]

    def draw(
        self, known: Knowledge, draws: int, chance: "np.random.Generator", further: float | None = None
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return (draws, c, q) degrees of classes and (draws, f, q) of function models.

        Parameters
        ----------
        known : Knowledge
            What was counted of the objects.
        draws : int
        chance : Generator
        further : float, optional
            Not of endlessly many objects, but of those seen and so many times as many more.
        """
        number = property_numbers(known.qualities)
        own = (self.of_class == np.arange(len(known.classes.names))[:, None]).astype(np.float64)
        size = own.sum(axis=1, keepdims=True)
        weights = chance.standard_gamma(own + PRIOR / len(self.of_class), (draws, *own.shape))
        weights /= np.maximum(weights.sum(axis=-1, keepdims=True), np.finfo(np.float64).tiny)
        if further is None:
            many = weights * size
        else:
            many = own + chance.multinomial(np.rint(further * size[:, 0]).astype(np.int64), weights)
        physical = self.held * known.mask(Kind.PHYSICAL)
        pairs = self.held[:, known.columns, None] * physical[:, None]
        together = many.sum(axis=1) @ pairs.reshape(len(self.held), -1)
        functions = together.reshape(draws, *pairs.shape[1:])
        return _shares(many @ self.held, number), _shares(functions, number)


def load_population(kb: KnowledgeBase) -> Population | None:
    """Return the objects, by `kb.view(load_population)`; None if they are too many or not all there."""
    known = kb.view(load_knowledge)
    if int(known.units.sum()) * len(known.units) > MOST_CELLS:
        return None
    pairs = [(str(one["class"]), str(one["instance"])) for one in kb.ask("all_instances")]
    rows = known.row_of_class
    row_of = {iri: row for row, iri in sorted((rows[of], iri) for of, iri in pairs if of in rows)}
    if not row_of:
        return None
    object_of = {iri: at for at, iri in enumerate(row_of)}
    column_of = {quality.iri: at for at, quality in enumerate(known.qualities)}
    counts = np.zeros((len(row_of), len(known.qualities)), dtype=np.int64)
    for found in kb.ask("instance_memberships", instances=list(row_of)):
        at = object_of[str(found["instance"])], column_of[str(found["quality"])]
        counts[at] = millionths(Decimal(str(found["count"])))
    of_class = np.array(list(row_of.values()), dtype=np.int64)
    sums = np.zeros_like(known.classes.counts)
    np.add.at(sums, of_class, counts)
    return Population(of_class, counts / DEGREE) if np.array_equal(sums, known.classes.counts) else None


def _shares(counts: NDArray[np.float64], number: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return counts as shares of their property's sums; 0 where nothing was observed."""
    return counts / np.maximum(property_sums(counts, number), np.finfo(np.float64).tiny)
