"""Pictures of answers: both sides of a threshold, fates, proved methods."""

from __future__ import annotations

import pytest
from numpy.testing import assert_allclose

from exactcreep import (
    Chain,
    Cycles,
    State,
    creep,
    fate,
    intercept,
    threshold,
)
from exactcreep.figures.fate import draw_fate
from exactcreep.figures.threshold import draw_threshold
from tests.pictures import assert_shows_data


def test_a_threshold_shows_the_displacements_below_and_above_it() -> None:
    found = threshold(Chain(2, 1000, "0.5", "0.6", tan_alpha="0.25"), digits=6)
    above, beneath = assert_shows_data(draw_threshold(found)).axes
    low, high = above.get_xlim()
    assert low < float(found.lower) < high
    below, beyond = (line.get_ydata() for line in beneath.lines)
    assert below[-1] == below[-2]
    assert beyond[-1] - beyond[-2] > 0.1
    run = creep(found.chain, Cycles(found.upper, beyond.size - 1))
    assert_allclose(beyond[1:], run.recorded["x_G"][1::2], atol=1e-9)
    (legend,) = above.figure.legends
    said = [text.get_text() for text in legend.get_texts()]
    assert above.figure.get_suptitle() == f"N = 2, sigma_mu = 0: {found.finding}"
    assert {f"below: A = {found.lower}", f"above: A = {found.upper}"} <= {*said}


def test_a_fate_is_drawn_from_its_start_to_where_it_settled() -> None:
    chain = Chain(3, 1000, "0.5", "0.6", tan_alpha="0.25")
    start = State.prepared(chain, ["0.1", "0.2"])
    settled = fate(chain, "0.00048", start=start, solver="exact")
    above, below = assert_shows_data(draw_fate(settled)).axes
    course, edge = above.lines
    run = creep(chain, Cycles("0.00048", len(course.get_ydata()) - 1), start=start)
    assert_allclose(course.get_ydata(), [0.0, *run.recorded["x_G"][1::2]])
    assert edge.get_xdata()[0] == settled.settled_after
    assert [line.get_ydata()[0] for line in below.lines[:2]] == [0.1, 0.2]


@pytest.mark.parametrize(
    ("amplitude", "cycles", "words"),
    [
        ("0.00048", 1, "limit, not settled in 1 cycle (undecided)"),
        ("0.00048", 10_000, "creeping downhill, settled after 20 cycles (proved)"),
        ("1e-5", 10_000, "at rest, settled after 0 cycles (proved)"),
    ],
)
def test_a_fate_is_entitled_how_it_ended(amplitude: str, cycles: int, words: str) -> None:
    known = fate(Chain(3, 1000, "0.5", "0.6", tan_alpha="0.25"), amplitude, cycles=cycles)
    assert words in draw_fate(known).axes[0].figure.get_suptitle()


def test_an_intercept_without_a_velocity_shows_the_amplitudes_of_the_laws() -> None:
    found = intercept(Chain(6, 1000, "0.5", "0.6", tan_alpha="0.25"), max_seconds="1e-9")
    (axes,) = draw_threshold(found).axes
    low, high = axes.get_xlim()
    assert 0 < low < found.law_seuil < high < 2 * found.law_seuil
