"""What a person may change in the browser, and a scan that is at hand: a small, writable service."""

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from selenium.webdriver.common.keys import Keys

from ersatz.knowledge.base import KnowledgeBase
from tests.service.browser import Browser, browser
from tests.service.conftest import TOKEN, Server, start
from tests.service.screenshots import write_board


@pytest.fixture(scope="module")
def own(tmp_path_factory: pytest.TempPathFactory, small: Path) -> Iterator[Server]:
    """A writable copy with pages, and a scan of one tray."""
    folder = tmp_path_factory.mktemp("own")
    shutil.copy(small, folder / "kb.ttl")
    scan = folder / "scans" / "tray" / "tray_1" / "board.ply"
    scan.parent.mkdir(parents=True)
    write_board(scan)
    running = start(folder / "kb.ttl", folder / "log", token=TOKEN, scans=folder / "scans")
    yield running
    running.stop()


@pytest.fixture(scope="module")
def window(own: Server, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    with browser(own.url, tmp_path_factory.mktemp("chromium") / "profile") as opened:
        yield opened


def saved(own: Server) -> KnowledgeBase:
    """Open what is on disk."""
    return KnowledgeBase.open(own.log.with_name("kb.ttl"))


def give_token(window: Browser, token: str) -> None:
    """Answer the dialog that asks for it."""
    field = window.find(".q-dialog input[type=password]")
    field.send_keys(Keys.CONTROL, "a")
    field.send_keys(token, Keys.ENTER)


def test_save_the_substitution_model(window: Browser, own: Server) -> None:
    window.open("/substitution?missing=plate&available=tray")
    window.press("Save the substitution model")
    give_token(window, "not the token of this service")
    assert window.sees("That is not the token.")
    assert saved(own).substitution_model("plate") is None
    give_token(window, TOKEN)
    assert window.sees("Saved.")
    model = saved(own).substitution_model("plate")
    assert model is not None
    assert [one.iri.rpartition("#")[2] for one in model.candidates] == ["Tray"]
    window.open("/substitution?missing=plate&available=tray")
    assert window.sees("Remembered from an earlier question.")


def test_how_sure_it_is_is_saved_where_it_is_shown(window: Browser, own: Server) -> None:
    window.open("/substitution?missing=tray&available=plate&graded=true&confidence=true")
    assert window.sees("P(accepted)")
    window.press("Save the substitution model")
    give_token(window, TOKEN)
    assert window.sees("Saved.")
    model = saved(own).substitution_model("tray")
    assert model is not None
    assert model.drawing is not None
    assert all(one.chances for one in model.candidates)


def test_the_scan_of_an_individual_can_be_turned(window: Browser) -> None:
    window.complaints()
    window.open("/individuals/tray_1")
    assert window.sees("8000 points in a box of 0.450 × 0.300 × 0.020 m")
    assert window.sees("board.ply")
    window.until("return document.querySelector('.cloud canvas') !== null")
    assert not window.complaints()
    window.open("/individuals/tray_2")
    assert window.sees("There is no scan of it in the folder.")


def test_add_a_scan_to_the_knowledge_base(window: Browser, own: Server, tmp_path: Path) -> None:
    pytest.importorskip("open3d")
    scan = tmp_path / "board.ply"
    write_board(scan)
    window.open("/ground")
    window.find("input[type=file]").send_keys(str(scan))
    assert window.sees("ADD IT TO THE KNOWLEDGE BASE", 120)
    window.press("Add")
    assert window.sees("Give it a name of its own.")
    window.find("input[aria-label='Its name']").send_keys("board_9")
    window.press("Add")
    give_token(window, TOKEN)
    assert window.sees("board_9 is known now.")
    assert saved(own).ask("instance", instance="board_9")[0]["className"] == "tray"
    window.open("/individuals/board_9")
    assert window.sees("A tray with 1 measurement of 1 property")
