"""The directory store: one writer, readers meanwhile, and a hundred kills."""

import random
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from ersatz.errors import KnowledgeBaseError, LockedError
from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.directory import is_directory_store
from tests.conftest import ROOT
from tests.knowledge.tools import assert_whole, facts_of, lines_of, small

KILLS = 100
WRITER = """
import sys
from ersatz.knowledge.base import KnowledgeBase
kb = KnowledgeBase.open(sys.argv[1])
while True:
    if kb.query("ASK { <https://w3id.org/ersatz/kb#tray_3> a ?x }")[0]["answer"]:
        kb.forget("tray 3")
    else:
        kb.observe("tray", "tray 3", {"weight": 0.75, "rigidity": 0.2, "size": [0.4, 0.3, 0.02]})
    print("done", flush=True)
"""
HOLDER = """
import sys
from ersatz.knowledge.base import KnowledgeBase
kb = KnowledgeBase.open(sys.argv[1])
kb.observe("tray", "tray 9", {"weight": 0.75})
print("holding", flush=True)
sys.stdin.readline()
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    small().save(tmp_path / "kb")
    return tmp_path / "kb"


def start(script: str, path: Path) -> "subprocess.Popen[str]":
    return subprocess.Popen(
        [sys.executable, "-c", script, str(path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=ROOT,
    )


def snapshots(path: Path) -> list[str]:
    return sorted(entry.name for entry in (path / "snapshots").iterdir())


def test_a_second_writer_is_told_and_may_write_later(folder: Path) -> None:
    before = KnowledgeBase.open(folder)
    with start(HOLDER, folder) as holder:
        assert holder.stdout is not None
        assert holder.stdout.readline() == "holding\n"
        second = KnowledgeBase.open(folder)
        with pytest.raises(LockedError, match="is being written by another process: try again later"):
            second.observe("plate", "plate 9", {"weight": 0.4})
        with pytest.raises(LockedError, match="being written"):
            small().save(folder)
        # readers: a new one sees what was written, an older one what it opened
        assert second.query("ASK { <https://w3id.org/ersatz/kb#tray_9> a ?x }")[0]["answer"]
        assert not before.query("ASK { <https://w3id.org/ersatz/kb#tray_9> a ?x }")[0]["answer"]
        assert_whole(before)
        holder.communicate("\n")
    second.observe("plate", "plate 9", {"weight": 0.4})
    assert_whole(second)


def test_who_read_before_another_wrote_must_open_again(folder: Path) -> None:
    stale = KnowledgeBase.open(folder)
    facts = facts_of(stale)
    with KnowledgeBase.open(folder) as writer:
        writer.observe("tray", "tray 3", {"weight": 0.75})
    with pytest.raises(LockedError, match="changed by another writer meanwhile: open it again"):
        stale.forget("plate 1")
    assert facts_of(stale) == facts  # and it reads on from where it was, without holding the lock
    assert_whole(stale)
    with KnowledgeBase.open(folder) as again:
        again.forget("plate 1")
        assert_whole(again)


def test_what_is_closed_says_so(folder: Path) -> None:
    kb = KnowledgeBase.open(folder)
    kb.close()
    with pytest.raises(KnowledgeBaseError, match="is closed: open it again"):
        kb.ask("classes")


def test_snapshots_are_kept_while_read_and_retired_after(folder: Path) -> None:
    reader = KnowledgeBase.open(folder)
    seen = snapshots(folder)
    writer = KnowledgeBase.open(folder)
    writer.observe("tray", "tray 3", {"weight": 0.75})
    writer.observe("tray", "tray 4", {"weight": 0.75})
    assert set(seen) < set(snapshots(folder))
    assert_whole(reader)
    reader.close()
    writer.forget("tray 3")
    writer.close()
    last = KnowledgeBase.open(folder)
    last.forget("tray 4")
    last.observe("tray", "tray 4", {"weight": 0.75})
    assert not set(seen) & set(snapshots(folder))
    assert len(snapshots(folder)) <= 2


def test_a_commit_that_was_never_published_is_found(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class KilledError(BaseException):
        """Stands for the kill between commit and publication."""

    def killed(*_: object) -> None:
        raise KilledError

    kb = KnowledgeBase.open(folder)
    with monkeypatch.context() as patch:
        patch.setattr("ersatz.knowledge.directory._publish", killed)
        with pytest.raises(KilledError):
            kb.observe("tray", "tray 3", {"weight": 0.75})
    kb.close()
    with KnowledgeBase.open(folder) as after:
        assert_whole(after)
        assert after.query("ASK { <https://w3id.org/ersatz/kb#tray_3> a ?x }")[0]["answer"]
        after.forget("tray 3")
    assert facts_of(KnowledgeBase.open(folder)) == facts_of(small())


def test_killed_a_hundred_times_it_is_always_whole(folder: Path) -> None:
    without = facts_of(KnowledgeBase.open(folder))
    with KnowledgeBase.open(folder) as kb:
        kb.observe("tray", "tray 3", {"weight": 0.75, "rigidity": 0.2, "size": [0.4, 0.3, 0.02]})
        with_it = facts_of(kb)
        kb.forget("tray 3")
    assert without != with_it
    chance = random.Random(0)
    states = [0, 0]
    for _ in range(KILLS):
        with start(WRITER, folder) as writer:
            assert writer.stdout is not None
            assert writer.stdout.readline() == "done\n"
            time.sleep(chance.uniform(0, 0.06))
            writer.send_signal(signal.SIGKILL)
        with KnowledgeBase.open(folder) as kb:
            facts = facts_of(kb)
            assert facts in (without, with_it)
            states[facts == with_it] += 1
            assert_whole(kb)
    assert min(states) > 0
    with KnowledgeBase.open(folder) as kb:
        if facts_of(kb) == without:
            kb.observe("tray", "tray 3", {"weight": 0.75, "rigidity": 0.2, "size": [0.4, 0.3, 0.02]})
        kb.forget("tray 3")
        assert facts_of(kb) == without
    assert len(snapshots(folder)) <= 2
    assert sorted(entry.name for entry in folder.iterdir()) == ["current", "snapshots", "store"]


def damage(folder: Path, how: str) -> None:
    newest = folder / "snapshots" / (folder / "current").read_text()
    if how == "no snapshot":
        shutil.rmtree(newest)
    elif how == "empty current":
        (folder / "current").write_text("")
    elif how == "binary current":
        (folder / "current").write_bytes(b"\xff\x00\xfe")
    elif how == "no manifest":
        for file in newest.glob("MANIFEST*"):
            file.unlink()
    elif how == "cut data":
        for file in newest.glob("*.sst"):
            file.unlink()
    elif how == "cut CURRENT":
        (newest / "CURRENT").unlink()
        (newest / "CURRENT").write_text("")


@pytest.mark.parametrize(
    "how", ["no snapshot", "empty current", "binary current", "no manifest", "cut data", "cut CURRENT"]
)
def test_a_truncated_store_is_one_clear_error_and_can_be_replaced(folder: Path, how: str) -> None:
    damage(folder, how)
    with pytest.raises(KnowledgeBaseError, match="build it again") as error:
        facts_of(KnowledgeBase.open(folder))
    assert "\n" not in str(error.value)
    small().save(folder)
    assert_whole(KnowledgeBase.open(folder))


@pytest.mark.parametrize("gone", ["store", "current"])
def test_a_half_written_directory_is_no_knowledge_base(folder: Path, gone: str) -> None:
    (shutil.rmtree if gone == "store" else Path.unlink)(folder / gone)
    assert not is_directory_store(folder)
    with pytest.raises(KnowledgeBaseError, match="is a directory, but no knowledge base"):
        KnowledgeBase.open(folder)


def test_nothing_is_left_of_a_write_that_fails(tmp_path: Path) -> None:
    def lines() -> object:
        yield from sorted(lines_of(small()))
        raise RuntimeError("the source dried up")

    with pytest.raises(RuntimeError, match="dried up"):
        KnowledgeBase.create(lines(), tmp_path / "kb")  # type: ignore[arg-type]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("at_once", [True, False])
def test_a_knowledge_base_is_replaced_at_once_where_the_system_can(
    folder: Path, monkeypatch: pytest.MonkeyPatch, at_once: bool
) -> None:
    if at_once and not sys.platform.startswith("linux"):
        pytest.skip("only Linux exchanges two names")
    other = small()
    other.forget("plate 1")
    renamed: list[Path] = []
    real = Path.rename

    def rename(one: Path, to: Path) -> Path:
        renamed.append(one)
        return real(one, to)

    monkeypatch.setattr(Path, "rename", rename)
    if not at_once:
        monkeypatch.setattr("ersatz.knowledge.directory._exchange", lambda *_: False)
    other.save(folder)
    assert len(renamed) == (0 if at_once else 2)
    assert KnowledgeBase.open(folder).revision == other.revision
    assert [entry.name for entry in folder.parent.iterdir()] == [folder.name]
