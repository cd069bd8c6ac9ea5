"""Substitution: what is missing, what is on the table, and what will do."""

import json
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from typing import Any

from fastapi import Query
from nicegui import ui

from ersatz.errors import ErsatzError
from ersatz.reasoner.relevance import Combine, ReasonerSettings
from ersatz.reasoner.similarity import CRISP
from ersatz.reasoner.substitution import Ranking, Status, rank_substitutes
from ersatz.service.pages.data import individuals, overview
from ersatz.service.pages.frame import PATIENCE, card, frame, heading, notice, show
from ersatz.service.pages.markup import joined, link_to, tag
from ersatz.service.pages.picker import picker
from ersatz.service.pages.ranking import MOST, answers, as_text, counted
from ersatz.service.pages.writing import ask_token
from ersatz.service.rest import remembered
from ersatz.service.service import Service


@dataclass(slots=True)
class View:
    """What is asked; the link that reproduces it holds nothing else."""

    missing: str = ""
    available: list[str] = field(default_factory=list)
    instance: list[str] = field(default_factory=list)
    representative: str = "0.35"
    tolerance: str = "0.35"
    relevance_tolerance: str = "0.35"
    combine: str = "union"
    similarity: str = "jaccard"
    above_lowest: bool = False
    fallback: bool = False

    def settings(self) -> ReasonerSettings:
        """Return the reasoner's settings."""
        return ReasonerSettings(
            self.representative,  # type: ignore[arg-type] # thresholds are made exact by the settings
            self.tolerance,  # type: ignore[arg-type]
            self.relevance_tolerance,  # type: ignore[arg-type]
            self.combine,  # type: ignore[arg-type]
            self.similarity,  # type: ignore[arg-type]
            self.above_lowest,
            self.fallback,
        )

    def link(self) -> str:
        """Return the address of this view; what is as usual is left out."""
        usual = View()
        given = {
            name: getattr(self, name)
            for name in View.__slots__
            if getattr(self, name) != getattr(usual, name)
        }
        return link_to("/substitution", **given)


def add(service: Service) -> None:
    """Add the page."""

    @ui.page("/substitution", response_timeout=PATIENCE)
    async def substitution(
        missing: str = "",
        available: list[str] = Query(default=[]),  # noqa: B008 # how FastAPI declares it
        instance: list[str] = Query(default=[]),  # noqa: B008
        representative: str = "0.35",
        tolerance: str = "0.35",
        relevance_tolerance: str = "0.35",
        combine: str = "union",
        similarity: str = "jaccard",
        above_lowest: bool = False,
        fallback: bool = False,
    ) -> None:
        view = View(missing, available, instance, representative, tolerance, relevance_tolerance, combine,
                    similarity, above_lowest, fallback)  # fmt: skip
        await _page(service, view)


async def _page(service: Service, view: View) -> None:
    seen = await service.read(lambda: overview(service.kb))
    things = await service.read(lambda: individuals(service.kb))
    names = [name for _, name, _ in seen.classes]
    with frame(service, "Substitution", "/substitution"):
        heading("Substitution", "Name the missing tool and what is on the table.")
        with ui.element("div").classes("split wide"):
            controls = ui.element("section").classes("card")
            results = ui.element("div").props('aria-live="polite"')

        async def draw() -> None:
            ui.run_javascript(f"history.replaceState(null, '', {json.dumps(view.link())})")
            results.clear()
            with results:
                await _results(service, view)

        with controls:
            _controls(view, names, [name for _, name, _ in things], draw)
        with results:
            await _results(service, view)


def _controls(view: View, names: list[str], things: list[str], draw: Callable[[], Awaitable[None]]) -> None:
    def bound(box: Any, name: str, convert: Callable[[Any], Any] = lambda value: value) -> Any:
        async def changed() -> None:
            setattr(view, name, convert(box.value))
            await draw()

        box.on_value_change(changed)
        return box

    bound(picker("Missing tool", names, view.missing), "missing", lambda one: str(one or ""))
    for label, offered, name in (
        ("Classes on the table (none: all)", names, "available"),
        ("Individuals on the table", things, "instance"),
    ):
        bound(picker(label, offered, getattr(view, name), several=True), name, lambda some: list(some or []))
    for name, label, least in (
        ("representative", "Typical from θ", 0.05),
        ("relevance_tolerance", "Function relevant above φ", 0.0),
        ("tolerance", "Stands in above φ", 0.0),
    ):
        _threshold(view, name, label, least, bound)
    for name, options in (("similarity", list(CRISP)), ("combine", list(Combine))):
        box = ui.select([one.value for one in options], label=name, value=getattr(view, name))
        bound(box.props("outlined dense"), name)
    bound(ui.switch("Only functions above the lowest", value=view.above_lowest), "above_lowest")
    bound(ui.switch("With none relevant, compare all", value=view.fallback), "fallback")


def _threshold(view: View, name: str, label: str, least: float, bound: Callable[..., Any]) -> None:
    with ui.element("div").classes("line spread faint"):
        show(tag("span", label))
        says = ui.label(f"{_number(getattr(view, name)):.2f}")
    slider = ui.slider(min=least, max=1, step=0.05, value=_number(getattr(view, name)))
    slider.props(f'label debounce=150 color=teal-8 aria-label="{label}"')
    slider.on_value_change(lambda: says.set_text(f"{slider.value:.2f}"))
    bound(slider, name, lambda value: f"{value:g}")


def _number(text: str) -> float:
    try:
        return min(max(float(text), 0.0), 1.0)
    except ValueError:
        return 0.35


async def _results(service: Service, view: View) -> None:
    if not view.missing:
        notice("Choose the missing tool.")
        return
    try:
        ranking = await service.read(
            lambda: rank_substitutes(
                service.kb,
                view.missing,
                view.available or None,
                instances=view.instance,
                settings=view.settings(),
            )
        )
    except (ErsatzError, ValueError) as error:
        notice(str(error), bad=True)
        return
    with card():
        _question(service, view, ranking)
    if ranking.status is Status.UNDETERMINED:
        notice(
            "Undetermined: none of its functions is relevant. The last switch compares all that is typical.",
            bad=True,
        )
        return
    # Counterfactuals are searched for: not while others wait.
    drawn = await service.read(lambda: answers(ranking))
    accepted = sum(one.accepted for one in ranking[:MOST])
    title = (
        f"{accepted} of {len(ranking)} will do"
        if len(ranking) <= MOST
        else f"The best {MOST} of {len(ranking)}"
    )
    with card(title):
        show(drawn)


def _question(service: Service, view: View, ranking: Ranking) -> None:
    article = "an" if ranking.missing[:1] in "aeiou" else "a"
    link = tag(
        "button", "copy link", class_="copy", data_do="copy-link", aria_label="Copy the link to this view"
    )
    rows = tag("button", "copy table", class_="copy", data_do="copy", data_words=as_text(ranking),
               aria_label="Copy the ranking as a table")  # fmt: skip
    with ui.element("div").classes("line spread"):
        show(tag("strong", f"In place of {article} {ranking.missing}", class_="asked"))
        with ui.element("div").classes("line end"):
            show(joined((link, rows)), "line")
            save = ui.button("Save the substitution model", icon="bookmark_add")
            save.props("outline dense padding='4px 12px' color=teal-8").on_click(lambda: _save(service, view))
    show(counted(ranking))


def _save(service: Service, view: View) -> None:
    if not service.settings.writable:
        ui.notify("This service is read-only: start it with --writable to save.", type="warning")
        return
    ask_token(
        service,
        lambda: remembered(service, view.missing, view.available, view.instance, view.settings()),
        "Saved.",
    )
