"""Raw features of classes: what a method sees that knows numbers but no qualities."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ersatz.errors import InputError
from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.names import local_name


@dataclass(frozen=True, slots=True, eq=False)
class ClassFeatures:
    """Mean values of each class, over its instances.

    Attributes
    ----------
    row : mapping of class name to row
    columns : tuple of (property, component)
        Component 0 of a scalar; 1, 2, … of a vector.
    functional : frozenset of str
        The properties that are functional.
    means : (c, k) float64 array, in the units of the properties; nan where nothing is known
    """

    row: Mapping[str, int]
    columns: tuple[tuple[str, int], ...]
    functional: frozenset[str]
    means: NDArray[np.float64]

    def of(self, properties: Sequence[str] | None = None) -> NDArray[np.float64]:
        """Return (c, k') means of some properties, or of all physical ones.

        Raises
        ------
        InputError
            If the knowledge base holds none of them.
        """
        chosen = [
            at
            for at, (name, _) in enumerate(self.columns)
            if (name not in self.functional if properties is None else name in properties)
        ]
        if not chosen:
            raise InputError(
                f"the knowledge base has no values of {', '.join(properties or ['any property'])}"
            )
        return self.means[:, chosen]


def class_features(kb: KnowledgeBase) -> ClassFeatures:
    """Read all measured values and average them by instance, then by class.

    Raises
    ------
    InputError
        If the knowledge base holds classes only.
    """
    values: dict[str, dict[tuple[str, int], list[float]]] = {}
    for name in kb.known_names("class"):
        of_class = values.setdefault(name, {})
        for row in kb.ask("instances", **{"class": name}):
            for column, mean in _instance(kb, str(row["instance"])).items():
                of_class.setdefault(column, []).append(mean)
    columns = tuple(sorted({column for one in values.values() for column in one}))
    if not columns:
        raise InputError("the knowledge base holds classes only: raw features need its instances")
    means = np.array(
        [[np.mean(one[column]) if column in one else np.nan for column in columns] for one in values.values()]
    )
    kinds = {local_name(str(row["property"])): str(row["kind"]) for row in kb.ask("properties")}
    functional = frozenset(name for name, kind in kinds.items() if kind == "functional")
    return ClassFeatures({name: at for at, name in enumerate(values)}, columns, functional, means)


def standardized(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (c, k) z-scores over classes; unknown values and constant columns are 0."""
    known = ~np.isnan(values)
    counts = np.maximum(known.sum(axis=0), 1)
    filled = np.where(known, values, 0.0)
    centred = np.where(known, values - filled.sum(axis=0) / counts, 0.0)
    spread = np.sqrt((centred**2).sum(axis=0) / counts)
    return centred / np.where(spread > 0, spread, 1.0)


def _instance(kb: KnowledgeBase, instance: str) -> dict[tuple[str, int], float]:
    values: dict[tuple[str, int], list[float]] = {}
    for row in kb.ask("instance_measurements", instance=instance):
        position = row["position"]
        column = local_name(str(row["property"])), int(str(position)) if position is not None else 0
        values.setdefault(column, []).append(float(str(row["value"])))
    return {column: sum(of) / len(of) for column, of in values.items()}
