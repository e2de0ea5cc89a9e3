"""An independent integration of one whole rearrangement, from the model's equations alone.

The velocities of the moving sliders are power series of forty terms about the beginning of every
short step, in numbers of fifty digits. Events are sign changes of speeds and margins between
samples, refined by Newton's method. Two roots between neighbouring samples would change the order
of events, and every comparison would show it. Nothing of `exactcreep.motion` or
`exactcreep.solvers` is used.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import pairwise
from typing import Any

import mpmath
import numpy as np

from exactcreep.model.chain import Chain
from exactcreep.model.keyed_disorder import static_coefficient

MP = mpmath.MPContext()
MP.dps = 50
ORDER, STEP = 40, MP.mpf(1) / 4
SAMPLES = np.linspace(0, 0.25, 33)[1:]
POWERS = SAMPLES[:, None] ** np.arange(ORDER + 3)
TOGETHER = 1e-10
"""Events closer than this cannot be told apart by floats: the trajectory is refused."""
MOST_EVENTS, LONGEST = 2000, 10_000


class Undecided(Exception):
    """A tie, or its length, keeps a trajectory from being one that floats can be held to."""


@dataclass
class Trajectory:
    """What the integration came to; `exact` are times and displacements to forty digits."""

    ramp: float = 0.0  # l0 (theta_c - theta)
    times: list[float] = field(default_factory=list)
    itinerary: list[tuple[str, tuple[int, ...], tuple[int, ...]]] = field(default_factory=list)
    displacements: np.ndarray = field(default_factory=lambda: np.zeros(0))
    tensions: np.ndarray = field(default_factory=lambda: np.zeros(0))
    draws: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    exact: list[Any] = field(default_factory=list)


def number(value: Any) -> Any:
    """Return a float or a rational to fifty digits."""
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

    def __init__(self, chain: Chain, tensions: Sequence[Any], draws: Any, seed: int) -> None:
        self.chain, self.n, self.seed = chain, chain.n, seed
        slope = number(chain.tan_alpha)
        self.cosine = 1 / MP.sqrt(1 + slope**2)
        pulls = [number(chain.end_forces[0]), *[0] * (self.n - 2), number(chain.end_forces[1])]
        bare = differences([number(tension) for tension in tensions])
        self.force = [a + b + slope * self.cosine for a, b in zip(bare, pulls, strict=True)]
        self.drag = [number(mu) * self.cosine for mu in chain.each("mu_d")]
        self.draws = np.array(draws, dtype=np.int64)
        self.holds = [self.threshold(n) for n in range(self.n)]
        self.place, self.speed = [MP.mpf(0)] * self.n, [MP.mpf(0)] * self.n
        self.way, self.time = [0] * self.n, MP.mpf(0)
        self.events: list[tuple[Any, str, list[int], list[int]]] = []
        if self.beyond():
            self.start(self.beyond())

    def threshold(self, n: int) -> Any:
        drawn = static_coefficient(self.chain, self.seed, n + 1, int(self.draws[n]) - 1)
        return max(number(drawn) * self.cosine, self.drag[n])

    def beyond(self) -> list[int]:
        return [n for n in range(self.n) if abs(self.force[n]) > self.holds[n]]

    def happened(self, kind: str, who: list[int]) -> None:
        self.events.append((self.time, kind, who, [self.way[n] for n in who]))

    def start(self, who: list[int]) -> None:
        for n in who:
            self.way[n] = 1 if self.force[n] > 0 else -1
        self.happened("start", who)

    def stop(self, n: int) -> None:
        """Let a slider stop, and draw; it may start again at once."""
        self.happened("stop", [n])
        self.way[n], self.speed[n] = 0, MP.mpf(0)
        self.draws[n] += 1
        self.holds[n] = self.threshold(n)
        if abs(abs(self.force[n]) - self.holds[n]) < TOGETHER:
            raise Undecided("a slider stops at its threshold")
        if abs(self.force[n]) > self.holds[n]:
            self.start([n])

    def ramp(self, direction: int) -> Any:
        """Change theta until the first slider starts; return by how much ``l0 theta`` changed."""
        expansion = [number(share) for share in self.chain.expansion or [1] * (self.n - 1)]
        rates = [-direction * rate for rate in differences(expansion)]
        away = sorted(
            ((self.holds[n] * abs(rate) - rate * self.force[n]) / rate**2, n)
            for n, rate in enumerate(rates)
            if rate
        )
        if away[1][0] - away[0][0] < TOGETHER:
            raise Undecided("two sliders start together")
        far, first = away[0]
        self.force = [force + rate * far for force, rate in zip(self.force, rates, strict=True)]
        self.start([first])
        if self.holds[first] <= self.drag[first]:  # a slip of length zero
            self.happened("stop", [first])
            self.draws[first] += 1
            self.way[first] = 0
        return direction * far

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

    def conditions(self, rows: list[list[Any]], moved: list[list[Any]]) -> dict[int, list[Any]]:
        """Return what is positive until a slider acts: its speed, or its least margin."""
        found: dict[int, list[Any]] = {}
        for n, way in enumerate(self.way):
            if way:
                series = [way * x for x in rows[n]]
                while abs(series[0]) < 1e-40:  # it has just started
                    series = series[1:]
                found[n] = series
                continue
            if not any(self.way[m] for m in self.beside(n)):
                continue
            grown = [sum(parts) for parts in zip(*(moved[m] for m in self.beside(n)), strict=True)]
            for side in (1, -1):
                found[side * (n + self.n)] = [
                    self.holds[n] - side * self.force[n],
                    *(-side * x for x in grown[1:]),
                ]
        return found

    def go_on(self) -> None:
        """Go on to the next event, or by a step in which there is none."""
        rows = self.velocities()
        moved = [[0, *(x / (k + 1) for k, x in enumerate(row))] for row in rows]
        roots = first_roots(self.conditions(rows, moved))
        if len(roots) > 1 and roots[1][0] - roots[0][0] < TOGETHER:
            raise Undecided("two events together")
        t = roots[0][0] if roots else STEP
        self.time += t
        ways = [value(row, t) for row in moved]
        self.speed = [value(row, t) for row in rows]
        for n in range(self.n):
            self.place[n] += ways[n]
            self.force[n] += sum(ways[m] for m in self.beside(n)) - len(self.beside(n)) * ways[n]
        if roots:
            n = abs(roots[0][1]) % self.n
            if self.way[n]:
                self.stop(n)
            else:
                self.start([n])

    def rest(self) -> None:
        """Go on until all sliders rest."""
        steps = 0
        while any(self.way):
            self.go_on()
            steps += 1
            if steps > LONGEST or len(self.events) > MOST_EVENTS:
                raise Undecided("too long")


def first_roots(functions: dict[int, list[Any]]) -> list[tuple[Any, int]]:
    """Return where functions that begin above zero first change their signs within a step."""
    names = list(functions)
    table = np.zeros((len(names), ORDER + 3))
    for row, name in zip(table, names, strict=True):
        row[: len(functions[name])] = [float(x) for x in functions[name]]
    below = POWERS @ table.T < 0
    found = []
    for j in np.flatnonzero(below.any(axis=0)).tolist():
        series, high = functions[names[j]], MP.mpf(SAMPLES[below[:, j].argmax()])
        rate = [k * x for k, x in enumerate(series)][1:]
        low = high - STEP / len(SAMPLES)
        for _ in range(20):
            middle = (low + high) / 2
            low, high = (middle, high) if value(series, middle) > 0 else (low, middle)
        for _ in range(5):
            high -= value(series, high) / value(rate, high)
        found.append((high, names[j]))
    return sorted(found)


def integrate(
    chain: Chain, tensions: Sequence[Any], draws: Any, direction: int, seed: int
) -> Trajectory:
    """Return the rearrangement that follows a ramp in `direction` (0: none).

    `draws` says how many static coefficients each slider has had; the last of them holds.

    Raises
    ------
    Undecided
        If a tie or its length keeps floats from telling what happens.
    """
    motion = Motion(chain, tensions, draws, seed)
    if direction and motion.events:
        raise Undecided("the chain is not at rest")
    ramp = motion.ramp(direction) if direction else 0
    motion.rest()
    gained = [b - a for a, b in pairwise(motion.place)]
    expansion = chain.expansion or [1] * (chain.n - 1)
    final = [
        number(tension) - ramp * number(share) + more
        for tension, share, more in zip(tensions, expansion, gained, strict=True)
    ]
    times = [time for time, *_ in motion.events]
    return Trajectory(
        ramp=float(ramp),
        times=[float(time) for time in times],
        itinerary=[
            (kind, tuple(n + 1 for n in who), tuple(ways)) for _, kind, who, ways in motion.events
        ],
        displacements=np.array([float(x) for x in motion.place]),
        tensions=np.array([float(x) for x in final]),
        draws=motion.draws,
        exact=[*times, *motion.place],
    )
