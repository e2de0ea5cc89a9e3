"""Two equal sliders on a level bed age: the mean square of their displacement grows as ln t.

The spring's length ``y = x_2 - x_1 - l0`` follows ``l0 theta`` as a play operator of half-width
mu_d. The slider with the smaller static coefficient slips, and draws a new one. The other, the
anchor, rests until a draw exceeds its own: a new maximum of all draws. So x_G is half the integral
of ``s dy``, where the sign s says which slider moves, and E[s s'] = (S/S')**2 for path lengths
S < S' of y. Derivation: ``derivations/level.py``.
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import scipy  # its parts are loaded where they are used
from numpy.typing import NDArray

from exactcreep.laws.number_types import Number
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles, Drive, GaussianSteps
from exactcreep.model.numbers import InputError, nearest_float, refusing

_FIRST = 10
_SMALLEST = 2
_FAR = 1000.0  # from here on three terms of a series have all digits of float64
_REACH, _ORDER, _RATES = 6.5, 72, 32  # grid of y in units of l0 sigma_theta; decay rates per S


@refusing
def level_displacement(chain: Chain, drive: Drive, t: Number) -> Any:
    """Return the mean square of x_G of two level sliders after t targets, over the disorder.

    The chain starts relaxed. The law has no parameter of the disorder, and holds for sigma_mu > 0.
    With cycles it is, H the sum of 1, 1/3, ..., 1/(2t-1),
    ``(l0 A - mu_d)**2 (2 H/3 - 1/4 - 1/(3 (2t - 1)))``. With Gaussian steps it is
    ``(l0 sigma_theta)**2 (v ln t + C)``; v and C depend on ``mu_d/(l0 sigma_theta)`` only, and the
    terms left out are of the order ``(l0 sigma_theta)**2/t``. Slips of a length 2D that is not
    small beside ``l0 A`` or ``l0 sigma_theta`` change either law by a share of their ratio.

    Parameters
    ----------
    chain : Chain
        Two equal sliders without end forces, tan_alpha = 0 and sigma_mu > 0.
    drive : Cycles or GaussianSteps
        Its size times l0 must be at least 2, and at least mu_s.
    t : int or ndarray of int
        Numbers of targets, from 10 on; they may exceed those of the drive.

    Returns
    -------
    float or ndarray
        Mean square displacement, unit ``(g tau_dyn**2)**2``.

    Raises
    ------
    InputError
        If the chain, the drive or t is outside the range of the law.

    See Also
    --------
    level_increment : the mean square between two targets.

    Notes
    -----
    Source: beyond the paper, which says that such a chain ages; ``derivations/level.py``.

    Examples
    --------
    >>> chain = Chain(2, 1000, "0.5", "0.6", "0.01", tan_alpha=0)
    >>> round(level_displacement(chain, Cycles("0.005", 100), 200), 4)
    43.9379
    """
    size, friction = _in_range(chain, drive)
    targets = _counted(t, "t", _FIRST)
    if isinstance(drive, Cycles):
        return _plain((size - friction) ** 2 * _cycled(targets))
    rate, constant = growth(friction / size)
    return _plain(size**2 * (rate * np.log(targets) + constant))


@refusing
def level_increment(chain: Chain, drive: Drive, t: Number, tau: Number) -> Any:
    """Return the mean square of the displacement of two level sliders from target t to t + tau.

    As in `level_displacement`. With cycles the law is exact for every t and tau; for large t it
    is ``(l0 A - mu_d)**2 (ln(1 + tau/t)/3 + (1 -+ (t/(t + tau))**2)/2)``, minus for even tau. With
    Gaussian steps it is ``(l0 sigma_theta)**2 (v ln(1 + tau/t) + (r(0) - r(tau))/2)`` up to terms
    of the order ``(l0 sigma_theta)**2/t``; r is the covariance of y in units of
    ``(l0 sigma_theta)**2``, which vanishes after a few targets.

    Parameters
    ----------
    chain, drive
        As for `level_displacement`.
    t : int or ndarray of int
        The age: targets before the increment, from 10 on.
    tau : int or ndarray of int
        Targets of the increment, from 1 on.

    Returns
    -------
    float or ndarray
        Mean square displacement, unit ``(g tau_dyn**2)**2``.

    Raises
    ------
    InputError
        If the chain, the drive, t or tau is outside the range of the law.

    See Also
    --------
    level_displacement : the mean square since the start.

    Notes
    -----
    Source: beyond the paper, ``derivations/level.py``.

    Examples
    --------
    >>> chain = Chain(2, 1000, "0.5", "0.6", "0.01", tan_alpha=0)
    >>> old = [level_increment(chain, Cycles("0.005", 100), 10**4, tau) for tau in (1000, 1001)]
    >>> [round(square, 3) for square in old]
    [2.401, 19.135]
    """
    size, friction = _in_range(chain, drive)
    begin, span = _counted(t, "t", _FIRST), _counted(tau, "tau", 1)
    if isinstance(drive, Cycles):
        apart = _cycled(begin + span) - _cycled(begin)
        back = ((2 * begin - 1) ** 2 - 2 / 3) * _turned(2 * begin - 1, span)
        return _plain((size - friction) ** 2 * (apart - back / 2))
    h = friction / size
    kept = np.vectorize(lambda count: covariance(h, count), otypes=[float])(span)
    aged = growth(h)[0] * np.log1p(span / begin)
    return _plain(size**2 * (aged + (covariance(h, 0) - kept) / 2))


def _in_range(chain: Chain, drive: Drive) -> tuple[float, float]:
    """Return the size of the drive times l0, and mu_d; or raise `InputError`."""
    law = "for the law of a level pair"
    if chain.n != 2:
        raise InputError("n", chain.n, f"must be 2 {law}")
    if chain.unlike or chain.tan_alpha or not chain.sigma_mu:
        alike = f"must have equal sliders, sigma_mu > 0, no slope and no end forces {law}"
        raise InputError("chain", chain, alike)
    if not isinstance(drive, Cycles | GaussianSteps):
        raise InputError("drive", drive, f"must be Cycles or GaussianSteps {law}")
    name = "amplitude" if isinstance(drive, Cycles) else "sigma_theta"
    size, least = getattr(drive, name), max(_SMALLEST, chain.mu_s)
    if chain.l0 * size < least:
        raise InputError(name, size, f"must be at least {float(least / chain.l0):.4g} {law}")
    return nearest_float(chain.l0 * size), nearest_float(chain.mu_d)


def _counted(given: Number, name: str, least: int) -> NDArray[np.float64]:
    counts = np.asarray(given, dtype=float)
    if not (np.isfinite(counts) & (counts >= least) & (counts == np.floor(counts))).all():
        raise InputError(name, given, f"must hold whole numbers from {least} on")
    return counts


def _plain(values: Any) -> Any:
    return values if np.ndim(values) else float(values)


def _cycled(t: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the mean square over (l0 A - mu_d)**2 after t half-cycles."""
    odd = math.log(2) + (scipy.special.digamma(t + 0.5) + np.euler_gamma) / 2
    return np.asarray(2 * odd / 3 - 1 / 4 - 1 / (3 * (2 * t - 1)))


def _turned(p: NDArray[np.float64], tau: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the integral of -dy/S**2 from the path length p on, over tau turned half-cycles.

    It is the sum, i from 1 to tau, of ``(-1)**i (1/(p + 2i - 2) - 1/(p + 2i))``.
    """

    def from_there_on(first: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return 1/first - 2 (1/first - 1/(first + 2) + ...), without loss of digits."""
        late, early = scipy.special.digamma([(first + 2) / 4, first / 4])
        near = 1 / first - (late - early) / 2
        square = first**-2
        far = -square * (1 - 2 * square + 16 * square**2)
        return np.where(first < _FAR, near, far)

    return from_there_on(p) - (1 - 2 * (tau % 2)) * from_there_on(p + 2 * tau)


def _tails(h: float, y: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
    """Return Phi(y - h) and Phi(-y - h), the probabilities that a target moves y down or up."""
    return scipy.special.ndtr(y - h), scipy.special.ndtr(-y - h)


def _density(z: NDArray[np.float64], off: float) -> NDArray[np.float64]:
    return np.asarray(np.exp(-((z - off) ** 2) / 2) / math.sqrt(2 * math.pi))


def covariance(h: float, tau: float) -> float:
    """Return the covariance of y at targets tau apart; K y, the mean after tau, has K' below."""
    y, step = np.linspace(-12, 12, 4801, retstep=True)
    below, above = _tails(h, y)
    rise = (1 - below - above) ** tau  # K': a target leaves y where it is with this probability
    mean = step * (np.cumsum(rise) - (rise + rise.sum()) / 2)
    law = (_density(y, h) * above + _density(y, -h) * below) / (below + above) ** 2
    return float((y * mean * law).sum() * step)


@cache
def growth(h: float) -> tuple[float, float]:
    """Return v and C for a play of half-width h under independent standard normal targets.

    In the path length S, y moves at unit speed and turns round at the rate ``turn``, whatever the
    targets. With the resolvents R at the rate lam per S, of functions of y and of the direction
    that the mirror image keeps (``kept = 1``) or changes (-1), from y = 0,
    ``C = v (1/4 + gamma + ln 2I) + (r(0) - v)/4 + integral over lam of
    v/(1 + lam) + R (y**2 - v - lam**2 R (y R y))``.
    """
    y, step = np.linspace(-12, 12, 4801, retstep=True)
    below, above = _tails(h, y)
    passing = below * above / (below + above)  # how often y passes a place, per target
    rise = float(passing.sum() * step)
    rate = float((y**2 * passing).sum() * step) / rise
    k = np.arange(_ORDER + 1)
    y = _REACH * np.cos(np.pi * k / _ORDER)  # Chebyshev's points, and the derivative there
    ends = np.where((k == 0) | (k == _ORDER), 2.0, 1.0) * (-1.0) ** k
    one = np.eye(_ORDER + 1)
    slope = np.outer(ends, 1 / ends) / (y[:, np.newaxis] - y + one)
    slope -= np.diag(slope.sum(axis=1))
    below, above = _tails(h, y)
    turn = _density(y, -h) * below / (above * (below + above))

    def resolvent(lam: float, kept: int, source: NDArray[np.float64]) -> NDArray[np.float64]:
        matrix = np.diag(lam + turn) - kept * turn[:, np.newaxis] * one[::-1] - slope
        matrix[0] = one[0] - kept * one[-1]  # the last point turns round at once
        return np.linalg.solve(matrix, np.append(0.0, source[1:]))

    total = 0.0
    for x, weight in zip(*np.polynomial.legendre.leggauss(_RATES), strict=True):
        lam, measure = (1 + x) / (1 - x), 2 * weight / (1 - x) ** 2
        later = resolvent(lam, 1, y * resolvent(lam, -1, y))
        early = resolvent(lam, 1, y**2 - rate - lam**2 * later)[_ORDER // 2]
        total += measure * (early + rate / (1 + lam))
    constant = rate * (1 / 4 + np.euler_gamma + math.log(2 * rise)) + total
    return rate, float(constant + (covariance(h, 0) - rate) / 4)
