"""Tables of the README that a command makes: between two comments, put there and read from there."""

import sys

from tests.conftest import ROOT

README = ROOT / "README.md"


def between(begin: str, end: str) -> str:
    """Return what stands between two lines of the README, or end the program saying that they are missing."""
    _, found, rest = README.read_text(encoding="utf-8").partition(begin + "\n")
    inside, also, _ = rest.partition(end)
    if not found or not also:
        sys.exit(f"the README has no place for the table: write {begin} and {end}")
    return inside


def put(table: str, begin: str, end: str) -> None:
    """Replace what stands between two lines of the README."""
    old = begin + "\n" + between(begin, end) + end
    text = README.read_text(encoding="utf-8")
    README.write_text(text.replace(old, f"{begin}\n{table}{end}"), encoding="utf-8")
