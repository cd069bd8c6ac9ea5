"""Whether the rows of every instance of a data set lie together, in one part and without others between."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ersatz.acquisition.engine import Engine
from ersatz.acquisition.tables.parts import Part, read_names
from ersatz.errors import InputError
from ersatz.grounding.summaries import hash_names


@dataclass(frozen=True, slots=True)
class Names:
    """The names of a part's instances in short.

    Attributes
    ----------
    first, last : str
        Of the first and the last row.
    ascending : bool
        Whether every name is above the one before, so that none can come back.
    """

    first: str
    last: str
    ascending: bool

    def __add__(self, other: "Names") -> "Names":
        """Return the names of both, the other's following."""
        ascending = self.ascending and other.ascending and self.last < other.first
        return Names(self.first, other.last, ascending)


def check_apart(parts: Sequence[Part], names: Sequence[Names | None], engine: Engine) -> None:
    """Check that no instance comes back after another.

    Where the rows are sorted by instance and the parts follow each other, that is known from where they
    begin and end. Else all names are read once more, and eight bytes of each are held.

    Raises
    ------
    InputError
        If an instance does; it would have been counted twice.
    """
    ordered = sorted((one for one in names if one is not None), key=lambda one: (one.first, one.last))
    if all(one.ascending for one in ordered) and all(a.last < b.first for a, b in pairwise(ordered)):
        return
    hashes = np.sort(np.concatenate(list(engine.map(_hashes, parts))))
    twice = np.unique(hashes[1:][hashes[1:] == hashes[:-1]])
    if not len(twice):
        return
    suspects = list(engine.map(partial(_suspects, hashes=twice), parts))
    seen = Counter(name for some in suspects for name in some)
    strays = sorted(name for name, times in seen.items() if times > 1)
    if strays:
        files = [part.name for part, some in zip(parts, suspects, strict=True) if strays[0] in some]
        raise InputError(
            f"the rows of instance {strays[0]!r} are apart in {' and '.join(map(repr, files))}: in a data "
            "set in parts all rows of an instance lie together in one file; sort the table by instance"
        )


def _hashes(part: Part) -> NDArray[np.uint64]:
    return np.concatenate([np.empty(0, np.uint64), *map(hash_names, read_names(part))])


def _suspects(part: Part, hashes: NDArray[np.uint64]) -> list[str]:
    """Return the names with one of the hashes, as often as they come; unequal names may have the same."""
    found: list[str] = []
    for names in read_names(part):
        found += [names[at] for at in np.flatnonzero(np.isin(hash_names(names), hashes))]
    return found
