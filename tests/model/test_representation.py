"""One line and one small table for every value that a reader prints."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from fractions import Fraction

import numpy as np
import pytest

import exactcreep
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles, GaussianSteps, Path
from exactcreep.model.representation import Shown, drawn, text
from exactcreep.model.state import State

CHAIN = Chain(6, 1000, "0.5", 0.6, "1/100", tan_alpha="1/3")
THIRD = Fraction(1, 3)


@pytest.mark.parametrize(
    "made",
    [CHAIN, Chain(1, "1e-30", 0, 7, tan_alpha=-0.1), Cycles("0.02", 7), GaussianSteps(0.1, 3),
     Path([0.1, "0.1", THIRD])],
    ids=repr,
)  # fmt: skip
def test_the_line_of_a_chain_or_a_drive_makes_it_again_exactly(made: Shown) -> None:
    assert eval(repr(made), vars(exactcreep) | {type(made).__name__: type(made)}) == made


def test_a_rational_is_shown_as_the_float_that_it_is_or_in_quotes() -> None:
    assert repr(CHAIN) == (
        "Chain(n=6, l0=1000, mu_d=0.5, mu_s=0.6, sigma_mu='0.01', tan_alpha='1/3')"
    )
    assert text(Fraction(0.1)) == "0.1"
    assert text(Fraction(1, 10)) == "'0.1'"
    assert len(text(Fraction(1, 3) ** 1000)) < 60


def test_long_lists_are_shown_by_their_ends() -> None:
    many = Path([Fraction(k, 3) for k in range(100_000)])
    assert len(repr(many)) < 200
    assert "100000 values" in repr(many)
    assert "33333" in repr(many)
    state = State.relaxed(Chain(1000, 10, 1, 2, tan_alpha=0))
    assert len(repr(state)) < 400


def test_what_a_notebook_shows_is_well_formed_and_escaped() -> None:
    class Sign(Shown):
        def _facts(self) -> dict[str, object]:
            return {"<a>": "b & c's", "nothing": None, "empty": ""}

    page = ET.fromstring(Sign()._repr_html_())
    assert [cell.text for row in page.iter("tr") for cell in row] == ["<a>", "b & c's"]
    for made in (CHAIN, Cycles(1, 3), State.relaxed(CHAIN)):
        page = ET.fromstring(made._repr_html_())
        assert page.find("{http://www.w3.org/2000/svg}svg") is not None


def test_a_small_picture_stays_inside_its_frame() -> None:
    wild = [np.nan, 1e308, -1e308, np.inf, 0.0, *np.arange(2000.0)]
    for dots in (False, True):
        picture = ET.fromstring(drawn(wild, dots=dots))
        inside = next(iter(picture))
        marks = inside.get("points", "").split() or [
            f"{mark.get('cx')},{mark.get('cy')}" for mark in picture
        ]
        assert 2 <= len(marks) <= 320
        for mark in marks:
            across, down = map(float, mark.split(","))
            assert 0 <= across <= 160
            assert 0 <= down <= 48
    assert drawn([1.0]) == ""
