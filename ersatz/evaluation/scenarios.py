"""Scenarios: a missing tool, the objects at hand, and what people or evidence say would stand in for it.

A scenario file is CSV or JSON with these columns (fields); lists are joined by ";" in CSV.

========== ================================================================================
id         unique name of the scenario
missing    class of the missing tool
available  classes at hand, at least one, the missing tool not among them
task       what the tool was needed for, in words; may be empty
accepted   classes known to do; "-" if none of them will; empty where only votes are known
ballots    one choice an expert: "e1=plate;e2=none"
votes      choices counted: "plate=5;none=1"; instead of ballots
========== ================================================================================

"none" is the choice of an expert who would take none of the objects.
"""

import csv
import io
import json
import random
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

from ersatz.errors import InputError, UnknownNameError

NONE: Final = "none"
"""The choice of none of the objects."""

COLUMNS: Final = ("id", "missing", "available", "task", "accepted", "ballots", "votes")
REQUIRED: Final = ("id", "missing", "available")
SHIPPED: Final = {"benchmark": Path(__file__).parent.parent / "data" / "scenarios.csv"}
"""Scenarios that come with ERSATZ, by name."""


@dataclass(frozen=True, slots=True)
class Scenario:
    """One question and, where known, its answers.

    Attributes
    ----------
    id : str
    missing : str
        Class of the missing tool.
    available : tuple of str
        Classes at hand; at least one, none twice.
    task : str
    accepted : frozenset of str or None
        Those known to do, possibly none; None where it is not known.
    votes : mapping of str to int
        How many experts chose each class, and "none"; empty where nobody voted.
    ballots : mapping of str to str
        Choice of each expert; empty where only counts are known.
    """

    id: str
    missing: str
    available: tuple[str, ...]
    task: str = ""
    accepted: frozenset[str] | None = None
    votes: Mapping[str, int] = field(default_factory=dict)
    ballots: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check, and count the ballots."""
        if not self.id or not self.missing:
            raise InputError(f"scenario {self.id!r} needs an id and a missing tool")
        if not self.id.isprintable():
            raise InputError(f"scenario {self.id!r}: an id has no line breaks")
        if not self.available or len(set(self.available)) < len(self.available):
            raise InputError(f"scenario {self.id!r}: name at least one available object, and each once")
        if self.missing in self.available or NONE in self.available:
            bad = self.missing if self.missing in self.available else NONE
            raise InputError(f"scenario {self.id!r}: {bad!r} cannot be among the available objects")
        if self.ballots and self.votes and Counter(self.ballots.values()) != Counter(self.votes):
            raise InputError(f"scenario {self.id!r} has ballots and other votes: give one of them")
        if self.ballots:
            object.__setattr__(self, "votes", dict(sorted(Counter(self.ballots.values()).items())))
        known = {*self.available, NONE}
        for name in (*self.votes, *(self.accepted or ())):
            if name not in known or (name == NONE and name not in self.votes):
                raise UnknownNameError("choice", name, self.available, f"in scenario {self.id!r}")
        if any(count < 0 for count in self.votes.values()):
            raise InputError(f"scenario {self.id!r}: a number of votes is negative")

    @property
    def voters(self) -> int:
        """Number of experts who answered."""
        return sum(self.votes.values())

    @property
    def judged(self) -> bool:
        """Whether there is anything to compare with."""
        return self.voters > 0 or self.accepted is not None

    def shares(self) -> tuple[float, ...]:
        """Return for each available object the share of experts who chose it, in [0, 1].

        Where nobody voted: 1 for an accepted object, 0 for another.
        """
        if self.voters:
            return tuple(self.votes.get(name, 0) / self.voters for name in self.available)
        return tuple(float(name in (self.accepted or ())) for name in self.available)

    def chosen(self) -> frozenset[str]:
        """Return the objects held to be substitutes: accepted, or chosen by some expert."""
        if self.accepted is not None:
            return self.accepted
        return frozenset(name for name in self.available if self.votes.get(name, 0) > 0)

    def modes(self) -> frozenset[str]:
        """Return what most experts chose (several if tied, maybe "none"); else what is accepted."""
        if self.voters:
            most = max(self.votes.values())
            return frozenset(name for name, count in self.votes.items() if count == most)
        return self.accepted if self.accepted else frozenset({NONE})

    def to_json(self) -> dict[str, Any]:
        """Return the fields of a scenario file."""
        return {
            "id": self.id,
            "missing": self.missing,
            "available": list(self.available),
            "task": self.task,
            "accepted": None if self.accepted is None else sorted(self.accepted),
            "ballots": dict(sorted(self.ballots.items())),
            "votes": {} if self.ballots else dict(sorted(self.votes.items())),
        }


def load_scenarios(location: str | Path) -> tuple[Scenario, ...]:
    """Read scenarios from CSV or JSON, or the shipped ones by name ("benchmark").

    Raises
    ------
    InputError
        If the file cannot be read, a column is missing or unknown, a row is not what it should be, or
        an id comes twice; the message names file and row.
    """
    path = SHIPPED.get(str(location), Path(location))
    try:
        text = path.read_text(encoding="utf-8-sig")
        rows = json.loads(text) if path.suffix == ".json" else _csv_rows(text)
    except (OSError, UnicodeDecodeError, json.JSONDecodeError, csv.Error) as error:
        raise InputError(
            f"cannot read scenarios from {str(location)!r}: {error}; give a CSV or JSON file, "
            f"or {' or '.join(map(repr, SHIPPED))}"
        ) from None
    if not isinstance(rows, list) or not rows:
        raise InputError(f"{str(location)!r} holds no scenario: give one a row, with {', '.join(REQUIRED)}")
    found = []
    for number, row in enumerate(rows, 2):
        try:
            found.append(_scenario(row))
        except (InputError, UnknownNameError) as error:
            raise InputError(f"{path.name}, row {number}: {error}") from None
    twice = [name for name, count in Counter(one.id for one in found).items() if count > 1]
    if twice:
        raise InputError(f"{path.name}: two scenarios are called {twice[0]!r}")
    return tuple(found)


def save_scenarios(scenarios: Iterable[Scenario], path: str | Path) -> None:
    """Write scenarios as CSV, or JSON where the name ends so; the same every time."""
    rows = [scenario.to_json() for scenario in scenarios]
    if Path(path).suffix == ".json":
        text = json.dumps(rows, indent=1, ensure_ascii=False) + "\n"
    else:
        out = io.StringIO()
        writer = csv.DictWriter(out, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows({name: _joined(value) for name, value in row.items()} for row in rows)
        text = out.getvalue()
    Path(path).write_text(text, encoding="utf-8")


def check_names(scenarios: Sequence[Scenario], known: Sequence[str]) -> None:
    """Refuse scenarios about classes a knowledge base does not know."""
    for scenario in scenarios:
        for name in (scenario.missing, *scenario.available):
            if name not in known:
                raise UnknownNameError("class", name, known, f"in scenario {scenario.id!r}")


def generate(classes: Sequence[str], candidates: int = 5, seed: int = 0) -> tuple[Scenario, ...]:
    """Return the paper's design: one query a class, with that many others drawn at random.

    Raises
    ------
    InputError
        If there are not enough classes, or a class comes twice.
    """
    names = sorted(set(classes))
    if len(names) < len(classes):
        raise InputError("a class is given twice")
    if not 0 < candidates < len(names):
        raise InputError(
            f"candidates is {candidates}: with {len(names)} classes it lies from 1 to {len(names) - 1}"
        )
    chance = random.Random(f"ersatz scenarios {seed}")
    return tuple(
        Scenario(f"q{number:02d}", name, tuple(chance.sample([n for n in names if n != name], candidates)))
        for number, name in enumerate(names, 1)
    )


def with_ballots(
    scenarios: Sequence[Scenario], ballots: Mapping[str, Mapping[str, str]]
) -> tuple[Scenario, ...]:
    """Return the scenarios with the experts' choices: ballots[id][expert] = choice."""
    known = [scenario.id for scenario in scenarios]
    for name in ballots:
        if name not in known:
            raise UnknownNameError("scenario", name, known)
    return tuple(
        replace(scenario, ballots=dict(ballots[scenario.id]), votes={})
        if scenario.id in ballots
        else scenario
        for scenario in scenarios
    )


def _csv_rows(text: str) -> list[dict[str, Any]]:
    reader = csv.DictReader(io.StringIO(text), strict=True)
    header = reader.fieldnames or []
    missing = [name for name in REQUIRED if name not in header]
    unknown = [name for name in header if name not in COLUMNS]
    if missing or unknown:
        raise InputError(
            f"the header of a scenario file is {','.join(COLUMNS)}; "
            + (f"{missing[0]!r} is missing" if missing else f"{unknown[0]!r} is not a column")
        )
    rows = []
    for row in reader:
        if None in row:
            raise InputError(f"row {reader.line_num} has more fields than the header: quote commas")
        cells = {name: (value or "").strip() for name, value in row.items()}
        accepted = cells.get("accepted", "")
        rows.append(
            cells
            | {
                "available": _split(cells["available"]),
                "accepted": None if not accepted else [] if accepted == "-" else _split(accepted),
                "ballots": _pairs(cells.get("ballots", "")),
                "votes": _pairs(cells.get("votes", "")),
            }
        )
    return rows


def _scenario(row: Any) -> Scenario:
    if not isinstance(row, dict):
        raise InputError("a scenario is an object with fields")
    unknown = [name for name in row if name not in COLUMNS]
    missing = [name for name in REQUIRED if not row.get(name)]
    if unknown or missing:
        raise InputError(f"unknown field {unknown[0]!r}" if unknown else f"{missing[0]!r} is missing")
    accepted, votes = row.get("accepted"), row.get("votes") or {}
    if isinstance(row["available"], str) or isinstance(accepted, str):
        raise InputError("available and accepted are lists of names")
    try:
        counts = {str(name): int(count) for name, count in votes.items()}
    except ValueError:
        raise InputError(f"votes {votes!r} are not whole numbers") from None
    return Scenario(
        str(row["id"]),
        str(row["missing"]),
        tuple(map(str, row["available"])),
        str(row.get("task") or ""),
        None if accepted is None else frozenset(map(str, accepted)),
        counts,
        {str(expert): str(choice) for expert, choice in (row.get("ballots") or {}).items()},
    )


def _split(cell: str) -> list[str]:
    return [name.strip() for name in cell.split(";") if name.strip()]


def _pairs(cell: str) -> dict[str, str]:
    pairs = [part.partition("=") for part in _split(cell)]
    wrong = [name for name, equals, value in pairs if not (name and equals and value)]
    if wrong:
        raise InputError(f"{wrong[0]!r} is no pair: write name=choice, separated by ;")
    found = {name.strip(): value.strip() for name, _, value in pairs}
    if len(found) < len(pairs):
        raise InputError(f"a name comes twice in {cell!r}")
    return found


def _joined(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, dict):
        return ";".join(f"{name}={one}" for name, one in value.items())
    if isinstance(value, list):
        return ";".join(value) or "-"
    return str(value)
