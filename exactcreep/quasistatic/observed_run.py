"""One run: a simulation, the observers of its targets, and the result of both."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from exactcreep.model.drive import Cycles
from exactcreep.model.enclosure import Enclosure, as_float, floats
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.model.state import State
from exactcreep.quasistatic.behaviour import Behaviour, behaviour
from exactcreep.quasistatic.creep_result import Creep
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.quasistatic.observer import Observer
from exactcreep.quasistatic.physical_range import PhysicalRange
from exactcreep.quasistatic.predictability import Predictability
from exactcreep.quasistatic.recorder import Recorder
from exactcreep.quasistatic.summary import attribute_of
from exactcreep.quasistatic.velocity import MeanVelocity, next_look
from exactcreep.solvers.interface import (
    LONGEST_AVALANCHE,
    Stretch,
    longest_avalanche,
    require,
    require_at_rest,
    require_like,
)
from exactcreep.solvers.return_map import ReturnMap
from exactcreep.solvers.tables import HALF_CYCLE_TABLE, RECORDS
from exactcreep.watch.limits import NO_LIMITS, Limits, Stop
from exactcreep.watch.preparation import clock

PAUSE = 0.1  # seconds between two checks of a run
_MOST_NUMBERS = 1 << 18  # in a column, recorded at once


class Returns(ReturnMap, Observer):
    """Whether the tensions of a run have returned at the ends of its cycles."""

    needs = ("tension", "slips")
    state = ("ends", "forgotten", "noted", "begun", "unlike")


class ObservedRun:
    """A simulation that follows its drive, and its observers.

    `done` targets are reached; `outcome` and `reason` say why it ended before the last;
    `kept_up_to_date`: whether a checkpoint is being written.
    """

    kept_up_to_date = False

    def __init__(self, experiment: Experiment) -> None:
        self.experiment = experiment
        self.total = experiment.drive.target_count
        self.done, self.seconds = 0, 0.0
        self.outcome: Outcome | None = None
        self.reason = ""
        self.recorder = Recorder(experiment)
        self.velocity = MeanVelocity(experiment)
        self.range = PhysicalRange(experiment)
        chain, drive = experiment.chain, experiment.drive
        returns = Returns(chain, experiment.initial, drive) if isinstance(drive, Cycles) else None
        self.return_map = returns
        self.observers: dict[str, Observer] = {"velocity": self.velocity, "range": self.range}
        if self.return_map is not None:
            self.observers["return_map"] = self.return_map
        needs = {*self.recorder.needs, *(n for o in self.observers.values() for n in o.needs)}
        if experiment.algorithm.perturbs and experiment.chain.n > 1:
            needs |= {"tension", "slips"}
        record = tuple(name for name in RECORDS if name in needs)
        self.simulation = experiment.simulation(record)
        self.copy = self.observers["copy"] = Predictability(experiment)

    @property
    def ended(self) -> bool:
        """Whether the run has reached its last target, its accuracy, or an early end."""
        return self.outcome is Outcome.RUNAWAY or self.done == self.total or self._accurate

    @property
    def _accurate(self) -> bool:
        """Whether the velocity has the requested accuracy, at a target where this is tested."""
        wanted, done = self.experiment.accuracy, self.done
        if wanted is None or next_look(done - 1) != done:
            return False
        return self._relative_error() <= wanted

    def _relative_error(self) -> float:
        """Return the relative error of the mean velocity at 95 %, nan if unknown."""
        if self.return_map is not None and self.return_map.settled() is not None:
            return 0.0
        burn_in, velocity = self.velocity.mean(self.done)
        value = 0.0 if velocity is None else abs(as_float(velocity))
        return 1.96 * self.velocity.error(burn_in) / value if value else math.nan

    def go_on(self, limits: Limits, watch: Callable[[], None], pause: float) -> None:
        """Go on until the run ends or a limit is reached; call `watch` after each pause."""
        self.outcome, self.reason, self.copy.limits = None, "", limits
        simulation, drive, before = self.simulation, self.experiment.drive, self.seconds
        longest = max(_MOST_NUMBERS // self.experiment.chain.n, 1)  # targets at once
        reached_with = events = simulation.tally.events  # when the last target was reached
        begin = watched = clock()
        while self.outcome is None and not self.ended:
            left = limits.after(events)
            if why := self._given_up(left, events - reached_with):
                self.outcome, self.reason = Outcome.LIMIT, why
                break
            left = replace(left, pause=watched + pause)
            ahead = min(observer.next(self.done) for observer in self.observers.values())
            count = min(ahead - self.done, self.total - self.done, longest)
            stretch = simulation.follow(drive, self.done + 1, count, left)
            self.take(stretch)
            events = simulation.tally.events
            reached_with = events if stretch.completed else reached_with
            now = clock()
            self.seconds = before + now - begin
            if now >= watched + pause:
                self._rest(left)
                watched = now
                watch()
        watch()

    def take(self, stretch: Stretch) -> None:
        self.recorder.take(stretch)
        if stretch.completed:
            for observer in self.observers.values():
                observer.take(stretch, self.done + 1, self.simulation)
            self.done += stretch.completed
        if stretch.stop.final:
            self.outcome = Outcome.RUNAWAY if stretch.stop is Stop.RUNAWAY else Outcome.LIMIT
            self.reason = stretch.reason

    def _given_up(self, limits: Limits, events: int) -> str:
        """Return which limit is reached, `events` after the last target; "" if none is."""
        if self.recorder.full:
            return self.recorder.full
        early = limits.stop(0)
        if early is Stop.DEADLINE:
            self._rest(NO_LIMITS)
        if early is not None:
            return limits.reason(early)
        # at tan_alpha >= mu_d the chain need not lose energy: sliders may stop and start for ever
        experiment = self.experiment
        wide = experiment.widest >= 1
        longest = LONGEST_AVALANCHE if wide else longest_avalanche(experiment.chain)
        if limits.events is None and events >= longest:
            why = "|theta| reaches 1" if wide else "tan_alpha >= mu_d"
            return (
                f"{why}, and after {events} events in one half-cycle the chain is"
                " neither at rest nor proved to run away; max_events lets it go on"
            )
        return ""

    def _rest(self, limits: Limits) -> None:
        """Let a rearrangement end if it does so soon, because a snapshot needs a chain at rest."""
        if self.kept_up_to_date and self.outcome is None:
            soon = replace(limits, pause=clock() + PAUSE)
            self.recorder.add(self.simulation.come_to_rest(soon))

    def _state(self) -> State:
        return self.experiment.algorithm.state_of(self.simulation, self.experiment.chain)

    def result(self) -> Creep:
        simulation, experiment, done = self.simulation, self.experiment, self.done
        tally, state = replace(simulation.tally), self._state()
        counts = vars(tally).copy()
        if self.outcome is None:
            ended = behaviour(self.velocity, self.return_map, state, tally, done)
        else:
            never = self.outcome is Outcome.RUNAWAY  # it provably never comes to rest
            known = Evidence.PROVED if never else Evidence.UNDECIDED
            ended = Behaviour(self.outcome, reason=self.reason, evidence=known)
        burn_in, mean = self.velocity.mean(done)
        velocity, error, exact = self._velocity(ended, burn_in, mean)
        known_until = self.copy.known_until(done)
        evidence = Evidence.of(done - known_until, simulation.evidence)
        beyond = {"draws_below_mu_d": tally.draws_below_mu_d} | self.range.kept()
        report = {"undecided": counts.pop("undecided")} | simulation.report()
        if experiment.accuracy is not None:
            reached = 0.0 if ended.velocity is not None else self._relative_error()
            report |= {"accuracy": experiment.accuracy, "relative_error": reached,
                       "accuracy_reached": reached <= experiment.accuracy}  # fmt: skip
        return Creep(
            experiment=experiment,
            outcome=ended.outcome,
            evidence=evidence,
            known_until=known_until,
            outcome_evidence=evidence.and_then(ended.evidence),
            reason=ended.reason,
            velocity=velocity,
            velocity_error=error,
            velocity_enclosure=exact if experiment.digits and self.velocity.burnt(done) else None,
            half_cycles=done,
            burn_in=burn_in,
            **{attribute_of(name): count for name, count in counts.items()},
            warnings={name: count for name, count in beyond.items() if count},
            seconds=self.seconds,
            state=state,
            recorded=self.recorder.columns(),
            report=report,
            since=ended.since,
        )

    def _velocity(
        self, ended: Behaviour, burn_in: int, mean: Enclosure | None
    ) -> tuple[float, float, Enclosure | None]:
        """Return the velocity of a run that ended so, its standard error, and all its digits."""
        if ended.outcome is Outcome.RUNAWAY:
            return math.copysign(math.inf, self.experiment.chain.heading), math.nan, None
        if mean is None:
            return math.nan, self.velocity.error(burn_in), None
        if ended.velocity is not None:
            return as_float(ended.velocity), 0.0, ended.velocity
        return as_float(mean), self.velocity.error(burn_in), mean

    def kept(self) -> dict[str, Any]:
        """Return the snapshot for a checkpoint, at rest, without the recorded rows."""
        return {
            "done": self.done,
            "outcome": "" if self.outcome is None else self.outcome.value,
            "reason": self.reason,
            "seconds": self.seconds,
            "simulation": self.simulation.snapshot(),
            "rows": self.recorder.counts(),
        } | {name: observer.kept() for name, observer in self.observers.items()}

    def restore(self, kept: Mapping[str, Any], rows: Mapping[str, list[Any]]) -> None:
        """Continue from a snapshot and the rows of the recorder, or raise `ValueError`."""
        require_like(self.kept() | dict.fromkeys(("rows", "simulation", *self.observers)), kept)
        self.simulation.restore(kept["simulation"])
        self.recorder.restore(rows)
        for name, observer in self.observers.items():
            observer.restore(kept[name])
        self.done, self.reason, self.seconds = kept["done"], kept["reason"], kept["seconds"]
        self.outcome = Outcome(kept["outcome"]) if kept["outcome"] else None
        require(0 <= self.done <= self.total, f"it has reached {self.done} of {self.total} targets")
        chain, state = self.experiment.chain, self._state()
        held = np.maximum(floats(state.coefficients), chain.floats("mu_d")) * chain.cos_alpha
        require_at_rest(state.forces(chain), held)
        counts = self.recorder.counts()
        due = {name: self.done for name in counts if name in HALF_CYCLE_TABLE.columns}
        require(counts == kept["rows"] | due, "it lacks recorded rows")
