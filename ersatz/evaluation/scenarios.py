"""Scenarios: a missing tool, the objects at hand, and what people or evidence say would stand in for it.

"none" is the choice of an expert who would take none of the objects.
"""

import random
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

from ersatz.errors import InputError, UnknownNameError

NONE: Final = "none"
"""The choice of none of the objects."""


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
