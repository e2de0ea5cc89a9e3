"""Where the straight part of v(A) meets zero: what one reads off the paper's figures.

Long chains creep chaotically, and with disorder tensions never return: nothing can be proved of
such creep, but its velocity can be measured, and Eq. (seuil) is a law of where it begins.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy import stats

from exactcreep.laws import LAWS
from exactcreep.limits import NO_LIMITS, Limits, Stop
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles
from exactcreep.model.numbers import (
    InputError,
    exact_number,
    nearest_float,
    plain_data,
    whole_number,
)
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.quasistatic.creep import creep
from exactcreep.studies.fates.fate import refuse_sliding
from exactcreep.studies.fates.survival import MOST_SEED, SIZE, start_of
from exactcreep.studies.thresholds.edges import beside, single_values

FEWEST_POINTS = 8
"""Amplitudes of a straight line."""
UNLIKELY = 0.01
"""Probability of a chi2 as large, below which a line is not believed."""


@dataclass(frozen=True, eq=False)
class Intercept:
    """Where the straight part of v(A) meets zero.

    Attributes
    ----------
    chain : Chain
    amplitudes, velocities, errors : ndarray, shape (points,)
        What was measured: the velocity per half-cycle, unit ``g tau_dyn**2``, and its standard
        error; where that is not known, the largest of the others.
    cycles, seed : int
    size : Fraction
        Largest tension of a start, unit m g.
    fit : tuple of float
        The range of the line, in units of Eq. (seuil).
    intercept, error : float
        The amplitude, and its standard error; nan if not known.
    systematic : float
        The larger shift of the intercept if only the lower, or only the upper half of the
        amplitudes is fitted.
    slope, slope_error : float
    chi2, chi2_probability : float
        Of the line, and the probability of one as large.
    law_seuil, law_slope : float
        Eq. (seuil), and ``(N + 3 - 2i) l0`` of Eq. (vitesse); nan at slopes
        between two plateaus, where i is not unique.
    reason : str
        Why the evidence is undecided; "" if it is not.

    Examples
    --------
    >>> from exactcreep import Chain, threshold
    >>> chain = Chain(2, 1000, "0.5", "0.6", sigma_mu="0.01", tan_alpha="0.25")
    >>> line = threshold(chain, criterion="intercept", cycles=200)
    >>> round(line.intercept / line.law_seuil, 1), line.evidence.value
    (1.3, 'undecided')
    """

    chain: Chain
    amplitudes: NDArray[np.float64]
    velocities: NDArray[np.float64]
    errors: NDArray[np.float64]
    cycles: int
    seed: int
    size: Fraction
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
    reason: str = ""

    criterion = "intercept"
    compare = "the intercept with Eq. (seuil), a law of long chains; the slope with (N + 3 - 2i) l0"

    @property
    def evidence(self) -> Evidence:
        """Measured with float64: `COMPUTED`; `UNDECIDED` where v(A) is no straight line.

        And where a limit ended the measurement.
        """
        return Evidence.UNDECIDED if self.reason else Evidence.COMPUTED

    def summary(self) -> dict[str, Any]:
        """Return everything by names, ready for JSON."""
        names = (
            "criterion", "intercept", "error", "systematic", "slope", "slope_error", "chi2",
            "chi2_probability", "law_slope", "cycles", "seed", "fit", "reason",
        )  # fmt: skip
        return plain_data(
            {name: getattr(self, name) for name in names}
            | {"size": nearest_float(self.size), "evidence": self.evidence.value}
            | beside(self.chain, self.compare)
            | {name: getattr(self, name) for name in _COLUMNS}
        )

    def dataset(self) -> xr.Dataset:
        """Return what was measured along ``amplitude``, and all single values as attributes."""
        columns = {name: ("amplitude", getattr(self, name)) for name in _COLUMNS[1:]}
        about = single_values(self.chain, self.summary())
        return xr.Dataset(columns, {"amplitude": self.amplitudes}, about)


_COLUMNS = ("amplitudes", "velocities", "errors")


def intercept(
    chain: Chain,
    *,
    fit: tuple[Any, Any] = ("1.2", "2"),
    points: int = 12,
    cycles: int = 400,
    size: Any = SIZE,
    seed: int = 0,
    limits: Limits = NO_LIMITS,
    say: Callable[..., None],
) -> Intercept:
    """Return the amplitude at which the straight part of v(A) meets zero.

    Parameters
    ----------
    chain : Chain
        Of a slope below mu_d; negative slopes mean the mirror image.
    fit : pair of numbers
        The range of the line, in units of Eq. (seuil).
    points : int
        Amplitudes, equally spaced over the range: at least 8.
    cycles : int
        Of each of them.
    size : number
        Tensions of a start are uniform in (-size, size), unit m g.
    seed : int
        Below 2**32. Amplitude k, from 1, has the start and the disorder of start k of `survival`.
    limits : Limits
    say : callable

    Returns
    -------
    Intercept
        With its standard error, the shift over two other ranges, chi2, and the laws beside. Out of
        time, the velocities that are known, and the line through them if they are 8 or more.

    Raises
    ------
    InputError
        If an argument is out of range, or Eq. (seuil) is not positive.
    """
    refuse_sliding(chain)
    if not abs(chain.tan_alpha) < chain.mu_d:
        raise InputError("tan_alpha", chain.tan_alpha, "must be less than mu_d in size")
    if chain.n < 2:
        raise InputError("n", chain.n, "must be at least 2: one slider has no spring")
    low, high = _range(fit)
    count = whole_number(points, "points", least=FEWEST_POINTS, most=10_000)
    key = whole_number(seed, "seed", least=0, most=MOST_SEED)
    spread = exact_number(size, "size")
    about = {name: nearest_float(getattr(chain, name)) for name in ("l0", "mu_d", "tan_alpha")}
    downhill = math.copysign(1.0, about["tan_alpha"])
    about["tan_alpha"] = abs(about["tan_alpha"])
    law = float(_law("seuil")(n=chain.n, mu_s=nearest_float(chain.mu_s), **about))
    try:
        law_slope = float(_law("vitesse")(n=chain.n, amplitude=1.0, **about))
    except ValueError:  # two plateaus are as near to the slope
        law_slope = math.nan
    amplitudes = law * np.linspace(low, high, count)
    velocities, errors = np.full(count, math.nan), np.full(count, math.nan)
    over = ""
    for done, k in enumerate([*range(0, count, 2), *range(1, count, 2)]):
        start, disorder = start_of(chain, spread, key, k + 1)
        drive = Cycles(amplitudes[k], cycles)
        seconds = limits.seconds_left
        run = creep(chain, drive, seed=disorder, start=start, record=(), max_seconds=seconds)
        if limits.passed():
            over = limits.reason(Stop.DEADLINE)
            break
        if run.outcome in (Outcome.RUNAWAY, Outcome.LIMIT):
            raise InputError("fit", high, f"must be lower: {run.reason}")
        velocities[k], errors[k] = downhill * run.velocity, run.velocity_error
        say("velocities", done + 1, count, "amplitudes")
    known = ~np.isnan(velocities)
    measured = amplitudes[known], velocities[known], errors[known]
    line: dict[str, Any] = {}
    if np.isnan(measured[2]).sum() > known.sum() // 2:
        if not over:
            allowed = "must be more: velocities have no standard error"
            raise InputError("cycles", cycles, allowed)
    elif known.sum() >= FEWEST_POINTS:
        line = _fitted(*measured)
    line["reason"] = over or line.get("reason", "")
    return Intercept(
        chain, *measured, cycles, key, spread, (low, high), law_seuil=law, law_slope=law_slope,
        **line,
    )  # fmt: skip


def _fitted(
    amplitudes: NDArray[np.float64],
    velocities: NDArray[np.float64],
    errors: NDArray[np.float64],
) -> dict[str, Any]:
    """Return what the weighted line tells; unknown errors are set to the largest of the others."""
    count = amplitudes.size
    unknown = np.isnan(errors)
    errors[unknown] = errors[~unknown].max()
    # a chain that has settled moves without scatter: its weight is that of the surest other
    scatter = errors[errors > 0]
    weighed = np.maximum(errors, scatter.min() if scatter.size else 1.0)
    line, covariance, chi2 = _line(amplitudes, velocities, weighed)
    at = -line[1] / line[0]
    turn = np.array([-at, -1.0]) / line[0]  # derivative of the intercept
    half = (count + 1) // 2
    parts = (slice(None, half), slice(-half, None))
    others = [_line(amplitudes[p], velocities[p], weighed[p])[0] for p in parts]
    found: dict[str, Any] = {
        "intercept": float(at),
        "systematic": float(max(abs(-b / a - at) for a, b in others)),
        "slope": float(line[0]),
    }
    if not scatter.size:
        why = "every chain has settled: v(A) has steps, and no errors to weigh them by"
        return found | {"reason": why}
    probability = float(stats.chi2.sf(chi2, count - 2))
    if probability < UNLIKELY:
        why = f"chi2 is {chi2:.3g} for {count - 2} degrees of freedom: v(A) is no straight line"
        found["reason"] = why
    return found | {
        "error": float(math.sqrt(turn @ covariance @ turn)),
        "slope_error": float(math.sqrt(covariance[0, 0])),
        "chi2": chi2,
        "chi2_probability": probability,
    }


def _law(label: str) -> Callable[..., Any]:
    form = LAWS[label].printed
    assert form is not None
    return form


def _range(fit: Any) -> tuple[float, float]:
    try:
        first, second = fit
    except (TypeError, ValueError):
        raise InputError("fit", fit, "must be two numbers") from None
    low, high = (nearest_float(exact_number(value, "fit")) for value in (first, second))
    if not 0 < low < high:
        raise InputError("fit", f"{first} {second}", "must be two numbers, 0 < LO < HI")
    return low, high


def _line(
    x: NDArray[np.float64], y: NDArray[np.float64], errors: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """Return slope and ordinate of the weighted line, their covariance, and chi2."""
    size = float(x.max())  # so that both columns are of one size
    design = np.column_stack([x / size, np.ones_like(x)]) / errors[:, None]
    covariance = np.linalg.inv(design.T @ design)
    found = covariance @ (design.T @ (y / errors))
    chi2 = float(np.sum((design @ found - y / errors) ** 2))
    back = np.diag([1 / size, 1.0])
    return back @ found, back @ covariance @ back, chi2
