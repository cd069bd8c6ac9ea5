"""Memberships: what is known of a class or goes with a function, from counts to lines of N-Triples."""

from collections.abc import Iterator
from fractions import Fraction
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ersatz.grounding.conceptualization import Counts
from ersatz.grounding.subcategorization import Qualities
from ersatz.knowledge import vocabulary as v
from ersatz.knowledge.names import class_iri, class_name, model_iri, snake_iri, snake_name
from ersatz.knowledge.terms import degree_text, english, individual, integer, iri, proportion_text, statements

# As text once: entries are most of a large knowledge base.
_DECIMAL: Final = f"^^<{v.XSD}decimal>"
_TYPE, _INDIVIDUAL, _LABEL, _ENTRY, _HAS_ENTRY, _QUALITY, _COUNT, _TOTAL, _PROPORTION, _REPRESENTATIVE = (
    str(term)
    for term in (
        v.TYPE,
        v.NAMED_INDIVIDUAL,
        v.LABEL,
        v.ENTRY,
        v.HAS_ENTRY,
        v.QUALITY,
        v.COUNT,
        v.TOTAL,
        v.PROPORTION,
        v.REPRESENTATIVE_QUALITY,
    )
)


def class_knowledge(counts: Counts, row: int, theta: Fraction) -> Iterator[str]:
    """Yield one class and its model <O, t, m>; nothing for a class without a unit."""
    label = counts.classes[row]
    if not counts.units[row]:
        return
    local, concept = class_name(label), iri(class_iri(label))
    model = iri(model_iri(label))
    yield from statements(
        concept,
        (v.TYPE, v.OWL_CLASS),
        (v.SUBCLASS_OF, v.OBJECT),
        (v.LABEL, english(label)),
    )
    yield from individual(model, v.CLASS_MODEL, f"what is known of {label}")
    yield f"{model} {v.DESCRIBES_CLASS} {concept} .\n"
    yield f"{model} {v.INSTANCE_COUNT} {integer(int(counts.units[row]))} .\n"
    yield from _entries(
        model, local, label, counts, counts.class_counts[row], counts.class_totals[row], theta
    )


def function_knowledge(counts: Counts, row: int, theta: Fraction) -> Iterator[str]:
    """Yield one function model <f, p, d>, of physical qualities; nothing if no unit holds f."""
    name = counts.functions[row]
    if not counts.function_totals[row].any():
        return
    model = iri(f"{v.KB}model_{snake_name(name)}")
    yield from individual(model, v.FUNCTION_MODEL, f"what goes with {name}")
    yield f"{model} {v.FOR_FUNCTION} {iri(snake_iri(name))} .\n"
    observed, totals = counts.function_counts[row], counts.function_totals[row]
    yield from _entries(model, snake_name(name), name, counts, observed, totals, theta)


def _entries(
    model: str,
    local: str,
    label: str,
    counts: Counts,
    observed: NDArray[np.int64],
    totals: NDArray[np.int64],
    theta: Fraction,
) -> Iterator[str]:
    columns = _columns(counts.qualities)
    opening = english(label).removesuffix('"@en')
    all_totals = totals.tolist()
    for (owner, name, quality), count in zip(columns, observed.tolist(), strict=True):
        if not count:
            continue
        total = all_totals[owner]
        entry = f"<{v.KB}{local}__{name}>"
        few, all_, proportion = degree_text(count), degree_text(total), proportion_text(count, total)
        yield f"{model} {_HAS_ENTRY} {entry} .\n"
        yield f"{entry} {_TYPE} {_INDIVIDUAL} .\n"
        yield f"{entry} {_TYPE} {_ENTRY} .\n"
        yield f'{entry} {_LABEL} {opening}: {name} = {proportion} ({few} of {all_})"@en .\n'
        yield f"{entry} {_QUALITY} {quality} .\n"
        yield f'{entry} {_COUNT} "{few}"{_DECIMAL} .\n'
        yield f'{entry} {_TOTAL} "{all_}"{_DECIMAL} .\n'
        yield f'{entry} {_PROPORTION} "{proportion}"{_DECIMAL} .\n'
        if count * theta.denominator >= theta.numerator * total:
            yield f"{model} {_REPRESENTATIVE} {quality} .\n"


@lru_cache(maxsize=8)
def _columns(qualities: tuple[Qualities, ...]) -> tuple[tuple[int, str, str], ...]:
    """Return the row of the property, the local name and the IRI in N-Triples of every quality."""
    return tuple(
        (owner, snake_name(name), iri(snake_iri(name)))
        for owner, quality in enumerate(qualities)
        for name in quality.names
    )
