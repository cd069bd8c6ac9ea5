"""Opening, saving and looking: the same knowledge in every format, and nothing written by accident."""

import filecmp
import socket
from pathlib import Path
from typing import Any, NoReturn

import pytest
import rdflib
from rdflib.graph import ModificationException, UnSupportedAggregateOperation
from rdflib.term import Node

from ersatz.errors import InputError, LockedError
from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.opening import SHIPPED
from ersatz.knowledge.revision import revision_of
from ersatz.reasoner.substitution import rank_substitutes
from ersatz.resources import ONTOLOGY
from tests.knowledge.tools import assert_whole, lines_of, small

SUFFIXES = tuple(
    f"{suffix}{gz}" for suffix in (".ttl", ".owl", ".rdf", ".nt", ".jsonld") for gz in ("", ".gz")
)
PLACES = (*SUFFIXES, "")
"""The name of a file, or of a directory."""
REFUSALS = (ModificationException, UnSupportedAggregateOperation, NotImplementedError, TypeError)
LABEL = rdflib.RDFS.label
Triple = tuple[Node, Node, Node]
EXTRA: Triple = (rdflib.URIRef("urn:a"), LABEL, rdflib.Literal("a"))


@pytest.fixture(scope="module")
def original() -> KnowledgeBase:
    return small()


@pytest.fixture(scope="module")
def saved(original: KnowledgeBase, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with one knowledge base in every format."""
    folder = tmp_path_factory.mktemp("saved")
    for suffix in PLACES:
        original.save(folder / f"kb{suffix}")
    return folder


@pytest.mark.parametrize("suffix", PLACES)
def test_every_format_holds_the_same(saved: Path, original: KnowledgeBase, suffix: str) -> None:
    expected = original
    with KnowledgeBase.open(saved / f"kb{suffix}") as kb:
        assert lines_of(kb) == lines_of(expected)
        assert kb.revision == expected.revision
        assert kb.build == expected.build
        assert_whole(kb)
        for name in ("classes", "qualities", "memberships", "all_instances", "quality_coordinates"):
            assert sorted(map(repr, kb.ask(name).rows)) == sorted(map(repr, expected.ask(name).rows))
            assert len(kb.ask(name)) > 0
        found = [(one.iri, one.fraction) for one in rank_substitutes(kb, "tray")]
        assert found == [(one.iri, one.fraction) for one in rank_substitutes(expected, "tray")]


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_file_saved_twice_is_the_same_bytes(saved: Path, suffix: str, tmp_path: Path) -> None:
    original, again = saved / f"kb{suffix}", tmp_path / f"other{suffix}"
    small().save(again)
    assert filecmp.cmp(original, again, shallow=False)
    KnowledgeBase.open(original).save(again)  # nor does it matter where the triples come from
    assert filecmp.cmp(original, again, shallow=False)


def test_a_round_trip_through_every_format_loses_nothing(saved: Path, tmp_path: Path) -> None:
    at = saved / "kb.ttl"
    for number, suffix in enumerate(PLACES):
        step = tmp_path / f"step{number}{suffix}"
        with KnowledgeBase.open(at) as kb:
            kb.save(step)
        at = step
    assert lines_of(KnowledgeBase.open(at)) == lines_of(small())


@pytest.mark.parametrize("suffix", [".ttl", ""])
def test_the_graph_holds_all_triples(saved: Path, suffix: str) -> None:
    with KnowledgeBase.open(saved / f"kb{suffix}") as kb:
        graph = kb.graph
        expected = rdflib.Graph().parse(data="".join(lines_of(kb)), format="nt")
        assert set(graph) == set(expected)
        assert len(graph) == len(expected) == len(lines_of(kb))
        assert sorted(map(str, graph.subjects(LABEL, None))) == sorted(
            map(str, expected.subjects(LABEL, None))
        )
        question = (
            "PREFIX e: <https://w3id.org/ersatz#> SELECT ?c { ?m a e:ClassModel ; e:describesClass ?c }"
        )
        assert {str(row[0]) for row in graph.query(question)} == {str(r["class"]) for r in kb.ask("classes")}  # type: ignore[index]


def attempts(graph: Any) -> dict[str, Any]:
    """Return every way to write to a graph that rdflib knows."""
    label = next(iter(graph.triples((None, LABEL, None))))
    more = rdflib.Graph().add(EXTRA)
    return {
        "add": lambda: graph.add(EXTRA),
        "addN": lambda: graph.addN([(*EXTRA, graph)]),
        "remove": lambda: graph.remove((None, None, None)),
        "set": lambda: graph.set((label[0], LABEL, rdflib.Literal("another"))),
        "+=": lambda: graph.__iadd__(more),
        "-=": lambda: graph.__isub__([label]),
        "parse": lambda: graph.parse(data="<urn:a> <urn:b> <urn:c> .", format="nt"),
        "insert": lambda: graph.update("INSERT DATA { <urn:a> <urn:b> <urn:c> }"),
        "delete": lambda: graph.update("DELETE WHERE { ?s ?p ?o }"),
        "clear": lambda: graph.update("CLEAR ALL"),
        "destroy": lambda: graph.destroy(""),
        "store.add": lambda: graph.store.add(EXTRA, graph),
        "store.update": lambda: graph.store.update("CLEAR ALL", {}, {}, ""),
    }


@pytest.mark.parametrize("suffix", [".ttl", ""])
@pytest.mark.parametrize("how", attempts(rdflib.Graph().add(EXTRA)))
def test_the_graph_is_read_only(saved: Path, suffix: str, how: str) -> None:
    with KnowledgeBase.open(saved / f"kb{suffix}") as kb:
        before = lines_of(kb)
        with pytest.raises(Exception) as error:
            attempts(kb.graph)[how]()
        assert lines_of(kb) == before
        assert isinstance(error.value, REFUSALS)


@pytest.mark.parametrize("file", [ONTOLOGY / "household.ttl", ONTOLOGY / "household.owl"], ids=str)
def test_the_revision_of_the_shipped_knowledge_base_is_that_of_its_triples(file: Path) -> None:
    kb = KnowledgeBase.open(file)
    assert kb.revision == f"{revision_of(lines_of(kb)):064x}"
    assert lines_of(kb) == lines_of(KnowledgeBase.open("household"))


@pytest.mark.parametrize("name", SHIPPED)
def test_the_shipped_knowledge_base_is_not_overwritten(name: str) -> None:
    file = ONTOLOGY / f"{name}.ttl"
    before = file.read_bytes()
    kb = KnowledgeBase.open(name)
    kb.forget("ycb_029_plate")
    try:
        for target in (None, file, ONTOLOGY / "examples" / ".." / file.name):
            with pytest.raises(InputError, match=f"'{name}' is shipped with ERSATZ: save it elsewhere"):
                kb.save(target)
            assert file.read_bytes() == before
    finally:
        if file.read_bytes() != before:
            file.write_bytes(before)


def test_saving_without_a_name_goes_back_to_the_file(tmp_path: Path) -> None:
    small().save(tmp_path / "kb.nt.gz")
    kb = KnowledgeBase.open(tmp_path / "kb.nt.gz")
    kb.observe("tray", "tray 3", {"weight": 0.75})
    assert KnowledgeBase.open(tmp_path / "kb.nt.gz").revision != kb.revision
    kb.save()
    again = KnowledgeBase.open(tmp_path / "kb.nt.gz")
    assert again.revision == kb.revision
    assert_whole(again)


def test_a_file_that_another_has_changed_is_not_overwritten(tmp_path: Path) -> None:
    file = tmp_path / "kb.nt"
    small().save(file)
    one, other = KnowledgeBase.open(file), KnowledgeBase.open(file)
    one.observe("tray", "tray 3", {"weight": 0.75})
    one.save()
    one.observe("tray", "tray 4", {"weight": 0.75})
    one.save(file)
    other.observe("plate", "plate 3", {"weight": 0.5})
    with pytest.raises(LockedError, match="was changed by another writer meanwhile: open it again"):
        other.save()
    assert KnowledgeBase.open(file).revision == one.revision
    other.save(tmp_path / "other.nt")


@pytest.mark.parametrize("suffix", [".ttl", ".owl", ".jsonld", ""])
def test_opening_loads_nothing_over_the_network(
    saved: Path, suffix: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object, **__: object) -> NoReturn:
        raise AssertionError("the network was asked")

    monkeypatch.setattr(socket, "create_connection", refuse)
    monkeypatch.setattr(socket, "getaddrinfo", refuse)
    monkeypatch.setattr(socket.socket, "connect", refuse)
    with KnowledgeBase.open(saved / f"kb{suffix}") as kb:
        assert len(kb.graph) > 0
        assert kb.owl() is not None
