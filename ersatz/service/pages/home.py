"""The first page: what there is, and the question it is all about."""

from urllib.parse import quote

from nicegui import ui
from starlette.responses import RedirectResponse

from ersatz.errors import ErsatzError
from ersatz.knowledge.vocabulary import KB
from ersatz.service.pages.data import Overview, is_individual, overview
from ersatz.service.pages.frame import PATIENCE, card, frame, heading, notice, show
from ersatz.service.pages.markup import Markup, chip, chips, joined, link, link_to, page_of, tag
from ersatz.service.pages.picker import picker
from ersatz.service.service import Service


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
                names = [name for _, name, _ in seen.classes]
                missing = picker("Missing tool", names, _first(names)).classes("grow")
                ui.button("Find substitutes", icon="search").props("unelevated color=teal-8").on_click(
                    lambda: ui.navigate.to(link_to("/substitution", missing=missing.value))
                )
            show(_tiles(seen), "tiles")
            with card("Classes"):
                marks = [chip(name, page_of("class", iri)) for iri, name, _ in seen.classes[:60]]
                if len(seen.classes) > 60:
                    marks.append(chip(f"all {len(seen.classes)}", "/classes", "info"))
                show(chips(marks))

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


def _tiles(seen: Overview) -> Markup:
    counts = (
        (len(seen.classes), "classes of things", "/classes"),
        (seen.individuals, "individuals observed", "/individuals"),
        (seen.properties, "properties measured", "/properties"),
        (seen.qualities, "qualities told apart", "/properties"),
    )
    return joined(
        link(joined((tag("b", f"{count:,}".replace(",", "\u202f")), tag("span", words))), path, class_="tile")
        for count, words, path in counts
    )


def _first(names: list[str]) -> str | None:
    return "tray" if "tray" in names else (names[0] if names else None)
