"""Tables of measured properties, CSV or Parquet, in two layouts.

Long, one number a row (recognised by its column `property`):

    object_class,instance,observation,property,component,value,unit,origin
    plate,plate_1,,weight,,279,g,machine
    plate,plate_1,,size,length,0.26,,

`observation`, `component`, `unit` and `origin` may be left out. Wide, one object or observation a row:

    object_class,instance,observation,weight [g],size.length,size.width,size.height
    plate,plate_1,,279,0.26,0.26,0.027

`observation` and `origin` may be left out. In both, an empty cell and nothing else is a missing value, an
empty unit is the property's own, and an empty origin is `machine`. A vector has all its components or none.
Properties without a name in `PROPERTIES` are described beside the table, see `property_files`.
"""

from collections.abc import Mapping
from pathlib import Path

from ersatz.acquisition.tables.long import read_long
from ersatz.acquisition.tables.property_files import beside, read_properties
from ersatz.acquisition.tables.rows import read_rows
from ersatz.acquisition.tables.sheets import read_sheet
from ersatz.acquisition.tables.wide import read_wide
from ersatz.errors import InputError
from ersatz.measurements import PROPERTIES, Block, Property


def read_table(path: Path, properties: Mapping[str, Property] | None = None) -> list[Block]:
    """Read one table, long or wide, into blocks of one property and origin each.

    Parameters
    ----------
    path : Path
        A .csv, .tsv, .csv.gz, .tsv.gz or .parquet file.
    properties : mapping of name to Property, optional
        The properties known by name; `PROPERTIES` if left out. `<stem>.properties.toml` adds to them.

    Returns
    -------
    list of Block
        Values in the unit of their property.

    Raises
    ------
    InputError
        If anything in the file is not what its layout asks for: the message tells file, line, column, value
        and what to do.
    """
    path = Path(path).absolute()
    known: Mapping[str, Property] = PROPERTIES if properties is None else properties
    if beside(path).exists():
        known = read_properties(beside(path), known)
    rows = read_rows(read_sheet(path))
    read = read_long if "property" in rows.sheet.columns else read_wide
    blocks = [block for values in read(rows, known) for block in rows.blocks(*values)]
    if not blocks:
        raise InputError(
            f"{path.name!r} holds no value: every cell of a property is empty; give at least one"
        )
    return blocks
