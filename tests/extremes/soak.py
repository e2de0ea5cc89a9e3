"""Random scenes under random faults: nothing is lost, no bit is wrong, nothing is left running.

For a night: ``python -m tests.extremes.soak --seconds 28800``. It prints how many cases of each
fault it tried, how often the fault struck, and every case that did not hold.
"""

from __future__ import annotations

import argparse
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from exactcreep import Creep
from exactcreep.quasistatic.result import load_members
from tests.processes import PATIENCE, PROGRAM, environment

JUMPS = """
import random, time
moments, true = random.Random({seed}), time.time
time.time = lambda: true() + moments.uniform(-1e8, 1e8)
from exactcreep.cli import main
main()
"""
BUSY = "import time\nend = time.monotonic() + 6\nwhile time.monotonic() < end: pass"
STATUS = {
    "kill": {0, -signal.SIGKILL},
    "term": {0, 143, -signal.SIGTERM},  # the last while it is imported
    "full disk": {0, 2, 4},
    "read-only": {2},
    "clock": {0},
    "load": {0, 3},
    "memory": {0, 2, 3, 4, 128 + signal.SIGABRT},
}
"""The exit statuses that a program may leave with under each fault."""
UNHARMED = ("kill", "term", "clock", "load")
"""The faults that no result is lost by; the others are mounted, or take memory away."""


def bits(result: Creep) -> dict[str, object]:
    """Return all that a result holds except how long it took."""
    about = {k: repr(v) for k, v in result.dataset.attrs.items() if k != "seconds"}
    values = {str(k): v.to_numpy().tobytes() for k, v in result.dataset.variables.items()}
    return about | values


def scene_of(moments: random.Random) -> list[str]:
    """Return the words that run a random scene."""
    n = moments.choice([2, 3, 6, 12])
    settings = {
        "chain.n": n,
        "chain.sigma_mu": moments.choice([0, 0.01]),
        "chain.tan_alpha": round(moments.uniform(0.05, 0.45), 3),
        "drive.amplitude": round(moments.uniform(0.002, 0.02), 4),
        "drive.cycles": moments.randrange(2000, 6000) // n**2 + 20,
        "run.seed": moments.randrange(10**6),
    }
    if moments.random() < 0.3:
        settings["vary.chain.l0"] = "[900, 1000, 1100]"
    words = ["run", "six-sliders-cycles", "--json"]
    for key, value in settings.items():
        words += ["--set", f"{key}={value}"]
    return [*words, "--record", moments.choice(["x_G", "x_G,tension", "x_G,slips"])]


class Case:
    """One scene under one fault, in a folder of its own."""

    def __init__(self, seed: int, fault: str, folder: Path) -> None:
        self.moments, self.fault, self.folder = random.Random(seed), fault, folder
        self.seed, self.struck, self.wrong = seed, 0, ""
        self.words = scene_of(self.moments)

    def begun(self, *words: str) -> subprocess.Popen[str]:
        return subprocess.Popen(
            words, cwd=self.folder, env=environment(), text=True, start_new_session=True,
            stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        )  # fmt: skip

    def ended(self, process: subprocess.Popen[str]) -> int:
        """Return the status of a process, and note what it should not have done."""
        try:
            told = process.communicate(timeout=PATIENCE)[1]
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            told = process.communicate()[1]
            self.note("it hung")
        status = process.returncode
        if status not in STATUS[self.fault]:
            self.note(f"status {status}: {told[-300:]}")
        if "Traceback" in told or "defect" in told:
            self.note(told[-600:])
        try:
            os.killpg(process.pid, 0)
        except ProcessLookupError:
            pass
        else:
            self.note("it has left a process behind")
        return status

    def note(self, what: str) -> None:
        self.wrong = self.wrong or what

    def interrupted(self) -> None:
        """Kill, or end, the program again and again, and let it resume until it has finished."""
        files = ("--checkpoint", "run.ckpt", "--every", "0.05")
        for attempt in range(40):
            known = (self.folder / "run.ckpt").exists()
            out = ("--out", "run.nc", "--force")
            words = ("resume", "run.ckpt", "--every", "0.05") if known else (*self.words, *files)
            process = self.begun(*PROGRAM, *words, *out)
            if attempt < 3:
                end = time.monotonic() + self.moments.uniform(0.5, 6)
                while process.poll() is None and time.monotonic() < end:
                    time.sleep(0.02)
                if process.poll() is None:
                    self.struck += 1
                    number = signal.SIGKILL if self.fault == "kill" else signal.SIGTERM
                    process.send_signal(number)
            if self.ended(process) == 0:
                return
            if self.wrong:
                return
        self.note("it never came to its end")

    def run(self) -> None:
        """Run the scene under its fault, and compare what there is with an undisturbed run."""
        if self.fault in ("kill", "term"):
            self.interrupted()
        elif self.fault == "clock":
            jumping = (sys.executable, "-c", JUMPS.format(seed=self.seed))
            files = ("--out", "run.nc", "--checkpoint", "run.ckpt", "--every", "0.05")
            self.ended(self.begun(*jumping, *self.words, *files))
            self.struck += 1
        elif self.fault == "load":
            busy = [self.begun(sys.executable, "-c", BUSY) for _ in range(8)]
            files = ("--out", "run.nc", "--checkpoint", "run.ckpt", "--every", "0.05")
            limit = ("--max-seconds", str(self.moments.choice([0.1, 1, 1000])))
            status = self.ended(self.begun(*PROGRAM, *self.words, *files, *limit))
            self.struck += status == 3
            if status == 3:  # too slow: what is left of it is computed now
                resumed = ("resume", "run.ckpt", "--out", "run.nc", "--force")
                self.ended(self.begun(*PROGRAM, *resumed))
            for process in busy:
                process.communicate()
        else:
            where, size = "small", self.moments.randrange(8, 200)
            before, after = f"mount -t tmpfs -o size={size}k none small", "exit $?"
            if self.fault == "full disk":
                after = "s=$?; cp small/*.nc . 2>/dev/null; exit $s"
            elif self.fault == "read-only":
                before = "mount -t tmpfs -o ro none small"
            else:
                # with less than that LLVM and OpenBLAS, as they are loaded, never end
                where, least = ".", self.moments.randrange(500_000, 900_000)
                before = f"export OPENBLAS_NUM_THREADS=1; ulimit -v {least}"
            (self.folder / "small").mkdir()
            files = ("--out", f"{where}/run.nc", "--checkpoint", f"{where}/run.ckpt")
            shell = f'{before} && "$@"; {after}'
            line = (*PROGRAM, *self.words, *files, "--every", "0.05")
            process = self.begun("unshare", "-m", "sh", "-c", shell, "sh", *line)
            self.struck += self.ended(process) != 0
        found = self.folder / "run.nc"
        if found.exists() and not self.wrong:
            whole = self.begun(*PROGRAM, *self.words, "--out", "whole.nc")
            whole.communicate(timeout=PATIENCE)
            pairs = zip(load_members(found), load_members(self.folder / "whole.nc"), strict=True)
            if any(bits(one) != bits(other) for one, other in pairs):
                self.note("other bits than an undisturbed run")
        elif self.fault in UNHARMED and not self.wrong:
            self.note("the result is lost")
        known = {"run.nc", "whole.nc", "run.ckpt", "small"}
        left = {path.name for path in self.folder.iterdir() if path.name not in known}
        if self.fault != "memory" and any(not name.startswith(".") for name in left):
            self.note(f"it has left {sorted(left)}")


def soak(seconds: float, seed: int = 0, faults: tuple[str, ...] = tuple(STATUS)) -> list[str]:
    """Return what did not hold in so many seconds of cases; print their counts."""
    if os.geteuid() != 0 or shutil.which("unshare") is None:
        # the others mount, which only root may
        faults = tuple(one for one in faults if one in UNHARMED)
    end, tried, struck = time.monotonic() + seconds, Counter[str](), Counter[str]()
    wrong: list[str] = []
    while time.monotonic() < end:
        fault = faults[seed % len(faults)]
        with tempfile.TemporaryDirectory() as name:
            case = Case(seed, fault, Path(name))
            case.run()
        tried[fault] += 1
        struck[fault] += case.struck
        if case.wrong:
            wrong.append(f"seed {seed}, {fault}: {' '.join(case.words)}: {case.wrong}")
            print(wrong[-1], flush=True)
        seed += 1
    for fault in tried:
        print(f"{fault:10} {tried[fault]:5} cases, struck {struck[fault]:5} times")
    print(f"{sum(tried.values())} cases, {len(wrong)} did not hold")
    return wrong


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=900)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--faults", nargs="+", default=list(STATUS), choices=list(STATUS))
    given = parser.parse_args()
    sys.exit(bool(soak(given.seconds, given.seed, tuple(given.faults))))
