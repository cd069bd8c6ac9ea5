"""A small knowledge base, scenarios about it, and a way to ground it again."""

from collections.abc import Sequence

import pytest

from ersatz.evaluation.scenarios import Scenario
from ersatz.knowledge.base import KnowledgeBase
from ersatz.measurements import Block
from tests.conftest import TABLE


def ground(blocks: Sequence[Block], clusters: int, seed: int) -> KnowledgeBase:
    """Ground blocks as the command line does."""
    from ersatz.grounding.subcategorization import SubcategorizationSettings
    from ersatz.pipeline import Settings, build

    return build(blocks=blocks, settings=Settings(SubcategorizationSettings(clusters, restarts=3, seed=seed)))


@pytest.fixture(scope="session")
def kb(tmp_path_factory: pytest.TempPathFactory) -> KnowledgeBase:
    """The knowledge base of `small_kb`, opened once: nothing here changes it."""
    from ersatz.grounding.subcategorization import SubcategorizationSettings
    from ersatz.pipeline import Settings, build

    folder = tmp_path_factory.mktemp("evaluation")
    (folder / "objects.csv").write_text(TABLE, encoding="utf-8")
    out = folder / "small.ttl"
    build(
        tables=[folder / "objects.csv"], settings=Settings(SubcategorizationSettings(2, restarts=5)), out=out
    )
    return KnowledgeBase.open(out)


@pytest.fixture(scope="session")
def scenarios() -> tuple[Scenario, ...]:
    choices = (
        ("q1", "tray", ("plate", "sponge"), "carry", ("plate", "plate", "none")),
        ("q2", "plate", ("tray", "sponge"), "serve", ("tray", "sponge", "tray")),
        ("q3", "sponge", ("tray", "plate"), "wipe", ("none", "none", "tray")),
        ("q4", "sponge", ("plate",), "pad", ()),
    )
    return tuple(
        Scenario(name, missing, available, task, ballots={f"e{n}": c for n, c in enumerate(chosen, 1)})
        for name, missing, available, task, chosen in choices
    )
