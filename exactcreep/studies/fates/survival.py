"""Measure how long creep lasts: many starts of one chain, and when each of them is arrested.

Nearly identical starts creep for very different times: some are arrested (locked or at rest) within
a few cycles, the others at a constant rate, as in transient chaos (Lai and Tél). The lifetime of a
start is the last cycle in which x_G advanced. A start not arrested at the horizon is censored.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property, partial
from importlib import import_module
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np
import scipy  # its parts are loaded where they are used
from numpy.typing import NDArray

from exactcreep import solvers
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles
from exactcreep.model.numbers import Number, exact_number, in_full, plain_data, whole_number
from exactcreep.model.outcome import Evidence, Outcome, direction_of
from exactcreep.model.result import Result
from exactcreep.model.state import State
from exactcreep.quasistatic.creep import interruptible
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.solvers.tables import Column, Schema
from exactcreep.studies.fates.escape import CONFIDENCE, Rate, escape_rate
from exactcreep.studies.fates.fate import numerical_fate
from exactcreep.studies.pool import in_parallel
from exactcreep.studies.sense import SURVIVAL, require_sense
from exactcreep.watch.display import shows_progress
from exactcreep.watch.limits import Limits, Stop
from exactcreep.watch.progress import Hearer, reporter

if TYPE_CHECKING:
    import xarray as xr

MOST_SEED = 2**32 - 1
SIZE = "1e-3"
"""Size of the tensions of starts, unit m g."""
_WORDS = {"at_rest": "at rest", "creeping": "still creeping", "runaway": "running away"}
_word, _whole, _flag = (partial(Column, kind, "") for kind in ("str", "int64", "bool"))


class Share(NamedTuple):
    """A number of starts, its fraction of all, and an interval of 95 % (Clopper and Pearson)."""

    starts: int
    share: float
    low: float
    high: float


class Curve(NamedTuple):
    """The Kaplan-Meier estimate of the fraction that survives; interval nan without variance."""

    cycles: NDArray[np.float64]
    moving: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]


class Life(NamedTuple):
    """The result of one start."""

    start: Annotated[int, _whole("number of the start, from 1")]
    outcome: Annotated[str, _word("what the start came to")]
    evidence: Annotated[str, _word("how well that is known")]
    cycles: Annotated[int, _whole("cycles followed")]
    advanced_until: Annotated[int, _whole("last cycle in which x_G advanced, 0: none")]
    furthest: Annotated[int, _whole("last cycle that took x_G further than ever, down or up")]
    settled_after: Annotated[int, _whole("cycles after which it is periodic, -1: not settled")]
    period: Annotated[int, _whole("cycles, 0: not settled")]
    dormant_after: Annotated[
        int, _whole("cycles after which no inner slider slipped for long, -1: never")
    ]
    marginal: Annotated[
        bool, _flag("whether it is locked in the limit: tensions approach a cycle like 1/k")
    ]
    dormant: Annotated[bool, _flag("whether it is dormant at the end, with disorder")]
    over: Annotated[bool, _flag("whether the limit of time ended it")]
    direction: Annotated[
        str, _word("which way it creeps; not settled: which way it went further than ever")
    ] = "none"


_LIVES = Schema("start", Life)


@dataclass(frozen=True, eq=False, repr=False)
class Survival(Result):
    """How long creep, down or up the incline, lasted from many starts.

    Attributes
    ----------
    chain, amplitude, size, starts, cycles, seed, dormant
        The arguments.
    lives : tuple of Life
        Results of the starts in order: all `starts`, unless a limit ended the computation.
    reason : str
        The limit that ended the computation and censored the running starts; or "".

    Examples
    --------
    >>> chain = Chain(3, 1000, "0.5", "0.6", tan_alpha="0.25")
    >>> survival(chain, "0.0004", starts=8, cycles=50).lifetimes
    array([2, 2, 2, 2, 2, 2, 2, 2])
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

    @cached_property
    def _columns(self) -> dict[str, NDArray[Any]]:
        return _LIVES.from_rows(self.lives)

    def _came_to(self, *outcomes: Outcome) -> NDArray[np.bool_]:
        return np.isin(self._columns["outcome"], [outcome.value for outcome in outcomes])

    @cached_property
    def arrested(self) -> NDArray[np.bool_]:
        """Which starts are arrested: at rest, or locked (if only in the limit); shape (starts,)."""
        return self._came_to(Outcome.AT_REST, Outcome.CYCLING)

    @cached_property
    def durations(self) -> NDArray[np.int64]:
        """Cycles up to the last advance of an arrested start, else observed cycles; (starts,)."""
        seen = np.where(self._came_to(Outcome.CREEPING), self.cycles, self._columns["cycles"])
        return np.where(self.arrested, self._columns["advanced_until"], seen).astype(np.int64)

    @property
    def lifetimes(self) -> NDArray[np.int64]:
        """Last cycle with an advance of each arrested start, shape (arrested,)."""
        return self.durations[self.arrested]

    @property
    def censored(self) -> NDArray[np.int64]:
        """Observed cycles of each start that is not arrested, shape (others,)."""
        return self.durations[~self.arrested]

    @cached_property
    def rate(self) -> Rate:
        """Arrests per cycle after the early phase, a `Rate` with an interval; or its `reason`.

        Source: Lai and Tél, Transient Chaos (2011).
        """
        return escape_rate(self.lifetimes, self.censored)

    @cached_property
    def curve(self) -> Curve:
        """The fraction of starts that survive each number of cycles, by Kaplan and Meier.

        Its interval of 95 % (log-log) holds for many starts; nan where none or all are moving.
        """
        times = scipy.stats.CensoredData(uncensored=self.lifetimes, right=self.censored)
        moving = scipy.stats.ecdf(times).sf
        with warnings.catch_warnings(), np.errstate(divide="ignore", invalid="ignore"):
            warnings.simplefilter("ignore", RuntimeWarning)  # no interval if all or none move
            between = moving.confidence_interval(CONFIDENCE, method="log-log")
        low, high = between.low.probabilities, between.high.probabilities
        return Curve(moving.quantiles.astype(float), moving.probabilities, low, high)

    def _share(self, which: NDArray[np.bool_]) -> Share:
        count, of = int(which.sum()), len(self.lives)
        between = scipy.stats.binomtest(count, of).proportion_ci(CONFIDENCE, method="exact")
        return Share(count, count / of, float(between.low), float(between.high))

    @property
    def moving(self) -> Share:
        """The `Share` of starts that are not arrested at the horizon, advancing or not."""
        return self._share(~self.arrested)

    @property
    def creeping(self) -> Share:
        """The `Share` of starts that creep, either way, or run away at the horizon."""
        return self._share(self._creeping)

    @property
    def directions(self) -> dict[str, Share]:
        """The shares of `creeping` by direction: see `Fate.direction`."""
        ways, creeping = self._columns["direction"], self._creeping
        words = np.unique(ways[creeping]).tolist()
        return {word: self._share(creeping & (ways == word)) for word in words}

    @property
    def _creeping(self) -> NDArray[np.bool_]:
        return self._kinds["creeping"] | self._kinds["runaway"]

    @cached_property
    def _kinds(self) -> dict[str, NDArray[np.bool_]]:
        cycles, unsettled = self._columns["cycles"], self._came_to(Outcome.LIMIT)
        sleeping = unsettled & self._columns["dormant"]
        lately = cycles - np.minimum(self.dormant, cycles // 2)
        advancing = unsettled & ~sleeping & (self._columns["furthest"] > lately)
        kinds = {
            "locked": self._came_to(Outcome.CYCLING),
            "at_rest": self._came_to(Outcome.AT_REST),
            "creeping": self._came_to(Outcome.CREEPING) | advancing,
            "dormant": sleeping,
            "runaway": self._came_to(Outcome.RUNAWAY),
        }
        return kinds | {"unsettled": ~np.any(list(kinds.values()), axis=0)}

    @cached_property
    def fractions(self) -> dict[str, Share]:
        """The share of starts by fate, with intervals of Clopper and Pearson.

        ``locked`` and ``at_rest`` are arrested. ``creeping``: creeps periodically, or has reached a
        new extreme of x_G within the last `dormant` cycles (and the last half). ``dormant``: with
        disorder, no inner slider has slipped for `dormant` cycles. ``runaway``: provably never
        rests. ``unsettled``: all others.
        """
        return {name: self._share(which) for name, which in self._kinds.items()}

    @property
    def evidence(self) -> Evidence:
        """`COMPUTED` of the shares and rates, not of one life; `UNDECIDED` if a start is."""
        return Evidence.of(self._undecided, Evidence.COMPUTED)

    @property
    def _undecided(self) -> int:
        return int((self._columns["evidence"] == Evidence.UNDECIDED.value).sum())

    @property
    def finding(self) -> str:
        """How soon creep ends, with its interval, and the fates of the starts, in words."""
        rate = self.rate
        ends = rate.reason or "no rate yet: no start stopped"
        if self._kinds["runaway"].all():
            ends = "friction holds no start"
        elif rate.rate > 0:
            longest = in_full(1 / rate.low) if rate.low > 0 else "any number"
            between = f"95 %: {in_full(1 / rate.high)} to {longest}"
            ends = f"creep ends once in {in_full(1 / rate.rate)} cycles ({between})"
        counts = {kind: int(which.sum()) for kind, which in self._kinds.items()}
        came = [f"{count} {_WORDS.get(kind, kind)}" for kind, count in counts.items() if count]
        return f"{ends}; starts: {', '.join(came)}"

    def _about(self) -> dict[str, Any]:
        names = ("amplitude", "size", "starts", "cycles", "seed", "dormant")
        return plain_data(self.chain.parameters() | {name: getattr(self, name) for name in names})

    def _numbers(self) -> dict[str, Any]:
        shares = {
            name: {word: share._asdict() for word, share in getattr(self, name).items()}
            for name in ("fractions", "directions")
        }
        return {
            **self._about(),
            "followed": len(self.lives),
            "deaths": self.lifetimes.size,
            "marginal": int(self._columns["marginal"].sum()),
            "cycles_lived": int(self.durations.sum()),
            "rate": self.rate._asdict(),
            "exponential": self.rate.exponential,
            "confidence": CONFIDENCE,
            **shares,
            **{name: getattr(self, name) for name in ("lifetimes", "censored", "evidence")},
            "undecided_starts": self._undecided,
            "reason": self.reason,
        }

    @cached_property
    def dataset(self) -> xr.Dataset:
        """The result of every start along ``start``, and `curve` along ``step``."""
        columns: dict[str, Any] = {
            name: ("start", self._columns[name], column.attributes)
            for name, column in _LIVES.fields.items()
        } | {f"curve_{name}": ("step", steps) for name, steps in self.curve._asdict().items()}
        columns["arrested"] = ("start", self.arrested)
        rate = dict(zip(("rate", "rate_low", "rate_high"), self.rate, strict=False))
        about = self._about() | rate | {"confidence": CONFIDENCE, "reason": self.reason}
        made: xr.Dataset = import_module("xarray").Dataset(columns, attrs=about)
        return made


def start_of(chain: Chain, size: Any, seed: int, number: int) -> tuple[State, int]:
    """Return start `number` (from 1) of a survival, and the seed of its disorder."""
    key = seed * 2**32 + number
    return State.perturbed(chain, size, start_seed=key, seed=key), key


@shows_progress
@interruptible
def survival(
    chain: Chain,
    amplitude: Number,
    *,
    starts: Number = 100,
    size: Number = SIZE,
    cycles: Number = 10_000,
    seed: Number = 0,
    dormant: Number = 500,
    workers: Number | None = None,
    max_seconds: Number | None = None,
    progress: Hearer = None,
) -> Survival:
    """Follow many starts under temperature cycles and return how long each start creeps.

    A start is an initial state: the chain at theta = 0 with small random tensions.

    Parameters
    ----------
    chain : Chain
        With slips (mu_s > mu_d, or disorder), of at most 10 000 sliders.
    amplitude : number
        Amplitude A of the cycles +A, -A.
    starts : int
        Number of starts, at least 1.
    size : number
        Tensions of the starts are uniform in (-size, size), unit m g.
    cycles : int
        Number of cycles to follow each start, the horizon.
    seed : int
        Below 2**32. Start k, from 1, is ``State.perturbed(chain, size, start_seed=key, seed=key)``
        with ``key = 2**32 seed + k``; a chain with disorder has new disorder in every start.
    dormant : int
        A chain with disorder is dormant if no inner slider has slipped for this number of
        cycles.
    workers : int, optional
        Number of threads. Default: one for each processor.
    max_seconds : number, optional
        Wall time after which no further start begins, and the result so far is returned; `reason`
        then says so.
    progress : bool or callable, optional
        A callable is called with a `Progress` about four times a second; else as for `creep`.

    Returns
    -------
    Survival
        The outcome of every start; `rate`, `curve` and `fractions` are its statistics.

    Raises
    ------
    InputError
        If an argument is out of range, or the chain cannot be followed.

    Notes
    -----
    Without disorder a start is arrested when its tensions return without an advance, or when their
    distance from such a cycle falls like 1/k in cycle k (see `Fate.marginal`). With disorder
    tensions never return; a start is then arrested if no slider slips any more. A chain in which
    only the end sliders slip is dormant, and may creep again.

    Guarantee: results do not depend on the number of threads. A chaotic float64 trajectory is not
    the exact solution; its statistics are those of exact solutions.

    Examples
    --------
    >>> chain = Chain(3, 1000, "0.5", "0.6", tan_alpha="0.25")
    >>> survival(chain, "0.0005", starts=8, cycles=50).moving.share
    1.0
    """
    drive = Cycles(amplitude, cycles)
    Experiment(chain, drive, record=())
    require_sense(chain, SURVIVAL, drive.amplitude)
    count = whole_number(starts, "starts", least=1, most=10**9)
    key = whole_number(seed, "seed", least=0, most=MOST_SEED)
    spread = exact_number(size, "size")
    start_of(chain, spread, key, 1)  # raises an error for a bad size
    wait_for = whole_number(dormant, "dormant", least=1)
    limits, say = Limits.of(max_seconds=max_seconds), reporter(progress)
    asked = Survival(chain, drive.amplitude, spread, count, drive.cycles, key, wait_for)
    lives: list[Life] = []

    def tasks() -> Iterator[tuple[int, int]]:
        for number in range(1, count + 1):
            if number > 1 and limits.passed():
                return
            yield number, number

    def followed(number: int, stopped: Callable[[], bool]) -> list[Life]:
        late = number > 1 and limits.passed()
        return [] if late else [_life(asked, number, replace(limits, interrupted=stopped))]

    def so_far() -> str:
        none = f"none of {count} starts has ended so far"
        return replace(asked, lives=tuple(lives)).finding if lives else none

    solvers.SettlingSearch(chain, drive, State.relaxed(chain), say=say)  # compiles
    say("starts", 0, count, "starts")
    with closing(in_parallel(followed, tasks(), workers=workers)) as computed:
        for ended in computed:
            lives.extend(ended[1].result() if ended is not None else ())
            say("starts", len(lives), count, "starts", so_far=so_far)
    if not lives:  # Ctrl-C came before the first start
        raise KeyboardInterrupt
    lives.sort(key=lambda life: life.start)
    over = len(lives) < count or any(life.over for life in lives)
    reason = limits.reason(Stop.DEADLINE) if over else ""
    return replace(asked, lives=tuple(lives), reason=reason)


def _life(asked: Survival, number: int, limits: Limits) -> Life:
    chain = asked.chain
    start, seed = start_of(chain, asked.size, asked.seed, number)
    drive = Cycles(asked.amplitude, asked.cycles)
    search = solvers.SettlingSearch(chain, drive, start, seed, asked.dormant)
    fate, stop = numerical_fate(search, start, limits)
    settled, direction = fate.settled_after, fate.direction
    if fate.outcome is Outcome.LIMIT:
        direction = direction_of(search.heading, chain.tan_alpha)
    return Life(
        number, fate.outcome.value, fate.evidence.value, fate.cycles, fate.advanced_until,
        search.furthest, -1 if settled is None else settled, fate.period or 0, search.dormant_after,
        fate.marginal, chain.sigma_mu != 0 and search.dormant, bool(limits.reason(stop)), direction,
    )  # fmt: skip
