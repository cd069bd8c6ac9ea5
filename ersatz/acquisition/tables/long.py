"""The long layout of a table: one number a row, with the names of its property and component."""

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from ersatz.acquisition.tables.rows import IDS, Rows, Values, in_unit, no_component, offer, unit_factor
from ersatz.acquisition.tables.sheets import Sheet
from ersatz.acquisition.tables.wide import LONG_ONLY
from ersatz.errors import InputError
from ersatz.measurements import Property


def read_long(rows: Rows, known: Mapping[str, Property]) -> Iterator[Values]:
    """Yield the values of each property the rows name.

    Raises
    ------
    InputError
        If a column, property, component or unit is unknown, a number is none, or a vector is incomplete.
    """
    sheet = rows.sheet
    strange = [column for column in sheet.columns if column not in (*IDS, *LONG_ONLY)]
    if strange:
        hint = offer(strange[0], (*IDS, *LONG_ONLY), "column")
        raise InputError(f"{sheet.source.name!r}: unknown column {strange[0]!r} in the long layout: {hint}")
    if "value" not in sheet.columns:
        raise InputError(f"{sheet.source.name!r} has no column 'value', as the long layout needs: add it")
    names, name_code = sheet.strings("property")
    for code, name in enumerate(map(str, names)):
        if name not in known:
            raise sheet.error(
                int(np.argmax(name_code == code)),
                "property",
                f"is no property: {offer(name, known)} (others are described in <stem>.properties.toml)",
            )
    numbers = sheet.numbers("value")
    given = ~np.isnan(numbers)
    for code, name in enumerate(map(str, names)):
        here = np.flatnonzero(name_code == code)
        component = _components(sheet, known[name], here)
        values = _converted(sheet, known[name], here, numbers[here])
        keep = given[here]
        yield _vectors(rows, known[name], here[keep], component[keep], values[keep])


def _components(sheet: Sheet, prop: Property, here: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return (k,) positions in the property's vector of the (k,) rows `here`."""
    names, codes = sheet.strings("component", optional=True)
    expected = prop.components or ("",)
    positions = np.asarray([expected.index(str(n)) if str(n) in expected else -1 for n in names])
    found: NDArray[np.int64] = positions[codes[here]]
    wrong = np.flatnonzero(found < 0)
    if len(wrong):
        column = "component" if "component" in sheet.columns else "property"
        raise sheet.error(int(here[wrong[0]]), column, no_component(prop))
    return found


def _converted(
    sheet: Sheet, prop: Property, here: NDArray[np.int64], numbers: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the (k,) numbers of the rows `here` in the property's unit, whatever unit each row is in."""
    names, codes = sheet.strings("unit", optional=True)
    values = np.empty_like(numbers)
    for code in np.unique(codes[here]):
        mine = np.flatnonzero(codes[here] == code)
        at = here[mine]
        where = f"{sheet.source.name!r}, {sheet.where(int(at[0]))}, column 'unit'"
        by = unit_factor(prop, str(names[code]), where)
        values[mine] = in_unit(sheet, prop, "value", at=at, numbers=numbers[mine], by=by)
    return values


def _vectors(
    rows: Rows,
    prop: Property,
    at: NDArray[np.int64],
    component: NDArray[np.int64],
    values: NDArray[np.float64],
) -> Values:
    """Bring the numbers of each vector together: k·d rows and numbers to k rows and (k, d) values."""
    order = np.lexsort((at, component, rows.key[at]))
    at, component, values = at[order], component[order], values[order]
    key = rows.key[at]
    twice = np.flatnonzero((key[1:] == key[:-1]) & (component[1:] == component[:-1]))
    if len(twice):
        raise rows.twice(prop.name, int(at[twice[0]]), int(at[twice[0] + 1]))
    starts = np.flatnonzero(np.diff(key, prepend=-1))
    _check_complete(rows, prop, at, component, starts)
    origins = rows.origin[at].reshape(-1, prop.dimensions)
    mixed = np.flatnonzero((origins != origins[:, :1]).any(axis=1))
    if len(mixed):
        problem = f"differs among the components of {prop.name!r}: give one"
        raise rows.sheet.error(int(at[starts[mixed[0]]]), "origin", problem)
    return prop, at[starts], values.reshape(-1, prop.dimensions)


def _check_complete(
    rows: Rows, prop: Property, at: NDArray[np.int64], component: NDArray[np.int64], starts: NDArray[np.int64]
) -> None:
    lengths = np.diff(starts, append=len(at))
    short = np.flatnonzero(lengths != prop.dimensions)
    if len(short):
        start = starts[short[0]]
        present = set(component[start : start + lengths[short[0]]].tolist())
        lacking = next(name for position, name in enumerate(prop.components) if position not in present)
        raise rows.sheet.error(
            int(at[start]), "instance", f"has {prop.name!r} without {lacking!r}: give all components or none"
        )
