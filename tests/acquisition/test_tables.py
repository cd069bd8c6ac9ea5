"""Property tables: what is written is what is read, in every layout, and nothing malformed gets through."""

import gzip
import hashlib
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ersatz.acquisition.tables import read_table
from ersatz.acquisition.tables.units import factor, scale
from ersatz.errors import InputError
from ersatz.measurements import DIGITS, PROPERTIES, Block, Kind, Measurements, Origin, Property

LONG = """object_class,instance,observation,property,component,value,unit,origin
plate,plate_1,,weight,,279,g,machine
plate,plate_1,,size,width,0.25,m,
plate,plate_1,,size,length,26,cm,
plate,plate_1,,size,height,27,mm,
plate,plate_1,,rigidity,,,,human
plate,plate_2,,rigidity,,96,%,human
"""
WIDE = """object_class,instance,observation,weight [g],size.length [cm],size.width,size.height [mm]
plate,plate_1,,279,26,0.25,27
bowl,bowl_1,b,,,,
bowl,bowl_1,a,147.5,,,
"""

Row = tuple[str, str, str, str, tuple[float, ...], str]


def rows(blocks: list[Block]) -> set[Row]:
    """Return (class, instance, observation, property, values, origin) of every value."""
    table = Measurements.collect(blocks)
    return {
        (
            table.classes[table.instance_class[i]],
            str(table.instances[i]),
            table.observations[o],
            column.property.name,
            tuple(v),
            str(list(Origin)[origin]),
        )
        for column in table.columns
        for i, o, v, origin in zip(
            column.instance.tolist(),
            column.observation.tolist(),
            column.values.tolist(),
            column.origin.tolist(),
            strict=True,
        )
    }


def write(folder: Path, content: str | bytes, name: str = "t.csv") -> Path:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def test_long_layout_converts_units_and_skips_empty_cells(tmp_path: Path) -> None:
    assert rows(read_table(write(tmp_path, LONG))) == {
        ("plate", "plate_1", "", "weight", (0.279,), "machine"),
        ("plate", "plate_1", "", "size", (0.26, 0.25, 0.027), "machine"),
        ("plate", "plate_2", "", "rigidity", (0.96,), "human"),
    }


def test_wide_layout_converts_units_and_skips_empty_cells(tmp_path: Path) -> None:
    assert rows(read_table(write(tmp_path, WIDE))) == {
        ("plate", "plate_1", "", "weight", (0.279,), "machine"),
        ("plate", "plate_1", "", "size", (0.26, 0.25, 0.027), "machine"),
        ("bowl", "bowl_1", "a", "weight", (0.1475,), "machine"),
    }


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("t.csv", lambda raw: b"\xef\xbb\xbf" + raw),
        ("t.csv", lambda raw: raw.replace(b"\n", b"\r\n")),
        ("t.csv", lambda raw: raw + b"\n\n"),
        ("t.csv", lambda raw: raw.replace(b"plate_1", b'"plate_1"')),
        ("t.csv", lambda raw: raw.replace(b",", b" , ")),
        ("t.CSV", lambda raw: raw),
        ("t.tsv", lambda raw: raw.replace(b",", b"\t")),
        ("t.csv.gz", gzip.compress),
        ("t.tsv.gz", lambda raw: gzip.compress(raw.replace(b",", b"\t"))),
        ("v1.2.csv", lambda raw: raw),
    ],
)
@pytest.mark.parametrize("content", [LONG, WIDE])
def test_same_values_in_every_dress(
    tmp_path: Path, content: str, name: str, change: Callable[[bytes], bytes]
) -> None:
    plain = rows(read_table(write(tmp_path, content, "plain.csv")))
    assert rows(read_table(write(tmp_path, change(content.encode()), name))) == plain


@pytest.mark.parametrize("content", [LONG, WIDE])
@pytest.mark.parametrize("text", [True, False])
def test_parquet_reads_as_csv_does(tmp_path: Path, content: str, text: bool) -> None:
    frame = pl.read_csv(content.encode(), infer_schema=not text)
    frame.write_parquet(tmp_path / "t.parquet")
    assert rows(read_table(tmp_path / "t.parquet")) == rows(read_table(write(tmp_path, content)))


def test_source_is_name_and_hash_of_the_file_as_it_lies_there(tmp_path: Path) -> None:
    raw = gzip.compress(WIDE.encode())
    (block, *_) = read_table(write(tmp_path, raw, "t.csv.gz"))
    assert (block.source.name, block.source.sha256) == ("t.csv.gz", hashlib.sha256(raw).hexdigest())


def test_names_with_separators_and_line_breaks(tmp_path: Path) -> None:
    path = write(tmp_path, 'object_class,instance,weight\n"cup, blue","a\nb",1\ncup,2,3\n')
    assert rows(read_table(path)) == {
        ("cup, blue", "a\nb", "", "weight", (1.0,), "machine"),
        ("cup", "2", "", "weight", (3.0,), "machine"),
    }


def test_tables_join_in_any_order(tmp_path: Path) -> None:
    one = write(tmp_path, "object_class,instance,weight\nplate,p,1\n", "1.csv")
    two = write(tmp_path, "object_class,instance,rigidity,origin\nplate,p,1,human\n", "2.csv")
    table, other = (
        Measurements.collect([block for path in paths for block in read_table(path)])
        for paths in ((one, two), (two, one))
    )
    assert [c.property.name for c in table.columns] == ["rigidity", "weight"]
    assert table.sources == other.sources
    assert rows(list(table.blocks())) == rows(list(other.blocks()))


def test_properties_described_beside_the_table(tmp_path: Path) -> None:
    write(
        tmp_path,
        '[grip]\nkind = "physical"\nunit = "N m"\ncomponents = ["near", "far"]\ndefinition = "x"\n',
        "t.properties.toml",
    )
    path = write(tmp_path, "object_class,instance,grip.near,grip.far [N m]\nplate,p,-1,2\n")
    (block,) = read_table(path)
    assert block.property == Property("grip", Kind.PHYSICAL, "N m", ("near", "far"), definition="x")
    assert block.values.tolist() == [[-1.0, 2.0]]


def test_given_properties_replace_the_known_ones(tmp_path: Path) -> None:
    path = write(tmp_path, "object_class,instance,heat [K]\nplate,p,-3\n")
    (block,) = read_table(path, {"heat": Property("heat", Kind.PHYSICAL, "K")})
    assert block.values.tolist() == [[-3.0]]


@pytest.mark.parametrize(
    ("unit", "target", "expected"),
    [
        ("kg", "kg", Fraction(1)),
        ("mg", "kg", Fraction(1, 10**6)),
        ("t", "kg", Fraction(1000)),
        ("mm", "m", Fraction(1, 1000)),
        ("cm²", "m2", Fraction(1, 10**4)),
        ("cm^2", "m2", Fraction(1, 10**4)),
        ("cl", "l", Fraction(1, 100)),
        ("L", "l", Fraction(1)),
        ("cm3", "l", Fraction(1, 1000)),
        ("m3", "l", Fraction(1000)),
        ("g cm2", "kg m2", Fraction(1, 10**7)),
        ("m2 kg", "kg m2", Fraction(1)),
        ("%", "1", Fraction(1, 100)),
        ("kg/m3", "kg/m3", Fraction(1)),
        ("m", "m2", None),
        ("lb", "kg", None),
        ("kg", "1", None),
        ("", "1", None),
        ("kg/m3", "kg", None),
    ],
)
def test_factor(unit: str, target: str, expected: Fraction | None) -> None:
    assert factor(unit, target) == expected


@given(st.integers(min_value=0, max_value=10**9))
def test_grams_are_converted_to_the_last_digit_stored(milligrams: int) -> None:
    grams = scale(np.array([float(f"{milligrams}e-3")]), Fraction(1, 1000))
    kilograms = np.array([float(f"{milligrams}e-6")])
    assert np.round(grams, DIGITS) == np.round(kilograms, DIGITS)


NAMES = st.text(st.characters(codec="utf-8", exclude_categories=["Cc", "Cs"]), min_size=1, max_size=6).map(
    str.strip
)
NUMBERS = st.floats(0, 1, allow_subnormal=False).map(lambda v: round(v, DIGITS) + 0.0)
VALUES = st.fixed_dictionaries(
    {
        "weight": st.none() | NUMBERS,
        "flatness": st.none() | NUMBERS,
        "size": st.none() | st.tuples(NUMBERS, NUMBERS, NUMBERS),
    }
)
TABLES = st.dictionaries(
    st.tuples(NAMES.filter(bool), NAMES),  # instance and observation
    st.tuples(VALUES, st.sampled_from(Origin)),
    min_size=1,
    max_size=6,
).filter(lambda table: any(v is not None for values, _ in table.values() for v in values.values()))


@given(table=TABLES, long=st.booleans(), parquet=st.booleans(), data=st.data())
@settings(max_examples=60, deadline=None)
def test_round_trip(
    tmp_path_factory: pytest.TempPathFactory,
    table: dict[tuple[str, str], tuple[dict[str, float | tuple[float, ...] | None], Origin]],
    long: bool,
    parquet: bool,
    data: st.DataObject,
) -> None:
    expected: set[Row] = set()
    records: list[dict[str, str]] = []
    for (instance, observation), (values, origin) in table.items():
        who = {"object_class": "c", "instance": instance, "observation": observation, "origin": str(origin)}
        wide = dict(who)
        for name, value in values.items():
            vector = value if isinstance(value, tuple) else (value,) * PROPERTIES[name].dimensions
            components = PROPERTIES[name].components or ("",)
            cells = ["" if v is None else repr(v) for v in vector]
            wide |= {f"{name}.{c}".strip("."): v for c, v in zip(components, cells, strict=True)}
            if long:
                records += [
                    who | {"property": name, "component": c, "value": v}
                    for c, v in zip(components, cells, strict=True)
                ]
            if value is not None:
                numbers = tuple(v for v in vector if v is not None)
                expected.add(("c", instance, observation, name, numbers, str(origin)))
        if not long:
            records.append(wide)
    frame = pl.DataFrame(data.draw(st.permutations(records)))
    path = tmp_path_factory.mktemp("round") / ("t.parquet" if parquet else "t.csv")
    if parquet:
        frame.write_parquet(path)
    else:
        frame.write_csv(path, quote_style="always")
    assert rows(read_table(path)) == expected


ID = "object_class,instance,"
MALFORMED: dict[str, tuple[str | bytes, str]] = {
    "empty file": ("", "is empty"),
    "blank file": ("\n \n", "is empty"),
    "header only": (ID + "weight\n", "has a header but no row"),
    "no value": (ID + "weight\nplate,p,\n", "holds no value"),
    "binary": (b"\x7fELF\x00\x01", "zero byte at offset 4"),
    "latin-1": ((ID + "weight\npl\u00e9,p,1\n").encode("latin-1"), r"line 2: the byte 0xe9 is not UTF-8"),
    "utf-16": ((ID + "weight\nplate,p,1\n").encode("utf-16"), "UTF-16: save it as UTF-8"),
    "parquet inside": (b"PAR1\x15", "is a Parquet file"),
    "semicolons": ("object_class;instance;weight\nplate;p;1\n", "separated by ';'"),
    "no class column": (
        "object class,instance,weight\nplate,p,1\n",
        "no column 'object_class': rename 'object class'",
    ),
    "no instance column": ("object_class,weight\nplate,1\n", "no column 'instance'"),
    "unknown column": (ID + "wieght\nplate,p,1\n", "'wieght' is no property: did you mean 'weight'"),
    "strange column": (ID + "zzz\nplate,p,1\n", "no property has a similar name; known are"),
    "unit in parentheses": (ID + "weight (g)\nplate,p,1\n", r"did you mean 'weight'.*brackets"),
    "value without property": (ID + "value\nplate,p,1\n", "needs a column 'property'"),
    "no property column": ("object_class,instance\nplate,p\n", "no column of a property"),
    "duplicate column": (ID + "weight,weight\nplate,p,1,1\n", "two columns are called 'weight'"),
    "duplicate number": (
        ID + "weight,weight [g]\nplate,p,1,1\n",
        "'weight' and 'weight \\[g\\]' give the same",
    ),
    "nameless column": (ID + ",weight\nplate,p,1,1\n", "column 3 has no name"),
    "short row": (ID + "weight\nplate,p,1\nplate,q\n", r"line 3 \('plate,q'\) has 2 cells, the header 3"),
    "long row": (ID + "weight\nplate,p,1,2\n", "line 2 .* has 4 cells"),
    "blank line": (ID + "weight\nplate,p,1\n\nplate,q,1\n", "line 3 .* has 0 cells"),
    "open quote": (ID + 'weight\n"plate,p,1\n', "has 3 cells|is not a table"),
    "text in a number": (
        ID + "weight\nplate,p,1\nplate,q,heavy\n",
        "line 3, column 'weight': 'heavy' is not a",
    ),
    "NA": (ID + "weight\nplate,p,NA\n", "'NA' is not a number: leave the cell of a missing value empty"),
    "NaN": (ID + "weight\nplate,p,nan\n", "'nan' is not a number: leave"),
    "infinity": (ID + "weight\nplate,p,-inf\n", "'-inf' is infinite"),
    "overflow": (ID + "weight\nplate,p,1e999\n", "'1e999' is out of range"),
    "huge": (ID + "weight\nplate,p,1e15\n", "'1e15' is out of range"),
    "underscore": (ID + "weight\nplate,p,1_000\n", "'1_000' is out of range: .* written like 0.25"),
    "decimal comma": (ID + 'weight\nplate,p,"0,5"\n', "'0,5' is not a number: write a decimal point"),
    "thousands": (ID + 'weight\nplate,p,"1,234"\n', "'1,234' is not a number: write 1234 or 1.234, as it is"),
    "old line ends": (
        ID + "weight\rplate,p,1\r",
        r"line 1 .* has a line break within: end lines with a line",
    ),
    "line break in a header": (ID + '"weight\n[g]"\nplate,p,1\n', "line 1 .* each column on one line"),
    "empty first line": ("\n" + ID + "weight\nplate,p,1\n", "line 1 is empty: begin with the names"),
    "unit in a cell": (ID + "weight\nplate,p,5 kg\n", "'5 kg' is not a number: .*unit in the header"),
    "negative weight": (ID + "weight\nplate,p,-1\n", "'-1' is out of range: weight is 0 or more"),
    "rigidity of 3": (ID + "rigidity\nplate,p,3\n", "'3' is out of range: rigidity is between 0 and 1"),
    "unknown unit": (ID + "weight [lb]\nplate,p,1\n", "'lb' is no multiple of 'kg'"),
    "unit of another dimension": (ID + "weight [m]\nplate,p,1\n", "'m' is no multiple of 'kg'"),
    "empty class": (ID + "weight\n,p,1\n", "line 2, column 'object_class': '' is no name"),
    "empty instance": (ID + "weight\nplate, ,1\n", "line 2, column 'instance': '.*' is no name"),
    "two classes": (
        ID + "weight\nplate,p,1\nbowl,p,\n",
        "line 3.*'bowl' is the class of 'p'; in line 2 it is 'plate'",
    ),
    "duplicate observation": (
        ID + "observation,weight\nc,p,a,1\nc,p,b,1\nc,p,a,2\n",
        "line 4.*already in line 2",
    ),
    "vector without component": (
        ID + "size\nplate,p,1\n",
        "'size' names no component of 'size': it has length",
    ),
    "component of a scalar": (ID + "weight.x\nplate,p,1\n", "'weight' is one number"),
    "wrong component": (ID + "size.depth\nplate,p,1\n", "it has length, width, height"),
    "missing component column": (
        ID + "size.length,size.width\nplate,p,1,1\n",
        "lacks the column 'size.height'",
    ),
    "missing component": (
        ID + "size.length,size.width,size.height\nplate,p,1,,1\n",
        "column 'size.width': '' is missing where other components",
    ),
    "wrong origin": (
        ID + "weight,origin\nplate,p,1,robot\n",
        "line 2, column 'origin': 'robot' must be one of",
    ),
    "long without value": (ID + "property\nplate,p,weight\n", "no column 'value'"),
    "long, unknown column": (
        ID + "property,value,units\nplate,p,weight,1,g\n",
        "'units'.*did you mean 'unit'",
    ),
    "long, unknown property": (
        ID + "property,value\nplate,p,wieght,1\n",
        "'wieght' is no property: did you mean",
    ),
    "long, dotted property": (ID + "property,value\nplate,p,size.length,1\n", "did you mean 'size'"),
    "long, wrong component": (
        ID + "property,component,value\nplate,p,size,depth,1\n",
        "'depth' names no component",
    ),
    "long, no component": (ID + "property,value\nplate,p,size,1\n", "'size' names no component of 'size'"),
    "long, half a vector": (
        ID + "property,component,value\nc,p,size,length,1\nc,p,size,height,1\nc,p,size,width,\n",
        "line 2, column 'instance': 'p' has 'size' without 'width'",
    ),
    "long, duplicate": (ID + "property,value\nc,p,weight,1\nc,p,weight,1\n", "line 3.*already in line 2"),
    "long, mixed units": (
        ID + "property,value,unit\nc,p,weight,1,kg\nc,q,weight,1,cm\n",
        "line 3, column 'unit': 'cm' is no multiple of 'kg'",
    ),
    "long, mixed origins": (
        ID
        + "property,component,value,origin\nc,p,size,length,1,\nc,p,size,width,1,human\nc,p,size,height,1,\n",
        "differs among the components of 'size'",
    ),
}


def check_one_line(error: pytest.ExceptionInfo[InputError]) -> None:
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 400


@pytest.mark.parametrize("case", MALFORMED)
def test_malformed_table_says_where_and_what_to_do(tmp_path: Path, case: str) -> None:
    content, message = MALFORMED[case]
    with pytest.raises(InputError, match=message) as error:
        read_table(write(tmp_path, content))
    check_one_line(error)
    assert "'t.csv'" in str(error.value)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("t.xlsx", b"x", "ending '.xlsx': give a .csv"),
        ("t", b"x", "ending '': give a .csv"),
        ("t.parquet", b"PAR1 and other junk", "not a Parquet file"),
        ("t.parquet", b"a,b\n1,2\n", "not a Parquet file"),
        ("t.csv.gz", b"a,b\n1,2\n", "called .gz but is not gzipped"),
        ("t.csv.gz", gzip.compress(WIDE.encode(), mtime=0)[:40], "damaged gzip"),
    ],
)
def test_wrong_kind_of_file(tmp_path: Path, name: str, content: bytes, message: str) -> None:
    with pytest.raises(InputError, match=message) as error:
        read_table(write(tmp_path, content, name))
    check_one_line(error)


def test_missing_file_and_directory(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"there is no file .*none\.csv"):
        read_table(tmp_path / "none.csv")
    with pytest.raises(InputError, match="is a directory: give the file in it"):
        read_table(tmp_path)


@pytest.mark.parametrize(
    ("column", "values", "message"),
    [
        ("weight", [1.0, float("nan")], "row 2, column 'weight': 'nan' is not a number: leave"),
        ("weight", [1.0, float("inf")], "row 2.*infinite"),
        ("weight", [[1.0], [2.0]], "column 'weight' holds List.*one number a cell"),
        ("weight", [True, False], "column 'weight' holds Boolean"),
        ("observation", [1.5, 2.5], "column 'observation' holds Float64: store names as text"),
    ],
)
def test_malformed_parquet(tmp_path: Path, column: str, values: list[object], message: str) -> None:
    table = {"object_class": ["c", "c"], "instance": ["p", "q"], "weight": [1, 2]} | {column: values}
    pl.DataFrame(table).write_parquet(tmp_path / "t.parquet")
    with pytest.raises(InputError, match=message) as error:
        read_table(tmp_path / "t.parquet")
    check_one_line(error)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("[grip", "is not TOML: .* correct the line"),
        ("grip = 1", "grip = 1 is not a property"),
        ('[Grip]\nkind = "physical"', "the property 'Grip' is not named in snake_case"),
        ('[a__b]\nkind = "physical"', "the property 'a__b' is not named"),
        ("[grip]", "kind = None must be physical or functional"),
        ('[grip]\nkind = "physical"\nunits = "m"', "unknown key 'units': did you mean 'unit'"),
        ('[grip]\nkind = "physical"\nunit = 1', "unit = 1 is not text"),
        ('[grip]\nkind = "physical"\ncomponents = ["a", "a"]', "must be a list of different names"),
        ('[weight]\nkind = "functional"', "describes 'weight' as"),
    ],
)
def test_malformed_description(tmp_path: Path, content: str, message: str) -> None:
    write(tmp_path, content, "t.properties.toml")
    with pytest.raises(InputError, match=message) as error:
        read_table(write(tmp_path, WIDE))
    assert "'t.properties.toml'" in str(error.value)
