"""Qualities: which classes and individuals have one, and what goes with a function."""

from typing import Any, Final

from nicegui import ui

from ersatz.errors import ErsatzError
from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.names import local_name
from ersatz.knowledge.terms import degree_text
from ersatz.knowledge.vocabulary import KB
from ersatz.reasoner.representative import function_model, load_knowledge
from ersatz.service.pages.data import qualities
from ersatz.service.pages.frame import PATIENCE, card, frame, notice, show, title_line
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
    words_of,
)
from ersatz.service.service import Service

MOST: Final = 200
"""Things of a list that are drawn."""


def add(service: Service) -> None:
    """Add the page."""

    @ui.page("/qualities/{name}", response_timeout=PATIENCE)
    async def quality(name: str) -> None:
        iri = KB + name
        try:
            of = (await service.read(lambda: qualities(service.kb)))[iri]["property"]
            rows = await service.read(lambda: service.kb.ask("classes_with_quality", quality=iri).rows)
            holders = await service.read(lambda: service.kb.ask("holders", quality=iri).rows)
            model = await service.read(lambda: _model(service.kb, iri))
        except (ErsatzError, ValueError, KeyError):
            with frame(service, "Unknown quality", "/properties"):
                notice(f"There is no quality {name!r}.", bad=True)
            return
        with frame(service, words_of(name), "/properties"):
            title_line(words_of(name), iri)
            prop = str(of)
            whose = link(words_of(local_name(prop)), page_of("property", prop))
            show(tag("p", "A quality of ", whose, ".", class_="lead"))
            if model:
                with card("What goes with it"):
                    show(_bars([(KB + n, words_of(n), count, total) for n, count, total in model], "quality"))
            with card("Classes that have it"):
                show(_bars([(str(c), local_name(str(c)), n, t) for c, n, t, _ in rows[:MOST]], "class"))
            with card(f"Individuals that hold it ({len(holders)})"):
                held = (chip(local_name(str(i)), page_of("instance", str(i))) for i, _ in holders[:MOST])
                show(chips(held, "None is known."))
            with card("More"):
                show(
                    chips(
                        (
                            chip("its neighbourhood", link_to("/graph", node=name)),
                            chip("as Turtle", f"/kb/{name}"),
                        )
                    )
                )


def _bars(rows: list[tuple[str, str, Any, Any]], kind: str) -> Markup:
    if not rows:
        return tag("div", "None.", class_="soft")
    return bars(
        (
            link(name, page_of(kind, iri)),
            bar(float(count) / float(total), typical=True, functional=kind == "quality"),
            f"{count} of {total}",
        )
        for iri, name, count, total in rows
    )


def _model(kb: KnowledgeBase, iri: str) -> list[tuple[str, str, str]]:
    known = kb.view(load_knowledge)
    if iri not in known.functions.iris:
        return []
    entries = sorted(function_model(kb, iri).entries, key=lambda one: -one.proportion)
    return [(one.quality, degree_text(one.count), degree_text(one.total)) for one in entries[:24]]
