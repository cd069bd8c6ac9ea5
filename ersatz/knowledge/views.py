"""Views: the knowledge base as an rdflib graph and as owlready2 objects."""

import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import pyoxigraph as ox

from ersatz.knowledge import vocabulary as v
from ersatz.knowledge.terms import lines_of
from ersatz.resources import ONTOLOGY

if TYPE_CHECKING:
    import rdflib


def rdflib_graph(triples: Iterable[ox.Triple]) -> "rdflib.Graph":
    """Return the triples as a read-only rdflib graph.

    A copy: a view on Oxigraph would type plain strings, which rdflib takes for other literals.
    """
    import rdflib
    from rdflib.graph import ModificationException, ReadOnlyGraphAggregate

    class _ReadOnly(ReadOnlyGraphAggregate):
        def update(self, *_: object, **__: object) -> NoReturn:
            raise ModificationException  # rdflib would say nothing to CLEAR

    view = _ReadOnly([rdflib.Graph().parse(data="".join(lines_of(triples)), format="nt")])
    for prefix, namespace in v.PREFIXES.items():
        view.namespace_manager.store.bind(prefix, rdflib.URIRef(namespace))
    return view


def owlready2_ontology(triples: Iterable[ox.Triple]) -> Any:
    """Return an owlready2 ontology of its own world, with the terms loaded beside the knowledge.

    owlready2 reads N-Triples safely (its RDF/XML reader strips a trailing slash from IRIs) and would
    fetch imports over the network: the import is loaded first from the package.
    """
    import owlready2

    world = owlready2.World()
    with tempfile.TemporaryDirectory() as folder:
        terms = ox.parse(path=str(ONTOLOGY / "ersatz.ttl"), format=ox.RdfFormat.TURTLE)
        for name, iri, said in (("terms", v.ONTOLOGY.value, terms), ("kb", v.KB_ONTOLOGY.value, triples)):
            file = Path(folder) / f"{name}.nt"
            file.write_text("".join(lines_of(said)), encoding="utf-8")
            with file.open("rb") as handle:
                ontology = world.get_ontology(f"{iri}#").load(fileobj=handle)
    return ontology
