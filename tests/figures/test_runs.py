"""Pictures of runs show the runs, however long and however many."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from exactcreep import Chain, Cycles, GaussianSteps, creep
from exactcreep.figures.runs import draw_run

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
