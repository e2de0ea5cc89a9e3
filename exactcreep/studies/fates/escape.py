"""The rate at which chaotic creep ends, once an early phase of arrests is over.

In transient chaos (Lai and Tél) the starts that survive an early phase are arrested at a constant
rate. The likelihood of two phases gives the late rate and its interval.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import scipy  # its parts are loaded where they are used
from numpy.typing import ArrayLike, NDArray

from exactcreep.model.numbers import InputError

CONFIDENCE = 0.95
"""Coverage of every interval."""
_TAIL = (1 - CONFIDENCE) / 2
_WIDTH = 1.9599639845400545  # half width of a normal interval of 95 %, in standard deviations
_TOLD = 0.8  # a late rate is reported if it differs from 0 by so many standard deviations
_EARLY = 1.92  # least gain of log-likelihood for which an early phase is accepted
_STRAGGLERS = 0.1  # expected number of early starts that survive the cut
_DOUBTED = 0.01  # lifetimes with a smaller probability are not geometric
_FEWEST_ARRESTS = 5  # fewest arrests for a test of their distribution
_EARLY_RATES, _LATE_RATES, _HALVINGS = 24, 60, 10
_LONGEST_HORIZON = 10**9

Floats = NDArray[np.float64]


class Rate(NamedTuple):
    """The escape rate: arrests per cycle of the starts that survive the early phase.

    `low` and `high` are its interval of 95 %. The early phase ends after `cut` cycles, in which
    `before` starts were arrested. `exponential` is the probability of later lifetimes at least as
    far from geometric. Rate and interval are nan, and `reason` says why, if the lifetimes do not
    separate the phases, or if later arrests do not come at a constant rate.
    """

    rate: float
    low: float
    high: float
    cut: int = 0
    before: int = 0
    exponential: float = math.nan
    reason: str = ""


class _Lives(NamedTuple):
    """Different lifetimes in whole cycles; each occurs `number` times."""

    cycles: Floats
    arrested: Floats  # 1 or 0
    number: NDArray[np.int64]

    @classmethod
    def of(cls, ends: Floats, censored: Floats) -> _Lives:
        cycles, arrested = (
            np.append(ends, censored),
            np.repeat([1.0, 0.0], [len(ends), len(censored)]),
        )
        lives = np.stack([cycles, arrested])[:, cycles > 0]
        (cycles, arrested), number = np.unique(lives, axis=1, return_counts=True)
        return cls(cycles, arrested, number)

    def log_probability(self, rates: Floats) -> Floats:
        """Return the log-probability of each lifetime at each rate, shape (rates, lives)."""
        rate = rates[:, None]
        stays = np.log1p(-rate) * (self.cycles - self.arrested)
        return stays + np.log(np.maximum(rate, 1e-300)) * self.arrested


class _Profile(NamedTuple):
    """The largest log-likelihood for each late rate, and the early phase that attains it."""

    late: Floats
    likelihood: Floats
    early: Floats
    share: Floats

    @property
    def best(self) -> int:
        return int(self.likelihood.argmax())

    @property
    def told(self) -> float:
        """Distance of the data from a late phase without arrests, in standard deviations."""
        return math.sqrt(2 * max(self.likelihood.max() - self.likelihood[0], 0.0))

    def at(self, deviations: float) -> float:
        """Return the late rate at a signed distance from the most likely rate."""
        signs = np.sign(np.arange(self.late.size) - self.best)
        fallen = np.maximum(self.likelihood.max() - self.likelihood, 0.0)
        root = np.maximum.accumulate((signs * np.sqrt(2 * fallen))[1:])
        return float(np.exp(np.interp(deviations, root, np.log(self.late[1:]))))


def escape_rate(lifetimes: ArrayLike, censored: ArrayLike = ()) -> Rate:
    """Return the rate at which starts are arrested once an early phase is over.

    `lifetimes`: whole cycles of the arrested starts; `censored`: whole cycles that the others were
    observed to move. Without any arrest the interval begins at 0.

    Each start belongs to one of two phases; the early phase has the higher rate of arrests.
    Lifetimes are geometric, or longer than observed. The interval is a profile likelihood over the
    early phase. An early phase that contains the share s of all starts has the prior 1 - s;
    otherwise a few survivors could always be a late phase. There is no rate if the early phase
    reaches beyond the horizon, or if a late phase without arrests is within 0.8 standard deviations
    or within the interval. The lower end is corrected for this condition, as for a normal estimate.

    Guarantee: none; `notebooks/explanation/fates.md` has the coverage on mixtures of two phases.
    """
    ends, others = _whole("lifetimes", lifetimes), _whole("censored", censored)
    lives = _Lives.of(ends, others)
    lived, arrests = (float(lives.number @ each) for each in lives[:2])
    if lived == arrests:  # no start lived longer than one cycle
        if not ends.size:
            return _refused("no rate yet: no start was followed for a cycle; try --cycles 1000")
        by = f"all {ends.size} starts stopped by cycle {ends.max(initial=0):.0f}"
        return _refused(f"no rate: {by}; try a larger --amplitude")
    if not arrests:
        return Rate(0.0, 0.0, -math.expm1(math.log(_TAIL) / lived))
    profile = _profile(lives, arrests / lived)
    best = profile.best
    (alone,) = lives.log_probability(np.array([arrests / lived])) @ lives.number
    cut = 0
    if profile.likelihood[best] - alone > _EARLY:
        of_early = max(profile.share[best] * lives.number.sum() / _STRAGGLERS, 1.0)
        cut = math.ceil(math.log(of_early) / -math.log1p(-profile.early[best]))
    before = int((ends <= cut).sum())
    likely = _geometric(ends[ends > cut] - cut, others[others > cut] - cut)
    if likely < _DOUBTED:
        why = f"after cycle {cut} starts do not stop at a constant rate (p = {likely:.1g})"
        return _refused(f"no rate: {why}; --plot draws how many still move", cut, before, likely)
    below = _deviations_below(profile.told)
    longest = int(lives.cycles.max())
    too_short = cut >= longest
    if too_short or not below < profile.told:
        late = max(profile.late[best], 1 / lived)
        needed = max(2 * longest, 2 / late, 20 / profile.early[best] if cut else 0)
        told = f"{ends.size} of {ends.size + others.size} starts stopped"
        helps = f"--cycles {_rounded_up(needed)}"
        if not others.size:  # a longer horizon would show the same
            helps = f"--starts {4 * ends.size}"
        return _refused(f"no rate yet: {told}; try {helps}", cut, before, likely)
    return Rate(
        float(profile.late[best]), profile.at(-below), profile.at(_WIDTH), cut, before, likely
    )


def _whole(name: str, cycles: ArrayLike) -> Floats:
    found = np.sort(np.asarray(cycles, dtype=np.float64).ravel())
    wrong = found[~((found >= 0) & (found == np.floor(found)))]
    if wrong.size:
        raise InputError(name, float(wrong[0]), "must be whole numbers of cycles, none negative")
    return found


def _refused(reason: str, cut: int = 0, before: int = 0, likely: float = math.nan) -> Rate:
    return Rate(math.nan, math.nan, math.nan, cut, before, likely, reason)


def _profile(lives: _Lives, mean: float) -> _Profile:
    first = np.quantile(lives.cycles[lives.arrested > 0], 0.02)
    late = np.append(0.0, np.geomspace(mean / 200, min(2.5 * mean, 0.98), _LATE_RATES))
    early = np.geomspace(min(mean, 0.9), min(max(1 / first, 1.5 * mean), 0.97), _EARLY_RATES)
    of_early, of_late = lives.log_probability(early), lives.log_probability(late)
    found = np.empty((3, late.size))
    for k, rate in enumerate(late):
        # the late rate itself as the early one: without an early phase
        faster = np.append(rate, early[early >= rate])
        both = np.vstack([of_late[k], of_early[early >= rate]])
        largest = np.maximum(both, of_late[k])
        base = np.exp(of_late[k] - largest)
        more = np.exp(both - largest) - base
        low, high = np.zeros(len(more)), np.full(len(more), 0.999)
        for _ in range(_HALVINGS):
            share = (low + high) / 2
            rises = (more / (base + share[:, None] * more)) @ lives.number > 1 / (1 - share)
            low, high = np.where(rises, share, low), np.where(rises, high, share)
        likely = (np.log(base + low[:, None] * more) + largest) @ lives.number + np.log1p(-low)
        best = likely.argmax()
        found[:, k] = likely[best], faster[best], low[best]
    return _Profile(late, *found)


def _deviations_below(told: float) -> float:
    """Return how many standard deviations below the estimate the interval begins."""

    def beyond(true: float) -> float:
        return float(scipy.stats.norm.logsf(told - true) - scipy.stats.norm.logsf(_TOLD - true))

    if told <= _TOLD or beyond(0.0) >= math.log(_TAIL):
        return math.inf
    root = scipy.optimize.brentq(lambda true: beyond(true) - math.log(_TAIL), 0.0, told)
    return told - float(root)


def _geometric(ends: Floats, others: Floats) -> float:
    """Return the probability of lifetimes at least as far from geometric, nan if there are few.

    At a constant rate arrests are uniform over the total of all cycles lived (test of Kolmogorov
    and Smirnov). Comparing at whole cycles makes the test conservative.
    """
    number = ends.size - (not others.size)  # if all are arrested, the last arrest ends the total
    if number < _FEWEST_ARRESTS:
        return math.nan
    every = np.sort(np.concatenate([ends, others]))
    cycles = np.unique(ends)
    over = np.searchsorted(every, cycles, side="right")
    lived = np.append(0.0, np.cumsum(every))[over] + cycles * (every.size - over)
    arrested = np.minimum(np.searchsorted(ends, cycles, side="right"), number) / number
    away = float(abs(arrested - lived / every.sum()).max())
    return float(scipy.stats.kstwo.sf(away, number))


def _rounded_up(cycles: float) -> int:
    unit = 10 ** max(math.floor(math.log10(cycles)) - 1, 0)
    return int(min(math.ceil(cycles / unit) * unit, _LONGEST_HORIZON))
