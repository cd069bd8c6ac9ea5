"""How sure an answer is, and what to measure next, on the command line."""

import json
from pathlib import Path

from tests.cli import Shell

ASKED = ("substitute", "household", "--missing", "tray", "--available", "plate", "--available", "sponge")


def test_an_answer_says_how_sure_it_is(ersatz: Shell) -> None:
    plain = json.loads(ersatz(*ASKED, "--json").out)
    found = json.loads(ersatz(*ASKED, "--confidence", "--draws", 50, "--seed", 1, "--json").out)
    for one, other in zip(found["substitutes"], plain["substitutes"], strict=True):
        assert set(one) - set(other) == {"confidence"}
    sure = [one["confidence"] for one in found["substitutes"]]
    assert all(one["draws"] == 50 and one["seed"] == 1 for one in sure)
    assert abs(sum(one["best"] for one in sure) - 1) < 1e-6
    assert "of 50 draws" in ersatz(*ASKED, "--confidence", "--draws", 50).out.replace("\n", " ")


def test_confidence_is_remembered_in_the_file(ersatz: Shell, small_kb: Path) -> None:
    asked = ("substitute", small_kb, "--missing", "tray", "--confidence", "--remember")
    assert ersatz(*asked).code == 0
    text = small_kb.read_text(encoding="utf-8")
    assert "ersatz:acceptanceProbability" in text and "ersatz:draws 200" in text
    assert ersatz("check", small_kb).code == 0


def test_it_is_told_what_to_measure(ersatz: Shell, tmp_path: Path) -> None:
    known = tmp_path / "object.toml"
    known.write_text("rigidity = 0.9\n", encoding="utf-8")
    asked = ("ask", "household", "--missing", "tray", "--measured", known)
    found = json.loads(ersatz(*asked, "--json").out)
    properties = [one["property"] for one in found["measure"]]
    assert properties and "rigidity" not in properties
    assert properties[0] in ersatz(*asked).out
    known.write_text("", encoding="utf-8")
    assert "rigidity" in [one["property"] for one in json.loads(ersatz(*asked, "--json").out)["measure"]]
    classes = ersatz("ask", "household", "--missing", "tray", "--available", "plate", "--best", "--draws", 50)
    assert classes.code == 0


def test_of_fuzzy_qualities_a_measured_object_holds_several(ersatz: Shell, tmp_path: Path) -> None:
    """Between two centroids a little weight tells more than the quality it is nearest to."""
    table, fuzzy = tmp_path / "objects.csv", tmp_path / "fuzzy.ttl"
    rows = [f"{name},{name}_{at},{weight},{area}" for name, weight, area in
            (("plate", 0.3, 0.05), ("tray", 0.8, 0.1)) for at in range(5)]  # fmt: skip
    table.write_text("\n".join(["object_class,instance,weight [kg],support [m2]", *rows]), encoding="utf-8")
    assert ersatz("build", fuzzy, "--tables", table, "--fuzzy", "--clusters", 2).code == 0
    known, found = tmp_path / "object.toml", []
    for weight in (0.79, 0.7, 0.6):  # all are weight_2 most
        known.write_text(f"weight = {weight}\n", encoding="utf-8")
        asked = ("ask", fuzzy, "--missing", "tray", "--graded", "--tolerance", "0.8", "--measured", known)
        found.append(json.loads(ersatz(*asked, "--json").out)["candidates"][0]["accepted"])
    assert found[0] > found[-1]


def test_asking_knows_the_rule_that_decides(ersatz: Shell) -> None:
    asked = ("ask", "household", "--missing", "tray", "--available", "plate", "--draws", 50, "--json")

    def accepted(*given: object) -> float:
        return float(json.loads(ersatz(*asked, *given).out)["candidates"][0]["accepted"])

    assert accepted("--graded", "--tolerance", "0.1") == 1
    assert accepted("--graded", "--tolerance", "0.99", "--similarity", "ruzicka") == 0
    close = ("--graded", "--tolerance", "0.74")
    assert accepted(*close, "--spacing", "centroid") != accepted(*close)
    assert ersatz(*asked, "--certainty", "2").err == (
        "error: certainty is 2: it lies between 0 and 1, without them\n"
    )


def test_what_cannot_be_asked_is_refused_in_one_line(ersatz: Shell, tmp_path: Path) -> None:
    known = tmp_path / "object.toml"
    for text, wanted in (("length = 1", "'length'"), ('weight = "much"', "weight"), ("size = 3", "size")):
        known.write_text(text, encoding="utf-8")
        run = ersatz("ask", "household", "--missing", "tray", "--measured", known)
        assert (run.code, run.out) == (2, "")
        assert run.err.startswith("error: ") and wanted in run.err and run.err.count("\n") == 1
    assert ersatz(*ASKED, "--confidence", "--draws", 0).code == 2
    for given in (("--draws", 10), ("--seed", 0)):
        run = ersatz(*ASKED, *given)
        assert (run.code, run.out) == (2, "")
        assert run.err == f"error: {given[0]} {given[1]} needs --confidence: without it nothing is drawn\n"


def test_how_qualities_are_spaced_is_said(ersatz: Shell) -> None:
    spaced = {"rank": "", "centroid": ", spaced by centroids", "ratio": ", spaced by ratios of centroids"}
    for name, words in spaced.items():
        assert f"How alike: ordinal{words}\n" in ersatz(*ASKED, "--graded", "--spacing", name).out
