"""The explorer in a real browser: it draws at once, and hears the keyboard."""

from __future__ import annotations

import re
import shutil
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from tests.processes import PATIENCE, PROGRAM, begun

pytest.importorskip("marimo", reason="marimo is not installed")
selenium = pytest.importorskip("selenium.webdriver", reason="selenium is not installed")
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser"))), None)
DRIVER = shutil.which("chromedriver")
pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(not CHROMIUM or not DRIVER, reason="no chromium with its driver here"),
    pytest.mark.xdist_group("browser"),
]
FLAGS = "--headless", "--no-sandbox", "--disable-gpu", "--window-size=1280,1150"
TAB, RIGHT, LEFT, ENTER = "\ue004", "\ue014", "\ue012", "\ue007"
END, HOME = "\ue010", "\ue011"
SEEN = "return document.querySelector('.seen svg')?.getAttribute('aria-label') ?? ''"
FOCUS = """
let active = document.activeElement;
while (active?.shadowRoot?.activeElement) active = active.shadowRoot.activeElement;
const host = document.activeElement;
return [active?.getAttribute("role") ?? active?.tagName, host?.innerText ?? "",
        active?.getRootNode().host?.shadowRoot.textContent ?? active?.textContent ?? ""].join(" ");
"""


class Page:
    """A visitor of the app."""

    def __init__(self, browser: Any) -> None:
        self.browser = browser

    def text(self) -> str:
        return str(self.browser.find_element("tag name", "body").text)

    def seen(self) -> str:
        """Return which experiment the picture shows."""
        return str(self.browser.execute_script(SEEN))

    def until(self, reached: Callable[[], Any]) -> None:
        end = time.monotonic() + PATIENCE
        while not reached():
            assert time.monotonic() < end, self.text()
            time.sleep(0.05)

    def press(self, *keys: str) -> None:
        for key in keys:
            selenium.ActionChains(self.browser).send_keys(key).perform()

    def focus_on(self, words: str) -> None:
        """Press Tab until what is named has the focus."""
        for _ in range(60):
            self.press(TAB)
            if words in self.browser.execute_script(FOCUS):
                return
        raise AssertionError(f"the keyboard does not reach {words!r}")


@pytest.fixture(scope="module")
def app(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    options = selenium.ChromeOptions()
    options.binary_location = CHROMIUM
    for flag in (*FLAGS, f"--user-data-dir={tmp_path_factory.mktemp('profile')}"):
        options.add_argument(flag)
    with (
        begun(*PROGRAM, "explore", "--headless") as process,
        selenium.Chrome(options=options, service=selenium.ChromeService(DRIVER)) as browser,
    ):
        url = re.compile(r"http://localhost:\d+\S*")
        browser.get(next(filter(None, map(url.findall, process.stdout)))[0])
        visitor = Page(browser)
        visitor.until(visitor.seen)
        yield visitor


def test_it_begins_with_a_run_and_its_law_and_the_keyboard_alone_changes_both(app: Page) -> None:
    assert "Law that holds" in app.text()
    before = app.seen()
    app.focus_on("slope: tan_alpha")
    app.press(RIGHT)
    app.until(lambda: "tan_alpha='0.255'" in app.seen())
    app.press(RIGHT)  # the slider has kept the focus
    app.until(lambda: "tan_alpha='0.26'" in app.seen())
    app.press(LEFT, LEFT)
    app.until(lambda: app.seen() == before)
    app.focus_on("above the threshold")
    app.press(ENTER)
    app.until(lambda: "amplitude='0.00182'" in app.seen())


def test_a_refused_value_names_itself_and_the_old_run_says_that_it_is_old(app: Page) -> None:
    before = app.seen()
    app.focus_on("dynamical friction: mu_d")
    app.press(END)  # beyond the static one
    app.until(lambda: "mu_s = " in app.text() and "Below is still the run before" in app.text())
    assert app.seen() == before
    app.press(HOME)
    app.until(lambda: "Below is still the run before" not in app.text())
