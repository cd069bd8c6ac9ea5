"""A second reasoner, written from the formulas of the paper with sets and fractions, to check the first.

It knows only tuples <concept, quality, count, total> and sets of names; it imports nothing of ERSATZ.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import TypeAlias

Tuples: TypeAlias = Iterable[tuple[str, str, Fraction, Fraction]]
"""<concept, quality, how often, out of how many>: <O, t, m> or <f, p, d> with the degree as a quotient."""

Qualities: TypeAlias = frozenset[str]


@dataclass(frozen=True)
class World:
    """What is known: both sorts of tuples, and of each quality its property, kind and rank."""

    classes: Mapping[str, Mapping[str, Fraction]]
    functions: Mapping[str, Mapping[str, Fraction]]
    property_of: Mapping[str, str]
    physical: Qualities
    lowest: Qualities


@dataclass(frozen=True)
class Options:
    theta: Fraction = Fraction(35, 100)
    phi: Fraction = Fraction(35, 100)
    relevance_phi: Fraction = Fraction(35, 100)
    combine: str = "union"
    similarity: str = "jaccard"
    above_lowest: bool = False
    fallback: bool = False
    properties: frozenset[str] | None = None


@dataclass(frozen=True)
class Result:
    determined: bool
    functional: Qualities
    physical: Qualities
    similarity: Mapping[str, Fraction]
    accepted: Mapping[str, bool]


def degrees(tuples: Tuples) -> dict[str, dict[str, Fraction]]:
    """Return concept -> quality -> degree, without those never observed."""
    found: dict[str, dict[str, Fraction]] = {}
    for concept, quality, count, total in tuples:
        if count > 0:
            found.setdefault(concept, {})[quality] = Fraction(count) / Fraction(total)
    return found


def jaccard(a: Qualities, b: Qualities) -> Fraction:
    """J = |A n B| / |A u B|; J of two empty sets is 0."""
    return Fraction(len(a & b), len(a | b)) if a | b else Fraction(0)


def similar(a: Qualities, b: Qualities, form: str) -> Fraction:
    """Compare relevant qualities a with a candidate's b."""
    if form == "jaccard":
        return jaccard(a, b)
    if form == "coverage":
        return Fraction(len(a & b), len(a)) if a else Fraction(0)
    assert form == "tversky"
    weighed = len(a & b) + len(a - b) + Fraction(len(b - a), 2)
    return Fraction(len(a & b)) / weighed if weighed else Fraction(0)


def typical(of: Mapping[str, Fraction], theta: Fraction) -> Qualities:
    """O_rp and O_rf together, or f_rp: what is observed in at least theta."""
    return frozenset(quality for quality, degree in of.items() if degree >= theta)


def reason(
    world: World, tool: str, candidates: Iterable[str], held: Mapping[str, Qualities], options: Options
) -> Result:
    """Judge candidate classes, and instances by what they hold."""
    used = frozenset(
        quality
        for quality, prop in world.property_of.items()
        if options.properties is None or prop in options.properties
    )
    body = used & world.physical
    mine = typical(world.classes.get(tool, {}), options.theta) & used
    o_rp, o_rf = mine & body, mine - world.physical
    if options.above_lowest:
        o_rf -= world.lowest
    f_rp = {f: typical(world.functions.get(f, {}), options.theta) & body for f in o_rf}
    functional = frozenset(f for f in o_rf if jaccard(o_rp, f_rp[f]) > options.relevance_phi)
    shares = [o_rp & f_rp[f] for f in functional]
    if not shares:
        physical = o_rp if options.fallback else frozenset()
    elif options.combine == "union":
        physical = frozenset().union(*shares)
    else:
        physical = frozenset.intersection(*shares)
    determined = bool(functional) or options.fallback
    theirs = {c: typical(world.classes.get(c, {}), options.theta) & body for c in candidates if c != tool}
    theirs |= {i: holds & body for i, holds in held.items()}
    scores = {c: similar(physical, b, options.similarity) for c, b in theirs.items()}
    return Result(
        determined,
        functional,
        physical,
        scores,
        {c: determined and score > options.phi for c, score in scores.items()},
    )
