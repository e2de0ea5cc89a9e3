"""What a scene needs, which solver answers it and why, what that costs, and how far to trust it."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from exactcreep.laws import edges, pivots, prediction
from exactcreep.limits import NO_LIMITS, Limits
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles, Drive
from exactcreep.model.numbers import InputError, Number, nearest_float, whole_number
from exactcreep.model.result import Result
from exactcreep.model.state import State
from exactcreep.progress import Hearer, reporter
from exactcreep.quasistatic.creep import PhysicsWarning, creep
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.scene import Scene
from exactcreep.solvers.registry import SOLVERS
from exactcreep.studies.compare import shortened

FLOAT_DIGITS = 15
"""Significant digits that float64 holds."""
_FIRST = 10  # half-cycles whose events are counted
_MOST = 1_000_000  # of these events, and
_FOLLOWED = 20_000  # of those over which a copy a few roundings off is followed
NANOSECONDS: Mapping[str, tuple[float, float]] = {
    "exact": (200, 4),
    "certified": (500_000, 40_000),
}
"""What an event takes: so much, and so much more for each slider, as measured for the book."""
_LONE_SLIP = 8  # nanoseconds of an event of two sliders, by `exact`
_SWINGS = 10_000  # targets whose mean distance is the swing of theta
_MANY_SLIPS = 100  # of an end in a swing: below, slips shift the threshold by a percent
_NEXT_PIVOT = 0.025  # of the descent
_NO_INERTIA = {
    "law": "a theorem tells the velocity without following any slip",
    "sliding": "sliders slide with theta, and never accelerate",
}


class Need(NamedTuple):
    """One thing that a scene needs or not, and why.

    Its name is ``disorder``, ``random dilations``, ``inertia``, ``trajectories`` or ``digits``.
    """

    name: str
    needed: bool
    reason: str


class _Asked:
    """What the rules decide about; `solid`: whether the scene speaks SI, of a solid on a slope."""

    def __init__(
        self, experiment: Experiment, digits: int, explicit: str | None, *, solid: bool = False
    ) -> None:
        self.experiment, self.digits, self.explicit = experiment, digits, explicit
        self.solid = solid
        self.chain = chain = experiment.chain
        self.slope, self.recorded = abs(chain.tan_alpha), bool(experiment.record)
        self.relaxed = experiment.start is None and chain.sigma_mu == 0

    @property
    def rests(self) -> bool:
        """Whether it is a single slider that stays where it is."""
        return self.chain.n == 1 and self.slope <= self.chain.mu_d and not self.recorded

    @property
    def still(self) -> bool:
        """Whether neither end is ever loaded beyond its threshold, from the relaxed chain."""
        load = nearest_float(self.chain.l0 * Fraction(self.experiment.widest))
        room = float(self.chain.mu_s - self.slope) * self.chain.cos_alpha * (1 - 2**-40)
        return self.relaxed and self.chain.n > 1 and load < room and not self.recorded

    @property
    def staircase(self) -> bool:
        """Whether the staircase of two sliders is the whole answer."""
        pair = self.relaxed and self.chain.n == 2 and 0 < self.slope < self.chain.mu_d
        cycles = isinstance(self.experiment.drive, Cycles)
        return pair and cycles and self.digits <= FLOAT_DIGITS and not self.recorded

    @property
    def continuous(self) -> bool:
        """Whether it is a solid of whose slips only the sum is asked for.

        The descent alone is wanted, the next pivot is worth at most `_NEXT_PIVOT` of it, and a
        swing of theta moves the ends by `_MANY_SLIPS` at least, beyond what friction takes up.
        """
        chain, drive = self.chain, self.experiment.drive
        descent = self.solid and set(self.experiment.record) <= {"x_G"}
        if not (descent and 0 < self.slope < chain.mu_d):
            return False
        targets = drive.targets(1, min(drive.half_cycles, _SWINGS), self.experiment.seed)
        swing = np.abs(np.diff(targets, prepend=self.experiment.theta)).mean() / 2
        taken = chain.n * float(chain.mu_d - self.slope) * chain.cos_alpha / 2
        many = float(chain.l0) * swing - taken >= _MANY_SLIPS * 2 * chain.excess
        gear = chain.n + 3 - 2 * max(pivots(chain.n, self.slope, chain.mu_d))
        return many and _NEXT_PIVOT * gear >= 2


class Rule(NamedTuple):
    """A rule of `plan`: when it holds, which solver it names ("law": no run), and why."""

    holds: Callable[[_Asked], bool]
    solver: str
    reason: str


RULES = (
    Rule(lambda a: a.explicit is not None, "", "the scene names it"),
    Rule(lambda a: a.rests, "law", "one slider has no spring: it rests for ever"),
    Rule(
        lambda a: a.chain.slides,
        "sliding",
        "mu_s = mu_d without disorder: there are no slips, and the sliding limit is exact",
    ),
    Rule(
        lambda a: a.still,
        "law",
        "l0 |theta| stays below mu_s c - |s|: no end of the relaxed chain ever starts",
    ),
    Rule(
        lambda a: a.staircase,
        "law",
        "two relaxed sliders without disorder: the staircase is exact",
    ),
    Rule(
        lambda a: a.digits > FLOAT_DIGITS,
        "certified",
        f"more than {FLOAT_DIGITS} digits: float64 does not hold them",
    ),
    Rule(
        lambda a: a.continuous,
        "sliding",
        "a solid that makes many slips in every swing: static friction moves its descent by less"
        f" than the next pivot is worth, at most {100 * _NEXT_PIVOT:g} % (measured on 10 to 80"
        " contacts, not proved)",
    ),
    Rule(lambda a: True, "exact", "every event counts, and float64 holds the digits asked for"),
)
"""In order of precedence: the first that holds decides."""


@dataclass(frozen=True, eq=False, repr=False)
class Plan(Result):
    """Which solver answers a question about a scene, why, what it costs, and what it is worth.

    Attributes
    ----------
    experiment : Experiment
    digits : int
        Significant digits asked for.
    explicit : str or None
        The solver that the scene names itself, which a plan never overrides.
    solver : str
        ``law`` if a closed form is the answer.
    reason : str
    needs : tuple of Need
    law : tuple of float
        The mean velocity by the theorem that decides, or of the paper's law; empty: none.
    theorems : mapping of str to float
        Amplitudes of cycles between the fates of the chain, see `exactcreep.laws.edges`.
    events, seconds : float
        Expected of the whole run: events from its first ten half-cycles, times the published time
        of one; nan: not known.
    course : str
        How far the trajectory can be trusted; "" where that is not known.
    trusted_half_cycles : int or None
        As in `Creep`.

    Examples
    --------
    >>> from exactcreep import Chain, Cycles, plan
    >>> chain = Chain(2, 1000, "0.5", "0.6", tan_alpha="0.25")
    >>> plan(chain, Cycles("0.001", 50)).solver, plan(chain, Cycles("0.001", 50), digits=40).solver
    ('law', 'certified')
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
    course: str = ""
    trusted_half_cycles: int | None = None

    def _facts(self) -> dict[str, Any]:
        names = "solver reason law events seconds course"
        facts = {name: getattr(self, name) for name in names.split()}
        return {k: v for k, v in facts.items() if v == v and v not in ((), "")}

    def _numbers(self) -> dict[str, Any]:
        names = "solver reason explicit digits law theorems events seconds course"
        told = {name: getattr(self, name) for name in f"{names} trusted_half_cycles".split()}
        needs = {n.name: {"needed": n.needed, "reason": n.reason} for n in self.needs}
        return told | {"half_cycles": self.experiment.drive.half_cycles, "needs": needs}


def plan(
    chain: Chain,
    drive: Drive,
    *,
    digits: Number = FLOAT_DIGITS,
    record: tuple[str, ...] = (),
    seed: int = 0,
    start: State | None = None,
) -> Plan:
    """Return which solver answers a question about a chain and a drive, and what that takes.

    By `RULES` and theorems alone: nothing is measured, and the clock plays no part.

    Parameters
    ----------
    chain : Chain
    drive : Drive
    digits : int
        Significant digits that are wanted of the trajectory.
    record : tuple of str
        What is to be recorded besides the mean velocity.
    seed : int
    start : State, optional
        Default: the relaxed chain.

    Raises
    ------
    InputError
        If an argument is out of range.

    Examples
    --------
    >>> from exactcreep import Chain, Cycles
    >>> chain = Chain(2, 1000, "0.5", "0.6", sigma_mu="0.01", tan_alpha="0.25")
    >>> plan(chain, Cycles("0.001", 50)).solver
    'exact'
    """
    experiment = Experiment.of(chain, drive, seed=seed, start=start, record=record)
    return _planned(experiment, digits, None)


def plan_scene(
    scene: Scene,
    *,
    digits: Number = FLOAT_DIGITS,
    max_seconds: Number | None = None,
    progress: Hearer = None,
) -> list[tuple[Mapping[str, Any], Plan]]:
    """Return, for every member of a scene, what it sets and its plan; see `plan`.

    A scene that does not name a `record` asks for the velocity alone. After `max_seconds` the
    members planned so far are returned.
    """
    plans: list[tuple[Mapping[str, Any], Plan]] = []
    members, run = scene.members(), scene.tables["run"]
    limits, say = Limits.of(max_seconds=max_seconds), reporter(progress)
    for member in members:
        settings, e = member.settings, member.experiment
        say("planning", len(plans), len(members), "members")
        if limits.passed():
            break
        asked = "record" in run or "run.record" in settings
        record = e.record if asked else ()
        own = Experiment.of(e.chain, e.drive, seed=e.seed, start=e.start, record=record)
        named = settings.get("run.solver", run.get("solver"))
        solid = member.solid is not None
        plans.append((settings, _planned(own, digits, named, limits, solid=solid)))
    return plans


def _planned(
    experiment: Experiment, digits: Any, explicit: str | None, limits: Limits = NO_LIMITS,
    *, solid: bool = False,
) -> Plan:  # fmt: skip
    """Return the plan of one experiment."""
    wanted = whole_number(digits, "digits", least=1, most=100_000)
    if explicit is not None and explicit not in SOLVERS:
        raise InputError("run.solver", explicit, "must be one of " + ", ".join(SOLVERS))
    asked = _Asked(experiment, wanted, explicit, solid=solid)
    rule = next(rule for rule in RULES if rule.holds(asked))
    solver = rule.solver or str(explicit)
    chain, drive = experiment.chain, experiment.drive
    law: tuple[float, ...] = ()
    if solver == "law" and (asked.still or asked.rests):
        law = (0.0,)
    elif (found := prediction(chain, drive, experiment.start)) is not None:
        decides = solver == "law" and found.staircase is not None
        law = (found.staircase,) if decides else found.printed  # type: ignore[assignment]
    theorems = edges(chain) if isinstance(drive, Cycles) else {}
    cost = {} if solver in _NO_INERTIA else _expected(experiment, solver, limits)
    needs = _needs(experiment, solver, wanted)
    return Plan(experiment, wanted, explicit, solver, rule.reason, needs, law, theorems, **cost)


def _expected(experiment: Experiment, solver: str, limits: Limits) -> dict[str, Any]:
    """Return the events and the cost of a run, and how far its trajectory can be trusted."""
    chain, drive = experiment.chain, experiment.drive
    about: dict[str, Any] = {"seed": experiment.seed, "start": experiment.start, "record": ()}
    about |= {"max_seconds": limits.seconds_left, "progress": False}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)  # the run itself will say it
        first = creep(chain, shortened(drive, _FIRST), max_events=_MOST, **about)
        followed = creep(chain, drive, max_events=_FOLLOWED, **about)
    known = {"course": followed.course, "trusted_half_cycles": followed.trusted_half_cycles}
    if not first.half_cycles:
        return known
    events = first.event_count / first.half_cycles * drive.half_cycles
    fixed, each = NANOSECONDS.get(solver, (math.nan, math.nan))
    lone = solver == "exact" and chain.n == 2
    seconds = 1e-9 * (_LONE_SLIP if lone else fixed + each * chain.n) * events
    return known | {"events": events, "seconds": seconds}


def _needs(experiment: Experiment, solver: str, digits: int) -> tuple[Need, ...]:
    """Return what a scene needs and does not need."""
    chain, random, record = experiment.chain, experiment.drive.random, experiment.record
    inertia = solver not in _NO_INERTIA
    slips = "every slip feels the excess mu_s - mu_d and may set neighbours in motion"
    disorder = "sigma_mu = 0: no coefficient is drawn"
    if chain.sigma_mu != 0:
        disorder = f"sigma_mu = {nearest_float(chain.sigma_mu):.3g}: one is drawn at every stop"
    recorded = "recorded: " + ", ".join(record) if record else "only the velocity is asked for"
    drawn = "drawn at every target" if random else "given"
    many = f"{digits} are asked for, float64 holds {FLOAT_DIGITS}"
    held = "float64 holds what is asked for"
    return (
        Need("disorder", inertia and chain.sigma_mu != 0, disorder),
        Need("random dilations", random, "theta is " + drawn),
        Need("inertia", inertia, _NO_INERTIA.get(solver, slips)),
        Need("trajectories", bool(record), recorded),
        Need("digits", digits > FLOAT_DIGITS, many if digits > FLOAT_DIGITS else held),
    )
