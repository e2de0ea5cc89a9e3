"""Check a finished run from its events: does the motion they make obey the model, and again so?

The events (kinds, sliders, signs, times) are followed in closed form, see `motion`; this shares the
motion of a run with the solvers, and none of their searches. Then the experiment is run again, and
has to give the same bits: radii and times of a log are computed again, never believed.
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
import xarray as xr
from numpy.typing import NDArray

from exactcreep.display import shows_progress
from exactcreep.limits import Limits, OutOfTime, Stop
from exactcreep.model import disorder
from exactcreep.model.enclosure import as_claimed, enclosure, exact_value
from exactcreep.model.numbers import InputError, Number
from exactcreep.model.outcome import Outcome
from exactcreep.model.state import State
from exactcreep.motion.arithmetic import BITS_PER_DIGIT, FLOAT64, Arithmetic, digits_of
from exactcreep.progress import Hearer, reporter
from exactcreep.quasistatic.creep import run_members
from exactcreep.quasistatic.result import Creep, load_members
from exactcreep.solvers.solver import Rearrangement
from exactcreep.studies.audits.motion import ACCURACY, Auditor, EnoughFindings, Finding
from exactcreep.studies.event_log import rearrangements

_NOT_WHOLE = (ArithmeticError, LookupError, TypeError, ValueError)  # what damaged logs raise
_EXTRA_BITS = 64  # of the replay beyond those of the log
_MORE_EVENTS = 1000  # that running again may take beyond those of the log
_OWN = ("seconds", "version", "reason")  # of one run: the time it took, which limit it met


@dataclass(frozen=True, eq=False)
class Audit:
    """What an audit has checked, and what it has found.

    Attributes
    ----------
    findings : tuple of Finding
        Empty if the run is in order.
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
        return float(np.nanmax(np.where(np.isfinite(self.errors), self.errors, 0.0), initial=0.0))

    def summary(self) -> dict[str, Any]:
        """Return the audit by names, ready for JSON."""
        names = "passed reason remark rearrangements events largest_time_error"
        told = {name: getattr(self, name) for name in names.split()}
        told |= {"energy_balance": self.balance, "digits": self.digits}
        return told | {"findings": [finding.summary() for finding in self.findings]}


@shows_progress
def audit(
    result: Rearrangement | Creep,
    *,
    seed: int | None = None,
    most_findings: int = 20,
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
        The audit of a `Creep` ends after so much time; its `reason` says so, and it is not
        `passed`.
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
    its solver claims, of which no more is believed than the digits of the log allow (float64: four
    times its residual; in a run, which records none, `ACCURACY` of the largest threshold), an event
    that is missing, and a contact that is not as the law has it, are found. Between events no
    excursion beyond a threshold is larger than `ACCURACY`, at any time. A `Creep` is run again, and
    whatever differs in a bit is found, but for the time that it took and, of one that was cut
    short, the limit. The events of `verlet` are late by up to its step: they are measured, and only
    running again judges them.

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
    max_seconds: Number | None = None,
    progress: Hearer = None,
) -> list[Audit]:
    """Return what is wrong with the runs in a file, one audit for each member; see `audit`.

    Raises
    ------
    InputError
        If the file is no result, or its events were not recorded.
    """
    members = load_members(path)
    limits, say = Limits.of(max_seconds=max_seconds), reporter(progress)
    said = [partial(say, text=f"member {k}") if len(members) > 1 else say
            for k in range(1, len(members) + 1)]  # fmt: skip
    pairs = zip(members, said, strict=True)
    return [_of_creep(member, None, most_findings, limits, told) for member, told in pairs]


def _of_rearrangement(result: Rearrangement, seed: int | None, most: int) -> Audit:
    chain = result.chain
    if chain.sigma_mu != 0 and seed is None:
        raise InputError("seed", None, "must be given: the static coefficients are drawn")
    times = [event.time for event in result.events]
    arithmetic, digits = _arithmetic(times, result.report.get("precision_bits"))
    seed = disorder.valid_seed(seed or 0)
    auditor = Auditor(chain, result.initial, seed, arithmetic, digits, most)
    with _followed(auditor):
        auditor.begin(result.initial)
        auditor.load = float(chain.l0 * abs(exact_value(result.theta)))
        error = 4 * 2.0**-52 * auditor.load if arithmetic is FLOAT64 else 0.0
        auditor.room = auditor.floor() + error
        auditor.place = (0, None)
        auditor.way = int(auditor.stable())
        if result.events:
            known = [float(event.residual) for event in result.events]
            residuals = known if arithmetic is FLOAT64 else ()
            ended = result.outcome is Outcome.AT_REST
            auditor.rearrangement(result.events, error, ended=ended, residuals=residuals)
        auditor.place = (None, None)
        _compare_end(auditor, result.state)
    return _audited(auditor)


def _of_creep(
    result: Creep, seed: int | None, most: int, limits: Limits, say: Callable[..., None]
) -> Audit:
    if seed is not None and seed != result.seed:
        raise InputError("seed", seed, f"must be that of the run, {result.seed}")
    if "event_time" not in result.recorded:
        raise InputError("record", list(result.recorded), "must include events")
    start = result.experiment.initial
    try:
        columns = as_claimed(result.recorded)
        bits, times = result.report.get("precision_bits"), columns["event_time"].tolist()
        arithmetic, digits = _arithmetic(times, bits, result.experiment.digits)
        auditor = Auditor(result.chain, start, result.seed, arithmetic, digits, most)
        stepped = result.solver == "verlet"
        auditor.most = sys.maxsize if stepped else most
    except _NOT_WHOLE as error:
        told = Finding("order", None, None, f"what was recorded cannot be read: {error}")
        return Audit((told,), 0, 0, np.empty(0), np.empty(0), math.nan, 0)
    auditor.limits = limits
    with _followed(auditor):
        auditor.begin(start)
        _follow(auditor, result, columns, say)
    remark = ""
    if stepped:
        late, count = _audited(auditor).largest_time_error, len(auditor.findings)
        remark = f"{count} departures from the closed form, as of fixed steps: events are late by"
        remark += f" up to {late:.2g} tau_dyn; only running again has judged them"
        auditor.findings, auditor.most = [], most
    if len(auditor.findings) < most and not auditor.reason:
        with _followed(auditor):
            auditor.place = None, None
            _again(auditor, result, limits)
    return replace(_audited(auditor), remark=remark)


def _follow(
    auditor: Auditor, result: Creep, columns: Any, say: Callable[..., None]
) -> None:  # fmt: skip
    """Take the auditor along the drive of a run, from rearrangement to rearrangement."""
    arithmetic, partial = auditor.arithmetic, result.outcome in (Outcome.RUNAWAY, Outcome.LIMIT)
    if not 0 <= result.half_cycles <= result.drive.half_cycles:
        auditor.find("drive", f"the drive has no target {result.half_cycles}")
        return
    log, r = rearrangements(columns), 0
    for q in range(1, min(result.half_cycles + partial, result.drive.half_cycles) + 1):
        target = arithmetic.number(result.drive.exact_target(q, result.seed))
        while r < len(log) and log[r].half_cycle == q:
            auditor.limits.require()
            auditor.place = (r, None)
            say("auditing", r, len(log), "rearrangements")
            theta, radius = enclosure(log[r].theta)
            error = min(float(radius * result.chain.l0), auditor.floor())
            if arithmetic is FLOAT64:
                error += 4 * 2.0**-52 * max(auditor.load, abs(float(theta * result.chain.l0)))
            auditor.room = auditor.floor() + error
            ramped = r > 0 or auditor.stable()
            auditor.ramp(arithmetic.number(theta), target, auditor.room, "a rearrangement")
            auditor.way *= ramped
            auditor.rearrangement(log[r].events, error, ended=r + 1 < len(log) or not partial)
            r += 1
        auditor.place = (None, None)
        if q <= result.half_cycles:
            auditor.ramp(target, target, auditor.room, "a target")
            auditor.rests(f"theta reaches target {q}")
            for name, made in (("x", "displacements"), ("tension", "tensions")):
                if name in columns:
                    own = getattr(auditor.state, made)
                    _same(auditor, f"recorded {name} at target {q}", own, columns[name][q - 1])
    if r < len(log):
        auditor.find("order", f"{len(log) - r} rearrangements belong to no half-cycle")
    if result.outcome is not Outcome.RUNAWAY:  # it goes on moving until that is proved
        _compare_end(auditor, result.state)


def _again(auditor: Auditor, result: Creep, limits: Limits) -> None:
    """Run the experiment again, and find what is not the same, bit for bit."""
    cut = result.outcome is Outcome.LIMIT
    most = result.event_count + (0 if cut else _MORE_EVENTS)
    (again,) = run_members([result.experiment], limits=replace(limits, events=most))
    if limits.passed():
        raise OutOfTime(limits.reason(Stop.DEADLINE))
    given, made = result.dataset, again.dataset
    names = {*given.variables, *made.variables}
    for name in sorted(map(str, names)):
        known = name in given.variables and name in made.variables
        if not known or not _identical(given[name], made[name]):
            auditor.find("again", f"running again gives another {name}")
    for name in sorted(map(str, {*given.attrs, *made.attrs} - {*_OWN})):
        pair = [xr.Dataset(attrs={name: data.attrs.get(name)}) for data in (given, made)]
        if not pair[0].identical(pair[1]):
            auditor.find("again", f"running again gives another {name}")


def _identical(given: xr.DataArray, made: xr.DataArray) -> bool:
    """Return whether two columns hold the same numbers, nan being nan."""
    return given.dims == made.dims and given.shape == made.shape and bool(given.equals(made))


def _compare_end(auditor: Auditor, state: State) -> None:
    """Compare the final state."""
    present = auditor.state
    _same(auditor, "the final tension", present.tensions, state.tensions)
    _same(auditor, "the final displacement", present.displacements, state.displacements)
    off = abs(exact_value(present.theta) - exact_value(state.theta)) * auditor.chain.l0
    rounding = 2.0**-49 * auditor.load + auditor.accuracy * (auditor.arithmetic is not FLOAT64)
    text = "the final theta is not where the drive took it"
    auditor.within("state", text, float(off), rounding)
    if not np.array_equal(present.draws, state.draws):
        auditor.find("state", "the number of draws is not what the stops make")
    elif not np.array_equal(present.coefficients, state.coefficients):
        auditor.find("state", "the final coefficients are not those of the last draws")


def _same(auditor: Auditor, what: str, made: NDArray[Any], given: NDArray[Any]) -> None:
    """Compare numbers as well as errors of events add up."""
    for here, there in zip(made.tolist(), given.tolist(), strict=True):
        known, value = enclosure(there), exact_value(here)
        allowed = max(ACCURACY if isinstance(there, float) else 0.0, auditor.accuracy)
        room = allowed * (1 + len(auditor.radii)) ** 0.5 * auditor.scale + auditor.room
        room += 2.0**-50 * abs(float(value)) * (auditor.arithmetic is FLOAT64)
        text = f"{what} is not what the events make"
        error = float(abs(value - known.middle))
        auditor.within("state", text, error, room)


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
def _followed(auditor: Auditor) -> Iterator[None]:
    """Let an audit end early; what cannot even be followed is a finding."""
    try:
        with auditor.arithmetic.active():
            yield
    except EnoughFindings:
        pass
    except OutOfTime as over:
        auditor.reason = str(over)
    except _NOT_WHOLE as error:
        sentence = f"the log cannot be followed: {error}"
        auditor.findings.append(Finding("order", *auditor.place, sentence))


def _audited(auditor: Auditor) -> Audit:
    return Audit(
        findings=tuple(auditor.findings),
        rearrangements=auditor.rearrangements,
        events=auditor.events,
        errors=np.array(auditor.errors),
        radii=np.array(auditor.radii),
        balance=auditor.balance,
        digits=auditor.digits,
        reason=auditor.reason,
    )
