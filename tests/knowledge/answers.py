"""Regenerate the README's answers across the border: household, its answers for all tools, and the bridges.

    python -m tests.knowledge.answers [--readme]

Without `--readme` it prints the table. It needs the ontologies of the shared data.
"""

import argparse
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pyoxigraph as ox

from ersatz.knowledge import linking
from ersatz.knowledge.base import KnowledgeBase
from ersatz.reasoner.substitution import rank_substitutes
from tests.conftest import DATA, ROOT
from tests.knowledge.linked import targets
from tests.readme import put

QUESTIONS = sorted((ROOT / "sparql" / "linked").glob("*.rq"))
BEGIN, END = "<!-- answers across the border -->", "<!-- end of answers -->"
SHOWN = 3
"""Things an answer names before it only counts the rest."""


@cache
def household() -> tuple[ox.Triple, ...]:
    """Return the shipped knowledge base with its answers for every missing tool."""
    kb = KnowledgeBase.open("household")
    for row in kb.ask("classes"):
        rank_substitutes(kb, missing=str(row["name"]), remember=True)
    return tuple(kb.triples())


def ask(question: Path, data: Path) -> tuple[list[str], list[tuple[str, ...]]]:
    """Return the columns and rows of a question, its terms as people read them."""
    bridge = question.stem.partition("_")[0]
    rows: Any = _linked(bridge, data).query(question.read_text(encoding="utf-8"))
    names = [variable.value for variable in rows.variables]
    return names, [tuple(_read(row[name]) for name in names) for row in rows]


@cache
def _linked(bridge: str, data: Path) -> ox.Store:
    return linking.link(household(), bridge, targets(bridge, data))


def table(data: Path) -> str:
    """Return the table of all questions and their answers as Markdown."""
    lines = ["| question | answer on `household` | `sparql/linked/` |", "|---|---|---|"]
    for question in QUESTIONS:
        summary = re.search(r"summary: (.*)", question.read_text(encoding="utf-8"))
        assert summary
        lines.append(f"| {summary[1]} | {_in_words(*ask(question, data))} | `{question.stem}` |")
    return "\n".join(lines) + "\n"


def _in_words(names: list[str], rows: list[tuple[str, ...]]) -> str:
    """Return rows as text: what shares its first column stands together, the most of it only counted."""
    head = names[0] + (f": {' '.join(names[1:])}" if names[1:] else "")
    groups: dict[str, list[str]] = {}
    for first, *rest in rows:
        groups.setdefault(first, []).append(" ".join(rest))
    told = list(_groups(groups))
    more = [f"… ({len(rows)} rows)"] if len(told) > SHOWN else []
    return f"*{head}* — {'; '.join([*told[:SHOWN], *more]) or 'none'}"


def _groups(groups: dict[str, list[str]]) -> Iterator[str]:
    for first, rest in groups.items():
        shown = ", ".join(rest[:SHOWN]) + (f" … ({len(rest)})" if len(rest) > SHOWN else "")
        yield f"{first}: {shown}" if shown else first


def _read(term: Any) -> str:
    if isinstance(term, ox.Literal):
        return f"{float(term.value):.3g}" if re.fullmatch(r"[\d.]+", term.value) else term.value
    name = re.split(r"[#/]", term.value)[-1]
    camel = re.fullmatch(r"(?:[A-Z][a-z]+)+", name)
    return re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name).lower() if camel else name


def main() -> None:
    """Print the table, or put it where it belongs."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--readme", action="store_true")
    made = table(DATA)
    if parser.parse_args().readme:
        put(made, BEGIN, END)
    else:
        print(made)


if __name__ == "__main__":
    main()
