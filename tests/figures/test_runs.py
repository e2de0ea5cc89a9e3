"""Pictures of runs show their numbers, however long and however many, and repeat the run."""

from __future__ import annotations

import dataclasses

import matplotlib.pyplot as plt
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from exactcreep import (
    Chain,
    Creep,
    Cycles,
    GaussianSteps,
    InputError,
    TemperatureRecord,
    creep,
    physical,
)
from exactcreep.figures.run import draw_portrait, draw_run, portrait, tension_bounds
from exactcreep.figures.sweep import LIMIT, STICKING
from exactcreep.laws import prediction
from tests.paper import paper_chain
from tests.pictures import assert_shows_data

CHAIN, SIX, VARIED = paper_chain(2), paper_chain(6), paper_chain(6, "0.02")
DRIVE = Cycles("0.004", 20)


def drawn(runs: list[Creep], **about: object):
    return assert_shows_data(draw_run(runs, **about)).axes


def test_the_lines_are_theta_and_x_G_of_every_target_from_the_start() -> None:
    run = creep(CHAIN, GaussianSteps("0.002", 300), seed=1)
    theta = run.drive.targets(1, run.half_cycles, run.seed)
    for axes, values in zip(drawn([run]), (theta, run.recorded["x_G"]), strict=True):
        assert_array_equal(axes.lines[0].get_xdata(), np.arange(301))
        assert_array_equal(axes.lines[0].get_ydata(), np.append(0.0, values))


def test_members_are_drawn_beside_the_law_of_their_group_and_named_by_what_varies() -> None:
    cases = [(a, s) for a in (1, 2) for s in (1, 2)]
    runs = [creep(VARIED, Cycles(f"0.00{a}", 9), seed=s) for a, s in cases]
    settings = [{"chain.n": 6, "drive.amplitude": a, "run.seed": s} for a, s in cases]
    _, axes = drawn(runs, settings=settings)
    named = [text.get_text() for text in axes.get_legend().get_texts()]
    assert named == [rf"$A_\theta$ = {a} (2 members)" for a in (1, 2)]
    assert sorted(text.get_text() for text in axes.texts) == ["seed = 1"] * 2 + ["seed = 2"] * 2
    low, high = axes.get_ylim()
    ends = sorted((float(run.recorded["x_G"][-1]) - low) / (high - low) for run in runs)
    assert min(text.xy[1] for text in axes.texts) == pytest.approx(ends[0])
    courses = [line.get_ydata()[1:] for line in axes.lines if line.get_linestyle() == "-"]
    assert_array_equal(courses, [run.recorded["x_G"] for run in runs])
    broken = [line for line in axes.lines if line.get_linestyle() == "--" and len(line.get_xdata())]
    for line, run in zip(broken, runs[::2], strict=True):
        (begin, end), height = line.get_xdata(), line.get_ydata()
        assert (begin, end) == (run.burn_in, run.half_cycles)
        assert height[0] == run.recorded["x_G"][begin - 1]
        rise = prediction(run.chain, run.drive).values[0] * (end - begin)
        assert np.ptp(height) == pytest.approx(rise, rel=1e-12)


def test_many_members_are_drawn_as_velocities_over_what_varies_beside_the_laws() -> None:
    amplitudes = [f"0.0{k:02}" for k in range(1, 13)]
    runs = [creep(SIX, Cycles(a, 12), seed=s) for a in amplitudes for s in (1, 2)]
    settings = [{"drive.amplitude": str(float(run.drive.amplitude)), "run.seed": run.seed}
                for run in runs]  # fmt: skip
    (axes,) = drawn(runs, settings=settings)
    (points,) = axes.containers
    x, y = points.lines[0].get_data(orig=False)
    assert_allclose(x, [float(a) for a in amplitudes])
    assert_allclose(y, [(one.velocity + two.velocity) / 2 for one, two in zip(
        runs[::2], runs[1::2], strict=True)])  # fmt: skip
    said = [text.get_text() for text in axes.get_legend().get_texts()]
    assert LIMIT in said
    assert STICKING in said
    seeds = drawn(runs[:1] * 12, settings=[{"run.seed": k} for k in range(12)])
    assert len(seeds) == 2  # lines over time: a seed is no quantity


def test_the_course_of_one_run_has_its_law_as_a_line_with_its_deviation() -> None:
    run = creep(paper_chain(10), Cycles("0.01", 8))
    _, bottom = drawn([run])
    law = prediction(run.chain, run.drive)
    (line,) = (each for each in bottom.lines if law.law in str(each.get_label()))
    begin, end = line.get_xdata()
    assert (begin, end) == (run.burn_in, run.half_cycles)
    assert np.ptp(line.get_ydata()) == pytest.approx(law.values[0] * (end - begin))
    assert f"± {law.deviation:.2g} per half-cycle" in line.get_label()
    (band,) = bottom.collections
    x, y = band.get_paths()[0].vertices.T
    assert np.ptp(y[x == end]) == pytest.approx(2 * law.deviation * (end - begin))
    sliding = drawn([creep(paper_chain(10), Cycles("0.01", 8), solver="sliding")])[1]
    assert not any("law" in str(each.get_label()) for each in sliding.lines)


def test_a_runaway_before_the_first_rest_is_told_in_words_not_by_a_blank_frame() -> None:
    steep = [creep(paper_chain(6, tan_alpha=t), DRIVE) for t in ("0.7", "0.8")]
    for runs in (steep[:1], steep):
        settings = [{"chain.tan_alpha": float(run.chain.tan_alpha)} for run in runs]
        _, bottom = draw_run(runs, settings).axes
        (words,) = (text.get_text() for text in bottom.texts)
        assert words == "runaway downhill (computed)\nbefore the end of a first half-cycle"


def test_a_short_chain_shows_its_sliders_and_many_cycles_a_band() -> None:
    run = creep(CHAIN, Cycles("0.002", 201), record=("x_G", "x"))
    top, bottom = drawn([run])
    (band,) = top.collections
    assert not top.lines
    assert np.abs(band.get_paths()[0].vertices[:, 1]).max() == 0.002
    mean, *sliders, _law = (line.get_ydata()[1:] for line in bottom.lines)
    assert_array_equal(mean, run.recorded["x_G"])
    assert_array_equal(np.array(sliders).T, run.recorded["x"])


@pytest.fixture(autouse=True)
def _closed():
    yield
    plt.close("all")


def test_a_record_is_drawn_in_dates_degrees_and_millimetres() -> None:
    roof = physical(length=3, youngs_modulus="16e9", density=11340, section="0.003", kappa="29e-6",
                    contacts=5, mu_d="0.45", mu_s="0.55", tan_alpha="0.3")  # fmt: skip
    days = np.arange("2020-07-01", "2020-07-31", dtype="datetime64[D]")
    degrees = [10.0 + 25 * (k % 2) for k in range(days.size)]
    record = TemperatureRecord.of(degrees, "29e-6", 10, times=days, unit="C")
    run = creep(roof.chain, record)
    axes = run.plot(solid=roof)
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("date", "descent (mm)")
    assert_shows_data(axes.figure)
    (line,) = axes.lines
    assert_array_equal(line.get_ydata(), 1000 * roof.metres(run.recorded["x_G"]))
    (beside,) = (each for each in axes.figure.axes if each is not axes)
    assert beside.get_ylabel() == "temperature (\N{DEGREE SIGN}C)"
    assert_allclose(beside.lines[0].get_ydata(), degrees[: run.half_cycles])


@pytest.fixture(scope="module")
def run():
    return creep(SIX, DRIVE, seed=3, record=("x_G",))


@pytest.mark.parametrize("half_cycle", [0, 7, 40])
def test_a_portrait_shows_what_a_full_record_holds(run: Creep, half_cycle: int) -> None:
    full = creep(SIX, DRIVE, seed=3, record=("x_G", "x", "tension", "slips")).recorded
    seen = portrait(run, half_cycle, window=10)
    there = slice(seen.first - 1, seen.first - 1 + 10)
    assert seen.first - 1 <= half_cycle <= seen.first + 9
    assert_array_equal(seen.slips, full["slips"][there])
    assert_array_equal(seen.x_G[1:], full["x_G"][there])
    assert seen.x_G[0] == np.vstack([np.zeros(6), full["x"]])[seen.first - 1].mean()
    assert (np.abs(seen.forces) <= seen.limits).all()
    (low, high), (least, most) = tension_bounds(SIX, "mu_s"), tension_bounds(SIX, "mu_d")
    assert (low <= seen.state.tensions).all()
    assert (seen.state.tensions <= high).all()
    assert ((low < least) & (most < high)).all()
    if half_cycle:
        assert_array_equal(seen.state.tensions, full["tension"][half_cycle - 1])
        assert_array_equal(seen.theta[1:], DRIVE.targets(seen.first, 10))


def test_a_portrait_of_a_chain_that_differs_keeps_within_the_friction_of_each_slider() -> None:
    friction = ["0.5", "0.2", "0.6", "0.4"]
    chain = Chain(4, 10, friction, "0.7", tan_alpha="0.1", end_forces=("0.3", 0))
    seen = portrait(creep(chain, Cycles("0.3", 9), solver="sliding"))
    low, high = tension_bounds(chain, "mu_d")
    tension = seen.state.tensions
    assert seen.limits == pytest.approx([float(mu) * chain.cos_alpha for mu in friction])
    assert tension == pytest.approx(high)  # the last ramp of cycles is a contraction
    assert (low < high).all()
    assert seen.forces.sum() == pytest.approx(4 * chain.sin_alpha + 0.3)
    axes = draw_portrait(seen).axes
    drawn = [line.get_ydata() for each in axes for line in each.lines]
    for expected in (tension, seen.forces, low, high):
        assert any(np.array_equal(y, expected) for y in drawn)


def test_what_the_run_does_not_have_or_repeat_is_refused(run: Creep) -> None:
    changed = run.recorded["x_G"].copy()
    changed[11] = np.nextafter(changed[11], 1e9)
    other = dataclasses.replace(run, recorded={"x_G": changed})
    with pytest.raises(InputError, match="at half-cycle 12 when the run was saved"):
        portrait(other, 20)
    with pytest.raises(InputError, match=r"half_cycle = 41.*at most 40"):
        portrait(run, 41)
