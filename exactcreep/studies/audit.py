"""Re-check a finished run from its events alone.

An audit takes the events as they stand (kinds, sliders, signs, times), sets the sliders in motion
and at rest accordingly, and asks of the motion that follows in closed form whether it obeys the
model: does each event's condition hold at its time; does every slider that rests stay within its
threshold, and every one that moves keep its direction, at all times between; do all stop; does
energy balance. It shares the closed form of a run with the solvers, and none of their searches.
What else a run claims (velocities, outcome, evidence, counts) follows from the motion, and is
made again by the `March` that made it.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from exactcreep.display import shows_progress
from exactcreep.limits import NO_LIMITS, Limits, OutOfTime
from exactcreep.model import disorder
from exactcreep.model.chain import Chain
from exactcreep.model.contacts import Contacts, Event, EventKind
from exactcreep.model.numbers import InputError, Number, nearest_float
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.model.state import State
from exactcreep.motion.arithmetic import BITS_PER_DIGIT, FLOAT64, Arithmetic, digits_of
from exactcreep.motion.modes import Run, RunMotion, forces_of
from exactcreep.motion.replay import Energies, Phase, Replay
from exactcreep.motion.runaway import NEVER_RESTS, NEVER_STOPS, never_rests
from exactcreep.progress import Hearer, reporter
from exactcreep.quasistatic.decimals import as_claimed, enclosure, floats, quantity
from exactcreep.quasistatic.march import NEARLY, March
from exactcreep.quasistatic.result import Creep, read_members
from exactcreep.solvers.auto import concluded
from exactcreep.solvers.exact.layout import PROMISED_EVENTS
from exactcreep.solvers.solver import Rearrangement, Stretch, Tally
from exactcreep.solvers.tables import COLUMNS, EVENT_TABLE, LOGS, record_arrays
from exactcreep.studies.eventlog import LoggedRearrangement, rearrangements

ACCURACY = 1e-12
"""What float64 claims: errors of forces and velocities in units of the largest threshold."""
_ROUNDING = 2.0**-46  # of the replay in float64 itself
_SHORTEST = 2.0**-40  # piece of a motion, relative, that is not divided further
_NOT_WHOLE = (ArithmeticError, LookupError, TypeError, ValueError)  # what damaged logs raise
_EXTRA_BITS = 64  # of the replay beyond those of the log


@dataclass(frozen=True)
class Finding:
    """Something in a log that contradicts the model.

    Attributes
    ----------
    check : str
        ``order``, ``contact``, ``motion``, ``static``, ``drive``, ``energy``, ``state``,
        ``claim`` (velocities, counts, outcome, evidence) or ``file``.
    rearrangement, number : int or None
        Where: from 0; the event within the rearrangement, from 0.
    sentence : str
    error, allowed : float
        How far it is off, and how far it may be.
    """

    check: str
    rearrangement: int | None
    number: int | None
    sentence: str
    error: float = math.inf
    allowed: float = 0.0

    def summary(self) -> dict[str, Any]:
        """Return the finding by names, ready for JSON."""
        return {
            "check": self.check,
            "rearrangement": self.rearrangement,
            "number": self.number,
            "sentence": self.sentence,
            "error": self.error,
            "allowed": self.allowed,
        }


@dataclass(frozen=True, eq=False)
class Audit:
    """What an audit has checked, and what it has found.

    Attributes
    ----------
    findings : tuple of Finding
        Empty if the run is in order.
    rearrangements, events : int
        Checked.
    errors, radii : ndarray, shape (events,)
        By how much each event's time is off, to first order, and the radius that is claimed
        for it (nan for the first of a rearrangement, whose time is zero); unit tau_dyn.
    balance : float
        Largest energy left over in a rearrangement, relative to its largest term.
    digits : int
        Decimal digits at which the motion was followed.
    reason : str
        Why the audit ended before the log did; "" if it did not.

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

    @property
    def passed(self) -> bool:
        """Whether everything was looked at, and nothing was found."""
        return not self.findings and not self.reason

    def summary(self) -> dict[str, Any]:
        """Return the audit by names, ready for JSON."""
        known = np.isfinite(self.errors)
        return {
            "passed": self.passed,
            "reason": self.reason,
            "rearrangements": self.rearrangements,
            "events": self.events,
            "largest_time_error": float(self.errors[known].max()) if known.any() else 0.0,
            "energy_balance": self.balance,
            "digits": self.digits,
            "findings": [finding.summary() for finding in self.findings],
        }


@shows_progress
def audit(
    result: Rearrangement | Creep,
    *,
    seed: int | None = None,
    most_findings: int = 20,
    max_seconds: Number | None = None,
    progress: Hearer = None,
) -> Audit:
    """Return what is wrong with a finished run, judged from its events.

    Parameters
    ----------
    result : Rearrangement or Creep
        A `Creep` must have recorded its events.
    seed : int, optional
        Of the static coefficients; needed for a `Rearrangement` with ``sigma_mu > 0`` alone.
    most_findings : int
        The audit ends after so many.
    max_seconds : number, optional
        The audit of a `Creep` ends after so much time, between two rearrangements; its `reason`
        says so, and it is not `passed`.
    progress : bool or callable, optional
        Called with a `Progress` at every rearrangement of a `Creep`; default: a bar where somebody
        waits.

    Returns
    -------
    Audit
        `passed`, or its `findings`: sentences with rearrangement and event.

    Raises
    ------
    InputError
        If events were not recorded, or the seed is missing or not that of the run.

    Notes
    -----
    Guarantee: an event that differs from the closed form by more than four times the radius that
    its solver claims (float64: four times its residual; in a run, which records none, `ACCURACY`
    of the largest threshold), an event that is missing, and a contact that is not as the law
    has it, are found. In a log of decimals the rounding of every number so far counts with the
    radii. Between events no excursion beyond a threshold is larger than `ACCURACY`, at any time.
    Of a run, everything it says is made again from its events: x_G, x, tensions, slips, counts,
    warnings, outcome, velocity and standard error, and the evidence, as far as its solver and the
    ties that it counted allow. What cannot be made again: the ties themselves, the radii, the
    time that it took, the work in `report`, and which limit ended it.

    Examples
    --------
    >>> from exactcreep import Chain, Cycles, creep
    >>> chain = Chain(2, 1000, "0.5", "0.6", tan_alpha="0.25")
    >>> audit(creep(chain, Cycles("0.001", 3), record=["events"])).passed
    True
    """
    if isinstance(result, Rearrangement):
        return _of_rearrangement(result, seed, most_findings)
    if isinstance(result, Creep):
        limits, say = Limits.of(max_seconds=max_seconds), reporter(progress)
        return _of_creep(result, seed, most_findings, limits, say)
    raise InputError("result", result, "must be a Rearrangement or a Creep")


def audit_file(
    path: str | os.PathLike[str],
    *,
    most_findings: int = 20,
    max_seconds: Any = None,
    progress: Hearer = None,
) -> list[Audit]:
    """Return what is wrong with the runs in a file, and with what the file says about them.

    Parameters
    ----------
    path : path
        What `Creep.save`, `save_members` or ``exactcreep run --out`` wrote.
    most_findings : int
        The audit of a run ends after so many.
    max_seconds : number, optional
        For all runs together, from when the file has been read; see `audit`.
    progress : callable, optional
        Called with a `Progress` at every rearrangement.

    Returns
    -------
    list of Audit
        One for each member.

    Raises
    ------
    InputError
        If the file is no result, or its events were not recorded.
    """
    members = read_members(path)
    limits, say = Limits.of(max_seconds=max_seconds), reporter(progress)
    return [
        audit_written(
            *member, most_findings=most_findings, limits=limits,
            say=partial(say, text=f"member {number}") if len(members) > 1 else say,
        )
        for number, member in enumerate(members, 1)
    ]  # fmt: skip


def audit_written(
    data: xr.Dataset,
    result: Creep,
    *,
    most_findings: int = 20,
    limits: Limits = NO_LIMITS,
    say: Callable[..., None] | None = None,
) -> Audit:
    """Return what is wrong with a run, and with the dataset that it was read from."""
    found = _of_creep(result, None, most_findings, limits, say or reporter(None))
    told = tuple(_rewritten(data, result))[: most_findings - len(found.findings)]
    return replace(found, findings=found.findings + told)


def _rewritten(data: xr.Dataset, result: Creep) -> Iterator[Finding]:
    """Yield what a file holds that is not what the result in it writes."""
    try:
        again = result.dataset
    except _NOT_WHOLE as error:
        yield Finding("file", None, None, f"the parts of the file do not fit: {error}")
        return
    given, made = ({str(k): v.values for k, v in d.variables.items()} for d in (data, again))
    pairs: list[tuple[str, Mapping[Any, Any], Mapping[Any, Any]]] = [
        ("attribute", data.attrs, again.attrs),
        ("variable", given, made),
    ]
    pairs += [
        (f"attribute of {name}", data[name].attrs, again[name].attrs)
        for name in given
        if name in made
    ]
    for what, here, there in pairs:
        for name in sorted({*here, *there} - {"version"}):
            if name not in here or name not in there or not _alike(here[name], there[name]):
                sentence = f"the {what} {name} is not what the run in the file makes"
                yield Finding("file", None, None, sentence)


def _alike(given: Any, made: Any) -> bool:
    one, other = np.asarray(given), np.asarray(made)
    if one.shape != other.shape:
        return False
    pairs = zip(one.ravel().tolist(), other.ravel().tolist(), strict=True)
    return all(a == b or (a != a and b != b) for a, b in pairs)


class _Enough(Exception):
    """As many findings as were asked for."""


class _Auditor:
    """The chain as the log has it, and what contradicts the model."""

    def __init__(
        self, chain: Chain, start: State, seed: int, arithmetic: Arithmetic, digits: int, most: int
    ) -> None:
        self.chain = chain
        self.contacts = Contacts(chain, seed)
        self.arithmetic = arithmetic
        self.digits = digits
        self.most = most
        self.l0 = arithmetic.number(chain.l0)
        self.findings: list[Finding] = []
        self.place: tuple[int | None, int | None] = (None, None)
        self.errors: list[float] = []
        self.radii: list[float] = []
        self.balance = 0.0
        self.limits, self.reason = NO_LIMITS, ""  # of the time, and why the audit ended early
        self.done = 0  # rearrangements that were looked at
        self.tally = Tally()
        self.slips = np.zeros(chain.n, dtype=np.int64)  # in this half-cycle
        self.load = 0.0  # largest l0 |theta| so far
        self.recorded: Mapping[str, NDArray[Any]] = {}  # what the run claims at its targets
        self.long = False  # whether the last rearrangement is too long for float64's promise
        self.moving: NDArray[Any] = np.zeros(chain.n)  # directions after the last event
        self.velocities: NDArray[Any] = np.zeros(chain.n)
        self.ramped = True  # whether the rearrangement begins at a theta_c that a ramp reached
        self.room = 0.0  # by which a resting slider may seem to exceed its threshold
        self.state = State(
            tensions=arithmetic.vector(map(_exact, start.tensions.tolist())),
            displacements=arithmetic.vector(map(_exact, start.displacements.tolist())),
            coefficients=start.coefficients if chain.sigma_mu == 0 else self.drawn(start),
            draws=start.draws,
            theta=arithmetic.number(_exact(start.theta)),
        )
        self.scale = float(max(self.thresholds().tolist()))
        self.accuracy = ACCURACY if arithmetic is FLOAT64 else 10.0 ** -min(digits, 300)

    def begin(self, start: State) -> None:
        """Check that the coefficients of the start are those of the seed."""
        for n in np.flatnonzero(self.state.coefficients != start.coefficients):
            self.find("contact", f"slider {n + 1} begins with a coefficient not of this seed")

    def drawn(self, state: State) -> NDArray[np.float64]:
        """Return the coefficients of the contacts that the sliders of `state` are in."""
        pairs = enumerate(state.draws.tolist())
        return np.array([float(self.contacts.coefficient(n + 1, k - 1)) for n, k in pairs])

    def thresholds(self) -> NDArray[Any]:
        """Return the forces that hold the sliders at present."""
        return self.contacts.thresholds(self.state.coefficients, self.arithmetic)

    def excesses(self) -> list[Any]:
        """Return by how much each resting slider exceeds its threshold at present."""
        weight = self.arithmetic.times_cosine(self.chain, self.chain.tan_alpha)
        forces = forces_of(self.arithmetic, self.state.tensions, weight)
        excesses: list[Any] = (abs(forces) - self.thresholds()).tolist()
        return excesses

    def find(self, check: str, sentence: str, error: Any = math.inf, allowed: Any = 0.0) -> None:
        """Add a finding."""
        finding = Finding(check, *self.place, sentence, float(error), float(allowed))
        self.findings.append(finding)
        if len(self.findings) >= self.most:
            raise _Enough

    def within(self, check: str, sentence: str, error: Any, allowed: float) -> None:
        """Add a finding if `error` exceeds `allowed`."""
        if not error <= allowed:
            self.find(check, sentence, error, allowed)

    def floor(self) -> float:
        """Return how far a condition may be off whatever its time claims."""
        if self.arithmetic is FLOAT64:
            return self.accuracy * self.scale
        # decimals of theta and of all times so far were rounded
        return self.accuracy * (self.scale + self.load) * (1 + len(self.radii))

    # -- between two rearrangements ------------------------------------------------------------

    def ramp(self, to: Any, target: Any, error: float, what: str) -> None:
        """Take theta to `to` on its way to `target`."""
        theta, l0 = self.state.theta, self.l0
        way = 1 if target >= theta else -1
        self.within("drive", f"theta turns back to {what}", way * (theta - to) * l0, error)
        passed = way * (to - target) * l0
        self.within("drive", f"theta passes its target at {what}", passed, error)
        self.state = replace(self.state, tensions=self.state.tensions - l0 * (to - theta), theta=to)
        self.load = max(self.load, float(abs(to) * l0))

    def stable(self) -> bool:
        """Return whether no slider exceeds its threshold as the chain stands."""
        return all(beyond <= self.room for beyond in self.excesses())

    def rests(self, when: str) -> None:
        """Check that every slider is within its threshold."""
        for n, beyond in enumerate(self.excesses()):
            text = f"slider {n + 1} exceeds its threshold when {when}"
            self.within("static", text, beyond, self.room)

    # -- one rearrangement ---------------------------------------------------------------------

    def rearrangement(
        self, events: Sequence[Event], load_error: float, ended: bool, claims: Sequence[float] = ()
    ) -> None:
        """Check one rearrangement, from the present state; `claims` are its residuals."""
        known = [enclosure(event.time) for event in events]
        exact = [replace(e, time=time.middle) for e, time in zip(events, known, strict=True)]
        replay = Replay(self.chain, self.state, exact, self.arithmetic, self.contacts)
        rearrangement, number = self.place[0], 0
        widest = self.floor() + load_error
        for phase in replay:
            self.place = (rearrangement, number)
            self.phase(replay, phase)
            for event in phase.events:
                self.place = (rearrangement, number)
                slack = widest
                if claims and number:
                    slack = min(widest, 4 * claims[number] + _ROUNDING * self.scale)
                legal = self.contact(replay, event)
                for n, sign in legal.items():
                    radius = nearest_float(known[number].radius)
                    self.condition(replay, event.kind, n, sign, radius, slack, number == 0)
                phase.happen(event, legal)
                number += 1
                self.tally.events += 1
                if event.kind is EventKind.STOP:
                    self.tally.slips += len(legal)
                    self.slips[list(legal)] += 1
                    self.tally.draws_below_mu_d += sum(
                        self.contacts.is_low(replay.coefficient(n)) for n in legal
                    )
        self.tally.rearrangements += 1
        self.tally.long_rearrangements += number > PROMISED_EVENTS
        self.long = number > PROMISED_EVENTS
        self.moving = replay.flow.signs.copy()
        self.velocities = replay.flow.velocities.copy()
        self.place = (rearrangement, None)
        before, self.state = self.state, replay.state()
        self.balanced(replay.energies(), before.tensions)
        if not ended:
            return
        moving = [n + 1 for n in np.flatnonzero(replay.flow.signs).tolist()]
        if moving:
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
            allowed = ACCURACY * self.scale
            watches = _Watches(replay, phase.runs)
            worst, n, moving = watches.worst(nearest_float(_exact(phase.span)), allowed)
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
            if not 0 <= n < self.chain.n:
                self.find("contact", f"there is no slider {slider}")
            elif starts and flow.signs[n] != 0:
                self.find("contact", f"slider {slider} starts while it moves")
            elif not starts and flow.signs[n] == 0:
                self.find("contact", f"slider {slider} stops while it rests")
            elif not starts and flow.signs[n] != sign:
                self.find("contact", f"slider {slider} stops with a sign that it did not have")
            elif starts and sign * flow.forces[n] <= 0:
                self.find("contact", f"slider {slider} starts against the force on it")
            else:
                legal[n] = sign
        return legal

    def condition(
        self,
        replay: Replay,
        kind: EventKind,
        n: int,
        sign: int,
        radius: float,
        slack: float,
        first: bool,
    ) -> None:
        """Check that slider `n` (from 0) stops without velocity, or starts at its threshold.

        Where it may start beyond its threshold, check that it is not below.
        """
        flow = replay.flow
        if kind is EventKind.STOP:
            value, what = flow.velocities[n], "moves"
            slope = float(abs(flow.forces[n] - flow.friction * int(flow.signs[n])))
        else:
            value, what = sign * flow.forces[n] - replay.threshold(n), "is not at its threshold"
            around = [m for m in (n - 1, n + 1) if 0 <= m < self.chain.n and flow.signs[m] != 0]
            slope = float(abs(sum(flow.velocities[m] for m in around)))
            if first or n in replay.just_stopped:
                self.within("static", f"slider {n + 1} starts below its threshold", -value, slack)
                if first and self.ramped:
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

    def balanced(self, energies: Energies, before: NDArray[Any]) -> None:
        """Check that the energy that went is the work of friction; `before` are tensions."""
        largest = max(abs(term) for term in energies)
        if largest == 0:
            return
        # what is left over of tensions that are much larger than their change is rounding
        base = float((before * before).sum()) if before.size else 0.0
        rounding = 2.0**-50 if self.arithmetic is FLOAT64 else self.accuracy
        left = float(abs(energies.left) / largest)
        self.balance = max(self.balance, left)
        allowed = max(self.accuracy, rounding * base / float(largest))
        self.within("energy", "energy does not balance", left, 4 * allowed)


class _Watches:
    """What must stay positive during a piece of motion, in float64, at many times at once.

    A moving slider's speed along its direction, and the two distances of a resting neighbour's
    force from its thresholds, each with a bound of its second derivative.
    """

    def __init__(self, replay: Replay, runs: Sequence[Run]) -> None:
        self.runs = [(run.first, _floating(run.motion)) for run in runs]
        flow, n = replay.flow, replay.chain.n
        self.size = n
        movers = np.array([i for run in runs for i in run.sliders])
        ends = {m for run in runs for m in (run.first - 1, run.first + run.motion.p)}
        resting = np.array(sorted(m for m in ends if 0 <= m < n), dtype=int)
        self.movers, self.resting = movers, resting
        self.sliders = np.concatenate([movers, resting, resting])
        self.directions = flow.signs[movers][:, None]
        rooms = [
            [nearest_float(_exact(replay.threshold(m) - side * flow.forces[m]))]
            for side in (1, -1)
            for m in resting.tolist()
        ]
        self.rooms = np.array(rooms).reshape(-1, 1)
        bends, rates = np.zeros(n + 2), np.zeros(n + 2)
        for first, motion in self.runs:
            for i in range(motion.p):
                bends[first + i + 1] = motion.bound(i, 2)
            rates[first] += motion.bound(0, 1)
            rates[first + motion.p + 1] += motion.bound(motion.p - 1, 1)
        bounds = np.concatenate([bends[movers + 1], rates[resting + 1], rates[resting + 1]])
        self.bounds = np.maximum(bounds, np.finfo(float).tiny)[:, None]

    def values(self, t: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return every margin and its slope at the times `t`, each of shape (margins, times)."""
        shape = (3, self.size + 2, t.size)
        moved = np.zeros(shape)
        for first, motion in self.runs:
            moved[:, first + 1 : first + 1 + motion.p] = _moved(motion, t)
        speeds, gains = (self.directions * part[self.movers + 1] for part in moved[1:])
        force, rate = (part[self.resting] + part[self.resting + 2] for part in moved[:2])
        rooms = self.rooms + np.concatenate([-force, force])
        return np.concatenate([speeds, rooms]), np.concatenate([gains, -rate, rate])

    def worst(self, span: float, allowed: float) -> tuple[float, int, bool]:
        """Return a margin below -`allowed` on ``[0, span]``, its slider and whether that moves.

        From value and slope at either end of a piece follows how far inwards a margin stays above
        -`allowed`; a piece that these two reaches do not cover is halved. Returns 0 if all are.
        """
        times = np.linspace(0.0, span, 2 + math.ceil(2 * span))
        a, b = times[:-1], times[1:]
        while a.size:
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
            a, b = a[loose], b[loose]
            middle = (a + b) / 2
            a, b = np.concatenate([a, middle]), np.concatenate([middle, b])
        return 0.0, -1, False


def _exact(value: Any) -> Fraction:
    return enclosure(value).middle


def _floating(motion: RunMotion) -> RunMotion:
    """Return the motion of a run in float64."""
    if motion.arithmetic is FLOAT64:
        return motion
    velocities, accelerations = (
        np.array([nearest_float(enclosure(x).middle) for x in vector.tolist()])
        for vector in (motion.velocities, motion.accelerations)
    )
    return RunMotion(FLOAT64, motion.ends, velocities, accelerations)


def _moved(motion: RunMotion, t: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return displacements, velocities and accelerations of a run, shape (3, p, times)."""
    w = motion.modes.frequencies[:, None]
    v, a = motion.modal_velocities[:, None], motion.modal_accelerations[:, None]
    still = w == 0
    sin, cos = np.sin(w * t / 2), np.cos(w * t / 2)
    stretched = np.where(still, t / 2, sin / np.where(still, 1.0, w))
    shift = 2 * stretched * (a * stretched + v * cos)
    gain = 2 * (a * stretched * cos - v * sin * sin)
    turned = -2 * sin * (a * sin + w * v * cos)
    vectors = motion.modes.vectors
    return np.stack(
        [
            vectors @ shift,
            motion.velocities[:, None] + vectors @ gain,
            motion.accelerations[:, None] + vectors @ turned,
        ]
    )


# -- what is audited ---------------------------------------------------------------------------


def _of_rearrangement(result: Rearrangement, seed: int | None, most: int) -> Audit:
    chain = result.chain
    if chain.sigma_mu != 0 and seed is None:
        raise InputError("seed", None, "must be given: the static coefficients are drawn")
    times = [event.time for event in result.events]
    arithmetic, digits = _arithmetic(times, result.report.get("precision_bits"))
    seed = disorder.valid_seed(seed or 0)
    auditor = _Auditor(chain, result.initial, seed, arithmetic, digits, most)
    auditor.load = nearest_float(chain.l0 * abs(_exact(result.theta)))
    error = 4 * 2.0**-52 * auditor.load if arithmetic is FLOAT64 else 0.0
    auditor.room = auditor.floor() + error
    ended = result.outcome is Outcome.AT_REST
    with arithmetic.active(), _heard(auditor):
        auditor.begin(result.initial)
        auditor.place = (0, None)
        auditor.ramped = auditor.stable()
        if result.events:
            claims = [float(event.residual) for event in result.events]
            auditor.rearrangement(
                result.events, error, ended, claims if arithmetic is FLOAT64 else ()
            )
        auditor.place = (None, None)
        _final(auditor, result.state)
    return _audited(auditor, 1, len(result.events))


def _of_creep(
    result: Creep, seed: int | None, most: int, limits: Limits, say: Callable[..., None]
) -> Audit:
    if seed is not None and seed != result.seed:
        raise InputError("seed", seed, f"must be that of the run, {result.seed}")
    chain, start = result.chain, result.experiment.initial
    if "event_time" not in result.recorded:
        rearrangements(result.recorded)
    log: list[LoggedRearrangement] = []
    try:
        columns = as_claimed(result.recorded)
        bits = result.report.get("precision_bits")
        times = columns["event_time"].tolist()
        arithmetic, digits = _arithmetic(times, bits, result.experiment.digits)
        auditor = _Auditor(chain, start, result.seed, arithmetic, digits, most)
    except _NOT_WHOLE as error:
        told = Finding("file", None, None, f"what was recorded cannot be read: {error}")
        return Audit((told,), 0, 0, np.empty(0), np.empty(0), math.nan, 0)
    with arithmetic.active(), _heard(auditor):
        _tables(auditor, result)
        if not auditor.findings:
            log += rearrangements(columns)
            auditor.recorded = columns
            auditor.begin(start)
            auditor.limits = limits
            _follow(auditor, result, log, say)
    if auditor.reason:
        del log[auditor.done :]
    return _audited(auditor, len(log), sum(len(one.events) for one in log))


def _arithmetic(
    times: Sequence[Any], bits: Any, digits: int | None = None
) -> tuple[Arithmetic, int]:
    """Return the arithmetic in which a log is followed, and its digits."""
    if all(isinstance(time, (float, np.floating, int)) for time in times) and digits is None:
        return FLOAT64, 15
    wanted = int(bits or 0)
    if digits is not None:
        wanted = max(wanted, math.ceil(digits * BITS_PER_DIGIT))
    arithmetic = digits_of(max(wanted, 64) + _EXTRA_BITS)
    return arithmetic, digits or max(1, math.floor((wanted or 64) / BITS_PER_DIGIT) - 15)


@contextmanager
def _heard(auditor: _Auditor) -> Iterator[None]:
    """Let an audit end early; what cannot even be followed is a finding."""
    try:
        yield
    except _Enough:
        pass
    except OutOfTime as over:
        auditor.reason = str(over)
    except _NOT_WHOLE as error:
        sentence = f"the log cannot be followed: {error}"
        auditor.findings.append(Finding("order", *auditor.place, sentence))


def _tables(auditor: _Auditor, result: Creep) -> None:
    """Check that what was recorded is there, whole, and numbered as events are."""
    recorded, n, experiment = result.recorded, result.chain.n, result.experiment
    expected = {quantity(name) for name in record_arrays(dict.fromkeys(experiment.record, ()), n)}
    there = {quantity(name) for name in recorded}
    for name in sorted(expected ^ there):
        auditor.find("state", f"{name} was recorded, or was not, against what was asked for")
    if not 0 <= result.half_cycles <= result.drive.half_cycles:
        auditor.find("claim", f"the drive has no target {result.half_cycles}")
    rows = len(recorded["event_time"])
    lengths = {
        name: len(recorded.get(next(iter(table.columns)), ()))
        for table in LOGS.values()
        for name in table.columns
    }
    for name, values in recorded.items():
        column = COLUMNS[quantity(name)]
        sizes = {"slider": n, "spring": n - 1}
        length = lengths.get(quantity(name), result.half_cycles)
        shape = (length, *(sizes[across] for across in column.across))
        if values.shape != shape:
            auditor.find("state", f"{name} has the shape {values.shape} instead of {shape}")
        elif values.dtype.kind == "f" and not np.isfinite(values).all():
            auditor.find("state", f"{name} holds numbers that are not finite")
    if auditor.findings:
        return
    for name in sorted(expected):
        if f"{name}_decimal" in recorded:
            known = as_claimed({key: recorded[key] for key in recorded if quantity(key) == name})
            near = floats(known[name])
            room = [nearest_float(x.radius) for x in known[name].ravel().tolist()]
            off = np.abs(near - recorded[name]).ravel() - np.array(room)
            if (off > 2.0**-50 * np.abs(near).ravel()).any():
                auditor.find("state", f"{name} and its decimals are not the same numbers")
    names = [name for name in EVENT_TABLE.columns if name in recorded]
    columns = {name.removeprefix("event_"): recorded[name] for name in names}
    ranges = {"kind": (0, 1), "slider": (1, n), "half_cycle": (1, result.half_cycles + 1)}
    for name, (low, high) in ranges.items():
        if rows and not low <= columns[name].min() <= columns[name].max() <= high:
            auditor.find("contact", f"the event column of {name} is not within {low} .. {high}")
    if not (np.abs(columns["sign"]) == 1).all():
        auditor.find("contact", "the event column of sign is not +1 or -1")
    if not rows:
        return
    step, new = np.diff(columns["rearrangement"]), np.diff(columns["number"])
    again = step == 0
    if columns["rearrangement"][0] != 0 or not np.isin(step, (0, 1)).all():
        auditor.find("order", "rearrangements are not numbered 0, 1, 2, ...")
    if columns["number"][0] != 0 or not np.isin(new[again], (0, 1)).all():
        auditor.find("order", "events are not numbered 0, 1, 2, ...")
    if (columns["number"][1:][~again] != 0).any():
        auditor.find("order", "the events of a rearrangement are not numbered from 0")
    same = again & (new == 0)
    for name in names:
        whole = name.removeprefix("event_")
        which = again if whole in ("half_cycle", "theta") else same
        parts = [name, f"{name}_decimal"]
        if whole != "theta":  # which certified encloses anew, wider, where it gathers its set again
            parts.append(f"{name}_radius")
        for part in parts if whole in ("half_cycle", "theta", "time", "kind") else ():
            if part in recorded and (recorded[part][1:] != recorded[part][:-1])[which].any():
                auditor.find("order", f"{part} changes within one event or rearrangement")
    if (np.diff(columns["half_cycle"]) < 0).any():
        auditor.find("order", "half-cycles go back")


def _follow(
    auditor: _Auditor, result: Creep, log: list[LoggedRearrangement], say: Callable[..., None]
) -> None:
    """Take the auditor along the drive of a run, and a march with it."""
    arithmetic, partial = auditor.arithmetic, result.outcome in (Outcome.RUNAWAY, Outcome.LIMIT)
    march = March(result.experiment, None)
    told = SimpleNamespace(
        tally=auditor.tally, state=lambda: auditor.state, evidence=result.evidence, report=dict,
        twin=lambda: None, capture=dict,
    )  # fmt: skip
    march.simulation = told  # type: ignore[assignment]
    r = 0
    for q in range(1, result.half_cycles + 2):
        more = q <= result.half_cycles
        if not more and not partial:
            break
        known = result.drive.half_cycles >= q
        target = arithmetic.number(result.drive.exact_target(q, result.seed)) if known else None
        auditor.slips[:] = 0
        while r < len(log) and log[r].half_cycle == q and known:
            one = log[r]
            auditor.place, auditor.done = (r, None), r
            say("auditing", r, len(log), "rearrangements")
            theta, radius = enclosure(one.theta)
            error = nearest_float(radius * result.chain.l0)
            if arithmetic is FLOAT64:
                largest = max(auditor.load, abs(nearest_float(theta * result.chain.l0)))
                error += 4 * 2.0**-52 * largest
            auditor.room = auditor.floor() + error
            auditor.ramped = r > 0 or auditor.stable()
            auditor.ramp(arithmetic.number(theta), target, auditor.room, "a rearrangement")
            auditor.rearrangement(one.events, error, r + 1 < len(log) or not partial)
            r += 1
        auditor.place = (None, None)
        if more:
            auditor.ramp(target, target, auditor.room, "a target")
            auditor.rests(f"theta reaches target {q}")
            _compare_rows(auditor, result, q)
            moved = auditor.state.displacements
            x_g = np.array([sum(moved.tolist()) / result.chain.n])
            march.take(Stretch(1, {"x_G": x_g, "x": moved[None, :]}))
    if r < len(log):
        auditor.find("order", f"{len(log) - r} rearrangements belong to no half-cycle")
    if result.outcome is not Outcome.RUNAWAY:  # it goes on moving until that is proved
        _final(auditor, result.state)
    _claims(auditor, result, march)


def _claims(auditor: _Auditor, result: Creep, march: March) -> None:
    """Compare what a run says about itself with what `march` finds on the same way."""
    auditor.tally.undecided = result.undecided
    whole = result.half_cycles == result.drive.half_cycles
    in_motion = bool(auditor.moving.any())
    if result.solver not in ("exact", "auto"):
        auditor.tally.long_rearrangements = 0
    elif in_motion and auditor.tally.long_rearrangements:
        auditor.tally.long_rearrangements -= auditor.long  # it has not ended
    if not whole or in_motion:
        march.outcome, march.reason = result.outcome, result.reason
    # the solver saw whether tensions came back exactly; here they are rounded anew
    march.unseen = _ROUNDING * auditor.scale * (1 + len(auditor.radii))
    own = march.result()

    def differ(name: str, claimed: Any, found: Any) -> None:
        if claimed != found:
            auditor.find("claim", f"{name} is {claimed}, and the events make it {found}")

    for name, count in own.counts.items():
        if name not in ("undecided", "undecided_from"):
            differ(name, result.counts[name], count)
    differ("warnings", dict(result.warnings), dict(own.warnings))
    doubtful = _ending(auditor, result, march, whole=whole, in_motion=in_motion)
    solver = str(result.report.get("chosen", result.solver))
    long = solver == "exact" and (own.long_rearrangements or (in_motion and auditor.long))
    best = Evidence.PROVED if solver == "certified" else Evidence.COMPUTED
    counted = int(result.undecided) + int(bool(long)) + result.undecided_from
    evidence = Evidence.of(counted + doubtful, best)
    differ("evidence", result.evidence.value, evidence.value)
    since = result.undecided_from
    if not 0 <= since <= result.half_cycles + 1 or (counted > 0 and since == 0):
        auditor.find("claim", f"the run is {evidence.value}, from {result.undecided_from} on")
    trusted = result.trusted_half_cycles
    if trusted is not None and not 0 <= trusted <= result.half_cycles:
        auditor.find("claim", f"{trusted} half-cycles are trusted of {result.half_cycles}")
    if result.undecided < 0:
        auditor.find("claim", f"undecided is {result.undecided}")
    if "ties_assumed" in result.report:
        differ("ties_assumed", result.report["ties_assumed"], result.undecided)
    for name, found in concluded(result.report, result.velocity, result.velocity_error).items():
        differ(name, result.report.get(name), found)
    _velocities(auditor, result, own)


def _ending(
    auditor: _Auditor, result: Creep, march: March, *, whole: bool, in_motion: bool
) -> bool:
    """Check the outcome of a run and the reason that it gives; return whether that is undecided."""
    proofs = (NEVER_STOPS, NEVER_RESTS)
    if whole and not in_motion:
        march.outcome = None
        exactly = march._behaviour(auditor.state)
        march.unseen = 0.0
        expected = [exactly, march._behaviour(auditor.state)]
        nearly = result.reason.startswith(NEARLY)
        claimed = result.outcome, result.since
        for found in expected:
            settled = found.velocity is not None
            if claimed == (found.outcome, found.since) and (
                result.reason == found.reason or (nearly and settled)
            ):
                return found.doubtful or nearly
        sentence = f"the outcome {result.outcome.value} ({result.reason!r}) is not the run's"
        auditor.find("claim", sentence)
    elif result.outcome is Outcome.RUNAWAY:
        if result.reason not in proofs or not _runs_away(auditor, result.chain):
            auditor.find("claim", "nothing proves that the chain runs away")
    elif result.outcome is not Outcome.LIMIT or result.reason in ("", *proofs):
        auditor.find("claim", f"the run ends early, and calls it {result.outcome.value}")
    return False


def _runs_away(auditor: _Auditor, chain: Chain) -> bool:
    """Return whether a chain in motion can be one that never comes to rest."""
    down = 1 if chain.tan_alpha >= 0 else -1
    if chain.may_run_away and (auditor.moving == down).all():
        return True
    largest = max(map(auditor.contacts.acting, auditor.state.coefficients.tolist()))
    state, moving = auditor.state, auditor.moving
    slack = auditor.floor()
    return never_rests(
        auditor.arithmetic, chain, state.tensions, auditor.velocities, moving, largest, slack
    )


def _velocities(auditor: _Auditor, result: Creep, own: Creep) -> None:
    """Compare the mean velocity and its standard error."""
    room = auditor.accuracy * (1 + len(auditor.radii)) ** 0.5 * auditor.scale + auditor.room
    size = abs(nearest_float(enclosure(auditor.state.displacements[0]).middle))
    room += 2.0**-48 * (1 + size)
    exact = result.velocity_enclosure
    for name, claimed, found, allowed in (
        ("velocity", result.velocity, own.velocity, room),
        ("velocity_error", result.velocity_error, own.velocity_error, room / 2),
    ):
        if claimed == found or (math.isnan(claimed) and math.isnan(found)):
            continue
        error = abs(claimed - found)
        text = f"{name} is not what the events make"
        auditor.within("claim", text, math.inf if math.isnan(error) else error, allowed)
    other = own.velocity_enclosure
    if (exact is None) != (other is None):
        auditor.find("claim", "the velocity has an exact value, or has none, against the digits")
    elif exact is not None and other is not None:
        error = nearest_float(abs(exact.middle - other.middle))
        text = "the exact velocity is not what the events make"
        auditor.within("claim", text, error, room + nearest_float(exact.radius))
        if result.velocity != nearest_float(exact.middle):
            auditor.find("claim", "the velocity is not the float nearest to its exact value")


def _compare_rows(auditor: _Auditor, result: Creep, q: int) -> None:
    """Compare what was recorded at target `q`."""
    state, recorded = auditor.state, auditor.recorded
    mean = np.array([sum(state.displacements.tolist()) / result.chain.n], dtype=object)
    rows = (("x", state.displacements), ("tension", state.tensions), ("x_G", mean))
    for name, present in rows:
        if name in recorded:
            given = recorded[name][q - 1 : q].ravel().tolist()
            _same(auditor, f"recorded {name} at target {q}", present, given)
    if "slips" in recorded and not np.array_equal(recorded["slips"][q - 1], auditor.slips):
        auditor.find("state", f"slips at target {q} are not those of the events")


def _same(auditor: _Auditor, what: str, present: NDArray[Any], given: Sequence[Any]) -> None:
    for here, there in zip(present.tolist(), given, strict=True):
        known = enclosure(there)
        value = _exact(here)
        allowed = max(ACCURACY if isinstance(there, float) else 0.0, auditor.accuracy)
        room = allowed * (1 + len(auditor.radii)) ** 0.5 * auditor.scale + auditor.room
        room += 2.0**-50 * abs(nearest_float(value)) * (auditor.arithmetic is FLOAT64)
        error = nearest_float(abs(value - known.middle))
        auditor.within(
            "state",
            f"{what} is not what the events make",
            error,
            room + nearest_float(known.radius),
        )


def _final(auditor: _Auditor, state: State) -> None:
    """Compare the final state."""
    present = auditor.state
    _same(auditor, "the final tension", present.tensions, state.tensions.tolist())
    displacements = state.displacements.tolist()
    _same(auditor, "the final displacement", present.displacements, displacements)
    off = abs(_exact(present.theta) - enclosure(state.theta).middle) * auditor.chain.l0
    rounding = 2.0**-49 * auditor.load + auditor.accuracy * (auditor.arithmetic is not FLOAT64)
    text = "the final theta is not where the drive took it"
    auditor.within("state", text, nearest_float(off), rounding)
    if not np.array_equal(present.draws, state.draws):
        auditor.find("state", "the number of draws is not what the stops make")
    elif not np.array_equal(present.coefficients, state.coefficients):
        auditor.find("state", "the final coefficients are not those of the last draws")


def _audited(auditor: _Auditor, count: int, events: int) -> Audit:
    return Audit(
        findings=tuple(auditor.findings),
        rearrangements=count,
        events=events,
        errors=np.array(auditor.errors),
        radii=np.array(auditor.radii),
        balance=auditor.balance,
        digits=auditor.digits,
        reason=auditor.reason,
    )
