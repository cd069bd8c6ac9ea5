"""The token: asked for before anything is written."""

from collections.abc import Callable

from nicegui import ui

from ersatz.service.inspection import RefusedError
from ersatz.service.service import Service


def ask_token(service: Service, change: Callable[[], object], done: str) -> None:
    """Ask for the token, then make a change of the knowledge base, and say that it is done."""
    with ui.dialog() as dialog, ui.card():
        ui.label("Saving needs the token of this service.")
        token = ui.input("Token", password=True).props("outlined dense autofocus autocomplete=off")

        async def confirm() -> None:
            if not service.has_token(str(token.value)):
                ui.notify("That is not the token.", type="negative")
                return
            try:
                await service.write(change)
                ui.notify(done, type="positive")
            except RefusedError as error:
                ui.notify(str(error), type="negative")
            dialog.close()

        token.on("keydown.enter", confirm)
        ui.button("Save", on_click=confirm).props("unelevated color=teal-8")
    dialog.open()
