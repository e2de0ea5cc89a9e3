"""The explorer in a real browser: it draws at once, and hears the keyboard."""

from __future__ import annotations

import re
from collections.abc import Iterator

import pytest

from tests.browser.chromium import MARKS, Page, new_browser
from tests.processes import PROGRAM, begun

pytest.importorskip("marimo", reason="marimo is not installed")
pytestmark = MARKS
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


@pytest.fixture(scope="module")
def app(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    with (
        begun(*PROGRAM, "explore", "--headless") as process,
        new_browser(tmp_path_factory.mktemp("profile")) as browser,
    ):
        url = re.compile(r"http://localhost:\d+\S*")
        (address,) = next(filter(None, map(url.findall, process.stdout)))
        visitor = Page(browser, address)
        visitor.until(lambda: visitor.script(SEEN))
        yield visitor


def focus_on(app: Page, words: str) -> None:
    """Press Tab until what is named has the focus."""
    for _ in range(60):
        app.press(TAB)
        if words in app.script(FOCUS):
            return
    raise AssertionError(f"the keyboard does not reach {words!r}: {app.script(FOCUS)}")


def test_it_begins_with_a_run_and_its_law(app: Page) -> None:
    assert "Law that holds" in app.browser.find_element("tag name", "body").text
    assert app.colours(app.browser.find_element("css selector", ".seen svg")) > 20


def test_the_keyboard_alone_changes_a_parameter_and_the_run(app: Page) -> None:
    before = app.script(SEEN)
    focus_on(app, "slope: tan_alpha")
    app.press(RIGHT)
    app.until(lambda: "tan_alpha='0.255'" in app.script(SEEN))
    app.press(RIGHT)  # the slider has kept the focus
    app.until(lambda: "tan_alpha='0.26'" in app.script(SEEN))
    app.press(LEFT, LEFT)
    app.until(lambda: app.script(SEEN) == before)
    focus_on(app, "above the threshold")
    app.press(ENTER)
    app.until(lambda: "amplitude='0.00182'" in app.script(SEEN))


def test_a_refused_value_names_itself_and_the_old_run_says_that_it_is_old(app: Page) -> None:
    before = app.script(SEEN)
    focus_on(app, "dynamical friction: mu_d")
    app.press(END)  # beyond the static one

    def told() -> str:
        return str(app.browser.find_element("tag name", "body").text)

    app.until(lambda: "mu_s = " in told() and "Below is still the run before" in told())
    assert app.script(SEEN) == before
    app.press(HOME)
    app.until(lambda: "Below is still the run before" not in told())
