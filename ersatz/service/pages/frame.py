"""The frame of every page: the style, the way to the others, light and dark; and the boxes on it.

All text reaches the browser as text: what is drawn is `markup`, or goes through Vue, which escapes it.
"""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any, Final

from nicegui import ui
from nicegui.elements.html import Html

from ersatz.service.pages.markup import Markup, joined, link, table_markup, tag
from ersatz.service.service import Service

PATIENCE: Final = 60.0
"""Seconds a page may take to be made; the first on a large knowledge base reads much."""

INK: Final = "#8595a2"
"""Of axes and labels in charts: readable on light and on dark."""

COLOURS: Final = ("#0d7a6f", "#3d6fb4", "#c98a2b", "#b4552d", "#7a5ba6", "#5b8c3a", "#b04a77", "#4a6670")
"""Of what is told apart."""

PLACES: Final = (
    ("Classes", "/classes"),
    ("Individuals", "/individuals"),
    ("Properties", "/properties"),
    ("Substitution", "/substitution"),
    ("SPARQL", "/ask"),
    ("Graph", "/graph"),
    ("Checks", "/checks"),
    ("Ground", "/ground"),
)


@cache
def _head() -> str:
    here = Path(__file__).parent
    style, script = ((here / name).read_text(encoding="utf-8") for name in ("style.css", "page.js"))
    return f"<style>{style}</style><script>{script}</script>"


@contextmanager
def frame(service: Service, title: str, here: str = "") -> Iterator[None]:
    """Lay a page out: its content goes into the block."""
    ui.page_title(f"{title} · ERSATZ")
    ui.add_head_html(_head())
    show(_top(here), "top", "header")
    with ui.element("main").classes("page").props("id=content"):
        yield
    show(_foot(service), "foot", "footer")


def _top(here: str) -> Markup:
    pages = (
        link(name, path, class_="here" if path == here else "", aria_current="page" if path == here else "")
        for name, path in PLACES
    )
    toggle = tag(
        "button", "◐", class_="dark", data_do="dark", aria_label="Light or dark", title="Light or dark"
    )
    skip, brand = link("Skip to the content", "#content", class_="skip"), link("ERSATZ", "/", class_="brand")
    return joined((skip, brand, tag("nav", *pages, class_="nav", aria_label="Pages"), toggle))


def _foot(service: Service) -> Markup:
    facts = (service.name(), f"revision {service.kb.revision[:12]}")
    state = "writable" if service.settings.writable else "read-only"
    endpoint = link("SPARQL endpoint", "/sparql", class_="end")
    return joined(
        (*(tag("span", one) for one in (*facts, state)), endpoint, link("OpenAPI", "/openapi.json"))
    )


def show(markup: Markup, classes: str = "", tag: str = "div") -> Html:
    """Put markup on the page."""
    assert isinstance(markup, Markup), "text is escaped by `markup.tag`"
    return ui.html(markup, sanitize=False, tag=tag).classes(classes)


def heading(title: str, lead: str = "") -> None:
    """Show the title of a page and what it is about."""
    show(joined((tag("h1", title), tag("p", lead, class_="lead") if lead else "")))


@contextmanager
def card(title: str = "", extra: str = "") -> Iterator[ui.element]:
    """A box with a title."""
    with ui.element("section").classes(f"card {extra}") as box:
        if title:
            show(Markup(joined((title,))), tag="h2")
        yield box


def table(heads: Sequence[str], rows: Iterable[Sequence[Any]], numeric: Sequence[int] = ()) -> None:
    """Show a table; see `markup.table_markup`."""
    show(table_markup(heads, rows, numeric))


def notice(words: str, *, bad: bool = False) -> None:
    """Show a message that cannot be overlooked."""
    show(tag("div", words, class_="notice" + " bad" * bad, role="status"))


def title_line(title: str, iri: str, *more: Markup) -> None:
    """Show the name of a thing, its IRI with a button that copies it, and what else there is to do."""
    copy = tag("button", "copy", class_="copy", data_do="copy", data_words=iri, aria_label="Copy the IRI")
    above = tag("div", tag("h1", title), *more, class_="line spread")
    show(joined((above, tag("div", tag("span", iri, class_="iri"), copy, class_="line"))))
