"""Starts from which rounding decides what happens, with what the certified solver proved of them.

`hard_starts.json` holds near-grazes and near-ties (a power of ten from where the events change),
edges (a few floats from there), hard avalanches, and speeds and forces that touch their edges
within rounding. Edges can be made anew: a tension of a random chain is bisected with the certified
solver down to two neighbouring floats between which the events of the rearrangement change.
"""

from __future__ import annotations

import hashlib
import json
import math
import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import accumulate
from pathlib import Path
from typing import Any

from exactcreep import Chain, Evidence, Outcome, State, rearrange
from exactcreep.model.contacts import Itinerary
from exactcreep.solvers.rearrangement import Rearrangement

FILE = Path(__file__).with_name("hard_starts.json")
OFFSETS = (0.0, 3e-16, 1e-15, 5e-15, -5e-15, 1e-13)
"""Of the tension from the edge, beside one float to either side."""
DIGITS = 25
CLOSE = 1e-11
"""So near the true edge the edge of `exact` is expected; if it is not, there is no case."""


@dataclass(frozen=True)
class Start:
    """A start, and the truth: a name of the events, and the displacements at the end.

    A `direction` of 0 lets the sliders start that exceed their thresholds as the chain stands.
    """

    kind: str
    chain: dict[str, Any]
    tensions: list[Any]
    direction: int
    seed: int
    most_events: int
    events: str = ""
    places: tuple[str, ...] = ()

    def rearranged(self, solver: str = "exact") -> Rearrangement:
        """Return the rearrangement from there."""
        chain = Chain(**self.chain)
        state = State.prepared(chain, self.tensions, seed=self.seed)
        digits = {"digits": DIGITS} if solver == "certified" else {}
        return rearrange(
            chain, state, direction=self.direction, seed=self.seed, solver=solver,
            max_events=self.most_events, **digits,
        )  # fmt: skip

    def proved(self) -> Start | None:
        """Return the start with the truth, if it can be proved."""
        truth = self.rearranged("certified")
        if truth.evidence is not Evidence.PROVED or truth.outcome is not Outcome.AT_REST:
            return None
        places = tuple(x.str(DIGITS, radius=False) for x in truth.state.displacements)
        return replace(self, events=digest(truth.itinerary), places=places)


def stored(kind: str) -> list[Start]:
    """Return the starts of a kind: near-graze, edge, hard, or touch."""
    known = json.loads(FILE.read_text(encoding="utf-8"))
    return [Start(**each) for each in known if each["kind"] == kind]


def digest(itinerary: Itinerary) -> str:
    """Return a name of an itinerary."""
    return hashlib.sha256(repr(itinerary).encode()).hexdigest()[:16]


def short_chain(rng: random.Random) -> Start:
    """Return a random chain of two to eight sliders without disorder."""
    return _drawn(rng, rng.randint(2, 8), "0", 60)


def long_chain(rng: random.Random) -> Start:
    """Return a random chain of up to twenty sliders, with or without disorder."""
    return _drawn(rng, rng.randint(6, 20), rng.choice(["0", "0.002", "0.01"]), 320)


def _drawn(rng: random.Random, n: int, sigma: str, most_events: int) -> Start:
    """Return a random chain: thresholds above friction by 0.001 to 1, at rest or unstable."""
    mu_d = Fraction(rng.choice([5, 50, 100, 300, 500, 500, 700]), 1000)
    above = Fraction(round(10 ** rng.uniform(0, 3)), 1000)
    tangent = mu_d * Fraction(rng.randint(-99, 99), 100)
    known = {"n": n, "l0": 1000, "mu_d": str(mu_d), "mu_s": str(mu_d + above), "sigma_mu": sigma,
             "tan_alpha": str(tangent)}  # fmt: skip
    chain = Chain(**known)
    limit = chain.times_cosine(chain.mu_s)
    direction = rng.choice([-1, 0, 1, 1])
    reach = 1.05 if direction == 0 else 1.0
    while True:  # forces that friction holds (or hardly), and that sum to the weight
        forces = [rng.uniform(-reach, reach) * limit for _ in range(n)]
        mean = sum(forces) / n
        forces = [f - mean + chain.sin_alpha for f in forces]
        if max(map(abs, forces)) <= reach * limit:
            break
        reach *= 1.02
    tensions = [*accumulate(force - chain.sin_alpha for force in forces[:-1])]
    return Start("edge", known, tensions, direction, rng.randrange(10**6), most_events)


def edges(seed: int, count: int, drawn: Callable[[random.Random], Start]) -> Iterator[Start]:
    """Yield the starts next to so many new edges, with their truth."""
    rng, found = random.Random(seed), 0
    while found < count:
        start = drawn(rng)
        spring = rng.randrange(len(start.tensions))

        def at(tension: float, start: Start = start, spring: int = spring) -> Start:
            tensions = [*start.tensions[:spring], tension, *start.tensions[spring + 1 :]]
            return replace(start, tensions=tensions)

        limit = Chain(**start.chain).times_cosine(Fraction(1))
        low = start.tensions[spring]
        high = low + 10 ** rng.uniform(-4, -0.5) * limit * rng.choice([-1, 1])
        low, high = _halved(at, low, high, "exact", CLOSE / 2)
        way = math.copysign(CLOSE, high - low)
        low, high = _halved(at, low - way, high + way, "certified", 0.0)
        if math.isnan(high):
            continue
        found += 1
        near = [high + offset for offset in OFFSETS]
        near += [math.nextafter(high, math.inf), math.nextafter(high, -math.inf)]
        yield from (start for tension in near if (start := at(tension).proved()))


def _halved(
    at: Callable[[float], Start], low: float, high: float, solver: str, apart: float
) -> tuple[float, float]:
    """Return two tensions between which the events change, so far apart or neighbouring floats."""
    if math.isnan(low):
        return math.nan, math.nan
    first, last = (at(tension).rearranged(solver) for tension in (low, high))
    at_rest = {first.outcome, last.outcome} == {Outcome.AT_REST}
    if not at_rest or first.itinerary == last.itinerary:
        return math.nan, math.nan
    while abs(high - low) > apart and (middle := low + (high - low) / 2) not in (low, high):
        if at(middle).rearranged(solver).itinerary == first.itinerary:
            low = middle
        else:
            high = middle
    return low, high
