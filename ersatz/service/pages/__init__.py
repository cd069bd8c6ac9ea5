"""The pages: what a person sees of the knowledge base. Each is a module with one function that adds it."""

from fastapi import FastAPI
from nicegui import ui

from ersatz.service.pages import (
    ask,
    checks,
    classes,
    graph,
    ground,
    home,
    individuals,
    properties,
    substitution,
)
from ersatz.service.service import Service

_ICON = (
    "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 32 32'>"
    "<rect width='32' height='32' rx='8' fill='#0d7a6f'/>"
    "<path d='M9 8h14v4H13v3h8v3h-8v3h10v4H9z' fill='#fff'/></svg>"
)


def add_pages(app: FastAPI, service: Service) -> None:
    """Add all pages to an application. NiceGUI keeps one set of pages a process: the last service's."""
    for module in (home, classes, individuals, properties, substitution, ask, graph, checks, ground):
        module.add(service)
    ui.run_with(
        app,
        title="ERSATZ",
        favicon=_ICON,
        dark=None,
        tailwind=False,
        show_welcome_message=False,
    )
