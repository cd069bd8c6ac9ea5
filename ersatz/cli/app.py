"""The application, to which every module of commands adds its own."""

from typing import Annotated

import typer

from ersatz import __version__

app = typer.Typer(
    name="ersatz",
    help="Which of the things at hand can stand in for a missing tool, and why.",
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)


@app.callback(invoke_without_command=True)
def _options(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Print the version and end.")] = False,
) -> None:
    if version:
        typer.echo(__version__)
        raise typer.Exit
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())
