"""Every step of the rule kept or exchanged: the ends are the reasoner's own rules, and the README is true."""

import numpy as np
import pytest

from ersatz.evaluation.ablation import (
    FORMS,
    Degrees,
    Outcome,
    RelevanceStep,
    Rule,
    ablate,
    all_rules,
    answers_of,
    by_choice,
    markdown,
    nested,
)
from ersatz.evaluation.agreement import Answer
from ersatz.evaluation.methods import Ersatz
from ersatz.evaluation.scenario_files import load_scenarios
from ersatz.evaluation.scenarios import Scenario
from ersatz.knowledge.base import KnowledgeBase
from ersatz.reasoner.relevance import ReasonerSettings
from ersatz.reasoner.similarity import Similarity
from tests.benchmarks.bench_evaluation import STEPS
from tests.conftest import ROOT

CUT = {Similarity.RUZICKA: Similarity.JACCARD, Similarity.COVERAGE: Similarity.COVERAGE}


@pytest.fixture(scope="module")
def household() -> KnowledgeBase:
    return KnowledgeBase.open("household")


@pytest.fixture(scope="module")
def benchmark() -> tuple[Scenario, ...]:
    return load_scenarios("benchmark")


@pytest.fixture(scope="module")
def outcomes(household: KnowledgeBase, benchmark: tuple[Scenario, ...]) -> tuple[Outcome, ...]:
    return ablate(household, benchmark)


def same(found: list[Answer], expected: list[Answer], within: float) -> bool:
    pairs = zip(found, expected, strict=True)
    return all(
        a.scores is b.scores is None
        or (a.scores is not None and b.scores is not None and np.allclose(a.scores, b.scores, atol=within))
        for a, b in pairs
    )


@pytest.mark.parametrize("form", CUT)
@pytest.mark.parametrize("fallback", [False, True])
def test_all_cut_is_the_paper_s_rule(
    household: KnowledgeBase, benchmark: tuple[Scenario, ...], form: Similarity, fallback: bool
) -> None:
    step = RelevanceStep.FALLBACK if fallback else RelevanceStep.CUT
    found = answers_of(household, benchmark, Rule(Degrees.CUT, step, form))
    method = Ersatz(household, ReasonerSettings(similarity=CUT[form], fallback=fallback))
    assert same(found, [method.answer(one) for one in benchmark], 1e-9)


@pytest.mark.parametrize("form", FORMS)
def test_all_kept_and_weighed_is_graded_reasoning(
    household: KnowledgeBase, benchmark: tuple[Scenario, ...], form: Similarity
) -> None:
    found = answers_of(household, benchmark, Rule(Degrees.KEPT, RelevanceStep.WEIGHED, form))
    method = Ersatz(household, ReasonerSettings(graded=True, similarity=form))
    assert same(found, [method.answer(one) for one in benchmark], 1e-4)


def test_every_combination_is_there_once(outcomes: tuple[Outcome, ...]) -> None:
    rules = [one.rule for one in outcomes]
    assert len(rules) == len(set(rules)) == 2 * 5 * 3
    assert rules[0] == all_rules()[0] == Rule(Degrees.CUT, RelevanceStep.CUT, Similarity.RUZICKA)
    means = by_choice(outcomes)
    for options in means.values():
        assert np.isclose(
            np.mean(list(options.values())), np.mean([one.metrics["top1"].mean for one in outcomes])
        )


def test_what_is_chosen_on_other_tools_is_not_better_than_the_best(
    outcomes: tuple[Outcome, ...], benchmark: tuple[Scenario, ...]
) -> None:
    mean, rule = nested(benchmark, outcomes)
    assert rule in {one.rule for one in outcomes}
    assert mean <= max(one.metrics["top1"].mean or 0 for one in outcomes)


def test_the_readme_has_the_table(outcomes: tuple[Outcome, ...], benchmark: tuple[Scenario, ...]) -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert text.partition(f"{STEPS[0]}\n")[2].partition(STEPS[1])[0] == markdown(benchmark, outcomes)
