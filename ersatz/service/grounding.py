"""Ground by hand: what one uploaded scan tells, by the knowledge base's own cut points.

The file comes from a stranger and is read by native code: that happens in a process of its own, which is
ended at a time limit and whose crash is an error like any other.
"""

import json
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ersatz.errors import MissingDependencyError, ScanError
from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.names import snake_iri
from ersatz.knowledge.updates import read_qualities
from ersatz.measurements import Kind
from ersatz.reasoner.relevance import ReasonerSettings, build_index, relevance
from ersatz.reasoner.representative import Knowledge, load_knowledge, pack
from ersatz.reasoner.similarity import compare

SECONDS: Final = 90
NEAREST: Final = 8
MOST_TOOLS: Final = 2_000
"""Classes tried as the missing tool."""


@dataclass(frozen=True, slots=True)
class Measured:
    """One property of the scan.

    Attributes
    ----------
    name, iri, unit : str
    values : tuple of float, in the unit
    quality, quality_iri : str
        Empty where the knowledge base has no qualities of the property.
    """

    name: str
    iri: str
    values: tuple[float, ...]
    unit: str
    quality: str
    quality_iri: str


@dataclass(frozen=True, slots=True, eq=False)
class Grounded:
    """What a scan tells.

    Attributes
    ----------
    points : (n, 3) float64 array, metres
    segments : (n,) int64 array
        Segment of each point.
    extent : str
        Of the box around it, metres.
    measured : tuple of Measured
    nearest, stands_in_for : tuples of (class IRI, name, similarity in [0, 1]), best first
        By the measured properties alone.
    """

    points: NDArray[np.float64]
    segments: NDArray[np.int64]
    extent: str
    measured: tuple[Measured, ...]
    nearest: tuple[tuple[str, str, float], ...]
    stands_in_for: tuple[tuple[str, str, float], ...]


def ground_scan(kb: KnowledgeBase, path: Path, seconds: float = SECONDS) -> Grounded:
    """Read, segment and measure a scan, and look up what it is like.

    Raises
    ------
    ScanError
        If it cannot be read or measured, or takes longer than `seconds`.
    MissingDependencyError
        If open3d is not installed.
    """
    concepts = Path(kb.location).with_suffix(".concepts.npz")
    points, segments, values = _apart(path, concepts if concepts.is_file() else None, seconds)
    measured = _assigned(kb, values)
    known = kb.view(load_knowledge)
    names = {one.quality for one in measured if one.quality}
    bits = np.array([quality.name in names for quality in known.qualities], dtype=bool)
    extent = " × ".join(f"{edge:.3f}" for edge in np.ptp(points, axis=0))
    properties = {one.name for one in measured if one.quality}
    return Grounded(
        points,
        segments,
        extent,
        measured,
        _nearest(kb, known, bits, properties),
        _tools(known, bits, properties),
    )


def _apart(
    path: Path, concepts: Path | None, seconds: float
) -> tuple[NDArray[np.float64], NDArray[np.int64], dict[str, list[float]]]:
    with tempfile.TemporaryDirectory(prefix="ersatz-") as folder:
        out = Path(folder) / "measured.npz"
        command = [sys.executable, "-m", "ersatz.service.grounding", str(path), str(out), str(concepts or "")]
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=seconds, check=False)
        except subprocess.TimeoutExpired:
            raise ScanError(f"the scan took longer than {seconds:g} s to measure: thin it first") from None
        if done.returncode == 3:
            raise MissingDependencyError(done.stdout.strip())
        if done.returncode == 2:
            raise ScanError(done.stdout.strip())
        if done.returncode != 0:
            raise ScanError("the scan cannot be measured: reading it broke off")
        with np.load(out, allow_pickle=False) as found:
            return found["points"], found["segments"], json.loads(str(found["values"]))


def _assigned(kb: KnowledgeBase, values: dict[str, list[float]]) -> tuple[Measured, ...]:
    learned = {one.property.name: one for one in read_qualities(kb)}
    from ersatz.measurements import PROPERTIES

    measured = []
    for name, value in sorted(values.items()):
        known = learned.get(name)
        prop = known.property if known else PROPERTIES.get(name)
        quality = ""
        if known is not None and known.centroids.shape[1] == len(value):
            quality = f"{name}_{int(known.assign(np.array([value]))[0]) + 1}"
        measured.append(
            Measured(
                name,
                snake_iri(name),
                tuple(value),
                prop.unit if prop else "",
                quality,
                snake_iri(quality) if quality else "",
            )
        )
    return tuple(measured)


def _nearest(
    kb: KnowledgeBase, known: Knowledge, bits: NDArray[np.bool_], properties: set[str]
) -> tuple[tuple[str, str, float], ...]:
    """Return the classes whose typical qualities of the measured properties are most like these."""
    mask = np.array([quality.property in properties for quality in known.qualities], dtype=bool)
    typical = known.classes.representative(ReasonerSettings().representative) & mask
    numerators, denominators = compare(pack(bits), pack(typical))
    return _best(known, numerators / denominators)


def _tools(
    known: Knowledge, bits: NDArray[np.bool_], properties: set[str]
) -> tuple[tuple[str, str, float], ...]:
    """Return the tools it would stand in for, judged by the measured properties."""
    functional = {quality.property for quality in known.qualities if quality.kind is Kind.FUNCTIONAL}
    physical = {quality.property for quality in known.qualities if quality.kind is Kind.PHYSICAL} & properties
    if not physical:
        return ()
    settings = ReasonerSettings(properties=tuple(sorted(functional | physical)))
    index = build_index(known, settings)
    mask = known.mask(Kind.PHYSICAL, tuple(physical))
    similarity = np.zeros(len(known.classes.iris))
    for row in range(min(len(similarity), MOST_TOOLS)):
        found = relevance(index, row, settings)
        if found.determined:
            numerators, denominators = compare(pack(found.physical), pack((bits & mask)[None]))
            similarity[row] = numerators[0] / denominators[0]
    return tuple(one for one in _best(known, similarity) if one[2] > float(settings.tolerance))


def _best(known: Knowledge, similarity: NDArray[np.float64]) -> tuple[tuple[str, str, float], ...]:
    order = sorted(range(len(similarity)), key=lambda row: (-similarity[row], known.classes.names[row]))
    return tuple(
        (known.classes.iris[row], known.classes.names[row], float(similarity[row]))
        for row in order[:NEAREST]
        if similarity[row] > 0
    )


def main() -> None:
    """Measure the scan named on the command line; an error is a line and the exit code 2, or 3."""
    path, out, concepts = sys.argv[1:]
    try:
        from ersatz.acquisition.measuring import measure_scan
        from ersatz.acquisition.scans import read_scan
        from ersatz.acquisition.segments import SegmentSettings, prepare, segment
        from ersatz.acquisition.shape_concepts import ShapeConcepts

        _limit_memory()
        scan = read_scan(path)
        settings = SegmentSettings()
        surface = prepare(scan, settings)
        patches = segment(surface, settings)
        values: dict[str, Any] = measure_scan(scan, ShapeConcepts.load(concepts) if concepts else None)
        np.savez(out, points=surface.points, segments=patches.labels, values=np.array(json.dumps(values)))
    except MissingDependencyError as error:
        sys.stdout.write(f"{error}\n")
        sys.exit(3)
    except ScanError as error:
        sys.stdout.write(f"{str(error).replace(repr(Path(path).name), 'the scan')}\n")
        sys.exit(2)


def _limit_memory() -> None:
    if sys.platform.startswith("linux"):
        import resource

        resource.setrlimit(resource.RLIMIT_DATA, (8 << 30, 8 << 30))


if __name__ == "__main__":
    main()
