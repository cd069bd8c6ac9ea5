"""Pictures of every page, by a real browser: `python -m tests.service.screenshots DIRECTORY [KB [SCANS]]`."""

import sys
import tempfile
import time
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from tests.service.browser import Browser, browser
from tests.service.conftest import start

PAGES = {
    "home": "/",
    "classes": "/classes",
    "class": "/classes/Tray",
    "individual": "/individuals/gso_plate",
    "individuals": "/individuals",
    "properties": "/properties",
    "property": "/properties/rigidity",
    "property_vector": "/properties/size",
    "quality": "/qualities/support_4",
    "substitution": "/substitution?missing=tray&available=plate&available=sponge&available=binder",
    "graded": "/substitution?missing=tray&available=plate&available=sponge&graded=true&confidence=true",
    "sparql": "/ask?run=true",
    "graph": "/graph?node=Tray",
    "checks": "/checks",
    "ground": "/ground",
}
LOOKS = tuple(name for name in PAGES if name not in ("classes", "individuals", "property_vector", "quality"))
"""Pages also shown dark, and on a narrow screen."""

SLOW = ("checks", "sparql", "graph", "ground")


def write_board(path: Path) -> None:
    """Write the surface of a board of 45 x 30 x 2 cm as a cloud."""
    generator = np.random.default_rng(0)
    up, back, right = np.array([0, 0, 0.02]), np.array([0, 0.30, 0]), np.array([0.45, 0, 0])
    flat = generator.random((6000, 3)) * [0.45, 0.30, 0.0]
    side = generator.random((1200, 3)) * [0.45, 0.0, 0.02]
    end = generator.random((800, 3)) * [0.0, 0.30, 0.02]
    cloud = np.vstack([flat, flat + up, side, side + back, end, end + right])
    axes = "".join(f"property float {axis}\n" for axis in "xyz")
    head = f"ply\nformat ascii 1.0\nelement vertex {len(cloud)}\n{axes}end_header\n"
    path.write_text(head + "\n".join(" ".join(f"{value:.5f}" for value in point) for point in cloud) + "\n")


def main() -> None:
    """Start a service, open every page, and write what it looks like; some also dark, and narrow."""
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        scan = Path(folder) / "board.ply"
        write_board(scan)
        kb, scans = (*sys.argv[2:4], *("household", "")[len(sys.argv) - 2 :])
        server = start(kb, Path(folder) / "log", scans=Path(scans) if scans else None)
        try:
            for look, dark, width in (("", False, 1360), ("_dark", True, 1360), ("_narrow", False, 400)):
                with browser(server.url, Path(folder) / f"profile{look}", dark=dark, width=width) as window:
                    for name in PAGES if not look else LOOKS:
                        _picture(window, name, scan, width, out / f"{name}{look}.png")
        finally:
            server.stop()


def _picture(window: Browser, name: str, scan: Path, width: int, out: Path) -> None:
    window.open(PAGES[name])
    if name == "ground" and find_spec("open3d") is not None:
        window.find("input[type=file]").send_keys(str(scan))
        window.sees("WHAT WAS MEASURED", 120)
    time.sleep(4.0 if name in SLOW else 1.5)
    metrics = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": False}
    window.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
    time.sleep(0.3)
    height = int(str(window.driver.execute_script("return document.body.scrollHeight")))
    metrics["height"] = min(max(height, 700), 2400)
    window.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
    time.sleep(0.4)
    window.driver.save_screenshot(str(out))
    window.driver.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
    for line in window.complaints():
        sys.stderr.write(f"{name}: {line}\n")


if __name__ == "__main__":
    main()
