"""Tables that a command makes: in the README, or another page, between two comments."""

import sys
from pathlib import Path

from tests.conftest import ROOT

README = ROOT / "README.md"


def between(begin: str, end: str, page: Path = README) -> str:
    """Return what stands between two lines of a page, or end the program saying that they are missing."""
    _, found, rest = page.read_text(encoding="utf-8").partition(begin + "\n")
    inside, also, _ = rest.partition(end)
    if not found or not also:
        sys.exit(f"{page.name} has no place for the table: write {begin} and {end}")
    return inside


def put(table: str, begin: str, end: str, page: Path = README) -> None:
    """Replace what stands between two lines of a page."""
    old = begin + "\n" + between(begin, end, page) + end
    text = page.read_text(encoding="utf-8")
    page.write_text(text.replace(old, f"{begin}\n{table}{end}"), encoding="utf-8")
