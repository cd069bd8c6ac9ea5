"""The tree of classes: only open branches are drawn, and the search runs here, not in the browser."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from nicegui import events, ui

from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.vocabulary import OBJECT
from ersatz.service.pages.data import overview, superclasses
from ersatz.service.pages.frame import show
from ersatz.service.pages.markup import Markup, faint, joined, link, page_of, tag

MOST: Final = 120
"""Lines that are drawn; typing narrows them."""

_EMIT: Final = "e => { const b = e.target.closest('[data-branch]'); if (b) emit(b.dataset.branch) }"


@dataclass(frozen=True, slots=True)
class Line:
    """A class in the tree, `open` is None where nothing lies below it."""

    depth: int
    iri: str
    name: str
    count: int
    open: bool | None


class Tree:
    """The classes and what lies below each."""

    def __init__(self, kb: KnowledgeBase) -> None:
        self._known = {iri: (name, count) for iri, name, count in overview(kb).classes}
        self._above = {
            iri: [one for one in superclasses(kb).get(iri, ()) if one in self._known and one != iri]
            for iri in self._known
        }
        self._closed: Sequence[Line] = ()
        self._below: dict[str, list[str]] = {}
        for iri in self._known:
            for one in self._above[iri] or [OBJECT.value]:
                self._below.setdefault(one, []).append(iri)

    def way_to(self, iri: str) -> set[str]:
        """Return the branches that must be open for a class to be seen."""
        found: set[str] = set()
        ahead = list(self._above.get(iri, ()))
        while ahead:
            if (one := ahead.pop()) not in found:
                found.add(one)
                ahead += self._above[one]
        return found

    def lines(self, opened: set[str]) -> Sequence[Line]:
        """Return what is seen with these branches open; a class with two parents stands twice."""
        if not opened:
            self._closed = self._closed or tuple(self._walk(opened))
            return self._closed
        return tuple(self._walk(opened))

    def _walk(self, opened: set[str]) -> Iterator[Line]:
        stack = [(0, iri, frozenset[str]()) for iri in reversed(self._below.get(OBJECT.value, []))]
        while stack:
            depth, iri, path = stack.pop()
            below = [one for one in self._below.get(iri, ()) if one not in path and one != iri]
            name, count = self._known[iri]
            yield Line(depth, iri, name, count, iri in opened if below else None)
            if iri in opened:
                stack += [(depth + 1, one, path | {iri}) for one in reversed(below)]

    def matching(self, wanted: str) -> Iterator[Line]:
        """Yield the classes whose name has all these words."""
        words = wanted.casefold().split()
        for iri, (name, count) in self._known.items():
            if all(word in name.casefold() for word in words):
                yield Line(0, iri, name, count, None)


def draw_tree(kb: KnowledgeBase, here: str = "") -> None:
    """Draw the tree with a search above it."""
    tree = kb.view(Tree)
    opened = tree.way_to(here)
    with ui.element("nav").classes("card side").props('aria-label="Classes"'):
        search = ui.input(placeholder="Search classes").props(
            'dense outlined clearable debounce=150 aria-label="Search classes"'
        )
        items = show(_items(tree, opened, "", here), "items")

        def draw() -> None:
            items.content = _items(tree, opened, str(search.value or ""), here)

        def toggle(event: events.GenericEventArguments) -> None:
            opened.symmetric_difference_update({str(event.args)})
            draw()

        items.on("click", toggle, js_handler=_EMIT)
        search.on_value_change(draw)


def _items(tree: Tree, opened: set[str], wanted: str, here: str) -> Markup:
    lines = tuple(tree.matching(wanted)) if wanted.strip() else tree.lines(opened)
    at = next((at for at, line in enumerate(lines) if line.iri == here), 0)
    first = max(0, min(at - MOST // 2, len(lines) - MOST))
    drawn = [_drawn(line, line.iri == here) for line in lines[first : first + MOST]]
    if not lines:
        drawn.append(faint("No class has that name."))
    elif len(lines) > MOST:
        drawn.append(faint(f"{len(lines) - MOST} more: type to narrow"))
    return joined(drawn)


def _drawn(line: Line, here: bool) -> Markup:
    words = joined((tag("span", line.name), tag("span", line.count, class_="count")))
    to = link(words, page_of("class", line.iri), class_="here" if here else "",
              aria_current="page" if here else "")  # fmt: skip
    branch: object = ""
    if line.open is not None:
        state = "true" if line.open else "false"
        branch = tag("button", "▾" if line.open else "▸", class_="branch", data_branch=line.iri,
                     aria_expanded=state, aria_label=f"What lies below {line.name}")  # fmt: skip
    return tag("div", branch, to, class_="leaf", style=f"--depth: {line.depth}")
