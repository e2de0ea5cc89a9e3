"""Does a chain creep at one amplitude: in the last of a number of cycles, or for ever?

*In the last cycle* x_G has to advance by more than 1e-6 in the direction in which weight and end
forces drive the chain. The chain may lock later. *For ever* is computed in float64, and by the
certified solver where float64 is unreliable.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any, NamedTuple

from exactcreep import solvers
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles
from exactcreep.model.enclosure import Enclosure, enclosure, exact_value
from exactcreep.model.numbers import nearest_float
from exactcreep.model.outcome import Evidence, Outcome, direction_of
from exactcreep.model.state import State
from exactcreep.solvers.interface import Stretch, simulate
from exactcreep.solvers.registry import solver_named
from exactcreep.studies import fates
from exactcreep.studies.event_log import LoggedRearrangement
from exactcreep.studies.fates.fate import numerical_fate
from exactcreep.studies.fates.fate_result import Fate
from exactcreep.studies.sense import CHAOTIC
from exactcreep.studies.thresholds.amplitudes import Bracket
from exactcreep.watch.limits import NO_LIMITS, Limits, OutOfTime, Stop
from exactcreep.watch.progress import reporter

_MOST_EVENTS = 10**6  # for each slider (at least 20); no edge is so high that a run needs more
ADVANCE = Fraction(1, 10**6)
"""Least advance of x_G in the last cycle."""
MOST_CYCLES = 10_000
"""Most cycles of a float64 trajectory whose fate is sought."""
CERTIFIED_CYCLES = 1_000
"""Most cycles of a certified trajectory."""
_TWIN = Fraction(1, 10**13)  # distance of two starts that must have the same fate in float64
Log = list[LoggedRearrangement]
_SILENT = reporter(None)
_FOR_EVER = "creep for ever"
_IDLE = (Outcome.AT_REST, Outcome.CYCLING)


class Observation(NamedTuple):
    """The behaviour of the chain at one amplitude."""

    creeps: bool
    evidence: Evidence
    log: Log
    outcome: Outcome | None  # in the last cycle, or for ever; None: it keeps changing
    outcome_evidence: Evidence
    direction: str = "none"  # of creep
    fate: Fate | None = None
    between: Bracket | None = None  # amplitudes with the same behaviour


@dataclass(eq=False)
class Question:
    """Does x_G advance in the last cycle at this amplitude, in the direction of its weight?

    `solver` decides, and reports to `say`; no run is made twice.
    """

    chain: Chain
    cycles: int
    start: State
    limits: Limits = NO_LIMITS
    solver: str = "certified"
    say: Callable[..., None] = _SILENT
    runs: dict[Fraction, Observation] = field(default_factory=dict, init=False)

    @property
    def what(self) -> str:
        """What begins at an edge, in words."""
        return f"advance in cycle {self.cycles}"

    def tell(self, answer: str) -> None:
        """Report what is known by now."""
        self.say("deciding", len(self.runs), 0, "runs", answer=answer)

    def decided(self, amplitude: Fraction, digits: int) -> Observation:
        """Return the answer of the deciding solver at an amplitude with `digits` digits."""
        if amplitude not in self.runs:
            self.say("deciding", len(self.runs) + 1, 0, "runs")
            options = {} if self.solver == "exact" else {"digits": digits}
            if self.solver == "certified":
                # an exact tie outside Q(c) stays undecided at any precision, so digits are limited
                options["most_digits"] = 4 * digits + 1000
            self.runs[amplitude] = self.tried(amplitude, self.solver, options)
        return self.runs[amplitude]

    def decided_at_its_end(self, amplitude: Fraction, digits: int) -> Observation:
        """Return the same for a run that is followed to its end, even if it had stopped early."""
        fate = self.decided(amplitude, digits).fate
        if fate is not None and fate.outcome is Outcome.LIMIT:
            self.runs[amplitude] = self.tried(amplitude, self.solver, {})
        return self.runs[amplitude]

    def report(self) -> dict[str, int]:
        """Return the number of runs."""
        return {"deciding_runs": len(self.runs)}

    def unsettled(self, amplitude: Fraction) -> bool:
        """Return whether the chain does not settle within the cycles that are followed."""
        return False

    def float_fails(self, low: Fraction, high: Fraction) -> bool:
        """Return whether float64 is unreliable at one of two amplitudes, or between them."""
        return False

    def creeps(self, amplitude: Fraction) -> bool:
        stretch, _ = self._followed(amplitude, "exact", {}, ())
        return stretch.stop is Stop.RUNAWAY or self._last_advance(stretch).middle > ADVANCE

    def tried(self, amplitude: Fraction, solver: str, options: dict[str, Any]) -> Observation:
        record, chain = ("x_G", "tension", "events"), self.chain
        stretch, evidence = self._followed(amplitude, solver, options, record)
        log, advanced = fates.logged(stretch.recorded), self._last_advance(stretch)
        runs_away = stretch.stop is Stop.RUNAWAY
        creeps = runs_away or advanced.middle > ADVANCE
        near = not runs_away and abs(advanced.middle - ADVANCE) <= advanced.radius
        if near and evidence is Evidence.PROVED:
            evidence = Evidence.UNDECIDED
        tensions = [self.start.tensions, *stretch.recorded["tension"]][-3:]
        before, after = (map(enclosure, tensions[k].tolist()) for k in (0, -1))
        changes = [_difference(x, y) for x, y in zip(before, after, strict=True)]
        room = Fraction(len(log), 2**50)
        last = [r for r in log if r.half_cycle > 2 * self.cycles - 2]
        returned = all(abs(change.middle) <= change.radius + room for change in changes)
        outcome = _last_outcome(last, evidence, returned=returned)
        direction = direction_of(chain.heading * creeps, chain.tan_alpha)
        return Observation(creeps, evidence, log, *outcome, direction)

    def _followed(
        self, amplitude: Fraction, solver: str, options: dict[str, Any], record: tuple[str, ...]
    ) -> tuple[Stretch, Evidence]:
        """Follow all cycles, or until a runaway; raise `OutOfTime` at a limit."""
        self.limits.require()  # short runs never check the time themselves
        algorithm = solver_named(solver, options)
        simulation = algorithm.simulation(self.chain, self.start, 0, record)
        most = _MOST_EVENTS * max(self.chain.n, 20)
        drive, limits = Cycles(amplitude, self.cycles), replace(self.limits, events=most)
        (stretch,) = simulate(simulation, drive, [2 * self.cycles], limits)
        if stretch.stop is Stop.DEADLINE:
            raise OutOfTime(stretch.reason)
        if stretch.stop in (Stop.BUDGET, Stop.LIMIT):
            why = f"more than {most:.0e} events: look for the edge at smaller amplitudes"
            why = stretch.reason if stretch.stop is Stop.LIMIT else why
            raise OutOfTime(f"a run at A = {nearest_float(amplitude):.17g}: {why}")
        return stretch, simulation.evidence

    def _last_advance(self, stretch: Stretch) -> Enclosure:
        """Return the advance of x_G in the last cycle, in the direction of weight and forces."""
        values = [0, 0, 0, *stretch.recorded["x_G"].tolist()]
        begin, end = (enclosure(values[k]) for k in (-3, -1))
        return _difference(end, begin) if self.chain.heading < 0 else _difference(begin, end)


@dataclass(eq=False)
class WithoutSlips(Question):
    """Does a chain that slides with theta advance in a cycle by more than `least`, exactly?

    The answer is proved if every possible pivot gives the same; else it follows from the mean over
    the pivots, as in `sliding`.
    """

    least: Fraction = ADVANCE

    @property
    def what(self) -> str:
        return super().what if self.least else _FOR_EVER

    def float_fails(self, low: Fraction, high: Fraction) -> bool:
        return True  # float64 is never used

    def creeps(self, amplitude: Fraction) -> bool:
        return self.tried(amplitude, self.solver, {}).creeps

    def tried(self, amplitude: Fraction, solver: str, options: dict[str, Any]) -> Observation:
        self.limits.require()
        way, evidence = self.chain.heading, Evidence.PROVED
        asked = solvers.relaxed_cycle(self.chain, amplitude, self.cycles)
        advances = [way * advance for advance, _ in asked]
        creeps = bool(sum(advances) > len(advances) * self.least)
        if any((advance > self.least) is not creeps for advance in advances):
            evidence = Evidence.UNDECIDED
        lasting = asked if self.cycles > 1 else solvers.relaxed_cycle(self.chain, amplitude, 2)
        advance, slid = lasting[0]
        outcome = Outcome.CREEPING if advance.sign() else Outcome.CYCLING
        if not slid.sign():
            outcome = Outcome.AT_REST
        direction = direction_of(way * creeps, self.chain.tan_alpha)
        return Observation(creeps, evidence, [], outcome, evidence, direction)


def _difference(a: Enclosure, b: Enclosure) -> Enclosure:
    return Enclosure(b.middle - a.middle, a.radius + b.radius)


def _last_outcome(
    last: Log, evidence: Evidence, *, returned: bool
) -> tuple[Outcome | None, Evidence]:
    if not last:
        return Outcome.AT_REST, evidence
    if all(fates.lone(rearrangement.itinerary) for rearrangement in last):
        # a lone slip from its threshold moves a slider by 2 D, so the moves cancel exactly or not
        moves: Counter[int] = Counter()
        for rearrangement in last:
            start = rearrangement.events[0]
            moves.update(dict(zip(start.sliders, start.signs, strict=True)))
        return None if any(moves.values()) else Outcome.CYCLING, evidence
    return (Outcome.CYCLING, evidence.and_then(Evidence.COMPUTED)) if returned else (None, evidence)


@dataclass(eq=False)
class Lasting(Question):
    """Does the chain creep for ever at this amplitude?

    Two starts that differ by 1e-13 show where float64 is unreliable. There the certified solver
    decides (`certified`); if it cannot, the amplitude is listed as `sensitive`.
    """

    certified: dict[Fraction, bool] = field(default_factory=dict, init=False)
    sensitive: dict[Fraction, bool] = field(default_factory=dict, init=False)
    locked: Log = field(default_factory=list, init=False)
    """The last run that provably does not creep."""
    between: list[Observation] = field(default_factory=list, init=False)
    """Proofs that hold between two amplitudes."""

    @property
    def what(self) -> str:
        return _FOR_EVER

    def report(self) -> dict[str, int]:
        return {**super().report(), "certified_points": len(self.certified)}

    def _course(self, amplitude: Fraction, start: State) -> tuple[Fate, float]:
        """Return the fate in float64, and x_G minus the steady part of its advance."""
        self.limits.require()  # a chain that settles at once never checks the time itself
        drive = Cycles(amplitude, self.cycles)
        solvers.SettlingSearch.compile()
        search = solvers.SettlingSearch(self.chain, drive, start)
        fate, stop = numerical_fate(search, start, self.limits)
        if stop is Stop.DEADLINE:
            raise OutOfTime(fate.reason)
        steady = fate.cycles * (fate.advance or 0.0) / (fate.period or 1)
        return fate, float(search.simulation.state().displacements.mean()) - steady

    def float_fails(self, low: Fraction, high: Fraction) -> bool:
        for amplitude in (low, high, (low + high) / 2):
            self.creeps(amplitude)
            if amplitude in self.certified or amplitude in self.sensitive:
                return True
        return False

    def unsettled(self, amplitude: Fraction) -> bool:
        return self.float_fate(amplitude).outcome is Outcome.LIMIT

    def float_fate(self, amplitude: Fraction) -> Fate:
        return self._course(amplitude, self.start)[0]

    def creeps(self, amplitude: Fraction) -> bool:
        """Return whether the chain creeps; a chain that has not settled has not locked."""
        for answers in (self.certified, self.sensitive):
            if amplitude in answers:
                return answers[amplitude]
        fate, place = self._course(amplitude, self.start)
        creeps = fate.outcome not in _IDLE
        if fate.outcome in (Outcome.AT_REST, Outcome.RUNAWAY) or self.solver == "exact":
            return creeps
        for seed in (1, 2):
            other = State.perturbed(self.chain, _TWIN, start_seed=seed)
            tensions = self.start.tensions + other.tensions
            twin, there = self._course(amplitude, replace(self.start, tensions=tensions))
            same = (twin.outcome, twin.period) == (fate.outcome, fate.period)
            if not same or (fate.period == 1 and abs(there - place) > 1e-6):
                break
        else:
            return creeps
        if fate.outcome is not Outcome.LIMIT and self.chain.n < CHAOTIC:
            trial = self.tried(amplitude, self.solver, {})
            if trial.evidence is Evidence.PROVED:
                self.certified[amplitude] = trial.creeps
                return trial.creeps
        self.sensitive[amplitude] = creeps
        return creeps

    def tried(self, amplitude: Fraction, solver: str, options: dict[str, Any]) -> Observation:
        if solver == "exact":
            in_floats = self.float_fate(amplitude)
            most = min(max(in_floats.cycles, 1), CERTIFIED_CYCLES)
            past = Question(self.chain, most, self.start, self.limits)
            trial = past.tried(amplitude, solver, options)
            return trial._replace(
                creeps=in_floats.outcome not in _IDLE,
                outcome=in_floats.outcome,
                outcome_evidence=trial.evidence,
                direction=in_floats.direction,
            )
        for trial in self.between:
            if trial.fate and trial.between and trial.between[0] < amplitude < trial.between[1]:
                return trial._replace(fate=replace(trial.fate, amplitude=amplitude))
        drive = Cycles(amplitude, min(self.cycles, CERTIFIED_CYCLES))
        digits: int = options.get("digits", 0)
        parted: Fraction | None = None

        def far_beyond(log: Log) -> bool:
            """Return whether the runs differ far below, so that the search continues there."""
            nonlocal parted
            parted = parting(self.locked, log) if parted is None else parted
            return parted is not None and abs(amplitude - parted) * 10 ** (digits - 1) > amplitude

        end: dict[str, Any] = {"enough": far_beyond} if digits and self.locked else {}
        fate, log, between = fates.proved_fate(self.chain, drive, self.start, self.limits, **end)
        if fate.outcome is Outcome.LIMIT:
            self.limits.require()
        creeps = fate.outcome not in _IDLE
        if not creeps:
            self.locked[:] = log
        trial = Observation(creeps, fate.evidence, log, fate.outcome, fate.evidence,
                            fate.direction, fate, between)  # fmt: skip
        if between is not None:
            self.between.append(trial)
        return trial


def parting(log: Log, other: Log) -> Fraction | None:
    """Return theta_c of the event that only one of two runs has, or None."""
    for mine, its in zip(log, other, strict=False):
        if (mine.half_cycle, mine.itinerary) == (its.half_cycle, its.itinerary):
            continue
        if mine.half_cycle == its.half_cycle:
            return None
        return abs(exact_value(min(mine, its, key=lambda r: r.half_cycle).theta))
    return None


def side_by_side(lower: Observation, upper: Observation) -> tuple[Log, Log]:
    """Return the events of both runs; the run that settled earlier repeats its last period."""

    def gone_on(trial: Observation, beside: Observation) -> Log:
        log, fate, longer = list(trial.log), trial.fate, beside.fate
        if fate is not None and longer is not None and fate.period is not None:
            end, step = 2 * fate.cycles, 2 * fate.period
            last = [again for again in log if again.half_cycle > end - step]
            while last and end < 2 * longer.cycles:
                last = [again._replace(half_cycle=again.half_cycle + step) for again in last]
                log += last
                end += step
        return log

    return gone_on(lower, upper), gone_on(upper, lower)
