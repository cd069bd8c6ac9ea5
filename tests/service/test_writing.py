"""Writing: only with the token, one at a time, and nothing is lost."""

import json
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from urllib.parse import urlencode

import pytest

from ersatz.errors import InputError
from ersatz.knowledge.base import KnowledgeBase
from ersatz.service.app import create_app
from ersatz.service.settings import ServiceSettings, read_token
from tests.service.conftest import TOKEN, Server, start

UPDATE = {"Content-Type": "application/sparql-update"}
AUTH = {"Authorization": f"Bearer {TOKEN}"}
NOTE = "http://www.w3.org/2000/01/rdf-schema#comment"
INSERT = f'PREFIX kb: <https://w3id.org/ersatz/kb#> INSERT DATA {{ kb:Plate <{NOTE}> "number %d"@en }}'


def notes(server: Server) -> set[str]:
    query = f"SELECT ?n {{ ?s <{NOTE}> ?n FILTER (STRSTARTS(?n, 'number')) }}"
    _, body, _ = server.send("GET", f"/sparql?{urlencode({'query': query})}")
    return {row["n"]["value"] for row in json.loads(body)["results"]["bindings"]}


def test_an_update_needs_the_token_and_is_kept(writable: Server) -> None:
    for headers, status in (
        ({}, 401),
        ({"Authorization": "Bearer wrong"}, 401),
        ({"Authorization": "Basic x"}, 401),
    ):
        got, _, answer = writable.send("POST", "/update", (INSERT % 1).encode(), UPDATE | headers)
        assert got == status
        assert (answer.getheader("WWW-Authenticate") or "").startswith("Bearer")
    assert notes(writable) == set()
    assert writable.send("POST", "/update", (INSERT % 1).encode(), UPDATE | AUTH)[0] == 204
    assert notes(writable) == {"number 1"}
    kept = KnowledgeBase.open(writable.log.with_name("kb.ttl"))
    assert kept.revision == json.loads(writable.send("GET", "/health")[1])["revision"]
    assert len(kept.query(f"SELECT * {{ ?s <{NOTE}> 'number 1'@en }}")) == 1
    assert TOKEN not in writable.log.read_text()


@pytest.mark.parametrize(
    ("update", "status"),
    [
        ("INSERT DATA { <x:a> <x:b> }", 400),
        ("LOAD <file:///etc/passwd>", 403),
        ("INSERT DATA { GRAPH <x:g> { <x:a> <x:b> <x:c> } }", 400),
        ("CLEAR ALL", 400),
        ("DELETE WHERE { ?b <https://w3id.org/ersatz#formatVersion> ?v }", 400),
    ],
)
def test_bad_updates_change_nothing(writable: Server, update: str, status: int) -> None:
    before = sorted(
        writable.send("GET", "/data?default", headers={"Accept": "application/n-triples"})[1].splitlines()
    )
    got, text, _ = writable.send("POST", "/update", update.encode(), UPDATE | AUTH)
    assert got == status, text
    after = sorted(
        writable.send("GET", "/data?default", headers={"Accept": "application/n-triples"})[1].splitlines()
    )
    assert before == after


def test_updates_at_once_are_all_kept_and_a_stop_is_clean(fresh: Server, tmp_path: Path) -> None:
    def write(number: int) -> int:
        return fresh.send("POST", "/update", (INSERT % number).encode(), UPDATE | AUTH)[0]

    with ThreadPoolExecutor(6) as writers:
        assert set(writers.map(write, range(6))) == {204}
    assert notes(fresh) == {f"number {number}" for number in range(6)}
    children = _children(fresh.process.pid)
    assert len(children) >= 2
    assert fresh.stop() in (0, -15)
    time.sleep(0.5)
    assert not [pid for pid in children if _is_ours(pid)]
    assert "Traceback" not in fresh.log.read_text()
    kept = KnowledgeBase.open(tmp_path / "kb.ttl")
    assert len(kept.query(f"SELECT ?n {{ ?s <{NOTE}> ?n FILTER (STRSTARTS(?n, 'number')) }}")) == 6


def test_a_stop_in_the_middle_loses_nothing_that_was_confirmed(fresh: Server, tmp_path: Path) -> None:
    confirmed: list[int] = []

    def write() -> None:
        for number in range(100):
            try:
                if fresh.send("POST", "/update", (INSERT % number).encode(), UPDATE | AUTH)[0] == 204:
                    confirmed.append(number)
            except OSError:
                return

    with ThreadPoolExecutor(1) as writer:
        writer.submit(write)
        while len(confirmed) < 2:
            time.sleep(0.02)
        fresh.stop()
    kept = KnowledgeBase.open(tmp_path / "kb.ttl")
    found = {str(row["n"]) for row in kept.query(f"SELECT ?n {{ ?s <{NOTE}> ?n }}")}
    assert {f"number {number}" for number in confirmed} <= found


def test_a_remembered_answer_is_reused(writable: Server) -> None:
    question = json.dumps({"missing": "tray"}).encode()
    got, body, _ = writable.send(
        "POST", "/substitutes", question, {"Content-Type": "application/json"} | AUTH
    )
    assert got == 200, body
    again = json.loads(writable.send("GET", "/substitutes?missing=tray")[1])
    assert again["reused"] == (again["status"] == "ok")


def test_how_sure_an_answer_by_degrees_is_can_be_remembered(writable: Server) -> None:
    asked = {"graded": True, "spacing": "centroid", "properties": "weight,support"}
    question = json.dumps({"missing": "tray", "available": ["plate"], "confidence": True} | asked).encode()
    headers = {"Content-Type": "application/json"} | AUTH
    got, body, _ = writable.send("POST", "/substitutes", question, headers)
    assert got == 200, body
    told = json.loads(body)
    assert [told["settings"][name] for name in asked] == [True, "centroid", ["support", "weight"]]
    assert told["substitutes"][0]["confidence"]["draws"] == 200
    text = (writable.log.parent / "kb.ttl").read_text(encoding="utf-8")
    assert "ersatz:acceptanceProbability" in text


@pytest.mark.parametrize(
    ("question", "status", "message"),
    [
        ({"missing": "tary"}, 404, b"did you mean 'tray'"),
        ({"missing": "tray", "settings": {"graded": True}}, 422, b"settings"),
        ({"missing": "tray", "graded": True, "similarity": "jaccard"}, 400, b"leave graded out"),
        ({"missing": "tray", "certainty": "2"}, 400, b"certainty is 2"),
    ],
)
def test_what_cannot_be_remembered_as_asked_is_refused(
    writable: Server, question: dict[str, object], status: int, message: bytes
) -> None:
    headers = {"Content-Type": "application/json"} | AUTH
    got, body, _ = writable.send("POST", "/substitutes", json.dumps(question).encode(), headers)
    assert got == status
    assert message in body


def test_a_directory_is_served_and_written(tmp_path: Path, small: Path) -> None:
    KnowledgeBase.open(small).save(tmp_path / "kb")
    server = start(tmp_path / "kb", tmp_path / "log", token=TOKEN, pages=False)
    try:
        assert server.send("POST", "/update", (INSERT % 7).encode(), UPDATE | AUTH)[0] == 204
        assert notes(server) == {"number 7"}
    finally:
        server.stop()
    assert len(KnowledgeBase.open(tmp_path / "kb").query(f"SELECT * {{ ?s <{NOTE}> 'number 7'@en }}")) == 1


def test_the_shipped_one_is_not_served_writable() -> None:
    with pytest.raises(InputError, match="shipped"):
        create_app(KnowledgeBase.open("household"), ServiceSettings(token=TOKEN, pages=False))


def test_tokens_are_kept_to_oneself(tmp_path: Path) -> None:
    file = tmp_path / "token"
    file.write_text(f"{TOKEN}\n")
    file.chmod(0o644)
    with pytest.raises(InputError, match="chmod 600"):
        read_token(file)
    file.chmod(0o600)
    assert read_token(file) == TOKEN
    with pytest.raises(InputError, match="at least 16"):
        ServiceSettings(token="short")
    with pytest.raises(InputError, match="cannot read"):
        read_token(tmp_path / "none")


def _is_ours(pid: int) -> bool:
    line = Path(f"/proc/{pid}/cmdline")
    return line.exists() and b"evaluator" in line.read_bytes()


def _children(pid: int) -> list[int]:
    found = [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
    return [*found, *(grandchild for child in found for grandchild in _children(child))]
