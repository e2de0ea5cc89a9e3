"""What a chain does for ever, at one amplitude: float64 first, and certified where that errs."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any

from exactcreep.limits import OutOfTime, Stop
from exactcreep.model.drive import Cycles
from exactcreep.model.enclosure import exact_value
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.model.state import State
from exactcreep.solvers.exact.recurrence import SettlingChain
from exactcreep.studies.event_log import LoggedRearrangement
from exactcreep.studies.fates.fate import numerical_fate
from exactcreep.studies.fates.proof import proved_fate
from exactcreep.studies.fates.result import Fate
from exactcreep.studies.thresholds.amplitudes import SHORT
from exactcreep.studies.thresholds.horizon import Observation, Question

MOST_CYCLES = 10_000
"""Of a float64 course whose fate is asked for."""
CERTIFIED_CYCLES = 1_000
"""Of a certified one."""
_TWIN = Fraction(1, 10**13)  # how far apart the starts are on whose fates float64 has to agree
Log = list[LoggedRearrangement]
_IDLE = (Outcome.AT_REST, Outcome.CYCLING)


@dataclass(frozen=True)
class Lasting(Question):
    """Does the chain creep for ever at this amplitude?

    Twins that start almost alike tell where float64 is no witness: there the fate is the certified
    one (`certified`), or, where that is not known either, the answer is listed as `sensitive`.
    """

    solver: str = "certified"
    certified: dict[Fraction, bool] = field(default_factory=dict)
    sensitive: dict[Fraction, bool] = field(default_factory=dict)
    locked: Log = field(default_factory=list)
    """Of the last run that was proved not to creep."""
    windows: list[Observation] = field(default_factory=list)
    """What is proved between two amplitudes."""

    def _course(self, amplitude: Fraction, start: State) -> tuple[Fate, float]:
        """Return the fate in float64, and where x_G has come to apart from a steady advance."""
        drive = Cycles(amplitude, self.cycles)
        course = SettlingChain(self.chain, drive, start)
        found, stop = numerical_fate(course, start, self.limits)
        if stop is Stop.DEADLINE:
            raise OutOfTime(found.reason)
        steady = found.cycles * (found.advance or 0.0) / (found.period or 1)
        return found, float(course.simulation.state().displacements.mean()) - steady

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
        """Return whether the chain creeps: what has not settled has not locked."""
        for known in (self.certified, self.sensitive):
            if amplitude in known:
                return known[amplitude]
        found, place = self._course(amplitude, self.start)
        creeps = found.outcome not in _IDLE
        if found.outcome in (Outcome.AT_REST, Outcome.RUNAWAY) or self.solver == "exact":
            return creeps
        for seed in (1, 2):
            other = State.perturbed(self.chain, _TWIN, start_seed=seed)
            tensions = self.start.tensions + other.tensions
            twin, there = self._course(amplitude, replace(self.start, tensions=tensions))
            same = (twin.outcome, twin.period) == (found.outcome, found.period)
            if not same or (found.period == 1 and abs(there - place) > 1e-6):
                break
        else:
            return creeps
        if found.outcome is not Outcome.LIMIT and self.chain.n <= SHORT:
            trial = self.tried(amplitude, self.solver, {})
            if trial.evidence is Evidence.PROVED:
                self.certified[amplitude] = trial.creeps
                return trial.creeps
        self.sensitive[amplitude] = creeps
        return creeps

    def tried(self, amplitude: Fraction, solver: str, options: dict[str, Any]) -> Observation:
        if solver == "exact":
            found = self.float_fate(amplitude)
            most = min(max(found.cycles, 1), CERTIFIED_CYCLES)
            past = Question(self.chain, most, self.start, self.limits)
            trial = past.tried(amplitude, solver, options)
            return trial._replace(
                creeps=found.outcome not in _IDLE,
                outcome=found.outcome,
                outcome_evidence=trial.evidence,
                direction=found.direction,
            )
        for trial in self.windows:
            if trial.fate and trial.between and trial.between[0] < amplitude < trial.between[1]:
                return trial._replace(fate=replace(trial.fate, amplitude=amplitude))
        drive = Cycles(amplitude, min(self.cycles, CERTIFIED_CYCLES))
        digits: int = options.get("digits", 0)
        edge: Fraction | None = None

        def far_beyond(
            log: Log,
        ) -> bool:  # the runs part so far below that the search goes on there
            nonlocal edge
            edge = parting(self.locked, log) if edge is None else edge
            return edge is not None and abs(amplitude - edge) * 10 ** (digits - 1) > amplitude

        enough = far_beyond if digits and self.locked else None
        proved = proved_fate(self.chain, drive, self.start, self.limits, enough=enough)
        found, log, between = proved
        if found.outcome is Outcome.LIMIT:
            self.limits.require()
        creeps, known = found.outcome not in _IDLE, (found.outcome, found.evidence, found.direction)
        if not creeps:
            self.locked[:] = log
        trial = Observation(creeps, found.evidence, log, *known, fate=found, between=between)
        if between is not None:
            self.windows.append(trial)
        return trial


def parting(one: Log, other: Log) -> Fraction | None:
    """Return theta_c of what one of two runs alone comes to, None if they do not part so."""
    for mine, its in zip(one, other, strict=False):
        if (mine.half_cycle, mine.itinerary) == (its.half_cycle, its.itinerary):
            continue
        if mine.half_cycle == its.half_cycle:
            return None
        return abs(exact_value(min(mine, its, key=lambda r: r.half_cycle).theta))
    return None


def side_by_side(one: Observation, other: Observation) -> tuple[Log, Log]:
    """Return what happened in both, that which settled earlier gone on with its last period."""

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

    return gone_on(one, other), gone_on(other, one)
