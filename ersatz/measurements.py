"""Measurements and Property: the columnar table that everything before grounding fills and grounding reads.

One value is one row of one property's column: (object class, instance, observation, value vector,
origin, source). Missing values are absent rows. Nothing here knows how a value was obtained.
"""

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ersatz.errors import InputError

DIGITS: Final = 12
"""Fraction digits of every number kept: what is computed with is what is stored, to the last digit."""

LARGEST: Final = 1e15
"""Values must be smaller than this in magnitude, so that every SPARQL engine can compute with them."""

Strings: TypeAlias = NDArray[Any]
"""An array of numpy's variable-width strings (StringDType)."""


class Kind(StrEnum):
    """Whether a property describes an object's physique or its ability (paper: P and F)."""

    PHYSICAL = "physical"
    FUNCTIONAL = "functional"


class Origin(StrEnum):
    """Where a value comes from: a sensor, an expert's judgement, or a model rather than a thing."""

    MACHINE = "machine"
    HUMAN = "human"
    SYNTHETIC = "synthetic"


ORIGINS: Final = tuple(Origin)


@dataclass(frozen=True, slots=True)
class Property:
    """A physical or functional property and how its numbers are to be read.

    Attributes
    ----------
    name : str
        Identifier in snake_case; qualities are called `<name>_<rank>`.
    kind : Kind
        Physical or functional.
    unit : str
        The unit of every component: "kg", "m", "l", "m2", "kg m2", or "1" for a dimensionless number.
    components : tuple of str
        Names of the dimensions of a vector, in order; empty for a scalar.
    adjective : str
        What a thing with much of it is: "as *rigid* as a tray". Empty if language has no word.
    orientation : str
        Which end of the scale is "more".
    definition : str
        What is measured, in one sentence.
    """

    name: str
    kind: Kind
    unit: str = "1"
    components: tuple[str, ...] = ()
    adjective: str = ""
    orientation: str = ""
    definition: str = ""

    def __post_init__(self) -> None:
        """Refuse names that are not snake_case."""
        for name in (self.name, *self.components):
            if not re.fullmatch(r"[^\W\d]\w*", name) or name != name.lower():
                raise InputError(f"{name!r} is no name of a property: use snake_case, such as 'bend_radius'")

    @property
    def label(self) -> str:
        """The name as a person writes it."""
        return self.name.replace("_", " ")

    @property
    def dimensions(self) -> int:
        """The length of a value vector."""
        return len(self.components) or 1


def _shape_response(rank: int) -> Property:
    return Property(
        f"shape_{rank}",
        Kind.PHYSICAL,
        orientation="1 = just like the concept's exemplars",
        definition=f"Response of the object's shape to shape concept {rank}, learned without labels.",
    )


PROPERTIES: Final[dict[str, Property]] = {
    p.name: p
    for p in (
        *map(_shape_response, range(1, 5)),
        Property(
            "size",
            Kind.PHYSICAL,
            "m",
            ("length", "width", "height"),
            adjective="large",
            orientation="more = larger",
            definition="Extents of the oriented bounding box, longest first.",
        ),
        Property(
            "flatness",
            Kind.PHYSICAL,
            adjective="flat",
            orientation="1 = one plane",
            definition="Share of the upper surface that lies in its dominant plane.",
        ),
        Property(
            "weight",
            Kind.PHYSICAL,
            "kg",
            adjective="heavy",
            orientation="more = heavier",
            definition="Mass of the object with its usual contents.",
        ),
        Property(
            "rigidity",
            Kind.PHYSICAL,
            adjective="rigid",
            orientation="1 = does not deform, 0 = limp",
            definition="Resistance to deformation when pressed by hand.",
        ),
        Property(
            "hollowness",
            Kind.PHYSICAL,
            adjective="hollow",
            orientation="1 = nearly all cavity",
            definition="Volume of the open cavity over the volume of the convex hull.",
        ),
        Property(
            "support",
            Kind.FUNCTIONAL,
            "m2",
            adjective="able to support",
            orientation="more = more can be put on it",
            definition="Area of the stable upper surface other things can rest on.",
        ),
        Property(
            "containment",
            Kind.FUNCTIONAL,
            "l",
            adjective="able to contain",
            orientation="more = holds more",
            definition="Volume that can be filled into the object from above.",
        ),
        Property(
            "blockage",
            Kind.FUNCTIONAL,
            "kg m2",
            adjective="able to block",
            orientation="more = harder to get past or to push away",
            definition="Mass times mean silhouette area.",
        ),
    )
}
"""The properties ERSATZ knows by name; a table may bring others and say what they are."""


def out_of_range(prop: Property, values: NDArray[np.float64]) -> tuple[NDArray[np.bool_], str]:
    """Return which values a property ERSATZ knows itself cannot have, and in words which it can.

    All of those are non-negative, and the dimensionless ones are shares of something.
    """
    known = PROPERTIES.get(prop.name) == prop
    top = 1.0 if known and prop.unit == "1" else np.inf
    wrong = (values < 0) | (values > top) if known else np.zeros(values.shape, dtype=bool)
    return wrong, "between 0 and 1" if top == 1 else "0 or more"


def rounded(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the values rounded to `DIGITS` fraction digits, as all numbers are that are kept.

    From 8192 on, floats have fewer digits than that; there `numpy.round` would only add an error.
    Adding 0.0 turns -0.0 into 0.0, which would else be a different number once written down.
    """
    kept: NDArray[np.float64] = np.where(np.abs(values) < 8192, np.round(values, DIGITS), values) + 0.0
    return kept


@dataclass(frozen=True, slots=True)
class Source:
    """Where values were read from: a file's base name and the SHA-256 of its content, and whom to credit."""

    name: str
    sha256: str = ""
    credit: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """Values of one property as a reader finds them, in any order; the input of `Measurements.collect`.

    Attributes
    ----------
    property : Property
    object_class, instance, observation : sequences of n str
        An empty observation means "of the instance as a whole".
    values : (n, d) array, in the property's unit
        d = `property.dimensions`; (n,) is accepted where d is 1.
    origin : Origin
    source : Source
    """

    property: Property
    object_class: Sequence[str] | Strings
    instance: Sequence[str] | Strings
    observation: Sequence[str] | Strings
    values: NDArray[np.float64]
    origin: Origin
    source: Source


@dataclass(frozen=True, slots=True, eq=False)
class Column:
    """All values of one property, rows in ascending order of (instance, observation).

    Attributes
    ----------
    property : Property
    instance, observation : (n,) int32 arrays
        Indices into `Measurements.instances` and `.observations`.
    values : (n, d) float64 array, in the property's unit, rounded to `DIGITS` fraction digits
    origin : (n,) int8 array
        Indices into `ORIGINS`.
    source : (n,) int32 array
        Indices into `Measurements.sources`.
    """

    property: Property
    instance: NDArray[np.int32]
    observation: NDArray[np.int32]
    values: NDArray[np.float64]
    origin: NDArray[np.int8]
    source: NDArray[np.int32]

    def __len__(self) -> int:
        """Return the number of values."""
        return len(self.values)


@dataclass(frozen=True, slots=True, eq=False)
class Measurements:
    """Everything measured of all objects, whatever the order it was read in.

    Attributes
    ----------
    classes : tuple of str
        Object class labels, sorted.
    instances : (m,) array of str
        Instance names, sorted by class and name; a name belongs to one class only.
    instance_class : (m,) int32 array
        Index of each instance's class.
    observations : tuple of str
        Observation names, sorted; "" is "of the instance as a whole".
    sources : tuple of Source
    columns : tuple of Column
        One a property, sorted by the property's name.
    """

    classes: tuple[str, ...]
    instances: Strings
    instance_class: NDArray[np.int32]
    observations: tuple[str, ...]
    sources: tuple[Source, ...]
    columns: tuple[Column, ...]

    @property
    def properties(self) -> tuple[Property, ...]:
        """The properties measured, in the order of the columns."""
        return tuple(column.property for column in self.columns)

    @classmethod
    def collect(cls, blocks: Iterable[Block]) -> "Measurements":
        """Bring what readers found into one table, independent of the order of blocks and rows.

        Raises
        ------
        InputError
            If there is no value at all; a value is NaN, infinite or out of range; a name is empty; an
            instance belongs to two classes; one (instance, observation, property) has two values; or
            one property comes with two definitions.
        """
        blocks = [block for block in blocks if len(block.values)]
        if not blocks:
            raise InputError(
                "no measurements: the input holds no value at all; give a table with at least one row"
            )
        classes_of = [_strings(block.object_class) for block in blocks]
        names_of = [_strings(block.instance) for block in blocks]
        seen_of = [_strings(block.observation) for block in blocks]
        classes, class_code = _coded(classes_of)
        names, name_code = _coded(names_of)
        observations, seen_code = _coded(seen_of)
        if classes[0] == "" or names[0] == "":
            raise InputError("empty name: every row needs an object class and an instance")
        sources = tuple(
            sorted({block.source for block in blocks}, key=lambda s: (s.name, s.sha256, s.credit))
        )

        class_of_name = np.empty(len(names), dtype=np.int32)
        class_of_name[name_code] = class_code
        strays = np.flatnonzero(class_of_name[name_code] != class_code)
        if len(strays):
            row = strays[0]
            one, two = sorted((str(classes[class_code[row]]), str(classes[class_of_name[name_code[row]]])))
            raise InputError(
                f"instance {str(names[name_code[row]])!r} is said to be of class {one!r} and "
                f"of class {two!r}: an instance has one class; give the two objects different names"
            )
        order = np.lexsort((np.arange(len(names)), class_of_name))
        position = np.empty(len(names), dtype=np.int32)
        position[order] = np.arange(len(names), dtype=np.int32)

        ends = np.cumsum([len(names_of_block) for names_of_block in names_of])
        rows: dict[str, list[tuple[Block, slice]]] = {}
        for block, end, named in zip(blocks, ends, names_of, strict=True):
            rows.setdefault(block.property.name, []).append((block, slice(end - len(named), end)))
        columns = tuple(
            _column(parts, position[name_code], seen_code, sources, names[order], observations)
            for _, parts in sorted(rows.items())
        )
        return cls(
            tuple(map(str, classes)),
            names[order],
            class_of_name[order],
            tuple(map(str, observations)),
            sources,
            columns,
        )

    def blocks(self) -> Iterator[Block]:
        """Yield the table as blocks, so that tables can be joined: `collect([*a.blocks(), *b.blocks()])`."""
        labels = np.asarray(self.classes, dtype=np.dtypes.StringDType())
        seen = np.asarray(self.observations, dtype=np.dtypes.StringDType())
        for column in self.columns:
            for origin, source in sorted(
                set(zip(column.origin.tolist(), column.source.tolist(), strict=True))
            ):
                rows = (column.origin == origin) & (column.source == source)
                instance = column.instance[rows]
                yield Block(
                    column.property,
                    labels[self.instance_class[instance]],
                    self.instances[instance],
                    seen[column.observation[rows]],
                    column.values[rows],
                    ORIGINS[origin],
                    self.sources[source],
                )


def instance_names(blocks: Iterable[Block]) -> dict[str, list[str]]:
    """Return the names of the instances the blocks are of, sorted, by object class."""
    names: dict[str, set[str]] = {}
    for block in blocks:
        for label, instance in zip(map(str, block.object_class), map(str, block.instance), strict=True):
            names.setdefault(label, set()).add(instance)
    return {label: sorted(of) for label, of in sorted(names.items())}


def unmeasured(judged: Iterable[Block], measured: Iterable[Block]) -> list[Block]:
    """Return the judged values of what was not measured: a measurement beats an expert's word."""
    taken: dict[str, set[str]] = {}
    for block in measured:
        taken.setdefault(block.property.name, set()).update(map(str, block.instance))
    kept = []
    for block in judged:
        known = taken.get(block.property.name, set())
        rows = np.array([str(instance) not in known for instance in block.instance], dtype=bool)
        kept.append(
            replace(
                block,
                object_class=_strings(block.object_class)[rows],
                instance=_strings(block.instance)[rows],
                observation=_strings(block.observation)[rows],
                values=block.values[rows],
            )
        )
    return kept


def _coded(parts: list[Strings]) -> tuple[Strings, NDArray[np.int64]]:
    """Return the distinct strings of all parts, sorted, and the index of each string.

    The index of first occurrence is asked for because that takes numpy's stable sort: its quicksort of many
    variable-width strings can end in a segmentation fault (numpy 2.4).
    """
    distinct, _, codes = np.unique(np.concatenate(parts), return_index=True, return_inverse=True)
    return distinct, codes


def _strings(names: Sequence[str] | Strings) -> Strings:
    return np.asarray(names, dtype=np.dtypes.StringDType())


def _column(
    parts: list[tuple[Block, slice]],
    instance_code: NDArray[np.int32],
    seen_code: NDArray[np.int64],
    sources: tuple[Source, ...],
    instances: Strings,
    observations: Strings,
) -> Column:
    prop = parts[0][0].property
    for block, _ in parts:
        if block.property != prop:
            raise InputError(
                f"property {prop.name!r} comes with two definitions: {prop} and {block.property}"
            )
    values = np.concatenate(
        [checked(prop, block.values, block.source, block.instance.__getitem__) for block, _ in parts]
    )
    instance = np.concatenate([instance_code[rows] for _, rows in parts]).astype(np.int32)
    observation = np.concatenate([seen_code[rows] for _, rows in parts]).astype(np.int32)
    origin = np.concatenate([np.full(len(b.values), ORIGINS.index(b.origin), np.int8) for b, _ in parts])
    source = np.concatenate([np.full(len(b.values), sources.index(b.source), np.int32) for b, _ in parts])
    names = instances.__getitem__
    return in_order(Column(prop, instance, observation, values, origin, source), observations, names)


def in_order(column: Column, observations: Strings | Sequence[str], name: Callable[[int], object]) -> Column:
    """Return the column with its rows in order.

    Parameters
    ----------
    column : Column
        Rows in any order.
    observations : sequence of str
        What `column.observation` stands for.
    name : callable
        Gives the name of the instance with an index.

    Raises
    ------
    InputError
        If one (instance, observation) has two values, or an instance has a value of its own beside values
        of observations.
    """
    if (column.instance[1:] > column.instance[:-1]).all():
        return column
    order = np.lexsort((column.observation, column.instance))
    instance, observation = column.instance[order], column.observation[order]
    twice = np.flatnonzero((instance[1:] == instance[:-1]) & (observation[1:] == observation[:-1]))
    if len(twice):
        row = twice[0]
        raise InputError(
            f"{column.property.name!r} of instance {str(name(instance[row]))!r} has two values for "
            f"observation {str(observations[observation[row]])!r}: "
            "give every repetition an observation name of its own"
        )
    unnamed = np.array([str(one) == "" for one in observations])
    mixed = np.flatnonzero((instance[1:] == instance[:-1]) & unnamed[observation[:-1]])
    if len(mixed):
        raise InputError(
            f"{column.property.name!r} of instance {str(name(instance[mixed[0]]))!r} has a value of the "
            "whole instance and values of observations: name every observation, or none"
        )
    return Column(
        column.property,
        instance,
        observation,
        column.values[order],
        column.origin[order],
        column.source[order],
    )


def checked(
    prop: Property, given: NDArray[np.float64], source: Source, name: Callable[[int], object]
) -> NDArray[np.float64]:
    """Return (n, d) values of a property, rounded.

    Parameters
    ----------
    prop : Property
    given : (n, d) array, or (n,) where d is 1, in the property's unit
    source : Source
    name : callable
        Gives the name of the instance of a row.

    Raises
    ------
    InputError
        If there are not as many components as the property has, or a number is out of range.
    """
    values = np.asarray(given, dtype=np.float64)
    values = values[:, None] if values.ndim == 1 else values
    if values.ndim != 2 or values.shape[1] != prop.dimensions:
        raise InputError(
            f"{prop.name!r} has {prop.dimensions} component(s) {list(prop.components)}, "
            f"but the values of {source.name!r} have shape {values.shape}"
        )
    bad = np.flatnonzero(~(np.abs(values) < LARGEST).all(axis=1))
    if len(bad):
        row = bad[0]
        value = values[row, ~(np.abs(values[row]) < LARGEST)][0]
        raise InputError(
            f"{prop.name!r} of instance {str(name(row))!r} is {value} in {source.name!r}: "
            f"values must be finite and below {LARGEST:g}; leave a missing value out"
        )
    return rounded(values)
