"""The build record: how a knowledge base came about and from which sources, as lines of N-Triples."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from fractions import Fraction

from ersatz.grounding.units import ObservationUnit
from ersatz.knowledge import vocabulary as v
from ersatz.knowledge.names import snake_name
from ersatz.knowledge.terms import decimal, finite, individual, integer, iri, statements, text
from ersatz.measurements import Source


@dataclass(frozen=True, slots=True)
class BuildRecord:
    """How a knowledge base came about; metadata, not knowledge.

    Attributes
    ----------
    unit : ObservationUnit
    theta : Fraction
        The representative threshold at which `ersatz:representativeQuality` is written down.
    clusters, seed : int
    settings : str
        All settings of the build as JSON.
    software : str
        Version of ERSATZ.
    time : str or None
        xsd:dateTime of the build; only where asked for, since it makes every build different.
    sources : tuple of Source
    """

    unit: ObservationUnit = ObservationUnit.INSTANCE
    theta: Fraction = Fraction(35, 100)
    clusters: int = 4
    seed: int = 0
    settings: str = "{}"
    software: str = ""
    time: str | None = None
    sources: tuple[Source, ...] = field(default=())


def build_lines(record: BuildRecord) -> Iterator[str]:
    """Yield the build record and its sources."""
    yield from individual(v.BUILD, v.KNOWLEDGE_BUILD, "the build of this knowledge base")
    yield from statements(
        v.BUILD,
        (v.FORMAT, integer(v.FORMAT_VERSION)),
        (v.OBSERVATION_UNIT, text(record.unit)),
        (v.THETA, decimal(finite(record.theta))),
        (v.CLUSTERS, integer(record.clusters)),
        (v.SEED, integer(record.seed)),
        (v.SETTINGS, text(record.settings)),
        (v.SOFTWARE_VERSION, text(record.software)),
    )
    if record.time:
        yield f'{v.BUILD} {v.ENDED_AT} "{record.time}"^^<{v.XSD}dateTime> .\n'
    for source in record.sources:
        yield f"{v.BUILD} {v.USED_SOURCE} {source_iri(source)} .\n"
        yield from source_lines(source)


def source_iri(source: Source) -> str:
    """Return the IRI of a source in N-Triples; its content tells two files of one name apart."""
    return iri(f"{v.KB}source_{snake_name(source.name)}{'_' + source.sha256[:8] if source.sha256 else ''}")


def source_lines(source: Source) -> Iterator[str]:
    """Yield a source: its file name, content hash and credit."""
    subject = source_iri(source)
    yield from individual(subject, v.SOURCE_CLASS, source.name)
    yield f"{subject} {v.FILE_NAME} {text(source.name)} .\n"
    if source.sha256:
        yield f"{subject} {v.SHA256} {text(source.sha256)} .\n"
    if source.credit:
        yield f"{subject} {v.CREDIT} {text(source.credit)} .\n"
