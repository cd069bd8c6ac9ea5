"""Expert files: draws are what the file says, depend on nothing else, and nonsense is refused."""

# ruff: noqa: E501 - the table of cases reads best with one a line

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from ersatz.acquisition.expert import Expert, read_expert
from ersatz.acquisition.expert.distributions import make
from ersatz.acquisition.layouts import PAPER_SELECTION
from ersatz.errors import InputError
from ersatz.measurements import PROPERTIES, Kind, Measurements, Origin

SHIPPED = Path(__file__).resolve().parents[2] / "ersatz" / "data" / "expert.toml"

HEAD = "format = 1\n"
TRAY = """
[classes.tray]
instances = 400
scans = 3
weight = { family = "lognormal", median = 600, spread = 1.4, unit = "g", reason = "r" }
rigidity = { family = "beta", mean = 0.9, sd = 0.05, reason = "r" }
size = { family = "normal", mean = [42, 30, 3], sd = [5, 4, 1], unit = "cm", reason = "r" }
blockage = { family = "silhouette", fill = 0.5, reason = "r" }
"""
MUG = """
[classes."coffee mug"]
instances = ["red", "blue"]
support = { family = "uniform", low = 10, high = 20, unit = "cm2", reason = "r" }
containment = { family = "constant", value = 300, unit = "ml", reason = "r" }
"""


def expert(folder: Path, content: str) -> Expert:
    path = folder / "e.toml"
    path.write_text(content, encoding="utf-8")
    return read_expert(path)


def draws(folder: Path, content: str, seed: int = 7) -> dict[tuple[str, str], NDArray[np.float64]]:
    """Return (class, property) -> values, in the order of instances and observations."""
    blocks = expert(folder, content).sample(seed)
    return {(str(block.object_class[0]), block.property.name): block.values for block in blocks}


def test_values_are_distributed_as_the_file_says(tmp_path: Path) -> None:
    drawn = draws(tmp_path, HEAD + TRAY + MUG)
    weight = drawn["tray", "weight"][:, 0]
    assert np.median(weight) == pytest.approx(0.6, rel=0.05)
    assert np.std(np.log(weight)) == pytest.approx(np.log(1.4), rel=0.1)
    rigidity = drawn["tray", "rigidity"][:, 0]
    assert np.mean(rigidity) == pytest.approx(0.9, abs=0.01)
    assert np.std(rigidity) == pytest.approx(0.05, abs=0.01)
    assert np.mean(drawn["tray", "size"], axis=0) == pytest.approx([0.42, 0.30, 0.03], rel=0.05)
    assert drawn["coffee mug", "containment"].tolist() == [[0.3], [0.3]]
    assert ((drawn["coffee mug", "support"] >= 0.001) & (drawn["coffee mug", "support"] <= 0.002)).all()


def test_blockage_follows_from_weight_and_size(tmp_path: Path) -> None:
    drawn = draws(tmp_path, HEAD + TRAY)
    length, width, height = drawn["tray", "size"].T
    surface = 2 * (length * width + length * height + width * height)
    assert drawn["tray", "blockage"][:, 0] == pytest.approx(drawn["tray", "weight"][:, 0] * 0.5 * surface / 4)


def test_shares_are_of_the_drawn_size(tmp_path: Path) -> None:
    shares = """
support = { family = "constant", value = 0.5, of = "footprint", reason = "r" }
containment = { family = "constant", value = 0.25, of = "box", reason = "r" }
"""
    drawn = draws(tmp_path, HEAD + TRAY + shares)
    length, width, height = drawn["tray", "size"].T
    assert drawn["tray", "support"][:, 0] == pytest.approx(0.5 * length * width)
    assert drawn["tray", "containment"][:, 0] == pytest.approx(0.25 * length * width * height * 1000)


def test_sizes_come_longest_first(tmp_path: Path) -> None:
    drawn = draws(tmp_path, HEAD + "[noise]\nsize = 0.05\n" + TRAY.replace("[42, 30, 3]", "[30, 31, 29]"))
    assert (np.diff(drawn["tray", "size"], axis=1) <= 0).all()
    assert len(drawn["tray", "size"]) == 1200


def test_a_seed_gives_the_same_draws_and_another_seed_others(tmp_path: Path) -> None:
    one, two, other = (draws(tmp_path, HEAD + TRAY, seed) for seed in (7, 7, 8))
    assert all(one[key].tobytes() == two[key].tobytes() for key in one)
    assert not np.isin(one["tray", "weight"], other["tray", "weight"]).any()


def test_the_order_of_the_file_does_not_matter(tmp_path: Path) -> None:
    head, *lines = TRAY.strip().splitlines()
    one = draws(tmp_path, HEAD + TRAY + MUG)
    two = draws(tmp_path, HEAD + MUG + "\n".join([head, *reversed(lines)]))
    assert {key: values.tobytes() for key, values in one.items()} == {k: v.tobytes() for k, v in two.items()}


def test_more_classes_properties_and_instances_change_no_draw(tmp_path: Path) -> None:
    one = draws(tmp_path, HEAD + TRAY)
    more = TRAY.replace("400", "500") + 'flatness = { family = "uniform", low = 0, high = 1, reason = "r" }\n'
    two = draws(tmp_path, HEAD + more + MUG)
    assert all(values.tobytes() == two[key][:400].tobytes() for key, values in one.items())


def test_correlations_tie_scalars_and_a_class_overrides_the_file(tmp_path: Path) -> None:
    tied = '[correlations]\n"weight ~ size.length" = 0.8\n"size ~ size" = 0.5\n'
    drawn = draws(tmp_path, HEAD + tied + TRAY)
    log_weight, (length, width, _) = np.log(drawn["tray", "weight"][:, 0]), drawn["tray", "size"].T
    assert np.corrcoef(log_weight, length)[0, 1] == pytest.approx(0.8, abs=0.08)
    assert np.corrcoef(length, width)[0, 1] == pytest.approx(0.5, abs=0.12)
    drawn = draws(tmp_path, HEAD + tied + TRAY + 'correlations = { "size.length ~ weight" = -0.5 }')
    log_weight, length = np.log(drawn["tray", "weight"][:, 0]), drawn["tray", "size"][:, 0]
    assert np.corrcoef(log_weight, length)[0, 1] == pytest.approx(-0.5, abs=0.12)


def test_without_noise_an_instance_has_one_value_with_noise_one_a_scan(tmp_path: Path) -> None:
    blocks = expert(tmp_path, HEAD + '[noise]\nweight = "1 %"\n' + TRAY + MUG).sample(0)
    seen = {(block.object_class[0], block.property.name): block for block in blocks}
    assert set(seen["tray", "rigidity"].observation) == {""}
    assert list(seen["tray", "weight"].observation[:4]) == ["1", "2", "3", "1"]
    assert list(seen["tray", "weight"].instance[:4]) == ["tray_1", "tray_1", "tray_1", "tray_2"]
    values = seen["tray", "weight"].values.reshape(400, 3)
    exact = draws(tmp_path, HEAD + TRAY, 0)["tray", "weight"]
    assert np.std(values / exact - 1) == pytest.approx(0.01, rel=0.1)
    assert list(seen["coffee mug", "support"].instance) == ["red", "blue"]


def test_noise_stays_within_the_limits(tmp_path: Path) -> None:
    drawn = draws(tmp_path, HEAD + TRAY.replace("sd = 0.05", "sd = 0.05, noise = 0.3"))
    assert drawn["tray", "rigidity"].min() >= 0
    assert drawn["tray", "rigidity"].max() == 1


def test_origin_and_source(tmp_path: Path) -> None:
    assert expert(tmp_path, HEAD + MUG).origin is Origin.HUMAN
    made = expert(tmp_path, HEAD + 'origin = "synthetic"\ncredit = "me"\n' + MUG)
    assert (made.origin, made.source.name, made.source.credit) == (Origin.SYNTHETIC, "e.toml", "me")
    assert {block.origin for block in made.sample(0)} == {Origin.SYNTHETIC}


def test_properties_described_beside_the_file(tmp_path: Path) -> None:
    (tmp_path / "e.properties.toml").write_text('[heat]\nkind = "physical"\nunit = "K"\n')
    drawn = draws(
        tmp_path, HEAD + '[classes.c]\nheat = { family = "normal", mean = -9, sd = 1, reason = "r" }'
    )
    assert drawn["c", "heat"].max() < 0


@given(
    st.sampled_from(["normal", "lognormal", "beta", "uniform"]),
    st.floats(0.1, 0.9),
    st.floats(0.01, 0.09),
    st.lists(st.floats(0.001, 0.999), min_size=2, max_size=9, unique=True),
)
def test_quantiles_rise_within_the_limits(
    family: str, middle: float, width: float, shares: list[float]
) -> None:
    parameters = {
        "normal": {"mean": middle, "sd": width},
        "lognormal": {"median": middle, "spread": 1 + width},
        "beta": {"mean": middle, "sd": width},
        "uniform": {},
    }[family]
    values = make(family, low=0.05, high=0.95, **parameters).quantile(np.sort(shares))
    assert (np.diff(values) >= 0).all()
    assert ((values >= 0.05) & (values <= 0.95)).all()


def one(line: str) -> str:
    return HEAD + "[classes.tray]\n" + line


def weight(rest: str) -> str:
    return one(f'weight = {{ reason = "r", {rest} }}')


NORMAL = 'family = "normal", mean = 1, sd = 0.1'
MALFORMED = {
    "not TOML": ("format = = 1", "is not TOML: .*line 1"),
    "no format": ("[classes.tray]", "format = None must be 1"),
    "another format": ("format = 2", "format = 2 must be 1"),
    "unknown key": (HEAD + "class = 1", "unknown key 'class': did you mean 'classes'"),
    "unknown origin": (HEAD + 'origin = "machine"', "origin = 'machine' must be 'human' or 'synthetic'"),
    "no class": (HEAD, "describes no class"),
    "class is no table": (HEAD + "[classes]\ntray = 1", "tray = 1 must be a table"),
    "nothing said": (one("scans = 2"), "class 'tray' has no property"),
    "unknown property": (
        one("wieght = 1"),
        "'wieght' is neither a key nor a property: did you mean 'weight'",
    ),
    "no distribution": (one("weight = 1"), "class 'tray', weight = 1 is no distribution"),
    "zero instances": (
        one("instances = 0\nweight = 1"),
        "instances = 0 must be a whole number|is no distribution",
    ),
    "same instances": (
        one(f'instances = ["a", "a"]\nweight = {{ {NORMAL}, reason = "r" }}'),
        "list of different names",
    ),
    "half a scan": (
        one(f'scans = 0.5\nweight = {{ {NORMAL}, reason = "r" }}'),
        "scans = 0.5 must be a whole number",
    ),
    "no reason": (one(f"weight = {{ {NORMAL} }}"), "class 'tray', weight has no reason"),
    "no family": (weight("mean = 1"), "family = None must be a name"),
    "unknown family": (weight('family = "gauss"'), "unknown family 'gauss'"),
    "near family": (weight('family = "log-normal"'), "did you mean 'lognormal'"),
    "unknown parameter": (weight(f"{NORMAL}, mode = 1"), "unknown key 'mode'"),
    "missing parameter": (weight('family = "normal", mean = 1'), "normal lacks its parameter 'sd'"),
    "text parameter": (weight('family = "normal", mean = "1", sd = 1'), "mean = '1' must be a finite number"),
    "infinite parameter": (
        weight('family = "normal", mean = inf, sd = 1'),
        "mean = inf must be a finite number",
    ),
    "negative sd": (weight('family = "normal", mean = 1, sd = -1'), "sd = -1 must be above 0"),
    "mean out of limits": (weight('family = "normal", mean = -1, sd = 1'), "mean = -1 must be in"),
    "limits reversed": (weight(f"{NORMAL}, low = 3, high = 2"), "low = 3 must be below high = 2"),
    "limit beyond nature": (weight(f"{NORMAL}, low = -1"), "low = -1 is beyond 0, where weight ends"),
    "spread below 1": (
        weight('family = "lognormal", median = 1, spread = 0.5'),
        "spread = 0.5 must be a factor above 1",
    ),
    "median 0": (weight('family = "lognormal", median = 0, spread = 2'), "median = 0 must be above 0"),
    "beta without end": (weight('family = "beta", mean = 1, sd = 0.1'), "high = inf must be given"),
    "beta too wide": (
        one('rigidity = { family = "beta", mean = 0.9, sd = 0.3, reason = "r" }'),
        "sd = 0.3 must be above 0 and below 0.3",
    ),
    "constant out of range": (
        one('rigidity = { family = "constant", value = 2, reason = "r" }'),
        "value = 2 must be in",
    ),
    "wrong unit": (weight(f'{NORMAL}, unit = "cm"'), "class 'tray', weight: 'cm' is no multiple of 'kg'"),
    "list for a scalar": (
        weight('family = "normal", mean = [1], sd = 1'),
        r"mean = \[1\] must be one number",
    ),
    "short vector": (
        one('size = { family = "normal", mean = [1, 2], sd = 1, reason = "r" }'),
        r"mean = \[1, 2\] must be 3 numbers",
    ),
    "negative noise": (weight(f"{NORMAL}, noise = -1"), "noise = -1 must be a number, 0 or more"),
    "noise in words": (weight(f'{NORMAL}, noise = "some"'), "noise = 'some' must be a number"),
    "noise of nothing": (HEAD + "[noise]\nwieght = 1\n[classes.tray]", r"\[noise\]: 'wieght' is neither"),
    "silhouette of weight": (weight('family = "silhouette", fill = 1'), "is of blockage only"),
    "silhouette alone": (
        one('blockage = { family = "silhouette", fill = 1, reason = "r" }'),
        "follows from weight and size: give weight, too",
    ),
    "silhouette overfull": (
        HEAD + TRAY.replace("fill = 0.5", "fill = 5"),
        "fill = 5 must be above 0 and at most 1",
    ),
    "share of what": (
        one('support = { family = "constant", value = 0.5, of = "box", reason = "r" }'),
        "of = 'box' must be 'footprint'",
    ),
    "share with a unit": (
        one('support = { family = "constant", value = 0.5, of = "footprint", unit = "m2", reason = "r" }'),
        "has no unit",
    ),
    "share above 1": (
        one('support = { family = "uniform", high = 2, of = "footprint", reason = "r" }'),
        "lies between 0 and 1",
    ),
    "share without size": (
        one('support = { family = "constant", value = 0.5, of = "footprint", reason = "r" }'),
        "follows from size: give size, too",
    ),
    "correlation of one": (HEAD + '[correlations]\n"weight" = 0.5', "must name two"),
    "correlation with itself": (HEAD + '[correlations]\n"weight ~ weight" = 0.5', "of a number with itself"),
    "correlation of 1": (HEAD + '[correlations]\n"weight ~ size" = 1', "= 1 must lie between -1 and 1"),
    "correlation of nothing": (HEAD + '[correlations]\n"weight ~ wight" = 0.5', "did you mean 'weight'"),
    "correlation of no component": (
        HEAD + '[correlations]\n"weight ~ size.depth" = 0.5',
        "choose size.length",
    ),
    "correlation twice": (
        HEAD + '[correlations]\n"weight ~ size" = 0.5\n"size.length ~ weight" = 0.4',
        "is given twice",
    ),
    "correlation of what is not drawn": (
        HEAD + TRAY + 'correlations = { "weight ~ flatness" = 0.5 }',
        "'flatness' has no effect",
    ),
    "contradicting correlations": (
        HEAD
        + TRAY
        + 'correlations = { "weight ~ rigidity" = 0.9, "weight ~ size.length" = 0.9, "rigidity ~ size.length" = -0.9 }',
        "contradict each other",
    ),
}


@pytest.mark.parametrize("case", MALFORMED)
def test_malformed_file_says_where_and_what_to_do(tmp_path: Path, case: str) -> None:
    content, message = MALFORMED[case]
    with pytest.raises(InputError, match=message) as error:
        expert(tmp_path, content)
    assert "'e.toml'" in str(error.value)
    assert "\n" not in str(error.value)


def test_negative_seed_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="seed = -1 must be 0 or more"):
        expert(tmp_path, HEAD + MUG).sample(-1)


@pytest.fixture(scope="module")
def shipped() -> Expert:
    return read_expert(SHIPPED)


def test_the_shipped_file_has_the_papers_classes_and_counts(shipped: Expert) -> None:
    counts = {c.name: (len(c.instances), c.scans) for c in shipped.classes}
    assert "running example" in next(c.note for c in shipped.classes if c.name == "tray")
    assert counts.pop("tray") == (5, 6)
    assert counts == PAPER_SELECTION
    assert sum(n for n, _ in counts.values()) == 146
    assert sum(n * scans for n, scans in counts.values()) == 692


def test_the_shipped_file_gives_every_class_every_property_with_a_reason(shipped: Expert) -> None:
    expected = {name for name in PROPERTIES if not name.startswith("shape_")}
    for judged in shipped.classes:
        assert {j.property.name for j in judged.judgements} == expected, judged.name
        assert all(len(j.reason) > 5 for j in judged.judgements), judged.name


@pytest.mark.parametrize("seed", range(5))
def test_objects_drawn_from_the_shipped_file_are_possible(shipped: Expert, seed: int) -> None:
    table = Measurements.collect(shipped.sample(seed))
    assert len(table.instances) == 151
    values = {c.property.name: c.values for c in table.columns}
    assert all(len(v) == 151 for v in values.values())
    length, width, height = values["size"].T
    assert (values["support"][:, 0] <= length * width).all()
    litres = 1000 * length * width * height
    assert (values["containment"][:, 0] <= litres).all()
    shares = [
        p.name for p in PROPERTIES.values() if p.unit == "1" and p.kind is Kind.PHYSICAL and p.name in values
    ]
    assert all(((values[name] >= 0) & (values[name] <= 1)).all() for name in shares)
    assert (values["weight"][:, 0] / litres < 9).all()
