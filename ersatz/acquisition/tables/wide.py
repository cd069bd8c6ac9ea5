"""The wide layout of a table: one object or observation a row, one number a column."""

import re
from collections.abc import Iterator, Mapping
from fractions import Fraction
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ersatz.acquisition.tables.rows import IDS, Keys, Values, in_unit, no_component, offer, unit_factor
from ersatz.acquisition.tables.sheets import Sheet
from ersatz.errors import InputError
from ersatz.measurements import Property

LONG_ONLY: Final = ("property", "component", "value", "unit")
_HEADER: Final = re.compile(r"(?P<name>[^\[\].]+)(\.(?P<component>[^\[\].]+))?(\[(?P<unit>[^\[\]]*)\])?\Z")

_Columns: TypeAlias = dict[str, tuple[str, Fraction]]
"""Component ("" of a scalar) -> column of the sheet, and what to multiply it by."""


def read_wide(rows: Keys, known: Mapping[str, Property]) -> Iterator[Values]:
    """Yield the values of each property that a column gives.

    Raises
    ------
    InputError
        If a column is unknown or given twice, or a number, a unit or a vector is not what it should be.
    """
    sheet = rows.sheet
    for name, columns in _columns(sheet, known).items():
        prop = known[name]
        lacking = [component for component in prop.components if component not in columns]
        if lacking:
            raise InputError(
                f"{sheet.source.name!r} lacks the column '{name}.{lacking[0]}': give every component"
            )
        order = [columns[component] for component in prop.components or ("",)]
        at, numbers = _complete(sheet, name, [column for column, _ in order])
        _check_once(rows, at, name)
        parts = [
            in_unit(sheet, prop, column, at=at, numbers=part, by=by)
            for (column, by), part in zip(order, numbers.T, strict=True)
        ]
        yield prop, at, np.stack(parts, axis=1)


def _columns(sheet: Sheet, known: Mapping[str, Property]) -> dict[str, _Columns]:
    found: dict[str, _Columns] = {}
    for column in sheet.columns:
        if column in IDS:
            continue
        prop, component, by = _header(sheet, column, known)
        columns = found.setdefault(prop.name, {})
        if component in columns:
            raise InputError(
                f"{sheet.source.name!r}: the columns {columns[component][0]!r} and {column!r} give the same "
                "number: delete one"
            )
        columns[component] = column, by
    if not found:
        raise InputError(
            f"{sheet.source.name!r} has no column of a property: add one, like 'weight' or 'size.length', "
            "or columns 'property' and 'value'"
        )
    return found


def _header(sheet: Sheet, column: str, known: Mapping[str, Property]) -> tuple[Property, str, Fraction]:
    """Return what a column holds: "size.length [cm]" is size, its length, in hundredths of a metre."""
    where = f"{sheet.source.name!r}: the column {column!r}"
    match = _HEADER.match(column)
    name = match["name"].strip() if match else column
    if name not in known:
        if name in LONG_ONLY:
            raise InputError(f"{where} belongs to the long layout, which needs a column 'property': add it")
        raise InputError(
            f"{where} is no property: {offer(name, known)} "
            "(units go in brackets, 'weight [g]'; other properties are described in <stem>.properties.toml)"
        )
    prop, component = known[name], ((match and match["component"]) or "").strip()
    if component not in (prop.components or ("",)):
        raise InputError(f"{where} {no_component(prop)}")
    return prop, component, unit_factor(prop, ((match and match["unit"]) or "").strip(), where)


def _complete(sheet: Sheet, name: str, columns: list[str]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return the (n,) rows that have a value, and the (n, d) numbers of the columns there."""
    numbers = np.stack([sheet.numbers(column) for column in columns], axis=1)
    missing = np.isnan(numbers)
    partial = np.flatnonzero(missing.any(axis=1) & ~missing.all(axis=1))
    if len(partial):
        row = int(partial[0])
        raise sheet.error(
            row,
            columns[int(np.argmax(missing[row]))],
            f"is missing where other components of {name!r} are given: give all or leave all empty",
        )
    at = np.flatnonzero(~missing[:, 0])
    return at, numbers[at]


def _check_once(rows: Keys, at: NDArray[np.int64], name: str) -> None:
    key = rows.key[at]
    if (key[1:] > key[:-1]).all():
        return
    order = np.argsort(key, kind="stable")
    key = key[order]
    twice = np.flatnonzero(key[1:] == key[:-1])
    if len(twice):
        raise rows.twice(name, int(at[order[twice[0]]]), int(at[order[twice[0] + 1]]))
