"""Attribution: every unit holds the nearest quality of each property it has a value of."""

import numpy as np
import pytest

from ersatz.errors import InputError
from ersatz.grounding.attribution import attribute
from ersatz.grounding.subcategorization import Qualities
from ersatz.grounding.units import ObservationUnit, find_units
from tests.making import prop, ranked, table

WEIGHT, USE = prop("weight"), prop("use", "functional")
MEASURED = table(
    [
        ("bowl", "b1", "a", "weight", 1.0),
        ("bowl", "b1", "b", "weight", 3.0),
        ("bowl", "b2", "", "use", 2.2),
        ("cup", "c1", "", "weight", 2.6),
    ],
    [WEIGHT, USE],
)


def test_instances_hold_the_quality_of_their_mean() -> None:
    units = find_units(MEASURED, ObservationUnit.INSTANCE)
    found = attribute(MEASURED, ranked([WEIGHT, USE], 3), units)
    assert found.unit_class.tolist() == [0, 0, 1]
    assert [h.tolist() for h in found.held] == [[-1, 1, -1], [1, -1, 2]]


def test_observations_hold_the_quality_of_their_own_value() -> None:
    units = find_units(MEASURED, ObservationUnit.OBSERVATION)
    found = attribute(MEASURED, ranked([WEIGHT, USE], 3), units)
    assert found.unit_class.tolist() == [0, 0, 0, 1]
    assert [h.tolist() for h in found.held] == [[-1, -1, 1, -1], [0, 2, -1, 2]]


def test_a_property_nobody_measured_is_held_by_none() -> None:
    units = find_units(MEASURED, ObservationUnit.INSTANCE)
    found = attribute(MEASURED, ranked([WEIGHT, USE, prop("zeal")], 3), units)
    assert found.held[2].tolist() == [-1, -1, -1]


def test_a_property_without_qualities_is_an_error() -> None:
    units = find_units(MEASURED, ObservationUnit.INSTANCE)
    with pytest.raises(InputError, match="'weight' has no qualities here: known are use"):
        attribute(MEASURED, ranked([USE], 3), units)


def test_other_components_are_an_error() -> None:
    units = find_units(MEASURED, ObservationUnit.INSTANCE)
    flat = Qualities(prop("weight", "physical", "x", "y"), np.zeros((1, 2)))
    with pytest.raises(InputError, match=r"'weight' was measured with components \[\]"):
        attribute(MEASURED, [flat, *ranked([USE], 3)], units)
