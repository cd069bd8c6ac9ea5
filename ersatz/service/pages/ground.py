"""Ground by hand: a scan comes in, and what it is and could stand in for comes out."""

import tempfile
from pathlib import Path
from typing import Any, Final

import numpy as np
from nicegui import events, ui

from ersatz.errors import ErsatzError
from ersatz.service.grounding import Grounded, ground_scan
from ersatz.service.inspection import RefusedError
from ersatz.service.pages.frame import (
    PATIENCE,
    bar,
    card,
    chip,
    chips,
    frame,
    heading,
    link_to,
    notice,
    page_of,
    table,
    words_of,
)
from ersatz.service.pages.individuals import unit_words
from ersatz.service.pages.properties import COLOURS
from ersatz.service.service import Service

SUFFIXES: Final = (".ply", ".pcd")
DRAWN: Final = 12_000
"""Points that are drawn."""


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
                upload = (
                    ui.upload(
                        label=f"A scan, at most {service.settings.upload_bytes >> 20} MiB",
                        auto_upload=True,
                        max_file_size=service.settings.upload_bytes,
                        max_files=1,
                    )
                    .props(f'accept="{",".join(SUFFIXES)}" flat bordered color=teal-8')
                    .style("width: 100%")
                )
            place = ui.element("div").props('aria-live="polite"')

            async def take(event: events.UploadEventArguments) -> None:
                place.clear()
                with place:
                    ui.spinner(size="lg", color="teal-8")
                try:
                    found = await _measured(service, event)
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


async def _measured(service: Service, event: events.UploadEventArguments) -> Grounded:
    # The name is the client's: only its suffix is used.
    suffix = Path(event.file.name).suffix.lower()
    if suffix not in SUFFIXES:
        raise ValueError(f"{event.file.name!r} is no scan by its name: give {' or '.join(SUFFIXES)}")
    with tempfile.TemporaryDirectory(prefix="ersatz-") as folder:
        path = Path(folder) / f"scan{suffix}"
        path.write_bytes(await event.file.read())
        return await service.read(lambda: ground_scan(service.kb, path))


def _draw(service: Service, found: Grounded) -> None:
    with ui.element("div").classes("two"):
        with card(f"Its {found.segments.max(initial=0) + 1} segments"):
            _scene(found)
            ui.label(f"{len(found.points)} points, {found.extent} m. Drag to turn it.").classes("faint")
        with card("What was measured"):
            table(
                ["property", "value", "unit", "quality"],
                [
                    (
                        (words_of(one.name), page_of("property", one.iri)),
                        " × ".join(f"{value:.4g}" for value in one.values),
                        unit_words(one.unit),
                        (words_of(one.quality), page_of("quality", one.quality_iri))
                        if one.quality
                        else "not in this knowledge base",
                    )
                    for one in found.measured
                ],
                numeric=(1,),
            )
    with card("Most like it"):
        ui.label(
            "Jaccard similarity of its qualities with those typical of a class, over the measured properties"
        ).classes("faint")
        with (
            ui.element("div")
            .classes("bars")
            .style("grid-template-columns: minmax(120px, max-content) 1fr max-content")
        ):
            for iri, name, similarity in found.nearest:
                ui.link(name, page_of("class", iri))
                bar(similarity, typical=similarity > 0.35)
                ui.label(f"{similarity:.2f}").classes("of")
    with card("What it could stand in for"), chips():
        for _, name, similarity in found.stands_in_for:
            chip(f"{name} {similarity:.2f}", link_to("/substitution", missing=name), "good")
        if not found.stands_in_for:
            ui.label("For nothing here, by what was measured.").classes("soft")
    if service.settings.writable:
        _keep(service, found)


def _scene(found: Grounded) -> None:
    chosen = np.linspace(0, len(found.points) - 1, min(DRAWN, len(found.points))).astype(int)
    points = found.points[chosen] - found.points.mean(axis=0)
    points = points / max(float(np.abs(points).max()), 1e-9) * 2.2
    palette = np.array([[int(colour[at : at + 2], 16) / 255 for at in (1, 3, 5)] for colour in COLOURS])
    colours = palette[found.segments[chosen] % len(palette)]
    with ui.scene(width=520, height=400, grid=False, background_color="#f5f7f8") as scene:
        scene.point_cloud(points.tolist(), colours.tolist(), point_size=0.06)
        scene.move_camera(x=2.1, y=-2.1, z=1.7, look_at_x=0, look_at_y=0, look_at_z=0, duration=0)
    scene.style("width: 100%; max-width: 100%; border-radius: 8px; overflow: hidden")


def _keep(service: Service, found: Grounded) -> None:
    with card("Add it to the knowledge base"), ui.element("div").classes("line"):
        of = ui.input("Its class").props("outlined dense")
        name = ui.input("Its name").props("outlined dense")
        token = ui.input("Token", password=True).props("outlined dense autocomplete=off")

        async def add_it() -> None:
            if not service.has_token(str(token.value)):
                ui.notify("That is not the token.", type="negative")
                return
            values: dict[str, Any] = {
                one.name: one.values[0] if len(one.values) == 1 else list(one.values)
                for one in found.measured
                if one.quality
            }
            try:
                await service.write(lambda: service.kb.observe(str(of.value), str(name.value), values))
                ui.notify(f"{name.value} is known now.", type="positive")
            except RefusedError as error:
                ui.notify(str(error), type="negative")

        ui.button("Add", on_click=add_it).props("unelevated color=teal-8")
