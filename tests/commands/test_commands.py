"""Every command prints, saves and draws, overwrites nothing, and stops with a sentence."""

from __future__ import annotations

import json
import re
import signal
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from matplotlib.figure import Figure

from exactcreep import moved
from exactcreep.cli import COMMANDS
from tests.conftest import Command
from tests.processes import PROGRAM, finished

TWO = ("--n", "2", "--amplitude", "0.001")
SEARCH = "threshold --n 3 --digits 9 --points 50"
QUICK = "run six-sliders-cycles --set drive.cycles=10"
SHORT = ("two-sliders-cycles", "--set", "drive.cycles=4")
EVERY = {
    "scenes": (("six-sliders-cycles",), ""),
    "run": (SHORT, "out plot"),
    "show": (("run.nc", "--half-cycle", "4"), "out.png"),
    "animate": ((*SHORT, "--frames", "2", "--rearrangement", "3"), "out.gif"),
    "record": (("days.csv",), "plot"),
    "roof": (("days.csv", "--length", "3", "--slope-degrees", "15"), "plot"),
    "threshold": (("--n", "2", "--after", "3", "--digits", "6"), "out plot"),
    "fate": (TWO, "plot"),
    "survival": ((*TWO, "--starts", "8", "--cycles", "30"), "out plot"),
    "compare": ((*SHORT, "--seeds", "1", "--events", "20", "--dts", "0.5"), "out plot"),
}
ENDINGS = {"out": ".nc", "plot": ".png"}
BEGINNINGS = {".nc": b"\x89HDF", ".png": b"\x89PNG", ".gif": b"GIF8"}
SILENT = {"show", "animate"}
"""Commands that have files alone, and no object of JSON."""


PRINTED = json.loads(Path(__file__).parents[1].joinpath("data/printed.json").read_text("utf-8"))
"""The numbers that lines of `EVERY` print: stored by ``python -m tests.data.printed``."""


def numbers(text: str) -> str:
    """Return the numbers in a text, but times and how they were found."""
    known = re.sub(r"^report .*|[\d.e+-]+ (s|ms|us|min)\b", "", text, flags=re.MULTILINE)
    return " ".join(re.findall(r"[-+]?\d[\d.]*(?:e[-+]?\d+)?", known))


def make_files(run: Callable[..., object]) -> None:
    """Make the files that lines of `EVERY` name."""
    run("run", *SHORT, "--record", "x_G,events", "--out", "run.nc")
    Path("days.csv").write_text("Tag;TN;TX\n01.06.2024;8,5;21\n02.06.2024;9;22,5\n")


@pytest.mark.parametrize("name", EVERY)
def test_a_command_prints_saves_draws_and_overwrites_nothing(
    name: str, command: Command, drawn: list[Figure], tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.setenv("COLUMNS", "80")
    given, outputs = EVERY[name]
    make_files(command)
    line = (name, *given)
    options: list[str] = []
    for output in outputs.split():
        option, dot, ending = output.partition(".")
        path = tmp_path / f"written{dot + ending or ENDINGS[option]}"
        path.write_text("precious")
        options += [f"--{option}", str(path)]
        assert "exists" in command(*line, *options[-2:]).sentence
        assert path.read_text() == "precious"
    told = command(*line, *options, *["--force"] * bool(options))
    assert told.code == 0, told.err
    for path in map(Path, options[1::2]):
        assert f"written: {path}" in told.err.splitlines() or f"written: {path} (" in told.err
        assert path.read_bytes().startswith(BEGINNINGS[path.suffix])
    assert bool(drawn) == ("plot" in outputs or name == "show")
    assert "written" not in told.out
    assert numbers(told.out) == PRINTED.get(name, numbers(told.out))
    assert told.out.strip()
    assert all(len(row) <= 80 for row in told.out.splitlines() if "  " in row)
    if name not in SILENT:
        assert command(*line, "--json").json
    if name == "show":
        assert drawn[0].axes[1].get_title(loc="right") == "inside half-cycles 3 to 6"
        assert "at most 8" in command("show", "run.nc", "--half-cycle", "9").sentence
    if name == "threshold":  # what is known when the time is over
        late = command(*line, "--max-seconds", "0")
        assert late.code == 3
        assert "max_seconds = 0 was reached" in " ".join(late.out.split())


def test_every_command_is_tried_and_has_help_with_an_example(command: Command) -> None:
    assert {*EVERY, "explore"} == {*COMMANDS}
    assert re.fullmatch(r"exactcreep \d+\.\d+\.\d+\n", command("--version").out)
    listed = re.findall(r"^│ ([a-z][a-z-]*) ", command("--help").out, re.MULTILINE)
    assert listed == list(COMMANDS)
    for name in COMMANDS:
        told = command(name, "--help").out
        assert f"exactcreep {name}" in told.partition("Options")[0].partition("Example")[2]


# --- what is said --------------------------------------------------------------------------------


def test_scenes_lists_every_scene_and_shows_one_that_runs(command: Command) -> None:
    scenes = command("scenes", "--json").json["scenes"]
    listed = {scene["name"]: scene["members"] for scene in scenes}
    assert listed["chain-jumps"] == 16
    assert all(name in command("scenes").out for name in listed)
    toml = command("scenes", "six-sliders-cycles").out
    Path("mine.toml").write_text(toml)
    short = ["--set", "drive.cycles=5", "--json"]
    mine = command("run", "mine.toml", *short).json
    assert mine["x_G"] == command("run", "six-sliders-cycles", *short).json["x_G"]


# --- refusals ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("line", "said"),
    [
        (f"{QUICK} --plot", "--plot needs a value"),
        (f"{QUICK} --n 2,4", "--set vary.chain.n=[2,4]"),
        (f"{QUICK} --set chain.n=[2,4]", "several values are for vary.chain.n"),
        ("run six-slider-cycles", "did you mean six-sliders-cycles? It must be a"),
        (f"{QUICK} --dt 0.01", "'dt': solver 'exact' does not take it"),
        (
            f"{QUICK} --seeds 2 --checkpoint a.ckpt",
            "is of one run, and this scene varies: --out DIR",
        ),
        (f"{QUICK} --seeds 2 --out a.nc", "must be a directory, without .nc: this scene varies"),
        (f"{QUICK} --seeds 2 --plot a.png --record none", "needs x_G among"),
        (f"{QUICK} --out no/such/run.nc", "must lie in a directory that exists"),
        (f"{QUICK} --plot run.png --record none", "needs x_G or rearrangements among"),
        ("animate two-sliders-cycles --out a.mp4", "must end in .gif"),
        ("run --n=8", "run takes a scene; set its chain.n with --set chain.n=8"),
        (f"{QUICK} --max-second 8", "run has no option --max-second (did you mean --max-seconds?)"),
        (f"{SEARCH} --bracket 0.0001 0.0002", "--from LO --to HI --points 1"),
        (f"{SEARCH} --from 0.001 --to 0.002", "from"),
        (f"{SEARCH} --solver verlet", "solver"),
        (f"{SEARCH} --sigma-mu 0.01", "digits = '9': belongs to kind='edge'"),
        (f"{SEARCH} --sigma-mu 0.01 --kind edge", "--kind intercept"),
        (f"{SEARCH} --seed 3", "belongs to kind='intercept', and this is an edge"),
        ("threshold --n 6", "`survival` how long, `threshold` with `after`"),
        ("threshold --n 6 --sigma-mu 0.01 --fit 2 1.2", "fit"),
        ("fate --n 6 --amplitude 0.001 --sigma-mu 0.01", "survival"),
        *moved.COMMANDS.items(),
    ],
)
def test_bad_input_is_one_sentence_and_status_2(
    command: Command, tmp_path: Path, line: str, said: str
) -> None:
    assert said in command(*line.split()).sentence
    assert not list(tmp_path.iterdir())


def test_a_compiler_that_is_switched_off_costs_a_sentence() -> None:
    told = finished(*PROGRAM, "run", *SHORT, NUMBA_DISABLE_JIT="1")
    assert told.returncode == 2
    assert told.stderr.startswith("exactcreep: NUMBA_DISABLE_JIT must not be set: ")
    assert told.stderr.count("\n") == 1


# --- stopped -------------------------------------------------------------------------------------

IMPORTING = """
import os, signal, sys
class Press:
    def find_spec(self, name, path=None, target=None):
        if name == "cyclopts":
            os.kill(os.getpid(), int(sys.argv[1]))
sys.meta_path.insert(0, Press())
from exactcreep.__main__ import main
main()
"""


@pytest.mark.usefixtures("hears_ctrl_c")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_while_the_program_is_imported_ends_in_a_sentence(number: int) -> None:
    done = finished(sys.executable, "-c", IMPORTING, str(int(number)))
    sentence = "exactcreep: interrupted\n"
    assert (done.returncode, done.stdout, done.stderr) == (128 + number, "", sentence)


# --- how a line is read ---------------------------------------------------------------------------


def test_a_setting_may_be_negative_and_a_scene_stand_behind_two_hyphens(command: Command) -> None:
    options = ("--set", "chain.tan_alpha=-1/4", "--set", "drive.cycles=5", "--json")
    told = command("run", *options, "--record", "x_G,slips", "--record", "x", "--", SHORT[0]).json
    mirrored = command("run", SHORT[0], *options[2:]).json
    assert told["x_G"] < 0 < mirrored["x_G"]


def test_a_sweep_prints_a_velocity_with_its_error_at_every_point(command: Command) -> None:
    line = "run six-sliders-cycles --set drive.cycles=80 --seeds 4 --out cells"
    rows = command(*line.split(), "--set", "vary.drive.amplitude=[0.00001,0.01]").out.splitlines()
    assert rows[1].split() == ["amplitude", "velocity", "paper", "off", "law", "off", "outcome"]
    assert re.fullmatch(r" 1e-05 +0.* +none +- +0 +\S+ +4 (at_rest|cycling)", rows[2])
    value, error, law, off = map(float, re.fullmatch(
        r" 0\.01 +(\S+) ± (\S+) +(\S+) +([+-]\S+) +\S+ +[+-]\d\.\d +4 creeping downhill", rows[3]
    ).groups())  # fmt: skip
    assert off == pytest.approx((value - law) / error, abs=0.05 + 0.1 * abs(off))
    assert rows[4].startswith("2 points, 4 seeds each: means and their standard errors: 4 ")
