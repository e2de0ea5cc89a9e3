"""Pictures of runs and of rearrangements show their numbers, however long and however many."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.figure import Figure

from exactcreep import (
    Chain,
    Cycles,
    GaussianSteps,
    InputError,
    State,
    TemperatureRecord,
    creep,
    physical,
    rearrange,
)
from exactcreep.figures.runs import draw_run
from tests.pictures import assert_shows_data

CHAIN = Chain(2, 1000, "0.5", "0.6", "0.01", tan_alpha="0.25")


def test_a_line_of_fewer_points_keeps_what_is_largest_and_smallest(drawn: list[Figure]) -> None:
    run = creep(CHAIN, GaussianSteps("0.002", 30_000), seed=1)
    draw_run([run], "unused.png")
    top, bottom = drawn[0].axes
    theta = run.drive.targets(1, run.half_cycles, run.seed)
    for line, values in ((top.lines[0], theta), (bottom.lines[0], run.recorded["x_G"])):
        time, shown = line.get_data()
        assert time.size < 20_002
        assert (shown.min(), shown.max()) == (min(values.min(), 0), max(values.max(), 0))
        assert (time[-1], shown[-1]) == (30_000, values[-1])
        np.testing.assert_array_equal(shown[1:], values[time[1:] - 1])


def test_drives_beyond_the_inks_are_counted_and_left_out(drawn: list[Figure]) -> None:
    runs = [creep(CHAIN, GaussianSteps("0.005", 5), seed=seed) for seed in range(10)]
    draw_run(runs, "unused.png")
    top, bottom = drawn[0].axes
    assert top.get_title() == "the first 8 of 10 drives"
    assert (len(top.lines), len(bottom.lines)) == (8, 10)


def test_many_cycles_are_drawn_as_the_band_that_they_fill(drawn: list[Figure]) -> None:
    draw_run([creep(CHAIN, Cycles("0.002", 201))], "unused.png")
    top, bottom = drawn[0].axes
    (band,) = top.collections
    assert not top.lines
    assert np.abs(band.get_paths()[0].vertices[:, 1]).max() == 0.002
    assert bottom.lines[0].get_xdata()[-1] == 402


@pytest.fixture
def shown():
    """Close what is shown in a notebook."""
    yield
    plt.close("all")


def test_the_energies_of_a_rearrangement_add_up_to_those_of_its_row() -> None:
    chain = Chain(6, 1000, "0.5", "0.6", "0.01", tan_alpha="0.25")
    run = creep(chain, Cycles("0.004", 1), seed=3, record=("rearrangements",))
    row = run.to_pandas("rearrangements").iloc[0]
    motion = rearrange(chain, State.relaxed(chain, seed=3), direction=+1, seed=3)
    begin, end = motion.energy(0), motion.energy(motion.duration)
    assert (begin.kinetic, begin.gravity, begin.dissipated) == (0, 0, 0)
    assert end.elastic == pytest.approx(row["elastic_after"], rel=1e-12)
    assert end.gravity == pytest.approx(-row["gravity"], rel=1e-12)
    assert end.dissipated == pytest.approx(row["dissipation"], rel=1e-12)
    times = np.linspace(0, float(motion.duration), 99)
    known = motion.energy(times)
    assert (np.diff(known.dissipated) > -1e-14).all()  # friction only takes
    assert known.kinetic.max() > 0
    np.testing.assert_allclose(sum(known), begin.elastic, rtol=1e-13)


@pytest.mark.usefixtures("shown")
def test_a_rearrangement_draws_its_velocities_and_energies() -> None:
    motion = rearrange(CHAIN, State.relaxed(CHAIN), direction=+1)
    above, below = motion.plot()
    assert_shows_data(above.figure)
    (mesh,) = above.collections
    assert np.asarray(mesh.get_array()).max() == pytest.approx(
        motion.sol(np.linspace(0, motion.duration, 400)).velocities.max(), rel=1e-12
    )
    lines = {line.get_label(): line.get_ydata()[-1] for line in below.lines}
    assert lines["dissipated"] == motion.energy(motion.duration).dissipated


@pytest.mark.usefixtures("shown")
def test_a_record_is_drawn_in_dates_degrees_and_millimetres() -> None:
    roof = physical(length=3, youngs_modulus="16e9", density=11340, section="0.003", kappa="29e-6",
                    contacts=5, mu_d="0.45", mu_s="0.55", tan_alpha="0.3")  # fmt: skip
    days = np.arange("2020-07-01", "2020-07-31", dtype="datetime64[D]")
    degrees = [10.0 + 25 * (k % 2) for k in range(days.size)]
    record = TemperatureRecord.of(degrees, "29e-6", 10, times=days, unit="C")
    run = creep(roof.chain, record)
    axes = run.plot(solid=roof)
    assert axes.get_xlabel() == "date"
    assert axes.get_ylabel() == "descent (mm)"
    assert_shows_data(axes.figure)
    (line,) = axes.lines
    np.testing.assert_array_equal(line.get_ydata(), 1000 * roof.metres(run.recorded["x_G"]))
    (beside,) = (each for each in axes.figure.axes if each is not axes)
    assert beside.get_ylabel() == "temperature (\N{DEGREE SIGN}C)"
    np.testing.assert_allclose(beside.lines[0].get_ydata(), degrees[: run.half_cycles])
    with pytest.raises(InputError, match="the solid of the run's chain"):
        creep(CHAIN, record).plot(solid=roof)
