"""Fifty clients at once, at our endpoint and at the bare Oxigraph server, on the same queries in one run.

`python -m tests.benchmarks.serve_load [SECONDS] [KB]`. Rounds alternate, so that both see the same machine.
"""

import asyncio
import os
import random
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import quote

from ersatz.knowledge.base import KnowledgeBase
from ersatz.knowledge.queries import stored_query
from tests.knowledge.endpoints import free_port
from tests.service.conftest import start

CLIENTS = 50
ROUNDS = 4


@dataclass
class Result:
    """What the clients saw: seconds of each answer, errors, and bytes."""

    seconds: list[float] = field(default_factory=list)
    errors: int = 0
    took: float = 0.0

    def line(self, name: str) -> str:
        ordered = sorted(self.seconds)
        median, most = (1000 * ordered[int(len(ordered) * share)] for share in (0.5, 0.99))
        rate = len(ordered) / self.took
        spread = f"median {median:6.1f} ms   p99 {most:6.1f} ms"
        return f"{name:10} {rate:8.0f} answers/s   {spread}   errors {self.errors}"


def questions(kb: KnowledgeBase) -> list[str]:
    """Return the mix: small lookups, joins, aggregates, a graph, and the reasoner's large read."""
    classes = [str(row["name"]) for row in kb.ask("classes")][:20]
    texts = [stored_query("class_knowledge").bind(kb.resolve, {"class": name}) for name in classes]
    texts += [stored_query("instances").bind(kb.resolve, {"class": name}) for name in classes]
    texts += [stored_query(name).text for name in ("classes", "properties", "qualities", "memberships")]
    texts += [
        stored_query("classes_with_quality").bind(kb.resolve, {"quality": name})
        for name in kb.known_names("quality")[:8]
    ]
    texts += [
        f"CONSTRUCT {{ <{row['class']}> ?p ?o }} WHERE {{ <{row['class']}> ?p ?o }}"
        for row in kb.ask("classes")[:10]
    ]
    texts.append("SELECT ?t (COUNT(*) AS ?n) { ?s a ?t } GROUP BY ?t ORDER BY DESC(?n)")
    return texts


async def client(port: int, texts: list[str], until: float, result: Result, seed: int) -> None:
    """Ask one question after another on one connection."""
    chance = random.Random(seed)
    accept = "application/sparql-results+json, application/n-triples;q=0.9"
    requests = [
        f"GET /query?query={quote(text)} HTTP/1.1\r\nHost: localhost\r\nAccept: {accept}\r\n\r\n".encode()
        for text in texts
    ]
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    while time.perf_counter() < until:
        begun = time.perf_counter()
        writer.write(chance.choice(requests))
        head = await reader.readuntil(b"\r\n\r\n")
        fields = dict(line.lower().split(b": ", 1) for line in head.split(b"\r\n")[1:] if b": " in line)
        if b"content-length" in fields:
            await reader.readexactly(int(fields[b"content-length"]))
        else:
            while size := int(await reader.readline(), 16):
                await reader.readexactly(size + 2)
            await reader.readline()
        if b" 200 " not in head[:16]:
            result.errors += 1
        result.seconds.append(time.perf_counter() - begun)
    writer.close()


async def load(port: int, texts: list[str], seconds: float, result: Result) -> None:
    """Let all clients ask."""
    begun = time.perf_counter()
    await asyncio.gather(*(client(port, texts, begun + seconds, result, seed) for seed in range(CLIENTS)))
    result.took += time.perf_counter() - begun


def memory(pid: int) -> float:
    """Return the resident memory of a process and its children, MB."""
    pids = [pid]
    for one in pids:
        pids += map(int, Path(f"/proc/{one}/task/{one}/children").read_text().split())
    fields = (Path(f"/proc/{one}/smaps_rollup").read_text().split("Pss:")[1].split()[0] for one in pids)
    return sum(map(int, fields)) / 1024


def bare(kb: KnowledgeBase, folder: Path) -> tuple[subprocess.Popen[bytes], int]:
    """Start the Oxigraph server on a copy of the knowledge base."""
    port = free_port()
    (folder / "kb.nt").write_text("".join(f"{t.subject} {t.predicate} {t.object} .\n" for t in kb.triples()))
    command = [str(Path(sys.executable).with_name("oxigraph"))]
    store = ["--location", str(folder / "store")]
    subprocess.run(
        [*command, "load", *store, "--file", str(folder / "kb.nt")], check=True, capture_output=True
    )
    process = subprocess.Popen(
        [*command, "serve-read-only", *store, "--bind", f"127.0.0.1:{port}"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    time.sleep(1)
    return process, port


def main() -> None:
    """Run and print."""
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 60.0
    location = sys.argv[2] if len(sys.argv) > 2 else "household"
    kb = KnowledgeBase.open(location)
    texts = questions(kb)
    ours, theirs = Result(), Result()
    with tempfile.TemporaryDirectory() as name:
        server = start(location, Path(name) / "log", pages=False, workers=os.cpu_count() or 2)
        process, port = bare(kb, Path(name))
        try:
            asyncio.run(load(server.port, texts, 1, Result()))
            asyncio.run(load(port, texts, 1, Result()))
            held = [memory(server.process.pid)]
            for _ in range(ROUNDS):
                asyncio.run(load(server.port, texts, seconds / ROUNDS, ours))
                held.append(memory(server.process.pid))
                asyncio.run(load(port, texts, seconds / ROUNDS, theirs))
        finally:
            process.terminate()
            process.wait()
            server.stop()
    sys.stdout.write(
        f"{CLIENTS} clients, {len(texts)} queries, {seconds:g} s each, load {os.getloadavg()[0]:.1f}\n"
    )
    sys.stdout.write(f"{ours.line('ersatz')}\n{theirs.line('oxigraph')}\n")
    ratio = (len(ours.seconds) / ours.took) / (len(theirs.seconds) / theirs.took)
    sys.stdout.write(f"ratio {ratio:.2f}; memory of ersatz, MB: {' '.join(f'{one:.0f}' for one in held)}\n")


if __name__ == "__main__":
    main()
