"""Votes are never lost: torn lines, two writers, a process killed while it votes."""

import subprocess
import sys
import time
from pathlib import Path

import pytest

from ersatz.errors import ErsatzWarning, InputError, LockedError, UnknownNameError
from ersatz.evaluation.scenario_files import load_scenarios
from ersatz.evaluation.scenarios import NONE, Scenario
from ersatz.evaluation.survey import Survey, VoteFile, add_votes
from tests.conftest import ROOT

SCENARIOS = tuple(Scenario(f"q{at}", "tray", ("a", "b", "c")) for at in range(8))


def test_an_expert_goes_through_all_questions_in_an_order_of_their_own(tmp_path: Path) -> None:
    with VoteFile(tmp_path / "votes.csv") as votes:
        survey = Survey(SCENARIOS, votes)
        orders = []
        for expert in ("anna", "ben"):
            seen: list[tuple[str, tuple[str, ...]]] = []
            while question := survey.next(expert):
                assert question.number == len(seen) + 1
                assert sorted(question.options) == ["a", "b", "c"]
                seen.append((question.scenario.id, question.options))
                assert survey.next(expert) == question
                survey.vote(expert, question.scenario.id, question.options[0])
            orders.append(seen)
        assert [sorted(name for name, _ in seen) for seen in orders] == [sorted(s.id for s in SCENARIOS)] * 2
        assert orders[0] != orders[1]
        assert survey.new_expert() not in ("anna", "ben")


def test_the_last_vote_counts_and_all_are_kept(tmp_path: Path) -> None:
    path = tmp_path / "votes.csv"
    with VoteFile(path) as votes:
        survey = Survey(SCENARIOS, votes)
        survey.vote("anna", "q1", "a")
        survey.vote("anna", "q1", NONE)
        survey.vote("ben", "q1", "b")
        survey.export(tmp_path / "judged.csv")
    assert path.read_text() == "scenario,expert,choice\nq1,anna,a\nq1,anna,none\nq1,ben,b\n"
    assert add_votes(SCENARIOS, path) == load_scenarios(tmp_path / "judged.csv")
    judged = {s.id: s for s in load_scenarios(tmp_path / "judged.csv")}
    assert judged["q1"].ballots == {"anna": NONE, "ben": "b"}
    assert not judged["q2"].judged


def test_refuses_votes_that_make_no_sense(tmp_path: Path) -> None:
    with VoteFile(tmp_path / "votes.csv") as votes:
        survey = Survey(SCENARIOS, votes)
        with pytest.raises(UnknownNameError, match="scenario"):
            survey.vote("anna", "q9", "a")
        with pytest.raises(UnknownNameError, match="choice"):
            survey.vote("anna", "q1", "d")
        for name in ("", "An na", "a,b", "x" * 33):
            with pytest.raises(InputError, match="id of an expert"):
                survey.vote(name, "q1", "a")
        assert votes.votes == []
        survey.vote("anna", "q1", "a")
        with pytest.raises(InputError, match="another survey"):
            Survey(SCENARIOS[2:], votes)
        with pytest.raises(InputError, match="another survey"):
            add_votes(SCENARIOS[2:], votes.path)
    with pytest.raises(InputError, match="cannot read votes"):
        add_votes(SCENARIOS, tmp_path / "nothing.csv")


@pytest.mark.parametrize("torn", [b"q2,ben", b"q2,ben,b", b"\xff"])
def test_half_a_line_is_dropped(tmp_path: Path, torn: bytes) -> None:
    path = tmp_path / "votes.csv"
    whole = b"scenario,expert,choice\nq1,anna,a\n"
    path.write_bytes(whole + torn)
    with pytest.warns(ErsatzWarning, match="half a line"), VoteFile(path) as votes:
        assert votes.votes == [("q1", "anna", "a")]
        votes.append("q2", "ben", "c")
    assert path.read_bytes() == whole + b"q2,ben,c\n"


def test_half_a_header_is_written_again(tmp_path: Path) -> None:
    path = tmp_path / "votes.csv"
    path.write_bytes(b"scena")
    with pytest.warns(ErsatzWarning), VoteFile(path) as votes:
        assert votes.votes == []
    assert path.read_bytes() == b"scenario,expert,choice\n"


@pytest.mark.parametrize("text", ["a,b\n1,2\n", "scenario,expert,choice\nq1,anna\n", "my diary", '"\n'])
def test_other_peoples_files_are_not_touched(tmp_path: Path, text: str) -> None:
    path = tmp_path / "votes.csv"
    path.write_text(text)
    with pytest.raises(InputError, match="not a file of votes"):
        VoteFile(path)
    assert path.read_text() == text


def test_two_surveys_do_not_share_a_file(tmp_path: Path) -> None:
    with VoteFile(tmp_path / "votes.csv"), pytest.raises(LockedError, match="another survey"):
        VoteFile(tmp_path / "votes.csv")
    VoteFile(tmp_path / "votes.csv").close()
    with pytest.raises(InputError, match="cannot write"):
        VoteFile(tmp_path)


def test_killed_while_voting(tmp_path: Path) -> None:
    """Every vote acknowledged before the kill is there after it, and the survey goes on."""
    path = tmp_path / "votes.csv"
    script = (
        "import sys\nfrom ersatz.evaluation.survey import VoteFile\n"
        f"votes = VoteFile({str(path)!r})\n"
        "for n in range(10**9):\n    votes.append('q1', f'e{n}', 'a')\n    print(n, flush=True)\n"
    )
    for _ in range(3):
        with subprocess.Popen(
            [sys.executable, "-c", script], stdout=subprocess.PIPE, text=True, cwd=ROOT
        ) as run:
            assert run.stdout
            assert run.stdout.readline()
            time.sleep(0.2)
            run.kill()
            acknowledged = run.stdout.read().split()
        with VoteFile(path) as votes:
            kept = {expert for _, expert, _ in votes.votes}
            assert {f"e{n}" for n in acknowledged} <= kept
            assert len(votes.votes) >= len(acknowledged) + 1
