"""A large table of measurements, written as it is drawn: the paper's ten properties of many things.

`python -m tests.large DIR [--instances N] [--files N]` writes one. A thing's values depend on its number
and the seed alone, not on how many files the table is divided into.
"""

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

CLASSES: Final = 1_000
CHUNK: Final = 50_000
SHARES: Final = ("shape_1", "shape_2", "shape_3", "shape_4", "rigidity", "hollowness")
EXTENTS: Final = ("weight", "support", "containment", "blockage")
PAPERS_TEN: Final = (*SHARES, *EXTENTS)


def chunk(number: int, instances: int, seed: int = 0, chunk_size: int = CHUNK) -> pa.Table:
    """Return the things of one chunk: shares around a class's own, pressed into [0, 1], and extents over
    some decades; one value in twenty is missing."""
    of_class, rng = np.random.default_rng(seed), np.random.default_rng([seed, number])
    thing = np.arange(number * chunk_size, min((number + 1) * chunk_size, instances))
    label = rng.integers(0, CLASSES, len(thing))
    columns: dict[str, pa.Array] = {
        "object_class": pa.DictionaryArray.from_arrays(
            pa.array(label.astype(np.int32)), pa.array([f"class {one:04d}" for one in range(CLASSES)])
        ),
        "instance": pa.array([f"thing_{one:09d}" for one in thing.tolist()]),
    }
    for name in SHARES:
        middle = of_class.uniform(0, 1, CLASSES)[label]
        values = np.clip(middle + rng.normal(0, 0.15, len(thing)), 0, 1)
        columns[name] = pa.array(values, mask=rng.random(len(thing)) < 0.05)
    for name in EXTENTS:
        middle = of_class.normal(-1, 1.5, CLASSES)[label]
        values = np.exp(middle + rng.normal(0, 0.5, len(thing)))
        columns[name] = pa.array(values, mask=rng.random(len(thing)) < 0.05)
    return pa.table(columns)


def chunks(instances: int, seed: int = 0, chunk_size: int = CHUNK) -> Iterator[pa.Table]:
    """Yield the table."""
    for number in range(-(-instances // chunk_size)):
        yield chunk(number, instances, seed, chunk_size)


def write(folder: Path, instances: int, files: int, seed: int = 0, chunk_size: int = CHUNK) -> Path:
    """Write the table into so many files, chunk by chunk."""
    folder.mkdir(parents=True)
    number = -(-instances // chunk_size)
    for file in range(files):
        mine = range(number * file // files, number * (file + 1) // files)
        schema = chunk(0, 1, seed, chunk_size).schema
        with pq.ParquetWriter(folder / f"part_{file:04d}.parquet", schema) as writer:
            for one in mine:
                writer.write_table(chunk(one, instances, seed, chunk_size))
    return folder


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--instances", type=int, default=1_000_000)
    parser.add_argument("--files", type=int, default=8)
    given = parser.parse_args()
    write(given.folder, given.instances, given.files)
