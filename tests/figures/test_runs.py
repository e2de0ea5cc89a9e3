"""Pictures of runs show their numbers, however long and however many, and repeat the run."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import exactcreep as ec
from exactcreep.figures.run import draw_run, inside
from exactcreep.laws import prediction
from exactcreep.results import Progress
from tests.paper import paper_chain
from tests.pictures import assert_shows_data, line

CHAIN, SIX, VARIED = paper_chain(2), paper_chain(6), paper_chain(6, "0.02")
DRIVE = ec.Cycles("0.004", 20)


def drawn(run: ec.Creep):
    return assert_shows_data(draw_run(run), framed=True).axes


def test_the_lines_are_theta_and_x_G_of_every_target_and_the_sliders_of_a_short_chain() -> None:
    start = ec.State(np.array([0.1]), np.array([1.0, 3.0]), np.full(2, 0.6), np.ones(2, int), 0.0)
    run = ec.creep(CHAIN, ec.GaussianSteps("0.002", 300), seed=1, start=start, record=("x_G", "x"))
    theta = run.drive.targets(1, run.half_cycles, run.seed)
    top, _, bottom, *_ = drawn(run)
    x = run.recorded["x"]
    for axes, place, begin, values in (
        (top, 0, 0.0, theta), (bottom, 0, 2.0, run.recorded["x_G"]),
        (bottom, 1, 1.0, x[:, 0]), (bottom, 2, 3.0, x[:, 1]),
    ):  # fmt: skip
        assert_array_equal(line(axes, place), [np.arange(301), np.append(begin, values)])


def test_the_course_of_one_run_has_its_law_as_a_line_with_its_deviation() -> None:
    run = ec.creep(SIX, ec.Cycles("0.01", 8))
    law, (_, _, bottom, *_) = prediction(run.chain, run.drive), drawn(run)
    x, y = line(bottom, f"{law.law} (± {law.deviation:.2g} per half-cycle)")
    assert x.tolist() == [run.burn_in, run.half_cycles]
    assert y[0] == run.recorded["x_G"][run.burn_in - 1]
    assert np.diff(y) == pytest.approx(law.values * np.diff(x))
    (band,) = bottom.collections
    x, y = band.get_paths()[0].vertices.T
    wide = 2 * law.deviation * (run.half_cycles - run.burn_in)
    assert np.ptp(y[x == run.half_cycles]) == pytest.approx(wide)
    _, sliding = drawn(ec.creep(paper_chain(10), ec.Cycles("0.01", 8), solver="sliding"))
    assert not any("law" in str(each.get_label()) for each in sliding.lines)


@pytest.mark.parametrize("drive", [DRIVE, ec.Targets([[0.01, 0], [0.01, 0.01], [0, 0]])])
@pytest.mark.parametrize("window", [(0, 4), (7, 3), (40, 2)])
def test_inside_half_cycles_x_G_and_the_sliders_step_at_each_rearrangement(
    drive: ec.Drive, window: tuple[int, int]
) -> None:
    chain, heard = paper_chain(3), list[Progress]()
    around, wide = (min(each, drive.target_count) for each in window)
    full = ec.creep(chain, drive, seed=2, record=("x_G", "x", "rearrangements", "slip_table"))
    seen = inside(ec.creep(chain, drive, seed=2), around, wide, progress=heard.append)
    begin, until = seen.first - 1, seen.last
    assert begin <= around <= until == begin + wide == heard[-1].done == heard[-1].total
    figure = assert_shows_data(draw_run(full, seen=seen), framed=True)
    _, ramps, _, within, slips, durations = figure.axes
    rows = full.to_pandas("rearrangements").query("@begin < half_cycle <= @until")
    recorded = np.column_stack([full.recorded["x_G"], full.recorded["x"]])
    for n, values in enumerate(recorded.T):
        time, moved = line(within, n)
        ends = np.searchsorted(time, np.arange(begin, until + 1), side="right") - 1
        assert_allclose(moved[ends], np.append(0, values)[begin : until + 1], atol=1e-9)
        there = line(full.plot(), n)[1][rows.index[0] + 1 :]
        assert_allclose(there[: moved.size - 2], moved[1:-1], atol=1e-9)
    assert_array_equal(np.ceil(time[1:-1]), rows.half_cycle)
    if drive.cyclic:  # theta of each is that of the ramp there
        assert_allclose(np.interp(time[1:-1], *line(ramps, 0)), rows.theta)
    (stems,) = durations.collections
    heights = [segment[1] for segment in stems.get_segments()]
    assert_allclose(heights, np.column_stack([time[1:-1], rows.duration]))
    table = full.to_pandas("slip_table").query("rearrangement in @rows.index")
    for words, own in (("down", table.displacement > 0), ("up", table.displacement < 0)):
        when = time[1 + table.rearrangement[own] - rows.index[0]]
        assert_array_equal(line(slips, words), [when, table.slider[own]])


def test_a_run_of_another_program_is_not_drawn_from_inside() -> None:
    run = ec.creep(SIX, DRIVE, seed=3, record=("x_G",))
    changed = run.recorded["x_G"].copy()
    changed[11] = np.nextafter(changed[11], 1e9)
    other = dataclasses.replace(run, recorded={"x_G": changed})
    with pytest.raises(ec.InputError, match="at half-cycle 12 when the run was saved"):
        inside(other, 20)


@pytest.mark.parametrize("years", [1, 6])
def test_a_descent_is_drawn_in_time_or_year_by_year_beside_those_of_other_frictions(
    years: int,
) -> None:
    roof = ec.physical(length=3, section="0.003", material="lead", contacts=5, mu_d="0.45",
                       mu_s="0.55", tan_alpha="0.3", measured=2.5)  # fmt: skip
    drive = ec.GaussianSteps(roof.dilation(10), 365 * years + 3)
    descent = roof.creep(drive, time_unit=86400, solver="sliding")
    top, bottom, side = assert_shows_data(descent.plot()).axes
    assert_allclose(top.lines[0].get_ydata(), descent.temperatures)
    yearly = np.diff(np.interp(365.25 * np.arange(years + 1), descent.elapsed, descent.millimetres))
    several, shown = years > 4, bottom.lines[0].get_ydata()
    assert_allclose(shown, yearly if several else descent.millimetres)
    assert bottom.get_ylim()[0] <= 0 < shown.max() < bottom.get_ylim()[1] < 3 * shown.max()
    span = 1 if several else descent.days / 365.25
    assert bottom.lines[1].get_ydata() == pytest.approx([2.5 * span] * 2)
    for place, contacts in enumerate(descent.contacts):
        rates = [descent.rates[contacts, factor] * span for factor in roof.friction]
        assert_allclose(line(side, 2 * place + 1), [[place] * 3, rates])
        assert_allclose(line(side, 2 * place + 2).ravel(), [place, rates[1]])


def test_a_rearrangement_is_drawn_by_its_velocities_and_by_energies_that_balance() -> None:
    motion = ec.rearrange(SIX, ec.State.prepared(SIX, [2, 0, 0, 1, 0]), direction=0)
    above, below = motion.plot()
    assert_shows_data(above.figure, framed=True)
    mesh = above.collections[0]
    times, kinetic = line(below, "kinetic")
    shown = np.asarray(mesh.get_array()).reshape(6, times.size)
    assert_array_equal(shown, motion.sol(times).velocities)
    assert mesh.norm.vmax == -mesh.norm.vmin == np.abs(shown).max()
    assert (times[0], times[-1]) == (0, motion.duration)
    assert above.get_xlim() == below.get_xlim()
    assert_allclose(kinetic, (shown**2).sum(axis=0) / 2, atol=1e-12)
    assert_allclose(sum(line(below, k)[1] for k in range(4)), 0, atol=1e-10)
