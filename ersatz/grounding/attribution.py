"""Attribution: which qualities each unit holds (paper: holds, a subset of instances x qualities)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ersatz.errors import InputError
from ersatz.grounding.subcategorization import Qualities
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
        labels = np.full(len(units), -1, dtype=np.int8)
        if column := columns.get(quality.property.name):
            if column.property.components != quality.property.components:
                raise InputError(
                    f"property {column.property.name!r} was measured with components "
                    f"{list(column.property.components)}, but its qualities have "
                    f"{list(quality.property.components)}"
                )
            rows, values = unit_values(column, units, measurements)
            labels[rows] = quality.assign(values)
        held.append(labels)
    return Attribution(tuple(qualities), measurements.instance_class[units.instance], tuple(held))
