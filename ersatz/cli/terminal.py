"""The terminal: opening what a command names, and saying what came of it."""

import json
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from threading import Thread
from typing import TYPE_CHECKING, Any

from ersatz.errors import ErsatzError, ErsatzWarning

if TYPE_CHECKING:
    from rich.console import Console

    from ersatz.knowledge.base import KnowledgeBase


def open_kb(location: str, *needed: str) -> "KnowledgeBase":
    """Open the knowledge base a command names.

    A file is parsed without the interpreter's lock: meanwhile what works with it is imported, which takes as
    long, and so are the modules that are `needed` next. So this comes before a command's other imports.
    """
    from ersatz.knowledge.opening import open_store

    def prepare() -> None:
        for module in ("ersatz.knowledge.base", *needed):
            import_module(module)

    Thread(target=prepare).start()
    store = open_store(location)
    from ersatz.knowledge.base import KnowledgeBase

    return KnowledgeBase(store)


def save(kb: "KnowledgeBase", otherwise: str = "") -> None:
    """Write a changed file back; where that cannot be and need not be, say so."""
    try:
        kb.save()
    except ErsatzError as error:
        if not otherwise:
            raise
        warnings.warn(f"{otherwise}: {error}", ErsatzWarning, stacklevel=2)


@contextmanager
def progress() -> Iterator[Callable[[str, float], None]]:
    """Show a progress bar on a terminal; elsewhere nothing."""
    from rich.progress import Progress

    terminal = console(err=True)
    with Progress(console=terminal, transient=True, disable=not terminal.is_terminal) as bar:
        task = bar.add_task("", total=1.0)
        yield lambda stage, share: bar.update(task, description=stage, completed=share)


def console(*, err: bool = False) -> "Console":
    """Return what tables and words are printed on."""
    from rich.console import Console

    return Console(stderr=err, emoji=False)  # a name such as :cat: is a name


def print_json(value: Any) -> None:
    """Print an answer for programs."""
    sys.stdout.write(json.dumps(value, indent=2, ensure_ascii=False) + "\n")


def say(message: str) -> None:
    """Tell what was done, beside the answer."""
    sys.stderr.write(f"{message}\n")


def fail(message: str) -> None:
    """Tell in one line what went wrong; control characters as escapes."""
    line = "".join(c if c.isprintable() else repr(c)[1:-1] for c in " ".join(message.split()))
    sys.stderr.write(f"error: {line}\n")
