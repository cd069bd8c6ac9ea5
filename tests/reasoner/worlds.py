"""Knowledge bases for the reasoner's tests, random and read, beside what the reference knows of them."""

from collections import defaultdict
from fractions import Fraction

from hypothesis import strategies as st

from ersatz.knowledge.base import KnowledgeBase
from ersatz.measurements import Kind
from tests.making import Held, held_kb, prop
from tests.reasoner.reference import Options, Qualities, World, degrees

PROPERTIES = (
    prop("alpha", adjective="alphic"),
    prop("beta"),
    prop("gamma"),
    prop("hold", "functional"),
    prop("use", "functional"),
)
PHYSICAL = tuple(p.name for p in PROPERTIES if p.kind is Kind.PHYSICAL)
CLASSES = ("bowl", "coffee mug", "plate", "tray")
RANKS = 3


def make(held: Held) -> KnowledgeBase:
    return held_kb(held, PROPERTIES, RANKS)


@st.composite
def helds(draw: st.DrawFn) -> Held:
    """Draw who holds what; few instances, so that shares like 1/2 and 1/3 are met often."""
    number = draw(st.integers(2, 10))
    found: dict[str, tuple[str, dict[str, int]]] = {}
    for at in range(number):
        label = CLASSES[at] if at < 2 else draw(st.sampled_from(CLASSES))
        ranks = draw(
            st.fixed_dictionaries({p.name: st.integers(0, RANKS) for p in PROPERTIES}).map(
                lambda found: {name: rank for name, rank in found.items() if rank}
            )
        )
        found[f"thing {at}"] = (label, ranks or {"alpha": 1})
    return found


THRESHOLDS = st.sampled_from(
    [Fraction(n, d) for d in (1, 2, 3, 4, 5, 6, 7, 20) for n in range(d + 1) if d < 20 or n == 7]
)


@st.composite
def options(draw: st.DrawFn) -> Options:
    names = [p.name for p in PROPERTIES]
    return Options(
        draw(THRESHOLDS.filter(bool)),
        draw(THRESHOLDS),
        draw(THRESHOLDS),
        draw(st.sampled_from(["union", "intersection"])),
        draw(st.sampled_from(["jaccard", "coverage", "tversky"])),
        draw(st.booleans()),
        draw(st.booleans()),
        draw(st.none() | st.frozensets(st.sampled_from(names))),
    )


@st.composite
def graded_options(draw: st.DrawFn) -> Options:
    names = [p.name for p in PROPERTIES]
    form = draw(st.sampled_from(["ruzicka", "ordinal", "coverage", "tversky"]))
    weights = st.sampled_from([Fraction(0), Fraction(1, 3), Fraction(1, 2), Fraction(1), Fraction(2)])
    chosen = (draw(weights), draw(weights)) if form == "tversky" else (Fraction(1), Fraction(1, 2))
    return Options(
        phi=draw(THRESHOLDS),
        relevance_phi=draw(st.just(Fraction(0)) | THRESHOLDS),
        similarity=form,
        above_lowest=draw(st.booleans()),
        fallback=draw(st.booleans()),
        properties=draw(st.none() | st.frozensets(st.sampled_from(names))),
        graded=True,
        alpha=chosen[0],
        beta=chosen[1],
    )


def world_of_held(held: Held) -> World:
    """Count in plain Python what `make` grounds: m and d as quotients of whole numbers."""
    class_counts: dict[tuple[str, str], int] = defaultdict(int)
    class_totals: dict[tuple[str, str], int] = defaultdict(int)
    counts: dict[tuple[str, str], int] = defaultdict(int)
    totals: dict[tuple[str, str], int] = defaultdict(int)
    for label, ranks in held.values():
        for name, rank in ranks.items():
            class_counts[label, f"{name}_{rank}"] += 1
            class_totals[label, name] += 1
        for f in ("hold", "use"):
            for name in PHYSICAL:
                if f in ranks and name in ranks:
                    counts[f"{f}_{ranks[f]}", f"{name}_{ranks[name]}"] += 1
                    totals[f"{f}_{ranks[f]}", name] += 1
    property_of = {f"{p.name}_{k}": p.name for p in PROPERTIES for k in range(1, RANKS + 1)}
    return World(
        degrees(
            (c, q, Fraction(n), Fraction(class_totals[c, property_of[q]]))
            for (c, q), n in class_counts.items()
        ),
        degrees((f, q, Fraction(n), Fraction(totals[f, property_of[q]])) for (f, q), n in counts.items()),
        property_of,
        frozenset(q for q, name in property_of.items() if name in PHYSICAL),
        frozenset(q for q in property_of if q.endswith("_1")),
    )


def held_by(held: Held) -> dict[str, Qualities]:
    return {i: frozenset(f"{p}_{k}" for p, k in ranks.items()) for i, (_, ranks) in held.items()}


def world_of_kb(kb: KnowledgeBase) -> World:
    """Read the tuples from the triples themselves."""
    name = {str(row["class"]): str(row["name"]) for row in kb.ask("classes")}

    def local(iri: object) -> str:
        return str(iri).rpartition("#")[2]

    def number(value: object) -> Fraction:
        return Fraction(str(value))

    qualities = kb.query(
        "PREFIX e: <https://w3id.org/ersatz#> SELECT ?q ?p ?kind ?rank WHERE { "
        "?q e:qualityOf ?p ; e:rank ?rank ; a ?kind "
        "VALUES ?kind { e:PhysicalQuality e:FunctionalQuality } }"
    )
    return World(
        degrees(
            (name[str(r["class"])], local(r["quality"]), number(r["count"]), number(r["total"]))
            for r in kb.ask("memberships")
        ),
        degrees(
            (local(r["function"]), local(r["quality"]), number(r["count"]), number(r["total"]))
            for r in kb.ask("function_models")
        ),
        {local(r["q"]): local(r["p"]) for r in qualities},
        frozenset(local(r["q"]) for r in qualities if local(r["kind"]) == "PhysicalQuality"),
        frozenset(local(r["q"]) for r in qualities if r["rank"] == 1),
    )
