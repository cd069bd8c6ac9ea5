"""A service for others: web origins that may read, and knowledge bases that lie elsewhere."""

import json
from pathlib import Path
from urllib.parse import urlencode

import pytest

from ersatz.errors import InputError
from ersatz.knowledge.base import KnowledgeBase
from ersatz.service.app import create_app
from ersatz.service.settings import ServiceSettings
from tests.cli import Shell
from tests.service.conftest import TOKEN, Server, start

THEIRS = "https://elsewhere.example"


def test_an_origin_that_is_named_may_read(small: Path, tmp_path: Path) -> None:
    server = start(small, tmp_path / "log", pages=False, origins=(THEIRS,))
    try:
        for origin, allowed in ((THEIRS, THEIRS), ("https://other.example", None)):
            _, _, answer = server.send("GET", "/health", headers={"Origin": origin})
            assert answer.getheader("Access-Control-Allow-Origin") == allowed
            ask = {"Origin": origin, "Access-Control-Request-Method": "POST"}
            _, _, answer = server.send("OPTIONS", "/sparql", headers=ask)
            assert answer.getheader("Access-Control-Allow-Origin") == allowed
    finally:
        server.stop()


@pytest.mark.parametrize("origin", ["example.org", "https://example.org/path", "ftp://x", "https://a b", ""])
def test_what_is_no_origin_is_refused(origin: str) -> None:
    with pytest.raises(InputError, match="is no web origin"):
        ServiceSettings(origins=(origin,))


@pytest.mark.parametrize(
    ("option", "value", "words"),
    [
        ("--cors", "example.org", "'example.org' is no web origin"),
        ("--scans", "nowhere", "there is no such folder of scans"),
    ],
)
def test_the_command_says_what_is_wrong(ersatz: Shell, option: str, value: str, words: str) -> None:
    done = ersatz("serve", "household", option, value)
    assert done.code == 2
    assert words in done.err


def count(server: Server) -> int:
    query = urlencode({"query": "SELECT (COUNT(*) AS ?n) { ?s ?p ?o }"})
    _, body, _ = server.send("GET", f"/sparql?{query}")
    return int(json.loads(body)["results"]["bindings"][0]["n"]["value"])


def test_a_knowledge_base_behind_an_endpoint_is_served(writable: Server, tmp_path: Path) -> None:
    relay = start(f"{writable.url}/sparql", tmp_path / "log")
    try:
        assert count(relay) == count(writable) > 100
        status, body, _ = relay.send("GET", "/substitutes?missing=tray&available=plate")
        assert (status, json.loads(body)["missing"]) == (200, "tray")
        status, body, _ = relay.send("GET", "/classes/Tray")
        assert status == 200
        assert b"Known from 3 instances" in body
    finally:
        relay.stop()


def test_it_is_changed_at_its_own_endpoint(writable: Server) -> None:
    kb = KnowledgeBase.open(f"{writable.url}/sparql")
    with pytest.raises(InputError, match="changed at its own endpoint"):
        create_app(kb, ServiceSettings(token=TOKEN))
