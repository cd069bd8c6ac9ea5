"""The frame of every page: the style, the way to the others, light and dark; and small building blocks.

All text reaches the browser as text: labels go through Vue, which escapes them. No HTML is made of data.
"""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote, urlencode

from nicegui import ui
from nicegui.elements.mixins.text_element import TextElement

from ersatz.knowledge.names import local_name
from ersatz.knowledge.queries import Value
from ersatz.knowledge.vocabulary import ERSATZ, KB, PREFIXES
from ersatz.service.service import Service

PATIENCE: Final = 60.0
"""Seconds a page may take to be made; the first on a large knowledge base reads much."""

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
_LIGHT: Final = """
<script>
addEventListener('load', () => { const dark = localStorage.getItem('ersatz-dark');
  if (dark !== null && window.Quasar) Quasar.Dark.set(dark === 'true'); });
</script>
"""


@cache
def _style() -> str:
    return f"<style>{(Path(__file__).parent / 'style.css').read_text(encoding='utf-8')}</style>"


@contextmanager
def frame(service: Service, title: str, here: str = "") -> Iterator[None]:
    """Lay a page out: its content goes into the block."""
    ui.page_title(f"{title} · ERSATZ")
    ui.add_head_html(_style() + _LIGHT)
    with ui.element("header").classes("top"):
        ui.link("Skip to the content", "#content").classes("skip")
        ui.link("ERSATZ", "/").classes("brand")
        with ui.element("nav").classes("nav").props('aria-label="Pages"'):
            for name, path in PLACES:
                link = ui.link(name, path)
                if path == here:
                    link.classes("here").props('aria-current="page"')
        toggle = ui.button(icon="contrast").props('flat round dense aria-label="Light or dark" color=grey')
        toggle.on(
            "click",
            js_handler="() => { Quasar.Dark.toggle();"
            " localStorage.setItem('ersatz-dark', Quasar.Dark.isActive) }",
        )
    with ui.element("main").classes("page").props("id=content"):
        yield
    with ui.element("footer").classes("foot"):
        ui.label(service.name())
        ui.label(f"revision {service.kb.revision[:12]}")
        ui.label("writable" if service.settings.writable else "read-only")
        ui.link("SPARQL endpoint", "/sparql").classes("end")
        ui.link("OpenAPI", "/openapi.json")


def heading(title: str, lead: str = "") -> None:
    """Show the title of a page and what it is about."""
    text(title, "h1")
    if lead:
        text(lead, "p").classes("lead")


def text(words: str, tag: str = "span") -> TextElement:
    """Add plain text to the element around."""
    return TextElement(tag=tag, text=words)


@contextmanager
def card(title: str = "", extra: str = "") -> Iterator[ui.element]:
    """A box with a title."""
    with ui.element("section").classes(f"card {extra}") as box:
        if title:
            text(title, "h2")
        yield box


def chip(words: str, to: str = "", sort: str = "") -> None:
    """A small label, or a link."""
    if to:
        ui.link(words, to).classes(f"chip {sort}")
    else:
        ui.label(words).classes(f"chip {sort}")


@contextmanager
def chips() -> Iterator[None]:
    """A row of them."""
    with ui.element("div").classes("chips"):
        yield


def bar(share: float, *, typical: bool, functional: bool = False, mark: float | None = None) -> ui.element:
    """A bar for a share in [0, 1], with a mark at a threshold."""
    with ui.element("div").classes("bar") as box:
        box.classes(add=" ".join(("rep" * typical, "fun" * functional)))
        box.style(f"--share: {share:.4f}").props(f'role="img" aria-label="{share:.2f}"')
        ui.element("i")
        if mark is not None:
            ui.element("u").style(f"--mark: {mark:.4f}")
    return box


def table(heads: Sequence[str], rows: Iterable[Sequence[Any]], numeric: Sequence[int] = ()) -> None:
    """A table; a cell is text, or a pair of text and the page it leads to."""
    with ui.element("div").classes("scroll"), ui.element("table").classes("plain"):
        with ui.element("thead"), ui.element("tr"):
            for at, head in enumerate(heads):
                with ui.element("th").classes("num" if at in numeric else ""):
                    ui.label(head)
        with ui.element("tbody"):
            for row in rows:
                with ui.element("tr"):
                    for at, cell in enumerate(row):
                        with ui.element("td").classes("num" if at in numeric else ""):
                            _cell(cell)


def _cell(cell: Any) -> None:
    if isinstance(cell, tuple):
        ui.link(str(cell[0]), cell[1])
    else:
        ui.label(str(cell))


def notice(words: str, *, bad: bool = False) -> None:
    """A message that cannot be overlooked."""
    ui.label(words).classes("notice" + " bad" * bad).props('role="status"')


def copyable(words: str) -> None:
    """An IRI or a link with a button that copies it."""
    with ui.element("div").classes("line"):
        ui.label(words).classes("iri")
        copy_button(words, "Copy")


def copy_button(words: str, label: str) -> None:
    """A button that copies text to the clipboard."""
    button = ui.button(icon="content_copy").props(f'flat dense round size=sm color=grey aria-label="{label}"')
    button.tooltip(label)
    button.on("click", lambda: copy(words))


def copy(words: str) -> None:
    """Put text on the clipboard."""
    ui.clipboard.write(words)
    ui.notify("Copied")


def page_of(kind: str, iri: str) -> str:
    """Return the page of a class, an individual, a property or a quality."""
    folder = {"class": "classes", "property": "properties", "quality": "qualities"}.get(kind, "individuals")
    return f"/{folder}/{quote(local_name(iri), safe='')}"


def link_to(path: str, **fields: Any) -> str:
    """Return a link with parameters, empty ones left out."""
    given = {name: value for name, value in fields.items() if value not in (None, "", [], False)}
    return f"{path}?{urlencode(given, doseq=True)}" if given else path


def shown(value: Value) -> str:
    """Return a value as a person reads it: names instead of our own IRIs, prefixes instead of known ones."""
    if value is None:
        return ""
    words = str(value)
    if words.startswith((KB, ERSATZ)):
        return local_name(words)
    for prefix, namespace in PREFIXES.items():
        if words.startswith(namespace):
            return f"{prefix}:{words[len(namespace) :]}"
    return words


def words_of(name: str) -> str:
    """Return a quality or property as words: "size_2" -> "size 2"."""
    return name.replace("_", " ")
