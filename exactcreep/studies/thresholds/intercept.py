"""The amplitude at which the straight part of v(A) meets zero, as one reads it off a figure."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from fractions import Fraction
from typing import Any

import numpy as np
import scipy  # its parts are loaded where they are used
from numpy.typing import NDArray

from exactcreep.laws import (
    differing_intercept,
    law_values,
    pivot_sliders,
    plateau_velocity,
    threshold_amplitude,
)
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
from exactcreep.quasistatic.creep import Interrupted, creep, interruptible
from exactcreep.studies.fates.survival import MOST_SEED, SIZE, start_of
from exactcreep.studies.sense import require_sense
from exactcreep.studies.thresholds.amplitudes import two_numbers
from exactcreep.studies.thresholds.beside_laws import BesideLaws
from exactcreep.watch.display import shows_progress
from exactcreep.watch.limits import Limits, Stop
from exactcreep.watch.progress import Hearer, reporter

Floats = NDArray[np.float64]
FEWEST_POINTS = 8
"""Fewest amplitudes for a straight line."""
UNLIKELY = 0.01
"""A line is rejected if so large a chi2 has a probability below this."""
_FLAT = 1e-6  # a relative slope below this is rounding


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Intercept(BesideLaws):
    """Where the straight part of v(A) meets zero.

    Attributes
    ----------
    chain, cycles, seed, size
        The arguments.
    amplitudes, velocities, errors : ndarray, shape (points,)
        Velocities per half-cycle, unit ``g tau_dyn**2``, and their standard errors. An unknown
        error is replaced by the largest known error.
    fit : tuple of float
        The range of the line, in units of Eq. 22.
    intercept, error, slope, slope_error : float
        With standard errors; nan if not known.
    systematic : float
        Larger shift of the intercept if only the lower, or only the upper half of the amplitudes is
        fitted; inf if a half has no slope.
    chi2, chi2_probability : float
        chi2 of the line, and the probability of so large a value.
    law_seuil, law_slope : float
        Eq. 22, and ``(N + 3 - 2i) l0`` of Eq. 20; nan where i is not unique. If friction or end
        forces differ, h/l0 and ``(q - p) l0`` of `differing_velocity`.
    reason : str
        Why the evidence is undecided; "" if it is not.

    Examples
    --------
    >>> chain = Chain(2, 1000, "0.5", "0.6", sigma_mu="0.01", tan_alpha="0.25")
    >>> intercept(chain, cycles=200).evidence.value
    'undecided'
    """

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

    criterion = "intercept"
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
            return "it is not known where the straight part of v(A) meets zero"
        if not self.chi2_probability >= UNLIKELY:
            return "v(A) has no straight part"
        where = f"A = {with_error(self.intercept, self.error)}"
        if self.systematic > 0:
            where += f"; half of the range moves it by up to {self.systematic:.2g}"
        law = f"{'the law' if self.chain.unlike else 'Eq. 22'} says {self.law_seuil:.6g}"
        return f"the straight part of v(A) meets zero at {where}; {law}"

    def _numbers(self) -> dict[str, Any]:
        measured = {one.name: getattr(self, one.name) for one in fields(self)[1:]}
        about = {"criterion": self.criterion, "size": nearest_float(self.size)}
        return measured | about | {"evidence": self.evidence} | self._beside()

    def _columns(self) -> tuple[dict[str, Any], dict[str, Any]]:
        columns = {name: ("amplitude", getattr(self, name)) for name in ("velocities", "errors")}
        return columns, {"amplitude": self.amplitudes}


@shows_progress
@interruptible
def intercept(
    chain: Chain,
    *,
    cycles: Number = 400,
    points: Number = 12,
    fit: tuple[Number, Number] | None = None,
    size: Number = SIZE,
    seed: Number = 0,
    progress: Hearer = None,
    max_seconds: Number | None = None,
) -> Intercept:
    """Return the amplitude at which the straight part of v(A) meets zero.

    This is the threshold in the paper's figures and in Eq. 22, also for chains with disorder.

    Parameters
    ----------
    chain : Chain
        At least two sliders with slips, on a slope below mu_d, with or without disorder. Friction
        may differ and end forces may act; all springs must expand alike.
    cycles : int
        Number of cycles at each amplitude.
    points : int
        Number of amplitudes, at least 8. Amplitude k, from 1, has the start and the disorder of
        start k of `survival`.
    fit : pair of numbers, optional
        Range of the line in units of Eq. 22. Default: 1.2 and 2.
    size : number
        Tensions of a start are uniform in (-size, size), unit m g.
    seed : int
        Seed of the starts and of the disorder.
    progress : bool or callable, optional
        A callable is called with a `Progress`; else as for `creep`.
    max_seconds : number, optional
        Wall time after which the velocities so far are returned, with their line if there are at
        least 8; `reason` then says so.

    Returns
    -------
    Intercept
        The measured velocities, the line through them, and the quality of the fit.

    Raises
    ------
    InputError
        If an argument or the fit is out of range, the question makes no sense for the chain, or
        `cycles` are too few for standard errors.

    Notes
    -----
    Guarantee: none; the line is a weighted least-squares fit of velocities measured in float64.
    `evidence` is `UNDECIDED` if chi2 has a probability below 1 %. Source: Eqs. 20 and 22.

    Examples
    --------
    >>> chain = Chain(2, 1000, "0.5", "0.6", sigma_mu="0.01", tan_alpha="0.25")
    >>> line = intercept(chain, cycles=200)
    >>> round(line.intercept / line.law_seuil, 1)
    1.3
    """
    require_sense(chain, "intercept")
    limits, say = Limits.of(max_seconds=max_seconds), reporter(progress)
    fit = ("1.2", "2") if fit is None else fit
    low, high = map(nearest_float, two_numbers(fit, "fit", positive=True))
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
        try:
            run = creep(chain, drive, max_seconds=limits.seconds_left, **begin)
        except Interrupted:
            if not limits.passed():  # the user interrupted, not the limit of time
                raise
        if limits.passed():
            over = limits.reason(Stop.DEADLINE)
            break
        if run.outcome in (Outcome.RUNAWAY, Outcome.LIMIT):
            raise InputError("fit", high, f"must be lower: {run.reason}")
        measured[k] = amplitudes[k], chain.heading * run.velocity, run.velocity_error
        say("velocities", len(measured), count, "amplitudes")
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
    if chain.unlike:
        driven = chain.each("mu_d"), chain.tan_alpha, chain.end_forces
        least = nearest_float(Fraction(float(differing_intercept(*driven))) / chain.l0)
        found = pivot_sliders(*driven).apart
        return least, tuple(chain.heading * apart * nearest_float(chain.l0) for apart in found)
    about = chain.parameters() | {"tan_alpha": abs(chain.tan_alpha), "amplitude": 1}
    return law_values(threshold_amplitude, about)[0], law_values(plateau_velocity, about)


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
        numbers["reason"] = (
            "every chain has settled: v(A) has steps, and no errors to weigh them by"
        )
    elif numbers["chi2_probability"] < UNLIKELY:
        freedom = f"{numbers['chi2']:.3g} for {count - 2} degrees of freedom"
        numbers["reason"] = f"chi2 is {freedom}: v(A) is no straight line"
    return numbers
