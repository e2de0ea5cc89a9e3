"""Enclosures of `certified` hold what power series of sixty digits find, which share no code.

Power series about the beginning of every short step stand for modes and sets of states; sign
changes of the event functions between samples for the search. A root that samples miss would change
the order of events, and fail. No line of `exactcreep` takes part but the chain's parameters.
"""

from __future__ import annotations

import random
from fractions import Fraction
from functools import cache
from itertools import pairwise
from typing import Any

import mpmath
import pytest

from exactcreep import Chain, Evidence, State, rearrange
from exactcreep.model.enclosure import enclosure

MP = mpmath.MPContext()
MP.dps = 60
ORDER, STEP, SAMPLES = 48, MP.mpf(1) / 4, 16
KNOWN = Fraction(1, 10**40)


def rational(value: Fraction) -> Any:
    return MP.mpf(value.numerator) / value.denominator


def value(series: list[Any], t: Any) -> Any:
    return MP.polyval(series[::-1], t)


class Series:
    """A chain without disorder, followed from event to event until it rests."""

    def __init__(self, chain: Chain, tensions: list[Fraction]) -> None:
        self.n, self.time = chain.n, MP.mpf(0)
        slope = rational(chain.tan_alpha)
        cosine = 1 / MP.sqrt(1 + slope**2)
        self.holds, self.drag = rational(chain.mu_s) * cosine, rational(chain.mu_d) * cosine
        bare = [Fraction(0), *tensions, Fraction(0)]
        self.force = [slope * cosine + rational(b - a) for a, b in pairwise(bare)]
        self.place, self.speed = [MP.mpf(0)] * self.n, [MP.mpf(0)] * self.n
        self.way = [0] * self.n
        self.events: list[tuple[str, tuple[int, ...], tuple[int, ...]]] = []
        self.times: list[Any] = []
        self.start([n for n in range(self.n) if abs(self.force[n]) > self.holds])
        while any(self.way):
            self.go_on()

    def happened(self, kind: str, who: list[int]) -> None:
        self.events.append((kind, tuple(n + 1 for n in who), tuple(self.way[n] for n in who)))
        self.times.append(self.time)

    def start(self, who: list[int]) -> None:
        for n in who:
            self.way[n] = 1 if self.force[n] > 0 else -1
        if who:
            self.happened("start", who)

    def beside(self, n: int) -> list[int]:
        return [m for m in (n - 1, n + 1) if 0 <= m < self.n]

    def velocities(self) -> list[list[Any]]:
        """Return the power series of each slider's velocity."""
        rows = [[self.speed[n]] for n in range(self.n)]
        for n, way in enumerate(self.way):
            rows[n].append((self.force[n] - way * self.drag) * abs(way))
        for k in range(ORDER):
            for n, row in enumerate(rows):
                pull = sum(rows[m][k] for m in self.beside(n)) - len(self.beside(n)) * row[k]
                row.append(pull * abs(self.way[n]) / ((k + 1) * (k + 2)))
        return rows

    def go_on(self) -> None:
        """Go on to the next event, or by a step in which there is none."""
        rows = self.velocities()
        moved = [[0, *(x / (k + 1) for k, x in enumerate(row))] for row in rows]
        functions: dict[tuple[int, int], list[Any]] = {}  # positive until a slider acts
        for n, way in enumerate(self.way):
            if way:
                series = [way * x for x in rows[n]]
                functions[n, 0] = series[1:] if self.speed[n] == 0 else series  # over t
                continue
            grown = [sum(parts) for parts in zip(*(moved[m] for m in self.beside(n)), strict=True)]
            for side in (1, -1):
                room = self.holds - side * self.force[n]
                functions[n, side] = [room, *(-side * x for x in grown[1:])]
        first = {who: root for who, f in functions.items() if (root := first_root(f)) is not None}
        who = min(first, key=lambda each: first[each], default=None)
        t = STEP if who is None else first[who]
        self.time += t
        self.speed = [value(row, t) for row in rows]
        ways = [value(row, t) for row in moved]
        for n in range(self.n):
            self.place[n] += ways[n]
            self.force[n] += sum(ways[m] for m in self.beside(n)) - len(self.beside(n)) * ways[n]
        if who is not None and who[1] == 0:
            self.happened("stop", [who[0]])
            self.way[who[0]], self.speed[who[0]] = 0, MP.mpf(0)
            self.start([who[0]] if abs(self.force[who[0]]) > self.holds else [])
        elif who is not None:
            self.start([who[0]])


def first_root(series: list[Any]) -> Any:
    """Return where a function that begins above zero first changes its sign within a step."""
    for k in range(1, SAMPLES + 1):
        high = STEP * k / SAMPLES
        if value(series, high) < 0:
            rate = [j * x for j, x in enumerate(series)][1:]
            low = high - STEP / SAMPLES
            for _ in range(20):
                middle = (low + high) / 2
                low, high = (middle, high) if value(series, middle) > 0 else (low, middle)
            for _ in range(5):
                high -= value(series, high) / value(rate, high)
            return high
    return None


@cache
def cases() -> list[tuple[Chain, list[Fraction]]]:
    rng, found = random.Random(1905), []
    while len(found) < 12:
        n = rng.randint(2, 5)
        mu_d = Fraction(rng.choice([5, 20, 30]), 100)
        mu_s = mu_d + Fraction(rng.choice([5, 10, 20]), 100)
        chain = Chain(n, 1, mu_d, mu_s, 0, tan_alpha=mu_d * Fraction(rng.randint(-9, 9), 10))
        tensions = [Fraction(rng.randint(-150, 150), 100) * mu_s for _ in range(n - 1)]
        result = rearrange(chain, State.prepared(chain, tensions), direction=0)
        if 4 <= len(result.events) <= 40 and not result.undecided:
            found.append((chain, tensions))
    return found


@pytest.mark.parametrize("case", range(12))
def test_power_series_find_the_same_events_within_the_enclosures(case: int) -> None:
    chain, tensions = cases()[case]
    truth = rearrange(chain, State.prepared(chain, tensions), direction=0, solver="certified")
    assert truth.evidence is Evidence.PROVED
    other = Series(chain, tensions)
    assert tuple(other.events) == truth.itinerary
    numbers = [*(event.time for event in truth.events), *truth.state.displacements.tolist()]
    for ball, found in zip(numbers, [*other.times, *other.place], strict=True):
        known = enclosure(ball)
        exact = Fraction(int(MP.nint(found * 2**170)), 2**170)
        assert abs(exact - known.middle) <= known.radius + KNOWN
