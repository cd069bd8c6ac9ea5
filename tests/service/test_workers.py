"""Workers: what they may not do, even where the inspection had let a query pass."""

import asyncio
import socket
import threading
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest

from ersatz.knowledge.base import KnowledgeBase
from ersatz.service.frames import Job
from ersatz.service.inspection import RefusedError
from ersatz.service.settings import ServiceSettings
from ersatz.service.sink import row_counter
from ersatz.service.workers import Pool

_HOME: list[Path] = []


@pytest.fixture(autouse=True)
def home(small: Path) -> None:
    _HOME[:] = [small]


@asynccontextmanager
async def pool(**settings: Any) -> AsyncIterator[Pool]:
    made = Pool(KnowledgeBase.open(_HOME[0]), ServiceSettings(**settings))
    await made.start()
    try:
        yield made
    finally:
        await made.stop()


async def answer(
    pool: Pool, text: str, action: str = "query", rows: int = 1000, size: int = 1 << 20
) -> bytes:
    spool, task = pool.evaluate(Job(action, text, "text/csv", "application/n-triples", rows, size))
    try:
        return b"".join([piece async for piece in spool.pieces()])
    finally:
        await asyncio.wait({task})
        spool.close()


def run(test: Callable[[], Coroutine[Any, Any, None]]) -> None:
    asyncio.run(asyncio.wait_for(test(), 60))


def test_a_worker_cannot_open_a_socket() -> None:
    """The last line of defence: whatever SERVICE gets past the inspection reaches nobody."""
    reached = threading.Event()
    listener = socket.create_server(("127.0.0.1", 0))
    listener.settimeout(8)

    def accept() -> None:
        try:
            listener.accept()
            reached.set()
        except TimeoutError:
            pass

    thread = threading.Thread(target=accept, daemon=True)
    thread.start()

    async def test() -> None:
        async with pool(workers=1) as own:
            port = listener.getsockname()[1]
            query = f"SELECT * {{ SERVICE SILENT <http://127.0.0.1:{port}/> {{ ?s ?p ?o }} }}"
            await answer(own, query)
            with pytest.raises(RefusedError):
                await answer(own, query.replace("SILENT", ""))

    run(test)
    assert not reached.is_set()
    listener.close()


def test_a_runaway_query_is_ended_and_its_worker_replaced() -> None:
    async def test() -> None:
        async with pool(workers=1, seconds=0.4, queue_seconds=5) as own:
            for _ in range(3):
                with pytest.raises(RefusedError) as caught:
                    await answer(own, "SELECT (COUNT(*) AS ?n) { ?a ?b ?c . ?d ?e ?f . ?g ?h ?i }")
                assert caught.value.status == 503
                assert (await answer(own, "SELECT (1 AS ?x) {}")).split() == [b"x", b"1"]

    run(test)


def test_limits_of_rows_and_bytes() -> None:
    async def test() -> None:
        async with pool(workers=1) as own:
            assert len((await answer(own, "SELECT * { ?s ?p ?o } LIMIT 10", rows=10)).splitlines()) == 11
            for text, rows, size in (
                ("SELECT * { ?s ?p ?o } LIMIT 12", 10, 1 << 20),
                ("CONSTRUCT { ?s ?p ?o } WHERE { ?s ?p ?o } LIMIT 12", 10, 1 << 20),
                ("SELECT * { ?s ?p ?o }", 10**6, 5000),
            ):
                with pytest.raises(RefusedError) as caught:
                    await answer(own, text, rows=rows, size=size)
                assert caught.value.status == 422

    run(test)


def test_no_answer_reaches_another_client() -> None:
    """Refused, broken and finished jobs in every order: what comes is what was asked for."""

    async def one(own: Pool, number: int) -> None:
        kind = number % 4
        if kind == 0:
            assert (await answer(own, f"SELECT ({number} AS ?x) {{}}")).split() == [
                b"x",
                str(number).encode(),
            ]
            return
        text = ["", "SELECT * { broken", "SELECT * { ?s ?p ?o } LIMIT 20", "ASK {} extra"][kind]
        with pytest.raises(RefusedError):
            await answer(own, text, rows=3)

    async def test() -> None:
        async with pool(workers=2) as own:
            await asyncio.gather(*(one(own, number) for number in range(120)))

    run(test)


def test_too_many_waiting_are_sent_away() -> None:
    async def test() -> None:
        async with pool(workers=1, waiting=2, seconds=1) as own:
            await answer(own, "ASK {}")
            slow = "SELECT (COUNT(*) AS ?n) { ?a ?b ?c . ?d ?e ?f . ?g ?h ?i }"
            found = await asyncio.gather(*(answer(own, slow) for _ in range(6)), return_exceptions=True)
            messages = [str(one) for one in found]
            assert sum("too many" in one for one in messages) == 3

    run(test)


@pytest.mark.parametrize(
    ("media", "pieces", "rows"),
    [
        ("text/csv", [b'a,b\r\n"x\r\n', b'y",1\r\n2,3\r\n'], 3),
        ("text/tab-separated-values", [b"?a\n1\n", b"2\n"], 3),
        (
            "application/sparql-results+json",
            [b'{"results":{"bindings":[{"a":{"x":"},{\\""}},', b'{"a":{}},{"a":{}}]}}'],
            2,
        ),
        ("application/sparql-results+xml", [b"<result></resu", b"lt><result></result>"], 2),
    ],
)
def test_rows_are_counted_whatever_the_pieces(media: str, pieces: list[bytes], rows: int) -> None:
    count = row_counter(media)
    assert sum(count(piece) for piece in pieces) == rows
