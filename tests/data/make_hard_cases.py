"""Make `hard_cases.json`: near-grazes, near-ties and long avalanches, with what was proved of them.

The certified solver gives the truth: the itinerary and the final displacements to 25 digits.
"""

from __future__ import annotations

import json
import random
from fractions import Fraction
from pathlib import Path
from typing import Any

from exactcreep import Chain, Evidence, Outcome, State, rearrange

SEED = 20110603
FILE = Path(__file__).with_name("hard_cases.json")


def candidates() -> list[tuple[str, Chain, list[Fraction], int]]:
    rng = random.Random(SEED)
    found: list[tuple[str, Chain, list[Fraction], int]] = []
    for k in (2, 3):  # slider 1 exceeds its threshold during 10^(-k/2) only
        slope = Fraction(1, 2) + Fraction(1, 10**k)
        chain = Chain(2, 1, "0.5", "0.6", tan_alpha=slope)
        found.append((f"near-graze 10^-{k}", chain, [Fraction(0)], 1))
    for k in range(2, 15):  # both ends start 10^-k apart
        chain = Chain(4, 1, "0.5", "0.6", tan_alpha=0)
        start = [Fraction(1, 10**k), Fraction(0), Fraction(0)]
        found.append((f"near-tie 10^-{k}", chain, start, 1))
    for number in range(12):  # an avalanche set off far from equilibrium, below mu_d
        n = rng.choice([3, 5, 8])
        chain = Chain(n, 1, "0.3", "0.5", "0.01", tan_alpha=Fraction(rng.randint(-9, 9), 100))
        start = [Fraction(rng.randint(-200, 200), 100) for _ in range(n - 1)]
        found.append((f"long run {number}", chain, start, 0))
    for k in (3, 6, 9, 12, 15):  # just below mu_d friction takes next to nothing
        for n in (2, 3):
            slope = Fraction(1, 2) - Fraction(1, 10**k)
            chain = Chain(n, 1, "0.5", "0.6", "0.01", tan_alpha=slope)
            found.append((f"mu_d - 10^-{k}, n = {n}", chain, [Fraction(0)] * (n - 1), 1))
    for number in range(6):  # half of all static coefficients act as mu_d
        n = rng.choice([3, 5])
        chain = Chain(n, 1, "0.5", "0.5", "0.1", tan_alpha=Fraction(rng.randint(-30, 30), 100))
        start = [Fraction(rng.randint(-100, 100), 100) for _ in range(n - 1)]
        found.append((f"draws below mu_d {number}", chain, start, rng.choice([-1, 0, 1])))
    return found


def described(
    label: str, chain: Chain, start: list[Fraction], direction: int
) -> dict[str, Any] | None:
    state = State.prepared(chain, start, seed=SEED)
    truth = rearrange(
        chain, state, direction=direction, seed=SEED, solver="certified", digits=30,
        max_events=1000, max_seconds=20,
    )  # fmt: skip
    if truth.evidence is not Evidence.PROVED or truth.outcome is Outcome.LIMIT:
        return None
    ends = truth.outcome is Outcome.AT_REST
    return {
        "label": label,
        "seed": SEED,
        "chain": {name: str(value) for name, value in chain.parameters().items()},
        "start": [str(value) for value in start],
        "direction": direction,
        "outcome": truth.outcome.value,
        "itinerary": [[kind, list(who), list(how)] for kind, who, how in truth.itinerary],
        "displacements": [x.str(25, radius=False) for x in truth.state.displacements] * ends,
    }


if __name__ == "__main__":
    cases = [case for one in candidates() if (case := described(*one)) is not None]
    FILE.write_text(json.dumps(cases, indent=0) + "\n", encoding="utf-8")
    print(len(cases), "cases,", sum(len(case["itinerary"]) for case in cases), "events")
