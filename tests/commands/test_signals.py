"""A signal at any stage of any command: it ends soon, says so, and leaves nothing half done.

How soon is not measured here, where machines are busy: what was left undone is.
"""

from __future__ import annotations

import json
import os
import signal
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.processes import finished

# One process compiles and imports; each attempt is a fork of it. The signal comes within a call
# that every command makes at this stage, however fast the machine is.
_PRESSED = """
import json, os, signal, sys

from exactcreep import cli
from exactcreep.watch import interrupts

cases, folder = json.loads(sys.argv[1]), sys.argv[2]
os.chdir(folder)
signal.signal(signal.SIGINT, signal.default_int_handler)
for line in {line for _, stage, line in cases if stage == "drawing"}:  # compiled and imported here
    cli.status([*line.replace("a.", "warm.").replace("--out a ", "--out warm ").split(), "--force"])


def attempt(number, stage, line, name):
    os.mkdir(name)
    os.chdir(name)
    for channel, descriptor in (("out", 1), ("err", 2)):
        os.dup2(os.open(channel, os.O_WRONLY | os.O_CREAT), descriptor)
    left = {"pressed": 0, "begun": 0}  # tasks, inner runs and files begun after the signal

    def hooked(owner, called, counted=True, first=False):
        honest = getattr(owner, called)

        def call(*given, **more):
            if left["pressed"]:
                left["begun"] += counted and interrupts.status() is not None  # once it is heard
            elif first:
                left["pressed"] = 1
                os.kill(os.getpid(), number)
            return honest(*given, **more)

        setattr(owner, called, call)

    from concurrent.futures import ThreadPoolExecutor

    from matplotlib.figure import Figure

    from exactcreep.quasistatic.observed_run import ObservedRun
    from exactcreep.solvers.exact.settling import SettlingChain
    from exactcreep.studies.fates import proof
    from exactcreep.watch.display import Display

    hooked(Display, "show", counted=False, first=stage == "task")
    hooked(ThreadPoolExecutor, "submit", first=False)
    hooked(ObservedRun, "__init__", counted=True)
    hooked(ObservedRun, "advance", counted=False, first=stage == "inner")
    hooked(SettlingChain, "follow", counted=True, first=stage == "inner")
    hooked(proof, "proved_fate", counted=True, first=stage == "inner")
    hooked(os, "fsync", counted=False, first=stage == "writing")
    hooked(Figure, "savefig", counted=False, first=stage == "drawing")
    sys.argv[1:] = line.split()
    try:
        cli.main()
    except SystemExit as leaving:
        code = int(leaving.code or 0)
    sys.stdout.flush()
    with open("told", "w") as told:
        json.dump({"code": code, **left}, told)
    os._exit(0)


for k, (number, stage, line) in enumerate(cases):
    child = os.fork()
    if child == 0:
        attempt(number, stage, line, str(k))
    assert os.waitpid(child, 0)[1] == 0, (number, stage, line)
"""
FILES = "--out a.nc --plot a.png"
LINES = {
    "run": f"run two-sliders-cycles --set drive.cycles=20 {FILES}",
    "sweep": "sweep two-sliders-cycles --set drive.cycles=20 --set vary.run.seed=[1,2,3,4,5,6,7,8]"
    " --set vary.drive.amplitude=[0.002,0.003] --workers 1 --out a --plot a.png",
    "survival": f"survival --n 3 --amplitude 0.0005 --cycles 50 --starts 200 --workers 1 {FILES}",
    "intercept": f"intercept --n 6 --sigma-mu 0.01 --cycles 100 --fit 1.3 2 {FILES}",
    "threshold": f"threshold --n 2 --digits 9 {FILES}",
    "fate": "fate --n 2 --amplitude 0.0004 --plot a.png",
    "compare": f"compare two-sliders-cycles --events 20 --seeds 1 {FILES}",
    "plan": "plan two-sliders-cycles",
    "reproduce": "reproduce two-sliders-trace --quick --workers 1 --out a",
}
STAGES = {
    "task": [*LINES],
    "inner": ["run", "sweep", "survival", "intercept", "threshold", "fate", "plan"],
    "writing": ["run", "survival", "intercept", "threshold", "compare"],
    "drawing": ["run", "sweep", "survival", "intercept", "threshold", "fate"],
}
CASES = [
    (int((signal.SIGINT, signal.SIGTERM)[place % 2]), stage, name)
    for stage, names in STAGES.items()
    for place, name in enumerate(names)
]
QUICK = [case for case in CASES if case[2] in ("survival", "intercept")]
ASKING = ("survival", "intercept", "threshold", "fate")
"""Commands that tell what is known whenever they are stopped."""
BEGUN = 6
"""Tasks and runs that may begin after the signal: those which threads had been given."""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
@pytest.mark.usefixtures("hears_ctrl_c")
@pytest.mark.parametrize("cases", [QUICK, pytest.param(CASES, marks=pytest.mark.slow)])
def test_a_signal_at_any_stage_ends_a_command_that_says_so_and_begins_nothing_more(
    cases: list[tuple[int, str, str]], tmp_path: Path
) -> None:
    lines = [(number, stage, LINES[name]) for number, stage, name in cases]
    done = finished(sys.executable, "-c", _PRESSED, json.dumps(lines), str(tmp_path))
    assert done.returncode == 0, done.stderr
    for k, (number, stage, name) in enumerate(cases):
        folder, what = tmp_path / str(k), f"{name} at {stage}"
        told: dict[str, Any] = json.loads((folder / "told").read_text())
        err = (folder / "err").read_text()
        assert told["pressed"] == 1, what
        assert told["code"] == 128 + number, (what, err)
        assert "exactcreep: interrupted" in err, (what, err)
        assert "Traceback" not in err, (what, err)
        assert told["begun"] <= BEGUN, (what, told)
        left = {path.name for path in folder.rglob("*") if path.is_file()}
        assert not [each for each in left if each.endswith(".part")], (what, left)
        asking = name in ASKING and (name, stage) != ("survival", "task")  # before its first start
        if stage in ("writing", "drawing") or asking:  # what was computed is told
            assert (folder / "out").read_text(), what
        if stage in ("writing", "drawing"):
            assert "a.png" not in left, what
            assert (stage == "writing") == ("a.nc" not in left) or name in ("fate", "sweep"), what
