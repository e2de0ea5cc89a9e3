"""The quasi-static loop: take the chain from target to target, the same for every solver.

Between two targets theta ramps; a solver's `Simulation.follow` knows how to do that for a block of
targets. The loop chooses the blocks so that it can show progress, hear Ctrl-C, respect limits
and write checkpoints several times a second, without slowing a chain that needs a microsecond per
half-cycle. Where blocks begin and end changes no bit of the result.
"""

from __future__ import annotations

import copy
import math
import os
import signal
import threading
import time
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np
from numba.core import event as compiler_event
from numpy.typing import NDArray

from exactcreep import __version__, checkpoint
from exactcreep.decimals import Enclosure, digits_and_radii, enclosure, floats
from exactcreep.experiment import Experiment
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles, GaussianSteps
from exactcreep.model.numbers import InputError, exact_number, nearest_float, whole_number
from exactcreep.model.state import State
from exactcreep.model.verdict import Outcome
from exactcreep.result import Creep, check_output
from exactcreep.solvers.solver import Simulation, Stretch, Tally

_BLOCK_SECONDS = 0.1
_LONGEST_BLOCK = 1 << 20  # targets; bounds the memory of a block
_SAMPLES = 4096
_BLOCKS = 32  # of the block averages behind the standard error
_FEWEST_BLOCKS = 8


class PhysicsWarning(UserWarning):
    """A run has left the model's physical range; the result counts how often."""


@dataclass(frozen=True)
class Progress:
    """How far a run has come.

    Attributes
    ----------
    phase : str
        ``compiling`` (once, before the first run on a machine) or ``running``.
    half_cycles, total : int
        Targets reached, and targets of the drive.
    events : int
    seconds : float
        Wall time of the run, without compilation.
    member, members : int
        Which of several experiments it is, from 1.
    """

    phase: str
    half_cycles: int
    total: int
    events: int
    seconds: float
    member: int = 1
    members: int = 1


class Interrupted(KeyboardInterrupt):
    """Ctrl-C during a run; `results` holds what was computed, the last one partial."""

    def __init__(self, results: Sequence[Creep]) -> None:
        super().__init__("interrupted")
        self.results = list(results)

    @property
    def partial(self) -> Creep:
        """The result that was being computed."""
        return self.results[-1]


@dataclass(frozen=True)
class Limits:
    """Where a run gives up; None: never.

    Attributes
    ----------
    max_events : int or None
        Events since the start of the run.
    max_seconds : float or None
        Wall time, without compilation.
    max_bytes : int or None
        Memory of what is recorded.
    """

    max_events: int | None = None
    max_seconds: float | None = None
    max_bytes: int | None = None

    @classmethod
    def of(cls, max_events: Any = None, max_seconds: Any = None, max_bytes: Any = None) -> Limits:
        """Return the limits, or raise `InputError` if one is not a number or negative."""

        def whole(value: Any, name: str) -> int | None:
            return None if value is None else whole_number(value, name, least=0)

        seconds = None if max_seconds is None else exact_number(max_seconds, "max_seconds")
        if seconds is not None and seconds < 0:
            raise InputError("max_seconds", max_seconds, "must not be negative")
        return cls(
            whole(max_events, "max_events"),
            None if seconds is None else nearest_float(seconds),
            whole(max_bytes, "max_bytes"),
        )


def creep(
    chain: Chain,
    drive: Any,
    *,
    seed: int = 0,
    solver: str = "exact",
    start: State | None = None,
    record: Sequence[str] = ("x_G",),
    burn_in: int | None = None,
    progress: Callable[[Progress], None] | None = None,
    max_events: int | None = None,
    max_seconds: float | None = None,
    max_bytes: int | None = None,
    checkpoint: str | os.PathLike[str] | None = None,
    every: float = 60.0,
    force: bool = False,
    **options: Any,
) -> Creep:
    """Drive a chain through its targets quasi-statically and return what it did.

    Parameters
    ----------
    chain : Chain
    drive : Cycles, GaussianSteps or Path
    seed : int
        Of the disorder: static coefficients and random dilations.
    solver : str
        A name of `exactcreep.solvers.registry.SOLVERS`.
    start : State, optional
        Default: the relaxed chain. A start that is not at rest is first rearranged.
    record : sequence of str
        Among ``x_G``, ``x``, ``tension``, ``slips`` and ``events``. With ``()`` the run needs no
        more memory than the chain does.
    burn_in : int, optional
        Targets left out of the mean velocity; default a tenth, at least 2. Made even for Cycles.
    progress : callable, optional
        Called with a `Progress` about ten times a second.
    max_events, max_seconds, max_bytes : number, optional
        Give up, with the partial result and the outcome `LIMIT`, after so many events, so much
        wall time, or so much memory of recorded data.
    checkpoint : path, optional
        A file from which `resume` goes on, bit for bit; written at the start, every `every`
        seconds, and at the end.
    force : bool
        Whether an existing checkpoint file may be overwritten.
    **options
        The solver's own options.

    Returns
    -------
    Creep
        Its `outcome` is

        - ``RUNAWAY``: it was proved that no slider ever stops again;
        - ``LIMIT``: a limit was reached, here or in the solver; `reason` says which;
        - ``AT_REST``: for Cycles, no event in the last whole cycle, so that there will never be
          one again; for other drives, no event after the burn-in;
        - ``CYCLING``: sliders slip, but without net displacement: if the last cycle returned
          the chain to the same tensions bit for bit, in that cycle (so that it goes on like this
          for ever), otherwise over all half-cycles after the burn-in;
        - ``CREEPING``: x_G moves on, in the same sense.

        A displacement counts as none if rounding alone can make it: 2**-50 n (mu_s + |tan_alpha|)
        cos(alpha) for every slip.

        `velocity_error` comes from block averages: 32 to 63 blocks of equal length (at least 8,
        else nan), their scatter, and their correlation where it is significant. Bounded noise on
        top of a steady advance makes it too large, never too small; an irregular creep whose
        quiet periods are longer than a block makes it too small.

    Raises
    ------
    InputError
        If an argument is out of range, or an option is not the solver's.
    Interrupted
        A KeyboardInterrupt that holds the partial result.

    Notes
    -----
    Guarantee: the result does not depend on what is recorded, shown or saved, nor on when.
    """
    experiment = Experiment.of(
        chain,
        drive,
        seed=seed,
        solver=solver,
        start=start,
        record=record,
        burn_in=burn_in,
        options=options,
    )
    limits = Limits.of(max_events, max_seconds, max_bytes)
    keeper = None if checkpoint is None else Keeper.of(checkpoint, every, force=force)
    return run_members([experiment], progress=progress, limits=limits, keeper=keeper)[0]


def resume(
    path: str | os.PathLike[str],
    *,
    progress: Callable[[Progress], None] | None = None,
    max_events: int | None = None,
    max_seconds: float | None = None,
    max_bytes: int | None = None,
    every: float = 60.0,
) -> Creep:
    """Go on from a checkpoint of `creep` and return the result, as if never interrupted.

    The file goes on being kept up to date; limits count anew, except `max_events`.

    Raises
    ------
    InputError
        If the file is no checkpoint, a damaged, truncated or newer one, or one of several runs.
    """
    saved = Saved.read(path)
    if len(saved.experiments) != 1:
        allowed = f"holds {len(saved.experiments)} runs; the command exactcreep resume goes on"
        raise InputError("checkpoint", os.fspath(path), allowed)
    return run_members(
        saved.experiments,
        progress=progress,
        limits=Limits.of(max_events, max_seconds, max_bytes),
        keeper=Keeper.of(path, every, force=True, note=saved.note),
        captured=saved.captured,
    )[0]


@dataclass(frozen=True)
class Saved:
    """What a checkpoint file holds: experiments, how far each has come, and a caller's note."""

    experiments: list[Experiment]
    captured: list[Mapping[str, Any] | None]
    note: Mapping[str, Any]

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Saved:
        """Return what the checkpoint file `path` holds, or raise `InputError`."""
        content = checkpoint.read(path)
        try:
            members, note = content["members"], content["note"]
            experiments = [Experiment.from_description(member["experiment"]) for member in members]
            return cls(experiments, [member["captured"] for member in members], note)
        except (KeyError, TypeError) as error:
            allowed = f"is not a checkpoint of a run: {error}"
            raise InputError("checkpoint", os.fspath(path), allowed) from None


class Keeper:
    """Writes the checkpoint file of a run when it is due."""

    def __init__(self, path: str, every: float, note: Mapping[str, Any]) -> None:
        self.path = path
        self.every = every
        self.note = note
        self._last = -math.inf

    @classmethod
    def of(
        cls,
        path: str | os.PathLike[str],
        every: Any,
        *,
        force: bool = False,
        note: Mapping[str, Any] | None = None,
    ) -> Keeper:
        """Return a keeper of the file `path`, or raise `InputError` if it cannot be one."""
        seconds = exact_number(every, "every")
        if seconds < 0:
            raise InputError("every", every, "must not be negative")
        check_output(path, "checkpoint", force=force)
        return cls(os.fspath(path), nearest_float(seconds), note or {})

    def due(self) -> bool:
        """Return whether the file is older than it should be."""
        return time.monotonic() - self._last >= self.every

    def keep(self, members: Sequence[tuple[Experiment, Mapping[str, Any] | None]]) -> None:
        """Write the file."""
        content = {
            "version": __version__,
            "note": dict(self.note),
            "members": [
                {"experiment": experiment.description(), "captured": captured}
                for experiment, captured in members
            ],
        }
        try:
            checkpoint.write(self.path, content)
        except TypeError as error:
            raise InputError("checkpoint", self.path, f"cannot be written: {error}") from None
        self._last = time.monotonic()


def run_members(
    experiments: Sequence[Experiment],
    *,
    progress: Callable[[Progress], None] | None = None,
    limits: Limits | None = None,
    keeper: Keeper | None = None,
    captured: Sequence[Mapping[str, Any] | None] | None = None,
    finished: Callable[[int, Creep], None] | None = None,
) -> list[Creep]:
    """Run experiments one after the other and return their results.

    Parameters
    ----------
    experiments : sequence of Experiment
    progress : callable, optional
        Called with a `Progress` about ten times a second.
    limits : Limits, optional
        `max_seconds` is for all together, the others for each.
    keeper : Keeper, optional
        Of the checkpoint.
    captured : sequence, optional
        How far each has come, from `Saved`.
    finished : callable, optional
        Called with the index and the result of each experiment.

    Raises
    ------
    Interrupted
        After Ctrl-C, with the results so far.
    """
    limits = limits or Limits()
    kept: list[Mapping[str, Any] | None] = list(captured or [None] * len(experiments))
    results: list[Creep] = []
    spent = 0.0
    with _deferred_interrupt() as interrupted:
        for index, experiment in enumerate(experiments):

            def show(
                phase: str, loop: _Loop, index: int = index, experiment: Experiment = experiment
            ) -> None:
                if progress is not None:
                    progress(
                        Progress(
                            phase,
                            loop.done,
                            experiment.drive.half_cycles,
                            loop.simulation.tally.events,
                            loop.seconds,
                            index + 1,
                            len(experiments),
                        )
                    )

            def save(loop: _Loop, index: int = index) -> None:
                kept[index] = loop.capture()
                if keeper is not None:
                    keeper.keep(list(zip(experiments, kept, strict=True)))

            loop = _Loop(experiment, kept[index])
            if not loop.ended:
                _warm_up(experiment, partial(show, "compiling", loop))
                loop.run(
                    limits,
                    spent,
                    interrupted=interrupted,
                    show=partial(show, "running"),
                    due=keeper.due if keeper is not None else lambda: False,
                    save=save,
                )
                if keeper is not None:
                    save(loop)
            spent += loop.seconds_here
            result = loop.result()
            results.append(result)
            if interrupted():
                raise Interrupted(results)
            if finished is not None:
                finished(index, result)
    return results


class _Loop:
    """A simulation on its way along its drive, and what has been recorded on the way."""

    def __init__(self, experiment: Experiment, captured: Mapping[str, Any] | None) -> None:
        self.experiment = experiment
        chain, drive = experiment.chain, experiment.drive
        self.total = drive.half_cycles
        widest = _widest(experiment)
        self.watch_theta = widest >= 1
        self.watch_gaps = _may_cross(experiment, widest)
        record = experiment.record
        if self.watch_gaps and "tension" not in record:
            record = (*record, "tension")
        self.simulation: Simulation = experiment.algorithm.simulation(
            chain, experiment.initial, experiment.seed, record
        )
        self.done = 0
        self.outcome: Outcome | None = None
        self.reason = ""
        self.seconds = 0.0  # since the very start, over all sessions
        self.seconds_here = 0.0
        self.bytes = 0
        self.crossings = 0
        self.beyond_one = 0
        self.blocks: dict[str, list[NDArray[Any]]] = {}
        begin = _mean(experiment.initial.displacements)
        self.tail: list[Enclosure] = [begin, begin]  # x_G at the last two targets
        self.samples = _Samples(nearest_float(begin.middle), 2 if drive.cyclic else 1)
        self.burn_in = experiment.burn_in_of(self.total)
        self.burnt: _Mark | None = None
        self.last_cycle: _Mark | None = None
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

    def run(
        self,
        limits: Limits,
        spent: float,
        *,
        interrupted: Callable[[], bool],
        show: Callable[[_Loop], None],
        due: Callable[[], bool],
        save: Callable[[_Loop], None],
    ) -> None:
        """Go on until the drive ends, the solver gives up, or a limit is reached."""
        self.outcome, self.reason = None, ""
        before = self.seconds
        begin = time.perf_counter()
        count, events = 2, 64
        while not self.ended and self.outcome is None:
            if due():
                save(self)
            self.reason = self._exhausted(limits, spent, interrupted)
            if self.reason:
                self.outcome = Outcome.LIMIT
                break
            room = min(
                [b - self.done for b in self.boundaries if b > self.done] + [self.total - self.done]
            )
            allowance = events
            if limits.max_events is not None:
                allowance = min(events, limits.max_events - self.simulation.tally.events)
            earlier, past = time.perf_counter(), self.simulation.tally.events
            stretch = self.simulation.follow(
                self.experiment.drive, self.done + 1, min(count, room), max_events=allowance
            )
            self._take(stretch)
            now = time.perf_counter()
            self.seconds_here = now - begin
            self.seconds = before + self.seconds_here
            faster = _BLOCK_SECONDS / max(now - earlier, 1e-9)
            count = _adapted(max(stretch.completed, 1), faster, count)
            events = _adapted(max(self.simulation.tally.events - past, 1), faster, events)
            show(self)

    def _exhausted(self, limits: Limits, spent: float, interrupted: Callable[[], bool]) -> str:
        if interrupted():
            return "interrupted"
        if limits.max_events is not None and self.simulation.tally.events >= limits.max_events:
            return f"max_events = {limits.max_events} was reached"
        if limits.max_seconds is not None and spent + self.seconds_here >= limits.max_seconds:
            return f"max_seconds = {limits.max_seconds:g} was reached"
        if limits.max_bytes is not None and self.bytes > limits.max_bytes:
            return f"max_bytes = {limits.max_bytes} was reached by what is recorded"
        return ""

    def _take(self, stretch: Stretch) -> None:
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
                theta = experiment.drive.targets(first, stretch.completed, experiment.seed)
                lengths = (1 + theta[:, None]) * nearest_float(experiment.chain.l0)
                gaps = floats(recorded["tension"]) + lengths
                self.crossings += int(np.count_nonzero((gaps <= 0).any(axis=1)))
            self.done += stretch.completed
            self._mark()
        for name, values in recorded.items():
            kind = "events" if name.startswith("event_") else name
            if kind in experiment.record and len(values):
                self._keep(name, values)
        if stretch.outcome is not None:
            self.outcome, self.reason = stretch.outcome, stretch.reason

    def _keep(self, name: str, values: NDArray[Any]) -> None:
        parts = {name: floats(values) if values.dtype == object else values}
        if values.dtype == object:
            texts, radii = digits_and_radii(values, self.experiment.digits or 17)
            parts |= {f"{name}_decimal": texts, f"{name}_radius": radii}
        for part, array in parts.items():
            self.blocks.setdefault(part, []).append(array)
            self.bytes += array.nbytes

    def _mark(self) -> None:
        if self.done == self.burn_in:
            self.burnt = _Mark.of(self, with_state=False)
        if self.experiment.drive.cyclic and self.done == self.total - 2:
            self.last_cycle = _Mark.of(self, with_state=True)

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
        self.burnt = _Mark.restored(captured["burnt"])
        self.last_cycle = _Mark.restored(captured["last_cycle"])

    def result(self) -> Creep:
        """Return what the run has come to."""
        simulation, experiment = self.simulation, self.experiment
        tally = copy.copy(simulation.tally)
        state = simulation.state()
        recorded = self.recorded()
        if "x_G" in experiment.record:
            recorded.setdefault("x_G", np.empty(0))
        burn_in, velocity = self._measured()
        value = math.nan if velocity is None else nearest_float(velocity.middle)
        error = self.samples.error(burn_in)
        outcome = self.outcome or self._behaviour(state)
        if outcome is Outcome.RUNAWAY:
            value = math.copysign(math.inf, nearest_float(experiment.chain.tan_alpha))
            velocity, error = None, math.nan
        result = Creep(
            experiment=experiment,
            outcome=outcome,
            evidence=simulation.evidence,
            reason=self.reason,
            velocity=value,
            velocity_error=error,
            velocity_enclosure=velocity if experiment.digits and self.burnt else None,
            half_cycles=self.done,
            burn_in=burn_in,
            **asdict(tally),
            warnings=self._warnings(tally),
            seconds=self.seconds,
            state=state,
            recorded=recorded,
            report=simulation.report(),
        )
        for count in result.warnings:
            text = f"{_WARNINGS[count]} ({result.warnings[count]} times)"
            warnings.warn(text, PhysicsWarning, stacklevel=2)
        return result

    def _measured(self) -> tuple[int, Enclosure | None]:
        """Return the burn-in, and the mean displacement per half-cycle after it if there is any."""
        burn_in = self.experiment.burn_in_of(self.done)
        if self.burnt is not None:
            burn_in, begin = self.burnt.done, self.burnt.x_G
        else:  # it ended before the planned burn-in did: take a shorter one, where x_G is known
            burn_in, value = self.samples.first_after(burn_in)
            begin = Enclosure(Fraction(value), Fraction(0))
        # whole cycles only: within one, the chain goes up as well as down
        partial = self.done % 2 if self.experiment.drive.cyclic else 0
        span = self.done - partial - burn_in
        if span <= 0:
            return min(burn_in, self.done), None
        end = self.tail[-1 - partial]
        middle = (end.middle - begin.middle) / span
        return burn_in, Enclosure(middle, (end.radius + begin.radius) / span)

    def _behaviour(self, state: State) -> Outcome:
        """Return what the chain does, once every target is reached; see `creep`."""
        tally = self.simulation.tally
        begin = self.burnt
        if begin is None or begin.done == self.done:
            begin = _Mark(0, _mean(self.experiment.initial.displacements), Tally())
        last = self.last_cycle
        if last is not None:
            if tally.events == last.tally.events:
                return Outcome.AT_REST
            if last.same_tensions(state):
                begin = last
        elif tally.events == begin.tally.events:
            return Outcome.AT_REST
        moved = abs(self.tail[-1].middle - begin.x_G.middle)
        slips = tally.slips - begin.tally.slips
        return Outcome.CREEPING if moved > slips * self._rounding() else Outcome.CYCLING

    def _rounding(self) -> Fraction:
        """Return the most that rounding adds to x_G in one slip."""
        chain = self.experiment.chain
        force = (chain.mu_s + abs(chain.tan_alpha)) * Fraction(chain.cos_alpha)
        return chain.n * force / 2**50

    def _warnings(self, tally: Tally) -> dict[str, int]:
        counted = {
            "draws_below_mu_d": tally.draws_below_mu_d,
            "theta_beyond_one": self.beyond_one,
            "crossings": self.crossings,
        }
        return {name: count for name, count in counted.items() if count}


_WARNINGS = {
    "draws_below_mu_d": "a static coefficient was drawn below mu_d, and acts as mu_d",
    "theta_beyond_one": "|theta| reached 1, where a spring of the model has no length left",
    "crossings": "sliders would have crossed: x_(n+1) <= x_n at the end of a half-cycle",
}


@dataclass(frozen=True)
class _Mark:
    """Where the run was at a target that is looked back to."""

    done: int
    x_G: Enclosure
    tally: Tally
    tensions: NDArray[Any] | None = None
    coefficients: NDArray[Any] | None = None

    @classmethod
    def of(cls, loop: _Loop, *, with_state: bool) -> _Mark:
        tally = copy.copy(loop.simulation.tally)
        if not with_state or loop.experiment.chain.sigma_mu != 0:
            return cls(loop.done, loop.tail[-1], tally)
        state = loop.simulation.state()
        if state.tensions.dtype == object or state.coefficients.dtype == object:
            return cls(loop.done, loop.tail[-1], tally)
        return cls(loop.done, loop.tail[-1], tally, state.tensions, state.coefficients)

    def same_tensions(self, state: State) -> bool:
        """Return whether `state` has the same tensions and coefficients, bit for bit."""
        return (
            self.tensions is not None
            and np.array_equal(self.tensions, state.tensions)
            and np.array_equal(self.coefficients, state.coefficients)  # type: ignore[arg-type]
        )

    def capture(self) -> dict[str, Any]:
        return {
            "done": self.done,
            "x_G": tuple(self.x_G),
            "tally": asdict(self.tally),
            "tensions": self.tensions,
            "coefficients": self.coefficients,
        }

    @classmethod
    def restored(cls, captured: Mapping[str, Any] | None) -> _Mark | None:
        if captured is None:
            return None
        return cls(
            captured["done"],
            Enclosure(*captured["x_G"]),
            Tally(**captured["tally"]),
            captured["tensions"],
            captured["coefficients"],
        )


class _Samples:
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
        while self.values.size > _SAMPLES:
            self.values = self.values[::2]
            self.spacing *= 2

    def first_after(self, target: int) -> tuple[int, float]:
        """Return the first sampled target that is not before `target`, and x_G there."""
        k = min(-(-target // self.spacing), self.values.size - 1)
        return k * self.spacing, float(self.values[k])

    def error(self, burn_in: int) -> float:
        """Return the standard error of the mean displacement per target, nan if unknown."""
        values = self.values[-(-burn_in // self.spacing) :]
        steps = values.size - 1
        group = max(1, steps // _BLOCKS)
        blocks = steps // group
        if blocks < _FEWEST_BLOCKS:
            return math.nan
        means = np.diff(values[: blocks * group + 1 : group]) / (group * self.spacing)
        error = float(np.std(means, ddof=1)) / math.sqrt(blocks)
        centred = means - means.mean()
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


def _adapted(achieved: int, faster: float, now: int) -> int:
    """Return a block size that takes about `_BLOCK_SECONDS`, at most 8 times `now`."""
    return max(1, min(int(achieved * faster), 8 * now, _LONGEST_BLOCK))


def _widest(experiment: Experiment) -> float:
    """Return a bound of |theta| over the whole drive."""
    drive = experiment.drive
    if isinstance(drive, Cycles):
        return nearest_float(drive.amplitude)
    if isinstance(drive, GaussianSteps):
        return 9 * nearest_float(drive.sigma_theta)  # no deviate of 53 bits is larger
    return float(np.abs(drive.targets(1, drive.half_cycles, experiment.seed)).max())


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


_WARM: set[tuple[str, tuple[str, ...]]] = set()


def _warm_up(experiment: Experiment, compiling: Callable[[], None]) -> None:
    """Have the solver's code compiled, or loaded, on two half-cycles of two sliders."""
    key = (experiment.solver, experiment.record)
    if key in _WARM:
        return
    listener = _CompilerListener(compiling)
    compiler_event.register("numba:compile", listener)
    try:
        chain = Chain(2, 10, "1/2", "3/5", experiment.chain.sigma_mu, tan_alpha="1/4")
        simulation = experiment.algorithm.simulation(
            chain, State.relaxed(chain), 0, experiment.record
        )
        simulation.follow(Cycles("1/10", 1), 1, 2, max_events=1000)
    finally:
        compiler_event.unregister("numba:compile", listener)
    _WARM.add(key)


class _CompilerListener(compiler_event.Listener):  # type: ignore[misc]
    """Says once that the compiler is at work; code found in its cache does not come here."""

    def __init__(self, say: Callable[[], None]) -> None:
        self.say: Callable[[], None] | None = say

    def on_start(self, event: Any) -> None:
        if self.say is not None:
            self.say()
            self.say = None

    def on_end(self, event: Any) -> None:
        pass


@contextmanager
def _deferred_interrupt() -> Iterator[Callable[[], bool]]:
    """Let Ctrl-C wait for the end of a block, so that a simulation is never left half changed.

    Yields a function that returns whether Ctrl-C was pressed; pressed twice, it interrupts at once.
    """
    pressed = False

    def press(number: int, frame: Any) -> None:
        nonlocal pressed
        if pressed:
            raise KeyboardInterrupt
        pressed = True

    main = threading.current_thread() is threading.main_thread()
    if not main or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield lambda: False
        return
    signal.signal(signal.SIGINT, press)
    try:
        yield lambda: pressed
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
