"""A second reasoner, written from the formulas of the paper with sets and fractions, to check the first.

It knows only tuples <concept, quality, count, total> and sets of names; it imports nothing of ERSATZ.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from math import floor
from typing import TypeAlias

Tuples: TypeAlias = Iterable[tuple[str, str, Fraction, Fraction]]
"""<concept, quality, how often, out of how many>: <O, t, m> or <f, p, d> with the degree as a quotient."""

Qualities: TypeAlias = frozenset[str]
Degrees: TypeAlias = Mapping[str, Fraction]

UNIT = 55440
"""Degrees are kept in units of 1 / UNIT, rounded half up."""


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
    graded: bool = False
    alpha: Fraction = Fraction(1)
    beta: Fraction = Fraction(1, 2)


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
    if options.graded:
        return reason_by_degrees(world, tool, candidates, held, options)
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


def rounded(value: Fraction) -> Fraction:
    return Fraction(floor(value * UNIT + Fraction(1, 2)), UNIT)


def ratio_of(a: Degrees, b: Degrees, alpha: Fraction, beta: Fraction) -> Fraction:
    """Tversky's ratio of graded sets; (1, 1) is Ruzicka, (1, 0) coverage."""
    zero = Fraction(0)
    pairs = [(a.get(q, zero), b.get(q, zero)) for q in a.keys() | b.keys()]
    both = sum((min(pair) for pair in pairs), zero)
    lacking = sum((max(x - y, zero) for x, y in pairs), zero)
    extra = sum((max(y - x, zero) for x, y in pairs), zero)
    whole = both + alpha * lacking + beta * extra
    return both / whole if whole else zero


def shares_of(world: World, of: Degrees, prop: str) -> list[Fraction]:
    """Cumulative shares of a property's qualities in order of rank; empty where it was not observed."""
    names = sorted(
        (q for q, p in world.property_of.items() if p == prop), key=lambda q: int(q.rpartition("_")[2])
    )
    whole = sum((of.get(q, Fraction(0)) for q in names), Fraction(0))
    found, sum_ = [], Fraction(0)
    for q in names:
        sum_ += of.get(q, Fraction(0))
        found.append(rounded(sum_ / whole) if whole else Fraction(0))
    return found if whole else []


def nearness(world: World, weights: Degrees, a: Degrees, b: Degrees) -> Fraction:
    """One minus the earth mover's distances of the properties, weighed; unknown of one is farthest."""
    apart = total = Fraction(0)
    for prop in set(world.property_of.values()):
        weight = sum((w for q, w in weights.items() if world.property_of[q] == prop), Fraction(0))
        mine, theirs = shares_of(world, a, prop), shares_of(world, b, prop)
        if not weight or not (mine or theirs):
            continue
        total += weight
        if not mine or not theirs:
            apart += weight
        elif len(mine) > 1:
            steps = sum((abs(x - y) for x, y in zip(mine, theirs, strict=True)), Fraction(0))
            apart += weight * steps / (len(mine) - 1)
    return 1 - apart / total if total else Fraction(0)


def reason_by_degrees(
    world: World, tool: str, candidates: Iterable[str], held: Mapping[str, Qualities], options: Options
) -> Result:
    """The same with degrees: weights for sets, ratios of sums for ratios of sizes, ranks for equality."""
    properties = options.properties
    used = {q for q, p in world.property_of.items() if properties is None or p in properties}
    body = used & world.physical

    def only(of: Degrees, qualities: Iterable[str]) -> dict[str, Fraction]:
        return {q: rounded(of[q]) for q in qualities if rounded(of.get(q, Fraction(0)))}

    raw = world.classes.get(tool, {})
    mine = only(raw, body)
    roles = only(raw, used - world.physical - (world.lowest if options.above_lowest else frozenset()))
    goes = {f: only(world.functions.get(f, {}), body) for f in roles}
    strength = {}
    for f, degree in roles.items():
        likeness = ratio_of(mine, goes[f], Fraction(1), Fraction(1))
        if likeness > options.relevance_phi and rounded(degree * likeness):
            strength[f] = rounded(degree * likeness)
    most = max(strength.values(), default=Fraction(0))
    weights = {
        q: weight
        for q in mine
        if (
            weight := max(
                (rounded(r * min(mine[q], goes[f].get(q, Fraction(0))) / most) for f, r in strength.items()),
                default=Fraction(0),
            )
        )
    }
    if not strength and options.fallback:
        weights = mine
    theirs: dict[str, Degrees] = {c: world.classes.get(c, {}) for c in candidates if c != tool}
    theirs |= {i: dict.fromkeys(holds, Fraction(1)) for i, holds in held.items()}
    ratios = {
        "ruzicka": (Fraction(1), Fraction(1)),
        "coverage": (Fraction(1), Fraction(0)),
        "tversky": (options.alpha, options.beta),
    }
    scores = {
        name: nearness(world, weights, raw, of)
        if options.similarity == "ordinal"
        else ratio_of(weights, only(of, body), *ratios[options.similarity])
        for name, of in theirs.items()
    }
    determined = bool(strength) or options.fallback
    return Result(
        determined,
        frozenset(strength),
        frozenset(weights),
        scores,
        {name: determined and score > options.phi for name, score in scores.items()},
    )
