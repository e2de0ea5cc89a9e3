"""What a chain does in the last of so many cycles, at one amplitude.

Does x_G advance down the incline by more than 1e-6 in the last of them? That is exact, but the
chain may lock a little later, and for ever; see `lasting`. An advance uphill is not asked for:
relaxing from its start, a chain that locks moves up, too, by less and less.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import pairwise
from typing import Any, NamedTuple

from exactcreep.limits import NO_LIMITS, Limits, OutOfTime, Stop
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles
from exactcreep.model.enclosure import Enclosure, enclosure
from exactcreep.model.numbers import nearest_float
from exactcreep.model.outcome import Evidence, Outcome, direction_of
from exactcreep.model.state import State
from exactcreep.solvers.registry import solver_named
from exactcreep.solvers.solver import Stretch, advance
from exactcreep.studies.event_log import LoggedRearrangement
from exactcreep.studies.fates.proof import logged, lone
from exactcreep.studies.fates.result import Fate

_MOST_EVENTS = 10**6  # for each slider (at least 20), then a run is given up: no edge is so far up
ADVANCE = Fraction(1, 10**6)
"""By which x_G has to move in the last cycle."""


class GivenUp(RuntimeError):
    """A run on which the search depends came to a limit of its solver.

    >>> issubclass(GivenUp, RuntimeError)
    True
    """


class Observation(NamedTuple):
    """What the chain does at one amplitude."""

    creeps: bool
    evidence: Evidence
    log: list[LoggedRearrangement]
    outcome: Outcome | None  # of the last cycle, or for ever; None: it goes on to change
    outcome_evidence: Evidence
    direction: str = "none"  # which way it creeps
    change: float = 0.0  # of a tension in the last cycle, the largest
    fate: Fate | None = None
    between: tuple[Fraction, Fraction] | None = None  # amplitudes at which it does the same


@dataclass(frozen=True)
class Question:
    """Does x_G advance down the incline in the last cycle at this amplitude?"""

    chain: Chain
    cycles: int
    start: State
    limits: Limits = NO_LIMITS

    def unsettled(self, amplitude: Fraction) -> bool:
        """Return whether no number of cycles that is followed shows what the chain does."""
        return False

    def float_fails(self, low: Fraction, high: Fraction) -> bool:
        """Return whether float64 is no witness at one of two amplitudes, or between them."""
        return False

    def creeps(self, amplitude: Fraction) -> bool:
        """Return the float64 solver's answer."""
        stretch, _ = self._followed(amplitude, "exact", {}, ())
        return stretch.stop is Stop.RUNAWAY or self._last_advance(stretch).middle > ADVANCE

    def tried(self, amplitude: Fraction, solver: str, options: dict[str, Any]) -> Observation:
        """Return a solver's answer, and what happened."""
        record, tangent = ("x_G", "tension", "events"), self.chain.tan_alpha
        stretch, evidence = self._followed(amplitude, solver, options, record)
        log, known = logged(stretch.recorded), self._last_advance(stretch)
        runs_away = stretch.stop is Stop.RUNAWAY
        creeps = runs_away or known.middle > ADVANCE
        near = not runs_away and abs(known.middle - ADVANCE) <= known.radius
        if near and evidence is Evidence.PROVED:
            evidence = Evidence.UNDECIDED
        tensions = [self.start.tensions, *stretch.recorded["tension"]][-3:]
        before, after = (map(enclosure, tensions[k].tolist()) for k in (0, -1))
        changes = [_difference(x, y) for x, y in zip(before, after, strict=True)]
        room = Fraction(len(log), 2**50)
        last = [one for one in log if one.half_cycle > 2 * self.cycles - 2]
        returned = all(abs(one.middle) <= one.radius + room for one in changes)
        outcome = _last_outcome(last, evidence, returned=returned)
        change = nearest_float(max(abs(one.middle) for one in changes))
        direction = direction_of(tangent * creeps, tangent)
        return Observation(creeps, evidence, log, *outcome, direction, change)

    def _followed(
        self, amplitude: Fraction, solver: str, options: dict[str, Any], record: tuple[str, ...]
    ) -> tuple[Stretch, Evidence]:
        """Follow all cycles, or to a runaway; `GivenUp` and `OutOfTime` where that fails."""
        algorithm = solver_named(solver, options)
        simulation = algorithm.simulation(self.chain, self.start, 0, record)
        most = _MOST_EVENTS * max(self.chain.n, 20)
        drive, limits = Cycles(amplitude, self.cycles), replace(self.limits, events=most)
        stretch = advance(simulation, drive, 2 * self.cycles, limits)
        if stretch.stop is Stop.DEADLINE:
            raise OutOfTime(stretch.reason)
        if stretch.stop in (Stop.BUDGET, Stop.LIMIT):
            why = f"more than {most:.0e} events: look for the edge at smaller amplitudes"
            why = stretch.reason if stretch.stop is Stop.LIMIT else why
            raise GivenUp(f"a run at A = {nearest_float(amplitude):.17g}: {why}")
        return stretch, simulation.evidence

    def _last_advance(self, stretch: Stretch) -> Enclosure:
        """Return by how much x_G moves down the incline in the last cycle."""
        values = [0, 0, 0, *stretch.recorded["x_G"].tolist()]
        begin, end = (enclosure(values[k]) for k in (-3, -1))
        return _difference(end, begin) if self.chain.tan_alpha < 0 else _difference(begin, end)


def _difference(a: Enclosure, b: Enclosure) -> Enclosure:
    return Enclosure(b.middle - a.middle, a.radius + b.radius)


def _last_outcome(
    last: list[LoggedRearrangement], evidence: Evidence, *, returned: bool
) -> tuple[Outcome | None, Evidence]:
    """Return what the chain does in the last cycle of a run, and how well that is known."""
    if not last:
        return Outcome.AT_REST, evidence
    if all(lone(one.itinerary) for one in last):
        # a lone slip from its threshold moves a slider by 2 D: the moves cancel, or do not
        moves: Counter[int] = Counter()
        for one in last:
            moves.update(dict(zip(one.events[0].sliders, one.events[0].signs, strict=True)))
        return None if any(moves.values()) else Outcome.CYCLING, evidence
    return (Outcome.CYCLING, weaker(evidence, Evidence.COMPUTED)) if returned else (None, evidence)


def transient(changes: list[tuple[int, float]]) -> dict[str, Any]:
    """Return how a transient goes on that has come to no end.

    From the largest change of a tension in one cycle, after so many: the ``cycles`` followed, the
    ``change`` in the last, and, if it falls like a power of their number (the last three agree on
    one to a tenth), its ``power``: below -1 a cycle is approached, and never quite reached.
    """
    out: dict[str, Any] = dict(zip(("cycles", "change"), changes[-1], strict=True))
    if len(changes) > 2 and min(change for _, change in changes[-3:]) > 0:
        logs = [(math.log(k), math.log(x)) for k, x in changes[-3:]]
        powers = [(y - x) / (b - a) for (a, x), (b, y) in pairwise(logs)]
        if powers[-1] < 0 and abs(powers[0] - powers[1]) <= abs(powers[1]) / 10:
            out["power"] = round(powers[-1], 3)
    return out


def weaker(a: Evidence, b: Evidence) -> Evidence:
    return max(a, b, key=list(Evidence).index)
