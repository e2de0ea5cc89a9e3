"""Audit a finished run: do its events obey the model, and does running it again give the same?

The sliders are set in motion and at rest as the events say, and followed in closed form; this
shares the motion of a run with the solvers, and none of their searches. What a log claims is never
believed: in the end the experiment is run again, and has to give the same bits.
"""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exactcreep.display import shows_progress
from exactcreep.limits import NO_LIMITS, Limits, OutOfTime
from exactcreep.model import disorder
from exactcreep.model.chain import Chain
from exactcreep.model.contacts import Contacts, Event, EventKind
from exactcreep.model.enclosure import as_claimed, enclosure, exact_value, floats
from exactcreep.model.numbers import InputError, Number, nearest_float
from exactcreep.model.outcome import Outcome
from exactcreep.model.result import Result, alike
from exactcreep.model.state import State
from exactcreep.motion.arithmetic import BITS_PER_DIGIT, FLOAT64, Arithmetic, digits_of
from exactcreep.motion.modes import Run, forces_of
from exactcreep.motion.replay import Phase, Replay
from exactcreep.progress import Hearer, reporter
from exactcreep.quasistatic.creep import run_members
from exactcreep.quasistatic.result import Creep, load_members
from exactcreep.solvers.solver import Rearrangement
from exactcreep.studies.event_log import rearrangements

ACCURACY = 1e-12
"""What float64 claims: errors of forces and velocities in units of the largest threshold."""
_ROUNDING = 2.0**-46  # of the replay in float64 itself
_NOT_WHOLE = (ArithmeticError, LookupError, TypeError, ValueError)  # what damaged logs raise
_MOST_FINDINGS = 20
_EXTRA_BITS = 64  # of the replay beyond those of the log
_MORE_EVENTS = 1000  # that running again may take beyond those of the log
_OWN = ("seconds", "version", "reason")  # of one run: the time it took, which limit it met
_SHORTEST = 2.0**-40  # piece of a motion, relative, that is not divided further
_TOGETHER = 4096  # pieces of a motion that are looked at together
_LONGEST = 1e6  # tau_dyn: no slider that friction brakes moves for so long


@dataclass(frozen=True)
class Finding:
    """What contradicts the model: where, counted from 0, how far it is off, and how far it may be.

    `check` is ``order``, ``contact``, ``motion``, ``static``, ``drive``, ``energy``, ``state`` or
    ``again`` (what running again does not give).
    """

    check: str
    rearrangement: int | None
    number: int | None
    sentence: str
    error: float = math.inf
    allowed: float = 0.0


class EnoughFindings(Exception):
    """As many findings as were asked for."""


@dataclass(frozen=True, eq=False, repr=False)
class Audit(Result):
    """What an audit has checked, and what it has found.

    Attributes
    ----------
    findings : tuple of Finding
    rearrangements, events : int
        Followed to their end.
    errors, radii : ndarray, shape (events,)
        By how much each event's time is off, to first order, and what is allowed (nan for the
        first of a rearrangement, whose time is zero); unit tau_dyn.
    balance : float
        Largest energy left over in a rearrangement, relative to its largest term.
    digits : int
        Decimal digits at which the motion was followed.
    reason : str
        Why the audit ended before the log did; "" if it did not.
    remark : str
        What the solver does not promise, and was measured alone: the times of fixed steps.

    Examples
    --------
    >>> from exactcreep import Chain, State, audit, rearrange
    >>> chain = Chain(2, 1000, "0.5", "0.6", tan_alpha="0.25")
    >>> found = audit(rearrange(chain, State.relaxed(chain), direction=+1))
    >>> found.passed, found.events, found.findings
    (True, 2, ())
    """

    findings: tuple[Finding, ...]
    rearrangements: int
    events: int
    errors: NDArray[np.float64]
    radii: NDArray[np.float64]
    balance: float
    digits: int
    reason: str = ""
    remark: str = ""

    @property
    def passed(self) -> bool:
        """Whether everything was looked at, and nothing was found."""
        return not self.findings and not self.reason

    @property
    def largest_time_error(self) -> float:
        """By how much the time of an event is off, at most; unit tau_dyn."""
        return float(np.max(self.errors, where=np.isfinite(self.errors), initial=0.0))

    told = ("passed", "reason", "remark", "rearrangements", "events", "largest_time_error")

    def _numbers(self) -> dict[str, Any]:
        findings = [vars(finding) for finding in self.findings]
        about = {"energy_balance": self.balance, "digits": self.digits, "findings": findings}
        return {**super()._numbers(), **about}


@shows_progress
def audit(
    result: Rearrangement | Creep,
    *,
    seed: int | None = None,
    most_findings: int = _MOST_FINDINGS,
    max_seconds: Number | None = None,
    progress: Hearer = None,
) -> Audit:
    """Return what is wrong with a finished run, judged from its events and from running it again.

    Parameters
    ----------
    result : Rearrangement or Creep
        A `Creep` must have recorded its events.
    seed : int, optional
        Of the static coefficients; needed for a `Rearrangement` with ``sigma_mu > 0`` alone.
    most_findings : int
        The audit ends after so many.
    max_seconds : number, optional
        The audit of a `Creep` ends after so much time, with a `reason`, and is not `passed`.
    progress : bool or callable, optional
        Called with a `Progress` at every rearrangement of a `Creep`; else as for `creep`.

    Raises
    ------
    InputError
        If events were not recorded, or the seed is missing or not that of the run.

    Notes
    -----
    Guarantee: an event that differs from the closed form by more than four times the radius that
    its solver claims, of which no more is believed than the digits of the log allow (float64: four
    times its residual; in a run, which records none, 1e-12 of the largest threshold), an event that
    is missing, and a contact that is not as the law has it, are found. Between events no excursion
    beyond a threshold is larger than 1e-12, at any time. A `Creep` is run again, and whatever
    differs in a bit is found, but for its time, version and reason. The events of `verlet` are late
    by up to its step: they are measured, and only running again judges them.

    Examples
    --------
    >>> from exactcreep import Chain, Cycles, creep
    >>> chain = Chain(2, 1000, "0.5", "0.6", tan_alpha="0.25")
    >>> audit(creep(chain, Cycles("0.001", 3), record=["events"])).passed
    True
    """
    if isinstance(result, Rearrangement):
        return _of_rearrangement(result, seed, most_findings)
    if not isinstance(result, Creep):
        raise InputError("result", result, "must be a Rearrangement or a Creep")
    if seed is not None and seed != result.seed:
        raise InputError("seed", seed, f"must be that of the run, {result.seed}")
    return _of_creep(result, most_findings, Limits.of(max_seconds=max_seconds), reporter(progress))


def audit_file(
    path: str | os.PathLike[str], *, max_seconds: Number | None = None, progress: Hearer = None
) -> list[Audit]:
    """Return what is wrong with the runs in a file, one audit for each member; see `audit`."""
    members, found = load_members(path), []
    limits, say = Limits.of(max_seconds=max_seconds), reporter(progress)
    for number, member in enumerate(members, 1):
        text = f"member {number}" if len(members) > 1 else ""
        found.append(_of_creep(member, _MOST_FINDINGS, limits, partial(say, text=text)))
    return found


def _of_rearrangement(result: Rearrangement, seed: int | None, most: int) -> Audit:
    chain = result.chain
    if chain.sigma_mu != 0 and seed is None:
        raise InputError("seed", None, "must be given: the static coefficients are drawn")
    times = [event.time for event in result.events]
    known = _arithmetic(times, result.report.get("precision_bits"))
    auditor = _Auditor(chain, result.initial, disorder.valid_seed(seed or 0), *known, most)
    with auditor.following():
        auditor.begin()
        auditor.load = float(chain.l0 * abs(exact_value(result.theta)))
        error = auditor.arrives(0, result.theta)
        auditor.way = int(auditor.stable())
        if result.events:
            residuals = [float(e.residual) for e in result.events] if auditor.float64 else []
            ended = result.outcome is Outcome.AT_REST
            auditor.rearrangement(result.events, error, ended=ended, residuals=residuals)
        auditor.place = (None, None)
        auditor.ends_in(result.state)
    return auditor.audit()


def _of_creep(result: Creep, most: int, limits: Limits, say: Callable[..., None]) -> Audit:
    if "event_time" not in result.recorded:
        raise InputError("record", list(result.recorded), "must include events")
    stepped, remark = result.solver == "verlet", ""
    columns, bits = as_claimed(result.recorded), result.report.get("precision_bits")
    known = _arithmetic(columns["event_time"].tolist(), bits, result.experiment.digits)
    enough, start = sys.maxsize if stepped else most, result.experiment.initial
    auditor = _Auditor(result.chain, start, result.seed, *known, enough, limits)
    with auditor.following():
        auditor.run(result, columns, say)
    if stepped:
        late, count = auditor.audit().largest_time_error, len(auditor.findings)
        remark = f"{count} departures from the closed form, as of fixed steps: events are late by"
        remark += f" up to {late:.2g} tau_dyn; only running again has judged them"
        auditor.findings, auditor.most = [], most
    if len(auditor.findings) < most and not auditor.reason:
        with auditor.following():
            auditor.place = None, None
            _again(auditor, result)
    return replace(auditor.audit(), remark=remark)


def _again(auditor: _Auditor, result: Creep) -> None:
    """Run the experiment again, and find what is not the same, bit for bit."""
    limits, cut = auditor.limits, result.outcome is Outcome.LIMIT
    most = result.event_count + (0 if cut else _MORE_EVENTS)
    (again,) = run_members([result.experiment], limits=replace(limits, events=most))
    limits.require()
    for part in ("variables", "attrs"):
        given, made = (getattr(run.dataset, part) for run in (result, again))
        for name in sorted({*given, *made}.difference(_OWN)):
            if name not in given or name not in made or not alike(given[name], made[name]):
                auditor.find("again", f"running again gives another {name}")


def _arithmetic(
    times: Sequence[Any], bits: Any, digits: int | None = None
) -> tuple[Arithmetic, int]:
    """Return the arithmetic in which a log is followed, and its digits."""
    if all(isinstance(time, (float, np.floating, int)) for time in times) and digits is None:
        return FLOAT64, 15
    wanted = max(int(bits or 0), math.ceil((digits or 0) * BITS_PER_DIGIT)) or 64
    arithmetic = digits_of(max(wanted, 64) + _EXTRA_BITS)
    return arithmetic, digits or max(1, math.floor(wanted / BITS_PER_DIGIT) - 15)


class _Auditor:
    """The chain at rest as the log has it, and what contradicts the model.

    It is at `place` (a rearrangement, and an event within it), has come by `load`, the largest
    ``l0 |theta|``, and along a ramp of direction `way`, 0 if none. A resting slider may seem to
    exceed its threshold by `room`; `scale` is the largest threshold, and `accuracy` the error that
    the numbers of the log claim in its units.
    """

    def __init__(
        self, chain: Chain, start: State, seed: int, arithmetic: Arithmetic, digits: int, most: int,
        limits: Limits = NO_LIMITS,
    ) -> None:  # fmt: skip
        self.chain, self.contacts, self.limits = chain, Contacts(chain, seed), limits
        self.arithmetic, self.digits, self.most, self.start = arithmetic, digits, most, start
        self.float64, self.l0 = arithmetic is FLOAT64, arithmetic.number(chain.l0)
        self.findings: list[Finding] = []
        self.place: tuple[int | None, int | None] = (None, None)
        self.errors: list[float] = []
        self.radii: list[float] = []
        self.balance = self.load = self.room = 0.0
        self.reason = ""
        self.rearrangements = self.events = self.way = 0
        pairs = enumerate(start.draws.tolist())
        drawn = [float(self.contacts.coefficient(n + 1, k - 1)) for n, k in pairs]
        self.state = State(
            tensions=arithmetic.vector(map(exact_value, start.tensions.tolist())),
            displacements=arithmetic.vector(map(exact_value, start.displacements.tolist())),
            coefficients=start.coefficients if chain.sigma_mu == 0 else np.array(drawn),
            draws=start.draws,
            theta=arithmetic.number(exact_value(start.theta)),
        )
        self.scale = float(max(self.thresholds().tolist()))
        self.accuracy = ACCURACY if self.float64 else 10.0 ** -min(digits, 300)

    def audit(self) -> Audit:
        return Audit(
            tuple(self.findings), self.rearrangements, self.events, np.array(self.errors),
            np.array(self.radii), self.balance, self.digits, self.reason,
        )  # fmt: skip

    @contextmanager
    def following(self) -> Iterator[None]:
        """Let an audit end early; what cannot even be followed is a finding."""
        try:
            with self.arithmetic.active():
                yield
        except EnoughFindings:
            pass
        except OutOfTime as over:
            self.reason = str(over)
        except _NOT_WHOLE as error:
            sentence = f"the log cannot be followed: {error}"
            self.findings.append(Finding("order", *self.place, sentence))

    def begin(self) -> None:
        """Check that the coefficients of the start are those of the seed."""
        for n in np.flatnonzero(self.state.coefficients != self.start.coefficients):
            self.find("contact", f"slider {n + 1} begins with a coefficient not of this seed")

    def thresholds(self) -> NDArray[Any]:
        """Return the forces that hold the sliders at present."""
        return self.contacts.thresholds(self.state.coefficients, self.arithmetic)

    def find(self, check: str, sentence: str, error: Any = math.inf, allowed: Any = 0.0) -> None:
        finding = Finding(check, *self.place, sentence, float(error), float(allowed))
        self.findings.append(finding)
        if len(self.findings) >= self.most:
            raise EnoughFindings

    def within(self, check: str, sentence: str, error: Any, allowed: float) -> None:
        if not error <= allowed:
            self.find(check, sentence, error, allowed)

    def floor(self) -> float:
        """Return how far a condition may be off whatever its time claims."""
        if self.float64:
            return self.accuracy * self.scale
        # decimals of theta and of all times so far were rounded
        return self.accuracy * (self.scale + self.load) * (1 + len(self.radii))

    def arrives(self, rearrangement: int, theta: Any) -> float:
        """Note which rearrangement comes next; return how far off the load at its theta may be."""
        middle, radius = (float(part * self.chain.l0) for part in enclosure(theta))
        error = min(radius, self.floor())
        error += 4 * 2.0**-52 * max(self.load, abs(middle)) * self.float64
        self.place, self.room = (rearrangement, None), self.floor() + error
        return error

    def run(self, result: Creep, columns: Any, say: Callable[..., None]) -> None:
        """Follow a run along its drive, from rearrangement to rearrangement."""
        self.begin()
        arithmetic, partial = self.arithmetic, result.outcome in (Outcome.RUNAWAY, Outcome.LIMIT)
        if not 0 <= result.half_cycles <= result.drive.half_cycles:
            self.find("drive", f"the drive has no target {result.half_cycles}")
            return
        log, r = rearrangements(columns), 0
        for q in range(1, min(result.half_cycles + partial, result.drive.half_cycles) + 1):
            target = arithmetic.number(result.drive.exact_target(q, result.seed))
            while r < len(log) and log[r].half_cycle == q:
                self.limits.require()
                say("auditing", r, len(log), "rearrangements")
                error = self.arrives(r, log[r].theta)
                ramped = r > 0 or self.stable()
                theta = arithmetic.number(exact_value(log[r].theta))
                self.ramp(theta, target, "a rearrangement")
                self.way *= ramped
                self.rearrangement(log[r].events, error, ended=r + 1 < len(log) or not partial)
                r += 1
            self.place = (None, None)
            if q <= result.half_cycles:
                self.ramp(target, target, "a target")
                self.rests(f"theta reaches target {q}")
                for name, made in (("x", "displacements"), ("tension", "tensions")):
                    if name in columns:
                        own = getattr(self.state, made)
                        self.same(f"recorded {name} at target {q}", own, columns[name][q - 1])
        if r < len(log):
            self.find("order", f"{len(log) - r} rearrangements belong to no half-cycle")
        if result.outcome is not Outcome.RUNAWAY:  # it goes on moving until that is proved
            self.ends_in(result.state)

    def ramp(self, to: Any, target: Any, what: str) -> None:
        theta, l0 = self.state.theta, self.l0
        way = self.way = 1 if target >= theta else -1
        self.within("drive", f"theta turns back to {what}", way * (theta - to) * l0, self.room)
        passed = way * (to - target) * l0
        self.within("drive", f"theta passes its target at {what}", passed, self.room)
        self.state = replace(self.state, tensions=self.state.tensions - l0 * (to - theta), theta=to)
        self.load = max(self.load, float(abs(to) * l0))

    def excesses(self) -> list[Any]:
        """Return by how much each resting slider exceeds its threshold at present."""
        weight = self.arithmetic.times_cosine(self.chain, self.chain.tan_alpha)
        forces = forces_of(self.arithmetic, self.state.tensions, weight)
        excesses: list[Any] = (abs(forces) - self.thresholds()).tolist()
        return excesses

    def stable(self) -> bool:
        return all(beyond <= self.room for beyond in self.excesses())

    def rests(self, when: str) -> None:
        for n, beyond in enumerate(self.excesses(), 1):
            text = f"slider {n} exceeds its threshold when {when}"
            self.within("static", text, beyond, self.room)

    def ends_in(self, state: State) -> None:
        present = self.state
        self.same("the final tension", present.tensions, state.tensions)
        self.same("the final displacement", present.displacements, state.displacements)
        off = abs(exact_value(present.theta) - exact_value(state.theta)) * self.chain.l0
        rounding = 2.0**-49 * self.load + self.accuracy * (not self.float64)
        text = "the final theta is not where the drive took it"
        self.within("state", text, float(off), rounding)
        if not np.array_equal(present.draws, state.draws):
            self.find("state", "the number of draws is not what the stops make")
        elif not np.array_equal(present.coefficients, state.coefficients):
            self.find("state", "the final coefficients are not those of the last draws")

    def same(self, what: str, made: NDArray[Any], given: NDArray[Any]) -> None:
        """Compare numbers as well as errors of events add up."""
        for here, there in zip(made.tolist(), given.tolist(), strict=True):
            known, value = enclosure(there), exact_value(here)
            allowed = max(ACCURACY if isinstance(there, float) else 0.0, self.accuracy)
            room = allowed * (1 + len(self.radii)) ** 0.5 * self.scale + self.room
            room += 2.0**-50 * abs(float(value)) * self.float64
            text = f"{what} is not what the events make"
            self.within("state", text, float(abs(value - known.middle)), room)

    def rearrangement(
        self, events: Sequence[Event], load_error: float, *, ended: bool,
        residuals: Sequence[float] = (),
    ) -> None:  # fmt: skip
        """Check one rearrangement, from the present state, and the residuals of its events."""
        known = [enclosure(event.time) for event in events]
        middles = [replace(e, time=time.middle) for e, time in zip(events, known, strict=True)]
        replay = Replay(self.chain, self.state, middles, self.arithmetic, self.contacts)
        rearrangement, number = self.place[0], 0
        widest = self.floor() + load_error
        for phase in replay:
            self.place = (rearrangement, number)
            self.phase(replay, phase)
            for event in phase.events:
                self.place, slack = (rearrangement, number), widest
                if residuals and number:
                    slack = min(widest, 4 * residuals[number] + _ROUNDING * self.scale)
                legal = self.contact(replay, event)
                radius = min(nearest_float(known[number].radius), widest)
                for n, sign in legal.items():
                    self.condition(replay, event.kind, n, sign, radius, slack)
                phase.happen(event, legal)
                number += 1
        self.rearrangements += 1
        self.events += number
        self.place = (rearrangement, None)
        before, self.state = self.state, replay.state()
        self.balanced(replay, before.tensions)
        if not ended:
            return
        if moving := [n + 1 for n in np.flatnonzero(replay.flow.signs).tolist()]:
            self.find("motion", f"sliders {moving} still move after the last event")
        self.rests("the rearrangement ends")

    def phase(self, replay: Replay, phase: Phase) -> None:
        """Check the motion up to the next events, and let it pass."""
        self.limits.require()
        if phase.span < 0:
            self.find("order", "the event comes before the previous one", -phase.span)
            phase.lasts = False
        if phase.lasts and not phase.runs:
            self.find("order", "time passes while no slider moves", phase.span)
        elif phase.lasts:
            resting, when = replay.just_stopped, "after it has stopped"
            if not replay.moves:
                resting, when = set(range(self.chain.n)), "when the rearrangement begins"
            for n in sorted(resting):
                if replay.flow.signs[n] == 0:
                    beyond = abs(replay.flow.forces[n]) - replay.threshold(n)
                    text = f"slider {n + 1} stays at rest beyond its threshold {when}"
                    self.within("static", text, beyond, self.room)
            allowed, span = ACCURACY * self.scale, nearest_float(exact_value(phase.span))
            if span > _LONGEST:
                self.find("motion", f"no slider moves for {span:.3g} tau_dyn", span, _LONGEST)
                raise EnoughFindings
            worst, n, moving = Watches(replay, phase.runs).worst(span, allowed)
            if worst < -allowed:
                act = "turns back" if moving else "exceeds its threshold"
                self.find("motion", f"slider {n + 1} {act} before the event", -worst, allowed)
        phase.arrive()

    def contact(self, replay: Replay, event: Event) -> dict[int, int]:
        """Check that the law allows the event; return the signs of the sliders it allows it to."""
        legal = {}
        starts, flow = event.kind is EventKind.START, replay.flow
        for slider, sign in zip(event.sliders, event.signs, strict=True):
            n = slider - 1
            there = 0 <= n < self.chain.n
            held, force = (flow.signs[n], flow.forces[n]) if there else (0, 0)
            wrong = {
                "is not there": not there,
                f"has the sign {sign}": sign not in (-1, 1),
                "starts while it moves": starts and held != 0,
                "stops while it rests": not starts and held == 0,
                "stops with a sign that it did not have": not starts and held != sign,
                "starts against the force on it": starts and sign * force <= 0,
            }
            if why := next((text for text, holds in wrong.items() if holds), None):
                self.find("contact", f"slider {slider} {why}")
            else:
                legal[n] = sign
        return legal

    def condition(
        self, replay: Replay, kind: EventKind, n: int, sign: int, radius: float, slack: float
    ) -> None:
        """Check that slider `n` (from 0) stops without velocity, or starts at its threshold."""
        flow, first = replay.flow, self.place[1] == 0
        if kind is EventKind.STOP:
            value, what = flow.velocities[n], "moves"
            slope = float(abs(flow.forces[n] - flow.friction * int(flow.signs[n])))
        else:
            value, what = sign * flow.forces[n] - replay.threshold(n), "is not at its threshold"
            around = [m for m in (n - 1, n + 1) if 0 <= m < self.chain.n and flow.signs[m] != 0]
            slope = float(abs(sum(flow.velocities[m] for m in around)))
            if first or n in replay.just_stopped:  # it may start beyond its threshold
                self.within("static", f"slider {n + 1} starts below its threshold", -value, slack)
                if first and self.way:
                    text = f"slider {n + 1} starts beyond its threshold on a ramp"
                    self.within("drive", text, value, slack)
                self.errors.append(math.nan)
                self.radii.append(math.nan)
                return
        size = float(abs(value))
        allowed = 4 * radius * slope + 4 * radius * radius + slack
        self.within("motion", f"slider {n + 1} {what} at the time of its event", size, allowed)
        self.errors.append(size / slope if slope else math.inf if size else 0.0)
        self.radii.append(allowed / slope / 4 if slope else math.inf)

    def balanced(self, replay: Replay, before: NDArray[Any]) -> None:
        """Check that the energy that went is the work of friction; `before` are tensions."""
        energies = replay.energies()
        if largest := max(abs(term) for term in energies):
            # what is left over of tensions that are much larger than their change is rounding
            rounding = 2.0**-50 if self.float64 else self.accuracy
            base = rounding * float((before * before).sum()) / float(largest)
            left = float(abs(energies.left) / largest)
            self.balance = max(self.balance, left)
            self.within("energy", "energy does not balance", left, 4 * max(self.accuracy, base))


class Watches:
    """What must stay positive during a piece of motion, each with a bound of its second derivative.

    A moving slider's speed along its direction, and the two distances of a resting neighbour's
    force from its thresholds; in float64.
    """

    def __init__(self, replay: Replay, runs: Sequence[Run]) -> None:
        self.runs = [
            Run(FLOAT64, run.ends, floats(run.velocities), floats(run.accelerations), run.first)
            for run in runs
        ]
        flow, n = replay.flow, replay.chain.n
        self.size = n
        self.movers = movers = np.array([i for run in runs for i in run.sliders])
        ends = {m for run in runs for m in (run.first - 1, run.first + run.p)}
        self.resting = resting = np.array(sorted(m for m in ends if 0 <= m < n), dtype=int)
        self.sliders = np.concatenate([movers, resting, resting])
        self.directions = flow.signs[movers][:, None]
        rooms = [
            nearest_float(exact_value(replay.threshold(m) - side * flow.forces[m]))
            for side in (1, -1)
            for m in resting.tolist()
        ]
        self.rooms = np.array(rooms).reshape(-1, 1)
        bends, rates = np.zeros(n + 2), np.zeros(n + 2)
        for run in self.runs:
            for i in range(run.p):
                bends[run.first + i + 1] = run.bound(i, 2)
            rates[run.first] += run.bound(0, 1)
            rates[run.first + run.p + 1] += run.bound(run.p - 1, 1)
        bounds = np.concatenate([bends[movers + 1], rates[resting + 1], rates[resting + 1]])
        self.bounds = np.maximum(bounds, np.finfo(float).tiny)[:, None]

    def values(self, t: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return every margin and its slope at the times `t`, each of shape (margins, times)."""
        moved = np.zeros((3, self.size + 2, t.size))
        for run in self.runs:
            moved[:, run.first + 1 : run.first + 1 + run.p] = run.at(t)
        speeds, gains = (self.directions * part[self.movers + 1] for part in moved[1:])
        force, rate = (part[self.resting] + part[self.resting + 2] for part in moved[:2])
        rooms = self.rooms + np.concatenate([-force, force])
        return np.concatenate([speeds, rooms]), np.concatenate([gains, -rate, rate])

    def worst(self, span: float, allowed: float) -> tuple[float, int, bool]:
        """Return a margin below -`allowed` on ``[0, span]``, its slider, whether that moves; or 0.

        From value and slope at either end of a piece follows how far inwards a margin stays above
        -`allowed`; a piece that these two reaches do not cover is halved.
        """
        ends = np.linspace(0.0, span, 2 + math.ceil(2 * span))
        waiting = [(ends[k : k + _TOGETHER], ends[k + 1 : k + 1 + _TOGETHER])
                   for k in range(0, ends.size - 1, _TOGETHER)]  # fmt: skip
        while waiting:
            a, b = waiting.pop()
            a = a[: b.size]
            values, slopes = self.values(np.concatenate([a, b]))
            margin, place = np.unravel_index(int(np.argmin(values)), values.shape)
            if values[margin, place] < -allowed:
                moving = bool(margin < self.movers.size)
                return float(values[margin, place]), int(self.sliders[margin]), moving
            slopes[:, a.size :] *= -1  # inwards
            root = np.sqrt(slopes**2 + 2 * self.bounds * np.maximum(values + allowed, 0.0))
            reach = (slopes + root) / self.bounds
            covered = reach[:, : a.size] + reach[:, a.size :]
            loose = (covered < b - a).any(axis=0) & (b - a > _SHORTEST * span)
            if loose.any():
                a, b = a[loose], b[loose]
                middle = (a + b) / 2
                waiting += [(a, middle), (middle, b)]
        return 0.0, -1, False
