"""Time a half-cycle of `exact` and of velocity Verlet in C, for the page on speed.

``python tests/benchmarks/half_cycles.py [SECONDS]`` needs a C compiler (``cc``) and some six
minutes of a quiet machine; SECONDS (0.25) is how long each contestant runs at least, in each of
three turns. It writes ``half-cycles.csv`` to ``notebooks/pictures``: microseconds of processor time
of one thread, contestants in turns, the least of the turns. Each contestant follows a run of its
own. Without disorder the members in lanes are all the same.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[2]))  # run as a script, not as a module

import pandas as pd

from exactcreep.laws.paper import threshold_amplitude
from exactcreep.model.drive import Cycles
from exactcreep.model.state import State
from exactcreep.solvers.registry import solver_named
from tests.paper import paper_chain

TURNS = 3
LENGTHS = (2, 3, 4, 6, 8, 10, 30, 60, 300)
LONG = (100, 300, 1000, 3000)
RIVALS = [("0.01", 1), ("0.1", 1), ("0.3", 1), ("0.3", 8)]
"""Time steps of Verlet, and the members in the lanes of a vector."""
FILE = Path(__file__).parents[2] / "notebooks" / "pictures" / "half-cycles.csv"


def amplitudes(n: int) -> dict[str, str]:
    """Return the two amplitudes of cycles of a chain, by what they are called."""
    law = threshold_amplitude(n=n, l0=1000, mu_d=0.5, tan_alpha=0.25)
    return {"0.01": "0.01", "1.37 Eq. 22": f"{1.37 * float(law):.8f}"}


class Exact:
    """The compiled solver on its way along cycles."""

    def __init__(self, n: int, amplitude: str, sigma: str) -> None:
        chain = paper_chain(n, sigma)
        self.simulation: Any = solver_named("exact", {}).simulation(
            chain, State.relaxed(chain, 1), 1, ()
        )
        self.drive, self.done = Cycles(amplitude, 10**9), 0

    def run(self, seconds: float, least: int = 2) -> tuple[float, float]:
        """Go on for so long; return microseconds per half-cycle and nanoseconds per event."""
        before, begin, count, stretch = self.simulation.events, time.thread_time(), 0, least
        while count < least or time.thread_time() - begin < seconds:
            self.simulation.follow(self.drive, self.done + 1, stretch)
            self.done, count = self.done + stretch, count + stretch
            stretch = min(2 * stretch, 2000)
        spent = time.thread_time() - begin
        return 1e6 * spent / count, 1e9 * spent / max(self.simulation.events - before, 1)


def in_c(folder: str, members: int) -> Callable[..., float]:
    """Compile `verlet.c`; return what tells the microseconds of a half-cycle of one member."""
    program, source = f"{folder}/verlet{members}", str(Path(__file__).with_name("verlet.c"))
    flags = ("-O3", "-march=native", f"-DLANES={members}", "-o", program)
    subprocess.run(["cc", *flags, source, "-lm"], check=True)

    def time_of(n: int, amplitude: str, step: str, sigma: str, seconds: float) -> float:
        words = [program, str(n), str(1000 * float(amplitude)), step, sigma]
        spent, count = 0.0, 1
        while 1e-6 * spent * count < seconds and count < 10**6:  # a run that fails has no time
            count *= 2
            done = subprocess.run([*words, str(count), "4", "1"], capture_output=True, check=True)
            spent = float(done.stdout.split()[0])
        return spent

    return time_of


def half_cycles(folder: str, seconds: float) -> Iterator[dict[str, Any]]:
    """Yield a row for each chain, amplitude and disorder."""
    programs = {members: in_c(folder, members) for members in (1, 8)}
    for n in LENGTHS:
        for name, amplitude in amplitudes(n).items():
            for sigma in ("0.01", "0"):
                exact = Exact(n, amplitude, sigma)
                exact.run(0.0, 10 if n < 60 else 4)
                if exact.simulation.events == 0:
                    continue  # nothing ever moves
                turns = []
                for _ in range(1 if n == 300 else TURNS):
                    times = {"exact": exact.run(seconds)[0]}
                    for step, members in RIVALS:
                        lanes = ", eight members in lanes" if members == 8 else ""
                        took = programs[members](n, amplitude, step, sigma, seconds)
                        times[f"Verlet in C, dt = {step}{lanes}"] = took
                    turns.append(times)
                row = {"n": n, "amplitude": name, "sigma_mu": sigma} | {**pd.DataFrame(turns).min()}
                print(row, flush=True)
                yield row


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as place:
        rows = [*half_cycles(place, float(sys.argv[1]) if len(sys.argv) > 1 else 0.25)]
    pd.DataFrame(rows).to_csv(FILE, index=False, float_format="%.3g")
    for size in LONG:
        chain = Exact(size, amplitudes(size)["1.37 Eq. 22"], "0.01")
        chain.run(0.0)
        least = min(chain.run(0.0)[1] for _ in range(TURNS))
        print(f"N = {size}: {least:.0f} ns per event")
