"""The random chains on which the law of sliders that stick and slip was fitted and judged.

``notebooks/pictures/sticking.csv`` has them, one row each; ``python -m tests.laws.sticking_chains``
runs them again with the solver `exact`, a quarter of an hour on one core. The chains were drawn
before any of them was run: N from 4 to 60; x = G/D from 2 to 100, half of them below 8; slopes up
to 0.85 mu_d, half of them near the end of a plateau; mu_s - mu_d from 0.03 to 2/3 of mu_d; sigma_mu
up to mu_s - mu_d. The law was fitted on two of three of the first 490, together with chains that
differ (`drawn_chains`). Its deviation was fitted on all.
"""

from __future__ import annotations

import warnings
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from exactcreep import Chain, Cycles, GaussianSteps, creep
from exactcreep.laws import pivots
from exactcreep.laws.sticking import forces
from exactcreep.results import PhysicsWarning
from tests.laws.kept import Row, renew

FILE = Path(__file__).parents[2] / "notebooks" / "pictures" / "sticking.csv"
CHAIN = ("n", "mu_d", "mu_s", "sigma_mu", "tan_alpha")
SLIPS, FEWEST, MOST, MOST_SLIPS = 500_000, 4, 16, 12_000_000
"""Of each run, roughly; seeds of each chain; and slips of all, enough for `GOAL` if they can be."""
GOAL = 0.01
"""Standard error of a velocity, in units of G, from the means of two halves of each run."""


def parameters(row: Row) -> dict[str, Any]:
    """Return a chain and its drive, by the names that laws use."""
    size = "sigma_theta" if row["kind"] == "random" else "amplitude"
    numbers = {name: Fraction(row[name]) for name in CHAIN}
    return numbers | {"n": int(row["n"]), "l0": 1000, size: Fraction(row["size"])}


def held_out(row: Row) -> bool:
    """Return whether a chain was left out of the fit of the law."""
    return int(row["number"]) % 3 == 2 or int(row["number"]) >= 490


def run(row: Row) -> dict[str, float]:
    """Return the velocity of a chain with its standard error."""
    about = parameters(row)
    gain, random, size = forces(about).gain, row["kind"] == "random", Fraction(row["size"])
    chain = Chain(**{name: about[name] for name in (*CHAIN, "l0")})
    slips = chain.n**2 * max(gain / chain.excess, 1) / 2
    targets = int(np.clip(SLIPS / slips, 60, 3000)) // 2 * 2
    drive = GaussianSteps(size, targets) if random else Cycles(size, targets // 2)
    marks = np.linspace(targets // 4 // 2 * 2, targets, 3).astype(int) // 2 * 2
    means: list[float] = []
    for seed in range(MOST):
        x_G = np.asarray(creep(chain, drive, seed=seed, record=("x_G",)).recorded["x_G"])
        if random:  # the scatter of the dilations is that of the sliding limit, whose mean is known
            limit = creep(chain, drive, seed=seed, solver="sliding", record=("x_G",))
            i = pivots(chain.n, chain.tan_alpha, chain.mu_d)[0]
            x_G = x_G - np.asarray(limit.recorded["x_G"])
            x_G += (chain.n + 3 - 2 * i) * gain * np.arange(1, targets + 1)
        means += (np.diff(x_G[marks - 1]) / np.diff(marks)).tolist()
        error = float(np.std(means, ddof=1) / np.sqrt(len(means)))
        enough = error <= GOAL * gain or (seed + 1) * targets * slips >= MOST_SLIPS
        if seed + 1 >= FEWEST and enough:
            break
    return {"velocity": float(np.mean(means)), "error": error}


if __name__ == "__main__":
    warnings.simplefilter("ignore", PhysicsWarning)  # draws below mu_d belong to the ranges
    renew(FILE, run)
