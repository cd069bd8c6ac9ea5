"""The order of a file, however little memory there is to sort in."""

import random
import tracemalloc
from collections.abc import Iterator
from pathlib import Path

import pyoxigraph as ox
import pytest

from ersatz.knowledge import paragraphs, turtle
from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.turtle import write_file
from ersatz.resources import ONTOLOGY

KITCHEN = ONTOLOGY / "examples" / "kitchen.ttl"


@pytest.mark.parametrize("suffix", ["ttl", "nt", "owl", "jsonld", "ttl.gz"])
def test_a_file_sorted_on_disk_is_the_one_sorted_in_memory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, suffix: str
) -> None:
    triples = sorted(KnowledgeBase.open(KITCHEN).triples(), key=str)
    one, other = tmp_path / f"one.{suffix}", tmp_path / f"other.{suffix}"
    write_file(triples, one)
    random.Random(0).shuffle(triples)  # so that most things come in several batches
    monkeypatch.setattr(paragraphs, "BATCH", 97)
    write_file(triples, other)
    assert one.read_bytes() == other.read_bytes()
    assert sorted(tmp_path.iterdir()) == [one, other]
    assert KnowledgeBase.open(other).revision == KnowledgeBase.open(KITCHEN).revision


def facts(number: int) -> Iterator[ox.Triple]:
    """Yield so many triples, ten of a thing."""
    for at in range(number):
        subject = ox.NamedNode(f"https://w3id.org/ersatz/kb#thing_{at // 10}")
        yield ox.Triple(subject, ox.NamedNode("urn:p"), ox.Literal(f"value {at}"))


def test_memory_does_not_grow_with_the_number_of_triples(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(paragraphs, "BATCH", 1_000)
    monkeypatch.setattr(paragraphs, "_BLOCK", 4)
    monkeypatch.setattr(turtle, "_PIECE", 100)
    peaks = []
    for number in (5_000, 20_000):
        tracemalloc.start()
        write_file(facts(number), tmp_path / "facts.nt")
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 2 * peaks[0]  # a block of each run that is merged
    assert sum(1 for _ in (tmp_path / "facts.nt").open()) == 20_000


def test_nothing_is_left_of_a_file_that_cannot_be_finished(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def dying() -> Iterator[ox.Triple]:
        yield from facts(500)
        raise RuntimeError("the source dried up")

    monkeypatch.setattr(paragraphs, "BATCH", 100)
    with pytest.raises(RuntimeError, match="dried up"):
        write_file(dying(), tmp_path / "facts.ttl")
    assert list(tmp_path.iterdir()) == []
