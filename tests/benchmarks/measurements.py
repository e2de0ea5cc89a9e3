"""What is timed, and how: processor time, in pairs, on the same rearrangements.

Clocks read the processor time of the measuring thread, so that other programs on the machine do not
count; contestants take turns, and ratios are formed within a turn. The exception is the speed-up
of two threads, which needs the clock on the wall: it is held against that of a loop that only
counts, in the same turns.
"""

from __future__ import annotations

import math
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
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from exactcreep.limits import Limits
from exactcreep.model.drive import Cycles
from exactcreep.model.state import State
from exactcreep.quasistatic.creep import creep
from exactcreep.solvers.registry import solver_named
from exactcreep.solvers.solver import Simulation
from tests.paper import paper_chain

CHECKOUT = pathlib.Path(__file__).parents[2]
SIZES = ((2, "0.01"), (6, "0.01"), (30, "0.005"), (60, "0.01"), (300, "0.05"))
"""Sliders and amplitudes of the paper's chains."""
TIME_STEPS = ("0.01", "0.1", "0.3")
C_VERLET = {
    2: (390e-6, 440e-6),
    6: (2700e-6, 2900e-6),
    30: (4600e-6, 5000e-6),
    60: (24500e-6, 26900e-6),
    300: (2.0, 2.0),
}
"""Seconds per half-cycle of a windowed velocity Verlet in C at dt = 0.01, lowest and highest, on
another machine with AVX-512: not measured here."""


def burned_in(n: int, amplitude: str, half_cycles: int, seed: int = 0) -> State:
    """Return the state at -A after an even number of half-cycles from the relaxed chain."""
    chain = paper_chain(n)
    simulation = solver_named("exact", {}).simulation(chain, State.relaxed(chain, seed), seed, ())
    simulation.follow(Cycles(amplitude, half_cycles), 1, half_cycles)
    return simulation.state()


@dataclass
class Contestant:
    """A compiled solver on its way along temperature cycles."""

    label: str
    simulation: Simulation
    drive: Cycles
    done: int = 0
    block: int = 2
    seconds: list[float] = field(default_factory=list)
    """Per half-cycle, one for each turn."""
    steps: int = 0
    stepping: float = 0.0

    def run(self, half_cycles: int) -> float:
        """Go on for so many half-cycles and return the processor time."""
        begin = time.thread_time()
        self.simulation.follow(self.drive, self.done + 1, half_cycles)
        self.done += half_cycles
        return time.thread_time() - begin

    def calibrate(self, seconds: float) -> None:
        """Choose the number of half-cycles of a turn, an even one."""
        while (took := self.run(self.block)) < seconds / 4:
            self.block *= 2
        self.block = max(2, 2 * round(self.block * seconds / took / 2))

    def take_turn(self) -> None:
        """Run one turn and keep what it took."""
        before = self.simulation.report().get("steps", 0)
        took = self.run(self.block)
        self.steps += self.simulation.report().get("steps", 0) - before
        self.stepping += took
        self.seconds.append(took / self.block)

    @property
    def per_step(self) -> float:
        """Seconds per Verlet step."""
        return self.stepping / self.steps if self.steps else math.nan


@dataclass
class HalfCycles:
    """Times per half-cycle at one size: medians over the turns."""

    n: int
    amplitude: str
    contestants: list[Contestant]

    def seconds(self, place: int) -> float:
        """Return the median time per half-cycle of a contestant; the first is exact."""
        return statistics.median(self.contestants[place].seconds)

    def ratios(self, place: int) -> list[float]:
        """Return the time of a contestant over that of exact, turn by turn."""
        exact, other = self.contestants[0].seconds, self.contestants[place].seconds
        return [b / a for a, b in zip(exact, other, strict=True)]

    def ratio(self, place: int) -> float:
        """Return the median of `ratios`."""
        return statistics.median(self.ratios(place))

    @property
    def c_ratio(self) -> float:
        """Time of the C Verlet, as stated, over that of exact, as measured."""
        return statistics.mean(C_VERLET[self.n]) / self.seconds(0)


def half_cycle_times(n: int, amplitude: str, *, turns: int, seconds: float) -> HalfCycles:
    """Return the times per half-cycle of exact and Verlet, each on its own run from one state."""
    chain = paper_chain(n)
    state = burned_in(n, amplitude, 2 if n > 100 else 10)
    drive = Cycles(amplitude, 10**9)
    contestants = []
    for dt in (None, *TIME_STEPS):
        solver = solver_named("verlet", {"dt": dt}) if dt else solver_named("exact", {})
        simulation = solver.simulation(chain, state, 0, ())
        simulation.follow(drive, 1, 1, Limits(20))  # compiles
        simulation = solver.simulation(chain, state, 0, ())
        label = f"Verlet, dt = {dt}" if dt else "exact"
        contestants.append(Contestant(label, simulation, drive))
    for one in contestants:
        if n <= 100:
            one.calibrate(seconds)
    for _ in range(turns):
        for one in contestants:
            one.take_turn()
    return HalfCycles(n, amplitude, contestants)


def long_chain_ratio(*, turns: int, half_cycles: int) -> tuple[float, float, float]:
    """Return seconds per event at N = 100 and at N = 10^5, and the median of their ratios.

    At A = 0.005 only the outer twenty sliders at either end ever move, in both chains.
    """
    runs = []
    for n in (100, 100_000):
        chain = paper_chain(n)
        simulation = solver_named("exact", {}).simulation(chain, State.relaxed(chain), 0, ())
        one = Contestant(str(n), simulation, Cycles("0.005", 10**9))
        one.run(10)
        runs.append(one)
    table: list[list[float]] = [[], []]
    for _ in range(turns):
        for one, row in zip(runs, table, strict=True):
            before = one.simulation.tally.events
            took = one.run(half_cycles)
            row.append(took / (one.simulation.tally.events - before))
    ratios = [b / a for a, b in zip(*table, strict=True)]
    return (*(statistics.median(row) for row in table), statistics.median(ratios))


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


def thread_speed_ups(*, turns: int, seconds: float) -> tuple[float, float, float]:
    """Return the speed-up of two threads: exact, a spinning loop, and the median of their ratios.

    Speed-up: the time of two jobs one after the other over that of both at once.
    """
    chain = paper_chain(30)
    drive = Cycles("0.005", 10**9)
    ensembles = []
    for seed in (1, 2):
        start = State.relaxed(chain, seed)
        simulation = solver_named("exact", {}).simulation(chain, start, seed, ())
        one = Contestant(str(seed), simulation, drive)
        one.calibrate(seconds)
        ensembles.append(one)
    block = min(one.block for one in ensembles)
    spins = 10**6
    _spin(10)
    while _wall([partial(_spin, spins)]) < seconds:
        spins *= 2
    exact_jobs = [partial(one.run, block) for one in ensembles]
    spin_jobs = [partial(_spin, spins)] * 2
    speed_ups: tuple[list[float], list[float]] = ([], [])
    for _ in range(turns):
        for jobs, found in zip((exact_jobs, spin_jobs), speed_ups, strict=True):
            alone = sum(_wall([job]) for job in jobs)
            found.append(alone / _wall(jobs))
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


@dataclass
class Velocity:
    """What a mean velocity costs at one size: exact, and Verlet at one time step.

    Attributes
    ----------
    mean, error : tuple of two floats
        Velocity and its standard error, exact and Verlet, from blocks of half-cycles of all chains.
    blocks : int
        How many; the relative uncertainty of a standard error is 1 / sqrt(2 blocks).
    seconds : tuple of two floats
        Processor time spent.
    time_ratio : float
        Time of Verlet over that of exact for the same half-cycles, median over the pairs.
    """

    n: int
    amplitude: str
    mean: tuple[float, float]
    error: tuple[float, float]
    blocks: int
    seconds: tuple[float, float]
    time_ratio: float

    @property
    def bias(self) -> float:
        """Verlet's velocity minus the exact one, in combined standard errors."""
        return (self.mean[1] - self.mean[0]) / math.hypot(*self.error)

    @property
    def cost_ratio(self) -> float:
        """Time of Verlet over that of exact for the same standard error."""
        costs = [t * e**2 for t, e in zip(self.seconds, self.error, strict=True)]
        return costs[1] / costs[0]

    @property
    def cost_ratio_error(self) -> float:
        """Standard error of `cost_ratio`."""
        return self.cost_ratio * 2.0 / math.sqrt(self.blocks)


_BLOCK = 10


def velocity_costs(
    n: int, amplitude: str, *, members: int, seconds: float, dt: str = "0.3"
) -> Velocity:
    """Return what the mean velocity costs with an ensemble of independent chains, by pairs."""
    chain = paper_chain(n)
    drive = Cycles(amplitude, 10**9)
    solvers = (solver_named("exact", {}), solver_named("verlet", {"dt": dt}))
    half_cycles = 0
    advances: tuple[list[float], list[float]] = ([], [])
    times: tuple[list[float], list[float]] = ([], [])
    for seed in range(1, members + 1):
        start = burned_in(n, amplitude, 20, seed)
        for solver, found, took in zip(solvers, advances, times, strict=True):
            simulation = solver.simulation(chain, start, seed, ())
            if half_cycles == 0:
                pilot = Contestant("", simulation, drive)
                pilot.calibrate(seconds / members)
                half_cycles = _BLOCK * max(1, round(pilot.block / _BLOCK))
                simulation = solver.simulation(chain, start, seed, ())
            simulation.follow(drive, 1, 2)
            begin = time.thread_time()
            stretch = simulation.follow(drive, 3, half_cycles + 1)
            took.append((time.thread_time() - begin) / (half_cycles + 1))
            found.extend(np.diff(stretch.recorded["x_G"][::_BLOCK]) / _BLOCK)
    blocks = len(advances[0])
    exact, verlet = (np.array(row) for row in advances)
    return Velocity(
        n,
        amplitude,
        (float(exact.mean()), float(verlet.mean())),
        (_standard_error(exact), _standard_error(verlet)),
        blocks,
        (sum(times[0]) * half_cycles, sum(times[1]) * half_cycles),
        statistics.median(b / a for a, b in zip(*times, strict=True)),
    )


def _standard_error(values: NDArray[np.float64]) -> float:
    return float(values.std(ddof=1)) / math.sqrt(values.size)
