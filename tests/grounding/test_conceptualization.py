"""Conceptualization against counting in plain Python; counts merge exactly in any split and order."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import reduce
from math import floor
from operator import add
from typing import TypeAlias

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ersatz.errors import InputError
from ersatz.grounding.attribution import Attribution, attribute
from ersatz.grounding.conceptualization import DEGREE, Counts, conceptualize
from ersatz.grounding.subcategorization import Qualities
from ersatz.grounding.units import ObservationUnit, find_units
from tests.making import prop, ranked, table

PROPERTIES = (prop("alpha"), prop("beta"), prop("hold", "functional"), prop("use", "functional"))
RANKS = 3
QUALITIES = tuple(ranked(PROPERTIES, RANKS))
CLASSES = ("bowl", "cup", "tray")

Degrees: TypeAlias = tuple[int, ...]
"""One property of one unit: degrees of its qualities in millionths; () = no value."""


@dataclass(frozen=True)
class Unit:
    """One unit: its class and, for each property, its degrees."""

    row: int
    degrees: tuple[Degrees, ...]


@st.composite
def crisp_degrees(draw: st.DrawFn) -> Degrees:
    rank = draw(st.integers(-1, RANKS - 1))
    return tuple(DEGREE * (at == rank) for at in range(RANKS)) if rank >= 0 else ()


@st.composite
def fuzzy_degrees(draw: st.DrawFn) -> Degrees:
    if draw(st.booleans()):
        return draw(crisp_degrees())
    cuts = sorted(draw(st.lists(st.integers(0, DEGREE), min_size=RANKS - 1, max_size=RANKS - 1)))
    return tuple(b - a for a, b in zip([0, *cuts], [*cuts, DEGREE], strict=True))


def some_units(degrees: st.SearchStrategy[Degrees]) -> st.SearchStrategy[list[Unit]]:
    one = st.builds(Unit, st.integers(0, len(CLASSES) - 1), st.tuples(*[degrees] * len(PROPERTIES)))
    return st.lists(one, max_size=12)


def attribution_of(some: Sequence[Unit], *, crisp: bool) -> Attribution:
    held: list[np.ndarray] = []
    for at in range(len(PROPERTIES)):
        rows = [unit.degrees[at] for unit in some]
        if crisp:
            held.append(np.array([row.index(DEGREE) if row else -1 for row in rows], dtype=np.int8))
        else:
            held.append(np.array([row or (0,) * RANKS for row in rows], dtype=np.int64).reshape(-1, RANKS))
    return Attribution(QUALITIES, np.array([unit.row for unit in some], dtype=np.int32), tuple(held))


def counted(some: Sequence[Unit], *, crisp: bool = False) -> Counts:
    return conceptualize(attribution_of(some, crisp=crisp), CLASSES)


def divided(much: int, degrees: Degrees) -> list[int]:
    """Divide a degree in proportion to others, in millionths; the largest remainders get what is left."""
    exact = [Fraction(much * degree, DEGREE) for degree in degrees]
    shares = [floor(share) for share in exact]
    for at in sorted(range(len(exact)), key=lambda at: shares[at] - exact[at])[: much - sum(shares)]:
        shares[at] += 1
    return shares


def by_hand(some: Sequence[Unit]) -> dict[tuple[str, ...], int]:
    """Count in dictionaries; what is absent is 0."""
    found: dict[tuple[str, ...], int] = defaultdict(int)
    for unit in some:
        name = CLASSES[unit.row]
        found["units", name] += 1
        for p, degrees in zip(PROPERTIES, unit.degrees, strict=True):
            if not degrees:
                continue
            found["total", name, p.name] += DEGREE
            for rank, degree in enumerate(degrees, start=1):
                found["count", name, f"{p.name}_{rank}"] += degree
            if p.kind == "functional":
                continue
            for f, able in zip(PROPERTIES, unit.degrees, strict=True):
                if f.kind != "functional" or not able:
                    continue
                for level, much in enumerate(able, start=1):
                    found["function total", f"{f.name}_{level}", p.name] += much
                    for rank, both in enumerate(divided(much, degrees), start=1):
                        found["function count", f"{f.name}_{level}", f"{p.name}_{rank}"] += both
    return {key: count for key, count in found.items() if count}


def as_dict(counts: Counts) -> dict[tuple[str, ...], int]:
    names = [name for q in counts.qualities for name in q.names]
    properties = [q.property.name for q in counts.qualities]
    found: dict[tuple[str, ...], int] = {}
    for what, rows, columns, cells in (
        ("count", counts.classes, names, counts.class_counts),
        ("total", counts.classes, properties, counts.class_totals),
        ("function count", counts.functions, names, counts.function_counts),
        ("function total", counts.functions, properties, counts.function_totals),
    ):
        assert cells.dtype == np.int64
        assert cells.shape == (len(rows), len(columns))
        for row, column in zip(*np.nonzero(cells), strict=True):
            found[what, rows[row], columns[column]] = int(cells[row, column])
    return found | {
        ("units", name): int(n) for name, n in zip(counts.classes, counts.units, strict=True) if n
    }


@settings(max_examples=300, deadline=None)
@given(some_units(crisp_degrees()))
def test_crisp_counts_are_those_of_counting_by_hand(some: list[Unit]) -> None:
    assert as_dict(counted(some, crisp=True)) == by_hand(some)
    assert as_dict(counted(some)) == by_hand(some)  # degrees 0 and 1 are the special case


@settings(max_examples=300, deadline=None)
@given(some_units(fuzzy_degrees()))
def test_fuzzy_counts_are_those_of_counting_by_hand(some: list[Unit]) -> None:
    assert as_dict(counted(some)) == by_hand(some)


@settings(max_examples=300, deadline=None)
@given(some_units(fuzzy_degrees()))
def test_counts_of_one_property_add_up_to_its_total(some: list[Unit]) -> None:
    """So that what was counted can be read back: a total above 0 has a count above 0."""
    counts = counted(some)
    for counted_, totals in (
        (counts.class_counts, counts.class_totals),
        (counts.function_counts, counts.function_totals),
    ):
        assert np.array_equal(np.add.reduceat(counted_, counts.offsets[:-1], axis=1), totals)


@settings(max_examples=300, deadline=None)
@given(some_units(fuzzy_degrees()), st.data())
def test_any_split_merged_in_any_order_is_the_batch(some: list[Unit], data: st.DataObject) -> None:
    owner = [data.draw(st.integers(0, 3)) for _ in some]
    parts = [counted([u for u, o in zip(some, owner, strict=True) if o == part]) for part in range(4)]
    whole = as_dict(counted(some))
    assert as_dict(reduce(add, data.draw(st.permutations(parts)))) == whole
    assert as_dict((parts[0] + parts[1]) + (parts[2] + parts[3])) == whole


@settings(max_examples=200, deadline=None)
@given(some_units(fuzzy_degrees()), some_units(crisp_degrees()))
def test_subtraction_undoes_addition(one: list[Unit], two: list[Unit]) -> None:
    a, b = counted(one), counted(two)
    assert as_dict((a + b) - b) == as_dict(a)
    assert as_dict((a - b) + b) == as_dict(a)
    assert as_dict(a - a) == {}


def mixed(crisp: Sequence[int]) -> Attribution:
    """Return two units, some properties crisp and the others as degrees."""
    some = [Unit(0, ((0, DEGREE, 0),) * 4), Unit(1, ((DEGREE, 0, 0), (), (0, 0, DEGREE), (0, DEGREE, 0)))]
    one, two = (attribution_of(some, crisp=c) for c in (True, False))
    held = tuple(one.held[at] if at in crisp else two.held[at] for at in range(4))
    return Attribution(QUALITIES, one.unit_class, held)


@pytest.mark.parametrize("crisp", [(), (0,), (1, 2), (2,), (0, 3), (0, 1, 2, 3)])
def test_crisp_and_fuzzy_properties_go_together(crisp: tuple[int, ...]) -> None:
    assert as_dict(conceptualize(mixed(crisp), CLASSES)) == as_dict(conceptualize(mixed(()), CLASSES))


def test_classes_of_two_tables_are_joined() -> None:
    def of(name: str) -> Counts:
        measured = table([(name, f"{name}_1", "", "alpha", 2.0)], PROPERTIES)
        units = find_units(measured, ObservationUnit.INSTANCE)
        return conceptualize(attribute(measured, QUALITIES, units), measured.classes)

    both = of("tray") + of("bowl")
    assert both.classes == ("bowl", "tray")
    assert both.units.tolist() == [1, 1]
    assert as_dict(both)["count", "tray", "alpha_2"] == DEGREE


def test_an_observation_counts_once_each_and_an_instance_once() -> None:
    rows = [("bowl", "b1", f"s{n}", "alpha", value) for n, value in enumerate((1.0, 1.0, 3.0))]
    measured = table([*rows, ("bowl", "b2", "", "alpha", 3.0)], PROPERTIES)
    expected = {
        ObservationUnit.OBSERVATION: (4, 2, 0, 2),
        ObservationUnit.INSTANCE: (2, 0, 1, 1),  # the mean of b1 is 5/3
    }
    for kind, (units, low, middle, high) in expected.items():
        counts = conceptualize(attribute(measured, QUALITIES, find_units(measured, kind)), ("bowl",))
        assert counts.units.tolist() == [units]
        assert counts.class_counts[0, :3].tolist() == [n * DEGREE for n in (low, middle, high)]


def test_counts_at_other_cut_points_are_not_added() -> None:
    other = tuple(Qualities(q.property, q.centroids + 1) for q in QUALITIES)
    empty = counted([])
    shifted = conceptualize(Attribution(other, np.zeros(0, np.int32), empty_held()), CLASSES)
    with pytest.raises(InputError, match="same cut points"):
        empty + shifted


def test_counts_of_other_fuzziness_are_not_added() -> None:
    norms = np.eye(1)[None].repeat(RANKS, axis=0)
    for other in (
        tuple(replace(q, fuzzifier=2.0) for q in QUALITIES),
        tuple(replace(q, norms=norms) for q in QUALITIES),
    ):
        shifted = conceptualize(Attribution(other, np.zeros(0, np.int32), empty_held()), CLASSES)
        with pytest.raises(InputError, match="same cut points"):
            counted([]) + shifted
        assert as_dict(shifted + shifted) == {}


def empty_held() -> tuple[np.ndarray, ...]:
    return tuple(np.zeros(0, dtype=np.int8) for _ in PROPERTIES)
