"""A real browser without a screen: Debian's Chromium, driven by selenium."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.by import By
from selenium.webdriver.remote.webelement import WebElement
from selenium.webdriver.support.ui import WebDriverWait

FLAGS = (
    "--headless=new",
    "--no-sandbox",
    "--disable-quic",
    "--disable-background-networking",
    "--disable-component-update",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--force-color-profile=srgb",
)


class Browser:
    """A browser at one service."""

    def __init__(self, driver: webdriver.Chrome, url: str) -> None:
        self.driver = driver
        self.url = url

    def open(self, path: str) -> None:
        """Open a page and wait until it is alive."""
        self.driver.get(self.url + path)
        self.until("return document.querySelector('main') && (window.did_handshake ?? true)")

    def until(self, script: str, seconds: float = 20) -> object:
        """Wait until a script returns something true."""
        return WebDriverWait(self.driver, seconds, 0.1).until(lambda d: d.execute_script(script))

    def sees(self, words: str, seconds: float = 20) -> bool:
        """Wait until the words are on the page."""
        WebDriverWait(self.driver, seconds, 0.1).until(lambda d: words in self.text())
        return True

    def text(self) -> str:
        """Return what a person reads."""
        return str(self.driver.execute_script("return document.body.innerText"))

    def find(self, css: str) -> WebElement:
        """Wait for an element."""
        return WebDriverWait(self.driver, 20, 0.1).until(lambda d: d.find_element(By.CSS_SELECTOR, css))

    def link(self, words: str) -> WebElement:
        """Wait for a link by its words."""
        return WebDriverWait(self.driver, 20, 0.1).until(lambda d: d.find_element(By.LINK_TEXT, words))

    def press(self, words: str, css: str = "button") -> None:
        """Click the button, or another thing, with these words."""
        script = (
            "const all = [...document.querySelectorAll(arguments[1])];"
            "const b = all.find(b => b.innerText.includes(arguments[0])); if (b) b.click(); return !!b"
        )
        WebDriverWait(self.driver, 20, 0.1).until(lambda d: d.execute_script(script, words, css))

    def complaints(self) -> list[str]:
        """Return what the browser's console says went wrong since the last call."""
        return [str(one["message"]) for one in self.driver.get_log("browser") if one["level"] == "SEVERE"]  # type: ignore[no-untyped-call]


@contextmanager
def browser(
    url: str, profile: Path, *, dark: bool = False, width: int = 1360, height: int = 900
) -> Iterator[Browser]:
    """Start Chromium with a fresh profile; the test is skipped where there is none."""
    chromium, driver = shutil.which("chromium"), shutil.which("chromedriver")
    if chromium is None or driver is None:
        pytest.skip("no chromium and chromedriver: apt-get install chromium chromium-driver")
    options = Options()
    options.binary_location = chromium
    for flag in (*FLAGS, f"--user-data-dir={profile}", f"--window-size={width},{height}"):
        options.add_argument(flag)
    if dark:
        options.add_argument("--force-dark-mode")
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    chrome = webdriver.Chrome(options, Service(driver))
    try:
        yield Browser(chrome, url)
    finally:
        chrome.quit()
