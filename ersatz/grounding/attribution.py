"""Attribution: which qualities each unit holds (paper: holds, a subset of instances x qualities)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ersatz.errors import InputError
from ersatz.grounding.subcategorization import Qualities, most
from ersatz.grounding.units import Units, unit_values
from ersatz.measurements import Measurements


@dataclass(frozen=True, slots=True, eq=False)
class Attribution:
    """What every unit holds.

    Attributes
    ----------
    qualities : tuple of p Qualities
    unit_class : (u,) int32 array
        Index of each unit's class in the measurements.
    held : tuple of p arrays
        For each property either (u,) int8, the index of the one quality held (-1: no value), or
        (u, k) int64, the degrees to which each quality is held in units of 10^-6 (all 0: no value).
    """

    qualities: tuple[Qualities, ...]
    unit_class: NDArray[np.int32]
    held: tuple[NDArray[np.int8] | NDArray[np.int64], ...]


def attribute(measurements: Measurements, qualities: Sequence[Qualities], units: Units) -> Attribution:
    """Give every unit the quality nearest to its value, for each property it has a value of.

    Of fuzzy qualities it gets the degrees to which its value belongs to each.

    Raises
    ------
    InputError
        If a property was measured that has no qualities.
    """
    known = {q.property.name: q for q in qualities}
    columns = {column.property.name: column for column in measurements.columns}
    for name in columns:
        if name not in known:
            raise InputError(f"property {name!r} has no qualities here: known are {', '.join(sorted(known))}")
    held = []
    for quality in qualities:
        held_here = _nothing(len(units), quality)
        if column := columns.get(quality.property.name):
            if column.property.components != quality.property.components:
                raise InputError(
                    f"property {column.property.name!r} was measured with components "
                    f"{list(column.property.components)}, but its qualities have "
                    f"{list(quality.property.components)}"
                )
            rows, values = unit_values(column, units, measurements)
            held_here[rows] = quality.held(values)
        held.append(held_here)
    return Attribution(tuple(qualities), measurements.instance_class[units.instance], tuple(held))


def most_held(held: NDArray[np.int8] | NDArray[np.int64]) -> NDArray[np.int8]:
    """Return the index of the quality each unit holds most, ties to the lower rank; -1: no value.

    Parameters
    ----------
    held : (u,) int8 or (u, k) int64 array
        As in `Attribution.held`.
    """
    if held.ndim == 1:
        return held.astype(np.int8, copy=False)
    labels = most(held.astype(np.int64, copy=False))
    labels[~held.any(axis=1)] = -1
    return labels


def _nothing(units: int, quality: Qualities) -> NDArray[np.int8] | NDArray[np.int64]:
    if quality.fuzzy:
        return np.zeros((units, len(quality.names)), dtype=np.int64)
    return np.full(units, -1, dtype=np.int8)
