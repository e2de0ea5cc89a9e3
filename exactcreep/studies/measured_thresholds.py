"""Thresholds that are measured: where chaotic creep is too short-lived, or too slow, for an edge.

From six sliders on creep is chaotic, and just above its first edge a transient; with disorder
tensions never return. Nothing can be proved of such creep, but two amplitudes can be measured: that
at which half of many starts outlive a horizon, and that at which the straight part of v(A), drawn
on, meets zero. The first depends on the horizon, and no law of the paper is about it; the second is
what one reads off the paper's figures, and Eq. (seuil) is its law.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from exactcreep.laws import LAWS
from exactcreep.limits import Limits
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles
from exactcreep.model.numbers import (
    InputError,
    Number,
    exact_number,
    nearest_float,
    plain_data,
    whole_number,
)
from exactcreep.model.verdict import Evidence, Outcome
from exactcreep.progress import Progress, reporter
from exactcreep.quasistatic.loop import creep
from exactcreep.studies.survival import MOST_SEED, Share, start_of, survival

FEWEST_POINTS = 8
"""Amplitudes of a straight line."""
UNLIKELY = 0.01
"""Probability of a chi2 as large, below which a line is not believed."""
_SIZE = "1e-3"  # of the tensions at the start, unit m g
_REFINED = 4  # bisections for each end of an interval


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
    fit : tuple of float
        The range of the line, in units of Eq. (seuil).
    intercept, error : float
        The amplitude, and its standard error.
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
    """

    chain: Chain
    amplitudes: NDArray[np.float64]
    velocities: NDArray[np.float64]
    errors: NDArray[np.float64]
    cycles: int
    seed: int
    fit: tuple[float, float]
    intercept: float
    error: float
    systematic: float
    slope: float
    slope_error: float
    chi2: float
    chi2_probability: float
    law_seuil: float
    law_slope: float
    reason: str = ""

    @property
    def evidence(self) -> Evidence:
        """Measured with float64: `COMPUTED`; `UNDECIDED` where v(A) is no straight line."""
        return Evidence.UNDECIDED if self.reason else Evidence.COMPUTED

    def summary(self) -> dict[str, Any]:
        """Return everything by names, ready for JSON."""
        names = (
            "intercept", "error", "systematic", "slope", "slope_error", "chi2",
            "chi2_probability", "law_seuil", "law_slope", "cycles", "seed", "reason",
        )  # fmt: skip
        about = {
            "criterion": "intercept",
            **{name: getattr(self, name) for name in names},
            "fit": list(self.fit),
            "evidence": self.evidence.value,
            "compare": "the intercept with Eq. (seuil), a law for long chains, and no other law",
            "amplitudes": self.amplitudes,
            "velocities": self.velocities,
            "errors": self.errors,
        }
        return plain_data(about)


def intercept(
    chain: Chain,
    *,
    fit: tuple[Any, Any] = ("1.2", "2"),
    points: int = 12,
    cycles: int = 400,
    seed: int = 0,
    max_seconds: Number | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> Intercept:
    """Return the amplitude at which the straight part of v(A) meets zero.

    Parameters
    ----------
    chain : Chain
        Of positive slope, below mu_d.
    fit : pair of numbers
        The range of the line, in units of Eq. (seuil).
    points : int
        Amplitudes, equally spaced over the range: at least 8.
    cycles : int
        Of each of them.
    seed : int
        Below 2**32. Amplitude k, from 1, has the start and the disorder of start k of `survival`.
    max_seconds : number, optional
        Raise `OutOfTime` at the first amplitude after so much wall time: half a line has no
        intercept.
    progress : callable, optional
        Called with a `Progress`.

    Returns
    -------
    Intercept
        With its standard error, the shift over two other ranges, chi2, and the laws beside.

    Raises
    ------
    InputError
        If an argument is out of range, or Eq. (seuil) is not positive.
    OutOfTime
        If the time is over.
    """
    if not isinstance(chain, Chain):
        raise InputError("chain", chain, "must be a Chain")
    if not 0 < chain.tan_alpha < chain.mu_d:
        raise InputError("tan_alpha", chain.tan_alpha, "must lie between 0 and mu_d")
    if chain.n < 2:
        raise InputError("n", chain.n, "must be at least 2: one slider has no spring")
    low, high = _range(fit)
    count = whole_number(points, "points", least=FEWEST_POINTS, most=10_000)
    key = whole_number(seed, "seed", least=0, most=MOST_SEED)
    limits, say = Limits.of(max_seconds=max_seconds), reporter(progress)
    about: dict[str, Any] = {
        name: nearest_float(getattr(chain, name)) for name in ("l0", "mu_d", "tan_alpha")
    }
    law = float(_law("seuil")(n=chain.n, mu_s=nearest_float(chain.mu_s), **about))
    try:
        law_slope = float(_law("vitesse")(n=chain.n, amplitude=1.0, **about))
    except ValueError:  # two plateaus are as near to the slope
        law_slope = math.nan
    amplitudes = law * np.linspace(low, high, count)
    velocities, errors = np.empty(count), np.empty(count)
    for k, amplitude in enumerate(amplitudes.tolist()):
        limits.require()
        start, disorder = start_of(chain, exact_number(_SIZE, "size"), key, k + 1)
        drive = Cycles(amplitude, cycles)
        run = creep(chain, drive, seed=disorder, start=start, record=())
        if run.outcome in (Outcome.RUNAWAY, Outcome.LIMIT):
            raise InputError("fit", high, f"must be lower: {run.reason}")
        velocities[k], errors[k] = run.velocity, run.velocity_error
        say("velocities", k + 1, count, "amplitudes")
    unknown = np.isnan(errors)
    if unknown.sum() > count // 2:
        raise InputError("cycles", cycles, "must be more: velocities have no standard error")
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
    probability = float(stats.chi2.sf(chi2, count - 2)) if scatter.size else math.nan
    reason = ""
    if not scatter.size:
        reason = "every chain has settled: v(A) has steps, and no errors to weigh them by"
    elif probability < UNLIKELY:
        reason = f"chi2 is {chi2:.3g} for {count - 2} degrees of freedom: v(A) is no straight line"
    return Intercept(
        chain, amplitudes, velocities, errors, cycles, key, (low, high),
        intercept=float(at),
        error=float(math.sqrt(turn @ covariance @ turn)) if scatter.size else math.nan,
        systematic=float(max(abs(-b / a - at) for a, b in others)),
        slope=float(line[0]),
        slope_error=float(math.sqrt(covariance[0, 0])) if scatter.size else math.nan,
        chi2=chi2 if scatter.size else math.nan,
        chi2_probability=probability,
        law_seuil=law,
        law_slope=law_slope,
        reason=reason,
    )  # fmt: skip


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


@dataclass(frozen=True, eq=False)
class HalfLife:
    """The amplitude at which half of the starts outlive the horizon.

    Attributes
    ----------
    chain : Chain
    starts, cycles, seed : int
    size : Fraction
        Largest tension of a start, unit m g.
    amplitude : float
        Between the last amplitude tried at which fewer than half live, and the first of more.
    low, high : float
        Amplitudes at which the share that lives is below, and above one half, at 95 %.
    shares : dict of float to Share
        Which part was alive at the horizon, at every amplitude tried.
    """

    chain: Chain
    starts: int
    cycles: int
    seed: int
    size: Fraction
    amplitude: float
    low: float
    high: float
    shares: dict[float, Share]

    @property
    def evidence(self) -> Evidence:
        """Measured with float64."""
        return Evidence.COMPUTED

    def summary(self) -> dict[str, Any]:
        """Return everything by names, ready for JSON."""
        return {
            "criterion": "survival",
            "amplitude": self.amplitude,
            "low": self.low,
            "high": self.high,
            "starts": self.starts,
            "cycles": self.cycles,
            "seed": self.seed,
            "size": nearest_float(self.size),
            "evidence": self.evidence.value,
            "compare": "no law: this amplitude grows with the horizon",
            "shares": [
                {"amplitude": amplitude, **share._asdict()}
                for amplitude, share in sorted(self.shares.items())
            ],
        }


def half_life(
    chain: Chain,
    low: Any,
    high: Any,
    *,
    starts: int = 40,
    size: Any = _SIZE,
    cycles: int = 4000,
    seed: int = 0,
    accuracy: Any = "1e-3",
    workers: int | None = None,
    max_seconds: Number | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> HalfLife:
    """Return the amplitude at which half of the starts are not dead after `cycles` cycles.

    Parameters
    ----------
    chain : Chain
        Without disorder.
    low, high : number
        Amplitudes: at the first fewer than half live, at the second more, both at 95 %.
    starts, size, cycles, seed, workers
        As of `survival`.
    accuracy : number
        Relative width at which bisection ends.
    max_seconds : number, optional
        Raise `OutOfTime` at the first amplitude after so much wall time.
    progress : callable, optional
        Called with a `Progress`.

    Returns
    -------
    HalfLife
        The amplitude and its interval; where the share crosses one half more than once, one of the
        crossings.

    Raises
    ------
    InputError
        If an argument is out of range, or the shares at `low` and `high` do not straddle one half.
    OutOfTime
        If the time is over.
    """
    if chain.sigma_mu != 0:
        raise InputError("sigma_mu", chain.sigma_mu, "must be 0: with disorder only rest is death")
    begin, end = exact_number(low, "from"), exact_number(high, "to")
    if not 0 < begin < end:
        raise InputError("from", low, f"must lie between 0 and to = {nearest_float(end)}")
    width = exact_number(accuracy, "accuracy")
    if not 0 < width < 1:
        raise InputError("accuracy", accuracy, "must lie between 0 and 1")
    limits, say = Limits.of(max_seconds=max_seconds), reporter(progress)
    shares: dict[Fraction, Share] = {}
    most = 2 + 2 * _REFINED + math.ceil(math.log2((end - begin) / (width * end)) + 1)

    def alive(amplitude: Fraction) -> Share:
        limits.require()
        found = survival(
            chain, amplitude, starts=starts, size=size, cycles=cycles, seed=seed, workers=workers
        )
        shares[amplitude] = found.alive
        say("amplitudes", len(shares), max(most, len(shares)), "amplitudes")
        return found.alive

    for amplitude, named in ((begin, "from"), (end, "to")):
        share = alive(amplitude)
        if not (share.high < 0.5 if named == "from" else share.low > 0.5):
            told = "fewer" if named == "from" else "more"
            allowed = f"must be an amplitude at which clearly {told} than half live"
            raise InputError(named, nearest_float(amplitude), f"{allowed}, not {share.share:.3g}")
    below, above = begin, end
    while above - below > width * above:
        middle = (below + above) / 2
        if alive(middle).share < 0.5:
            below = middle
        else:
            above = middle
    fewer = _end(shares, alive, below, width, lambda share: share.high < 0.5)
    more = _end(shares, alive, above, width, lambda share: share.low > 0.5)
    return HalfLife(
        chain, starts, cycles, seed, exact_number(size, "size"),
        nearest_float((below + above) / 2), nearest_float(fewer), nearest_float(more),
        {nearest_float(amplitude): share for amplitude, share in shares.items()},
    )  # fmt: skip


def _end(
    shares: dict[Fraction, Share],
    alive: Callable[[Fraction], Share],
    inner: Fraction,
    width: Fraction,
    sure: Callable[[Share], bool],
) -> Fraction:
    """Return the amplitude next to `inner` at which it is sure on which side of 1/2 the share is.

    Bisected a few times, between `inner` and the nearest such amplitude that was tried.
    """
    outer = min((a for a, share in shares.items() if sure(share)), key=lambda a: abs(a - inner))
    for _ in range(_REFINED):
        if abs(outer - inner) <= width * inner:
            break
        middle = (outer + inner) / 2
        if sure(alive(middle)):
            outer = middle
        else:
            inner = middle
    return outer
