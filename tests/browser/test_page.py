"""The page to play with, in a real browser: what a visitor does, and what is then to be seen."""

from __future__ import annotations

import io
import json
import re
import shutil
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import matplotlib.image as mpimg
import numpy as np
import pytest

from exactcreep.figures.animation import find_avalanche
from exactcreep.figures.explorer import experiment_of
from tests.conftest import Command

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser"))), None)
DRIVER = shutil.which("chromedriver")
FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
    "--window-size=1280,1150",
)  # fmt: skip
PATIENCE = 120
OUTSIDE = """
return [...document.querySelectorAll("path")].filter(
  path => path.getAttribute("d").match(/[-.\\d]+/g)?.some(at => at < -0.01 || at > 100.01)).length;
"""

selenium = pytest.importorskip("selenium.webdriver", reason="selenium is not installed")
pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(not CHROMIUM or not DRIVER, reason="no chromium with its driver here"),
    pytest.mark.xdist_group("browser"),
]


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    options = selenium.ChromeOptions()
    options.binary_location = CHROMIUM
    for flag in (*FLAGS, f"--user-data-dir={tmp_path_factory.mktemp('profile')}"):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    with selenium.Chrome(options=options, service=selenium.ChromeService(DRIVER)) as driver:
        driver.set_script_timeout(PATIENCE)
        yield driver


class Page:
    """A visitor of the page."""

    def __init__(self, browser: Any, url: str) -> None:
        self.browser = browser
        browser.get(url)

    def until(self, reached: Callable[[], Any]) -> None:
        end = time.monotonic() + PATIENCE
        while not reached():
            assert time.monotonic() < end, self.text("refused") + self.text("told")
            time.sleep(0.05)

    def find(self, name: str) -> Any:
        return self.browser.find_element("id", name)

    def text(self, name: str) -> str:
        return str(self.find(name).text)

    def script(self, text: str, *arguments: Any) -> Any:
        return self.browser.execute_script(text, *arguments)

    def settled(self) -> None:
        """Wait until the page shows what its fields say, or refuses it."""
        asked = "return !busy && document.body.dataset.shown === asked().toString();"
        self.until(lambda: self.script(asked))

    def set(self, **fields: Any) -> None:
        """Type into fields, all at once."""
        typed = "const f = document.getElementById(arguments[0]); f.value = arguments[1];"
        for name, text in fields.items():
            self.script(typed + "f.dispatchEvent(new Event('input'))", name, text)
        self.settled()

    def choose(self, share: float) -> None:
        """Click a rearrangement, at this part of the width of the picture of slips."""
        canvas = self.find("slips")
        chain = selenium.ActionChains(self.browser)
        sideways = round((share - 0.5) * canvas.size["width"] * 0.85)
        chain.move_to_element_with_offset(canvas, sideways, 0).click().perform()
        self.until(lambda: self.script("return motion !== null") or self.text("refused"))

    def quiet(self) -> None:
        """Assert that the browser has complained of nothing but what the page was refused."""
        log = self.browser.get_log("browser")
        said = [entry["message"] for entry in log if entry["level"] == "SEVERE"]
        assert not [line for line in said if "400 (Bad Request)" not in line]

    def seen(self, name: str) -> Any:
        """Return what is drawn inside the frame of a picture, as it is seen."""
        pixels = mpimg.imread(io.BytesIO(self.find(name).screenshot_as_png))
        return pixels[5:-5, 5:-5]

    def colours(self, name: str) -> int:
        """Return how many colours are seen in a picture; one: that of the paper."""
        return len(np.unique(self.seen(name).reshape(-1, 4), axis=0))


@pytest.fixture
def page(browser: Any, server: tuple[str, int]) -> Iterator[Page]:
    visitor = Page(browser, "http://{}:{}/".format(*server))
    visitor.settled()
    yield visitor
    visitor.quiet()


@pytest.mark.parametrize(("n", "amplitude"), [(2, "0.0004"), (100, "0.012")])
def test_the_page_shows_a_run_and_moves_its_rearrangements(
    page: Page, n: int, amplitude: str
) -> None:
    page.set(n=n, amplitude=amplitude)
    assert "targets" in page.text("told")
    for name in ("course", "slips"):
        assert page.colours(name) > 5, name
    page.choose(0.7)
    start = page.seen("chain")
    page.script("now = 0.5 * end(); drawMotion();")
    assert (page.seen("chain") != start).any()
    assert not page.script(OUTSIDE)
    assert page.text("clock").startswith("t = ")


def test_the_cubics_of_the_page_are_the_closed_form(page: Page) -> None:
    """Between its instants, too; and the forces follow from the displacements."""
    page.choose(0.5)
    number = page.script("return motion.number")
    motion = find_avalanche(experiment_of({}), number).rearrangement
    for share in (0.123, 0.456, 0.789, 0.999):
        t = share * float(motion.duration)
        shown = page.script(
            "const s = at(arguments[0]); return [Array.from(s.place), Array.from(s.drawn)]", t
        )
        true = motion.sol(t)
        moved = true.positions - motion.initial.displacements
        assert max(abs(moved - shown[0])) < 1e-4 * abs(moved).max()
        assert max(abs(true.forces - shown[1])) < 4e-4 * abs(moved).max()


def test_an_avalanche_plays_pauses_and_begins_again(page: Page) -> None:
    page.choose(0.8)
    page.script("document.getElementById('speed').value = '4'")
    page.find("play").click()
    page.until(lambda: page.script("return now > 0"))
    page.find("play").click()
    paused = page.script("return now")
    page.script("drawMotion()")
    assert (page.text("play"), page.script("return now")) == ("Play", paused)
    page.script("const t = document.getElementById('time'); t.value = t.max; t.oninput();")
    assert page.script("return Math.abs(now - end()) < 1e-3")
    page.find("play").click()  # from the end it begins again
    page.until(lambda: page.script("return playing && now < end() / 2 || now > 0 && !playing"))


@pytest.mark.parametrize(("name", "text"), [("amplitude", "<b>1</b>"), ("mu_s", "0.1")])
def test_bad_input_is_answered_by_a_sentence_and_forgotten_when_it_is_mended(
    page: Page, name: str, text: str
) -> None:
    before, good = page.text("told"), page.find(name).get_attribute("value")
    page.set(**{name: text})
    assert page.text("refused").startswith(f"{name} = ")
    assert "bad" in page.find(name).get_attribute("class")
    assert page.script("return document.body.classList.contains('stale')")
    assert page.text("told") == before
    page.set(**{name: good})
    assert page.text("refused") == ""
    assert "bad" not in page.find(name).get_attribute("class")


def test_a_saved_page_needs_no_server(browser: Any, command: Command, tmp_path: Path) -> None:
    words = ("six-sliders-cycles", "--set", "drive.cycles=20", "--rearrangement", "40")
    assert command("animate", *words, "--out", "avalanche.html").code == 0
    text = (tmp_path / "avalanche.html").read_text("utf-8")
    assert not re.findall(r"""(?:src|href)=["']?(?!data:)[a-z/.]""", text)
    page = Page(browser, (tmp_path / "avalanche.html").as_uri())
    assert page.text("which").startswith("Rearrangement 40, in half-cycle ")
    assert not page.find("controls").is_displayed()
    page.script("now = 0.5 * end(); drawMotion();")
    for name in ("course", "slips", "chain", "forces", "moved"):
        assert page.colours(name) > 5, name
    requested = page.script("return JSON.stringify(performance.getEntriesByType('resource'))")
    assert json.loads(requested) == []
    page.quiet()
