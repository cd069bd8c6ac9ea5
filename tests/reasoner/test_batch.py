"""Batches: the same answers as one by one, in all settings."""

from collections.abc import Sequence

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ersatz.errors import ErsatzError
from ersatz.reasoner.batch import rank_many
from ersatz.reasoner.relevance import ReasonerSettings
from ersatz.reasoner.substitution import rank_substitutes
from tests.making import Held
from tests.reasoner.reference import Options
from tests.reasoner.test_reference import settings_of
from tests.reasoner.worlds import helds, make, options


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(helds(), options(), st.integers(1, 4))
def test_many_are_ranked_as_each(held: Held, chosen: Options, top: int) -> None:
    kb, asked = make(held), settings_of(chosen)
    batch = rank_many(kb, top=top, settings=asked)
    assert list(batch.missing) == [*batch.names]
    for name, found, determined in zip(batch.missing, batch, batch.determined, strict=True):
        one = rank_substitutes(kb, name, settings=asked, top=top)
        assert [(each.name, each.fraction, each.accepted) for each in one] == found
        assert (str(one.status) == "ok") == determined
    some = batch.missing[::-1]
    assert rank_many(kb, some, top=top, settings=asked)[::-1] == batch[:]


@pytest.mark.parametrize(
    ("missing", "top", "graded", "message"),
    [
        (["tray", "sofa"], 1, False, "sofa"),
        ("tray", 1, False, "takes a list of names"),
        (["tray"], 0, False, "top is 0"),
        (["tray"], 1, True, "graded reasoning ranks one tool at a time"),
    ],
)
def test_bad_input_is_one_clear_error(missing: Sequence[str], top: int, graded: bool, message: str) -> None:
    kb = make({"one": ("tray", {"alpha": 1}), "two": ("bowl", {"alpha": 1})})
    with pytest.raises(ErsatzError, match=message):
        rank_many(kb, missing, top=top, settings=ReasonerSettings(graded=graded))
