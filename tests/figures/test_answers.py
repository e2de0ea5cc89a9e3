"""Pictures of answers: sides of a threshold, fates, lives, fits."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from exactcreep import Chain, Cycles, State, creep, fate, laws, survival, threshold
from exactcreep.figures.fate import draw_fate, draw_survival
from exactcreep.figures.threshold import draw_threshold
from tests.pictures import assert_shows_data, line

TWO = Chain(2, 1000, "0.5", "0.6", tan_alpha="0.25")


def test_a_threshold_shows_the_displacements_below_and_above_it_and_the_laws() -> None:
    found = threshold(TWO, digits=6)
    above, beneath = assert_shows_data(draw_threshold(found)).axes
    edge = (float(found.lower) + float(found.upper)) / 2
    assert line(above, f"begins: {edge:.9g}")[0].tolist() == [edge] * 2
    low, high = above.get_xlim()
    for law, size in (
        ("Eq. 22", 0.25 / np.hypot(1, 0.25) / 1000),  # N m/2 of two sliders
        ("creeps for ever", laws.edges(TWO)["no_lasting_creep"]),
    ):
        assert line(above, law)[0] == pytest.approx([size] * 2, rel=1e-5)
        assert low < size < high < 2 * edge
    below, beyond = (line(beneath, f"A = {side}")[1] for side in (found.lower, found.upper))
    assert below[-1] == below[-2]
    assert beyond[-1] - beyond[-2] > 0.1
    run = creep(found.chain, Cycles(found.upper, beyond.size - 1))
    assert_allclose(beyond, [0, *run.recorded["x_G"][1::2]], atol=1e-9)
    assert found.finding in above.figure.get_suptitle()


def test_a_fate_is_drawn_from_its_start_to_where_it_settled() -> None:
    chain = Chain(3, 1000, "0.5", "0.6", tan_alpha="0.25")
    start = State.prepared(chain, ["0.1", "0.2"])
    settled = fate(chain, "0.00048", start=start, solver="exact")
    above, below = assert_shows_data(draw_fate(settled), framed=True).axes
    cycles = settled.settled_after + max(2 * settled.period, settled.settled_after // 5, 5)
    run = creep(chain, Cycles("0.00048", cycles), start=start, record=("x_G", "tension"))
    time, ends = np.arange(cycles + 1), slice(1, None, 2)
    assert_allclose(line(above, 0), [time, [0.0, *run.recorded["x_G"][ends]]])
    for spring, first in enumerate((0.1, 0.2)):
        tension = run.recorded["tension"][ends, spring]
        assert_allclose(line(below, spring), [time, [first, *tension]])
    assert line(above, 1)[0, 0] == line(below, 2)[0, 0] == settled.settled_after
    assert settled.finding in above.figure.get_suptitle()


def test_a_survival_steps_down_at_deaths_and_its_rate_falls_from_the_cut() -> None:
    lives = survival(Chain(6, 1000, "0.5", "0.6", tan_alpha="0.25"), "0.000969", starts=30,
                     cycles=2000)  # fmt: skip
    (axes,) = assert_shows_data(draw_survival(lives), framed=True).axes
    curve, rate = lives.curve, lives.rate
    steps, moving = line(axes, 0)
    assert_allclose([steps, moving], [[0, *curve.cycles], [1, *curve.moving]])
    times, heights = line(axes, 1)  # censored
    assert_allclose(times, lives.censored)
    assert_allclose(heights, [moving[steps <= time][-1] for time in times])
    times, constant = line(axes, "constant rate")
    assert (times[0], times[-1]) == (rate.cut, steps[-1])
    assert constant[0] == moving[steps <= rate.cut][-1]
    assert_allclose(np.diff(np.log(constant)) / np.diff(times), -rate.rate)
    (band,) = axes.collections
    edges = {*band.get_paths()[0].vertices[:, 1].tolist()}
    for bound in (curve.low, curve.high):
        assert {*bound[np.isfinite(bound)].tolist()} <= edges


def test_an_intercept_is_drawn_by_its_velocities_and_the_line_through_them() -> None:
    rough = Chain(6, 1000, "0.5", "0.6", "0.01", tan_alpha="0.25")
    found = threshold(rough, cycles=100, points=8)
    (axes,) = assert_shows_data(draw_threshold(found)).axes
    (points,) = axes.containers
    assert_allclose(points.lines[0].get_xydata().T, [found.amplitudes, found.velocities])
    bars = np.array(points.lines[2][0].get_segments())[:, :, 1]
    assert_allclose(np.diff(bars).ravel(), 2 * 1.96 * found.errors)
    places, fitted = line(axes, "zero at")
    assert_allclose(fitted, found.slope * (places - found.intercept))
    assert_allclose(places, [found.intercept, found.amplitudes.max()])
