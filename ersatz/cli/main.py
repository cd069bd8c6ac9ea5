"""The entry point: runs a command; errors are one line, and exit code 2."""

import atexit
import gc
import os
import sys
import threading
import warnings
from contextlib import suppress

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


def run() -> None:
    """Run the command line as a process of its own, and end it.

    To take apart all that was imported and loaded takes a tenth of a second; a process that has neither
    threads nor processes beside it leaves that to the system.
    """
    try:
        main()
    except SystemExit as end:
        if "multiprocessing" in sys.modules or threading.active_count() > 1 or isinstance(end.code, str):
            raise
        atexit._run_exitfuncs()
        with suppress(OSError, ValueError):  # a pipe that broke, or was closed for that
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(end.code or 0)


def _show_warning(message: Warning | str, category: type[Warning], *_: object, **__: object) -> None:
    if issubclass(category, ErsatzWarning):
        sys.stderr.write(f"warning: {message}\n")
