"""The solver called "auto": the cheapest one whose error on the mean velocity is known to be small.

The ladder, from the cheapest: the *law* (a closed form, no run at all), *sliding* (no inertia),
*exact* (float64, event by event), *certified* (balls). An error is

- zero where a theorem says so: without a static excess (mu_s = mu_d, sigma_mu = 0) the sliding
  limit is the chain; two relaxed sliders under cycles follow their staircase;
- bounded where a theorem bounds it: two sliders with sigma_mu = 0 differ from the sliding limit by
  at most D = (mu_s - mu_d) cos(alpha) per half-cycle;
- measured in all other cases, by a pilot run: exact and sliding side by side, on the same drive,
  their difference with its standard error.

The choice depends on the scene alone, not on the clock: counts limit the pilot run, and the same
scene makes the same choice on every machine.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from exactcreep.laws import pivots, prediction
from exactcreep.limits import NO_LIMITS, Limits, OutOfTime, Stop
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles, Drive
from exactcreep.model.numbers import InputError, exact_number
from exactcreep.model.state import State
from exactcreep.model.verdict import Evidence
from exactcreep.motion.condition import PROMISE
from exactcreep.solvers.certified import Certified
from exactcreep.solvers.exact import Exact
from exactcreep.solvers.records import LOGS
from exactcreep.solvers.sliding import Sliding
from exactcreep.solvers.solver import (
    ONE_REARRANGEMENT,
    Rearrangement,
    Simulation,
    Solver,
    Stretch,
    Tally,
    advance,
)

LADDER = ("law", "sliding", "exact", "certified")
"""What there is to choose from, the cheapest first."""

_TRAJECTORIES = ("x", "tension", "slips", *LOGS)
_PILOT_EVENTS = 300_000  # about 0.3 s of the exact solver
_PILOT_TARGETS = 20_000  # where there are few events, a pilot ends here
_PILOT_BLOCKS = 16  # for a standard error that is itself known to a fifth
_SURVEY_TARGETS = 100_000  # whose range of theta is looked at
_SIGMAS = 3.0  # standard errors that a measured difference may be off


@dataclass(frozen=True)
class Candidate:
    """One rung of the ladder, and what is known of its error.

    Attributes
    ----------
    name : str
        One of `LADDER`.
    error : float
        Relative bias of the mean velocity, without its statistical error
        (`Choice.statistical_error`); of exact and certified, that of a single rearrangement. nan
        if it is not known or the rung does not apply.
    basis : str
        ``exact``, ``bounded``, ``measured``, ``promised``, ``unknown`` or ``not applicable``.
    reason : str
        One sentence.
    """

    name: str
    error: float
    basis: str
    reason: str

    @property
    def applies(self) -> bool:
        """Whether this rung can answer at all."""
        return self.basis != "not applicable"


@dataclass(frozen=True)
class Pilot:
    """A pilot run: exact and sliding side by side, on the same drive and from the same start.

    Attributes
    ----------
    half_cycles : int
        Targets of the run.
    burn_in : int
        Of them, left out of the means.
    events : int
        Of the exact run.
    velocity, velocity_error : float
        Of the exact run, with its standard error over blocks.
    sliding : float
        The velocity of the sliding limit over the same targets.
    difference, difference_error : float
        Exact minus sliding, paired block by block.
    resting : bool
        Whether nothing happened in the exact run after the burn-in.
    """

    half_cycles: int
    burn_in: int
    events: int
    velocity: float
    velocity_error: float
    sliding: float
    difference: float
    difference_error: float
    resting: bool

    @property
    def errors(self) -> tuple[float, float]:
        """The least and the largest relative error of sliding, within 3 standard errors."""
        if self.resting and self.difference == 0:
            return 0.0, 0.0
        if math.isnan(self.difference_error) or self.velocity == 0:
            return 0.0, math.inf
        margin = _SIGMAS * self.difference_error
        scale = abs(self.velocity)
        return max(0.0, abs(self.difference) - margin) / scale, (
            abs(self.difference) + margin
        ) / scale


@dataclass(frozen=True)
class Choice:
    """Which rung of the ladder is taken, and why.

    Attributes
    ----------
    name : str
        One of `LADDER`.
    solver : Solver
        What runs the scene; for the law, which needs no run, the sliding limit.
    candidates : tuple of Candidate
        All rungs, the cheapest first.
    reason : str
    pilot : Pilot or None
        None if a theorem settled it.
    law : tuple of float
        The velocity that the law predicts: none, one, or two where the limit is not unique.
    """

    name: str
    solver: Solver
    candidates: tuple[Candidate, ...]
    reason: str
    pilot: Pilot | None = None
    law: tuple[float, ...] = ()

    def statistical_error(self, half_cycles: int) -> float:
        """Return the relative standard error of a mean over so many targets; nan if unknown.

        Estimated from the pilot run; 0 if the chosen rung is known to be right by a theorem.
        """
        if self.name in ("law", "sliding"):
            (taken,) = [rung for rung in self.candidates if rung.name == self.name]
            if taken.basis == "exact":
                return 0.0
        pilot = self.pilot
        if pilot is None or not pilot.velocity:
            return math.nan
        measured = pilot.half_cycles - pilot.burn_in
        ratio = measured / max(half_cycles - half_cycles // 10, 1)
        return pilot.velocity_error / abs(pilot.velocity) * math.sqrt(ratio)


def valid_accuracy(accuracy: Any) -> Fraction:
    """Return `accuracy` as a rational between 0 and 1 (exclusive), or raise `InputError`."""
    value = exact_number(accuracy, "accuracy")
    if not 0 < value < 1:
        raise InputError("accuracy", accuracy, "must lie between 0 and 1, e.g. 0.01")
    return value


def choose(
    chain: Chain,
    drive: Drive,
    *,
    accuracy: Any,
    start: State | None = None,
    seed: int = 0,
    record: tuple[str, ...] = (),
    limits: Limits = NO_LIMITS,
) -> Choice:
    """Return the cheapest way to the mean velocity whose relative error is at most `accuracy`.

    Parameters
    ----------
    chain : Chain
    drive : Drive
    accuracy : number
        Relative, on the mean velocity; between 0 and 1.
    start : State, optional
        Default: the relaxed chain.
    seed : int
    record : tuple of str
        What is to be recorded besides: more than the velocity rules out the law, more than x_G
        rules out the sliding limit unless it is exact.
    limits : Limits
        Of which only the time counts.

    Raises
    ------
    OutOfTime
        If the time is over within the pilot run.

    Notes
    -----
    Guarantee: errors called exact or bounded follow from theorems; measured ones hold for the
    pilot run within three standard errors.
    """
    wanted = float(valid_accuracy(accuracy))
    pilot: Pilot | None = None
    predicted = prediction(chain, drive, start)
    laws = () if predicted is None else predicted.values
    limit = _from_theorems(chain, drive, start, seed, laws)
    needs_trajectory = any(name in record for name in _TRAJECTORIES)
    approximate = limit is None or limit.error > 0
    if limit is None and wanted >= PROMISE and not needs_trajectory:
        pilot = pilot_run(chain, drive, start=start, seed=seed, accuracy=wanted, limits=limits)
        limit = _from_pilot(pilot)
    if limit is None:
        limit = Candidate("sliding", math.nan, "unknown", "no theorem bounds its error here")
    if needs_trajectory and limit.applies and approximate:
        limit = Candidate(
            "sliding", math.nan, "not applicable", "its trajectories are not those of the chain"
        )
    rungs = (
        _law_candidate(chain, drive, start, record, limit, laws),
        limit,
        _exact_candidate(chain),
        _certified_candidate(chain),
    )
    for rung in rungs:
        if rung.applies and rung.error <= wanted:
            reason = f"{rung.reason}; cheaper ones: {_dismissed(rungs, rung)}"
            if rung is rungs[0] or not _dismissed(rungs, rung):
                reason = rung.reason
            return Choice(rung.name, runner(rung.name, wanted), rungs, reason, pilot, laws)
    best = next(rung for rung in (rungs[2], rungs[1], rungs[3]) if rung.applies)
    reason = f"nothing is known to be within {wanted:.3g}; {best.name}: {best.reason}"
    return Choice(best.name, runner(best.name, wanted), rungs, reason, pilot, laws)


def _dismissed(rungs: tuple[Candidate, ...], chosen: Candidate) -> str:
    """Return why the rungs below the chosen one were left."""
    told = []
    for rung in rungs[: rungs.index(chosen)]:
        bias = 0.0 if rung.name in ("exact", "certified") else rung.error
        error = "" if math.isnan(rung.error) else f" (bias {bias:.2g}, {rung.basis})"
        told.append(rung.name + (error or f" ({rung.reason})"))
    return ", ".join(told)


def runner(name: str, accuracy: float) -> Solver:
    """Return the solver that runs a scene for a rung of the ladder: sliding for the law.

    Certified carries ten digits more than the accuracy has.
    """
    if name in ("law", "sliding"):
        return Sliding(exact=accuracy < PROMISE)
    if name == "certified":
        return Certified(digits=max(20, math.ceil(-math.log10(accuracy)) + 10))
    return Exact()


def _has_no_excess(chain: Chain) -> bool:
    return chain.mu_s == chain.mu_d and chain.sigma_mu == 0


def _two_sliders(chain: Chain) -> bool:
    return chain.n == 2 and chain.sigma_mu == 0 and 0 < abs(chain.tan_alpha) < chain.mu_d


def _from_theorems(
    chain: Chain, drive: Drive, start: State | None, seed: int, laws: tuple[float, ...]
) -> Candidate | None:
    """Return what theorems say of the sliding limit; None if they are silent."""
    if chain.n == 1 and abs(chain.tan_alpha) <= chain.mu_d:
        return Candidate("sliding", 0.0, "exact", "a single slider rests for ever")
    if _has_no_excess(chain):
        if chain.may_run_away:
            return Candidate("sliding", 0.0, "exact", "|tan_alpha| >= mu_s = mu_d: nothing holds")
        indices = pivots(chain.n, chain.tan_alpha, chain.mu_d)
        if len(indices) == 1:
            return Candidate("sliding", 0.0, "exact", "mu_s = mu_d: the sliding limit is the chain")
        middle = abs(chain.n + 3 - sum(indices))
        error = 1 / middle if middle else math.inf
        return Candidate(
            "sliding",
            error,
            "bounded",
            "mu_s = mu_d, but the slope lies at the edge between two pivots, where the balance of"
            f" forces leaves the velocity open by a factor 1 +- {error:.3g}",
        )
    if chain.may_run_away:
        return Candidate(
            "sliding", math.nan, "not applicable", "|tan_alpha| >= mu_d: inertia decides"
        )
    if not _two_sliders(chain):
        return None
    velocity = abs(_surveyed(chain, drive, start, seed))
    if isinstance(drive, Cycles) and start is None:
        (truth,) = laws
        gap = abs(velocity - abs(truth))
        error = gap / abs(truth) if truth else (0.0 if gap == 0 else math.inf)
        return Candidate(
            "sliding", error, "bounded", "two relaxed sliders: the staircase is known exactly"
        )
    bound = chain.excess
    error = bound / (velocity - bound) if velocity > bound else math.inf
    return Candidate(
        "sliding",
        error,
        "bounded",
        f"two sliders, sigma_mu = 0: within D = {bound:.3g} per half-cycle",
    )


def _surveyed(chain: Chain, drive: Drive, start: State | None, seed: int) -> float:
    """Return the mean velocity of the sliding limit over (the beginning of) the drive."""
    total = min(drive.half_cycles, _SURVEY_TARGETS)
    simulation = Sliding().simulation(chain, _start(chain, start, seed), seed, ())
    positions = _positions(simulation, drive, 1, total)
    burn_in = _burn_in(total, drive)
    if burn_in >= total:
        return 0.0
    before = positions[burn_in - 1] if burn_in else 0.0
    return float(positions[-1] - before) / (total - burn_in)


def _burn_in(total: int, drive: Drive) -> int:
    targets = max(2, total // 5)
    return targets + targets % 2 if drive.cyclic else targets


def _start(chain: Chain, start: State | None, seed: int) -> State:
    return State.relaxed(chain, seed) if start is None else start


def _positions(
    simulation: Simulation, drive: Drive, first: int, count: int, limits: Limits = NO_LIMITS
) -> NDArray[np.float64]:
    """Return x_G at `count` targets; fewer if the events are used up, or after a runaway."""
    stretch = advance(simulation, drive, first + count - 1, limits, done=first - 1)
    if stretch.stop is Stop.DEADLINE:
        raise OutOfTime(stretch.reason)
    return stretch.recorded["x_G"].astype(np.float64)


def pilot_run(
    chain: Chain,
    drive: Drive,
    *,
    accuracy: float,
    start: State | None = None,
    seed: int = 0,
    limits: Limits = NO_LIMITS,
) -> Pilot:
    """Return a pilot run, long enough to tell whether sliding is within `accuracy`.

    It doubles its length until that is decided within three standard errors, the drive ends, or
    300 000 events or 20 000 targets have passed. Raises `OutOfTime` when the time is over.
    """
    initial = _start(chain, start, seed)
    exact = Exact().simulation(chain, initial, seed, ())
    sliding = Sliding().simulation(chain, initial, seed, ())
    one, other = np.empty(0), np.empty(0)
    total = min(drive.half_cycles, _PILOT_TARGETS)
    length = min(200, total)
    events = 0
    while True:
        left = replace(limits, events=_PILOT_EVENTS, used=exact.tally.events, pause=math.inf)
        fresh = _positions(exact, drive, one.size + 1, length - one.size, left)
        cut = fresh.size < length - one.size
        one = np.concatenate([one, fresh])
        other = np.concatenate([other, _positions(sliding, drive, other.size + 1, fresh.size)])
        still = exact.tally.events == events
        events = exact.tally.events
        pilot = _compared(one, other, drive, events, still)
        least, largest = pilot.errors
        if cut or length == total or largest <= accuracy or least > accuracy:
            return pilot
        length = min(2 * length, total)


def _compared(
    one: NDArray[np.float64], other: NDArray[np.float64], drive: Drive, events: int, still: bool
) -> Pilot:
    burn_in = _burn_in(one.size, drive)
    group = (one.size - burn_in) // _PILOT_BLOCKS
    if drive.cyclic:
        group -= group % 2
    if group < 1:
        nan = math.nan
        return Pilot(one.size, burn_in, events, nan, nan, nan, nan, nan, False)
    used = group * _PILOT_BLOCKS
    ends = slice(one.size - used - 1, None, group)
    measured = np.diff(one[ends]) / group
    limit = np.diff(other[ends]) / group
    gap = measured - limit
    root = math.sqrt(_PILOT_BLOCKS)
    return Pilot(
        half_cycles=one.size,
        burn_in=one.size - used,
        events=events,
        velocity=float(measured.mean()),
        velocity_error=float(measured.std(ddof=1)) / root,
        sliding=float(limit.mean()),
        difference=float(gap.mean()),
        difference_error=float(gap.std(ddof=1)) / root,
        resting=still,
    )


def _from_pilot(pilot: Pilot) -> Candidate:
    largest = pilot.errors[1]
    if math.isinf(largest):
        return Candidate(
            "sliding", math.nan, "unknown", "the pilot run was too short to measure its error"
        )
    told = "nothing moves, in the pilot run and in the sliding limit"
    if not pilot.resting:
        gap = f"{pilot.difference:.3g} +- {pilot.difference_error:.2g}"
        told = f"in the pilot run it differs by {gap} from {pilot.velocity:.6g}"
    return Candidate("sliding", largest, "measured", told)


def _law_candidate(
    chain: Chain,
    drive: Drive,
    start: State | None,
    record: tuple[str, ...],
    limit: Candidate,
    values: tuple[float, ...],
) -> Candidate:
    if not values:
        return Candidate("law", math.nan, "not applicable", "there is no law for this scene")
    if record:
        asked = ", ".join(record)
        return Candidate(
            "law", math.nan, "not applicable", f"it gives a velocity only; recorded is {asked}"
        )
    if start is None and isinstance(drive, Cycles) and _two_sliders(chain):
        return Candidate("law", 0.0, "exact", "two relaxed sliders under cycles: the staircase")
    if len(values) > 1 and limit.basis == "measured":
        middle = abs(values[0] + values[1]) / 2
        error = abs(values[1] - values[0]) / 2 / middle if middle else math.inf
        return Candidate(
            "law", error, "bounded", "the slope lies at the edge between two pivots"
        )
    mean = "the expected" if drive.random else "the asymptotic"
    of = f"{mean} velocity of the sliding limit; {limit.reason}"
    return Candidate("law", limit.error, limit.basis, of)


def _exact_candidate(chain: Chain) -> Candidate:
    if _has_no_excess(chain):
        return Candidate("exact", math.nan, "not applicable", "mu_s = mu_d: there are no slips")
    return Candidate("exact", PROMISE, "promised", "the chain itself, in float64: no bias")


def _certified_candidate(chain: Chain) -> Candidate:
    if _has_no_excess(chain):
        return Candidate("certified", math.nan, "not applicable", "mu_s = mu_d: no slips")
    return Candidate("certified", 0.0, "promised", "the chain itself, in many digits: no bias")


class AutoSimulation(Simulation):
    """A simulation by the solver that is chosen when the drive is first seen."""

    def __init__(
        self, chain: Chain, state: State, seed: int, record: tuple[str, ...], accuracy: Fraction
    ) -> None:
        self.chain, self.start, self.seed, self.record = chain, state, seed, record
        self.accuracy = accuracy
        self._inner: Simulation | None = None
        self._chosen = ""
        self._told: dict[str, Any] = {}

    @property
    def tally(self) -> Tally:  # type: ignore[override]
        """Counts since the start."""
        return Tally() if self._inner is None else self._inner.tally

    def _is_relaxed(self) -> bool:
        start, relaxed = self.start, State.relaxed(self.chain, self.seed)
        return bool(
            start.theta == 0
            and np.all(start.tensions == 0)
            and np.array_equal(start.coefficients, relaxed.coefficients)
        )

    def follow(
        self, drive: Drive, first: int, count: int, limits: Limits = NO_LIMITS
    ) -> Stretch:
        """Choose a solver if that has not been done, then let it take the chain on."""
        if self._inner is None:
            try:
                choice = choose(
                    self.chain,
                    drive,
                    accuracy=self.accuracy,
                    start=None if self._is_relaxed() else self.start,
                    seed=self.seed,
                    record=self.record,
                    limits=limits,
                )
            except OutOfTime as late:
                return Stretch(0, {}, Stop.DEADLINE, str(late))
            (taken,) = [rung for rung in choice.candidates if rung.name == choice.name]
            self._take(choice.solver, choice.name)
            error, known_by = taken.error, taken.basis
            if choice.name in ("exact", "certified"):  # a mean has no digits of a trajectory
                error = choice.statistical_error(drive.half_cycles)
                known_by = "unknown" if math.isnan(error) else "estimated"
            self._told = {
                "chosen": "sliding" if choice.name == "law" else choice.name,
                "relative_error": None if math.isnan(error) else error,
                "known_by": known_by,
                "reason": choice.reason,
            }
        assert self._inner is not None
        return self._inner.follow(drive, first, count, limits)

    def _take(self, solver: Solver, name: str) -> None:
        self._inner = solver.simulation(self.chain, self.start, self.seed, self.record)
        self._chosen = name

    def state(self) -> State:
        """Return the present state."""
        return self.start if self._inner is None else self._inner.state()

    def capture(self) -> dict[str, Any]:
        """Return everything needed to go on bit for bit."""
        inner = None if self._inner is None else self._inner.capture()
        return {"chosen": self._chosen, "told": dict(self._told), "inner": inner}

    def restore(self, captured: Mapping[str, Any]) -> None:
        """Take over what `capture` returned (for the same chain, seed and solver)."""
        if captured["inner"] is None:
            return
        name = str(captured["chosen"])
        self._take(runner(name, float(self.accuracy)), name)
        self._told = dict(captured["told"])
        assert self._inner is not None
        self._inner.restore(captured["inner"])

    def twin(self) -> Simulation | None:
        """Return a twin of the solver which runs."""
        return None if self._inner is None else self._inner.twin()

    @property
    def evidence(self) -> Evidence:
        """That of the solver which runs; an approximation is computed at best."""
        if self._inner is None:
            return Evidence.COMPUTED
        found = self._inner.evidence
        approximate = self._chosen in ("law", "sliding") and not _has_no_excess(self.chain)
        return Evidence.COMPUTED if approximate and found is Evidence.PROVED else found

    def report(self) -> dict[str, Any]:
        """Return which solver was chosen, how well its error is known, and its own report."""
        inner = {} if self._inner is None else self._inner.report()
        return self._told | inner


@dataclass(frozen=True)
class Auto(Solver):
    """The cheapest of sliding, exact and certified whose error is known to be small enough.

    Parameters
    ----------
    accuracy : number
        Largest relative error of the mean velocity; between 0 and 1.
    """

    accuracy: Any = field(default=Fraction(1, 100))
    name: ClassVar[str] = "auto"
    summary: ClassVar[str] = "the cheapest solver that is accurate enough for the mean velocity"

    def __post_init__(self) -> None:
        object.__setattr__(self, "accuracy", valid_accuracy(self.accuracy))

    def rearrange(
        self,
        chain: Chain,
        state: State,
        direction: int,
        seed: int,
        limits: Limits = ONE_REARRANGEMENT,
    ) -> Rearrangement:
        """Rearrange with the exact solver: a rearrangement is inertia."""
        return Exact().rearrange(chain, state, direction, seed, limits)

    def simulation(
        self, chain: Chain, state: State, seed: int, record: tuple[str, ...]
    ) -> AutoSimulation:
        """Return a simulation that starts from `state`."""
        return AutoSimulation(chain, state, seed, record, self.accuracy)
