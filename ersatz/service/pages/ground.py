"""Ground by hand: a scan comes in, and what it is and could stand in for comes out."""

import tempfile
from pathlib import Path
from typing import Any, Final

from nicegui import events, ui

from ersatz.errors import ErsatzError
from ersatz.knowledge.names import snake_iri
from ersatz.pipeline import Grounded
from ersatz.reasoner.relevance import ReasonerSettings
from ersatz.service.grounding import SeenScan, ground_scan
from ersatz.service.pages.cloud import by_segment, draw_cloud
from ersatz.service.pages.data import overview
from ersatz.service.pages.frame import PATIENCE, card, frame, heading, notice, show, table
from ersatz.service.pages.markup import (
    Markup,
    bar,
    bars,
    chip,
    chips,
    link,
    link_to,
    page_of,
    tag,
    unit_words,
    words_of,
)
from ersatz.service.pages.picker import picker
from ersatz.service.pages.writing import ask_token
from ersatz.service.service import Service

SUFFIXES: Final = (".ply", ".pcd")
NEAREST: Final = 8
"""Classes and tools that are shown."""


def add(service: Service) -> None:
    """Add the page."""

    @ui.page("/ground", response_timeout=PATIENCE)
    async def ground() -> None:
        with frame(service, "Ground by hand", "/ground"):
            heading(
                "Ground by hand",
                "Give a scan of one object (PLY or PCD, metres). It is cut into segments and measured, its "
                "qualities are looked up, and the classes most like it follow.",
            )
            with card():
                most = service.settings.upload_bytes
                label = f"A scan, at most {most >> 20} MiB: choose a file, or drop it here"
                upload = ui.upload(label=label, auto_upload=True, max_file_size=most, max_files=1).props(
                    f'accept="{",".join(SUFFIXES)}" flat bordered'
                )
            place = ui.element("div").props('aria-live="polite"')

            async def take(event: events.UploadEventArguments) -> None:
                place.clear()
                with place:
                    ui.spinner(size="lg", color="teal-8")
                try:
                    found = await _seen(service, event)
                except (ErsatzError, ValueError) as error:
                    place.clear()
                    with place:
                        notice(str(error), bad=True)
                else:
                    place.clear()
                    with place:
                        _draw(service, found)
                upload.reset()

            upload.on_upload(take)


async def _seen(service: Service, event: events.UploadEventArguments) -> SeenScan:
    # The name is the client's: only its suffix is used.
    suffix = Path(event.file.name).suffix.lower()
    if suffix not in SUFFIXES:
        raise ValueError(f"{event.file.name!r} is no scan by its name: give {' or '.join(SUFFIXES)}")
    with tempfile.TemporaryDirectory(prefix="ersatz-") as folder:
        path = Path(folder) / f"scan{suffix}"
        path.write_bytes(await event.file.read())
        return await service.read(lambda: ground_scan(service.kb, path))


def _draw(service: Service, found: SeenScan) -> None:
    if found.remark:
        notice(found.remark)
    with ui.element("div").classes("two"):
        with card(f"Its {found.segments.max(initial=0) + 1} segments"):
            draw_cloud(found.points, by_segment(found.segments))
        with card("What was measured"):
            table(("property", "value", "unit", "quality"), _held(found.grounded), numeric=(1,))
    with card("Most like it"):
        words = "Jaccard index of its qualities with those typical of a class, over the measured properties"
        show(tag("div", f"{words}; dimensionless.", class_="soft"))
        show(_likenesses(found.grounded))
    with card("What it could stand in for"):
        roles = [role for role in found.grounded.roles if role.accepted][:NEAREST]
        marks = (
            chip(
                f"{role.tool} {float(role.similarity):.2f}",
                link_to("/substitution", missing=role.tool),
                "good",
            )
            for role in roles
        )
        show(chips(marks, "For nothing here, by what was measured."))
    if service.settings.writable:
        _keep(service, found)


def _held(grounded: Grounded) -> list[tuple[Any, ...]]:
    return [
        (
            (words_of(one.property), page_of("property", snake_iri(one.property))),
            " × ".join(f"{value:.4g}" for value in one.value),
            unit_words(one.unit),
            (words_of(one.quality), page_of("quality", snake_iri(one.quality))),
        )
        for one in grounded.held
    ]


def _likenesses(grounded: Grounded) -> Markup:
    typical = ReasonerSettings().tolerance
    return bars(
        (
            link(one.name, page_of("class", one.iri)),
            bar(float(one.similarity), typical=one.similarity > typical),
            f"{float(one.similarity):.2f}",
        )
        for one in grounded.classes[:NEAREST]
        if one.similarity > 0
    )


def _keep(service: Service, found: SeenScan) -> None:
    with card("Add it to the knowledge base"), ui.element("div").classes("line"):
        names = [name for _, name, _ in overview(service.kb).classes]
        of = picker("Its class", names, found.grounded.classes[0].name)
        name = ui.input("Its name").props("outlined dense")

        def add_it() -> None:
            values = {
                one.property: one.value[0] if len(one.value) == 1 else list(one.value)
                for one in found.grounded.held
            }
            chosen, called = str(of.value or ""), str(name.value or "").strip()
            if not called:
                ui.notify("Give it a name of its own.", type="warning")
                return
            ask_token(service, lambda: service.kb.observe(chosen, called, values), f"{called} is known now.")

        ui.button("Add", on_click=add_it).props("unelevated color=teal-8")
