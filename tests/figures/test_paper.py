"""The paper's figures show what the captions say, and their tables hold the laws beside them."""

from __future__ import annotations

import csv
import dataclasses
import io
import math
import re
from pathlib import Path

import pandas as pd
import pytest
import xarray as xr

from exactcreep import load_scene
from exactcreep.figures.paper import PICTURES, Table, to_csv
from exactcreep.figures.sweep import Point, deviation
from exactcreep.model.numbers import exact_number
from tests.conftest import Command
from tests.pictures import assert_shows_data

SEEDS = {"vary.run.seed": [1, 2]}
TINY = {
    "two-sliders-trace": {"drive.steps": 60},
    "two-sliders-angle": {
        "drive.steps": 40, "vary.chain.tan_alpha": ["0", "0.25", "0.49"], **SEEDS,
    },
    "two-sliders-amplitude": {
        "drive.steps": 40, "vary.drive.sigma_theta": ["0.001", "0.01"], **SEEDS,
    },
    "chain-plateaus": {"drive.steps": 10, "vary.chain.tan_alpha": ["0.1", "0.49"], **SEEDS},
    "chain-amplitude": {"drive.cycles": 5, "vary.drive.amplitude": ["0.002", "0.0037", "0.005"]},
    "chain-amplitude-random": {
        "drive.steps": 5, "vary.drive.sigma_theta": ["0.002", "0.005"], **SEEDS,
    },
    "chain-size": {"drive.cycles": 5, "vary.chain.n": [2, 7, 8]},
    "chain-size-random": {"drive.steps": 5, "vary.chain.n": [2, 8], **SEEDS},
    "chain-jumps": {
        "drive.cycles": 100, "vary.run.start": ["relaxed", {"size": "1e-6", "seed": 1}],
    },
}  # fmt: skip
CAPTION = {"l0": 1000, "mu_d": "0.5", "mu_s": "0.6", "sigma_mu": "0.01"}
SLOPE = {"tan_alpha": "0.25"}
CAPTIONS = {
    "two-sliders-trace": {"n": 2, "sigma_theta": "0.1", **SLOPE},
    "two-sliders-angle": {"n": 2, "sigma_theta": "0.01"},
    "two-sliders-amplitude": {"n": 2, **SLOPE},
    "chain-plateaus": {"sigma_theta": "0.01"},
    "chain-amplitude": {"n": 30, **SLOPE},
    "chain-amplitude-random": {"n": 30, **SLOPE},
    "chain-size": {"amplitude": "0.005", **SLOPE},
    # such dilations go as far as those cycles
    "chain-size-random": {"sigma_theta": repr(0.005 * math.sqrt(math.pi)), **SLOPE},
    "chain-jumps": {"n": 30, "sigma_mu": 0, **SLOPE},
}


@pytest.mark.parametrize("scene", CAPTIONS)
def test_a_scene_has_the_parameters_of_the_caption(scene: str) -> None:
    loaded = load_scene(scene)
    given = {**loaded.tables["chain"], **loaded.tables["drive"]}
    for name, value in {**CAPTION, **CAPTIONS[scene]}.items():
        assert float(exact_number(given[name], name)) == float(exact_number(value, name))


@pytest.mark.parametrize("name", list(PICTURES))
def test_a_picture_shows_and_keeps_every_number(name: str, tmp_path: Path) -> None:
    picture = PICTURES[name]
    short = dataclasses.replace(picture, quick={scene: TINY[scene] for scene in picture.quick})
    data = short.data(quick=True, workers=2)
    tables = picture.write(data, tmp_path)
    for ending, begin in (("png", b"\x89PNG"), ("pdf", b"%PDF")):
        assert (tmp_path / f"{name}.{ending}").read_bytes().startswith(begin)
    with (tmp_path / f"{name}.csv").open() as file:
        measured = [float(row["measured"]) for row in csv.DictReader(file)]
    assert measured == [row.measured for table in tables for row in table.rows]
    assert all(map(math.isfinite, measured))
    for scene in picture.quick:
        group = None if len(picture.quick) == 1 else scene
        kept = xr.load_dataset(tmp_path / f"{name}.nc", group=group, engine="h5netcdf")
        assert kept.identical(data[scene])
    figure = assert_shows_data(picture.draw(data, tables))
    shown = [y for axes in figure.axes for points in axes.containers
             for y in points[0].get_ydata(orig=False)]  # fmt: skip
    assert not shown or set(measured) <= set(shown)


# --- what the tables must show -------------------------------------------------------------------


@pytest.mark.parametrize(
    ("measured", "error", "law", "expected"),
    [
        (1.0, 0.1, (0.5,), 5.0),
        (1.0, 0.1, (0.5, 1.2), 0.0),  # two values of a plateau that is not unique
        (0.4, 0.1, (1.2, 0.5), -1.0),
        (1.0, 1e-16, (1.1,), -math.inf),  # rounding is no scatter
        (1.0, 0.1, (), math.nan),
    ],
)
def test_a_deviation_counts_standard_errors_outside_of_the_law(
    measured: float, error: float, law: tuple, expected: float
) -> None:
    assert deviation(measured, error, law) == pytest.approx(expected, rel=1e-12, nan_ok=True)


def test_a_table_is_a_csv_with_numbers_in_columns_of_numbers() -> None:
    known = Point({"n": 6, "tan_alpha": 0.1}, 1.5, 0.25, (2.0,), (1.0, 1.25))
    tables = [Table("plateau", "", (known,)), Table("life", "", (Point({"n": 7}, 1e-300),))]
    frame = pd.read_csv(io.StringIO(to_csv(tables)))
    assert frame.pop("series").tolist() == ["plateau", "life"]
    assert set(frame.pop("unit")) == {"g tau_dyn^2 per half-cycle or target"}
    assert frame.iloc[0].dropna().to_dict() == {
        "n": 6, "tan_alpha": 0.1, "measured": 1.5, "standard_error": 0.25,
        "printed_law_least": 2, "printed_law_largest": 2,
        "exact_law_least": 1, "exact_law_largest": 1.25,
        "deviation_printed": -2, "deviation_exact": 1,
    }  # fmt: skip
    assert frame.iloc[1].dropna().to_dict() == {"n": 7, "measured": 1e-300}


def test_the_command_lists_refuses_and_keeps_files(command: Command, tmp_path: Path) -> None:
    listed = re.findall(r"^(\S+) +Fig. (\d)$", command("reproduce").out, re.MULTILINE)
    assert listed == [(name, str(k)) for k, name in enumerate(PICTURES, start=2)]
    assert "did you mean chain-plateaus?" in command("reproduce", "chain-plateau").sentence
    words = ["reproduce", "two-sliders-trace", "--quick", "--out", "figures"]
    assert "paper: Eq. 17" in command(*words).out
    written = {path.name for path in (tmp_path / "figures").iterdir()}
    assert written == {f"two-sliders-trace.{ending}" for ending in ("png", "pdf", "nc", "csv")}
    assert "exists" in command(*words).sentence
    assert command(*words, "--force").code == 0
