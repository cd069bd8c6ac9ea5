"""Binding: exactly the declared parameters, of their types, whatever text a hostile user gives."""

from decimal import Decimal
from fractions import Fraction

import numpy as np
import pyoxigraph as ox
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ersatz.errors import InputError, UnknownNameError
from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.queries import Query, query_names, refuse_foreign_access, stored_query


@pytest.fixture(scope="module")
def kb() -> KnowledgeBase:
    return KnowledgeBase.open("household")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({}, r"query 'representative_qualities' needs kind, concept, threshold; it takes: kind \(string\)"),
        ({"concept": "tray", "kind": "physical"}, "needs threshold"),
        ({"concept": "tray", "kind": "physical", "treshold": 1, "threshold": 1}, "no parameter 'treshold'"),
        ({"concept": "tray", "kind": 3, "threshold": 1}, "parameter 'kind' takes a text, not 3"),
        ({"concept": 5, "kind": "physical", "threshold": 1}, "parameter 'concept' takes a name, not 5"),
        ({"concept": ["tray"], "kind": "physical", "threshold": 1}, "takes a name, not"),
        ({"concept": "tray", "kind": "physical", "threshold": "many"}, "'many' is not a number"),
        ({"concept": "tray", "kind": "physical", "threshold": True}, "True is not a number"),
        ({"concept": "tray", "kind": "physical", "threshold": None}, "None is not a number"),
        ({"concept": "tray", "kind": "physical", "threshold": float("nan")}, "nan is not a number"),
        ({"concept": "tray", "kind": "physical", "threshold": ["1"]}, "takes one number"),
        ({"concept": "tray", "kind": "physical", "threshold": "1/3"}, "no finite decimal notation"),
    ],
)
def test_wrong_arguments(kb: KnowledgeBase, arguments: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        kb.ask("representative_qualities", **arguments)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "threshold", ["0.35", 0.35, Decimal("0.35"), Fraction(7, 20), np.float64(0.35), "7/20"]
)
def test_a_number_may_be_written_in_many_ways(kb: KnowledgeBase, threshold: float) -> None:
    rows = kb.ask("representative_qualities", concept="tray", kind="physical", threshold=threshold)
    assert rows == kb.ask("representative_qualities", concept="tray", kind="physical", threshold="0.35")
    assert len(rows) > 0


def test_unknown_names_offer_the_nearest(kb: KnowledgeBase) -> None:
    with pytest.raises(UnknownNameError, match="unknown class 'tary': did you mean 'tray'"):
        kb.ask("class", **{"class": "tary"})
    with pytest.raises(UnknownNameError, match="unknown quality 'flatnes_4': did you mean 'flatness_4'"):
        kb.ask("holders", quality="flatnes_4")
    with pytest.raises(UnknownNameError, match="unknown query 'clases': did you mean 'classes'"):
        kb.ask("clases")
    with pytest.raises(UnknownNameError, match="unknown class 'flatness_4'"):
        kb.ask("class", **{"class": "flatness_4"})  # known, but no class


@pytest.mark.parametrize(
    "name",
    [
        "https://w3id.org/ersatz/kb#Tray> ?p ?o . ?x ?y <http://z",
        "kb:Tray> <x",
        "http://x y",
        "",
        "'\"\n{}",
        "}",
    ],
)
def test_hostile_names_are_unknown_and_do_no_more(kb: KnowledgeBase, name: str) -> None:
    with pytest.raises(UnknownNameError):
        kb.ask("class", **{"class": name})


ECHO = Query.parse("echo", "SELECT ?found WHERE { BIND (?_text_string AS ?found) }")


@given(st.text(st.characters(exclude_categories=["Cs"])))
def test_any_text_comes_back_as_it_went_in(text: str) -> None:
    solutions = ox.Store().query(ECHO.bind(lambda name, _: name, {"text": text}))
    assert isinstance(solutions, ox.QuerySolutions)
    assert [solution["found"] for solution in solutions] == [ox.Literal(text)]


@pytest.mark.parametrize(
    "text", ['"', "'", "\\", '" } INSERT { "', "a\nb", "?_text_string", "\\u0022", "{}", '"""']
)
def test_hostile_texts_come_back_too(text: str) -> None:
    solutions = ox.Store().query(ECHO.bind(lambda name, _: name, {"text": text}))
    assert isinstance(solutions, ox.QuerySolutions)
    assert [solution["found"] for solution in solutions] == [ox.Literal(text)]


def test_a_whole_number_is_demanded() -> None:
    query = Query.parse("n", "SELECT ?n { BIND (?_n_integer AS ?n) }")
    assert '"3"' in query.bind(lambda name, _: name, {"n": "3"})
    with pytest.raises(InputError, match="whole number"):
        query.bind(lambda name, _: name, {"n": 2.5})


def test_lists_of_names() -> None:
    query = Query.parse("l", "SELECT * { VALUES ?x { ?_x_iris } }")
    iri = "http://example.org/a"
    assert f"{{ <{iri}> <{iri}> }}" in query.bind(lambda name, _: name, {"x": [iri, iri]})
    assert f"{{ <{iri}> }}" in query.bind(lambda name, _: name, {"x": iri})
    assert "{  }" in query.bind(lambda name, _: name, {"x": []})
    for wrong in (3, [1], {"a": 1}, {iri}):
        with pytest.raises(InputError, match="takes names"):
            query.bind(lambda name, _: name, {"x": wrong})  # type: ignore[dict-item]


def test_a_parameter_needs_one_type() -> None:
    with pytest.raises(InputError, match=r"parameter '\?_tool' has no type"):
        Query.parse("q", "SELECT * { ?_tool ?p ?o }")
    with pytest.raises(InputError, match=r"'\?_tool_klass' has no type"):
        Query.parse("q", "SELECT * { ?_tool_klass ?p ?o }")
    with pytest.raises(InputError, match="'tool' is both class and string"):
        Query.parse("q", "SELECT * { ?_tool_class ?p ?_tool_string }")
    assert Query.parse("q", "SELECT * { $_tool_class ?p ?o }").parameters == {"tool": "class"}


SERVICES = [
    "SELECT * { SERVICE <http://127.0.0.1:1/> { ?s ?p ?o } }",
    "select*{service<http://127.0.0.1:1/>{?s?p?o}}",
    "SELECT * { ?s ?p 1SERVICE <http://127.0.0.1:1/> { ?s ?p ?o } }",
    "SELECT * { ?s ?p trueSERVICE <http://127.0.0.1:1/> { ?s ?p ?o } }",
    "SELECT * { # a comment ends at a carriage return\rSERVICE <http://127.0.0.1:1/> { ?s ?p ?o } }",
    "SELECT * { VALUES ?g { <http://127.0.0.1:1/> } FILTER(?a<?b)SERVICE?g{?s?p?o}FILTER(?c>?d) }",
    "PREFIX : <http://127.0.0.1:1/> SELECT * { SERVICE:a{ ?s ?p ?o } }",
    "SELECT * { \\u0053ERVICE <http://127.0.0.1:1/> { ?s ?p ?o } }",
    'SELECT * { BIND ("""a"b""" AS ?x) SERVICE <http://127.0.0.1:1/> { ?s ?p ?o } BIND (\'c\' AS ?y) }',
    "SELECT * { BIND ('''it's''' AS ?x) SERVICE <http://127.0.0.1:1/> { ?s ?p ?o } }",
    "SELECT * { BIND ('\\u0027SERVICE <http://127.0.0.1:1/> {} #' AS ?x) }",
    "PREFIX a: <x:> SELECT * { FILTER(?x<a:#>'''\n) SERVICE <http://127.0.0.1:1/> {} #'''\n}",
    "SELECT * {SERVICESILENT<http://127.0.0.1:1/>{}}",
    "PREFIX e: <http://127.0.0.1:1/> SELECT * {SERVICEe:x{}}",
    "PREFIX e: <http://127.0.0.1:1/> SELECT * {?a ?b ?xservice SERVICEe:b{}}",
    "SELECT * { ?a?b?c.SERVICE<http://127.0.0.1:1/>{} }",
    'SELECT * { ?a ?b "x"@en.SERVICE<http://127.0.0.1:1/>{} }',
    "PREFIX e: <x:> SELECT * { ?a ?b e:c.SERVICE<http://127.0.0.1:1/>{} }",
]


@pytest.mark.parametrize("text", SERVICES)
def test_other_servers_are_refused_however_it_is_written(kb: KnowledgeBase, text: str) -> None:
    with pytest.raises(InputError, match="SERVICE is not allowed"):
        kb.query(text)


@pytest.mark.parametrize(
    "text",
    [
        'ASK { ?s ?p "SERVICE" }',
        "ASK { ?s ?p 'at your service' }",
        'ASK { ?s ?p """a "SERVICE" b""" }',
        "ASK { ?s ?p '''it's a SERVICE''' }",
        "ASK { ?s ?p 'it\\'s SERVICE' }",
        "# SERVICE\nASK { ?s ?p ?o }",
        "ASK { ?s ?p <http://example.org/SERVICE> }",
        "PREFIX kb: <https://w3id.org/ersatz/kb#> ASK { ?service a kb:service }",
        "ASK { $SERVICE ?p 'x'@service }",
    ],
)
def test_the_word_itself_is_harmless(kb: KnowledgeBase, text: str) -> None:
    refuse_foreign_access(text)
    assert kb.query(text).variables == ("answer",)


@pytest.mark.parametrize(
    "text",
    [
        "INSERT DATA { <http://a> <http://b> <http://c> }",
        "DELETE WHERE { ?s ?p ?o }",
        "CLEAR ALL",
        "LOAD <file:///etc/hostname>",
        "DROP DEFAULT",
        "ASK {}; CLEAR ALL",
        "SELECT",
        "",
    ],
)
def test_updates_and_nonsense_are_no_queries(kb: KnowledgeBase, text: str) -> None:
    before = kb.revision
    with pytest.raises(InputError, match="not a valid SPARQL query"):
        kb.query(text)
    assert kb.query("SELECT * { ?s ?p ?o } LIMIT 1")
    assert kb.revision == before


def test_headers_go_over_lines() -> None:
    query = Query.parse("q", "#+ summary: One\n#+   two\n#+ example: x=1\nSELECT * { ?s ?p ?_x_integer }")
    assert (query.summary, query.example, query.parameters) == ("One two", "x=1", {"x": "integer"})


def test_stored_queries_are_found_in_folders_too() -> None:
    assert "checks/missing_label" in query_names()
    assert stored_query("checks/missing_label").summary
    with pytest.raises(UnknownNameError):
        stored_query("../pyproject")


def test_answers_are_sequences(kb: KnowledgeBase) -> None:
    rows = kb.ask("classes")
    assert rows[0]["name"] == next(iter(rows))["name"]
    assert len(rows[:3]) == 3
    with pytest.raises(InputError, match="CONSTRUCT"):
        rows.to_turtle()
    made = kb.query("CONSTRUCT { ?s a ?o } WHERE { ?s a ?o } LIMIT 3")
    assert ox.parse(made.to_turtle().encode(), format=ox.RdfFormat.TURTLE)
    assert len(made) == 3
