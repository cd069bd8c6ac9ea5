"""The table of questions: `sparql/README.md`, made from the headers of the files it lists.

Run `python -m ersatz.knowledge.questions` after a change of a header; a test compares the two.
"""

from collections.abc import Iterator
from typing import Final

from ersatz.knowledge.queries import Query, query_names, stored_query
from ersatz.resources import SPARQL

_OPENING: Final = """\
# Questions to a knowledge base

One question a file, in SPARQL 1.1, over the default graph. This page is made from their headers by
`python -m ersatz.knowledge.questions`.

A file begins with a header (`#+ summary:`, `#+ description:`, and `#+ example:` where it has parameters).
A variable `?_<name>_<type>` is a parameter. `ersatz query` and `KnowledgeBase.ask` check its value and put it
in as text; another tool needs it replaced by a term. Types: `class`, `instance`, `property`, `quality` and
`iri` take a name or an IRI, `iris` several of them, `decimal` and `integer` a number below 1e15 with at most
12 digits after the point, `string` a text.

## Ask

```console
$ ersatz query household
$ ersatz query household classes
$ ersatz query household class_knowledge --param class=tray
$ ersatz query household jaccard --param qualities=rigidity_4,flatness_4 --param threshold=0.35 --format csv
```

```python
>>> import ersatz
>>> kb = ersatz.KnowledgeBase.open("household")
>>> rows = kb.ask("representative_qualities", concept="tray", kind="physical", threshold="0.35")
>>> rows.variables
('quality', 'count', 'total')
>>> kb.ask("class", **{"class": "coffee mug"})[0]["name"]
'coffee mug'

```
"""

_FOLDERS: Final = (
    ("", "Questions", "What the reasoner, the command line and the pages ask, and anyone may."),
    (
        "linked",
        "Questions across ontologies",
        "Asked of a knowledge base joined with a bridge of `ontology/bridges` by `ersatz link`.",
    ),
    (
        "checks",
        "Checks",
        "Each returns nothing on a sound knowledge base; `ersatz check KB` runs them all. The summary says "
        "what holds where nothing is found.",
    ),
)


def table_of_questions() -> str:
    """Return all stored questions with parameters and summaries, as Markdown."""
    return _OPENING + "".join(line for folder in _FOLDERS for line in _section(*folder))


def _section(folder: str, title: str, about: str) -> Iterator[str]:
    names = [name for name in query_names() if name.rpartition("/")[0] == folder]
    yield f"\n## {title}\n\n{about}\n\n"
    yield f"| name | parameters | {'states' if folder == 'checks' else 'answers'} |\n|---|---|---|\n"
    for name in names:
        query = stored_query(name)
        yield (
            f"| [`{name}`]({name}.rq) | {_parameters(query)} | "
            f"{query.summary.replace('|', chr(92) + '|')} |\n"
        )


def _parameters(query: Query) -> str:
    return ", ".join(f"`{name}` ({kind})" for name, kind in query.parameters.items())


if __name__ == "__main__":
    (SPARQL / "README.md").write_text(table_of_questions(), encoding="utf-8")
