"""The amplitude of temperature cycles above which a chain creeps, to any number of digits.

Three things are told apart: the paper's law, the corrected law, and the *dynamical threshold*
of the equations themselves. From its start the chain is driven by `cycles` cycles +A, -A; it
creeps at A if x_G advances by more than 1e-6 during the last cycle. A scan in float64 finds the
lowest creeping amplitude; bisection narrows the edge as far as float64 tells. Across the edge
one event differs, and up to it everything is an explicit function of A: the condition of that
event is followed to its root by the secant method, which for lone slips, where it is linear in
A, is exact at once. Two runs of the chosen solver, at the decimals that enclose the root, then
show that the chain does not creep at one and creeps at the other; what leads to these decimals
need not be trusted.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from decimal import Decimal
from fractions import Fraction
from functools import lru_cache
from itertools import pairwise
from typing import Any, NamedTuple, TypedDict

import numpy as np
from numpy.typing import NDArray

from exactcreep.laws import LAWS
from exactcreep.limits import NO_LIMITS, Limits, OutOfTime, Stop
from exactcreep.model.chain import Chain
from exactcreep.model.contact import EventKind
from exactcreep.model.drive import Cycles
from exactcreep.model.numbers import InputError, Number, exact_number, nearest_float, whole_number
from exactcreep.model.state import State
from exactcreep.model.verdict import Evidence, Outcome
from exactcreep.motion.arithmetic import BITS_PER_DIGIT, digits_of
from exactcreep.motion.itinerary import Course, StrayRoot
from exactcreep.progress import Progress, reporter
from exactcreep.quasistatic.decimals import Enclosure, enclosure
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.solvers.recurrence import Course as Recurring
from exactcreep.solvers.registry import SOLVERS, solver_named
from exactcreep.solvers.solver import Simulation, Stretch, advance
from exactcreep.studies.eventlog import (
    LoggedEvent,
    LoggedRearrangement,
    first_difference,
    numbered,
    rearrangements,
)
from exactcreep.studies.fate import Fate, ended, followed
from exactcreep.studies.fate_proof import Recurrence, recurrence

MOST_EVENTS = 10**6
"""Events for each slider (at least 20) after which a run is given up: no edge is so far up."""
ADVANCE = Fraction(1, 10**6)
"""A chain creeps if x_G advances by more than this during the last cycle."""
MOST_DIGITS = {"certified": 5_000, "mpmath": 300, "exact": 12}
"""Digits of an amplitude that each solver is asked to tell."""
_FLOAT_DIGITS = MOST_DIGITS["exact"]
_NARROW = Fraction(1, 10**11)  # relative width at which bisection in float64 ends
_STRAY = 10**5  # widths of a float64 bracket that rounding may have put it off
_SPARE = 2  # digits of the bracket beyond those asked for
_LATER = (4, 16, 64)  # times the cycles, after which a transient may be over
_SEED_SIZE = Fraction(1, 10**6)  # of seeded tensions: far below a slip, far above rounding


class GivenUp(RuntimeError):
    """A run on which the search depends came to a limit of its solver."""


@dataclass(frozen=True)
class Edge:
    """An amplitude at which creep begins or ends.

    Attributes
    ----------
    lower, upper : str
        Decimals that enclose it: of two amplitudes the chain creeps at one, and not at the other.
    begins : bool
        Whether creep begins there (it creeps at `upper`), or ends.
    evidence : Evidence
        Of what happens at `lower` and at `upper`.
    """

    lower: str
    upper: str
    begins: bool
    evidence: Evidence

    @property
    def middle(self) -> Fraction:
        """The middle of the bracket."""
        return (Fraction(self.lower) + Fraction(self.upper)) / 2

    def summary(self) -> dict[str, Any]:
        """Return the edge by names, ready for JSON."""
        return {
            "lower": self.lower,
            "upper": self.upper,
            "creep": "begins" if self.begins else "ends",
            "evidence": self.evidence.value,
        }


@dataclass(frozen=True)
class Difference:
    """The first event that differs across an edge; None: no further event on that side."""

    at_lower: LoggedEvent | None
    at_upper: LoggedEvent | None

    def summary(self) -> dict[str, Any]:
        """Return both events by names, ready for JSON."""
        return {
            "at_lower": None if self.at_lower is None else self.at_lower.summary(),
            "at_upper": None if self.at_upper is None else self.at_upper.summary(),
        }


@dataclass(frozen=True)
class Threshold:
    """The dynamical threshold of a chain, beside the laws that predict it.

    Attributes
    ----------
    chain : Chain
    cycles : int
    digits : int
        Significant digits asked for.
    law_seuil, law_corrected, law_two_sliders : str or None
        Eq. (seuil); with the term that it drops; ``(mu_s c - s)/l0``, for two sliders only.
    lower, upper : str or None
        Decimals: the chain does not creep at `lower`, and creeps at `upper`. None for one slider.
    outcome_at_lower : Outcome or None
        `AT_REST` (no event in a whole cycle, hence for ever), `CYCLING` (slips that return
        the chain to the same state); if neither within `cycles`, what it has come to after up to
        64 times as many in float64; None if it still does neither.
    outcome_evidence : Evidence
        Of `outcome_at_lower`: `PROVED` if the run is and the cycle has lone slips alone, which
        return the chain exactly; otherwise it has been seen to return, to within rounding.
    evidence : Evidence
        Of what happens at `lower` and at `upper`.
    stable_digits : int or None
        How many of the digits survive when `cycles` is doubled.
    deciding_event : Difference or None
        None if no event differs: the advance itself passes 1e-6 there.
    solver : str
    criterion : str
        ``horizon`` or ``lasting``; see `threshold`.
    fates : pair of Recurrence or None
        What the chain does for ever at `lower` and at `upper`, of the criterion ``lasting``.
    sensitive : tuple of float
        Amplitudes at which starts 1e-13 apart part in float64, and the fate is the certified one.
    windows : tuple of Edge
        Every edge of the scan, if asked for.
    preparations : mapping of int to Edge
        The threshold from each seeded start, if asked for; None where none was found.
    report : mapping
        How many runs of the solver it took; if `outcome_at_lower` is None, ``transient``: how many
        ``cycles`` were followed in float64, the largest ``change`` of a tension in the last of
        them, and the ``power`` of the number of cycles like which the changes fall, if they do.
    reason : str
        Which limit ended the search; "" if it was completed. What it had not come to is None, or
        missing from a list; `lower` and `upper` are as narrow as they had become.
    """

    chain: Chain
    cycles: int
    digits: int
    law_seuil: str | None
    law_corrected: str | None
    law_two_sliders: str | None
    lower: str | None
    upper: str | None
    outcome_at_lower: Outcome | None
    outcome_evidence: Evidence
    evidence: Evidence
    stable_digits: int | None
    deciding_event: Difference | None
    solver: str
    criterion: str = "horizon"
    fates: tuple[Recurrence | None, Recurrence | None] | None = None
    sensitive: tuple[float, ...] = ()
    windows: tuple[Edge, ...] | None = None
    preparations: Mapping[int, Edge | None] | None = None
    report: Mapping[str, Any] = field(default_factory=dict)
    reason: str = ""

    def summary(self) -> dict[str, Any]:
        """Return everything by names, ready for JSON."""
        outcome = self.outcome_at_lower
        out: dict[str, Any] = {
            "law_seuil": self.law_seuil,
            "law_corrected": self.law_corrected,
            "law_two_sliders": self.law_two_sliders,
            "lower": self.lower,
            "upper": self.upper,
            "outcome_at_lower": None if outcome is None else outcome.value,
            "outcome_evidence": self.outcome_evidence.value,
            "evidence": self.evidence.value,
            "cycles": self.cycles,
            "digits": self.digits,
            "stable_digits": self.stable_digits,
            "deciding_event": None
            if self.deciding_event is None
            else self.deciding_event.summary(),
            "solver": self.solver,
        }
        if self.criterion != "horizon":
            out["criterion"] = self.criterion
            out["sensitive"] = list(self.sensitive)
        if self.fates is not None:
            sides = zip(("fate_at_lower", "fate_at_upper"), self.fates, strict=True)
            out |= {name: one and one.summary() for name, one in sides}
        if self.windows is not None:
            out["windows"] = [edge.summary() for edge in self.windows]
        if self.preparations is not None:
            out["preparations"] = [
                {"seed": seed, **({"lower": None, "upper": None} if e is None else e.summary())}
                for seed, e in self.preparations.items()
            ]
        if self.reason:
            out["reason"] = self.reason
        return out | {"report": dict(self.report)}


def threshold(
    chain: Chain,
    *,
    criterion: str = "horizon",
    cycles: int | None = None,
    digits: int = 15,
    low: Any = None,
    high: Any = None,
    points: int = 1000,
    bracket: tuple[Any, Any] | None = None,
    windows: bool = False,
    refine: int = 0,
    start_tension: Any = None,
    seeds: int = 0,
    solver: str = "certified",
    progress: Callable[[Progress], None] | None = None,
    max_seconds: Number | None = None,
) -> Threshold:
    """Return the lowest amplitude at which a chain with ``sigma_mu = 0`` creeps.

    Parameters
    ----------
    chain : Chain
    criterion : str
        ``horizon``: it creeps that advances in cycle `cycles`. ``lasting``: that creeps for ever;
        see `fate`.
    cycles : int, optional
        Full cycles +A, -A before the verdict, default 20; of ``horizon`` only.
    digits : int
        Significant digits of the bracket.
    low, high : number, optional
        Ends of the scan; default 1/2 and 2 times Eq. (seuil). If nothing creeps up to there (or
        the law is not positive), the default scan goes on to N (mu_s c - s)/l0; if the chain
        creeps at its lower end, as it may from a start with tensions, it begins at 0.
    points : int
        Equal steps of the scan.
    bracket : pair of numbers, optional
        Instead of a scan: the chain does not creep at the first, and creeps at the second.
    windows : bool
        Whether to list all edges of the scan.
    refine : int
        How many of them to give to all digits; the others have float accuracy.
    start_tension : number, optional
        Of every spring, at theta = 0; default none, the relaxed chain.
    seeds : int
        Also find the threshold from so many starts with seeded tensions, uniform in (-size, size)
        with size ``|start_tension|``, or 1e-6.
    solver : str
        Which decides about the bracket: ``certified``, ``mpmath`` or ``exact`` (float64: at most
        12 digits, and a wider bracket where rounding does not tell so many).
    progress : callable, optional
        Called with a `Progress`.
    max_seconds : number, optional
        Come back after so much wall time with what has been found; `reason` then says so.

    Returns
    -------
    Threshold
        `lower` and `upper` are decimals that enclose the amplitude (dimensionless), `evidence`
        says how well that is known; the paper's laws stand beside them.

    Raises
    ------
    InputError
        If an argument is out of range, a bracket is empty or does not straddle an edge, or
        nothing creeps in the scan.
    GivenUp
        If a run comes to a limit of its solver.

    Notes
    -----
    Guarantee: if `evidence` is `PROVED`, the chain provably does not creep at `lower` and creeps
    at `upper`. That the scan has missed no narrower window below is not claimed.

    With ``mu_s = mu_d`` the chain slides with theta and the threshold is N m/(2 l0), exactly. For
    ``tan_alpha < 0`` the mirror image is meant, and an advance is one uphill along x.
    """
    lasting = _is_lasting(criterion, cycles, seeds, solver)
    cycles = MOST_CYCLES if lasting else 20 if cycles is None else cycles
    asked = _Asked.of(chain, cycles, digits, points, windows, refine, seeds, solver, progress)
    size = Fraction(0) if start_tension is None else exact_number(start_tension, "start_tension")
    if bracket is not None and (low is not None or high is not None):
        raise InputError("bracket", bracket, "must not be given together with the ends of a scan")
    if bracket is not None and windows:
        raise InputError("windows", windows, "needs a scan, and a bracket skips it")
    if chain.n == 1:
        return _single(asked)
    span = _bracket(bracket) if bracket is not None else None
    scans = _scans(chain, low, high)
    limits = Limits.of(max_seconds=max_seconds)
    if chain.mu_s == chain.mu_d:
        return _sliding(asked)
    start = State.prepared(chain, [size] * (chain.n - 1))
    question = _Question(chain, asked.cycles, start, limits)
    if lasting:
        question = _Fates(chain, asked.cycles, start, limits, solver)
    search = _Search(asked, question, scans, span)
    try:
        if low is None and span is None and question.creeps(scans[0][0]):
            scans = search.scans = [(Fraction(0), scans[0][0])]
        found = search.threshold()
    except OutOfTime as limit:
        return search.unfinished(str(limit))
    if not seeds:
        return found
    preparations: dict[int, Edge | None] = {}
    for seed in range(1, asked.seeds + 1):
        begin = State.perturbed(chain, abs(size) or _SEED_SIZE, start_seed=seed)
        other = _Search(replace(asked, windows=False), replace(question, start=begin), scans, span)
        try:
            preparations[seed] = other.edge().edge
        except InputError:
            preparations[seed] = None
        except OutOfTime as limit:
            return replace(found, preparations=preparations, reason=str(limit))
        asked.say("preparations", seed, asked.seeds, "starts")
    return replace(found, preparations=preparations)


def _is_lasting(criterion: Any, cycles: Any, seeds: Any, solver: Any) -> bool:
    """Return whether the fate is asked for, and not what happens in some cycle."""
    if criterion not in ("horizon", "lasting"):
        raise InputError("criterion", criterion, "must be horizon or lasting")
    if criterion == "horizon":
        return False
    for name, given in (("cycles", cycles), ("seeds", seeds or None)):
        if given is not None:
            raise InputError(name, given, "has no meaning with the criterion lasting")
    if solver not in ("certified", "exact"):
        raise InputError("solver", solver, "must be certified or exact with the criterion lasting")
    return True


@dataclass(frozen=True)
class _Asked:
    """The checked arguments of `threshold`."""

    chain: Chain
    cycles: int
    digits: int
    points: int
    windows: bool
    refine: int
    seeds: int
    solver: str
    say: Callable[..., None]

    @classmethod
    def of(
        cls,
        chain: Any,
        cycles: Any,
        digits: Any,
        points: Any,
        windows: bool,
        refine: Any,
        seeds: Any,
        solver: Any,
        progress: Callable[[Progress], None] | None,
    ) -> _Asked:
        if not isinstance(chain, Chain):
            raise InputError("chain", chain, "must be a Chain")
        if chain.sigma_mu != 0:
            raise InputError("sigma_mu", chain.sigma_mu, "must be 0: a threshold has no disorder")
        if abs(chain.tan_alpha) >= chain.mu_s:
            allowed = f"must be less than mu_s = {nearest_float(chain.mu_s)}, or the chain slides"
            raise InputError("tan_alpha", chain.tan_alpha, allowed)
        if chain.tan_alpha == 0 and chain.n > 1:
            raise InputError("tan_alpha", 0, "must not be 0: a level chain creeps nowhere")
        if not isinstance(solver, str) or solver not in MOST_DIGITS or solver not in SOLVERS:
            raise InputError("solver", solver, "must be certified, mpmath or exact")
        if not isinstance(windows, bool):
            raise InputError("windows", windows, "must be true or false")
        refined = whole_number(refine, "refine", least=0)
        if refined and not windows:
            raise InputError("refine", refine, "needs windows")
        return cls(
            chain,
            whole_number(cycles, "cycles", least=1, most=10**7),
            whole_number(digits, "digits", least=1, most=MOST_DIGITS[solver]),
            whole_number(points, "points", least=1, most=10**7),
            windows,
            refined,
            whole_number(seeds, "seeds", least=0, most=10**6),
            solver,
            reporter(progress),
        )

    def options(self) -> dict[str, Any]:
        """Return the options of the solver that decides."""
        if self.solver == "exact":
            return {}
        digits = self.digits + _SPARE
        if self.solver == "mpmath":
            return {"digits": digits}
        # an exact tie outside Q(c) is undecided at any precision: do not try very many
        return {"digits": digits, "most_digits": 4 * digits + 1000}


def _bracket(given: Any) -> tuple[Fraction, Fraction]:
    try:
        first, second = given
    except (TypeError, ValueError):
        raise InputError("bracket", given, "must be two numbers") from None
    low, high = exact_number(first, "bracket"), exact_number(second, "bracket")
    if not 0 <= low < high:
        raise InputError("bracket", f"{first} {second}", "must be two numbers, 0 <= LO < HI")
    return low, high


def _scans(chain: Chain, low: Any, high: Any) -> list[tuple[Fraction, Fraction]]:
    """Return the ends of one scan after the other; nothing here decides where the edge is."""
    tangent, cosine = abs(chain.tan_alpha), Fraction(chain.cos_alpha)
    law = chain.n * (chain.mu_d - tangent) * cosine / (2 * chain.l0)
    first_slip = (chain.mu_s - tangent) * cosine / chain.l0
    begin = (law if law > 0 else first_slip) / 2 if low is None else exact_number(low, "from")
    if begin < 0:
        raise InputError("from", low, "must not be negative")
    if high is not None:
        end = exact_number(high, "to")
        if begin >= end:
            raise InputError("to", high, f"must exceed from = {nearest_float(begin)}")
        return [(begin, end)]
    ends = [end for end in sorted([2 * law, chain.n * first_slip]) if end > begin]
    return list(pairwise([begin, *(ends or [2 * begin])]))


class _Trial(NamedTuple):
    """What the chain does at one amplitude."""

    creeps: bool
    evidence: Evidence
    log: list[LoggedRearrangement]
    tensions: tuple[NDArray[Any], NDArray[Any]]
    outcome: Outcome | None = None  # of a fate
    fate: Recurrence | None = None

    @property
    def change(self) -> float:
        """The largest change of a tension in the last cycle."""
        before, after = self.tensions
        pairs = zip(before, after, strict=True)
        changes = (abs(enclosure(y).middle - enclosure(x).middle) for x, y in pairs)
        return nearest_float(max(changes, default=Fraction(0)))


@dataclass(frozen=True)
class _Question:
    """Does the chain creep at this amplitude?"""

    chain: Chain
    cycles: int
    start: State
    limits: Limits = NO_LIMITS

    @property
    def half_cycles(self) -> int:
        return 2 * self.cycles

    def creeps(self, amplitude: Fraction) -> bool:
        """Return the float64 solver's answer."""
        simulation = solver_named("exact", {}).simulation(self.chain, self.start, 0, ())
        stretch = self._followed(simulation, amplitude)
        if stretch.stop is Stop.RUNAWAY:
            return True
        return self._advance(stretch.recorded["x_G"].tolist()).middle > ADVANCE

    def tried(self, amplitude: Fraction, solver: str, options: dict[str, Any]) -> _Trial:
        """Return a solver's answer, and what happened."""
        algorithm = solver_named(solver, options)
        record = ("x_G", "tension", "events")
        simulation = algorithm.simulation(self.chain, self.start, 0, record)
        stretch = self._followed(simulation, amplitude)
        recorded = dict(stretch.recorded)
        if solver != "exact":  # a time leads to the root of a condition: no more is asked of it
            times = [enclosure(time).middle for time in recorded["event_time"].tolist()]
            recorded["event_time"] = np.array([*times, None], dtype=object)[:-1]
        tensions = list(recorded["tension"][-3:])
        if len(tensions) < 3:
            tensions = [self.start.tensions, *tensions[-2:]]
        evidence = simulation.evidence
        creeps = stretch.stop is Stop.RUNAWAY
        if not creeps:
            known = self._advance(recorded["x_G"].tolist())
            creeps = known.middle > ADVANCE
            if abs(known.middle - ADVANCE) <= known.radius and evidence is Evidence.PROVED:
                evidence = Evidence.UNDECIDED
        return _Trial(creeps, evidence, rearrangements(recorded), (tensions[0], tensions[-1]))

    def _followed(self, simulation: Simulation, amplitude: Fraction) -> Stretch:
        """Take a simulation through all cycles, or to a runaway.

        Raises
        ------
        GivenUp
            If the solver gives up, or there are too many events.
        OutOfTime
            If the time is over.
        """
        most = MOST_EVENTS * max(self.chain.n, 20)
        limits = replace(self.limits, events=most)
        drive = Cycles(amplitude, self.cycles)
        stretch = advance(simulation, drive, self.half_cycles, limits)
        if stretch.stop is Stop.DEADLINE:
            raise OutOfTime(stretch.reason)
        if stretch.stop is Stop.BUDGET:
            raise GivenUp(
                f"a run at A = {nearest_float(amplitude):.17g} takes more than {most:.0e}"
                " events: look for the edge at smaller amplitudes"
            )
        if stretch.stop is Stop.LIMIT:
            raise GivenUp(f"a run at A = {nearest_float(amplitude):.17g}: {stretch.reason}")
        return stretch

    def _advance(self, values: list[Any]) -> Enclosure:
        way = -1 if self.chain.tan_alpha < 0 else 1
        end = enclosure(values[-1])
        if len(values) < 3:
            return Enclosure(way * end.middle, end.radius)
        begin = enclosure(values[-3])
        return Enclosure(way * (end.middle - begin.middle), end.radius + begin.radius)


MOST_CYCLES = 10_000
"""Of a float64 course whose fate is asked for."""
CERTIFIED_CYCLES = 1_000
"""Of a certified one."""
_SHORT = 5  # sliders: the transients of longer chains are too long to certify one after the other
_TWIN = Fraction(1, 10**13)  # how far apart the starts are on whose fates float64 has to agree


@dataclass(frozen=True)
class _Fates(_Question):
    """Does the chain creep for ever at this amplitude?

    Twins that start almost alike tell where float64 is no witness: there the fate is a certified
    one.
    """

    solver: str = "certified"
    sensitive: dict[Fraction, bool] = field(default_factory=dict)

    def _course(self, amplitude: Fraction, start: State) -> tuple[Fate, float]:
        """Return the fate in float64, and where x_G has come to apart from a steady advance."""
        drive = Cycles(amplitude, self.cycles)
        experiment = Experiment.of(self.chain, drive, solver="exact", start=start, record=())
        course = Recurring(self.chain, drive, start)
        stop, reason = followed(course, self.limits)
        if stop is Stop.DEADLINE:
            raise OutOfTime(reason)
        found = ended(experiment, course, stop, reason)
        steady = found.cycles * (found.advance or 0.0) / (found.period or 1)
        return found, float(course.simulation.state().displacements.mean()) - steady

    def float_fails(self, low: Fraction, high: Fraction) -> bool:
        """Return whether float64 is no witness at one of two amplitudes, or between them."""
        for amplitude in (low, high, (low + high) / 2):
            self.creeps(amplitude)
            if amplitude in self.sensitive:
                return True
        return False

    def unsettled(self, amplitude: Fraction) -> bool:
        """Return whether float64 creeps there without ever coming to a period."""
        return self.float_fate(amplitude).outcome is Outcome.LIMIT

    def float_fate(self, amplitude: Fraction) -> Fate:
        """Return the fate that float64 finds."""
        return self._course(amplitude, self.start)[0]

    def creeps(self, amplitude: Fraction) -> bool:
        """Return whether the chain creeps: what has not settled has not locked."""
        if amplitude in self.sensitive:
            return self.sensitive[amplitude]
        found, place = self._course(amplitude, self.start)
        creeps = found.outcome not in _IDLE
        if found.outcome in (Outcome.AT_REST, Outcome.RUNAWAY) or self.solver == "exact":
            return creeps
        for seed in (1, 2):
            other = State.perturbed(self.chain, _TWIN, start_seed=seed)
            tensions = self.start.tensions + other.tensions
            twin, there = self._course(amplitude, replace(self.start, tensions=tensions))
            same = (twin.outcome, twin.period) == (found.outcome, found.period)
            if not same or (found.period == 1 and abs(there - place) > 1e-6):
                break
        else:
            return creeps
        if found.outcome is not Outcome.LIMIT and self.chain.n <= _SHORT:
            creeps = self.tried(amplitude, self.solver, {}).creeps
        self.sensitive[amplitude] = creeps
        return creeps

    def tried(self, amplitude: Fraction, solver: str, options: dict[str, Any]) -> _Trial:
        """Return the fate that a solver finds, and what happened until it was known."""
        if solver == "exact":
            found = self.float_fate(amplitude)
            most = min(max(found.cycles, 1), CERTIFIED_CYCLES)
            past = _Question(self.chain, most, self.start, self.limits)
            trial = past.tried(amplitude, solver, options)
            return trial._replace(creeps=found.outcome not in _IDLE, outcome=found.outcome)
        drive = Cycles(amplitude, min(self.cycles, CERTIFIED_CYCLES))
        proved = recurrence(self.chain, drive, self.start, self.limits)
        if proved.outcome is Outcome.LIMIT:
            self.limits.require()
        creeps = proved.outcome not in _IDLE
        tensions = np.array([]), np.array([])
        log = list(proved.log)
        return _Trial(creeps, proved.evidence, log, tensions, proved.outcome, proved)


def _side_by_side(one: _Trial, other: _Trial) -> list[list[LoggedRearrangement]]:
    """Return what happened in both, that which settled earlier gone on with its last period."""
    logs = []
    for trial, beside in ((one, other), (other, one)):
        log = list(trial.log)
        fate, longer = trial.fate, beside.fate
        if fate is not None and longer is not None and fate.period is not None:
            end, step = 2 * fate.cycles, 2 * fate.period
            last = [again for again in log if again.half_cycle > end - step]
            while last and end < 2 * longer.cycles:
                last = [again._replace(half_cycle=again.half_cycle + step) for again in last]
                log += last
                end += step
        logs.append(log)
    return logs


_IDLE = (Outcome.AT_REST, Outcome.CYCLING)


def _rounded(low: Fraction, high: Fraction, begins: bool) -> Edge:
    """Return an edge of float accuracy, rounded outward."""
    unit = _unit(high, _FLOAT_DIGITS - 1)
    below, above = math.floor(low / unit), math.ceil(high / unit)
    return Edge(_text(below, unit), _text(above, unit), begins, Evidence.COMPUTED)


class _Refined(NamedTuple):
    edge: Edge
    at_lower: _Trial
    at_upper: _Trial


class _Search:
    """The search for an edge: scan, bisection, the deciding event's root, two deciding runs."""

    def __init__(
        self,
        asked: _Asked,
        question: _Question,
        scans: list[tuple[Fraction, Fraction]],
        bracket: tuple[Fraction, Fraction] | None,
    ) -> None:
        self.asked = asked
        self.question = question
        self.scans = scans
        self.bracket = bracket
        self.trials = 0
        # what has been found, should time be out
        self.found: list[tuple[Fraction, Fraction, bool]] = []
        self.narrowest: tuple[Fraction, Fraction] | None = None
        self.decided: _Refined | None = None
        self.transient: dict[str, Any] | None = None

    def threshold(self) -> Threshold:
        """Return the threshold, and what was asked for beside it."""
        asked = self.asked
        edges = list(self.edges()) if asked.windows else None
        low, high = edges[0][:2] if edges else self.first_bracket()
        refined = self.decided = self.refined(low, high, begins=True)
        at_lower, at_upper = refined.at_lower, refined.at_upper
        if isinstance(self.question, _Fates):
            return self.lasting(refined, edges)
        outcome, outcome_evidence = _outcome(at_lower, self.question.half_cycles)
        lasting = outcome is Outcome.AT_REST or (
            outcome is Outcome.CYCLING and outcome_evidence is Evidence.PROVED
        )
        if outcome is None:
            outcome, outcome_evidence = self.settled(Fraction(refined.edge.lower))
        differs = first_difference(numbered(at_lower.log), numbered(at_upper.log))
        return Threshold(
            chain=asked.chain,
            cycles=asked.cycles,
            digits=asked.digits,
            **_laws(asked.chain, asked.digits),
            lower=refined.edge.lower,
            upper=refined.edge.upper,
            outcome_at_lower=outcome,
            outcome_evidence=outcome_evidence,
            evidence=refined.edge.evidence,
            stable_digits=self.stable_digits(refined, lasting),
            deciding_event=None if differs is None else Difference(*differs[1:]),
            solver=asked.solver,
            windows=self.windows(refined, edges),
            report={"deciding_runs": self.trials}
            | ({} if self.transient is None else {"transient": self.transient}),
        )

    def windows(
        self, first: _Refined, edges: list[tuple[Fraction, Fraction, bool]] | None
    ) -> tuple[Edge, ...] | None:
        """Return every edge of the scan, as accurately as was asked for."""
        if edges is None:
            return None
        return tuple(
            (first if k == 0 else self.refined(*edge)).edge
            if k < self.asked.refine
            else self.rough(*edge)
            for k, edge in enumerate(edges)
        )

    def lasting(
        self, refined: _Refined, edges: list[tuple[Fraction, Fraction, bool]] | None
    ) -> Threshold:
        """Return the edge of a fate, and what the chain does for ever on both sides."""
        asked, question = self.asked, self.question
        assert isinstance(question, _Fates)
        at_lower, at_upper = refined.at_lower, refined.at_upper
        sides = map(numbered, _side_by_side(at_lower, at_upper))
        differs = first_difference(*sides)
        windows = self.windows(refined, edges)
        return Threshold(
            chain=asked.chain,
            cycles=asked.cycles,
            digits=asked.digits,
            **_laws(asked.chain, asked.digits),
            lower=refined.edge.lower,
            upper=refined.edge.upper,
            outcome_at_lower=at_lower.outcome,
            outcome_evidence=at_lower.evidence,
            evidence=refined.edge.evidence,
            stable_digits=None,
            deciding_event=None if differs is None else Difference(*differs[1:]),
            solver=asked.solver,
            criterion="lasting",
            fates=(at_lower.fate, at_upper.fate),
            sensitive=tuple(sorted(map(nearest_float, question.sensitive))),
            windows=windows,
            report={"deciding_runs": self.trials},
        )

    def unfinished(self, reason: str) -> Threshold:
        """Return what had been found when time was out."""
        asked, edge = self.asked, None
        outcome, evidence = None, Evidence.COMPUTED
        if self.decided is not None:
            edge = self.decided.edge
            lower = self.decided.at_lower
            outcome, evidence = lower.outcome, lower.evidence
            if outcome is None:
                outcome, evidence = _outcome(lower, self.question.half_cycles)
        elif self.narrowest is not None:
            edge = _rounded(*self.narrowest, begins=True)
        windows = tuple(_rounded(*one) for one in self.found) if asked.windows else None
        return Threshold(
            chain=asked.chain,
            cycles=asked.cycles,
            digits=asked.digits,
            **_laws(asked.chain, asked.digits),
            lower=None if edge is None else edge.lower,
            upper=None if edge is None else edge.upper,
            outcome_at_lower=outcome,
            outcome_evidence=evidence,
            evidence=Evidence.COMPUTED if edge is None else edge.evidence,
            stable_digits=None,
            deciding_event=None,
            solver=asked.solver,
            criterion="lasting" if isinstance(self.question, _Fates) else "horizon",
            windows=windows,
            report={"deciding_runs": self.trials},
            reason=reason,
        )

    def edge(self) -> _Refined:
        """Return the lowest edge at which creep begins."""
        return self.refined(*self.first_bracket(), begins=True)

    # -- float64 -----------------------------------------------------------------------------

    def edges(self) -> Iterator[tuple[Fraction, Fraction, bool]]:
        """Yield a bracket of every edge of the scan, and whether creep begins there."""
        points = self.asked.points
        before = self.scans[0][0]
        creeping = self.question.creeps(before)
        if creeping:
            allowed = "must be lower: the chain creeps there already"
            raise InputError("from", nearest_float(before), allowed)
        for begin, end in self.scans:
            found = False
            for k in range(1, points + 1):
                amplitude = begin + (end - begin) * k / points
                creeps = self.question.creeps(amplitude)
                self.asked.say("scan", k, points, "amplitudes")
                if creeps != creeping:
                    found = True
                    self.found.append((before, amplitude, creeps))
                    self.narrowest = self.narrowest or (before, amplitude)
                    yield before, amplitude, creeps
                before, creeping = amplitude, creeps
            if found:
                return
        allowed = "must be higher: the chain creeps at no point of the scan"
        raise InputError("to", nearest_float(before), allowed)

    def first_bracket(self) -> tuple[Fraction, Fraction]:
        """Return the bracket that was given, or the first of the scan."""
        if self.bracket is None:
            low, high, _ = next(self.edges())
            return low, high
        low, high = self.bracket
        creeps = [self.question.creeps(amplitude) for amplitude in self.bracket]
        if creeps != [False, True]:  # or float64 does not tell them apart
            creeps = [self._tried(amplitude).creeps for amplitude in self.bracket]
        if creeps != [False, True]:
            shown = f"{nearest_float(low)} {nearest_float(high)}"
            allowed = "must straddle an edge: no creep at LO, creep at HI"
            raise InputError("bracket", shown, allowed)
        self.narrowest = low, high
        return low, high

    def narrowed(
        self, low: Fraction, high: Fraction, begins: bool, width: Fraction = _NARROW
    ) -> tuple[Fraction, Fraction]:
        """Return the bracket after bisection at midpoints, in float64."""
        while high - low > width * high:
            middle = (low + high) / 2
            if self.question.creeps(middle) == begins:
                high = middle
            else:
                low = middle
            if begins and self.decided is None:
                self.narrowest = low, high
        return low, high

    def rough(self, low: Fraction, high: Fraction, begins: bool) -> Edge:
        """Return an edge at float accuracy."""
        return _rounded(*self.narrowed(low, high, begins), begins)

    # -- all digits --------------------------------------------------------------------------

    def refined(self, low: Fraction, high: Fraction, begins: bool) -> _Refined:
        """Return an edge to all digits, decided by two runs of the chosen solver."""
        unit = _unit(high, self.asked.digits + _SPARE)
        question = self.question
        if isinstance(question, _Fates) and question.unsettled(high if begins else low):
            low, high = self.narrowed(low, high, begins)
            one, other = (question.tried(amplitude, "exact", {}) for amplitude in (low, high))
            edge = replace(_rounded(low, high, begins), evidence=Evidence.UNDECIDED)
            return _Refined(edge, one, other)
        coarse = isinstance(question, _Fates) and question.float_fails(low, high)
        if coarse:  # bisection in float64 would find an edge of its own
            guess = high - unit
        else:
            low, high = self.narrowed(low, high, begins)
            guess = self._guess(low, high)
        if self.asked.solver == "exact":
            # float64 claims no more than what its own edge shares with that of the same
            # itinerary at more digits
            apart = max(abs(guess - low), abs(guess - high))
            while unit < 4 * apart:
                unit *= 10
        trials: dict[int, _Trial] = {}

        def above(k: int) -> bool:
            if k not in trials:
                trials[k] = self._tried(k * unit)
            return trials[k].creeps == begins

        below_k, above_k = math.floor(guess / unit), math.floor(guess / unit) + 1
        # the edge is the first condition's, or lies further on in the bracket of float64, or, if
        # that errs, outside
        step = max(math.ceil((high - low) / unit), 1)
        reach = below_k - math.floor(low / unit)
        if coarse:
            below_k, above_k = math.floor(low / unit), math.ceil(high / unit)
        while above(below_k):
            above_k = below_k
            below_k = max(below_k - max(reach, 1), 0)
            reach = step
            step *= 2
            if above_k == 0:
                raise InputError("bracket", str(low), "must not creep at its lower end")
        reach = math.ceil(high / unit) - above_k
        while not above(above_k):
            below_k = above_k
            above_k += max(reach, 1)
            reach = step
            step *= 2
            if step * unit > high:
                raise InputError("bracket", str(high), "must creep at its upper end")
        while above_k - below_k > 1:
            width = above_k - below_k
            ends = trials[below_k], trials[above_k]
            root = self._root(below_k * unit, above_k * unit, *ends, loss=1)
            near = [] if root is None else [math.floor(root / unit), math.floor(root / unit) + 1]
            for k in near:
                if below_k < k < above_k:
                    below_k, above_k = (below_k, k) if above(k) else (k, above_k)
            if above_k - below_k > max(width // 2, 1):
                k = (below_k + above_k) // 2
                below_k, above_k = (below_k, k) if above(k) else (k, above_k)
        # an end that lies exactly on the edge may be undecided; one unit further out it is not
        proved = self.asked.solver == "certified"
        if proved and trials[below_k].evidence is not Evidence.PROVED and not above(below_k - 1):
            below_k -= 1
        if proved and trials[above_k].evidence is not Evidence.PROVED and above(above_k + 1):
            above_k += 1
        at_lower, at_upper = trials[below_k], trials[above_k]
        evidence = _weaker(at_lower.evidence, at_upper.evidence)
        edge = Edge(_text(below_k, unit), _text(above_k, unit), begins, evidence)
        return _Refined(edge, at_lower, at_upper)

    def _tried(self, amplitude: Fraction, question: _Question | None = None) -> _Trial:
        self.trials += 1
        self.asked.say("deciding", self.trials, 0, "runs")
        return (question or self.question).tried(amplitude, self.asked.solver, self.asked.options())

    def _guess(self, low: Fraction, high: Fraction) -> Fraction:
        """Return where float64 has the edge: a root of the deciding condition, or the middle."""
        if high - low < _NARROW * high / 2:  # float64 would not tell its ends apart
            low, high = low - _NARROW * high, high + _NARROW * high
        trials = [self.question.tried(amplitude, "exact", {}) for amplitude in (low, high)]
        root = self._root(low, high, *trials, loss=16)
        return (low + high) / 2 if root is None else root

    def _root(
        self, low: Fraction, high: Fraction, at_low: _Trial, at_high: _Trial, *, loss: int
    ) -> Fraction | None:
        """Return the root of the condition in which the runs at `low` and `high` first differ.

        None if none of the conditions that may be it has a root there. Beyond the root the runs
        may differ from that at `high` once more, and the edge lie further on. One bit is taken to
        be lost in `loss` events.
        """
        log, beside = _side_by_side(at_low, at_high)
        one, other = numbered(log), numbered(beside)
        events = len(one)
        if at_low.fate is not None:  # what follows the difference does not matter
            differs = first_difference(one, other)
            events = 0 if differs is None else differs[0] // 4
        lost = 64 + events // loss
        for condition in _conditions(self.question, log, one, other):
            root = _secant(condition, low, high, self.asked.digits + _SPARE + 3, lost)
            if root is not None:
                return root
        return None

    def settled(self, amplitude: Fraction) -> tuple[Outcome | None, Evidence]:
        """Return what float64 has the chain do after many more cycles at `amplitude`."""
        changes: list[tuple[int, float]] = []
        for times in _LATER:
            later = replace(self.question, cycles=times * self.question.cycles)
            most = _LATER[-1] * self.question.cycles
            self.asked.say("behaviour below", later.cycles, most, "cycles")
            trial = later.tried(amplitude, "exact", {})
            outcome, evidence = _outcome(trial, later.half_cycles)
            if outcome is not None and not trial.creeps:
                return outcome, _weaker(evidence, Evidence.COMPUTED)
            changes.append((later.cycles, trial.change))
        self.transient = _transient(changes)
        return None, _weaker(trial.evidence, Evidence.COMPUTED)

    def stable_digits(self, refined: _Refined, lasting: bool) -> int:
        """Return how many digits of an edge survive when `cycles` is doubled.

        `lasting`: what the chain does at its lower end, it does for ever.
        """
        asked, edge = self.asked, refined.edge
        width = Fraction(edge.upper) - Fraction(edge.lower)
        shown = min(asked.digits, math.floor(_log2(edge.middle / width) / BITS_PER_DIGIT))
        doubled = replace(self.question, cycles=2 * self.question.cycles)
        lower, upper = Fraction(edge.lower), Fraction(edge.upper)
        if self._tried(upper, doubled).creeps and (
            lasting or not self._tried(lower, doubled).creeps
        ):
            return shown
        again = _Search(replace(asked, windows=False), doubled, self.scans, self.bracket)
        try:
            low, high = again.first_bracket()
        except InputError:
            return 0
        low, high = again.narrowed(low, high, True)
        close = abs((low + high) / 2 - edge.middle) <= 100 * _NARROW * high
        other = again.refined(low, high, True).edge.middle if close else (low + high) / 2
        return _shared_digits(edge.middle, other, shown)


# -- the condition that decides --------------------------------------------------------------


Condition = Callable[[Fraction, int], Any]
"""A function of the amplitude and of the working precision in bits, zero at the edge."""


def _conditions(
    question: _Question,
    log: list[LoggedRearrangement],
    one: list[LoggedEvent],
    other: list[LoggedEvent],
) -> Iterator[Condition]:
    """Yield the conditions that may decide between two runs, the likeliest first."""
    differs = first_difference(one, other)

    def advance(amplitude: Fraction, bits: int) -> Any:
        return _Rerun(question, amplitude, bits).advance(log)

    if differs is None:
        yield advance
        return
    _, a, b = differs
    begin = a or b
    assert begin is not None  # two runs that differ have an event that does
    earlier, later = (a, b) if b is None or (a is not None and _before(a, b)) else (b, a)
    assert earlier is not None
    same = later is not None and later.rearrangement == earlier.rearrangement
    if earlier.number == 0 and later is not None and same and later.number == 0:
        same = later.half_cycle == earlier.half_cycle
    if earlier.number == 0:

        def ramp(amplitude: Fraction, bits: int) -> Any:
            rerun = _Rerun(question, amplitude, bits)
            course = rerun.at_rest(log, earlier.rearrangement)
            first = _starting(course, earlier)
            if later is not None and same:
                return first - _starting(course, later)
            return first - rerun.target(earlier.half_cycle)

        yield ramp
        return
    for event in (earlier, later):
        if event is not None and event.event.kind is EventKind.START:
            partner = later if event is earlier else earlier

            def margin(
                amplitude: Fraction,
                bits: int,
                event: LoggedEvent = event,
                partner: LoggedEvent | None = partner,
            ) -> Any:
                return _Rerun(question, amplitude, bits).margin(log, event, partner)

            yield margin
    if later is not None and same:

        def tie(amplitude: Fraction, bits: int) -> Any:
            return _Rerun(question, amplitude, bits).tie(log, earlier, later)

        yield tie


def _before(a: LoggedEvent, b: LoggedEvent) -> bool:
    """Return whether `a`, which comes after the same events as `b`, comes before it."""
    if (a.half_cycle, a.rearrangement) != (b.half_cycle, b.rearrangement):
        return (a.half_cycle, a.rearrangement) < (b.half_cycle, b.rearrangement)
    return bool(a.event.time <= b.event.time)


def _starting(course: Course, place: LoggedEvent) -> Any:
    return course.starting_load(place.event.sliders[0] - 1, place.event.signs[0])


class _Rerun:
    """The run at one amplitude along a known itinerary, at a given precision."""

    def __init__(self, question: _Question, amplitude: Fraction, bits: int) -> None:
        self.chain = question.chain
        self.limits = question.limits
        self.amplitude = amplitude
        self.half_cycles = question.half_cycles
        self.course = Course(question.chain, question.start, digits_of(bits))

    def target(self, half_cycle: int) -> Any:
        """Return ``l0 theta`` of a target."""
        way = 1 if half_cycle % 2 == 1 else -1
        return self.course.load_of(way * self.amplitude)

    def at_rest(self, log: list[LoggedRearrangement], count: int) -> Course:
        """Return the course after the first `count` rearrangements."""
        half_cycle = 1
        for one in log[:count]:
            self.limits.require()
            self._reach(half_cycle, one.half_cycle)
            half_cycle = one.half_cycle
            self.course.rearrange(one.events)
        return self.course

    def _reach(self, present: int, wanted: int) -> None:
        for half_cycle in range(present, wanted):
            self.course.ramp(self.target(half_cycle))

    def advance(self, log: list[LoggedRearrangement]) -> Any:
        """Return by how much the advance of the last cycle exceeds the limit."""
        first = sum(one.half_cycle <= self.half_cycles - 2 for one in log)
        begin = self.at_rest(log, first).travel.copy()
        half_cycle = log[first - 1].half_cycle if first else 1
        for one in log[first:]:
            self.limits.require()
            self._reach(half_cycle, one.half_cycle)
            half_cycle = one.half_cycle
            self.course.rearrange(one.events)
        way = -1 if self.chain.tan_alpha < 0 else 1
        moved = (self.course.travel - begin).sum() * way / self.chain.n
        return moved - self.course.arithmetic.number(ADVANCE)

    def margin(
        self, log: list[LoggedRearrangement], event: LoggedEvent, partner: LoggedEvent | None
    ) -> Any:
        """Return the least margin of the slider that `event` starts."""
        course = self.at_rest(log, event.rearrangement)
        shared = log[event.rearrangement].events[: event.number]
        flow = course.enter(shared)
        last = shared[-1]
        others = set() if partner is None else set(partner.event.sliders)
        slider, sign = next(
            (n - 1, s)
            for n, s in zip(event.event.sliders, event.event.signs, strict=True)
            if n not in others or partner is None or partner.event.kind is not EventKind.START
        )
        if last.kind is EventKind.STOP and slider + 1 in last.sliders:  # a reversal
            return course.threshold(slider) - sign * flow.forces[slider]
        return course.least_margin(flow, slider, sign, event.event.time - last.time)

    def tie(self, log: list[LoggedRearrangement], one: LoggedEvent, other: LoggedEvent) -> Any:
        """Return by how much time `one` comes before `other`."""
        course = self.at_rest(log, one.rearrangement)
        shared = log[one.rearrangement].events[: one.number]
        flow = course.enter(shared)
        runs = flow.runs()
        first, second = (
            course.time(flow, runs, place.event, place.event.time - shared[-1].time)
            for place in (one, other)
        )
        return first - second


def _secant(
    condition: Condition, low: Fraction, high: Fraction, digits: int, loss: int
) -> Fraction | None:
    """Return the root of `condition` near the bracket to `digits` digits, None if there is none.

    The working precision follows the digits that are known.
    """
    wanted = digits * BITS_PER_DIGIT
    final = math.ceil(wanted) + loss
    width = high - low
    previous, present = low, high
    bits = 0
    condition = lru_cache(maxsize=4)(condition)  # a run in many digits takes seconds
    try:
        for _ in range(32):
            known = _log2(abs(present) / abs(present - previous))
            if known >= wanted:
                return present
            # the next step about doubles what is known; both points are taken at this precision,
            # so that their difference is not rounding
            bits = max(bits, min(final, math.ceil(3 * known) + loss))
            before, now = condition(previous, bits), condition(present, bits)
            if now in (0, before) and bits < final:
                bits = final
                continue
            if now == 0:
                return present
            if now == before:
                return None
            following = present - enclosure(now / (now - before)).middle * (present - previous)
            if not low - _STRAY * width <= following <= high + _STRAY * width:
                return None
            if following == present:
                return present if bits == final else None
            if low < following < high:  # then the error is of the order of the last two steps'
                steps = abs(following - present), abs(following - previous)
                if sum(_log2(abs(following) / step) for step in steps) >= wanted + 16:
                    return following
            previous, present = present, following
    except (StrayRoot, ArithmeticError, KeyError, StopIteration):
        pass
    return None


def _log2(value: Fraction) -> float:
    """Return log2 of a positive rational, however large."""
    shift = value.numerator.bit_length() - value.denominator.bit_length()
    return shift + math.log2(value / Fraction(2) ** shift)


# -- what the runs at the edge tell ----------------------------------------------------------


def _outcome(trial: _Trial, half_cycles: int) -> tuple[Outcome | None, Evidence]:
    """Return what the chain does in the last cycle of a run, and how well that is known."""
    last = [one for one in trial.log if one.half_cycle > half_cycles - 2]
    if not last:
        return Outcome.AT_REST, trial.evidence
    moves: Counter[int] = Counter()
    for one in last:
        if not _lone_slips(one):
            break
        moves.update(dict(zip(one.events[0].sliders, one.events[0].signs, strict=True)))
    else:
        # a lone slip from its threshold moves a slider by 2 D: the moves cancel, or do not
        if not any(moves.values()):
            return Outcome.CYCLING, trial.evidence
        return None, trial.evidence
    before, after = trial.tensions
    pairs = [(enclosure(x), enclosure(y)) for x, y in zip(before, after, strict=True)]
    room = Fraction(len(trial.log), 2**50)
    if any(abs(x.middle - y.middle) > x.radius + y.radius + room for x, y in pairs):
        return None, trial.evidence
    return Outcome.CYCLING, _weaker(trial.evidence, Evidence.COMPUTED)


def _transient(changes: list[tuple[int, float]]) -> dict[str, Any]:
    """Return how a transient goes on that has come to no end.

    Parameters
    ----------
    changes : list of (int, float)
        The largest change of a tension in one cycle, after so many cycles.

    Returns
    -------
    dict
        ``cycles`` followed, and the ``change`` in the last of them; if it falls like a power of
        the number of cycles (the last three agree on one to a tenth), its ``power``: with one below
        -1 the changes still to come have a finite sum, and the chain approaches a cycle that it
        never quite reaches.
    """
    cycles, change = changes[-1]
    out: dict[str, Any] = {"cycles": cycles, "change": change}
    if len(changes) > 2 and min(change for _, change in changes[-3:]) > 0:
        logs = [(math.log(k), math.log(x)) for k, x in changes[-3:]]
        powers = [(y - x) / (b - a) for (a, x), (b, y) in pairwise(logs)]
        if powers[-1] < 0 and abs(powers[0] - powers[1]) <= abs(powers[1]) / 10:
            out["power"] = round(powers[-1], 3)
    return out


def _lone_slips(one: LoggedRearrangement) -> bool:
    """Return whether it is a slip of one slider from its threshold, or of two far apart."""
    if len(one.events) != 2:
        return False
    start, stop = one.events
    return (
        start.kind is EventKind.START
        and stop.kind is EventKind.STOP
        and start.sliders == stop.sliders
        and start.signs == stop.signs
        and all(b - a > 1 for a, b in pairwise(start.sliders))
    )


def _weaker(a: Evidence, b: Evidence) -> Evidence:
    order = list(Evidence)
    return order[max(order.index(a), order.index(b))]


def _shared_digits(a: Fraction, b: Fraction, most: int) -> int:
    """Return how many significant digits `b` shares with `a`, at most `most`."""
    if a == b:
        return most
    return max(0, min(most, math.floor(_log2(abs(a) / abs(a - b)) / BITS_PER_DIGIT)))


# -- decimals --------------------------------------------------------------------------------


def _unit(value: Fraction, digits: int) -> Fraction:
    """Return one unit of the last of `digits` significant decimal digits of `value` > 0."""
    exponent = math.floor(_log2(value) / BITS_PER_DIGIT)
    while Fraction(10) ** (exponent + 1) <= value:
        exponent += 1
    while Fraction(10) ** exponent > value:
        exponent -= 1
    return Fraction(10) ** (exponent + 1 - digits)


def _text(count: int, unit: Fraction) -> str:
    """Return ``count * unit`` as a decimal; `unit` is a power of ten."""
    digits = len(str(unit.denominator)) - len(str(unit.numerator))
    return str(Decimal((int(count < 0), tuple(map(int, str(abs(count)))), -digits)))


class _Predicted(TypedDict):
    law_seuil: str | None
    law_corrected: str | None
    law_two_sliders: str | None


def _laws(chain: Chain, digits: int) -> _Predicted:
    """Return what the laws predict, as decimals."""
    context = digits_of(math.ceil((digits + 10) * BITS_PER_DIGIT)).context
    rationals = {name: getattr(chain, name) for name in ("l0", "mu_d", "mu_s")}
    rationals["tan_alpha"] = abs(chain.tan_alpha)
    parameters = {k: context.mpf(v.numerator) / v.denominator for k, v in rationals.items()}

    def shown(label: str, form: str) -> str | None:
        law = LAWS.get(label)
        function = None if law is None else getattr(law, form)
        if function is None:
            return None
        return enclosure(function(n=chain.n, **parameters)).text(digits)

    two = chain.n == 2
    return {
        "law_seuil": shown("seuil", "printed"),
        "law_corrected": shown("seuil", "corrected"),
        "law_two_sliders": shown("threshold_th_2_cycle_corrected", "exact") if two else None,
    }


# -- where there is nothing to search --------------------------------------------------------


def _single(asked: _Asked) -> Threshold:
    """Return that one slider, which has no spring, stays at rest at any amplitude."""
    return Threshold(
        chain=asked.chain,
        cycles=asked.cycles,
        digits=asked.digits,
        **_laws(asked.chain, asked.digits),
        lower=None,
        upper=None,
        outcome_at_lower=Outcome.AT_REST,
        outcome_evidence=Evidence.PROVED,
        evidence=Evidence.PROVED,
        stable_digits=None,
        deciding_event=None,
        solver=asked.solver,
    )


def _sliding(asked: _Asked) -> Threshold:
    """Return N m/(2 l0), where the chain slides with theta: mu_s = mu_d."""
    chain = asked.chain
    if asked.windows or asked.seeds:
        field = "windows" if asked.windows else "seeds"
        allowed = "has no meaning with mu_s = mu_d: there is one edge, whatever the start"
        raise InputError(field, True if asked.windows else asked.seeds, allowed)
    tangent = abs(chain.tan_alpha)
    # N (mu_d - tan) cos / (2 l0) = sqrt(square), floored exactly
    square = (chain.n * (chain.mu_d - tangent) / (2 * chain.l0)) ** 2 / (1 + tangent**2)
    wide = Fraction(10) ** (2 * math.floor(_log2(square) / (2 * BITS_PER_DIGIT)) - 40)
    near = Fraction(math.isqrt(math.floor(square / wide))) * Fraction(10) ** (
        math.floor(_log2(square) / (2 * BITS_PER_DIGIT)) - 20
    )
    unit = _unit(near, asked.digits + _SPARE)
    below = math.isqrt(math.floor(square / unit**2))
    exact = (below * unit) ** 2 == square
    lower = below * unit
    simulation = solver_named("sliding", {}).simulation(
        chain, State.relaxed(chain), 0, ("x_G", "slips")
    )
    followed = advance(simulation, Cycles(lower, asked.cycles), 2 * asked.cycles)
    moves = bool(np.any(followed.recorded["slips"][-2:]))
    return Threshold(
        chain=chain,
        cycles=asked.cycles,
        digits=asked.digits,
        **_laws(chain, asked.digits),
        lower=_text(below, unit),
        upper=_text(below + 1, unit),
        outcome_at_lower=Outcome.CYCLING if moves else Outcome.AT_REST,
        outcome_evidence=Evidence.COMPUTED,
        evidence=Evidence.PROVED,
        stable_digits=asked.digits,
        deciding_event=None,
        solver="sliding",
        report={"exact": exact},
    )
