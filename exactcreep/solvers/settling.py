"""Follow temperature cycles with `exact` until the chain returns to an earlier state.

Without disorder the state at the end of a cycle determines everything that follows. Tensions that
return (see `return_map`) name a period; the chain then follows one more period, which shows whether
its forces return bit for bit.

An avalanche rounds the forces, and a cycle with avalanches may return them only to within rounding.
If they do so for `PATIENCE` successive cycles and at least two periods, they are assumed to
continue so. This is not an exact recurrence of the floats, and is reported separately.

With disorder a contact never gets back its threshold. Then the search is for a cycle without any
event, which ends all motion, and for the time since an inner slider last slipped.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.chain import Chain, no_advance, rounding_of
from exactcreep.model.drive import Cycles
from exactcreep.model.numbers import nearest_float
from exactcreep.model.state import State
from exactcreep.solvers.exact import layout
from exactcreep.solvers.exact.copies import NEAR_COPIES, perturbed
from exactcreep.solvers.exact.solver import Exact, ExactSimulation
from exactcreep.solvers.interface import compile_for
from exactcreep.solvers.return_map import (
    LONGEST_PERIOD,
    PATIENCE,
    Approach,
    CycleEnds,
    CycleReader,
    LimitCycle,
    approach,
    nearness,
    repeats_since,
    returns,
)
from exactcreep.watch.limits import NO_LIMITS, Limits, Stop

_RECORD = ("tension", "slips")
_SHORTEST, _LONGEST = 8, 256  # cycles between two searches for a return
_MOST_KEPT = 2**25  # numbers in the stored ends of cycles
_FORCES = [layout.FORCE, layout.FORCE_LOW, layout.EXCESS]


class SettlingSearch:
    """The search for the cycle to which temperature cycles of one amplitude take a chain.

    Parameters
    ----------
    chain : Chain
    drive : Cycles
        Its cycles are the most that the chain may take.
    start : State
    seed : int
    dormant : int
        Cycles without a slip of an inner slider after which the chain is called dormant.
    say : callable, optional
        Hears that the compiler works.

    Attributes
    ----------
    simulation : ExactSimulation
        The present chain.
    cycles : int
        Whole cycles so far.
    settled : LimitCycle or None
        The limit cycle, exact if `apart` is 0, else to within this distance.
    advanced_until : int
        The last cycle, up to `settled.since`, with an advance of x_G; 0: none.
    furthest, heading : int
        The last cycle with a new extreme of x_G, and its direction: +1 or -1 along x; 0: none.
    alike_since, advanced_before : int
        The cycle after which every cycle has the same slips, and the last advance up to it.
    dormant_after : int
        Cycles after which the chain was first dormant, -1: never.
    """

    def __init__(
        self, chain: Chain, drive: Cycles, start: State, seed: int = 0, dormant: int = 2**62,
        *, say: Callable[..., None] | None = None,
    ) -> None:  # fmt: skip
        compile_for(Exact(), chain, _RECORD, say and partial(say, "compiling", 0))
        self.simulation, self.drive = ExactSimulation(chain, start, seed, _RECORD), drive
        self.settled: LimitCycle | None = None
        self.cycles = self.advanced_until = self.furthest = self.heading = 0
        self.alike_since = self.advanced_before = self._stirred = 0
        self.dormant_after, self._calm = -1, dormant if chain.n > 2 else 2**62
        self._close, self._rounding = nearness(chain), nearest_float(rounding_of(chain))
        self._still = nearest_float(no_advance(chain))
        place = float(self.simulation.state().displacements.mean())
        self._place, self._extremes = (place, 0.0), {1: place, -1: -place}
        self._reader, self._done = CycleReader(chain, start), 0  # targets
        self._slips = np.zeros(chain.n, dtype=np.int64)  # of the last cycle
        # at the ends of the last cycles: the last advance, kept coefficients, tensions
        self._ends = np.empty((0, chain.n + 1))

    def follow(self, limits: Limits = NO_LIMITS) -> tuple[Stop, str]:
        """Continue until the chain has settled, has had its cycles, or a limit is reached.

        Returns `Stop.DONE` in the first two cases, otherwise why it ended, with a sentence.
        """
        while self.settled is None and self.cycles < self.drive.cycles:
            ahead = min(max(self.cycles, _SHORTEST), _LONGEST)
            if self.simulation.chain.sigma_mu != 0:
                ahead = _LONGEST  # a chain at rest costs no more
            ahead = min(ahead, self.drive.cycles - self.cycles)
            count = 2 * (self.cycles + ahead) - self._done
            stretch = self.simulation.follow(self.drive, self._done + 1, count, limits)
            self._take(self._reader.read(stretch, self._done + 1))
            self._done += stretch.completed
            if self.settled is None:
                if stretch.stop is not Stop.DONE:
                    return stretch.stop, stretch.reason
                if (stop := limits.stop(0)) is not None:
                    return stop, limits.reason(stop)
        return Stop.DONE, ""

    def _take(self, ends: CycleEnds) -> None:
        """Note some cycles, up to the first without a slip."""
        calm = np.flatnonzero(~ends.slips.any(axis=1))[:1]
        count = int(calm[0]) + 1 if calm.size else len(ends.slips)
        if count == 0:
            return
        x_G, low, slips, keep, tension = (rows[:count] for rows in ends)
        new = np.column_stack([self._note(slips, x_G, low), keep, tension])
        most = max(min(3 * LONGEST_PERIOD + 1, _MOST_KEPT // self._slips.size), 2)
        self._ends = np.vstack([self._ends[-most:], new])
        if calm.size:  # nothing moves any more
            self.settled = LimitCycle(1, self.cycles - 1, 0.0, None)
        elif self.simulation.chain.sigma_mu == 0:
            self._look_for_a_return()

    def _note(self, slips: NDArray[Any], x_G: NDArray[Any], low: NDArray[Any]) -> NDArray[Any]:
        """Note where the chain was at the ends of some cycles, and which sliders slipped.

        Returns the last cycle with an advance, up to each of them.
        """
        cycles = np.arange(self.cycles + 1, self.cycles + 1 + len(slips))
        noise = self._rounding * slips.sum(axis=1)
        x_G, low = (np.append(*pair) for pair in zip(self._place, (x_G, low), strict=True))
        moved = np.abs((x_G[1:] - x_G[:-1]) + (low[1:] - low[:-1]))
        advanced = np.where(moved > np.maximum(noise, self._still), cycles, 0)
        advances = np.maximum.accumulate(np.append(self.advanced_until, advanced))
        for way, extreme in self._extremes.items():
            far = np.maximum.accumulate(np.append(extreme, way * x_G[1:]))
            beyond = np.flatnonzero(way * x_G[1:] > far[:-1] + noise)
            if beyond.size and cycles[beyond[-1]] > self.furthest:
                self.furthest, self.heading = int(cycles[beyond[-1]]), way
            self._extremes[way] = far[-1]
        stirs = np.append(self._stirred, cycles[slips[:, 1:-1].any(axis=1)])
        pauses = np.append(stirs[1:] - 1, cycles[-1]) - stirs
        if (long := stirs[pauses >= self._calm]).size and self.dormant_after < 0:
            self.dormant_after = int(long[0])
        others = np.flatnonzero((slips != np.vstack([self._slips, slips[:-1]])).any(axis=1))
        if others.size:
            self.alike_since = int(cycles[others[-1]]) - 1
            self.advanced_before = int(advances[others[-1]])
        self.cycles, self.advanced_until = int(cycles[-1]), int(advances[-1])
        self._stirred, self._slips, self._place = int(stirs[-1]), slips[-1], (x_G[-1], low[-1])
        return advances[1:]

    def _look_for_a_return(self) -> None:
        ends = self._ends[:, 1:]
        for period in returns(ends, LONGEST_PERIOD, self._close).tolist():
            first = repeats_since(ends, period, self._close)
            lasts = len(ends) - period - first >= max(PATIENCE, 2 * period)
            if not (lasts or (ends[-1] == ends[-1 - period]).all()):
                continue
            apart = self._apart(period)
            if lasts or apart == 0.0:
                first = first if apart else repeats_since(ends, period, 0.0)
                since = self.cycles + 1 - len(ends) + first
                self.settled = LimitCycle(period, since, apart, None)
                self.advanced_until = int(self._ends[first, 0])
                return

    def _apart(self, period: int) -> float:
        """Return how far the forces, and their lower parts, are from here after a period."""
        simulation = self.recording()
        before = np.array([simulation.cell(row) for row in _FORCES])
        simulation.follow(self.drive, 2 * self.cycles + 1, 2 * period)
        after = np.array([simulation.cell(row) for row in _FORCES])
        return float(np.abs(after - before).max())

    def copies(self) -> list[SettlingSearch]:
        """Return searches from two starts that differ by a few rounding errors."""
        chain, start = self.simulation.chain, self.simulation.start.state
        return [SettlingSearch(chain, self.drive, perturbed(chain, start, *of)[1])
                for of in NEAR_COPIES]  # fmt: skip

    def recording(self) -> ExactSimulation:
        """Return a simulation that goes on from the present end of a cycle, and records events."""
        of = self.simulation
        return ExactSimulation(of.chain, of.state(), of.seed, ("events",), unrounded=of.unrounded())

    def approaching(self) -> Approach | None:
        """Return how the forces approach a limit like 1/k; None if they do not."""
        if self.simulation.chain.sigma_mu != 0:
            return None
        forces = np.diff(self._ends[:, 2:], axis=1, prepend=0.0, append=0.0)
        return approach(forces, self.cycles - self.alike_since)

    @property
    def dormant(self) -> bool:
        """Whether no inner slider has slipped for `dormant` cycles."""
        return self.cycles - self._stirred >= self._calm
