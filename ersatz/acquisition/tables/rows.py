"""What the rows of a sheet are about, and the checks both table layouts share."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ersatz.acquisition.tables.sheets import Sheet
from ersatz.acquisition.tables.units import factor, scale
from ersatz.errors import InputError, nearest
from ersatz.measurements import ORIGINS, Block, Origin, Property, Strings, out_of_range

IDS: Final = ("object_class", "instance", "observation", "origin")

Values: TypeAlias = tuple[Property, NDArray[np.int64], NDArray[np.float64]]
"""A property, the (n,) rows its values come from, and the (n, d) values in its unit."""


@dataclass(frozen=True, slots=True, eq=False)
class Keys:
    """What tells the n rows of a sheet apart.

    Attributes
    ----------
    sheet : Sheet
    observation : (n,) array of str
    key : (n,) int64 array
        Equal where instance and observation are.
    origin : (n,) int8 array
        Indices into ORIGINS.
    """

    sheet: Sheet
    observation: Strings
    key: NDArray[np.int64]
    origin: NDArray[np.int8]

    def twice(self, name: str, one: int, two: int) -> InputError:
        """Return the error that row `two` gives a property again that row `one` has given."""
        return self.sheet.error(
            two,
            "instance",
            f"has {name!r} of observation {str(self.observation[two])!r} already in {self.sheet.where(one)}: "
            "give every repetition an observation name of its own",
        )


@dataclass(frozen=True, slots=True, eq=False)
class Rows(Keys):
    """What each of the n rows of a sheet is about: whom, when, by whom.

    Attributes
    ----------
    object_class, instance : (n,) arrays of str
    """

    object_class: Strings
    instance: Strings

    def blocks(self, prop: Property, at: NDArray[np.int64], values: NDArray[np.float64]) -> Iterator[Block]:
        """Yield the values of one property, those of one origin a block."""
        for origin in np.unique(self.origin[at]):
            mine = np.flatnonzero(self.origin[at] == origin)
            row = at[mine]
            # Strings are dear to copy: a full column shares those of the sheet.
            whole = len(row) == len(self.sheet) and bool((np.diff(row) == 1).all())
            about = (self.object_class, self.instance, self.observation)
            who, which, when = about if whole else (names[row] for names in about)
            yield Block(prop, who, which, when, values[mine], ORIGINS[origin], self.sheet.source)


def read_rows(sheet: Sheet) -> Rows:
    """Read the columns object_class, instance, observation and origin.

    Raises
    ------
    InputError
        If a class or instance has no name, an instance has two classes, or an origin is unknown.
    """
    check_named(sheet)
    classes, class_code = sheet.strings("object_class")
    instances, instance_code = sheet.strings("instance")
    seen, seen_code = sheet.strings("observation", optional=True)
    first = np.full(len(instances), len(sheet), dtype=np.int64)
    np.minimum.at(first, instance_code, np.arange(len(sheet)))
    strays = np.flatnonzero(class_code[first[instance_code]] != class_code)
    if len(strays):
        row = int(strays[0])
        before = int(first[instance_code[row]])
        raise sheet.error(
            row,
            "object_class",
            f"is the class of {str(instances[instance_code[row]])!r}; in {sheet.where(before)} it is "
            f"{str(classes[class_code[before]])!r}: give two objects different names",
        )
    return Rows(
        sheet,
        seen[seen_code],
        instance_code * len(seen) + seen_code,
        origins(sheet),
        classes[class_code],
        instances[instance_code],
    )


def check_named(sheet: Sheet) -> None:
    """Check that every row names an object class and an instance.

    Raises
    ------
    InputError
        If a column is missing or a cell of it is empty.
    """
    for name in IDS[:2]:
        if name not in sheet.columns:
            near = nearest(name, sheet.columns, most=1)
            hint = f"rename {near[0]!r}" if near else f"it has {', '.join(map(repr, sheet.columns))}"
            raise InputError(f"{sheet.source.name!r} has no column {name!r}: {hint}")
        empty = np.flatnonzero((sheet.texts(name) == "").to_numpy())
        if len(empty):
            problem = "is no name: every row needs an object class and an instance"
            raise sheet.error(int(empty[0]), name, problem)


def origins(sheet: Sheet) -> NDArray[np.int8]:
    """Return (n,) indices into ORIGINS; an empty cell is `machine`."""
    names, codes = sheet.strings("origin", optional=True)
    indices = np.zeros(len(names), dtype=np.int8)
    for code, name in enumerate(map(str, names)):
        if name and name not in ORIGINS:
            raise sheet.error(int(np.argmax(codes == code)), "origin", f"must be one of {', '.join(ORIGINS)}")
        indices[code] = ORIGINS.index(Origin(name or Origin.MACHINE))
    return indices[codes]


def unit_factor(prop: Property, unit: str, where: str) -> Fraction:
    """Return what to multiply numbers in `unit` by; an empty unit is the property's own.

    Raises
    ------
    InputError
        If the unit is no plain multiple of the property's.
    """
    by = factor(unit or prop.unit, prop.unit)
    if by is None:
        raise InputError(
            f"{where}: {unit!r} is no multiple of {prop.unit!r}, the unit of {prop.name!r}: "
            f"convert the values to {prop.unit}"
        )
    return by


def in_unit(
    sheet: Sheet,
    prop: Property,
    column: str,
    *,
    at: NDArray[np.int64],
    numbers: NDArray[np.float64],
    by: Fraction,
) -> NDArray[np.float64]:
    """Return (k,) numbers of the (k,) rows `at` in the property's unit.

    Raises
    ------
    InputError
        If one is out of the range of a property ERSATZ knows itself.
    """
    scaled = scale(numbers, by)
    wrong, allowed = out_of_range(prop, scaled)
    if wrong.any():
        raise sheet.error(
            int(at[np.argmax(wrong)]),
            column,
            f"is out of range: {prop.label} is {allowed}; correct the value or its unit",
        )
    return scaled


def offer(name: str, known: Iterable[str], what: str = "property") -> str:
    """Return what to say of an unknown name: the nearest known ones, or all of them."""
    known = sorted(known)
    stem = name.partition(".")[0].partition("(")[0].strip()
    near = nearest(name, known) or nearest(stem, known)
    if near:
        return f"did you mean {' or '.join(map(repr, near))}?"
    return f"no {what} has a similar name; known are {', '.join(known)}"


def no_component(prop: Property) -> str:
    """Return what to say of a component the property does not have."""
    if not prop.components:
        return f"is no component: {prop.name!r} is one number, without components"
    return f"names no component of {prop.name!r}: it has {', '.join(prop.components)}"
