"""The pages in a real browser: each opens without a complaint, and the main paths lead somewhere."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from selenium.webdriver.common.by import By

from tests.service.browser import Browser, browser
from tests.service.conftest import Server
from tests.service.screenshots import PAGES, write_board

EXPECTED = {
    "home": "The tool is missing. What will do?",
    "classes": "water bottle",
    "class": "Known from",
    "individual": "A plate with",
    "individuals": "gso_",
    "properties": "FUNCTION MODELS",
    "property": "WHERE THE VALUES LIE",
    "property_vector": "WHERE THE VALUES LIE",
    "quality": "WHAT GOES WITH IT",
    "substitution": "In place of a tray",
    "graded": "alike, counts",
    "sparql": "rows in",
    "graph": "rdfs:subClassOf",
    "checks": "rules",
    "ground": "A scan, at most",
}


@pytest.fixture(scope="module")
def window(server: Server, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    with browser(server.url, tmp_path_factory.mktemp("chromium") / "profile") as opened:
        yield opened


@pytest.mark.parametrize("name", PAGES)
def test_every_page_opens(window: Browser, name: str) -> None:
    window.complaints()
    window.open(PAGES[name])
    assert window.sees(EXPECTED[name], 30)
    assert not window.complaints()
    assert window.driver.title.endswith("ERSATZ")


def test_nothing_is_loaded_from_elsewhere(window: Browser) -> None:
    for path in ("/", "/properties", "/ask"):
        window.open(path)
        window.until("return document.readyState === 'complete'")
        loaded = window.driver.execute_script(
            "return performance.getEntriesByType('resource').map(e => e.name)"
        )
        assert loaded
        assert not [one for one in loaded if not one.startswith((window.url, "data:", "blob:"))]


def test_find_the_plate(window: Browser) -> None:
    window.open("/classes")
    window.find("input[aria-label='Search classes']").send_keys("plat")
    window.until("return document.querySelectorAll('.items a').length === 1")
    window.find(".items a").click()
    assert window.sees("Known from 13 instances")
    assert "/classes/Plate" in window.driver.current_url
    assert window.sees("of 13")


def test_the_slider_marks_what_is_representative(window: Browser) -> None:
    window.open("/classes/Tray")
    before = len(window.driver.find_elements(By.CSS_SELECTOR, ".bar.rep"))
    thumb = window.find(".q-slider [tabindex='0'], .q-slider[tabindex='0']")
    for _ in range(9):
        thumb.send_keys("\ue014")  # arrow right
    window.until(f"return document.querySelectorAll('.bar.rep').length < {before}")
    assert before > 0


def test_ask_for_a_trays_substitute(window: Browser) -> None:
    window.open("/")
    window.press("Find substitutes")
    assert window.sees("In place of a tray")
    assert "missing=tray" in window.driver.current_url
    window.open("/substitution?missing=tray&available=plate&available=sponge&tolerance=0.2")
    assert window.sees("1 OF 2 WILL DO")
    assert window.sees("lacks")
    who = [one.text for one in window.driver.find_elements(By.CSS_SELECTOR, ".who")]
    assert who == ["plate", "sponge"]


def test_saving_on_a_read_only_service_says_so(window: Browser) -> None:
    window.open("/substitution?missing=tray")
    window.press("Save the substitution model")
    assert window.sees("read-only: start it with --writable")


def test_run_a_stored_query(window: Browser) -> None:
    window.open("/ask?question=class_knowledge")
    window.until("return document.querySelector('.cm-content').innerText.includes('kb#Tray')")
    window.press("Run")
    assert window.sees("rows in")
    assert window.sees("flatness_4")


def test_a_refused_query_is_explained(window: Browser) -> None:
    window.open("/ask?run=true&query=SELECT%20*%20%7B%20SERVICE%20%3Chttp://127.0.0.1:9/%3E%20%7B%7D%20%7D")
    assert window.sees("SERVICE is not allowed")


def test_a_click_opens_neighbours(window: Browser) -> None:
    window.open("/graph?node=tray_model_1")
    assert window.sees("tray_model_1")
    window.link("Tray").click()
    window.until("return location.search === '?node=Tray'")
    assert window.sees("rdfs:subClassOf")


def test_labels_are_text(window: Browser) -> None:
    """What looks like markup in a query's answer stays text."""
    query = "SELECT%20(%22%3Cimg%20src=x%20onerror='document.title=1'%3E%22%20AS%20?x)%20%7B%7D"
    window.open(f"/ask?run=true&query={query}")
    assert window.sees("<img src=x")
    assert window.driver.find_elements(By.CSS_SELECTOR, "main img") == []
    assert window.driver.title.endswith("ERSATZ")
    window.open("/individuals/%3Cimg%20src=x%3E")
    assert window.sees("img src=x")
    assert window.driver.find_elements(By.CSS_SELECTOR, "main img") == []


def test_light_and_dark_and_back(window: Browser) -> None:
    window.open("/")
    window.find("button[aria-label='Light or dark']").click()
    window.until("return document.body.classList.contains('body--dark')")
    window.open("/classes")
    window.until("return document.body.classList.contains('body--dark')")
    window.find("button[aria-label='Light or dark']").click()
    window.until("return !document.body.classList.contains('body--dark')")


def test_narrow_screens_do_not_scroll_sideways(window: Browser) -> None:
    """Nothing is cut off at 400 pixels: what is wider scrolls in a box of its own."""
    metrics = {"width": 400, "height": 900, "deviceScaleFactor": 1, "mobile": False}
    window.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
    try:
        for name in PAGES:
            window.open(PAGES[name])
            assert window.sees(EXPECTED[name], 30)
            wide = window.driver.execute_script("return document.documentElement.scrollWidth")
            assert wide <= 400, name
    finally:
        window.driver.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def test_every_table_can_be_copied(window: Browser) -> None:
    window.open("/properties/rigidity")
    window.driver.execute_script(
        "document.execCommand = () => { window.copied = document.querySelector('textarea').value };"
        "Object.defineProperty(navigator, 'clipboard', { value: undefined })"
    )
    window.find("button[aria-label='Copy the table']").click()
    lines = str(window.until("return window.copied")).splitlines()
    assert lines[0].split("\t")[:3] == ["quality", "rank", "centroid (dimensionless)"]
    assert lines[1].split("\t")[:2] == ["rigidity 1", "1"]
    assert len(lines) == 5
    for name in ("individual", "properties", "graph", "checks", "sparql"):
        window.open(PAGES[name])
        assert window.sees(EXPECTED[name], 30)
        tables = len(window.driver.find_elements(By.CSS_SELECTOR, "table.plain"))
        assert tables == len(window.driver.find_elements(By.CSS_SELECTOR, "[data-do='copy-table']")) > 0


def test_mappings_are_shown_unlinked(window: Browser) -> None:
    window.open("/classes/Bowl")
    assert window.sees("THE SAME IN OTHER ONTOLOGIES")
    text = window.text()
    for ontology, term in (
        ("SOMA", "http://www.ease-crc.org/ont/SOMA.owl#Bowl"),
        ("KnowRob", "http://knowrob.org/kb/knowrob.owl#Bowl"),
        ("Open English WordNet", "https://en-word.net/id/oewn-02884182-n"),
    ):
        assert ontology in text
        assert term in text
    assert "closeMatch" in text
    assert "ersatz.sssom.tsv, manual mapping curation" in text


def test_graded_reasoning_and_how_sure_it_is(window: Browser) -> None:
    window.open("/substitution?missing=tray&available=plate&available=sponge")
    assert window.sees("1 OF 2 WILL DO")
    window.press("Graded: reason with degrees", ".q-toggle")
    window.until("return location.search.includes('graded=True')")
    assert window.sees("alike, counts")
    rows = "[...document.querySelectorAll('.bars')].map(bars => bars.innerText).join(' ')"
    window.until(f"return /support 4\\s+0.58/.test({rows}) && /weight\\s+0.90/.test({rows})")
    window.press("Say how sure it is", ".q-toggle")
    assert window.sees("P(accepted) 0.98")
    assert window.sees("similarity 0.69 to 0.79")


def test_upload_a_scan(window: Browser, tmp_path: Path) -> None:
    pytest.importorskip("open3d")
    scan = tmp_path / "board.ply"
    write_board(scan)
    window.open("/ground")
    window.find("input[type=file]").send_keys(str(scan))
    assert window.sees("WHAT WAS MEASURED", 120)
    assert window.sees("flatness 4")
    assert window.sees("MOST LIKE IT")
    window.until("return document.querySelector('canvas') !== null")


def test_a_file_that_is_no_scan_is_refused(window: Browser, tmp_path: Path) -> None:
    pytest.importorskip("open3d")
    scan = tmp_path / "broken.ply"
    scan.write_bytes(b"ply\nformat ascii 1.0\nelement vertex 99\nend_header\nnothing")
    window.open("/ground")
    window.find("input[type=file]").send_keys(str(scan))
    window.until("return document.querySelector('.notice.bad') !== null", 60)
    assert str(tmp_path) not in window.text()
