"""A march: a simulation on its way along its drive, and what it has recorded and measured."""

from __future__ import annotations

import copy
import math
import os
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exactcreep.limits import MEMORY, Limits, Stop
from exactcreep.model.drive import Cycles
from exactcreep.model.numbers import InputError, exact_number, nearest_float
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.model.state import State
from exactcreep.quasistatic.decimals import Enclosure, as_written, enclosure, floats
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.quasistatic.result import Creep
from exactcreep.quasistatic.store import Store
from exactcreep.quasistatic.twin import Watch
from exactcreep.solvers.auto import concluded
from exactcreep.solvers.exact.solver import Exact
from exactcreep.solvers.solver import Simulation, Stretch, Tally, advance
from exactcreep.solvers.statistics import rests_for_long, standard_error
from exactcreep.solvers.tables import record_arrays

_MOST_SAMPLES = 4096  # of x_G that are kept for the standard error, however long the run
_LEAST_BYTES = 500  # of memory for a slider
_LONGEST_PERIOD = 64  # cycles: how far back the tensions at the end are looked for
_LONGEST_EXACT = 1000  # the same where the run can be followed again in no time
_MOST_SAVED = 16  # states from which one of the run is computed again
_MOST_SAVED_SLIDERS = 2**17  # in all of them
_SLOW = ("certified", "mpmath", "reference")
_TRIES = 3  # longer periods
_MOST_AGAIN = 10**7  # events for that
_MOST_MARKED = 2**21  # tensions that are kept for that
NEARLY = "the tensions return to within "
"""How the reason begins of a chain that has settled so."""
_REMEMBERED = 1024  # cycles, at least, whose x_G is kept
_NEAR = 2.0**-40  # how nearly tensions return, in units of the largest that a contact holds
_KEPT = ("done", "outcome", "reason", "seconds", "crossings", "beyond_one", "tail", "samples",
         "burnt", "marks", "course")  # fmt: skip
"""What of a march a checkpoint keeps as it is."""


class March:
    """A simulation on its way along its drive, and what has been recorded on the way."""

    def __init__(
        self,
        experiment: Experiment,
        captured: Mapping[str, Any] | None,
        memory: int = MEMORY,
    ) -> None:
        self.experiment = experiment
        chain, drive = experiment.chain, experiment.drive
        _check_memory(chain.n)
        self.total = drive.half_cycles
        widest = experiment.widest
        self.watch_theta = widest >= 1
        self.watch_gaps = _may_cross(experiment, widest)
        record = experiment.record
        if self.watch_gaps and "x" not in record:
            record = (*record, "x")
        self.simulation: Simulation = experiment.algorithm.simulation(
            chain, experiment.initial, experiment.seed, record
        )
        self.watch = Watch(asked=experiment.twin)
        self.done = 0
        self.outcome: Outcome | None = None
        self.reason = ""
        self.seconds = 0.0  # since the very start, over all sessions
        self.store = Store(memory)
        self.unwritten = ""  # why what is recorded has no room left, if so
        self.crossings = 0
        self.gaps = _gaps(experiment) if self.watch_gaps else np.empty(0)
        self.beyond_one = 0
        self.nothing = record_arrays(dict.fromkeys(experiment.record, ()), chain.n)
        begin = _mean(experiment.initial.displacements)
        start = np.array([nearest_float(begin.middle)])
        self.tail: list[Enclosure] = [begin, begin]  # x_G at the last two targets
        self.samples = Samples(start, 2 if drive.cyclic else 1)
        self.burn_in = experiment.burn_in_of(self.total)
        self.origin = Mark.of(self)
        self.burnt: Mark | None = None
        self.marks: list[Mark] = []  # at the ends of the last cycles, but for the very last
        # a block ends where the run will be looked back to
        self.boundaries = {self.burn_in}
        if drive.cyclic:
            period = max(1, min(self._depth, _MOST_MARKED // chain.n))
            self.boundaries |= set(range(max(self.total - 2 * period, 0), self.total, 2))
        self.saved: dict[int, Mapping[str, Any]] = {}
        self.unseen = 0.0  # how far apart tensions may be that count as the same
        self.course = Course(start)
        if captured is not None:
            self._restore(captured)
        else:
            self._mark()

    @property
    def _depth(self) -> int:
        """How many cycles before the last are kept: many, where a cycle takes long anyway."""
        return _LONGEST_EXACT if self.experiment.algorithm.name in _SLOW else _LONGEST_PERIOD

    @property
    def ended(self) -> bool:
        """Whether no further target can be reached."""
        return self.outcome is Outcome.RUNAWAY or self.done == self.total

    @property
    def room(self) -> int:
        """Targets up to the next one that will be looked back to, or the last."""
        ends = [boundary for boundary in self.boundaries if boundary > self.done]
        ends.append(self.watch.next)
        return min([self.total, *ends]) - self.done

    def take(self, stretch: Stretch) -> None:
        """Take over what `follow` came to."""
        recorded = stretch.recorded
        experiment = self.experiment
        if stretch.completed:
            first = self.done + 1
            raw = recorded["x_G"]
            self.tail = [*self.tail, *map(enclosure, raw[-2:].tolist())][-2:]
            self.samples.add(first, floats(raw))
            if experiment.drive.cyclic:
                self.course.add(floats(raw)[first % 2 :: 2])
            if self.watch_theta:
                theta = experiment.drive.targets(first, stretch.completed, experiment.seed)
                self.beyond_one += int(np.count_nonzero(np.abs(theta) >= 1))
            if self.watch_gaps:
                gaps = self.gaps + np.diff(floats(recorded["x"]), axis=1)
                self.crossings += int(np.count_nonzero((gaps <= 0).any(axis=1)))
            self.done += stretch.completed
            self._mark()
            last = self.done == self.total
            self.watch.look(self.simulation, experiment.drive, self.done, last=last)
            self._save()
        for name, values in recorded.items():
            if name in self.nothing and len(values):
                for part, array in as_written(name, values, experiment.digits).items():
                    self._keep(part, array)
        if stretch.stop.final:
            runaway = stretch.stop is Stop.RUNAWAY
            self.outcome = Outcome.RUNAWAY if runaway else Outcome.LIMIT
            self.reason = stretch.reason

    def _keep(self, name: str, rows: NDArray[Any]) -> None:
        try:
            self.store.add(name, rows)
        except OSError as error:
            folder = tempfile.gettempdir()
            self.unwritten = f"what is recorded cannot be kept in {folder}: {error.strerror}"

    def _save(self) -> None:
        """Save how far the simulation is, at fewer and fewer of the targets that are passed."""
        most = min(_MOST_SAVED, _MOST_SAVED_SLIDERS // self.experiment.chain.n)
        if self.done - max(self.saved, default=0) < self.done // max(most, 1) or not most:
            return
        self.saved[self.done] = self.simulation.capture()
        if len(self.saved) > most:
            # the one whose neighbours are nearest to each other
            kept = [0, *sorted(self.saved)]
            spare = min(range(1, len(kept) - 1), key=lambda i: kept[i + 1] - kept[i - 1])
            del self.saved[kept[spare]]

    def _mark(self) -> None:
        if self.done == self.burn_in:
            self.burnt = Mark.of(self)
        late = self.done >= self.total - 2 * self._depth
        if self.experiment.drive.cyclic and late and self.done in self.boundaries:
            self.marks.append(Mark.of(self))

    def capture(self) -> dict[str, Any]:
        """Return everything needed to go on bit for bit, as a checkpoint holds it."""
        kept = {name: getattr(self, name) for name in _KEPT}
        twin, recorded = self.watch.capture(), self.store.arrays()
        return kept | {"simulation": self.simulation.capture(), "watch": twin, "recorded": recorded}

    def _restore(self, captured: Mapping[str, Any]) -> None:
        self.simulation.restore(captured["simulation"])
        self.watch.restore(captured["watch"], self.simulation)
        self.store.restore(captured["recorded"])
        vars(self).update({name: captured[name] for name in _KEPT})
        self._save()

    def result(self) -> Creep:
        """Return what the run has come to."""
        simulation, experiment = self.simulation, self.experiment
        tally = copy.copy(simulation.tally)
        state = simulation.state()
        burn_in, velocity = self._measured()
        error = self.samples.error(burn_in, experiment)
        evidence, since = simulation.evidence, None
        outcome, reason = self.outcome, self.reason
        if outcome is None:
            found = self._behaviour(state)
            outcome, reason, since = found.outcome, found.reason, found.since
            if found.doubtful:
                evidence = Evidence.UNDECIDED
            if velocity is not None and found.velocity is not None:
                velocity, error = found.velocity, 0.0
        value = math.nan if velocity is None else nearest_float(velocity.middle)
        if outcome is Outcome.RUNAWAY:
            value = math.copysign(math.inf, nearest_float(experiment.chain.tan_alpha))
            velocity, error = None, math.nan
        doubted = self.watch.doubted_from
        if not doubted and simulation.evidence is Evidence.UNDECIDED:
            doubted = self.watch.checked + 1
        return Creep(
            experiment=experiment,
            outcome=outcome,
            evidence=Evidence.UNDECIDED if doubted else evidence,
            undecided_from=doubted,
            trusted_half_cycles=self.watch.trusted_up_to,
            reason=reason,
            since=since,
            velocity=value,
            velocity_error=error,
            velocity_enclosure=velocity if experiment.digits and self.burnt else None,
            half_cycles=self.done,
            burn_in=burn_in,
            rearrangements=tally.rearrangements,
            event_count=tally.events,
            slip_count=tally.slips,
            draws_below_mu_d=tally.draws_below_mu_d,
            undecided=tally.undecided,
            long_rearrangements=tally.long_rearrangements,
            warnings=self._warnings(tally),
            seconds=self.seconds,
            state=state,
            recorded=self.nothing | self.store.arrays(),
            report=concluded(simulation.report(), value, error),
            saved=self.saved,
        )

    def _measured(self) -> tuple[int, Enclosure | None]:
        """Return the burn-in, and the mean velocity after it if there is any; see `Drive.per`."""
        burn_in = self.experiment.burn_in_of(self.done)
        if self.burnt is not None:
            burn_in, begin = self.burnt.done, self.burnt.x_G
        else:  # it ended before the planned burn-in did: take a shorter one, where x_G is known
            burn_in, value = self.samples.first_after(burn_in)
            begin = Enclosure(Fraction(value), Fraction(0))
        # whole cycles only: within one, the chain goes up as well as down
        partial = self.done % 2 if self.experiment.drive.cyclic else 0
        last = self.done - partial
        if last <= burn_in:
            return min(burn_in, self.done), None
        left, reached = self.experiment.drive.clock(np.array([burn_in, last])).tolist()
        span = Fraction(reached) - Fraction(left)
        if not span:
            return burn_in, None
        end = self.tail[-1 - partial]
        middle = (end.middle - begin.middle) / span
        return burn_in, Enclosure(middle, (end.radius + begin.radius) / span)

    def _behaviour(self, state: State) -> Behaviour:
        """Return what the chain does at the end, once every target is reached; see `creep`."""
        burn_in, velocity = self._measured()
        error = self.samples.error(burn_in, self.experiment, least=True)
        begin = self.burnt
        if begin is None or begin.done == self.done:
            begin = self.origin
        advanced = self._advanced_since(begin, state)
        if not self.experiment.drive.cyclic:
            if self.simulation.tally.events == begin.tally.events:
                return Behaviour(Outcome.AT_REST)
            return self._drifting(advanced, velocity, error, None)
        settled = self._settled(state)
        if settled is None:
            return self._drifting(advanced, velocity, error, begin.done // 2)
        if settled.outcome is not Outcome.CREEPING and advanced and not settled.reason:
            remark = f"the chain advanced in a transient only, up to cycle {settled.since}"
            return replace(settled, reason=remark)
        return settled

    def _settled(self, state: State) -> Behaviour | None:
        """Return what the last cycles show if they have brought the tensions back."""
        still, chain = Enclosure(Fraction(0), Fraction(0)), self.experiment.chain
        events = self.simulation.tally.events
        if self.marks and events == self.marks[-1].tally.events:
            return Behaviour(Outcome.AT_REST, self._since(1), velocity=still)
        if chain.sigma_mu != 0:  # no contact gets back its threshold
            return None
        for mark in reversed(self.marks):
            apart = mark.apart(state)
            if apart <= self.unseen:
                apart = 0.0
            period = (self.done - mark.done) // 2
            # what returns but nearly is believed if it does so for another period
            twice = self.course.cycles - self.course.repeats_since(period) >= 2 * period
            if apart and not (apart <= self._close and twice):
                continue
            since = self._since(period)
            if apart and self.course.cycles - since < 2 * period:
                continue
            reason = f"{NEARLY}{apart:.1e} m g, not exactly" if apart else ""
            if not self._advanced_since(mark, state):
                return Behaviour(Outcome.CYCLING, since, reason, bool(apart), still)
            moved, begun = self.tail[-1], mark.x_G
            velocity = Enclosure(
                (moved.middle - begun.middle) / (2 * period),
                (moved.radius + begun.radius) / (2 * period),
            )
            return Behaviour(Outcome.CREEPING, since, reason, bool(apart), velocity)
        return self._long_period()

    @property
    def _close(self) -> float:
        """How far apart tensions are that nearly return."""
        chain = self.experiment.chain
        return _NEAR * (chain.friction + chain.excess + abs(chain.sin_alpha))

    def _since(self, period: int) -> int:
        """Return the cycle from which on the tensions, and not x_G alone, repeat with `period`.

        As far back as they are known: `exact` is followed again; others keep the last cycles.
        """
        first = self.course.repeats_since(period)
        again = self._followed_again(first, period)
        if again is not None:
            return again[0]
        close = max(self._close, self.unseen)
        for later, mark in zip(self.marks[:period:-1], self.marks[-1 - period :: -1], strict=False):
            if _apart(later.tensions, mark.tensions) > close:
                return max(first, mark.done // 2 + 1)
        return first

    def _followed_again(self, first: int, period: int) -> tuple[int, float] | None:
        """Return the cycle, not before `first`, from which on the tensions repeat with `period`.

        And to within what they do in the end. None if they do not, if it takes too long, or if the
        solver is not `exact`.
        """
        experiment, last = self.experiment, self.done // 2
        drive, limits = experiment.drive, Limits(events=_MOST_AGAIN)
        if not isinstance(experiment.algorithm, Exact) or not isinstance(drive, Cycles):
            return None
        ahead, simulation = (
            experiment.algorithm.simulation(
                experiment.chain, experiment.initial, experiment.seed, record
            )
            for record in ((), ("tension",))
        )
        if advance(ahead, drive, 2 * first, limits).stop is not Stop.DONE:
            return None
        simulation.restore(ahead.capture())
        state = simulation.state()
        # a start may stand at another temperature than the ends of cycles do
        ramp = experiment.chain.l0 * (exact_number(state.theta, "theta") + drive.amplitude)
        rows = (state.tensions + nearest_float(ramp))[None, :]
        cycle, since, off = first, first, 0.0
        while cycle < last:
            count = min(max(2 * period, 64), last - cycle)
            stretch = advance(simulation, drive, 2 * (cycle + count), limits, done=2 * cycle)
            if stretch.stop is not Stop.DONE:
                return None
            rows = np.vstack([rows, stretch.recorded["tension"][1::2]])
            cycle += count
            change = np.diff(rows[period:] - rows[:-period], axis=1, prepend=0.0, append=0.0)
            apart = np.abs(change).max(axis=1)  # of the forces
            far = np.flatnonzero(apart > self._close)
            if far.size:
                since = cycle - rows.shape[0] + 1 + int(far[-1]) + 1
            off = float(apart[-period:].max(initial=0.0))
            if apart.size >= period and not off:
                break
            rows = rows[-period:]
        return (since, off) if last - since >= period else None

    def _long_period(self) -> Behaviour | None:
        """Return what `exact` shows if the tensions return later than others are looked back to."""
        if not isinstance(self.experiment.algorithm, Exact):
            return None
        longer = self.course.periods(_LONGEST_PERIOD + 1, _LONGEST_EXACT)
        for period in islice(longer, _TRIES):
            again = self._followed_again(self.course.repeats_since(period), period)
            if again is None or self.course.cycles - again[0] < 2 * period:
                continue
            since, apart = again
            reason = f"{NEARLY}{apart:.1e} m g, not exactly" if apart else ""
            moved = self.course.values[-1] - self.course.values[-1 - period]
            still = abs(moved) <= _NEAR * max(1.0, abs(self.course.values[-1]))
            velocity = Enclosure(Fraction(0 if still else moved) / (2 * period), Fraction(0))
            outcome = Outcome.CYCLING if still else Outcome.CREEPING
            return Behaviour(outcome, since, reason, bool(apart), velocity)
        return None

    def _drifting(
        self, advanced: bool, velocity: Enclosure | None, error: float, since: int | None
    ) -> Behaviour:
        """Return what is known of a chain that has not settled, from its drift."""
        value = math.nan if velocity is None else abs(nearest_float(velocity.middle))
        if value < 2 * error:
            known = self.samples.error(self.experiment.burn_in_of(self.done), self.experiment)
            bound = "which may be larger than their estimate"
            if not math.isnan(known):
                bound = f"|velocity| is at most {value + 2 * error:.2g}"
            told = f"no drift is seen beyond two standard errors: {bound}"
            return Behaviour(Outcome.CYCLING, since, told, doubtful=True)
        if advanced:
            return Behaviour(Outcome.CREEPING, since)
        chain = self.experiment.chain
        if since is None or chain.sigma_mu != 0:
            return Behaviour(Outcome.CYCLING, since)
        told = "not every slider has advanced, and the tensions have not returned"
        return Behaviour(Outcome.CYCLING, since, told, doubtful=True)

    def _advanced_since(self, begin: Mark, state: State) -> bool:
        """Return whether every slider has moved the same way, by more than rounding can make."""
        change = floats(state.displacements) - begin.displacements
        slips = self.simulation.tally.slips - begin.tally.slips
        rounding = nearest_float(slips * self.experiment.chain.rounding)
        return bool((change > rounding).all() or (change < -rounding).all())

    def _warnings(self, tally: Tally) -> dict[str, int]:
        counted = {
            "draws_below_mu_d": tally.draws_below_mu_d,
            "theta_beyond_one": self.beyond_one,
            "crossings": self.crossings,
        }
        return {name: count for name, count in counted.items() if count}


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


@dataclass(frozen=True)
class Mark:
    """Where the run was at a target that is looked back to."""

    done: int
    x_G: Enclosure
    tally: Tally
    displacements: NDArray[np.float64]
    tensions: NDArray[Any]

    @classmethod
    def of(cls, march: March) -> Mark:
        """Return where `march` is now."""
        state, tally = march.simulation.state(), copy.copy(march.simulation.tally)
        moved = floats(state.displacements)
        return cls(march.done, march.tail[-1], tally, moved, _enclosed(state.tensions))

    def apart(self, state: State) -> float:
        """Return how far the tensions of `state` are from these, 0 if they may be the same."""
        return _apart(_enclosed(state.tensions), self.tensions)

def _apart(now: NDArray[Any], then: NDArray[Any]) -> float:
    """Return how far apart tensions are, 0 if they may be the same."""
    if now.dtype != object:
        return float(np.abs(now - then).max(initial=0))
    largest = 0.0
    for one, other in zip(now.tolist(), then.tolist(), strict=True):
        distance = abs(one.middle - other.middle)
        if distance > one.radius + other.radius:
            largest = max(largest, nearest_float(distance))
    return largest


def _enclosed(values: NDArray[Any]) -> NDArray[Any]:
    """Return floats as they are, numbers of any other arithmetic as `Enclosure`."""
    if values.dtype != object:
        return values
    return _objects([enclosure(value) for value in values.tolist()])


def _objects(values: list[Enclosure]) -> NDArray[Any]:
    array = np.empty(len(values), dtype=object)
    for k, value in enumerate(values):
        array[k] = value
    return array


@dataclass
class Course:
    """x_G at the ends of the last cycles, and since when it has gone on in the same way.

    Every so many cycles the older half is dropped, with a note of the period with which x_G went
    on; what remains depends only on how many cycles were completed.
    """

    values: NDArray[np.float64]
    dropped: int = 0  # values before these
    noted: tuple[int, int] = (0, 0)  # a period, and since which cycle it holds

    @property
    def cycles(self) -> int:
        """Whole cycles so far."""
        return self.dropped + self.values.size - 1

    def add(self, block: NDArray[np.float64]) -> None:
        """Take over x_G at the ends of the next cycles."""
        while block.size:
            room = 2 * _REMEMBERED + 1 - self.values.size
            self.values = np.concatenate([self.values, block[:room]])
            block = block[room:]
            if self.values.size > 2 * _REMEMBERED:
                steps, close = self._steps()
                since = {k: self._repeats_since(k, steps, close) for k in range(1, 65)}
                best = min(since, key=lambda period: (since[period], period))
                self.noted = best, since[best]
                self.values = self.values[_REMEMBERED:]
                self.dropped += _REMEMBERED

    def repeats_since(self, period: int) -> int:
        """Return the first cycle from which on x_G moves with `period`, up to its advance.

        If that was before the cycles that are remembered and another period was noted then, the
        first of these.
        """
        return self._repeats_since(period, *self._steps())

    def _steps(self) -> tuple[NDArray[np.float64], float]:
        """Return the advances of the cycles that are remembered, and how nearly they repeat."""
        return np.diff(self.values), _NEAR * max(1.0, float(np.abs(self.values).max()))

    def _repeats_since(self, period: int, steps: NDArray[np.float64], close: float) -> int:
        if steps.size < period:
            return self.cycles
        if steps.size > period and abs(steps[-1] - steps[-1 - period]) > close:  # most often
            return self.dropped + steps.size - period
        different = np.flatnonzero(np.abs(steps[period:] - steps[:-period]) > close)
        if different.size:
            return self.dropped + int(different[-1]) + 1
        noted, since = self.noted
        return since if noted and period % noted == 0 else self.dropped

    def periods(self, least: int, most: int) -> Iterator[int]:
        """Yield the periods from `least` to `most` that x_G has kept twice at the end."""
        steps, close = self._steps()
        for period in range(least, min(most, steps.size // 2) + 1):
            if abs(steps[-1] - steps[-1 - period]) > close:
                continue  # as almost always
            if (np.abs(steps[-period:] - steps[-2 * period : -period]) <= close).all():
                yield period


@dataclass
class Samples:
    """x_G at equally spaced targets from the start on: never more than a few thousand.

    When there are too many, every other one is dropped; which ones remain depends only on how many
    targets were reached.
    """

    values: NDArray[np.float64]
    spacing: int

    def add(self, first: int, block: NDArray[np.float64]) -> None:
        """Take over x_G at the targets `first`, `first` + 1, ..."""
        wanted = self.spacing * self.values.size
        self.values = np.concatenate([self.values, block[wanted - first :: self.spacing]])
        while self.values.size > _MOST_SAMPLES:
            self.values = self.values[::2]
            self.spacing *= 2

    def first_after(self, target: int) -> tuple[int, float]:
        """Return the first sampled target that is not before `target`, and x_G there."""
        k = min(-(-target // self.spacing), self.values.size - 1)
        return k * self.spacing, float(self.values[k])

    def error(self, burn_in: int, experiment: Experiment, *, least: bool = False) -> float:
        """Return the standard error of the velocity of a run, or `least` what it may be.

        nan if it is unknown.
        """
        drive = experiment.drive
        begin = -(-burn_in // self.spacing)
        targets = (self.values.size - begin) * self.spacing
        moved = self.values[-1] != self.values[0]
        if moved and not least and rests_for_long(experiment.chain, targets):
            return math.nan
        clock = drive.clock(np.arange(begin, self.values.size) * self.spacing)
        silent = math.nan if drive.random else 0.0
        return standard_error(self.values[begin:], clock, silent=silent, least=least)


def _mean(values: NDArray[Any]) -> Enclosure:
    if values.dtype != object:
        return Enclosure(Fraction(math.fsum(values.tolist())) / len(values), Fraction(0))
    known = [enclosure(value) for value in values.tolist()]
    middle = sum((x.middle for x in known), Fraction(0))
    return Enclosure(middle / len(known), sum((x.radius for x in known), Fraction(0)) / len(known))


def _check_memory(n: int) -> None:
    """Raise `InputError` if the memory of this machine cannot hold `n` sliders."""
    try:
        there = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):  # a system that does not tell
        return
    if n * _LEAST_BYTES > there:
        most = there // _LEAST_BYTES
        raise InputError("n", n, f"must be at most {most} to fit into the memory of this machine")


def _gaps(experiment: Experiment) -> NDArray[np.float64]:
    """Return the distances of neighbours less the differences of their displacements: constants."""
    initial = experiment.initial
    theta = nearest_float(enclosure(initial.theta).middle)
    length = (1 + theta) * nearest_float(experiment.chain.l0)
    return length + floats(initial.tensions) - np.diff(floats(initial.displacements))


def _may_cross(experiment: Experiment, widest: float) -> bool:
    """Return whether springs are so short that sliders might cross.

    No resting chain holds a tension beyond the sum of its limits, n (mu_s + |tan_alpha|)
    cos(alpha); twice that, and nine sigma_mu, leave room for random coefficients.
    """
    chain = experiment.chain
    if chain.n == 1:
        return False
    limit = chain.mu_s + 9 * chain.sigma_mu + abs(chain.tan_alpha)
    start = float(np.abs(floats(experiment.initial.tensions)).max())
    return (1 - widest) * nearest_float(chain.l0) <= 2 * chain.n * nearest_float(limit) + start
