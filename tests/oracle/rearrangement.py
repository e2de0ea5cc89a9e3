"""An independent integration of rearrangements and runs, from the model's equations alone.

The velocities of the moving sliders are power series of forty terms about the beginning of every
short step, in numbers of fifty digits. Events are sign changes of speeds and margins between
samples, refined by Newton's method. Two roots between neighbouring samples would change the order
of events, and every comparison would show it. Nothing of `exactcreep.motion` or
`exactcreep.solvers` is used.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise
from typing import Any

import mpmath
import numpy as np

from exactcreep.model.chain import Chain
from exactcreep.model.keyed_disorder import static_coefficient
from exactcreep.model.state import State

MP = mpmath.MPContext()
MP.dps = 50
ORDER, STEP = 40, MP.mpf(1) / 4
SAMPLES = np.linspace(0, 0.25, 33)[1:]
POWERS = SAMPLES[:, None] ** np.arange(ORDER + 3)
TOGETHER, TIED = 1e-10, 1e-30
"""Events closer than this floats cannot tell apart: the trajectory is refused, unless they tie."""
MOST_EVENTS, MOST_STEPS = 2000, 1000


class Undecided(Exception):
    """A tie, or its length, keeps a trajectory from being one that floats can be held to."""


def number(value: Any) -> Any:
    """Return a float or a rational to fifty digits."""
    if isinstance(value, MP.mpf):
        return value
    exact = Fraction(value)
    return MP.mpf(exact.numerator) / exact.denominator


def value(series: Sequence[Any], t: Any) -> Any:
    """Return a power series at a time."""
    return MP.polyval(series[::-1], t)


def differences(row: Sequence[Any]) -> list[Any]:
    """Return each number less the one before, of a row with a zero at either end."""
    bare = [0, *row, 0]
    return [b - a for a, b in pairwise(bare)]


class Motion:
    """A chain that is followed from event to event until it rests."""

    def __init__(
        self, chain: Chain, tensions: Sequence[Any], draws: Any, seed: int, own: Any = ()
    ) -> None:
        """Begin at rest; `own` are coefficients that the sliders bring, if they are not drawn."""
        self.chain, self.n, self.seed = chain, chain.n, seed
        slope = number(chain.tan_alpha)
        self.cosine = 1 / MP.sqrt(1 + slope**2)
        pulls = [number(chain.end_forces[0]), *[0] * (self.n - 2), number(chain.end_forces[1])]
        self.tensions = [number(tension) for tension in tensions]  # where the load is zero
        bare = differences(self.tensions)
        self.force = [a + b + slope * self.cosine for a, b in zip(bare, pulls, strict=True)]
        self.drag = [number(mu) * self.cosine for mu in chain.each("mu_d")]
        self.draws = np.array(draws, dtype=np.int64)
        self.holds = [self.threshold(n) for n in range(self.n)]
        for n, brought in enumerate(own):
            if brought != float(self.drawn(n)):
                self.holds[n] = max(number(brought) * self.cosine, self.drag[n])
        self.place, self.speed = [MP.mpf(0)] * self.n, [MP.mpf(0)] * self.n
        self.way, self.time, self.load = [0] * self.n, MP.mpf(0), MP.mpf(0)
        self.expansion = [number(share) for share in chain.expansion or [1] * (self.n - 1)]
        self.events: list[tuple[Any, str, list[int], list[int]]] = []
        rooms = [hold - abs(force) for hold, force in zip(self.holds, self.force, strict=True)]
        if any(abs(room) < TIED for room in rooms):
            raise Undecided("a slider stands at its threshold")
        if unstable := [n for n, room in enumerate(rooms) if room < 0]:
            self.start(unstable)

    def drawn(self, n: int) -> Any:
        return static_coefficient(self.chain, self.seed, n + 1, int(self.draws[n]) - 1)

    def threshold(self, n: int) -> Any:
        return max(number(self.drawn(n)) * self.cosine, self.drag[n])

    def happened(self, kind: str, who: list[int]) -> None:
        self.events.append((self.time, kind, who, [self.way[n] for n in who]))

    def start(self, who: list[int]) -> None:
        for n in who:
            self.way[n] = 1 if self.force[n] > 0 else -1
        self.happened("start", who)

    def stop(self, who: list[int]) -> None:
        """Let sliders stop, and draw."""
        self.happened("stop", who)
        for n in who:
            self.way[n], self.speed[n] = 0, MP.mpf(0)
            self.draws[n] += 1
            self.holds[n] = self.threshold(n)

    def next_starts(self, direction: int) -> tuple[Any, list[int]]:
        """Return by how much ``l0 theta`` changes until sliders start, and which."""
        rates = [-direction * rate for rate in differences(self.expansion)]
        ways = [
            ((self.holds[n] * abs(rate) - rate * self.force[n]) / rate**2, n)
            for n, rate in enumerate(rates)
            if rate
        ]
        return together(ways)

    def ramp(self, change: Any) -> None:
        self.load += change
        rates = differences(self.expansion)
        self.force = [f - rate * change for f, rate in zip(self.force, rates, strict=True)]

    def begin(self, who: list[int]) -> None:
        """Start on a ramp; those that nothing drives slip by nothing."""
        self.time = MP.mpf(0)
        self.start(who)
        if undriven := [n for n in who if self.holds[n] <= self.drag[n]]:
            self.stop(undriven)

    def beside(self, n: int) -> list[int]:
        return [m for m in (n - 1, n + 1) if 0 <= m < self.n]

    def velocities(self) -> list[list[Any]]:
        """Return the power series of each slider's velocity."""
        rows = [[self.speed[n]] for n in range(self.n)]
        for n, way in enumerate(self.way):
            rows[n].append((self.force[n] - way * self.drag[n]) * abs(way))
        for k in range(ORDER):
            for n, row in enumerate(rows):
                if not self.way[n]:
                    row.append(MP.mpf(0))
                    continue
                pull = sum(rows[m][k] for m in self.beside(n)) - len(self.beside(n)) * row[k]
                row.append(pull / ((k + 1) * (k + 2)))
        return rows

    def conditions(
        self, rows: list[list[Any]], moved: list[list[Any]]
    ) -> list[tuple[list[Any], int]]:
        """Return what is positive until a slider acts, its speed or its margins, and the slider."""
        found: list[tuple[list[Any], int]] = []
        for n, way in enumerate(self.way):
            if way:
                series = [way * x for x in rows[n]]
                while abs(series[0]) < 1e-40:  # it has just started
                    series = series[1:]
                found.append((series, n))
                continue
            if not any(self.way[m] for m in self.beside(n)):
                continue
            grown = [sum(parts) for parts in zip(*(moved[m] for m in self.beside(n)), strict=True)]
            for side in (1, -1):
                room = self.holds[n] - side * self.force[n]
                if abs(room) < TIED:
                    raise Undecided("a slider at its threshold has a neighbour that moves")
                found.append(([room, *(-side * x for x in grown[1:])], n))
        return found

    def go_on(self) -> None:
        """Go on to the next event, or by a step in which there is none."""
        rows = self.velocities()
        moved = [[0, *(x / (k + 1) for k, x in enumerate(row))] for row in rows]
        first, who = together(first_roots(self.conditions(rows, moved)))
        t = first if who else STEP
        self.time += t
        ways = [value(row, t) for row in moved]
        self.speed = [value(row, t) for row in rows]
        for n in range(self.n):
            self.place[n] += ways[n]
            self.force[n] += sum(ways[m] for m in self.beside(n)) - len(self.beside(n)) * ways[n]
        stops = [n for n in who if self.way[n]]
        if stops:
            self.stop(stops)
        if any(abs(abs(self.force[n]) - self.holds[n]) < TOGETHER for n in stops):
            raise Undecided("a slider stops at its threshold")
        starts = [n for n in who if n not in stops or abs(self.force[n]) > self.holds[n]]
        if starts:
            self.start(starts)

    def rest(self) -> None:
        """Go on until all sliders rest."""
        steps = 0
        while any(self.way):
            self.go_on()
            steps += 1
            if steps > MOST_STEPS or len(self.events) > MOST_EVENTS:
                raise Undecided("too long")

    def reach(self, goal: Any) -> Any:
        """Go on to a value of ``l0 theta``; return the value at which a slider would start next."""
        while True:
            way = 1 if goal > self.load else -1
            far, who = self.next_starts(way)
            left = abs(goal - self.load)
            if abs(far - left) < TOGETHER:
                raise Undecided("a slider is at its threshold at the target")
            if far > left:
                further = self.load + way * far
                self.ramp(goal - self.load)
                return further
            self.ramp(way * far)
            self.begin(who)
            self.rest()

    def present_tensions(self) -> list[float]:
        pairs = pairwise(self.place)
        parts = zip(self.tensions, self.expansion, pairs, strict=True)
        return [float(begin - self.load * share + (b - a)) for begin, share, (a, b) in parts]

    def log(self) -> list[tuple[Any, tuple[str, tuple[int, ...], tuple[int, ...]]]]:
        """Return the time since its rearrangement began, and the signature, of every event."""
        return [
            (time, (kind, tuple(n + 1 for n in who), tuple(ways)))
            for time, kind, who, ways in self.events
        ]


def together(found: list[tuple[Any, int]]) -> tuple[Any, list[int]]:
    """Return the first of some times, and who acts then; infinity and nobody if there are none."""
    found = sorted(found)
    who = [n for time, n in found if time - found[0][0] < TIED]
    if len(found) > len(who) and found[len(who)][0] - found[0][0] < TOGETHER:
        raise Undecided("two events together")
    return (found[0][0], sorted(who)) if found else (MP.inf, [])


def first_roots(functions: list[tuple[list[Any], int]]) -> list[tuple[Any, int]]:
    """Return where functions that begin above zero first change their signs within a step."""
    table = np.zeros((len(functions), ORDER + 3))
    for row, (series, _) in zip(table, functions, strict=True):
        row[: len(series)] = [float(x) for x in series]
    below = POWERS @ table.T < 0
    found = []
    for j in np.flatnonzero(below.any(axis=0)).tolist():
        series, n = functions[j]
        rate = [k * x for k, x in enumerate(series)][1:]
        high = MP.mpf(SAMPLES[below[:, j].argmax()])
        low = high - STEP / len(SAMPLES)
        for _ in range(20):
            middle = (low + high) / 2
            low, high = (middle, high) if value(series, middle) > 0 else (low, middle)
        for _ in range(5):
            high -= value(series, high) / value(rate, high)
        found.append((high, n))
    return found


def integrate(
    chain: Chain, tensions: Sequence[Any], draws: Any, direction: int, seed: int
) -> Motion:
    """Return the chain at rest after a ramp in `direction` (0: none) and a rearrangement.

    `draws` says how many static coefficients each slider has had; the last of them holds.

    Raises
    ------
    Undecided
        If a tie or its length keeps floats from telling what happens.
    """
    motion = Motion(chain, tensions, draws, seed)
    if direction and motion.events:
        raise Undecided("the chain is not at rest")
    if direction:
        far, who = motion.next_starts(direction)
        motion.ramp(direction * far)
        motion.begin(who)
    motion.rest()
    return motion


def follow(
    chain: Chain, state: State, targets: Sequence[Any], seed: int
) -> tuple[list[tuple[Any, Any]], list[list[Any]]]:
    """Return time and signature of every event on the way to targets, and displacements there.

    Raises
    ------
    Undecided
        As `integrate` does.
    """
    motion = Motion(chain, state.tensions, state.draws, seed, state.coefficients)
    motion.rest()
    places = []
    for target in targets:
        motion.reach(number(chain.l0 * Fraction(target)))
        places.append(motion.place.copy())
    return motion.log(), places


def threshold(chain: Chain, low: Fraction, cycles: int) -> Any:
    """Return the amplitude above `low` from which on the relaxed chain creeps.

    It creeps if it still moves after so many cycles. While it comes to rest, the same events follow
    up to the least theta at which another slider would have started: the next amplitude to try.
    """
    load, last = number(chain.l0 * low), None
    while True:
        start = State.relaxed(chain)
        motion, furthest = Motion(chain, start.tensions, start.draws, 0), MP.inf
        for _ in range(cycles):
            before = len(motion.events)
            furthest = min([furthest, *(abs(motion.reach(way * load)) for way in (1, -1))])
            if len(motion.events) == before:
                break
        else:
            return last / number(chain.l0)
        last, load = furthest, furthest * (1 + MP.mpf(10) ** -8)
