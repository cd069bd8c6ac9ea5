"""The pages: what a person sees of the knowledge base. Each is a module with one function that adds it."""

from fastapi import FastAPI
from nicegui import ui

from ersatz.service.pages.ask import add as add_ask
from ersatz.service.pages.checks import add as add_checks
from ersatz.service.pages.classes import add as add_classes
from ersatz.service.pages.graph import add as add_graph
from ersatz.service.pages.ground import add as add_ground
from ersatz.service.pages.home import add as add_home
from ersatz.service.pages.individuals import add as add_individuals
from ersatz.service.pages.properties import add as add_properties
from ersatz.service.pages.qualities import add as add_qualities
from ersatz.service.pages.substitution import add as add_substitution
from ersatz.service.service import Service

_ICON = (
    "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 32 32'>"
    "<rect width='32' height='32' rx='8' fill='#0d7a6f'/>"
    "<path d='M9 8h14v4H13v3h8v3h-8v3h10v4H9z' fill='#fff'/></svg>"
)


def add_pages(app: FastAPI, service: Service) -> None:
    """Add all pages to an application. NiceGUI keeps one set of pages a process: the last service's."""
    for add in (
        add_home,
        add_classes,
        add_individuals,
        add_properties,
        add_qualities,
        add_substitution,
        add_ask,
        add_graph,
        add_checks,
        add_ground,
    ):
        add(service)
    ui.run_with(
        app,
        title="ERSATZ",
        favicon=_ICON,
        dark=None,
        tailwind=False,
        show_welcome_message=False,
    )
