"""Individuals: what was measured of each thing, what it looks like, and which qualities it holds."""

from dataclasses import dataclass
from decimal import Decimal
from itertools import groupby
from typing import Any, Final

from nicegui import ui

from ersatz.errors import ErsatzError
from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.names import local_name
from ersatz.knowledge.vocabulary import KB
from ersatz.reasoner.candidates import perceived
from ersatz.service.pages.cloud import by_height, draw_cloud
from ersatz.service.pages.data import individuals, qualities, unit_of
from ersatz.service.pages.frame import PATIENCE, card, frame, heading, notice, show, table, title_line
from ersatz.service.pages.markup import (
    Markup,
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
from ersatz.service.service import Service

MOST: Final = 400
"""Individuals of a list that are drawn."""


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
            items = show(_groups(known, search))
            box.on_value_change(lambda: items.set_content(_groups(known, str(box.value or ""))))

    @ui.page("/individuals/{name}", response_timeout=PATIENCE)
    async def one(name: str) -> None:
        try:
            found = await service.read(lambda: _read(service.kb, KB + name))
        except (ErsatzError, ValueError, IndexError) as error:
            with frame(service, "Unknown individual", "/individuals"):
                notice(str(error), bad=True)
            return
        with frame(service, found.name, "/individuals"):
            await _individual(service, found)


@dataclass(frozen=True, slots=True)
class _Found:
    """What the page of an individual shows.

    Attributes
    ----------
    iri, name, class_iri, class_name : str
    held : list of (quality, its degree, in words where the value belongs to others too)
    rows : list of rows of the table of measurements
    usage : list of (thing, relation)
    """

    iri: str
    name: str
    class_iri: str
    class_name: str
    held: list[tuple[str, Decimal, str]]
    rows: list[tuple[Any, ...]]
    usage: list[tuple[Any, str]]


def _read(kb: KnowledgeBase, name: str) -> _Found:
    iri = kb.resolve(name, "instance")
    row = kb.ask("instance", instance=iri)[0]
    held = tuple(str(row["quality"]) for row in kb.ask("instance_qualities", instances=[iri]))
    rows = _measured(kb, iri, held)
    usage: list[tuple[Any, str]] = [
        ((shown(row["s"]), link_to("/graph", node=shown(row["s"]))), shown(row["p"]))
        for row in kb.query(f"SELECT ?s ?p {{ ?s ?p <{iri}> }} ORDER BY ?p ?s LIMIT 200")
    ]
    degrees = _degrees(kb, iri, held)
    return _Found(iri, str(row["name"]), str(row["class"]), str(row["className"]), degrees, rows, usage)


def _degrees(kb: KnowledgeBase, iri: str, held: tuple[str, ...]) -> list[tuple[str, Decimal, str]]:
    """Return the qualities held, how far, and how far the values belong to the others of the property."""
    known, degree = qualities(kb), perceived(kb, iri)
    found = []
    for one in held:
        same = [
            other for other in degree if one in known and known[other]["property"] == known[one]["property"]
        ]
        words = ", ".join(f"{words_of(local_name(other))} to {degree[other]:.2f}" for other in same)
        found.append((one, degree.get(one, Decimal(1)), words if len(same) > 1 else ""))
    return found


def _measured(kb: KnowledgeBase, iri: str, held: tuple[str, ...]) -> list[tuple[Any, ...]]:
    """Return a row a property and observation, the components of a vector together."""
    quality = {str(qualities(kb)[one]["property"]): one for one in held if one in qualities(kb)}
    values: dict[tuple[str, str], list[Decimal]] = {}
    other: dict[tuple[str, str], tuple[str, str]] = {}
    for row in kb.ask("instance_measurements", instance=iri):
        key = str(row["property"]), str(row["observation"] or "")
        values.setdefault(key, []).append(Decimal(str(row["value"])))
        other[key] = shown(row["origin"]), str(row["file"] or "")
    rows: list[tuple[Any, ...]] = []
    for prop, keys in groupby(values, key=lambda key: key[0]):
        for at, key in enumerate(keys):
            holds = _said(quality[prop], "quality", again=at > 0) if prop in quality else ""
            value = " × ".join(f"{float(value):.4g}" for value in values[key])
            name = _said(prop, "property", again=at > 0)
            rows.append((name, key[1], value, unit_of(kb, prop), holds, *other[key]))
    return rows


def _said(iri: str, kind: str, *, again: bool) -> Markup:
    """Return a name as a link; said again it is there for a copy of the table, not for the eye."""
    words = words_of(local_name(iri))
    return tag("span", words, class_="again") if again else link(words, page_of(kind, iri))


async def _individual(service: Service, found: _Found) -> None:
    stand_in = link(
        "What it can stand in for", link_to("/substitution", instance=found.name), class_="button"
    )
    title_line(found.name, found.iri, stand_in)
    properties = sum("again" not in row[0] for row in found.rows)
    counts = (
        f" with {len(found.rows)} measurement{'s' * (len(found.rows) != 1)}"
        f" of {properties} propert{'y' if properties == 1 else 'ies'}."
    )
    kind = link(found.class_name, page_of("class", found.class_iri))
    show(tag("p", "A ", kind, counts, class_="lead"))
    with ui.element("div").classes("two"):
        with card("Scan"):
            await _scan(service, found.iri)
        with card("Holds"):
            held = (
                chip(
                    words_of(local_name(one)) + (f" ({degree:.2f})" if others else ""),
                    page_of("quality", one),
                    "good",
                    others,
                )
                for one, degree, others in found.held
            )
            more = (
                chip("its neighbourhood", link_to("/graph", node=local_name(found.iri))),
                chip("as Turtle", f"/kb/{local_name(found.iri)}"),
            )
            show(joined((chips(held, "No quality."), faint("More"), chips(more))))
    with card("Measurements"):
        heads = ("property", "observation", "raw value", "unit", "quality", "origin", "source")
        table(heads, found.rows, numeric=(2,))
    with card("Who refers to it"):
        if found.usage:
            table(("from", "by"), found.usage)
        else:
            show(tag("div", "Nothing does.", class_="soft"))


async def _scan(service: Service, iri: str) -> None:
    """Draw the scan, or say why there is none."""
    if service.scans is None:
        words = "No scans are at hand: `ersatz serve KB --scans FOLDER` shows those the values came from."
        show(tag("div", words, class_="soft"))
        return
    scans = service.scans
    files = scans.of(iri)
    if not files:
        show(tag("div", "There is no scan of it in the folder.", class_="soft"))
        return
    place = ui.element("div")

    async def draw(at: int) -> None:
        try:
            points = await service.read(lambda: scans.points(files[at]))
        except ErsatzError as error:
            with place:
                notice(str(error).replace(str(files[at].path), files[at].path.name), bad=True)
            return
        place.clear()
        with place:
            draw_cloud(points, by_height(points))

    await draw(0)
    if len(files) > 1:
        names = dict(enumerate(file.path.name for file in files))
        box = ui.select(names, value=0, label="Scan").props("outlined dense").style("width: 100%")
        box.on_value_change(lambda: draw(int(box.value)))
    else:
        show(tag("div", files[0].path.name, class_="faint"))


def _groups(known: tuple[tuple[str, str, str], ...], wanted: str) -> Markup:
    words = wanted.casefold().split()
    fitting = [
        one for one in known if all(word in f"{one[1]} {local_name(one[2])}".casefold() for word in words)
    ]
    boxes = [faint(f"{len(fitting)} of {len(known)}")]
    for of, members in groupby(fitting[:MOST], key=lambda one: one[2]):
        marks = chips(chip(name, page_of("instance", iri)) for iri, name, _ in members)
        head = tag("div", link(words_of(local_name(of)), page_of("class", of)), class_="head")
        boxes.append(tag("section", head, marks, class_="card"))
    if len(fitting) > MOST:
        boxes.append(tag("div", f"{len(fitting) - MOST} more: type to narrow.", class_="notice"))
    return joined(boxes)
