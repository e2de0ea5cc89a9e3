"""Enclosures of `certified`, held against those of interval arithmetic that shares no code with it.

Intervals of mpmath for python-flint's balls; power series about the beginning of every short step
for modes and sets of states; bisection until one event function is monotonic for the search. No
line of `exactcreep` takes part but the chain's parameters.
"""

from __future__ import annotations

import random
from fractions import Fraction
from functools import cache
from itertools import pairwise
from typing import Any

import pytest
from mpmath.ctx_iv import MPIntervalContext

from exactcreep import Chain, Evidence, State, rearrange

ORDER = 36
STEP = Fraction(1, 4)
IV: Any = MPIntervalContext()
IV.dps = 60


def rational(value: Fraction) -> Any:
    return IV.mpf(value.numerator) / value.denominator


class Intervals:
    """A chain without disorder, followed in intervals from event to event."""

    def __init__(self, chain: Chain, tensions: list[Fraction]) -> None:
        self.n, self.time = chain.n, IV.mpf(0)
        cosine = 1 / IV.sqrt(1 + rational(chain.tan_alpha) ** 2)
        self.holds, self.drag = rational(chain.mu_s) * cosine, rational(chain.mu_d) * cosine
        weight = rational(chain.tan_alpha) * cosine
        bare = [Fraction(0), *tensions, Fraction(0)]
        self.force = [weight + rational(b - a) for a, b in pairwise(bare)]
        self.place = [IV.mpf(0)] * self.n
        self.speed = [IV.mpf(0)] * self.n
        self.way = [0] * self.n
        self.fresh: set[int] = set()
        self.events: list[tuple[str, tuple[int, ...], tuple[int, ...]]] = []
        self.times: list[Any] = []
        pulled = [(n, self.pulled(n)) for n in range(self.n)]
        self.start([(n, way) for n, way in pulled if way])

    def pulled(self, n: int) -> int:
        """Return the direction in which a slider at rest starts."""
        for way in (1, -1):
            beyond = way * self.force[n] - self.holds
            assert beyond > 0 or beyond < 0
            if beyond > 0:
                return way
        return 0

    def happened(self, kind: str, who: list[tuple[int, int]]) -> None:
        sliders, ways = zip(*who, strict=True)
        self.events.append((kind, tuple(n + 1 for n in sliders), ways))
        self.times.append(self.time)

    def start(self, who: list[tuple[int, int]]) -> None:
        for n, way in who:
            self.way[n] = way
            self.fresh.add(n)
        self.happened("start", who)

    def series(self) -> list[list[Any]]:
        """Return coefficients of the velocities, and a bound of what is left out up to `STEP`."""
        moving = [n for n in range(self.n) if self.way[n]]
        zero = IV.mpf(0)
        pulls = [self.force[n] - self.way[n] * self.drag for n in range(self.n)]
        rows = [self.speed, [pulls[n] if n in moving else zero for n in range(self.n)]]
        for k in range(ORDER - 2):
            row = [zero] * self.n
            for n in moving:
                beside = [m for m in (n - 1, n + 1) if 0 <= m < self.n]
                bent = sum((rows[k][m] for m in beside), zero) - len(beside) * rows[k][n]
                row[n] = bent / ((k + 1) * (k + 2))
            rows.append(row)
        # no power of K lengthens a vector, by its largest entry, more than that of 4
        most = max(abs(x).b for x in [*rows[0], *rows[1]])
        rest = IV.mpf(most) * 3 * IV.mpf(2) ** ORDER / IV.factorial(ORDER)
        rest = IV.mpf([-rest.b, rest.b])
        return [*rows, [rest if n in moving else zero for n in range(self.n)]]

    def functions(self, rows: list[list[Any]]) -> dict[tuple[int, int], list[Any]]:
        """Return polynomials that are positive until a slider stops (0) or starts (+1, -1)."""
        out = {}
        for n in range(self.n):
            beside = [m for m in (n - 1, n + 1) if 0 <= m < self.n and self.way[m]]
            if self.way[n]:
                speed = [self.way[n] * row[n] for row in rows]
                out[n, 0] = speed[1:] if n in self.fresh else speed  # over t: it began at rest
            elif beside:
                for way in (1, -1):
                    rates = [sum((row[m] for m in beside), IV.mpf(0)) for row in rows]
                    grown = [-way * rate / (k + 1) for k, rate in enumerate(rates)]
                    out[n, way] = [self.holds - way * self.force[n], *grown]
        return out

    def pass_by(self, rows: list[list[Any]], t: Any) -> None:
        """Let a time pass."""
        self.time = self.time + t
        grown = [[x / (k + 1) for x in row] for k, row in enumerate(rows)]
        ways = [value([row[n] for row in grown], t) * t for n in range(self.n)]
        for n in range(self.n):
            if self.way[n]:
                self.speed[n] = value([row[n] for row in rows], t)
            self.place[n] = self.place[n] + ways[n]
            for m in (n - 1, n + 1):
                if 0 <= m < self.n:
                    self.force[n] = self.force[n] + ways[m] - ways[n]
        self.fresh.clear()

    def step(self) -> None:
        """Go on to the next event, or by a time in which there is none."""
        rows, length = self.series(), STEP
        functions = self.functions(rows)
        while True:
            span = IV.mpf([0, length.numerator]) / length.denominator
            near = [who for who, f in functions.items() if not value(f, span) > 0]
            if not near:
                return self.pass_by(rows, rational(length))
            if len(near) == 1:
                root = only_root(functions[near[0]], rational(length))
                if root is not None:
                    return self.act(rows, root, *near[0])
            length /= 2
            assert length > Fraction(1, 2**60), "what comes first is not told apart"

    def act(self, rows: list[list[Any]], root: Any, n: int, way: int) -> None:
        self.pass_by(rows, root)
        if way:
            return self.start([(n, way)])
        before = self.way[n]
        self.way[n] = 0
        self.speed[n] = IV.mpf(0)
        self.happened("stop", [(n, before)])
        if back := self.pulled(n):
            self.start([(n, back)])
        return None


def value(poly: list[Any], t: Any) -> Any:
    total = IV.mpf(0)
    for x in reversed(poly):
        total = total * t + x
    return total


def only_root(poly: list[Any], end: Any) -> Any:
    """Return an enclosure of the root before `end`, None if it is not proved to be the only one."""
    rate = [k * x for k, x in enumerate(poly)][1:]
    span = IV.mpf([0, end.b])
    # the last term is no coefficient but a bound: that of its derivative is taken as generously
    rate[-1] = rate[-1] * 4 / end
    falls = value(rate, span) < 0
    if not (falls and value(poly, end) < 0 and value(poly, IV.mpf(0)) > 0):
        return None
    for _ in range(12):
        middle = IV.mpf(span.mid)
        nearer = middle - value(poly, middle) / value(rate, span)
        low, high = max(span.a, nearer.a), min(span.b, nearer.b)
        span = IV.mpf([low, high])
    return span


@cache
def cases() -> list[tuple[Chain, list[Fraction]]]:
    rng, found = random.Random(1905), []
    while len(found) < 7:
        n = rng.randint(2, 4)
        mu_d = Fraction(rng.choice([5, 20, 30]), 100)
        mu_s = mu_d + Fraction(rng.choice([5, 10, 20]), 100)
        chain = Chain(n, 1, mu_d, mu_s, 0, tan_alpha=mu_d * Fraction(rng.randint(-9, 9), 10))
        tensions = [Fraction(rng.randint(-150, 150), 100) * mu_s for _ in range(n - 1)]
        result = rearrange(chain, State.prepared(chain, tensions), direction=0)
        if 4 <= len(result.events) <= 40 and not result.undecided:
            found.append((chain, tensions))
    return found


@pytest.mark.parametrize("case", range(7))
def test_intervals_that_share_no_code_find_the_same_events_at_the_same_times(case: int) -> None:
    chain, tensions = cases()[case]
    truth = rearrange(chain, State.prepared(chain, tensions), direction=0, solver="certified")
    assert truth.evidence is Evidence.PROVED
    other = Intervals(chain, tensions)
    while any(other.way):
        other.step()
    assert tuple(other.events) == truth.itinerary
    numbers = [*(event.time for event in truth.events), *truth.state.displacements.tolist()]
    for ball, interval in zip(numbers, [*other.times, *other.place], strict=True):
        if isinstance(ball, (int, float)):
            assert interval.a == interval.b == ball
            continue
        low, high = (Fraction(*part) for part in bounds(interval))
        assert high - low < Fraction(1, 10**25)  # the second opinion is a sharp one
        middle, radius = exactly(ball.mid()), exactly(ball.rad())
        assert low - radius <= middle <= high + radius


def exactly(ball: Any) -> Fraction:
    mantissa, exponent = ball.man_exp()
    return int(mantissa) * Fraction(2) ** int(exponent)


def bounds(interval: Any) -> list[tuple[int, int]]:
    """Return both ends of an interval as ratios."""
    ends = []
    for sign, mantissa, exponent, _ in interval._mpi_:
        number = (-1) ** sign * int(mantissa) * Fraction(2) ** int(exponent)
        ends.append((number.numerator, number.denominator))
    return ends
