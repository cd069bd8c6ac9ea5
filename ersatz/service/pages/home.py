"""The first page: what there is, and the question it is all about."""

from typing import Final
from urllib.parse import quote

from nicegui import ui
from starlette.responses import RedirectResponse

from ersatz.errors import ErsatzError
from ersatz.knowledge.vocabulary import KB
from ersatz.service.pages.data import is_individual, overview
from ersatz.service.pages.frame import (
    PATIENCE,
    card,
    chip,
    chips,
    frame,
    heading,
    link_to,
    notice,
    page_of,
    text,
)
from ersatz.service.service import Service

MOST_OFFERED: Final = 400


def add(service: Service) -> None:
    """Add the page, and the one that leads from any name to its own."""

    @ui.page("/", response_timeout=PATIENCE)
    async def home() -> None:
        seen = await service.read(lambda: overview(service.kb))
        with frame(service, "What stands in?"):
            heading(
                "The tool is missing. What will do?",
                "This knowledge base holds what a robot has observed of everyday things. Name the tool that "
                "is not here, and it ranks what is, with reasons.",
            )
            with card(), ui.element("div").classes("line"):
                names = sorted(name for _, name, _ in seen.classes)
                missing = ui.select(
                    offered(names, _first(names)),
                    label="Missing tool",
                    with_input=True,
                    new_value_mode="add-unique",
                    value=_first(names),
                ).classes("grow")
                ui.button("Find substitutes", icon="search").props("unelevated color=teal-8").on_click(
                    lambda: ui.navigate.to(link_to("/substitution", missing=missing.value))
                )
            with ui.element("div").classes("tiles"):
                for count, words, path in (
                    (len(seen.classes), "classes of things", "/classes"),
                    (seen.individuals, "individuals observed", "/individuals"),
                    (seen.properties, "properties measured", "/properties"),
                    (seen.qualities, "qualities told apart", "/properties"),
                ):
                    with ui.link(target=path).classes("tile"):
                        text(f"{count:,}".replace(",", "\u202f"), "b")
                        ui.label(words)
            with card("Classes"), chips():
                for iri, name, _ in seen.classes[:60]:
                    chip(name, page_of("class", iri))
                if len(seen.classes) > 60:
                    chip(f"all {len(seen.classes)}", "/classes", "info")

    @ui.page("/thing/{name}", response_timeout=PATIENCE)
    async def thing(name: str) -> RedirectResponse | None:
        try:
            if await service.knows(KB + name):
                kind = await service.read(lambda: service.kb.kind_of(KB + name))
                known = await service.read(lambda: is_individual(service.kb, KB + name))
                if kind == "instance" and not known:
                    return RedirectResponse(f"/graph?node={quote(name)}", 303)
                return RedirectResponse(page_of(kind, KB + name), 303)
        except (ErsatzError, ValueError):
            pass
        with frame(service, "Unknown"):
            notice(f"Nothing here is called {name!r}.", bad=True)
        return None


def offered(names: list[str], *chosen: str | None) -> list[str]:
    """Return the names a field offers: not more than a page bears; others can be typed."""
    return sorted({*names[:MOST_OFFERED], *(one for one in chosen if one)})


def _first(names: list[str]) -> str | None:
    return "tray" if "tray" in names else (names[0] if names else None)
