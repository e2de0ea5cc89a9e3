"""Long runs survive: commands killed at random moments, and files that are not the run's."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from exactcreep import Creep, creep, load_scene
from tests.processes import finished

# One process compiles; each attempt is a fork of it, so that a kill costs milliseconds. An attempt
# dies before or after one of the calls by which a file gets onto the disk: which, is random and
# does not depend on how fast the machine is. The same line is given again until it ends.
_KILLED = """
import os, random, signal, sys
from exactcreep.cli import status

folder, wanted, most, words = sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), sys.argv[4:]
os.chdir(folder)
status([*words[:2], "--set", "drive.cycles=1", "--json", "--record", "x_G,slips"])
quiet = os.open(os.devnull, os.O_WRONLY)
moments = random.Random(20110603)


def mortal(call, left):
    def moment():
        left[0] -= 1
        if left[0] == 0:
            os.kill(os.getpid(), signal.SIGKILL)

    def called(*given, **more):
        moment()
        call(*given, **more)
        moment()

    return called


kills = 0
finished = False
while not finished:
    left = [moments.randrange(1, most) if kills < wanted else 0]
    child = os.fork()
    if child == 0:
        os.dup2(quiet, 1)
        os.dup2(quiet, 2)
        os.fsync, os.replace = mortal(os.fsync, left), mortal(os.replace, left)
        os._exit(status(words))
    told = os.waitpid(child, 0)[1]
    finished = told == 0
    kills += not finished
    assert finished or os.WTERMSIG(told) == signal.SIGKILL
print(kills, file=sys.stderr)
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
def test_a_command_killed_6_times_at_random_writes_the_file_of_an_uninterrupted_one(
    tmp_path: Path,
) -> None:
    words = ["run", "six-sliders-cycles", "--record", "x_G,slips", "--set", "drive.cycles=1600",
             "--checkpoint", "run.ckpt", "--every", "0", "--out", "run.nc"]  # fmt: skip
    told = finished(sys.executable, "-c", _KILLED, str(tmp_path), "6", "25", *words)
    assert (told.returncode, told.stderr.split()[-1:]) == (0, ["6"]), told.stderr
    # what a kill in the middle of writing leaves behind the next writer removes
    assert {path.name for path in tmp_path.iterdir()} == {"run.ckpt", "run.nc"}
    run = load_scene(words[1]).experiment({"drive.cycles": 1600})
    assert Creep.load(tmp_path / "run.nc") == creep(run.chain, run.drive, record=("x_G", "slips"))
