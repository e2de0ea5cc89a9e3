"""The standard error of a mean velocity whose steps are correlated.

*Long rests of two sliders.* At a small slope two sliders take turns. One that has drawn a rare
large coefficient rests until the other, which draws at every stop, comes within ``d = 2
|tan_alpha|`` of it. For a coefficient z standard deviations above the mean this takes
``exp((z - d/sigma)^2 / 2)`` half-cycles, with a probability ``exp(-z^2 / 2)``. So rests longer than
t have the frequency ``exp(-h^2/2 - h sqrt(2 ln t)) / t`` with ``h = d/sigma``, and the length of a
rest has no variance. A run may miss the rests as long as a block that it should contain; then its
error cannot be estimated from the run itself.

*Near a threshold* a chain of any length alternates between creep and rests. Six sliders with
``sigma_mu = 0.01``, at 1.1 times the amplitude ``N m/(2 l0)``, rest for longer than 10 cycles in
one of 8 rests, and for longer than 1000 in one of 250. A run of 100 cycles may contain only creep,
or only a rest, and its blocks scatter little in both cases.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from exactcreep.laws.differing import differing_intercept
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles, Drive
from exactcreep.model.numbers import nearest_float
from exactcreep.model.uniform import EXPANSION

FEWEST_STEPS = 64
"""Fewest cycles (or targets of other drives) for a standard error; fewer do not show its growth."""
_COARSE = (8, 16, 32)  # numbers of blocks
_MOST_GROWTH = {8: 2.937292038455222, 16: 2.336627253950356, 32: 2.0005492338344837}
"""Quantiles of 99 % of Fisher's F with (n - 1, 63) degrees of freedom. They are constants because
loading SciPy's statistics takes as long as a short run."""
_STUDENT = 2.365  # of 95 % with 7 degrees of freedom
_MOST_LONG_RESTS = 0.05  # fraction of the expected ones: .18 spoil a third of the errors, .013 none
_MOST_SKEWNESS = 0.8
_CROSSOVER = 2.0
"""Creep and long rests alternate within so many D/l0 in amplitude of where ``l0 A = N m/2``."""
_FEWEST_SEEDS = 6  # from this number on the scatter of the seeds gives the error
_FEWEST_INSTEAD = 3  # the same, where a run has no error of its own


def standard_error(
    positions: NDArray[np.float64],
    clock: NDArray[np.float64],
    *,
    silent: float = 0.0,
    least: bool = False,
) -> float:
    """Return the standard error of the mean velocity between the first position and the last.

    An interval of 95 % is +-1.96 standard errors. nan for fewer than `FEWEST_STEPS` steps, and if
    the steps are correlated over times that are not short compared with the run.

    `positions`, `clock` (ndarray of float64, shape (steps + 1,)): x_G, and its times; `silent`: the
    result if nothing moved; `least`: return the estimate even if the true error may be larger.

    Source: averages over blocks, H. Flyvbjerg and H. G. Petersen, J. Chem. Phys. 91, 461 (1989).
    The error is the largest estimate from 8, 16 and 32 blocks, times Student's factor for 8 blocks
    (B. Schmeiser, Oper. Res. 30, 556 (1982)). It is unknown if the square of an estimate exceeds
    the square from 64 blocks by more than Fisher's test allows in 99 of 100 cases, since then it
    may still grow. It is also unknown if the skewness of 32 blocks exceeds 0.8, since then rare
    excursions determine the mean (after A. Tafazzoli et al., INFORMS J. Comput. 23, 303 (2011)).
    Neither test applies to bounded noise on a steady advance, whose sums over blocks scatter no
    more than single steps.
    """
    gains, spans = np.diff(positions), np.diff(clock)
    steps = gains.size
    if steps < FEWEST_STEPS:
        return math.nan
    if not gains.any():
        return silent
    # the error of a ratio of two means, since steps of a record last differently long
    excess = gains - spans * (gains.sum() / spans.sum())
    spreads = {blocks: _spread(excess, blocks) for blocks in _COARSE}
    coarse, blocks = max((spread, blocks) for blocks, spread in spreads.items())
    error = _STUDENT / 1.96 * math.sqrt(coarse / steps) / float(spans.mean())
    single = _spread(excess, steps)
    rounding = 2.0**-40 * float(np.abs(gains).max())
    if least or coarse * (steps // blocks) <= max(2 * single, rounding**2):
        return error
    fine = _spread(excess, FEWEST_STEPS)
    grows = any(spreads[blocks] > most * fine for blocks, most in _MOST_GROWTH.items())
    return math.nan if grows or _skewness(excess, 32) > _MOST_SKEWNESS else error


def mean_over_seeds(
    velocities: NDArray[np.float64], errors: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return mean velocities over the last axis, the seeds, and the standard errors of the means.

    Seeds without a velocity (nan) are left out, e.g. those that an interrupted sweep did not reach.
    The errors come from the scatter of six seeds or more, else from the errors of the runs. If one
    of these is unknown, they come from the scatter of three seeds or more, unless it is 0.
    """
    known = ~np.isnan(velocities)
    count = known.sum(axis=-1)
    with np.errstate(invalid="ignore", divide="ignore"):  # a runaway chain has no finite velocity
        mean = velocities.sum(axis=-1, where=known) / count
        own = np.sqrt((errors**2).sum(axis=-1, where=known)) / count
        squares = ((velocities - mean[..., None]) ** 2).sum(axis=-1, where=known)
        scatter = np.sqrt(squares / (count - 1) / count)
        instead = np.isnan(own) & (count >= _FEWEST_INSTEAD) & (scatter > 0)
        return mean, np.where((count >= _FEWEST_SEEDS) | instead, scatter, own)


def ratio_of_sums(
    parts: NDArray[np.float64], wholes: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return ``sum(parts) / sum(wholes)`` over independent blocks, the first axis, and its error.

    The standard error is first order; nan for one block.
    """
    blocks, whole = len(parts), wholes.sum()
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = parts.sum(axis=0) / whole
        squares = ((parts - ratio * wholes) ** 2).sum(axis=0)
        several = blocks / (blocks - 1) if blocks > 1 else math.nan
        return ratio, np.sqrt(several * squares) / whole


def rests_for_long(chain: Chain, targets: int) -> bool:
    """Return whether rests without a finite variance spoil the error of so many targets.

    This is known for two sliders; in longer chains each half averages over its coefficients.
    """
    if chain.n != 2 or chain.sigma_mu == 0 or targets < 2:
        return False
    h = nearest_float(2 * abs(chain.tan_alpha) / chain.sigma_mu)
    longer_than_a_block = 16 * math.exp(-h * h / 2 - h * math.sqrt(2 * math.log(targets)))
    return longer_than_a_block > _MOST_LONG_RESTS


def alternates(chain: Chain, drive: Drive) -> bool:
    """Return whether a chain under cycles is near x = 0, where creep and long rests alternate.

    Measured for 2 to 30 sliders with ``sigma_mu = 0.01``, and for 6 to 100 without disorder: from
    2 D/l0 above the middle of the crossover on, rests take at most a few per cent of the time. If
    sliders differ, the middle is at ``l0 A = h`` of `differing_intercept`, and D is the mean.
    Chains whose springs expand by different weights may alternate: their h is not known.
    """
    if not isinstance(drive, Cycles):
        return False
    if EXPANSION in chain.unlike:
        return True
    borne = differing_intercept(chain.each("mu_d"), chain.tan_alpha, chain.end_forces)
    beyond = nearest_float(chain.l0 * drive.amplitude) - float(borne)
    return abs(beyond) < _CROSSOVER * _mean_excess(chain)


def jump_of(chain: Chain) -> float:
    """Return the advance of x_G, N D/4, up to which a cycle is quiescent; ``g tau_dyn**2``.

    D is the mean if friction differs.
    """
    return chain.n * _mean_excess(chain) / 4


def _mean_excess(chain: Chain) -> float:
    return chain.times_cosine((sum(chain.each("mu_s")) - sum(chain.each("mu_d"))) / chain.n)


def rests_are_short(advances: NDArray[np.float64], jump: float) -> bool:
    """Return whether a series has as many rests as blocks, 32, each shorter than a block.

    Then blocks average over rests. Six sliders whose rests have no finite mean (see above) passed
    this in 3 of 2700 runs of 90 to 3600 cycles.
    """
    quiet = np.concatenate([[False], np.abs(advances) <= jump, [False]])
    ends = np.flatnonzero(np.diff(quiet))
    rests = ends[1::2] - ends[::2]
    blocks = max(_COARSE)
    return bool(rests.size >= blocks and rests.max() < advances.size / blocks)


def _sums(steps: NDArray[np.float64], blocks: int) -> NDArray[np.float64]:
    """Return the sum of each block over the root of its length; blocks differ by a step at most."""
    begins = -(np.arange(0, -blocks - 1, -1) * steps.size // blocks)
    return np.asarray(np.add.reduceat(steps, begins[:-1]) / np.sqrt(np.diff(begins)))


def _spread(steps: NDArray[np.float64], blocks: int) -> float:
    """Return the variance of a step, of mean 0, that independent blocks of steps would have."""
    return float((_sums(steps, blocks) ** 2).sum()) / (blocks - 1)


def _skewness(steps: NDArray[np.float64], blocks: int) -> float:
    sums = _sums(steps, blocks)
    centred = sums - sums.mean()
    power = float((centred**2).mean()) ** 1.5
    return abs(float((centred**3).mean())) / power if power > 0 else 0.0
