"""The folder layout of RoCS, a robot-centric data set by the paper's authors (Thosar et al. 2021).

One CSV a property, one row a repetition: `paper_box_4_6` is repetition 6 on the instance `paper_box_4` of the
class "paper box". Its functional properties are published as concatenations of physical values.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ersatz.acquisition.tables.sheets import Sheet, read_sheet
from ersatz.errors import InputError
from ersatz.measurements import Block, Kind, Origin, Property, Strings

CREDIT: Final = "RoCS: Thosar et al. 2021"

_EXTENTS: Final = ("length", "width", "height")
_CONCATENATION: Final = "Concatenation of physical values, as published: "

ROCS_PROPERTIES: Final[dict[str, Property]] = {
    p.name: p
    for p in (
        Property(
            "size",
            Kind.PHYSICAL,
            components=_EXTENTS,
            orientation="1 = the largest extent",
            definition="Extents of the bounding box divided by the largest: proportions, without a scale.",
        ),
        Property(
            "flatness",
            Kind.PHYSICAL,
            adjective="flat",
            orientation="1 = one plane",
            definition="Share of the points seen from above that lie in one plane.",
        ),
        Property(
            "weight", Kind.PHYSICAL, "kg", adjective="heavy", orientation="more = heavier", definition="Mass."
        ),
        Property(
            "rigidity",
            Kind.PHYSICAL,
            adjective="rigid",
            orientation="1 = does not deform; below 0 where a press deformed it beyond the scale's end",
            definition="1 minus the published value, which is the deformation under a press of the robot.",
        ),
        Property(
            "roughness",
            Kind.PHYSICAL,
            adjective="rough",
            orientation="more = harder to slide",
            definition="Resistance of the surface to sliding.",
        ),
        Property(
            "hollowness",
            Kind.PHYSICAL,
            adjective="hollow",
            orientation="1 = nearly all cavity; slightly below 0 by sensor noise",
            definition="Depth of the object's cavity relative to its height.",
        ),
        Property(
            "support",
            Kind.FUNCTIONAL,
            components=("flatness", "rigidity", *_EXTENTS),
            adjective="able to support",
            orientation="more = flatter, more rigid, bulkier",
            definition=f"{_CONCATENATION}flatness, rigidity (1 minus the published deformation) and size.",
        ),
        Property(
            "containment",
            Kind.FUNCTIONAL,
            components=(*_EXTENTS, "hollowness"),
            adjective="able to contain",
            orientation="more = bulkier and more hollow",
            definition=f"{_CONCATENATION}size and hollowness.",
        ),
        Property(
            "movability",
            Kind.FUNCTIONAL,
            components=("weight", "roughness"),
            orientation="more = heavier and rougher, so harder to move",
            definition=f"{_CONCATENATION}weight in kg and roughness.",
        ),
        Property(
            "blockage",
            Kind.FUNCTIONAL,
            components=("inv_weight", "inv_roughness"),
            orientation="more = lighter and smoother, so easier to push away",
            definition=f"{_CONCATENATION}weight in kg and roughness, both negated.",
        ),
    )
}
"""RoCS's own ten properties. They share names with ERSATZ's, not scales: the two never go into one KB."""

INVERTED: Final = ("rigidity",)
"""Components published as their opposite: as "rigidity", RoCS has the deformation."""

HEADERS: Final[dict[tuple[str, ...], tuple[str, ...]]] = {
    ("instance_name", "length", "width", "hollowness"): ("instance_name", *_EXTENTS, "hollowness"),
}
"""containment.csv has four values under three names."""


def read_rocs(folder: Path) -> list[Block]:
    """Read the ten tables of a RoCS folder.

    Parameters
    ----------
    folder : Path
        Holds size.csv, weight.csv, ... as published.

    Returns
    -------
    list of Block
        One a property, rows in ascending order of (instance, repetition).

    Raises
    ------
    InputError
        If a table is missing or is not as published, a value is missing, or the tables are not about the
        same repetitions.
    """
    folder = Path(folder)
    if not folder.is_dir():
        problem = "is a file" if folder.exists() else "does not exist"
        raise InputError(f"the RoCS folder {str(folder)!r} {problem}: give the folder that holds size.csv")
    lacking = [f"{name}.csv" for name in ROCS_PROPERTIES if not (folder / f"{name}.csv").exists()]
    if lacking:
        raise InputError(f"{str(folder)!r} is no RoCS folder: it lacks {', '.join(lacking)}")
    blocks = []
    names: _Names | None = None
    for prop in ROCS_PROPERTIES.values():
        sheet = read_sheet(folder / f"{prop.name}.csv", HEADERS, CREDIT)
        mine, order = _names(sheet)
        names = names or mine
        _check_same(names, mine)
        values = _values(sheet, prop)[order]
        blocks.append(
            Block(
                prop, mine.object_class, mine.instance, mine.repetition, values, Origin.MACHINE, sheet.source
            )
        )
    return blocks


@dataclass(frozen=True, slots=True, eq=False)
class _Names:
    """Whom the rows of a table are about, in ascending order of the published names."""

    file: str
    published: Strings
    object_class: Strings
    instance: Strings
    repetition: Strings


def _names(sheet: Sheet) -> tuple[_Names, NDArray[np.int64]]:
    """Split the published names; also return the order of rows that sorts them."""
    import polars as pl

    if "instance_name" not in sheet.columns:
        raise InputError(f"{sheet.source.name!r} has no column 'instance_name': it is no table of RoCS")
    published = sheet.texts("instance_name")
    parts = published.str.extract_groups(r"^((?:[a-z]+_)+\d+)_(\d+)$").struct.unnest()
    wrong = parts["1"].is_null().arg_max()
    if wrong is not None and parts["1"][wrong] is None:
        raise sheet.error(wrong, "instance_name", "is not named <class>_<number>_<repetition>: correct it")
    frame = parts.with_columns(
        name=published,
        label=parts["1"].str.replace(r"_\d+$", "").str.replace_all("_", " ", literal=True),
        row=pl.int_range(len(published)),
    ).sort("name")
    twice = frame.filter(pl.col("name").is_duplicated())
    if len(twice):
        raise sheet.error(int(twice["row"][1]), "instance_name", "stands for two rows: delete one")
    strings = np.dtypes.StringDType()
    published_names, labels, instances, repetitions = (
        np.asarray(frame[column].to_list(), dtype=strings) for column in ("name", "label", "1", "2")
    )
    names = _Names(sheet.source.name, published_names, labels, instances, repetitions)
    return names, frame["row"].to_numpy().astype(np.int64)


def _check_same(one: _Names, two: _Names) -> None:
    for holder, other in ((one, two), (two, one)):
        only = np.setdiff1d(holder.published, other.published)
        if len(only):
            raise InputError(
                f"{other.file!r} has no row {str(only[0])!r}, which {holder.file!r} has: "
                "RoCS has every property of every repetition; add the row"
            )


def _values(sheet: Sheet, prop: Property) -> NDArray[np.float64]:
    """Return the (n, d) values of a table, in the order of its rows."""
    expected = prop.components or (prop.name,)
    if sheet.columns != ("instance_name", *expected):
        raise InputError(
            f"{sheet.source.name!r} has the columns {', '.join(sheet.columns)}, where RoCS has "
            f"instance_name, {', '.join(expected)}: restore its header"
        )
    columns = []
    for name in expected:
        numbers = sheet.numbers(name)
        missing = np.flatnonzero(np.isnan(numbers))
        if len(missing):
            raise sheet.error(int(missing[0]), name, "is missing: RoCS has a value in every cell")
        columns.append(1.0 - numbers if name in INVERTED else numbers)
    return np.stack(columns, axis=1)
