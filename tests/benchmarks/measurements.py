"""What `compare` does not measure: long chains, threads, long runs and the first start.

Clocks read the processor time of the measuring thread, so that other programs on the machine do not
count, and ratios are formed turn by turn. The exception is the speed-up of two threads, which needs
the clock on the wall: it is held against that of a loop that only counts, in the same turns.
"""

from __future__ import annotations

import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import threading
import time
import tracemalloc
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from numba import njit

from exactcreep.model.drive import Cycles
from exactcreep.model.state import State
from exactcreep.quasistatic.creep import creep
from exactcreep.solvers.registry import solver_named
from tests.paper import paper_chain

CHECKOUT = pathlib.Path(__file__).parents[2]
AMPLITUDE = "0.005"


class Running:
    """The compiled solver on its way along temperature cycles of one of the paper's chains."""

    def __init__(self, n: int, seed: int = 0) -> None:
        start = State.relaxed(paper_chain(n), seed)
        self.simulation = solver_named("exact", {}).simulation(paper_chain(n), start, seed, ())
        self.drive, self.done = Cycles(AMPLITUDE, 10**9), 0

    def run(self, half_cycles: int) -> tuple[float, int]:
        """Go on for so many half-cycles and return the processor time and the events."""
        begin, events = time.thread_time(), self.simulation.tally.events
        self.simulation.follow(self.drive, self.done + 1, half_cycles)
        self.done += half_cycles
        return time.thread_time() - begin, self.simulation.tally.events - events


def long_chain_ratio(*, turns: int, half_cycles: int) -> float:
    """Return the time of an event at N = 10^5 over that at N = 100, median of pairs.

    At A = 0.005 only the outer twenty sliders at either end ever move, in both chains.
    """
    runs = [Running(n) for n in (100, 100_000)]
    for running in runs:
        running.run(10)
    ratios = []
    for _ in range(turns):
        short, long = (took / events for took, events in (r.run(half_cycles) for r in runs))
        ratios.append(long / short)
    return statistics.median(ratios)


@njit(nogil=True)
def _spin(turns):
    x = 1
    for _ in range(turns):
        x = (x * 1664525 + 1013904223) & 0xFFFFFFFF
    return x


def _wall(jobs: Sequence[Callable[[], Any]]) -> float:
    """Return how long it takes to run all jobs, each in a thread of its own."""
    threads = [threading.Thread(target=job) for job in jobs]
    begin = time.perf_counter()
    for one in threads:
        one.start()
    for one in threads:
        one.join()
    return time.perf_counter() - begin


def thread_speed_ups(*, turns: int, half_cycles: int) -> tuple[float, float, float]:
    """Return the speed-up of two threads: exact, a spinning loop, and the median of their ratios.

    Speed-up: the time of two jobs one after the other over that of both at once.
    """
    ensembles = [Running(30, seed) for seed in (1, 2)]
    for running in ensembles:
        running.run(10)
    spins = 10**6
    _spin(10)
    while _wall([partial(_spin, spins)]) < 0.1:
        spins *= 2
    jobs = [partial(running.run, half_cycles) for running in ensembles], [partial(_spin, spins)] * 2
    speed_ups: tuple[list[float], list[float]] = ([], [])
    for _ in range(turns):
        for pair, found in zip(jobs, speed_ups, strict=True):
            alone = sum(_wall([job]) for job in pair)
            found.append(alone / _wall(pair))
    ratio = statistics.median(a / b for a, b in zip(*speed_ups, strict=True))
    return statistics.median(speed_ups[0]), statistics.median(speed_ups[1]), ratio


def long_run_memory(half_cycles: int) -> tuple[float, int, int]:
    """Return seconds for so many half-cycles of N = 2, and the peak bytes of that and of 1000."""
    chain = paper_chain(2)
    creep(chain, Cycles("0.01", 4), record=())
    peaks = []
    took = 0.0
    for count in (1000, half_cycles):
        tracemalloc.start()
        begin = time.thread_time()
        creep(chain, Cycles("0.01", count // 2), record=())
        took = time.thread_time() - begin
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    return took, peaks[1], peaks[0]


def start_up_seconds() -> tuple[float, float]:
    """Return the processor time of a short `exactcreep run`: with compilation, and afterwards."""
    spent = []
    with tempfile.TemporaryDirectory() as cache:
        words = ["run", "six-sliders-cycles", "--set", "drive.cycles=2", "--json"]
        code = "import sys; from exactcreep.cli import main; sys.exit(main())"
        for _ in range(2):
            before = os.times()
            subprocess.run(
                [sys.executable, "-c", code, *words],
                env=os.environ | {"NUMBA_CACHE_DIR": cache},
                cwd=CHECKOUT,
                stdout=subprocess.DEVNULL,
                check=True,
                timeout=300,
            )
            after = os.times()
            spent.append(
                after.children_user + after.children_system
                - before.children_user - before.children_system
            )  # fmt: skip
    return spent[0], spent[1]
