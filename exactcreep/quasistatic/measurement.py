"""A simulation on its way along its drive: what is measured and recorded, and what it shows."""

from __future__ import annotations

import copy
import math
import os
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exactcreep.limits import MEMORY, Limits, Stop
from exactcreep.model.disorder import LARGEST_DEVIATE
from exactcreep.model.drive import Cycles
from exactcreep.model.enclosure import Enclosure, as_written, enclosure, enclosures, floats
from exactcreep.model.numbers import InputError, exact_number, nearest_float
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.model.state import State
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.quasistatic.history import NEAR, CycleEnds, Mark, Samples
from exactcreep.quasistatic.result import COUNTS, Creep
from exactcreep.quasistatic.sensitivity import RoundingSensitivity
from exactcreep.quasistatic.store import Store
from exactcreep.solvers.auto import concluded
from exactcreep.solvers.exact.solver import Exact
from exactcreep.solvers.solver import Simulation, Stretch, advance
from exactcreep.solvers.tables import record_arrays

_LEAST_BYTES = 500  # of memory for a slider
_LONGEST_PERIOD = 64  # cycles: how far back the tensions at the end are looked for
_LONGEST_EXACT = 1000  # the same where the run can be followed again in no time
_SLOW = ("certified", "mpmath", "reference")  # and where a cycle takes long anyway
_MOST_MARKED = 2**21  # tensions that are kept for that
_TRIES = 3  # longer periods
_MOST_AGAIN = 10**7  # events for that
_MOST_SAVED = 16  # states from which one of the run is computed again
_MOST_SAVED_SLIDERS = 2**17  # in all of them
_TRANSIENT = "the run lies within its burn-in: the advance may be that of a transient"
NEARLY = "the tensions return to within "
"""How the reason begins of a chain that has settled so."""
_STILL = Enclosure(Fraction(0), Fraction(0))
_KEPT = ("done", "outcome", "reason", "seconds", "crossings", "beyond_one", "tail", "samples",
         "burnt", "marks", "course")  # fmt: skip
"""What of a measurement a checkpoint keeps as it is."""


class Measurement:
    """A simulation on its way along its drive, and what has been recorded on the way."""

    def __init__(
        self,
        experiment: Experiment,
        captured: Mapping[str, Any] | None = None,
        memory: int = MEMORY,
    ) -> None:
        self.experiment = experiment
        chain, drive, record = experiment.chain, experiment.drive, experiment.record
        _check_memory(chain.n)
        self.total = drive.half_cycles
        self.gaps = _narrow_gaps(experiment)
        if self.gaps is not None and "x" not in record:
            record = (*record, "x")
        self.simulation: Simulation = experiment.algorithm.simulation(
            chain, experiment.initial, experiment.seed, record
        )
        self.sensitivity = RoundingSensitivity(asked=experiment.twin)
        self.done = 0
        self.outcome: Outcome | None = None
        self.reason = ""
        self.seconds = 0.0  # since the very start, over all sessions
        self.store = Store(memory)
        self.unwritten = ""  # why what is recorded has no room left, if so
        self.crossings = 0
        self.beyond_one = 0
        self.nothing = record_arrays(dict.fromkeys(experiment.record, ()), chain.n)
        begin = _mean(experiment.initial.displacements)
        start = np.array([nearest_float(begin.middle)])
        self.tail: list[Enclosure] = [begin, begin]  # x_G at the last two targets
        self.samples = Samples(start, 2 if drive.cyclic else 1)
        self.course = CycleEnds(start)
        self.burn_in = experiment.burn_in_of(self.total)
        depth = _LONGEST_EXACT if experiment.algorithm.name in _SLOW else _LONGEST_PERIOD
        cycles = max(1, min(depth, _MOST_MARKED // chain.n))
        self.last_cycles = range(max(self.total - 2 * cycles, 0), self.total, 2)
        if not drive.cyclic:
            self.last_cycles = range(0)
        self.origin = self._marked()
        self.burnt: Mark | None = None
        self.marks: list[Mark] = []  # at the ends of the last cycles, but for the very last
        self.saved: dict[int, Mapping[str, Any]] = {}
        self.unseen = 0.0  # how far apart tensions may be that count as the same
        if captured is None:
            self._mark()
        else:
            self.simulation.restore(captured["simulation"])
            self.sensitivity.restore(captured["watch"], self.simulation)
            self.store.restore(captured["recorded"])
            vars(self).update({name: captured[name] for name in _KEPT})
            self._save()

    def capture(self) -> dict[str, Any]:
        """Return everything needed to go on bit for bit, as a checkpoint holds it."""
        return {name: getattr(self, name) for name in _KEPT} | {
            "simulation": self.simulation.capture(),
            "watch": self.sensitivity.capture(),
            "recorded": self.store.arrays(),
        }

    @property
    def ended(self) -> bool:
        """Whether no further target can be reached."""
        return self.outcome is Outcome.RUNAWAY or self.done == self.total

    @property
    def next(self) -> int:
        """The next target at which the run is looked at, or to which it will be looked back."""
        ends: list[int] = [*self.last_cycles, self.burn_in, self.sensitivity.next, self.total]
        return min(end for end in ends if end > self.done)

    def take(self, stretch: Stretch) -> None:
        """Take over what the simulation did on the way to some further targets."""
        recorded, experiment = stretch.recorded, self.experiment
        if stretch.completed:
            first = self.done + 1
            self.tail = [*self.tail, *map(enclosure, recorded["x_G"][-2:].tolist())][-2:]
            x_G = floats(recorded["x_G"])
            self.samples.add(first, x_G)
            if experiment.drive.cyclic:
                self.course.add(x_G[first % 2 :: 2])
            if experiment.widest >= 1:
                theta = experiment.drive.targets(first, stretch.completed, experiment.seed)
                self.beyond_one += int(np.count_nonzero(np.abs(theta) >= 1))
            if self.gaps is not None:
                gaps = self.gaps + np.diff(floats(recorded["x"]), axis=1)
                self.crossings += int(np.count_nonzero((gaps <= 0).any(axis=1)))
            self.done += stretch.completed
            self._mark()
            self.sensitivity.look(self.simulation, experiment.drive, self.done)
            self._save()
        for name, values in recorded.items():
            if name in self.nothing and len(values):
                for part, rows in as_written(name, values, experiment.digits).items():
                    self._keep(part, rows)
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
            self.burnt = self._marked()
        if self.done in self.last_cycles:
            self.marks.append(self._marked())

    def _marked(self) -> Mark:
        """Return where the run is now; tensions that are not floats as enclosures."""
        state, tally = self.simulation.state(), copy.copy(self.simulation.tally)
        tensions = state.tensions
        if tensions.dtype == object:
            tensions = enclosures(tensions)
        return Mark(self.done, self.tail[-1], tally, floats(state.displacements), tensions)

    def result(self) -> Creep:
        """Return what is known of the run."""
        simulation, experiment = self.simulation, self.experiment
        tally, state = copy.copy(simulation.tally), simulation.state()
        burn_in, velocity = self._mean_velocity()
        error = self.samples.error(burn_in, experiment)
        if self.outcome is None:
            found = self.behaviour(state)
        else:
            found = Behaviour(self.outcome, reason=self.reason)
        if velocity is not None and found.velocity is not None:
            velocity, error = found.velocity, 0.0
        value = math.nan if velocity is None else nearest_float(velocity.middle)
        if found.outcome is Outcome.RUNAWAY:
            value = math.copysign(math.inf, nearest_float(experiment.chain.tan_alpha))
            velocity, error = None, math.nan
        doubted = self.sensitivity.doubted_from
        if not doubted and simulation.evidence is Evidence.UNDECIDED:
            doubted = self.sensitivity.checked + 1
        counts: dict[str, Any] = {COUNTS[name]: count for name, count in vars(tally).items()}
        beyond = {
            "draws_below_mu_d": tally.draws_below_mu_d,
            "theta_beyond_one": self.beyond_one,
            "crossings": self.crossings,
        }
        return Creep(
            experiment=experiment,
            outcome=found.outcome,
            evidence=Evidence.of(doubted or found.doubtful, simulation.evidence),
            reason=found.reason,
            velocity=value,
            velocity_error=error,
            velocity_enclosure=velocity if experiment.digits and self.burnt else None,
            half_cycles=self.done,
            burn_in=burn_in,
            **counts,
            undecided_from=doubted,
            trusted_half_cycles=self.sensitivity.trusted_up_to,
            warnings={name: count for name, count in beyond.items() if count},
            seconds=self.seconds,
            state=state,
            recorded=self.nothing | self.store.arrays(),
            report=concluded(simulation.report(), value, error),
            since=found.since,
            saved=self.saved,
        )

    def _mean_velocity(self) -> tuple[int, Enclosure | None]:
        """Return the burn-in, and the mean velocity after it if there is any; see `Drive.per`."""
        burn_in = self.experiment.burn_in_of(self.done)
        if self.burnt is not None:
            burn_in, begin = self.burnt.done, self.burnt.x_G
        else:  # it ended before the planned burn-in did: take a shorter one, where x_G is known
            burn_in, value = self.samples.first_after(burn_in)
            begin = enclosure(value)
        # whole cycles only: within one, the chain goes up as well as down
        partial = self.done % 2 if self.experiment.drive.cyclic else 0
        last = self.done - partial
        if last <= burn_in:
            return min(burn_in, self.done), None
        left, reached = self.experiment.drive.clock(np.array([burn_in, last])).tolist()
        span = Fraction(reached) - Fraction(left)
        return burn_in, self.tail[-1 - partial].rate(begin, span) if span else None

    def behaviour(self, state: State) -> Behaviour:
        """Return what the chain does at the end, once every target is reached; see `creep`."""
        begin, all_burn_in = self.burnt, False
        if begin is None or begin.done == self.done:
            begin, all_burn_in = self.origin, True
        advanced = self._advanced_since(begin, state)
        if not self.experiment.drive.cyclic:
            if self.simulation.tally.events == begin.tally.events:
                return Behaviour(Outcome.AT_REST)
            return self._drifting(advanced, None)
        settled = self._settled(state)
        if settled is None:
            found = self._drifting(advanced, begin.done // 2)
            unclear = all_burn_in and self.experiment.chain.sigma_mu == 0
            if unclear and found.outcome is Outcome.CREEPING:
                return replace(found, reason=_TRANSIENT, doubtful=True)
            return found
        if settled.outcome is not Outcome.CREEPING and advanced and not settled.reason:
            remark = f"the chain advanced in a transient only, up to cycle {settled.since}"
            return replace(settled, reason=remark)
        return settled

    def _settled(self, state: State) -> Behaviour | None:
        """Return what the last cycles show if they have brought the tensions back."""
        events = self.simulation.tally.events
        if self.marks and events == self.marks[-1].tally.events:
            return Behaviour(Outcome.AT_REST, self._since(1), velocity=_STILL)
        if self.experiment.chain.sigma_mu != 0:  # no contact gets back its threshold
            return None
        for mark in reversed(self.marks):
            apart = mark.apart(state.tensions)
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
            velocity = None
            if self._advanced_since(mark, state):
                velocity = self.tail[-1].rate(mark.x_G, 2 * period)
            return Behaviour.periodic(since, apart, velocity)
        return self._long_period()

    @property
    def _close(self) -> float:
        """How far apart tensions are that nearly return: `NEAR` of what a contact holds."""
        chain = self.experiment.chain
        return NEAR * (chain.friction + chain.excess + abs(chain.sin_alpha))

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
            if mark.apart(later.tensions) > close:
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
        x_G = self.course.values
        longer = self.course.periods(_LONGEST_PERIOD + 1, _LONGEST_EXACT)
        for period in islice(longer, _TRIES):
            again = self._followed_again(self.course.repeats_since(period), period)
            if again is None or self.course.cycles - again[0] < 2 * period:
                continue
            moved = x_G[-1] - x_G[-1 - period]
            still = abs(moved) <= NEAR * max(1.0, abs(x_G[-1]))
            velocity = None if still else Enclosure(Fraction(moved) / (2 * period), Fraction(0))
            return Behaviour.periodic(*again, velocity)
        return None

    def _drifting(self, advanced: bool, since: int | None) -> Behaviour:
        """Return what is known of a chain that has not settled, from its drift."""
        burn_in, velocity = self._mean_velocity()
        least = self.samples.error(burn_in, self.experiment, least=True)
        value = math.nan if velocity is None else abs(nearest_float(velocity.middle))
        if value < 2 * least:
            known = self.samples.error(self.experiment.burn_in_of(self.done), self.experiment)
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
        slips = self.simulation.tally.slips - begin.tally.slips
        rounding = nearest_float(slips * self.experiment.chain.rounding)
        return bool((change > rounding).all() or (change < -rounding).all())


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

    @classmethod
    def periodic(cls, since: int, off: float, velocity: Enclosure | None) -> Behaviour:
        """Return the behaviour of tensions that return to within `off`; None: without advance."""
        reason = f"{NEARLY}{off:.1e} m g, not exactly" if off else ""
        if velocity is None:
            return cls(Outcome.CYCLING, since, reason, bool(off), _STILL)
        return cls(Outcome.CREEPING, since, reason, bool(off), velocity)


def _mean(values: NDArray[Any]) -> Enclosure:
    if values.dtype != object:
        return enclosure(Fraction(math.fsum(values.tolist())) / len(values))
    middles, radii = zip(*enclosures(values), strict=True)
    return Enclosure(sum(middles) / Fraction(len(values)), sum(radii) / Fraction(len(values)))


def _check_memory(n: int) -> None:
    """Raise `InputError` if the memory of this machine cannot hold `n` sliders."""
    try:
        there = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):  # a system that does not tell
        return
    if n * _LEAST_BYTES > there:
        most = there // _LEAST_BYTES
        raise InputError("n", n, f"must be at most {most} to fit into the memory of this machine")


def _narrow_gaps(experiment: Experiment) -> NDArray[np.float64] | None:
    """Return the distances of neighbours less the differences of their displacements: constants.

    None if springs are so long that sliders cannot cross: no resting chain holds a tension beyond
    the sum of its limits, n (mu_s + |tan_alpha|) cos(alpha). Twice that, with the largest random
    coefficients, is taken.
    """
    chain, initial = experiment.chain, experiment.initial
    if chain.n == 1:
        return None
    limit = chain.mu_s + LARGEST_DEVIATE * chain.sigma_mu + abs(chain.tan_alpha)
    tensions, l0 = floats(initial.tensions), nearest_float(chain.l0)
    most = 2 * chain.n * nearest_float(limit) + float(np.abs(tensions).max())
    if (1 - experiment.widest) * l0 > most:
        return None
    length = (1 + nearest_float(enclosure(initial.theta).middle)) * l0
    return length + tensions - np.diff(floats(initial.displacements))
