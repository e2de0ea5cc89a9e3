"""A march: a simulation on its way along its drive, and what it has recorded and measured."""

from __future__ import annotations

import copy
import math
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exactcreep.limits import Stop
from exactcreep.model.drive import Drive
from exactcreep.model.numbers import InputError, nearest_float
from exactcreep.model.state import State
from exactcreep.model.verdict import Outcome
from exactcreep.quasistatic.decimals import Enclosure, as_written, enclosure, floats
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.quasistatic.result import Creep
from exactcreep.solvers.records import record_arrays
from exactcreep.solvers.solver import Simulation, Stretch, Tally

_MOST_SAMPLES = 4096  # of x_G that are kept for the standard error, however long the run
_BLOCKS = 32  # of the block averages behind the standard error
_FEWEST_BLOCKS = 8  # below, their scatter says too little
_LEAST_BYTES = 500  # of memory for a slider


class March:
    """A simulation on its way along its drive, and what has been recorded on the way."""

    def __init__(self, experiment: Experiment, captured: Mapping[str, Any] | None) -> None:
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
        self.done = 0
        self.outcome: Outcome | None = None
        self.reason = ""
        self.seconds = 0.0  # since the very start, over all sessions
        self.bytes = 0
        self.crossings = 0
        self.gaps = _gaps(experiment) if self.watch_gaps else np.empty(0)
        self.beyond_one = 0
        self.nothing = record_arrays(dict.fromkeys(experiment.record, ()), chain.n)
        self.blocks: dict[str, list[NDArray[Any]]] = {}
        begin = _mean(experiment.initial.displacements)
        self.tail: list[Enclosure] = [begin, begin]  # x_G at the last two targets
        self.samples = Samples(nearest_float(begin.middle), 2 if drive.cyclic else 1)
        self.burn_in = experiment.burn_in_of(self.total)
        self.origin = Mark.of(self)
        self.burnt: Mark | None = None
        self.last_cycle: Mark | None = None
        # a block ends where the run will be looked back to
        self.boundaries = {self.burn_in, self.total - 2} if drive.cyclic else {self.burn_in}
        if captured is not None:
            self._restore(captured)
        else:
            self._mark()

    @property
    def ended(self) -> bool:
        """Whether no further target can be reached."""
        return self.outcome is Outcome.RUNAWAY or self.done == self.total

    @property
    def room(self) -> int:
        """Targets up to the next one that will be looked back to, or the last."""
        ends = [boundary for boundary in self.boundaries if boundary > self.done]
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
            if self.watch_theta:
                theta = experiment.drive.targets(first, stretch.completed, experiment.seed)
                self.beyond_one += int(np.count_nonzero(np.abs(theta) >= 1))
            if self.watch_gaps:
                gaps = self.gaps + np.diff(floats(recorded["x"]), axis=1)
                self.crossings += int(np.count_nonzero((gaps <= 0).any(axis=1)))
            self.done += stretch.completed
            self._mark()
        for name, values in recorded.items():
            if name in self.nothing and len(values):
                for part, array in as_written(name, values, experiment.digits).items():
                    self.blocks.setdefault(part, []).append(array)
                    self.bytes += array.nbytes
        if stretch.stop.final:
            runaway = stretch.stop is Stop.RUNAWAY
            self.outcome = Outcome.RUNAWAY if runaway else Outcome.LIMIT
            self.reason = stretch.reason

    def _mark(self) -> None:
        if self.done == self.burn_in:
            self.burnt = Mark.of(self)
        if self.experiment.drive.cyclic and self.done == self.total - 2:
            self.last_cycle = Mark.of(self)

    def recorded(self) -> dict[str, NDArray[Any]]:
        """Return what was recorded, one array for each name."""
        for name, parts in self.blocks.items():
            if len(parts) > 1:
                self.blocks[name] = [np.concatenate(parts)]
        return {name: parts[0] for name, parts in self.blocks.items()}

    def capture(self) -> dict[str, Any]:
        """Return everything needed to go on bit for bit, as plain data."""
        return {
            "simulation": self.simulation.capture(),
            "done": self.done,
            "outcome": None if self.outcome is None else self.outcome.value,
            "reason": self.reason,
            "seconds": self.seconds,
            "crossings": self.crossings,
            "beyond_one": self.beyond_one,
            "recorded": self.recorded(),
            "tail": [tuple(x) for x in self.tail],
            "samples": self.samples.capture(),
            "burnt": None if self.burnt is None else self.burnt.capture(),
            "last_cycle": None if self.last_cycle is None else self.last_cycle.capture(),
        }

    def _restore(self, captured: Mapping[str, Any]) -> None:
        self.simulation.restore(captured["simulation"])
        self.done = captured["done"]
        self.outcome = None if captured["outcome"] is None else Outcome(captured["outcome"])
        self.reason = captured["reason"]
        self.seconds = captured["seconds"]
        self.crossings = captured["crossings"]
        self.beyond_one = captured["beyond_one"]
        self.blocks = {name: [array] for name, array in captured["recorded"].items()}
        self.bytes = sum(array.nbytes for array in captured["recorded"].values())
        self.tail = [Enclosure(*x) for x in captured["tail"]]
        self.samples.restore(captured["samples"])
        self.burnt = Mark.restored(captured["burnt"])
        self.last_cycle = Mark.restored(captured["last_cycle"])

    def result(self) -> Creep:
        """Return what the run has come to."""
        simulation, experiment = self.simulation, self.experiment
        tally = copy.copy(simulation.tally)
        state = simulation.state()
        burn_in, velocity = self._measured()
        value = math.nan if velocity is None else nearest_float(velocity.middle)
        error = self.samples.error(burn_in, experiment.drive)
        outcome, reason = self.outcome, self.reason
        if outcome is None:
            outcome, reason = self._behaviour(state)
        if outcome is Outcome.RUNAWAY:
            value = math.copysign(math.inf, nearest_float(experiment.chain.tan_alpha))
            velocity, error = None, math.nan
        return Creep(
            experiment=experiment,
            outcome=outcome,
            evidence=simulation.evidence,
            reason=reason,
            velocity=value,
            velocity_error=error,
            velocity_enclosure=velocity if experiment.digits and self.burnt else None,
            half_cycles=self.done,
            burn_in=burn_in,
            **asdict(tally),
            warnings=self._warnings(tally),
            seconds=self.seconds,
            state=state,
            recorded=self.nothing | self.recorded(),
            report=simulation.report(),
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

    def _behaviour(self, state: State) -> tuple[Outcome, str]:
        """Return what the chain does once every target is reached, and a remark; see `creep`."""
        tally, last = self.simulation.tally, self.last_cycle
        begin = self.burnt
        if begin is None or begin.done == self.done:
            begin = self.origin
        advanced = self._advanced_since(begin, state)
        if last is None:
            at_rest = tally.events == begin.tally.events
        else:
            at_rest = tally.events == last.tally.events
            if last.same_tensions(state):
                begin = last
        if at_rest or not self._advanced_since(begin, state):
            remark = "the chain advanced in a transient only, before the last cycle"
            return Outcome.AT_REST if at_rest else Outcome.CYCLING, remark if advanced else ""
        return Outcome.CREEPING, ""

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
class Mark:
    """Where the run was at a target that is looked back to."""

    done: int
    x_G: Enclosure
    tally: Tally
    displacements: NDArray[np.float64]
    tensions: NDArray[Any] | None
    coefficients: NDArray[Any] | None

    @classmethod
    def of(cls, march: March) -> Mark:
        """Return where `march` is now."""
        state, tally = march.simulation.state(), copy.copy(march.simulation.tally)
        moved = floats(state.displacements)
        if state.tensions.dtype == object or state.coefficients.dtype == object:
            return cls(march.done, march.tail[-1], tally, moved, None, None)
        tensions, coefficients = state.tensions, state.coefficients
        return cls(march.done, march.tail[-1], tally, moved, tensions, coefficients)

    def same_tensions(self, state: State) -> bool:
        """Return whether `state` has the same tensions and coefficients, bit for bit."""
        return (
            self.tensions is not None
            and np.array_equal(self.tensions, state.tensions)
            and np.array_equal(self.coefficients, state.coefficients)  # type: ignore[arg-type]
        )

    def capture(self) -> dict[str, Any]:
        """Return this mark as plain data."""
        return {
            "done": self.done,
            "x_G": tuple(self.x_G),
            "tally": asdict(self.tally),
            "displacements": self.displacements,
            "tensions": self.tensions,
            "coefficients": self.coefficients,
        }

    @classmethod
    def restored(cls, captured: Mapping[str, Any] | None) -> Mark | None:
        """Return the mark that `capture` described."""
        if captured is None:
            return None
        about = dict(captured)
        x_g, tally = Enclosure(*about.pop("x_G")), Tally(**about.pop("tally"))
        return cls(x_G=x_g, tally=tally, **about)


class Samples:
    """x_G at equally spaced targets from the start on: never more than a few thousand.

    When there are too many, every other one is dropped; which ones remain depends only on how many
    targets were reached.
    """

    def __init__(self, start: float, spacing: int) -> None:
        self.spacing = spacing
        self.values = np.array([start])

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

    def error(self, burn_in: int, drive: Drive) -> float:
        """Return the standard error of the velocity along `drive`, nan if unknown."""
        begin = -(-burn_in // self.spacing)
        values = self.values[begin:]
        clock = drive.clock(np.arange(begin, self.values.size) * self.spacing)
        steps = values.size - 1
        group = max(1, steps // _BLOCKS)
        blocks = steps // group
        if blocks < _FEWEST_BLOCKS:
            return math.nan
        gains = np.diff(values[: blocks * group + 1 : group])
        spans = np.diff(clock[: blocks * group + 1 : group])
        # of the ratio of two means: blocks of a record last differently long
        centred = (gains - spans * (gains.sum() / spans.sum())) / spans.mean()
        error = math.sqrt(float(centred @ centred) / (blocks - 1) / blocks)
        power = float(centred @ centred)
        correlation = float(centred[1:] @ centred[:-1]) / power if power > 0 else 0.0
        if correlation > 2 / math.sqrt(blocks):
            error *= math.sqrt((1 + correlation) / (1 - correlation))
        return error

    def capture(self) -> dict[str, Any]:
        return {"spacing": self.spacing, "values": self.values}

    def restore(self, captured: Mapping[str, Any]) -> None:
        self.spacing = captured["spacing"]
        self.values = captured["values"]


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
