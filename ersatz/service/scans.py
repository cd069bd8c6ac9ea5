"""Scans at hand: the folder of scans a knowledge base was built from, found by instance."""

from collections import OrderedDict
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ersatz.acquisition.layouts import ScanFile, list_scans
from ersatz.knowledge.names import local_name, snake_iri

DRAWN: Final = 8_000
"""Points of a scan that are drawn."""

_KEPT: Final = 32
"""Clouds that are kept ready."""


class ScanFolder:
    """The scans of a folder by the instance they show.

    Parameters
    ----------
    folder : Path
        As for `ersatz build --scans`.

    Raises
    ------
    InputError
        If there is no such folder, or no scan in it.
    """

    def __init__(self, folder: Path) -> None:
        self._of: dict[str, list[ScanFile]] = {}
        for file in list_scans(folder):
            self._of.setdefault(local_name(snake_iri(file.instance)), []).append(file)
        self._clouds: OrderedDict[Path, NDArray[np.float64]] = OrderedDict()

    def of(self, instance: str) -> tuple[ScanFile, ...]:
        """Return the scans of an instance by its IRI, in the order of their files."""
        return tuple(self._of.get(local_name(instance), ()))

    def points(self, file: ScanFile) -> NDArray[np.float64]:
        """Return (n, 3) points of a scan's surface in metres, n <= `DRAWN`; the same every time.

        Raises
        ------
        ScanError
            If it cannot be read.
        """
        if file.path not in self._clouds:
            self._clouds[file.path] = _read(file)
            while len(self._clouds) > _KEPT:
                self._clouds.popitem(last=False)
        return self._clouds[file.path]


def _read(file: ScanFile) -> NDArray[np.float64]:
    scan = file.load()
    if scan.mesh is not None:
        return scan.mesh.sampled(DRAWN, seed=0)[0]
    steps = np.linspace(0, len(scan.points) - 1, min(DRAWN, len(scan.points))).astype(int)
    thinned: NDArray[np.float64] = scan.points[steps]
    return thinned
