"""The command line as a newcomer uses it."""

import csv
import io
import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from ersatz.knowledge.base import KnowledgeBase
from ersatz.reasoner.substitution import rank_substitutes
from ersatz.resources import DATA, ONTOLOGY
from tests.cli import Shell


def test_without_arguments_it_helps(ersatz: Shell) -> None:
    run = ersatz()
    assert "Which of the things at hand" in run.out
    for command in COMMANDS:
        assert command in run.out


COMMANDS = [
    "demo",
    "fetch",
    "fetch",
    "build",
    "substitute",
    "ask",
    "ground",
    "show",
    "observe",
    "forget",
    "query",
    "check",
    "link",
    "export",
    "upload",
    "serve",
    "evaluate",
    "scenarios",
    "survey",
]


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_an_example(command: str, ersatz: Shell) -> None:
    run = ersatz(command, "--help")
    assert run.code == 0
    assert f"Example: ersatz {command}" in " ".join(run.out.split())


@pytest.mark.parametrize("command", ["scan", "concepts", "drift"])
def test_every_figure_has_an_example(command: str, ersatz: Shell) -> None:
    assert command in ersatz("figure", "--help").out
    run = ersatz("figure", command, "--help")
    assert f"Example: ersatz figure {command}" in " ".join(run.out.split())


def test_version(ersatz: Shell) -> None:
    assert ersatz("--version").out.strip().count(".") == 2


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["substitue"], "No such command 'substitue'. Did you mean 'substitute'?"),
        (["substitute", "household", "--availble", "x"], "'--availble'. Did you mean '--available'?"),
        (["substitute", "household"], "Missing option '--missing'."),
        (["export", "household"], "Missing argument 'OUT'."),
        (["forget", "kb.ttl", "plate_1", "plate_2"], "unexpected extra argument (plate_2)"),
        (["build", "kb.ttl", "--clusters", "four"], "'--clusters': 'four' is not a valid integer."),
        (["query", "household", "--format", "xml"], "'xml' is not one of 'table', 'json', 'csv', 'ttl'."),
        (["figure"], "Missing command."),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_a_wrong_command_line_is_quoted(arguments: list[str], said: str, ersatz: Shell) -> None:
    run = ersatz(*arguments)
    assert (run.code, run.out) == (2, "")
    assert run.err.startswith("error: ")
    assert run.err.endswith(f"{said} Try `ersatz --help`.\n")


@pytest.mark.parametrize(
    ("words", "completed"),
    [
        ("ersatz sub", ["substitute"]),
        ("ersatz nothing", []),
        ("ersatz query household --format ", ["table", "json", "csv", "ttl"]),
        ("ersatz figure ", ["concepts", "drift", "scan"]),
    ],
)
def test_the_shell_completes(
    words: str, completed: list[str], ersatz: Shell, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("_ERSATZ_COMPLETE", "bash_complete")
    monkeypatch.setenv("COMP_WORDS", words)
    monkeypatch.setenv("COMP_CWORD", str(words.count(" ")))
    run = ersatz()
    assert run.code == 0
    assert [line.removeprefix("plain,") for line in run.out.split()] == completed


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_is_installed_once(
    shell: str, tmp_path: Path, ersatz: Shell, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("SHELL", f"/usr/bin/{shell}")
    assert "_ERSATZ_COMPLETE" in ersatz("--show-completion").out
    for _ in range(2):
        run = ersatz("--install-completion")
        assert run.code == 0
    file = Path(run.out.split(":")[0])
    assert file.is_relative_to(tmp_path)
    assert file.read_text().count(f"_ERSATZ_COMPLETE={shell}_source") == 1
    monkeypatch.setenv("SHELL", "/bin/csh")
    assert "'csh'" in ersatz("--install-completion").err


def test_demo(ersatz: Shell) -> None:
    run = ersatz("demo")
    assert run.code == 0
    assert run.out.count(" is missing.") >= 3
    assert "stands in" in run.out


def test_substitute_says_what_the_library_says(ersatz: Shell) -> None:
    run = ersatz("substitute", "household", "--missing", "tray", "--json")
    assert run.code == 0
    answer = json.loads(run.out)
    ranking = rank_substitutes(KnowledgeBase.open("household"), "tray")
    assert answer == json.loads(json.dumps(ranking.to_json()))
    assert answer["version"] == 1
    assert [one["name"] for one in answer["substitutes"]] == [one.name for one in ranking]
    assert set(answer) == {
        "version",
        "missing",
        "iri",
        "status",
        "settings",
        "revision",
        "reused",
        "relevant_functional",
        "relevant_physical",
        "substitutes",
    }


def test_thresholds_are_exact(small_kb: Path, ersatz: Shell) -> None:
    """A similarity of 1/2 is not above a tolerance of 1/2, and is above 0.4999999999999999999."""
    base = ("substitute", small_kb, "--missing", "tray", "--json")
    answer = json.loads(ersatz(*base).out)
    best = answer["substitutes"][0]
    numerator, denominator = best["similarity_fraction"]
    assert numerator
    for tolerance, accepted in ((f"{numerator}/{denominator}", False), ("0.0000000000000000001", True)):
        again = json.loads(ersatz(*base, "--tolerance", tolerance).out)
        assert again["substitutes"][0]["accepted"] is accepted


def test_perceived_instances(small_kb: Path, ersatz: Shell) -> None:
    run = ersatz(
        "substitute", small_kb, "--missing", "tray", "--instance", "plate_1", "--instance", "tray_3", "--json"
    )
    kinds = {one["name"]: (one["kind"], one["flags"]) for one in json.loads(run.out)["substitutes"]}
    assert kinds == {"plate_1": ("instance", []), "tray_3": ("instance", ["same_class"])}


@pytest.mark.parametrize("name", ["small.ttl", "kb"])
def test_remember(name: str, small_kb: Path, ersatz: Shell) -> None:
    kb = small_kb.with_name(name)
    if kb != small_kb:
        assert ersatz("export", small_kb, kb).code == 0
    ask = ("substitute", kb, "--missing", "tray", "--json")
    assert json.loads(ersatz(*ask).out)["reused"] is False
    assert json.loads(ersatz(*ask, "--remember").out)["reused"] is False
    reused = json.loads(ersatz(*ask).out)
    assert reused["reused"] is True
    assert {**reused, "reused": False} == json.loads(ersatz(*ask, "--relevance-tolerance", "0.35").out) | {
        "reused": False
    }
    assert ersatz("forget", kb, "plate_1").code == 0
    assert json.loads(ersatz(*ask).out)["reused"] is False


def test_remembering_in_the_shipped_one_is_refused_kindly(ersatz: Shell) -> None:
    before = (ONTOLOGY / "household.ttl").read_bytes()
    run = ersatz("substitute", "household", "--missing", "tray", "--remember", "--json")
    assert run.code == 0
    assert json.loads(run.out)["substitutes"]
    assert "warning: the answer is not remembered" in run.err
    assert (ONTOLOGY / "household.ttl").read_bytes() == before


@pytest.mark.parametrize("suffix", ["json", "toml", "csv"])
def test_observe_and_forget(suffix: str, small_kb: Path, ersatz: Shell) -> None:
    text = {
        "json": '{"weight": 0.5, "rigidity": 0.9}',
        "toml": "weight = 0.5\nrigidity = 0.9\n",
        "csv": "object_class,instance,weight [g],rigidity\nplate,plate_4,500,0.9\n",
    }[suffix]
    path = small_kb.with_name(f"new.{suffix}")
    path.write_text(text)
    before = KnowledgeBase.open(small_kb).revision
    run = ersatz("observe", small_kb, "plate", "plate_4", "--measurements", path)
    assert run.code == 0, run.err
    rows = {row["quality"]: row["total"] for row in knowledge_of(small_kb, "plate")}
    assert rows["https://w3id.org/ersatz/kb#weight_1"] == 4
    assert ersatz("forget", small_kb, "plate_4").code == 0
    assert KnowledgeBase.open(small_kb).revision == before


def knowledge_of(path: Path, name: str) -> list[dict[str, object]]:
    return [dict(row) for row in KnowledgeBase.open(path).ask("class_knowledge", **{"class": name})]


@pytest.mark.parametrize("name", ["tray", "plate_1", "weight", "weight_1", "support_2"])
def test_show_a_thing(name: str, small_kb: Path, ersatz: Shell) -> None:
    run = ersatz("show", small_kb, name)
    assert run.code == 0
    assert f"<https://w3id.org/ersatz/kb#{name.capitalize() if name == 'tray' else name}>" in run.out
    assert len(run.out.splitlines()) > 2


def test_show_everything(ersatz: Shell) -> None:
    run = ersatz("show", "household")
    assert "coffee mug" in run.out
    assert "kg m2" in run.out


def test_brackets_in_names_are_no_markup(table: Path, ersatz: Shell) -> None:
    table.write_text(table.read_text().replace("sponge", "sponge [bold]"))
    out = table.with_name("kb.ttl")
    built(out, ersatz, "--tables", table, "--clusters", 2)
    assert "sponge [bold]" in ersatz("show", out).out
    assert "sponge [bold]" in ersatz("substitute", out, "--missing", "sponge [bold]").out
    assert "sponge [bold]" in ersatz("query", out, "classes").out


def test_query_lists_questions(ersatz: Shell) -> None:
    run = ersatz("query", "household")
    assert "representative_qualities" in run.out
    assert "checks" not in run.out


def test_query_formats(ersatz: Shell) -> None:
    ask = ("query", "household", "class_knowledge", "--param", "class=tray", "--format")
    rows = json.loads(ersatz(*ask, "json").out)
    table = list(csv.DictReader(io.StringIO(ersatz(*ask, "csv").out)))
    assert len(rows) == len(table) > 5
    assert [row["quality"] for row in rows] == [row["quality"] for row in table]
    assert rows[0]["quality"].rpartition("#")[2] in ersatz(*ask, "table").out


def test_query_of_my_own(tmp_path: Path, ersatz: Shell) -> None:
    path = tmp_path / "own.rq"
    path.write_text("CONSTRUCT { ?_thing_iri ?p ?o } WHERE { ?_thing_iri ?p ?o }")
    run = ersatz("query", "household", path, "--param", "thing=tray", "--format", "ttl")
    assert run.code == 0
    assert "kb:Tray a owl:Class" in run.out


@pytest.mark.parametrize("to", ["owl", "ttl", "nt", "jsonld"])
def test_export(to: str, tmp_path: Path, ersatz: Shell) -> None:
    assert ersatz("export", "household", "--to", to, tmp_path / "copy").code == 0
    assert KnowledgeBase.open(tmp_path / f"copy.{to}").revision == KnowledgeBase.open("household").revision


def built(out: Path, ersatz: Shell, *options: object) -> bytes:
    run = ersatz("build", out, *options)
    assert run.code == 0, run.err
    return out.read_bytes()


def test_both_shipped_files_hold_the_same(tmp_path: Path, ersatz: Shell) -> None:
    """The RDF/XML beside the Turtle is its export, byte for byte; both state the revision they have."""
    assert ersatz("export", "household", tmp_path / "household.owl").code == 0
    assert (tmp_path / "household.owl").read_bytes() == (ONTOLOGY / "household.owl").read_bytes()
    assert ersatz("export", ONTOLOGY / "household.owl", tmp_path / "household.ttl").code == 0
    assert (tmp_path / "household.ttl").read_bytes() == (ONTOLOGY / "household.ttl").read_bytes()


def test_the_shipped_expert_is_named_household(tmp_path: Path, ersatz: Shell) -> None:
    one = built(tmp_path / "one.ttl", ersatz, "--expert", "household")
    assert one == built(tmp_path / "two.ttl", ersatz, "--expert", DATA / "expert.toml")


def shuffled(path: Path) -> Iterator[Path]:
    head, *rows = path.read_text().splitlines(keepends=True)
    for number, order in enumerate((rows[::-1], rows[3:] + rows[:3])):
        copy = path.parent / str(number) / path.name
        copy.parent.mkdir()
        copy.write_text("".join([head, *order]))
        yield copy


def test_row_order_changes_nothing_but_the_source(table: Path, ersatz: Shell) -> None:
    out = table.with_name("kb.ttl")
    built(out, ersatz, "--tables", table, "--clusters", 2)
    revision = KnowledgeBase.open(out).revision
    for copy in shuffled(table):
        built(out, ersatz, "--tables", copy, "--clusters", 2)
        assert KnowledgeBase.open(out).revision == revision


def test_time_is_written_only_when_asked_for(
    table: Path, ersatz: Shell, monkeypatch: pytest.MonkeyPatch
) -> None:
    options = ("--tables", table, "--clusters", 2)
    plain = built(table.with_name("a.ttl"), ersatz, *options)
    assert plain == built(table.with_name("a.ttl"), ersatz, *options)
    assert b"endedAtTime" not in plain
    timed = built(table.with_name("b.ttl"), ersatz, *options, "--time", "2026-01-31T12:00:00+01:00")
    assert b'prov:endedAtTime "2026-01-31T11:00:00Z"^^xsd:dateTime' in timed
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "0")
    assert b"1970-01-01T00:00:00Z" in built(table.with_name("c.ttl"), ersatz, *options)


def test_classes_only(table: Path, ersatz: Shell) -> None:
    out, whole = table.with_name("classes.ttl"), table.with_name("whole.ttl")
    built(out, ersatz, "--tables", table, "--clusters", 2, "--classes-only")
    built(whole, ersatz, "--tables", table, "--clusters", 2)
    assert b"plate_1" not in out.read_bytes()
    ask = ("--missing", "tray", "--json")
    some, all_ = (json.loads(ersatz("substitute", kb, *ask).out) for kb in (out, whole))
    assert {**some, "revision": ""} == {**all_, "revision": ""}


def test_observations_as_units(table: Path, ersatz: Shell) -> None:
    table.write_text(
        "object_class,instance,observation,weight\n"
        "plate,p1,a,1\nplate,p1,b,3\nplate,p2,a,1\ntray,t1,a,9\ntray,t1,b,9\n"
    )
    out = table.with_name("kb.ttl")
    options = ("--tables", table, "--clusters", 3)
    built(out, ersatz, *options, "--unit", "observation")
    assert [(row["count"], row["total"]) for row in knowledge_of(out, "plate")] == [(2, 3), (1, 3)]
    built(out, ersatz, *options)
    assert [(row["count"], row["total"]) for row in knowledge_of(out, "plate")] == [(1, 2), (1, 2)]


def test_a_fuzzy_knowledge_base_is_built_shown_changed_and_asked(table: Path, ersatz: Shell) -> None:
    out, options = table.with_name("fuzzy.ttl"), ("--tables", table, "--clusters", 2)
    crisp = built(out, ersatz, *options)
    assert built(out, ersatz, *options, "--fuzzy", "--fuzzifier", 1) == crisp
    fuzzy = built(out, ersatz, *options, "--fuzzy")
    assert b"ersatz:fuzzifier 2.0" in fuzzy
    assert fuzzy == built(out, ersatz, *options, "--fuzzy", "--fuzzifier", 2) != crisp
    shown = ersatz("show", out, "tray_3").out.splitlines()
    degrees = dict(line.split()[:2] for line in shown if line.startswith("weight_"))
    assert degrees.keys() == {"weight_1", "weight_2"}
    assert 0.8 < float(degrees["weight_1"]) < 1
    measured = table.with_name("tray_4.toml")
    measured.write_text("weight = 0.6\nrigidity = 0.9\nsupport = 0.11\n")
    assert ersatz("observe", out, "tray", "tray_4", "--measurements", measured).code == 0
    assert out.read_bytes() != fuzzy
    assert ersatz("check", out).code == 0
    assert ersatz("forget", out, "tray_4").code == 0
    revisions = [KnowledgeBase.open(file).revision for file in (out, built_file(table, fuzzy))]
    assert revisions[0] == revisions[1]
    run = ersatz("substitute", out, "--missing", "tray", "--json")
    assert run.code in (0, 1)
    assert json.loads(run.out)["status"] in ("ok", "undetermined")


def built_file(beside: Path, content: bytes) -> Path:
    path = beside.with_name("before.ttl")
    path.write_bytes(content)
    return path
