"""Plans: what a scene needs and does not need, what each solver would cost, and which to take."""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from exactcreep.laws import prediction
from exactcreep.limits import Limits
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Drive
from exactcreep.model.numbers import nearest_float, plain_data
from exactcreep.model.state import State
from exactcreep.motion.condition import PROMISE
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.quasistatic.loop import PhysicsWarning, creep
from exactcreep.quasistatic.result import Creep, course_of
from exactcreep.quasistatic.watch import MOST_EVENTS
from exactcreep.scene import Scene
from exactcreep.solvers.auto import (
    LADDER,
    Choice,
    choose,
    runner,
    valid_accuracy,
)
from exactcreep.solvers.solver import Solver, advance, warm_up

DEFAULT_ACCURACY = "0.01"
_TIMED_SECONDS = 0.2  # of a pilot run: long beside a call, short beside a reader's patience


@dataclass(frozen=True)
class Need:
    """One thing that a scene needs or does not need.

    Attributes
    ----------
    name : str
        ``disorder``, ``random dilations``, ``inertia``, ``trajectories`` or ``digits``.
    needed : bool
    reason : str
    """

    name: str
    needed: bool
    reason: str


@dataclass(frozen=True)
class Plan:
    """How to come by the mean velocity of a scene with the least effort.

    Attributes
    ----------
    experiment : Experiment
    accuracy : float
        Largest relative error of the mean velocity that is allowed.
    choice : Choice
        The rung of the ladder, all candidates with their errors, the reason, the pilot run.
    explicit : str or None
        The solver that the scene names itself, which a plan never overrides.
    needs : tuple of Need
    costs : mapping of str to float
        Predicted seconds of the whole run for each of `LADDER`; nan where it does not apply.
    course : str
        One sentence: how far the course of the run by `exact` can be followed; "" where that is not
        known.
    trusted_half_cycles : int or None
        As in `Creep`.
    """

    experiment: Experiment
    accuracy: float
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

    @property
    def statistical_error(self) -> float:
        """The relative standard error of the mean over this run, expected; nan if unknown."""
        return self.choice.statistical_error(self.experiment.drive.half_cycles)

    def summary(self) -> dict[str, Any]:
        """Return the plan as plain data for JSON; a number that is not known is None."""
        pilot = None
        if self.choice.pilot is not None:
            known = vars(self.choice.pilot).items()
            pilot = {name: value for name, value in known if name != "resting"}
        return plain_data({
            "solver": self.solver,
            "explicit": self.explicit,
            "choice": self.choice.name,
            "reason": self.choice.reason,
            "accuracy": self.accuracy,
            "statistical_error": self.statistical_error,
            "statistical_error_known_by": "unknown"
            if math.isnan(self.statistical_error)
            else ("estimated" if self.statistical_error else "exact"),
            "half_cycles": self.experiment.drive.half_cycles,
            "law": list(self.choice.law),
            "needs": {
                need.name: {"needed": need.needed, "reason": need.reason} for need in self.needs
            },
            "candidates": [
                {
                    "solver": rung.name,
                    "error": None if rung.name in ("exact", "certified") else rung.error,
                    "basis": rung.basis,
                    "reason": rung.reason,
                    "seconds": self.costs[rung.name],
                }
                for rung in self.choice.candidates
            ],
            "pilot": pilot,
            "trusted_half_cycles": self.trusted_half_cycles,
            "course": self.course or None,
        })


def plan(
    chain: Chain,
    drive: Drive,
    *,
    accuracy: Any = DEFAULT_ACCURACY,
    seed: int = 0,
    start: State | None = None,
    record: tuple[str, ...] = (),
) -> Plan:
    """Return the cheapest way to the mean velocity of a chain whose error is known to be small.

    Parameters
    ----------
    chain : Chain
    drive : Drive
    accuracy : number
        Largest relative error of the mean velocity, between 0 and 1.
    seed : int
    start : State, optional
        Default: the relaxed chain.
    record : tuple of str
        What is to be recorded besides the velocity.

    Returns
    -------
    Plan
        Its `choice` of a solver with the reason, what the run needs (`needs`), and the predicted
        `costs` of every solver in seconds.

    Raises
    ------
    InputError
        If an argument is out of range.

    Notes
    -----
    Guarantee: the choice depends on the arguments alone; the predicted times are measured on this
    machine and do not influence it.
    """
    experiment = Experiment.of(chain, drive, seed=seed, start=start, record=record)
    return _planned(experiment, accuracy, experiment.record, explicit=None)


def plan_scene(
    scene: Scene, *, accuracy: Any = None
) -> list[tuple[Mapping[str, Any], Plan]]:
    """Return, for every member of a scene, what it sets and its plan.

    A scene that does not name a `record` asks for the velocity alone.

    Parameters
    ----------
    scene : Scene
    accuracy : number, optional
        Default: that of the scene, if its solver is ``auto``, else 0.01.

    Raises
    ------
    InputError
        If a value of the scene is out of range.
    """
    plans = []
    for member in scene.members():
        named = member.settings.get("run.solver", scene.tables["run"].get("solver"))
        wanted = accuracy
        if wanted is None:
            own = member.experiment.options.get("accuracy") if named == "auto" else None
            wanted = DEFAULT_ACCURACY if own is None else own
        asked = "record" in scene.tables["run"] or "run.record" in member.settings
        record = member.experiment.record if asked else ()
        plans.append((member.settings, _planned(member.experiment, wanted, record, explicit=named)))
    return plans


def _planned(
    experiment: Experiment, accuracy: Any, record: tuple[str, ...], explicit: str | None
) -> Plan:
    wanted = float(valid_accuracy(accuracy))
    choice = choose(
        experiment.chain,
        experiment.drive,
        accuracy=accuracy,
        start=experiment.start,
        seed=experiment.seed,
        record=record,
    )
    begun = _begun(experiment, choice)
    return Plan(
        experiment=experiment,
        accuracy=wanted,
        choice=choice,
        explicit=explicit,
        needs=_needs(experiment, choice, wanted, record),
        costs=_costs(experiment, choice, wanted),
        course=course_of(begun),
        trusted_half_cycles=begun[0].trusted_half_cycles if begun else None,
    )


def _begun(experiment: Experiment, choice: Choice) -> list[Creep]:
    """Return the beginning of an exact run with its twin, if that solver applies."""
    if not any(rung.name == "exact" and rung.applies for rung in choice.candidates):
        return []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)  # the run itself will say it
        begun = creep(
            experiment.chain,
            experiment.drive,
            seed=experiment.seed,
            start=experiment.start,
            record=(),
            twin=True,
            max_events=MOST_EVENTS,
        )
    return [begun]


def _needs(
    experiment: Experiment, choice: Choice, accuracy: float, record: tuple[str, ...]
) -> tuple[Need, ...]:
    chain, drive = experiment.chain, experiment.drive
    inertia = choice.name in ("exact", "certified")
    if chain.sigma_mu == 0:
        disorder = Need("disorder", False, "sigma_mu = 0: no coefficient is drawn")
    elif inertia:
        width = f"sigma_mu = {nearest_float(chain.sigma_mu):.3g}"
        disorder = Need("disorder", True, f"{width}: a coefficient is drawn at every stop")
    else:
        disorder = Need("disorder", False, "within the accuracy it does not change the velocity")
    if inertia:
        slips = "every slip feels the excess mu_s - mu_d and may set neighbours in motion"
        why_inertia = slips
    elif chain.mu_s == chain.mu_d and chain.sigma_mu == 0:
        why_inertia = "mu_s = mu_d: sliders slide with theta, and never accelerate"
    else:
        why_inertia = "within the accuracy it does not change the velocity"
    digits = accuracy < PROMISE
    return (
        disorder,
        Need(
            "random dilations",
            drive.random,
            "theta is drawn at every target" if drive.random else "theta is given",
        ),
        Need("inertia", inertia, why_inertia),
        Need(
            "trajectories",
            bool(record),
            "recorded: " + ", ".join(record) if record else "only the velocity is asked for",
        ),
        Need(
            "digits",
            digits,
            "asked for more than float64 holds" if digits else "float64 holds the accuracy",
        ),
    )


def _costs(experiment: Experiment, choice: Choice, accuracy: float) -> dict[str, float]:
    costs = dict.fromkeys(LADDER, math.nan)
    total = experiment.drive.half_cycles
    events = math.nan  # per half-cycle, from the exact run
    for rung in choice.candidates:
        if not rung.applies:
            continue
        if rung.name == "law":
            begin = time.perf_counter()
            prediction(experiment.chain, experiment.drive, experiment.start)
            costs["law"] = time.perf_counter() - begin
            continue
        algorithm = runner(rung.name, accuracy)
        if rung.name == "certified":
            if not math.isnan(events):
                each = seconds_per_event(experiment, algorithm)
                costs["certified"] = each * events * total
            continue
        pace = measured_pace(experiment, algorithm)
        costs[rung.name] = pace.seconds_per_half_cycle * total
        if rung.name == "exact":
            events = pace.events_per_half_cycle
    return costs


def seconds_per_event(
    experiment: Experiment, algorithm: Solver, *, seconds: float = _TIMED_SECONDS
) -> float:
    """Return the time that a slow solver takes for an event; 0 if nothing ever happens.

    Measured over the first three half-cycles, or as much of them as the time allows.
    """
    drive = experiment.drive
    until = min(3, drive.half_cycles)
    simulation = algorithm.simulation(experiment.chain, experiment.initial, experiment.seed, ())
    begin = time.perf_counter()
    done = advance(simulation, drive, until, Limits(at=begin + seconds)).completed
    if simulation.tally.events == 0:  # the first takes longer than that, if there is one
        advance(simulation, drive, until, Limits(1), done=done)
    events = simulation.tally.events
    return (time.perf_counter() - begin) / events if events else 0.0


@dataclass(frozen=True)
class Pace:
    """How fast a solver takes a chain along its drive on this machine; nan where not known.

    Attributes
    ----------
    seconds_per_half_cycle, seconds_per_event, events_per_half_cycle : float
    """

    seconds_per_half_cycle: float
    seconds_per_event: float
    events_per_half_cycle: float


def measured_pace(
    experiment: Experiment, algorithm: Solver, *, seconds: float = _TIMED_SECONDS
) -> Pace:
    """Return the pace of a compiled solver on the beginning of an experiment.

    Compilation is not counted.

    Parameters
    ----------
    experiment : Experiment
    algorithm : Solver
    seconds : float
        How long to measure, at most about twice that.
    """
    chain, drive = experiment.chain, experiment.drive
    warm_up(algorithm, algorithm.compiles(chain.n))
    simulation = algorithm.simulation(chain, experiment.initial, experiment.seed, ())
    begin = time.perf_counter()
    done = advance(simulation, drive, drive.half_cycles, Limits(at=begin + seconds)).completed
    spent = time.perf_counter() - begin
    events = simulation.tally.events
    return Pace(
        spent / done if done else math.nan,
        spent / events if events else math.nan,
        events / done if done else math.nan,
    )
