"""How costs grow with instances, classes, properties and queries, and what a fleet would need by that.

`python -m tests.benchmarks.bench_growth [--quick] [--out DIR]` measures each cost at sizes that double, by
processors' time, fits a line in log-log, and writes `growth.md`, `growth.json` and the figure `growth.png`
and `.svg`. Nothing is compared here, so there is no `run`.
"""

import argparse
import json
import os
import time
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import numpy as np

from ersatz.grounding.attribution import attribute
from ersatz.grounding.conceptualization import conceptualize
from ersatz.grounding.units import ObservationUnit, find_units
from ersatz.knowledge.base import KnowledgeBase
from ersatz.reasoner.substitution import rank_substitutes
from tests.benchmarks.__main__ import machine
from tests.benchmarks.measuring import RESULTS
from tests.benchmarks.worlds import RANKS, World
from tests.making import ranked

TOOL: Final = "thing 0000000"


@dataclass(frozen=True, slots=True)
class Series:
    """One cost at several sizes.

    Attributes
    ----------
    cost : str
        What was measured.
    over : str
        What its size is counted in.
    unit : str
        "s" (of processors) or "B".
    sizes, values : tuples of float
    """

    cost: str
    over: str
    unit: str
    sizes: tuple[float, ...]
    values: tuple[float, ...]

    @property
    def slope(self) -> float:
        """The exponent of growth: 1 is linear, 0 is none."""
        return float(np.polyfit(np.log(self.sizes), np.log(self.values), 1)[0])

    @property
    def used(self) -> float:
        """The exponent it is extended by: the measured one, but 1 at least, for small sizes hide growth."""
        return max(self.slope, 1.0)

    def at(self, size: float) -> float:
        """Return the cost at another size, from the largest measured on."""
        return float(self.values[-1] * (size / self.sizes[-1]) ** self.used)

    def __str__(self) -> str:
        """Return where it comes from."""
        largest = quantity(self.values[-1], self.unit)
        return f"{self.cost}: {largest} at {self.sizes[-1]:,.0f} {self.over}, slope {self.used:.2f}"


def seconds(work: Callable[[], object], times: int = 3, repeat: int = 1) -> float:
    """Return the least processors' time of one run."""
    least = float("inf")
    for _ in range(times):
        start = time.process_time()
        for _ in range(repeat):
            work()
        least = min(least, (time.process_time() - start) / repeat)
    return least


def size_of(folder: Path) -> int:
    """Return the bytes of a directory's database; its snapshots are hard links to the same files."""
    return sum(one.stat().st_size for one in (folder / "store").rglob("*") if one.suffix == ".sst")


def grounding(world: World) -> float:
    """Return the time to count what the world's instances hold, with given cut points."""
    measured = world.measurements()
    qualities = ranked([column.property for column in measured.columns], RANKS)

    def ground() -> object:
        units = find_units(measured, ObservationUnit.INSTANCE)
        return conceptualize(attribute(measured, qualities, units), measured.classes)

    return seconds(ground)


def over_instances(folder: Path, sizes: Iterable[int]) -> list[Series]:
    """Measure grounding, writing, room and a change, of worlds of 100 classes."""
    found: dict[tuple[str, str], list[float]] = {}
    for number in sizes:
        world, place = World(100, number // 100), folder / str(number)
        made = [0, 0]

        def write(world: World = world, place: Path = place, made: list[int] = made) -> None:
            lines = list(world.lines())
            made[:] = len(lines), sum(len(line) for line in lines)
            KnowledgeBase.create(lines, place).close()

        row = {("write a directory", "s"): seconds(write, 1), ("room on disk", "B"): size_of(place)}
        row |= {("N-Triples to send", "B"): made[1], ("observe one object", "s"): change(place)}
        for key, value in row.items():
            found.setdefault(key, []).append(float(value))
    return [series(cost, "instances", unit, sizes, values) for (cost, unit), values in found.items()]


def change(place: Path) -> float:
    """Return the time to observe an object, or to forget it, on average."""
    with KnowledgeBase.open(place) as kb:

        def both() -> None:
            kb.observe(TOOL, "new", {"body_0": 1.0, "body_1": 2.0, "use_0": 1.0})
            kb.forget("new")

        both()
        return seconds(both) / 2


def answer(kb: KnowledgeBase, *, first: bool = False) -> float:
    """Return the time of one answer: the first, which reads what is known, or a warm one."""

    def ask() -> None:
        rank_substitutes(kb, TOOL, top=10)

    return seconds(ask, 1) if first else seconds(ask, 5, 20)


def over_classes(sizes: Iterable[int]) -> list[Series]:
    """Measure the first and a warm answer among more and more classes."""
    first, warm, room = [], [], []
    for number in sizes:
        lines = list(World(number, 3).lines(classes_only=True))
        room.append(float(sum(map(len, lines))))
        kb = KnowledgeBase.create(lines)
        first.append(answer(kb, first=True))
        warm.append(answer(kb))
    return [
        series("N-Triples of class knowledge", "classes", "B", sizes, room),
        series("first answer", "classes", "s", sizes, first),
        series("warm answer", "classes", "s", sizes, warm),
    ]


def over_properties(folder: Path, sizes: Iterable[int]) -> list[Series]:
    """Measure writing and a warm answer with more and more physical properties."""
    write, warm = [], []
    for number in sizes:
        world, place = World(100, 10, number), folder / f"p{number}"
        start = time.process_time()
        with KnowledgeBase.create(list(world.lines()), place) as kb:
            write.append(time.process_time() - start)
            answer(kb, first=True)
            warm.append(answer(kb))
    return [
        series("write a directory", "properties", "s", sizes, write),
        series("warm answer", "properties", "s", sizes, warm),
    ]


def over_queries(sizes: Iterable[int]) -> list[Series]:
    """Measure more and more warm answers one after the other, among 1,000 classes."""
    kb = KnowledgeBase.create(World(1_000, 3).lines(classes_only=True))
    tools = [f"thing {at:07}" for at in range(1_000)]
    rank_substitutes(kb, TOOL)

    values = []
    for number in sizes:
        start = time.process_time()
        for at in range(number):
            rank_substitutes(kb, tools[at % 1_000], top=10)
        values.append(time.process_time() - start)
    return [series("warm answers", "queries", "s", sizes, values)]


def series(cost: str, over: str, unit: str, sizes: Iterable[int], values: Iterable[float]) -> Series:
    """Return a series of plain numbers."""
    return Series(cost, over, unit, tuple(map(float, sizes)), tuple(values))


def measure(*, quick: bool) -> list[Series]:
    """Measure everything."""
    scale = 1 if quick else 4
    doubling = [1, 2, 4, 8]
    with TemporaryDirectory() as name:
        counted = [5_000 * scale * at for at in doubling]
        count = [grounding(World(100, number // 100)) for number in counted]
        return [
            series("count", "instances", "s", counted, count),
            *over_instances(Path(name), [200 * scale * at for at in doubling]),
            *over_classes([250 * scale * at for at in doubling]),
            *over_properties(Path(name), [2, 4, 8, 16]),
            *over_queries([10 * scale * at for at in doubling]),
        ]


# The fleet, on paper ---------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Fleet:
    """What is assumed of a fleet.

    Attributes
    ----------
    robots, objects : int
        Robots, and objects each of them knows.
    classes, properties : int
        Of the knowledge base they share.
    new : int
        Objects a robot meets a day.
    questions : int
        Questions a robot asks a second.
    trip : float, seconds
        Way to a server and back.
    """

    robots: int = 1_000_000
    objects: int = 1_000
    classes: int = 100_000
    properties: int = 10
    new: int = 10
    questions: int = 1
    trip: float = 0.02


def needs(known: dict[tuple[str, str], Series], fleet: Fleet) -> list[tuple[str, str, str]]:
    """Return (what, how it follows, how much) of a fleet."""
    instances, new = fleet.robots * fleet.objects, fleet.robots * fleet.new
    wide = fleet.properties / 3  # the worlds that were measured have three properties
    each, index = 8 * fleet.properties, fleet.classes * fleet.properties * RANKS // 8
    asked = fleet.robots * fleet.questions
    count, write = known["count", "instances"], known["write a directory", "instances"]
    room, sent = known["room on disk", "instances"], known["N-Triples to send", "instances"]
    text, first = known["N-Triples of class knowledge", "classes"], known["first answer", "classes"]
    warm, change = known["warm answer", "classes"], known["observe one object", "instances"]

    def row(what: str, one: Series, size: float) -> tuple[str, str, str]:
        return what, f"{one}; x {wide:.2g} for properties", quantity(one.at(size) * wide, one.unit)

    def arithmetic(what: str, how: str, bytes_: float) -> tuple[str, str, str]:
        return what, how, quantity(bytes_, "B")

    answers = warm.at(fleet.classes) * wide
    return [
        row("time: count all objects (class knowledge only)", count, instances),
        row("time: write all objects as triples", write, instances),
        row("storage: all objects as triples", room, instances),
        arithmetic(
            "storage: all objects as columns (Parquet)", f"{each} B an object, uncompressed", instances * each
        ),
        row("storage: class knowledge as N-Triples", text, fleet.classes),
        arithmetic("storage: packed index on a robot", f"a bit a quality, {RANKS} a property", index),
        row("network: all objects as triples, once", sent, instances),
        arithmetic("network: all objects as columns, once", f"{each} B an object", instances * each),
        arithmetic("network: new objects as columns, a day", f"{new:,} objects", new * each),
        arithmetic(
            "network: packed index to every robot, once", f"{fleet.robots:,} robots", fleet.robots * index
        ),
        row("latency: first answer on a robot", first, fleet.classes),
        row("latency: warm answer on a robot", warm, fleet.classes),
        (
            "latency: warm answer of a server",
            f"the same after {fleet.trip * 1e3:.0f} ms of network",
            quantity(answers + fleet.trip, "s"),
        ),
        (
            "time: one server answers all robots",
            f"{asked:,} warm answers a second",
            f"{answers * asked:,.0f} cores",
        ),
        (
            "time: every new object observed one by one (a writer has one core)",
            f"{change.cost}: {quantity(change.values[-1], 's')} at {change.sizes[-1]:,.0f} instances, "
            f"slope {change.slope:.2f}, not extended; {new / 86_400:,.0f} a second",
            f"{change.values[-1] * new / 86_400:,.1f} cores",
        ),
        row("time: count a day's new objects in one batch", count, new),
    ]


def quantity(value: float, unit: str) -> str:
    """Return a number with a prefix, or time in words.

    >>> quantity(2.5e12, "B"), quantity(0.00025, "s"), quantity(90_000, "s")
    ('2.5 TB', '250 µs', '25 h of a core')
    """
    if unit == "B":
        power = min(int(np.log10(max(value, 1)) // 3), 5)
        return f"{value / 1000**power:.3g} {'kMGTP'[power - 1] if power else ''}B"
    for most, factor, name in (
        (1e-3, 1e6, "µs"),
        (1.0, 1e3, "ms"),
        (600.0, 1.0, "s"),
        (3.6e5, 1 / 3600, "h of a core"),
    ):
        if value < most:
            return f"{value * factor:.3g} {name}"
    return f"{value / 86_400:.3g} days of a core"


def page(found: list[Series], fleet: Fleet) -> str:
    """Return the measurements and what follows from them as Markdown."""
    known = {(one.cost, one.over): one for one in found}
    where = machine()
    text = "# How costs grow\n\nMade by `python -m tests.benchmarks.bench_growth`; processors' time, on "
    text += f"{where['processor']}, {where['cores']} cores, Python {where['python']}, load {where['load']}.\n"
    text += "Slopes are of a line through the sizes in log-log: 1 is linear, 0 is no growth.\n\n"
    text += "![Growth](growth.svg)\n\n| cost | grows with | sizes | at the largest | slope |\n"
    text += "|---|---|---|---|---|\n"
    for one in found:
        sizes, largest = f"{one.sizes[0]:,.0f} to {one.sizes[-1]:,.0f}", quantity(one.values[-1], one.unit)
        text += f"| {one.cost} | {one.over} | {sizes} | {largest} | {one.slope:.2f} |\n"
    text += "\n# What a fleet would need, on paper\n\nAssumed: "
    text += ", ".join(f"{name} {value:,}" for name, value in asdict(fleet).items())
    text += (
        "; one observation of an object. Nothing of this was run: each number is the largest measured, "
        "times (size / largest size) to the slope above, or to 1 where that is less, for constant parts hide "
        "growth at small sizes, and times (properties / 3). So these are bounds from above.\n\n"
        "| what | from | needs |\n|---|---|---|\n"
    )
    text += "".join(f"| {what} | {how} | {much} |\n" for what, how, much in needs(known, fleet))
    return text


def figure(found: list[Series], out: Path) -> None:
    """Draw every cost over its size, both in logarithms, as PNG and SVG."""
    import matplotlib as mpl

    mpl.use("Agg")
    mpl.rcParams["svg.hashsalt"] = "ersatz"
    from matplotlib import pyplot as plt
    from matplotlib.ticker import NullFormatter

    groups = list(dict.fromkeys((one.over, one.unit) for one in found))
    drawing, axes = plt.subplots(
        2, -(-len(groups) // 2), figsize=(11, 7), layout="constrained", squeeze=False
    )
    for place in axes.flat[len(groups) :]:
        place.axis("off")
    for place, (over, unit) in zip(axes.flat, groups, strict=False):
        for one in found:
            if (one.over, one.unit) == (over, unit):
                place.loglog(one.sizes, one.values, "o-", label=f"{one.cost}: {one.slope:.2f}")
        place.set_xlabel(over)
        place.set_ylabel("seconds of processors" if unit == "s" else "bytes")
        for axis in (place.xaxis, place.yaxis):
            axis.set_minor_formatter(NullFormatter())
        place.legend(fontsize=8)
        place.grid(visible=True, which="both", alpha=0.2)
    drawing.savefig(out / "growth.png", dpi=120, metadata={"Software": None})
    drawing.savefig(out / "growth.svg", metadata={"Date": None})
    plt.close(drawing)


def write_all(found: list[Series], out: Path) -> None:
    """Write page, figures and numbers."""
    out.mkdir(parents=True, exist_ok=True)
    numbers: list[dict[str, Any]] = [asdict(one) | {"slope": round(one.slope, 3)} for one in found]
    (out / "growth.json").write_text(json.dumps(numbers, indent=1) + "\n", encoding="utf-8")
    (out / "growth.md").write_text(page(found, Fleet()), encoding="utf-8")
    figure(found, out)


def main() -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.bench_growth", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="small sizes")
    parser.add_argument("--out", type=Path, default=RESULTS)
    given = parser.parse_args()
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    write_all(measure(quick=given.quick), given.out)
    print((given.out / "growth.md").read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
