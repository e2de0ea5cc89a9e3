"""What the commands that ask a question say in words, and what they say when they are stopped."""

from __future__ import annotations

import signal
import sys
from pathlib import Path

import pytest

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
