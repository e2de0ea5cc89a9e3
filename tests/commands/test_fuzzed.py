"""Command lines as people mistype them, and signals at any moment: a sentence, never a defect."""

from __future__ import annotations

import re
import signal
import time
from collections.abc import Iterator
from pathlib import Path
from random import Random

import pytest

from tests.warm import Warm, warm_process

pytestmark = pytest.mark.xdist_group("warm")  # one warm process
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


@pytest.fixture(scope="module")
def warm(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Warm]:
    with warm_process(tmp_path_factory.mktemp("warm")) as process:
        yield process


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


@pytest.mark.parametrize("seed", range(2))
def test_a_mistyped_line_ends_with_an_answer_or_a_sentence(
    seed: int, warm: Warm, tmp_path: Path
) -> None:
    random = Random(seed)
    for _ in range(60):
        line = mistyped(random.choice(LINES), random)
        code, _, said = warm.run(f"{line} --max-seconds 1" if "run" in line else line, tmp_path)
        assert code in STATUSES, (line, said)
        assert not re.search("defect|Traceback", said), (line, said)
        assert code == 0 or said.strip(), line


ENDLESS = {
    "survival --n 6 --amplitude 0.000969 --starts 4000": "cycles followed",
    "fate --n 30 --amplitude 0.003 --cycles 100000000 --solver exact": "last advance",
    "compare thirty-sliders-cycles": "interrupted",
    "run two-sliders-cycles --set drive.cycles=1e9 --checkpoint a.ckpt --force": "same command",
}
"""Lines that are never done in time, with a word of what is known when they are stopped."""


@pytest.mark.parametrize("line", ENDLESS)
def test_what_is_known_when_a_command_is_stopped_is_said(
    line: str, warm: Warm, tmp_path: Path
) -> None:
    for patience in (0.5, 2, 8, 32):
        with warm.begun(line, tmp_path) as child:
            time.sleep(patience)
            child.signal(signal.SIGINT)
            code, out, said = child.wait()
        assert code == 130
        if ENDLESS[line] in " ".join((out + said).split()):
            return
    pytest.fail(said)


@pytest.mark.parametrize("line", [line for line in LINES if "show" not in line])
def test_a_signal_at_any_moment_is_said_and_leaves_no_part(
    line: str, warm: Warm, tmp_path: Path
) -> None:
    random = Random(line)
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGINT):
        with warm.begun(line, tmp_path) as child:
            time.sleep(random.uniform(0, 0.3))
            child.signal(number)
            code, _, said = child.wait()
        assert code in (128 + number, *STATUSES), said
        assert code != 128 + number or not said or "exactcreep: interrupted" in said
        assert not re.search("defect|Traceback", said), said
        assert {path.suffix for path in tmp_path.iterdir()} <= {".png", ".nc"}
