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
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ersatz.acquisition.sources import concepts_beside
from ersatz.errors import InputError, MissingDependencyError, ScanError
from ersatz.knowledge.base import KnowledgeBase
from ersatz.pipeline import Grounded, concepts_of, ground_values

SECONDS: Final = 90
"""How long measuring one scan may take."""


@dataclass(frozen=True, slots=True, eq=False)
class SeenScan:
    """A scan, cut and measured.

    Attributes
    ----------
    points : (n, 3) float64 array, metres
    segments : (n,) int64 array
        Segment of each point.
    grounded : Grounded
        What it holds, is like and could stand in for.
    remark : str
        Why some properties were not measured; else empty.
    """

    points: NDArray[np.float64]
    segments: NDArray[np.int64]
    grounded: Grounded
    remark: str


def ground_scan(kb: KnowledgeBase, path: Path, seconds: float = SECONDS) -> SeenScan:
    """Read, segment and measure a scan, and look up what it is like.

    Raises
    ------
    ScanError
        If it cannot be read or measured, or takes longer than `seconds`.
    InputError
        If the knowledge base knows nothing of what was measured.
    MissingDependencyError
        If open3d is needed and not installed.
    """
    concepts, remark = _concepts(kb)
    points, segments, values = _apart(path, concepts, seconds)
    measured = {name: tuple(value) for name, value in values.items()}
    return SeenScan(points, segments, ground_values(kb, measured, "the scan"), remark)


def _concepts(kb: KnowledgeBase) -> tuple[Path | None, str]:
    """Return the file of the shape concepts, or why the shape is not measured."""
    try:
        if concepts_of(kb) is None:
            return None, ""
    except InputError as error:
        return None, f"Its shape was not measured: {error}"
    return concepts_beside(Path(kb.location)), ""


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


def main() -> None:
    """Measure the scan named on the command line; an error is a line and the exit code 2, or 3."""
    path, out, concepts = sys.argv[1:]
    try:
        from ersatz.acquisition.measuring import measure_object
        from ersatz.acquisition.scans import read_scan
        from ersatz.acquisition.segments import SegmentSettings, prepare, segment
        from ersatz.acquisition.shape_concepts import ShapeConcepts

        _limit_memory()
        scan = read_scan(path)
        settings = SegmentSettings()
        surface = prepare(scan, settings)
        patches = segment(surface, settings)
        values = measure_object(scan, ShapeConcepts.load(concepts) if concepts else None)
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
