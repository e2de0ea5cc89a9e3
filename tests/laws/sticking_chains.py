"""The random chains on which the law of sliders that stick and slip was fitted and judged.

``python -m tests.laws.sticking_chains`` runs them with the solver `exact` and writes
``notebooks/pictures/sticking.csv``, one row each; rows that are there already are kept. That takes
one core a quarter of an hour. The chains were fixed before any of them was run. The law was fitted
on two of three of the first 490. Its deviation was fitted on these as well, then found too small
for the chains that had been held out, and fitted on all that were run by then.
"""

from __future__ import annotations

import math
import sys
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from exactcreep import Chain, Cycles, GaussianSteps, PhysicsWarning, creep
from exactcreep.laws import gaussian_integral, pivots, sticking_gain
from tests.laws.kept import add_rows

FILE = Path(__file__).parents[2] / "notebooks" / "pictures" / "sticking.csv"
L0 = 1000
SLIPS = 500_000
"""Of each run, roughly: it follows as many targets as have them, from 60 to 3000."""
FEWEST, MOST, MOST_SLIPS = 4, 16, 12_000_000
"""Seeds of each chain's disorder, and slips of all: enough for `GOAL`, if they reach it."""
GOAL = 0.01
"""Standard error of a velocity, in units of G."""
BLOCKS = 2
"""Means of each run whose scatter gives the standard error."""


@dataclass(frozen=True)
class Case:
    """A chain and the size of its drive: an amplitude of cycles, or a width of random dilations."""

    number: int
    kind: str
    n: int
    mu_d: str
    mu_s: str
    sigma_mu: str
    tan_alpha: str
    size: str

    @property
    def held_out(self) -> bool:
        """Whether the chain was left out of the fit of the law."""
        return self.number % 3 == 2 or self.number >= 490

    @property
    def chain(self) -> Chain:
        return Chain(
            self.n, L0, self.mu_d, self.mu_s, self.sigma_mu, tan_alpha=Fraction(self.tan_alpha)
        )

    @property
    def parameters(self) -> dict[str, Any]:
        """The chain and its drive, by the names that laws use."""
        name = "sigma_theta" if self.kind == "random" else "amplitude"
        return self.chain.parameters() | {name: Fraction(self.size)}


def cases() -> Iterator[Case]:
    """Yield the chains, the same ones every time.

    N from 4 to 60; x = G/D from 2 to 100, half of them below 8; slopes up to 0.85 mu_d, half of
    them near the end of a plateau; mu_s - mu_d from 0.03 to 2/3 of mu_d; sigma_mu up to
    mu_s - mu_d.
    """
    random = Random("where sliders stick and slip")
    for number in range(640):
        kind = "random" if number % 11 in (3, 8) else "cycles"
        n = round(math.exp(random.uniform(math.log(3.5), math.log(60.5))))
        n = min(max(n, 4), 60)
        mu_d = random.uniform(0.2, 1)
        excess = mu_d * math.exp(random.uniform(math.log(0.03), math.log(2 / 3)))
        slope = random.uniform(0, 0.85) * mu_d
        if random.random() < 0.5:
            k = random.choice([k for k in range(n % 2, n, 2) if k < 0.8 * n])
            slope = abs((k * mu_d + random.uniform(-2, 2) * excess) / n)
            slope = min(slope, 0.85 * mu_d)
        ratio = random.uniform(0.01, 1)
        if random.random() < 0.15 and n >= 8:
            ratio = 0.0
        low, high = random.choice([(2, 8), (8, 100 if n <= 30 else 40)])
        x = math.exp(random.uniform(math.log(low), math.log(high)))
        shape = (n, f"{mu_d:.3f}", f"{mu_d + excess:.4f}", f"{ratio * excess:.4f}", f"{slope:.4f}")
        yield Case(number, kind, *shape, _size(kind, *shape, x))


def _size(kind: str, n: int, mu_d: str, mu_s: str, sigma: str, slope: str, x: float) -> str:
    """Return the amplitude, or width, at which G is x times D."""
    cosine = 1 / math.hypot(1, float(slope))
    gain = x * (float(mu_s) - float(mu_d)) * cosine
    half = n * (float(mu_d) - float(slope)) * cosine / 2
    if kind == "cycles":
        return f"{(gain + half) / L0:.6g}"
    low, high = 0.0, 2 * (gain + half)
    for _ in range(60):
        middle = (low + high) / 2
        less = middle * gaussian_integral(half / middle) < gain
        low, high = (middle, high) if less else (low, middle)
    return f"{high / L0:.6g}"


def run(case: Case) -> dict[str, float]:
    """Return the velocity of a chain with its standard error."""
    chain, gain = case.chain, sticking_gain(case.parameters)
    slips = case.n**2 * max(gain / chain.excess, 1) / 2
    targets = int(np.clip(SLIPS / slips, 60, 3000)) // 2 * 2
    size = Fraction(case.size)
    random = case.kind == "random"
    drive = GaussianSteps(size, targets) if random else Cycles(size, targets // 2)
    skipped = targets // 4 // 2 * 2
    marks = np.linspace(skipped, targets, BLOCKS + 1).astype(int) // 2 * 2
    means = []
    for seed in range(MOST):
        result = creep(chain, drive, seed=seed, record=("x_G",))
        if result.half_cycles < targets:
            print(f"chain {case.number}: {result.outcome.value}, {result.reason}", file=sys.stderr)
            return {"velocity": math.nan, "error": math.nan}
        x_G = np.asarray(result.recorded["x_G"])
        if random:  # the scatter of the dilations is that of the sliding limit, whose mean is known
            limit = creep(chain, drive, seed=seed, solver="sliding", record=("x_G",))
            i = pivots(case.n, chain.tan_alpha, chain.mu_d)[0]
            x_G = x_G - np.asarray(limit.recorded["x_G"])
            x_G += (case.n + 3 - 2 * i) * gain * np.arange(1, targets + 1)
        means += (np.diff(x_G[marks - 1]) / np.diff(marks)).tolist()
        error = np.std(means, ddof=1) / np.sqrt(len(means))
        enough = error <= GOAL * gain or (seed + 1) * targets * slips >= MOST_SLIPS
        if seed + 1 >= FEWEST and enough:
            break
    return {"velocity": float(np.mean(means)), "error": float(error)}


def main() -> None:
    """Run the chains that are not in the file yet."""
    warnings.simplefilter("ignore", PhysicsWarning)  # draws below mu_d belong to the ranges
    known = {case.number: case for case in cases()}
    add_rows(FILE, known, lambda number: vars(known[number]) | run(known[number]))


if __name__ == "__main__":
    main()
