"""Plans: what a scene needs and does not need, what each solver would cost, and which to take."""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from exactcreep.laws import prediction
from exactcreep.limits import NO_LIMITS, Limits, OutOfTime
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Drive
from exactcreep.model.numbers import Number, Shown, nearest_float, plain_data
from exactcreep.model.state import State
from exactcreep.progress import Hearer, reporter
from exactcreep.quasistatic.course import course_of
from exactcreep.quasistatic.creep import PhysicsWarning, run_members
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.quasistatic.sensitivity import MOST_EVENTS
from exactcreep.scene import Scene
from exactcreep.solvers.auto import LADDER, Choice, Rung, choose, runner, valid_accuracy
from exactcreep.solvers.exact.layout import TENSION_TOLERANCE
from exactcreep.solvers.solver import Simulation, advance
from exactcreep.solvers.warm_up import warm_up

DEFAULT_ACCURACY = "0.01"
_TIMED_SECONDS = 0.2  # of a pilot run: long beside a call, short beside a reader's patience
_TIMED_TOGETHER = 10.0  # of all members of a scene


class Need(NamedTuple):
    """One thing that a scene needs or does not need, and why.

    Its name is ``disorder``, ``random dilations``, ``inertia``, ``trajectories`` or ``digits``.
    """

    name: str
    needed: bool
    reason: str


@dataclass(frozen=True, repr=False)
class Plan(Shown):
    """How to come by the answer to a question about a scene with the least effort.

    Attributes
    ----------
    experiment : Experiment
    accuracy : float
        Largest relative error, at 95 %, that is allowed.
    question : str
        ``velocity`` or ``course``.
    choice : Choice
        The rung of the ladder, all candidates with their errors, the reason, the pilot run.
    explicit : str or None
        The solver that the scene names itself, which a plan never overrides.
    needs : tuple of Need
    costs : mapping of str to float
        Predicted seconds of the scene's own run for each of `LADDER`; nan where it does not apply.
    course : str
        One sentence: how far the course of the run by `exact` can be followed; "" where that is not
        known.
    trusted_half_cycles : int or None
        As in `Creep`.

    Examples
    --------
    >>> from exactcreep import Chain, Cycles, plan
    >>> found = plan(Chain(2, 1000, "0.5", "0.6", tan_alpha="0.25"), Cycles("0.001", 50))
    >>> found.solver, sorted(found.costs)
    ('law', ['certified', 'exact', 'law', 'sliding'])
    """

    experiment: Experiment
    accuracy: float
    question: str
    choice: Choice
    explicit: str | None
    needs: tuple[Need, ...]
    costs: Mapping[str, float]
    course: str = ""
    trusted_half_cycles: int | None = None

    @property
    def solver(self) -> str:
        """The solver that will run: the explicit one if there is one, else the choice."""
        if self.explicit is not None and self.explicit != "auto":
            return self.explicit
        return self.choice.name

    def _facts(self) -> dict[str, Any]:
        return {
            "solver": self.solver,
            "question": self.question,
            "accuracy": self.accuracy,
            "accuracy_reached": self.accuracy_reached,
            "reason": self.choice.reason,
        } | {f"seconds_of_{name}": float(f"{s:.3g}") for name, s in self.costs.items() if s == s}

    @property
    def accuracy_reached(self) -> bool:
        """Whether the solver that will run is expected to reach the accuracy along this drive."""
        rungs = {rung.name: rung for rung in self.choice.candidates}
        return self.solver in rungs and rungs[self.solver].error <= self.accuracy

    def seeds(self, rung: Rung) -> float:
        """Return how many seeds reach the accuracy; inf if no number does, nan if unknown.

        So many times longer a run, of cycles or Gaussian steps, does the same.
        """
        times = rung.repeats(self.accuracy)
        return float(math.ceil(times)) if math.isfinite(times) else times

    def seconds(self, rung: Rung) -> float:
        """Return what a rung costs that reaches the accuracy; nan if it does not, or is unknown."""
        seconds = self.costs[rung.name] * self.seeds(rung)
        return seconds if math.isfinite(seconds) else math.nan

    def summary(self) -> dict[str, Any]:
        """Return the plan as plain data for JSON; a number that is not known is None."""
        own = ("solver", "explicit", "question", "accuracy", "accuracy_reached",
               "trusted_half_cycles")  # fmt: skip
        pilot = self.choice.pilot
        half_cycles = self.experiment.drive.half_cycles
        return plain_data(
            {
                "choice": self.choice.name,
                "reason": self.choice.reason,
                "half_cycles": half_cycles,
                "law": list(self.choice.law),
                "needs": {
                    name: {"needed": needed, "reason": reason}
                    for name, needed, reason in self.needs
                },
                "candidates": [
                    {
                        "solver": rung.name,
                        "applies": rung.applies,
                        "bias": rung.bias,
                        "statistical_error": rung.statistical,
                        "known_by": rung.known_by,
                        "reason": rung.reason,
                        "seconds": self.costs[rung.name],
                        "seeds_needed": self.seeds(rung),
                        "half_cycles_needed": self.seeds(rung) * half_cycles,
                        "seconds_needed": self.seconds(rung),
                    }
                    for rung in self.choice.candidates
                ],
                "pilot": None if pilot is None else vars(pilot),
                "course": self.course or None,
            }
            | {name: getattr(self, name) for name in own}
        )


def plan(
    chain: Chain,
    drive: Drive,
    *,
    accuracy: Number = DEFAULT_ACCURACY,
    question: str = "velocity",
    seed: int = 0,
    start: State | None = None,
    record: tuple[str, ...] = (),
) -> Plan:
    """Return the cheapest way to the mean velocity, or the course, of a chain, accurate enough.

    Parameters
    ----------
    chain : Chain
    drive : Drive
    accuracy : number
        Largest relative error, at 95 %, between 0 and 1.
    question : {"velocity", "course"}
        Of what: of the long-time mean velocity over disorder and starts, or of x_G and the
        tensions at every target.
    seed : int
    start : State, optional
        Default: the relaxed chain.
    record : tuple of str
        What is to be recorded besides the velocity.

    Returns
    -------
    Plan
        Its `choice` of a solver with the reason, what the run needs (`needs`), the predicted
        `costs` of every solver in seconds, whether this run reaches the accuracy, and how many
        seeds, or how many times as many cycles, do.

    Raises
    ------
    InputError
        If an argument is out of range, or a course cannot be followed.

    Notes
    -----
    Guarantee: the choice depends on the arguments alone; the predicted times are measured on this
    machine and do not influence it.

    Examples
    --------
    >>> from exactcreep import Chain, Cycles
    >>> chain = Chain(2, 1000, "0.5", "0.6", tan_alpha="0.25")
    >>> plan(chain, Cycles("0.001", 50), accuracy=0.05).choice.name
    'law'
    """
    experiment = Experiment.of(chain, drive, seed=seed, start=start, record=record)
    return _planned(experiment, accuracy, question, experiment.record)


def plan_scene(
    scene: Scene,
    *,
    accuracy: Number | None = None,
    question: str | None = None,
    max_seconds: Number | None = None,
    progress: Hearer = None,
) -> list[tuple[Mapping[str, Any], Plan]]:
    """Return, for every member of a scene, what it sets and its plan.

    A scene that does not name a `record` asks for the velocity alone.

    Parameters
    ----------
    scene : Scene
    accuracy : number, optional
        Default: that of the scene, if its solver is ``auto``, else 0.01.
    question : {"velocity", "course"}, optional
        Default: that of the scene, if its solver is ``auto``, else ``velocity``.
    max_seconds : number, optional
        After so much time the members planned so far are returned.
    progress : callable, optional
        Called with a `Progress` before every member.

    Raises
    ------
    InputError
        If a value of the scene is out of range.
    """
    plans: list[tuple[Mapping[str, Any], Plan]] = []
    members = scene.members()
    limits, say = Limits.of(max_seconds=max_seconds), reporter(progress)
    timed = min(_TIMED_SECONDS, _TIMED_TOGETHER / len(members))
    for member in members:
        say("planning", len(plans), len(members), "members")
        named = member.settings.get("run.solver", scene.tables["run"].get("solver"))
        own = member.experiment.options if named == "auto" else {}
        wanted = own.get("accuracy", DEFAULT_ACCURACY) if accuracy is None else accuracy
        asks = own.get("question", "velocity") if question is None else question
        asked = "record" in scene.tables["run"] or "run.record" in member.settings
        record = member.experiment.record if asked else ()
        try:
            one = _planned(member.experiment, wanted, asks, record, named, limits, timed)
        except OutOfTime:
            break
        plans.append((member.settings, one))
    return plans


def _planned(
    experiment: Experiment,
    accuracy: Any,
    question: str,
    record: tuple[str, ...],
    explicit: str | None = None,
    limits: Limits = NO_LIMITS,
    seconds: float = _TIMED_SECONDS,
) -> Plan:
    """Return the plan of one experiment; raise `OutOfTime` if the limits do not allow it."""
    wanted = float(valid_accuracy(accuracy))
    choice = choose(
        experiment.chain,
        experiment.drive,
        accuracy=accuracy,
        question=question,
        start=experiment.start,
        seed=experiment.seed,
        record=record,
        limits=limits,
    )
    begun = []
    if any(rung.name == "exact" and rung.applies for rung in choice.candidates):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PhysicsWarning)  # the run itself will say it
            left = limits.seconds_left
            allowed = Limits(MOST_EVENTS, seconds=math.inf if left is None else left)
            own: dict[str, Any] = {"solver": "exact", "options": {}, "burn_in": None}
            own |= {"record": (), "twin": True}
            begun = run_members([replace(experiment, **own)], limits=allowed)
    limits.require()
    return Plan(
        experiment=experiment,
        accuracy=wanted,
        question=question,
        choice=choice,
        explicit=explicit,
        needs=_needs(experiment, choice, wanted, record),
        costs=_costs(experiment, choice, wanted, seconds),
        course=course_of(begun),
        trusted_half_cycles=begun[0].trusted_half_cycles if begun else None,
    )


def _needs(
    experiment: Experiment, choice: Choice, accuracy: float, record: tuple[str, ...]
) -> tuple[Need, ...]:
    chain, random = experiment.chain, experiment.drive.random
    inertia, digits = choice.name in ("exact", "certified"), accuracy < TENSION_TOLERANCE
    disorder = moving = "within the accuracy it does not change the velocity"
    if chain.sigma_mu == 0:
        disorder = "sigma_mu = 0: no coefficient is drawn"
    elif inertia:
        width = f"sigma_mu = {nearest_float(chain.sigma_mu):.3g}"
        disorder = f"{width}: a coefficient is drawn at every stop"
    if inertia:
        moving = "every slip feels the excess mu_s - mu_d and may set neighbours in motion"
    elif chain.slides:
        moving = "mu_s = mu_d: sliders slide with theta, and never accelerate"
    dilations = "theta is drawn at every target" if random else "theta is given"
    recorded = "recorded: " + ", ".join(record) if record else "only the velocity is asked for"
    held = "asked for more than float64 holds" if digits else "float64 holds the accuracy"
    return (
        Need("disorder", inertia and chain.sigma_mu != 0, disorder),
        Need("random dilations", random, dilations),
        Need("inertia", inertia, moving),
        Need("trajectories", bool(record), recorded),
        Need("digits", digits, held),
    )


class _Lap(NamedTuple):
    seconds: float
    half_cycles: int
    events: int


def _timed(simulation: Simulation, drive: Drive, until: int, limits: Limits, done: int = 0) -> _Lap:
    """Take a simulation from target `done` of a drive to `until`, or as far as it may."""
    events, begin = simulation.tally.events, time.perf_counter()
    completed = advance(simulation, drive, until, limits, done=done).completed
    return _Lap(time.perf_counter() - begin, completed, simulation.tally.events - events)


def _costs(
    experiment: Experiment, choice: Choice, accuracy: float, seconds: float
) -> dict[str, float]:
    """Return the predicted seconds of a run for each rung, each measured for so long."""
    costs = dict.fromkeys(LADDER, math.nan)
    chain, drive = experiment.chain, experiment.drive
    events = math.nan  # of the whole run, from the exact one
    for rung in choice.candidates:
        proved = rung.name == "certified"
        if not rung.applies or (proved and math.isnan(events)):
            continue
        begin = time.perf_counter()
        if rung.name == "law":
            prediction(chain, drive, experiment.start)
            costs["law"] = time.perf_counter() - begin
            continue
        algorithm = runner(rung.name, accuracy)
        if not proved:
            warm_up(algorithm, algorithm.compiles(chain.n))
        simulation = algorithm.simulation(chain, experiment.initial, experiment.seed, ())
        until = min(3, drive.half_cycles) if proved else drive.half_cycles
        lap = _timed(simulation, drive, until, Limits(at=time.perf_counter() + seconds))
        if not proved:
            share = drive.half_cycles / lap.half_cycles if lap.half_cycles else math.nan
            costs[rung.name] = lap.seconds * share
            if rung.name == "exact" and lap.half_cycles:
                events = lap.events / lap.half_cycles * drive.half_cycles
            continue
        took, happened = lap.seconds, lap.events
        if happened == 0:  # the first takes longer than that, if there is one
            more = _timed(simulation, drive, until, Limits(1), lap.half_cycles)
            took, happened = took + more.seconds, more.events
        costs[rung.name] = took / happened * events if happened else 0.0
    return costs
