"""The application: which command is in which module, and what every command shares."""

from importlib import import_module
from typing import Final

import click

from ersatz import __version__
from ersatz.cli.completion import install_completion, show_completion

MODULES: Final = {
    "fetch": "fetch",
    "build": "build",
    "observe": "update",
    "forget": "update",
    "demo": "substitute",
    "substitute": "substitute",
    "ask": "substitute",
    "ground": "substitute",
    "show": "inspect",
    "query": "inspect",
    "check": "inspect",
    "link": "share",
    "export": "share",
    "upload": "share",
    "serve": "share",
    "evaluate": "evaluate",
    "scenarios": "evaluate",
    "survey": "evaluate",
    "figure": "figures",
}
"""The module of each command, which has the command's name there; in the order of `ersatz --help`."""


class Commands(click.Group):
    """The commands; only the module of the one that is asked for is imported."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of all commands."""
        return list(MODULES)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Return the command of a name; none where a shell asks for what may still become one."""
        if cmd_name in MODULES:
            command = getattr(import_module(f"ersatz.cli.{MODULES[cmd_name]}"), cmd_name)
            assert isinstance(command, click.Command)
            return command
        if ctx.resilient_parsing:
            return None
        raise click.exceptions.NoSuchCommand(cmd_name, possibilities=MODULES, ctx=ctx)


@click.group(cls=Commands, invoke_without_command=True, context_settings={"show_default": True})
@click.version_option(__version__, message="%(version)s", help="Print the version and end.")
@install_completion
@show_completion
@click.pass_context
def app(context: click.Context) -> None:
    """Which of the things at hand can stand in for a missing tool, and why."""
    if context.invoked_subcommand is None:
        click.echo(context.get_help())
