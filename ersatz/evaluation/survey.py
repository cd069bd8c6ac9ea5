"""The survey: who is asked what in which order, and votes that are never lost.

A vote is one line appended to a CSV file and forced to disk before the expert sees the next question. A
line cut off by a crash was never acknowledged; it is dropped when the file is opened again. An expert who
answers a question again changes the answer: the last vote counts, all stay in the file.
"""

import csv
import io
import os
import random
import re
import secrets
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Final, TypeAlias

from ersatz.errors import ErsatzWarning, InputError, LockedError, UnknownNameError
from ersatz.evaluation.scenario_files import save_scenarios
from ersatz.evaluation.scenarios import NONE, Scenario, with_ballots

HEADER: Final = ("scenario", "expert", "choice")
EXPERT: Final = re.compile(r"[a-z0-9]{1,32}")


Vote: TypeAlias = tuple[str, str, str]
"""Scenario, expert, choice."""


@dataclass(frozen=True, slots=True)
class Question:
    """What an expert is asked next.

    Attributes
    ----------
    scenario : Scenario
    options : tuple of str
        The available objects in the order this expert sees them.
    number, total : int
        The how-manieth question it is, from 1.
    """

    scenario: Scenario
    options: tuple[str, ...]
    number: int
    total: int


class VoteFile:
    """Votes on disk, append-only; one process at a time writes."""

    def __init__(self, path: str | Path) -> None:
        """Open or make the file, drop a line cut off by a crash, and read the votes.

        Raises
        ------
        InputError
            If it cannot be written, or is not a file of votes.
        LockedError
            If another survey is writing to it.
        """
        self.path = Path(path)
        try:
            self._file = os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o644)
        except OSError as error:
            raise InputError(f"cannot write votes to {str(path)!r}: {error}") from None
        try:
            self._lock()
            self.votes = self._read()
        except BaseException:
            os.close(self._file)
            raise

    def __enter__(self) -> "VoteFile":
        """Return itself; it is closed at the end of the block."""
        return self

    def __exit__(self, _: type[BaseException] | None, __: object, ___: TracebackType | None) -> None:
        """Close."""
        self.close()

    def close(self) -> None:
        """Release the file."""
        os.close(self._file)

    def append(self, scenario: str, expert: str, choice: str) -> None:
        """Add a vote; when this returns it is on disk."""
        self._write((scenario, expert, choice))
        self.votes.append((scenario, expert, choice))

    def ballots(self) -> dict[str, dict[str, str]]:
        """Return the last choice of each expert in each scenario: ballots[scenario][expert]."""
        return last_choices(self.votes)

    def _lock(self) -> None:
        try:
            import fcntl
        except ImportError:  # not a POSIX system: a second survey on the file is the user's to avoid
            return
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise LockedError(
                f"another survey writes to {str(self.path)!r}: stop it, or give another file"
            ) from None

    def _read(self) -> list[Vote]:
        raw = self.path.read_bytes()
        votes, whole = parse_votes(raw, self.path.name)
        if whole < len(raw):
            os.ftruncate(self._file, whole)
        if not whole:
            self._write(HEADER)
        return votes

    def _write(self, row: Sequence[str]) -> None:
        out = io.StringIO()
        csv.writer(out, lineterminator="\n").writerow(row)
        line = out.getvalue().encode("utf-8")
        if os.write(self._file, line) != len(line):
            raise InputError(f"the disk is full: a vote could not be written to {str(self.path)!r}")
        os.fsync(self._file)


class Survey:
    """Scenarios and votes: what each expert is asked next."""

    def __init__(self, scenarios: Sequence[Scenario], votes: VoteFile, seed: int = 0) -> None:
        """Check that the votes are about these scenarios.

        Raises
        ------
        InputError
            If a vote is about another scenario, or a choice that was not offered.
        """
        self.scenarios = {scenario.id: scenario for scenario in scenarios}
        self.votes = votes
        self.seed = seed
        for scenario, _, choice in votes.votes:
            try:
                self._check(scenario, choice)
            except UnknownNameError as error:
                raise InputError(f"{votes.path.name} is of another survey: {error}") from None

    def new_expert(self) -> str:
        """Return an anonymous id that nobody has."""
        taken = {expert for _, expert, _ in self.votes.votes}
        while (name := secrets.token_hex(3)) in taken:
            pass
        return name

    def next(self, expert: str) -> Question | None:
        """Return the next question of an expert, or None when all are answered.

        The order of questions and of objects is the expert's own, and the same after an interruption.
        """
        check_expert(expert)
        answered = {scenario for scenario, who, _ in self.votes.votes if who == expert}
        order = sorted(self.scenarios)
        random.Random(f"questions {self.seed} {expert}").shuffle(order)
        left = [name for name in order if name not in answered]
        if not left:
            return None
        scenario = self.scenarios[left[0]]
        options = list(scenario.available)
        random.Random(f"objects {self.seed} {expert} {scenario.id}").shuffle(options)
        return Question(scenario, tuple(options), len(order) - len(left) + 1, len(order))

    def vote(self, expert: str, scenario: str, choice: str) -> None:
        """Record a choice; when this returns it is on disk.

        Raises
        ------
        UnknownNameError
            If there is no such scenario, or the object was not offered in it.
        InputError
            If the id of the expert is not one.
        """
        check_expert(expert)
        self._check(scenario, choice)
        self.votes.append(scenario, expert, choice)

    def judged(self) -> tuple[Scenario, ...]:
        """Return the scenarios with the experts' choices."""
        return with_ballots(tuple(self.scenarios.values()), self.votes.ballots())

    def export(self, path: str | Path) -> None:
        """Write the scenarios with the experts' choices, as `ersatz evaluate` reads them."""
        save_scenarios(self.judged(), path)

    def _check(self, scenario: str, choice: str) -> None:
        if scenario not in self.scenarios:
            raise UnknownNameError("scenario", scenario, self.scenarios)
        offered = (*self.scenarios[scenario].available, NONE)
        if choice not in offered:
            raise UnknownNameError("choice", choice, offered, f"in scenario {scenario!r}")


def parse_votes(raw: bytes, name: str) -> tuple[list[Vote], int]:
    """Return the votes in the content of a file, and how many bytes are whole lines.

    Raises
    ------
    InputError
        If it is not a file of votes.
    """
    whole = raw[: raw.rfind(b"\n") + 1]
    wrong = InputError(f"{name} is not a file of votes: its header is {','.join(HEADER)}")
    if len(whole) < len(raw):
        if raw[:8] != b"scenario"[: len(raw)]:
            raise wrong
        warnings.warn(
            f"{name} ended in half a line, a vote never acknowledged: {len(raw) - len(whole)} bytes dropped",
            ErsatzWarning,
            stacklevel=2,
        )
    if not whole:
        return [], 0
    try:
        rows = list(csv.reader(io.StringIO(whole.decode("utf-8")), strict=True))
    except (UnicodeDecodeError, csv.Error):
        raise wrong from None
    if tuple(rows[0]) != HEADER or any(len(row) != len(HEADER) for row in rows):
        raise wrong
    return [(row[0], row[1], row[2]) for row in rows[1:]], len(whole)


def last_choices(votes: Sequence[Vote]) -> dict[str, dict[str, str]]:
    """Return the last choice of each expert in each scenario: [scenario][expert]."""
    found: dict[str, dict[str, str]] = {}
    for scenario, expert, choice in votes:
        found.setdefault(scenario, {})[expert] = choice
    return found


def add_votes(scenarios: Sequence[Scenario], path: str | Path) -> tuple[Scenario, ...]:
    """Return the scenarios with the choices in a file of votes; the file is only read.

    Raises
    ------
    InputError
        If it cannot be read, is not a file of votes, or is about other scenarios.
    """
    try:
        raw = Path(path).read_bytes()
    except OSError as error:
        raise InputError(f"cannot read votes from {str(path)!r}: {error}") from None
    try:
        return with_ballots(scenarios, last_choices(parse_votes(raw, Path(path).name)[0]))
    except UnknownNameError as error:
        raise InputError(f"{Path(path).name} is of another survey: {error}") from None


def check_expert(expert: str) -> None:
    """Refuse what is no id of an expert."""
    if not EXPERT.fullmatch(expert):
        raise InputError(f"{expert!r} is no id of an expert: up to 32 small letters and digits")
