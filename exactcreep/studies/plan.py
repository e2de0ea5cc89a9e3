"""Choose the solver for a scene: why, what a run costs, and how far to trust it."""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from exactcreep.laws import Prediction, edges, pivots, prediction
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles, Drive
from exactcreep.model.numbers import Number, nearest_float, whole_number
from exactcreep.model.outcome import Outcome
from exactcreep.model.result import Result
from exactcreep.model.state import State
from exactcreep.model.uniform import require_uniform
from exactcreep.quasistatic.creep import PhysicsWarning, creep
from exactcreep.quasistatic.creep_result import Creep
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.scene import Scene
from exactcreep.solvers.interface import compile_for, simulate
from exactcreep.solvers.registry import require_solver
from exactcreep.studies.compare import COMPILED, shortened
from exactcreep.studies.trajectory import Method
from exactcreep.watch.limits import NO_LIMITS, Limits, OutOfTime
from exactcreep.watch.progress import Hearer, reporter

FLOAT_DIGITS = 15
"""Significant digits that float64 holds."""
_FIRST = 4  # half-cycles of the first pilot
_AT_REST = 2**14  # half-cycles of a pilot at rest: so long the search for a return costs more
_MOST = 1_000_000  # most events of a pilot
_COUNTED = 20_000  # least events of the last pilot when events are counted
_PILOT = 0.02  # least processor time of the last pilot when time is measured, in seconds
_FOLLOWED = 20_000  # events over which perturbed copies are followed
_TIMED = 200  # events timed for solvers that take milliseconds each: certified
_SWINGS = 10_000  # targets whose mean distance is the swing of theta
_MANY_SLIPS = 100  # least slips of an end in a swing; then slips shift the threshold by under 1 %
_ROUNDING = Fraction(1, 2**40)  # more than float64 rounds cos(alpha), relative
_NEXT_PIVOT = 0.025  # most change of the descent by one pivot, relative
_NO_INERTIA = {
    "law": "a theorem tells the velocity without following any slip",
    "sliding": "sliders slide with theta, and never accelerate",
}


class Need(NamedTuple):
    """Something that a scene needs or does not need, and why; `_needs` lists all of them."""

    name: str
    needed: bool
    reason: str


@dataclass(frozen=True, eq=False, repr=False)
class Plan(Result):
    """The solver that answers a question about a scene, why, at what cost, and how reliably.

    Attributes
    ----------
    experiment, digits, explicit
        The arguments; the solver that the scene itself names, which a plan never overrides.
    solver, reason, needs
        The solver, or ``law`` if a closed form is the answer; why; what the scene needs.
    law : tuple of float
        The mean velocity by the law that holds: several values if the start decides, empty without
        a law.
    law_name : str
        The name of the law, in words.
    law_deviation : float
        Measured difference between runs and the law; nan if unknown.
    theorems : mapping of str to float
        Amplitudes of cycles between the fates of the chain, see `exactcreep.laws.edges`.
    events, seconds : float
        Estimates for the whole run from its first half-cycles: events of `exact`, the same on every
        machine, and processor time on this machine; nan if unknown.
    known_until : int or None
        Number of targets up to which the trajectory of `exact` is known, of those that 20,000
        events reach; None if no events were counted.

    Examples
    --------
    >>> plan(pair, Cycles("0.001", 50)).solver
    'law'
    """

    experiment: Experiment
    digits: int
    explicit: str | None
    solver: str
    reason: str
    needs: tuple[Need, ...]
    law: tuple[float, ...]
    theorems: Mapping[str, float]
    events: float = math.nan
    seconds: float = math.nan
    known_until: int | None = None
    law_name: str = ""
    law_deviation: float = math.nan

    @property
    def finding(self) -> str:
        """The solver that answers the question."""
        return self.solver

    told = (
        "solver", "reason", "law", "events", "seconds", "known_until",
        "explicit", "digits", "theorems", "law_name", "law_deviation",
    )  # fmt: skip

    def _facts(self) -> dict[str, Any]:
        facts = {name: getattr(self, name) for name in self.told[:6]}
        return {name: value for name, value in facts.items() if value == value and value != ()}

    def _numbers(self) -> dict[str, Any]:
        needs = {n.name: {"needed": n.needed, "reason": n.reason} for n in self.needs}
        half_cycles = self.experiment.drive.half_cycles
        return {**super()._numbers(), "half_cycles": half_cycles, "needs": needs}


def plan(
    chain: Chain,
    drive: Drive,
    *,
    digits: Number = FLOAT_DIGITS,
    record: tuple[str, ...] = (),
    seed: int = 0,
    start: State | None = None,
) -> Plan:
    """Return which solver answers a question about a chain and a drive, why, and at what cost.

    Parameters
    ----------
    chain : Chain
        Sliders, springs and friction.
    drive : Drive
        The dilations that the chain follows.
    digits : int
        Significant digits of the trajectory.
    record : tuple of str
        Quantities to record besides the mean velocity.
    seed : int
        Seed of the disorder and of a random drive.
    start : State, optional
        Default: the relaxed chain.

    Returns
    -------
    Plan
        The solver and why, the velocity by a law that holds, and the cost of a run.

    Raises
    ------
    InputError
        If an argument is out of range.

    Notes
    -----
    Guarantee: rules and theorems choose the solver, never a measured time; everything but the
    seconds depends only on the arguments. `law_deviation` was measured in runs: 0 if the law is a
    theorem. Events and seconds are extrapolated from the first half-cycles.

    Examples
    --------
    >>> chain = Chain(2, 1000, "0.5", "0.6", sigma_mu="0.01", tan_alpha="0.25")
    >>> plan(chain, Cycles("0.001", 50)).solver
    'exact'
    """
    experiment = Experiment(chain, drive, seed=seed, start=start, record=record)
    return _planned(experiment, digits, None)


def plan_scene(
    scene: Scene,
    *,
    digits: Number = FLOAT_DIGITS,
    max_seconds: Number | None = None,
    progress: Hearer = None,
) -> list[tuple[Mapping[str, Any], Plan]]:
    """Return the settings and the plan of every member of a scene that `max_seconds` allows."""
    plans: list[tuple[Mapping[str, Any], Plan]] = []
    limits, say = Limits.of(max_seconds=max_seconds), reporter(progress)
    total, run = len(scene.settings()), scene.tables["run"]
    for member in scene.members():
        settings, own = member.settings, member.experiment
        say("planning", len(plans), total, "members")
        if "record" not in run and "run.record" not in settings:
            own = replace(own, record=())
        named = settings.get("run.solver", run.get("solver"))
        solid = member.solid is not None
        try:
            limits.require()
            plans.append((settings, _planned(own, digits, named, limits, solid=solid)))
        except OutOfTime:
            break
    return plans


def _planned(
    experiment: Experiment, digits: Any, explicit: str | None, limits: Limits = NO_LIMITS,
    *, solid: bool = False,
) -> Plan:  # fmt: skip
    """Return the plan of one experiment; `solid`: the scene describes a solid in SI units."""
    require_uniform(experiment.chain.parameters(), "a plan by laws")
    experiment.drive.require_one_dilation("a plan by laws")
    wanted = whole_number(digits, "digits", least=1, most=100_000)
    if explicit is not None:
        require_solver("run.solver", explicit)
    chain, drive = experiment.chain, experiment.drive
    predicted = prediction(chain, drive, experiment.start)
    solver, reason, *law = _chosen(experiment, wanted, explicit, predicted, solid=solid)
    about_law: dict[str, Any] = {"law_name": reason, "law_deviation": 0.0} if law else {}
    if not law and predicted is not None:
        law = [*predicted.values]
        about_law = {"law_name": predicted.law, "law_deviation": predicted.deviation}
    theorems = edges(chain) if isinstance(drive, Cycles) else {}
    own = {"digits": wanted} if solver == "certified" else {}
    method = Method(solver, **(experiment.options if explicit else own))
    cost = {} if solver in _NO_INERTIA else _expected(experiment, method, limits)
    needs = _needs(experiment, solver, wanted)
    return Plan(experiment, wanted, explicit, solver, reason, needs, tuple(law), theorems,
                **about_law, **cost)  # fmt: skip


def _chosen(
    experiment: Experiment, digits: int, explicit: str | None, predicted: Prediction | None,
    *, solid: bool,
) -> tuple[Any, ...]:  # fmt: skip
    """Return the solver by the first rule that applies, the reason, and a velocity if known."""
    chain, recorded = experiment.chain, bool(experiment.record)
    slope, relaxed = abs(chain.tan_alpha), experiment.start is None and chain.sigma_mu == 0
    if explicit is not None:
        return explicit, "the scene names it"
    held = chain.mu_s if relaxed else chain.mu_d  # draws below mu_d act as mu_d
    if chain.n == 1 and slope <= held and not recorded:
        return "law", "one slider has no spring: it rests for ever", 0.0
    if chain.slides:
        why = "mu_s = mu_d without disorder: there are no slips, and the sliding limit is exact"
        return "sliding", why
    if relaxed and chain.n > 1 and not recorded:
        if chain.l0 * Fraction(experiment.widest) < chain.first_start * (1 - _ROUNDING):
            why = "l0 |theta| stays below mu_s c - |s|: no end of the relaxed chain ever starts"
            return "law", why, 0.0
        staircase = predicted is not None and predicted.staircase is not None
        if staircase and digits <= FLOAT_DIGITS:
            return "law", "two relaxed sliders without disorder: the staircase is exact"
    if digits > FLOAT_DIGITS:
        return "certified", f"more than {FLOAT_DIGITS} digits: float64 does not hold them"
    if solid and set(experiment.record) <= {"x_G"} and _continuous(experiment):
        why = "a solid that makes many slips in every swing: static friction moves its descent by"
        why += f" less than the next pivot is worth, at most {100 * _NEXT_PIVOT:g} % (measured on"
        return "sliding", f"{why} 10 to 80 contacts, not proved)"
    why = "every event counts, and float64 holds the digits asked for"
    if slope == chain.mu_d:
        why += "; at tan_alpha = mu_d an avalanche may never end (max_events)"
    return "exact", why


def _continuous(experiment: Experiment) -> bool:
    """Return whether slips are many, and the next pivot changes the descent by little."""
    chain, drive = experiment.chain, experiment.drive
    slope = abs(chain.tan_alpha)
    if not 0 < slope < chain.mu_d:
        return False
    targets = drive.targets(1, min(drive.half_cycles, _SWINGS), experiment.seed)
    swing = np.abs(np.diff(targets, prepend=experiment.theta)).mean() / 2
    taken = chain.n * float(chain.mu_d - slope) * chain.cos_alpha / 2
    many = float(chain.l0) * swing - taken >= _MANY_SLIPS * 2 * chain.excess
    gear = chain.n + 3 - 2 * max(pivots(chain.n, slope, chain.mu_d))
    return bool(many and _NEXT_PIVOT * gear >= 2)


def _expected(experiment: Experiment, method: Method, limits: Limits) -> dict[str, Any]:
    """Return the events and the cost of a run, and how far its trajectory can be trusted."""
    chain, drive = experiment.chain, experiment.drive
    about: dict[str, Any] = {"seed": experiment.seed, "start": experiment.start}
    own = {"solver": method.solver, "record": experiment.record, **method.options}
    compile_for(method.algorithm(), chain, experiment.record)

    def run(part: Drive, most: int, **how: Any) -> Creep:
        left = limits.seconds_left
        pilot = creep(
            chain, part, max_events=most, max_seconds=left, progress=False, **how, **about
        )
        limits.require()  # otherwise the number of events would depend on the time
        return pilot

    def counted(part: Drive) -> _Pilot:
        return _Pilot.of(run(part, _MOST, record=()))

    def timed(part: Drive) -> _Pilot:
        seconds = math.inf
        for _ in range(3):  # the first may have loaded or compiled code
            begin = time.process_time()  # other processes do not count
            pilot = run(part, _MOST, **own)
            seconds = min(seconds, time.process_time() - begin)
        return _Pilot.of(pilot)._replace(seconds=seconds)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)  # the user's own run will warn
        followed = run(drive, _FOLLOWED, record=())
        trust: dict[str, Any] = {"known_until": followed.known_until}
        # the number of events, counted or estimated, must not depend on a measured time
        pilots = _pilots(
            drive, counted, lambda p: p.events >= _COUNTED or p.half_cycles >= _AT_REST
        )
        if followed.outcome is Outcome.RUNAWAY or not pilots[-1].half_cycles:
            return trust
        events = _total(drive.half_cycles, [(pilot.half_cycles, pilot.events) for pilot in pilots])
        if method.solver in COMPILED:
            pilots = _pilots(drive, timed, lambda pilot: pilot.seconds >= _PILOT)
            spent = [(pilot.half_cycles, pilot.seconds) for pilot in pilots]
            seconds = _total(drive.half_cycles, spent)
        else:
            seconds = events * _pace(experiment, method, limits)
    return trust | {"events": events, "seconds": seconds}


class _Pilot(NamedTuple):
    """The first half-cycles of a run, and their cost; `cut` if its limit of events ended it."""

    half_cycles: int
    events: int
    cut: bool
    seconds: float = math.nan

    @classmethod
    def of(cls, run: Creep) -> _Pilot:
        return cls(run.half_cycles, run.event_count, run.outcome is Outcome.LIMIT)


def _pilots(
    drive: Drive, run: Callable[[Drive], _Pilot], enough: Callable[[_Pilot], bool]
) -> list[_Pilot]:
    """Return at least two pilots, each twice as long as the last, until a pilot is enough."""
    pilots: list[_Pilot] = []
    half_cycles, ended = _FIRST, False
    while not ended:
        part = shortened(drive, half_cycles)
        pilots.append(pilot := run(part))
        moves = len(pilots) > 1 and pilot.events > pilots[-2].events
        long = enough(pilot) and (moves or pilot.half_cycles >= _AT_REST)
        ended = pilot.cut or part.half_cycles >= drive.half_cycles or (long and len(pilots) > 1)
        half_cycles *= 2
    return pilots


def _total(half_cycles: int, pilots: Sequence[tuple[int, float]]) -> float:
    """Return the cost of all half-cycles, by the difference of the last two pilots."""
    (before, less), (reached, most) = [(0, 0.0), *pilots][-2:]
    rate = min(max(most - less, 0) / max(reached - before, 1), most / reached)
    return most + rate * (half_cycles - reached)


def _pace(experiment: Experiment, method: Method, limits: Limits) -> float:
    simulation = method.simulation(experiment)
    begin = time.process_time()
    most = replace(limits, events=_TIMED)
    _ = [*simulate(simulation, experiment.drive, [min(_FIRST, experiment.drive.half_cycles)], most)]
    seconds = time.process_time() - begin
    return seconds / simulation.tally.events if simulation.tally.events else math.nan


def _needs(experiment: Experiment, solver: str, digits: int) -> tuple[Need, ...]:
    chain, random, record = experiment.chain, experiment.drive.random, experiment.record
    inertia, drawn = solver not in _NO_INERTIA, chain.sigma_mu != 0
    slips = "every slip feels the excess mu_s - mu_d and may set neighbours in motion"
    disorder = "sigma_mu = 0: no coefficient is drawn"
    if drawn:
        disorder = f"sigma_mu = {nearest_float(chain.sigma_mu):.3g}: every stop draws a coefficient"
    recorded = "recorded: " + ", ".join(record) if record else "only the velocity is asked for"
    theta, many = "drawn at every target" if random else "given", digits > FLOAT_DIGITS
    held = f"{digits} are asked for, float64 holds {FLOAT_DIGITS}"
    return (
        Need("disorder", inertia and drawn, disorder),
        Need("random dilations", random, "theta is " + theta),
        Need("inertia", inertia, _NO_INERTIA.get(solver, slips)),
        Need("trajectories", bool(record), recorded),
        Need("digits", many, held if many else "float64 holds all that are asked for"),
    )
