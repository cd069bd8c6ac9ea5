"""Rivals that know facts: relations between concepts, and affordances of objects, from tables."""

import ast
import csv
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from ersatz.errors import InputError
from ersatz.evaluation.agreement import Answer
from ersatz.evaluation.methods import Context
from ersatz.evaluation.scenarios import Scenario

RELATIONS: Final = Path(__file__).parents[2] / "data" / "relations.csv"
"""Our own small table; each row names its source."""

COLUMNS: Final = {"class", "relation", "value"}
KINDS: Final = ("has_property", "capable_of", "used_for")


@dataclass(frozen=True, slots=True)
class Overlap:
    """The object that shares most facts with the missing tool: sum of lesser over sum of greater weights.

    Attributes
    ----------
    facts : mapping of class to a mapping of fact to its weight
    """

    facts: Mapping[str, Mapping[str, float]]

    def answer(self, scenario: Scenario) -> Answer:
        """Score by the (weighted) Jaccard index of facts."""
        mine = self.facts.get(scenario.missing, {})
        return Answer(tuple(overlap(mine, self.facts.get(name, {})) for name in scenario.available))


def overlap(a: Mapping[str, float], b: Mapping[str, float]) -> float:
    """Return sum of min over sum of max of the weights, in [0, 1]; 0 of two empty ones.

    >>> overlap({"roll": 1.0, "grasp": 1.0}, {"grasp": 0.5})
    0.25
    """
    either = sorted(a.keys() | b.keys())
    most = sum(max(a.get(fact, 0.0), b.get(fact, 0.0)) for fact in either)
    return round(sum(min(a.get(f, 0.0), b.get(f, 0.0)) for f in either) / most, 9) if most else 0.0


def shared_relations(context: Context) -> Overlap:
    """Return the method after Boteanu, St. Clair, Mohseni-Kabir, Saldanha & Chernova 2016.

    Takes from "Leveraging large-scale semantic networks for adaptive robot task learning and execution":
    that a substitute is a concept with the same relations (HasProperty, CapableOf, UsedFor) as the missing
    one in a semantic network. Does not take: ConceptNet itself (our table of the shipped categories, or
    one the user gives: class, relation, value), the context of the task's other objects, nor the random
    forest that learns which relations count.
    """
    path = context.sources.get("relations", RELATIONS)
    facts: dict[str, dict[str, float]] = {}
    for row in _rows(path, COLUMNS):
        if row["relation"] not in KINDS:
            raise InputError(f"{path.name}: relation {row['relation']!r} is not one of {', '.join(KINDS)}")
        facts.setdefault(row["class"], {})[f"{row['relation']} {row['value']}"] = 1.0
    return Overlap(facts)


def affordance_overlap(context: Context) -> Overlap:
    """Return the method after Agostini, Aein, Szedmak, Aksoy, Piater & Wörgötter 2015.

    Takes from "Using structural bootstrapping for object substitution in robotic executions of human-like
    manipulation tasks": that a substitute shares affordances with the missing tool, looked up in a
    repository of objects and their affordances (ROAR). Does not take: ROAR itself (a table in RoboCSK's
    layout that the user gives: Object, Affordances), the learned completion of missing entries, nor the
    action context. Trust in a label is its weight.
    """
    path = context.sources.get("affordances")
    if path is None:
        raise InputError("affordances needs a table: give --baseline affordances=FILE (RoboCSK's layout)")
    facts = {}
    for row in _rows(path, {"Object", "Affordances"}):
        try:
            stated = ast.literal_eval(row["Affordances"])
            facts[row["Object"]] = {str(word): float(trust) for word, trust in stated.values()}
        except (ValueError, SyntaxError, TypeError, AttributeError):
            raise InputError(
                f"{path.name}: the affordances of {row['Object']!r} are not {{1: ('contain', 1.0), ...}}"
            ) from None
    return Overlap(facts)


def _rows(path: Path, columns: set[str]) -> list[dict[str, str]]:
    try:
        with path.open(encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"cannot read {str(path)!r}: {error}") from None
    if not rows or not columns <= set(rows[0]):
        raise InputError(f"{path.name} needs rows with the columns {', '.join(sorted(columns))}")
    return rows
