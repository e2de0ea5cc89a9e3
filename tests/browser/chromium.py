"""A visitor of pages in Chromium: what is seen, what is asked for, what the keyboard does."""

from __future__ import annotations

import io
import shutil
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib.image as mpimg
import numpy as np
import pytest

from tests.processes import PATIENCE

selenium = pytest.importorskip("selenium.webdriver", reason="selenium is not installed")
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser"))), None)
DRIVER = shutil.which("chromedriver")
MARKS = [
    pytest.mark.browser,
    pytest.mark.skipif(not CHROMIUM or not DRIVER, reason="no chromium with its driver here"),
    pytest.mark.xdist_group("browser"),
]
FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
    "--window-size=1280,1150",
)  # fmt: skip


def new_browser(profile: Path) -> Any:
    """Return a browser with an empty profile, which a `with` block closes."""
    options = selenium.ChromeOptions()
    options.binary_location = CHROMIUM
    for flag in (*FLAGS, f"--user-data-dir={profile}"):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = selenium.Chrome(options=options, service=selenium.ChromeService(DRIVER))
    driver.set_script_timeout(PATIENCE)
    return driver


class Page:
    """A visitor of one page."""

    def __init__(self, browser: Any, url: str) -> None:
        self.browser = browser
        browser.get(url)

    def until(self, reached: Callable[[], Any]) -> None:
        end = time.monotonic() + PATIENCE
        while not reached():
            assert time.monotonic() < end, self.browser.find_element("tag name", "body").text
            time.sleep(0.05)

    def script(self, text: str, *arguments: Any) -> Any:
        return self.browser.execute_script(text, *arguments)

    def press(self, *keys: str) -> None:
        for key in keys:
            selenium.ActionChains(self.browser).send_keys(key).perform()

    def colours(self, element: Any) -> int:
        """Return how many colours are seen in a picture; one: that of the paper."""
        pixels = mpimg.imread(io.BytesIO(element.screenshot_as_png))[5:-5, 5:-5]
        return len(np.unique(pixels.reshape(-1, pixels.shape[-1]), axis=0))
