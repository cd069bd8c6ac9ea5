"""Classes: all of them, and what is known of each."""

from dataclasses import dataclass
from fractions import Fraction
from itertools import groupby
from typing import Final

from nicegui import ui

from ersatz.errors import ErsatzError
from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.models import ClassModel, Entry
from ersatz.knowledge.names import local_name
from ersatz.knowledge.queries import exact
from ersatz.knowledge.terms import degree_text
from ersatz.knowledge.vocabulary import KB, OBJECT
from ersatz.measurements import Kind
from ersatz.reasoner.relevance import ReasonerSettings
from ersatz.reasoner.representative import class_model
from ersatz.reasoner.substitution import Ranking, rank_substitutes
from ersatz.service.pages.data import ontology_of, overview, shipped_mappings, superclasses
from ersatz.service.pages.frame import PATIENCE, card, frame, heading, notice, show, table, title_line
from ersatz.service.pages.markup import (
    Markup,
    bar,
    chip,
    chips,
    faint,
    joined,
    link,
    link_to,
    page_of,
    shown,
    tag,
    words_of,
)
from ersatz.service.pages.tree import draw_tree
from ersatz.service.service import Service

MOST: Final = 200
"""Things of a list that are drawn."""


def add(service: Service) -> None:
    """Add the pages."""

    @ui.page("/classes", response_timeout=PATIENCE)
    async def classes() -> None:
        seen = await service.read(lambda: overview(service.kb))
        with frame(service, "Classes", "/classes"), ui.element("div").classes("split"):
            draw_tree(service.kb)
            with ui.element("div"):
                heading(
                    "Classes",
                    "A class is known by what its individuals were observed to be: each opens to its "
                    "qualities, with the counts behind them.",
                )
                show(joined(_tile(service, *one) for one in seen.classes[:MOST]), "tiles")
                if len(seen.classes) > MOST:
                    notice(f"{len(seen.classes) - MOST} more: type into the search to find them.")

    @ui.page("/classes/{name}", response_timeout=PATIENCE)
    async def one(name: str, theta: str = "") -> None:
        try:
            threshold = exact(theta or service.kb.build.theta)
            found = await service.read(lambda: _read(service.kb, KB + name, threshold))
        except (ErsatzError, ValueError, KeyError) as error:
            with frame(service, "Unknown class", "/classes"):
                notice(str(error), bad=True)
            return
        with frame(service, found.model.name, "/classes"), ui.element("div").classes("split"):
            draw_tree(service.kb, found.model.iri)
            with ui.element("div"):
                _class(service, found, threshold)


def _tile(service: Service, iri: str, name: str, count: int) -> Markup:
    known = tag("div", f"known from {count} {service.kb.build.unit}{'s' * (count != 1)}", class_="faint")
    return link(joined((tag("strong", name), known)), page_of("class", iri), class_="tile")


@dataclass(frozen=True, slots=True)
class _Found:
    """What a class page shows.

    Attributes
    ----------
    model : ClassModel
    instances : tuple of (IRI, name)
    parents : tuple of IRIs
    mappings : tuple of (predicate, other thing, where it comes from)
    use : Ranking, or why there is none
    """

    model: ClassModel
    instances: tuple[tuple[str, str], ...]
    parents: tuple[str, ...]
    mappings: tuple[tuple[str, str, str], ...]
    use: Ranking | str


def _read(kb: KnowledgeBase, name: str, theta: Fraction) -> _Found:
    iri = kb.resolve(name, "class")
    rows = kb.ask("instances", **{"class": iri}).rows
    return _Found(
        class_model(kb, iri),
        tuple((str(i), str(n)) for i, n in rows),
        tuple(superclasses(kb).get(iri, ())),
        _mappings(kb, iri),
        _use(kb, iri, theta),
    )


def _mappings(kb: KnowledgeBase, iri: str) -> tuple[tuple[str, str, str], ...]:
    """Return the mappings in the knowledge base, then those ERSATZ ships."""
    rows = kb.query(
        f"SELECT DISTINCT ?p ?o {{ <{iri}> ?p ?o FILTER (ISIRI(?o) && (STRENDS(STR(?p), 'Match') "
        "|| STRENDS(STR(?p), 'equivalentClass'))) } ORDER BY ?p ?o"
    ).rows
    own = [(str(p), str(o), "this knowledge base") for p, o in rows]
    held = {(p, o) for p, o, _ in own}
    return (*own, *(one for one in shipped_mappings().get(iri, ()) if one[:2] not in held))


def _use(kb: KnowledgeBase, iri: str, theta: Fraction) -> Ranking | str:
    try:
        return rank_substitutes(kb, iri, settings=ReasonerSettings(representative=theta), top=5)
    except ErsatzError as error:
        return str(error)


def _class(service: Service, found: _Found, theta: Fraction) -> None:
    model = found.model
    find = link("Find a substitute", link_to("/substitution", missing=model.name), class_="button")
    title_line(model.name, model.iri, find)
    unit = f"{service.kb.build.unit}{'s' * (model.instances != 1)}"
    show(tag("p", f"Known from {model.instances} {unit}.", class_="lead"))
    with card("What it is like"):
        slider, says, drawn = _slider(theta), show(Markup(), "soft"), show(Markup())
    with ui.element("div").classes("two"):
        with card("What it is for"):
            use = show(_drawn_use(found.use))
        with card("Where it stands"):
            show(_standing(found))
    with card("The same in other ontologies"):
        _draw_mappings(found.mappings)
    with card(f"Individuals ({len(found.instances)})"):
        more = len(found.instances) - MOST
        marks = [chip(name, page_of("instance", iri)) for iri, name in found.instances[:MOST]]
        all_of_them = chip(f"and {more} more", link_to("/individuals", search=model.name), "info")
        show(chips([*marks, *([all_of_them] if more > 0 else [])], "It holds classes only."))

    def mark() -> None:
        now = Fraction(str(slider.value))
        typical = sum(entry.proportion >= now for entry in model.entries)
        says.content = tag("span", f"θ = {float(now):.2f}: {typical} of {len(model.entries)} qualities")
        drawn.content = _memberships(model.entries, now)

    async def slid() -> None:
        mark()
        now = Fraction(str(slider.value))
        use.content = _drawn_use(await service.read(lambda: _use(service.kb, model.iri, now)))

    mark()
    slider.on_value_change(slid)


def _slider(theta: Fraction) -> ui.slider:
    with ui.element("div").classes("line"):
        show(tag("span", "Representative from"), "soft")
        slider = ui.slider(min=0.05, max=1, step=0.05, value=float(theta)).classes("grow")
        return slider.props('label debounce=100 aria-label="Threshold theta" color=teal-8')


def _memberships(entries: tuple[Entry, ...], theta: Fraction) -> Markup:
    """Return bars of all memberships; those that are representative stand out."""
    parts = []
    for kind, title in ((Kind.PHYSICAL, "Physical"), (Kind.FUNCTIONAL, "Functional")):
        own = [entry for entry in entries if entry.kind is kind]
        rows = (
            _membership(entry, theta, first=at == 0)
            for _, group in groupby(own, key=lambda entry: entry.property)
            for at, entry in enumerate(group)
        )
        parts += [faint(title), tag("div", *rows, class_="bars")]
    return joined(parts)


def _membership(entry: Entry, theta: Fraction, *, first: bool) -> Markup:
    of = link(words_of(entry.property), page_of("property", KB + entry.property)) if first else ""
    return joined(
        (
            tag("div", of, class_="name"),
            link(words_of(entry.quality), page_of("quality", KB + entry.quality)),
            bar(
                float(entry.proportion),
                typical=entry.proportion >= theta,
                functional=entry.kind is Kind.FUNCTIONAL,
            ),
            tag("span", f"{degree_text(entry.count)} of {degree_text(entry.total)}", class_="of"),
        )
    )


def _drawn_use(use: Ranking | str) -> Markup:
    if isinstance(use, str):
        return tag("div", use, class_="soft")
    functional = (chip(words_of(q), page_of("quality", KB + q), "info") for q in use.relevant_functional)
    physical = (chip(words_of(q), page_of("quality", KB + q), "good") for q in use.relevant_physical)
    nearest = (
        chip(f"{one.name} {one.similarity:.2f}", page_of("class", one.iri), "good" * one.accepted)
        for one in use
    )
    nothing = "None: it cannot be said what would stand in for it."
    rows = (
        ("Functions relevant in it", chips(functional, nothing)),
        ("Qualities they rest on", chips(physical, "none")),
        ("Nearest stand-ins, by Jaccard index", chips(nearest, "none")),
    )
    return joined(part for title, row in rows for part in (faint(title), row))


def _standing(found: _Found) -> Markup:
    name = local_name(found.model.iri)
    above = (chip(shown(one), page_of("class", one) if one.startswith(KB) else "")
             for one in found.parents or (OBJECT.value,))  # fmt: skip
    more = (chip("its neighbourhood", link_to("/graph", node=name)), chip("as Turtle", f"/kb/{name}"))
    return joined((faint("Superclasses"), chips(above), faint("More"), chips(more)))


def _draw_mappings(rows: tuple[tuple[str, str, str], ...]) -> None:
    if not rows:
        show(tag("div", "No mapping of this class is known.", class_="soft"))
        return
    heads = ("ontology", "relation", "term", "where it comes from")
    table(heads, ((ontology_of(o), local_name(p), link(shown(o), o), source) for p, o, source in rows))
    show(tag("div", "`ersatz link` merges the knowledge base with such an ontology.", class_="faint"))
