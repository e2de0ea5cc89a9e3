"""The amplitude at which the straight part of v(A) meets zero, as one reads it off a figure."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from fractions import Fraction
from typing import Any

import numpy as np
import scipy  # its parts are loaded where they are used
from numpy.typing import NDArray

from exactcreep.laws import differing_intercept, pivot_sliders
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles
from exactcreep.model.numbers import (
    InputError,
    Number,
    exact_number,
    nearest_float,
    whole_number,
    with_error,
)
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.quasistatic.creep import Interrupted, creep
from exactcreep.studies.fates.survival import MOST_SEED, SIZE, start_of
from exactcreep.studies.sense import INTERCEPT
from exactcreep.studies.thresholds.threshold_result import Threshold
from exactcreep.watch.limits import Limits, Stop
from exactcreep.watch.progress import Progress

Floats = NDArray[np.float64]
FEWEST_POINTS = 8
"""Fewest amplitudes for a straight line."""
UNLIKELY = 0.01
"""A line is rejected if so large a chi2 has a probability below this."""
_FLAT = 1e-6  # a relative slope below this is rounding


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Intercept(Threshold):
    """Where the straight part of v(A) meets zero, an extrapolation."""

    chain: Chain
    cycles: int
    seed: int
    size: Fraction
    reason: str
    amplitudes: Floats
    velocities: Floats
    errors: Floats
    fit: tuple[float, float]
    law_seuil: float
    law_slope: float
    intercept: float = math.nan
    error: float = math.nan
    systematic: float = math.nan
    slope: float = math.nan
    slope_error: float = math.nan
    chi2: float = math.nan
    chi2_probability: float = math.nan

    kind = INTERCEPT
    digits = 12
    compare = "the intercept with Eq. 22, a law of long chains; the slope with (N + 3 - 2i) l0"

    @property
    def evidence(self) -> Evidence:
        """`COMPUTED` in float64, or `UNDECIDED`; `reason` then says why."""
        return Evidence.UNDECIDED if self.reason else Evidence.COMPUTED

    @property
    def finding(self) -> str:
        """The intercept with its uncertainty, and the paper's law, in words."""
        if math.isnan(self.intercept):
            return "no straight part of v(A) is known, so no intercept"
        if not self.chi2_probability >= UNLIKELY:
            return "no line fits: v(A) has no straight part"
        where = f"A = {with_error(self.intercept, self.error)}"
        if self.systematic > 0:
            where += f"; half of the range moves it by up to {self.systematic:.2g}"
        law = f"{'the law' if self.chain.unlike else 'Eq. 22'} says {self.law_seuil:.6g}"
        return f"the straight part of v(A) meets zero at {where}; {law}"

    def _numbers(self) -> dict[str, Any]:
        measured = {one.name: getattr(self, one.name) for one in fields(self)[1:]}
        about = {"kind": self.kind, "size": nearest_float(self.size)}
        return measured | about | {"evidence": self.evidence} | self._beside()

    def _columns(self) -> tuple[dict[str, Any], dict[str, Any]]:
        columns = {name: ("amplitude", getattr(self, name)) for name in ("velocities", "errors")}
        return columns, {"amplitude": self.amplitudes}


def intercept_of(
    chain: Chain,
    limits: Limits,
    say: Callable[..., None],
    *,
    cycles: Number = 400,
    points: Number = 12,
    fit: tuple[Number, Number] = ("1.2", "2"),
    size: Number = SIZE,
    seed: Number = 0,
) -> Intercept:
    """Return the intercept of a chain for which it makes sense; see `threshold`."""
    try:
        low, high = (nearest_float(exact_number(end, "fit")) for end in fit)
    except (TypeError, ValueError):
        raise InputError("fit", fit, "must be two numbers") from None
    if not 0 < low < high:
        raise InputError("fit", fit, "must be two numbers, 0 < LO < HI")
    count = whole_number(points, "points", least=FEWEST_POINTS, most=10_000)
    key = whole_number(seed, "seed", least=0, most=MOST_SEED)
    spread = exact_number(size, "size")
    law, slopes = _line_by_law(chain)
    amplitudes = law * np.linspace(low, high, count)
    measured: dict[int, tuple[float, float, float]] = {}
    over = ""
    for k in [*range(0, count, 2), *range(1, count, 2)]:
        start, disorder = start_of(chain, spread, key, k + 1)
        drive = Cycles(amplitudes[k], cycles)
        begin: dict[str, Any] = {"seed": disorder, "start": start, "record": ()}

        def heard(far: Progress, at: float = amplitudes[k]) -> None:
            where = f"at A = {at:.6g}: {far.half_cycles} of {far.total:.0f} half-cycles so far"
            say("velocities", len(measured), count, "amplitudes", so_far=where)

        try:
            run = creep(chain, drive, max_seconds=limits.seconds_left, progress=heard, **begin)
        except Interrupted:
            if not limits.passed():  # the user interrupted, not the limit of time
                raise
        if limits.passed():
            over = limits.reason(Stop.DEADLINE)
            break
        if run.outcome in (Outcome.RUNAWAY, Outcome.LIMIT):
            raise InputError("fit", high, f"must be lower: {run.reason}")
        measured[k] = amplitudes[k], chain.heading * run.velocity, run.velocity_error
        v = f"v = {with_error(*measured[k][1:])} at A = {amplitudes[k]:.6g} (computed)"
        say("velocities", len(measured), count, "amplitudes", so_far=v)
    columns = np.array([measured[k] for k in sorted(measured)]).reshape(-1, 3).T
    line: dict[str, Any] = {}
    if np.isnan(columns[2]).sum() > len(measured) // 2:
        if not over:
            raise InputError("cycles", cycles, "must be more: velocities have no standard error")
    elif len(measured) >= FEWEST_POINTS:
        line = fitted(*columns)
    return Intercept(
        chain=chain, cycles=drive.cycles, seed=key, size=spread,
        amplitudes=columns[0], velocities=columns[1], errors=columns[2], fit=(low, high),
        law_seuil=law, law_slope=slopes[0] if len(slopes) == 1 else math.nan,
        **line | {"reason": over or line.get("reason", "")},
    )  # fmt: skip


def _line_by_law(chain: Chain) -> tuple[float, tuple[float, ...]]:
    """Return where the law's line meets zero, and its slope (two if both are possible)."""
    driven = chain.each("mu_d"), chain.tan_alpha, chain.end_forces
    least = nearest_float(Fraction(float(differing_intercept(*driven))) / chain.l0)
    found = pivot_sliders(*driven).apart
    return least, tuple(chain.heading * apart * nearest_float(chain.l0) for apart in found)


def fitted(amplitudes: Floats, velocities: Floats, errors: Floats) -> dict[str, Any]:
    """Return the weighted line; an unknown error is replaced by the largest known error."""
    count = amplitudes.size
    unknown = np.isnan(errors)
    errors[unknown] = errors[~unknown].max()
    # a settled chain moves without scatter: it gets the largest weight among the others
    scatter = errors[errors > 0]
    weights = 1 / np.maximum(errors, scatter.min() if scatter.size else 1.0)

    def line(part: slice) -> Any:
        x, y = amplitudes[part], velocities[part]
        return np.polyfit(x, y, 1, w=weights[part], cov="unscaled")

    (slope, ordinate), covariance = line(slice(None))
    at, half = -ordinate / slope, (count + 1) // 2
    others = [line(part)[0] for part in (slice(None, half), slice(-half, None))]
    shifts = [abs(-b / a - at) if abs(a) > _FLAT * abs(slope) else math.inf for a, b in others]
    fitted = {"intercept": at, "systematic": max(shifts), "slope": slope}
    if scatter.size:
        turn = np.array([-at, -1.0]) / slope  # derivative of the intercept
        chi2 = np.sum(((slope * amplitudes + ordinate - velocities) * weights) ** 2)
        fitted |= {
            "error": math.sqrt(turn @ covariance @ turn),
            "slope_error": math.sqrt(covariance[0, 0]),
            "chi2": chi2,
            "chi2_probability": scipy.stats.chi2.sf(chi2, count - 2),
        }
    numbers: dict[str, Any] = {name: float(value) for name, value in fitted.items()}
    if not scatter.size:
        numbers["reason"] = "every chain has settled: v(A) has steps"
    elif numbers["chi2_probability"] < UNLIKELY:
        freedom = f"{numbers['chi2']:.3g} for {count - 2} degrees of freedom"
        numbers["reason"] = f"chi2 is {freedom}"
    return numbers
