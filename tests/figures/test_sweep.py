"""The picture of a sweep shows the numbers of the sweep, and refuses to show nothing."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure
from numpy.testing import assert_allclose, assert_array_equal

import exactcreep
from exactcreep.figures.style import VELOCITY
from exactcreep.figures.sweep import STAIRCASE, draw_sweep, points_of
from exactcreep.laws import differing_velocity, sliding_velocity, sliding_velocity_random
from exactcreep.model.numbers import InputError
from exactcreep.scene import load_scene
from exactcreep.studies.sweep import sweep
from tests.pictures import assert_shows_data


def swept(**vary: Any) -> xr.Dataset:
    settings = {"drive.cycles": 20} | {key.replace("__", "."): v for key, v in vary.items()}
    return sweep(load_scene("two-sliders-cycles").with_settings(settings), workers=1)


def drawn(grid: xr.Dataset, title: str = "") -> Figure:
    return assert_shows_data(draw_sweep(grid, title), framed=True)


@pytest.mark.parametrize(
    ("scene", "length", "size", "law"),
    [
        ("cycles", "cycles", "amplitude", sliding_velocity),
        ("angle", "steps", "sigma_theta", sliding_velocity_random),
    ],
)
def test_points_are_the_means_over_the_seeds_and_lines_the_sliding_limit(
    scene: str, length: str, size: str, law: Callable[..., Any]
) -> None:
    vary = {"chain.tan_alpha": ["0.1", "0.2", "0.3"], f"drive.{size}": ["0.005", "0.01"]}
    settings = {f"vary.{key}": values for key, values in {**vary, "run.seed": [1, 2]}.items()}
    loaded = load_scene(f"two-sliders-{scene}").with_settings({f"drive.{length}": 20} | settings)
    grid = sweep(loaded, workers=1)
    (axes,) = drawn(grid).axes
    lines = [line for line in axes.lines if line.get_linestyle() == "--" and len(line.get_xdata())]
    for points, line, value in zip(axes.containers, lines, (0.005, 0.01), strict=True):
        x, y = points.lines[0].get_data(orig=False)
        mean = grid.velocity.mean("seed").sel({size: value}).to_numpy()
        assert x.tolist() == [0.1, 0.2, 0.3]
        assert_allclose(y, mean, rtol=1e-15, atol=0)
        slopes, values = line.get_data(orig=False)
        assert {*x} < {*slopes}
        given = {"n": 2, "l0": 1000, "mu_d": 0.5, size: value}
        expected = [float(law(**given, tan_alpha=t)) for t in slopes]
        assert_allclose(values, expected, rtol=1e-12, atol=0)


def test_the_line_of_a_chain_that_differs_is_its_own_law() -> None:
    grid = swept(chain__mu_d=["0.4", "0.5"], vary__drive__amplitude=["0.001", "0.002"])
    (axes,) = drawn(grid).axes
    (line,) = [one for one in axes.lines if one.get_linestyle() == "--" and len(one.get_xdata())]
    amplitudes, values = line.get_data(orig=False)
    given = {"l0": 1000, "mu_d": [0.4, 0.5], "tan_alpha": 0.25}
    for amplitude, value in zip(amplitudes, values, strict=True):
        (law,) = differing_velocity(**given, amplitude=float(amplitude))
        assert value == pytest.approx(law, rel=1e-12)


def test_two_quantities_of_many_values_make_a_map_with_contours_of_the_law() -> None:
    slopes, sizes = [f"0.{k}" for k in range(1, 5)], [f"0.00{k}" for k in range(1, 8)]
    grid = swept(vary__chain__tan_alpha=slopes, vary__drive__amplitude=sizes)
    assert not drawn(grid).axes[0].get_title()  # four slopes are families
    grid = swept(vary__chain__tan_alpha=["0", *slopes], vary__drive__amplitude=sizes)
    axes, bar = drawn(grid).axes
    mesh, lines = axes.collections[:2]
    assert axes.get_title().startswith("broken lines")
    shown = np.asarray(mesh.get_array()).reshape(7, 5)
    velocity = grid["velocity"].transpose("amplitude", "tan_alpha").to_numpy()
    assert_array_equal(shown, velocity)
    assert bar.get_ylabel() == VELOCITY
    # along a contour the law has the contour's value
    given = {"n": 2, "l0": 1000.0, "mu_d": 0.5}
    checked = 0
    for level, path in zip(lines.levels, lines.get_paths(), strict=True):
        for slope, size in path.vertices[5:-5:9]:
            if 0.01 < slope < 0.39:
                at = float(sliding_velocity(**given, tan_alpha=slope, amplitude=size))
                assert at == pytest.approx(level, abs=0.02 * np.nanmax(velocity))
                checked += 1
    assert checked > 5


def test_a_sweep_draws_itself_into_given_axes_with_its_errors_and_the_staircase() -> None:
    grid = swept(vary__chain__tan_alpha=["0.1", "0.2", "0.3"], vary__run__seed=[*range(6)])
    given = Figure(layout="constrained").subplots()
    assert exactcreep.plot_sweep(grid, ax=given) is given
    assert_shows_data(given.figure, framed=True)
    (bars,) = given.containers
    assert_allclose(bars.lines[0].get_data(orig=False)[1], grid.velocity.mean("seed"), rtol=1e-15)
    lengths = np.ptp(np.array(bars.lines[2][0].get_segments())[:, :, 1], axis=1)
    assert_allclose(lengths, 2 * grid.velocity.std("seed", ddof=1) / np.sqrt(6))
    clean = swept(chain__sigma_mu=0, vary__drive__amplitude=["0.0005", "0.001"])
    axes = exactcreep.plot_sweep(clean)
    (stairs,) = [one for one in axes.lines if one.get_linestyle() == "-" and len(one.get_xdata())]
    steps = 0.1 * 2 / np.hypot(1, 0.25)  # 2 D
    heights = stairs.get_ydata() / steps
    assert_allclose(heights, heights.round(), atol=1e-9)
    assert np.ptp(heights.round()) >= 1
    assert STAIRCASE in [text.get_text() for text in axes.get_legend().get_texts()]
    plt.close(axes.figure)


def test_a_sweep_of_which_a_part_is_gone_says_so_instead_of_being_drawn() -> None:
    grid = swept(vary__chain__tan_alpha=["0.1", "0.2", "0.3"], vary__run__seed=[1, 2])
    for part in (grid.mean("seed"), grid.isel(seed=0), grid.isel(tan_alpha=[0, 1]), grid.velocity):
        with pytest.raises(InputError, match="whole grid that sweep returned"):
            exactcreep.plot_sweep(part)
    with pytest.raises(InputError, match="other than the seed"):
        exactcreep.plot_sweep(swept(vary__run__seed=[1, 2]))


def test_the_sliding_limit_of_the_same_random_steps_takes_their_scatter_out() -> None:
    vary = {"vary.chain.tan_alpha": ["0.2"], "vary.run.seed": [*range(8)], "drive.steps": 4}
    grid = sweep(load_scene("two-sliders-angle").with_settings(vary), workers=1)
    scatter = np.random.default_rng(1).normal(0, 5, grid.velocity.shape)
    given = {"n": 2, "l0": 1000, "mu_d": 0.5, "tan_alpha": 0.2, "sigma_theta": 0.01}
    law = float(sliding_velocity_random(**given))
    own = grid.assign(velocity=grid.velocity * 0 + scatter + law + 0.25)
    known = own.assign(velocity_sliding=own.velocity * 0 + scatter + law)
    (alone,), (beside,) = points_of(own), points_of(known)
    assert beside.measured == pytest.approx(law + 0.25, abs=1e-12)
    assert beside.error < 1e-12
    assert alone.measured == pytest.approx(law + 0.25 + scatter.mean(), abs=1e-12)
