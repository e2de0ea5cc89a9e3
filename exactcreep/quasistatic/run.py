"""A run on its way: a simulation, the observers beside it, and what they make of it together."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from exactcreep.limits import MEMORY, Stop
from exactcreep.model.disorder import static_coefficients
from exactcreep.model.enclosure import Enclosure, as_float, enclosure, floats
from exactcreep.model.numbers import InputError, nearest_float
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.model.state import State
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.quasistatic.perturbed import PerturbedCopy
from exactcreep.quasistatic.physical_range import PhysicalRange
from exactcreep.quasistatic.recorder import Recorder
from exactcreep.quasistatic.recurrence import RecurrenceObserver, Settled
from exactcreep.quasistatic.result import COUNTS, Creep
from exactcreep.quasistatic.velocity import Mark, MeanVelocity, next_look
from exactcreep.solvers.solver import Stretch, require
from exactcreep.solvers.tables import RECORDS

_LEAST_BYTES = 500  # of memory for a slider
_MOST_SAVED = 16  # snapshots from which a state of the run is computed again
_MOST_SAVED_SLIDERS = 2**17  # in all of them
_TRANSIENT = "the run lies within its burn-in: the advance may be that of a transient"
NEARLY = "the tensions return to within "
"""How the reason begins of a chain that has settled so."""


@dataclass(frozen=True)
class Behaviour:
    """What a chain does at the end of a run, and since which cycle.

    `velocity` is that of its cycle, if it has settled; `doubtful` whether that is undecided.
    """

    outcome: Outcome
    since: int | None = None
    reason: str = ""
    doubtful: bool = False
    velocity: Enclosure | None = None


class ObservedRun:
    """A simulation on its way along its drive, and its observers.

    Attributes
    ----------
    done : int
        Targets reached.
    outcome : Outcome or None
        Why it ended before the last target, with the `reason`.
    seconds : float
        Since the very start, over all sessions.
    saved : mapping of int to mapping
        Snapshots, by targets reached.
    """

    def __init__(self, experiment: Experiment, memory: int = MEMORY) -> None:
        _check_memory(experiment.chain.n)
        self.experiment = experiment
        self.total = experiment.drive.half_cycles
        self.done = 0
        self.outcome: Outcome | None = None
        self.reason = ""
        self.seconds = 0.0
        self.saved: dict[int, Mapping[str, Any]] = {}
        self.recorder = Recorder(experiment, memory)
        self.velocity = MeanVelocity(experiment)
        self.range = PhysicalRange(experiment)
        self.recurrence = RecurrenceObserver(experiment) if experiment.drive.cyclic else None
        watched = (self.recorder, self.velocity, self.range, self.recurrence)
        needs = {name for observer in watched if observer is not None for name in observer.needs}
        chain, start, seed = experiment.chain, experiment.initial, experiment.seed
        if experiment.algorithm.perturbs and chain.n > 1:
            needs |= {"tension", "slips"}
        record = tuple(name for name in RECORDS if name in needs)
        self.simulation = experiment.algorithm.simulation(chain, start, seed, record)
        self.copy = PerturbedCopy(experiment, self.simulation)

    @property
    def observers(self) -> dict[str, Any]:
        """Those that look at every target, by name."""
        named = {"velocity": self.velocity, "range": self.range, "copy": self.copy}
        return named | ({} if self.recurrence is None else {"recurrence": self.recurrence})

    @property
    def ended(self) -> bool:
        """Whether no further target can be reached, or need be."""
        return self.outcome is Outcome.RUNAWAY or self.done == self.total or self.accurate

    @property
    def next(self) -> int:
        """The next target at which an observer wants to look."""
        return min(self.velocity.next(self.done), self.copy.next(self.done), self.total)

    def take(self, stretch: Stretch) -> None:
        """Take over what the simulation did on the way to some further targets."""
        first = self.done + 1
        self.recorder.take(stretch, first, self.simulation)
        if stretch.completed:
            for observer in self.observers.values():
                observer.take(stretch, first, self.simulation)
            self.done += stretch.completed
            self._save()
        if stretch.stop.final:
            runaway = stretch.stop is Stop.RUNAWAY
            self.outcome = Outcome.RUNAWAY if runaway else Outcome.LIMIT
            self.reason = stretch.reason

    def _save(self) -> None:
        """Save how far the simulation is, at fewer and fewer of the targets that are passed."""
        most = min(_MOST_SAVED, _MOST_SAVED_SLIDERS // self.experiment.chain.n)
        if self.done - max(self.saved, default=0) < self.done // max(most, 1) or not most:
            return
        if not self.simulation.at_rest or self.done == self.total:
            return
        self.saved[self.done] = self.simulation.snapshot()
        if len(self.saved) > most:
            # the one whose neighbours are nearest to each other
            kept = [0, *sorted(self.saved)]
            spare = min(range(1, len(kept) - 1), key=lambda i: kept[i + 1] - kept[i - 1])
            del self.saved[kept[spare]]

    # -- what it comes to ----------------------------------------------------------------------

    @property
    def accurate(self) -> bool:
        """Whether the velocity is known as well as was asked for, at a target to look at."""
        wanted, done = self.experiment.accuracy, self.done
        if wanted is None or next_look(done - 1) != done:
            return False
        return self.relative_error() <= wanted

    def relative_error(self) -> float:
        """Return the relative error of the mean velocity at 95 %, nan if that is not known."""
        if self.recurrence is not None and self.recurrence.settled() is not None:
            return 0.0
        burn_in, velocity = self.velocity.mean(self.done)
        value = 0.0 if velocity is None else abs(nearest_float(velocity.middle))
        return 1.96 * self.velocity.error(burn_in) / value if value else math.nan

    def result(self) -> Creep:
        """Return what is known of the run."""
        simulation, experiment = self.simulation, self.experiment
        tally, state = replace(simulation.tally), simulation.state()
        burn_in, velocity = self.velocity.mean(self.done)
        error = self.velocity.error(burn_in)
        found = (
            Behaviour(self.outcome, reason=self.reason) if self.outcome else self.behaviour(state)
        )
        if velocity is not None and found.velocity is not None:
            velocity, error = found.velocity, 0.0
        value = math.nan if velocity is None else nearest_float(velocity.middle)
        if found.outcome is Outcome.RUNAWAY:
            value = math.copysign(math.inf, nearest_float(experiment.chain.tan_alpha))
            velocity, error = None, math.nan
        doubted = self.copy.doubted_from
        if not doubted and simulation.evidence is Evidence.UNDECIDED:
            doubted = self.done + 1
        counts: dict[str, Any] = {COUNTS[name]: count for name, count in vars(tally).items()}
        beyond = {"draws_below_mu_d": tally.draws_below_mu_d} | self.range.kept()
        report = simulation.report()
        if experiment.accuracy is not None:
            reached = 0.0 if found.velocity is not None else self.relative_error()
            report |= {
                "accuracy": experiment.accuracy,
                "relative_error": reached,
                "accuracy_reached": reached <= experiment.accuracy,
            }
        burnt = self.velocity.burnt(self.done)
        return Creep(
            experiment=experiment,
            outcome=found.outcome,
            evidence=Evidence.of(doubted or found.doubtful, simulation.evidence),
            reason=found.reason,
            velocity=value,
            velocity_error=error,
            velocity_enclosure=velocity if experiment.digits and burnt else None,
            half_cycles=self.done,
            burn_in=burn_in,
            **counts,
            undecided_from=doubted,
            trusted_half_cycles=self.copy.trusted_up_to,
            warnings={name: count for name, count in beyond.items() if count},
            seconds=self.seconds,
            state=state,
            recorded=self.recorder.columns(),
            report=report,
            since=found.since,
            saved=self.saved,
        )

    def behaviour(self, state: State) -> Behaviour:
        """Return what the chain does at the end, once every target is reached; see `creep`."""
        begin, all_burn_in = self.velocity.burnt(self.done), False
        if begin is None or begin.done == self.done:
            begin, all_burn_in = self.velocity.marks[0], True
        advanced = self._advanced_since(begin, state)
        if self.recurrence is None:
            if self.simulation.tally.events == begin.events:
                return Behaviour(Outcome.AT_REST)
            return self._drifting(advanced, None)
        settled = self.recurrence.settled()
        if settled is None and (approach := self.recurrence.approaching()):
            cycle, change = approach
            reason = f"locked in the limit: tensions still change by {change:.1e} m g per cycle"
            return Behaviour(Outcome.CYCLING, cycle, reason, doubtful=True, velocity=STILL)
        if settled is None:
            found = self._drifting(advanced, begin.done // 2)
            unclear = all_burn_in and self.experiment.chain.sigma_mu == 0
            if unclear and found.outcome is Outcome.CREEPING:
                return replace(found, reason=_TRANSIENT, doubtful=True)
            return found
        found = _settled(settled)
        if found.outcome is not Outcome.CREEPING and advanced and not found.reason:
            remark = f"the chain advanced in a transient only, up to cycle {found.since}"
            return replace(found, reason=remark)
        return found

    def _drifting(self, advanced: bool, since: int | None) -> Behaviour:
        """Return what is known of a chain that has not settled, from its drift."""
        burn_in, velocity = self.velocity.mean(self.done)
        least = self.velocity.error(burn_in, least=True)
        value = math.nan if velocity is None else abs(nearest_float(velocity.middle))
        if value < 2 * least:
            known = self.velocity.error(self.experiment.burn_in_of(self.done))
            bound = "which may be larger than their estimate"
            if not math.isnan(known):
                bound = f"|velocity| is at most {value + 2 * least:.2g}"
            reason = f"no drift is seen beyond two standard errors: {bound}"
            return Behaviour(Outcome.CYCLING, since, reason, doubtful=True)
        if advanced:
            return Behaviour(Outcome.CREEPING, since)
        if since is None or self.experiment.chain.sigma_mu != 0:
            return Behaviour(Outcome.CYCLING, since)
        reason = "not every slider has advanced, and the tensions have not returned"
        return Behaviour(Outcome.CYCLING, since, reason, doubtful=True)

    def _advanced_since(self, begin: Mark, state: State) -> bool:
        """Return whether every slider has moved the same way, by more than rounding can make."""
        change = floats(state.displacements) - begin.displacements
        slips = self.simulation.tally.slips - begin.slips
        rounding = nearest_float(slips * self.experiment.chain.rounding)
        return bool((change > rounding).all() or (change < -rounding).all())

    # -- to go on later ------------------------------------------------------------------------

    def kept(self) -> dict[str, Any]:
        """Return what a checkpoint keeps of it, at rest, but for the rows that were recorded."""
        observers = {name: observer.kept() for name, observer in self.observers.items()}
        return {
            "done": self.done,
            "outcome": "" if self.outcome is None else self.outcome.value,
            "reason": self.reason,
            "seconds": self.seconds,
            "simulation": self.simulation.snapshot(),
            "rows": self.recorder.counts(),
        } | observers

    def restore(self, kept: Mapping[str, Any], rows: Mapping[str, list[Any]]) -> None:
        """Go on from what `kept` returned and the rows of the recorder, or raise `ValueError`."""
        names = {"done", "outcome", "reason", "seconds", "simulation", "rows", *self.observers}
        require(isinstance(kept, Mapping) and kept.keys() == names, "a part of the run is missing")
        done, reason, seconds = kept["done"], kept["reason"], kept["seconds"]
        require(type(done) is int and 0 <= done <= self.total, "there is no such target")
        require(type(reason) is type(kept["outcome"]) is str, "it does not say how it ended")
        known = type(seconds) is float and 0 <= seconds < math.inf
        require(known, "its time is not known")
        self.simulation.restore(kept["simulation"])
        self._require_physics(done)
        self.recorder.restore(rows, kept["rows"])
        for name, observer in self.observers.items():
            observer.restore(kept[name], done)
        counts = self.simulation.tally.events, self.simulation.tally.slips
        marked = all(mark.events <= counts[0] and mark.slips <= counts[1]
                     for mark in self.velocity.marks)  # fmt: skip
        require(marked, "a mark counts more than the run")
        per_target = {"x_G", "x", "tension", "slips"} & kept["rows"].keys()
        require(all(kept["rows"][name] == done for name in per_target), "a target has no row")
        self.done, self.reason, self.seconds = done, reason, seconds
        self.outcome = Outcome(kept["outcome"]) if kept["outcome"] else None
        self._save()

    def _require_physics(self, done: int) -> None:
        """Raise `ValueError` unless the state can be one of this run after so many targets."""
        experiment, state, tally = self.experiment, self.simulation.state(), self.simulation.tally
        chain, drive, initial = experiment.chain, experiment.drive, experiment.initial
        counts = vars(tally).values()
        require(all(0 <= count < 2**60 for count in counts), "a count is out of range")
        theta, ramps = as_float(state.theta), drive.targets(max(done, 1), 2, experiment.seed)
        ends = [experiment.theta, *ramps.tolist()][:2] if done == 0 else ramps.tolist()
        close = 2.0**-40 * max(map(abs, [*ends, theta]))
        require(min(ends) - close <= theta <= max(ends) + close, "theta is not on its way")
        if not experiment.algorithm.needs_slips:
            return
        places, tensions = floats(state.displacements), floats(state.tensions)
        moved = np.diff(places - floats(initial.displacements))
        ramp = nearest_float(chain.l0) * (theta - experiment.theta)
        apart = abs(floats(initial.tensions) + moved - ramp - tensions)
        scale = 2.0**-36 * (1 + float(abs(places).max()) + abs(ramp))
        require(bool((apart <= scale).all()), "tensions and displacements do not belong together")
        held, drawn = floats(state.coefficients), state.draws - initial.draws
        require(bool((drawn >= 0).all()) and drawn.sum() == tally.slips, "draws are not its slips")
        last = enumerate(state.draws.tolist(), 1)
        keyed = [static_coefficients(chain, experiment.seed, n, k - 1, 1)[0] for n, k in last]
        own = np.where(drawn > 0, keyed, floats(initial.coefficients))
        require(bool((held == own).all()), "coefficients are not those that are drawn")
        limits = np.maximum(held, nearest_float(chain.mu_d)) * chain.cos_alpha
        require(bool((abs(state.forces(chain)) <= limits + scale).all()), "a slider does not rest")


STILL = enclosure(0)


def _settled(settled: Settled) -> Behaviour:
    """Return what a chain does that has come back."""
    if settled.period == 0:
        return Behaviour(Outcome.AT_REST, settled.since, velocity=STILL)
    off = settled.apart
    reason = f"{NEARLY}{off:.1e} m g, not exactly" if off else ""
    outcome = Outcome.CYCLING if settled.velocity is None else Outcome.CREEPING
    return Behaviour(outcome, settled.since, reason, bool(off), settled.velocity or STILL)


def _check_memory(n: int) -> None:
    """Raise `InputError` if the memory of this machine cannot hold `n` sliders."""
    try:
        there = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):  # a system that does not tell
        return
    if n * _LEAST_BYTES > there:
        most = there // _LEAST_BYTES
        raise InputError("n", n, f"must be at most {most} to fit into the memory of this machine")
