"""Completion of commands and options by the shell."""

import os
from functools import partial
from pathlib import Path
from typing import Final

import click

from ersatz.errors import InputError

_VARIABLE: Final = "_ERSATZ_COMPLETE"
_STARTS: Final = {
    "bash": (".bashrc", f'eval "$({_VARIABLE}=bash_source ersatz)"'),
    "zsh": (".zshrc", f'eval "$({_VARIABLE}=zsh_source ersatz)"'),
    "fish": (".config/fish/completions/ersatz.fish", f"{_VARIABLE}=fish_source ersatz | source"),
}
"""The file in the user's home that each shell reads, and the line there that turns completion on."""


def _install(context: click.Context, _: click.Parameter, wanted: bool) -> None:
    if wanted and not context.resilient_parsing:
        name, line = _STARTS[_shell()]
        file = Path.home() / name
        if not file.exists() or line not in file.read_text(encoding="utf-8").splitlines():
            file.parent.mkdir(parents=True, exist_ok=True)
            with file.open("a", encoding="utf-8") as text:
                text.write(f"\n{line}\n")
        click.echo(f"{file}: completes ersatz in every new shell")
        context.exit()


def _show(context: click.Context, _: click.Parameter, wanted: bool) -> None:
    if wanted and not context.resilient_parsing:
        from click.shell_completion import get_completion_class

        kind = get_completion_class(_shell())
        assert kind is not None
        click.echo(kind(context.command, {}, "ersatz", _VARIABLE).source())
        context.exit()


def _shell() -> str:
    shell = Path(os.environ.get("SHELL", "")).name
    if shell not in _STARTS:
        raise InputError(f"no completion for the shell {shell!r}: set SHELL to bash, zsh or fish")
    return shell


_switch = partial(click.option, is_flag=True, is_eager=True, expose_value=False)
install_completion = _switch(
    "--install-completion", callback=_install, help="Install completion for the current shell."
)
show_completion = _switch(
    "--show-completion",
    callback=_show,
    help="Show completion for the current shell, to copy it or customize the installation.",
)
