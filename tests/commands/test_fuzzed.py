"""Command lines as people mistype them, and Ctrl-C: a sentence, never a defect."""

from __future__ import annotations

import re
import shlex
import signal
import time
from random import Random

import pytest

from tests.conftest import Command
from tests.processes import PATIENCE, PROGRAM, begun

LINES = (
    "run two-sliders-cycles --set drive.cycles=3 --json",
    "run two-sliders-cycles --set chain.n=3 --set drive.amplitude=0.001 --plot p.png --force",
    "run two-sliders-cycles --solver certified --set drive.cycles=1 --out r.nc --force",
    "fate --n 3 --amplitude 0.0004 --solver exact",
    "threshold --n 2 --digits 4",
    "survival --n 3 --amplitude 0.0004 --starts 2 --cycles 20",
    "compare two-sliders-cycles --events 20 --dts 0.1",
    "scenes",
    "show r.nc",
    "record weather.csv",
)
WORDS = (
    "-1", "0", "1e400", "nan", "--n", "--set", "chain.n=x", "drive.amplitude=", "=", "--json",
    "--out", "/", "", "--max-seconds", "0.1", "--solver", "verlet", "'a b'", "--plot", "x" * 300,
)  # fmt: skip
STATUSES = 0, 2, 3, 4


def mistyped(line: str, random: Random) -> str:
    """Return a line with one to three words dropped, doubled, changed or put in."""
    words = line.split()
    for _ in range(random.randint(1, 3)):
        place = random.randrange(len(words))
        word = words[place]
        changed = word.replace(random.choice(word), random.choice("-=.0x9"), 1)
        new = random.choice([(), (word, word), (changed,), (word, random.choice(WORDS))])
        words[place : place + 1] = [each or "''" for each in new] or (["scenes"] * (not words[1:]))
    return " ".join(words)


@pytest.mark.filterwarnings("ignore")
def test_a_mistyped_line_ends_with_an_answer_or_a_sentence(command: Command) -> None:
    random = Random(0)
    for _ in range(100):
        line = mistyped(random.choice(LINES), random)
        told = command(*shlex.split(f"{line} --max-seconds 1" if "run" in line else line))
        assert told.code in STATUSES, (line, told.err)
        assert not re.search("defect|Traceback", told.err), (line, told.err)
        assert told.code == 0 or told.err.strip(), line


ENDLESS = {
    "survival --n 6 --amplitude 0.000969 --starts 4000": "cycles followed",
    "fate --n 30 --amplitude 0.003 --cycles 100000000 --solver exact": "last advance",
}
"""Lines that are never done in time, with a word of what is known when they are stopped."""


@pytest.mark.usefixtures("hears_ctrl_c")
@pytest.mark.parametrize("line", ENDLESS)
def test_what_is_known_when_a_command_is_stopped_is_said(line: str) -> None:
    for patience in (4, 16, 64):
        with begun(*PROGRAM, *line.split()) as process:
            time.sleep(patience)
            process.send_signal(signal.SIGINT)
            out, err = process.communicate(timeout=PATIENCE)
        assert process.returncode == 130
        if ENDLESS[line] in " ".join((out + err).split()):
            return
    pytest.fail(err)
