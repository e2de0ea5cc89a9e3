"""Long runs survive: commands killed at random moments, and files that are not the run's."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest
import xarray as xr

from exactcreep import Creep, creep, load_scene, sweep
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


def bits(result: Creep) -> dict[str, object]:
    about = {k: repr(v) for k, v in result.dataset.attrs.items() if k != "seconds"}
    values = {str(k): v.to_numpy().tobytes() for k, v in result.dataset.variables.items()}
    return about | values


WORDS = ["run", "six-sliders-cycles", "--record", "x_G,slips", "--set"]


def killed(folder: Path, *words: str, kills: int, most: int) -> set[str]:
    """Kill a line at random writes, of which `most` is the last; return what is left at its end."""
    told = finished(sys.executable, "-c", _KILLED, str(folder), str(kills), str(most), *words)
    assert told.returncode == 0, told.stderr
    assert int(told.stderr.split()[-1]) == kills
    return {path.name for path in folder.iterdir()}


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
def test_a_command_killed_6_times_at_random_writes_the_file_of_an_uninterrupted_one(
    tmp_path: Path,
) -> None:
    kept = ("drive.cycles=1600", "--checkpoint", "run.ckpt", "--every", "0", "--out", "run.nc")
    # what a kill in the middle of writing leaves behind the next writer removes
    assert killed(tmp_path, *WORDS, *kept, kills=6, most=25) == {"run.ckpt", "run.nc"}
    run = load_scene(WORDS[1]).experiment({"drive.cycles": 1600})
    whole = creep(run.chain, run.drive, record=("x_G", "slips"))
    assert bits(whole) == bits(Creep.load(tmp_path / "run.nc"))


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
def test_a_scene_of_16_members_killed_at_random_gives_the_grid_of_an_uninterrupted_sweep(
    tmp_path: Path,
) -> None:
    sixteen = (
        "drive.cycles=800",
        "--set",
        "vary.chain.mu_s=[0.6,0.7]",
        "--seeds",
        "8",
        "--out",
        "grid",
    )
    assert killed(tmp_path, *WORDS, *sixteen, kills=4, most=12) == {"grid"}
    varied = {"vary.chain.mu_s": ["0.6", "0.7"], "vary.run.seed": [*range(8)]}
    settings = {**varied, "drive.cycles": 800, "run.record": ["x_G", "slips"]}
    whole = sweep(load_scene(WORDS[1]).with_settings(settings))
    found = xr.load_dataset(tmp_path / "grid" / "sweep.nc", engine="h5netcdf")
    for name in {*whole} - {"file"}:  # a decimal of a command line is the same number
        assert found[name].identical(whole[name])
    left = {path.suffix for path in (tmp_path / "grid").rglob("*") if path.is_file()}
    assert left == {".nc"}
    assert len([*(tmp_path / "grid" / "cells").iterdir()]) == 16
