"""Make `edges.json`: starts within a few floats of an edge of the itinerary, and what they come to.

One tension of a random chain is bisected with the certified solver down to two neighbouring floats
between which the events of the rearrangement change: there a slider grazes its threshold, all but
stops, or two events meet. The starts of an edge lie a few floats to either side of it.
"""

from __future__ import annotations

import hashlib
import json
import math
import random
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Any

from exactcreep import Chain, Evidence, Outcome, State, rearrange
from exactcreep.model.contacts import Itinerary
from exactcreep.solvers.rearrangement import Rearrangement

FILE = Path(__file__).with_name("edges.json")
SEED = 84061303
EDGES = 25
OFFSETS = (0.0, 3e-16, 1e-15, 5e-15, -5e-15, 1e-13)
"""Of the tension from the edge, beside one float to either side."""
DIGITS = 25
CLOSE = 1e-11
"""So near the true edge the edge of `exact` is expected; if it is not, there is no case."""


@dataclass(frozen=True)
class Begun:
    """A chain, a start at rest, the spring whose tension is varied, and where the ramp leads.

    A `direction` of 0 lets the sliders start that exceed their thresholds as the chain stands.
    """

    chain: dict[str, Any]
    tensions: list[float]
    spring: int
    direction: int
    seed: int
    most_events: int

    def at(self, tension: float) -> tuple[Chain, State]:
        """Return the chain, and the start with this tension of the spring."""
        chain = Chain(**self.chain)
        tensions = [*self.tensions]
        tensions[self.spring] = tension
        return chain, State.prepared(chain, tensions, seed=self.seed)

    def rearranged(self, tension: float, solver: str = "exact", **options: Any) -> Rearrangement:
        """Return the rearrangement from there."""
        if solver == "certified":
            options["digits"] = DIGITS
        return rearrange(
            *self.at(tension), direction=self.direction, seed=self.seed, solver=solver,
            max_events=self.most_events, **options,
        )  # fmt: skip


@dataclass(frozen=True)
class Start:
    """One start next to an edge, and the truth: the events, and the displacements at the end."""

    begun: Begun
    tension: float
    offset: str
    events: str
    places: list[str]


def digest(itinerary: Itinerary) -> str:
    """Return a name of an itinerary."""
    return hashlib.sha256(repr(itinerary).encode()).hexdigest()[:16]


def short_chain(rng: random.Random) -> Begun:
    """Return a random chain of two to eight sliders without disorder."""
    return _drawn(rng, rng.randint(2, 8), "0", 60)


def long_chain(rng: random.Random) -> Begun:
    """Return a random chain of up to twenty sliders, with or without disorder."""
    return _drawn(rng, rng.randint(6, 20), rng.choice(["0", "0.002", "0.01"]), 320)


def _drawn(rng: random.Random, n: int, sigma: str, most_events: int) -> Begun:
    """Return a random chain: thresholds above friction by 0.001 to 1, at rest or unstable."""
    mu_d = Fraction(rng.choice([5, 50, 100, 300, 500, 500, 700]), 1000)
    above = Fraction(round(10 ** rng.uniform(0, 3)), 1000)
    tangent = mu_d * Fraction(rng.randint(-99, 99), 100)
    known = {"n": n, "l0": 1000, "mu_d": str(mu_d), "mu_s": str(mu_d + above), "sigma_mu": sigma}
    chain = Chain(**known, tan_alpha=str(tangent))
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
    tensions, tension = [], 0.0
    for force in forces[:-1]:
        tension += force - chain.sin_alpha
        tensions.append(tension)
    spring = rng.randrange(n - 1)
    known["tan_alpha"] = str(tangent)
    return Begun(known, tensions, spring, direction, rng.randrange(10**6), most_events)


def edge(begun: Begun, rng: random.Random) -> float | None:
    """Return the tension of the spring next to which the events change; None if none is found."""
    low = begun.tensions[begun.spring]
    span = 10 ** rng.uniform(-4, -0.5) * Chain(**begun.chain).times_cosine(Fraction(1))
    low, high = _halved(begun, low, low + span * rng.choice([-1, 1]), "exact", CLOSE / 2)
    if math.isnan(low):
        return None
    way = math.copysign(CLOSE, high - low)
    low, high = _halved(begun, low - way, high + way, "certified", 0.0)
    return None if math.isnan(low) else high


def _halved(
    begun: Begun, low: float, high: float, solver: str, apart: float
) -> tuple[float, float]:
    """Return two tensions between which the events change, so far apart or neighbouring floats."""
    first, last = (begun.rearranged(t, solver) for t in (low, high))
    at_rest = {first.outcome, last.outcome} == {Outcome.AT_REST}
    if not at_rest or first.itinerary == last.itinerary:
        return math.nan, math.nan
    while abs(high - low) > apart:
        middle = low + (high - low) / 2
        if middle in (low, high):
            break
        if begun.rearranged(middle, solver).itinerary == first.itinerary:
            low = middle
        else:
            high = middle
    return low, high


def starts_at(begun: Begun, tension: float) -> Iterator[Start]:
    """Yield the starts next to an edge whose truth is proved."""
    near = {f"{offset:+g}": tension + offset for offset in OFFSETS}
    near["next"] = math.nextafter(tension, math.inf)
    near["last"] = math.nextafter(tension, -math.inf)
    for offset, moved in near.items():
        truth = begun.rearranged(moved, "certified")
        if truth.evidence is Evidence.PROVED and truth.outcome is Outcome.AT_REST:
            places = [x.str(DIGITS, radius=False) for x in truth.state.displacements.tolist()]
            yield Start(begun, moved, offset, digest(truth.itinerary), places)


def starts(seed: int, edges: int, drawn: Any = short_chain) -> Iterator[Start]:
    """Yield the starts next to so many edges."""
    rng, found = random.Random(seed), 0
    while found < edges:
        begun = drawn(rng)
        place = edge(begun, rng)
        if place is not None:
            found += 1
            yield from starts_at(replace(begun), place)


def read(text: str) -> list[Start]:
    """Return the starts of a file."""
    return [Start(**known | {"begun": Begun(**known["begun"])}) for known in json.loads(text)]


if __name__ == "__main__":
    lines = ",\n".join(json.dumps(asdict(start)) for start in starts(SEED, EDGES))
    FILE.write_text(f"[\n{lines}\n]\n", encoding="utf-8")
