"""Grounding again: from the measurements a knowledge base holds, with other settings or other objects."""

import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from ersatz.errors import InputError
from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.names import local_name
from ersatz.knowledge.reader import read_qualities
from ersatz.measurements import Block, Origin, Property, Source

Grounder: TypeAlias = Callable[[Sequence[Block], int, int], KnowledgeBase]
"""Grounds blocks of measurements with so many qualities a property and a seed: the caller has the "
"pipeline."""


@dataclass(frozen=True, slots=True)
class Value:
    """One measured value as the knowledge base holds it."""

    object_class: str
    instance: str
    property: str
    observation: str
    origin: Origin
    vector: tuple[float, ...]


def read_values(kb: KnowledgeBase) -> tuple[list[Value], dict[str, Property]]:
    """Return all measured values, and the properties by name.

    Raises
    ------
    InputError
        If the knowledge base holds classes only.
    """
    properties = {one.property.name: one.property for one in read_qualities(kb)}
    found: list[Value] = []
    for name in kb.known_names("class"):
        for instance in kb.ask("instances", **{"class": name}):
            vectors: dict[tuple[str, str, str], dict[int, float]] = {}
            for row in kb.ask("instance_measurements", instance=str(instance["instance"])):
                key = local_name(str(row["property"])), str(row["observation"] or ""), str(row["origin"])
                place = int(str(row["position"])) if row["position"] is not None else 0
                vectors.setdefault(key, {})[place] = float(str(row["value"]))
            found += [
                Value(
                    name,
                    str(instance["name"]),
                    of,
                    observation,
                    Origin(local_name(origin)),
                    tuple(vector[at] for at in sorted(vector)),
                )
                for (of, observation, origin), vector in vectors.items()
            ]
    if not found:
        raise InputError("the knowledge base holds classes only: it cannot be grounded again")
    return found, properties


def to_blocks(values: Sequence[Value], properties: dict[str, Property]) -> list[Block]:
    """Return values as blocks, one a property and origin."""
    groups: dict[tuple[str, Origin], list[Value]] = {}
    for value in values:
        groups.setdefault((value.property, value.origin), []).append(value)
    return [
        Block(
            properties[name],
            [v.object_class for v in group],
            [v.instance for v in group],
            [v.observation for v in group],
            np.array([v.vector for v in group], dtype=np.float64),
            origin,
            Source("the knowledge base evaluated"),
        )
        for (name, origin), group in sorted(groups.items())
    ]


def resampled(values: Sequence[Value], seed: int) -> list[Value]:
    """Return values of as many objects of each class, drawn with replacement; never single observations."""
    of_class: dict[str, dict[str, list[Value]]] = {}
    for value in values:
        of_class.setdefault(value.object_class, {}).setdefault(value.instance, []).append(value)
    chance = random.Random(f"objects {seed}")
    found: list[Value] = []
    for name in sorted(of_class):
        objects = sorted(of_class[name])
        for at, instance in enumerate(chance.choices(objects, k=len(objects)), 1):
            found += [
                Value(v.object_class, f"{name} draw {at}", v.property, v.observation, v.origin, v.vector)
                for v in of_class[name][instance]
            ]
    return found
