"""Properties that ERSATZ does not know by name, described in a TOML file beside the table that uses them.

`lab.csv` may come with `lab.properties.toml`, one table a property; `kind` is required, all else optional:

    [grip_width]
    kind = "physical"                       # or "functional"
    unit = "m"                              # "1", the default, for a dimensionless number
    components = ["near", "far"]            # only of a vector
    adjective = "wide to grip"
    orientation = "more = wider"
    definition = "Distance between the fingers of the gripper when it holds the object."
"""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from ersatz.acquisition.tables.files import read_toml
from ersatz.errors import InputError, nearest
from ersatz.measurements import Kind, Property

TEXTS: Final = ("unit", "adjective", "orientation", "definition")
_NAME: Final = re.compile(r"[a-z][a-z0-9]*(_[a-z0-9]+)*\Z")


def beside(path: Path) -> Path:
    """Return where the description of a table's own properties is looked for.

    >>> beside(Path("lab.csv.gz")).name
    'lab.properties.toml'
    """
    stem = path.name
    for ending in (".gz", Path(stem.removesuffix(".gz")).suffix):
        stem = stem.removesuffix(ending) if ending else stem
    return path.with_name(f"{stem}.properties.toml")


def read_properties(path: Path, known: Mapping[str, Property]) -> dict[str, Property]:
    """Return `known` and the properties a TOML file describes, by name.

    Raises
    ------
    InputError
        If the file is not TOML, a key or kind is unknown, a name is not snake_case, or a known property
        is described as something else.
    """
    tables, _ = read_toml(path)
    described = {name: _property(path.name, name, table) for name, table in tables.items()}
    for name, prop in described.items():
        if known.get(name, prop) != prop:
            raise InputError(
                f"{path.name!r} describes {name!r} as {prop}, but it is known as {known[name]}: "
                "give your property another name"
            )
    return {**known, **described}


def _property(file: str, name: str, table: Any) -> Property:
    _check_name(file, "property", name)
    if not isinstance(table, dict):
        raise InputError(f"{file!r}: {name} = {table!r} is not a property: write a table [{name}]")
    keys = ("kind", "components", *TEXTS)
    for key, value in table.items():
        if key not in keys:
            near = nearest(key, keys)
            hint = f"did you mean {near[0]!r}?" if near else f"known keys are {', '.join(keys)}"
            raise InputError(f"{file!r}, [{name}]: unknown key {key!r}: {hint}")
        if key in TEXTS and not isinstance(value, str):
            raise InputError(f"{file!r}, [{name}]: {key} = {value!r} is not text: put it in quotes")
    if table.get("kind") not in tuple(Kind):
        raise InputError(f"{file!r}, [{name}]: kind = {table.get('kind')!r} must be {' or '.join(Kind)}")
    components = table.get("components", [])
    if not isinstance(components, list) or len(set(map(str, components))) != len(components):
        raise InputError(f"{file!r}, [{name}]: components = {components!r} must be a list of different names")
    for component in components:
        _check_name(file, f"component of {name}", component)
    texts = {key: table[key] for key in TEXTS if key in table}
    return Property(name, Kind(table["kind"]), components=tuple(components), **texts)


def _check_name(file: str, what: str, name: Any) -> None:
    if not isinstance(name, str) or not _NAME.match(name):
        raise InputError(
            f"{file!r}: the {what} {name!r} is not named in snake_case: write it like 'grip_width'"
        )
