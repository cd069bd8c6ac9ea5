"""Reading the TOML file in which an expert describes object classes; `ersatz/data/expert.toml` is one.

    format = 1
    origin = "human"                       # or "synthetic"
    credit = "who says so"                 # optional

    [noise]                                # optional: how scans of one object scatter
    weight = "2 %"                         # of the value; a plain number is in the property's unit

    [correlations]                         # optional, in (-1, 1); "size" stands for each of its components
    "weight ~ size" = 0.6

    [classes.tray]
    instances = 5                          # or a list of names
    scans = 6
    weight = { family = "lognormal", median = 600, spread = 1.4, unit = "g", reason = "..." }
    size = { family = "normal", mean = [0.42, 0.30, 0.02], sd = [0.05, 0.04, 0.005], reason = "..." }
    support = { family = "beta", mean = 0.8, sd = 0.05, of = "footprint", reason = "..." }
    blockage = { family = "silhouette", fill = 1, reason = "..." }

Families and their parameters are those of `distributions`, and "silhouette", which derives blockage from
the drawn weight and size. With `of = "footprint"` (length x width) or `of = "box"` (length x width x height)
a distribution is of a share of the drawn size. `low` and `high` may be left out where the property has
natural limits. A class may have its own `correlations` and a `note`; a property its own `noise`.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any, Final

import numpy as np

from ersatz.acquisition.expert.distributions import PURE, Distribution, make, parameters
from ersatz.acquisition.expert.judgements import (
    EXTENTS,
    Correlations,
    Expert,
    ExpertClass,
    Judgement,
    Noise,
    Silhouette,
    correlation_matrix,
    scalars,
)
from ersatz.acquisition.tables.files import read_toml
from ersatz.acquisition.tables.property_files import beside, read_properties
from ersatz.acquisition.tables.rows import offer, unit_factor
from ersatz.errors import InputError
from ersatz.measurements import PROPERTIES, Origin, Property

__all__ = ["Expert", "ExpertClass", "read_expert"]

FORMAT: Final = 1
KEYS: Final = ("format", "origin", "credit", "noise", "correlations", "classes")
CLASS_KEYS: Final = ("instances", "scans", "note", "correlations")
COMMON: Final = ("family", "unit", "reason", "noise", "of")
SILHOUETTE: Final = "silhouette"

_SHARE: Final = re.compile(r"(\d+(?:\.\d+)?) ?%\Z")


@dataclass(frozen=True, slots=True)
class _Context:
    """What holds for the whole file."""

    file: str
    known: Mapping[str, Property]
    noise: Mapping[str, Noise]
    correlations: Correlations


def read_expert(path: Path) -> Expert:
    """Read an expert's file; `<stem>.properties.toml` beside it may describe further properties.

    Raises
    ------
    InputError
        If the file is not TOML, or a key, family, parameter, unit, correlation or name is not what it should
        be; the message tells the class and the property.
    """
    path = Path(path)
    table, source = read_toml(path)
    file = path.name
    _check_keys(table, KEYS, repr(file))
    if table.get("format") != FORMAT:
        raise InputError(
            f"{file!r}: format = {table.get('format')!r} must be {FORMAT}, the format this reads"
        )
    if table.get("origin", "human") not in (Origin.HUMAN, Origin.SYNTHETIC):
        raise InputError(f"{file!r}: origin = {table['origin']!r} must be 'human' or 'synthetic'")
    known = read_properties(beside(path), PROPERTIES) if beside(path).exists() else PROPERTIES
    noise = {
        _property(name, known, f"{file!r}, [noise]").name: _noise(value, f"{file!r}, [noise] {name}")
        for name, value in _table(table, "noise", repr(file)).items()
    }
    correlations = _correlations(_table(table, "correlations", repr(file)), known, repr(file))
    context = _Context(file, known, noise, correlations)
    classes = _table(table, "classes", repr(file))
    if not classes:
        raise InputError(f"{file!r} describes no class: add a table like [classes.tray]")
    credited = type(source)(source.name, source.sha256, _text(table, "credit", repr(file)))
    return Expert(
        tuple(_class(name, classes, context) for name in sorted(classes)),
        Origin(table.get("origin", "human")),
        credited,
    )


def _class(name: str, classes: Mapping[str, Any], context: _Context) -> ExpertClass:
    where = f"{context.file!r}, class {name!r}"
    if not name.strip():
        raise InputError(f"{where} has no name: name it")
    table = _table(classes, name, repr(context.file))
    judgements = tuple(
        _judgement(key, value, context, where)
        for key, value in sorted(table.items())
        if key not in CLASS_KEYS
    )
    if not judgements:
        raise InputError(f"{where} has no property: add one, like weight = {{ family = 'normal', ... }}")
    given = {judgement.property.name for judgement in judgements}
    for judgement in judgements:
        needed = ["weight", "size"] if isinstance(judgement.distributions, Silhouette) else []
        needed = ["size"] if judgement.of else needed
        if lacking := [name for name in needed if name not in given]:
            raise InputError(
                f"{where}: {judgement.property.name} follows from {' and '.join(needed)}: "
                f"give {lacking[0]}, too"
            )
    drawn = [scalar for judgement in judgements for scalar in judgement.scalars()]
    own = _correlations(_table(table, "correlations", where), context.known, where)
    for pair in own:
        for scalar in pair[:2]:
            if scalar not in drawn:
                raise InputError(
                    f"{where}: the correlation of {scalar!r} has no effect: it is not drawn; delete it"
                )
    # A share follows its object's size by itself; a class's own word comes later, and replaces the file's.
    shares = {judgement.property.name for judgement in judgements if judgement.of}
    general = tuple(pair for pair in context.correlations if not shares.intersection(pair[:2]))
    return ExpertClass(
        name,
        _instances(table, name, where),
        _count(table, "scans", where),
        judgements,
        _consistent(drawn, (*general, *own), where),
        _text(table, "note", where),
    )


def _instances(table: Mapping[str, Any], name: str, where: str) -> tuple[str, ...]:
    given = table.get("instances", 1)
    if isinstance(given, list):
        if not given or not all(isinstance(n, str) and n for n in given) or len(set(given)) != len(given):
            raise InputError(f"{where}: instances = {given!r} must be a number or a list of different names")
        return tuple(given)
    snake = re.sub(r"\W+", "_", name.strip().casefold())
    return tuple(f"{snake}_{number + 1}" for number in range(_count(table, "instances", where)))


def _judgement(name: str, table: Any, context: _Context, where: str) -> Judgement:
    prop = _property(name, context.known, where)
    where = f"{where}, {name}"
    if not isinstance(table, dict):
        raise InputError(f"{where} = {table!r} is no distribution: write {{ family = 'normal', ... }}")
    family = table.get("family")
    if not isinstance(family, str):
        raise InputError(f"{where}: family = {family!r} must be a name, like 'normal'")
    reason = _text(table, "reason", where)
    if not reason:
        raise InputError(f"{where} has no reason: say in a few words what the numbers rest on")
    noise = _noise(table["noise"], where) if "noise" in table else context.noise.get(name, Noise())
    if family == SILHOUETTE:
        return Judgement(prop, _silhouette(prop, table, where), noise, reason)
    try:
        _check_keys(table, (*parameters(family), *COMMON), where)
    except InputError as error:
        raise InputError(str(error) if str(error).startswith(where) else f"{where}: {error}") from None
    if "of" in table:
        return _share(prop, family, table, noise, where)
    by = unit_factor(prop, _text(table, "unit", where), where)
    parts = [_component(prop, family, table, position, by, where) for position in range(prop.dimensions)]
    return Judgement(prop, tuple(parts), noise, reason)


def _share(prop: Property, family: str, table: Mapping[str, Any], noise: Noise, where: str) -> Judgement:
    """Return a judgement of a share of the object's size, such as support = 0.9 of its footprint."""
    of = table["of"]
    if of not in EXTENTS or EXTENTS[of][0] != prop.unit or prop.components:
        raise InputError(
            f"{where}: of = {of!r} must be 'footprint', of an area in m2, or 'box', of a volume in l"
        )
    if "unit" in table:
        raise InputError(f"{where}: a share of the {of} has no unit: delete the unit")
    share = Property(prop.name, prop.kind)
    part = _component(share, family, {"low": 0.0, "high": 1.0, **table}, 0, Fraction(1), where)
    if part.low < 0 or part.high > 1:
        raise InputError(f"{where}: a share of the {of} lies between 0 and 1: correct low or high")
    return Judgement(prop, (part,), noise, _text(table, "reason", where), of)


def _component(
    prop: Property, family: str, table: Mapping[str, Any], position: int, by: Fraction, where: str
) -> Distribution:
    """Return the distribution of one component, within the natural limits of its property."""
    own = PROPERTIES.get(prop.name) == prop
    limits = {"low": 0.0 if own else -math.inf, "high": 1.0 if own and prop.unit == "1" else math.inf}
    if family == "lognormal":
        limits["low"] = max(limits["low"], 0.0)
    values = dict(limits)
    for key in parameters(family):
        if key in table:
            number = _number(table[key], prop, position, f"{where}: {key}")
            values[key] = number if key in PURE else number * by.numerator / by.denominator
    for key, sign in (("low", 1), ("high", -1)):
        if sign * values[key] < sign * limits[key]:
            raise InputError(
                f"{where}: {key} = {values[key]:g} is beyond {limits[key]:g}, where {prop.name} ends"
            )
    try:
        return make(family, **values)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None


def _silhouette(prop: Property, table: Mapping[str, Any], where: str) -> Silhouette:
    _check_keys(table, ("fill", *COMMON), where)
    if prop.name != "blockage" or PROPERTIES["blockage"] != prop:
        raise InputError(f"{where}: the family 'silhouette' is of blockage only: choose another")
    if "unit" in table:
        raise InputError(f"{where}: 'silhouette' follows from weight and size: delete the unit")
    fill = _number(table.get("fill"), prop, 0, f"{where}: fill")
    if not 0 < fill <= 1:
        raise InputError(f"{where}: fill = {fill:g} must be above 0 and at most 1")
    return Silhouette(fill)


def _number(value: Any, prop: Property, position: int, where: str) -> float:
    """Return a parameter of one component; a list has one number a component."""
    if isinstance(value, list):
        if len(value) != prop.dimensions or not prop.components:
            wanted = f"{len(prop.components)} numbers" if prop.components else "one number"
            raise InputError(f"{where} = {value!r} must be {wanted}")
        value = value[position]
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise InputError(f"{where} = {value!r} must be a finite number")
    return float(value)


def _noise(value: Any, where: str) -> Noise:
    share = _SHARE.match(value) if isinstance(value, str) else None
    if share:
        return Noise(float(share[1]) / 100, relative=True)
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value < math.inf:
        raise InputError(f"{where}: noise = {value!r} must be a number, 0 or more, or a share like '2 %'")
    return Noise(float(value))


def _correlations(table: Mapping[str, Any], known: Mapping[str, Property], where: str) -> Correlations:
    """Return the pairs of scalars a table like { "weight ~ size" = 0.6 } ties together."""
    found: dict[tuple[str, str], float] = {}
    for pair, strength in table.items():
        names = [name.strip() for name in pair.split("~")]
        if len(names) != 2:
            raise InputError(f"{where}: the correlation {pair!r} must name two, like 'weight ~ size.length'")
        if isinstance(strength, bool) or not isinstance(strength, int | float) or not -1 < strength < 1:
            raise InputError(f"{where}: the correlation {pair!r} = {strength!r} must lie between -1 and 1")
        one, two = (_scalars(name, known, where) for name in names)
        for key in {(min(a, b), max(a, b)) for a in one for b in two if a != b}:
            if found.get(key, strength) != strength:
                raise InputError(
                    f"{where}: the correlation of {key[0]!r} and {key[1]!r} is given twice: delete one"
                )
            found[key] = float(strength)
        if one == two and len(one) == 1:
            raise InputError(f"{where}: the correlation {pair!r} is of a number with itself: delete it")
    return tuple((a, b, strength) for (a, b), strength in sorted(found.items()))


def _scalars(name: str, known: Mapping[str, Property], where: str) -> tuple[str, ...]:
    prop = _property(name.partition(".")[0], known, f"{where}, [correlations]")
    if name == prop.name:
        return scalars(prop)
    if name not in scalars(prop):
        raise InputError(
            f"{where}: the correlation of {name!r} is of no number: choose {', '.join(scalars(prop))}"
        )
    return (name,)


def _consistent(names: list[str], correlations: Correlations, where: str) -> Correlations:
    smallest = float(np.linalg.eigvalsh(correlation_matrix(names, correlations))[0])
    if smallest < 1e-6:
        raise InputError(
            f"{where}: the correlations contradict each other (not positive definite, smallest eigenvalue "
            f"{smallest:.2g}): weaken the strongest, or tie the others, too"
        )
    return correlations


def _property(name: str, known: Mapping[str, Property], where: str) -> Property:
    if name not in known:
        raise InputError(
            f"{where}: {name!r} is neither a key nor a property: {offer(name, [*known, *CLASS_KEYS])}"
        )
    return known[name]


def _check_keys(table: Mapping[str, Any], keys: tuple[str, ...], where: str) -> None:
    for key in table:
        if key not in keys:
            raise InputError(f"{where}: unknown key {key!r}: {offer(key, keys, 'key')}")


def _table(table: Mapping[str, Any], key: str, where: str) -> dict[str, Any]:
    value = table.get(key, {})
    if not isinstance(value, dict):
        raise InputError(f"{where}: {key} = {value!r} must be a table: write [{key}]")
    return value


def _text(table: Mapping[str, Any], key: str, where: str) -> str:
    value = table.get(key, "")
    if not isinstance(value, str):
        raise InputError(f"{where}: {key} = {value!r} must be text: put it in quotes")
    return value


def _count(table: Mapping[str, Any], key: str, where: str) -> int:
    value = table.get(key, 1)
    if isinstance(value, bool) or not isinstance(value, int) or value < 1:
        raise InputError(f"{where}: {key} = {value!r} must be a whole number, 1 or more")
    return value
