"""Exact, Verlet and certified side by side, with the same disorder: where do they part, and why?

All contestants follow the same drive, with breakpoints between the rearrangements that change
nothing but let their positions be compared after each one. The certified solver is the truth. For
each of the others: the first event that differs, how close the tie was there in the certified
motion, how far positions were off until then and after, and what remains of the mean velocity.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

from exactcreep.display import shows_progress
from exactcreep.limits import Limits
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Drive
from exactcreep.model.enclosure import enclosure
from exactcreep.model.numbers import InputError, Number, nearest_float, plain_data, whole_number
from exactcreep.model.outcome import Evidence
from exactcreep.model.state import State
from exactcreep.motion.arithmetic import FLOAT64
from exactcreep.motion.itinerary import Retracer, slider_motion
from exactcreep.progress import Hearer, Progress, reporter
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.quasistatic.result import Creep
from exactcreep.studies.contest import (
    MOST_EVENTS,
    STATISTICS_EVENTS,
    Agreement,
    Contestant,
    Standard,
)
from exactcreep.studies.partings import DEFAULT_SEEDS, DEFAULT_STEPS, Partings, partings


class Tie(NamedTuple):
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


@dataclass(frozen=True, eq=False)
class Standing(Agreement):
    """How one solver stands beside the certified one.

    Its events carry the half-cycles of the drive; its errors are those of displacements, unit
    ``g tau_dyn**2``. Attributes as in `Agreement`, and:

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
        own = ("velocity", "velocity_error", "half_cycles", "undecided", "trusted_half_cycles",
               "seconds")  # fmt: skip
        difference = {
            "own": self.own and self.own.summary(),
            "certified": self.known and self.known.summary(),
            "tie": self.tie and self.tie._asdict(),
        }
        return plain_data(
            {
                "solver": self.contestant.solver,
                "options": self.contestant.options,
                "events_agreed": self.agreed,
                "first_difference": difference if self.differs else None,
                "rests_compared": self.compared,
                "position_error_before": self.error_before,
                "position_error_after": self.error_after,
                "slips_per_half_cycle": run.slip_count / max(run.half_cycles, 1),
                "outcome": run.outcome.value,
                "evidence": run.evidence.value,
                "course": run.course or None,
            }
            | {name: getattr(run, name) for name in own}
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
        chosen = DEFAULT_SEEDS if seeds is None else seeds
        steps = DEFAULT_STEPS if dts is None else dts
        return partings(experiment, seeds=chosen, dts=steps, digits=digits, events=most, say=say)
    verlet = Contestant("verlet", {"dt": dt} | ({"locate": True} if locate else {}))
    contestants = Contestant("exact"), verlet
    for one in (*contestants, Contestant("certified", {"digits": digits})):
        one.algorithm()
    say("certified", 0.0)
    truth = Standard(
        experiment, digits, most, say=lambda done: say("certified", min(1.0, done / most))
    )
    certified = truth.walk
    if certified.reached == 0:
        raise InputError("scene", "a first rearrangement without end", "must come to rest once")
    standings = []

    def running(name: str, progress: Progress) -> None:
        say(f"{name}, statistics", progress.half_cycles / max(progress.total, 1))

    for contestant in contestants:
        say(contestant.solver, 0.0)
        found = truth.agreement(contestant)
        told = partial(running, contestant.solver)
        limits = Limits(STATISTICS_EVENTS)
        run = contestant.run(experiment, limits, told, record=("x_G",), twin=True)
        tie = _tie(truth, found) if found.differs else None
        own, known = (
            event and event._replace(half_cycle=truth.ends[event.half_cycle - 1])
            for event in (found.own, found.known)
        )
        standings.append(
            Standing(found.agreed, own, known, found.compared, found.errors, contestant, tie, run)
        )
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


def _tie(truth: Standard, found: Agreement) -> Tie:
    """Return how close the certified motion comes to the other side's event."""
    experiment, log = truth.experiment, truth.walk.log
    chain, start, seed = experiment.chain, experiment.initial, experiment.seed
    retracer = Retracer(chain, start, FLOAT64, seed=seed, refine=False)
    differ = [event for event in (found.own, found.known) if event is not None]
    claimed = min(differ, key=lambda event: event[:2])  # of two in one rearrangement its own
    together = [one.event for one in differ if one[:2] == claimed[:2]]
    plain = [
        [replace(event, time=_instant(event.time)) for event in one.events]
        for one in log[: claimed.rearrangement + 1]
    ]
    for events in plain[: claimed.rearrangement]:
        retracer.rearrange(events)
    slider, sign = claimed.event.sliders[0] - 1, claimed.event.signs[0]
    if claimed.number == 0:
        loads = [retracer.starting_load(one.sliders[0] - 1, one.signs[0]) for one in together]
        loads.append(retracer.load_of(experiment.drive.exact_target(claimed.half_cycle, 0)))
        return Tie("load", slider + 1, float(abs(loads[0] - loads[1])), None)
    times = [_instant(one.time) for one in together]
    apart = abs(times[0] - times[1]) if len(times) > 1 else None
    shared = plain[claimed.rearrangement][: claimed.number]
    flow = retracer.enter(shared)
    runs, since = flow.runs(), max(times[0] - shared[-1].time, 0.0)
    if any(slider in run.sliders for run in runs):
        # it stops, or starts on one side only because it has stopped there
        condition, (_, margin, _) = "velocity", slider_motion(runs, slider, since)
    else:
        condition, (margin, _) = "force", retracer.margin(flow, runs, slider, sign, since)
    return Tie(condition, slider + 1, abs(float(margin)), apart)


def _instant(time: Any) -> float:
    """Return a time, unit tau_dyn, in float64."""
    return nearest_float(enclosure(time).middle)
