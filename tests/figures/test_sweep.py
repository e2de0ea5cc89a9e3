"""The picture of a sweep shows the numbers of the sweep, and refuses to show nothing."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure
from numpy.testing import assert_allclose, assert_array_equal

import exactcreep
from exactcreep.figures.style import VELOCITY, setting_text
from exactcreep.figures.sweep import (
    _levels,
    draw_sweep,
    plot_sweep,
    points_of,
    predicted,
    sticking,
)
from exactcreep.laws import sliding_velocity, sliding_velocity_random, sticking_velocity
from exactcreep.laws.sticking import beyond_sticking
from exactcreep.model.numbers import InputError
from exactcreep.scene import load_scene
from exactcreep.studies.sweep import sweep
from tests.pictures import assert_shows_data


def swept(**vary: Any) -> xr.Dataset:
    settings = {"drive.cycles": 20} | {key.replace("__", "."): v for key, v in vary.items()}
    return sweep(load_scene("two-sliders-cycles").with_settings(settings), workers=1)


def drawn(grid: xr.Dataset, title: str = "") -> Figure:
    return assert_shows_data(draw_sweep(grid, title))


@pytest.mark.parametrize(
    ("scene", "length", "size", "name", "law"),
    [
        ("cycles", "cycles", "amplitude", r"$A_\theta$", sliding_velocity),
        ("angle", "steps", "sigma_theta", r"$\sigma_\theta$", sliding_velocity_random),
    ],
)
def test_points_are_the_means_over_the_seeds_and_lines_the_sliding_limit(
    scene: str, length: str, size: str, name: str, law: Callable[..., Any]
) -> None:
    vary = {"chain.tan_alpha": ["0.1", "0.2", "0.3"], f"drive.{size}": ["0.005", "0.01"]}
    settings = {f"vary.{key}": values for key, values in {**vary, "run.seed": [1, 2]}.items()}
    loaded = load_scene(f"two-sliders-{scene}").with_settings({f"drive.{length}": 20} | settings)
    grid = sweep(loaded, workers=1)
    (axes,) = drawn(grid).axes
    assert axes.get_xlabel() == r"$\tan\alpha$"
    for number, value in enumerate((0.005, 0.01)):
        points = axes.containers[number]
        x, y = points.lines[0].get_data(orig=False)
        mean = grid.velocity.mean("seed").sel({size: value}).to_numpy()
        assert x.tolist() == [0.1, 0.2, 0.3]
        assert_allclose(y, mean, rtol=1e-15, atol=0)
        assert points.get_label() == f"{name} = {value}"
        (line,) = [
            one for one in axes.lines
            if one.get_color() == points.lines[0].get_color() and one.get_linestyle() == "--"
        ]  # fmt: skip
        given = {"n": 2, "l0": 1000, "mu_d": 0.5, size: value}
        slopes, values = line.get_data(orig=False)
        assert {*x} < {*slopes}
        expected = [float(law(**given, tan_alpha=t)) for t in slopes]
        assert_allclose(values, expected, rtol=1e-12, atol=0)


def test_where_there_is_no_law_there_is_no_line() -> None:
    title = r"$\bad{ is no formula, and 5 $ is money"
    figure = drawn(swept(vary__chain__tan_alpha=["-0.1", "0.2", "0.5"]), title)
    assert figure.get_suptitle() == title
    lines = [line for line in figure.axes[0].lines if line.get_linestyle() == "--"]
    (law,) = (line for line in lines if len(line.get_xdata()))
    slopes, values = law.get_data()
    assert (np.isnan(values) == (slopes >= 0.5)).all()


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


def test_contours_of_a_map_are_the_law_that_holds_there_whatever_was_measured() -> None:
    """Full ones of the law of sticking sliders, in its range; broken ones of the sliding limit."""
    slopes, sizes = [f"0.{k}" for k in range(6)], [f"0.00{k}" for k in range(3, 9)]
    few = {"chain__n": 10, "chain__sigma_mu": "0.01", "drive__cycles": 1}
    grid = swept(vary__chain__tan_alpha=slopes, vary__drive__amplitude=sizes, **few)
    grid["velocity"] = grid.velocity * 0
    grid["velocity"][0, 0] = 30.0  # the levels of contours are those between the colours' ends
    axes = drawn(grid).axes[0]
    _, full, broken = axes.collections[:3]
    assert axes.get_title().startswith("full lines: measured law of sticking sliders; broken")
    given = {"n": 10, "l0": 1000.0, "mu_d": 0.5}
    sticks = given | {"mu_s": 0.6, "sigma_mu": 0.01}
    checked = dict.fromkeys(("full", "broken"), 0)
    laws = {"full": (full, sticking_velocity, sticks), "broken": (broken, sliding_velocity, given)}
    for name, (lines, law, about) in laws.items():
        for level, path in zip(lines.levels, lines.get_paths(), strict=True):
            for slope, size in path.vertices[3:-3:4]:
                where = {"tan_alpha": float(slope), "amplitude": float(size)}
                at = float(law(**about, **where))
                # interpolated between points a hundredth of the map apart; the limit has jumps
                near = [float(law(**about, tan_alpha=slope + off, amplitude=size))
                        for off in (-0.007, 0.007) if 0 <= slope + off < 0.5]  # fmt: skip
                assert min(at, *near) - 0.3 < level < max(at, *near) + 0.3
                assert not beyond_sticking(sticks | where) or name == "broken"
                checked[name] += 1
    assert min(checked.values()) > 10


def test_slow_creep_has_another_colour_than_rest_in_a_map() -> None:
    """A hundredth of the fastest is a tenth of the way along the colours; the ticks tell it."""
    slopes, sizes = [f"0.{k}" for k in range(5)], [f"0.00{k}" for k in range(1, 6)]
    grid = swept(vary__chain__tan_alpha=slopes, vary__drive__amplitude=sizes)
    grid["velocity"] = grid.velocity * 0
    grid["velocity"][1, 1], grid["velocity"][2, 2], grid["velocity"][3, 3] = 10.0, 0.1, math.nan
    figure = drawn(grid)
    mesh = figure.axes[0].collections[0]
    assert_allclose(mesh.norm([0.0, 0.1, 10.0]), [0.0, 0.1, 1.0], rtol=1e-12)
    assert np.count_nonzero(np.ma.getmaskarray(mesh.get_array())) == 1
    ticks = figure.axes[1].get_yticks()
    assert {0.0, 1.0, 5.0} <= {*ticks.tolist()}
    grid["velocity"] = grid.velocity * math.nan  # runaways alone
    draw_sweep(grid)


def test_a_sweep_draws_itself_into_given_axes_with_its_errors_and_the_law() -> None:
    grid = swept(vary__chain__tan_alpha=["0.1", "0.2", "0.3"], vary__run__seed=[1, 2])
    figure = Figure(layout="constrained")
    given = figure.subplots()
    assert exactcreep.plot_sweep(grid, ax=given) is given
    assert_shows_data(figure)
    (bars,) = given.containers
    assert bars.has_yerr
    assert_allclose(bars.lines[0].get_data(orig=False)[1], grid.velocity.mean("seed"), rtol=1e-15)
    assert any(line.get_linestyle() == "--" and len(line.get_xdata()) for line in given.lines)
    own = exactcreep.plot_sweep(grid)
    assert_shows_data(own.figure)
    plt.close(own.figure)


def test_a_sweep_of_which_a_part_is_gone_says_so_instead_of_being_drawn() -> None:
    grid = swept(vary__chain__tan_alpha=["0.1", "0.2", "0.3"], vary__run__seed=[1, 2])
    for part in (grid.mean("seed"), grid.isel(seed=0), grid.isel(tan_alpha=[0, 1]), grid.velocity):
        with pytest.raises(InputError, match="whole grid that sweep returned"):
            exactcreep.plot_sweep(part)
    with pytest.raises(InputError, match="other than the seed"):
        exactcreep.plot_sweep(swept(vary__run__seed=[1, 2]))


def test_points_without_a_known_error_are_counted_and_the_sliding_limit_does_not_stick() -> None:
    scene = load_scene("six-sliders-cycles").with_settings({"drive.cycles": 6})
    grid = sweep(scene.with_settings({"vary.run.solver": ["exact", "sliding"]}))
    assert np.isnan(grid["velocity_error"]).all()
    axes = plot_sweep(grid)
    labels = [text.get_text() for text in axes.get_legend().get_texts()]
    assert "errors of 2 of 2 are not known" in labels
    exact, sliding = (sticking(predicted(point.parameters))[0] for point in points_of(grid))
    assert math.isfinite(exact)
    assert math.isnan(sliding)
    errors = grid.assign(velocity_error=grid["velocity_error"] * 0 + 0.1)
    errors["velocity_error"][:] = 0.1
    known = plot_sweep(errors).get_legend().get_texts()
    assert not any("not known" in text.get_text() for text in known)


def test_a_start_is_named_in_words() -> None:
    assert setting_text("start", '{"tensions": ["0.06"]}') == "tensions 0.06"
    assert setting_text("run.start", "relaxed") == "relaxed"
    assert len(setting_text("start", '{"tensions": [' + "0.06, " * 30 + "]}")) < 50


def test_contours_of_a_narrow_range_are_round_and_few_enough_for_labels() -> None:
    assert _levels(10.1, 10.9) == pytest.approx([10.2, 10.35, 10.5, 10.65, 10.8])
    assert _levels(0.3, 60) == [1, 2, 5, 10, 20, 50]
