"""Exact, Verlet and certified side by side, with the same disorder: where do they part, and why?

All contestants follow the same drive, with breakpoints between the rearrangements that change
nothing but let their positions be compared after each one. The certified solver is the truth. For
each of the others: the first event that differs, how close the tie was there in the certified
motion, how far positions were off until then and after, and what remains of the mean velocity.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from exactcreep.display import shows_progress
from exactcreep.model.chain import Chain
from exactcreep.model.contacts import Event
from exactcreep.model.drive import Drive
from exactcreep.model.numbers import InputError, Number, nearest_float, plain_data, whole_number
from exactcreep.model.outcome import Evidence
from exactcreep.model.state import State
from exactcreep.motion.arithmetic import FLOAT64
from exactcreep.motion.itinerary import Retracer, slider_motion
from exactcreep.progress import Hearer, reporter
from exactcreep.quasistatic.creep import creep
from exactcreep.quasistatic.decimals import enclosure
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.quasistatic.result import Creep
from exactcreep.studies.contest import (
    MOST_EVENTS,
    Agreement,
    Contestant,
    Standard,
)
from exactcreep.studies.eventlog import LoggedEvent
from exactcreep.studies.partings import DEFAULT_SEEDS, DEFAULT_STEPS, Partings, partings

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
        return asdict(self)


@dataclass(frozen=True, eq=False)
class Standing(Agreement):
    """How one solver stands beside the certified one.

    Its events carry the half-cycles of the drive; its errors are those of displacements, unit
    ``g tau_dyn**2``.

    Attributes
    ----------
    contestant : Contestant
    tie : Tie or None
        At the first event that differs.
    creep : Creep
        The run behind the statistics.
    """

    contestant: Contestant
    tie: Tie | None
    creep: Creep

    def summary(self) -> dict[str, Any]:
        """Return the standing by names, ready for JSON."""
        run = self.creep
        return plain_data(
            {
                "solver": self.contestant.solver,
                "options": self.contestant.options,
                "events_agreed": self.agreed,
                "first_difference": None
                if not self.differs
                else {
                    "own": None if self.own is None else self.own.summary(),
                    "certified": None if self.known is None else self.known.summary(),
                    "tie": None if self.tie is None else self.tie.summary(),
                },
                "rests_compared": self.compared,
                "position_error_before": self.error_before,
                "position_error_after": self.error_after,
                "velocity": run.velocity,
                "velocity_error": run.velocity_error,
                "slips_per_half_cycle": run.slip_count / max(run.half_cycles, 1),
                "half_cycles": run.half_cycles,
                "outcome": run.outcome.value,
                "evidence": run.evidence.value,
                "undecided": run.undecided,
                "trusted_half_cycles": run.trusted_half_cycles,
                "course": run.course or None,
                "seconds": run.seconds,
            }
        )


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
    contestants : tuple of Standing
        ``exact`` first.

    Examples
    --------
    >>> from exactcreep import Chain, Cycles, compare
    >>> chain = Chain(2, 1000, "0.5", "0.6", tan_alpha="0.25")
    >>> found = compare(chain, Cycles("0.001", 5), dt="0.1", events=20)
    >>> found.evidence.value, found.events, [one.differs for one in found.contestants]
    ('proved', 20, [False, False])
    """

    experiment: Experiment
    digits: int
    events: int
    rearrangements: int
    half_cycles: int
    evidence: Evidence
    radius: float
    contestants: tuple[Standing, ...]

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
        return plain_data(
            {
                "certified": {
                    "digits": self.digits,
                    "events": self.events,
                    "rearrangements": self.rearrangements,
                    "half_cycles": self.half_cycles,
                    "evidence": self.evidence.value,
                    "largest_radius": self.radius,
                },
                "contestants": [contestant.summary() for contestant in self.contestants],
                "velocity_difference": self.velocity_difference,
                "standard_errors": self.standard_errors,
            }
        )


@shows_progress
def compare(
    chain: Chain | Experiment,
    drive: Drive | None = None,
    *,
    seed: int | None = None,
    start: State | None = None,
    dt: Number = "0.01",
    locate: bool = False,
    digits: int = 30,
    events: int = 1000,
    seeds: int | Sequence[int] | None = None,
    dts: Sequence[Number] | None = None,
    progress: Hearer = None,
) -> Comparison | Partings:
    """Return how exact and Verlet fare beside the certified solver, with the same disorder.

    With `seeds` or `dts`, over many seeds and time steps, without and with located events.

    Parameters
    ----------
    chain : Chain or Experiment
        An experiment, e.g. of a scene, brings its drive, seed and start; its solver and what it
        records do not matter.
    drive : Cycles, GaussianSteps, Path or TemperatureRecord
    seed : int, optional
        Of the disorder: static coefficients and random dilations; default 0.
    start : State, optional
        Default: the relaxed chain. A start that is not at rest is first rearranged.
    dt : number
        Verlet's time step, unit tau_dyn.
    locate : bool
        Whether Verlet finds events inside a step.
    digits : int
        Of the certified solver.
    events : int
        About how many certified events to compare, of each seed; the drive may end before.
    seeds : int or sequence of int, optional
        How many, from the experiment's own on, or which. If only `dts` is given: 8.
    dts : sequence of number, optional
        Time steps. If only `seeds` is given: 0.1, 0.03, 0.01. Beside them neither `dt` nor
        `locate` plays a part.
    progress : bool or callable, optional
        A callable is called with a `Progress`; else as for `creep`.

    Returns
    -------
    Comparison or Partings
        `Partings` with `seeds` or `dts`: the first wrong event, the position error before it, its
        order in dt, and the bias of the mean velocity, with intervals. Else a `Comparison` of two
        `contestants`: how many events of each agree, the first that does not, how close
        that tie was, and the position errors of all rest states.

    Raises
    ------
    InputError
        If an argument is out of range, nothing happens in the experiment, or the first thing that
        happens is too long for the certified solver, or never ends.

    Notes
    -----
    Guarantee: events agree in kind, sliders, directions and order, and the certified ones are
    those of the equations, as far as its evidence says ``PROVED``. Statistics come from runs of the
    whole drive, or of its first 200 000 events.

    Examples
    --------
    >>> from exactcreep import Chain, Cycles
    >>> chain = Chain(2, 1000, "0.5", "0.6", tan_alpha="0.25")
    >>> exact, verlet = compare(chain, Cycles("0.001", 5), dt="0.1", events=20).contestants
    >>> exact.differs, verlet.differs
    (False, False)
    """
    experiment = _experiment(chain, drive, seed, start)
    most = whole_number(events, "events", least=1, most=MOST_EVENTS)
    say = reporter(progress)
    if seeds is not None or dts is not None:
        return partings(
            experiment,
            seeds=DEFAULT_SEEDS if seeds is None else seeds,
            dts=DEFAULT_STEPS if dts is None else dts,
            digits=digits,
            events=most,
            say=say,
        )
    verlet = {"dt": dt, **({"locate": True} if locate else {})}
    contestants = Contestant("exact"), Contestant("verlet", verlet)
    for one in (*contestants, Contestant("certified", {"digits": digits})):
        one.algorithm()
    say("certified", 0.0)
    truth = Standard(
        experiment, digits, most, say=lambda done: say("certified", min(1.0, done / most))
    )
    if truth.walk.reached == 0:
        raise InputError("scene", "a first rearrangement without end", "must come to rest once")
    standings = []
    for contestant in contestants:
        say(contestant.solver, 0.0)
        agreement = truth.agreement(contestant)
        run = creep(
            experiment.chain,
            experiment.drive,
            seed=experiment.seed,
            start=experiment.start,
            solver=contestant.solver,
            twin=True,
            max_events=_STATISTICS_EVENTS,
            progress=lambda p, name=contestant.solver: say(  # type: ignore[misc]
                f"{name}, statistics", p.half_cycles / max(p.total, 1)
            ),
            **contestant.options,
        )
        tie = _tie(truth, agreement) if agreement.differs else None
        placed = {
            name: event and event._replace(half_cycle=truth.ends[event.half_cycle - 1])
            for name, event in (("own", agreement.own), ("known", agreement.known))
        }
        known = {**vars(agreement), **placed}
        standings.append(Standing(**known, contestant=contestant, tie=tie, creep=run))
    certified = truth.walk
    radii = [enclosure(value).radius for value in certified.x.ravel().tolist()]
    return Comparison(
        experiment=experiment,
        digits=digits,
        events=truth.events,
        rearrangements=sum(one.half_cycle <= certified.reached for one in certified.log),
        half_cycles=truth.ends[certified.reached - 1],
        evidence=certified.evidence,
        radius=nearest_float(max(radii)),
        contestants=tuple(standings),
    )


def _experiment(chain: Any, drive: Any, seed: Any, start: Any) -> Experiment:
    """Return the experiment that `compare` is asked about."""
    if not isinstance(chain, Experiment):
        return Experiment.of(chain, drive, seed=0 if seed is None else seed, start=start)
    for name, given in (("drive", drive), ("seed", seed), ("start", start)):
        if given is not None:
            raise InputError(name, given, "must not be given beside an experiment, which has one")
    return chain


def _tie(truth: Standard, agreement: Agreement) -> Tie:
    """Return how close the certified motion comes to the other side's event."""
    experiment, path, log = truth.experiment, truth.path, truth.walk.log
    chain, own, certified = experiment.chain, agreement.own, agreement.known
    course = Retracer(chain, experiment.initial, FLOAT64, seed=experiment.seed, refine=False)
    claimed = own if own is not None and not _later(own, certified) else certified
    assert claimed is not None  # two runs that differ have an event that does
    other = certified if claimed is own else own
    half_cycle = 1
    for one in log[: claimed.rearrangement]:
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
    shared = _plain(log[claimed.rearrangement].events[: claimed.number])
    flow = course.enter(shared)
    runs, last = flow.runs(), shared[-1]
    claimed_time = _instant(claimed.event.time)
    apart = None
    if other is not None and not _later(other, claimed):
        apart = abs(claimed_time - _instant(other.event.time))
    since = max(claimed_time - last.time, 0.0)
    moving = {n for run in runs for n in run.sliders}
    if slider in moving:  # it stops, or starts on one side only because it has stopped there
        _, velocity, _ = slider_motion(runs, slider, since)
        return Tie("velocity", slider + 1, abs(float(velocity)), apart)
    margin = course.margin(flow, runs, slider, sign, since)[0]
    return Tie("force", slider + 1, abs(float(margin)), apart)


def _later(a: LoggedEvent, b: LoggedEvent | None) -> bool:
    """Return whether `a` belongs to a later rearrangement or half-cycle than `b`."""
    return b is not None and (a.half_cycle, a.rearrangement) > (b.half_cycle, b.rearrangement)


def _plain(events: Sequence[Event]) -> list[Event]:
    """Return events with their times in float64."""
    return [replace(event, time=_instant(event.time)) for event in events]


def _instant(time: Any) -> float:
    """Return a time, unit tau_dyn, in float64."""
    return nearest_float(enclosure(time).middle)
