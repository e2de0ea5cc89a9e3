"""Long runs survive: commands killed at random moments, and files that are not the run's."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from exactcreep import Creep
from exactcreep.quasistatic.creep_result import load_members
from tests.processes import finished

# One process compiles; each attempt is a fork of it, so that a kill costs milliseconds. An attempt
# dies before or after one of the calls by which a checkpoint gets onto the disk: which, is random
# and does not depend on how fast the machine is.
_KILLED = """
import os, random, signal, sys
from exactcreep.cli import status

folder, words = sys.argv[1], sys.argv[2:]
os.chdir(folder)
status([*words, "--set", "drive.cycles=1", "--json", "--out", "x.nc"])
assert status([*words, "--out", "whole.nc", "--json"]) == 0
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


kills = resumed = 0
finished = False
while not finished:
    there = os.path.exists("run.ckpt")
    left = [moments.randrange(1, 25) if kills < 12 else 0]
    child = os.fork()
    if child == 0:
        os.dup2(quiet, 1)
        os.dup2(quiet, 2)
        os.fsync, os.replace = mortal(os.fsync, left), mortal(os.replace, left)
        if there:
            code = status(["resume", "run.ckpt", "--every", "0", "--out", "run.nc", "--force"])
        else:
            code = status([*words, "--checkpoint", "run.ckpt", "--every", "0", "--out", "run.nc"])
        os._exit(code)
    told = os.waitpid(child, 0)[1]
    finished = told == 0
    kills += not finished
    resumed += there
    assert finished or os.WTERMSIG(told) == signal.SIGKILL
print(kills, resumed, file=sys.stderr)
"""


def bits(result: Creep) -> dict[str, object]:
    about = {k: repr(v) for k, v in result.dataset.attrs.items() if k != "seconds"}
    values = {str(k): v.to_numpy().tobytes() for k, v in result.dataset.variables.items()}
    return about | values


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
def test_a_command_killed_12_times_at_random_writes_the_file_of_an_uninterrupted_one(
    tmp_path: Path,
) -> None:
    words = ["run", "six-sliders-cycles", "--set", "drive.cycles=800", "--set",
             "vary.run.seed=[3, 4]", "--record", "x_G,slips"]  # fmt: skip
    told = finished(sys.executable, "-c", _KILLED, str(tmp_path), *words)
    assert told.returncode == 0, told.stderr
    kills, resumed = map(int, told.stderr.split()[-2:])
    assert kills == 12
    assert resumed >= 10
    whole, survived = (load_members(tmp_path / name) for name in ("whole.nc", "run.nc"))
    assert len(whole) == len(survived) == 2
    for one, other in zip(whole, survived, strict=True):
        assert bits(one) == bits(other)
        assert one.half_cycles == 1600
    left = {path.name for path in tmp_path.iterdir()} - {"whole.nc", "run.nc", "run.ckpt", "x.nc"}
    assert not left  # what a kill in the middle of writing leaves behind the next writer removes
