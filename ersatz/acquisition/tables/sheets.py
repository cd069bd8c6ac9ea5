"""A sheet: the cells of a CSV, TSV or Parquet file before anybody knows what they mean.

Cells stay text until a column is asked for as numbers, so that an error can quote the file and the line.
"""

import csv
import re
from collections.abc import Mapping
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from ersatz.acquisition.tables.files import read_bytes, without_bom
from ersatz.errors import InputError
from ersatz.measurements import LARGEST, Source, Strings

if TYPE_CHECKING:
    import polars as pl

SEPARATORS: Final = {".csv": ",", ".tsv": "\t"}
PARQUET: Final = (".parquet", ".pq")
LARGE: Final = 1 << 28
"""A Parquet file of more bytes than this is read in parts."""

NO_VALUE: Final = frozenset({"na", "n/a", "nan", "null", "none", "nil", "-", "--", "?", "missing", "unknown"})

_QUOTED: Final = re.compile(rb'"(?:[^"]|"")*"')
_COMMA: Final = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}\Z")
"""Either a decimal comma or one between thousands."""
_DECIMAL_COMMA: Final = re.compile(r"[+-]?\d+,\d+\Z")


@dataclass(frozen=True, slots=True, eq=False)
class Sheet:
    """The cells of one file.

    Attributes
    ----------
    source : Source
    columns : tuple of str
        Distinct and not empty.
    frame : polars.DataFrame
        One row at least; text for CSV and TSV, typed for Parquet.
    first_line : int or None
        The line of the first row, if row i is line `first_line` + i of the file.
    rows_before : int
        Rows of the file before the first of these.
    """

    source: Source
    columns: tuple[str, ...]
    frame: "pl.DataFrame"
    first_line: int | None
    rows_before: int = 0

    def __len__(self) -> int:
        """Return the number of rows."""
        return int(self.frame.height)

    def error(self, row: int, column: str, problem: str) -> InputError:
        """Return an error that says where: file, line (or row, counted from 1), column, value."""
        cell = self.frame[column][row]
        quoted = repr("" if cell is None else str(cell))
        return InputError(f"{self.source.name!r}, {self.where(row)}, column {column!r}: {quoted} {problem}")

    def where(self, row: int) -> str:
        """Return how a person finds row i of the frame: its line, or its number counted from 1."""
        number = row + self.rows_before
        return f"row {number + 1}" if self.first_line is None else f"line {number + self.first_line}"

    def texts(self, column: str) -> "pl.Series":
        """Return (n,) texts without surrounding blanks, "" where a cell is empty.

        Raises
        ------
        InputError
            If a Parquet column holds anything but texts, categories or whole numbers.
        """
        import polars as pl

        cells = self.frame[column]
        kind = cells.dtype
        if not (kind in (pl.String, pl.Categorical, pl.Enum, pl.Null) or kind.is_integer()):
            raise InputError(f"{self.source.name!r}, column {column!r} holds {kind}: store names as text")
        return cells.cast(pl.String).fill_null("").str.strip_chars()

    def strings(self, column: str, *, optional: bool = False) -> tuple[Strings, NDArray[np.int64]]:
        """Return the distinct texts, sorted, and (n,) indices into them; an optional column may be absent."""
        if optional and column not in self.columns:
            return np.asarray([""], dtype=np.dtypes.StringDType()), np.zeros(len(self), dtype=np.int64)
        import polars as pl

        texts = self.texts(column)
        distinct = texts.unique().sort()
        codes = texts.cast(pl.Enum(distinct)).to_physical().to_numpy().astype(np.int64)
        return np.asarray(distinct.to_list(), dtype=np.dtypes.StringDType()), codes

    def numbers(self, column: str) -> NDArray[np.float64]:
        """Return (n,) numbers as they stand in the file, NaN where a cell is empty, and only there.

        Raises
        ------
        InputError
            If a cell is neither empty nor a finite number below `LARGEST` in magnitude.
        """
        import polars as pl

        cells = self.frame[column]
        if cells.dtype in (pl.Boolean, pl.List, pl.Array, pl.Struct) or cells.dtype.is_temporal():
            raise InputError(
                f"{self.source.name!r}, column {column!r} holds {cells.dtype}: store one number a cell"
            )
        if cells.dtype.is_numeric() or cells.dtype == pl.Null:
            parsed, given = cells.cast(pl.Float64), cells.is_not_null()
        else:
            texts = self.texts(column)
            parsed, given = texts.cast(pl.Float64, strict=False), texts != ""
        values: NDArray[np.float64] = parsed.fill_null(float("nan")).to_numpy().astype(np.float64)
        wrong = np.flatnonzero(given.to_numpy() & ~(np.abs(values) < LARGEST))
        if len(wrong):
            raise self.error(int(wrong[0]), column, _advice(str(cells[int(wrong[0])])))
        return values


def _advice(cell: str) -> str:
    text = cell.strip().casefold()
    if text in NO_VALUE:
        return "is not a number: leave the cell of a missing value empty"
    if text.lstrip("+-") in ("inf", "infinity"):
        return "is infinite: values must be finite; leave the cell of a missing value empty"
    if _COMMA.match(text):
        return f"is not a number: write {text.replace(',', '')} or {text.replace(',', '.')}, as it is meant"
    if _DECIMAL_COMMA.match(text):
        return "is not a number: write a decimal point, not a comma"
    try:
        float(text)
    except ValueError:
        return "is not a number: write it like 0.25, with the unit in the header or the column 'unit'"
    return f"is out of range: values must be below {LARGEST:g} and written like 0.25"


def in_parts(table: str | Path, *, anyway: bool = False) -> bool:
    """Tell whether a table is read in parts: a directory, a URL, or a large Parquet file; `anyway` any."""
    path = Path(table)
    if "://" in str(table) or path.is_dir():
        return True
    large = path.suffix.lower() in PARQUET and path.is_file() and path.stat().st_size > LARGE
    return large or (anyway and path.suffix.lower() in PARQUET)


def read_sheet(
    path: Path, headers: Mapping[tuple[str, ...], tuple[str, ...]] | None = None, credit: str = ""
) -> Sheet:
    """Read a .csv, .tsv (either may be gzipped) or .parquet file.

    Parameters
    ----------
    path : Path
    headers : mapping, optional
        Headers of text files known to be wrong, and what they should be.
    credit : str, optional
        Whom the source is to be credited to.

    Raises
    ------
    InputError
        If the file cannot be read, is not what its name says, is not rectangular, has columns without or
        with the same name, or has no row.
    """
    raw, source = read_bytes(path, credit)
    suffix = next((s.lower() for s in reversed(path.suffixes) if s.lower() != ".gz"), "")
    if suffix in PARQUET:
        sheet = _parquet(raw, source)
    elif suffix in SEPARATORS:
        if raw.startswith(b"PAR1"):
            raise InputError(f"{source.name!r} is a Parquet file: call it {path.stem}.parquet")
        sheet = _separated(without_bom(raw, source.name), source, SEPARATORS[suffix], headers or {})
    else:
        raise InputError(
            f"{source.name!r} has the ending {suffix!r}: give a .csv, .tsv, .csv.gz, .tsv.gz or .parquet file"
        )
    if not len(sheet):
        raise InputError(f"{source.name!r} has a header but no row: give at least one measurement")
    return sheet


def _parquet(raw: bytes, source: Source) -> Sheet:
    import polars as pl

    try:
        frame = pl.read_parquet(BytesIO(raw))
    except (pl.exceptions.PolarsError, pl.exceptions.PanicException, OSError, ValueError) as error:
        raise InputError(
            f"{source.name!r} is not a Parquet file ({brief(error)}): write it again, or call it .csv"
        ) from None
    return Sheet(source, checked_header(frame.columns, source.name), frame, None)


def _separated(
    raw: bytes, source: Source, separator: str, headers: Mapping[tuple[str, ...], tuple[str, ...]]
) -> Sheet:
    import polars as pl

    first, _, body = (raw.rstrip(b"\r\n") + b"\n").partition(b"\n")
    head = first.decode().strip("\r")
    names = _names(head, source.name, separator)
    others = [s for s in ",;\t" if s != separator and s in head]
    if len(names) == 1 and others:
        raise InputError(
            f"{source.name!r}, line 1 is separated by {others[0]!r}: a {Path(source.name).suffixes[0]} file "
            f"is separated by {separator!r}; save it so"
        )
    columns = checked_header(names, source.name)
    columns = headers.get(columns, columns)
    if not body:
        return Sheet(source, columns, pl.DataFrame(), 2)
    first_line = _check_rectangle(body, source.name, separator, len(columns))
    try:
        frame = pl.read_csv(
            body, separator=separator, has_header=False, infer_schema=False, new_columns=list(columns)
        )
    except (pl.exceptions.PolarsError, pl.exceptions.PanicException) as error:
        raise InputError(
            f"{source.name!r} is not a table ({brief(error)}): check its separators and quotes"
        ) from None
    return Sheet(source, columns, frame, first_line)


def _names(head: str, file: str, separator: str) -> list[str]:
    if not head.strip():
        raise InputError(f"{file!r}, line 1 is empty: begin with the names of the columns")
    if "\r" in head or head.count('"') % 2:
        raise InputError(
            f"{file!r}, line 1 ({head[:40]!r}) has a line break within: end lines with a line feed, "
            "and write the name of each column on one line"
        )
    return [name.strip() for name in next(csv.reader([head], delimiter=separator), [])]


def checked_header(names: list[str], file: str) -> tuple[str, ...]:
    """Return the names of a file's columns.

    Raises
    ------
    InputError
        If one has no name, or two have the same.
    """
    for position, name in enumerate(names):
        if not name:
            raise InputError(f"{file!r}: column {position + 1} has no name; name it or delete it")
        if name in names[:position]:
            raise InputError(f"{file!r}: two columns are called {name!r}; rename or delete one")
    return tuple(names)


def _check_rectangle(body: bytes, file: str, separator: str, width: int) -> int | None:
    """Raise unless every line has `width` cells; return the line of the first row if each row is one line.

    polars fills short lines up with missing values, which would hide a slip of the pen.
    """
    flat = _QUOTED.sub(b"", body) if b'"' in body else body
    marks = np.frombuffer(flat, dtype=np.uint8)
    ends = np.flatnonzero(marks == ord("\n"))
    before = np.searchsorted(np.flatnonzero(marks == ord(separator)), ends)
    cells = np.diff(before, prepend=0) + 1
    wrong = np.flatnonzero(cells != width)
    one_line_each = flat.count(b"\n") == body.count(b"\n")
    if len(wrong):
        row = int(wrong[0])
        text = flat[ends[row - 1] + 1 if row else 0 : ends[row]].decode(errors="replace").strip()
        what = f"line {row + 2}" if one_line_each else f"row {row + 1}"
        raise InputError(
            f"{file!r}, {what} ({text[:40]!r}) has {cells[row] if text else 0} cells, the header {width}: "
            "write every cell, empty where a value is missing, and put text with a separator in double quotes"
        )
    return 2 if one_line_each else None


def brief(error: BaseException) -> str:
    """Return the first line of what an error says, cut to 120 characters."""
    return (str(error).strip().splitlines() or [type(error).__name__])[0][:120]
