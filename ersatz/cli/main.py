"""The entry point: runs a command; errors are one line, and exit code 2."""

import sys
import warnings
from typing import Any, Final

import typer

from ersatz.cli.app import app
from ersatz.cli.terminal import fail
from ersatz.errors import ErsatzError, ErsatzWarning

# Importing a module adds its commands, in the order of `ersatz --help`.
from ersatz.cli import fetch, build, substitute, inspect, update, share, evaluate, figures  # noqa: F401  isort: skip

# Typer has brought its own click since 0.20; what it raises is the parent of what it exports.
_CLICK_ERROR: Final[Any] = next(t for t in typer.BadParameter.__mro__ if t.__name__ == "ClickException")


def main() -> None:
    """Run the command line: errors become one line, and exit code 2."""
    warnings.showwarning = _show_warning
    warnings.simplefilter("always", ErsatzWarning)
    try:
        code = app(prog_name="ersatz", standalone_mode=False)
        sys.stdout.flush()
    except typer.Exit as exit_:
        code = exit_.exit_code
    except _CLICK_ERROR as error:
        fail(f"{error.format_message()} Try `ersatz --help`.")
        code = 2
    except (typer.Abort, KeyboardInterrupt):
        code = 130
    except ErsatzError as error:
        fail(str(error))
        code = 2
    except BrokenPipeError:
        sys.stderr.close()
        code = 0
    sys.exit(code)


def _show_warning(message: Warning | str, category: type[Warning], *_: object, **__: object) -> None:
    if issubclass(category, ErsatzWarning):
        sys.stderr.write(f"warning: {message}\n")
