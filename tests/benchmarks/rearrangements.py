"""Time and error of single rearrangements, by every method, against the certified solver."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exactcreep.limits import Limits
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Path
from exactcreep.model.state import State
from exactcreep.solvers.registry import rearrange, solver_named
from exactcreep.solvers.solver import Rearrangement
from tests.benchmarks.measurements import burned_in
from tests.benchmarks.rivals import Failed, Heyoka, Task, with_scipy
from tests.paper import paper_chain

LADDER = ("0.1", "0.03", "0.01", "0.003", "0.001", "0.0001", "0.00001")
"""Verlet's time steps for single rearrangements; the last one without locating events only."""
TOLERANCES = (1e-6, 1e-9, 1e-12)
TAYLOR_TOLERANCES = (1e-6, 1e-9, 2.0**-52)
SAMPLES = {2: 200, 6: 150, 30: 80}
_STRETCH = {2: 50}  # a slip of two sliders takes less than a call from Python: follow more of them


@dataclass
class Method:
    """A way to compute a rearrangement, what it costs, and how far off it is.

    Attributes
    ----------
    family, setting : str
    seconds : float
        Processor time per rearrangement.
    errors : ndarray
        Largest position error at the end of each rearrangement, against the certified solver;
        inf where other sliders moved, or in another order.
    """

    family: str
    setting: str
    seconds: float
    errors: NDArray[np.float64]

    @property
    def label(self) -> str:
        return f"{self.family}, {self.setting}" if self.setting else self.family

    @property
    def wrong(self) -> float:
        """The fraction of rearrangements with wrong events."""
        return float(np.isinf(self.errors).mean())

    def quantile(self, share: float) -> float:
        """Return the error that so large a share of the rearrangements does not exceed."""
        return float(np.sort(self.errors)[math.ceil(share * self.errors.size) - 1])


@dataclass
class Rearrangements:
    """The same rearrangements by every method."""

    n: int
    amplitude: str
    events: int
    methods: list[Method]

    def family(self, name: str) -> list[Method]:
        """Return the methods of a family, cheapest first."""
        return sorted((m for m in self.methods if m.family == name), key=lambda m: m.seconds)

    def seconds_at(self, name: str, error: float, share: float = 0.9) -> tuple[float, str]:
        """Return the time at which a family keeps `share` of the errors below `error`.

        Between two settings the logarithms are interpolated; beyond the finest that was run the
        slope of the last two is followed, and the word says so.
        """
        points = [(m.quantile(share), m.seconds) for m in self.family(name)]
        known = [(e, s) for e, s in points if 0 < e < math.inf]
        enough = [s for e, s in points if e <= error]
        if not known:
            return math.nan, "never"
        # among the settings: the cheapest that is good enough, then what lies before it
        coarse = [(e, s) for e, s in known if e > error]
        if not enough:
            (e1, s1), (e2, s2) = known[-2:]
            slope = math.log(s2 / s1) / math.log(e1 / e2)
            return s2 * (e2 / error) ** slope, "extrapolated"
        best = min(enough)
        if not coarse:
            return best, "coarsest setting"
        e1, s1 = coarse[-1]
        e2, s2 = next((e, s) for e, s in points if s == best)
        if e2 <= 0 or s2 <= s1:
            return best, "measured"
        slope = math.log(s2 / s1) / math.log(e1 / e2)
        return s1 * (e1 / error) ** slope, "interpolated"


def _chain_of_rearrangements(
    chain: Chain, state: State, count: int
) -> tuple[list[State], list[Rearrangement], Fraction]:
    """Return rest states, the certified rearrangements from them, and a dilation after the last.

    The displacements of every rest state are set to zero: errors are not to be hidden below the
    spacing of floats at a chain that has travelled far.
    """
    states, known = [], []
    while len(known) <= count:
        state = replace(state, displacements=np.zeros(chain.n))
        states.append(state)
        known.append(rearrange(chain, state, direction=1, solver="certified", digits=25))
        state = rearrange(chain, state, direction=1).state
    thetas = [Fraction(float(one.theta)) for one in known[-2:]]
    return states[:-1], known[:-1], sum(thetas) / 2


def _moved(result: Rearrangement) -> NDArray[np.float64]:
    return np.array([float(x) for x in result.state.displacements.tolist()])


def _wandering(
    family: str,
    setting: str,
    chain: Chain,
    states: Sequence[State],
    known: Sequence[Rearrangement],
    end: Fraction,
    least: float,
) -> Method:
    """Measure a compiled solver: time along the whole stretch, errors from every rest state."""
    options: dict[str, Any] = {}
    if setting:
        options = {"dt": setting.removeprefix("dt = "), "locate": family.endswith("located")}
    solver = solver_named("verlet" if options else "exact", options)
    simulation = solver.simulation(chain, states[0], 0, ())
    path = Path([end])
    simulation.follow(path, 1, 1, Limits(50))  # compiles
    times = []
    while sum(times) < least or len(times) < 3:
        simulation = solver.simulation(chain, states[0], 0, ())
        begin = time.thread_time()
        simulation.follow(path, 1, 1)
        times.append(time.thread_time() - begin)
        if sum(times) > 20 * least:
            break
    seconds = statistics.median(times) / simulation.tally.rearrangements
    errors = []
    for state, truth in zip(states, known, strict=True):
        found = solver.rearrange(chain, state, 1, 0)
        right = found.itinerary == truth.itinerary
        errors.append(float(np.abs(_moved(found) - _moved(truth)).max()) if right else math.inf)
    return Method(family, setting, seconds, np.array(errors))


def _rival(
    family: str,
    setting: str,
    rearranged: Callable[[Task], Any],
    tasks: Sequence[Task],
    known: Sequence[Rearrangement],
) -> Method:
    """Measure a general-purpose integrator, one rearrangement at a time."""
    rearranged(tasks[0])
    errors, spent = [], 0.0
    for task, truth in zip(tasks, known, strict=True):
        begin = time.thread_time()
        try:
            course = rearranged(task)
        except Failed:
            course = None
        spent += time.thread_time() - begin
        if course is not None and tuple(course.itinerary) == truth.itinerary:
            errors.append(float(np.abs(course.moved - _moved(truth)).max()))
        else:
            errors.append(math.inf)
    return Method(family, setting, spent / len(tasks), np.array(errors))


def rearrangement_costs(
    n: int, amplitude: str, *, count: int, ladder: Sequence[str] = LADDER, least: float = 0.2
) -> Rearrangements:
    """Return time and error per rearrangement of every method, from the same rest states.

    The rest states are successive ones from theta = 0 on the way up, after ten half-cycles. A
    compiled solver is timed along the whole stretch, without Python in between, and compared from
    each rest state; the rivals are timed and compared from each rest state.
    """
    chain = paper_chain(n)
    middle = solver_named("exact", {}).simulation(chain, burned_in(n, amplitude, 10), 0, ())
    middle.follow(Path([0]), 1, 1)
    states, known, end = _chain_of_rearrangements(chain, middle.state(), count)
    begin = Fraction(float(states[0].theta))
    stretch = begin + (end - begin) * _STRETCH.get(n, 1)
    methods = [_wandering("exact", "", chain, states, known, stretch, least)]
    located = [dt for dt in ladder if Fraction(dt) >= Fraction(1, 10_000)]
    for family in ("Verlet", "Verlet, located"):
        for dt in ladder if family == "Verlet" else located:
            setting = f"dt = {dt}"
            last = end if Fraction(dt) < Fraction(1, 1000) else stretch
            methods.append(_wandering(family, setting, chain, states, known, last, least))
    tasks = [Task.of(chain, truth.initial, truth.itinerary, 0, ahead=16) for truth in known]
    for rtol in TOLERANCES:
        methods.append(
            _rival("SciPy", f"rtol = {rtol:.0e}", partial(with_scipy, rtol=rtol), tasks, known)
        )
    for tol in TAYLOR_TOLERANCES:
        heyoka = Heyoka(n, tol)
        methods.append(_rival("heyoka", f"tol = {tol:.0e}", heyoka.rearrange, tasks, known))
    events = sum(len(one.events) for one in known)
    return Rearrangements(n, amplitude, events, methods)
