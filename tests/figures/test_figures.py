"""The pictures show what the captions say, and their tables explain every departure from a law."""

from __future__ import annotations

import ast
import csv
import dataclasses
import functools
import math
from fractions import Fraction
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
import xarray as xr
from PIL import Image

from exactcreep.cli import status
from exactcreep.commands.reproduce import data_of, write
from exactcreep.figures import drawing
from exactcreep.figures.catalogue import PICTURES
from exactcreep.figures.pictures.beyond import bursts
from exactcreep.figures.style import STYLE
from exactcreep.figures.tables import CONTROL, deviation, points_of, with_control
from exactcreep.laws import LAWS
from exactcreep.model.numbers import exact_number
from exactcreep.scene import load_scene
from exactcreep.studies.sweep import sweep

pytestmark = pytest.mark.xdist_group("figures")  # they share the data of `tiny`

TINY_STARTS = ["relaxed", {"size": "1e-6", "seed": 1}]
TINY = {
    "two-sliders-trace": {"drive.steps": 60},
    "two-sliders-angle": {
        "drive.steps": 40, "vary.chain.tan_alpha": ["0", "0.25", "0.49"], "vary.run.seed": [1, 2],
    },
    "two-sliders-amplitude": {
        "drive.steps": 40, "vary.drive.sigma_theta": ["0.001", "0.01"], "vary.run.seed": [1, 2],
    },
    "chain-plateaus": {
        "drive.steps": 10, "vary.chain.tan_alpha": ["0.1", "0.2"], "vary.run.seed": [1, 2],
    },
    "chain-amplitude": {"drive.cycles": 5, "vary.drive.amplitude": ["0.002", "0.0037", "0.005"]},
    "chain-amplitude-random": {
        "drive.steps": 5, "vary.drive.sigma_theta": ["0.002", "0.005"], "vary.run.seed": [1, 2],
    },
    "chain-size": {"drive.cycles": 5, "vary.chain.n": [2, 7, 8]},
    "chain-size-random": {"drive.steps": 5, "vary.chain.n": [2, 8], "vary.run.seed": [1, 2]},
    "chain-jumps": {"drive.cycles": 10, "vary.run.start": TINY_STARTS},
    "two-sliders-staircase": {
        "drive.cycles": 10, "vary.drive.amplitude": ["0.0003", "0.0007", "0.0011"],
    },
    "chain-windows": {"drive.cycles": 20, "vary.drive.amplitude": ["0.00045", "0.00046", "0.0005"]},
    "chain-map": {
        "drive.cycles": 5, "vary.chain.tan_alpha": ["0", "0.2", "0.4"],
        "vary.drive.amplitude": ["0.001", "0.003"],
    },
    "chain-waiting": {"drive.cycles": 60, "vary.run.start": TINY_STARTS[1:] * 2},
    "gaussian-closed-form": {
        "drive.steps": 20, "vary.drive.sigma_theta": ["0.0003", "0.003"], "vary.run.seed": [1, 2],
    },
    "chain-pivots": {
        "drive.cycles": 5, "vary.chain.tan_alpha": ["0.15", "0.25"], "vary.run.seed": [1],
    },
    "thresholds-by-criterion": {
        "sizes": [2, 6], "step": 0.2, "starts": 4, "cycles": 40, "velocity_cycles": 120,
        "most_velocity": 6,
    },
    "fate-map": {"sizes": [3, 6], "count": 7, "cycles": 100},
    "lifetimes": {"sizes": [6], "ratios": [0.94, 0.95, 0.98], "starts": 4, "cycles": 500},
    "chain-avalanches": {"sizes": [6, 9], "ratios": [1.5], "cycles": [12, 12]},
    "chain-near-threshold": {
        "drive.cycles": 5, "vary.drive.amplitude": ["0.0035", "0.004"],
        "vary.run.start": TINY_STARTS[1:],
    },
}  # fmt: skip
PAPER = {
    "position2sliders", "velocity2sliders", "velocity2sliders_theta", "velocityNsliders",
    "velocityNslidersbis", "cloche", "jumps",
}  # fmt: skip


@functools.cache
def tiny(name: str):
    """Return a picture with its data, as short as it can be drawn."""
    picture = PICTURES[name]
    small = dataclasses.replace(picture, quick={scene: TINY[scene] for scene in picture.scenes})
    return small, data_of(small, quick=True, workers=2)


def test_every_figure_with_data_of_the_paper_has_a_picture() -> None:
    assert {picture.figure for picture in PICTURES.values()} - {""} == PAPER


@pytest.mark.parametrize(
    ("scene", "said"),
    [
        ("two-sliders-trace", {"n": 2, "sigma_mu": "0.01", "tan_alpha": "0.25",
                               "sigma_theta": "0.1"}),
        ("two-sliders-angle", {"n": 2, "sigma_mu": "0.01", "sigma_theta": "0.01"}),
        ("two-sliders-amplitude", {"n": 2, "sigma_mu": "0.01", "tan_alpha": "0.25"}),
        ("chain-plateaus", {"sigma_mu": "0.01", "sigma_theta": "0.01"}),
        ("chain-amplitude", {"n": 30, "sigma_mu": "0.01", "tan_alpha": "0.25"}),
        ("chain-amplitude-random", {"n": 30, "sigma_mu": "0.01", "tan_alpha": "0.25"}),
        ("chain-size", {"sigma_mu": "0.01", "tan_alpha": "0.25", "amplitude": "0.005"}),
        ("chain-size-random", {"sigma_mu": "0.01", "tan_alpha": "0.25"}),
        ("chain-jumps", {"n": 30, "sigma_mu": 0, "tan_alpha": "0.25"}),
    ],
)  # fmt: skip
def test_a_scene_has_the_parameters_of_the_caption(scene: str, said: dict) -> None:
    loaded = load_scene(scene)
    given = {**loaded.tables["chain"], **loaded.tables["drive"]}
    for name, value in {"l0": 1000, "mu_d": "0.5", "mu_s": "0.6", **said}.items():
        assert exact_number(given[name], name) == exact_number(value, name)


def test_the_random_dilations_of_the_size_figure_match_its_cycles() -> None:
    sigma = load_scene("chain-size-random").tables["drive"]["sigma_theta"]
    assert float(sigma) == 0.005 * math.sqrt(math.pi)


def test_the_amplitudes_of_jumps_lie_one_percent_from_the_law() -> None:
    amplitudes = load_scene("chain-jumps").vary["drive.amplitude"]
    star = LAWS["seuil"].printed(n=30, l0=1000, mu_d=Fraction(1, 2), tan_alpha=Fraction(1, 4))
    assert [round(float(a) / float(star), 12) for a in amplitudes] == [0.99, 1.01]


@pytest.mark.parametrize("name", list(PICTURES))
def test_a_picture_is_written_with_its_data_and_table(name: str, tmp_path: Path) -> None:
    picture, data = tiny(name)
    tables = picture.tables(data)
    write(picture, data, tables, tmp_path)
    with Image.open(tmp_path / f"{name}.png") as shown:
        pixels = np.asarray(shown.convert("L"))
    assert min(pixels.shape) > 400
    assert 0.001 < (pixels < 128).mean() < 0.7
    assert (tmp_path / f"{name}.pdf").read_bytes().startswith(b"%PDF")
    with (tmp_path / f"{name}.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == sum(len(table.rows) for table in tables)
    for row in rows:
        assert math.isfinite(float(row["measured"]))
        departs = abs(float(row["deviation_exact"])) > 3  # nan: no standard error
        assert row["remark"] or not departs
    for scene in picture.scenes:
        group = None if len(picture.scenes) == 1 else scene
        kept = xr.load_dataset(tmp_path / f"{name}.nc", group=group, engine="h5netcdf")
        assert kept.identical(data[scene])


@pytest.mark.parametrize("name", list(PICTURES))
def test_every_axis_of_a_picture_is_labelled(name: str) -> None:
    picture, data = tiny(name)
    with mpl.rc_context(STYLE):
        figure = picture.draw(data, picture.tables(data))
    for axes in figure.axes:
        if axes.get_label() == "<colorbar>":
            continue
        shared = axes.get_shared_x_axes().get_siblings(axes)
        assert any(each.get_xlabel() for each in shared)
    assert any(axes.get_ylabel() for axes in figure.axes)


# --- what the tables must show -------------------------------------------------------------------


def test_two_sliders_follow_the_exact_law_where_the_printed_one_is_off() -> None:
    picture = PICTURES["two-sliders-angle"]
    settings = {"drive.steps": 1000, "vary.chain.tan_alpha": ["0.1", "0.25", "0.4"]}
    changed = dataclasses.replace(picture, quick={picture.name: settings})
    (table,) = picture.tables(data_of(changed, quick=True))
    for row in table.rows:
        assert abs(row.deviation_exact) < 4
        assert row.deviation_printed > 20  # it has mu_s where mu_d belongs
        assert not row.departs


def test_two_sliders_depart_near_alpha_zero_and_the_angle_of_avalanche() -> None:
    picture = PICTURES["two-sliders-angle"]
    settings = {"drive.steps": 1000, "vary.chain.tan_alpha": ["0", "0.004", "0.49"]}
    changed = dataclasses.replace(picture, quick={picture.name: settings})
    level, shallow, steep = picture.tables(data_of(changed, quick=True))[0].rows
    assert abs(level.measured) < 4 * level.error
    assert "symmetry" in level.remark
    assert shallow.deviation_exact < -10
    assert "sigma_mu" in shallow.remark
    assert steep.deviation_exact > 10
    assert "mu_d" in steep.remark


def test_without_disorder_two_sliders_stand_on_the_staircase() -> None:
    picture = PICTURES["two-sliders-staircase"]
    (table,) = picture.tables(data_of(picture, quick=True))
    assert len(table.rows) == 302
    assert all(row.deviation_exact == 0 for row in table.rows)
    assert len({round(row.measured, 9) for row in table.rows}) > 10


def test_three_sliders_creep_in_a_window_below_their_last_threshold() -> None:
    dataset = sweep(load_scene("chain-windows"))
    star = float(LAWS["seuil"].printed(n=3, l0=1000, mu_d=0.5, tan_alpha=0.25))
    relative = dataset["amplitude"].to_numpy() / star
    creeps = dataset["outcome"].to_numpy() == "creeping"
    window = (relative >= 1.2586) & (relative < 1.2827) | (relative >= 1.3116)
    # the thresholds are known to four digits: no point of the grid is closer to one than that
    assert np.array_equal(creeps, window)
    assert not dataset["velocity"].to_numpy()[~creeps].any()


def test_the_onset_of_creep_is_sharp_without_disorder_and_broad_with_it() -> None:
    scene = load_scene("chain-pivots").with_settings(
        {"vary.chain.tan_alpha": ["0.15", "0.175", "0.199", "0.201"], "vary.run.seed": [1],
         "drive.cycles": 100}
    )  # fmt: skip
    velocity = sweep(scene)["velocity"].squeeze("seed")
    plateau = float(velocity.sel(sigma_mu=0, tan_alpha=0.201))
    law = LAWS["vitesse_seuil"].printed
    expected = law(n=3, l0=1000, mu_d=0.5, tan_alpha=0.201, amplitude=0.005)
    assert abs(plateau / expected - 1) < 0.02
    assert not velocity.sel(sigma_mu=0)[:3].any()
    broad = velocity.sel(sigma_mu=0.01)
    assert (broad.diff("tan_alpha") > 0).all()
    assert 0 < float(broad[0]) < float(broad[1]) < 0.9 * plateau


def test_dilations_taken_out_leave_the_mean_and_shrink_its_error() -> None:
    scene = load_scene("two-sliders-angle").with_settings(
        {"drive.steps": 400, "vary.chain.tan_alpha": ["0.25"]}
    )
    raw = sweep(scene)
    sliding = sweep(scene.with_settings({"run.solver": "sliding"}))
    (before,), (after,) = points_of(raw), points_of(with_control(raw, sliding))
    assert after.error < before.error / 20
    assert abs(after.measured - before.measured) < 4 * before.error
    assert CONTROL not in raw


@pytest.mark.parametrize(
    ("measured", "error", "law", "expected"),
    [
        (1.0, 0.1, (0.5,), 5.0),
        (1.0, 0.1, (0.5, 1.2), 0.0),  # between two values of a plateau that is not unique
        (1.5, 0.1, (0.5, 1.2), 3.0),
        (0.4, 0.1, (1.2, 0.5), -1.0),
        (1.0, 0.0, (1.0 + 1e-13,), 0.0),
        (1.0, 0.0, (0.9,), math.inf),
        (1.0, 1e-16, (1.1,), -math.inf),  # rounding is no scatter
        (1.0, math.nan, (0.9,), math.nan),
        (1.0, 0.1, (), math.nan),
    ],
)
def test_a_deviation_counts_standard_errors_outside_of_the_law(
    measured: float, error: float, law: tuple, expected: float
) -> None:
    assert deviation(measured, error, law) == pytest.approx(expected, rel=1e-12, nan_ok=True)


def test_bursts_are_cycles_in_which_all_but_the_pivot_slip() -> None:
    #                  cycle: 1     2     3     4     5     6
    active = np.array([1, 2, 4, 0, 0, 3, 1, 1, 2, 2, 3, 3])
    x_G = np.array([0, 0.1, 1, 2, 3, 4.5, 4.5, 4.6, 4.6, 4.7, 5, 6], dtype=float)
    waits, jumps = bursts(active, x_G, 4)
    assert waits == [2]
    assert jumps == pytest.approx([4.4, 1.3], rel=1e-12, abs=0)


# --- the command ---------------------------------------------------------------------------------


def test_the_command_lists_refuses_and_keeps_files(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert status(["reproduce"]) == 0
    listed = capsys.readouterr().out
    assert all(name in listed for name in PICTURES)
    assert status(["reproduce", "chain-plateau"]) == 2
    assert "did you mean chain-plateaus?" in capsys.readouterr().err
    words = ["reproduce", "two-sliders-trace", "--quick", "--out", str(tmp_path / "figures")]
    assert status(words) == 0
    assert "paper: Eq. (velocity_th_2_gaussienne_corrected)" in capsys.readouterr().out
    written = {path.name for path in (tmp_path / "figures").iterdir()}
    assert written == {f"two-sliders-trace.{ending}" for ending in ("png", "pdf", "nc", "csv")}
    assert status(words) == 2
    assert "exists" in capsys.readouterr().err
    assert status([*words, "--force"]) == 0


def test_a_legend_names_laws_in_words_that_a_reader_knows() -> None:
    for path in Path(drawing.__file__).parent.rglob("*.py"):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        for node in ast.walk(tree):
            if isinstance(node, ast.keyword) and node.arg == "label":
                assert "Eq. (" not in ast.unparse(node.value), f"{path.name}, {node.value.lineno}"
    assert set(drawing._NAMES) <= set(LAWS)
