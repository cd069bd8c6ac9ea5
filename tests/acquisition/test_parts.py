"""Parquet data sets are read in batches of whole instances, whatever the files and the batches."""

import hashlib
import subprocess
from collections.abc import Sequence
from pathlib import Path

import fsspec
import numpy as np
import polars as pl
import pytest

from ersatz.acquisition.tables import read_table
from ersatz.acquisition.tables.parts import (
    find_parts,
    read_batches,
    read_names,
    read_whole,
    sha256,
    source_of,
)
from ersatz.acquisition.tables.sheets import in_parts
from ersatz.errors import InputError
from ersatz.measurements import Measurements

FRAME = pl.DataFrame(
    {
        "object_class": ["cup", "cup", "cup", "plate", "plate", "cup", "plate"],
        "instance": ["cup_1", "cup_1", "cup_1", "plate_1", "plate_2", "cup_2", "plate_3"],
        "observation": ["b", "a", "c", None, None, "a", None],
        "weight [g]": [300.0, 310.0, None, 400.0, None, 200.0, None],
        "size.length [cm]": [10.0, 11.0, 12.0, None, 26.0, None, None],
        "size.width [cm]": [8.0, 8.5, 8.0, None, 26.0, None, None],
        "size.height [cm]": [9.0, 9.0, 9.0, None, 2.0, None, None],
        "grip": [1, 2, 3, 4, 5, 6, None],
    }
)
DESCRIBED = '[grip]\nkind = "physical"\nunit = "1"\n'


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a data set in three files, one of them without a row, and with files that are none of it."""
    (tmp_path / "big" / "deep").mkdir(parents=True)
    FRAME[:4].write_parquet(tmp_path / "big" / "b.parquet", row_group_size=2)
    FRAME[4:].write_parquet(tmp_path / "big" / "deep" / "a.parquet")
    FRAME[:0].write_parquet(tmp_path / "big" / "empty.pq")
    (tmp_path / "big" / "_metadata.parquet").write_bytes(b"not ours")
    (tmp_path / "big" / "notes.txt").write_text("hello", encoding="utf-8")
    (tmp_path / "big.properties.toml").write_text(DESCRIBED, encoding="utf-8")
    return tmp_path / "big"


def write(tmp_path: Path, *frames: pl.DataFrame) -> Path:
    (tmp_path / "made").mkdir()
    for number, frame in enumerate(frames):
        frame.write_parquet(tmp_path / "made" / f"{number}.parquet")
    return tmp_path / "made"


def table(measurements: Measurements) -> list[tuple[object, ...]]:
    """Return every value with its names."""
    return sorted(
        (
            column.property.name,
            measurements.classes[measurements.instance_class[row]],
            str(measurements.instances[row]),
            measurements.observations[seen],
            *values,
        )
        for column in measurements.columns
        for row, seen, values in zip(
            column.instance.tolist(), column.observation.tolist(), column.values.tolist(), strict=True
        )
    )


def test_the_parts_of_a_data_set(folder: Path) -> None:
    parts = find_parts(folder)
    assert [part.name for part in parts] == ["big/b.parquet", "big/deep/a.parquet", "big/empty.pq"]
    assert [prop.name for prop in parts[0].properties] == ["grip"]
    (single,) = find_parts(folder / "b.parquet")
    assert single.name == "b.parquet"


@pytest.mark.parametrize("rows", [1, 2, 3, 4, 100])
def test_batches_hold_whole_instances_and_together_everything(folder: Path, rows: int) -> None:
    found, names = [], []
    for part in find_parts(folder):
        for batch in read_batches(part, rows):
            found += table(batch.named())
            names += batch.names.to_list()
    FRAME.write_parquet(folder.parent / "whole.parquet")
    (folder.parent / "whole.properties.toml").write_text(DESCRIBED, encoding="utf-8")
    whole = Measurements.collect(read_table(folder.parent / "whole.parquet"))
    assert sorted(found) == table(whole)
    assert len(found) == 14
    assert names == ["cup_1", "plate_1", "plate_2", "cup_2", "plate_3"]
    assert [name for part in find_parts(folder) for some in read_names(part, rows) for name in some] == names


def test_a_data_set_can_be_joined_with_other_sources(folder: Path) -> None:
    blocks = read_whole(folder)
    assert table(Measurements.collect(blocks))[0] == ("grip", "cup", "cup_1", "a", 2.0)
    assert "plate_3" not in {str(name) for block in blocks for name in block.instance}


def test_any_file_system_of_fsspec(folder: Path) -> None:
    memory = fsspec.filesystem("memory")
    memory.put(str(folder), "/fleet/big", recursive=True)
    memory.put(str(folder.with_name("big.properties.toml")), "/fleet/big.properties.toml")
    try:
        parts = find_parts("memory://fleet/big")
        assert [part.name for part in parts] == ["big/b.parquet", "big/deep/a.parquet", "big/empty.pq"]
        remote = [row for part in parts for batch in read_batches(part) for row in table(batch.named())]
        local = [
            row for part in find_parts(folder) for one in read_batches(part) for row in table(one.named())
        ]
        assert remote == local
    finally:
        memory.rm("/fleet", recursive=True)


def test_the_hash_of_a_data_set_can_be_made_again_in_the_shell(folder: Path) -> None:
    parts = find_parts(folder)
    source = source_of((part, sha256(part)) for part in reversed(parts))
    listed = subprocess.run(
        ["sha256sum", "b.parquet", "deep/a.parquet", "empty.pq"], cwd=folder, capture_output=True, check=True
    ).stdout
    assert (source.name, source.sha256) == ("big", hashlib.sha256(listed).hexdigest())
    single = source_of([(parts[0], sha256(parts[0]))])
    assert single.sha256 == hashlib.sha256((folder / "b.parquet").read_bytes()).hexdigest()


def test_what_is_read_in_parts(folder: Path, tmp_path: Path) -> None:
    small = folder / "b.parquet"
    assert in_parts(folder)
    assert in_parts("s3://fleet/big")
    assert not in_parts(small)
    assert in_parts(small, anyway=True)
    assert not in_parts(tmp_path / "lab.csv", anyway=True)
    large = tmp_path / "large.parquet"
    with large.open("wb") as file:
        file.truncate((1 << 28) + 1)
    assert in_parts(large)


def changed(**columns: Sequence[object]) -> pl.DataFrame:
    frame = pl.DataFrame(
        {"object_class": ["cup"] * 3, "instance": ["a", "b", "c"], "weight": [1.0, 2.0, 3.0]}, strict=False
    )
    return frame.with_columns(pl.Series(name, values, strict=False) for name, values in columns.items())


@pytest.mark.parametrize(
    ("frame", "words"),
    [
        (changed(property=["weight"] * 3), ["long layout", "wide"]),
        (changed(weight=[1.0, 2.0, float("nan")]), ["row 3", "'weight'", "nan", "leave"]),
        (changed(weight=[1.0, 2.0, float("inf")]), ["row 3", "infinite"]),
        (changed(weight=[1.0, 2.0, -3.0]), ["row 3", "-3.0", "0 or more"]),
        (changed(instance=["a", "b", ""]), ["row 3", "'instance'", "no name"]),
        (changed(instance=["a", "b", "b"]), ["row 3", "'b'", "already in row 2"]),
        (
            changed(instance=["a", "b", "b"], object_class=["cup", "cup", "jug"], observation=["", "x", "y"]),
            ["row 3", "'jug'", "'cup'", "different names"],
        ),
        (
            changed(instance=["a", "b", "b"], observation=["", "", "y"]),
            ["'b'", "whole instance", "name every observation"],
        ),
        (changed(wieght=[1, 2, 3]), ["'wieght'", "did you mean 'weight'"]),
        (changed().drop("instance"), ["no column 'instance'"]),
    ],
    ids=range(10),
)
@pytest.mark.parametrize("rows", [1, 2, 100])
def test_bad_tables_say_where_and_what_to_do(
    frame: pl.DataFrame, words: list[str], rows: int, tmp_path: Path
) -> None:
    made = write(tmp_path, frame)
    with pytest.raises(InputError) as error:
        for part in find_parts(made):
            list(read_batches(part, rows))
    message = str(error.value)
    assert "made/0.parquet" in message or "whole instance" in message
    for word in words:
        assert word in message


def test_a_missing_or_broken_data_set_is_named(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"nowhere.*no Parquet file"):
        find_parts(tmp_path / "nowhere")
    with pytest.raises(InputError, match="nosuch"):
        find_parts("nosuch://fleet/big")
    (folder / "broken.parquet").write_bytes(b"PAR1 and nothing else")
    (broken,) = (part for part in find_parts(folder) if "broken" in part.name)
    with pytest.raises(InputError, match=r"'big/broken.parquet' cannot be read as Parquet"):
        list(read_batches(broken))
    text = (folder / "b.parquet").read_bytes()
    (folder / "b.parquet").write_bytes(text[:20] + bytes(60) + text[80:])
    with pytest.raises(InputError, match=r"b\.parquet"):
        list(read_batches(find_parts(folder)[0]))


def test_values_are_rounded_and_in_their_unit(folder: Path) -> None:
    first = next(read_batches(find_parts(folder)[0])).measurements
    (weights,) = (column for column in first.columns if column.property.name == "weight")
    assert np.array_equal(weights.values[:, 0], [0.31, 0.3])  # a before b, in kg
