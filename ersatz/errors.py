"""What can go wrong, said once: every error of ERSATZ is an `ErsatzError` and a builtin as well.

A message names the offending value and says what to do; the command line prints it as one line and
ends with exit code 2.
"""

from collections.abc import Iterable
from difflib import get_close_matches


class ErsatzWarning(UserWarning):
    """Something was done that the user may not expect; the message says what."""


class ErsatzError(Exception):
    """The root of all errors raised on purpose."""


class InputError(ErsatzError, ValueError):
    """A file, a value or a setting is not what it should be."""


class ScanError(InputError):
    """A point cloud cannot be read, or is too poor for what is asked of it."""


class UnknownNameError(ErsatzError, KeyError):
    """A name the knowledge base does not hold; the message offers the nearest ones it does."""

    def __init__(self, what: str, name: str, known: Iterable[str], hint: str = "") -> None:
        near = nearest(name, known)
        offer = f"did you mean {' or '.join(map(repr, near))}?" if near else "nothing has a similar name"
        super().__init__(f"unknown {what} {name!r}: {offer}{' ' + hint if hint else ''}")

    def __str__(self) -> str:
        """Return the message itself; KeyError would show its repr."""
        return str(self.args[0])


class KnowledgeBaseError(ErsatzError, OSError):
    """A knowledge base cannot be opened, read or written."""


class LockedError(KnowledgeBaseError):
    """Another process writes to the knowledge base."""


class MissingDependencyError(ErsatzError, ImportError):
    """An optional package or system library is needed; the message says how to install it."""


def nearest(name: str, known: Iterable[str], most: int = 2) -> list[str]:
    """Return up to `most` of the known names that look most like `name`, whatever their case.

    >>> nearest("Tary", ["tray", "plate", "Tray table"])
    ['tray']
    """
    folded = {candidate.casefold(): candidate for candidate in sorted(known)}
    return [folded[key] for key in get_close_matches(name.casefold(), folded, n=most, cutoff=0.6)]
