"""Asking for more: what to measure next, of which thing, before deciding."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ersatz.errors import InputError
from ersatz.grounding.fuzzy import DEGREE
from ersatz.knowledge.base import KnowledgeBase
from ersatz.reasoner.confidence import SURE
from ersatz.reasoner.gain import DRAWS, Doubt, Measurement, Outlook, outlook
from ersatz.reasoner.population import load_population
from ersatz.reasoner.recognition import Held, held_degrees
from ersatz.reasoner.relevance import USUAL, ReasonerSettings
from ersatz.reasoner.representative import Knowledge, class_row, load_knowledge
from ersatz.reasoner.sampling import Question
from ersatz.reasoner.substitution import rank_substitutes

UNNAMED = "the object"
"""What an object without a name is called."""


@dataclass(frozen=True, slots=True)
class Candidacy:
    """A candidate as things stand.

    Attributes
    ----------
    name : str
    kind : {"class", "instance", "object"}
    accepted, best : float in [0, 1]
        Probability that it stands in, and that it is the most similar.
    """

    name: str
    kind: str
    accepted: float
    best: float


@dataclass(frozen=True, slots=True)
class Wish:
    """A measurement worth making.

    Attributes
    ----------
    thing : str
        The missing tool's class or a candidate.
    kind : {"tool", "class", "instance", "object"}
        Of a tool or a class another object is to be measured.
    property : str
    gain : float in (0, 1]
        Share of the doubt that it is expected to take away.
    known : int or float
        From how many objects of the class the property is known already; 0 of a single object.
    """

    thing: str
    kind: str
    property: str
    gain: float
    known: int | float


@dataclass(frozen=True, slots=True)
class Wishes:
    """What to measure, the most telling first.

    Attributes
    ----------
    missing, iri : str
    about : Doubt
    doubt : float >= 0
        As things stand: P (1 - P), summed over the candidates.
    settled : bool
        Whether every candidate is accepted or refused with a probability of `SURE` or more.
    candidates : tuple of Candidacy
    wishes : tuple of Wish
    """

    missing: str
    iri: str
    about: Doubt
    doubt: float
    settled: bool
    candidates: tuple[Candidacy, ...]
    wishes: tuple[Wish, ...]

    @property
    def most(self) -> float:
        """The most that can be in doubt: one half and one half for each candidate, or all alike."""
        n = len(self.candidates)
        return n / 4 if self.about is Doubt.ACCEPTED else 1 - 1 / n

    def to_json(self) -> dict[str, Any]:
        """Return it in JSON's types; the layout is stable."""
        return {
            "version": 3,
            "missing": self.missing,
            "iri": self.iri,
            "about": str(self.about),
            "doubt": round(self.doubt, 6),
            "settled": self.settled,
            "candidates": [
                {
                    "name": one.name,
                    "kind": one.kind,
                    "accepted": round(one.accepted, 6),
                    "best": round(one.best, 6),
                }
                for one in self.candidates
            ],
            "measure": [
                {
                    "thing": one.thing,
                    "kind": one.kind,
                    "property": one.property,
                    "gain": round(one.gain, 6),
                    "known": one.known,
                }
                for one in self.wishes
            ],
        }


def ask_for_more(
    kb: KnowledgeBase,
    missing: str,
    available: Sequence[str] | None = None,
    *,
    instances: Sequence[str] = (),
    held: Held | None = None,
    settings: ReasonerSettings | None = None,
    about: Doubt = Doubt.ACCEPTED,
    draws: int = DRAWS,
    seed: int = 0,
) -> Wishes:
    """Return which measurements would reduce the doubt about a decision most.

    Parameters
    ----------
    kb : KnowledgeBase
    missing, available, instances, settings
        As for `rank_substitutes`.
    held : sequence of str, or mapping of str to a degree in [0, 1], optional
        Instead of what is available, one object nobody named: the qualities it is known to hold so far,
        perhaps none; not graded, those of any degree. Asked are its relevant properties that are not
        known, and no others.
    about : Doubt
    draws, seed : int

    Raises
    ------
    UnknownNameError
        If the knowledge base does not know a name; the nearest is offered.
    InputError
        If things are named together with an unnamed object.
    """
    known = kb.view(load_knowledge)
    if held is None:
        ranking = rank_substitutes(kb, missing, available, instances=instances, settings=settings)
        question = replace(ranking.question, population=kb.view(load_population))
        found = outlook(question, draws, seed, about)
        things = [(one.name, one.kind) for one in ranking]
        return _wishes(known, ranking.question.tool, found, things, about)
    if available or instances:
        raise InputError("name things that are available, or what is known of one object, not both")
    tool = class_row(kb, known, missing)
    degrees, settings = held_degrees(known, held)[None], settings or USUAL
    question = Question(
        known,
        settings,
        tool,
        np.array([-1]),
        degrees if settings.graded else (degrees > 0).astype(np.float64),
        population=kb.view(load_population),
    )
    found = outlook(question, draws, seed, about)
    return _wishes(known, tool, found, [(UNNAMED, "object")], about)


def _wishes(
    known: Knowledge, tool: int, found: Outlook, things: Sequence[tuple[str, str]], about: Doubt
) -> Wishes:
    unnamed = things[0][1] == "object"
    asked = [one for one in found.measurements if one.clear and (one.candidate is not None or not unnamed)]
    return Wishes(
        known.classes.names[tool],
        known.classes.iris[tool],
        about,
        found.doubt,
        all(max(share, 1 - share) >= SURE for share in found.accepted),
        tuple(
            Candidacy(*thing, accepted, best)
            for thing, accepted, best in zip(things, found.accepted, found.best, strict=True)
        ),
        tuple(_wish(known, tool, one, things) for one in asked),
    )


def _wish(known: Knowledge, tool: int, one: Measurement, things: Sequence[tuple[str, str]]) -> Wish:
    name, kind = (known.classes.names[tool], "tool") if one.candidate is None else things[one.candidate]
    row = known.row_of_name[name] if kind in ("tool", "class") else None
    columns = [at for at, quality in enumerate(known.qualities) if quality.property == one.property]
    total = 0 if row is None else int(known.classes.totals[row, columns].max())
    return Wish(
        name, kind, one.property, one.gain, total // DEGREE if total % DEGREE == 0 else total / DEGREE
    )
