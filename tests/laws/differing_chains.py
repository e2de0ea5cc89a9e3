"""A hundred random chains that differ, on which the sliding limit is held against `exact`.

``python -m tests.laws.differing_chains`` runs them again and writes ``tests/data/differing.csv``,
one row each. The chains were fixed before any of them was run.
"""

from __future__ import annotations

import math
import warnings
from pathlib import Path
from random import Random

import numpy as np

from exactcreep import Chain, Cycles, PhysicsWarning, creep, laws
from tests.laws.kept import renew

FILE = Path(__file__).parents[1] / "data" / "differing.csv"
SLIPS = 300_000
"""Of each run, roughly."""
SEEDS = 3


def case(number: int) -> tuple[Chain, Cycles]:
    """Return a chain that sticks and slips, and cycles above the threshold of its law."""
    random = Random(f"differing {number}")
    n = random.randint(3, 30)
    mean, jump = random.uniform(0.3, 0.7), random.uniform(0.05, 0.4)

    def about(middle: float) -> str:
        return f"{middle * random.uniform(0.5, 1.5):.4f}"

    friction = [about(mean) for _ in range(n)]
    static = [f"{float(mu) + float(about(mean * jump)):.4f}" for mu in friction]
    ends = ["0", "0"]
    if number % 2:
        ends = [f"{n * mean * random.uniform(-0.2, 0.2):.3f}" for _ in ends]
    sigma = "0" if number % 4 == 0 else f"{mean * jump * random.uniform(0.05, 0.5):.4f}"
    slope = f"{mean * random.uniform(-0.7, 0.7):.4f}"
    chain = Chain(n, 1000, friction, static, sigma, tan_alpha=slope, end_forces=ends)
    try:
        least = laws.differing_intercept(chain.each("mu_d"), chain.tan_alpha, chain.end_forces)
        laws.pivot_sliders(chain.each("mu_d"), chain.tan_alpha, chain.end_forces)
    except ValueError:
        return case(number + 1000)  # friction does not hold it
    beyond = mean * jump * random.choice([3, 6, 12, 25, 50])  # in mean excess
    return chain, Cycles(f"{(float(least) + beyond) / 1000:.6f}", 40)


def measured(number: int) -> dict[str, float]:
    """Return the mean velocity of a chain by `exact`, its standard error, and the law."""
    chain, drive = case(number)
    friction = {"mu_d": chain.each("mu_d"), "tan_alpha": chain.tan_alpha,
                "end_forces": chain.end_forces}  # fmt: skip
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)
        few = creep(chain, drive, seed=number)
        cycles = Cycles(drive.amplitude, min(max(40 * SLIPS // max(few.slip_count, 1), 40), 4000))
        seeds = [number + 1000 * seed for seed in range(SEEDS)]
        values = np.array([creep(chain, cycles, seed=seed).velocity for seed in seeds])
    law = laws.differing_velocity(l0=chain.l0, amplitude=drive.amplitude, **friction)
    gain = chain.l0 * drive.amplitude - laws.differing_intercept(**friction)
    error = float(values.std(ddof=1)) / math.sqrt(SEEDS)
    about = {"velocity": float(values.mean()), "error": error, "law": float(np.mean(law))}
    return about | {"n": chain.n, "gain": float(gain)}


if __name__ == "__main__":
    renew(FILE, lambda row: measured(int(row["number"])))
