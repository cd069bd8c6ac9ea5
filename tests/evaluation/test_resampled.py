"""Objects grounded again in memory: stability, calibration and what asking is worth, on small worlds."""

from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from ersatz.acquisition.engine import Processes
from ersatz.evaluation.calibration import calibrate, half
from ersatz.evaluation.figures import draw_one, reliability
from ersatz.evaluation.inquiry import Effort, Inquiry, Ratio, inquire
from ersatz.evaluation.inquiry_cases import unknown_classes, unknown_object, unknown_objects
from ersatz.evaluation.regrounding import Objects, learn, reground, similarities
from ersatz.evaluation.resampling import read_values, to_blocks
from ersatz.evaluation.scenarios import Scenario
from ersatz.evaluation.stability import VARIANTS, markdown, stability, with_agreement
from ersatz.grounding.subcategorization import SubcategorizationSettings
from ersatz.knowledge.base import KnowledgeBase
from ersatz.measurements import Block, Origin
from ersatz.pipeline import Settings, build
from ersatz.reasoner.gain import Doubt, outlook
from ersatz.reasoner.relevance import ReasonerSettings
from ersatz.reasoner.representative import load_knowledge
from ersatz.reasoner.substitution import Status, rank_substitutes
from tests.making import HERE, prop

PROPERTIES = (prop("alpha"), prop("beta"), prop("size", "physical", "x", "y"), prop("use", "functional"))
FEW = SubcategorizationSettings(3, restarts=3)


def blocks(objects: int = 4, spread: float = 0.6, alike: Sequence[str] = ()) -> list[Block]:
    """Return values of five classes around means of their own, or of all classes where they are alike."""
    chance = np.random.default_rng(0)
    found = []
    for p in PROPERTIES:
        width = max(1, len(p.components))
        means = chance.normal(size=(5, width)) * (p.name not in alike)
        values = np.repeat(means, objects, axis=0) + spread * chance.normal(size=(5 * objects, width))
        classes = [f"class {at // objects}" for at in range(5 * objects)]
        names = [f"thing {at}" for at in range(5 * objects)]
        found.append(Block(p, classes, names, [""] * len(names), values, Origin.MACHINE, HERE))
    return found


@pytest.fixture(scope="module")
def objects() -> Objects:
    return Objects.of(blocks())


@pytest.mark.parametrize("graded", [False, True])
def test_grounding_in_memory_is_that_of_the_pipeline(graded: bool) -> None:
    kb = build(blocks=blocks(), settings=Settings(FEW))
    values, properties = read_values(kb)
    known = Objects.of(to_blocks(values, properties))
    memory, stored = reground(known, learn(known, FEW)), kb.view(load_knowledge)
    assert memory.classes.names == stored.classes.names
    assert np.array_equal(memory.classes.counts, stored.classes.counts)
    assert np.array_equal(memory.functions.counts, stored.functions.counts)
    terms = [[(q.name, q.rank, q.kind, q.centroid) for q in one.qualities] for one in (memory, stored)]
    assert terms[0] == terms[1]
    chosen = ReasonerSettings(graded=graded)
    found = similarities(memory, chosen)
    for row, tool in enumerate(memory.classes.names):
        ranking = rank_substitutes(kb, tool, settings=chosen)
        for one in ranking:
            wanted = one.similarity if ranking.status is Status.OK else 0.0
            assert found[row, memory.row_of_name[one.name]] == pytest.approx(wanted)


def test_a_resample_has_as_many_objects_of_each_class(objects: Objects) -> None:
    again = objects.resampled(1)
    assert np.array_equal(np.bincount(again.of_class), np.bincount(objects.of_class))
    assert not np.array_equal(again.values["alpha"], objects.values["alpha"])
    assert np.array_equal(again.values["alpha"], objects.resampled(1).values["alpha"])
    twice = objects.resampled(1, times=2)
    assert np.array_equal(np.bincount(twice.of_class), 2 * np.bincount(objects.of_class))
    shown = half(objects, 0)
    assert len(set(shown.tolist())) == len(shown) == 10


def test_what_is_all_alike_is_stable_and_ties(objects: Objects) -> None:
    same = Objects.of(blocks(spread=0.0))
    for one in stability(same, VARIANTS[:2], resamples=2, refits=1):
        assert (one.top1, one.refitted_top1) == (1.0, 1.0) or one.ties > 0
    some = (VARIANTS[0], VARIANTS[3], VARIANTS[-3])
    found = stability(objects, some, resamples=2, refits=1)
    assert all(0 <= one.top1 <= 1 and -1 <= one.tau <= 1 and 0 <= one.ties <= 1 for one in found)
    assert [one.agreement for one in found] == [None] * len(some)
    assert [one.refitted_tau for one in stability(objects, some, 1, refits=0)] == [None] * len(some)
    once, many = (stability(objects, some[-1:], 5, refits=0, times=times)[0] for times in (1, 50))
    assert many.tau > once.tau
    names = [f"class {at}" for at in range(5)]
    scenario = Scenario("q", names[0], tuple(names[1:]), "", frozenset(names[1:]))
    agreed = with_agreement(found, some, objects, [scenario], restarts=3)
    assert {one.agreement for one in agreed} <= {0.0, 1.0}
    assert markdown(agreed).count("\n") == 2 + len(some)


def test_answers_of_half_of_the_objects_are_judged_by_all(objects: Objects, tmp_path: Path) -> None:
    found = calibrate(objects, learn(objects, FEW), ReasonerSettings(graded=True), splits=2, draws=20)
    assert found.said.shape == (2, 5, 4)
    assert np.all((found.said >= 0) & (found.said <= 1))
    assert found.error < 0.2
    pytest.importorskip("matplotlib")
    assert draw_one("reliability", reliability, {"here": found}, tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {"reliability.png", "reliability.svg"}
    assert not draw_one("nothing", reliability, {}, tmp_path)


@pytest.mark.parametrize("draw", [unknown_object, unknown_objects, unknown_classes])
def test_efforts_are_counted(objects: Objects, draw: object) -> None:
    assert callable(draw)
    cases = draw(objects, learn(objects, FEW), ReasonerSettings(graded=True), 2)
    found = inquire(cases, 1)
    assert len(found.asked) == len(found.random) == len(cases) == 2
    for case, asked, (random,) in zip(cases, found.asked, found.random, strict=True):
        for one in (asked, random):
            assert one.possible == case.slots.total()
            assert 0 <= one.right <= one.possible
            assert 0 <= one.sure <= one.possible
            assert one.confirmed or one.sure < one.right
    assert inquire(cases, 1, engine=Processes(2) if draw is unknown_object else None) == found


@pytest.mark.filterwarnings("ignore:.*distinct value")
@pytest.mark.parametrize("graded", [False, True])
def test_what_tells_classes_apart_is_asked_first(graded: bool) -> None:
    """Of one property classes differ, of the others nobody does."""
    chosen = ReasonerSettings(graded=graded, tolerance=Fraction(7, 10))
    world = Objects.of(blocks(objects=8, spread=0, alike=("beta", "size")))
    found = inquire(unknown_object(world, learn(world, FEW), chosen, 20), 3)
    assert {one.right for one in found.asked} == {0, 1}
    assert max(one.right for each in found.random for one in each) > 1


def test_all_that_can_be_measured_leaves_no_doubt(objects: Objects) -> None:
    """What is asked of all measurements is what the rule answers with all objects."""
    qualities = learn(objects, FEW)
    exact = similarities(reground(objects, qualities), ReasonerSettings(graded=True))
    for case in unknown_classes(objects, qualities, ReasonerSettings(graded=True), 3):
        question = case.ask(case.slots)
        found = outlook(question, 5, about=Doubt.BEST)
        assert found.best[int(exact[question.tool, question.rows].argmax())] == 1
        assert found.doubt == 0


def test_ratios_are_of_means() -> None:
    efforts = Effort(9, 1, 2, confirmed=True), Effort(9, 3, 4, confirmed=False)
    found = Inquiry(efforts, ((Effort(9, 4, 4, confirmed=True),), (Effort(9, 4, 8, confirmed=True),)))
    one = found.ratio("right")
    assert (one.asked, one.random, one.ratio) == (2.0, 4.0, 0.5)
    assert (one.low, one.high) == (0.25, 0.75)
    assert found.to_json()["confirmed"] == 0.5
    assert Ratio.of([0.0], [0.0]).ratio == 1.0


def test_a_knowledge_base_of_classes_only_cannot_be_resampled() -> None:
    kb: KnowledgeBase = build(blocks=blocks(), settings=Settings(FEW, classes_only=True))
    with pytest.raises(ValueError, match="classes only"):
        read_values(kb)
