"""How long pages take to open in a real browser, also with ten thousand classes.

`python -m tests.benchmarks.serve_pages [CLASSES]`. Each page is opened six times in one browser, the first
with an empty cache; the time is from the request until the words are on the page. Before each opening a page
of NiceGUI that holds one label is opened in a browser of its own: what the framework and the machine take.
"""

import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from http.client import HTTPConnection
from pathlib import Path

import numpy as np

from ersatz.grounding.subcategorization import SubcategorizationSettings
from ersatz.pipeline import Settings, build
from tests.knowledge.endpoints import free_port
from tests.service.browser import Browser, browser
from tests.service.conftest import start


def large(out: Path, classes: int) -> None:
    """Ground a knowledge base of many classes of three objects each."""
    chance = np.random.default_rng(0)
    rows = ["object_class,instance,weight [kg],rigidity,support [m2]"]
    for number in range(classes):
        centre = chance.random(3)
        for at in range(3):
            weight, rigidity, support = np.clip(centre + chance.normal(0, 0.05, 3), 0.001, 1)
            rows.append(f"thing {number},thing_{number}_{at},{weight:.4f},{rigidity:.4f},{support:.4f}")
    table = out.with_name("objects.csv")
    table.write_text("\n".join(rows) + "\n")
    build(tables=[table], settings=Settings(SubcategorizationSettings(4, restarts=5)), out=out)


BARE = """\
import sys, uvicorn
from fastapi import FastAPI
from nicegui import ui
@ui.page("/")
def page(): ui.label("nothing but a label")
app = FastAPI()
ui.run_with(app, tailwind=False)
uvicorn.run(app, port=int(sys.argv[1]), log_level="error")
"""


@contextmanager
def bare(folder: Path) -> Iterator[Browser]:
    """Serve an empty page, and open a browser for it."""
    port = free_port()
    process = subprocess.Popen([sys.executable, "-c", BARE, str(port)])
    try:
        for _ in range(300):
            try:
                HTTPConnection("127.0.0.1", port, timeout=5).request("GET", "/")
                break
            except OSError:
                time.sleep(0.1)
        with browser(f"http://127.0.0.1:{port}", folder) as window:
            yield window
    finally:
        process.terminate()
        process.wait()


def opened(window: Browser, path: str, words: str) -> float:
    """Return the seconds until a page shows the words."""
    begun = time.perf_counter()
    window.driver.get(window.url + path)
    window.sees(words, 60)
    return time.perf_counter() - begun


def timed(window: Browser, empty: Browser, path: str, words: str) -> str:
    """Return the times of six openings, and of as many of the empty page."""
    ours, theirs = [], []
    for _ in range(6):
        theirs.append(opened(empty, "/", "nothing but a label"))
        ours.append(opened(window, path, words))
    later, base = sorted(ours[1:])[2], sorted(theirs[1:])[2]
    return (
        f"{path:20} first {ours[0]:.2f} s, then median {later:.2f} s; "
        f"empty page {base:.2f} s, ratio {later / base:.1f}"
    )


def main() -> None:
    """Run and print."""
    classes = int(sys.argv[1]) if len(sys.argv) > 1 else 10_000
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        large(folder / "large.nt", classes)
        for location, paths in (
            ("household", (("/", "What will do"), ("/classes/Tray", "Known from"))),
            (str(folder / "large.nt"), (("/", "What will do"), ("/classes/Thing42", "Known from"))),
        ):
            begun = time.perf_counter()
            server = start(location, folder / "log", patience=300)
            shown = Path(location).stem
            sys.stdout.write(f"{shown:10} started in {time.perf_counter() - begun:.1f} s\n")
            try:
                with (
                    browser(server.url, folder / f"profile{shown}") as window,
                    bare(folder / f"empty{shown}") as empty,
                ):
                    for path, words in paths:
                        sys.stdout.write(f"{shown:10} {timed(window, empty, path, words)}\n")
            finally:
                server.stop()


if __name__ == "__main__":
    main()
