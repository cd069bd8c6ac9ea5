"""What the endpoint says of itself (SPARQL 1.1 Service Description)."""

from collections.abc import Iterator
from typing import Final

import pyoxigraph as ox

from ersatz.knowledge.vocabulary import KB_ONTOLOGY, RDF
from ersatz.service.functions import function_iris

_SD: Final = "http://www.w3.org/ns/sparql-service-description#"
_FORMATS: Final = "http://www.w3.org/ns/formats/"
_RESULTS: Final = (
    "SPARQL_Results_JSON",
    "SPARQL_Results_XML",
    "SPARQL_Results_CSV",
    "SPARQL_Results_TSV",
    "Turtle",
    "N-Triples",
    "JSON-LD",
    "RDF_XML",
)


def service_description(address: str, media: str) -> bytes:
    """Return the description of the endpoint at an address, in one of the formats of graphs."""
    format_ = ox.RdfFormat.from_media_type(media)
    assert format_ is not None
    written = ox.serialize(_triples(address), format=format_, prefixes={"sd": _SD, "formats": _FORMATS})
    assert written is not None
    return written


def _triples(address: str) -> Iterator[ox.Triple]:
    service, dataset, graph = (ox.BlankNode(name) for name in ("service", "dataset", "graph"))
    a, sd = ox.NamedNode(RDF + "type"), _sd
    yield ox.Triple(service, a, sd("Service"))
    yield ox.Triple(service, sd("endpoint"), ox.NamedNode(address))
    yield ox.Triple(service, sd("supportedLanguage"), sd("SPARQL11Query"))
    for name in _RESULTS:
        yield ox.Triple(service, sd("resultFormat"), ox.NamedNode(_FORMATS + name))
    for function in function_iris():
        yield ox.Triple(service, sd("extensionFunction"), function)
        yield ox.Triple(function, a, sd("Function"))
    yield ox.Triple(service, sd("defaultDataset"), dataset)
    yield ox.Triple(dataset, a, sd("Dataset"))
    yield ox.Triple(dataset, sd("defaultGraph"), graph)
    yield ox.Triple(graph, a, sd("Graph"))
    yield ox.Triple(graph, sd("name"), KB_ONTOLOGY)


def _sd(name: str) -> ox.NamedNode:
    return ox.NamedNode(_SD + name)
