"""``exactcreep run``: what it prints, writes and keeps, and how it ends."""

from __future__ import annotations

import json
import math
import re
import signal
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

from exactcreep import Creep, creep, load_scene
from exactcreep.commands.run import beside, foretelling
from exactcreep.quasistatic.checkpoint import CheckpointWarning
from exactcreep.results import Progress
from exactcreep.watch.display import Display
from tests.conftest import Command
from tests.processes import PATIENCE, PROGRAM, begun, wait_until
from tests.test_book import README

SIX, TWO = ("run", "six-sliders-cycles"), ("run", "two-sliders-cycles")
JUMPS = ("run", "chain-jumps")


def cycles(count: int, *more: str) -> tuple[str, ...]:
    return ("--set", f"drive.cycles={count}", *more)


QUICK = (*SIX, *cycles(10))


def test_what_a_run_still_takes_is_told_without_the_part_in_its_checkpoint(
    capsys: pytest.CaptureFixture[str],
) -> None:
    foretelling(Display())(Progress("running", 75, 100, events=3000, seconds=60.0))
    assert capsys.readouterr().err == "expected: about 1e+03 more events in 20 s\n"


# --- what is printed -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("measured", "error", "law", "said"),
    [
        (1.0, 0.1, (0.5,), "+5"),
        (1.0, 0.1, (0.5, 1.2), "between"),  # two values of a plateau that is not unique
        (0.4, 0.1, (1.2, 0.5), "-1"),
        (1.0, 1e-16, (1.1,), "-no scatter"),  # rounding is no scatter
        (1.0, 0.1, (), "-"),
        (1.0, math.nan, (0.5,), "no error"),
        (0.4999, 0.1, (0.5,), "+0"),
    ],
)
def test_a_deviation_counts_standard_errors_outside_of_the_law(
    measured: float, error: float, law: tuple[float, ...], said: str
) -> None:
    assert beside(measured, error, law)[1] == said


def test_a_scene_with_members_prints_what_each_one_sets(command: Command) -> None:
    told = command(*JUMPS, *cycles(3, "--json"))
    members = told.json["members"]
    # every digit that was written is printed, although Python's float holds fewer
    assert '"drive.amplitude": 0.00367441471930044455' in told.out
    start = {"run.start": {"size": 1e-6, "seed": 1}}
    assert members[9]["set"] == {"drive.amplitude": 0.00367441471930044455} | start
    assert [members[0]["set"]["run.start"], len(members)] == ["relaxed", 16]
    assert all(member["half_cycles"] == 6 for member in members)
    assert len({member["x_G"] for member in members}) > 2


def test_numbers_asked_with_digits_are_decimal_strings(command: Command) -> None:
    sure = cycles(4, "--set", "chain.sigma_mu=0", "--solver", "certified", "--digits", "40")
    velocity = command(*TWO, *sure, "--json").json["velocity"]
    assert isinstance(velocity, str)
    assert len(velocity.replace(".", "")) == 40
    # 2 D k with D = 0.1 cos(alpha), tan(alpha) = 1/4, k slips of each slider in a cycle
    assert velocity.startswith("9.70142500145331")


def test_the_readme_shows_what_is_printed_where_no_terminal_folds_it(
    command: Command, drawn: list[Figure], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("COLUMNS")
    text = README.read_text("utf-8")
    line = re.search(r"exactcreep (run .*)$", text, re.MULTILINE)
    shown = re.search(r"^```text\n(six-sliders-cycles: .*?)^```$", text, re.MULTILINE | re.DOTALL)
    untimed = re.compile(r"[\d.]+ s$", re.MULTILINE)
    assert line is not None
    assert shown is not None
    assert untimed.sub("", command(*line[1].split()).out) == untimed.sub("", shown[1])
    assert f": {drawn[0].get_suptitle()}\n" in shown[1]


# --- checkpoints ---------------------------------------------------------------------------------


def untimed(told: dict) -> dict:
    for member in told.get("members", [told]):
        assert member.pop("seconds") > 0
    return told


def test_the_same_command_goes_on_and_prints_what_an_uninterrupted_run_prints(
    command: Command,
) -> None:
    line = (*QUICK, "--set", "run.start.tensions=[0.05,0,0,0,0]")
    whole = untimed(command(*line, "--json").json)
    files = "--checkpoint", "a.ckpt", "--out", "a.nc", "--plot", "a.svg"
    assert command(*line, *files, "--max-events", str(whole["events"] - 1)).code == 3
    with pytest.warns(CheckpointWarning, match=r"a.ckpt holds \d+ of 20 half-cycles: the run goes"):
        told = command(*line, *files, "--json")
    assert untimed(told.json) == whole
    assert Creep.load("a.nc").half_cycles == 20
    assert command(*QUICK, "--out", "a.nc").code == 2  # it is overwritten by no other command
    said = "drive.cycles is 10 there, and 11 here; name another file, or begin anew with force"
    assert said in command(*SIX, *cycles(11), "--checkpoint", "a.ckpt").sentence


def test_the_same_command_goes_on_with_the_members_of_a_scene(command: Command) -> None:
    whole = untimed(command(*JUMPS, *cycles(20, "--json")).json)
    most = str(max(member["events"] for member in whole["members"]) - 1)
    files = "--out", "a", "--plot", "a.svg"  # the picture of the part is drawn again
    part = command(*JUMPS, *cycles(20, "--json"), "--max-events", most, *files)
    assert part.code == 3
    ended = [member for member in part.json["members"] if member["outcome"] == "limit"]
    assert 0 < len(ended) < 16
    with pytest.warns(CheckpointWarning, match=f"a goes on: {16 - len(ended)} of 16 cells"):
        again = command(*JUMPS, *cycles(20, "--json"), *files)
    assert untimed(again.json) == whole
    late = command(*JUMPS, *cycles(21, "--json"), "--max-seconds", "0")
    assert (late.code, len(late.json["members"])) == (3, 1)
    assert late.json["members"][0]["reason"] == "max_seconds = 0 was reached"


def test_trajectories_are_drawn_in_one_picture_unless_a_number_has_three_values(
    command: Command, drawn: list[Figure]
) -> None:
    slopes = "--set", "vary.chain.tan_alpha=[0.1,0.2]", "--plot", "a.png"
    assert command(*TWO, *cycles(4), "--seeds", "3", *slopes, "--out", "grid").code == 0
    (axes,) = drawn[-1].axes
    grid = xr.load_dataset("grid/sweep.nc", engine="h5netcdf")
    lines = [line.get_ydata()[1:] for line in axes.lines]
    assert np.array_equal(lines, grid.recorded_x_G.to_numpy().reshape(6, 8))
    assert len(axes.get_legend().get_texts()) == 2
    slopes = "--set", "vary.chain.tan_alpha=[0.1,0.2,0.3]", "--plot", "b.png"
    assert command(*TWO, *cycles(4), *slopes).code == 0
    assert "alpha" in drawn[-1].axes[0].get_xlabel()  # velocities


# --- signals and the compiler --------------------------------------------------------------------


@pytest.mark.usefixtures("ignores_ctrl_c")
def test_a_signal_saves_and_summarises_what_was_computed(tmp_path: Path) -> None:
    """In the background of a shell, where Ctrl-C is ignored, SIGTERM does."""
    kept = tmp_path / "a.ckpt"

    def size() -> int:
        return kept.stat().st_size if kept.exists() else 0

    endless = ("--json", "--checkpoint", "a.ckpt", "--every", "0", "--out", "a.nc")
    with begun(*PROGRAM, *TWO, "--set", "drive.cycles=1e9", *endless, cwd=tmp_path) as process:
        # with its third checkpoint, if not before, the loop is running
        wait_until(lambda: size() > 30_000, process)
        process.send_signal(signal.SIGINT)
        pressed = size()
        wait_until(lambda: size() > 2 * pressed, process)
        process.send_signal(signal.SIGTERM)
        out, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == 128 + signal.SIGTERM
    assert json.loads(out)["reason"] == "interrupted"
    assert "the same command goes on" in err
    loaded = Creep.load(tmp_path / "a.nc")
    assert loaded.half_cycles == json.loads(out)["half_cycles"] > 100
    assert loaded.velocity == pytest.approx(9.757, rel=0.01)
    run = load_scene("two-sliders-cycles").experiment({"drive.cycles": 10**9})
    with pytest.warns(CheckpointWarning, match=f"holds {loaded.half_cycles} of"):
        gone_on = creep(run.chain, run.drive, checkpoint=kept, max_events=0)
    assert gone_on.half_cycles == loaded.half_cycles
