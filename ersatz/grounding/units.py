"""Units of attribution: what counts as one when qualities are counted, an instance or an observation."""

from dataclasses import dataclass
from enum import StrEnum
from math import fsum

import numpy as np
from numpy.typing import NDArray

from ersatz.measurements import Column, Measurements, rounded


class ObservationUnit(StrEnum):
    """Whether an object's observations are averaged first (as in RoCS) or every observation counts."""

    INSTANCE = "instance"
    OBSERVATION = "observation"


@dataclass(frozen=True, slots=True, eq=False)
class Units:
    """The units of a table of measurements, ascending.

    Attributes
    ----------
    kind : ObservationUnit
    instance : (u,) int32 array
        The instance each unit is, or is an observation of.
    observation : (u,) int32 array
        The observation each unit is; all 0 where the unit is the instance.
    """

    kind: ObservationUnit
    instance: NDArray[np.int32]
    observation: NDArray[np.int32]

    def __len__(self) -> int:
        """Return the number of units."""
        return len(self.instance)


def find_units(measurements: Measurements, kind: ObservationUnit) -> Units:
    """Return the units of the table.

    With `observation`, an instance is counted once for each of its named observations, or once if it
    has none; what was measured of the instance as a whole then holds in each of its observations.
    """
    everything = np.arange(len(measurements.instances), dtype=np.int32)
    if kind is ObservationUnit.INSTANCE:
        return Units(kind, everything, np.zeros_like(everything))
    base = len(measurements.observations)
    whole = _whole(measurements)
    keys = [np.unique(c.instance.astype(np.int64) * base + c.observation) for c in measurements.columns]
    pairs = np.unique(np.concatenate(keys))
    instance, observation = np.divmod(pairs, base)
    if whole is not None:
        named = observation != whole
        lonely = np.setdiff1d(everything, instance[named])
        keep = named | np.isin(instance, lonely)
        instance, observation = instance[keep], observation[keep]
    return Units(kind, instance.astype(np.int32), observation.astype(np.int32))


def unit_values(
    column: Column, units: Units, measurements: Measurements
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return which units have a value of the column's property, and the values.

    Returns
    -------
    rows : (n,) int64 array, ascending indices of units
    values : (n, d) float64 array, in the property's unit
        For an instance the mean of its observations, each component summed exactly (`math.fsum`) and
        `rounded`, so that no order of reading changes it.
    """
    if units.kind is ObservationUnit.INSTANCE:
        return _means(column)
    whole = _whole(measurements)
    base = len(measurements.observations)
    own = column.instance.astype(np.int64) * base + column.observation
    wanted = units.instance.astype(np.int64) * base + units.observation
    row = _find(own, wanted)
    if whole is not None:
        broadcast = _find(own, units.instance.astype(np.int64) * base + whole)
        row = np.where(row < 0, broadcast, row)
    rows = np.flatnonzero(row >= 0)
    return rows, column.values[row[rows]]


def _whole(measurements: Measurements) -> int | None:
    """Return the index of the observation "" (sorted first), if it occurs."""
    return 0 if measurements.observations[0] == "" else None


def _find(sorted_keys: NDArray[np.int64], wanted: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the position of each wanted key, or -1."""
    at = np.minimum(np.searchsorted(sorted_keys, wanted), len(sorted_keys) - 1)
    found: NDArray[np.int64] = np.where(sorted_keys[at] == wanted, at, -1)
    return found


def _means(column: Column) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    rows, first, count = np.unique(column.instance, return_index=True, return_counts=True)
    values = column.values[first]
    for at in np.flatnonzero(count > 1):
        repeated = column.values[first[at] : first[at] + count[at]]
        values[at] = [fsum(component) / len(repeated) for component in repeated.T]
    return rows.astype(np.int64), rounded(values)
