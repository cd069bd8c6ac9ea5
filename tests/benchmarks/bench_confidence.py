"""How stable, how well calibrated and how economical answers with confidence are, on RoCS and `household`.

    python -m tests.benchmarks.bench_confidence [stability] [calibration] [asking] [--out DIR] [--rocs DIR]
        [--resamples 100] [--refits 100] [--splits 20] [--decisions 100] [--workers 1] [--save]

Prints tables in Markdown, or puts them into `results/confidence.md`, the figure of calibration beside them
(`--save`); `--out` writes the numbers as JSON, and the figure. Without the RoCS data only `household` takes
part.
"""

import argparse
import json
import sys
import time
import warnings
from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any, TypeAlias

from ersatz.acquisition.engine import Processes
from ersatz.acquisition.rocs import read_rocs
from ersatz.errors import ErsatzWarning
from ersatz.evaluation import inquiry
from ersatz.evaluation.calibration import Calibration, Truth, calibrate
from ersatz.evaluation.figures import draw_one, reliability
from ersatz.evaluation.inquiry import Inquiry, Ratio, inquire
from ersatz.evaluation.inquiry_cases import unknown_classes, unknown_object, unknown_objects
from ersatz.evaluation.regrounding import Objects, learn
from ersatz.evaluation.resampling import read_values, to_blocks
from ersatz.evaluation.scenario_files import load_scenarios
from ersatz.evaluation.stability import VARIANTS, markdown, stability, with_agreement
from ersatz.grounding.subcategorization import SubcategorizationSettings
from ersatz.knowledge.base import KnowledgeBase
from ersatz.reasoner import gain
from ersatz.reasoner.relevance import ReasonerSettings
from tests.benchmarks.measuring import RESULTS
from tests.conftest import DATA
from tests.readme import put

Table: TypeAlias = tuple[str, Any]
"""In Markdown, and the numbers in JSON's types."""

CASES = {
    "an object: does it stand in?": (unknown_object, 3, gain.DRAWS),
    "five objects: which is best?": (unknown_objects, 1, inquiry.DRAWS),
    "five classes and the tool: which is best?": (unknown_classes, 1, inquiry.DRAWS),
}
"""How cases are drawn, how many times as many, and draws: those of one object vary most, and cost least."""
SETTINGS = {"the paper's rule": ReasonerSettings(), "graded, ordinal": ReasonerSettings(graded=True)}


def measure_stability(data: Mapping[str, Objects], options: argparse.Namespace) -> Table:
    """Draw the objects again; agreement is that of `household` with the benchmark."""
    if "RoCS" not in data:
        sys.exit("stability needs the RoCS data: say where it is with --rocs")
    scenarios, found = load_scenarios("benchmark"), []
    for name, objects in data.items():
        refits = options.refits if name == "RoCS" else 0
        rows = stability(objects, VARIANTS, options.resamples, refits, progress=tell)
        if name == "RoCS":
            rows = with_agreement(rows, VARIANTS, data["household"], scenarios)
        more = stability(objects, VARIANTS[-1:], options.resamples, 0, times=2, progress=tell)
        rows += tuple(replace(one, label=f"twice as many objects: {one.label}") for one in more)
        found += [replace(one, label=f"{name}: {one.label}") for one in rows]
    return markdown(found), [one.to_json() for one in found]


def measure_calibration(data: Mapping[str, Objects], options: argparse.Namespace) -> Table:
    """Answer with some of the objects, drawn as wholes and property by property."""
    rows = [
        "| objects | rule | what is true | Brier of yes or no | Brier, singly | error, singly | Brier "
        "| error | by chance | bins off |",
        "|" + "---|" * 10,
    ]
    found: dict[str, Calibration] = {}
    for name, objects in data.items():
        qualities = learn(objects, SubcategorizationSettings())
        for (rule, settings), truth in product(SETTINGS.items(), Truth):
            label = f"{name} | {rule} | {truth}"
            tell(label, len(found) / (4 * len(data)))
            singly, wholes = (
                calibrate(objects, qualities, settings, options.splits, truth=truth, wholes=one)
                for one in (False, True)
            )
            found[label] = wholes
            numbers = (wholes.brier_crisp, singly.brier, singly.error, wholes.brier, wholes.error)
            cells = [f"{number:.3f}" for number in (*numbers, wholes.error_by_chance)]
            off = [one.off for one in wholes.bins()]
            rows.append(f"| {label} | {' | '.join(cells)} | {sum(off)} of {len(off)} |")
    for folder in filter(None, (options.out, RESULTS if options.save else None)):
        shown = {label.replace(" | ", ", ").replace(", ", "\n", 1): one for label, one in found.items()}
        draw_one("reliability", reliability, shown, folder)
    return "\n".join(rows) + "\n", {name: one.to_json() for name, one in found.items()}


def measure_asking(data: Mapping[str, Objects], options: argparse.Namespace) -> Table:
    """Count measurements in the order asked for and in random order."""
    rows = [
        "| unknown | objects | rule | decisions | possible | until right: asked | random | ratio "
        "| until sure: asked | random | ratio | then right: asked | random |",
        "|" + "---|" * 13,
    ]
    found: dict[str, Inquiry] = {}
    engine = Processes(options.workers) if options.workers > 1 else None
    for what, (draw, times, draws) in CASES.items():
        for name, objects in data.items():
            qualities = learn(objects, SubcategorizationSettings())
            for rule, settings in SETTINGS.items():
                cases = draw(objects, qualities, settings, times * options.decisions)
                label = f"{what} | {name} | {rule}"
                found[label] = inquire(cases, draws=draws, engine=engine)
                rows.append(row_of(label, found[label]))
                tell(rows[-1], len(found) / (len(CASES) * len(data) * len(SETTINGS)))
    return "\n".join(rows) + "\n", {label: one.to_json() for label, one in found.items()}


def row_of(label: str, one: Inquiry) -> str:
    numbers = one.to_json()
    cells = [str(numbers["decisions"]), f"{numbers['possible']:.0f}"]
    cells += [*cells_of(one.ratio("right")), *cells_of(one.ratio("sure"))]
    shares = [f"{numbers[key]:.2f}" for key in ("confirmed", "confirmed_random")]
    return f"| {label} | {' | '.join([*cells, *shares])} |"


def cells_of(one: Ratio) -> list[str]:
    return [f"{one.asked:.1f}", f"{one.random:.1f}", f"**{one.ratio:.2f}** ({one.low:.2f}–{one.high:.2f})"]


PARTS: dict[str, Callable[[Mapping[str, Objects], argparse.Namespace], Table]] = {
    "stability": measure_stability,
    "calibration": measure_calibration,
    "asking": measure_asking,
}


def tell(stage: str, share: float) -> None:
    print(f"{share:4.0%} {stage}", file=sys.stderr)


def main() -> None:
    """Measure what is asked for, or all of it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("parts", nargs="*", choices=[[], *PARTS], default=[])
    parser.add_argument("--out", type=Path)
    parser.add_argument("--save", action="store_true")
    parser.add_argument("--rocs", type=Path, default=DATA / "rocs")
    usual = {"resamples": 100, "refits": 100, "splits": 20, "decisions": 100, "workers": 1}
    for name, number in usual.items():
        parser.add_argument(f"--{name}", type=int, default=number)
    options = parser.parse_args()
    warnings.simplefilter("ignore", ErsatzWarning)  # few objects make fewer qualities: part of the experiment
    if options.out:
        options.out.mkdir(parents=True, exist_ok=True)
    values, properties = read_values(KnowledgeBase.open("household"))
    data = {"household": Objects.of(to_blocks(values, properties))}
    if options.rocs.is_dir():
        data = {"RoCS": Objects.of(read_rocs(options.rocs))} | data
    for part in options.parts or PARTS:
        start = time.perf_counter()
        table, found = PARTS[part](data, options)
        if options.save:
            put(table, f"<!-- {part} -->", f"<!-- end of {part} -->", RESULTS / "confidence.md")
        else:
            print(table)
        tell(f"{part}: {time.perf_counter() - start:.0f} s", 1.0)
        if options.out:
            text = json.dumps(found, indent=1, ensure_ascii=False) + "\n"
            (options.out / f"{part}.json").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
