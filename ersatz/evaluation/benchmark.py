"""The shipped benchmark: scenarios whose answers follow from measured and stated facts by the rules below.

A task judges a category by its facts: fit, unfit, or not decided. A scenario takes a category that is fit
as the missing tool, and offers other fit ones among unfit ones; what is not decided is not offered. The
rules were written before any method was run on them and are not tuned on. `ersatz/data/scenarios.md`
shows all facts and verdicts; `derive(data)` makes both files again.
"""

import random
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final, TypeAlias

from ersatz.evaluation.facts import Facts, read_facts
from ersatz.evaluation.scenario_files import SHIPPED, save_scenarios
from ersatz.evaluation.scenarios import Scenario

Verdict: TypeAlias = bool | None
"""Fit, unfit, or not decided by the facts."""


@dataclass(frozen=True, slots=True)
class Task:
    """Something to be done, and which categories can do it.

    Attributes
    ----------
    name, text : str
    fit, unfit : str
        The rules in words.
    judge : callable
    """

    name: str
    text: str
    fit: str
    unfit: str
    judge: Callable[[Facts], Verdict]


def _decide(fit: Verdict, unfit: Verdict) -> Verdict:
    return True if fit else False if unfit else None


def _pour(f: Facts) -> Verdict:
    deep = f.cavity is not None and f.cavity >= 0.1 and f.extents is not None and f.extents[2] >= 0.05
    return _decide("pour" in f.affordances or (deep and f.hard), f.hard is False or _closed(f))


def _gather(f: Facts) -> Verdict:
    return _decide("contain" in f.affordances or (f.cavity is not None and f.cavity >= 0.05), _closed(f))


def _closed(f: Facts) -> bool:
    return f.cavity is not None and f.cavity <= 0.01


def _carry(f: Facts) -> Verdict:
    if f.extents is None:
        return False if f.hard is False else None
    length, width, height = f.extents
    return _decide(
        f.hard and length >= 0.15 and width >= 0.12 and height <= 0.03, f.hard is False or width < 0.10
    )


def _wipe(f: Facts) -> Verdict:
    return _decide(bool(f.affordances & {"dry", "absorb", "clean"}), f.hard)


def _pad(f: Facts) -> Verdict:
    return None if f.hard is None else not f.hard


def _dough(f: Facts) -> Verdict:
    if f.extents is None or f.roundness is None:
        return False if f.hard is False else None
    long = f.extents[0] >= 0.09 and f.extents[0] >= 1.1 * f.extents[1]
    return _decide(f.hard and f.roundness >= 0.95 and long, f.hard is False or f.roundness <= 0.65)


def _toy(f: Facts) -> Verdict:
    flat = f.roundness is not None and f.roundness <= 0.65
    return _decide("roll" in f.affordances, f.hard is False or flat)


def _reach(f: Facts) -> Verdict:
    if f.extents is None:
        return False if f.hard is False else None
    length, width, _ = f.extents
    return _decide(
        f.hard and length >= 0.12 and width <= 0.08, f.hard is False or width >= 0.12 or length <= 0.10
    )


def _hold_open(f: Facts) -> Verdict:
    return None if f.mass is None else _decide(f.mass >= 0.3, f.mass <= 0.15)


def _raise(f: Facts) -> Verdict:
    if f.extents is None or f.fullness is None:
        return False if f.hard is False else None
    length, width, height = f.extents
    ball = length <= 1.05 * width and f.roundness is not None and f.roundness >= 0.95
    return _decide(
        f.hard is not False and f.fullness >= 0.75 and height >= 0.04,
        f.hard is False or height <= 0.025 or ball,
    )


def _cover(f: Facts) -> Verdict:
    if f.extents is None:
        return None
    return _decide(f.extents[1] >= 0.15 and f.extents[2] <= 0.04, f.extents[1] <= 0.10)


UNROUND: Final = "not hard, or the shorter two edges differ by more than a third"

TASKS: Final = (
    Task(
        "pour",
        "Fetch water from the tap and pour it out again.",
        "labelled `pour`; or hard, with a cavity of at least 0.1 l and no edge below 5 cm",
        "not hard, or a cavity of at most 0.01 l",
        _pour,
    ),
    Task(
        "gather",
        "Keep a handful of screws together.",
        "labelled `contain`, or a cavity of at least 0.05 l",
        "a cavity of at most 0.01 l",
        _gather,
    ),
    Task(
        "carry",
        "Carry two cups at once.",
        "hard, at least 15 cm x 12 cm, at most 3 cm high",
        "not hard, or narrower than 10 cm",
        _carry,
    ),
    Task("wipe", "Take up spilled water.", "labelled `dry`, `absorb` or `clean`", "hard", _wipe),
    Task("pad", "Put something yielding under a fragile thing.", "not hard", "hard", _pad),
    Task(
        "dough",
        "Roll out dough.",
        "hard, the shorter two edges within 5 % (round about its axis), at least 9 cm long and 1.1 times "
        "as long "
        "as wide",
        UNROUND,
        _dough,
    ),
    Task("toy", "Roll something along the floor to a child.", "labelled `roll`", UNROUND, _toy),
    Task(
        "reach",
        "Push a coin out from under a cupboard, through a gap of 8 cm.",
        "hard, at least 12 cm long, at most 8 cm wide",
        "not hard, at least 12 cm wide, or at most 10 cm long",
        _reach,
    ),
    Task("hold_open", "Keep a door from falling shut.", "at least 300 g", "at most 150 g", _hold_open),
    Task(
        "raise",
        "Raise the end of a board by 4 cm or more.",
        "not soft, fills at least three quarters of its box, no edge below 4 cm",
        "soft, an edge of at most 2.5 cm, or a ball",
        _raise,
    ),
    Task(
        "cover",
        "Cover a bowl of 15 cm against flies.",
        "at least 15 cm wide, at most 4 cm high",
        "at most 10 cm wide",
        _cover,
    ),
)
"""What is to be done, in the order of the document."""

DRAWS: Final = 2
"""Scenarios of each task and missing tool; more where a tool has few tasks, so that each has three."""

OFFERED: Final = 5
"""Objects at hand in a scenario, as in the paper."""


def verdicts(facts: Mapping[str, Facts]) -> dict[str, dict[str, Verdict]]:
    """Return for each task what it says of each category."""
    return {task.name: {name: task.judge(one) for name, one in facts.items()} for task in TASKS}


def draw(facts: Mapping[str, Facts], seed: int = 0) -> tuple[Scenario, ...]:
    """Return the scenarios that follow from the facts; one to three of five objects will do."""
    judged = verdicts(facts)
    found = []
    for task in TASKS:
        fit = sorted(name for name, verdict in judged[task.name].items() if verdict)
        unfit = sorted(name for name, verdict in judged[task.name].items() if verdict is False)
        for missing in fit:
            tasks = sum(bool(judged[other.name][missing]) for other in TASKS)
            chance = random.Random(f"{seed} {task.name} {missing}")
            offers: list[tuple[tuple[str, ...], frozenset[str]]] = []
            while len(offers) < max(DRAWS, -(-3 // tasks)):
                good = chance.sample(
                    others := [n for n in fit if n != missing], chance.randint(1, min(3, len(others)))
                )
                shown = [*good, *chance.sample(unfit, OFFERED - len(good))]
                chance.shuffle(shown)
                if not any(set(shown) == set(before) for before, _ in offers):
                    offers.append((tuple(shown), frozenset(good)))
            found += [
                Scenario(f"{task.name}-{missing.replace(' ', '_')}-{at}", missing, shown, task.text, accepted)
                for at, (shown, accepted) in enumerate(offers, 1)
            ]
    return tuple(found)


def derive(data: Path) -> None:
    """Derive the shipped benchmark from its sources again."""
    write(read_facts(data), SHIPPED["benchmark"])


def write(facts: Mapping[str, Facts], scenarios: Path) -> None:
    """Write the scenarios that follow from the facts and, beside them, the document that shows how."""
    found = draw(facts)
    save_scenarios(found, scenarios)
    scenarios.with_suffix(".md").write_text(describe(facts, found), encoding="utf-8")


INTRODUCTION: Final = """\
A category is fit or unfit for a task only if a fact below says so; otherwise it is not offered.

Facts: edges, roundness (ratio of the shorter two edges), fullness (volume of the convex hull over that
of the box) and cavity are medians over scanned objects (YCB, KIT ObjectModels, Google Scanned Objects,
OCRTOC, Amazon Picking Challenge; one object a product; exact examples of a category before near ones).
Masses are medians of weighed objects, or means of at least ten shop entries for what nobody weighed
(Hullman et al. 2018). Hard: at least 70 % of the people asked call it rigid, soft: at most 30 % (Hullman
et al. 2018), else NEWTON's label of softness. Labels: RoboCSK's affordances with trust of at least 1;
those below were derived by machine. The inside of things scanned closed is unknown; binder, cap and
keyboard were not scanned.

The rules were written down before any method was run on them, and nothing was changed afterwards.

Limits: no method is told the task, so a tool with several uses has scenarios that no single ranking can
all get right (the report shows that ceiling); unfit objects are unfit by a wide margin, so nearness in
raw numbers goes far; the facts are of a hundred objects, many of one brand; and a knowledge base
grounded in the same scans shares their errors, though not these rules.
"""


def describe(facts: Mapping[str, Facts], scenarios: tuple[Scenario, ...]) -> str:
    """Return the document of the benchmark: facts, rules, verdicts."""
    judged = verdicts(facts)
    tools = len({s.missing for s in scenarios})
    counted = (
        f"{len(scenarios)} scenarios, {tools} missing tools, {len(TASKS)} tasks, {OFFERED} objects each."
    )
    made = "Made by `ersatz.evaluation.benchmark.derive`; do not edit."
    lines = [
        f"# The shipped benchmark\n\n{counted} {made}\n\n{INTRODUCTION}",
        "## Facts\n",
        "| category | edges, cm | round | full | cavity, l | mass, kg | hard | labels |",
        "|---|---|---|---|---|---|---|---|",
        *(_fact_row(name, one) for name, one in facts.items()),
        "\n## Tasks\n",
        "| task | what is to be done | fit | unfit | fit categories | unfit categories |",
        "|---|---|---|---|---|---|",
        *(_task_row(task, judged[task.name]) for task in TASKS),
    ]
    return "\n".join(lines) + "\n"


def _task_row(task: Task, judged: Mapping[str, Verdict]) -> str:
    fit, unfit = (", ".join(n for n, v in judged.items() if v is wanted) for wanted in (True, False))
    return f"| {task.name} | {task.text} | {task.fit} | {task.unfit} | {fit} | {unfit} |"


def _fact_row(name: str, f: Facts) -> str:
    edges = " x ".join(f"{100 * edge:.1f}" for edge in f.extents) if f.extents else ""
    numbers = ("" if x is None else f"{x:.2f}" for x in (f.roundness, f.fullness, f.cavity, f.mass))
    hard = {True: "yes", False: "no", None: ""}[f.hard]
    return f"| {name} | {edges} | {' | '.join(numbers)} | {hard} | {', '.join(sorted(f.affordances))} |"
