"""The measured trade: what time buys which accuracy, on this machine and for this scene.

Every contestant is measured in four ways, against the certified solver where there is one truth:

- *time* per half-cycle: all contestants take turns, round after round, so that whatever else the
  machine does hits them alike; medians over the rounds, ratios within a round;
- *rearrangements*: single ones, from rest states of the scene, against the same one certified: do
  the same sliders start and stop in the same order, and how far off are they in the end;
- *events* from the start of the scene that agree with the certified ones before the first that
  differs;
- *bias* of the mean velocity against the exact solver, on the same drive and with the same
  disorder, with the standard error of the paired difference: over the seeds, which are independent,
  or else along the one run.
"""

from __future__ import annotations

import math
import statistics
import time
import tracemalloc
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import zip_longest
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from exactcreep.limits import Limits
from exactcreep.model.chain import Chain
from exactcreep.model.numbers import InputError, Number, exact_number, nearest_float, plain_data
from exactcreep.model.state import State
from exactcreep.progress import Progress, reporter
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.solvers.statistics import standard_error
from exactcreep.solvers.warm_up import TWO_SLIDERS, warm_up
from exactcreep.studies.contest import (
    Contestant,
    Lap,
    Rest,
    Walk,
    agree,
    mean_velocity,
    positions,
    rests_between,
    settled,
    steady,
    timed,
    walk,
)
from exactcreep.studies.partings import experiments_of, interval_of_mean

TIME_STEPS = ("0.3", "0.1", "0.03", "0.01", "0.003", "0.001")
"""The ladder of Verlet's time steps."""
DIGITS = (15, 30)
"""The digits of the certified solver as a contestant."""
DEFAULT_BUDGET = 60
"""Seconds."""

_ROUNDS = 9  # of timing, if the budget allows: quartiles need a few on either side
_FEWEST_ROUNDS = 3  # a median needs them, whatever the budget
_SAMPLES = 200  # single rearrangements: "wrong" to half a percent
_LONGEST_LOG = 20_000  # certified events, however large the budget: a log that is kept whole
_SIGMAS = 3.0  # standard errors within which a bias counts as none
_SHARES = {"time": 0.35, "rearrangements": 0.25, "events": 0.1, "bias": 0.3}
_COMPILED = ("exact", "sliding", "verlet")  # so fast that whole half-cycles can be timed

TRUTH = Contestant("certified", {"digits": 50})
"""What single rearrangements and events are compared with."""


@dataclass
class Score:
    """What was measured of one contestant; nan where it was not, and `notes` say why.

    Attributes
    ----------
    contestant : Contestant
    seconds, seconds_low, seconds_high : float
        Per half-cycle: median and quartiles over the rounds.
    ratio : float
        Time over that of the exact solver, median of the ratios within a round.
    compared, different : int
        Single rearrangements, and those of them with other events than the certified ones.
    error, error_high : float
        Largest position error at the end of the others, unit ``g tau_dyn**2``: median and maximum.
    agreed, agreed_all : int, bool
        Events from the start that agree with the certified ones; whether none was met that differs.
    bias, bias_error : float
        Mean velocity minus that of the exact solver, with its standard error: 1.96 of it make an
        interval of 95 %; over `bias_half_cycles`, of all seeds.
    memory : int
        Bytes that a simulation takes, at its peak over the first events.
    notes : list of str
    """

    contestant: Contestant
    seconds: float = math.nan
    seconds_low: float = math.nan
    seconds_high: float = math.nan
    ratio: float = math.nan
    compared: int = 0
    different: int = 0
    error: float = math.nan
    error_high: float = math.nan
    agreed: int = 0
    agreed_all: bool = False
    bias: float = math.nan
    bias_error: float = math.nan
    bias_half_cycles: int = 0
    memory: int = 0
    notes: list[str] = field(default_factory=list)

    def take_down(self, times: list[float], exact: Score | None) -> None:
        """Note the median and the quartiles of the times per half-cycle, and their ratio."""
        self.seconds = statistics.median(times)
        self.seconds_low, self.seconds_high = np.quantile(times, (0.25, 0.75)).tolist()
        if exact is not None and exact.seconds > 0:
            self.ratio = self.seconds / exact.seconds

    @property
    def wrong(self) -> float:
        """The fraction of rearrangements with wrong events; nan if none was compared."""
        return self.different / self.compared if self.compared else math.nan

    @property
    def wrong_interval(self) -> tuple[float, float]:
        """The interval of 95 % of `wrong` (Wilson's); nan if none was compared."""
        if not self.compared:
            return math.nan, math.nan
        found = stats.binomtest(self.different, self.compared).proportion_ci(method="wilson")
        return float(found.low), float(found.high)

    @property
    def unbiased(self) -> bool:
        """Whether the bias was measured and is zero within three standard errors."""
        return abs(self.bias) <= _SIGMAS * self.bias_error

    def summary(self) -> dict[str, Any]:
        """Return the score as plain data for JSON; what is not known is None."""
        return plain_data(
            {
                "label": self.contestant.label,
                "solver": self.contestant.solver,
                "options": self.contestant.options,
                "seconds_per_half_cycle": self.seconds,
                "seconds_quartiles": [self.seconds_low, self.seconds_high],
                "time_ratio_to_exact": self.ratio,
                "rearrangements_compared": self.compared,
                "rearrangements_with_other_events": self.different,
                "wrong_interval": self.wrong_interval,
                "position_error_median": self.error,
                "position_error_largest": self.error_high,
                "events_agreed": self.agreed,
                "events_agreed_all": self.agreed_all,
                "velocity_bias": self.bias,
                "velocity_bias_error": self.bias_error,
                "velocity_bias_half_cycles": self.bias_half_cycles,
                "memory_bytes": self.memory or None,
                "notes": self.notes,
            }
        )


@dataclass
class Tradeoff:
    """The measured trade of a scene.

    Attributes
    ----------
    experiment : Experiment
    scores : tuple of Score
    velocity, velocity_error : float
        Of the exact solver, over the longest run that was made for the bias.
    events_compared : int
        Length of the certified list of events from the start of the scene.
    left_out : int
        Rearrangements whose certificate would have taken more than a twentieth of the budget.
    no_truth : int
        Rearrangements whose certified solution gave up, or had to assume a tie.
    seconds : float
        How long the measurement took.
    seeds : tuple of int
        Whose rearrangements and velocities were compared; times and events from the start are those
        of the first.
    """

    experiment: Experiment
    scores: tuple[Score, ...]
    seeds: tuple[int, ...]
    velocity: float = math.nan
    velocity_error: float = math.nan
    events_compared: int = 0
    left_out: int = 0
    no_truth: int = 0
    seconds: float = 0.0

    def score(self, solver: str) -> Score | None:
        """Return the first score of a solver, None if it has none."""
        return next((one for one in self.scores if one.contestant.solver == solver), None)

    @property
    def advice(self) -> str:
        """One sentence: what to take for this scene."""
        exact, sliding = self.score("exact"), self.score("sliding")
        if exact is None or math.isnan(exact.seconds):
            return "Take sliding: this chain has no slips, and the sliding limit is exact."
        if self.events_compared == 0 and not self.velocity:
            return "Take exact, or no run at all: nothing moves here."
        sentence = f"Take exact: {_microseconds(exact.seconds)} per half-cycle"
        steps = [one for one in self.scores if one.contestant.solver == "verlet"]
        steps = [one for one in steps if not math.isnan(one.seconds)]
        for paper in steps:
            if paper.contestant.label == "verlet, dt = 0.01" and paper.compared:
                faster, ratio = paper.ratio >= 1, max(paper.ratio, 1 / paper.ratio)
                sentence += (
                    f", {ratio:.2g} times {'faster' if faster else 'slower'} than Verlet at dt ="
                    f" 0.01, which takes a wrong turn in {100 * paper.wrong:.3g} % of the"
                    " rearrangements"
                )
        if fair := [one for one in steps if one.unbiased]:
            best = min(fair, key=lambda one: one.seconds)
            sentence += (
                f"; for the mean velocity alone Verlet is unbiased within"
                f" {_relative(_SIGMAS * best.bias_error, self.velocity)} up to dt ="
                f" {best.contestant.options['dt']}, at {best.ratio:.2g} times the time of exact"
            )
        if sliding is not None and not math.isnan(sliding.bias_error):
            largest = abs(sliding.bias) + _SIGMAS * sliding.bias_error
            sentence += (
                f"; sliding costs {_microseconds(sliding.seconds)} and is off by at most"
                f" {_relative(largest, self.velocity)}"
            )
        return sentence + "."

    def summary(self) -> dict[str, Any]:
        """Return the trade as plain data for JSON."""
        own = "velocity", "velocity_error", "events_compared", "seeds", "advice", "seconds"
        return plain_data(
            {
                "half_cycles": self.experiment.drive.half_cycles,
                "long_rearrangements_left_out": self.left_out,
                "rearrangements_without_truth": self.no_truth,
                "truth": vars(TRUTH),
                "scores": [one.summary() for one in self.scores],
            }
            | {name: getattr(self, name) for name in own}
        )


def _microseconds(seconds: float) -> str:
    return f"{seconds * 1e6:.3g} us" if seconds < 1e-2 else f"{seconds * 1e3:.3g} ms"


def _relative(value: float, scale: float) -> str:
    return f"{100 * value / abs(scale):.2g} %" if scale else f"{value:.2g}"


def ladder(chain: Chain) -> list[Contestant]:
    """Return the contestants for a chain: without a static excess, the sliding limit alone."""
    if chain.slides:
        return [Contestant("sliding")]
    found = [Contestant("exact"), Contestant("sliding")]
    found += [Contestant("verlet", {"dt": dt}) for dt in TIME_STEPS]
    found += [Contestant("verlet", {"dt": dt, "locate": True}) for dt in TIME_STEPS]
    return found + [Contestant("certified", {"digits": count}) for count in DIGITS]


def tradeoff(
    experiment: Experiment,
    *,
    budget: Number = DEFAULT_BUDGET,
    seeds: int | Sequence[int] | None = None,
    progress: Callable[[Progress], None] | None = None,
    contestants: Sequence[Contestant] | None = None,
) -> Tradeoff:
    """Return the measured trade between time and accuracy for an experiment.

    Parameters
    ----------
    experiment : Experiment
        Its own solver and record play no part.
    budget : number
        About how many seconds to spend, at least 1; compilation comes on top.
    seeds : int or sequence of int, optional
        How many, from the experiment's own on, or which, to take rearrangements and velocities from
        in turn. Default: its own alone.
    progress : callable, optional
        Called with a `Progress`.
    contestants : sequence of Contestant, optional
        Default: `ladder`.

    Raises
    ------
    InputError
        If the budget is too small, or the chain may run away.

    Notes
    -----
    Guarantee: times are medians of paired rounds, on a machine that may be doing other things too;
    errors are against the middles of certified enclosures of 50 digits.
    """
    seconds = nearest_float(exact_number(budget, "budget"))
    if not 1 <= seconds < math.inf:
        raise InputError("budget", budget, "must be at least 1 second")
    chain = experiment.chain
    if chain.may_run_away:
        raise InputError("tan_alpha", chain.tan_alpha, "must be below mu_d in absolute value")
    members = [experiment] if seeds is None else experiments_of(experiment, seeds)
    scores = [Score(one) for one in (ladder(chain) if contestants is None else contestants)]
    found = Tradeoff(experiment, tuple(scores), tuple(member.seed for member in members))
    begin, report = time.perf_counter(), reporter(progress)
    race = _Race(found, members, seconds, lambda text, done: report("measuring", done, text=text))
    race.warm_up()
    race.take_times()
    if not chain.slides:
        race.compare_rearrangements()
        race.compare_events()
        race.measure_bias()
    race.measure_memory()
    race.tell("done", 1.0)
    found.seconds = time.perf_counter() - begin
    return found


class _Race:
    """The measurements, one after the other."""

    def __init__(
        self, found: Tradeoff, members: list[Experiment], budget: float,
        tell: Callable[[str, float], None],
    ) -> None:  # fmt: skip
        self.found, self.experiment, self.scores = found, found.experiment, found.scores
        self.members = members
        self.timed = [one for one in found.scores if one.contestant.solver in _COMPILED]
        self.exact = found.score("exact")
        self.shares = {name: share * budget for name, share in _SHARES.items()}
        self.tell = tell
        self.events_per_half_cycle = 0.0

    def warm_up(self) -> None:
        """Have everything compiled."""
        for count, contestant in enumerate(one.contestant for one in self.scores):
            self.tell(f"compiling: {contestant.label}", 0.05 * count / len(self.scores))
            algorithm = contestant.algorithm()
            lengths = algorithm.compiles(self.experiment.chain.n)
            warm_up(algorithm, lengths)
            if contestant.solver != "sliding":
                warm_up(algorithm, lengths, ("events",))
                algorithm.rearrange(TWO_SLIDERS, State.relaxed(TWO_SLIDERS), 1, 0)

    def take_times(self) -> None:
        """Time in turns all contestants that are compiled."""
        share = self.shares["time"]
        each = share / max(len(self.timed), 1) / (_ROUNDS + 1)
        runners = [_Runner(one.contestant, self.experiment, each) for one in self.timed]
        deadline = time.perf_counter() + share
        for turn in range(_ROUNDS):
            for count, (score, runner) in enumerate(zip(self.timed, runners, strict=True)):
                done = 0.05 + 0.3 * (turn + count / len(runners)) / _ROUNDS
                self.tell(f"timing: {score.contestant.label}", done)
                runner.run()
            if turn + 1 >= _FEWEST_ROUNDS and time.perf_counter() > deadline:
                break
        laps = [runner.laps for runner in runners]
        exact = laps[self.timed.index(self.exact)] if self.exact else []
        cycles = sum(lap.half_cycles for lap in exact)
        self.events_per_half_cycle = sum(lap.events for lap in exact) / cycles if cycles else 0.0
        for score, own in zip(self.timed, laps, strict=True):
            times = [lap.pace for lap in own if lap.half_cycles]
            if not times:
                # less than a half-cycle within the time: by the events that it managed
                pace = self.events_per_half_cycle
                times = [lap.seconds / lap.events * pace for lap in own if lap.events]
                score.notes.append("time extrapolated from a part of a half-cycle")
            if times and times[0] > 0:
                score.take_down(times, self.exact)
            ratios = [a.pace / b.pace for a, b in zip(own, exact, strict=False)]
            if known := [ratio for ratio in ratios if not math.isnan(ratio)]:
                score.ratio = statistics.median(known)

    def compare_rearrangements(self) -> None:
        """Compare single rearrangements, from rest states of the scene, with the truth."""
        share, begin = self.shares["rearrangements"], time.perf_counter()
        chain = self.experiment.chain
        trials = [_Trials(one) for one in self.scores if one.contestant.solver != "sliding"]
        exact, truth = Contestant("exact").algorithm(), TRUTH.algorithm()
        pace_of_truth = 0.0
        for count, (seed, (state, way)) in enumerate(_rests_in_turn(self.members)):
            fraction = max(count / _SAMPLES, (time.perf_counter() - begin) / share)
            if fraction >= 1:
                break
            self.tell(f"rearrangement {count + 1}", 0.35 + 0.25 * fraction)
            length = len(exact.rearrange(chain, state, way, seed).events)
            if length * pace_of_truth > share / 5:
                self.found.left_out += 1
                continue
            clock = time.perf_counter()
            proved = truth.rearrange(chain, state, way, seed)
            if not proved.events:
                continue
            pace_of_truth = max(pace_of_truth, (time.perf_counter() - clock) / len(proved.events))
            if not settled(proved):
                self.found.no_truth += 1
                continue
            known = Walk.of(proved)
            for own in trials:
                if own.seconds <= share / (len(trials) + 1):
                    clock = time.perf_counter()
                    found = own.algorithm.rearrange(chain, state, way, seed)
                    seconds = time.perf_counter() - clock
                    own.seconds += seconds
                    own.paces.append(seconds / max(len(found.events), 1))
                    own.errors.append(agree(Walk.of(found), known).error_before)
        for own in trials:
            score, right = own.score, [error for error in own.errors if not math.isnan(error)]
            score.compared, score.different = len(own.errors), len(own.errors) - len(right)
            if right:
                score.error, score.error_high = statistics.median(right), max(right)
            if own.paces and score not in self.timed:
                score.notes.append("time per event of single rearrangements, times events")
                times = [pace * self.events_per_half_cycle for pace in own.paces]
                score.take_down(times, self.exact)
        for score in self.scores:
            if score.contestant.solver == "sliding":
                score.notes.append("the sliding limit has no rearrangements")

    def compare_events(self) -> None:
        """Compare the events from the start of the scene with the truth."""
        share = self.shares["events"]
        self.tell("certified events", 0.6)
        truth = self._events(TRUTH, _LONGEST_LOG, share / 2)
        self.found.events_compared = enough = len(truth.events)
        for place, score in enumerate(self.scores):
            contestant = score.contestant
            if contestant.solver == "sliding":
                continue
            self.tell(f"events: {contestant.label}", 0.6 + 0.1 * place / len(self.scores))
            allowed = share / (8 if score in self.timed else 4)
            agreement = agree(self._events(contestant, enough, allowed), truth)
            score.agreed, score.agreed_all = agreement.agreed, not agreement.differs

    def _events(self, contestant: Contestant, enough: int, seconds: float) -> Walk:
        """Return a solver's events from the start of the scene, as far as the time allows."""
        return walk(
            contestant, self.experiment, self.experiment.drive.half_cycles, enough=enough,
            limits=Limits(at=time.perf_counter() + seconds), record=("events",),
        )  # fmt: skip

    def measure_bias(self) -> None:
        """Measure the mean velocity of every contestant against that of the exact solver."""
        exact, total = self.exact, self.experiment.drive.half_cycles
        if exact is None or math.isnan(exact.seconds):
            return
        racing = [one for one in self.timed if one is not exact and not math.isnan(one.seconds)]
        each = self.shares["bias"] / (len(racing) + 1) / len(self.members)

        def courses(score: Score, until: list[int]) -> list[NDArray[np.float64]]:
            return [
                positions(score.contestant, member, q, Limits(at=time.perf_counter() + each))
                for member, q in zip(self.members, until, strict=True)
            ]

        references = courses(exact, [total] * len(self.members))
        sizes = [one.size for one in references]
        found = self.found
        found.velocity, found.velocity_error = self._mean_velocity(references)
        exact.bias, exact.bias_error, exact.bias_half_cycles = 0.0, 0.0, sum(sizes)
        for place, score in enumerate(racing):
            self.tell(f"bias: {score.contestant.label}", 0.7 + 0.28 * place / len(racing))
            pairs = zip(courses(score, sizes), references, strict=True)
            gaps = [own - reference[: own.size] for own, reference in pairs]
            score.bias_half_cycles = sum(one.size for one in gaps)
            score.bias, score.bias_error = self._mean_velocity(gaps)
            if math.isnan(score.bias):
                score.notes.append("too slow for a mean velocity within the budget")
            elif math.isnan(score.bias_error):
                score.notes.append("too few half-cycles for the error of the bias: take more seeds")

    def _mean_velocity(self, courses: list[NDArray[np.float64]]) -> tuple[float, float]:
        """Return the mean advance per half-cycle but for the first fifth, and its standard error.

        Over independent seeds, such that 1.96 of it make Student's interval; of one seed along it.
        """
        experiment = self.experiment
        means = [mean_velocity(x_G, experiment) for x_G in courses]
        if len(means) > 1:
            mean, _, upper = interval_of_mean(means)
            return mean, (upper - mean) / 1.96
        (x_G,) = courses
        pace = 2 if experiment.drive.cyclic else 1
        kept = x_G[steady(x_G, experiment) - 1 :: pace]
        return means[0], standard_error(kept, pace * np.arange(kept.size, dtype=float))

    def measure_memory(self) -> None:
        """Measure how much memory a simulation takes."""
        for score in self.scores:
            tracemalloc.start()
            try:
                simulation = score.contestant.simulation(self.experiment)
                simulation.follow(self.experiment.drive, 1, 1, Limits(100))
                score.memory = tracemalloc.get_traced_memory()[1]
            finally:
                tracemalloc.stop()


def _rests_in_turn(members: Sequence[Experiment]) -> Iterator[tuple[int, Rest]]:
    """Yield a rest of each seed in turn, with the seed, until none has any left."""
    for round_of in zip_longest(*map(rests_between, members)):
        for member, rest in zip(members, round_of, strict=True):
            if rest is not None:
                yield member.seed, rest


class _Trials:
    """What single rearrangements have shown of a contestant."""

    def __init__(self, score: Score) -> None:
        self.score, self.algorithm = score, score.contestant.algorithm()
        self.seconds = 0.0
        self.paces: list[float] = []  # seconds per event
        self.errors: list[float] = []  # nan where other events happened


class _Runner:
    """A contestant's own run along the drive, timed block by block."""

    def __init__(self, contestant: Contestant, experiment: Experiment, seconds: float) -> None:
        self.simulation = contestant.simulation(experiment)
        self.fresh = self.simulation.capture()
        self.drive = experiment.drive
        self.longest = max(self.drive.half_cycles // 2 * 2, 1)  # a block has whole cycles
        self.seconds = seconds
        self.laps: list[Lap] = []
        self.done = self.block = 0

    def run(self) -> None:
        """Time the next block of half-cycles, or as much of it as the time allows."""
        if self.block == 0:  # the first half-cycles leave the transient, and set the block's size
            wanted = 2
            lap = self._lap(wanted, self.seconds)
            while wanted == lap.half_cycles < self.longest and lap.seconds <= self.seconds / 4:
                wanted = min(2 * wanted, self.longest)
                lap = self._lap(wanted, self.seconds)
            pace = lap.seconds / max(lap.half_cycles, 1)
            self.block = max(2, min(int(self.seconds / pace), self.longest) // 2 * 2)
        self.laps.append(self._lap(self.block, 4 * self.seconds))

    def _lap(self, wanted: int, seconds: float) -> Lap:
        wanted = min(wanted, self.longest)
        if self.done + wanted > self.drive.half_cycles:
            self.simulation.restore(self.fresh)
            self.done = 0
        limits = Limits(at=time.perf_counter() + seconds)
        lap = timed(self.simulation, self.drive, self.done + wanted, limits, self.done)
        self.done += lap.half_cycles
        return lap
