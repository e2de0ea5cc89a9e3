"""The solver called "auto": the cheapest one that answers a question with the accuracy asked for.

An accuracy has a subject. ``question="velocity"`` asks for the long-time mean velocity, over
disorder and starts: its error is the bias of the solver (the chain is replaced by its sliding
limit, say) and the statistical error of a run that ends. Of a chain that settles it is the
chain's own velocity, without a statistical error. On a path or a record it is the mean along
this very drive. ``question="course"`` asks for x_G and the tensions at every target: there rounding
decides how long a course can be followed.

The ladder, from the cheapest: the *law* (a closed form, no run at all), *sliding* (no inertia),
*exact* (float64, event by event), *certified* (balls). What is not settled by a theorem is measured
by a pilot: exact and sliding side by side, on the same drive. Cycles and Gaussian steps are
stationary, so that a pilot follows them from the beginning, as far as the scene goes if the chain
is cheap; of a long path it looks at windows spread over all of it and at its extremes. A chain
under cycles that comes to rest, or is locked, stays so; where that may still happen after the end
of a pilot, nothing is claimed; where it may is told by rules, see `Pilot`. On other drives
silence proves nothing.

The choice depends on the scene alone, not on the clock: counts limit the pilot, and the same
scene makes the same choice on every machine.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any, ClassVar

from exactcreep.laws import pivots, prediction
from exactcreep.limits import NO_LIMITS, Limits, OutOfTime, Stop
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Drive
from exactcreep.model.numbers import InputError, exact_number
from exactcreep.model.outcome import Evidence
from exactcreep.model.state import State
from exactcreep.solvers.exact.layout import TENSION_TOLERANCE
from exactcreep.solvers.exact.solver import Exact
from exactcreep.solvers.field.certified import Certified
from exactcreep.solvers.pilot import (
    ROUNDINGS,
    Pilot,
    Subject,
    event_nanoseconds,
    pilot_run,
    surveyed,
    trusted_course,
)
from exactcreep.solvers.sliding import Sliding
from exactcreep.solvers.solver import Rearrangement, Simulation, Solver, Start, Stretch, Tally
from exactcreep.solvers.tables import LOGS

LADDER = ("law", "sliding", "exact", "certified")
"""What there is to choose from, the cheapest first."""
QUESTIONS = ("velocity", "course")
KNOWN_BY = {
    "exact": "a theorem: the error is zero, but for the rounding of the answer",
    "promised": "a bound that a theorem or the solver guarantees",
    "measured": "an interval of 95 % from the drive itself, or from a stationary part of it",
    "estimated": "an interval of 95 % from windows of a drive, or from how fast rounding grows",
    "unknown": "nothing: no theorem holds, and what was run says too little",
}
"""How an error may be known, the surest first."""

_TRAJECTORIES = ("x", "tension", "slips", *LOGS)
_COURSE_EVENTS = 100_000  # of certified, some minutes


@dataclass(frozen=True)
class Rung:
    """A rung of the ladder, by `name`, and what is known of its error for which `reason`.

    Attributes
    ----------
    bias : float
        Relative error of the answer that a longer run does not remove, with its uncertainty; nan
        if it is not known or the rung does not apply.
    known_by : str
        How the bias is known, one of `KNOWN_BY`.
    statistical : float
        Relative statistical error, at 95 %, of a mean over the scene's own drive; nan if unknown.
    applies : bool
        Whether this rung can answer at all.
    """

    name: str
    bias: float
    known_by: str
    reason: str
    statistical: float = 0.0
    applies: bool = True

    @property
    def error(self) -> float:
        """The whole relative error at 95 %, nan if unknown."""
        return self.bias + self.statistical

    @property
    def told(self) -> str:
        """Its name, with its bias, or else why that is not known."""
        known = f"bias {self.bias:.2g}, {self.known_by}"
        return f"{self.name} ({self.reason if math.isnan(self.bias) else known})"

    def repeats(self, accuracy: float) -> float:
        """Return how many times the scene's own drive reaches the accuracy, as cycles or seeds.

        1 if it does so itself, inf if no number does, nan if that is not known.
        """
        if not self.applies or self.bias > accuracy:
            return math.inf
        if math.isnan(self.error) or self.error <= accuracy:
            return 1.0 + 0 * self.error
        room = accuracy - self.bias
        return (self.statistical / room) ** 2 if room > 0 else math.inf


@dataclass(frozen=True)
class Choice:
    """Which rung of the ladder is taken, by `name`, and for which `reason`.

    Attributes
    ----------
    solver : Solver
        What runs the scene; for the law, which needs no run, the sliding limit.
    candidates : tuple of Rung
        All rungs, the cheapest first.
    accuracy : float
        What was asked for.
    pilot : Pilot or None
        None if a theorem settled it.
    law : tuple of float
        The velocity that the law predicts: none, one, or two where the limit is not unique.
    """

    name: str
    solver: Solver
    candidates: tuple[Rung, ...]
    reason: str
    accuracy: float
    pilot: Pilot | None = None
    law: tuple[float, ...] = ()

    @property
    def taken(self) -> Rung:
        """The rung that is taken."""
        return next(rung for rung in self.candidates if rung.name == self.name)

    @property
    def accuracy_reached(self) -> bool:
        """Whether the scene's own drive is known to be long enough for the accuracy."""
        return self.taken.error <= self.accuracy


def valid_accuracy(accuracy: Any) -> Fraction:
    """Return `accuracy` as a rational between 0 and 1 (exclusive), or raise `InputError`."""
    value = exact_number(accuracy, "accuracy")
    if not 0 < value < 1:
        raise InputError("accuracy", accuracy, "must lie between 0 and 1, e.g. 0.01")
    return value


def valid_question(question: Any) -> str:
    """Return `question` if it is one of `QUESTIONS`, or raise `InputError`."""
    if not isinstance(question, str) or question not in QUESTIONS:
        raise InputError("question", question, "must be one of " + ", ".join(QUESTIONS))
    return question


def choose(
    chain: Chain,
    drive: Drive,
    *,
    accuracy: Any,
    question: str = "velocity",
    start: State | None = None,
    seed: int = 0,
    record: tuple[str, ...] = (),
    limits: Limits = NO_LIMITS,
) -> Choice:
    """Return the cheapest way to an answer whose relative error is at most `accuracy`.

    If nothing reaches the accuracy along the scene's own drive, the rung that does so with the
    least work is taken, or else exact.

    Parameters
    ----------
    accuracy : number
        Relative, between 0 and 1: of the mean velocity, or of a course in units of the largest
        tension (of 1, if that is less).
    start : State, optional
        Default: the relaxed chain.
    record : tuple of str
        What is to be recorded besides: more than the velocity rules out the law, more than x_G
        rules out the sliding limit unless it is exact.
    limits : Limits
        Of which only the time counts.

    Raises
    ------
    OutOfTime
        If the time is over within the pilot.
    InputError
        If a course can be followed neither by exact nor by certified within reason.
    """
    wanted = float(valid_accuracy(accuracy))
    begun = Start(chain, State.relaxed(chain, seed) if start is None else start, seed)
    limits = replace(limits, events=None, bytes=None, used=0, pause=math.inf)
    subject = Subject(begun, drive, limits)
    if valid_question(question) == "course":
        return _course(subject, wanted)
    pilot: Pilot | None = None
    predicted = prediction(chain, drive, None if subject.relaxed else start)
    laws = () if predicted is None else predicted.values
    limit = _from_theorems(subject, laws)
    needs_trajectory = any(name in record for name in _TRAJECTORIES)
    if limit is None or (limit.applies and limit.bias > wanted and not chain.slides):
        pilot = pilot_run(subject, wanted)
        measured = _from_pilot(pilot, drive)
        wide = limit is None or (limit.known_by == "promised" and measured.bias < limit.bias)
        if wide and not needs_trajectory:  # a pilot sees x_G alone
            limit = measured
    if limit is None:
        limit = Rung("sliding", math.nan, "unknown", "no theorem bounds its error here")
    if needs_trajectory and limit.applies and limit.bias != 0:
        limit = _inapplicable("sliding", "its trajectories are not those of the chain")
    law = _law(subject, record, limit, laws)
    rungs = (law, limit, *_with_inertia(subject, pilot, limit))
    found = _cheapest(rungs, wanted, chain, pilot)
    left = ", ".join(rung.told for rung in rungs[: rungs.index(found)])
    reason = found.reason + (f"; cheaper ones: {left}" if left else "")
    if not found.error <= wanted:
        missed = f"nothing is known to be within {wanted:.3g} along this drive"
        reason = f"{missed}; {found.name}: {reason}"
    return Choice(found.name, runner(found.name, wanted), rungs, reason, wanted, pilot, laws)


def _cheapest(rungs: tuple[Rung, ...], accuracy: float, chain: Chain, pilot: Pilot | None) -> Rung:
    """Return the rung that reaches the accuracy with the least work, or is nearest to it."""
    events = pilot.events / max(pilot.half_cycles, 1) if pilot is not None else chain.n
    exact = 20 + event_nanoseconds(chain) * events
    # of a half-cycle, in units of about a nanosecond, by counts alone
    costs = {"law": 0.0, "sliding": 2.0 * chain.n, "exact": exact, "certified": 10**6 * events}
    applying = [rung for rung in rungs if rung.applies]
    for rung in applying:
        if rung.error <= accuracy:
            return rung
    work = {rung: rung.repeats(accuracy) * costs[rung.name] for rung in applying}
    able = [rung for rung in applying if math.isfinite(work[rung])]
    if able:
        return min(able, key=work.__getitem__)
    return next(rung for rung in (rungs[2], rungs[1], rungs[3]) if rung.applies)


def runner(name: str, accuracy: float, digits: int = 0) -> Solver:
    """Return the solver that runs a scene for a rung of the ladder: sliding for the law.

    Certified carries ten digits more than the accuracy has, or `digits`.
    """
    if name in ("law", "sliding"):
        return Sliding(exact=accuracy < TENSION_TOLERANCE)
    if name == "certified":
        return Certified(digits=digits or max(20, math.ceil(-math.log10(accuracy)) + 10))
    return Exact()


def _inapplicable(name: str, why: str) -> Rung:
    return Rung(name, math.nan, "unknown", why, math.nan, applies=False)


def _two_sliders(chain: Chain) -> bool:
    return chain.n == 2 and chain.sigma_mu == 0 and 0 < abs(chain.tan_alpha) < chain.mu_d


def _from_theorems(subject: Subject, laws: tuple[float, ...]) -> Rung | None:
    """Return what theorems say of the sliding limit; None if they are silent."""
    chain, drive = subject.chain, subject.drive
    if chain.n == 1 and abs(chain.tan_alpha) <= chain.mu_d:
        return Rung("sliding", 0.0, "exact", "a single slider rests for ever")
    if chain.may_run_away and not chain.slides:
        return _inapplicable("sliding", "|tan_alpha| >= mu_d: inertia decides")
    if chain.may_run_away:
        return Rung("sliding", 0.0, "exact", "|tan_alpha| >= mu_s = mu_d: nothing holds")
    if not (chain.slides or _two_sliders(chain)):
        return None
    velocity, scatter = surveyed(subject)
    if chain.slides:
        indices = pivots(chain.n, chain.tan_alpha, chain.mu_d)
        if len(indices) == 1:
            reason = "mu_s = mu_d: the sliding limit is the chain"
            return Rung("sliding", 0.0, "exact", reason, scatter)
        middle = abs(chain.n + 3 - sum(indices))
        error = 1 / middle if middle else math.inf
        reason = (
            "mu_s = mu_d, but the slope lies at the edge between two pivots, where the balance"
            f" of forces leaves the velocity open by a factor 1 +- {error:.3g}"
        )
        return Rung("sliding", error, "promised", reason, scatter)
    if drive.cyclic and subject.relaxed:
        gap, (truth,) = abs(velocity - laws[0]), map(abs, laws)
        error = gap / truth if truth else (0.0 if gap == 0 else math.inf)
        reason = "two relaxed sliders: the staircase is known exactly"
        return Rung("sliding", error, "exact", reason)
    bound, size = chain.excess, abs(velocity)
    error = bound / (size - bound) if size > bound else math.inf
    reason = f"two sliders, sigma_mu = 0: within D = {bound:.3g} per half-cycle"
    return Rung("sliding", error, "promised", reason, scatter)


def _from_pilot(pilot: Pilot, drive: Drive) -> Rung:
    """Return what a pilot says of the sliding limit."""
    largest = pilot.errors[1]
    silent = not pilot.events and not pilot.settled and drive.random
    why = ""
    if pilot.may_settle:
        why = "by a rule, the chain may come to rest or be locked after the end of the pilot"
    elif math.isinf(largest) and pilot.settled:
        why = f"the chain rests or is locked, and the sliding limit goes on by {pilot.sliding:.3g}"
    elif math.isinf(largest) or silent:
        why = "the pilot was too short, or too silent, to measure its error"
    if why:
        return Rung("sliding", math.nan, "unknown", why, math.nan)
    gap = f"{pilot.difference:.3g} +- {pilot.difference_error:.2g}"
    told = f"in the pilot it differs by {gap} from {pilot.velocity:.6g}"
    if largest == 0:
        told = "in the pilot it moves as the chain does"
    known_by = "estimated" if pilot.windows else "measured"
    statistical = pilot.relative(pilot.sliding_error, drive)
    return Rung("sliding", largest, known_by, told, statistical)


def _law(subject: Subject, record: tuple[str, ...], limit: Rung, values: tuple[float, ...]) -> Rung:
    """Return the rung that needs no run."""
    drive = subject.drive
    if not values:
        return _inapplicable("law", "there is no law for this scene")
    if record:
        return _inapplicable("law", f"it gives a velocity only; recorded is {', '.join(record)}")
    if drive.cyclic and _two_sliders(subject.chain) and subject.relaxed:
        return Rung("law", 0.0, "exact", "two relaxed sliders under cycles: the staircase")
    if len(values) > 1 and limit.known_by == "measured":
        middle = abs(values[0] + values[1]) / 2
        error = abs(values[1] - values[0]) / 2 / middle if middle else math.inf
        return Rung("law", error, "promised", "the slope lies at the edge between two pivots")
    mean = "the expected" if drive.random else "the asymptotic"
    of = f"{mean} velocity of the sliding limit; {limit.reason}"
    return replace(limit, name="law", reason=of, statistical=0.0)


def _with_inertia(subject: Subject, pilot: Pilot | None, limit: Rung) -> tuple[Rung, Rung]:
    """Return the rungs exact and certified."""
    if subject.chain.slides:
        why = "mu_s = mu_d: there are no slips"
        return _inapplicable("exact", why), _inapplicable("certified", why)
    if pilot is not None:
        statistical = pilot.relative(pilot.velocity_error, subject.drive)
    else:  # what a theorem knows exactly has no statistical error
        statistical = 0.0 if limit.known_by == "exact" else math.nan
    # rounding takes a chain that does not settle to another of its courses: that is no bias
    rests = pilot is not None and pilot.settled == "rest"
    bias = TENSION_TOLERANCE if statistical < TENSION_TOLERANCE and not rests else 0.0
    said = "the chain itself, in float64: no bias"
    return (
        Rung("exact", bias, "promised", said, statistical),
        Rung("certified", 0.0, "promised", "the chain itself, in many digits", statistical),
    )


def _course(subject: Subject, accuracy: float) -> Choice:
    """Return how to follow x_G and the tensions at every target to `accuracy`, or refuse."""
    chain, total = subject.chain, subject.drive.half_cycles
    law = _inapplicable("law", "it gives a velocity only")
    if chain.slides or (chain.n == 1 and not chain.may_run_away):
        limit = _from_theorems(subject, ())
        assert limit is not None
        limit = replace(limit, statistical=0.0)
        rungs = (law, limit, *_with_inertia(subject, None, limit))
        return Choice("sliding", runner("sliding", accuracy), rungs, limit.reason, accuracy)
    limit = _inapplicable("sliding", "its course is not that of the chain")
    trusted, off, per_target = trusted_course(subject, accuracy)
    whole = trusted == total and accuracy >= TENSION_TOLERANCE
    error = max(TENSION_TOLERANCE, ROUNDINGS * off) if whole else math.nan
    said = f"a twin that starts some roundings off is within {off:.1e} up to half-cycle {trusted}"
    exact = Rung("exact", error, "estimated" if whole else "unknown", said)
    proved = Rung("certified", 0.0, "promised", "balls: every digit is proved")
    rungs = (law, limit, exact, proved)
    if whole:
        return Choice("exact", Exact(), rungs, said, accuracy)
    events = per_target * total
    if events > _COURSE_EVENTS:
        raise InputError(
            "question", "course",
            f"{said}, and certified would take {events:.1g} events: at most {_COURSE_EVENTS} are"
            " followed. Ask for fewer half-cycles, or for the velocity",
        )  # fmt: skip
    lost = 16 * total / max(trusted, 1)  # digits, if they are lost as fast as they were up to there
    digits = math.ceil(min(lost, 500) - math.log10(accuracy)) + 10
    solver = runner("certified", accuracy, max(20, digits))
    reason = f"{proved.reason}; cheaper ones: exact ({said})"
    return Choice("certified", solver, rungs, reason, accuracy)


def concluded(report: Mapping[str, Any], velocity: float, error: float) -> dict[str, Any]:
    """Return the report of a run, with how accurate its answer is if it was chosen for that.

    That is its `relative_error` at 95 % (None if unknown), `known_by` (see `KNOWN_BY`) and
    `accuracy_reached`. Where a run, of a measured velocity with its standard error, is too short to
    tell that error, the answer is as far off as it is from the mean of the longer pilot, and as
    that mean may be.
    """
    told = dict(report)
    if "bias_known_by" not in told:
        return told
    known_by, scatter = told["bias_known_by"], told["statistical"]
    found = math.nan if told["bias"] is None else told["bias"]
    if scatter is None:
        off = 1.96 * error
        if math.isnan(error) and told.get("pilot_velocity") is not None:
            off = abs(velocity - told["pilot_velocity"]) + 1.96 * told["pilot_velocity_error"]
        scatter = off / abs(velocity) if velocity else (0.0 if error == 0 else math.nan)
        if velocity == error == 0:  # at rest, or locked
            found, known_by = 0.0, "exact"
    if scatter:
        found += scatter
        known_by = "estimated" if known_by == "estimated" else "measured"
    known = math.isfinite(found)
    return told | {
        "relative_error": found if known else None,
        "known_by": known_by if known else "unknown",
        "accuracy_reached": found <= told["accuracy"],
    }


def accuracy_told(report: Mapping[str, Any]) -> str:
    """Return in words how accurate the answer of a run is, from what `concluded` found."""
    error = report["relative_error"]
    found = "the relative error is not known"
    if error is not None:
        at = "" if error == 0 or report["known_by"] in ("exact", "promised") else " at 95 %"
        found = f"relative error {error:.2g}{at}, {report['known_by']}"
    reached = "is reached" if report["accuracy_reached"] else "is not known to be reached"
    return f"{found}; the accuracy {report['accuracy']:g} of the {report['question']} {reached}"


class AutoSimulation(Simulation):
    """A simulation by the solver that is chosen when the drive is first seen."""

    def __init__(self, start: Start, record: tuple[str, ...], wanted: Auto) -> None:
        self._start, self._record, self._wanted = start, record, wanted
        self._inner: Simulation | None = None
        self._digits = 0  # of certified
        self._told: dict[str, Any] = {}

    @property
    def tally(self) -> Tally:  # type: ignore[override]
        return Tally() if self._inner is None else self._inner.tally

    def follow(self, drive: Drive, first: int, count: int, limits: Limits = NO_LIMITS) -> Stretch:
        """Choose a solver if that has not been done, then let it take the chain on."""
        if self._inner is None:
            start, wanted = self._start, self._wanted
            try:
                choice = choose(
                    start.chain,
                    drive,
                    accuracy=wanted.accuracy,
                    question=wanted.question,
                    start=start.state,
                    seed=start.seed,
                    record=self._record,
                    limits=limits,
                )
            except OutOfTime as late:
                return Stretch(0, {}, Stop.DEADLINE, str(late))
            self._told = _telling(choice, wanted.question, drive)
            self._inner = self._run_by(choice.solver)
        return self._inner.follow(drive, first, count, limits)

    def _run_by(self, solver: Solver) -> Simulation:
        start, self._digits = self._start, getattr(solver, "digits", 0)
        return solver.simulation(start.chain, start.state, start.seed, self._record)

    def state(self) -> State:
        return self._start.state if self._inner is None else self._inner.state()

    def capture(self) -> dict[str, Any]:
        return {
            "chosen": self._told.get("chosen", ""),
            "digits": self._digits,
            "told": dict(self._told),
            "inner": None if self._inner is None else self._inner.capture(),
        }

    def restore(self, captured: Mapping[str, Any]) -> None:
        if captured["inner"] is None:
            return
        self._told = dict(captured["told"])
        accuracy, digits = float(self._wanted.accuracy), int(captured["digits"])
        self._inner = self._run_by(runner(self._told["chosen"], accuracy, digits))
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
        approximate = self._told["chosen"] == "sliding" and not self._start.chain.slides
        return Evidence.COMPUTED if approximate and found is Evidence.PROVED else found

    def report(self) -> dict[str, Any]:
        """Return which solver was chosen, how well its error is known, and its own report."""
        return self._told | ({} if self._inner is None else self._inner.report())


def _telling(choice: Choice, question: str, drive: Drive) -> dict[str, Any]:
    """Return what a report says of a choice, for `concluded`; the run measures the rest."""
    taken, pilot = choice.taken, choice.pilot
    inertia = choice.name in ("exact", "certified")
    told = {
        "chosen": "sliding" if choice.name == "law" else choice.name,
        "question": question,
        "accuracy": choice.accuracy,
        "bias": taken.bias if math.isfinite(taken.bias) else None,
        "bias_known_by": taken.known_by,
        "statistical": taken.statistical,
    }
    # along a path, and of the sliding limit under cycles, the pilot knows it better
    if question == "velocity" and (drive.random or (drive.cyclic and inertia)):
        told["statistical"] = None
        if pilot is not None and not pilot.may_settle:
            mean, error = pilot.sliding, pilot.sliding_error
            if inertia:
                mean, error = pilot.velocity, pilot.velocity_error
            if math.isfinite(mean) and math.isfinite(error):
                told |= {"pilot_velocity": mean, "pilot_velocity_error": error}
    return told | {"reason": choice.reason}


@dataclass(frozen=True)
class Auto(Solver):
    """The cheapest of sliding, exact and certified whose error is known to be small enough.

    Parameters
    ----------
    accuracy : number
        Largest relative error, at 95 %, between 0 and 1.
    question : {"velocity", "course"}
        Of what: of the long-time mean velocity over disorder and starts (on a path or a record,
        of the mean along it), or of x_G and the tensions at every target. A course that neither
        exact nor certified can follow is refused.
    """

    accuracy: Any = field(default=Fraction(1, 100))
    question: str = "velocity"
    needs_slips: ClassVar[bool] = False
    name: ClassVar[str] = "auto"
    summary: ClassVar[str] = "the cheapest solver that is accurate enough for the question"

    def __post_init__(self) -> None:
        object.__setattr__(self, "accuracy", valid_accuracy(self.accuracy))
        valid_question(self.question)

    def rearrange_from(self, start: Start, direction: int, limits: Limits) -> Rearrangement:
        """Rearrange with the exact solver: a rearrangement is inertia."""
        return Exact().rearrange(start.chain, start.state, direction, start.seed, limits)

    def simulation_from(self, start: Start, record: tuple[str, ...]) -> Simulation:
        """Return a simulation that chooses its solver when it sees the drive."""
        return AutoSimulation(start, record, self)
