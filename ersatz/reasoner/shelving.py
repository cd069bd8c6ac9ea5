"""Knowledge as arrays for the shelf, and back: without a copy, each text read when it is looked at."""

from bisect import bisect_right
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from fractions import Fraction
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from ersatz.measurements import Kind
from ersatz.reasoner.representative import Knowledge, Memberships, QualityTerm, pack


@dataclass(frozen=True, slots=True, eq=False)
class Texts(Sequence[str]):
    """Texts in one array of UTF-8.

    Attributes
    ----------
    letters : (b,) uint8 array
    ends : (n,) int64 array
        Where each text ends.
    """

    letters: NDArray[np.uint8]
    ends: NDArray[np.int64]

    @classmethod
    def of(cls, texts: Sequence[str]) -> "Texts":
        """Put texts into one array; it is never empty, since an empty file cannot be mapped."""
        encoded = [text.encode() for text in texts]
        ends = np.cumsum([len(one) for one in encoded], dtype=np.int64)
        return cls(np.frombuffer(b"".join([*encoded, b"\n"]), dtype=np.uint8), ends)

    def __len__(self) -> int:
        """Return the number of texts."""
        return len(self.ends)

    @overload
    def __getitem__(self, at: int) -> str: ...
    @overload
    def __getitem__(self, at: slice) -> Sequence[str]: ...
    def __getitem__(self, at: int | slice) -> str | Sequence[str]:
        """Return one text, or some."""
        if isinstance(at, slice):
            return [self[one] for one in range(*at.indices(len(self)))]
        at = range(len(self))[at]
        start = int(self.ends[at - 1]) if at else 0
        return self.letters[start : int(self.ends[at])].tobytes().decode()

    def __iter__(self) -> Iterator[str]:
        """Yield all."""
        letters, start = self.letters.tobytes(), 0
        for end in self.ends.tolist():
            yield letters[start:end].decode()
            start = end


@dataclass(frozen=True, slots=True, eq=False)
class Rows(Mapping[str, int]):
    """Which row a text is in, by bisection; of equal texts the last.

    Attributes
    ----------
    texts : Texts
    order : (n,) int64 array
        Rows by ascending text.
    """

    texts: Texts
    order: NDArray[np.int64]

    def __getitem__(self, text: str) -> int:
        """Return the row."""
        at = bisect_right(self.order, text, key=self.texts.__getitem__) - 1
        if at < 0 or self.texts[int(self.order[at])] != text:
            raise KeyError(text)
        return int(self.order[at])

    def __iter__(self) -> Iterator[str]:
        """Yield all texts, by row."""
        return iter(self.texts)

    def __len__(self) -> int:
        """Return the number of texts."""
        return len(self.texts)


def to_arrays(known: Knowledge, theta: Fraction) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """Return what is to be kept: arrays, and JSON about them; representative at theta is decided now."""
    classes, functions = known.classes, known.functions
    names, iris = Texts.of(classes.names), Texts.of(classes.iris)
    arrays: dict[str, NDArray[Any]] = {
        "counts": classes.counts,
        "totals": classes.totals,
        "representative": pack(classes.representative(theta)),
        "units": known.units,
        "names": names.letters,
        "name_ends": names.ends,
        "iris": iris.letters,
        "iri_ends": iris.ends,
        "by_iri": np.array(sorted(range(len(iris)), key=list(classes.iris).__getitem__), dtype=np.int64),
        "function_counts": functions.counts,
        "function_totals": functions.totals,
    }
    return arrays, {"theta": str(theta), "qualities": [asdict(quality) for quality in known.qualities]}


def _quality(kept: Mapping[str, Any]) -> QualityTerm:
    return QualityTerm(**{**kept, "kind": Kind(kept["kind"]), "centroid": tuple(kept.get("centroid", ()))})


def from_arrays(arrays: Mapping[str, NDArray[Any]], about: Any) -> Knowledge:
    """Return the knowledge that was kept."""
    qualities = tuple(_quality(one) for one in about["qualities"])
    functions = [quality for quality in qualities if quality.kind is Kind.FUNCTIONAL]
    names = Texts(arrays["names"], arrays["name_ends"])
    iris = Texts(arrays["iris"], arrays["iri_ends"])
    return Knowledge(
        qualities,
        Memberships(
            iris,
            names,
            arrays["counts"],
            arrays["totals"],
            {Fraction(about["theta"]): arrays["representative"]},
        ),
        Memberships(
            tuple(quality.iri for quality in functions),
            tuple(quality.name for quality in functions),
            arrays["function_counts"],
            arrays["function_totals"],
        ),
        arrays["units"],
        Rows(iris, arrays["by_iri"]),
        Rows(names, np.arange(len(names))),
    )
