"""The interface of solvers: they make rearrangements, and simulations that follow a drive."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from importlib import import_module
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.chain import Chain, without_excess
from exactcreep.model.drive import Cycles, Drive
from exactcreep.model.numbers import InputError
from exactcreep.model.outcome import Evidence
from exactcreep.model.state import State, completed
from exactcreep.model.uniform import require_uniform
from exactcreep.solvers.rearrangement import Ending as Ending
from exactcreep.solvers.rearrangement import Rearrangement as Rearrangement
from exactcreep.solvers.tables import RECORDS, joined
from exactcreep.watch import interrupts
from exactcreep.watch.limits import NO_LIMITS, Limits, Stop
from exactcreep.watch.preparation import preparing

MOST_EVENTS = 20_000
"""Default limit of events of `rearrange`."""
LONGEST_AVALANCHE = 10**6
"""Most events of an avalanche that may never end, plus 1000 for each slider."""
ONE_REARRANGEMENT = Limits(events=MOST_EVENTS)
TENSION_TOLERANCE = 1e-12
"""Error that float64 promises for one rearrangement, relative to the largest force in it."""
_NO_SLIPS = (
    "equal to mu_d with sigma_mu = 0 leaves no slips, the sliders slide with theta:"
    ' use solver="sliding"'
)
_SLIDES = (
    "equal to mu_d with sigma_mu = 0 lets this slider slide with theta while others slip, which no"
    " solver follows: give it a larger mu_s"
)
_SLACK = 1e-9  # of forces in a file
_MOST, _LARGEST = 2**62, 2.0**1000  # of a count and a float in a file
_LONGEST_STRETCH = 1 << 21  # numbers at targets; bounds the memory of a stretch
_TWO_SLIDERS = Chain(2, 10, "1/2", "3/5", "1/100", tan_alpha="1/4")
_COMPILED: set[tuple[str, int, tuple[str, ...]]] = set()


def require_slips(chain: Chain, driven: Collection[int]) -> None:
    """Raise `InputError` if one of the sliders that theta drives slides with it, without slips."""
    if sliding := [slider for slider in without_excess(chain) if slider in driven]:
        if chain.mu_s == chain.mu_d:
            raise InputError("mu_s", chain.mu_s, _NO_SLIPS)
        raise InputError(f"mu_s[{sliding[0]}]", chain.each("mu_s")[sliding[0]], _SLIDES)


def longest_avalanche(chain: Chain) -> int:
    """Return after how many events an avalanche of a chain is given up.

    Below mu_d every avalanche ends, and there is no limit. On the slope mu_d itself friction equals
    gravity, and an avalanche may continue for ever although not all sliders move.
    """
    return LONGEST_AVALANCHE + 1000 * chain.n if chain.may_run_away else 2**62


@dataclass
class Tally:
    """Counts since the start of a simulation."""

    rearrangements: int = 0
    events: int = 0
    """Start and stop events; a simultaneous set of sliders is one event."""
    slips: int = 0
    """Motions of one slider from a start to a stop."""
    draws_below_mu_d: int = 0
    undecided: int = 0
    """Comparisons within their rounding bound, settled by the model's rules."""


@dataclass(frozen=True, eq=False)
class Stretch:
    """The result of `Simulation.follow`, and an item of `simulate`.

    `completed`: targets reached in this call; `recorded`: ``x_G`` (completed,) and other requested
    columns, at targets and in tables; `stop`, `reason`: why it ended, with a sentence unless every
    target was reached; `partial`: rows since the last target, which come again in the next stretch;
    `doubts` (ndarray of int64 or None): undecided comparisons up to each target, if known;
    `x_G_low` (ndarray of float64 or None): what rounding takes from each x_G, if known.
    """

    completed: int
    recorded: Mapping[str, NDArray[Any]]
    stop: Stop = Stop.DONE
    reason: str = ""
    partial: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    doubts: NDArray[np.int64] | None = None
    x_G_low: NDArray[np.float64] | None = None

    @property
    def whole(self) -> Mapping[str, NDArray[Any]]:
        """The recorded columns, with the rows since the last target."""
        return joined([self.recorded, self.partial])


class Simulation(ABC):
    """A chain that follows a drive: the only mutable object in the package."""

    tally: Tally

    @abstractmethod
    def follow(self, drive: Drive, first: int, count: int, limits: Limits = NO_LIMITS) -> Stretch:
        """Take the chain to targets `first` .. `first + count - 1` of the drive.

        Returns early when the events of `limits`, counted from this call, or the time are used up.
        Calling again with the first target that was not completed continues with the same bits.
        """

    @abstractmethod
    def state(self) -> State:
        """Return the present state (between two events if `follow` returned early)."""

    @property
    @abstractmethod
    def at_rest(self) -> bool:
        """Whether a snapshot can be taken now: between rearrangements, or at a target."""

    def unrounded(self) -> dict[str, Any] | None:
        """Return the numbers at a target from which `Start.unrounded` goes on with the same bits.

        None if `state` loses no bit.
        """
        return None

    @abstractmethod
    def snapshot(self) -> dict[str, Any]:
        """Return the chain at rest in numbers and arrays, without recorded data."""

    @abstractmethod
    def restore(self, snapshot: Mapping[str, Any]) -> None:
        """Continue from a snapshot of a simulation with the same start, seed and records.

        Raises `ValueError` if names, types or shapes differ.
        """

    def come_to_rest(self, limits: Limits) -> Mapping[str, NDArray[Any]]:
        """Let the present rearrangement end, if the limits allow it; return its log."""
        return {}

    @property
    def evidence(self) -> Evidence:
        return Evidence.of(self.tally.undecided, Evidence.COMPUTED)

    def report(self) -> dict[str, Any]:
        return {}


def require(holds: bool, otherwise: str) -> None:
    if not holds:
        raise ValueError(otherwise)


def require_like(like: Any, held: Any, name: str = "it") -> None:
    """Raise `ValueError` unless data from a file have the names, types and shapes of `like`.

    Floats must be below 2**1000, whole numbers below 2**62. In `like`, an array without rows allows
    any number of rows, a list any number of items like its first; None and [] allow anything.
    """
    if isinstance(like, Mapping):
        require(isinstance(held, Mapping) and like.keys() == held.keys(), f"{name} lacks a name")
        for key, value in like.items():
            require_like(value, held[key], key)
    elif isinstance(like, np.ndarray):
        fits = isinstance(held, np.ndarray) and held.dtype == like.dtype
        begin = int(len(like) == 0)
        require(fits and held.shape[begin:] == like.shape[begin:], f"{name} has another shape")
        require(_bounded(held), f"{name} is out of range")
    elif like is not None and not (isinstance(like, list) and not like):
        require(type(held) is type(like), f"{name} is of another kind")
        if isinstance(like, (int, float)):
            require(_bounded(np.array(held)), f"{name} is out of range")
        elif isinstance(like, (list, tuple)):
            fits = len(held) > 0 if isinstance(like, list) else len(held) == len(like)
            require(fits, f"{name} has another length")
            for k, part in enumerate(held):
                require_like(like[0 if isinstance(like, list) else k], part, name)


def require_at_rest(forces: NDArray[np.float64], held: NDArray[np.float64]) -> None:
    """Raise `ValueError` unless static friction holds these forces, up to rounding errors."""
    slack = _SLACK * max(1.0, float(held.max()))
    require(bool((np.abs(forces) <= held + slack).all()), "its forces hold no chain at rest")


def _bounded(array: NDArray[Any]) -> bool:
    """Return whether sums of these floats are finite, and counts of any use."""
    most = _LARGEST if array.dtype.kind == "f" else _MOST
    return bool(((array > -most) & (array < most)).all())


@dataclass(frozen=True, eq=False)
class Start:
    """A chain, its initial state, and the seed of its later draws.

    `unrounded`: the numbers of the same solver and chain from which a simulation goes on.
    """

    chain: Chain
    state: State
    seed: int
    unrounded: Mapping[str, Any] | None = None


class Solver(ABC):
    """An algorithm: a frozen dataclass whose fields are its validated options.

    A subclass implements `rearrange_from` and `simulation_from`.
    """

    name: ClassVar[str]
    summary: ClassVar[str]
    """One line for people."""
    needs_slips: ClassVar[bool] = True
    """Whether it refuses a chain with a slider that slides with theta; see `sliding`."""
    takes: ClassVar[frozenset[str]] = frozenset()
    """Respects in which sliders and springs may differ; see `Chain.unlike`."""
    perturbs: ClassVar[bool] = False
    """Whether perturbed copies show how far its simulations are known; see `exact.copies`."""
    on_file: ClassVar[bool] = True
    """Whether a file can hold snapshots of its simulations."""
    records: ClassVar[tuple[str, ...]] = RECORDS
    no_more: ClassVar[str] = ""
    """The quantities that its simulations can record, and why there are no others."""

    def rearrange(
        self, chain: Chain, state: State, direction: int, seed: int,
        limits: Limits = ONE_REARRANGEMENT,
    ) -> Rearrangement:  # fmt: skip
        """Ramp theta in `direction` (+1, -1, or 0: not at all) to theta_c, and rearrange.

        The outcome is `LIMIT` if the limits end it.
        """
        if state.springs:
            allowed = "must be one number: theta ramps alike for all springs"
            raise InputError("state.theta", state.theta.tolist(), allowed)
        return self.rearrange_from(self._start(chain, state, seed), direction, limits)

    def simulation(
        self, chain: Chain, state: State, seed: int, record: tuple[str, ...]
    ) -> Simulation:
        """Return a simulation that starts from `state`.

        `Simulation.follow` first rearranges a start that is not at rest, at its own theta.
        """
        for name in record:
            if name not in self.records:
                allowed = "must be one of " + ", ".join(self.records) + self.no_more
                raise InputError("record", name, allowed)
        start = replace(self._start(chain, state, seed), unrounded=self.unrounded(state, chain))
        return self.simulation_from(start, record)

    def unrounded(self, state: State, chain: Chain) -> Any:
        """Return the unrounded numbers of a state if they are of this solver and chain, or None."""
        known = state.unrounded
        if known is None or {**known, **self._mark(chain)} != known:
            return None
        return known["numbers"]

    def state_of(self, simulation: Simulation, chain: Chain) -> State:
        """Return the present state of a simulation of this solver, with its unrounded numbers."""
        state, numbers = simulation.state(), None
        if simulation.at_rest:
            numbers = simulation.unrounded()
        return completed(state, numbers and self._mark(chain) | {"numbers": numbers})

    def _mark(self, chain: Chain) -> dict[str, Any]:
        """Return whose unrounded numbers of a state are."""
        return {"solver": self.name, "chain": chain.parameters()}

    def _start(self, chain: Chain, state: State, seed: int) -> Start:
        if not chain.unlike <= self.takes:
            require_uniform(chain.parameters(), f"the solver {self.name}", self.takes)
        if self.needs_slips:
            require_slips(chain, chain.rates or {0})
        return Start(chain, state, seed)

    @abstractmethod
    def rearrange_from(self, start: Start, direction: int, limits: Limits) -> Rearrangement:
        """Implement `rearrange`."""

    @abstractmethod
    def simulation_from(self, start: Start, record: tuple[str, ...]) -> Simulation:
        """Implement `simulation`."""

    def compiles(self, n: int) -> int:
        """Return a number of sliders for which the same compiled code is used as for `n`."""
        return 2


def compile_for(
    solver: Solver,
    chain: Chain,
    record: tuple[str, ...] = (),
    say: Callable[[], None] | None = None,
) -> None:
    """Compile or load the code with which a solver follows and records such a chain.

    `say` is called if the compiler works. Rarely needed code is compiled later. A signal ends the
    wait for the compiler.
    """
    kind = (solver.name, solver.compiles(chain.n), record)
    if kind in _COMPILED:
        return

    def compile_once() -> None:
        pair = replace(_TWO_SLIDERS, n=solver.compiles(chain.n))
        simulation = type(solver)().simulation(pair, State.relaxed(pair), 0, record)
        simulation.follow(Cycles("1/10", 1), 1, 2)

    with preparing(), import_module("exactcreep.compiling").told(say):
        interrupts.prepare(compile_once)
    _COMPILED.add(kind)


def simulate(
    simulation: Simulation,
    drive: Drive,
    targets: Iterable[int],
    limits: Limits = NO_LIMITS,
    *,
    done: int = 0,
) -> Iterator[Stretch]:
    """Take a chain from target `done` of a drive to each of `targets` in turn.

    Yields a stretch for each of them. The last stretch says why the chain did not go on to the next
    target. `limits` hold for all stretches together.
    """
    before, most = simulation.tally.events, max(_LONGEST_STRETCH // simulation.state().n, 1)
    for target in targets:
        begin, last = done, Stretch(0, {})
        parts: list[Mapping[str, NDArray[Any]]] = [{"x_G": np.empty(0)}]
        while done < target and last.stop is Stop.DONE:
            left = limits.after(simulation.tally.events - before)
            if (stop := left.stop(0)) is not None:
                last = Stretch(0, {}, stop, left.reason(stop))
            else:
                last = simulation.follow(drive, done + 1, min(most, target - done), left)
            done += last.completed
            parts.append(last.recorded)
        yield replace(last, completed=done - begin, recorded=joined(parts), doubts=None)
        if last.stop is not Stop.DONE:
            return
