"""Where trajectories part, over many seeds: Verlet at several time steps beside the certified one.

Every seed is a run of its own: the certified solver follows it for so many events, and so does
every contestant, with the same disorder. Of each the first event that differs is noted, and how far
off sliders rest until then. Mean velocities are compared over as many half-cycles of the whole
drive, seed by seed. What is said of many seeds has an interval of 95 %.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from exactcreep.limits import Limits
from exactcreep.model.disorder import valid_seed
from exactcreep.model.numbers import (
    InputError,
    exact_number,
    nearest_float,
    plain_data,
    whole_number,
)
from exactcreep.model.outcome import Evidence
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.studies.contest import (
    STATISTICS_EVENTS,
    Contestant,
    Standard,
    mean_velocity,
    positions,
)

FEWEST_SEEDS = 2
DEFAULT_SEEDS = 8
DEFAULT_STEPS = ("0.1", "0.03", "0.01")
_LEVEL = 0.95


class Interval(NamedTuple):
    """A number and its interval of 95 %; nan where it is not known."""

    value: float
    lower: float
    upper: float


UNKNOWN = Interval(math.nan, math.nan, math.nan)


def interval_of_mean(values: Sequence[float] | NDArray[np.float64]) -> Interval:
    """Return the mean of independent numbers, with Student's interval of 95 %."""
    known = np.asarray(values, dtype=float)
    if known.size < 2 or not np.isfinite(known).all():
        return UNKNOWN
    mean = float(known.mean())
    half = float(stats.t.ppf((1 + _LEVEL) / 2, known.size - 1) * stats.sem(known))
    return Interval(mean, mean - half, mean + half)


class Followed(NamedTuple):
    """How far one contestant followed one seed.

    Attributes
    ----------
    agreed, differs : int, bool
        Events before the first that differs, or all that were compared; whether one does.
    errors : ndarray, shape (rests,)
        Position errors at the rests before it, unit ``g tau_dyn**2``.
    velocity, exact : float
        Mean velocity of the contestant and of `exact`, over the same half-cycles.
    """

    seed: int
    agreed: int
    differs: bool
    errors: NDArray[np.float64]
    velocity: float
    exact: float


@dataclass(frozen=True, eq=False)
class Parting:
    """How one contestant parts from the certified solver, over many seeds: a course for each."""

    contestant: Contestant
    courses: tuple[Followed, ...]

    @property
    def dt(self) -> float:
        """The time step, unit tau_dyn; nan of a contestant without one."""
        dt = self.contestant.options.get("dt")
        return math.nan if dt is None else nearest_float(exact_number(dt, "dt"))

    @property
    def located(self) -> bool:
        """Whether events are found inside a step."""
        return bool(self.contestant.options.get("locate"))

    @property
    def parted(self) -> int:
        """Seeds in which an event differs."""
        return sum(one.differs for one in self.courses)

    @cached_property
    def agreed(self) -> Interval:
        """Events before the first that differs: quartiles over the seeds, the median first.

        Infinite where so many seeds did not part within the events that were compared.
        """
        lives = np.sort([one.agreed if one.differs else math.inf for one in self.courses])
        place = [max(math.ceil(share * lives.size) - 1, 0) for share in (0.5, 0.25, 0.75)]
        return Interval(*lives[place].tolist())

    @cached_property
    def rate(self) -> Interval:
        """Wrong turns per event: seeds that parted over all events that agree.

        With the interval of a Poisson count, as if every event were as likely to be the first.
        """
        told = sum(one.agreed for one in self.courses)
        if not told:
            return UNKNOWN
        low = stats.chi2.ppf((1 - _LEVEL) / 2, 2 * self.parted) / 2 if self.parted else 0.0
        high = stats.chi2.ppf((1 + _LEVEL) / 2, 2 * self.parted + 2) / 2
        return Interval(self.parted / told, float(low) / told, float(high) / told)

    @cached_property
    def error(self) -> Interval:
        """Largest position error before the first wrong event: quartiles over seeds, median first.

        nan where no seed came to a rest.
        """
        largest = [float(one.errors.max()) for one in self.courses if one.errors.size]
        if not largest:
            return UNKNOWN
        return Interval(*np.quantile(largest, (0.5, 0.25, 0.75)).tolist())

    @cached_property
    def bias(self) -> Interval:
        """Relative difference of the mean velocity from that of `exact`, paired by the seed."""
        scale = float(np.mean([one.exact for one in self.courses]))
        if math.isnan(scale) or scale == 0:
            return UNKNOWN
        gaps = np.array([one.velocity - one.exact for one in self.courses])
        return interval_of_mean(gaps / abs(scale))

    def summary(self) -> dict[str, Any]:
        """Return the parting by names, ready for JSON."""
        return plain_data(
            {
                "label": self.contestant.label,
                "solver": self.contestant.solver,
                "options": self.contestant.options,
                "seeds_that_parted": self.parted,
                "events_agreed_median_quartiles": self.agreed,
                "wrong_turns_per_event": self.rate,
                "position_error_before_median_quartiles": self.error,
                "velocity_bias_relative": self.bias,
            }
        )


@dataclass(frozen=True, eq=False)
class Partings:
    """Where contestants part from the certified solver, over many seeds.

    Attributes
    ----------
    experiment : Experiment
        Its own seed plays no part.
    seeds : tuple of int
    digits : int
        Of the certified solver.
    events : int
        Certified events that were compared, in all seeds.
    undecided : int
        Seeds in which the certified solver had to assume a tie.
    half_cycles : int
        Over which velocities were measured: the fewest of any seed.
    contestants : tuple of Parting
        ``exact`` first, then Verlet by its time steps, without and with located events.

    Examples
    --------
    >>> from exactcreep import Chain, Cycles, compare
    >>> chain = Chain(2, 1000, "0.5", "0.6", sigma_mu="0.01", tan_alpha="0.25")
    >>> found = compare(chain, Cycles("0.001", 5), seeds=2, dts=["0.1"], events=20)
    >>> found.seeds, [one.contestant.label for one in found.contestants]
    ((0, 1), ['exact', 'verlet, dt = 0.1', 'verlet, dt = 0.1, located'])
    """

    experiment: Experiment
    seeds: tuple[int, ...]
    digits: int
    events: int
    undecided: int
    half_cycles: int
    contestants: tuple[Parting, ...]

    def family(self, *, locate: bool) -> list[Parting]:
        """Return Verlet's contestants with or without located events, in the order of the steps."""
        return [one for one in self.contestants if one.dt > 0 and one.located is locate]

    def order(self, *, locate: bool) -> Interval:
        """Return the order in dt of Verlet's position errors, fitted seed by seed.

        Neighbouring steps are compared at the rests that both came to before their first wrong
        event: the mean of ``log(error ratio) / log(dt ratio)`` over pairs of steps, weighted by
        the latter squared (a straight line through the medians); then the mean over seeds.
        """
        family = self.family(locate=locate)
        found = []
        for seed in range(len(self.seeds)):
            above = below = 0.0
            for coarse, fine in pairwise(family):
                pair = coarse.courses[seed].errors, fine.courses[seed].errors
                shared = min(one.size for one in pair)
                if not shared:
                    continue
                medians = [float(np.median(one[:shared])) for one in pair]
                step = math.log(coarse.dt / fine.dt)
                if min(medians) > 0:
                    above += math.log(medians[0] / medians[1]) * step
                    below += step * step
            if below:
                found.append(above / below)
        return interval_of_mean(found)

    def summary(self) -> dict[str, Any]:
        """Return everything by names, ready for JSON."""
        return plain_data(
            {
                "n": self.experiment.chain.n,
                "seeds": self.seeds,
                "certified": {
                    "digits": self.digits,
                    "events": self.events,
                    "seeds_undecided": self.undecided,
                },
                "half_cycles": self.half_cycles,
                "orders": {
                    name: self.order(locate=locate)
                    for name, locate in (("verlet", False), ("verlet, located", True))
                },
                "contestants": [one.summary() for one in self.contestants],
            }
        )


def experiments_of(experiment: Experiment, seeds: Any) -> list[Experiment]:
    """Return one experiment for each seed: of so many from the experiment's own, or of those named.

    Raises
    ------
    InputError
        If they are fewer than two or not distinct, or nothing in the experiment depends on them.
    """
    if isinstance(seeds, (int, np.integer)) and not isinstance(seeds, bool):
        count = whole_number(seeds, "seeds", least=FEWEST_SEEDS, most=100_000)
        named = [experiment.seed + k for k in range(count)]
    elif isinstance(seeds, (list, tuple, range)):
        named = list(seeds)
    else:
        raise InputError("seeds", seeds, "must be a whole number or a list of seeds")
    chosen = [valid_seed(seed) for seed in named]
    if len(chosen) < FEWEST_SEEDS or len(set(chosen)) < len(chosen):
        raise InputError("seeds", seeds, "must be two different seeds at least, and none twice")
    if experiment.chain.sigma_mu == 0 and not experiment.drive.random:
        allowed = "must not be given: without disorder and random dilations all runs are the same"
        raise InputError("seeds", seeds, allowed)
    return [replace(experiment, seed=seed) for seed in chosen]


def partings(
    experiment: Experiment,
    *,
    seeds: Any,
    dts: Sequence[Any],
    digits: int,
    events: int,
    say: Callable[[str, float], None],
) -> Partings:
    """Return where Verlet, without and with located events, parts from the certified solver.

    Arguments are those of `compare`; `say` is told what is done, and how much of the whole.

    Raises
    ------
    InputError
        If an argument is out of range, or nothing happens in the experiment.

    Notes
    -----
    Guarantee: as of `compare`, for each seed. Intervals of 95 % over the seeds, which are
    independent: Student's of means, Poisson's of counts. Velocities are those of the whole drive,
    or of its first 200 000 events, but for its first fifth.
    """
    if isinstance(dts, str) or not isinstance(dts, Sequence) or not dts:
        raise InputError("dts", dts, "must be a list of time steps, e.g. 0.1, 0.01")
    sizes = {dt: exact_number(dt, "dt") for dt in dts}
    steps = sorted(sizes, key=sizes.__getitem__, reverse=True)
    if len(set(sizes.values())) < len(dts):
        raise InputError("dts", dts, "must not name a time step twice")
    exact = Contestant("exact")
    field = [exact, *(Contestant("verlet", {"dt": dt}) for dt in steps)]
    field += [Contestant("verlet", {"dt": dt, "locate": True}) for dt in steps]
    for one in (*field, Contestant("certified", {"digits": digits})):
        one.algorithm()
    members = experiments_of(experiment, seeds)
    courses: list[list[Followed]] = [[] for _ in field]
    compared = undecided = 0
    spans = []
    for number, member in enumerate(members):
        say(f"seed {member.seed}", number / len(members))
        truth = Standard(member, digits, events)
        compared += truth.events
        undecided += truth.walk.evidence is Evidence.UNDECIDED
        x_G = positions(exact, member, member.drive.half_cycles, Limits(STATISTICS_EVENTS))
        spans.append(x_G.size)
        velocity = mean_velocity(x_G, member)
        for contestant, kept in zip(field, courses, strict=True):
            found, own = truth.agreement(contestant), velocity
            if contestant is not exact:
                own = mean_velocity(positions(contestant, member, x_G.size), member)
            before = found.errors[: found.compared]
            kept.append(Followed(member.seed, found.agreed, found.differs, before, own, velocity))
    say("done", 1.0)
    return Partings(
        experiment=experiment,
        seeds=tuple(member.seed for member in members),
        digits=digits,
        events=compared,
        undecided=undecided,
        half_cycles=min(spans),
        contestants=tuple(map(Parting, field, map(tuple, courses))),
    )
