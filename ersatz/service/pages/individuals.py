"""Individuals: what was measured of each thing, and which qualities it holds."""

from decimal import Decimal
from typing import Any

from nicegui import ui

from ersatz.errors import ErsatzError
from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.names import local_name
from ersatz.knowledge.vocabulary import KB
from ersatz.service.pages.classes import MOST
from ersatz.service.pages.data import individuals, units
from ersatz.service.pages.frame import (
    PATIENCE,
    card,
    chip,
    chips,
    copyable,
    frame,
    heading,
    link_to,
    notice,
    page_of,
    shown,
    table,
    text,
    words_of,
)
from ersatz.service.service import Service


def add(service: Service) -> None:
    """Add the pages."""

    @ui.page("/individuals", response_timeout=PATIENCE)
    async def all_of_them(search: str = "") -> None:
        known = await service.read(lambda: individuals(service.kb))
        with frame(service, "Individuals", "/individuals"):
            heading("Individuals", "The things that were measured, one by one.")
            if not known:
                notice("This knowledge base holds classes only.")
                return
            box = ui.input(placeholder="Search by name or class", value=search).props(
                'outlined dense clearable debounce=150 aria-label="Search individuals"'
            )
            items = ui.element("div").style("margin-top: 18px")

            def draw() -> None:
                items.clear()
                with items:
                    _groups(known, str(box.value or ""))

            box.on_value_change(draw)
            draw()

    @ui.page("/individuals/{name}", response_timeout=PATIENCE)
    async def one(name: str) -> None:
        try:
            found = await service.read(lambda: _Found(service.kb, service.kb.resolve(KB + name, "instance")))
        except (ErsatzError, ValueError, IndexError) as error:
            with frame(service, "Unknown individual", "/individuals"):
                notice(str(error), bad=True)
            return
        with frame(service, found.name, "/individuals"):
            text(found.name, "h1")
            copyable(found.iri)
            with ui.element("p").classes("lead"):
                text("A ")
                ui.link(found.class_name, page_of("class", found.class_iri))
                text(f" with {len(found.rows)} measured properties and {len(found.qualities)} qualities.")
            with card("Measurements"):
                table(
                    ["property", "observation", "raw value", "unit", "quality", "origin", "source"],
                    found.rows,
                    numeric=(2,),
                )
            with ui.element("div").classes("two"):
                with card("Holds"), chips():
                    for iri in found.qualities:
                        chip(words_of(local_name(iri)), page_of("quality", iri), "good")
                with card("Who refers to it"):
                    table(["from", "by"], found.usage)
            with card("More"), chips():
                chip("what it can stand in for", link_to("/substitution", instance=found.name))
                chip("its neighbourhood", link_to("/graph", node=local_name(found.iri)))
                chip("as Turtle", f"/kb/{local_name(found.iri)}")


class _Found:
    """What the page of an individual shows."""

    def __init__(self, kb: KnowledgeBase, iri: str) -> None:
        row = kb.ask("instance", instance=iri)[0]
        self.iri, self.name = iri, str(row["name"])
        self.class_iri, self.class_name = str(row["class"]), str(row["className"])
        held = kb.ask("instance_qualities", instances=[iri])
        self.qualities = [str(row["quality"]) for row in held]
        self.rows = _measured(kb, iri, self.qualities)
        self.usage: list[tuple[Any, str]] = [
            ((shown(row["s"]), link_to("/graph", node=shown(row["s"]))), shown(row["p"]))
            for row in kb.query(f"SELECT ?s ?p {{ ?s ?p <{iri}> }} ORDER BY ?p ?s LIMIT {MOST}")
        ] or [("Nothing does.", "")]


def _measured(kb: KnowledgeBase, iri: str, held: list[str]) -> list[tuple[Any, ...]]:
    """Return a row a property and observation, the components of a vector together."""
    known = units(kb)
    of = {str(row["quality"]): str(row["property"]) for row in kb.ask("qualities")}
    quality = {of[one]: one for one in held}
    values: dict[tuple[str, str], list[Decimal]] = {}
    other: dict[tuple[str, str], tuple[str, str]] = {}
    for row in kb.ask("instance_measurements", instance=iri):
        key = str(row["property"]), str(row["observation"] or "")
        values.setdefault(key, []).append(Decimal(str(row["value"])))
        other[key] = shown(row["origin"]), str(row["file"] or "")
    rows: list[tuple[Any, ...]] = []
    for (prop, observation), found in values.items():
        one = quality.get(prop)
        rows.append(
            (
                (words_of(local_name(prop)), page_of("property", prop)),
                observation,
                " × ".join(f"{float(value):.4g}" for value in found),
                unit_of(known, prop),
                (words_of(local_name(one)), page_of("quality", one)) if one else "",
                *other[prop, observation],
            )
        )
    return rows


def unit_of(known: dict[str, dict[str, Any]], prop: str) -> str:
    """Return the unit of a property as a person reads it."""
    return unit_words(str(known.get(prop, {}).get("unit") or "1"))


def unit_words(unit: str) -> str:
    """Return a unit as a person reads it.

    >>> unit_words("m2"), unit_words("1")
    ('m²', 'dimensionless')
    """
    return {"1": "dimensionless", "m2": "m²", "m3": "m³", "kg m2": "kg m²"}.get(unit, unit)


def _groups(known: tuple[tuple[str, str, str], ...], wanted: str) -> None:
    words = wanted.casefold().split()
    fitting = [
        one for one in known if all(word in f"{one[1]} {local_name(one[2])}".casefold() for word in words)
    ]
    ui.label(f"{len(fitting)} of {len(known)}").classes("faint")
    groups: dict[str, list[tuple[str, str]]] = {}
    for iri, name, of in fitting[: 2 * MOST]:
        groups.setdefault(of, []).append((iri, name))
    for of, members in groups.items():
        with card():
            ui.link(local_name(of), page_of("class", of)).style("font-weight: 650")
            with chips():
                for iri, name in members:
                    chip(name, page_of("instance", iri))
    if len(fitting) > 2 * MOST:
        notice(f"{len(fitting) - 2 * MOST} more: type to narrow.")
