"""Pictures of every page, by a real browser: `python -m tests.service.screenshots DIRECTORY [KB]`."""

import sys
import tempfile
import time
from pathlib import Path

from tests.service.browser import browser
from tests.service.conftest import start

PAGES = {
    "home": "/",
    "classes": "/classes",
    "class": "/classes/Tray",
    "individual": "/individuals/plate_1",
    "individuals": "/individuals",
    "properties": "/properties",
    "property": "/properties/rigidity",
    "property_vector": "/properties/size",
    "quality": "/qualities/support_4",
    "substitution": "/substitution?missing=tray&available=plate&available=sponge&available=binder",
    "sparql": "/ask?run=true",
    "graph": "/graph?node=Tray",
    "checks": "/checks",
    "ground": "/ground",
}


def main() -> None:
    """Start a service, open every page, and write what it looks like; some also dark, and narrow."""
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    chosen = set(sys.argv[3:])
    with tempfile.TemporaryDirectory() as folder:
        server = start(sys.argv[2] if len(sys.argv) > 2 else "household", Path(folder) / "log")
        try:
            for look, dark, width in (("", False, 1360), ("_dark", True, 1360), ("_narrow", False, 420)):
                with browser(server.url, Path(folder) / f"profile{look}", dark=dark, width=width) as window:
                    for name, path in PAGES.items():
                        if (look and name not in ("class", "substitution", "property", "home")) or chosen - {
                            name
                        } == chosen != set():
                            continue
                        window.open(path)
                        time.sleep(4.0 if name in ("checks", "sparql", "graph") else 1.5)
                        height = int(str(window.driver.execute_script("return document.body.scrollHeight")))
                        window.driver.set_window_size(width, min(max(height + 90, 800), 2400))
                        time.sleep(0.4)
                        window.driver.save_screenshot(str(out / f"{name}{look}.png"))
                        window.driver.set_window_size(width, 900)
                        for line in window.complaints():
                            sys.stderr.write(f"{name}: {line}\n")
        finally:
            server.stop()


if __name__ == "__main__":
    main()
