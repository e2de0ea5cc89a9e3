"""Make `near_grazes.json`: starts near those at which an itinerary changes, and what they come to.

A spring of a random chain is stretched more and more until the events change: there a slider
grazes its threshold, all but stops, or two events meet. Each case lies a power of ten from there,
to either side. The certified solver gives the truth.
"""

from __future__ import annotations

import hashlib
import json
import random
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

from exactcreep import Chain, Evidence, Outcome, State, rearrange
from exactcreep.model.contacts import EventKind, Itinerary

SEED = 20110603
CASES = 500
VELOCITY_CASES = 120
"""Behind the others: the velocity of a mover touches zero."""
PER_EDGE = 6
MEETS = 1e-3
"""Two events that change places at an edge are less than that apart 1e-10 from it."""
FILE = Path(__file__).with_name("near_grazes.json")


def stretched(seed: int, extra: Fraction) -> tuple[Chain, State]:
    """Return a random chain one of whose springs is stretched by more."""
    rng = random.Random(seed)
    n = rng.randint(2, 7)
    mu_d = Fraction(rng.choice([5, 50, 100, 300]), 1000)
    mu_s = mu_d + Fraction(rng.choice([20, 100, 300]), 1000)
    sigma = rng.choice(["0", "0.01"])
    chain = Chain(n, 1, mu_d, mu_s, sigma, tan_alpha=mu_d * Fraction(rng.randint(-9, 9), 10))
    unit = Fraction(chain.times_cosine(mu_s))
    tensions = [unit * Fraction(rng.randint(-150, 150), 100) for _ in range(n - 1)]
    tensions[rng.randrange(n - 1)] += extra
    return chain, State.prepared(chain, tensions, seed=SEED)


def digest(itinerary: Itinerary) -> str:
    """Return a name of an itinerary."""
    return hashlib.sha256(repr(itinerary).encode()).hexdigest()[:16]


def edge(seed: int) -> Fraction | None:
    """Return the stretch at which the itinerary changes, to 2**-54; None if there is none."""

    def follow(extra: Fraction) -> Any:
        return rearrange(*stretched(seed, extra), direction=0, seed=SEED, max_events=200)

    low, high = Fraction(0), Fraction(1, 100)
    first, last = follow(low), follow(high)
    at_rest = {first.outcome, last.outcome} == {Outcome.AT_REST}
    if not at_rest or first.itinerary == last.itinerary:
        return None
    for _ in range(48):
        middle = (low + high) / 2
        if follow(middle).itinerary == first.itinerary:
            low = middle
        else:
            high = middle
    return high


def grazes_velocity(seed: int, place: Fraction) -> bool:
    """Return whether a stop appears there: the velocity of a mover touches zero."""
    aside = Fraction(1, 10**10)
    below, above = (
        rearrange(*stretched(seed, extra), direction=0, seed=SEED, max_events=400).events
        for extra in (place - aside, place + aside)
    )
    for event, other in zip(below, above, strict=False):
        if event.signature != other.signature:
            first, later = sorted((event, other), key=lambda e: float(e.time))
            apart = float(later.time) - float(first.time)  # of two that change places: nothing
            return first.kind is EventKind.STOP and apart > MEETS
    return False


def cases(
    count: int, seed: int, edges_seed: int, wanted: Callable[[int, Fraction], bool]
) -> list[dict[str, Any]]:
    """Return so many cases, with the truth, at edges of chains from `edges_seed` + 1 on."""
    rng, found = random.Random(seed), []
    while len(found) < count:
        edges_seed += 1
        place = edge(edges_seed)
        if place is None or not wanted(edges_seed, place):
            continue
        for _ in range(PER_EDGE):
            extra = place + rng.choice([-1, 1]) * Fraction(1, 10 ** rng.randint(4, 17))
            chain, state = stretched(edges_seed, extra)
            truth = rearrange(
                chain, state, direction=0, seed=SEED, solver="certified", digits=25, max_events=400
            )
            if truth.evidence is not Evidence.PROVED or truth.outcome is not Outcome.AT_REST:
                continue
            places = [x.str(25, radius=False) for x in truth.state.displacements.tolist()]
            case = {"seed": edges_seed, "extra": str(extra), "events": digest(truth.itinerary)}
            found.append(case | {"places": places})
    return found[:count]


if __name__ == "__main__":
    of_any_kind = cases(CASES, SEED, 0, lambda seed, place: True)
    last = of_any_kind[-1]["seed"]
    of_velocity = cases(VELOCITY_CASES, SEED + 1, last, grazes_velocity)
    lines = ",\n".join(json.dumps(case) for case in of_any_kind + of_velocity)
    FILE.write_text(f"[\n{lines}\n]\n", encoding="utf-8")
