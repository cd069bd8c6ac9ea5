"""The line end to end on small tables: what is told, recorded, merged, left out, and drawn again."""

from decimal import Decimal
from fractions import Fraction
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest

from ersatz.acquisition.sources import AcquisitionSettings
from ersatz.errors import InputError
from ersatz.grounding.subcategorization import SubcategorizationSettings
from ersatz.grounding.units import ObservationUnit
from ersatz.knowledge.base import KnowledgeBase
from ersatz.measurements import PROPERTIES, Block, Origin, Source
from ersatz.pipeline import Settings, build, ground_values
from ersatz.resources import ONTOLOGY
from tests.knowledge.tools import lines_of

HABITS = SubcategorizationSettings(2, restarts=5)
EXPERT = """\
format = 1
origin = "human"
credit = "our expert"

[classes.plate]
instances = 2
weight = { family = "constant", value = 9.5, unit = "kg", reason = "wrong on purpose" }
rigidity = { family = "beta", mean = 0.5, sd = 0.1, reason = "a wide guess" }

[classes.sponge]
instances = 2
weight = { family = "constant", value = 0.5, unit = "kg", reason = "soaked" }
rigidity = { family = "beta", mean = 0.2, sd = 0.1, reason = "limp" }

[classes.lamp]
instances = 2
weight = { family = "constant", value = 2, unit = "kg", reason = "never measured" }
"""


@pytest.fixture
def expert(tmp_path: Path) -> Path:
    path = tmp_path / "judged.toml"
    path.write_text(EXPERT, encoding="utf-8")
    return path


def weights(*instances: str, label: str = "plate") -> Block:
    """Return a machine's weights of some plates, 0.3 kg each."""
    names, whole = list(instances), [""] * len(instances)
    values = np.full(len(names), 0.3)
    return Block(
        PROPERTIES["weight"], [label] * len(names), names, whole, values, Origin.MACHINE, Source("scale")
    )


def values(kb: KnowledgeBase, instance: str) -> dict[str, tuple[object, str]]:
    """Return value and origin of each property of an instance."""
    rows = kb.ask("instance_measurements", instance=instance)
    return {
        str(row["property"]).partition("#")[2]: (row["value"], str(row["origin"]).partition("#")[2])
        for row in rows
    }


def classes(kb: KnowledgeBase) -> dict[str, object]:
    return {str(row["name"]): row["instances"] for row in kb.ask("classes")}


def test_progress_only_goes_forward_through_every_stage(table: Path, expert: Path) -> None:
    told: list[tuple[str, float]] = []
    build(
        tables=[table],
        expert=expert,
        settings=Settings(HABITS),
        progress=lambda stage, share: told.append((stage, share)),
    )
    stages, shares = [stage for stage, _ in told], [share for _, share in told]
    assert shares == sorted(shares)
    assert shares[0] >= 0
    assert shares[-1] <= 1
    assert stages[0] == "reading measurements"
    assert stages[-1] == "counting and writing"
    found = [stage.removeprefix("finding the qualities of ") for stage in stages[1:-1]]
    assert sorted(found) == ["rigidity", "support", "weight"]


def test_sources_are_recorded_by_name_and_content(table: Path, expert: Path) -> None:
    kb = build(tables=[table], expert=expert, blocks=[weights("plate_9")], settings=Settings(HABITS))
    rows = [(row["file"], row["sha256"], row["credit"]) for row in kb.ask("sources")]
    assert rows == [
        ("judged.toml", sha256(expert.read_bytes()).hexdigest(), "our expert"),
        ("objects.csv", sha256(table.read_bytes()).hexdigest(), None),
        ("scale", None, None),
    ]
    text = "".join(lines_of(kb))
    assert str(table.parent) not in text, "a path of this machine is in the knowledge base"


def test_settings_are_recorded(table: Path) -> None:
    settings = Settings(HABITS, theta=Fraction(1, 2), time="2026-01-02T03:04:05Z")
    (row,) = build(tables=[table], settings=settings).ask("build")
    assert row["settings"] == settings.to_json()
    assert (row["theta"], row["clusters"], row["unit"]) == (Decimal("0.5"), 2, "instance")
    assert row["time"] == "2026-01-02T03:04:05Z"


def test_classes_only_is_the_whole_without_its_instances(table: Path) -> None:
    whole = build(tables=[table], settings=Settings(HABITS))
    kb = build(tables=[table], settings=Settings(HABITS, classes_only=True))
    assert classes(kb) == classes(whole) == {"plate": 3, "sponge": 3, "tray": 3}
    for question in ("memberships", "function_models", "qualities", "sources"):
        rows = {tuple(row.items()) for row in kb.ask(question)}
        assert rows == {tuple(row.items()) for row in whole.ask(question)}
        assert rows
    assert len(whole.ask("all_instances")) == 9
    assert len(kb.ask("all_instances")) == 0
    assert not any("hasMeasurement" in line for line in lines_of(kb))
    with pytest.raises(InputError, match="class"):
        kb.observe("plate", "plate_4", {"weight": 0.3})


def test_a_measurement_beats_the_expert(expert: Path) -> None:
    kb = build(blocks=[weights("dish a", "dish b")], expert=expert, settings=Settings(HABITS))
    for name in ("dish a", "dish b"):
        found = values(kb, name)
        assert found["weight"] == (Decimal("0.3"), "machine")
        assert found["rigidity"][1] == "human", "the expert is asked about what was measured"
        assert set(found) == {"weight", "rigidity"}
    one, two = (values(kb, name)["rigidity"][0] for name in ("dish a", "dish b"))
    assert one != two, "every instance is drawn anew"


def test_classes_nobody_measured_come_from_the_expert_alone(expert: Path) -> None:
    kb = build(blocks=[weights("dish a")], expert=expert, settings=Settings(HABITS))
    assert classes(kb) == {"lamp": 2, "plate": 1, "sponge": 2}
    (lamp, _) = kb.ask("instances", **{"class": "lamp"})
    assert values(kb, str(lamp["instance"])) == {"weight": (2, "human")}


def test_what_the_expert_does_not_know_stays_as_measured(expert: Path) -> None:
    kb = build(blocks=[weights("cup_1", label="cup")], expert=expert, settings=Settings(HABITS))
    assert values(kb, "cup_1") == {"weight": (Decimal("0.3"), "machine")}


def test_the_same_seed_gives_the_same_bytes(table: Path, expert: Path, tmp_path: Path) -> None:
    written = []
    for name in ("one.ttl", "two.ttl"):
        build(tables=[table], expert=expert, settings=Settings(HABITS), out=tmp_path / name)
        written.append((tmp_path / name).read_bytes())
    assert written[0] == written[1]


def test_the_order_of_rows_and_blocks_does_not_matter(table: Path, expert: Path) -> None:
    one = build(tables=[table], blocks=[weights("p 1"), weights("p 2")], expert=expert)
    head, *rows = table.read_text(encoding="utf-8").splitlines()
    table.write_text("\n".join([head, *rows[::-1]]) + "\n", encoding="utf-8")
    two = build(tables=[table], blocks=[weights("p 2"), weights("p 1")], expert=expert)
    assert one.revision == two.revision


def test_another_seed_draws_other_values(expert: Path) -> None:
    drawn = []
    for seed in (0, 1):
        settings = Settings(HABITS, acquisition=AcquisitionSettings(expert_seed=seed))
        kb = build(expert=expert, settings=settings)
        names = [str(row["instance"]) for row in kb.ask("all_instances")]
        assert len(names) == 6
        drawn.append({name: values(kb, name) for name in names})
        assert all(found["weight"][0] in (Decimal("9.5"), Decimal("0.5"), 2) for found in drawn[-1].values())
    assert drawn[0].keys() == drawn[1].keys()
    for name, found in drawn[0].items():
        if "rigidity" in found:
            assert found["rigidity"] != drawn[1][name]["rigidity"]


def test_by_observation_every_observation_counts() -> None:
    weight, source = PROPERTIES["weight"], Source("scale")
    seen = Block(
        weight,
        ["cup"] * 3,
        ["c", "c", "d"],
        ["a", "b", "a"],
        np.array([1.0, 2.0, 1.0]),
        Origin.MACHINE,
        source,
    )
    by = {unit: build(blocks=[seen], settings=Settings(HABITS, unit=unit)) for unit in ObservationUnit}
    assert classes(by[ObservationUnit.INSTANCE]) == {"cup": 2}
    assert classes(by[ObservationUnit.OBSERVATION]) == {"cup": 3}
    counts = [row["count"] for row in by[ObservationUnit.OBSERVATION].ask("memberships")]
    assert sorted(map(str, counts)) == ["1", "2"]


def test_the_unit_may_be_given_by_its_name() -> None:
    assert Settings(unit="observation").unit is ObservationUnit.OBSERVATION  # type: ignore[arg-type]
    with pytest.raises(InputError, match="unit 'object' is not one of instance, observation"):
        Settings(unit="object")  # type: ignore[arg-type]


@pytest.mark.parametrize("theta", [0, "1.1", -1])
def test_theta_outside_its_range_is_refused(theta: object) -> None:
    with pytest.raises(InputError, match="theta"):
        Settings(theta=theta)  # type: ignore[arg-type]


def test_nothing_to_ground_is_said_and_nothing_is_left(tmp_path: Path) -> None:
    with pytest.raises(InputError):
        build(out=tmp_path / "kb")
    assert list(tmp_path.iterdir()) == []


def test_all_ways_to_keep_it_hold_the_same(table: Path, tmp_path: Path) -> None:
    memory = build(tables=[table], settings=Settings(HABITS))
    for name in ("kb.ttl", "kb.nt.gz", "kb"):
        build(tables=[table], settings=Settings(HABITS), out=tmp_path / name).close()
        with KnowledgeBase.open(tmp_path / name) as kb:
            assert lines_of(kb) == lines_of(memory)
            assert kb.revision == memory.revision


def test_an_unknown_object_is_grounded_to_degrees() -> None:
    kb = KnowledgeBase.open(ONTOLOGY / "examples" / "fuzzy.ttl")
    grounded = ground_values(kb, {"weight": (0.35,), "size": (0.5, 0.5)}, "mug.ply")
    size, weight = grounded.held
    assert (weight.quality, weight.degrees) == ("weight_1", (("weight_1", 0.735294), ("weight_2", 0.264706)))
    assert grounded.to_json()["held"][1]["degrees"] == {"weight_1": 0.735294, "weight_2": 0.264706}
    assert size.quality == "size_2"
    crisp = ground_values(
        KnowledgeBase.open(ONTOLOGY / "examples" / "two_classes.ttl"), {"weight": (0.2,)}, "x"
    )
    assert crisp.held[0].degrees == ()
    assert "degrees" not in crisp.to_json()["held"][0]
