"""Triples to counts: what a knowledge base says, read back exactly as it was written."""

from collections.abc import Iterable, Mapping
from decimal import Decimal
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ersatz.errors import InputError
from ersatz.grounding.conceptualization import Counts
from ersatz.grounding.subcategorization import Qualities
from ersatz.knowledge import vocabulary as v
from ersatz.knowledge.answers import Answer, Value
from ersatz.knowledge.names import class_iri, local_name, refuse_renamed, snake_iri
from ersatz.knowledge.queries import stored_query
from ersatz.knowledge.terms import millionths
from ersatz.measurements import Block, Kind, Measurements, Origin, Property, Source

if TYPE_CHECKING:
    from ersatz.knowledge.base import KnowledgeBase


def read_qualities(kb: "KnowledgeBase") -> tuple[Qualities, ...]:
    """Return the saved cut points."""
    components: dict[str, list[str]] = {}
    for row in kb.ask("axes"):
        components.setdefault(str(row["property"]), []).append(str(row["component"]))
    properties = {
        str(row["property"]): Property(
            local_name(str(row["property"])),
            Kind(str(row["kind"])),
            str(row["unit"]),
            tuple(components.get(str(row["property"]), ())),
            *(str(row[name] or "") for name in ("adjective", "orientation", "definition")),
        )
        for row in kb.ask("properties")
    }
    places: dict[str, list[Value]] = {}
    for row in kb.ask("quality_coordinates"):
        places.setdefault(str(row["quality"]), []).append(row["coordinate"])
    centroids: dict[str, list[list[float]]] = {}
    methods: dict[str, str] = {}
    fuzzifiers: dict[str, float] = {}
    for row in kb.ask("qualities"):
        name = str(row["property"])
        place = places.get(str(row["quality"])) or [row["centroid"]]
        centroids.setdefault(name, []).append([float(_number(value)) for value in place])
        methods[name] = str(row["method"] or "given")
        fuzzifiers[name] = float(_number(row["fuzzifier"] if row["fuzzifier"] is not None else 1))
    norms = _read_norms(kb) if max(fuzzifiers.values(), default=1) > 1 else {}
    return tuple(
        Qualities(properties[name], np.array(rows), methods[name], fuzzifiers[name], norms.get(name))
        for name, rows in centroids.items()
    )


def read_counts(kb: "KnowledgeBase", qualities: tuple[Qualities, ...], label: str) -> Counts:
    """Return the counts of one class, which may be new, and of all functions."""
    names = [name for quality in qualities for name in quality.names]
    owner = np.repeat(np.arange(len(qualities)), [len(quality.names) for quality in qualities])
    position = {snake_iri(name): at for at, name in enumerate(names)}
    functions = [n for q in qualities if q.property.kind is Kind.FUNCTIONAL for n in q.names]
    row_of = {snake_iri(name): at for at, name in enumerate(functions)}
    concept = class_iri(label)
    units = [int(_number(row["instances"])) for row in ask_about(kb, "class", concept)]

    def tables(
        rows: int, found: Iterable[Mapping[str, Value]], row_number: Mapping[str, int], key: str
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        counts = np.zeros((rows, len(names)), dtype=np.int64)
        totals = np.zeros((rows, len(qualities)), dtype=np.int64)
        for row in found:
            at, column = row_number[str(row[key])], position[str(row["quality"])]
            counts[at, column] = millionths(_number(row["count"]))
            totals[at, owner[column]] = millionths(_number(row["total"]))
        return counts, totals

    mine = [{**row, "class": concept} for row in ask_about(kb, "class_knowledge", concept)]
    class_counts, class_totals = tables(1, mine, {concept: 0}, "class")
    function_counts, function_totals = tables(len(functions), kb.ask("function_models"), row_of, "function")
    return Counts(
        qualities,
        (label,),
        np.array(units or [0], dtype=np.int64),
        class_counts,
        class_totals,
        function_counts,
        function_totals,
    )


def read_instance(kb: "KnowledgeBase", name: str, qualities: tuple[Qualities, ...]) -> Measurements | None:
    """Return what was measured of an instance, exactly as it was; None if it is not known."""
    iri = name if name.startswith(v.KB) else snake_iri(name)
    known = ask_about(kb, "instance", iri)
    if not known:
        if kb.query(
            f"ASK {{ ?model {v.DESCRIBES_CLASS} ?class "
            f"FILTER NOT EXISTS {{ ?thing {v.HAS_MEASUREMENT} ?measurement }} }}"
        )[0]["answer"]:
            raise InputError(
                f"{kb.location!r} holds classes only: build it with instances to observe or forget one"
            )
        return None
    instance, label = str(known[0]["name"]), str(known[0]["className"])
    if len(classes := sorted({local_name(str(row["class"])) for row in known})) > 1:
        raise InputError(
            f"{instance!r} is of the classes {' and '.join(classes)}: leave it the one it was counted in"
        )
    for row in known:
        refuse_renamed(iri, str(row["name"]), snake_iri)
        refuse_renamed(str(row["class"]), str(row["className"]), class_iri)
    properties = {snake_iri(quality.property.name): quality.property for quality in qualities}
    vectors: dict[tuple[str, str], dict[Value, float]] = {}
    notes: dict[tuple[str, str], tuple[Origin, Source]] = {}
    for row in ask_about(kb, "instance_measurements", iri):
        key = (str(row["property"]), str(row["observation"] or ""))
        vectors.setdefault(key, {})[row["position"]] = float(_number(row["value"]))
        credit = Source(str(row["file"] or ""), str(row["sha256"] or ""), str(row["credit"] or ""))
        notes[key] = (Origin(local_name(str(row["origin"]))), credit)
    return Measurements.collect(
        Block(properties[key[0]], [label], [instance], [key[1]], np.array([[*vector.values()]]), *notes[key])
        for key, vector in vectors.items()
    )


def ask_about(kb: "KnowledgeBase", query: str, iri: str) -> Answer:
    """Answer a stored question about one thing that may not be known yet."""
    parameter = next(iter(stored_query(query).parameters))
    return kb.query(stored_query(query).bind(lambda name, _: name, {parameter: iri}))


def _read_norms(kb: "KnowledgeBase") -> dict[str, NDArray[np.float64]]:
    """Return the matrices of the qualities' distances by property, ranks in order."""
    found: dict[str, dict[tuple[int, int, int], float]] = {}
    for row in kb.ask("quality_norms"):
        rank, one, other = (int(_number(row[name])) - 1 for name in ("rank", "row", "column"))
        elements = found.setdefault(str(row["property"]), {})
        elements[rank, one, other] = elements[rank, other, one] = float(_number(row["element"]))
    norms = {}
    for name, elements in found.items():
        norms[name] = np.zeros(np.max([*elements], axis=0) + 1)
        norms[name][tuple(np.transpose([*elements]))] = [*elements.values()]
    return norms


def _number(value: Value) -> Decimal:
    if isinstance(value, Decimal | int) and not isinstance(value, bool):
        return Decimal(value)
    raise InputError(f"the knowledge base says {value!r} where a number belongs: run `ersatz check`")
