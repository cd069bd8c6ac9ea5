"""A small knowledge base, scenarios about it, and a way to ground it again."""

from collections.abc import Sequence
from pathlib import Path

import pytest

from ersatz.evaluation.scenarios import Scenario
from ersatz.knowledge.base import KnowledgeBase
from ersatz.measurements import Block


def ground(blocks: Sequence[Block], clusters: int, seed: int) -> KnowledgeBase:
    """Ground blocks as the command line does."""
    from ersatz.grounding.subcategorization import SubcategorizationSettings
    from ersatz.pipeline import Settings, build

    return build(blocks=blocks, settings=Settings(SubcategorizationSettings(clusters, restarts=3, seed=seed)))


@pytest.fixture
def kb(small_kb: Path) -> KnowledgeBase:
    return KnowledgeBase.open(small_kb)


@pytest.fixture
def scenarios() -> tuple[Scenario, ...]:
    return (
        Scenario("q1", "tray", ("plate", "sponge"), "carry", ballots={"e1": "plate", "e2": "plate", "e3": "none"}),
        Scenario("q2", "plate", ("tray", "sponge"), "serve", ballots={"e1": "tray", "e2": "sponge", "e3": "tray"}),
        Scenario("q3", "sponge", ("tray", "plate"), "wipe", ballots={"e1": "none", "e2": "none", "e3": "tray"}),
        Scenario("q4", "sponge", ("plate",), "pad"),
    )  # fmt: skip
