"""Substitution: what is missing, what is on the table, and what will do."""

import json
from dataclasses import dataclass, field
from typing import Any

from fastapi import Query
from nicegui import ui

from ersatz.errors import ErsatzError
from ersatz.knowledge.vocabulary import KB
from ersatz.reasoner.explanation import Evidence
from ersatz.reasoner.relevance import Combine, ReasonerSettings
from ersatz.reasoner.similarity import CRISP
from ersatz.reasoner.substitution import Ranking, Status, Substitute, rank_substitutes
from ersatz.service.inspection import RefusedError
from ersatz.service.pages.data import individuals, overview
from ersatz.service.pages.frame import (
    PATIENCE,
    bar,
    card,
    chip,
    chips,
    copy_button,
    frame,
    heading,
    link_to,
    notice,
    page_of,
    text,
    words_of,
)
from ersatz.service.pages.home import offered
from ersatz.service.rest import remembered
from ersatz.service.service import Service

MOST = 30
"""Candidates that are drawn."""


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


def _controls(view: View, names: list[str], things: list[str], draw: Any) -> None:
    def bound(box: Any, name: str, convert: Any = lambda value: value) -> Any:
        async def changed() -> None:
            setattr(view, name, convert(box.value))
            await draw()

        box.on_value_change(changed)
        return box

    def choose(label: str, options: list[str], name: str, *, several: bool) -> None:
        value = getattr(view, name)
        options = offered(options, *(value if several else [value]))
        box = ui.select(
            options,
            label=label,
            value=value or ([] if several else None),
            with_input=True,
            new_value_mode="add-unique",
            multiple=several,
        )
        box.props("outlined dense use-chips" if several else "outlined dense").style(
            "width: 100%; margin-bottom: 12px"
        )
        bound(box, name, lambda chosen: list(chosen or []) if several else str(chosen or ""))

    choose("Missing tool", names, "missing", several=False)
    choose("Classes on the table (none: all)", names, "available", several=True)
    choose("Individuals on the table", things, "instance", several=True)
    for name, label, least in (
        ("representative", "Typical from θ", 0.05),
        ("relevance_tolerance", "Function relevant above φ", 0.0),
        ("tolerance", "Stands in above φ", 0.0),
    ):
        ui.label(label).classes("faint")
        slider = ui.slider(min=least, max=1, step=0.05, value=_number(getattr(view, name)))
        slider.props(f'label color=teal-8 aria-label="{label}"').on("change", lambda: None)
        bound(slider.props("debounce=150"), name, lambda value: f"{value:g}")
    for name, options in (("similarity", list(CRISP)), ("combine", list(Combine))):
        box = ui.select([one.value for one in options], label=name, value=getattr(view, name))
        bound(box.props("outlined dense").style("width: 100%; margin-top: 10px"), name)
    bound(ui.switch("Only functions above the lowest", value=view.above_lowest), "above_lowest")
    bound(ui.switch("With none relevant, compare all", value=view.fallback), "fallback")


def _number(text_: str) -> float:
    try:
        return min(max(float(text_), 0.0), 1.0)
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
    shown = ranking[:MOST]
    # Counterfactuals are searched for: not while others wait.
    answers = await service.read(lambda: [_Answer(one) for one in shown])
    accepted = sum(one.accepted for one in shown)
    title = (
        f"{accepted} of {len(ranking)} will do"
        if len(ranking) <= MOST
        else f"The best {MOST} of {len(ranking)}"
    )
    with card(title):
        for answer in answers:
            _draw_answer(answer, float(ranking.settings.tolerance))


class _Answer:
    """What is drawn of a candidate."""

    def __init__(self, one: Substitute) -> None:
        self.one = one
        self.words = one.explain().partition(": ")[2]
        self.evidence = (("good", one.shared), ("bad", one.lacking), ("much", one.extra))


def _question(service: Service, view: View, ranking: Ranking) -> None:
    with ui.element("div").classes("line"):
        article = "an" if ranking.missing[:1] in "aeiou" else "a"
        text(f"In place of {article} {ranking.missing}", "strong").style("font-size: 19px")
        with ui.element("div").classes("line end"):
            button = ui.button(icon="link").props(
                'flat dense round color=grey aria-label="Copy the link to this view"'
            )
            button.tooltip("Copy the link to this view").on(
                "click", js_handler="() => navigator.clipboard.writeText(location.href)"
            )
            copy_button(_as_text(ranking), "Copy the ranking as a table")
            save = ui.button("Save the substitution model", icon="bookmark_add").props(
                "outline dense color=teal-8"
            )
            save.on_click(lambda: _save(service, view))
    for title, names, sort in (
        ("What it is for", ranking.relevant_functional, "info"),
        ("What counts", ranking.relevant_physical, "good"),
    ):
        ui.label(title).classes("faint").style("margin-top: 8px")
        with chips():
            for name in names:
                chip(words_of(name), page_of("quality", KB + name), sort)
            if not names:
                ui.label("nothing").classes("soft")
    if ranking.reused:
        ui.label("Remembered from an earlier question.").classes("faint")


def _as_text(ranking: Ranking) -> str:
    rows = ["name\tsimilarity\taccepted"]
    rows += [f"{one.name}\t{one.similarity:.6f}\t{one.accepted}" for one in ranking[:1000]]
    return "\n".join(rows)


def _draw_answer(answer: _Answer, tolerance: float) -> None:
    one = answer.one
    with ui.element("article").classes("answer"):
        with ui.element("div").classes("rank"):
            ui.label("✓" if one.accepted else "–").classes("mark yes" if one.accepted else "mark no")
            with ui.element("div").classes("line"):
                ui.link(one.name, page_of(one.kind, one.iri)).classes("who")
                for flag in one.flags:
                    chip(flag.replace("_", " "), sort="bad")
            bar(one.similarity, typical=one.accepted, mark=tolerance)
            ui.label(f"{one.similarity:.2f}").classes("value").tooltip(
                f"exactly {one.fraction}, dimensionless"
            )
        text(answer.words, "p")
        with chips():
            for sort, found in answer.evidence:
                for evidence in found:
                    _evidence(evidence, sort)


def _evidence(evidence: Evidence, sort: str) -> None:
    mark = {"good": "✓", "bad": "✗", "much": "+"}[sort]
    meaning = {"good": "shared", "bad": "lacking", "much": "extra"}[sort]
    link = ui.link(f"{mark} {words_of(evidence.quality)}", page_of("quality", KB + evidence.quality))
    link.classes(f"chip {sort}").tooltip(
        f"{meaning}: {evidence.to_json()['observed'][0]} of {evidence.to_json()['observed'][1]} observed"
    )


async def _save(service: Service, view: View) -> None:
    if not service.settings.writable:
        ui.notify("This service is read-only: start it with --writable to save.", type="warning")
        return
    with ui.dialog() as dialog, ui.card():
        ui.label("Saving needs the token of this service.")
        token = ui.input("Token", password=True).props("outlined dense autofocus autocomplete=off")

        async def confirm() -> None:
            if not service.has_token(str(token.value)):
                ui.notify("That is not the token.", type="negative")
                return
            try:
                await service.write(
                    lambda: remembered(service, view.missing, view.available, view.instance, view.settings())
                )
                ui.notify("Saved.", type="positive")
            except RefusedError as error:
                ui.notify(str(error), type="negative")
            dialog.close()

        ui.button("Save", on_click=confirm).props("unelevated color=teal-8")
    dialog.open()
