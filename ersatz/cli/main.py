"""The entry point: runs a command; errors are one line, and exit code 2."""

import gc
import sys
import warnings

import click

from ersatz.cli.app import app
from ersatz.cli.terminal import fail
from ersatz.errors import ErsatzError, ErsatzWarning


def main() -> None:
    """Run the command line: errors become one line, and exit code 2."""
    gc.set_threshold(100_000)  # what is imported stays: to look for garbage in it takes time
    warnings.showwarning = _show_warning
    warnings.simplefilter("always", ErsatzWarning)
    try:
        code = app(prog_name="ersatz", standalone_mode=False)
        sys.stdout.flush()
    except click.ClickException as error:
        fail(f"{error.format_message()} Try `ersatz --help`.")
        code = 2
    except (click.Abort, KeyboardInterrupt):
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
