"""The picture of a sweep shows the numbers of the sweep, and refuses to show nothing."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.testing import assert_allclose, assert_array_equal

import exactcreep
from exactcreep import InputError, load_scene, sweep
from exactcreep.figures.style import VELOCITY
from exactcreep.figures.sweep import draw_sweep
from exactcreep.laws import creep_velocity_random, prediction_of
from exactcreep.model.numbers import exact_number
from tests.pictures import assert_shows_data

CHAIN = {"n": 2, "l0": 1000, "mu_d": 0.5, "mu_s": 0.6, "sigma_mu": 0.01}
SLOPES = {"vary.chain.tan_alpha": ["0.1", "0.2", "0.3"]}


def swept(settings: dict[str, Any], scene: str = "cycles", length: int = 20) -> xr.Dataset:
    of_drive = {"drive.cycles" if scene == "cycles" else "drive.steps": length}
    loaded = load_scene(f"two-sliders-{scene}").with_settings(of_drive | settings)
    return sweep(loaded, workers=1)


def drawn(grid: xr.Dataset) -> Figure:
    return assert_shows_data(draw_sweep(grid, ""), framed=True)


def lines_of(axes: Axes, style: str) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return the points of the lines in a style: dotted ones of the paper, full ones of laws."""
    lines = [one for one in axes.lines if one.get_linestyle() == style and len(one.get_xdata())]
    return [one.get_data(orig=False) for one in lines]


@pytest.mark.parametrize(
    ("scene", "size", "sigma_mu"),
    [("cycles", "amplitude", 0.01), ("angle", "sigma_theta", 0.01), ("cycles", "amplitude", 0)],
)
def test_points_are_the_means_over_the_seeds_and_lines_the_law_in_its_band(
    scene: str, size: str, sigma_mu: float
) -> None:
    vary = {**SLOPES, f"vary.drive.{size}": ["0.005", "0.01"], "vary.run.seed": [1, 2]}
    grid = swept(vary | {"chain.n": 6, "chain.sigma_mu": sigma_mu}, scene)
    (axes,) = drawn(grid).axes
    lines, bands = lines_of(axes, "-"), axes.collections[1::2]
    for points, value, band, *both in zip(
        axes.containers, (0.005, 0.01), bands, lines[::2], lines[1::2], strict=True
    ):
        x, y = points.lines[0].get_data(orig=False)
        mean = grid.velocity.mean("seed").sel({size: value}).to_numpy()
        assert x.tolist() == [0.1, 0.2, 0.3]
        assert_allclose(y, mean, rtol=1e-15, atol=0)
        about = {**CHAIN, "n": 6, "sigma_mu": sigma_mu, size: value}
        laws = [prediction_of(about | {"tan_alpha": slope}, relaxed=True) for slope in both[0][0]]
        assert {*x} < {*both[0][0]}
        for (_, values), end in zip(both, (min, max), strict=True):
            assert_allclose(values, [end(law.values) for law in laws], rtol=1e-9)
        heights = band.get_paths()[0].vertices[:, 1]
        tops = [max(law.values) + np.nan_to_num(law.deviation) for law in laws]
        assert heights.max() == pytest.approx(max(tops))


def test_two_quantities_of_many_values_make_a_map_with_contours_of_the_law() -> None:
    slopes, sizes = [f"0.{k}" for k in range(5)], [f"0.00{k}" for k in range(1, 8)]
    vary = {"vary.chain.tan_alpha": slopes, "vary.drive.amplitude": sizes}
    grid = swept(vary)
    axes, bar = drawn(grid).axes
    mesh, contours = axes.collections[:2]
    shown = np.asarray(mesh.get_array()).reshape(7, 5)
    velocity = grid["velocity"].transpose("amplitude", "tan_alpha").to_numpy()
    assert_array_equal(shown, velocity)
    assert bar.get_ylabel() == VELOCITY
    # along a contour the law has the contour's value
    checked = 0
    for level, path in zip(contours.levels, contours.get_paths(), strict=True):
        for slope, size in path.vertices[5:-5:9]:
            if 0.01 < slope < 0.39:
                law = prediction_of({**CHAIN, "tan_alpha": slope, "amplitude": size})
                assert law.values[0] == pytest.approx(level, abs=0.03 * np.nanmax(velocity))
                checked += 1
    assert checked > 5


def test_a_sweep_draws_itself_into_given_axes_with_its_errors() -> None:
    grid = swept(SLOPES | {"vary.run.seed": [*range(6)]})
    given = Figure(layout="constrained").subplots()
    assert exactcreep.plot_sweep(grid, ax=given) is given
    assert_shows_data(given.figure, framed=True)
    (bars,) = given.containers
    assert_allclose(bars.lines[0].get_data(orig=False)[1], grid.velocity.mean("seed"), rtol=1e-15)
    lengths = np.ptp(np.array(bars.lines[2][0].get_segments())[:, :, 1], axis=1)
    assert_allclose(lengths, 2 * grid.velocity.std("seed", ddof=1) / np.sqrt(6))


def test_a_sweep_of_which_a_part_is_gone_says_so_instead_of_being_drawn() -> None:
    grid = swept(SLOPES | {"vary.run.seed": [1, 2]})
    for part in (grid.mean("seed"), grid.isel(seed=0), grid.isel(tan_alpha=[0, 1]), grid.velocity):
        with pytest.raises(InputError, match="whole grid that sweep returned"):
            exactcreep.plot_sweep(part)
    with pytest.raises(InputError, match="other than the seed"):
        exactcreep.plot_sweep(swept({"vary.run.seed": [1, 2]}))


CAPTION = {"l0": 1000, "mu_d": "0.5", "mu_s": "0.6", "sigma_mu": "0.01"}
SLOPE = {"tan_alpha": "0.25"}
PAGE = Path(__file__).parents[2] / "notebooks"


@pytest.mark.parametrize(
    ("scene", "caption"),
    [
        ("two-sliders-trace", {"n": 2, "sigma_theta": "0.1", **SLOPE}),
        ("two-sliders-angle", {"n": 2, "sigma_theta": "0.01"}),
        ("two-sliders-amplitude", {"n": 2, **SLOPE}),
        ("chain-plateaus", {"sigma_theta": "0.01"}),
        ("chain-amplitude", {"n": 30, **SLOPE}),
        ("chain-amplitude-random", {"n": 30, **SLOPE}),
        ("chain-size", {"amplitude": "0.005", **SLOPE}),
        # such dilations go as far as those cycles
        ("chain-size-random", {"sigma_theta": repr(0.005 * math.sqrt(math.pi)), **SLOPE}),
        ("chain-jumps", {"n": 30, "sigma_mu": 0, **SLOPE}),
    ],
)
def test_a_scene_of_the_paper_has_the_parameters_of_the_caption(
    scene: str, caption: dict[str, Any]
) -> None:
    loaded = load_scene(scene)
    given = {**loaded.tables["chain"], **loaded.tables["drive"]}
    for name, value in {**CAPTION, **caption}.items():
        assert float(exact_number(given[name], name)) == float(exact_number(value, name))
    page, kept = (PAGE / "reference/figures.md", PAGE / f"pictures/paper/{scene}.txt")
    assert f"$ exactcreep run {scene} " in page.read_text(encoding="utf-8")
    assert "nan" not in kept.read_text(encoding="utf-8")


def test_a_sweep_over_decades_has_logarithmic_axes_and_the_line_of_the_paper() -> None:
    sizes = ["0.0001", "0.001", "0.1"]
    grid = swept({"vary.drive.sigma_theta": sizes}, "amplitude", length=40)
    (axes,) = assert_shows_data(draw_sweep(grid, "")).axes
    assert (axes.get_xscale(), axes.get_yscale()) == ("log", "log")
    (places, values), _ = lines_of(axes, ":")
    given = {"n": 2, "l0": 1000, "mu_d": 0.5, "tan_alpha": 0.25}
    laws = [creep_velocity_random(**given, sigma_theta=float(one)) for one in places]
    assert_allclose(values, [law if law > 0 else np.nan for law in laws], rtol=1e-12)
    assert "paper, Eq. 24" in [text.get_text() for text in axes.get_legend().get_texts()]
