"""Every stored question: its header, its example on the shipped knowledge base, its rows on a small world.

The rows were worked out by hand. Oxigraph and rdflib's own engine must both give them.
"""

import doctest
import re
import shlex
from collections.abc import Iterable
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction

import pytest
import rdflib

from ersatz.errors import InputError
from ersatz.grounding.subcategorization import SubcategorizationSettings
from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.queries import Argument, query_names, stored_query
from ersatz.knowledge.questions import table_of_questions
from ersatz.knowledge.substitutions import remembered
from ersatz.knowledge.turtle import turtle
from ersatz.knowledge.vocabulary import PREFIXES
from ersatz.measurements import PROPERTIES
from ersatz.pipeline import Settings, build
from ersatz.reasoner.relevance import ReasonerSettings
from ersatz.reasoner.substitution import rank_substitutes
from ersatz.resources import ONTOLOGY, SPARQL
from tests.cli import Shell
from tests.knowledge.tools import Row, blocks

QUESTIONS = tuple(name for name in query_names() if "/" not in name)
SIZE, WEIGHT, SUPPORT = (PROPERTIES[name] for name in ("size", "weight", "support"))

WORLD: tuple[Row, ...] = (
    (WEIGHT, "tray", "tray 1", "", (0.8,)),
    (WEIGHT, "tray", "tray 2", "", (0.6,)),
    (WEIGHT, "plate", "plate 1", "", (0.5,)),
    (WEIGHT, "plate", "plate 2", "a", (0.4,)),
    (WEIGHT, "plate", "plate 2", "b", (0.6,)),
    (WEIGHT, "sponge", "sponge 1", "", (0.1,)),
    (SUPPORT, "tray", "tray 1", "", (0.14,)),
    (SUPPORT, "tray", "tray 2", "", (0.12,)),
    (SUPPORT, "plate", "plate 1", "", (0.1,)),
    (SUPPORT, "plate", "plate 2", "", (0.02,)),
    (SUPPORT, "sponge", "sponge 1", "", (0.02,)),
    (SIZE, "tray", "tray 1", "", (0.4, 0.3, 0.04)),
    (SIZE, "plate", "plate 1", "", (0.2, 0.2, 0.02)),
    (SIZE, "sponge", "sponge 1", "", (0.2, 0.1, 0.06)),
)
"""Two qualities a property: weight is cut at 0.35 kg, support at 0.07 m2, and a tray's size is another's."""


@dataclass(frozen=True, slots=True)
class Case:
    """A question's arguments, and its rows: cells between bars, "-" where unbound, "*" where any will do."""

    rows: str
    arguments: dict[str, Argument] | None = None


HASH = "ab" * 32

CASES: dict[str, list[Case]] = {
    "all_instances": [
        Case(
            """
            kb:plate_1  | plate 1  | kb:Plate
            kb:plate_2  | plate 2  | kb:Plate
            kb:sponge_1 | sponge 1 | kb:Sponge
            kb:tray_1   | tray 1   | kb:Tray
            kb:tray_2   | tray 2   | kb:Tray
            """
        )
    ],
    "axes": [Case("kb:size | 1 | length \n kb:size | 2 | width \n kb:size | 3 | height")],
    "build": [Case("1 | instance | 0.35 | 2 | 0 | * | * | 2026-01-02T03:04:05Z | REVISION")],
    "class": [Case("plate | 2", {"class": "plate"}), Case("tray | 2", {"class": "kb:Tray"})],
    "class_knowledge": [
        Case(
            """
            kb:size    | kb:size_1    | 1 | 1 | 1 | 1
            kb:support | kb:support_1 | 1 | 1 | 2 | 0.5
            kb:support | kb:support_2 | 2 | 1 | 2 | 0.5
            kb:weight  | kb:weight_2  | 2 | 2 | 2 | 1
            """,
            {"class": "plate"},
        )
    ],
    "classes": [Case("kb:Plate | plate | 2 \n kb:Sponge | sponge | 1 \n kb:Tray | tray | 2")],
    "classes_with_quality": [
        Case("kb:Sponge | 1 | 1 | 1 \n kb:Plate | 1 | 2 | 0.5", {"quality": "support_1"}),
        Case("kb:Plate | 2 | 2 | 1 \n kb:Tray | 2 | 2 | 1", {"quality": "weight_2"}),
    ],
    "function_model": [
        Case(
            """
            kb:size   | kb:size_1   | 1 | 1 | 2 | 0.5
            kb:size   | kb:size_2   | 2 | 1 | 2 | 0.5
            kb:weight | kb:weight_2 | 2 | 3 | 3 | 1
            """,
            {"function": "support_2"},
        )
    ],
    "function_models": [
        Case(
            """
            kb:support_1 | kb:size_1   | 1 | 1
            kb:support_1 | kb:weight_1 | 1 | 2
            kb:support_1 | kb:weight_2 | 1 | 2
            kb:support_2 | kb:size_1   | 1 | 2
            kb:support_2 | kb:size_2   | 1 | 2
            kb:support_2 | kb:weight_2 | 3 | 3
            """
        )
    ],
    "holders": [
        Case("kb:plate_2 | kb:Plate \n kb:sponge_1 | kb:Sponge", {"quality": "support_1"}),
        Case("kb:tray_1 | kb:Tray", {"quality": "size_2"}),
    ],
    "index": [
        Case(
            """
            kb:Plate     | plate  | -            | 2 | -
            kb:Sponge    | sponge | -            | 1 | -
            kb:Tray      | tray   | -            | 2 | -
            kb:Plate     | -      | kb:size_1    | 1 | 1
            kb:Plate     | -      | kb:support_1 | 1 | 2
            kb:Plate     | -      | kb:support_2 | 1 | 2
            kb:Plate     | -      | kb:weight_2  | 2 | 2
            kb:Sponge    | -      | kb:size_1    | 1 | 1
            kb:Sponge    | -      | kb:support_1 | 1 | 1
            kb:Sponge    | -      | kb:weight_1  | 1 | 1
            kb:Tray      | -      | kb:size_2    | 1 | 1
            kb:Tray      | -      | kb:support_2 | 2 | 2
            kb:Tray      | -      | kb:weight_2  | 2 | 2
            kb:support_1 | -      | kb:size_1    | 1 | 1
            kb:support_1 | -      | kb:weight_1  | 1 | 2
            kb:support_1 | -      | kb:weight_2  | 1 | 2
            kb:support_2 | -      | kb:size_1    | 1 | 2
            kb:support_2 | -      | kb:size_2    | 1 | 2
            kb:support_2 | -      | kb:weight_2  | 3 | 3
            """
        )
    ],
    "index_of": [
        Case(
            """
            kb:Sponge    | sponge | -            | 1 | -
            kb:Sponge    | -      | kb:size_1    | 1 | 1
            kb:Sponge    | -      | kb:support_1 | 1 | 1
            kb:Sponge    | -      | kb:weight_1  | 1 | 1
            kb:support_1 | -      | kb:size_1    | 1 | 1
            kb:support_1 | -      | kb:weight_1  | 1 | 2
            kb:support_1 | -      | kb:weight_2  | 1 | 2
            """,
            {"concepts": ["kb:Sponge", "kb:support_1", "kb:plate_1"]},
        )
    ],
    "index_touched": [
        Case("kb:Plate | - \n kb:Tray | -", {"things": ["kb:Plate", "kb:model_Tray", "kb:plate_1"]}),
        Case("kb:Sponge | - \n - | kb:size", {"things": ["kb:Sponge__size_1", "kb:size_1"]}),
        Case("- | kb:weight", {"things": ["kb:weight"]}),
    ],
    "instance": [Case("plate 2 | kb:Plate | plate", {"instance": "plate 2"})],
    "instance_measurements": [
        Case(
            f"""
            kb:support | - | - | 0.02 | ersatz:machine | table.csv | {HASH} | -
            kb:weight  | a | - | 0.4  | ersatz:machine | table.csv | {HASH} | -
            kb:weight  | b | - | 0.6  | ersatz:machine | table.csv | {HASH} | -
            """,
            {"instance": "plate_2"},
        ),
        Case(
            f"""
            kb:size    | - | 1 | 0.2  | ersatz:machine | table.csv | {HASH} | -
            kb:size    | - | 2 | 0.1  | ersatz:machine | table.csv | {HASH} | -
            kb:size    | - | 3 | 0.06 | ersatz:machine | table.csv | {HASH} | -
            kb:support | - | - | 0.02 | ersatz:machine | table.csv | {HASH} | -
            kb:weight  | - | - | 0.1  | ersatz:machine | table.csv | {HASH} | -
            """,
            {"instance": "sponge 1"},
        ),
    ],
    "instance_qualities": [
        Case(
            """
            kb:plate_2  | plate 2  | kb:Plate  | kb:support_1
            kb:plate_2  | plate 2  | kb:Plate  | kb:weight_2
            kb:sponge_1 | sponge 1 | kb:Sponge | kb:size_1
            kb:sponge_1 | sponge 1 | kb:Sponge | kb:support_1
            kb:sponge_1 | sponge 1 | kb:Sponge | kb:weight_1
            """,
            {"instances": ["sponge 1", "plate 2", "sponge_1"]},
        )
    ],
    "instance_memberships": [
        Case(
            """
            kb:plate_2  | kb:support_1 | 1 | 1
            kb:plate_2  | kb:weight_2  | 1 | 1
            kb:sponge_1 | kb:size_1    | 1 | 1
            kb:sponge_1 | kb:support_1 | 1 | 1
            kb:sponge_1 | kb:weight_1  | 1 | 1
            """,
            {"instances": ["sponge 1", "plate 2", "sponge_1"]},
        )
    ],
    "instances": [Case("kb:plate_1 | plate 1 \n kb:plate_2 | plate 2", {"class": "plate"})],
    "jaccard": [
        Case(
            "kb:Tray | 2 | 2 | 1 \n kb:Plate | 1 | 3 | 0.333333",
            {"qualities": ["weight_2", "size_2"], "threshold": "0.35"},
        ),
        Case(
            "kb:Tray | 2 | 2 | 1 \n kb:Plate | 1 | 3 | 0.333333",
            {"qualities": ["size_2", "weight_2", "size_2", "weight_2"], "threshold": "0.35"},
        ),
        Case(
            "kb:Tray | 2 | 2 | 1 \n kb:Plate | 1 | 3 | 0.333333",
            {"qualities": ["weight_2", "size_2", "support_2"], "threshold": "0.35"},
        ),
    ],
    "lookup": [
        Case("kb:Tray | owl:Class", {"name": "tray"}),
        Case("kb:tray_1 | owl:NamedIndividual \n kb:tray_1 | kb:Tray", {"name": "tray 1"}),
        Case("", {"name": "teapot"}),
    ],
    "memberships": [
        Case(
            """
            kb:Plate  | kb:size_1    | 1 | 1
            kb:Plate  | kb:support_1 | 1 | 2
            kb:Plate  | kb:support_2 | 1 | 2
            kb:Plate  | kb:weight_2  | 2 | 2
            kb:Sponge | kb:size_1    | 1 | 1
            kb:Sponge | kb:support_1 | 1 | 1
            kb:Sponge | kb:weight_1  | 1 | 1
            kb:Tray   | kb:size_2    | 1 | 1
            kb:Tray   | kb:support_2 | 2 | 2
            kb:Tray   | kb:weight_2  | 2 | 2
            """
        )
    ],
    "posterior": [
        Case(
            """
            kb:size    | kb:size_1    | 1 | 1.5 | 0.5 | 0.75
            kb:size    | kb:size_2    | 2 | 0.5 | 1.5 | 0.25
            kb:support | kb:support_1 | 1 | 1.5 | 1.5 | 0.5
            kb:support | kb:support_2 | 2 | 1.5 | 1.5 | 0.5
            kb:weight  | kb:weight_1  | 1 | 0.5 | 2.5 | 0.166667
            kb:weight  | kb:weight_2  | 2 | 2.5 | 0.5 | 0.833333
            """,
            {"concept": "plate", "prior": 1},
        ),
        Case(
            """
            kb:size   | kb:size_1   | 1 | 1.25 | 1.25 | 0.5
            kb:size   | kb:size_2   | 2 | 1.25 | 1.25 | 0.5
            kb:weight | kb:weight_1 | 1 | 0.25 | 3.25 | 0.071429
            kb:weight | kb:weight_2 | 2 | 3.25 | 0.25 | 0.928571
            """,
            {"concept": "support_2", "prior": "0.5"},
        ),
    ],
    "properties": [
        Case(
            """
            kb:size    | physical   | m  | large           | more = larger                  | *
            kb:support | functional | m2 | able to support | more = more can be put on it   | *
            kb:weight  | physical   | kg | heavy           | more = heavier                 | *
            """
        )
    ],
    "qualities": [
        Case(
            """
            kb:size_1    | kb:size    | 1 | -    | -    | -    | k-means | -
            kb:size_2    | kb:size    | 2 | -    | -    | -    | k-means | -
            kb:support_1 | kb:support | 1 | 0.02 | -    | 0.07 | optimal | -
            kb:support_2 | kb:support | 2 | 0.12 | 0.07 | -    | optimal | -
            kb:weight_1  | kb:weight  | 1 | 0.1  | -    | 0.35 | optimal | -
            kb:weight_2  | kb:weight  | 2 | 0.6  | 0.35 | -    | optimal | -
            """
        )
    ],
    "quality_coordinates": [
        Case(
            """
            kb:size_1 | kb:size | 1 | 1 | 0.2
            kb:size_1 | kb:size | 1 | 2 | 0.15
            kb:size_1 | kb:size | 1 | 3 | 0.04
            kb:size_2 | kb:size | 2 | 1 | 0.4
            kb:size_2 | kb:size | 2 | 2 | 0.3
            kb:size_2 | kb:size | 2 | 3 | 0.04
            """
        )
    ],
    "quality_norms": [Case("")],
    "relevant_functions": [
        Case("kb:support_2 | 2 | 3 | 0.666667", {"tool": "tray", "threshold": "0.35", "tolerance": "0.35"}),
        # both functions go with size_1 and weight_2, and with one quality that a plate lacks
        Case(
            "kb:support_1 | 2 | 3 | 0.666667 \n kb:support_2 | 2 | 3 | 0.666667",
            {"tool": "plate", "threshold": "0.5", "tolerance": "0.6666"},
        ),
        Case("", {"tool": "plate", "threshold": "0.50001", "tolerance": "0"}),
        Case("kb:support_2 | 1 | 2 | 0.5", {"tool": "tray", "threshold": "1", "tolerance": "0.499"}),
        Case("", {"tool": "tray", "threshold": "1", "tolerance": "0.5"}),
    ],
    "relevant_qualities": [
        Case(
            "kb:size_2 | kb:support_2 \n kb:weight_2 | kb:support_2",
            {"tool": "tray", "threshold": "0.35", "tolerance": "0.35"},
        ),
        Case(
            """
            kb:size_1   | kb:support_1
            kb:size_1   | kb:support_2
            kb:weight_2 | kb:support_1
            kb:weight_2 | kb:support_2
            """,
            {"tool": "plate", "threshold": "0.35", "tolerance": "0.35"},
        ),
    ],
    "representative_qualities": [
        Case(
            "kb:size_2 | 1 | 1 \n kb:weight_2 | 2 | 2",
            {"concept": "tray", "kind": "physical", "threshold": 1},
        ),
        Case(
            "kb:support_1 | 1 | 2 \n kb:support_2 | 1 | 2",
            {"concept": "plate", "kind": "functional", "threshold": "0.5"},
        ),
        Case("kb:weight_2 | 3 | 3", {"concept": "support_2", "kind": "physical", "threshold": "0.51"}),
        Case("", {"concept": "tray", "kind": "both", "threshold": "0.5"}),
    ],
    "sources": [Case(f"table.csv | {HASH} | -")],
    "stands_in_for": [
        Case("kb:Tray | 0.333333", {"class": "plate"}),
        Case("", {"class": "sponge"}),
    ],
    "substitution_candidates": [
        Case(
            """
            kb:Plate  | 0.333333 | true  | extra   | kb:size_1
            kb:Plate  | 0.333333 | true  | lacking | kb:size_2
            kb:Plate  | 0.333333 | true  | shared  | kb:weight_2
            kb:Sponge | 0        | false | extra   | kb:size_1
            kb:Sponge | 0        | false | extra   | kb:weight_1
            kb:Sponge | 0        | false | lacking | kb:size_2
            kb:Sponge | 0        | false | lacking | kb:weight_2
            """,
            {"model": "MODEL"},
        )
    ],
    "substitution_confidence": [
        Case(
            "kb:Plate | * | * | * | * | 0.9 | 50 | 0.5 | 0 \n kb:Sponge | * | * | * | * | 0.9 | 50 | 0.5 | 0",
            {"model": "MODEL"},
        )
    ],
    "substitution_model": [Case("kb:Tray | * | 0.35 | 0.35 | 0.3 | REVISION", {"model": "MODEL"})],
    "substitution_models": [Case("MODEL | kb:Tray | REVISION | REVISION")],
    "substitution_relevance": [
        Case(
            "functional | kb:support_2 | - \n physical | kb:size_2 | - \n physical | kb:weight_2 | -",
            {"model": "MODEL"},
        )
    ],
}
FUZZY: dict[str, list[Case]] = {
    "instance_memberships": [
        Case(
            """
            kb:bowl_02       | kb:containment_2 | 1        | 1
            kb:bowl_02       | kb:size_2        | 1        | 1
            kb:bowl_02       | kb:weight_1      | 0.1      | 1
            kb:bowl_02       | kb:weight_2      | 0.9      | 1
            kb:coffee_mug_01 | kb:containment_1 | 0.9      | 1
            kb:coffee_mug_01 | kb:containment_2 | 0.1      | 1
            kb:coffee_mug_01 | kb:size_1        | 0.938462 | 1
            kb:coffee_mug_01 | kb:size_2        | 0.061538 | 1
            kb:coffee_mug_01 | kb:weight_1      | 0.9      | 1
            kb:coffee_mug_01 | kb:weight_2      | 0.1      | 1
            """,
            {"instances": ["coffee mug 01", "bowl 02", "bowl_02"]},
        )
    ],
    "qualities": [
        Case(
            """
            kb:containment_1 | kb:containment | 1 | 0.1 | -   | 0.5 | given | 2
            kb:containment_2 | kb:containment | 2 | 0.9 | 0.5 | -   | given | 2
            kb:size_1        | kb:size        | 1 | -   | -   | -   | given | 2
            kb:size_2        | kb:size        | 2 | -   | -   | -   | given | 2
            kb:weight_1      | kb:weight      | 1 | 0.2 | -   | 0.4 | given | 2
            kb:weight_2      | kb:weight      | 2 | 0.6 | 0.4 | -   | given | 2
            """
        )
    ],
    "quality_norms": [
        Case(
            """
            kb:size_1 | kb:size | 1 | 1 | 1 | 1
            kb:size_1 | kb:size | 1 | 1 | 2 | 0
            kb:size_1 | kb:size | 1 | 2 | 2 | 1
            kb:size_2 | kb:size | 2 | 1 | 1 | 1.25
            kb:size_2 | kb:size | 2 | 1 | 2 | 0.75
            kb:size_2 | kb:size | 2 | 2 | 2 | 1.25
            """
        )
    ],
}
"""On `ontology/examples/fuzzy.ttl`. The first mug, 12 by 10 cm, lies 2 cm from the first centroid; it is 8 cm
shorter and 2 cm higher than the second, by the matrix 1.25 64 - 2 0.75 16 + 1.25 4 = 61 square centimetres
away: its degrees are as 61 to 4."""

EACH = [(name, case) for name, cases in CASES.items() for case in cases]


@dataclass(frozen=True, slots=True)
class World:
    """The small knowledge base, the same triples in rdflib, and the name of the answer it remembers."""

    kb: KnowledgeBase
    graph: rdflib.Graph
    model: str


@pytest.fixture(scope="module")
def world() -> World:
    settings = Settings(SubcategorizationSettings(clusters=2), time="2026-01-02T03:04:05Z")
    kb = build(blocks=blocks(WORLD), settings=settings)
    chosen = ReasonerSettings(tolerance=Fraction(3, 10))
    rank_substitutes(kb, "tray", settings=chosen, remember=True, draws=50)
    graph = rdflib.Graph().parse(data="".join(turtle(kb.triples())), format="turtle")
    (model,) = kb.view(remembered)
    return World(kb, graph, model)


@pytest.fixture(scope="module")
def household() -> KnowledgeBase:
    """The shipped knowledge base, with an answer it remembers."""
    kb = KnowledgeBase.open("household")
    rank_substitutes(
        kb, "tray", settings=ReasonerSettings(tolerance=Fraction(1, 10)), remember=True, draws=10
    )
    return kb


def cell(value: object) -> str:
    """Return a value of either engine as the cases write it."""
    if value is None:
        return "-"
    if isinstance(value, rdflib.Literal):
        lexical, value = str(value), value.toPython()
        if not isinstance(value, bool | int | Decimal):
            return lexical.replace("+00:00", "Z")
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | Decimal):
        return f"{value:.6f}".rstrip("0").rstrip(".")
    text = str(value)
    for prefix, namespace in PREFIXES.items():
        if text.startswith(namespace):
            return f"{prefix}:{text.removeprefix(namespace)}"
    return text


def expected(case: Case, world: World) -> list[tuple[str, ...]]:
    lines = case.rows.replace("REVISION", world.kb.revision).replace("MODEL", cell(world.model)).splitlines()
    return [tuple(part.strip() for part in line.split("|")) for line in lines if line.strip()]


def check(found: Iterable[Iterable[object]], wanted: list[tuple[str, ...]], ordered: bool) -> None:
    rows = [tuple(map(cell, row)) for row in found]
    rows, wanted = (rows, wanted) if ordered else (sorted(rows), sorted(wanted))
    assert len(rows) == len(wanted), rows
    for row, like in zip(rows, wanted, strict=True):
        assert tuple("*" if b == "*" else a for a, b in zip(row, like, strict=True)) == like


@pytest.fixture(scope="module")
def fuzzy() -> World:
    kb = KnowledgeBase.open(ONTOLOGY / "examples" / "fuzzy.ttl")
    return World(kb, rdflib.Graph().parse(ONTOLOGY / "examples" / "fuzzy.ttl"), "")


@pytest.mark.parametrize(("name", "case"), [(n, c) for n, cases in FUZZY.items() for c in cases], ids=FUZZY)
def test_rows_of_degrees(fuzzy: World, name: str, case: Case) -> None:
    compare(fuzzy, name, case)


@pytest.mark.parametrize(("name", "case"), EACH, ids=[f"{n}-{i}" for i, (n, _) in enumerate(EACH)])
def test_rows(world: World, name: str, case: Case) -> None:
    compare(world, name, case)


def compare(world: World, name: str, case: Case) -> None:
    """Ask both engines and check the rows of both."""
    query = stored_query(name)
    arguments = {
        key: world.model if value == "MODEL" else value for key, value in (case.arguments or {}).items()
    }
    ordered = "ORDER BY" in query.text
    wanted = expected(case, world)
    answer = world.kb.answer(query, arguments)
    check(answer.rows, wanted, ordered)
    other = world.graph.query(query.bind(world.kb.resolve, arguments))
    assert other.vars is not None
    assert tuple(map(str, other.vars)) == answer.variables
    check(other, wanted, ordered)  # type: ignore[arg-type]


def test_the_table_of_questions_is_up_to_date() -> None:
    assert (SPARQL / "README.md").read_text(encoding="utf-8") == table_of_questions(), (
        "run `python -m ersatz.knowledge.questions`"
    )


def test_every_question_is_in_the_table_once() -> None:
    listed = re.findall(r"^\| \[`([^`]*)`\]\(([^)]*)\) \|", table_of_questions(), re.MULTILINE)
    assert sorted(name for name, _ in listed) == sorted(query_names())
    assert all((SPARQL / link).is_file() for _, link in listed)


COMMANDS = re.findall(r"^\$ ersatz (.*)$", table_of_questions(), re.MULTILINE)
PYTHON = re.findall(r"```python\n(.*?)```", table_of_questions(), re.DOTALL)


@pytest.mark.parametrize("command", COMMANDS)
def test_commands_of_the_table_answer(ersatz: Shell, command: str) -> None:
    run = ersatz(*shlex.split(command))
    assert (run.code, run.err) == (0, "")
    assert len(run.out.splitlines()) >= 3


def test_python_of_the_table_runs() -> None:
    assert len(COMMANDS) >= 3
    examples = [one for part in PYTHON for one in doctest.DocTestParser().get_examples(part)]
    assert examples
    test = doctest.DocTest(examples, {}, "sparql/README.md", None, None, None)
    assert doctest.DocTestRunner().run(test).failed == 0


def test_no_question_lacks_a_case() -> None:
    assert set(CASES) == set(QUESTIONS)
    assert len(QUESTIONS) >= 20


@pytest.mark.parametrize("name", query_names())
def test_header(name: str) -> None:
    query = stored_query(name)
    assert query.summary
    assert query.description
    assert query.summary[-1] in "?.", query.summary
    assert bool(query.example) == bool(query.parameters), "an example is of the parameters"


@pytest.mark.parametrize("name", [name for name in QUESTIONS if name != "quality_norms"])
def test_example_finds_something_on_the_shipped_knowledge_base(household: KnowledgeBase, name: str) -> None:
    query = stored_query(name)
    given: dict[str, Argument] = {}
    for part in shlex.split(query.example):
        key, _, value = part.partition("=")
        given[key] = value.split(",") if query.parameters[key] == "iris" else value
    assert set(given) == set(query.parameters)
    if "model" in given:
        assert str(given["model"]).startswith("kb:substitution_tray_")
        (given["model"],) = household.view(remembered)
    assert len(household.answer(query, given)) > 0


def representative(world: World, threshold: str) -> list[object]:
    rows = world.kb.ask("representative_qualities", concept="plate", kind="functional", threshold=threshold)
    return [row["quality"] for row in rows]


def test_a_threshold_with_many_digits_is_exact(world: World) -> None:
    assert len(representative(world, "0.5")) == 2
    assert len(representative(world, "0.500000000000000000000000")) == 2
    assert len(representative(world, "0.499999999999")) == 2
    assert representative(world, "0.500000000001") == []


@pytest.mark.parametrize("threshold", ["0.4999999999999", "0.33333333333333333333", "1e-30", "1e15", "-1e40"])
def test_a_threshold_engines_could_not_compute_with_is_refused(world: World, threshold: str) -> None:
    with pytest.raises(
        InputError, match="parameter 'threshold' takes a number below 1e\\+15 with at most 12 digits"
    ):
        representative(world, threshold)


def test_fractional_counts_times_the_longest_threshold_do_not_overflow(world: World) -> None:
    """Engines answer an overflow with a row less, not with an error."""
    for total in ("10.123456", "999999999.999999"):
        text = f"SELECT (5.5 >= 0.123456789012 * {total} AS ?less) WHERE {{}}"
        assert world.kb.query(text)[0]["less"] is (total == "10.123456")
