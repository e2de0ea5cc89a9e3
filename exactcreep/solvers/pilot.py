"""Pilots: exact beside sliding, or beside a twin: runs that represent a drive at a small price."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import special

from exactcreep.laws import at_rest_amplitude
from exactcreep.limits import NO_LIMITS, Limits, OutOfTime, Stop
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles, Drive, GaussianSteps, Listed
from exactcreep.model.numbers import nearest_float
from exactcreep.model.outcome import Evidence
from exactcreep.model.state import State
from exactcreep.solvers.exact.rest import rational
from exactcreep.solvers.exact.solver import Exact
from exactcreep.solvers.sliding import Sliding
from exactcreep.solvers.solver import Simulation, advance
from exactcreep.solvers.statistics import rests_for_long, standard_error

_PILOT_NANOSECONDS = 1e8  # of the exact solver, by the count of its events
_PILOT_TARGETS = 200_000, 1_000_000  # where there are few events: at least, if need be, and at most
_COURSES = 8, 64  # along a cheap path: at least, and at most, if its mean asks for more
_OFF = 2.0**-46  # of starts that are some roundings apart, beside the largest coefficient
_WINDOWS = 16  # of a long path, besides its extremes
_SURVEY_TARGETS = 100_000  # of the sliding limit
_SIGMAS = 3.0  # standard errors that a bias may be off: a pilot looks several times
_HIGHEST = 6  # standard deviations of coefficients that are expected; 1e-9 are beyond
_LOCKED = 1.5  # without disorder, chains of up to 30 were locked at 1.36 N (m + D) / (2 l0)
_LONGEST_PERIOD = 64  # cycles
_NEAR = 2.0**-40  # how nearly advances repeat, relative to x_G
ROUNDINGS = 16.0
"""How much further off than its twin a course may be."""


@dataclass(frozen=True)
class Pilot:
    """A pilot: exact and sliding side by side, on the same drive and from the same start.

    Attributes
    ----------
    half_cycles : int
        Targets of the run, or of all its windows.
    burn_in : int
        Of them, left out of the means.
    events : int
        Of the exact run.
    velocity, velocity_error : float
        Of the exact run per `Drive.per`, with its standard error; nan if unknown.
    sliding, sliding_error : float
        The same of the sliding limit.
    difference, difference_error : float
        Exact minus sliding, and the standard error of that.
    settled : str
        ``rest`` or ``period`` if the exact chain has settled under cycles for good; else empty.
    may_settle : bool
        Whether it may still do so later, by rules: no coefficient is more than 6 standard
        deviations above the mean, and no chain without disorder is locked above 1.5 times an
        amplitude that all chains locked in tests stayed below. They are not proved.
    windows : int
        Of a path that was looked at here and there; 0 if it was followed from the beginning.
    """

    half_cycles: int
    burn_in: int
    events: int
    velocity: float
    velocity_error: float
    sliding: float
    sliding_error: float
    difference: float
    difference_error: float
    settled: str = ""
    may_settle: bool = False
    windows: int = 0

    @property
    def errors(self) -> tuple[float, float]:
        """The least and the largest relative error of sliding, within 3 standard errors."""
        if self.difference == 0 and self.difference_error == 0:
            return 0.0, 0.0
        if math.isnan(self.difference_error) or self.velocity == 0:
            return 0.0, math.inf
        margin = _SIGMAS * self.difference_error
        off, scale = abs(self.difference), abs(self.velocity)
        return max(0.0, off - margin) / scale, (off + margin) / scale

    def relative(self, error: float, drive: Drive) -> float:
        """Return what a standard error of this pilot is for a mean over `drive`, relative, 95 %."""
        if error == 0:
            return 0.0
        if not self.velocity:
            return math.nan
        after = drive.half_cycles - _burn_in(drive.half_cycles, drive)
        shorter = 1.0 if self.windows else (self.half_cycles - self.burn_in) / max(after, 1)
        return 1.96 * error / abs(self.velocity) * math.sqrt(shorter)


def event_nanoseconds(chain: Chain) -> float:
    """Return about what an event of the exact solver takes, by counts alone."""
    return 8.0 if chain.n == 2 else 200.0 + 4.0 * chain.n


def _most_events(chain: Chain) -> int:
    return int(_PILOT_NANOSECONDS / event_nanoseconds(chain))


def surveyed(chain: Chain, drive: Drive, start: State | None, seed: int) -> tuple[float, float]:
    """Return the mean velocity of the sliding limit per target, and its relative error at 95 %.

    Over the drive, or its beginning; the error is 0 unless the drive is random.
    """
    total = min(drive.half_cycles, _SURVEY_TARGETS)
    simulation = Sliding().simulation(chain, _start(chain, start, seed), seed, ())
    initial = _mean(_start(chain, start, seed))
    positions = np.concatenate([[initial], _positions(simulation, drive, 1, total)])
    burn_in = _burn_in(total, drive)
    if burn_in >= total:
        return 0.0, 0.0
    velocity = float(positions[-1] - positions[burn_in]) / (total - burn_in)
    if not drive.random:
        return velocity, 0.0
    error = _error(positions, burn_in, drive)
    return velocity, 1.96 * error / abs(velocity) if velocity else math.nan


def _burn_in(total: int, drive: Drive) -> int:
    if isinstance(drive, Listed):
        return 0
    targets = min(max(2, total // 5), total)
    return targets + targets % 2 if drive.cyclic else targets


def _start(chain: Chain, start: State | None, seed: int) -> State:
    return State.relaxed(chain, seed) if start is None else start


def _mean(state: State) -> float:
    return math.fsum(float(x) for x in state.displacements.tolist()) / state.n


def _positions(
    simulation: Simulation, drive: Drive, first: int, count: int, limits: Limits = NO_LIMITS
) -> NDArray[np.float64]:
    """Return x_G at `count` targets; fewer if the events are used up, or after a runaway."""
    stretch = advance(simulation, drive, first + count - 1, limits, done=first - 1)
    if stretch.stop is Stop.DEADLINE:
        raise OutOfTime(stretch.reason)
    return stretch.recorded["x_G"].astype(np.float64)


def _error(positions: NDArray[np.float64], burn_in: int, drive: Drive) -> float:
    """Return the standard error of the velocity over whole cycles after a burn-in."""
    targets = np.arange(burn_in, positions.size, 2 if drive.cyclic else 1)
    silent = math.nan if drive.random else 0.0
    return standard_error(positions[targets], drive.clock(targets), silent=silent)


def _gap_error(gap: NDArray[np.float64], burn_in: int, drive: Drive) -> float:
    """Return the standard error of a difference in velocity, or what is certainly more.

    Along a path, which is no sample of anything, advances in its sixteenths are taken for errors
    themselves. Where the error over a stationary drive is unknown: the scatter of eighths, as if
    they were not eight but one. nan if there are fewer steps.
    """
    if isinstance(drive, Listed):
        return 1.2 * _size(_advances(gap, burn_in, drive, 16))
    error = _error(gap, burn_in, drive)
    if not math.isnan(error) or (drive.random and not gap.any()):
        return error
    return math.sqrt(8) * _size(_advances(gap, burn_in, drive, 8))


def _scatter_along(gap: NDArray[np.float64], drive: Listed) -> float:
    """Return the standard error of the exact velocity along a path, over disorder.

    The sliding limit along it is certain; of what exact advances more in its sixteenths, the
    part that varies slowly belongs to the path, what jumps from one to the next to disorder.
    """
    jumps = np.diff(_advances(gap, 0, drive, 16))
    return 1.2 * _size(jumps) * math.sqrt(16 / 30)


def _advances(
    gap: NDArray[np.float64], burn_in: int, drive: Drive, blocks: int
) -> NDArray[np.float64]:
    """Return the advances in equal parts, for the time of them all; empty if there are fewer."""
    each = (gap.size - 1 - burn_in) // blocks
    each -= each % 2 if drive.cyclic else 0
    if not each:
        return np.empty(0)
    ends = np.arange(gap.size - 1 - blocks * each, gap.size, each)
    begun, ended = drive.clock(ends[[0, -1]]).tolist()
    advances: NDArray[np.float64] = np.diff(gap[ends]) / (ended - begun)
    return advances


def _size(parts: NDArray[np.float64]) -> float:
    return math.sqrt(float((parts**2).sum())) if parts.size else math.nan


def _may_settle(chain: Chain, drive: Drive) -> bool:
    """Return whether the chain might come to rest for good, or be locked without disorder."""
    if not isinstance(drive, Cycles):
        return False
    held = [max(chain.mu_s + _HIGHEST * chain.sigma_mu, chain.mu_d)] * chain.n
    rest = float(at_rest_amplitude(chain.l0, chain.tan_alpha, held))
    if chain.sigma_mu == 0:
        static = chain.times_cosine(chain.mu_s - abs(chain.tan_alpha))
        rest = max(rest, _LOCKED * chain.n * static / (2 * nearest_float(chain.l0)))
    return nearest_float(drive.amplitude) <= rest


def _settled_advance(positions: NDArray[np.float64]) -> float:
    """Return the advance of a cycle in the period with which cycles repeat; nan if they do not.

    They must have done so for three periods, and for a quarter of the run.
    """
    ends = positions[::2]
    steps = np.diff(ends[ends.size * 3 // 4 :])
    close = _NEAR * max(1.0, float(np.abs(ends).max()))
    for period in range(1, min(_LONGEST_PERIOD, steps.size // 3) + 1):
        if np.abs(steps[period:] - steps[:-period]).max() <= close:
            return float(steps[-period:].mean())
    return math.nan


def pilot_run(
    chain: Chain,
    drive: Drive,
    *,
    accuracy: float,
    start: State | None = None,
    seed: int = 0,
    limits: Limits = NO_LIMITS,
) -> Pilot:
    """Return a pilot that represents the drive, long enough to tell whether sliding will do.

    Of cycles and Gaussian steps it doubles its length until that is decided within three standard
    errors and the statistical error is known, or the chain has settled; at most over the events of
    a tenth of a second (of four if that error is still unknown) or a million targets. It goes to
    the end of the scene, and beyond, while the chain may still settle. A path is followed as a
    whole, with several seeds, or starts some roundings apart, if they take less than twice as many
    events, or in windows if it takes more.
    Raises `OutOfTime` when the time is over.
    """
    most_events = _most_events(chain)
    initial = _start(chain, start, seed)
    longer, most = drive, drive.half_cycles
    if isinstance(drive, (Cycles, GaussianSteps)):
        least, allowed = _PILOT_TARGETS
        most = min(max(most, least), allowed)
        size = drive.amplitude if isinstance(drive, Cycles) else drive.sigma_theta
        longer = type(drive)(size, most)
    exact = Exact().simulation(chain, initial, seed, ())
    sliding = Sliding().simulation(chain, initial, seed, ())
    one = other = np.array([_mean(initial)])
    may_settle = _may_settle(chain, drive)
    length = most if isinstance(drive, Listed) else min(256, most)
    while True:
        events = 0
        for until in (length - 2, length):
            left = replace(limits, events=most_events, used=exact.tally.events)
            events, count = exact.tally.events, until - one.size + 1
            if count > 0:
                one = np.concatenate([one, _positions(exact, longer, one.size, count, left)])
        cut = one.size <= length
        if cut and isinstance(drive, Listed):
            return _in_windows(chain, drive, initial, seed, limits)
        fresh = _positions(sliding, longer, other.size, one.size - other.size, limits)
        other = np.concatenate([other, fresh])
        resting = drive.cyclic and not cut and exact.tally.events == events
        pilot = _compared(one, other, longer, exact.tally.events, chain, resting)
        decided = _decided(pilot, drive, accuracy)
        unsure = math.isnan(pilot.velocity_error)
        known = not unsure and not may_settle
        if cut and unsure and not pilot.settled and most_events < 4 * _most_events(chain):
            most_events *= 2  # some good estimates are refused by chance
            continue
        if cut or length == most or pilot.settled or (decided and known):
            if isinstance(drive, Listed) and most:
                return _over_courses(pilot, chain, drive, accuracy, start, seed, limits)
            return replace(pilot, may_settle=may_settle and not pilot.settled)
        length = min(2 * length, most)


def _decided(pilot: Pilot, drive: Drive, accuracy: float) -> bool:
    """Return whether sliding is known to be within the accuracy along this drive, or beyond it."""
    statistical = pilot.relative(pilot.sliding_error, drive)
    room = accuracy - statistical if statistical < accuracy else accuracy
    least, largest = pilot.errors
    return largest <= room or least > room


def _over_courses(
    pilot: Pilot,
    chain: Chain,
    drive: Listed,
    accuracy: float,
    start: State | None,
    seed: int,
    limits: Limits,
) -> Pilot:
    """Return a pilot along a whole path with the scatter of its courses, if it is cheap.

    With disorder they are those of other seeds, twice as many until the accuracy is decided.
    Without, the path has one velocity, and rounding alone may miss it: courses that start some
    roundings apart show how far, as the true one is to each of them what they are to each other.
    """
    affordable = 2 * _most_events(chain) // max(pilot.events, 1)
    if affordable < _COURSES[0] or math.isnan(pilot.velocity):
        return pilot
    begun, ended = drive.clock(np.array([0, drive.half_cycles])).tolist()
    velocities = [pilot.velocity]
    while True:
        for other in range(len(velocities), max(_COURSES[0], 2 * len(velocities))):
            key = (seed + other) % 2**64 if chain.sigma_mu else seed
            initial = _start(chain, start, key)
            if not chain.sigma_mu:
                initial = _roundings_off(initial, chain, other)
            exact = Exact().simulation(chain, initial, key, ())
            reached = _positions(exact, drive, 1, drive.half_cycles, limits)
            velocities.append(float(reached[-1] - _mean(initial)) / (ended - begun))
        count = len(velocities)
        mean, scatter = math.fsum(velocities) / count, float(np.std(velocities, ddof=1))
        scatter *= float(special.stdtrit(count - 1, 0.975)) / 1.96
        if not chain.sigma_mu:
            scatter *= math.sqrt(2)
        pilot = replace(
            pilot,
            velocity=mean,
            velocity_error=scatter,
            difference=mean - pilot.sliding,
            difference_error=scatter / math.sqrt(count) if chain.sigma_mu else scatter,
        )
        enough = not chain.sigma_mu or _decided(pilot, drive, accuracy)
        if enough or 2 * count > min(affordable, _COURSES[1]):
            return pilot


def _roundings_off(state: State, chain: Chain, key: int) -> State:
    """Return the state with every tension some roundings off, by what `key` draws."""
    size = _OFF * nearest_float(chain.mu_s + abs(chain.tan_alpha))
    off = np.random.default_rng(key).uniform(-size, size, chain.n - 1).tolist()
    tensions: NDArray[Any] = np.empty(chain.n - 1, dtype=object)
    given = state.tensions.tolist()
    tensions[:] = [rational(t) + Fraction(d) for t, d in zip(given, off, strict=True)]
    return replace(state, tensions=tensions)


def _compared(
    one: NDArray[np.float64],
    other: NDArray[np.float64],
    drive: Drive,
    events: int,
    chain: Chain,
    resting: bool,
) -> Pilot:
    """Return what two courses x_G(t) show, from the start on."""
    done = one.size - 1
    burn_in = _burn_in(done, drive)
    last = done - done % 2 if drive.cyclic else done
    one, other = one[: last + 1], other[: last + 1]
    if last <= burn_in:
        nan = math.nan
        return Pilot(done, burn_in, events, nan, nan, nan, nan, nan, nan)
    settled, advance_of_cycle = "", math.nan
    if resting:
        settled, advance_of_cycle = "rest", 0.0
    elif drive.cyclic and chain.sigma_mu == 0:
        advance_of_cycle = _settled_advance(one)
        settled = "" if math.isnan(advance_of_cycle) else "period"
    begun, ended = drive.clock(np.array([burn_in, last])).tolist()
    span = ended - begun or math.nan

    def velocity(positions: NDArray[np.float64]) -> float:
        return float(positions[-1] - positions[burn_in]) / span

    found = Pilot(
        half_cycles=done,
        burn_in=burn_in,
        events=events,
        velocity=velocity(one),
        velocity_error=_error(one, burn_in, drive),
        sliding=velocity(other),
        sliding_error=_error(other, burn_in, drive) if drive.random else 0.0,
        difference=velocity(one - other),
        difference_error=_gap_error(one - other, burn_in, drive),
    )
    if isinstance(drive, Listed):
        found = replace(found, velocity_error=_scatter_along(one - other, drive))
    if not settled and found.difference and rests_for_long(chain, done):
        return replace(found, velocity_error=math.nan, difference_error=math.nan)
    if not settled:
        return found
    limit = float(other[-1] - other[-3]) / 2  # the sliding limit settles in its second cycle
    true = advance_of_cycle / 2
    close = _NEAR * max(1.0, float(np.abs(one).max()))
    gap = true - limit if abs(true - limit) > close else 0.0
    return replace(
        found, velocity=true, velocity_error=0.0, sliding=limit, difference=gap,
        difference_error=0.0, settled=settled,
    )  # fmt: skip


def _in_windows(chain: Chain, drive: Listed, initial: State, seed: int, limits: Limits) -> Pilot:
    """Return a pilot in windows spread over a path, and around its extremes.

    The windows begin where the sliding limit is then, and their first quarter is left out. The
    velocity of the exact chain is that of the sliding limit along the whole path, times the ratio
    of what both advance within the windows; its error comes from the scatter of the windows.
    """
    total = drive.half_cycles
    theta = drive.targets(1, total, seed)
    width = total // (_WINDOWS + 2)
    middles = [*(np.arange(_WINDOWS) + 0.5) * total / _WINDOWS, theta.argmax(), theta.argmin()]
    begins = sorted({min(max(int(middle) - width // 2, 0), total - width) for middle in middles})
    sliding = Sliding().simulation(chain, initial, seed, ())
    other = np.array([_mean(initial)])
    gains, used, events = [], 0, 0
    for begin in [*begins, total]:
        if begin >= other.size:
            fresh = _positions(sliding, drive, other.size, begin - other.size + 1, limits)
            other = np.concatenate([other, fresh])
        if begin == total:
            break
        exact = Exact().simulation(chain, sliding.state(), seed, ())
        left = replace(limits, events=_most_events(chain) // len(begins))
        one = _positions(exact, drive, begin + 1, width, left)
        fresh = _positions(sliding, drive, other.size, begin + one.size - other.size + 1, limits)
        other = np.concatenate([other, fresh])
        used, events = used + one.size, events + exact.tally.events
        first = one.size // 4
        if one.size > first + 1:
            limit = other[begin + 1 : begin + 1 + one.size]
            gains.append((float(one[-1] - one[first]), float(limit[-1] - limit[first])))
    begun, ended = drive.clock(np.array([0, total])).tolist()
    whole_limit = float(other[-1] - other[0]) / (ended - begun)
    nan = math.nan
    pilot = Pilot(used, used // 4, events, nan, nan, whole_limit, 0.0, nan, nan, windows=len(gains))
    moved, expected = np.array(gains).T if gains else (np.zeros(1), np.zeros(1))
    whole = float(np.abs(expected).sum())
    # one storm in one window tells nothing of its scatter
    if len(gains) < _WINDOWS // 2 or not whole or np.abs(expected).max() > whole / 2:
        return pilot
    ratio = float(moved.sum() / expected.sum())
    rest = moved - ratio * expected
    error = math.sqrt(float((rest**2).sum()) * rest.size / (rest.size - 1)) / abs(expected.sum())
    gap = float(error) * abs(whole_limit)
    return replace(
        pilot,
        velocity=ratio * whole_limit,
        velocity_error=gap * math.sqrt(used / total),
        difference=(ratio - 1) * whole_limit,
        difference_error=gap,
    )


def trusted_course(
    chain: Chain, drive: Drive, accuracy: float, start: State | None, seed: int, limits: Limits
) -> tuple[int, float, float]:
    """Return how far exact follows the course, how far its twin is off there, events per target.

    The distance is that of tensions, in units of the largest (of 1, if that is less).
    """
    exact = Exact().simulation(chain, _start(chain, start, seed), seed, ())
    twin = exact.twin()
    trusted, largest_off = 0, 0.0
    total = drive.half_cycles
    while trusted < total:
        until = min(trusted + 1 + trusted // 8, total)
        ended = []
        for simulation in (exact, *([] if twin is None else [twin])):
            left = replace(limits, events=_most_events(chain))
            stretch = advance(simulation, drive, until, left, done=trusted)
            if stretch.stop is Stop.DEADLINE:
                raise OutOfTime(stretch.reason)
            ended.append(stretch.stop)
        one, other = exact.state(), (twin or exact).state()
        tensions, others = one.tensions.astype(float), other.tensions.astype(float)
        size = max(1.0, float(np.abs(tensions).max(initial=0)))
        off = float(np.abs(tensions - others).max(initial=0)) / size
        together = np.array_equal(one.draws, other.draws) and len(set(ended)) == 1
        if not together or ended[0] is Stop.BUDGET or ROUNDINGS * off > accuracy:
            break
        if exact.evidence is Evidence.UNDECIDED:
            break
        largest_off = max(largest_off, off)
        trusted = total if ended[0].final else until
    return trusted, largest_off, exact.tally.events / max(trusted, 1)
