"""What a benchmark measures: rows of the table, and the race that fills them."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from statistics import median, quantiles
from typing import Final

RESULTS: Final = Path(__file__).parent / "results"
"""Where what was measured is kept."""


@dataclass(frozen=True, slots=True)
class Row:
    """One line of the table: ERSATZ beside one rival.

    Attributes
    ----------
    work : str
        What both did, in words.
    size : str
        How much of it, such as "100,000 classes, 48 qualities".
    rival : str
        What it is compared with.
    ours, theirs : tuple of float, seconds
        The time of each round; empty where it was not run. Where the rival did a share of the work
        only, its times are scaled, and `note` says so.
    target : float or None
        What the ratio should at least be, by the design.
    note : str
        How the answers were found equal, what was scaled, or why the rival was not run.
    package : str
        The distribution the rival comes from, whose version is reported; "" for Python itself.
    limit : float or None, seconds
        What ERSATZ should at most take, by the design.
    """

    work: str
    size: str
    rival: str
    ours: tuple[float, ...]
    theirs: tuple[float, ...]
    target: float | None = None
    note: str = ""
    package: str = ""
    limit: float | None = None

    @property
    def aim(self) -> str:
        """The target and whether it was met; "" without one, for the eye."""
        if self.limit is not None and self.ours:
            return f"≤ {time_text((self.limit,))} {_verdict(median(self.ours) <= self.limit)}"
        if self.target is None:
            return ""
        met = "" if self.ratio is None else f" {_verdict(self.ratio >= self.target)}"
        return f"≥ {self.target:.2g}{met}"

    @property
    def ratio(self) -> float | None:
        """Time of the rival / time of ERSATZ, medians: above 1, ERSATZ is faster."""
        return median(self.theirs) / median(self.ours) if self.ours and self.theirs else None

    @property
    def spread(self) -> tuple[float, float] | None:
        """Quartiles of that ratio over the rounds; the extremes of fewer than four."""
        if not self.ours or not self.theirs:
            return None
        rounds = min(len(self.ours), len(self.theirs))
        ratios = [self.theirs[at] / self.ours[at] for at in range(rounds)]
        if rounds < 4:
            return min(ratios), max(ratios)
        low, _, high = quantiles(ratios, n=4)
        return low, high


@dataclass(frozen=True, slots=True)
class Rival:
    """What ERSATZ is timed beside.

    Attributes
    ----------
    name : str
    work : function or None
        The same work; None where the package is not installed.
    target, note, package
        As in `Row`.
    scale : float
        How many times the work it does is contained in the whole.
    most : int
        Rounds it takes part in; fewer for the slow.
    """

    name: str
    work: Callable[[], object] | None
    target: float | None = None
    note: str = ""
    package: str = ""
    scale: float = 1.0
    most: int = 1_000_000


def race(
    work: str,
    size: str,
    ours: Callable[[], object],
    rivals: list[Rival],
    rounds: int,
    repeat: int = 1,
    clock: Callable[[], float] = time.perf_counter,
    limit: float | None = None,
    pieces: int = 1,
) -> list[Row]:
    """Time ERSATZ and every rival in turns, once more before for warmth.

    Parameters
    ----------
    work, size : str
    ours : function
    rivals : list of Rival
    rounds : int
        How often; the row keeps the time of each.
    repeat : int
        Runs in a round of those that are too short for the clock; a round's time is of one run.
    clock : function
        `time.process_time` where all happens in this process: what others do on the machine then
        counts for less.
    """
    mine: list[float] = []
    theirs: list[list[float]] = [[] for _ in rivals]
    ours()
    for at in range(rounds):
        mine.append(seconds(ours, repeat, clock) / pieces)
        for rival, found in zip(rivals, theirs, strict=True):
            if rival.work is not None and at < rival.most:
                times = repeat if rival.most > rounds else 1
                found.append(seconds(rival.work, times, clock) * rival.scale / pieces)
    return [
        Row(
            work,
            size,
            rival.name,
            tuple(mine),
            tuple(found),
            rival.target,
            rival.note or ("" if rival.work else f"not installed: {rival.package}"),
            rival.package,
            None if at else limit,
        )
        for at, (rival, found) in enumerate(zip(rivals, theirs, strict=True))
    ]


def seconds(
    work: Callable[[], object], repeat: int = 1, clock: Callable[[], float] = time.perf_counter
) -> float:
    """Return the time of one run, the mean of so many."""
    start = clock()
    for _ in range(repeat):
        work()
    return (clock() - start) / repeat


def versions(rows: list[Row]) -> Mapping[str, str]:
    """Return the versions of ERSATZ, numpy and every rival's package."""
    found = {}
    for name in sorted({"ersatz", "numpy", "pyoxigraph", *(row.package for row in rows)} - {""}):
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return found


def time_text(times: tuple[float, ...]) -> str:
    """Return a median time with its unit.

    >>> time_text((0.00012, 0.00014, 0.00013))
    '130 µs'
    """
    if not times:
        return "—"
    middle = median(times)
    for unit, size in (("s", 1.0), ("ms", 1e-3)):
        if middle >= size:
            return f"{middle / size:.3g} {unit}"
    return f"{middle * 1e6:.3g} µs"


def _verdict(met: bool) -> str:
    return "✓" if met else "missed"
