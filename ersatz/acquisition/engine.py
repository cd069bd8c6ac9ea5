"""Where work is done that falls into pieces: in this process, in some on this machine, or on a Dask cluster.

What comes of it is the same everywhere. On Dask a piece whose worker dies is done again by another.
"""

import multiprocessing
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from typing import Any, Final, Protocol, TypeVar

from ersatz.acquisition.extras import distributed
from ersatz.errors import ErsatzError, InputError

PATIENCE: Final = "10s"
"""How long a scheduler is given to answer."""

T = TypeVar("T")
R = TypeVar("R")


class Engine(Protocol):
    """Does one thing to many."""

    def map(self, work: Callable[[T], R], items: Iterable[T]) -> Iterator[R]:
        """Yield what comes of each item, in the order of the items, which are consumed as needed."""
        ...


class Here:
    """Does it in this process."""

    def map(self, work: Callable[[T], R], items: Iterable[T]) -> Iterator[R]:
        """Yield what comes of each item."""
        return map(work, items)


class Processes:
    """Has it done by processes of its own on this machine.

    Parameters
    ----------
    workers : int
    """

    def __init__(self, workers: int) -> None:
        self.workers = workers

    def map(self, work: Callable[[T], R], items: Iterable[T]) -> Iterator[R]:
        """Yield what comes of each item."""
        # Spawned, because open3d's threads do not survive a fork.
        context = multiprocessing.get_context("spawn")
        with ProcessPoolExecutor(self.workers, context) as pool:
            yield from _results(lambda item: pool.submit(work, item), items, 4 * self.workers)


class Cluster:
    """Has it done by the workers of a Dask cluster, a few pieces ahead of what is asked for.

    Parameters
    ----------
    client : distributed.Client
    """

    def __init__(self, client: Any) -> None:
        self.client = client

    def map(self, work: Callable[[T], R], items: Iterable[T]) -> Iterator[R]:
        """Yield what comes of each item.

        Raises
        ------
        ErsatzError
            If the workers keep dying over one item; else what `work` raises.
        """
        from distributed import KilledWorker

        threads = sum(self.client.nthreads().values())
        try:
            yield from _results(
                lambda item: self.client.submit(work, item, pure=False), items, 2 * max(1, threads)
            )
        except KilledWorker as error:
            raise ErsatzError(
                f"the workers died over one piece of work again and again ({error}): give them more memory"
            ) from None


def _results(submit: Callable[[T], Any], items: Iterable[T], ahead: int) -> Iterator[Any]:
    """Yield the results of futures in order, so many submitted ahead."""
    waiting: deque[Any] = deque()
    try:
        for item in items:
            waiting.append(submit(item))
            if len(waiting) > ahead:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()
    finally:
        for future in waiting:
            future.cancel()


@contextmanager
def open_engine(scheduler: str | None) -> Iterator[Engine]:
    """Open the engine a user names.

    Parameters
    ----------
    scheduler : str or None
        None: this process. "local:N": N processes on this machine. Else the address of a Dask scheduler,
        such as "tcp://10.0.0.1:8786", whose workers have the same ERSATZ and see the same files.

    Raises
    ------
    InputError
        If there is no scheduler at the address.
    """
    if scheduler is None:
        yield Here()
        return
    dask = distributed()
    kind, _, number = scheduler.partition(":")
    if kind == "local":
        if not number.isdigit() or int(number) < 1:
            raise InputError(f"scheduler {scheduler!r}: write local:N, with N processes, such as local:2")
        cluster = dask.LocalCluster(n_workers=int(number), threads_per_worker=1, dashboard_address=None)
        with cluster, dask.Client(cluster) as client:
            yield Cluster(client)
        return
    try:
        client = dask.Client(scheduler, timeout=PATIENCE)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(
            f"there is no Dask scheduler at {scheduler!r} ({error}): give an address such as "
            "tcp://10.0.0.1:8786, or local:N"
        ) from None
    with client:
        yield Cluster(client)
