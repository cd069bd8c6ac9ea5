"""Looking into a knowledge base: what it holds, answers to questions, what is wrong with it."""

import sys
from collections.abc import Sequence
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from ersatz.cli.app import app
from ersatz.cli.options import Location
from ersatz.cli.terminal import console, open_kb, print_json
from ersatz.errors import InputError


class TableFormat(StrEnum):
    """How an answer is printed."""

    TABLE = "table"
    JSON = "json"
    CSV = "csv"
    TTL = "ttl"


@app.command()
def show(
    location: Location,
    name: Annotated[str | None, typer.Argument(help="A class, instance, property or quality.")] = None,
) -> None:
    """Show what a knowledge base holds, or what it knows of one thing.

    Example: ersatz show household "coffee mug"
    """
    from ersatz.display import show_knowledge, show_thing

    kb = open_kb(location)
    if name is None:
        show_knowledge(console(), kb)
    else:
        show_thing(console(), kb, name)


@app.command()
def query(
    location: Location,
    name: Annotated[str | None, typer.Argument(metavar="NAME_OR_FILE", help="Without it: the list.")] = None,
    param: Annotated[list[str] | None, typer.Option(help="name=value; repeatable.")] = None,
    as_format: Annotated[
        TableFormat, typer.Option("--format", help="How to print the answer.")
    ] = TableFormat.TABLE,
) -> None:
    """Ask a stored question, or one of your own in a file.

    Example: ersatz query household class_knowledge --param class=tray
    """
    from ersatz.display import show_questions
    from ersatz.knowledge.queries import query_names, read_query, stored_query

    kb = open_kb(location)
    if name is None:
        show_questions(console(), [stored_query(one) for one in query_names() if "/" not in one])
        return
    question = read_query(Path(name)) if name.endswith((".rq", ".sparql")) else stored_query(name)
    _print_answer(kb.answer(question, _arguments(param or [], question.parameters)), as_format)


@app.command()
def check(
    location: Location,
    reason: Annotated[
        bool, typer.Option("--reason", help="Also ask HermiT for contradictions; needs Java.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the report as JSON.")] = False,
) -> None:
    """Look for everything that can be wrong with a knowledge base. Exit code 1: something was found.

    Example: ersatz check kb.ttl --reason
    """
    from ersatz.knowledge.validation import check as check_store
    from ersatz.knowledge.validation import check_file

    path = _path_of(location)
    report = (
        check_file(path, reason) if path is not None else check_store(open_kb(location).triples(), reason)
    )
    if as_json:
        print_json(report.as_dict())
    else:
        from ersatz.display import show_report

        show_report(console(), report)
    raise typer.Exit(0 if report.ok else 1)


def _path_of(location: str) -> Path | None:
    """Return the file a knowledge base is in, if it is in one."""
    from ersatz.knowledge.base import SHIPPED
    from ersatz.resources import ONTOLOGY

    path = ONTOLOGY / f"{location}.ttl" if location in SHIPPED else Path(location)
    return path if path.is_file() and path.suffix != ".gz" else None


def _arguments(params: Sequence[str], kinds: Any) -> dict[str, Any]:
    arguments: dict[str, Any] = {}
    for one in params:
        name, equals, value = one.partition("=")
        if not equals:
            raise InputError(f"--param {one!r}: write name=value")
        arguments[name] = value.split(",") if kinds.get(name) == "iris" else value
    return arguments


def _print_answer(answer: Any, as_format: TableFormat) -> None:
    if as_format is TableFormat.JSON:
        print_json([{name: _plain(value) for name, value in row.items()} for row in answer])
    elif as_format is TableFormat.CSV:
        import csv

        writer = csv.writer(sys.stdout, lineterminator="\n")
        writer.writerow(answer.variables)
        writer.writerows([["" if value is None else value for value in row] for row in answer.rows])
    elif as_format is TableFormat.TTL:
        sys.stdout.write(answer.to_turtle())
    else:
        from ersatz.display import answer_table

        console().print(answer_table(answer))


def _plain(value: Any) -> Any:
    """Return a value in JSON's types; decimals as numbers."""
    from decimal import Decimal

    if isinstance(value, Decimal):
        return int(value) if value == value.to_integral_value() else float(value)
    return value
