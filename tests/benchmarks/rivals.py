"""A general-purpose integrator as a solver, written as its users would write it.

Between two events the sliders that move obey Eqs. 5-7; the contact rules
switch from one set of movers to the next. SciPy integrates the movers with its own event
detection (a velocity reaches zero, a neighbour reaches its threshold), stops at the event, and goes
on with the new set. Nothing of `exactcreep.motion` is used. `registered` makes it a method of
`compare`: ``solver="scipy"`` with the option ``rtol``.
"""

from __future__ import annotations

import math
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from typing import ClassVar

import numpy as np
from scipy.integrate import solve_ivp

from exactcreep.model.contacts import Contacts, Event, EventKind
from exactcreep.model.state import State
from exactcreep.solvers.avalanche_table import AvalancheLog
from exactcreep.solvers.interface import Simulation, Solver, Stretch, Tally
from exactcreep.solvers.registry import SOLVERS
from exactcreep.solvers.tables import record_arrays, rows_of
from exactcreep.watch.limits import NO_LIMITS, Stop

LONGEST = 1000.0
"""Time within which a chain in motion has an event."""


class Motion:
    """A chain in motion at theta_c: forces at the start of each slider, friction and thresholds."""

    def __init__(self, pulls, friction, thresholds):
        self.pulls, self.friction, self.thresholds = pulls, friction, thresholds
        self.n, self.time, self.events = pulls.size, 0.0, []
        self.x, self.v, self.sign = np.zeros((3, self.n))

    def forces(self, x):
        """Return the forces on all sliders."""
        around = np.concatenate([x[:1], x, x[-1:]])
        return self.pulls + around[:-2] + around[2:] - 2 * x

    def start(self, i, force):
        """Set a slider in motion."""
        self.sign[i] = math.copysign(1.0, force)
        self.events.append(("start", i, int(self.sign[i]), self.time, self.x[i]))

    def rearrange(self, first, draw, rtol):
        """Integrate from event to event until all rest; `draw` has new thresholds."""
        for i in first:
            self.start(i, self.pulls[i])
        while self.sign.any():
            i, span = fly(self, rtol)
            self.time += span
            force = self.forces(self.x)[i]
            if self.sign[i] == 0.0:
                self.start(i, force)
                continue
            self.events.append(("stop", i, int(self.sign[i]), self.time, self.x[i]))
            self.sign[i] = self.v[i] = 0.0
            self.thresholds[i] = draw(i)
            if abs(force) > self.thresholds[i]:
                self.start(i, force)


def fly(motion, rtol):
    """Move the sliders to their next event, by SciPy's `solve_ivp` (DOP853) with terminal events.

    Return who has it and the time until then.
    """
    n, sign, held = motion.n, motion.sign, motion.thresholds
    moves, drag = sign != 0.0, motion.friction * sign

    def slope(t, y):
        return np.concatenate([y[n:], moves * (motion.forces(y[:n]) - drag)])

    def slows(t, y, i):
        return sign[i] * y[n + i]

    def holds(t, y, i):
        return held[i] - abs(motion.forces(y[:n])[i])

    near = np.convolve(moves, [1, 1, 1])[1:-1].nonzero()[0].tolist()
    events = [partial(slows if moves[i] else holds, i=i) for i in near]
    for event in events:
        event.terminal, event.direction = True, -1.0
    done = solve_ivp(
        slope, (0.0, LONGEST), np.concatenate([motion.x, motion.v]),
        method="DOP853", rtol=rtol, atol=rtol * 1e-3, events=events,
    )  # fmt: skip
    assert done.status == 1
    which = next(k for k, times in enumerate(done.t_events) if times.size)
    motion.x, motion.v = np.split(done.y_events[which][0], 2)
    return near[which], float(done.t_events[which][0])


class RivalSimulation(Simulation):
    """A chain on its way along a drive, in float64: ramp to theta_c, rearrange, repeat."""

    at_rest = True

    def __init__(self, start, record, rtol):
        self.chain, self.seed, self.names, self.rtol = start.chain, start.seed, record, rtol
        self.contacts, self.tally = Contacts(start.chain, start.seed), Tally()
        self.theta, self.draws = float(start.state.theta), start.state.draws - 1
        self.tensions, self.x = start.state.tensions.copy(), start.state.displacements.copy()
        self.thresholds = np.array([self._drawn(i) for i in range(start.chain.n)])

    def _drawn(self, i):
        coefficient = float(self.contacts.coefficient(i + 1, int(self.draws[i])))
        self.draws[i] += 1
        return max(coefficient, float(self.chain.mu_d)) * self.chain.cos_alpha

    def _forces(self):
        return np.diff(self.tensions, prepend=0.0, append=0.0) + self.chain.sin_alpha

    def follow(self, drive, first, count, limits=NO_LIMITS):
        """Take the chain to some targets."""
        rows, log = (
            {name: [] for name in ("x_G", *self.names)},
            AvalancheLog(self.chain, self.names),
        )
        l0, begin, q, stop = float(self.chain.l0), self.tally.events, first, Stop.DONE
        while q < first + count and stop is Stop.DONE:
            target = float(drive.targets(q, 1, self.seed)[0])
            way, forces = 1.0 if target >= self.theta else -1.0, self._forces()
            # a dilation takes l0 dtheta from every tension: only the ends of the chain feel it
            left = self.thresholds[[0, -1]] + way * np.array([forces[0], -forces[-1]])
            least = left.min()
            if self.theta * way + least / l0 > target * way:
                self.tensions -= l0 * (target - self.theta)
                self.theta = target
                here = {"x_G": self.x.mean(), "x": self.x.copy()}
                for name in rows.keys() & here.keys():
                    rows[name].append(here[name])
                q += 1
                continue
            self.theta += way * least / l0
            self.tensions -= way * least
            motion = Motion(self._forces(), self.chain.friction, self.thresholds)
            ends = np.array([0, self.chain.n - 1])[left == least]
            motion.rearrange(ends.tolist(), self._drawn, self.rtol)
            for number, (kind, i, sign, time, moved) in enumerate(motion.events):
                event = Event(time, EventKind(kind), (i + 1,), (sign,))
                at = q, self.tally.rearrangements, number, self.theta
                (row,) = rows_of(event, *at)
                rows.get("events", []).append(row)
                log.take(row, lambda: self.tensions, moved, math.nan, way)
            log.rest(lambda: self.tensions, 0)
            self.tally.events += len(motion.events)
            self.tally.rearrangements += 1
            self.x += motion.x
            self.tensions += np.diff(motion.x)
            stop = limits.stop(self.tally.events - begin) or Stop.DONE
        reason = "" if stop is Stop.DONE else limits.reason(stop)
        return Stretch(q - first, record_arrays(rows | log.tables(), self.chain.n), stop, reason)

    def state(self):
        """Return the present state, at rest."""
        numbers = enumerate((self.draws - 1).tolist(), 1)
        held = np.array([float(self.contacts.coefficient(i, number)) for i, number in numbers])
        return State(self.tensions, self.x, coefficients=held, draws=self.draws, theta=self.theta)

    snapshot = restore = None  # `compare` resumes nothing


@dataclass(frozen=True)
class SciPy(Solver):
    """SciPy's `solve_ivp` with terminal events."""

    rtol: float = 1e-9
    name: ClassVar[str] = "scipy"
    records: ClassVar[tuple[str, ...]] = ("x_G", "x", "events", "slip_table")
    rearrange_from = None  # only runs are compared

    def simulation_from(self, start, record):
        """Return a simulation from a start."""
        return RivalSimulation(start, record, float(self.rtol))


@contextmanager
def registered():
    """Let SciPy be a solver by name."""
    SOLVERS["scipy"] = lambda: SciPy
    try:
        yield
    finally:
        del SOLVERS["scipy"]
