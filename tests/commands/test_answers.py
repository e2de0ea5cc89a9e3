"""What the commands that ask a question say in words, and what they say when they are stopped."""

from __future__ import annotations

import signal
import sys
from pathlib import Path

import pytest

from exactcreep.commands import files
from tests.conftest import Command
from tests.processes import finished

PAIR = ("threshold", "--n", "2")


def words(text: str) -> str:
    return " ".join(text.split())


def test_a_threshold_lists_its_edges_and_those_of_seeded_starts(command: Command) -> None:
    scan = ("--cycles", "3", "--points", "30", "--digits", "8", "--solver", "exact")
    told = command(*PAIR, *scan, "--windows", "--seeds", "2")
    assert told.code == 0
    said = words(told.out)
    # (mu_s c - s)/l0, where two relaxed sliders begin to creep
    assert "windows lower 0.00033954987505, upper 0.00033954987506, advance begins" in said
    assert "seed 1, lower 0.000339549" in said
    assert "seed 2, lower 0.000339549" in said


def test_a_threshold_that_finds_no_time_shows_what_is_known_with_status_3(command: Command) -> None:
    told = command(*PAIR, "--max-seconds", "0")
    assert told.code == 3
    assert "reason max_seconds = 0 was reached" in words(told.out)
    assert "outcome evidence computed" in words(told.out)


def test_a_long_itinerary_is_cut_and_says_by_how_much(command: Command) -> None:
    told = command("fate", "--n", "3", "--amplitude", "0.0006", "--start-tension", "0.01")
    count = len(command("fate", "--n", "3", "--amplitude", "0.0006", "--start-tension", "0.01",
                        "--json").json["itinerary"])  # fmt: skip
    assert told.out.count("half cycle ") == 12
    assert f"and {count - 12} more" in words(told.out)


PRESSED = """
import os, sys
from exactcreep import display
from exactcreep.cli import main

def show(self, progress, seen=[]):
    shown(self, progress)
    seen.append(progress)
    if progress.phase != "compiling" and len(seen) == 3:
        os.kill(os.getpid(), number)

number = int(sys.argv.pop(1))
shown, display.Display.show = display.Display.show, show
main()
"""


@pytest.mark.usefixtures("hears_ctrl_c")
@pytest.mark.parametrize(
    ("number", "line", "known"),
    [
        (signal.SIGTERM, "threshold --n 3 --digits 12", "interrupted"),
        (signal.SIGINT, "survival --n 6 --amplitude 0.000969 --starts 400", "cycles lived"),
        (
            signal.SIGTERM,
            "fate --n 30 --amplitude 0.003 --cycles 100000000 --solver exact",
            "last advance",
        ),
        (
            signal.SIGINT,
            "sweep chain-jumps --set drive.cycles=3000 --workers 1",
            "--resume goes on",
        ),
        (signal.SIGTERM, "reproduce chain-amplitude --quick --workers 1", "cells"),
        (signal.SIGINT, "plan chain-jumps", "interrupted"),
    ],
)
def test_a_command_that_is_stopped_says_so_and_what_is_known(
    number: int, line: str, known: str, tmp_path: Path
) -> None:
    script = f"import os; os.chdir({str(tmp_path)!r})\n{PRESSED}"
    told = finished(sys.executable, "-c", script, str(int(number)), *line.split())
    assert told.returncode == 128 + number, told.stderr
    assert "exactcreep: interrupted" in told.stderr
    assert known in words(told.stdout + told.stderr)
    assert "Traceback" not in told.stderr


@pytest.mark.parametrize(
    ("line", "variables", "status", "said"),
    [
        ("run two-sliders-cycles --set drive.cycles=2", {"NUMBA_DISABLE_JIT": "1"}, 2,
         "exactcreep: NUMBA_DISABLE_JIT must not be set: the solvers are compiled\n"),
        ("run two-sliders-cycles --set drive.cycles=2 --out a.nc", {"GONE": "1"}, 2,
         "exactcreep: the working directory is gone: No such file or directory\n"),
        ("run two-sliders-cycles --set drive.cycles=2 --plot a.png", {"MPLBACKEND": "nonsense"}, 0,
         ""),
    ],
)  # fmt: skip
def test_an_environment_that_does_not_fit_costs_a_sentence(
    line: str, variables: dict[str, str], status: int, said: str, tmp_path: Path
) -> None:
    script = f"import os, sys; os.chdir({str(tmp_path)!r})\n"
    script += "if 'GONE' in os.environ: os.rmdir(os.getcwd())\n"
    script += "from exactcreep.cli import main; main()"
    told = finished(sys.executable, "-c", script, *line.split(), **variables)
    assert (told.returncode, told.stderr) == (status, said)


def test_a_scene_is_printed_as_json_too_and_a_wrong_name_finds_the_right_one(
    command: Command,
) -> None:
    told = command("scenes", "--json", "--show", "six-sliders-cycles")
    assert told.json["toml"] == command("scenes", "--show", "six-sliders-cycles").out
    wrong = command("scenes", "--show", "six-slider-cycles").sentence
    assert wrong.endswith("(did you mean six-sliders-cycles?)")


def test_a_large_export_is_announced_with_its_size(
    command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = ("run", "six-sliders-cycles", "--set", "drive.cycles=30", "--record", "events")
    assert command(*run, "--out", "run.nc").code == 0
    monkeypatch.setattr(files, "_LARGE", 1e5)
    told = command("export", "run.nc", "--table", "events", "--to", "a.csv")
    size = Path("a.csv").stat().st_size / 1e6
    (words,) = told.err.splitlines()
    assert abs(float(words.split()[-2]) - size) < 0.25 * size
    assert command("export", "run.nc", "--to", "b.csv").err == ""


def test_an_animation_gives_up_in_time(command: Command) -> None:
    scene = ("animate", "thirty-sliders-cycles", "--rearrangement", "999999")
    assert "max_seconds = 0 was reached" in command(*scene, "--max-seconds", "0").sentence


def test_a_title_tells_what_was_run_and_a_velocity_below_the_threshold_no_law(
    command: Command,
) -> None:
    words = ("run", "six-sliders-cycles", "--set", "chain.n=3", "--set", "drive.cycles=5")
    assert command(*words).out.startswith("six-sliders-cycles: with chain.n=3, drive.cycles=5\n")
    below = command(*words, "--set", "drive.amplitude=1e-5").out
    assert "paper, Eq. (vitesse_seuil)  none: below its threshold" in below


@pytest.mark.parametrize(
    "words",
    [("run", "chain-jumps", "--set", "drive.cycles=2"), ("compare", "two-sliders-cycles")],
    ids=lambda words: words[0],
)
def test_tables_fit_eighty_columns(
    command: Command, words: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    short = ("--seeds", "2", "--events", "20") if words[0] == "compare" else ()
    told = command(*words, *short)
    assert told.code == 0
    table = [line for line in told.out.splitlines() if "  " in line.strip()]
    assert table
    assert max(map(len, table)) <= 80
