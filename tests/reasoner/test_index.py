"""The reasoner's arrays: the same from one stream, from the shelf, and brought up to date by any change."""

import json
import random
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from fractions import Fraction
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ersatz.errors import ErsatzError
from ersatz.knowledge import shelf
from ersatz.knowledge.base import KnowledgeBase
from ersatz.reasoner import loading
from ersatz.reasoner.representative import Knowledge, Memberships, load_knowledge, pack, unpack
from ersatz.reasoner.shelving import Rows, Texts
from ersatz.reasoner.substitution import rank_substitutes
from tests.conftest import ROOT
from tests.knowledge.tools import assert_whole, small
from tests.making import Held
from tests.reasoner.reference import Options, reason
from tests.reasoner.worlds import helds, make, world_of_kb

THETA = Fraction(35, 100)
KILLS = 8
WRITER = """
import sys
from ersatz.knowledge.base import KnowledgeBase
from ersatz.reasoner.substitution import rank_substitutes
kb = KnowledgeBase.open(sys.argv[1])
turn = 0
while True:
    turn += 1
    rank_substitutes(kb, "tray", remember=turn % 2 == 0)
    if kb.query("ASK { <https://w3id.org/ersatz/kb#cup_1> a ?x }")[0]["answer"]:
        kb.forget("cup 1")
    else:
        kb.observe("cup", "cup 1", {"weight": 0.3, "rigidity": 0.2, "support": 0.001})
    print("done", flush=True)
"""


def same(one: Knowledge, two: Knowledge) -> bool:
    """Tell whether all that two say is equal, also what is representative at the kept thresholds."""
    return (
        one.qualities == two.qualities
        and [*one.classes.names] == [*two.classes.names]
        and [*one.classes.iris] == [*two.classes.iris]
        and dict(one.row_of_class) == dict(two.row_of_class)
        and dict(one.row_of_name) == dict(two.row_of_name)
        and np.array_equal(one.units, two.units)
        and all(
            np.array_equal(mine.counts, theirs.counts) and np.array_equal(mine.totals, theirs.totals)
            for mine, theirs in ((one.classes, two.classes), (one.functions, two.functions))
        )
        and np.array_equal(one.classes.representative(THETA), two.classes.representative(THETA))
    )


def agrees(kb: KnowledgeBase) -> bool:
    """Tell whether the arrays are what the triples say, read anew."""
    return same(kb.view(load_knowledge), loading._read_all(kb))


def flip(file: Path, at: int = -2) -> None:
    """Change one bit; in a new file, for others may be linked to the old one."""
    content = bytearray(file.read_bytes())
    content[at] ^= 1
    file.unlink()
    file.write_bytes(content)


def reading_all_is_an_error(_: KnowledgeBase) -> Knowledge:
    raise AssertionError("all was read again")


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("whole") / "kb"
    small().save(path)
    with KnowledgeBase.open(path) as kb:
        kb.view(load_knowledge)
    return path


@pytest.fixture
def folder(whole: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(whole, tmp_path / "kb"))


@settings(max_examples=8, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(held=helds())
def test_the_shelf_gives_the_answers_of_brute_force(
    tmp_path_factory: pytest.TempPathFactory, held: Held
) -> None:
    path = tmp_path_factory.mktemp("random") / "kb"
    make(held).save(path)
    chosen = Options(THETA, THETA, THETA, "union", "jaccard", False, False, None)
    for round_ in range(2):
        with KnowledgeBase.open(path) as kb:
            assert agrees(kb)
            assert isinstance(kb.view(load_knowledge).classes.names, Texts if round_ else tuple)
            world = world_of_kb(kb)
            for tool in world.classes:
                expected = reason(world, tool, [one for one in world.classes if one != tool], {}, chosen)
                found = rank_substitutes(kb, tool)
                assert {one.name: one.fraction for one in found} == expected.similarity
                best = sorted(expected.similarity, key=lambda name: (-expected.similarity[name], name))
                assert [one.name for one in found] == best
                assert [one.name for one in rank_substitutes(kb, tool, top=2)] == best[:2]


def test_an_observation_reads_only_what_it_touched(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with KnowledgeBase.open(folder) as kb:
        before = rank_substitutes(kb, "tray")
        said = before[0].explain()
        read: list[str] = []
        stream = kb.stream
        monkeypatch.setattr(kb, "stream", lambda text: read.append(text) or stream(text))  # type: ignore[func-returns-value]
        kb.observe("plate", "plate 9", {"weight": 0.01, "rigidity": 0.1})
        kb.observe("cup", "cup 1", {"weight": 0.01, "rigidity": 0.1})
        after = rank_substitutes(kb, "tray")
        assert len(read) == 1
        assert "Plate" in read[0]
        assert "Sponge" not in read[0]
        assert agrees(kb)
        assert "cup" in [one.name for one in after]
        assert before[0].explain() == said  # an answer keeps the knowledge it was given from


STEPS = st.lists(
    st.tuples(
        st.sampled_from(["observe", "forget", "ask", "remember", "label", "open", "stale", "damage"]),
        st.sampled_from(["tray", "plate", "cup"]),
        st.integers(1, 3),
        st.sampled_from([{"weight": 0.1}, {"weight": 0.9, "rigidity": 0.2}, {"support": 0.1}]),
    ),
    max_size=14,
)


def change(kb: KnowledgeBase, what: str, label: str, name: str, values: dict[str, float], turn: int) -> None:
    """Do one thing to a knowledge base; what it refuses changes nothing."""
    with suppress(ErsatzError):
        if what == "observe":
            kb.observe(label, name, values, observation=f"at {turn}")
        elif what == "forget":
            kb.forget(name)
        elif what in ("ask", "remember"):
            rank_substitutes(kb, label, remember=what == "remember")
        elif what == "label":
            thing = kb.resolve(label, "class")
            kb.tell([], [f'<{thing}> <http://www.w3.org/2000/01/rdf-schema#label> "{"a" * turn}"@de .\n'])


def spoil(path: Path, what: str, turn: int) -> None:
    """Put the arrays of another state in place, or damage those that are there."""
    index = path / "snapshots" / (path / "current").read_text() / "index"
    kept = path.with_name("kept")
    if what == "damage" and index.exists():
        flip(index / "counts.npy", -1 - turn)
    elif what == "stale" and kept.exists():
        shutil.rmtree(index, ignore_errors=True)
        shutil.copytree(kept, index)
    elif what == "stale" and index.exists():
        shutil.copytree(index, kept)


@settings(max_examples=6, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(steps=STEPS)
def test_arrays_and_triples_never_disagree(
    whole: Path,
    tmp_path_factory: pytest.TempPathFactory,
    steps: list[tuple[str, str, int, dict[str, float]]],
) -> None:
    path = Path(shutil.copytree(whole, tmp_path_factory.mktemp("steps") / "kb"))
    kb = KnowledgeBase.open(path)
    for turn, (what, label, number, values) in enumerate(steps):
        change(kb, what, label, f"{label} {number}", values, turn)
        if what in ("open", "stale", "damage"):
            kb.close()
            spoil(path, what, turn)
            kb = KnowledgeBase.open(path)
        if number > 1:  # else several changes come together
            assert agrees(kb)
    assert agrees(kb)
    assert_whole(kb)
    kb.close()
    with KnowledgeBase.open(path) as again:
        assert agrees(again)


def test_a_change_is_carried_over_a_restart(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with KnowledgeBase.open(folder) as kb:
        kb.observe("tray", "tray 3", {"weight": 0.01})
        kb.observe("cup", "cup 1", {"weight": 0.01})
        kb.forget("sponge 1")
    monkeypatch.setattr(loading, "_read_all", reading_all_is_an_error)
    with KnowledgeBase.open(folder) as kb:
        found = kb.view(load_knowledge)
        assert [*found.classes.names] == ["cup", "plate", "tray"]
        monkeypatch.undo()
        assert agrees(kb)


def test_many_changes_are_folded_in(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(loading, "MANY", 3)
    with KnowledgeBase.open(folder) as kb:
        kb.observe("tray", "tray 3", {"weight": 0.01})
    for carried in (True, False):
        with KnowledgeBase.open(folder) as kb:
            assert kb.shelf is not None
            found = shelf.find(kb.shelf, kb.revision)
            assert found is not None
            assert bool(found.changed) == carried
            assert agrees(kb)


def reword(file: Path, **changes: object) -> None:
    """Change a manifest, with the right checksum."""
    said = json.loads(file.read_text().splitlines()[1]) | changes
    text = json.dumps(said)
    file.write_text(f"{sha256(text.encode()).hexdigest()}\n{text}\n")


DAMAGES: dict[str, Callable[[Path], object]] = {
    **{
        f"flipped {name}": lambda index, name=name: flip(index / f"{name}.npy")  # type: ignore[misc]
        for name in ("counts", "totals", "units", "names", "iris", "by_iri", "representative")
    },
    "cut array": lambda index: (index / "counts.npy").write_bytes((index / "counts.npy").read_bytes()[:-9]),
    "empty array": lambda index: (index / "counts.npy").write_bytes(b""),
    "no array": lambda index: (index / "counts.npy").unlink(),
    "flipped manifest": lambda index: flip(index / "manifest.json"),
    "half a manifest": lambda index: (index / "manifest.json").write_bytes(
        (index / "manifest.json").read_bytes()[:200]
    ),
    "empty manifest": lambda index: (index / "manifest.json").write_bytes(b""),
    "no manifest": lambda index: (index / "manifest.json").unlink(),
    "not text": lambda index: (index / "manifest.json").write_bytes(b"\xff\xfe\x00"),
    "another format": lambda index: reword(index / "manifest.json", format=shelf.FORMAT + 1),
    "another revision": lambda index: reword(index / "manifest.json", revision="0" * 64),
    "another snapshot": lambda index: reword(index / "manifest.json", snapshot="00000099"),
    "no folder": shutil.rmtree,
    "half written": lambda index: index.rename(index.with_name(".index-1-1")),
}


@pytest.mark.parametrize("how", DAMAGES)
def test_what_is_stale_or_damaged_is_not_believed_but_replaced(folder: Path, how: str) -> None:
    newest = folder / "snapshots" / (folder / "current").read_text()
    DAMAGES[how](newest / "index")
    with KnowledgeBase.open(folder) as kb:
        assert kb.shelf == newest
        assert shelf.find(newest, kb.revision) is None
        assert agrees(kb)
        assert shelf.find(newest, kb.revision) is not None


def test_a_damaged_shelf_is_not_carried_on_into_belief(folder: Path) -> None:
    newest = folder / "snapshots" / (folder / "current").read_text()
    flip(newest / "index" / "counts.npy")
    with KnowledgeBase.open(folder) as kb:
        kb.observe("tray", "tray 3", {"weight": 0.01})
    with KnowledgeBase.open(folder) as kb:
        assert agrees(kb)


def test_another_s_change_of_a_name_is_seen_after_a_restart(folder: Path) -> None:
    """Names are not in the revision; a shelf belongs to a snapshot, so it cannot miss them."""
    stale = KnowledgeBase.open(folder)
    stale.view(load_knowledge)
    with KnowledgeBase.open(folder) as kb:
        label = "<http://www.w3.org/2000/01/rdf-schema#label>"
        plate = "<https://w3id.org/ersatz/kb#Plate>"
        kb.tell([f'{plate} {label} "plate"@en .\n'], [f'{plate} {label} "dish"@en .\n'])
        assert kb.revision == stale.revision
        assert agrees(kb)
    stale.observe("tray", "tray 3", {"weight": 0.01})
    stale.close()
    with KnowledgeBase.open(folder) as kb:
        assert "dish" in [*kb.view(load_knowledge).classes.names]
        assert agrees(kb)


def test_killed_in_the_middle_of_writing_it_is_right_or_not_there(folder: Path) -> None:
    chance = random.Random(0)
    found = 0
    for _ in range(KILLS):
        with subprocess.Popen(
            [sys.executable, "-c", WRITER, str(folder)], stdout=subprocess.PIPE, text=True, cwd=ROOT
        ) as writer:
            assert writer.stdout is not None
            assert writer.stdout.readline() == "done\n"
            time.sleep(chance.uniform(0, 0.08))
            writer.send_signal(signal.SIGKILL)
        with KnowledgeBase.open(folder) as kb:
            assert kb.shelf is not None
            found += shelf.find(kb.shelf, kb.revision) is not None
            assert agrees(kb)
            assert_whole(kb)
    assert found > 0


def test_texts_and_rows_are_a_tuple_and_a_dictionary() -> None:
    words = ["", "a", "b", "b", "茶碗", "𝄞"]
    texts = Texts.of(words)
    assert [*texts] == [texts[at] for at in range(6)] == words
    assert texts[-1] == "𝄞"
    assert texts[1:3] == ["a", "b"]
    with pytest.raises(IndexError):
        texts[6]
    rows = Rows(texts, np.arange(6))
    assert dict(rows) == {"": 0, "a": 1, "b": 3, "茶碗": 4, "𝄞": 5}
    assert "c" not in rows
    assert rows.get("zzzz") is rows.get("\x00") is None
    assert [*Texts.of([])] == []
    assert "a" not in Rows(Texts.of([]), np.arange(0))


COUNTS = st.integers(0, 20) | st.integers(0, 2**62)
PROPORTIONS = st.tuples(COUNTS, COUNTS).map(lambda two: Fraction(1 + min(two), 1 + max(two)))


@settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    st.integers(1, 3).flatmap(
        lambda width: st.lists(
            st.lists(st.tuples(COUNTS, COUNTS).map(sorted), min_size=width, max_size=width), max_size=3
        )
    ),
    st.lists(PROPORTIONS, min_size=1, max_size=5),
)
def test_what_is_representative_at_several_thresholds(
    cells: list[list[list[int]]], thetas: list[Fraction]
) -> None:
    width = len(cells[0]) if cells else 1
    counts, totals = np.array(cells, dtype=np.int64).reshape(-1, width, 2).transpose(2, 0, 1)
    names = [str(row) for row in range(len(cells))]
    table = Memberships(names, names, counts, totals)
    thetas += [Fraction(count, total) for row in cells for count, total in row if count]
    wanted = [
        [[bool(count) and Fraction(count, total) >= theta for count, total in row] for row in cells]
        for theta in thetas
    ]
    assert table.representative_at(thetas).tolist() == wanted
    assert [table.representative(theta).tolist() for theta in thetas] == wanted


def test_packed_bits_come_out_again() -> None:
    bits = np.random.default_rng(0).random((5, 70)) < 0.5
    assert np.array_equal(unpack(pack(bits), 70), bits)
