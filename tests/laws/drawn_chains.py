"""Random chains, most of them with sliders that differ, on which the law was fitted and judged.

``python -m tests.laws.drawn_chains`` runs them again with the solver `exact` and writes
``tests/data/drawn.csv``, one row each. The chains were drawn before any of them was run. Half of
them lie at the ends of plateaus; of ten chains, one is of equal sliders, three are nearly so, and
the others have end forces, two halves, one rough slider, scattered friction, scattered excess
``mu_s - mu_d``, or all of these.
"""

from __future__ import annotations

import math
import warnings
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from exactcreep import Chain, Cycles, GaussianSteps, State, creep, laws
from exactcreep.results import PhysicsWarning
from tests.laws.kept import renew

FILE = Path(__file__).parents[1] / "data" / "drawn.csv"
FITTED, JUDGED = 400, 600
"""The law was fitted to the chains before the first number, its deviation to those before the
second one. The others were drawn and run when both were known."""
SLIPS, FEWEST, MOST, MOST_SLIPS = 400_000, 6, 16, 6_000_000
"""Of each run, roughly; seeds of each chain; and slips of all, enough for `GOAL` if they can be."""
GOAL = 0.01
"""Standard error of a velocity, in units of G."""


def case(number: int) -> dict[str, Any]:
    """Return a chain and its drive, by the names that laws use."""
    random, kind = Random(f"drawn {number}"), number % 10
    n, mean = random.randint(4, 40), random.uniform(0.3, 0.7)
    jump = mean * math.exp(random.uniform(math.log(0.04), math.log(0.6)))
    clean = n >= 8 and random.random() < 0.35
    sigma = 0.0 if clean else jump * math.exp(random.uniform(math.log(0.03), 0))
    friction, excess, ends = [mean] * n, [jump] * n, [0.0, 0.0]
    if kind in (1, 2, 3):
        part = random.choice([1e-3, 0.01, 0.03])
        friction = [mean * (1 + part * random.uniform(-1, 1)) for _ in friction]
    if kind in (4, 9):
        ends = [n * mean * random.uniform(-0.15, 0.15) for _ in ends]
    if kind == 5:
        friction = [mean * (1.3 if k < n * 0.5 else 0.7) for k in range(n)]
        if random.random() < 0.5:
            friction.reverse()
    if kind == 6:
        friction[random.randrange(n)] *= random.uniform(2, min(n / 2, 8))
    if kind in (7, 9):
        part = random.uniform(0.05, 0.5)
        friction = [mean * (1 + part * random.uniform(-1, 1)) for _ in friction]
    if kind in (8, 9):
        part = random.uniform(0.1, 0.6)
        excess = [jump * (1 + part * random.uniform(-1, 1)) for _ in excess]
    total, slope = sum(friction), random.uniform(-0.8, 0.8)
    if kind < 4 or random.random() < 0.2:  # at the end of a plateau, or half a window beside it
        steps = [below for k in range(n + 1)
                 if abs(below := sum(friction[k:]) - sum(friction[:k])) < 0.78 * total]  # fmt: skip
        slope = (random.choice(steps) + jump * random.choice([0, random.uniform(-1, 1)])) / total
    tan = (slope * total - sum(ends)) / n
    cosine = 1 / math.hypot(1, tan)
    ends = [end * cosine for end in ends]
    unit = jump * cosine
    least = max(2, 12 / n, 1 / (1 - min(abs(slope), 0.8))) * unit
    half = total * cosine * (1 - abs(slope)) / 2
    random_steps = random.random() < 0.25
    if clean and not random_steps:
        least = max(least, half)
    gain = max(least * 1.02, math.exp(random.uniform(math.log(2), math.log(60))) * unit)
    drive = {"amplitude": round(half + gain, 4) / 1000}
    if random_steps:
        low, high = 0.0, 20 * (half + gain)
        for _ in range(60):
            width = (low + high) / 2
            far = width * float(laws.gaussian_integral(half / width)) > gain
            low, high = (low, width) if far else (width, high)
        drive = {"sigma_theta": round(high, 4) / 1000}
    rounded = [round(mu, 6) for mu in friction]
    above = [round(mu + more, 6) for mu, more in zip(rounded, excess, strict=True)]
    chain = {"n": n, "l0": 1000, "mu_d": rounded, "mu_s": above, "sigma_mu": round(sigma, 6)}
    if kind == 0:
        chain |= {"mu_d": rounded[0], "mu_s": above[0]}
    return chain | {"tan_alpha": round(tan, 6), "end_forces": [round(f, 6) for f in ends]} | drive


def chain_of(about: dict[str, Any]) -> Chain:
    names = ("n", "l0", "mu_d", "mu_s", "sigma_mu", "tan_alpha", "end_forces")
    return Chain(**{name: as_text(about[name]) for name in names})


def as_text(value: Any) -> Any:
    """Return numbers as decimals, which a chain takes exactly."""
    if isinstance(value, list):
        return [as_text(one) for one in value]
    return value if isinstance(value, int) else f"{float(value):.8f}"


def measured(about: dict[str, Any]) -> dict[str, float]:
    """Return the velocity of a chain with its standard error, and G."""
    chain = chain_of(about)
    clean, random = about["sigma_mu"] == 0, "sigma_theta" in about
    half = float(laws.differing_intercept(chain.each("mu_d"), chain.tan_alpha, chain.end_forces))
    size = f"{float(about['sigma_theta' if random else 'amplitude']):.9f}"
    width = 1000 * float(size)
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
    return {"velocity": float(np.mean(means)), "error": error, "gain": gain}


if __name__ == "__main__":
    warnings.simplefilter("ignore", PhysicsWarning)  # draws below mu_d belong to the ranges
    renew(FILE, lambda row: measured(case(int(row["number"]))))
