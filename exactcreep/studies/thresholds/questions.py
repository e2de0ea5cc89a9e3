"""Does a chain creep at one amplitude: in the last of a number of cycles, or for ever?

*In the last cycle* x_G has to advance by more than 1e-6 in the direction in which weight and end
forces drive the chain. The chain may lock later. *For ever* is computed in float64, and by the
certified solver where float64 is unreliable.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cached_property
from typing import Any, NamedTuple

from exactcreep import solvers
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles
from exactcreep.model.enclosure import Enclosure, enclosure
from exactcreep.model.numbers import nearest_float
from exactcreep.model.outcome import Evidence, Outcome, direction_of
from exactcreep.model.state import State
from exactcreep.motion.arithmetic import BITS_PER_DIGIT
from exactcreep.motion.cosine_field import CosineField
from exactcreep.solvers.interface import Simulation, Start, simulate
from exactcreep.studies import fates
from exactcreep.studies.fates.fate import numerical_fate
from exactcreep.studies.fates.fate_result import Fate
from exactcreep.studies.sense import CHAOTIC
from exactcreep.watch.limits import NO_LIMITS, Limits, OutOfTime, Stop
from exactcreep.watch.progress import reporter

Bracket = tuple[Fraction, Fraction]
_MOST_EVENTS = 10**6  # for each slider (at least 20); no edge is so high that a run needs more
_ADVANCE = Fraction(1, 10**6)  # least advance of x_G in the last cycle
MOST_CYCLES = 10_000
"""Most cycles of a float64 trajectory whose fate is sought."""
_CERTIFIED_CYCLES = 1_000  # most cycles of a certified trajectory
_TWIN = Fraction(1, 10**13)  # distance of two starts that must have the same fate in float64
_SILENT = reporter(None)
_IDLE = (Outcome.AT_REST, Outcome.CYCLING)


class Answer(NamedTuple):
    """What the chain does at one amplitude, by the certified solver."""

    creeps: bool
    evidence: Evidence
    direction: str = "none"  # of creep
    fate: Fate | None = None
    between: Bracket | None = None  # amplitudes with the same events so far
    shared: bool = False  # whether the answer is the same at all of them

    def holds_at(self, amplitude: Fraction) -> bool:
        """Return whether the answer is known at another amplitude, too."""
        low, high = self.between or (amplitude, amplitude)
        return self.shared and low < amplitude < high


@dataclass(eq=False)
class Question(ABC):
    """Whether a relaxed chain creeps; no amplitude is certified twice.

    `cycles`: that are followed; `say`: hears what is known.
    """

    chain: Chain
    cycles: int
    limits: Limits = NO_LIMITS
    say: Callable[..., None] = _SILENT
    answers: dict[Fraction, Answer] = field(default_factory=dict, init=False)

    @property
    def what(self) -> str:
        """What begins at an edge, in words."""
        return "creep for ever"

    @abstractmethod
    def creeps(self, amplitude: Fraction) -> bool:
        """Return what float64 says, or the certified solver where float64 is unreliable."""

    @abstractmethod
    def certified(self, amplitude: Fraction, digits: int) -> Answer:
        """Ask the certified solver."""

    def unsettled(self, amplitude: Fraction) -> bool:
        """Return whether the chain does not settle within the cycles that are followed."""
        return False

    def float_fails(self, low: Fraction, high: Fraction) -> bool:
        """Return whether float64 is unreliable at one of two amplitudes, or between them."""
        return False

    def answer(self, amplitude: Fraction, digits: int) -> Answer:
        """Return what is known of an amplitude with so many digits, or ask."""
        known = (answer for answer in self.answers.values() if answer.holds_at(amplitude))
        if amplitude in self.answers:
            return self.answers[amplitude]
        if (alike := next(known, None)) is not None:
            return alike._replace(fate=alike.fate and replace(alike.fate, amplitude=amplitude))
        self.say("deciding", len(self.answers) + 1, 0, "runs")
        self.answers[amplitude] = self.certified(amplitude, digits)
        return self.answers[amplitude]


@dataclass(eq=False)
class InCycle(Question):
    """Does x_G advance in the last cycle, in the direction of weight and end forces?"""

    @property
    def what(self) -> str:
        return f"advance in cycle {self.cycles}"

    def creeps(self, amplitude: Fraction) -> bool:
        simulation = solvers.Exact().simulation(self.chain, State.relaxed(self.chain), 0, ())
        advance, _ = self._last_advance(simulation, amplitude)
        return advance is None or advance.middle > _ADVANCE

    def certified(self, amplitude: Fraction, digits: int) -> Answer:
        # an exact tie outside Q(c) stays undecided at any precision, so digits are limited
        solver = solvers.Certified(digits=digits, most_digits=4 * digits + 1000)
        start = Start(self.chain, State.relaxed(self.chain), 0)
        simulation = fates.Leaping(start, ("events",), solver)
        advance, recorded = self._last_advance(simulation, amplitude)
        evidence, creeps = simulation.evidence, advance is None or advance.middle > _ADVANCE
        if advance is not None and abs(advance.middle - _ADVANCE) <= advance.radius:
            evidence = evidence.and_then(Evidence.UNDECIDED)
        between = simulation.same_events(amplitude, fates.logged(recorded))
        direction = direction_of(self.chain.heading * creeps, self.chain.tan_alpha)
        alike = advance is not None and evidence is Evidence.PROVED
        return Answer(creeps, evidence, direction, None, between, alike)

    def _last_advance(
        self, simulation: Simulation, amplitude: Fraction
    ) -> tuple[Enclosure | None, Any]:
        """Return the advance of x_G in the last cycle, None of a runaway; and the records.

        Raises `OutOfTime` at a limit.
        """
        self.limits.require()  # short runs never check the time themselves
        most = _MOST_EVENTS * max(self.chain.n, 20)
        drive, limits = Cycles(amplitude, self.cycles), replace(self.limits, events=most)
        (stretch,) = simulate(simulation, drive, [2 * self.cycles], limits)
        if stretch.stop is Stop.DEADLINE:
            raise OutOfTime(stretch.reason)
        if stretch.stop in (Stop.BUDGET, Stop.LIMIT):
            why = f"more than {most:.0e} events: look for the edge at smaller amplitudes"
            why = stretch.reason if stretch.stop is Stop.LIMIT else why
            raise OutOfTime(f"a run at A = {nearest_float(amplitude):.17g}: {why}")
        if stretch.stop is Stop.RUNAWAY:
            return None, stretch.whole
        values = [0, 0, *stretch.recorded["x_G"].tolist()]
        begin, end = (enclosure(values[k]) for k in (-3, -1))
        ahead = self.chain.heading * (end.middle - begin.middle)
        return Enclosure(ahead, begin.radius + end.radius), stretch.recorded


@dataclass(eq=False)
class Lasting(Question):
    """Does the chain creep for ever?

    Two starts that differ by 1e-13 show where float64 is unreliable (`unsure`). There the certified
    solver decides; if it cannot, the amplitude is `sensitive`, and the answer of float64 is taken.
    """

    unsure: dict[Fraction, bool] = field(default_factory=dict, init=False)
    sensitive: list[Fraction] = field(default_factory=list, init=False)

    def _course(self, amplitude: Fraction, start: State) -> tuple[Fate, float]:
        """Return the fate in float64, and x_G minus the steady part of its advance."""
        self.limits.require()  # a chain that settles at once never checks the time itself
        drive = Cycles(amplitude, self.cycles)
        search = solvers.SettlingSearch(self.chain, drive, start)
        fate, stop = numerical_fate(search, start, self.limits)
        if stop is Stop.DEADLINE:
            raise OutOfTime(fate.reason)
        steady = fate.cycles * (fate.advance or 0.0) / (fate.period or 1)
        return fate, float(search.simulation.state().displacements.mean()) - steady

    def unsettled(self, amplitude: Fraction) -> bool:
        fate, _ = self._course(amplitude, State.relaxed(self.chain))
        return fate.outcome is Outcome.LIMIT

    def float_fails(self, low: Fraction, high: Fraction) -> bool:
        for amplitude in (low, high, (low + high) / 2):
            self.creeps(amplitude)
            if amplitude in self.unsure:
                return True
        return False

    def creeps(self, amplitude: Fraction) -> bool:
        """Return whether the chain creeps; a chain that has not settled has not locked."""
        if amplitude in self.unsure:
            return self.unsure[amplitude]
        start = State.relaxed(self.chain)
        fate, place = self._course(amplitude, start)
        creeps = fate.outcome not in _IDLE
        if fate.outcome in (Outcome.AT_REST, Outcome.RUNAWAY):
            return creeps
        for seed in (1, 2):
            other = State.perturbed(self.chain, _TWIN, start_seed=seed)
            twin, there = self._course(amplitude, replace(start, tensions=other.tensions))
            same = (twin.outcome, twin.period) == (fate.outcome, fate.period)
            if not same or (fate.period == 1 and abs(there - place) > 1e-6):
                break
        else:
            return creeps
        answer = Answer(creeps, Evidence.UNDECIDED)
        if fate.outcome is not Outcome.LIMIT and self.chain.n < CHAOTIC:
            answer = self.certified(amplitude, 1)
        if answer.evidence is not Evidence.PROVED:
            self.sensitive.append(amplitude)
            answer = Answer(creeps, Evidence.UNDECIDED)
        self.unsure[amplitude] = answer.creeps
        return answer.creeps

    def certified(self, amplitude: Fraction, digits: int) -> Answer:
        drive = Cycles(amplitude, min(self.cycles, _CERTIFIED_CYCLES))
        start = State.relaxed(self.chain)
        found = fates.proved_fate(self.chain, drive, start, self.limits, digits=digits)
        fate = found.fate
        if fate.outcome is Outcome.LIMIT:
            self.limits.require()
        creeps = fate.outcome not in _IDLE
        known = fate.evidence, fate.direction, fate, found.between, found.shared
        return Answer(creeps, *known)


@dataclass(eq=False)
class Sliding(Question):
    """Does a chain without slips creep for ever? It does above ``h/l0``, exactly.

    See `laws.differing_intercept`.
    """

    @cached_property
    def edge(self) -> Any:
        """``h/l0`` in Q(cos(alpha))."""
        chain, way = self.chain, self.chain.heading
        friction = sum(chain.each("mu_d")) - way * chain.n * chain.tan_alpha
        held = CosineField(chain.tan_alpha).times_cosine(friction)
        return (held - way * sum(chain.end_forces)) / (2 * chain.l0)

    def creeps(self, amplitude: Fraction) -> bool:
        return bool(self.edge < amplitude)

    def certified(self, amplitude: Fraction, digits: int) -> Answer:
        creeps = self.creeps(amplitude)
        middle, radius = self.edge.bracket(math.ceil(digits * BITS_PER_DIGIT) + 64)
        between = (middle + radius, Fraction(1)) if creeps else (Fraction(0), middle - radius)
        direction = direction_of(self.chain.heading * creeps, self.chain.tan_alpha)
        return Answer(creeps, Evidence.PROVED, direction, between=between)
