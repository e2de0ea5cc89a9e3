"""Exact, Verlet and certified side by side, with the same disorder: where do they part, and why?

All contestants follow the same drive, with breakpoints between the rearrangements that change
nothing but let their positions be compared after each one. The certified solver is the truth. For
each of the others: the first event that differs, how close the tie was there in the certified
motion, how far positions were off until then and after, and what remains of the mean velocity.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exactcreep.limits import Limits
from exactcreep.model.contact import Event, EventKind
from exactcreep.model.drive import Path
from exactcreep.model.numbers import InputError, nearest_float, whole_number
from exactcreep.model.verdict import Evidence
from exactcreep.motion.arithmetic import FLOAT64
from exactcreep.motion.itinerary import Course, slider_motion
from exactcreep.progress import Progress, reporter
from exactcreep.quasistatic.decimals import enclosure
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.quasistatic.loop import creep
from exactcreep.quasistatic.result import Creep
from exactcreep.solvers.records import joined
from exactcreep.solvers.registry import solver_named
from exactcreep.studies.eventlog import (
    LoggedEvent,
    LoggedRearrangement,
    first_difference,
    numbered,
    rearrangements,
)

MOST_EVENTS = 100_000
"""Certified events that may be compared: some minutes of the certified solver."""
_STATISTICS_EVENTS = 200_000  # of each contestant's own run, for its mean velocity


@dataclass(frozen=True)
class Tie:
    """How close to its alternative the first event that differs was, in the certified motion.

    Attributes
    ----------
    condition : str
        ``velocity`` (a stop), ``force`` (a start) or ``load`` (theta_c of a rearrangement).
    slider : int
        From 1.
    margin : float
        How far that event's condition is from holding in the certified motion at the time at
        which it is claimed: a velocity (``g tau_dyn``), a distance of ``|F|`` from its threshold
        (``m g``), or of ``l0 theta_c`` from that of the certified event.
    time : float or None
        Between the two events, unit tau_dyn; None if they belong to different rearrangements.
    """

    condition: str
    slider: int
    margin: float
    time: float | None

    def summary(self) -> dict[str, Any]:
        """Return the tie by names, ready for JSON."""
        return {
            "condition": self.condition,
            "slider": self.slider,
            "margin": self.margin,
            "time": self.time,
        }


@dataclass(frozen=True, eq=False)
class Contestant:
    """One solver against the certified one.

    Attributes
    ----------
    solver : str
    options : mapping
    agreed : int
        Events before the first that differs (all of them, if none does).
    own, certified : LoggedEvent or None
        The first events that differ; half-cycles are those of the drive.
    tie : Tie or None
    compared : int
        Rest states before the first event that differs.
    error_before, error_after : float
        Largest difference of a slider's position at any rest before the first event that differs
        (nan if there is none), and anywhere; unit ``g tau_dyn**2``.
    errors : ndarray
        The same at every rest that was compared.
    creep : Creep
        The run behind the statistics.
    """

    solver: str
    options: Mapping[str, Any]
    agreed: int
    own: LoggedEvent | None
    certified: LoggedEvent | None
    tie: Tie | None
    compared: int
    error_before: float
    error_after: float
    errors: NDArray[np.float64]
    creep: Creep

    @property
    def differs(self) -> bool:
        """Whether an event differs."""
        return self.own is not None or self.certified is not None

    @property
    def label(self) -> str:
        """How it is called in tables and pictures."""
        return ", ".join([self.solver, *(f"{k} = {v}" for k, v in self.options.items())])

    def summary(self) -> dict[str, Any]:
        """Return the contestant by names, ready for JSON."""
        run = self.creep
        return {
            "solver": self.solver,
            "options": dict(self.options),
            "events_agreed": self.agreed,
            "first_difference": None
            if not self.differs
            else {
                "own": None if self.own is None else self.own.summary(),
                "certified": None if self.certified is None else self.certified.summary(),
                "tie": None if self.tie is None else self.tie.summary(),
            },
            "rests_compared": self.compared,
            "position_error_before": _finite(self.error_before),
            "position_error_after": _finite(self.error_after),
            "velocity": _finite(run.velocity),
            "velocity_error": _finite(run.velocity_error),
            "slips_per_half_cycle": run.slips / max(run.half_cycles, 1),
            "half_cycles": run.half_cycles,
            "outcome": run.outcome.value,
            "evidence": run.evidence.value,
            "undecided": run.undecided,
            "seconds": run.seconds,
        }


@dataclass(frozen=True, eq=False)
class Comparison:
    """What came of a comparison.

    Attributes
    ----------
    experiment : Experiment
    digits : int
        Of the certified solver.
    events, rearrangements : int
        Of the certified run, as far as it was compared.
    half_cycles : int
        Reached by it.
    evidence : Evidence
        Of the certified run.
    radius : float
        Largest radius of its positions.
    contestants : tuple of Contestant
        ``exact`` first.
    """

    experiment: Experiment
    digits: int
    events: int
    rearrangements: int
    half_cycles: int
    evidence: Evidence
    radius: float
    contestants: tuple[Contestant, ...]

    @property
    def velocity_difference(self) -> float:
        """Difference of the mean velocities, Verlet's minus the exact one's."""
        exact, verlet = (contestant.creep.velocity for contestant in self.contestants)
        return verlet - exact

    @property
    def standard_errors(self) -> float:
        """The same in units of the combined standard error; nan if it is not known."""
        errors = [contestant.creep.velocity_error for contestant in self.contestants]
        combined = math.hypot(*errors)
        return self.velocity_difference / combined if combined > 0 else math.nan

    def summary(self) -> dict[str, Any]:
        """Return everything by names, ready for JSON."""
        return {
            "certified": {
                "digits": self.digits,
                "events": self.events,
                "rearrangements": self.rearrangements,
                "half_cycles": self.half_cycles,
                "evidence": self.evidence.value,
                "largest_radius": self.radius,
            },
            "contestants": [contestant.summary() for contestant in self.contestants],
            "velocity_difference": _finite(self.velocity_difference),
            "standard_errors": _finite(self.standard_errors),
        }


def compare(
    experiment: Experiment,
    *,
    dt: Any = "0.01",
    locate: bool = False,
    digits: int = 30,
    events: int = 1000,
    progress: Callable[[Progress], None] | None = None,
) -> Comparison:
    """Return how exact and Verlet fare beside the certified solver, with the same disorder.

    Parameters
    ----------
    experiment : Experiment
        Chain, drive, seed and start; its solver and what it records do not matter.
    dt : number
        Verlet's time step, unit tau_dyn.
    locate : bool
        Whether Verlet finds events inside a step.
    digits : int
        Of the certified solver.
    events : int
        About how many certified events to compare; the drive may end before.
    progress : callable, optional
        Called with a `Progress`.

    Returns
    -------
    Comparison
        Two `contestants`: how many events of each agree, the first that does not, how close
        that tie was, and the position errors of all rest states.

    Raises
    ------
    InputError
        If an argument is out of range, nothing happens in the experiment, or the first thing that
        happens never ends.

    Notes
    -----
    Guarantee: events agree in kind, sliders, directions and order, and the certified ones are
    those of the equations, as far as its evidence says ``PROVED``. Statistics come from runs of the
    whole drive, or of its first 200 000 events.
    """
    if not isinstance(experiment, Experiment):
        raise InputError("experiment", experiment, "must be an Experiment, e.g. of a scene")
    most = whole_number(events, "events", least=1, most=MOST_EVENTS)
    options = {
        "exact": {},
        "verlet": {"dt": dt, **({"locate": True} if locate else {})},
        "certified": {"digits": digits},
    }
    for name, given in options.items():
        solver_named(name, given)
    say = reporter(progress)
    path, ends = _broken_drive(experiment, most)
    say("certified", 0.0)
    truth = _Taken.of(
        experiment,
        "certified",
        options["certified"],
        path,
        most,
        lambda done: say("certified", done),
    )
    targets = truth.x.shape[0]
    if targets == 0:
        raise InputError("scene", "a first rearrangement without end", "must come to rest once")
    contestants = []
    for name in ("exact", "verlet"):
        say(name, 0.0)
        course = _Taken.of(experiment, name, options[name], path, None, None, targets)
        run = creep(
            experiment.chain,
            experiment.drive,
            seed=experiment.seed,
            start=experiment.start,
            solver=name,
            max_events=_STATISTICS_EVENTS,
            progress=lambda p, name=name: say(  # type: ignore[misc]
                f"{name}, statistics", p.half_cycles / max(p.total, 1)
            ),
            **options[name],
        )
        contestants.append(_judged(experiment, name, options[name], path, course, truth, ends, run))
    return Comparison(
        experiment=experiment,
        digits=digits,
        events=len(truth.events),
        rearrangements=len(truth.log),
        half_cycles=ends[targets - 1] if targets else 0,
        evidence=truth.evidence,
        radius=float(truth.radii.max()) if truth.radii.size else 0.0,
        contestants=tuple(contestants),
    )


def _broken_drive(experiment: Experiment, events: int) -> tuple[Path, list[int]]:
    """Return the drive with a breakpoint between any two rearrangements, as far as is needed.

    With it the half-cycle that each breakpoint belongs to.
    """
    drive, seed = experiment.drive, experiment.seed
    simulation = solver_named("exact", {}).simulation(
        experiment.chain, experiment.initial, seed, ("x_G", "events")
    )
    theta: list[Fraction] = []
    ends: list[int] = []
    for q in range(1, drive.half_cycles + 1):
        before: float | None = None  # theta_c of the rearrangement before
        reached = False
        while not reached:
            stretch = simulation.follow(drive, q, 1, Limits(events))
            for one in rearrangements(stretch.recorded):
                here = float(one.theta)
                if before is not None and before != here:
                    theta.append((Fraction(before) + Fraction(here)) / 2)
                    ends.append(q)
                before = here
            reached = bool(stretch.completed) or stretch.stop.final
            if simulation.tally.events >= 2 * events + 100 and theta and not reached:
                return Path(theta), ends  # a half-cycle may have more events than memory holds
        theta.append(drive.exact_target(q, seed))
        ends.append(q)
        if stretch.stop.final or simulation.tally.events >= events:
            break
    if simulation.tally.events == 0:
        raise InputError("scene", "no events", "must drive the chain so far that a slider slips")
    return Path(theta), ends


@dataclass(frozen=True, eq=False)
class _Taken:
    """What one solver made of the broken drive."""

    log: list[LoggedRearrangement]
    events: list[LoggedEvent]
    x: NDArray[Any]
    radii: NDArray[np.float64]
    evidence: Evidence

    @classmethod
    def of(
        cls,
        experiment: Experiment,
        solver: str,
        options: Mapping[str, Any],
        path: Path,
        most: int | None,
        say: Callable[[float], None] | None,
        targets: int | None = None,
    ) -> _Taken:
        """Return how far a solver came in about `most` events, or to all `targets`."""
        simulation = solver_named(solver, dict(options)).simulation(
            experiment.chain, experiment.initial, experiment.seed, ("x_G", "x", "events")
        )
        parts: list[Mapping[str, NDArray[Any]]] = []
        done, total = 0, path.half_cycles if targets is None else targets
        while done < total:
            stretch = simulation.follow(path, done + 1, 1, Limits(1 << 40))
            parts.append(stretch.recorded)
            done += stretch.completed
            events = simulation.tally.events
            if say is not None and most is not None:
                say(min(1.0, events / most))
            if stretch.stop.final or (most is not None and events >= most):
                break
        recorded = joined(parts)
        x = recorded["x"]
        known = [enclosure(value).radius for value in x.ravel().tolist()]
        radii = np.array([nearest_float(radius) for radius in known])
        log = rearrangements(recorded)
        return cls(log, numbered(log), x, radii, simulation.evidence)


def _judged(
    experiment: Experiment,
    solver: str,
    options: Mapping[str, Any],
    path: Path,
    course: _Taken,
    truth: _Taken,
    ends: list[int],
    run: Creep,
) -> Contestant:
    """Return how a solver's course stands beside the certified one."""
    size = min(len(course.x), len(truth.x))
    errors = np.array(
        [_distance(a, b) for a, b in zip(course.x[:size], truth.x[:size], strict=True)]
    )
    differs = first_difference(course.events, truth.events)
    agreed, own, certified = (len(truth.events), None, None) if differs is None else differs
    until = size
    tie = None
    for event in (own, certified):
        if event is not None:
            until = min(until, event.half_cycle - 1)
    if own is not None or certified is not None:
        tie = _tie(experiment, path, truth, own, certified)

    def placed(event: LoggedEvent | None) -> LoggedEvent | None:
        return None if event is None else event._replace(half_cycle=ends[event.half_cycle - 1])

    return Contestant(
        solver=solver,
        options=dict(options),
        agreed=agreed,
        own=placed(own),
        certified=placed(certified),
        tie=tie,
        compared=until,
        error_before=float(errors[:until].max()) if until else math.nan,
        error_after=float(errors.max()) if errors.size else math.nan,
        errors=errors,
        creep=run,
    )


def _distance(a: NDArray[Any], b: NDArray[Any]) -> float:
    """Return the largest difference of two lists of positions, exactly and then rounded."""
    pairs = zip(a.tolist(), b.tolist(), strict=True)
    return max(nearest_float(abs(enclosure(x).middle - enclosure(y).middle)) for x, y in pairs)


def _tie(
    experiment: Experiment,
    path: Path,
    truth: _Taken,
    own: LoggedEvent | None,
    certified: LoggedEvent | None,
) -> Tie:
    """Return how close the certified motion comes to the other side's event."""
    chain = experiment.chain
    course = Course(chain, experiment.initial, FLOAT64, seed=experiment.seed, refine=False)
    claimed = own if own is not None and not _later(own, certified) else certified
    assert claimed is not None  # two runs that differ have an event that does
    other = certified if claimed is own else own
    half_cycle = 1
    for one in truth.log[: claimed.rearrangement]:
        for target in range(half_cycle, one.half_cycle):
            course.ramp(course.load_of(path.theta[target - 1]))
        half_cycle = one.half_cycle
        course.rearrange(_plain(one.events))
    for target in range(half_cycle, claimed.half_cycle):
        course.ramp(course.load_of(path.theta[target - 1]))
    slider, sign = claimed.event.sliders[0] - 1, claimed.event.signs[0]
    if claimed.number == 0:
        there = course.load_of(path.theta[claimed.half_cycle - 1])
        if other is not None and not _later(other, claimed):
            there = course.starting_load(other.event.sliders[0] - 1, other.event.signs[0])
        margin = abs(course.starting_load(slider, sign) - there)
        return Tie("load", slider + 1, float(margin), None)
    shared = _plain(truth.log[claimed.rearrangement].events[: claimed.number])
    flow = course.enter(shared)
    runs, last = flow.runs(), shared[-1]
    claimed_time = _seconds(claimed.event.time)
    apart = None
    if other is not None and not _later(other, claimed):
        apart = abs(claimed_time - _seconds(other.event.time))
    since = max(claimed_time - last.time, 0.0)
    moving = {n for run in runs for n in run.sliders}
    if claimed.event.kind is EventKind.STOP and slider in moving:
        _, velocity, _ = slider_motion(runs, slider, since)
        return Tie("velocity", slider + 1, abs(float(velocity)), apart)
    if slider in moving:  # it starts on one side only because it has stopped there
        _, velocity, _ = slider_motion(runs, slider, since)
        return Tie("velocity", slider + 1, abs(float(velocity)), apart)
    margin = course.margin(flow, runs, slider, sign, since)[0]
    return Tie("force", slider + 1, abs(float(margin)), apart)


def _later(a: LoggedEvent, b: LoggedEvent | None) -> bool:
    """Return whether `a` belongs to a later rearrangement or half-cycle than `b`."""
    return b is not None and (a.half_cycle, a.rearrangement) > (b.half_cycle, b.rearrangement)


def _plain(events: Sequence[Event]) -> list[Event]:
    """Return events with their times in float64."""
    return [replace(event, time=_seconds(event.time)) for event in events]


def _seconds(time: Any) -> float:
    return nearest_float(enclosure(time).middle)


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
