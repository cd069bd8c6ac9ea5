"""Bad input ends in one line that quotes what is wrong and says what to do; nothing is lost."""

import gzip
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.cli import Shell
from tests.conftest import TABLE

HEAD = "object_class,instance,weight,rigidity,support\n"
EXPERT = """
format = 1
[classes.plate]
instances = 3
scans = 1
weight = { family = "normal", mean = 300, sd = 20, unit = "g", reason = "said so" }
"""

Table = Callable[[str], str]
TABLES: dict[str, tuple[str | bytes, list[str]]] = {
    "an unknown column": (HEAD.replace("weight", "wieght") + "a,a_1,1,1,1\n", ["wieght", "weight"]),
    "text in a number": (HEAD + "plate,plate_1,heavy,1,1\n", ["heavy", "line 2"]),
    "a decimal comma": (HEAD + 'plate,plate_1,"0,3",1,1\n', ["0,3"]),
    "NaN": (HEAD + "plate,plate_1,nan,1,1\n", ["nan", "empty"]),
    "infinity": (HEAD + "plate,plate_1,inf,1,1\n", ["inf"]),
    "beyond every float": (HEAD + "plate,plate_1,1e999,1,1\n", ["1e999"]),
    "an absurd number": (HEAD + "plate,plate_1,1e200,1,1\n", ["1e200"]),
    "NA for missing": (HEAD + "plate,plate_1,NA,1,1\n", ["NA", "empty"]),
    "a negative weight": (HEAD + "plate,plate_1,-1,1,1\n", ["-1", "weight"]),
    "rigidity above one": (HEAD + "plate,plate_1,1,1.5,1\n", ["1.5", "rigidity"]),
    "mixed units": ("object_class,instance,weight [m]\nplate,plate_1,1\n", ["'m'", "kg"]),
    "an unknown unit": ("object_class,instance,weight [stone]\nplate,plate_1,1\n", ["stone", "kg"]),
    "no instance column": ("object_class,weight\nplate,1\n", ["instance"]),
    "no class column": ("instance,weight\nplate_1,1\n", ["object_class"]),
    "a column twice": ("object_class,instance,weight,weight\nplate,plate_1,1,2\n", ["weight"]),
    "an empty name": (HEAD + "plate,,1,1,1\n", ["instance"]),
    "one object twice": (HEAD + "plate,plate_1,1,1,1\nplate,plate_1,2,1,1\n", ["plate_1"]),
    "one object, two classes": (HEAD + "plate,x_1,1,1,1\ntray,x_1,2,1,1\n", ["x_1", "plate", "tray"]),
    "names that collide": (HEAD + "plate,a b,1,1,1\nplate,a_b,2,1,1\n", ["'a b'", "'a_b'", "rename"]),
    "classes that collide": (
        HEAD + "food can,a,1,1,1\nFood Can,b,2,1,1\n",
        ["Food Can", "food can", "rename"],
    ),
    "an object called like a quality": (
        HEAD + "plate,weight_1,1,1,1\nplate,b,2,1,1\n",
        ["weight_1", "rename"],
    ),
    "a name of punctuation": (HEAD + "plate,???,1,1,1\n", ["???", "letter"]),
    "half a vector": ("object_class,instance,size.length,size.width\nplate,p,1,1\n", ["size", "height"]),
    "a header and no row": (HEAD, ["row"]),
    "nothing but empty cells": (HEAD + "plate,plate_1,,,\n", ["value"]),
    "an empty file": ("", ["empty"]),
    "binary junk": (bytes(range(256)) * 8, ["objects.csv"]),
    "another encoding": (HEAD.encode() + "caf\xe9,x,1,1,1\n".encode("latin-1"), ["UTF-8"]),
    "a short row": (HEAD + "plate,plate_1,1\n", ["line 2"]),
}


def one_line(text: str) -> str:
    """Return the single error line a command printed; fail if it said more."""
    lines = [line for line in text.splitlines() if not line.startswith("warning: ")]
    assert len(lines) == 1, text
    assert lines[0].startswith("error: "), text
    assert "Traceback" not in text
    assert len(lines[0]) < 500, lines[0]
    return lines[0]


@pytest.mark.parametrize("name", TABLES)
def test_tables(name: str, tmp_path: Path, ersatz: Shell) -> None:
    content, words = TABLES[name]
    path, out = tmp_path / "objects.csv", tmp_path / "kb.ttl"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    out.write_text("what was there before")
    run = ersatz("build", out, "--tables", path)
    assert run.code == 2, run
    line = one_line(run.err)
    for word in words:
        assert word in line
    assert out.read_text() == "what was there before"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["kb.ttl", "objects.csv"]


def test_good_table_passes(table: Path, ersatz: Shell) -> None:
    """The same command succeeds on good input, so that the cases above fail for their own reason."""
    assert ersatz("build", table.with_name("kb.ttl"), "--tables", table, "--clusters", 2).code == 0


KB_FILES: dict[str, tuple[str, bytes, list[str]]] = {
    "binary junk as Turtle": ("kb.ttl", bytes(range(256)), ["kb.ttl", "Turtle"]),
    "binary junk as RDF/XML": ("kb.owl", bytes(range(256)), ["kb.owl", "RDF"]),
    "an empty file": ("kb.ttl", b"", ["no ERSATZ knowledge base", "ersatz build"]),
    "someone else's RDF": ("kb.ttl", b"<http://a> <http://b> <http://c> .", ["no ERSATZ knowledge base"]),
    "half a gz": ("kb.nt.gz", gzip.compress(b"<http://a> <http://b> <http://c> .\n" * 99)[:20], ["kb.nt.gz"]),
    "gz in name only": ("kb.nt.gz", b"<http://a> <http://b> <http://c> .\n", ["kb.nt.gz"]),
    "a name that says no format": ("kb.txt", b"hello", ["kb.txt", ".ttl"]),
}


@pytest.mark.parametrize("name", KB_FILES)
def test_knowledge_base_files(name: str, tmp_path: Path, ersatz: Shell) -> None:
    file, content, words = KB_FILES[name]
    (tmp_path / file).write_bytes(content)
    run = ersatz("show", tmp_path / file)
    assert run.code == 2
    line = one_line(run.err)
    for word in words:
        assert word in line


def test_truncated_turtle(small_kb: Path, ersatz: Shell) -> None:
    small_kb.write_bytes(small_kb.read_bytes()[:-100])
    run = ersatz("show", small_kb)
    assert run.code == 2
    assert "small.ttl" in one_line(run.err)


def test_another_version(small_kb: Path, ersatz: Shell) -> None:
    text = small_kb.read_text()
    assert "ersatz:formatVersion 1 ;" in text
    small_kb.write_text(text.replace("ersatz:formatVersion 1 ;", "ersatz:formatVersion 99 ;"))
    run = ersatz("show", small_kb)
    assert run.code == 2
    assert "format 99" in one_line(run.err)


def test_truncated_directory(small_kb: Path, ersatz: Shell) -> None:
    folder = small_kb.with_name("kb")
    assert ersatz("export", small_kb, folder).code == 0
    for file in (folder / "snapshots").rglob("*.sst"):
        file.write_bytes(b"")
    for file in (folder / "snapshots").rglob("MANIFEST*"):
        file.write_bytes(file.read_bytes()[:10])
    run = ersatz("show", folder)
    assert run.code == 2
    assert str(folder) in one_line(run.err)


NAMES: dict[str, tuple[list[str], list[str]]] = {
    "an unknown class, nearly right": (["substitute", "KB", "--missing", "tary"], ["'tary'", "'tray'"]),
    "an unknown class, nothing near": (["substitute", "KB", "--missing", "zzzzzz"], ["'zzzzzz'"]),
    "an unknown candidate": (
        ["substitute", "KB", "--missing", "tray", "--available", "plat"],
        ["'plat'", "'plate'"],
    ),
    "only the tool itself": (
        ["substitute", "KB", "--missing", "tray", "--available", "tray"],
        ["'tray' itself"],
    ),
    "an unknown instance": (
        ["substitute", "KB", "--missing", "tray", "--instance", "plate_11"],
        ["'plate_11'"],
    ),
    "a threshold in words": (
        ["substitute", "KB", "--missing", "tray", "--tolerance", "some"],
        ["'some'", "0.35"],
    ),
    "a threshold with a comma": (
        ["substitute", "KB", "--missing", "tray", "--tolerance", "0,35"],
        ["'0,35'"],
    ),
    "a threshold out of range": (["substitute", "KB", "--missing", "tray", "--tolerance", "35"], ["35"]),
    "theta zero": (["substitute", "KB", "--missing", "tray", "--representative", "0"], ["representative"]),
    "an unknown similarity": (
        ["substitute", "KB", "--missing", "tray", "--similarity", "cosine"],
        ["cosine"],
    ),
    "an unknown combination": (
        ["substitute", "KB", "--missing", "tray", "--combine", "both"],
        ["both", "union"],
    ),
    "an unknown property": (
        ["substitute", "KB", "--missing", "tray", "--properties", "color"],
        ["color", "weight"],
    ),
    "an unknown option": (["substitute", "KB", "--mising", "tray"], ["--mising"]),
    "no tool": (["substitute", "KB"], ["missing"]),
    "an unknown command": (["substitue", "KB"], ["substitue"]),
    "no such knowledge base": (["show", "nowhere"], ["'nowhere'", "household"]),
    "no such file": (["show", "nowhere.ttl"], ["nowhere.ttl"]),
    "a directory that is none": (["show", "."], ["'.'", "ersatz build"]),
    "no such host": (["show", "http://127.0.0.1:9/sparql"], ["127.0.0.1:9"]),
    "an unknown question": (["query", "KB", "class_knowlege"], ["'class_knowlege'", "'class_knowledge'"]),
    "a parameter missing": (["query", "KB", "class_knowledge"], ["class"]),
    "a parameter too many": (["query", "KB", "classes", "--param", "x=1"], ["'x'"]),
    "a parameter without value": (["query", "KB", "class_knowledge", "--param", "class"], ["name=value"]),
    "a number that is none": (
        ["query", "KB", "jaccard", "--param", "qualities=weight_1", "--param", "threshold=much"],
        ["'much'"],
    ),
    "an unknown thing": (["show", "KB", "plat"], ["'plat'", "'plate'"]),
    "an unknown object to forget": (["forget", "KB", "plate_33"], ["'plate_33'", "'plate_3'"]),
    "nothing to ground": (["build", "OUT.ttl"], ["measurements"]),
    "a folder that does not exist": (["build", "no/where/kb.ttl", "--expert", "household"], ["create it"]),
    "an output without a format": (["build", "kb.docx", "--expert", "household"], ["kb.docx", ".ttl"]),
    "no such table": (["build", "OUT.ttl", "--tables", "no.csv"], ["no.csv"]),
    "a folder for a table": (["build", "OUT.ttl", "--tables", "."], ["holds no Parquet file"]),
    "a folder that is not RoCS": (["build", "OUT.ttl", "--rocs", "."], ["."]),
    "no clusters": (["build", "OUT.ttl", "--expert", "household", "--clusters", "0"], ["0"]),
    "a fuzzifier out of range": (
        ["build", "OUT.ttl", "--expert", "household", "--fuzzy", "--fuzzifier", "0.5"],
        ["0.5", "between 1 (crisp) and 10"],
    ),
    "a fuzzifier that is no number": (
        ["build", "OUT.ttl", "--expert", "household", "--fuzzy", "--fuzzifier", "nan"],
        ["nan", "between 1 (crisp) and 10"],
    ),
    "a fuzzifier of crisp qualities": (
        ["build", "OUT.ttl", "--expert", "household", "--fuzzifier", "2"],
        ["--fuzzifier 2", "needs --fuzzy"],
    ),
    "a time that is none": (["build", "OUT.ttl", "--expert", "household", "--time", "noon"], ["'noon'"]),
    "the shipped one changed": (["forget", "household", "ycb_029_plate"], ["household", "elsewhere"]),
}


@pytest.mark.parametrize("name", NAMES)
def test_names_and_options(name: str, small_kb: Path, ersatz: Shell, monkeypatch: pytest.MonkeyPatch) -> None:
    arguments, words = NAMES[name]
    monkeypatch.chdir(small_kb.parent)
    before = small_kb.read_bytes()
    listing = sorted(path.name for path in small_kb.parent.iterdir())
    run = ersatz(*(str(small_kb) if one == "KB" else one for one in arguments))
    assert run.code == 2, run
    line = one_line(run.err)
    for word in words:
        assert word in line
    assert not run.out
    assert small_kb.read_bytes() == before
    assert sorted(path.name for path in small_kb.parent.iterdir()) == listing


QUERIES = {
    "no SPARQL": ("hello", "SPARQL"),
    "an update": ("INSERT DATA { <http://a> <http://b> <http://c> }", "SPARQL"),
    "another server": ("SELECT * { SERVICE <http://127.0.0.1:9/> { ?s ?p ?o } }", "SERVICE"),
    "another server, in disguise": ("SELECT * { service\n<http://127.0.0.1:9/> { ?s ?p ?o } }", "SERVICE"),
}


@pytest.mark.parametrize("name", QUERIES)
def test_hostile_queries(name: str, small_kb: Path, ersatz: Shell) -> None:
    text, word = QUERIES[name]
    path = small_kb.with_name("own.rq")
    path.write_text(text)
    run = ersatz("query", small_kb, path)
    assert run.code == 2
    assert word in one_line(run.err)


OBSERVATIONS: dict[str, tuple[str, str, list[str]]] = {
    "an unknown property": ("plate", '{"colour": 1}', ["'colour'", "weight"]),
    "a word": ("plate", '{"weight": "heavy"}', ["'heavy'"]),
    "a vector for a number": ("plate", '{"weight": [1, 2]}', ["weight"]),
    "NaN": ("plate", '{"weight": NaN}', ["nan"]),
    "nothing": ("plate", "{}", ["no measurements"]),
    "no JSON": ("plate", "weight = 1", ["new.json"]),
    "another class": ("tray", '{"weight": 1}', ["plate", "tray"]),
    "a class called alike": ("Plate", '{"weight": 1}', ["'Plate'", "'plate'"]),
    "measured before": ("plate", '{"weight": 1}', ["plate_1", "observation"]),
}


@pytest.mark.parametrize("name", OBSERVATIONS)
def test_observations(name: str, small_kb: Path, ersatz: Shell) -> None:
    object_class, text, words = OBSERVATIONS[name]
    path = small_kb.with_name("new.json")
    path.write_text(text)
    before = small_kb.read_bytes()
    run = ersatz("observe", small_kb, object_class, "plate_1", "--measurements", path)
    assert run.code == 2
    line = one_line(run.err)
    for word in words:
        assert word in line
    assert small_kb.read_bytes() == before


EXPERTS = {
    "no TOML": ("weight = = 1", []),
    "an unknown family": (EXPERT.replace("normal", "pareto"), ["pareto"]),
    "a missing parameter": (EXPERT.replace(", sd = 20", ""), ["sd"]),
    "a negative spread": (EXPERT.replace("sd = 20", "sd = -20"), ["sd", "above 0"]),
    "an unknown unit": (EXPERT.replace('"g"', '"stone"'), ["stone"]),
    "an unknown property": (EXPERT.replace("weight =", "wieght ="), ["wieght"]),
    "no classes": ("format = 1", ["class"]),
}


@pytest.mark.parametrize("name", EXPERTS)
def test_experts(name: str, tmp_path: Path, ersatz: Shell) -> None:
    text, words = EXPERTS[name]
    path = tmp_path / "expert.toml"
    path.write_text(text)
    run = ersatz("build", tmp_path / "kb.ttl", "--expert", path)
    assert run.code == 2
    line = one_line(run.err)
    assert "expert.toml" in line
    for word in words:
        assert word in line
    assert not (tmp_path / "kb.ttl").exists()


def test_few_distinct_values_warn(table: Path, ersatz: Shell) -> None:
    """Fewer distinct values than clusters: a result, and a warning on stderr."""
    path = table.with_name("few.csv")
    path.write_text("object_class,instance,weight\nplate,p1,1\nplate,p2,1\ntray,t1,2\n")
    run = ersatz("build", table.with_name("few.ttl"), "--tables", path)
    assert run.code == 0
    assert "warning: 'weight' has 2 distinct value(s): 2 instead of 4 qualities" in run.err


@pytest.mark.parametrize("rows", [1, 3])
def test_one_class_has_no_candidates(rows: int, table: Path, ersatz: Shell) -> None:
    path, out = table.with_name("one.csv"), table.with_name("one.ttl")
    path.write_text("".join(TABLE.splitlines(keepends=True)[: rows + 1]))
    assert ersatz("build", out, "--tables", path, "--clusters", 1).code == 0
    run = ersatz("substitute", out, "--missing", "plate")
    assert run.code == 2
    assert "only class" in one_line(run.err)


def test_undetermined_is_not_an_error(small_kb: Path, ersatz: Shell) -> None:
    run = ersatz("substitute", small_kb, "--missing", "tray", "--relevance-tolerance", "1", "--json")
    assert run.code == 1
    assert json.loads(run.out)["status"] == "undetermined"


def test_parquet_junk(tmp_path: Path, ersatz: Shell) -> None:
    path = tmp_path / "objects.parquet"
    path.write_bytes(np.random.default_rng(0).bytes(1000))
    run = ersatz("build", tmp_path / "kb.ttl", "--tables", path)
    assert run.code == 2
    assert "objects.parquet" in one_line(run.err)
