"""Every engine does the same, in the order of the items, and passes errors on."""

import os
from collections.abc import Iterator
from threading import get_ident

import pytest

from ersatz.acquisition.engine import Cluster, Engine, Here, Processes, open_engine
from ersatz.errors import InputError


def halved(number: int) -> int:
    if number % 2:
        raise InputError(f"{number} is odd")
    return number // 2


def thread(_: int) -> tuple[int, int]:
    return os.getpid(), get_ident()


@pytest.fixture(scope="module", params=["here", "processes", "cluster"])
def engine(request: pytest.FixtureRequest) -> Iterator[Engine]:
    if request.param == "cluster":
        # Not above, for the processes import this module.
        from distributed import Client, LocalCluster

        workers = LocalCluster(n_workers=2, threads_per_worker=1, processes=False, dashboard_address=None)
        with workers, Client(workers) as client:
            yield Cluster(client)
    elif request.param == "processes":
        yield Processes(2)
    else:
        yield Here()


def test_results_come_in_order_and_items_are_taken_as_needed(engine: Engine) -> None:
    taken = 0

    def items() -> Iterator[int]:
        nonlocal taken
        for number in range(0, 200, 2):
            taken += 1
            yield number

    results = engine.map(halved, items())
    assert next(results) == 0
    assert taken <= 12
    assert list(results) == list(range(1, 100))
    assert list(engine.map(halved, [])) == []


def test_errors_come_as_they_were_raised(engine: Engine) -> None:
    with pytest.raises(InputError, match="3 is odd"):
        list(engine.map(halved, [0, 2, 3, 4]))


def test_work_is_done_elsewhere(engine: Engine) -> None:
    found = set(engine.map(thread, range(8)))
    assert ((os.getpid(), get_ident()) in found) == isinstance(engine, Here)


@pytest.mark.parametrize("scheduler", ["local:0", "local:two", "local", "nowhere://x", "tcp://127.0.0.1:1"])
def test_a_scheduler_that_is_none_is_named(scheduler: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ersatz.acquisition.engine.PATIENCE", "1s")
    with pytest.raises(InputError, match=f"{scheduler!r}.*local:N"), open_engine(scheduler):
        pass
