"""What "auto" says of its own accuracy is true: random scenes, held against many seeds."""

from __future__ import annotations

import math
import random
from collections import Counter
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from exactcreep import Chain, Cycles, GaussianSteps, Path, State, TemperatureRecord, creep
from exactcreep.model.drive import Drive
from exactcreep.quasistatic.result import Creep
from exactcreep.solvers.pilot import event_nanoseconds

ACCURACIES = ("0.1", "0.03", "0.01", "0.001")
_EVENTS, _FEWEST = 16_000, 70  # of a scene: at most so many events, at least so many targets
SEEDS, _STUDENT = 32, 2.04  # whose mean is the truth; its interval of 95 % with 31 degrees
pytestmark = pytest.mark.filterwarnings("ignore::UserWarning")


@dataclass(frozen=True)
class Verdict:
    """What became of one scene at one accuracy."""

    kind: str
    accuracy: str
    known: bool
    outside: bool
    """The truth lies outside the stated error."""
    costlier: bool
    """It ran event by event where the sliding limit, 3 times cheaper, lies within the accuracy."""


def scene(seed: int) -> tuple[str, Chain, Drive]:
    """Return the kind of drive, a random chain, and a drive from far below to far above threshold.

    What is so violent that 70 targets take more than `_EVENTS` events is made weaker until not.
    """
    rng, kind = random.Random(seed), ("cycles", "gaussian", "path", "record")[seed % 4]
    n = rng.choice([1, 2, 2, 3, 3, 4, 5, 6, 8, 10, 15, 20, 30])
    excess = rng.choice(["0.001", "0.02", "0.1", "0.2"])
    sigma = rng.choice(["0", "0.001", "0.01", "0.01", "0.03"])
    tan_alpha = Fraction(rng.randint(2, 96), 200)
    chain = Chain(n, 1000, "0.5", Fraction(1, 2) + Fraction(excess), sigma, tan_alpha=tan_alpha)
    held = n * float(chain.mu_d - tan_alpha) + float(chain.mu_s - chain.mu_d)
    threshold = held * chain.cos_alpha / 2000
    size = threshold * math.exp(rng.uniform(math.log(0.4), math.log(15)))
    count = 0
    while count < _FEWEST:
        steps = creep(chain, GaussianSteps(size, 4000), max_events=_EVENTS, record=())
        count, size = steps.half_cycles, size * (1.0 if steps.half_cycles >= _FEWEST else 0.8)
    draw = np.random.default_rng(rng.randrange(2**32))
    if kind == "cycles":
        return kind, chain, Cycles(size, min(count // 2, 1500))
    if kind == "gaussian":
        return kind, chain, GaussianSteps(size, count)
    if kind == "path":
        calm, loud = rng.choice([(0.02, 1.0), (0.3, 1.0), (1.0, 1.0)])
        sizes = np.where(np.arange(count) < count // 3, calm, loud)
        return kind, chain, Path((size * sizes * draw.standard_normal(count)).tolist())
    hours = np.arange(2 * count)
    theta = size * (
        np.sin(2 * np.pi * hours / hours.size) + 0.5 * np.sin(2 * np.pi * hours / 24)
    ) + 0.3 * size * draw.standard_normal(hours.size)
    listed = {"theta": theta.tolist(), "times": hours.tolist(), "sha256": "0" * 64}
    return kind, chain, TemperatureRecord("a year.csv", "1e-5", 0, **listed)


def longer(drive: Drive) -> Drive:
    if isinstance(drive, Cycles):
        return Cycles(drive.amplitude, 2 * drive.cycles)
    return GaussianSteps(drive.sigma_theta, 2 * drive.steps) if drive.random else drive


def settled(result: Creep) -> bool:
    return result.velocity_error == 0 and result.drive.cyclic


def truth(chain: Chain, drive: Drive, own: Creep) -> tuple[float, float]:
    """Return the velocity that is asked for, with its standard error.

    Of a chain that settles, now or much later, its own; without disorder, along this very path,
    that of a start some roundings off; else the mean over seeds, and over starts if there is no
    disorder, of those that do not settle.
    """
    if isinstance(drive, Cycles) and not settled(own):
        later = Cycles(drive.amplitude, max(100_000, drive.cycles))
        own = creep(chain, later, record=(), max_events=50 * _EVENTS)
    if settled(own):
        return own.velocity, 0.0
    if not (drive.random or drive.cyclic or chain.sigma_mu):
        near = [1e-15 * (-1) ** i for i in range(chain.n - 1)]
        return creep(chain, drive, start=State.prepared(chain, near), record=()).velocity, 0.0
    off = np.random.default_rng(0).uniform(-0.01, 0.01, (SEEDS, chain.n - 1))
    runs = [
        creep(
            chain, longer(drive), seed=seed + 1, record=(),
            start=None if chain.sigma_mu else State.prepared(chain, off[seed].tolist()),
        )
        for seed in range(SEEDS)
    ]  # fmt: skip
    moving = np.array([run.velocity for run in runs if not settled(run)])
    if moving.size < SEEDS // 2:
        return math.nan, math.nan
    return float(moving.mean()), float(moving.std(ddof=1)) / math.sqrt(moving.size)


def verdicts(seed: int) -> list[Verdict]:
    """Return what became of a scene at every accuracy."""
    kind, chain, drive = scene(seed)
    own = creep(chain, drive, record=())
    sliding = creep(chain, drive, solver="sliding", record=()).velocity
    true, unsure = truth(chain, drive, own)
    dear = event_nanoseconds(chain) * own.event_count >= 3 * 2 * chain.n * own.half_cycles
    found = []
    for accuracy in ACCURACIES:
        auto = creep(chain, drive, solver="auto", accuracy=accuracy, record=("x_G",))
        told: dict[str, Any] = dict(auto.report)
        error = told["relative_error"]
        known = error is not None and not math.isnan(true)
        outside = False
        if known:
            allowed = max(abs(auto.velocity), abs(true)) * error
            outside = abs(auto.velocity - true) > math.hypot(allowed, _STUDENT * unsure) + 1e-12
        off = abs(sliding - true) + _STUDENT * unsure
        costlier = told["chosen"] != "sliding" and off <= float(accuracy) * abs(true)
        found.append(Verdict(kind, accuracy, known, outside, dear and costlier))
        if outside or costlier:
            print(seed, chain, drive.half_cycles, found[-1], flush=True)
    return found


def table(found: list[Verdict]) -> str:
    lines = [f"{'':18} cases  known  outside  costlier"]
    for key in ("kind", "accuracy"):
        groups = Counter(getattr(one, key) for one in found)
        for name, cases in groups.items():
            part = [one for one in found if getattr(one, key) == name]
            counts = [sum(getattr(one, what) for one in part) for what in _COUNTED]
            lines.append(f"{name:18} {cases:5}  {counts[0]:5}  {counts[1]:7}  {counts[2]:8}")
    return "\n".join(lines)


_COUNTED = ("known", "outside", "costlier")


def judge(found: list[Verdict]) -> None:
    print(table(found))
    known, outside, costlier = (sum(getattr(one, what) for one in found) for what in _COUNTED)
    # 1.96 standard deviations above 5 %: four cases of a scene share their pilot
    assert outside <= 0.05 * known + 1.96 * math.sqrt(4 * 0.05 * 0.95 * known)
    assert costlier < 0.1 * len(found)


@pytest.mark.slow
@pytest.mark.timeout(7200)
def test_in_300_scenes_auto_lies_outside_its_error_no_more_often_than_it_says() -> None:
    judge([verdict for seed in range(300) for verdict in verdicts(seed)])


def test_in_a_few_scenes_auto_lies_outside_its_error_no_more_often_than_it_says() -> None:
    judge([verdict for seed in range(1000, 1004) for verdict in verdicts(seed)])
