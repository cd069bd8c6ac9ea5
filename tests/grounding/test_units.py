"""Units: what counts as one, and the value it has."""

import itertools
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ersatz.grounding.units import ObservationUnit, find_units, unit_values
from ersatz.measurements import DIGITS
from tests.making import Row, prop, table

WEIGHT, SIZE, USE = prop("weight"), prop("size", "physical", "length", "width"), prop("use", "functional")
PROPERTIES = (WEIGHT, SIZE, USE)
ROWS: list[Row] = [
    ("bowl", "b1", "s1", "weight", 1.0),
    ("bowl", "b1", "s2", "weight", 2.0),
    ("bowl", "b1", "s2", "size", [3.0, 4.0]),
    ("bowl", "b1", "s3", "size", [5.0, 6.0]),
    ("bowl", "b1", "", "use", 9.0),
    ("cup", "c1", "", "weight", 7.0),
    ("cup", "c2", "s1", "size", [1.0, 1.0]),
]


def valued(kind: ObservationUnit) -> dict[str, dict[tuple[str, str], list[float]]]:
    """Return property -> (instance, observation) -> value."""
    found = {}
    measured = table(ROWS, PROPERTIES)
    units = find_units(measured, kind)
    for column in measured.columns:
        rows, values = unit_values(column, units, measured)
        assert np.array_equal(rows, np.unique(rows))
        found[column.property.name] = {
            (
                str(measured.instances[units.instance[row]]),
                measured.observations[units.observation[row]] if kind == "observation" else "",
            ): value.tolist()
            for row, value in zip(rows.tolist(), values, strict=True)
        }
    return found


def test_an_instance_has_the_mean_of_its_observations() -> None:
    assert valued(ObservationUnit.INSTANCE) == {
        "weight": {("b1", ""): [1.5], ("c1", ""): [7.0]},
        "size": {("b1", ""): [4.0, 5.0], ("c2", ""): [1.0, 1.0]},
        "use": {("b1", ""): [9.0]},
    }


def test_every_observation_counts_and_has_what_was_measured_of_the_whole() -> None:
    assert valued(ObservationUnit.OBSERVATION) == {
        "weight": {("b1", "s1"): [1.0], ("b1", "s2"): [2.0], ("c1", ""): [7.0]},
        "size": {("b1", "s2"): [3.0, 4.0], ("b1", "s3"): [5.0, 6.0], ("c2", "s1"): [1.0, 1.0]},
        "use": {("b1", "s1"): [9.0], ("b1", "s2"): [9.0], ("b1", "s3"): [9.0]},
    }


@pytest.mark.parametrize("kind", list(ObservationUnit))
def test_units_do_not_depend_on_the_order_of_rows(kind: ObservationUnit) -> None:
    expected = find_units(table(ROWS, PROPERTIES), kind)
    for rows in itertools.islice(itertools.permutations(ROWS), 0, 5040, 311):
        found = find_units(table(rows, PROPERTIES), kind)
        assert np.array_equal(found.instance, expected.instance)
        assert np.array_equal(found.observation, expected.observation)


@settings(max_examples=200, deadline=None)
@given(st.lists(st.floats(-1e9, 1e9).map(lambda x: round(x, DIGITS)), min_size=1, max_size=12))
def test_the_mean_is_the_exact_one_rounded_once(values: list[float]) -> None:
    measured = table([("c", "i", f"o{n}", "weight", v) for n, v in enumerate(values)], [WEIGHT])
    units = find_units(measured, ObservationUnit.INSTANCE)
    mean = unit_values(measured.columns[0], units, measured)[1][0, 0]
    exact = sum(map(Fraction, values), Fraction(0)) / len(values)
    assert mean == pytest.approx(float(exact), rel=2e-15, abs=10.0**-DIGITS)
