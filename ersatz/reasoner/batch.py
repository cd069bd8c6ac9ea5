"""Batches: substitutes of many missing tools at once, or of every class, in bounded memory."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ersatz.errors import InputError
from ersatz.knowledge.base import KnowledgeBase
from ersatz.reasoner.indices import crisp_index
from ersatz.reasoner.relevance import USUAL, Combine, Index, ReasonerSettings
from ersatz.reasoner.representative import class_row, load_knowledge
from ersatz.reasoner.similarity import above, best_first, compare, ratios, set_sizes

BLOCK: Final = 1024
"""Tools whose relevant qualities are worked out at once."""


@dataclass(frozen=True, slots=True, eq=False)
class Batch(Sequence[Sequence[tuple[str, Fraction, bool]]]):
    """The best substitutes of n tools; each a sequence of (name, similarity, accepted), best first.

    Attributes
    ----------
    missing : tuple of n str
    determined : (n,) bool array
        Whether the tool has a relevant function to judge candidates by.
    rows : (n, k) int64 array
        Candidates by their row in `names`, best first; of equal ones the first by name.
    numerators, denominators : (n, k) int32 arrays
        Their similarities, exactly.
    accepted : (n, k) bool array
    names, iris : sequences of c str
        Of all classes.
    """

    missing: tuple[str, ...]
    determined: NDArray[np.bool_]
    rows: NDArray[np.int64]
    numerators: NDArray[np.int32]
    denominators: NDArray[np.int32]
    accepted: NDArray[np.bool_]
    names: Sequence[str] = field(repr=False)
    iris: Sequence[str] = field(repr=False)

    def __len__(self) -> int:
        """Return the number of tools."""
        return len(self.missing)

    def __getitem__(self, at: Any) -> Any:
        """Return the substitutes of one tool, or of some."""
        if isinstance(at, slice):
            return [self[one] for one in range(*at.indices(len(self)))]
        halves = zip(self.numerators[at].tolist(), self.denominators[at].tolist(), strict=True)
        named = zip(self.rows[at].tolist(), halves, self.accepted[at].tolist(), strict=True)
        return [(self.names[row], Fraction(*ratio), accepted) for row, ratio, accepted in named]


def rank_many(
    kb: KnowledgeBase,
    missing: Sequence[str] | None = None,
    *,
    top: int = 10,
    settings: ReasonerSettings | None = None,
) -> Batch:
    """Rank all classes as substitutes for each of many missing tools; the same as one by one.

    Parameters
    ----------
    kb : KnowledgeBase
    missing : sequence of str, optional
        Names of classes; without it every class, which compares all pairs.
    top : int
        Substitutes to return for each; memory is for these alone.
    settings : ReasonerSettings, optional
        Crisp ones; graded reasoning goes one tool at a time, by `rank_substitutes`.

    Raises
    ------
    UnknownNameError
        If the knowledge base does not know a name.
    InputError
        If top is less than 1, settings are graded, or there is but one class.
    """
    settings = settings or USUAL
    if top < 1:
        raise InputError(f"top is {top}: rank at least one")
    if isinstance(missing, str):
        raise InputError("missing takes a list of names, not one string: ask rank_substitutes")
    if settings.graded:
        raise InputError("graded reasoning ranks one tool at a time: ask rank_substitutes")
    known = kb.view(load_knowledge)
    count = len(known.classes.names)
    if count < 2:
        raise InputError("there is no other class to choose from")
    named = range(count) if missing is None else [class_row(kb, known, name) for name in missing]
    tools = np.array(named, dtype=np.int64)
    index, width = crisp_index(kb, settings), min(top, count - 1)
    rows = np.empty((len(tools), width), dtype=np.int64)
    numerators, denominators = np.empty(rows.shape, np.int32), np.empty(rows.shape, np.int32)
    sizes, determined = set_sizes(index.body), np.empty(len(tools), dtype=bool)
    for at, (wanted, clear) in enumerate(_relevant(index, tools, settings)):
        found = compare(wanted, index.body, settings.similarity, sizes)
        similarity = ratios(*found)
        similarity[tools[at]] = -1
        rows[at], determined[at] = best_first(similarity, width), clear
        numerators[at], denominators[at] = (half[rows[at]] for half in found)
    accepted = above(numerators, denominators, settings.tolerance) & determined[:, None]
    names = known.classes.names
    chosen = tuple(names[row] for row in tools.tolist())
    return Batch(chosen, determined, rows, numerators, denominators, accepted, names, known.classes.iris)


def _relevant(
    index: Index, tools: NDArray[np.int64], settings: ReasonerSettings
) -> Iterator[tuple[NDArray[np.uint64], bool]]:
    """Yield the relevant qualities of each tool, (w,) packed, and whether there are any to judge by."""
    for start in range(0, len(tools), BLOCK):
        rows = tools[start : start + BLOCK]
        mine, does = index.body[rows], index.bits[rows][:, index.columns]
        found = compare(mine[:, None, :], index.function_body)
        relevant = does & above(*found, settings.relevance_tolerance)
        union = settings.combine is Combine.UNION
        sets = np.zeros_like(mine) if union else mine.copy()
        for function, body in enumerate(index.function_body):
            goes = relevant[:, function]
            sets[goes] = sets[goes] | (mine[goes] & body) if union else sets[goes] & body
        some = np.asarray(relevant.any(axis=1))
        sets[~some] = mine[~some] if settings.fallback else 0
        for at, clear in enumerate(some.tolist()):
            yield sets[at], clear or settings.fallback
