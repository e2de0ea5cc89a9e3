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
from exactcreep.limits import Limits, OutOfTime, Stop
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles, Drive
from exactcreep.model.numbers import nearest_float
from exactcreep.model.outcome import Evidence
from exactcreep.model.state import State
from exactcreep.solvers.exact.rest import rational
from exactcreep.solvers.exact.solver import Exact
from exactcreep.solvers.sliding import Sliding
from exactcreep.solvers.solver import Solver, Start, advance
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
    half_cycles, burn_in : int
        Targets of the run, or of all its windows; those that are left out of the means.
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
    velocity: float = math.nan
    velocity_error: float = math.nan
    sliding: float = math.nan
    sliding_error: float = math.nan
    difference: float = math.nan
    difference_error: float = math.nan
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

    def decides(self, drive: Drive, accuracy: float) -> bool:
        """Return whether sliding is known to be within the accuracy along a drive, or beyond it."""
        statistical = self.relative(self.sliding_error, drive)
        room = accuracy - statistical if statistical < accuracy else accuracy
        least, largest = self.errors
        return largest <= room or least > room


@dataclass(frozen=True)
class Subject:
    """A start, a drive, and the time that trying them out may take."""

    start: Start
    drive: Drive
    limits: Limits

    @property
    def chain(self) -> Chain:
        """The chain that is driven."""
        return self.start.chain

    @property
    def relaxed(self) -> bool:
        """Whether it starts as the laws have it: without tensions, as the seed draws it."""
        given, relaxed = self.start.state, State.relaxed(self.chain, self.start.seed)
        same = np.array_equal(given.coefficients, relaxed.coefficients)
        return given.theta == 0 and not given.tensions.any() and same

    def course(self, solver: Solver, start: Start | None = None, done: int = 0) -> _Track:
        """Return the course from the start, or from another one at target `done`."""
        return _Track(self, solver, start or self.start, done)


class _Track:
    """x_G of a simulation as far as it has been taken, from its start on."""

    def __init__(self, subject: Subject, solver: Solver, start: Start, done: int) -> None:
        self.subject, self.first = subject, done
        self.simulation = solver.simulation_from(start, ())
        places = map(float, start.state.displacements.tolist())
        self.x_g = np.array([math.fsum(places) / start.chain.n])

    @property
    def targets(self) -> int:
        """How many it has reached."""
        return self.x_g.size - 1

    @property
    def events(self) -> int:
        """How many have happened."""
        return self.simulation.tally.events

    def upto(self, target: int, events: int | None = None) -> NDArray[np.float64]:
        """Go on to a target, or until there are so many events, or a runaway; return `x_g`."""
        limits = replace(self.subject.limits, events=events, used=self.events)
        done = self.first + self.targets
        stretch = advance(self.simulation, self.subject.drive, target, limits, done=done)
        if stretch.stop is Stop.DEADLINE:
            raise OutOfTime(stretch.reason)
        fresh = stretch.recorded["x_G"].astype(np.float64)
        self.x_g = np.concatenate([self.x_g, fresh])
        return self.x_g


def event_nanoseconds(chain: Chain) -> float:
    """Return about what an event of the exact solver takes, by counts alone."""
    return 8.0 if chain.n == 2 else 200.0 + 4.0 * chain.n


def _most_events(chain: Chain) -> int:
    return int(_PILOT_NANOSECONDS / event_nanoseconds(chain))


def surveyed(subject: Subject) -> tuple[float, float]:
    """Return the mean velocity of the sliding limit per target, and its relative error at 95 %.

    Over the drive, or its beginning; the error is 0 unless the drive is random.
    """
    drive = subject.drive
    total = min(drive.half_cycles, _SURVEY_TARGETS)
    burn_in = _burn_in(total, drive)
    positions = subject.course(Sliding()).upto(total)
    velocity = float(positions[-1] - positions[burn_in]) / max(total - burn_in, 1)
    if not drive.random:
        return velocity, 0.0
    error = _error(positions, burn_in, drive)
    return velocity, 1.96 * error / abs(velocity) if velocity else math.nan


def _burn_in(total: int, drive: Drive) -> int:
    if not (drive.cyclic or drive.random):
        return 0
    targets = min(max(2, total // 5), total)
    return targets + targets % 2 if drive.cyclic else targets


def _span(drive: Drive, begin: int, end: int) -> float:
    begun, ended = drive.clock(np.array([begin, end])).tolist()
    return float(ended - begun) or math.nan


def _error(positions: NDArray[np.float64], burn_in: int, drive: Drive) -> float:
    """Return the standard error of the velocity over whole cycles after a burn-in."""
    targets = np.arange(burn_in, positions.size, 2 if drive.cyclic else 1)
    silent = math.nan if drive.random else 0.0
    return standard_error(positions[targets], drive.clock(targets), silent=silent)


def _errors(
    one: NDArray[np.float64], other: NDArray[np.float64], burn_in: int, drive: Drive
) -> tuple[float, float, float]:
    """Return standard errors: of the exact velocity, of sliding, and of their difference.

    Along a path, which is no sample of anything, the sliding limit is certain. What exact advances
    more in sixteenths of it is taken for the error of the difference itself; what jumps from one
    to the next belongs to disorder, the rest to the path. Where the error of the difference over a
    stationary drive is unknown: the scatter of eighths, as if they were not eight but one, which is
    certainly more. nan if there are fewer steps.
    """
    gap = one - other
    if not (drive.cyclic or drive.random):
        parts = _advances(gap, 0, drive, 16)
        return 1.2 * _size(np.diff(parts)) * math.sqrt(16 / 30), 0.0, 1.2 * _size(parts)
    error = _error(gap, burn_in, drive)
    if math.isnan(error) and (gap.any() or not drive.random):
        error = math.sqrt(8) * _size(_advances(gap, burn_in, drive, 8))
    sliding = _error(other, burn_in, drive) if drive.random else 0.0
    return _error(one, burn_in, drive), sliding, error


def _advances(
    gap: NDArray[np.float64], burn_in: int, drive: Drive, blocks: int
) -> NDArray[np.float64]:
    """Return the advances in equal parts, for the time of them all; empty if there are fewer."""
    each = (gap.size - 1 - burn_in) // blocks
    each -= each % 2 if drive.cyclic else 0
    if not each:
        return np.empty(0)
    ends = np.arange(gap.size - 1 - blocks * each, gap.size, each)
    advances: NDArray[np.float64] = np.diff(gap[ends]) / _span(drive, ends[0], ends[-1])
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


def pilot_run(subject: Subject, accuracy: float) -> Pilot:
    """Return a pilot that represents the drive, long enough to tell whether sliding will do.

    Of cycles and Gaussian steps it doubles its length until that is decided within three standard
    errors and the statistical error is known, or the chain has settled; at most over the events of
    a tenth of a second (of four if that error is still unknown) or a million targets. It goes to
    the end of the scene, and beyond, while the chain may still settle. A path is followed as a
    whole, with several seeds, or starts some roundings apart, if they take less than twice as many
    events, or in windows if it takes more.
    Raises `OutOfTime` when the time is over.
    """
    chain, drive = subject.chain, subject.drive
    most_events = _most_events(chain)
    if not (drive.cyclic or drive.random):
        exact, sliding = subject.course(Exact()), subject.course(Sliding())
        if exact.upto(drive.half_cycles, most_events).size <= drive.half_cycles:
            return _in_windows(subject)
        sliding.upto(drive.half_cycles)
        return _over_courses(_compared(exact, sliding), subject, accuracy)
    most = min(max(drive.half_cycles, _PILOT_TARGETS[0]), _PILOT_TARGETS[1])
    longer = replace(drive, **{"cycles" if drive.cyclic else "steps": most})
    exact, sliding = (replace(subject, drive=longer).course(one) for one in (Exact(), Sliding()))
    may_settle = _may_settle(chain, drive)
    length = min(256, most)
    while True:
        exact.upto(length - 2, most_events)
        events = exact.events
        exact.upto(length, most_events)
        cut = exact.targets < length
        sliding.upto(exact.targets)
        pilot = _compared(exact, sliding, drive.cyclic and not cut and exact.events == events)
        unsure = math.isnan(pilot.velocity_error)
        if cut and unsure and not pilot.settled and most_events < 4 * _most_events(chain):
            most_events *= 2  # some good estimates are refused by chance
            continue
        known = not (unsure or may_settle) and pilot.decides(drive, accuracy)
        if cut or length == most or pilot.settled or known:
            return replace(pilot, may_settle=may_settle and not pilot.settled)
        length = min(2 * length, most)


def _over_courses(pilot: Pilot, subject: Subject, accuracy: float) -> Pilot:
    """Return a pilot along a whole path with the scatter of its courses, if it is cheap.

    With disorder they are those of other seeds, twice as many until the accuracy is decided.
    Without, the path has one velocity, and rounding alone may miss it: courses that start some
    roundings apart show how far, as the true one is to each of them what they are to each other.
    """
    chain, drive, start = subject.chain, subject.drive, subject.start
    affordable = 2 * _most_events(chain) // max(pilot.events, 1)
    if affordable < _COURSES[0] or math.isnan(pilot.velocity):
        return pilot
    relaxed, disorder = subject.relaxed, chain.sigma_mu != 0
    velocities = [pilot.velocity]
    while True:
        for other in range(len(velocities), max(_COURSES[0], 2 * len(velocities))):
            if not disorder:
                begun = replace(start, state=_roundings_off(start, other))
            else:
                key = (start.seed + other) % 2**64
                begun = Start(chain, State.relaxed(chain, key) if relaxed else start.state, key)
            x_g = subject.course(Exact(), begun).upto(drive.half_cycles)
            velocities.append(float(x_g[-1] - x_g[0]) / _span(drive, 0, drive.half_cycles))
        count = len(velocities)
        mean, scatter = math.fsum(velocities) / count, float(np.std(velocities, ddof=1))
        scatter *= float(special.stdtrit(count - 1, 0.975)) / 1.96
        if not disorder:
            scatter *= math.sqrt(2)
        pilot = replace(
            pilot,
            velocity=mean,
            velocity_error=scatter,
            difference=mean - pilot.sliding,
            difference_error=scatter / math.sqrt(count) if disorder else scatter,
        )
        enough = not disorder or pilot.decides(drive, accuracy)
        if enough or 2 * count > min(affordable, _COURSES[1]):
            return pilot


def _roundings_off(start: Start, key: int) -> State:
    """Return the start's state with every tension some roundings off, by what `key` draws."""
    chain, given = start.chain, start.state.tensions.tolist()
    size = _OFF * nearest_float(chain.mu_s + abs(chain.tan_alpha))
    off = np.random.default_rng(key).uniform(-size, size, chain.n - 1).tolist()
    tensions: NDArray[Any] = np.empty(chain.n - 1, dtype=object)
    tensions[:] = [rational(t) + Fraction(d) for t, d in zip(given, off, strict=True)]
    return replace(start.state, tensions=tensions)


def _compared(exact: _Track, sliding: _Track, resting: bool = False) -> Pilot:
    """Return what two courses show, from the start on."""
    chain, drive = exact.subject.chain, exact.subject.drive
    done, events = exact.targets, exact.events
    burn_in = _burn_in(done, drive)
    last = done - done % 2 if drive.cyclic else done
    one, other = exact.x_g[: last + 1], sliding.x_g[: last + 1]
    if last <= burn_in:
        return Pilot(done, burn_in, events)
    cycle = 0.0 if resting else math.nan
    if drive.cyclic and chain.sigma_mu == 0 and not resting:
        cycle = _settled_advance(one)
    if not math.isnan(cycle):
        limit = float(other[-1] - other[-3]) / 2  # the sliding limit settles in its second cycle
        gap = cycle / 2 - limit
        if abs(gap) <= _NEAR * max(1.0, float(np.abs(one).max())):
            gap = 0.0
        settled = "rest" if resting else "period"
        return Pilot(done, burn_in, events, cycle / 2, 0.0, limit, 0.0, gap, 0.0, settled)
    span = _span(drive, burn_in, last)
    moved, crept, gap = (float(x[-1] - x[burn_in]) / span for x in (one, other, one - other))
    error, sliding_error, gap_error = _errors(one, other, burn_in, drive)
    if gap and rests_for_long(chain, done):
        error = gap_error = math.nan
    return Pilot(done, burn_in, events, moved, error, crept, sliding_error, gap, gap_error)


def _in_windows(subject: Subject) -> Pilot:
    """Return a pilot in windows spread over a path, and around its extremes.

    The windows begin where the sliding limit is then, and their first quarter is left out. The
    velocity of the exact chain is that of the sliding limit along the whole path, times the ratio
    of what both advance within the windows; its error comes from the scatter of the windows.
    """
    chain, drive, total = subject.chain, subject.drive, subject.drive.half_cycles
    theta = drive.targets(1, total, subject.start.seed)
    width = total // (_WINDOWS + 2)
    middles = [*(np.arange(_WINDOWS) + 0.5) * total / _WINDOWS, theta.argmax(), theta.argmin()]
    begins = sorted({min(max(int(middle) - width // 2, 0), total - width) for middle in middles})
    sliding = subject.course(Sliding())
    gains, used, events = [], 0, 0
    for begin in begins:
        sliding.upto(begin)
        here = replace(subject.start, state=sliding.simulation.state())
        exact = subject.course(Exact(), here, begin)
        one = exact.upto(begin + width, _most_events(chain) // len(begins))
        done, first = exact.targets, 1 + exact.targets // 4
        limit = sliding.upto(begin + done)[begin : begin + done + 1]
        used, events = used + done, events + exact.events
        if done > first:
            gains.append((float(one[-1] - one[first]), float(limit[-1] - limit[first])))
    x_g = sliding.upto(total)
    crept = float(x_g[-1] - x_g[0]) / _span(drive, 0, total)
    pilot = Pilot(used, used // 4, events, sliding=crept, sliding_error=0.0, windows=len(gains))
    moved, expected = np.array(gains).T if gains else (np.zeros(1), np.zeros(1))
    whole = float(np.abs(expected).sum())
    # one storm in one window tells nothing of its scatter
    if len(gains) < _WINDOWS // 2 or not whole or np.abs(expected).max() > whole / 2:
        return pilot
    ratio = float(moved.sum() / expected.sum())
    rest = moved - ratio * expected
    error = math.sqrt(float((rest**2).sum()) * rest.size / (rest.size - 1)) / abs(expected.sum())
    gap = float(error) * abs(crept)
    return replace(
        pilot,
        velocity=ratio * crept,
        velocity_error=gap * math.sqrt(used / total),
        difference=(ratio - 1) * crept,
        difference_error=gap,
    )


def trusted_course(subject: Subject, accuracy: float) -> tuple[int, float, float]:
    """Return how far exact follows the course, how far its twin is off there, events per target.

    The distance is that of tensions, in units of the largest (of 1, if that is less).
    """
    exact = Exact().simulation_from(subject.start, ())
    twin = exact.twin()
    limits = replace(subject.limits, events=_most_events(subject.chain))  # of each part
    trusted, largest_off = 0, 0.0
    total = subject.drive.half_cycles
    while trusted < total:
        until = min(trusted + 1 + trusted // 8, total)
        ended = []
        for simulation in (exact, *([] if twin is None else [twin])):
            stretch = advance(simulation, subject.drive, until, limits, done=trusted)
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
