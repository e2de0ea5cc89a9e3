"""The random chains on which the law of sliders that stick and slip was fitted and judged.

``python -m tests.laws.sticking_chains`` runs them with the solver `exact` and writes
``notebooks/pictures/sticking.csv``, one row each; rows that are there already are kept. That takes
one core about an hour. The chains were fixed before any of them was run: 140 within the law's
range, 60 of which one quantity lies beyond it, and 40 under random dilations; the law's constant
was fitted on the first 140 of an even number; the odd ones judge it. When the law was fixed, 30
more were drawn from all that `beyond_sticking` lets pass.
"""

from __future__ import annotations

import csv
import sys
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from random import Random

import numpy as np
from numpy.typing import NDArray

from exactcreep import Chain, Creep, Cycles, GaussianSteps, PhysicsWarning, creep
from exactcreep.laws import (
    beyond_sticking,
    gaussian_integral,
    pivots,
    threshold_amplitude,
)

FILE = Path(__file__).parents[2] / "notebooks" / "pictures" / "sticking.csv"
L0 = 1000
SEEDS = 4
"""Of the disorder, per chain."""
MOST_SLIPS = 1_000_000
"""Of each run, roughly: it follows as many targets as have them, 60 at least."""
BLOCKS = 4
"""Means of each run whose scatter gives the standard error."""
RANGES = {
    "n": (4, 32),
    "mu_d": (0.3, 0.7),
    "excess": (0.05, 0.2),
    "slope": (0.08, 0.8),
    "sigma_mu": (0.003, 0.02),
    "drive": (2.0, 8.0),
}
"""Of N, mu_d, mu_s - mu_d, tan_alpha/mu_d, sigma_mu, and the amplitude in units of Eq. 22."""
BEYOND = {
    "n": ((2, 3), (33, 48)),
    "mu_d": ((0.15, 0.3), (0.7, 1.0)),
    "excess": ((0.01, 0.05), (0.2, 0.5)),
    "slope": ((0.02, 0.08), (0.8, 0.95)),
    "sigma_mu": ((0.0, 0.003), (0.02, 0.06)),
    "drive": ((1.1, 2.0), (8.0, 12.0)),
}
"""Intervals beyond each end of them."""


@dataclass(frozen=True)
class Case:
    """A chain and its drive: `drive` is the amplitude, or the width, in units of Eq. 22."""

    number: int
    kind: str
    n: int
    mu_d: str
    mu_s: str
    sigma_mu: str
    tan_alpha: str
    drive: str

    @property
    def chain(self) -> Chain:
        return Chain(
            self.n, L0, self.mu_d, self.mu_s, self.sigma_mu, tan_alpha=Fraction(self.tan_alpha)
        )

    @property
    def size(self) -> Fraction:
        """The amplitude of the cycles, or the width of the random dilations."""
        chain = self.chain
        star = threshold_amplitude(n=self.n, l0=L0, mu_d=float(chain.mu_d),
                                   tan_alpha=float(chain.tan_alpha))  # fmt: skip
        return Fraction(f"{float(self.drive) * star:.6g}")

    @property
    def gain(self) -> float:
        """G: what a plateau of one slider more advances per half-cycle or target."""
        chain, reach = self.chain, L0 * float(self.size)
        margin = self.n * chain.cos_alpha * float(chain.mu_d - chain.tan_alpha) / 2
        if self.kind == "random":
            return float(reach * gaussian_integral(margin / reach))
        return reach - margin


def cases() -> Iterator[Case]:
    """Yield the chains, the same ones every time."""
    yield from _cases_fixed_beforehand()
    yield from _cases_of_the_stated_range()


def _cases_of_the_stated_range() -> Iterator[Case]:
    random, number = Random("where the law says that it holds"), 240
    while number < 270:
        n, drive = random.randint(4, 32), random.uniform(2, 12)
        mu_d = random.uniform(0.2, 1)
        excess = random.uniform(0.02, 2 / 3 * mu_d)
        sigma_mu = random.choice([0.0, random.uniform(0, 0.4 * excess)])
        slope = random.uniform(0, 0.8 * mu_d)
        case = Case(
            number, "stated", n, f"{mu_d:.3f}", f"{mu_d + excess:.3f}", f"{sigma_mu:.4f}",
            f"{slope:.4f}", f"{drive:.2f}",
        )  # fmt: skip
        if not beyond_sticking(case.chain.parameters() | {"amplitude": case.size}):
            yield case
            number += 1


def _cases_fixed_beforehand() -> Iterator[Case]:
    random = Random("where a plateau ends")
    beyond = [(name, side) for name in BEYOND for side in (0, 1)]
    kinds = ["within"] * 140 + [*(f"{name} {'<>'[side]}" for name, side in beyond)] * 5
    for number, kind in enumerate(kinds + ["random"] * 40):
        spans = dict(RANGES)
        if kind[-1] in "<>":
            name = kind.split()[0]
            spans[name] = BEYOND[name]["<>".index(kind[-1])]
        low, high = spans.pop("n")
        n = random.randint(int(low), int(high))
        drawn = {name: random.uniform(*span) for name, span in spans.items()}
        mu_d = f"{drawn['mu_d']:.3f}"
        yield Case(
            number, kind, n, mu_d, f"{float(mu_d) + drawn['excess']:.3f}",
            f"{drawn['sigma_mu']:.4f}", f"{drawn['slope'] * float(mu_d):.4f}",
            f"{drawn['drive']:.2f}",
        )  # fmt: skip


def run(case: Case) -> dict[str, float]:
    """Return the velocity of a chain with its standard error, and what its phases are."""
    slips = case.n**2 * max(case.gain, case.chain.excess) / (2 * case.chain.excess)
    targets = int(np.clip(MOST_SLIPS / slips, 60, 4000)) // 2 * 2
    random = case.kind == "random"
    if random:
        targets *= 2
    drive = GaussianSteps(case.size, targets) if random else Cycles(case.size, targets // 2)
    skipped = targets // 4 // 2 * 2
    marks = np.linspace(skipped, targets, BLOCKS + 1).astype(int) // 2 * 2
    means, phases = [], []
    for seed in range(SEEDS):
        result = creep(case.chain, drive, seed=seed, record=("x_G", "x", "tension"))
        if result.half_cycles < targets:
            raise RuntimeError(f"chain {case.number}: {result.outcome.value}, {result.reason}")
        x_G = np.asarray(result.recorded["x_G"])
        if random:  # the scatter of the dilations is that of the sliding limit, whose mean is known
            limit = creep(case.chain, drive, seed=seed, solver="sliding")
            i = pivots(case.n, case.chain.tan_alpha, case.chain.mu_d)[0]
            x_G -= np.asarray(limit.recorded["x_G"])
            x_G += (case.n + 3 - 2 * i) * case.gain * np.arange(1, targets + 1)
        else:
            phases.append(signed_phases(result, skipped))
        means += (np.diff(x_G[marks - 1]) / np.diff(marks)).tolist()
    error = np.std(means, ddof=1) / np.sqrt(len(means))
    return {"velocity": float(np.mean(means)), "error": float(error)} | summary(phases)


def signed_phases(result: Creep, skipped: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the phases at the end of each dilation, and which way each slider went during it.

    The phase of slider n is ``(|F_n| - mu_d c)/D``, from -1 to 1 without disorder; the way is -1
    for uphill, 1 for downhill, 0 for rest. Rows are dilations.
    """
    chain = result.chain
    tension = np.asarray(result.recorded["tension"])[skipped::2]
    forces = np.diff(tension, axis=1, prepend=0.0, append=0.0) + chain.sin_alpha
    x = np.asarray(result.recorded["x"])
    way = np.sign(x[skipped::2] - x[skipped - 1 : -1 : 2])
    return (way * forces - chain.friction) / chain.excess, way


def summary(phases: list[tuple[NDArray[np.float64], NDArray[np.float64]]]) -> dict[str, float]:
    """Return mean, spread and correlation of the phases of all but the two sliders at each side
    of the place where the motion turns."""
    if not phases:
        return {}
    phase, way = (np.concatenate(part) for part in zip(*phases, strict=True))
    turn = (way < 0).sum(axis=1, keepdims=True)
    places = np.arange(1, phase.shape[1] + 1)
    off = np.where((places <= turn - 2) | (places > turn + 2), phase, np.nan)
    if np.isnan(off).all():
        return {}
    mean, spread = float(np.nanmean(off)), float(np.nanstd(off))
    beside = (off[:, 1:] - mean) * (off[:, :-1] - mean)
    return {
        "phase_mean": mean,
        "phase_spread": spread,
        "phase_beside": float(np.nanmean(beside)) / spread**2 if np.isfinite(beside).any() else 0.0,
    }


COLUMNS = (
    "number", "kind", "n", "mu_d", "mu_s", "sigma_mu", "tan_alpha", "drive", "gain", "velocity",
    "error", "phase_mean", "phase_spread", "phase_beside",
)  # fmt: skip


def main() -> None:
    """Run what is not in the file yet."""
    warnings.simplefilter("ignore", PhysicsWarning)  # draws below mu_d belong to the ranges
    kept = []
    if FILE.exists():
        with FILE.open(encoding="utf-8") as file:
            kept = [int(row["number"]) for row in csv.DictReader(file)]
    with FILE.open("a", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, restval="", lineterminator="\n")
        if not kept:
            writer.writeheader()
        for case in cases():
            if case.number in kept:
                continue
            found = run(case) | {"gain": case.gain}
            rounded = {name: f"{value:.6g}" for name, value in found.items()}
            writer.writerow({name: getattr(case, name, "") for name in COLUMNS} | rounded)
            file.flush()
            print(case.number, end=" ", file=sys.stderr, flush=True)


if __name__ == "__main__":
    main()
