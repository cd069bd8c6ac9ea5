"""All methods by name: ERSATZ, its variants, its rivals."""

from collections.abc import Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Final

from ersatz.errors import ErsatzError, UnknownNameError
from ersatz.evaluation.methods import Context, Entrant, Method, ersatz_with, expected_with, papers_properties
from ersatz.evaluation.rivals import distance, simple, tables, wordnet
from ersatz.reasoner.relevance import Combine
from ersatz.reasoner.similarity import GRADED, Similarity

ENTRANTS: Final = tuple(
    Entrant(name, label, make)
    for name, label, make in (
        ("ersatz", "ERSATZ (the paper's settings)", ersatz_with()),
        ("fallback", "ERSATZ, all that is typical if no function is relevant", ersatz_with(fallback=True)),
        ("paper-properties", "ERSATZ, the paper's properties only", papers_properties),
        ("intersection", "ERSATZ, intersection of functions", ersatz_with(combine=Combine.INTERSECTION)),
        ("coverage", "ERSATZ, coverage", ersatz_with(similarity=Similarity.COVERAGE)),
        ("tversky", "ERSATZ, Tversky", ersatz_with(similarity=Similarity.TVERSKY)),
        ("above-lowest", "ERSATZ, no lowest qualities as functions", ersatz_with(above_lowest=True)),
        (
            "no-relevance",
            "ERSATZ without relevance",
            ersatz_with(relevance_tolerance=1, fallback=True),
        ),
        ("certainty", "ERSATZ, typical if P(m ≥ θ) ≥ 0.5", ersatz_with(certainty=Fraction(1, 2))),
        ("confidence", "ERSATZ, by expected similarity, P(accepted) ≥ 0.5", expected_with()),
        ("graded", "ERSATZ, graded (ordinal)", ersatz_with(graded=True)),
        (
            "graded-confidence",
            "ERSATZ, graded (ordinal), by expected similarity, P(accepted) ≥ 0.5",
            expected_with(graded=True),
        ),
        (
            "graded-no-relevance",
            "ERSATZ, graded (ordinal) without relevance",
            ersatz_with(graded=True, relevance_tolerance=1, fallback=True),
        ),
        *(
            (f"graded-{form}", f"ERSATZ, graded ({form})", ersatz_with(graded=True, similarity=form))
            for form in GRADED
            if form is not Similarity.ORDINAL
        ),
        ("chance", "Chance", simple.chance),
        ("most-popular", "Most popular", simple.most_popular),
        ("heaviest", "Heaviest", simple.heaviest),
        ("box-size", "Nearest box", distance.box_size),
        ("feature-distance", "Nearest in raw features", distance.feature_distance),
        ("shape-concepts", "Nearest in shape concepts", distance.shape_concepts),
        ("parts", "Proportions and mass (after Abelha 2016)", distance.parts_and_mass),
        ("wordnet", "WordNet similarity (Wu-Palmer)", wordnet.wu_palmer),
        ("inheritance", "WordNet inheritance (after Awaad 2014)", wordnet.inheritance),
        ("relations", "Shared relations (after Boteanu 2016)", tables.shared_relations),
        ("affordances", "Affordance overlap (after Agostini 2015)", tables.affordance_overlap),
    )
)
"""In the order of tables and figures; the first is what the others are compared with."""

OURS: Final = frozenset(entrant.name for entrant in ENTRANTS if entrant.label.startswith("ERSATZ"))
"""ERSATZ, its variants and its ablation; the others are rivals."""


def select(baselines: Sequence[str]) -> tuple[tuple[Entrant, ...], dict[str, Path]]:
    """Return the entrants asked for, ERSATZ always among them, and the files given as NAME=FILE.

    With no names, or only names with files, all take part.

    Raises
    ------
    UnknownNameError
        If a name is none of them.
    """
    known = [entrant.name for entrant in ENTRANTS]
    sources: dict[str, Path] = {}
    wanted = {"ersatz"}
    for one in baselines:
        name, equals, file = one.partition("=")
        if name not in known:
            raise UnknownNameError("baseline", name, known)
        if equals:
            sources[name] = Path(file)
        wanted.add(name)
    everyone = all("=" in one for one in baselines)
    return tuple(e for e in ENTRANTS if everyone or e.name in wanted), sources


def assemble(
    entrants: Sequence[Entrant], context: Context
) -> tuple[dict[Entrant, Method], Mapping[str, str]]:
    """Make the methods; return them and, for those that cannot take part, the reason."""
    methods: dict[Entrant, Method] = {}
    left_out: dict[str, str] = {}
    for entrant in entrants:
        try:
            methods[entrant] = entrant.make(context)
        except ErsatzError as error:
            left_out[entrant.name] = str(error)
    return methods, left_out
