"""A hand-made kitchen linked with the real ontologies of others, as `ersatz link` links it."""

from collections.abc import Iterable
from functools import cache
from pathlib import Path

import pyoxigraph as ox

from ersatz.knowledge import linking
from ersatz.knowledge.stores import read_into
from tests.reasoners import ROOT

KITCHEN = ROOT / "ontology" / "examples" / "kitchen.ttl"
ONTOLOGIES = {
    "cora": ("ieee1872/cora.owl", "ieee1872/cora-bare.owl", "ieee1872/corax.owl", "ieee1872/sumo-cora.owl"),
    "isaac": ("isaac/hed.owl", "isaac/j87.owl"),
    "knowrob": ("soma/DUL.owl", "knowrob/knowrob.owl"),
    "oro": ("oro/oro.owl",),
    "prov": ("prov/prov-o.ttl",),
    "soma": ("soma/DUL.owl", "soma/SOMA-HOME.owl"),
    "sosa": ("ssn/sosa-2017.ttl",),
}
"""The files of each bridge's target with what they import, below `ontologies/` of the shared data."""


def store_of(*files: Path) -> ox.Store:
    store = ox.Store()
    for file in files:
        read_into(store, file)
    return store


def triples(store: ox.Store) -> list[ox.Triple]:
    return [quad.triple for quad in store]


def targets(bridge: str, data: Path) -> list[Path]:
    return [data / "ontologies" / file for file in ONTOLOGIES[bridge]]


@cache
def linked(bridge: str, data: Path) -> ox.Store:
    return linking.link(triples(store_of(KITCHEN)), bridge, targets(bridge, data))


@cache
def alone(bridge: str, data: Path) -> ox.Store:
    """Return the other ontology without us, under one header: what is wrong here is not our doing."""
    store = ox.Store()
    for file in targets(bridge, data):
        linking._read_foreign(store, file)
    linking._one_header(store, bridge)
    return store


def write(some: Iterable[ox.Triple | ox.Quad], path: Path) -> Path:
    """Write a graph where Java finds it, without blank lines about where it came from."""
    ox.serialize(
        (each.triple if isinstance(each, ox.Quad) else each for each in some),
        str(path),
        format=ox.RdfFormat.N_TRIPLES,
    )
    return path
