"""Rankings: what counts, and each candidate with its similarity, its reasons and its evidence."""

from typing import Final

from ersatz.knowledge.vocabulary import KB
from ersatz.reasoner.confidence import MASS
from ersatz.reasoner.explanation import VISIBLE, Evidence
from ersatz.reasoner.substitution import Ranking, Substitute
from ersatz.service.pages.markup import (
    Markup,
    bar,
    bars,
    chip,
    chips,
    faint,
    joined,
    link,
    page_of,
    tag,
    words_of,
)

MOST: Final = 30
"""Candidates that are drawn."""

_MARKS: Final = {"good": ("✓", "shared"), "bad": ("✗", "lacking"), "much": ("+", "extra")}


def counted(ranking: Ranking) -> Markup:
    """Return what the missing tool is for, and what counts; by degrees, how much."""
    parts = _weights(ranking) if ranking.settings.graded else _sets(ranking)
    if ranking.reused:
        parts.append(faint("Remembered from an earlier question."))
    return joined(parts)


def _sets(ranking: Ranking) -> list[Markup]:
    """Return the relevant functions and qualities."""
    parts = []
    for title, names, sort in (
        ("What it is for", ranking.relevant_functional, "info"),
        ("What counts", ranking.relevant_physical, "good"),
    ):
        marks = (chip(words_of(name), page_of("quality", KB + name), sort) for name in names)
        parts += [faint(title), chips(marks, "nothing")]
    return parts


def _weights(ranking: Ranking) -> list[Markup]:
    """Return how relevant functions and properties are; without those that would read 0.00."""
    functions = ranking.weights()["functions"].items()
    properties = ((one.property, one.weight) for one in ranking.property_weights)
    return [
        part
        for title, kind, weights in (
            ("What it is for", "quality", functions),
            ("What counts", "property", properties),
        )
        for part in (
            faint(title),
            bars(
                (
                    link(words_of(name), page_of(kind, KB + name)),
                    bar(weight, typical=True, functional=kind == "quality"),
                    f"{weight:.2f}",
                )
                for name, weight in weights
                if weight >= VISIBLE
            ),
        )
    ]


def answers(ranking: Ranking) -> Markup:
    """Return the best candidates; their counterfactuals are searched for, which takes time."""
    return joined(_candidate(one, float(ranking.settings.tolerance)) for one in ranking[:MOST])


def as_text(ranking: Ranking) -> str:
    """Return a ranking as lines of cells, for the clipboard."""
    rows = ["name\tsimilarity\taccepted"]
    rows += [f"{one.name}\t{one.similarity:.6f}\t{one.accepted}" for one in ranking[:1000]]
    return "\n".join(rows)


def _candidate(one: Substitute, tolerance: float) -> Markup:
    flags = (chip(flag.replace("_", " "), sort="bad") for flag in one.flags)
    who = link(one.name, page_of(one.kind, one.iri), class_="who")
    head = (
        tag("span", "✓" if one.accepted else "–", class_="mark yes" if one.accepted else "mark no"),
        tag("div", who, *flags, *_sure(one), class_="line"),
        bar(one.similarity, typical=one.accepted, mark=tolerance),
        tag("span", f"{one.similarity:.2f}", class_="value", title=f"exactly {one.fraction}, dimensionless"),
    )
    words = tag("p", one.explain().partition(": ")[2])
    parts = _aspects(one) if one.aspects else _qualities(one)
    return tag("article", tag("div", *head, class_="rank"), words, parts, class_="answer")


def _sure(one: Substitute) -> tuple[Markup, ...]:
    """Return how sure the answer is, where it was asked."""
    if one.confidence is None:
        return ()
    sure = one.confidence
    chance = f"P(accepted) {sure.accepted:.2f}"
    spread = f"similarity {sure.low:.2f} to {sure.high:.2f}"
    return (
        chip(chance, sort="info", title=sure.words()),
        chip(spread, sort="much", title=f"with probability {MASS}, from {sure.draws} draws"),
    )


def _qualities(one: Substitute) -> Markup:
    sorts = (("good", one.shared), ("bad", one.lacking), ("much", one.extra))
    return chips(_evidence(found, sort) for sort, all_of_it in sorts for found in all_of_it)


def _aspects(one: Substitute) -> Markup:
    """Return the properties of a graded comparison: how alike the two are, and how much it counts."""
    return bars(
        (
            link(words_of(aspect.property), page_of("property", KB + aspect.property)),
            bar(float(aspect.likeness), typical=aspect.observed),
            f"{float(aspect.likeness):.2f} alike, counts {float(aspect.weight):.0%}",
        )
        for aspect in one.aspects
        if aspect.weight > 0
    )


def _evidence(evidence: Evidence, sort: str) -> Markup:
    mark, meaning = _MARKS[sort]
    times, out_of = evidence.to_json()["observed"]
    words = f"{mark} {words_of(evidence.quality)}"
    return chip(
        words, page_of("quality", KB + evidence.quality), sort, f"{meaning}: {times} of {out_of} observed"
    )
