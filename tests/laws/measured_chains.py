"""Random chains and their velocities, on which the law of sticking sliders was fitted and judged.

``python -m tests.laws.measured_chains FILE`` runs the chains of a table again with the solver
`exact`, a quarter of an hour on one core. All were drawn before any of them was run.

``notebooks/pictures/sticking.csv`` has equal sliders: N from 4 to 60; x = G/D from 2 to 100, half
of them below 8; slopes up to 0.85 mu_d, half of them near the end of a plateau; mu_s - mu_d from
0.03 to 2/3 of mu_d; sigma_mu up to mu_s - mu_d. The law was fitted on two of three of the first
490, its deviation on all.

``tests/data/drawn.csv`` has N from 4 to 40, most of them sliders that differ. Half of them lie at
the ends of plateaus. By the last digit of the number, 0 has equal sliders, 1 to 3 nearly so; the
others have end forces (4), two halves (5), one rough slider (6), scattered friction (7), scattered
excess ``mu_s - mu_d`` (8), or all of these (9).
"""

from __future__ import annotations

import math
import sys
import warnings
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from exactcreep import Chain, Cycles, GaussianSteps, State, creep, laws
from exactcreep.results import PhysicsWarning

DRAWN = Path(__file__).parents[1] / "data" / "drawn.csv"
EQUAL = Path(__file__).parents[2] / "notebooks" / "pictures" / "sticking.csv"
FITTED, JUDGED = 400, 600
"""The law was fitted to the drawn chains before the first number, its deviation to those before the
second one. The others were drawn and run when both were known."""
SLIPS, FEWEST, MOST, MOST_SLIPS = 400_000, 6, 16, 6_000_000
"""Of each run, roughly; seeds of each chain; and slips of all, enough for `GOAL` if they can be."""
GOAL = 0.01
"""Standard error of a velocity, in units of G."""


def rows(file: Path) -> dict[int, dict[str, str]]:
    """Return the rows of a table by their numbers."""
    table = pd.read_csv(file, dtype=str)
    return {int(row["number"]): row for row in table.to_dict("records")}


def parameters(row: dict[str, str]) -> dict[str, Any]:
    """Return a chain and its drive, by the names that laws use."""
    size = "sigma_theta" if row["kind"] == "random" else "amplitude"
    chain: dict[str, Any] = {"n": int(row["n"]), "l0": 1000, size: Fraction(row["size"])}
    for name in ("mu_d", "mu_s", "sigma_mu", "tan_alpha", "end_forces"):
        numbers = [Fraction(number) for number in row.get(name, "0 0").split()]
        chain[name] = numbers if len(numbers) > 1 else numbers[0]
    return chain


def measured(row: dict[str, str]) -> dict[str, float]:
    """Return the velocity of a chain with its standard error."""
    about = parameters(row)
    size = about.pop("sigma_theta", None) or about.pop("amplitude")
    chain, random, clean = Chain(**about), row["kind"] == "random", about["sigma_mu"] == 0
    half = float(laws.differing_intercept(chain.each("mu_d"), chain.tan_alpha, chain.end_forces))
    width = float(1000 * size)
    gain = width * float(laws.gaussian_integral(half / width)) if random else width - half
    excess = (sum(chain.each("mu_s")) - sum(chain.each("mu_d"))) / chain.n
    slips = chain.n**2 * max(gain / float(excess), 1) / 2
    targets = int(np.clip(SLIPS / slips, 80, 3000)) // 2 * 2
    drive = GaussianSteps(size, targets) if random else Cycles(size, targets // 2)
    begin = targets // 4 // 2 * 2
    means: list[float] = []
    for seed in range(MOST):
        start = None
        if clean and seed:
            start = State.perturbed(chain, "0.3", start_seed=seed, seed=seed)
        run = creep(chain, drive, seed=seed, start=start, record=("x_G",))
        x_G = np.asarray(run.recorded["x_G"], float)
        if random:  # the scatter of the dilations is that of a play, whose mean is known
            flat = (half + 0.1 / math.hypot(1, 0.1)) * math.hypot(1, 0.1)
            pair = Chain(2, 1000, f"{flat:.12f}", f"{flat:.12f}", tan_alpha="0.1")
            play = creep(pair, drive, seed=seed, solver="sliding", record=("x_G",))
            moved = np.asarray(play.recorded["x_G"], float) - gain * np.arange(1, targets + 1)
            x_G = x_G - (x_G[-1] - x_G[begin - 1]) / (targets - begin) / gain * moved
        means.append((x_G[-1] - x_G[begin - 1]) / (targets - begin))
        error = float(np.std(means, ddof=1) / np.sqrt(len(means))) if seed else math.inf
        enough = error <= GOAL * gain or (seed + 1) * targets * slips >= MOST_SLIPS
        if seed + 1 >= FEWEST and enough:
            break
    return {"velocity": float(np.mean(means)), "error": error}


if __name__ == "__main__":
    warnings.simplefilter("ignore", PhysicsWarning)  # draws below mu_d belong to the ranges
    again = pd.DataFrame([row | measured(row) for row in rows(Path(sys.argv[1])).values()])
    again.to_csv(sys.argv[1], index=False, float_format="%.7g", lineterminator="\n")
