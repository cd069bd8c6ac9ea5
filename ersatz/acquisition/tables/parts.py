"""Parquet tables larger than memory, read in batches of rows.

A data set is a directory of Parquet files in the wide layout, or one such file, at a path or at a URL of a
file system known to fsspec. Each file is a part, the unit of distributed work. All rows of an instance lie
together, in one part: so a batch can end between two instances, and nobody needs to hold the observations
of all. Parts that do not keep to this are found, see `check_apart`. Properties without a name in
`PROPERTIES` are described beside the data set, as beside any table.
"""

import hashlib
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from ersatz.acquisition.extras import parquet
from ersatz.acquisition.tables.property_files import beside, read_properties
from ersatz.acquisition.tables.rows import Keys, check_named, origins
from ersatz.acquisition.tables.sheets import PARQUET, Sheet, brief, checked_header
from ersatz.acquisition.tables.wide import read_wide
from ersatz.errors import InputError
from ersatz.measurements import PROPERTIES, Block, Column, Measurements, Property, Source, checked, in_order

if TYPE_CHECKING:
    import polars as pl

BATCH: Final = 1 << 18
"""Rows read at a time; how many decides how much memory is needed, and nothing else."""


@dataclass(frozen=True, slots=True)
class Part:
    """One Parquet file of a data set.

    Attributes
    ----------
    table : str
        Base name of the data set.
    name : str
        The file's name below it; for messages.
    url : str
        Where it lies, as fsspec understands it.
    properties : tuple of Property
        Those that are described beside the data set.
    """

    table: str
    name: str
    url: str
    properties: tuple[Property, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Batch:
    """Some instances of a part, with all that was measured of them.

    Attributes
    ----------
    names : polars.Series of str
        Of every instance in the order of the rows.
    measured : (m,) int64 array
        Indices of those that have a value, ascending.
    measurements : Measurements
        Of these, in this order, with names that are empty: they are many, and seldom asked for.
    """

    names: "pl.Series"
    measured: NDArray[np.int64]
    measurements: Measurements

    def named(self) -> Measurements:
        """Return the measurements with the names of their instances."""
        names = self.names.gather(self.measured).to_list()
        return replace(self.measurements, instances=np.asarray(names, dtype=np.dtypes.StringDType()))


def find_parts(table: str | Path) -> list[Part]:
    """Return the Parquet files of a data set, sorted by name.

    Raises
    ------
    InputError
        If there is nothing, no Parquet file, or a property is described wrongly.
    """
    parquet()
    from fsspec.core import url_to_fs

    try:
        fs, root = url_to_fs(str(table))
        found = sorted(fs.find(root))
    except (ImportError, OSError, ValueError) as error:
        raise InputError(f"cannot read {str(table)!r}: {brief(error)}") from None
    hidden = ("_", ".")
    paths = [
        path
        for path in found
        if PurePosixPath(path).suffix.lower() in PARQUET and not PurePosixPath(path).name.startswith(hidden)
    ]
    if not paths:
        raise InputError(
            f"{str(table)!r} holds no Parquet file: give a directory of {' or '.join(PARQUET)} files in the "
            "wide layout, or the files of another kind one by one"
        )
    name = PurePosixPath(root).name
    properties = _described(fs, root)
    below = [f"{name}/{path.removeprefix(root).lstrip('/')}".rstrip("/") for path in paths]
    return [
        Part(name, file, fs.unstrip_protocol(path), properties)
        for file, path in zip(below, paths, strict=True)
    ]


def read_batches(part: Part, rows: int = BATCH) -> Iterator[Batch]:
    """Yield a part in batches of about so many rows, each of whole instances.

    Raises
    ------
    InputError
        If the file cannot be read, is in the long layout, or holds what a table must not hold.
    """
    import polars as pl

    known = {**PROPERTIES, **{prop.name: prop for prop in part.properties}}
    rest: Sheet | None = None
    for sheet in _sheets(part, rows):
        check_named(sheet)
        if rest is not None:
            sheet = replace(rest, frame=pl.concat([rest.frame, sheet.frame]))  # noqa: PLW2901
        names = sheet.texts("instance")
        others = np.flatnonzero((names != names[-1]).to_numpy())
        whole = int(others[-1]) + 1 if len(others) else 0
        if whole:
            yield _batch(replace(sheet, frame=sheet.frame[:whole]), known)
        rest = replace(sheet, frame=sheet.frame[whole:], rows_before=sheet.rows_before + whole)
    if rest is not None:
        yield _batch(rest, known)


def read_names(part: Part, rows: int = BATCH) -> Iterator[list[str]]:
    """Yield the names of a part's instances, one for each run of rows with the same."""
    last = None
    for sheet in _sheets(part, rows, ["instance"]):
        names = sheet.texts("instance")
        fresh = np.concatenate([[names[0] != last], (names[1:] != names[:-1]).to_numpy()])
        last = names[-1]
        yield names.filter(fresh).to_list()


def read_whole(table: str | Path) -> list[Block]:
    """Return a data set as a whole, for what is to be joined with other sources."""
    batches = chain.from_iterable(map(read_batches, find_parts(table)))
    return [block for batch in batches for block in batch.named().blocks()]


def sha256(part: Part) -> str:
    """Return the SHA-256 of a part's file, read once more for it."""
    digest = hashlib.sha256()
    with _opened(part) as file:
        while block := file.read(1 << 22):
            digest.update(block)
    return digest.hexdigest()


def source_of(hashes: Iterable[tuple[Part, str]]) -> Source:
    """Return the source that stands for the parts of one data set.

    Its SHA-256 is the file's if there is one; else that of the lines `sha256sum` prints of the sorted files.
    """
    known = sorted((part.name, part.table, value) for part, value in hashes)
    _, table, only = known[0]
    if len(known) == 1:
        return Source(table, only)
    lines = "".join(f"{value}  {name.partition('/')[2]}\n" for name, _, value in known)
    return Source(table, hashlib.sha256(lines.encode()).hexdigest())


def _described(fs: Any, root: str) -> tuple[Property, ...]:
    path = str(PurePosixPath(root).parent / beside(Path(PurePosixPath(root).name)).name)
    if not fs.exists(path):
        return ()
    with TemporaryDirectory() as folder:
        copy = Path(folder) / PurePosixPath(path).name
        copy.write_bytes(fs.cat_file(path))
        known = read_properties(copy, PROPERTIES)
    return tuple(prop for name, prop in known.items() if PROPERTIES.get(name) != prop)


def _sheets(part: Part, rows: int, only: list[str] | None = None) -> Iterator[Sheet]:
    """Yield so many rows of a part at a time; `only` some of its columns."""
    import polars as pl

    with _opened(part) as file:
        table = _guarded(part, lambda: parquet().ParquetFile(file, buffer_size=1 << 20))
        columns = checked_header(table.schema_arrow.names, part.name)
        if "property" in columns:
            raise InputError(
                f"{part.name!r} is in the long layout, one number a row: a data set in parts is wide, one "
                "object or observation a row"
            )
        done = 0
        chunks = table.iter_batches(batch_size=rows, columns=only, use_threads=False)
        while (chunk := _guarded(part, partial(next, chunks, None))) is not None:
            frame = pl.from_arrow(chunk)
            assert isinstance(frame, pl.DataFrame)
            if len(frame):
                yield Sheet(Source(part.name), columns, frame, None, done)
                done += len(frame)


def _opened(part: Part) -> Any:
    import fsspec

    return _guarded(part, lambda: fsspec.open(part.url, "rb").open())


def _guarded(part: Part, read: Callable[[], Any]) -> Any:
    """Return what is read; what Arrow or the file system complain of becomes an error that names the part."""
    try:
        return read()
    except (OSError, ValueError) as error:
        raise InputError(
            f"{part.name!r} cannot be read as Parquet ({brief(error)}): write or copy it again"
        ) from None


def _batch(sheet: Sheet, known: dict[str, Property]) -> Batch:
    """Return what the rows of whole instances say."""
    names = sheet.texts("instance")
    fresh = np.concatenate([[True], (names[1:] != names[:-1]).to_numpy()])
    starts, run = np.flatnonzero(fresh), np.cumsum(fresh) - 1
    classes, class_code = sheet.strings("object_class")
    strays = np.flatnonzero(class_code != class_code[starts][run])
    if len(strays):
        before = str(classes[class_code[starts[run[strays[0]]]]])
        raise sheet.error(
            int(strays[0]),
            "object_class",
            f"is the class of {names[int(strays[0])]!r}, which is {before!r} in the row before: "
            "give two objects different names",
        )
    seen, seen_code = sheet.strings("observation", optional=True)
    keys = Keys(sheet, seen[seen_code], run * len(seen) + seen_code, origins(sheet))
    found = sorted(read_wide(keys, known), key=lambda values: values[0].name)
    found = [values for values in found if len(values[1])]
    has_value = np.zeros(len(starts), dtype=bool)
    for _, at, _ in found:
        has_value[run[at]] = True
    measured, place = np.flatnonzero(has_value), np.cumsum(has_value) - 1

    def column(prop: Property, at: NDArray[np.int64], values: NDArray[np.float64]) -> Column:
        rows = Column(
            prop,
            place[run[at]].astype(np.int32),
            seen_code[at].astype(np.int32),
            checked(prop, values, sheet.source, lambda row: names[int(at[row])]),
            keys.origin[at],
            np.zeros(len(at), dtype=np.int32),
        )
        return in_order(rows, seen, lambda instance: names[int(starts[measured[instance]])])

    used, of_class = np.unique(class_code[starts[measured]], return_inverse=True)
    measurements = Measurements(
        tuple(str(classes[code]) for code in used),
        np.zeros(len(measured), dtype=np.dtypes.StringDType()),
        of_class.astype(np.int32),
        tuple(map(str, seen)),
        (sheet.source,),
        tuple(column(*values) for values in found),
    )
    return Batch(names.gather(starts), measured, measurements)
