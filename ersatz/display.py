"""What the command line shows a person: tables and sentences, by Rich."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from rich.console import Console
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from ersatz.knowledge.answers import Answer, Value
from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.models import Entry
from ersatz.knowledge.names import local_name
from ersatz.knowledge.queries import Query
from ersatz.knowledge.terms import rough_text
from ersatz.knowledge.vocabulary import ERSATZ, KB
from ersatz.reasoner.explanation import VISIBLE
from ersatz.reasoner.relevance import Spacing
from ersatz.reasoner.representative import class_model, function_model
from ersatz.reasoner.substitution import Ranking, Status

if TYPE_CHECKING:
    from ersatz.knowledge.validation import Report
    from ersatz.pipeline import Grounded
    from ersatz.reasoner.asking import Wishes

BAR: Final = 10
"""Characters of a full bar."""

MINOR: Final = 0.05
"""Weights below, and below half of the greatest, are not shown."""

SPACED: Final = {
    Spacing.RANK: "",
    Spacing.CENTROID: ", spaced by centroids",
    Spacing.RATIO: ", spaced by ratios of centroids",
}


def show_ranking(console: Console, ranking: Ranking, most: int | None = None) -> None:
    """Print which things stand in for the missing tool, and why."""
    settings = ranking.settings
    console.print(f"[bold]{escape(ranking.missing)}[/bold] is missing.", highlight=False)
    if ranking.status is Status.UNDETERMINED:
        console.print(
            f"Undetermined: none of its functions is relevant (J > {float(settings.relevance_tolerance):g}). "
            "--fallback compares with all that is typical of it."
        )
        return
    if settings.graded:
        _show_weights(console, ranking)
    elif ranking.relevant_functional:
        console.print(f"What it is for: {', '.join(ranking.relevant_functional)}", highlight=False)
    if not settings.graded:
        counts = ", ".join(ranking.relevant_physical) or "nothing"
        console.print(f"What counts:    {counts}", highlight=False)
    table = Table(box=None, show_header=False, pad_edge=False, padding=(0, 1, 1, 0))
    for _ in range(3):
        table.add_column(no_wrap=True)
    table.add_column(ratio=1)
    for substitute in ranking[:most]:
        verdict = Text("stands in", "green") if substitute.accepted else Text("does not", "red")
        sure = f"{substitute.confidence.sentence()} " if substitute.confidence else ""
        words = Text.assemble(substitute.reasons() + ". ", (sure, "bold"), (substitute.turning(), "dim"))
        table.add_row(verdict, Text(substitute.name, "bold"), bar(substitute.similarity), words)
    console.print(table, highlight=False)
    if most is not None and len(ranking) > most:
        console.print(f"  … and {len(ranking) - most} more", style="dim")
    if ranking.reused:
        console.print("Remembered from an earlier question.", style="dim")


def _show_weights(console: Console, ranking: Ranking) -> None:
    """Print how relevant functions and properties are, and which functions make a property relevant."""
    table = Table(box=None, show_header=False, pad_edge=False, padding=(0, 1, 0, 0))
    for _ in range(3):
        table.add_column(no_wrap=True)
    table.add_column(ratio=1, style="dim")
    title = "What it is for"
    functions = ranking.weights()["functions"]
    least = min(MINOR, max(functions.values(), default=0) / 2)
    for name, weight in functions.items():
        if weight >= least:
            table.add_row(title, name, bar(weight))
            title = ""
    title = "What counts"
    for one in ranking.property_weights:
        if one.weight >= MINOR:
            strongest = [pair for pair in one.functions[:3] if pair[1] >= VISIBLE]
            behind = ", ".join(f"{name} {share:.2f}" for name, share in strongest)
            table.add_row(title, one.property, bar(one.weight), behind and f"by {behind}")
            title = ""
    console.print(table, highlight=False)
    spaced = SPACED[ranking.settings.spacing]
    console.print(f"How alike: {ranking.settings.similarity}{spaced}\n", highlight=False)


def show_wishes(console: Console, wishes: "Wishes", most: int = 10) -> None:
    """Print what is in doubt, and what to measure, the most telling first."""
    console.print(f"[bold]{escape(wishes.missing)}[/bold] is missing.", highlight=False)
    several = len(wishes.candidates) > 1
    sure = Table("", "stands in", *(["most similar"] if several else []), box=None, pad_edge=False)
    for one in wishes.candidates[:most]:
        sure.add_row(escape(one.name), bar(one.accepted), *([f"{one.best:.2f}"] if several else []))
    console.print(sure, highlight=False)
    if not wishes.wishes:
        console.print("No measurement is expected to change the decision.")
        return
    asked = Table("measure", "of", "known from", "doubt less by", box=None, pad_edge=False)
    for wish in wishes.wishes[:most]:
        of = f"another {wish.thing}" if wish.kind in ("tool", "class") else wish.thing
        known = f"{wish.known:g}" if wish.kind in ("tool", "class") else ""
        asked.add_row(wish.property, escape(of), known, f"{wish.gain:.1%}")
    console.print(f"Doubt: {wishes.doubt:.2f} of at most {wishes.most:.2f}.", highlight=False)
    console.print(asked, highlight=False)


def show_grounded(console: Console, grounded: "Grounded", most: int = 5) -> None:
    """Print what a scan tells: the qualities held, the nearest classes, and what it could stand in for."""
    held = Table("property", "quality", "value", "unit", box=None, pad_edge=False)
    for one in grounded.held:
        unit = "" if one.unit == "1" else one.unit
        quality = ", ".join(f"{name} {degree:.2f}" for name, degree in one.degrees) or one.quality
        held.add_row(one.property, quality, " x ".join(f"{value:.3g}" for value in one.value), unit)
    console.print(f"[bold]{escape(grounded.scan)}[/bold]", held, highlight=False)
    likes = Table("like", "", box=None, pad_edge=False)
    for like in grounded.classes[:most]:
        likes.add_row(like.name, bar(float(like.similarity)))
    roles = Table("could stand in for", "", box=None, pad_edge=False)
    for role in [role for role in grounded.roles if role.accepted][:most]:
        roles.add_row(role.tool, bar(float(role.similarity)))
    console.print(likes, roles if roles.row_count else "It stands in for nothing that is known.")


def show_knowledge(console: Console, kb: KnowledgeBase) -> None:
    """Print what a knowledge base holds."""
    console.print(f"[bold]{escape(kb.location)}[/bold]  revision {kb.revision[:12]}", highlight=False)
    properties = Table("property", "kind", "unit", "qualities", "what is measured", box=None, pad_edge=False)
    counted = [local_name(str(row["property"])) for row in kb.ask("qualities")]
    for row in kb.ask("properties"):
        name = local_name(str(row["property"]))
        properties.add_row(
            name, str(row["kind"]), str(row["unit"]), str(counted.count(name)), str(row["definition"] or "")
        )
    classes = Table("class", "counted", box=None, pad_edge=False)
    for row in kb.ask("classes"):
        classes.add_row(escape(str(row["name"])), str(row["instances"]))
    console.print(properties, classes)


def show_thing(console: Console, kb: KnowledgeBase, name: str) -> None:
    """Print what is known of a class, an instance, a property or a quality."""
    iri = kb.resolve(name)
    kind = kb.kind_of(iri)
    console.print(f"[bold]{escape(name)}[/bold]  {kind}  <{iri}>", highlight=False)
    if kind == "class":
        model = class_model(kb, iri)
        console.print(f"known from {model.instances}", highlight=False)
        console.print(_entries(model.entries))
    elif kind == "instance":
        console.print(_held(kb, iri))
        console.print(answer_table(kb.ask("instance_measurements", instance=iri)))
    elif kind == "property":
        rows = [row for row in kb.ask("qualities") if row["property"] == iri]
        console.print(rows_table(rows))
    else:
        if any(row["function"] == iri for row in kb.ask("function_models")):
            console.print(_entries(function_model(kb, iri).entries))
        console.print(answer_table(kb.ask("classes_with_quality", quality=iri)))


def show_report(console: Console, report: "Report") -> None:
    """Print what a check found, and what it could not try."""
    for finding in report.findings:
        console.print(f"[red]{finding.rule}[/red]  [bold]{shown(finding.entity)}[/bold]", highlight=False)
        console.print(f"  {escape(finding.message)}\n  [dim]{escape(finding.mend)}[/dim]", highlight=False)
    for reason in report.skipped:
        console.print(f"[yellow]not tried[/yellow]  {escape(reason)}", highlight=False)
    what = f"{len(report.findings)} found" if report.findings else "nothing found"
    console.print(f"{len(report.ran)} checks: {what}.", highlight=False)


def show_questions(console: Console, queries: Sequence[Query]) -> None:
    """Print the stored questions and their parameters."""
    table = Table("question", "parameters", "what it answers", box=None, pad_edge=False)
    for query in queries:
        table.add_row(
            query.name, " ".join(f"{n}={t.upper()}" for n, t in query.parameters.items()), query.summary
        )
    console.print(table)


def answer_table(answer: Answer) -> Table:
    """Return an answer as a table; names instead of IRIs of our own."""
    table = Table(*answer.variables, box=None, pad_edge=False)
    for row in answer.rows:
        table.add_row(*map(shown, row))
    return table


def rows_table(rows: Sequence[object]) -> Table:
    """Return rows of an answer as a table, without columns that are empty."""
    found = [row for row in rows if isinstance(row, dict)]
    names = [name for name in (found[0] if found else ()) if any(row[name] is not None for row in found)]
    table = Table(*names, box=None, pad_edge=False)
    for row in found:
        table.add_row(*(shown(row[name]) for name in names))
    return table


def shown(value: Value) -> str:
    """Return a value as a person reads it."""
    if value is None:
        return ""
    text = str(value)
    return escape(local_name(text) if text.startswith((KB, ERSATZ)) else text)


def bar(share: float) -> Text:
    """Return a share as a bar and a number."""
    full = round(share * BAR)
    return Text.assemble((f"{share:.2f} ", "bold"), ("█" * full, "cyan"), ("░" * (BAR - full), "dim"))


def _held(kb: KnowledgeBase, instance: str) -> Table:
    """Return what an instance holds and, where that is not all or nothing, how far."""
    rows = kb.ask("instance_memberships", instances=[instance])
    if all(row["count"] == row["total"] for row in rows):
        return answer_table(kb.ask("instance_qualities", instances=[instance]))
    table = Table("quality", "degree", box=None, pad_edge=False)
    for row in rows:
        table.add_row(shown(row["quality"]), bar(float(str(row["count"])) / float(str(row["total"]))))
    return table


def _entries(entries: Sequence[Entry]) -> Table:
    table = Table("property", "quality", "degree", "observed", box=None, pad_edge=False)
    previous = ""
    for entry in entries:
        name = entry.property if entry.property != previous else ""
        previous = entry.property
        observed = f"{rough_text(entry.count)} of {rough_text(entry.total)}"
        table.add_row(name, entry.quality, bar(float(entry.proportion)), observed)
    return table
