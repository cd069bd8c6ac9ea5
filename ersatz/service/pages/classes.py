"""Classes: the tree of them, and what is known of each."""

from fractions import Fraction
from itertools import groupby
from typing import Any

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
from ersatz.reasoner.substitution import rank_substitutes
from ersatz.service.pages.data import overview, superclasses
from ersatz.service.pages.frame import (
    PATIENCE,
    bar,
    card,
    chip,
    chips,
    copyable,
    frame,
    heading,
    link_to,
    notice,
    page_of,
    text,
    words_of,
)
from ersatz.service.service import Service

MOST = 200
"""Lines of a list that are drawn; typing narrows it."""


def add(service: Service) -> None:
    """Add the pages."""

    @ui.page("/classes", response_timeout=PATIENCE)
    async def classes() -> None:
        seen = await service.read(lambda: overview(service.kb))
        parents = await service.read(lambda: superclasses(service.kb))
        with frame(service, "Classes", "/classes"), ui.element("div").classes("split"):
            tree(seen.classes, parents)
            with ui.element("div"):
                heading(
                    "Classes",
                    "A class is known by what its individuals were observed to be: each opens to its "
                    "qualities, with the counts behind them.",
                )
                with ui.element("div").classes("tiles"):
                    for iri, name, count in seen.classes[:MOST]:
                        with ui.link(target=page_of("class", iri)).classes("tile"):
                            text(name, "strong")
                            ui.label(f"known from {count} {service.kb.build.unit}s").classes("faint")
                if len(seen.classes) > MOST:
                    notice(f"{len(seen.classes) - MOST} more: type into the search to find them.")

    @ui.page("/classes/{name}", response_timeout=PATIENCE)
    async def one(name: str, theta: str = "") -> None:
        try:
            found = await service.read(lambda: _read(service.kb, KB + name))
            threshold = exact(theta or service.kb.build.theta)
        except (ErsatzError, ValueError, KeyError) as error:
            with frame(service, "Unknown class", "/classes"):
                notice(str(error), bad=True)
            return
        seen = await service.read(lambda: overview(service.kb))
        parents = await service.read(lambda: superclasses(service.kb))
        with frame(service, found.model.name, "/classes"), ui.element("div").classes("split"):
            tree(seen.classes, parents, found.model.iri)
            with ui.element("div"):
                await _class(service, found, parents.get(found.model.iri, []), threshold)


def tree(classes: tuple[tuple[str, str, int], ...], parents: dict[str, list[str]], here: str = "") -> None:
    """Draw the tree of classes with a search above it; only the first ones of a long list."""
    order = _nested(classes, parents)
    with ui.element("nav").classes("card side").props('aria-label="Classes"'):
        search = ui.input(placeholder="Search classes").props(
            'dense outlined clearable debounce=150 aria-label="Search classes"'
        )
        with ui.element("div").classes("items") as items:
            _lines(order, here, "")

        def narrow() -> None:
            items.clear()
            with items:
                _lines(order, here, str(search.value or ""))

        search.on_value_change(narrow)


def _nested(
    classes: tuple[tuple[str, str, int], ...], parents: dict[str, list[str]]
) -> list[tuple[int, str, str, int]]:
    """Return (depth, IRI, name, count) in the order of the tree; a class with two parents stands twice."""
    known = {iri: (iri, name, count) for iri, name, count in classes}
    below: dict[str, list[str]] = {}
    for iri, _, _ in classes:
        above = [one for one in parents.get(iri, []) if one in known and one != iri] or [OBJECT.value]
        for one in above:
            below.setdefault(one, []).append(iri)
    order: list[tuple[int, str, str, int]] = []
    stack = [(0, iri, frozenset[str]()) for iri in reversed(below.get(OBJECT.value, []))]
    while stack:
        depth, iri, path = stack.pop()
        order.append((depth, *known[iri]))
        stack.extend(
            (depth + 1, child, path | {iri})
            for child in reversed(below.get(iri, []))
            if child not in path | {iri}
        )
    return order


def _lines(order: list[tuple[int, str, str, int]], here: str, wanted: str) -> None:
    words = wanted.casefold().split()
    fitting = [line for line in order if all(word in line[2].casefold() for word in words)]
    at = next((at for at, line in enumerate(fitting) if line[1] == here), 0)
    first = max(0, min(at - MOST // 2, len(fitting) - MOST))
    if not words:
        with ui.element("div").classes("faint"):
            ui.label("Object")
    for depth, iri, name, count in fitting[first : first + MOST]:
        link = ui.link(target=page_of("class", iri)).style(f"margin-left: {12 * depth}px")
        with link:
            text(name)
            text(str(count)).classes("count")
        if iri == here:
            link.classes("here").props('aria-current="page"')
    if not fitting:
        ui.label("No class has that name.").classes("faint")
    elif len(fitting) > MOST:
        ui.label(f"{len(fitting) - MOST} more: type to narrow").classes("faint")


class _Found:
    """What a class page shows."""

    def __init__(self, kb: KnowledgeBase, iri: str) -> None:
        self.model: ClassModel = class_model(kb, iri)
        self.instances = [(str(i), str(n)) for i, n in kb.ask("instances", **{"class": iri}).rows]
        self.mappings = kb.query(
            f"SELECT DISTINCT ?p ?o {{ <{iri}> ?p ?o FILTER (ISIRI(?o) && (STRENDS(STR(?p), 'Match') "
            "|| STRENDS(STR(?p), 'equivalentClass'))) } ORDER BY ?p ?o"
        ).rows


def _read(kb: KnowledgeBase, iri: str) -> _Found:
    return _Found(kb, kb.resolve(iri, "class"))


async def _class(service: Service, found: _Found, parents: list[str], theta: Fraction) -> None:
    model = found.model
    with ui.element("div").classes("line"):
        text(model.name, "h1")
        ui.button("Find a substitute", icon="swap_horiz").props("outline color=teal-8").classes(
            "end"
        ).on_click(lambda: ui.navigate.to(link_to("/substitution", missing=model.name)))
    copyable(model.iri)
    ui.label(f"Known from {model.instances} {service.kb.build.unit}s.").classes("lead")
    with card("What it is like"):
        _memberships(model.entries, theta)
    with ui.element("div").classes("two"):
        with card("What it is for"):
            await _functions(service, model.iri, theta)
        with card("Where it stands"):
            _standing(found, parents)
    with card(f"Individuals ({len(found.instances)})"), chips():
        for iri, name in found.instances[:MOST]:
            chip(name, page_of("instance", iri))
        if len(found.instances) > MOST:
            chip(
                f"and {len(found.instances) - MOST} more", link_to("/individuals", search=model.name), "info"
            )


def _memberships(entries: tuple[Entry, ...], theta: Fraction) -> None:
    """Bars of all memberships; a slider marks those that are representative."""
    drawn: list[tuple[Entry, ui.element]] = []
    with ui.element("div").classes("line"):
        ui.label("Representative from").classes("soft")
        slider = ui.slider(min=0.05, max=1, step=0.05, value=float(theta)).classes("grow")
        slider.props('label aria-label="Threshold theta" color=teal-8')
        says = ui.label().classes("soft")

    def mark() -> None:
        now = Fraction(str(slider.value))
        for entry, box in drawn:
            box.classes(add="rep") if entry.proportion >= now else box.classes(remove="rep")
        typical = sum(entry.proportion >= now for entry in entries)
        says.text = f"θ = {float(now):.2f}: {typical} of {len(entries)} qualities"

    for kind, title in ((Kind.PHYSICAL, "Physical"), (Kind.FUNCTIONAL, "Functional")):
        ui.label(title).classes("faint").style("margin: 14px 0 6px")
        with ui.element("div").classes("bars"):
            own = [entry for entry in entries if entry.kind is kind]
            for name, group in groupby(own, key=lambda entry: entry.property):
                _property(name, list(group), theta, drawn)
    slider.on_value_change(mark)
    mark()


def _property(name: str, group: list[Entry], theta: Fraction, drawn: list[tuple[Entry, ui.element]]) -> None:
    for at, entry in enumerate(group):
        with ui.element("div").classes("name"):
            if at == 0:
                ui.link(words_of(name), page_of("property", KB + name))
        ui.link(words_of(entry.quality), page_of("quality", KB + entry.quality))
        share = float(entry.proportion)
        functional = entry.kind is Kind.FUNCTIONAL
        drawn.append((entry, bar(share, typical=entry.proportion >= theta, functional=functional)))
        ui.label(f"{degree_text(entry.count)} of {degree_text(entry.total)}").classes("of")


async def _functions(service: Service, iri: str, theta: Fraction) -> None:
    settings = ReasonerSettings(representative=theta)
    try:
        ranking = await service.read(lambda: rank_substitutes(service.kb, iri, settings=settings, top=5))
    except ErsatzError as error:
        ui.label(str(error)).classes("soft")
        return
    ui.label("Functions relevant in it").classes("faint")
    with chips():
        for name in ranking.relevant_functional:
            chip(words_of(name), page_of("quality", KB + name), "info")
        if not ranking.relevant_functional:
            ui.label("None: it cannot be said what would stand in for it.").classes("soft")
    ui.label("Qualities they rest on").classes("faint")
    with chips():
        for name in ranking.relevant_physical:
            chip(words_of(name), page_of("quality", KB + name), "good")
    ui.label("Nearest stand-ins").classes("faint")
    with chips():
        for one in ranking:
            chip(
                f"{one.name} {one.similarity:.2f}", page_of("class", one.iri), "good" if one.accepted else ""
            )


def _standing(found: _Found, parents: list[str]) -> None:
    ui.label("Superclasses").classes("faint")
    with chips():
        for one in parents or [OBJECT.value]:
            chip(local_name(one), page_of("class", one) if one.startswith(KB) else "")
    ui.label("The same in other ontologies").classes("faint")
    rows: tuple[tuple[Any, ...], ...] = found.mappings
    for relation, other in rows:
        ui.label(f"{local_name(str(relation))}: {other}").classes("iri")
    if not rows:
        ui.label("No mapping is in this knowledge base; `ersatz link` adds them.").classes("soft")
    ui.label("More").classes("faint")
    with chips():
        chip("its neighbourhood", link_to("/graph", node=local_name(found.model.iri)))
        chip("as Turtle", f"/kb/{local_name(found.model.iri)}")
