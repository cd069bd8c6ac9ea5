"""The rivals on cases where the answer is plain."""

from pathlib import Path

import numpy as np
import pytest

from ersatz.errors import InputError, MissingDependencyError, UnknownNameError
from ersatz.evaluation.agreement import Answer
from ersatz.evaluation.baselines import ENTRANTS, OURS, assemble, select
from ersatz.evaluation.features import class_features, standardized
from ersatz.evaluation.methods import Context, Ersatz, Expected, papers_properties
from ersatz.evaluation.rivals import distance, simple, tables
from ersatz.evaluation.rivals.wordnet import FOLDER, SENSES, Inheritance, WordNet, WuPalmer, wu_palmer
from ersatz.evaluation.scenario_files import load_scenarios
from ersatz.evaluation.scenarios import Scenario
from ersatz.evaluation.thresholds import accept_by_score, nested_choice, nested_settings
from ersatz.knowledge.base import KnowledgeBase
from ersatz.reasoner.confidence import DRAWS
from ersatz.reasoner.relevance import ReasonerSettings
from ersatz.reasoner.substitution import rank_substitutes

PLATE = Scenario("q", "plate", ("tray", "sponge"))


def test_features_are_means_over_instances(kb: KnowledgeBase) -> None:
    features = class_features(kb)
    assert features.columns == (("rigidity", 0), ("support", 0), ("weight", 0))
    assert features.means[features.row["plate"]] == pytest.approx([2.75 / 3, 0.035, 0.35])
    assert features.of().shape == (3, 2)
    with pytest.raises(InputError, match="no values of size"):
        features.of(["size"])


def test_standardized_by_hand() -> None:
    values = np.array([[1.0, 5.0], [3.0, 5.0], [np.nan, 5.0]])
    assert standardized(values).tolist() == [[-1, 0], [1, 0], [0, 0]]


def test_simple_rivals(kb: KnowledgeBase) -> None:
    others = [
        Scenario("1", "sponge", ("tray", "plate"), votes={"tray": 3, "plate": 1}),
        Scenario("2", "plate", ("tray", "sponge"), votes={"sponge": 5}),
    ]
    context = Context(kb, others)
    assert simple.chance(context).answer(PLATE).scores == (0, 0)
    assert simple.heaviest(context).answer(PLATE).scores == pytest.approx((2.3 / 3, 0.02))
    # the votes on the plate's own scenario are not looked at
    assert simple.most_popular(context).answer(PLATE).scores == (0.75, 0.0)


def test_distances(kb: KnowledgeBase) -> None:
    scores = distance.feature_distance(Context(kb, [])).answer(PLATE).scores
    assert scores is not None
    assert scores[0] > scores[1]
    for make in (distance.box_size, distance.shape_concepts, distance.parts_and_mass):
        with pytest.raises(InputError, match="no values"):
            make(Context(kb, []))


def test_ersatz_answers_like_the_reasoner(kb: KnowledgeBase) -> None:
    from ersatz import rank_substitutes

    answer = Ersatz(kb).answer(PLATE)
    ranking = {s.name: s for s in rank_substitutes(kb, "plate", ["tray", "sponge"])}
    assert answer.scores == tuple(ranking[name].similarity for name in PLATE.available)
    assert answer.accepted == frozenset(name for name in ranking if ranking[name].accepted)
    nothing = Ersatz(kb, ReasonerSettings(relevance_tolerance=1)).answer(PLATE)  # type: ignore[arg-type]
    assert nothing == Answer(None, frozenset())
    assert papers_properties(Context(kb, [])).settings.properties == ("rigidity", "support", "weight")


@pytest.fixture(scope="module")
def wordnet() -> WordNet:
    if not (FOLDER / "data.noun").is_file():
        pytest.skip(f"no WordNet at {FOLDER}: install wordnet-base")
    return WordNet()


def test_wordnet_knows_every_category(wordnet: WordNet) -> None:
    assert {wordnet.synset(name) for name in SENSES} == {place for _, place in SENSES.values()}
    assert wordnet.synset("spatula") not in {place for _, place in SENSES.values()}
    with pytest.raises(UnknownNameError):
        wordnet.synset("xyzzy")


def test_wordnet_hierarchy_by_hand(wordnet: WordNet) -> None:
    """A soda can is a can is a container; a cereal box is a box is a container."""
    soda_can, can, box = (wordnet.synset(name) for name in ("soda can", "food can", "cereal box"))
    assert wordnet.ancestors(soda_can)[can] == 1
    assert wordnet.depth(soda_can) == wordnet.depth(can) + 1
    deep = wordnet.depth(can)  # depth of container is deep - 1, so deep counted from 1
    rival = WuPalmer(wordnet)
    assert rival.similarity(soda_can, can) == pytest.approx(2 * (deep + 1) / (1 + 2 * (deep + 1)))
    assert rival.similarity(soda_can, box) == pytest.approx(2 * deep / (2 + 2 + 2 * deep))
    assert rival.similarity(can, can) == 1
    answer = Inheritance(wordnet).answer(Scenario("q", "soda can", ("food can", "cereal box", "hand towel")))
    assert answer.scores is not None
    assert answer.scores[:2] == (-1, -2)
    assert answer.accepted == frozenset({"food can"})


def test_wordnet_that_is_not_there(kb: KnowledgeBase, tmp_path: Path) -> None:
    with pytest.raises(MissingDependencyError, match="wordnet-base"):
        wu_palmer(Context(kb, [PLATE], {"wordnet": tmp_path}))


def test_relations_cover_the_categories_and_name_their_sources(kb: KnowledgeBase) -> None:
    import csv

    rows = list(csv.DictReader(tables.RELATIONS.open(encoding="utf-8")))
    assert {row["class"] for row in rows} == set(SENSES)
    assert all(row["source"].startswith(("WordNet gloss", "common sense")) for row in rows)
    assert len({(row["class"], row["relation"], row["value"]) for row in rows}) == len(rows)
    score = (
        tables.shared_relations(Context(kb, [])).answer(Scenario("q", "pitcher", ("bowl", "keyboard"))).scores
    )
    # open, hollow, contain liquid are shared; has handle, pour, round, eat, hold food are not
    assert score == pytest.approx((3 / 8, 0))


def test_affordances_of_the_users_table(kb: KnowledgeBase, tmp_path: Path) -> None:
    path = tmp_path / "affordances.csv"
    path.write_text(
        "Object,Affordances\nplate,\"{1: ('carry', 1.0), 2: ('hold', 2.0)}\"\ntray,\"{1: ('hold', 1.0)}\"\n"
    )
    rival = tables.affordance_overlap(Context(kb, [], {"affordances": path}))
    assert rival.answer(PLATE).scores == pytest.approx((1 / 3, 0))
    with pytest.raises(InputError, match="needs a table"):
        tables.affordance_overlap(Context(kb, []))
    path.write_text('Object,Affordances\nplate,"[1]"\n')
    with pytest.raises(InputError, match="'plate'"):
        tables.affordance_overlap(Context(kb, [], {"affordances": path}))
    path.write_text("a,b\n1,2\n")
    with pytest.raises(InputError, match="columns"):
        tables.affordance_overlap(Context(kb, [], {"affordances": path}))


def test_selection_and_what_is_left_out(kb: KnowledgeBase) -> None:
    everyone, none = select([])
    assert everyone == ENTRANTS
    assert none == {}
    some, files = select(["chance", "relations=x.csv"])
    assert [e.name for e in some] == ["ersatz", "chance", "relations"]
    assert files == {"relations": Path("x.csv")}
    assert select(["affordances=y.csv"])[0] == ENTRANTS
    with pytest.raises(UnknownNameError, match="did you mean 'heaviest'"):
        select(["heavyest"])
    methods, left_out = assemble(ENTRANTS, Context(kb, load_scenarios("benchmark")))
    assert {e.name for e in methods} | set(left_out) == {e.name for e in ENTRANTS}
    assert {"box-size", "shape-concepts", "parts", "affordances"} <= set(left_out)
    assert {e.name for e in methods} >= OURS


def test_nested_choice_never_sees_its_own_tool() -> None:
    values = np.array([[1.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    assert nested_choice(values, ["a", "a", "b"]).tolist() == [1, 1, 0]
    assert nested_choice(values, ["a", "a", "a"]).tolist() == [0, 0, 0]


def test_thresholds_are_chosen_on_other_tools() -> None:
    scenarios = [
        Scenario("1", "a", ("x", "y"), accepted=frozenset({"x"})),
        Scenario("2", "b", ("x", "y"), accepted=frozenset({"x", "y"})),
    ]
    answers = [Answer((0.9, 0.1)), Answer((0.9, 0.1))]
    decided = accept_by_score(scenarios, answers)
    # a is judged by b's threshold, which takes both; b by a's, which takes x alone
    assert decided[0].accepted == frozenset({"x", "y"})
    assert decided[1].accepted == frozenset({"x"})
    assert accept_by_score(scenarios, [Answer(None), Answer(None)]) == [Answer(None), Answer(None)]
    grid = {
        "low": decided,
        "high": [Answer((0.9, 0.1), frozenset({"x"})), Answer((0.9, 0.1), frozenset({"x", "y"}))],
    }
    assert nested_settings(scenarios, grid)[1] == ["high", "high"]


@pytest.mark.parametrize("graded", [False, True])
def test_expected_answers_are_those_of_the_draws(kb: KnowledgeBase, graded: bool) -> None:
    """Scores are means over the draws, and what stands in does so in half of them."""
    settings = ReasonerSettings(graded=graded)
    answer = Expected(kb, settings).answer(PLATE)
    ranking = rank_substitutes(kb, PLATE.missing, PLATE.available, settings=settings, draws=DRAWS)
    assert ranking.sure is not None
    scores = dict(zip([one.name for one in ranking], ranking.sure.expected.tolist(), strict=True))
    assert answer.scores == tuple(scores[name] for name in PLATE.available)
    likely = {one.name for one in ranking if one.confidence and one.confidence.accepted >= 0.5}
    assert set(answer.accepted or ()) == likely
