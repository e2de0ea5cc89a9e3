"""Timings against what a user would pick instead: ``pytest -m benchmark tests/benchmarks``.

What `compare` does not measure stands here: long chains, threads, long runs and the first start.
Clocks read the processor time of the measuring thread, so that other programs on the machine do not
count, and ratios are formed turn by turn. The exception is the speed-up of two threads, which needs
the clock on the wall: it is held against that of a loop that only counts, in the same turns.
"""

from __future__ import annotations

import json
import os
import statistics
import time
import tracemalloc
from pathlib import Path

import pytest

from exactcreep.model.drive import Cycles
from exactcreep.model.state import State
from exactcreep.quasistatic.creep import creep
from exactcreep.solvers.registry import solver_named
from exactcreep.studies.comparison import table
from tests.benchmarks.run import AMPLITUDES, contest
from tests.paper import paper_chain
from tests.processes import PROGRAM, finished

FASTER = {2: 15.0, 6: 2.0, 30: 2.0}
"""Than our own Verlet at dt = 0.01: what must not be lost, not what was reached."""
SHORT = ("run", "six-sliders-cycles", "--set", "drive.cycles=2", "--json")


def test_integrators_that_know_nothing_of_us_make_the_certified_events() -> None:
    """Written independently, SciPy (and heyoka) take the same turns to the same places."""
    rows = table(contest(6, seeds=1, events=60))
    for name, row in rows.iterrows():
        if not str(name).startswith("verlet"):
            assert row.parted == 0, name
            assert row.error < 1e-6, name
    assert rows.error["exact"] < 1e-12 < rows.error["scipy"]


@pytest.mark.benchmark
@pytest.mark.parametrize("size", AMPLITUDES)
def test_exact_is_faster_than_everything_else(size: int) -> None:
    rows = table(contest(size, seeds=2, events=200))
    print(rows.to_string())
    assert rows.ratio["verlet, dt = 0.01"] >= FASTER[size]
    assert (rows.ratio[rows.index.str.startswith(("scipy", "heyoka"))] > 20).all()


class Running:
    """The compiled solver on its way along temperature cycles of one of the paper's chains."""

    def __init__(self, n: int, seed: int = 0) -> None:
        start = State.relaxed(paper_chain(n), seed)
        self.simulation = solver_named("exact", {}).simulation(paper_chain(n), start, seed, ())
        self.drive, self.done = Cycles("0.005", 10**9), 0
        self.run(10)

    def run(self, half_cycles: int) -> float:
        """Go on for so many half-cycles and return the processor time of an event."""
        begin, events = time.thread_time(), self.simulation.tally.events
        self.simulation.follow(self.drive, self.done + 1, half_cycles)
        self.done += half_cycles
        return (time.thread_time() - begin) / (self.simulation.tally.events - events)


@pytest.mark.benchmark
def test_an_event_costs_the_same_in_a_chain_a_thousand_times_longer() -> None:
    """At A = 0.005 only the outer twenty sliders at either end ever move, in both chains."""
    short, long = (Running(n) for n in (100, 100_000))
    assert statistics.median(long.run(40) / short.run(40) for _ in range(9)) <= 1.5


@pytest.mark.benchmark
def test_a_million_half_cycles_take_no_more_memory_than_ten_thousand() -> None:
    chain, peaks = paper_chain(2), []
    creep(chain, Cycles("0.01", 4), record=())
    for half_cycles in (10**4, 10**6):
        tracemalloc.start()
        creep(chain, Cycles("0.01", half_cycles // 2), record=())
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < min(2**20, peaks[0] + 10**6)


@pytest.mark.benchmark
def test_the_kernel_is_compiled_within_40_s_once(tmp_path: Path) -> None:
    spent = []
    for _ in range(2):
        before = os.times()
        done = finished(*PROGRAM, *SHORT, NUMBA_CACHE_DIR=str(tmp_path))
        after = os.times()
        assert json.loads(done.stdout)["half_cycles"] == 4
        spent.append(sum(after[2:4]) - sum(before[2:4]))  # of children
    assert spent[0] < 40
    assert spent[1] < spent[0] / 3
