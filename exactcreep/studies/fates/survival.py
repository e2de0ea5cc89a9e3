"""How long creep lives: many starts, and what became of each.

Chaotic creep cannot be proved to last; how long it lives can be measured. Starts whose tensions
differ by little live differently long, and where all of them die at last, they do so at a constant
rate, as in transient chaos: lifetimes are exponentially distributed. A start that still creeps when
the horizon is reached is censored: its lifetime is known to exceed the horizon, and no more.
"""

from __future__ import annotations

import time
import warnings
from concurrent.futures import Executor, Future
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy import stats

from exactcreep.display import shows_progress
from exactcreep.limits import Limits, Stop
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles
from exactcreep.model.numbers import (
    Number,
    exact_number,
    nearest_float,
    plain_data,
    whole_number,
)
from exactcreep.model.outcome import Evidence, Outcome
from exactcreep.model.state import State
from exactcreep.progress import Hearer, reporter
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.solvers.exact.recurrence import Recurrence
from exactcreep.studies.fates.numerical import numerical_fate, refuse_sliding
from exactcreep.studies.pool import Signals, pool_of

CONFIDENCE = 0.95
"""Of every interval."""
MOST_SEED = 2**32 - 1
SIZE = "1e-3"
"""Of the tensions of starts, unit m g."""
_STARTS_OF_A_TASK = 4
_FEWEST_DEATHS = 5  # of which a distribution is tested


class Share(NamedTuple):
    """How many of the starts, which part of them, and an exact interval of the probability."""

    starts: int
    share: float
    low: float
    high: float


class Rate(NamedTuple):
    """Deaths per cycle lived, and its exact interval if lifetimes are exponential."""

    rate: float
    low: float
    high: float


class Curve(NamedTuple):
    """The Kaplan-Meier estimate: which part of the starts lives longer than each number of cycles.

    `low` and `high` are nan where the estimate has no variance: at 1 and at 0.
    """

    cycles: NDArray[np.float64]
    alive: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]


class Life(NamedTuple):
    """What became of one start; `_COLUMNS` says what most of it means."""

    outcome: str
    evidence: str
    cycles: int
    last_advance: int
    furthest: int
    settled_after: int
    period: int
    dormant_after: int
    dormant: bool  # with disorder, at the end
    over: bool  # a limit of the user ended it


_COLUMNS = {
    "outcome": "what the start came to",
    "evidence": "how well that is known",
    "cycles": "cycles followed",
    "last_advance": "last cycle in which x_G advanced, 0: none",
    "furthest": "last cycle that took x_G further down than ever",
    "settled_after": "cycles after which it is periodic, -1: not settled",
    "period": "cycles, 0: not settled",
    "dormant_after": "cycles after which no inner slider slipped for long, -1: never",
}


@dataclass(frozen=True, eq=False)
class Survival:
    """How long creep lived from many starts.

    Attributes
    ----------
    chain : Chain
    amplitude : Fraction
    size : Fraction
        Largest tension of a start, unit m g.
    starts, cycles, seed, dormant : int
        As asked for.
    lives : tuple of Life
        What became of every start, in their order.
    reason : str
        Which limit ended the computation; "" if it was completed. Starts that it cut short are
        censored where it did.

    Examples
    --------
    >>> from exactcreep import Chain, survival
    >>> chain = Chain(3, 1000, "0.5", "0.6", tan_alpha="0.25")
    >>> lived = survival(chain, "0.0004", starts=8, cycles=50)
    >>> lived.lifetimes, lived.evidence.value
    (array([2, 2, 2, 2, 2, 2, 2, 2]), 'computed')
    """

    chain: Chain
    amplitude: Fraction
    size: Fraction
    starts: int
    cycles: int
    seed: int
    dormant: int
    lives: tuple[Life, ...] = ()
    reason: str = ""

    def _column(self, name: str) -> NDArray[Any]:
        return np.array([getattr(life, name) for life in self.lives])

    def _came_to(self, *outcomes: Outcome) -> NDArray[np.bool_]:
        return np.isin(self._column("outcome"), [outcome.value for outcome in outcomes])

    @cached_property
    def dead(self) -> NDArray[np.bool_]:
        """Which starts have come to an end for good: locked or at rest; shape (starts,)."""
        return self._came_to(Outcome.AT_REST, Outcome.CYCLING)

    @property
    def lifetimes(self) -> NDArray[np.int64]:
        """The last cycle with an advance of each start that is dead, shape (deaths,)."""
        return self._column("last_advance")[self.dead].astype(np.int64)

    @property
    def censored(self) -> NDArray[np.int64]:
        """How many cycles each of the others has been known to live.

        Periodic creep goes on for ever, and counts as seen up to the horizon.
        """
        lived = np.where(self._came_to(Outcome.CREEPING), self.cycles, self._column("cycles"))
        return lived[~self.dead].astype(np.int64)

    @property
    def cycles_lived(self) -> int:
        """Of all starts together."""
        return int(self.lifetimes.sum() + self.censored.sum())

    @property
    def rate(self) -> Rate:
        """Deaths per cycle lived, with the exact interval of a constant rate."""
        deaths, lived = self.lifetimes.size, self.cycles_lived
        if lived == 0:
            return Rate(np.inf if deaths else np.nan, 0.0, np.inf)
        tail = (1 - CONFIDENCE) / 2
        low = stats.chi2.ppf(tail, 2 * deaths) if deaths else 0.0
        high = stats.chi2.ppf(1 - tail, 2 * deaths + 2)
        return Rate(deaths / lived, float(low / 2 / lived), float(high / 2 / lived))

    @cached_property
    def curve(self) -> Curve:
        """The Kaplan-Meier estimate, a step after each lifetime and each censoring."""
        times = stats.CensoredData(uncensored=self.lifetimes, right=self.censored)
        alive = stats.ecdf(times).sf
        with warnings.catch_warnings(), np.errstate(divide="ignore", invalid="ignore"):
            warnings.simplefilter("ignore", RuntimeWarning)  # no interval where all live, or none
            between = alive.confidence_interval(CONFIDENCE, method="log-log")
        low, high = between.low.probabilities, between.high.probabilities
        return Curve(alive.quantiles.astype(float), alive.probabilities, low, high)

    @property
    def exponential(self) -> float:
        """Probability of lifetimes at least as far from exponential as these; nan if too few died.

        If the rate is constant, deaths are spread evenly over the cycles that all have lived up to
        each (the total time on test): this is tested by Kolmogorov and Smirnov's statistic.
        """
        ends = np.sort(self.lifetimes)
        every = np.concatenate([self.lifetimes, self.censored])
        tested = np.array([np.minimum(every, end).sum() for end in ends])
        total = self.cycles_lived
        if not self.censored.size:  # the last death ends the test
            tested = tested[:-1]
        if tested.size < _FEWEST_DEATHS or total == 0:
            return float("nan")
        return float(stats.kstest(tested / total, "uniform").pvalue)

    def _share(self, which: NDArray[np.bool_]) -> Share:
        count, of = int(which.sum()), self.starts
        between = stats.binomtest(count, of).proportion_ci(CONFIDENCE, method="exact")
        return Share(count, count / of, float(between.low), float(between.high))

    @property
    def alive(self) -> Share:
        """The starts that are not dead at the horizon."""
        return self._share(~self.dead)

    @property
    def creeping(self) -> Share:
        """The starts that still creep at the horizon, or run away; chaos without advance is not."""
        return self._share(self._kinds["creeping"] | self._kinds["runaway"])

    @cached_property
    def _kinds(self) -> dict[str, NDArray[np.bool_]]:
        """Which starts do what in the end; see `fractions`."""
        cycles, unsettled = self._column("cycles"), self._came_to(Outcome.LIMIT)
        sleeping = unsettled & self._column("dormant")
        lately = cycles - np.minimum(self.dormant, cycles // 2)
        moving = unsettled & ~sleeping & (self._column("furthest") > lately)
        kinds = {
            "locked": self._came_to(Outcome.CYCLING),
            "at_rest": self._came_to(Outcome.AT_REST),
            "creeping": self._came_to(Outcome.CREEPING) | moving,
            "dormant": sleeping,
            "runaway": self._came_to(Outcome.RUNAWAY),
        }
        return kinds | {"undecided": ~np.any(list(kinds.values()), axis=0)}

    @cached_property
    def fractions(self) -> dict[str, Share]:
        """Which part of the starts does what in the end, with intervals of Clopper and Pearson.

        ``locked`` and ``at_rest`` are dead; ``creeping`` are those that creep periodically, or have
        come further down than ever within the last `dormant` cycles (and the last half);
        ``dormant`` those with disorder whose inner sliders have not slipped for so long;
        ``runaway`` those proved never to come to rest; ``undecided`` all others.
        """
        return {name: self._share(which) for name, which in self._kinds.items()}

    @property
    def _undecided(self) -> int:
        return sum(life.evidence == Evidence.UNDECIDED.value for life in self.lives)

    @property
    def evidence(self) -> Evidence:
        """Of float64: undecided if one of the starts is."""
        return Evidence.of(self._undecided, Evidence.COMPUTED)

    def summary(self) -> dict[str, Any]:
        """Return everything but the single starts by names, ready for JSON."""
        return {
            **self._about(),
            "deaths": int(self.lifetimes.size),
            "cycles_lived": self.cycles_lived,
            "rate": self.rate._asdict(),
            "exponential": self.exponential,
            "confidence": CONFIDENCE,
            "fractions": {name: share._asdict() for name, share in self.fractions.items()},
            "lifetimes": self.lifetimes.tolist(),
            "censored": self.censored.tolist(),
            "evidence": self.evidence.value,
            "undecided_starts": self._undecided,
            "reason": self.reason,
        }

    def _about(self) -> dict[str, Any]:
        names = ("amplitude", "size", "starts", "cycles", "seed", "dormant")
        return plain_data(self.chain.parameters() | {name: getattr(self, name) for name in names})

    def dataset(self) -> xr.Dataset:
        """Return what became of every start along ``start``, and the curve along ``step``."""
        columns: dict[str, Any] = {
            name: ("start", self._column(name), {"long_name": text})
            for name, text in _COLUMNS.items()
        } | {f"curve_{name}": ("step", steps) for name, steps in self.curve._asdict().items()}
        columns["dead"] = ("start", self.dead)
        rate = dict(zip(("rate", "rate_low", "rate_high"), self.rate, strict=True))
        about = self._about() | rate | {"confidence": CONFIDENCE, "reason": self.reason}
        return xr.Dataset(columns, {"start": np.arange(1, self.starts + 1)}, about)


class _Task(NamedTuple):
    """Some of the starts, for one processor."""

    asked: Survival
    numbers: range
    until: float | None
    """When it has to end, in seconds since the epoch: clocks of other machines know that."""


def start_of(chain: Chain, size: Any, seed: int, number: int) -> tuple[State, int]:
    """Return start `number` (from 1) of a survival, and the seed of its disorder."""
    key = seed * 2**32 + number
    return State.perturbed(chain, size, start_seed=key, seed=key), key


@shows_progress
def survival(
    chain: Chain,
    amplitude: Number,
    *,
    starts: Number = 100,
    size: Number = SIZE,
    cycles: Number = 10_000,
    seed: Number = 0,
    dormant: Number = 500,
    executor: Executor | None = None,
    workers: Number | None = None,
    max_seconds: Number | None = None,
    progress: Hearer = None,
) -> Survival:
    """Follow many starts under temperature cycles and return how long creep lived in each.

    Parameters
    ----------
    chain : Chain
    amplitude : number
        Of the cycles +A, -A.
    starts : int
    size : number
        Tensions of the starts are uniform in (-size, size), unit m g.
    cycles : int
        The horizon.
    seed : int
        Below 2**32. Start k, from 1, is ``State.perturbed(chain, size, start_seed=key, seed=key)``
        with ``key = 2**32 seed + k``: with disorder every start has its own.
    dormant : int
        With disorder a chain whose inner sliders have not slipped for so many cycles is dormant.
    executor : concurrent.futures.Executor, optional
        Where starts are followed: threads, processes, or a cluster. It is not shut down.
    workers : int, optional
        Without an executor: so many threads; default one for each processor.
    max_seconds : number, optional
        Come back after so much wall time with what is known; `reason` then says so.
    progress : bool or callable, optional
        A callable is called with a `Progress` about four times a second; else as for `creep`.

    Returns
    -------
    Survival
        Lifetimes, the rate of deaths, the Kaplan-Meier curve and the fractions of starts that
        lock, rest or creep, all with intervals of 95 %.

    Raises
    ------
    InputError
        If an argument is out of range, or the chain has no slips (mu_s = mu_d).

    Notes
    -----
    Without disorder a start dies when its tensions return without an advance; its lifetime is the
    last cycle with an advance. With disorder tensions never return, and only rest is death: a chain
    whose ends alone slip is dormant, and may wake up.

    Guarantee: lives do not depend on the executor, nor on the number of threads. They are those of
    float64, evidence `COMPUTED`: not one by one those of the equations, but with their statistics.

    Examples
    --------
    >>> from exactcreep import Chain
    >>> chain = Chain(3, 1000, "0.5", "0.6", tan_alpha="0.25")
    >>> survival(chain, "0.0005", starts=8, cycles=50).alive.share
    1.0
    """
    drive = Cycles(amplitude, cycles)
    Experiment.of(chain, drive, record=())
    refuse_sliding(chain)
    count = whole_number(starts, "starts", least=1, most=10**9)
    key = whole_number(seed, "seed", least=0, most=MOST_SEED)
    spread = exact_number(size, "size")
    start_of(chain, spread, key, 1)  # refuses a size
    wait_for = whole_number(dormant, "dormant", least=1)
    limits = Limits.of(max_seconds=max_seconds)
    until = None
    if max_seconds is not None:
        until = time.time() + nearest_float(exact_number(max_seconds, "max_seconds"))
    asked = Survival(chain, drive.amplitude, spread, count, drive.cycles, key, wait_for)
    numbers, found, say = range(1, count + 1), dict[int, list[Life]](), reporter(progress)

    def take(first: int, future: Future[list[Life]]) -> None:
        found[first] = future.result()

    with pool_of(executor, workers) as pool:
        pool.run(
            lives_of,
            {
                first: _Task(asked, numbers[first - 1 :][:_STARTS_OF_A_TASK], until)
                for first in numbers[::_STARTS_OF_A_TASK]
            },
            take,
            lambda: say("starts", sum(map(len, found.values())), count, "starts"),
        )
    lives = tuple(life for first in sorted(found) for life in found[first])
    over = any(life.over for life in lives)
    return replace(asked, lives=lives, reason=limits.reason(Stop.DEADLINE) if over else "")


def lives_of(task: _Task, signals: Signals | None = None) -> list[Life]:
    """Return the lives of the starts of a task, one after the other."""
    left = None if task.until is None else max(task.until - time.time(), 0.0)
    limits = Limits.of(max_seconds=left)
    if signals is not None:
        limits = replace(limits, interrupted=lambda: signals.stop)
    return [_life(task.asked, number, limits) for number in task.numbers]


def _life(asked: Survival, number: int, limits: Limits) -> Life:
    chain = asked.chain
    start, seed = start_of(chain, asked.size, asked.seed, number)
    course = Recurrence(chain, Cycles(asked.amplitude, asked.cycles), start, seed, asked.dormant)
    found, stop = numerical_fate(course, start, limits)
    return Life(
        found.outcome.value,
        found.evidence.value,
        found.cycles,
        found.last_advance,
        course.furthest,
        -1 if found.settled_after is None else found.settled_after,
        found.period or 0,
        -1 if course.dormant_after is None else course.dormant_after,
        dormant=chain.sigma_mu != 0 and course.dormant_now,
        over=bool(limits.reason(stop)),
    )
