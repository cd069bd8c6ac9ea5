"""The survey's pages: over HTTP without a browser, and a dry run by scripted raters in Chromium."""

import os
import random
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from html import unescape
from pathlib import Path
from typing import Any
from urllib.error import HTTPError, URLError
from urllib.parse import urlencode
from urllib.request import Request, urlopen

import numpy as np
import pytest

from ersatz.evaluation.experiment import run
from ersatz.evaluation.pictures import find_scans, picture
from ersatz.evaluation.report import write
from ersatz.evaluation.scenario_files import save_scenarios
from ersatz.evaluation.scenarios import NONE, Scenario
from ersatz.evaluation.survey import Survey, VoteFile
from ersatz.knowledge.base import KnowledgeBase
from tests.conftest import ROOT

CHROMIUM, DRIVER = Path("/usr/bin/chromium"), Path("/usr/bin/chromedriver")
SERVER = """
import sys
from pathlib import Path
from ersatz.evaluation.pictures import find_scans
from ersatz.evaluation.scenario_files import load_scenarios
from ersatz.evaluation.survey import Survey, VoteFile
from ersatz.service.survey_pages import create_survey_app, serve_survey
scenarios, votes, scans, port = sys.argv[1:]
with VoteFile(votes) as file:
    pictures = find_scans(Path(scans), ["plate", "sponge"])
    serve_survey(create_survey_app(Survey(load_scenarios(scenarios), file), pictures), port=int(port))
"""


class Server:
    """The survey in a process of its own, to be killed and started again."""

    def __init__(self, folder: Path, scenarios: tuple[Scenario, ...]) -> None:
        pytest.importorskip("fastapi")
        pytest.importorskip("uvicorn")
        self.scenarios = scenarios
        save_scenarios(scenarios, folder / "scenarios.csv")
        (folder / "scans" / "plate").mkdir(parents=True)
        points = np.random.default_rng(0).uniform((-0.1, -0.1, 0), (0.1, 0.1, 0.01), (4000, 3))
        np.savez(folder / "scans" / "plate" / "one.npz", points=points)
        self.votes = folder / "votes.csv"
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self.port = int(probe.getsockname()[1])
        self.url = f"http://127.0.0.1:{self.port}"
        self._arguments = [
            str(folder / "scenarios.csv"),
            str(self.votes),
            str(folder / "scans"),
            str(self.port),
        ]
        self._process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-W", "ignore", "-c", SERVER, *self._arguments], cwd=ROOT
        )
        for _ in range(600):
            try:
                urlopen(self.url, timeout=5).close()
            except (URLError, ConnectionError):
                assert self._process.poll() is None, "the survey ended by itself"
                time.sleep(0.05)
            else:
                return
        raise AssertionError("the survey did not start")

    def kill(self) -> None:
        if self._process is not None:
            os.kill(self._process.pid, signal.SIGKILL)
            self._process.wait()
            self._process = None


@pytest.fixture
def server(tmp_path: Path, scenarios: tuple[Scenario, ...]) -> Iterator[Server]:
    bare = tuple(Scenario(s.id, s.missing, s.available, s.task) for s in scenarios)
    one = Server(tmp_path, bare)
    one.start()
    yield one
    one.kill()


def test_pages_over_http(server: Server) -> None:
    welcome = urlopen(server.url).read().decode()
    assert "4 times" in welcome
    page = urlopen(f"{server.url}/begin", b"").read().decode()
    expert = re.search(r"id=expert>(\w+)<", page)
    assert expert
    name = expert[1]
    scenario = re.search(r"name=scenario value='(\w+)'", page)
    assert scenario
    again = urlopen(f"{server.url}/e/{name}", urlencode({"scenario": scenario[1]}).encode()).read().decode()
    assert "Please choose one" in again
    voted = urlencode({"scenario": scenario[1], "choice": NONE}).encode()
    assert "Question 2 of 4" in urlopen(f"{server.url}/e/{name}", voted).read().decode()
    assert server.votes.read_text().endswith(f"{scenario[1]},{name},none\n")
    for path, data, code in (
        (f"/e/{name}", urlencode({"scenario": "q9", "choice": "a"}).encode(), 400),
        ("/e/NO%20BODY", None, 400),
        ("/picture/sponge", None, 404),
    ):
        with pytest.raises(HTTPError) as error:
            urlopen(server.url + path, data)
        assert error.value.code == code
    foreign = Request(f"{server.url}/e/{name}", voted, {"Origin": "http://elsewhere.example"})
    with pytest.raises(HTTPError) as refused:
        urlopen(foreign)
    assert refused.value.code == 403
    png = urlopen(f"{server.url}/picture/plate").read()
    assert png.startswith(b"\x89PNG")
    assert not re.search(r"(src|href)='?(https?:)?//", unescape(page))


def test_pictures_of_scans(shared_data: Path) -> None:
    scans = find_scans(shared_data / "objects", ["coffee mug", "binder", "ball"])
    assert set(scans) == {"coffee mug", "ball"}
    assert scans["ball"].suffix == ".ply"
    assert picture(scans["coffee mug"]).startswith(b"\x89PNG")


@pytest.fixture
def browser(tmp_path: Path) -> Iterator[Any]:
    webdriver = pytest.importorskip("selenium.webdriver")
    if not CHROMIUM.exists() or not DRIVER.exists():
        pytest.skip("no Chromium: install chromium and chromium-driver")
    options = webdriver.ChromeOptions()
    options.binary_location = str(CHROMIUM)
    for flag in ("--headless=new", "--no-sandbox", "--disable-quic", "--disable-background-networking"):
        options.add_argument(flag)
    options.add_argument(f"--user-data-dir={tmp_path / 'profile'}")
    driver = webdriver.Chrome(options, webdriver.ChromeService(str(DRIVER)))
    yield driver
    driver.quit()


def _wait_for(browser: Any, text: str) -> None:
    """Wait until the page shows the text: a click may return before the next page is there."""
    for _ in range(200):
        if text in browser.page_source:
            return
        time.sleep(0.05)
    raise AssertionError(f"{text!r} did not appear; the page is {browser.page_source}")


def _begin(browser: Any, server: Server) -> str:
    browser.get(server.url)
    browser.find_element("css selector", "button").click()
    _wait_for(browser, "Question 1 of 4")
    return str(browser.find_element("id", "expert").text)


def _vote(browser: Any, choose: random.Random) -> None:
    options = browser.find_elements("css selector", "input[name=choice]")
    choose.choice(options).click()
    browser.find_element("css selector", "button").click()


def test_dry_run_in_chromium(browser: Any, server: Server, kb: KnowledgeBase, tmp_path: Path) -> None:
    """Three scripted raters; the survey is killed in the middle of the second, and resumed."""
    choose = random.Random(1)
    experts = []
    for number in range(3):
        expert = _begin(browser, server)
        experts.append(expert)
        for question in range(4):
            _wait_for(browser, f"Question {question + 1} of 4")
            if (number, question) == (1, 2):
                before = server.votes.read_bytes()
                server.kill()
                server.start()
                assert server.votes.read_bytes() == before
                browser.get(f"{server.url}/e/{expert}")
                _wait_for(browser, "Question 3 of 4")
            _vote(browser, choose)
        _wait_for(browser, "All questions are answered")
    if shown := os.environ.get("ERSATZ_SCREENSHOT"):
        browser.get(f"{server.url}/e/screenshot")
        browser.save_screenshot(shown)
    server.kill()
    with VoteFile(server.votes) as votes:
        assert len(votes.votes) == 12
        judged = Survey(server.scenarios, votes).judged()
    assert all(set(s.ballots) == set(experts) for s in judged)
    results = run(kb, judged, baselines=["chance"])
    assert results.alpha["choices"] is not None
    written = write(results, tmp_path / "out")
    assert all(path.stat().st_size > 0 for path in written)
    assert {"heat_maps.png", "calibration.svg", "report.html"} <= {path.name for path in written}
