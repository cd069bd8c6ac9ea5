"""Substitution: what is missing, what is on the table, and what will do."""

import json
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from typing import Any, Final

from fastapi import Query
from nicegui import ui

from ersatz.errors import ErsatzError
from ersatz.reasoner.relevance import Combine, ReasonerSettings
from ersatz.reasoner.similarity import CRISP, GRADED
from ersatz.reasoner.substitution import Ranking, Status
from ersatz.service.pages.data import individuals, overview
from ersatz.service.pages.frame import PATIENCE, card, frame, heading, notice, show
from ersatz.service.pages.markup import joined, link_to, tag
from ersatz.service.pages.picker import picker
from ersatz.service.pages.ranking import MOST, answers, as_text, counted
from ersatz.service.pages.writing import ask_token
from ersatz.service.rest import rank
from ersatz.service.service import Service

_TUNED: Final = ("representative", "tolerance", "relevance_tolerance", "combine", "similarity")


@dataclass(slots=True)
class View:
    """What is asked; the link that reproduces it holds nothing else."""

    missing: str = ""
    available: list[str] = field(default_factory=list)
    instance: list[str] = field(default_factory=list)
    representative: str = ""
    tolerance: str = ""
    relevance_tolerance: str = ""
    combine: str = ""
    similarity: str = ""
    graded: bool = False
    confidence: bool = False
    above_lowest: bool = False
    fallback: bool = False

    def settings(self) -> ReasonerSettings:
        """Return the reasoner's settings; what is empty is as usual."""
        given: dict[str, Any] = {name: getattr(self, name) for name in _TUNED if getattr(self, name)}
        return ReasonerSettings(
            graded=self.graded, above_lowest=self.above_lowest, fallback=self.fallback, **given
        )

    def begin_anew(self) -> None:
        """Forget what is set for crisp or for graded reasoning: the other has another usual."""
        for name in _TUNED:
            setattr(self, name, "")

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
        representative: str = "",
        tolerance: str = "",
        relevance_tolerance: str = "",
        combine: str = "",
        similarity: str = "",
        graded: bool = False,
        confidence: bool = False,
        above_lowest: bool = False,
        fallback: bool = False,
    ) -> None:
        view = View(missing, available, instance, representative, tolerance, relevance_tolerance, combine,
                    similarity, graded, confidence, above_lowest, fallback)  # fmt: skip
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
    bound(ui.switch("Say how sure it is", value=view.confidence), "confidence")
    graded = ui.switch("Graded: reason with degrees", value=view.graded)
    tuned = ui.element("div")
    with tuned:
        _tuned(view, bound)

    async def regrade() -> None:
        view.graded = graded.value
        view.begin_anew()
        tuned.clear()
        with tuned:
            _tuned(view, bound)
        await draw()

    graded.on_value_change(regrade)
    bound(ui.switch("Only functions above the lowest", value=view.above_lowest), "above_lowest")
    bound(ui.switch("With none relevant, compare all", value=view.fallback), "fallback")


def _tuned(view: View, bound: Callable[..., Any]) -> None:
    """Draw the settings that differ between crisp and graded reasoning."""
    try:
        now = view.settings()
    except ErsatzError:  # the results say what is wrong
        now = ReasonerSettings(graded=view.graded)
    crisp = (("representative", "Typical from θ", 0.05),)
    for name, label, least in (
        *(() if view.graded else crisp),
        ("relevance_tolerance", "Function relevant above φ", 0.0),
        ("tolerance", "Stands in above φ", 0.0),
    ):
        _threshold(float(getattr(now, name)), name, label, least, bound)
    forms = GRADED if view.graded else CRISP
    choices = (("similarity", forms, now.similarity), ("combine", tuple(Combine), now.combine))
    for choice, options, value in choices[: 1 if view.graded else 2]:
        box = ui.select([one.value for one in options], label=choice, value=value.value)
        bound(box.props("outlined dense"), choice)


def _threshold(value: float, name: str, label: str, least: float, bound: Callable[..., Any]) -> None:
    with ui.element("div").classes("line spread faint"):
        show(tag("span", label))
        says = ui.label(f"{value:.2f}")
    slider = ui.slider(min=least, max=1, step=0.05, value=value)
    slider.props(f'label debounce=150 color=teal-8 aria-label="{label}"')
    slider.on_value_change(lambda: says.set_text(f"{slider.value:.2f}"))
    bound(slider, name, lambda now: f"{now:g}")


async def _results(service: Service, view: View) -> None:
    if not view.missing:
        notice("Choose the missing tool.")
        return
    try:
        ranking = await service.read(lambda: _rank(service, view))
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


def _rank(service: Service, view: View, *, remember: bool = False) -> Ranking:
    asked = view.missing, view.available, view.instance, view.settings()
    return rank(service.kb, *asked, confidence=view.confidence, remember=remember)


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
        lambda: _rank(service, view, remember=True),
        "Saved.",
    )
