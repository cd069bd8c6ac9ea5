"""Looking into a knowledge base: what it holds, answers to questions, what is wrong with it."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from ersatz.cli import options
from ersatz.cli.terminal import console, open_kb, print_json
from ersatz.errors import InputError


@click.command()
@options.location
@click.argument("name", required=False, help="A class, instance, property or quality.")
def show(location: str, name: str | None) -> None:
    """Show what a knowledge base holds, or what it knows of one thing.

    Example: ersatz show household "coffee mug"
    """
    kb = open_kb(location)
    from ersatz.display import show_knowledge, show_thing

    if name is None:
        show_knowledge(console(), kb)
    else:
        show_thing(console(), kb, name)


@click.command()
@options.location
@click.argument("name", metavar="[NAME_OR_FILE]", required=False, help="Without it: the list.")
@click.option("--param", multiple=True, help="name=value; repeatable.")
@click.option(
    "--format",
    "as_format",
    type=click.Choice(["table", "json", "csv", "ttl"]),
    default="table",
    help="How to print the answer.",
)
def query(location: str, name: str | None, param: tuple[str, ...], as_format: str) -> None:
    """Ask a stored question, or one of your own in a file.

    Example: ersatz query household class_knowledge --param class=tray
    """
    kb = open_kb(location)
    from ersatz.display import show_questions
    from ersatz.knowledge.queries import query_names, read_query, stored_query

    if name is None:
        show_questions(console(), [stored_query(one) for one in query_names() if "/" not in one])
        return
    question = read_query(Path(name)) if name.endswith((".rq", ".sparql")) else stored_query(name)
    _print_answer(kb.answer(question, _arguments(param, question.parameters)), as_format)


@click.command()
@options.location
@click.option("--reason", is_flag=True, help="Also ask HermiT for contradictions; needs Java.")
@options.as_json
def check(location: str, reason: bool, as_json: bool) -> int:
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
    return 0 if report.ok else 1


def _path_of(location: str) -> Path | None:
    """Return the file a knowledge base is in, if it is in one."""
    from ersatz.knowledge.opening import path_of

    path = path_of(location)
    return path if path.is_file() and path.suffix != ".gz" else None


def _arguments(params: Sequence[str], kinds: Any) -> dict[str, Any]:
    arguments: dict[str, Any] = {}
    for one in params:
        name, equals, value = one.partition("=")
        if not equals:
            raise InputError(f"--param {one!r}: write name=value")
        arguments[name] = value.split(",") if kinds.get(name) == "iris" else value
    return arguments


def _print_answer(answer: Any, as_format: str) -> None:
    if as_format == "json":
        print_json([{name: _plain(value) for name, value in row.items()} for row in answer])
    elif as_format == "csv":
        import csv

        writer = csv.writer(sys.stdout, lineterminator="\n")
        writer.writerow(answer.variables)
        writer.writerows([["" if value is None else value for value in row] for row in answer.rows])
    elif as_format == "ttl":
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
