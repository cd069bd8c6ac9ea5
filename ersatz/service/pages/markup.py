"""Markup: HTML made of data, every piece of text escaped in one place.

An element of the framework costs the server a quarter of a millisecond and the browser a component. What
only has to be read (bars, chips, tables, links) is therefore one string. Nothing else makes HTML: `tag`
escapes every child that is not markup itself and every attribute, and `link` leads nowhere but to pages.
"""

from collections.abc import Iterable, Sequence
from html import escape
from typing import Any, Final
from urllib.parse import quote, urlencode

from ersatz.knowledge.answers import Value
from ersatz.knowledge.names import local_name
from ersatz.knowledge.vocabulary import ERSATZ, KB, PREFIXES

_PLACES: Final = ("/", "#", "http://", "https://")


class Markup(str):
    """HTML that is safe to send."""

    __slots__ = ()


def tag(name: str, *children: object, **attributes: object) -> Markup:
    """Return an element; text and the values of attributes are escaped.

    Parameters
    ----------
    name : str
    *children : object
        Markup stays as it is, all else becomes text.
    **attributes : object
        `class_` is "class", `aria_label` "aria-label"; None, False and "" leave the attribute out.

    >>> tag("b", "<script>", title='"')
    '<b title="&quot;">&lt;script&gt;</b>'
    """
    given = "".join(
        f' {key.rstrip("_").replace("_", "-")}="{escape(str(value))}"'
        for key, value in attributes.items()
        if value is not None and value is not False and value != ""
    )
    return Markup(f"<{name}{given}>{joined(children)}</{name}>")


def joined(children: Iterable[object]) -> Markup:
    """Return pieces in a row; what is not markup is escaped."""
    return Markup("".join(one if isinstance(one, Markup) else escape(str(one)) for one in children))


def link(words: object, to: str, **attributes: object) -> Markup:
    """Return a link.

    Raises
    ------
    ValueError
        If the address is none of a page, so that no data becomes a script.
    """
    if not to.startswith(_PLACES) or to.startswith("//"):
        raise ValueError(f"{to!r} is no address of a page")
    return tag("a", words, href=to, rel="" if to[0] in "/#" else "noreferrer", **attributes)


def chip(words: object, to: str = "", sort: str = "", title: str = "") -> Markup:
    """Return a small label, or a link that looks like one."""
    look = f"chip {sort}".strip()
    return link(words, to, class_=look, title=title) if to else tag("span", words, class_=look, title=title)


def chips(marks: Iterable[Markup], otherwise: str = "") -> Markup:
    """Return a row of them, or a word where there are none."""
    row = joined(marks)
    return tag("div", row or tag("span", otherwise, class_="soft"), class_="chips")


def faint(words: str) -> Markup:
    """Return a small heading above a row."""
    return tag("div", words, class_="faint")


def bar(share: float, *, typical: bool, functional: bool = False, mark: float | None = None) -> Markup:
    """Return a bar for a share in [0, 1], with a mark at a threshold."""
    look = "bar" + " rep" * typical + " fun" * functional
    threshold = "" if mark is None else tag("u", style=f"--mark: {mark:.4f}")
    return tag(
        "div", tag("i"), threshold, class_=look, style=f"--share: {share:.4f}", role="img",
        aria_label=f"{share:.2f}",
    )  # fmt: skip


def bars(rows: Iterable[tuple[Markup, Markup, str]]) -> Markup:
    """Return rows of a name, a bar and what it counts."""
    cells = (joined((name, drawn, tag("span", of, class_="of"))) for name, drawn, of in rows)
    return tag("div", *cells, class_="bars plain")


def table_markup(heads: Sequence[str], rows: Iterable[Sequence[Any]], numeric: Sequence[int] = ()) -> Markup:
    """Return a table with a button that copies it; a cell is text, markup, or text and where it leads."""
    look = ["num" if at in numeric else "" for at in range(len(heads))]
    head = tag("tr", *(tag("th", name, class_=look[at], scope="col") for at, name in enumerate(heads)))
    body = (
        tag("tr", *(tag("td", _cell(cell), class_=look[at]) for at, cell in enumerate(row))) for row in rows
    )
    drawn = tag("table", tag("thead", head), tag("tbody", *body), class_="plain")
    copy = tag("button", "copy", class_="copy", data_do="copy-table", aria_label="Copy the table")
    return tag("div", tag("div", drawn, class_="scroll"), copy, class_="copyable")


def _cell(cell: Any) -> object:
    return link(cell[0], cell[1]) if isinstance(cell, tuple) else cell


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
    """Return a quality or property as words.

    >>> words_of("size_2"), words_of("shape_1"), words_of("shape_1_3")
    ('size 2', 'shape 1', 'shape 1 · 3')
    """
    stem, _, rank = name.rpartition("_")
    if stem[-1:].isdigit() and rank.isdigit():
        return f"{stem.replace('_', ' ')} · {rank}"
    return name.replace("_", " ")


def unit_words(unit: str) -> str:
    """Return a unit as a person reads it.

    >>> unit_words("m2"), unit_words("1")
    ('m²', 'dimensionless')
    """
    return {"1": "dimensionless", "m2": "m²", "m3": "m³", "kg m2": "kg m²"}.get(unit, unit)
