"""RoCS: all of it is read, under the right names, whatever the order of rows; damaged folders are refused."""

import random
import shutil
from pathlib import Path

import numpy as np
import pytest

from ersatz.acquisition.rocs import ROCS_PROPERTIES, read_rocs
from ersatz.errors import InputError
from ersatz.measurements import Column, Kind, Measurements, Origin
from tests.rocs import published_concepts, published_symbols

EXTENTS = ["length", "width", "height"]
HEADERS = {
    "size": EXTENTS,
    "support": ["flatness", "rigidity", *EXTENTS],
    "containment": ["length", "width", "hollowness"],
    "movability": ["weight", "roughness"],
    "blockage": ["inv_weight", "inv_roughness"],
}
ROWS = ("paper_box_4_1", "paper_box_4_10", "ball_10_1", "ball_10_10")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A small folder in the published layout; value k of row i is i + k / 10."""
    for name, prop in ROCS_PROPERTIES.items():
        lines = [",".join(["instance_name", *HEADERS.get(name, [name])])]
        lines += [
            ",".join([row, *(f"{i + k / 10:g}" for k in range(prop.dimensions))])
            for i, row in enumerate(ROWS)
        ]
        (tmp_path / f"{name}.csv").write_text("\n".join(lines) + "\n")
    return tmp_path


@pytest.fixture(scope="session")
def rocs(shared_data: Path) -> Path:
    return shared_data / "rocs"


def column(table: Measurements, name: str) -> Column:
    return next(c for c in table.columns if c.property.name == name)


def test_names_are_split_into_class_instance_and_repetition(folder: Path) -> None:
    table = Measurements.collect(read_rocs(folder))
    assert table.classes == ("ball", "paper box")
    assert list(table.instances) == ["ball_10", "paper_box_4"]
    assert table.observations == ("1", "10")


def test_containment_has_four_values_under_three_names(folder: Path) -> None:
    values = column(Measurements.collect(read_rocs(folder)), "containment").values
    assert ROCS_PROPERTIES["containment"].components == ("length", "width", "height", "hollowness")
    assert values.tolist() == [[2, 2.1, 2.2, 2.3], [3, 3.1, 3.2, 3.3], [0, 0.1, 0.2, 0.3], [1, 1.1, 1.2, 1.3]]


def test_rigidity_is_inverted_also_within_support(folder: Path) -> None:
    table = Measurements.collect(read_rocs(folder))
    assert column(table, "rigidity").values[:, 0].tolist() == [-1.0, -2.0, 1.0, 0.0]
    assert column(table, "support").values[2].tolist() == [0.0, 0.9, 0.2, 0.3, 0.4]


def test_functional_properties_are_those_of_the_design() -> None:
    functional = {p.name for p in ROCS_PROPERTIES.values() if p.kind is Kind.FUNCTIONAL}
    assert functional == {"support", "containment", "movability", "blockage"}


def test_every_value_of_rocs_is_read(rocs: Path) -> None:
    table = Measurements.collect(read_rocs(rocs))
    assert (len(table.classes), len(table.instances), len(table.observations)) == (11, 110, 10)
    assert {c.property.name: len(c) for c in table.columns} == dict.fromkeys(ROCS_PROPERTIES, 1100)
    assert {Origin.MACHINE} == {block.origin for block in table.blocks()}
    assert {s.name for s in table.sources} == {f"{name}.csv" for name in ROCS_PROPERTIES}
    line = next(
        text for text in (rocs / "rigidity.csv").read_text().splitlines() if text.startswith("ball_3_7,")
    )
    c = column(table, "rigidity")
    row = (table.instances[c.instance] == "ball_3") & (np.asarray(table.observations)[c.observation] == "7")
    assert c.values[row].tolist() == [[round(1 - float(line.split(",")[1]), 12)]]


def test_published_names_are_ours(rocs: Path) -> None:
    table = Measurements.collect(read_rocs(rocs))
    symbols, concepts = published_symbols(rocs), published_concepts(rocs)
    assert set(symbols) == set(map(str, table.instances))
    assert all(set(held) == set(ROCS_PROPERTIES) for held in symbols.values())
    assert set(concepts) == set(table.classes)
    assert concepts["plastic box"]["weight_0"] == 1.0


def test_order_of_rows_does_not_matter(rocs: Path, tmp_path: Path) -> None:
    dice = random.Random(1)
    for name in ROCS_PROPERTIES:
        header, *lines = (rocs / f"{name}.csv").read_text().splitlines()
        (tmp_path / f"{name}.csv").write_text("\n".join([header, *dice.sample(lines, len(lines))]))
    one, two = (Measurements.collect(read_rocs(f)) for f in (rocs, tmp_path))
    assert list(one.instances) == list(two.instances)
    for a, b in zip(one.columns, two.columns, strict=True):
        assert (a.property, a.instance.tolist()) == (b.property, b.instance.tolist())
        assert a.observation.tolist() == b.observation.tolist()
        assert a.values.tobytes() == b.values.tobytes()


@pytest.mark.parametrize(
    ("file", "old", "new", "message"),
    [
        (
            "size.csv",
            "ball_10_1,",
            "ball_10,",
            "'size.csv', line 4, column 'instance_name': 'ball_10' is not named",
        ),
        ("size.csv", "ball_10_1,", "Ball_10_1,", "'Ball_10_1' is not named <class>_<number>_<repetition>"),
        ("size.csv", "ball_10_10,", "ball_10_1,", "'ball_10_1' stands for two rows: delete one"),
        ("size.csv", "ball_10_10,", "ball_10_9,", "has no row 'ball_10_9', which 'size.csv' has"),
        (
            "size.csv",
            "length,width,height",
            "x,y,z",
            "has the columns instance_name, x, y, z, where RoCS has",
        ),
        ("size.csv", "instance_name", "name", "has no column 'instance_name'"),
        ("weight.csv", "ball_10_1,2", "ball_10_1,", "'weight.csv', line 4, column 'weight': '' is missing"),
        ("weight.csv", "ball_10_1,2", "ball_10_1,two", "line 4, column 'weight': 'two' is not a number"),
        ("weight.csv", "ball_10_1,2", "ball_10_1", "line 4 .* has 1 cells, the header 2"),
        ("containment.csv", ",0.3", "", r"'containment.csv', line 2 .* has 4 cells, the header 5"),
    ],
)
def test_damaged_table(folder: Path, file: str, old: str, new: str, message: str) -> None:
    path = folder / file
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(InputError, match=message) as error:
        read_rocs(folder)
    assert "\n" not in str(error.value)


def test_missing_row_at_the_end(folder: Path) -> None:
    path = folder / "weight.csv"
    path.write_text("\n".join(path.read_text().splitlines()[:-1]))
    with pytest.raises(InputError, match=r"'weight.csv' has no row 'ball_10_10', which '\w+.csv' has"):
        read_rocs(folder)


def test_no_rocs_folder(folder: Path) -> None:
    with pytest.raises(InputError, match=r"size\.csv' is a file: give the folder"):
        read_rocs(folder / "size.csv")
    (folder / "size.csv").unlink()
    with pytest.raises(InputError, match=r"is no RoCS folder: it lacks size\.csv"):
        read_rocs(folder)
    shutil.rmtree(folder)
    with pytest.raises(InputError, match="does not exist: give the folder"):
        read_rocs(folder)
