"""How long pages take to open in a real browser, also with ten thousand classes.

`python -m tests.benchmarks.serve_pages [CLASSES]`. Each page is opened six times in one browser,
the first with an empty cache; the time is from the request until the words are on the page.
"""

import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from ersatz.grounding.subcategorization import SubcategorizationSettings
from ersatz.pipeline import Settings, build
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


def timed(window: Browser, path: str, words: str) -> str:
    """Return the times of six openings."""
    found = []
    for _ in range(6):
        begun = time.perf_counter()
        window.driver.get(window.url + path)
        window.sees(words, 60)
        found.append(time.perf_counter() - begun)
    return f"{path:22} first {found[0]:.2f} s, then median {sorted(found[1:])[2]:.2f} s"


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
            sys.stdout.write(f"{Path(location).stem:10} started in {time.perf_counter() - begun:.1f} s\n")
            try:
                with browser(server.url, folder / f"profile{len(location)}") as window:
                    for path, words in paths:
                        sys.stdout.write(f"{Path(location).stem:10} {timed(window, path, words)}\n")
            finally:
                server.stop()


if __name__ == "__main__":
    main()
