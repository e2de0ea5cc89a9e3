"""The page of one avalanche in a real browser: what a visitor does, and what is then to be seen."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from exactcreep import Chain, Cycles, Experiment
from exactcreep.figures.animation import RunAvalanche, find_avalanche
from exactcreep.figures.avalanche_page import page as page_of
from exactcreep.figures.avalanche_page import run_to_draw
from tests.browser.chromium import MARKS, Page, new_browser
from tests.conftest import Command

pytestmark = MARKS
OUTSIDE = """
return [...document.querySelectorAll("figure:not(#chain) path")].filter(path =>
  path.getAttribute("d").match(/[-.\\d]+/g)?.some(at => at < -0.01 || at > 100.01)).length;
"""
CHAIN_ANGLE = """
const numbers = document.querySelector("#chain path").getAttribute("d").match(/[-.\\d]+/g);
const [a, b, c, d] = numbers.map(Number); return (d - b) / (c - a);
"""


def avalanche_of(n: int, amplitude: str) -> RunAvalanche:
    chain = Chain(n, 1000, "0.5", "0.6", "0.01", tan_alpha="0.25")
    return find_avalanche(Experiment(chain, Cycles(amplitude, 10)), 12)


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    with new_browser(tmp_path_factory.mktemp("profile")) as driver:
        yield driver


@pytest.fixture
def visit(browser: Any, tmp_path: Path) -> Iterator[Any]:
    """Return a function that opens the page of an avalanche."""
    visitors: list[Page] = []

    def opened(avalanche: RunAvalanche, **about: Any) -> Page:
        written = tmp_path / "page.html"
        written.write_text(page_of(run_to_draw(avalanche.experiment), avalanche, **about), "utf-8")
        visitors.append(Page(browser, written.as_uri()))
        return visitors[-1]

    yield opened
    for visitor in visitors:
        visitor.quiet()


@pytest.mark.parametrize(("n", "amplitude"), [(2, "0.0004"), (100, "0.012")])
def test_the_page_shows_a_run_and_moves_its_avalanche(visit: Any, n: int, amplitude: str) -> None:
    page = visit(avalanche_of(n, amplitude))
    assert "targets" in page.text("sentence")
    for name in ("course", "slips", "moved", "forces", "tensions", "chain"):
        assert page.colours(name) > 5, name
    start = page.seen("chain")
    page.script("now = 0.5 * end(); drawMotion();")
    assert (page.seen("chain") != start).any()
    assert not page.script(OUTSIDE)
    assert page.text("clock").startswith("t = ")
    assert page.script(CHAIN_ANGLE) == pytest.approx(0.25, abs=0.01)


def test_the_cubics_of_the_page_are_the_closed_form(visit: Any) -> None:
    """Between its instants, too; forces and tensions follow from the displacements."""
    avalanche = avalanche_of(10, "0.002")
    page, motion = visit(avalanche), avalanche.rearrangement
    for share in (0.123, 0.456, 0.789, 0.999):
        t = share * float(motion.duration)
        words = "const s = at(arguments[0]);"
        words += "return [s.place, s.drawn, s.tight].map(values => Array.from(values))"
        place, forces, tensions = page.script(words, t)
        true = motion.sol(t)
        moved = true.positions - motion.initial.displacements
        assert max(abs(moved - place)) < 1e-4 * abs(moved).max()
        assert max(abs(true.forces - forces)) < 4e-4 * abs(moved).max()
        stretched = motion.initial.tensions + moved[1:] - moved[:-1]
        assert max(abs(stretched - tensions)) < 4e-4 * abs(moved).max()


def test_an_avalanche_plays_pauses_and_begins_again(visit: Any) -> None:
    page = visit(avalanche_of(10, "0.002"))
    assert page.script("return [playing, now]") == [False, 0]
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


def test_the_page_of_the_command_needs_no_server(
    browser: Any, command: Command, tmp_path: Path
) -> None:
    words = ("six-sliders-cycles", "--set", "drive.cycles=20", "--rearrangement", "40")
    assert command("animate", *words, "--out", "avalanche.html").code == 0
    text = (tmp_path / "avalanche.html").read_text("utf-8")
    assert not re.findall(r"""(?:src|href)=["']?(?!data:)[a-z/.]""", text)
    page = Page(browser, (tmp_path / "avalanche.html").as_uri())
    assert page.text("which").startswith("Rearrangement 40, in half-cycle ")
    requested = page.script("return JSON.stringify(performance.getEntriesByType('resource'))")
    assert json.loads(requested) == []
    assert not math.isnan(page.script("return end()"))
    page.quiet()
