"""The ontology as a page to read: terms by kind, how a membership is reified, and questions to start with.

One HTML file without scripts, fonts or pictures from elsewhere: it reads the same offline.
"""

import re
from collections.abc import Iterator
from html import escape
from typing import Any, Final

import pyoxigraph as ox

from ersatz.knowledge import vocabulary as v
from ersatz.knowledge.stores import read_into
from ersatz.resources import DATA, ONTOLOGY, SPARQL

_SKOS: Final = "http://www.w3.org/2004/02/skos/core#"
_KINDS: Final = (
    ("Class", "Classes"),
    ("ObjectProperty", "Relations"),
    ("DatatypeProperty", "Values"),
    ("AnnotationProperty", "Annotations"),
    ("NamedIndividual", "Individuals"),
)
_DETAILS: Final = (
    (v.RDFS + "subClassOf", "below"),
    (v.RDFS + "domain", "of"),
    (v.RDFS + "range", "to"),
    (v.OWL + "disjointWith", "disjoint from"),
    (v.OWL + "propertyDisjointWith", "disjoint from"),
    (v.RDFS + "comment", "note"),
    (_SKOS + "example", "example"),
)
_DIAGRAM: Final = (
    # (x, y, text), then (from, to, relation)
    (
        (90, 40, "kb:model_Bowl"),
        (330, 40, "kb:Bowl__size_2"),
        (570, 40, "kb:size_2"),
        (330, 130, "3.0 / 4.0 = 0.75"),
    ),
    ((0, 1, "hasEntry"), (1, 2, "quality"), (1, 3, "count, total, proportion")),
)


def reference() -> str:
    """Return the reference of this release as HTML, made from `ontology/` and `sparql/` alone."""
    store = ox.Store()
    read_into(store, ONTOLOGY / "ersatz.ttl")
    title = _value(store, v.ONTOLOGY, v.DCTERMS + "title")
    about = _value(store, v.ONTOLOGY, v.DCTERMS + "description")
    version = _value(store, v.ONTOLOGY, v.OWL + "versionIRI")
    style = (DATA / "reference.css").read_text(encoding="utf-8")
    parts = [
        '<!DOCTYPE html><html lang="en"><head><meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<title>{escape(title)}</title><style>{style}</style></head><body>",
        *_contents(store),
        f'<main><h1 id="top">{escape(title)}</h1><p>{escape(about)}</p>',
        f'<p class="release">Terms <code>{v.ERSATZ}</code>, this release <code>{escape(version)}</code></p>',
        '<h2 id="membership">A membership</h2><p>In 3 of 4 bowls the quality size_2 was found:</p>',
        *_diagram(),
    ]
    for kind, heading in _KINDS:
        parts += [f'<h2 id="{heading.lower()}">{heading}</h2>', *_articles(store, kind)]
    parts += ['<h2 id="questions">Questions to start with</h2>', *_questions(), "</main></body></html>"]
    return "\n".join(parts) + "\n"


def _contents(store: ox.Store) -> Iterator[str]:
    """Yield the column beside the page: the tree of classes, then every other kind of term by name."""
    yield '<nav><a class="brand" href="#top">ERSATZ</a><ul><li><a href="#membership">A membership</a></li>'
    yield '<li><a href="#questions">Questions to start with</a></li></ul>'
    for kind, heading in _KINDS:
        yield f'<h2><a href="#{heading.lower()}">{heading}</a></h2>'
        terms = _terms(store, kind)
        below = {term: _above(store, term) & set(terms) for term in terms}
        yield from _tree([term for term in terms if not below[term]], below)
    yield "</nav>"


def _tree(terms: list[ox.NamedNode], below: dict[ox.NamedNode, set[ox.NamedNode]]) -> Iterator[str]:
    yield "<ul>"
    for term in terms:
        yield f'<li><a href="#{_short(term)}">{_short(term)}</a>'
        children = [child for child, above in below.items() if term in above]
        yield from _tree(children, below) if children else ()
        yield "</li>"
    yield "</ul>"


def _above(store: ox.Store, term: ox.NamedNode) -> set[ox.NamedNode]:
    found = store.quads_for_pattern(term, v.SUBCLASS_OF, None)
    return {quad.object for quad in found if isinstance(quad.object, ox.NamedNode)}


def _terms(store: ox.Store, kind: str) -> list[ox.NamedNode]:
    typed = store.quads_for_pattern(None, v.TYPE, ox.NamedNode(v.OWL + kind))
    found = {quad.subject for quad in typed if isinstance(quad.subject, ox.NamedNode)}
    return sorted((t for t in found if t.value.startswith(v.ERSATZ)), key=lambda term: term.value.lower())


def _articles(store: ox.Store, kind: str) -> Iterator[str]:
    for term in _terms(store, kind):
        name = _short(term)
        label = escape(_value(store, term, v.RDFS + "label"))
        yield f'<article id="{name}"><h3><code>{name}</code> <span>{label}</span></h3>'
        yield f"<p>{escape(_value(store, term, _SKOS + 'definition'))}</p><dl>"
        for predicate, word in _DETAILS:
            found = [quad.object for quad in store.quads_for_pattern(term, ox.NamedNode(predicate), None)]
            shown = sorted(_shown(one) for one in found if not isinstance(one, ox.BlankNode))
            if shown:
                yield f"<dt>{word}</dt><dd>{', '.join(shown)}</dd>"
        yield "</dl></article>"


def _questions() -> Iterator[str]:
    for file in [*sorted(SPARQL.glob("*.rq")), *sorted((SPARQL / "linked").glob("*.rq"))]:
        text = file.read_text(encoding="utf-8")
        summary = re.search(r"^#\+ summary: (.*)$", text, re.MULTILINE)
        query = re.sub(r"^#\+.*\n", "", text, flags=re.MULTILINE)
        command = f"ersatz query KB {file.relative_to(SPARQL).with_suffix('').as_posix()}"
        yield f'<details id="{file.stem}"><summary>{escape(summary[1] if summary else file.stem)}'
        yield f"<br><code>{command}</code></summary><pre>{escape(query.strip())}</pre></details>"


def _diagram() -> Iterator[str]:
    boxes, arrows = _DIAGRAM
    yield '<svg class="diagram" viewBox="0 0 670 170" role="img" aria-label="model, entry, quality, counts">'
    yield '<defs><marker id="a" markerWidth="8" markerHeight="8" refX="7" refY="4" orient="auto">'
    yield '<path d="M0,0 L8,4 L0,8 z"/></marker></defs>'
    for start, end, relation in arrows:
        (x1, y1, _), (x2, y2, _) = boxes[start], boxes[end]
        down = y1 != y2
        x1, x2, y1, y2 = (x1, x2, y1 + 18, y2 - 18) if down else (x1 + 80, x2 - 80, y1, y2)
        yield f'<line x1="{x1}" y1="{y1}" x2="{x2}" y2="{y2}" marker-end="url(#a)"/>'
        at = (x1 + 8, (y1 + y2) // 2 + 4, "start") if down else ((x1 + x2) // 2, y1 - 8, "middle")
        yield f'<text class="relation" x="{at[0]}" y="{at[1]}" text-anchor="{at[2]}">{relation}</text>'
    for x, y, words in boxes:
        yield f'<rect x="{x - 80}" y="{y - 18}" width="160" height="36" rx="6"/>'
        yield f'<text x="{x}" y="{y + 4}" text-anchor="middle">{words}</text>'
    yield "</svg>"


def _shown(term: Any) -> str:
    if isinstance(term, ox.NamedNode):
        name = _short(term)
        return f'<a href="#{name}">{name}</a>' if term.value.startswith(v.ERSATZ) else f"<code>{name}</code>"
    return f"<em>{escape(str(term.value))}</em>"


def _short(term: Any) -> str:
    return str(term.value).rpartition("#")[2]


def _value(store: ox.Store, subject: Any, predicate: str) -> str:
    found = next(store.quads_for_pattern(subject, ox.NamedNode(predicate), None), None)
    assert found is not None, (subject, predicate)
    assert isinstance(found.object, ox.NamedNode | ox.Literal)
    return found.object.value
