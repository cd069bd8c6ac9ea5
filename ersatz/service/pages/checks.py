"""Checks: what is wrong with the knowledge base, live."""

import pyoxigraph as ox
from nicegui import ui

from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.names import local_name
from ersatz.knowledge.validation import Report, check, checks
from ersatz.service.pages.frame import PATIENCE, card, frame, heading, notice, show, table
from ersatz.service.pages.markup import link_to, tag
from ersatz.service.service import Service


def add(service: Service) -> None:
    """Add the page."""

    @ui.page("/checks", response_timeout=PATIENCE)
    async def checks_page() -> None:
        with frame(service, "Checks", "/checks"):
            heading("Checks", "Every rule is a query that must find nothing; this runs them now.")
            place = ui.element("div").props('aria-live="polite"')
            with place:
                ui.spinner(size="lg", color="teal-8")

            async def run() -> None:
                report = await service.read(lambda: _report(service.kb))
                place.clear()
                with place:
                    _draw(report)

            ui.timer(0.1, run, once=True)


def _report(kb: KnowledgeBase) -> Report:
    store = ox.Store()
    store.bulk_extend(ox.Quad(t.subject, t.predicate, t.object) for t in kb.triples())
    return check(store, rules=[one.rule for one in checks()])


def _draw(report: Report) -> None:
    found: dict[str, int] = {}
    for finding in report.findings:
        found[finding.rule] = found.get(finding.rule, 0) + 1
    if report.ok:
        notice(f"All is well: {len(report.ran)} rules found nothing.")
    else:
        notice(f"{len(report.findings)} findings by {len(found)} of {len(report.ran)} rules.", bad=True)
        with card("Findings"):
            table(
                ["rule", "where", "what", "what to do"],
                [
                    (
                        one.rule.replace("_", " "),
                        (local_name(one.entity), link_to("/graph", node=local_name(one.entity))),
                        one.message,
                        one.mend,
                    )
                    for one in report.findings[:500]
                ],
            )
    summaries = {one.rule: one.summary for one in checks()}
    with card(f"Rules ({len(report.ran)})"):
        table(
            ["", "rule", "what must be"],
            [
                ("✗" if rule in found else "✓", rule.replace("_", " "), summaries.get(rule, ""))
                for rule in report.ran
            ],
        )
    for skipped in report.skipped:
        show(tag("div", skipped, class_="faint"))
