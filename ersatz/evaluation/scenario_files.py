"""Scenario files: CSV or JSON with these columns (fields); lists are joined by ";" in CSV.

========== ================================================================================
id         unique name of the scenario
missing    class of the missing tool
available  classes at hand, at least one, the missing tool not among them
task       what the tool was needed for, in words; may be empty
accepted   classes known to do; "-" if none of them will; empty where only votes are known
ballots    one choice an expert: "e1=plate;e2=none"
votes      choices counted: "plate=5;none=1"; instead of ballots
========== ================================================================================
"""

import csv
import io
import json
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Final

from ersatz.errors import InputError, UnknownNameError
from ersatz.evaluation.scenarios import Scenario

COLUMNS: Final = ("id", "missing", "available", "task", "accepted", "ballots", "votes")
REQUIRED: Final = ("id", "missing", "available")
SHIPPED: Final = {"benchmark": Path(__file__).parent.parent / "data" / "scenarios.csv"}
"""Scenarios that come with ERSATZ, by name."""


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
