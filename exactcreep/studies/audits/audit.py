"""Re-check a finished run from its events alone.

An audit takes the events as they stand (kinds, sliders, signs, times), and asks whether the motion
that they make obeys the model, see `motion`. It shares the closed form of a run with the solvers,
and none of their searches. What else a run says follows from the motion, see `claims`.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from exactcreep.display import shows_progress
from exactcreep.limits import NO_LIMITS, Limits, OutOfTime
from exactcreep.model import disorder
from exactcreep.model.enclosure import as_claimed
from exactcreep.model.numbers import InputError, Number
from exactcreep.model.outcome import Outcome
from exactcreep.motion.arithmetic import BITS_PER_DIGIT, FLOAT64, Arithmetic, digits_of
from exactcreep.progress import Hearer, reporter
from exactcreep.quasistatic.result import Creep, read_members
from exactcreep.solvers.solver import Rearrangement
from exactcreep.studies.audits.claims import check_order, check_tables, compare_end, follow
from exactcreep.studies.audits.motion import Auditor, EnoughFindings, Finding, exact
from exactcreep.studies.trajectory import rearrangements

_NOT_WHOLE = (ArithmeticError, LookupError, TypeError, ValueError)  # what damaged logs raise
_EXTRA_BITS = 64  # of the replay beyond those of the log


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
    the tables of rearrangements and slips, warnings, outcome, velocity and standard error, and the
    evidence, as far as its solver and the ties that it counted allow. What cannot be made again:
    the ties themselves, the radii, the time that it took, the work in `report`, and which limit
    ended it.

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
    given, made = (
        {f"variable {name}": xr.Dataset({"": found}) for name, found in d.variables.items()}
        | {f"attribute {name}": xr.Dataset(attrs={name: found}) for name, found in d.attrs.items()}
        for d in (data, again)
    )
    for name in sorted({*given, *made} - {"attribute version"}):
        if name not in given or name not in made or not given[name].identical(made[name]):
            sentence = f"the {name} is not what the run in the file makes"
            yield Finding("file", None, None, sentence)


def _of_rearrangement(result: Rearrangement, seed: int | None, most: int) -> Audit:
    chain = result.chain
    if chain.sigma_mu != 0 and seed is None:
        raise InputError("seed", None, "must be given: the static coefficients are drawn")
    times = [event.time for event in result.events]
    arithmetic, digits = _arithmetic(times, result.report.get("precision_bits"))
    seed = disorder.valid_seed(seed or 0)
    auditor = Auditor(chain, result.initial, seed, arithmetic, digits, most)
    with _heard(auditor):
        auditor.begin(result.initial)
        auditor.load = float(chain.l0 * abs(exact(result.theta)))
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
        compare_end(auditor, result.state)
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
    except _NOT_WHOLE as error:
        told = Finding("file", None, None, f"what was recorded cannot be read: {error}")
        return Audit((told,), 0, 0, np.empty(0), np.empty(0), math.nan, 0)
    with _heard(auditor):
        check_tables(auditor, result)
        log = rearrangements(columns) if not auditor.findings else []
        check_order(auditor, columns, log)
        if not auditor.findings:
            auditor.begin(start)
            auditor.limits = limits
            follow(auditor, result, columns, log, say)
    return _audited(auditor)


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
def _heard(auditor: Auditor) -> Iterator[None]:
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
        rearrangements=auditor.tally.rearrangements,
        events=auditor.tally.events,
        errors=np.array(auditor.errors),
        radii=np.array(auditor.radii),
        balance=auditor.balance,
        digits=auditor.digits,
        reason=auditor.reason,
    )
