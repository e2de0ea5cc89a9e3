"""A level chain has no mean drift, by symmetry, and no run of one says that it creeps."""

from __future__ import annotations

from random import Random
from typing import Any

import pytest

from exactcreep import Chain, Creep, Cycles, Drive, GaussianSteps, Outcome, State, Targets, creep


def level(n: int = 2, **other: Any) -> Chain:
    parts: dict[str, Any] = {"mu_d": "0.5", "mu_s": "0.6", "sigma_mu": "0.01", "tan_alpha": 0}
    return Chain(n, 1000, **(parts | other))


def said(chain: Chain, drive: Drive, **given: Any) -> str:
    return creep(chain, drive, record=(), **given).reason


def test_level_runs_say_that_they_have_no_mean_drift_by_symmetry() -> None:
    assert said(level(), Cycles("0.005", 100)) == "the chain ages: no mean drift, by symmetry"
    for drive in (GaussianSteps("0.005", 100), Targets(["0.003", "-0.001"] * 20)):
        assert said(level(), drive) == "the chain ages: no mean drift, by symmetry"
        assert said(level(4), drive) == "no mean drift, by symmetry"


@pytest.mark.parametrize(
    "changed",
    [{"tan_alpha": "0.0001"}, {"end_forces": ("0.01", "0")}, {"mu_s": ["0.6", "0.61"]},
     {"start": State.prepared(level(), ["0.1"])}],
    ids=str,
)  # fmt: skip
def test_a_chain_or_start_that_is_not_its_own_mirror_image_has_no_such_theorem(
    changed: dict[str, Any],
) -> None:
    given = {"start": changed.pop("start")} if "start" in changed else {}
    assert "symmetry" not in said(level(**changed), Cycles("0.005", 100), **given)


def runs(count: int) -> list[Creep]:
    """Return level runs of 2 to 8 sliders, of both drives, several lengths and disorders."""
    random, found = Random(65), []
    for seed in range(count):
        n, size = random.choice([2, 2, 3, 4, 5, 6, 8]), random.choice(["0.0015", "0.003", "0.008"])
        length = random.choice([3, 20, 70, 300, 450, 901, 1500]) // (1 if n < 4 else 3) + 1
        chain = level(n, sigma_mu=random.choice(["0", "0.001", "0.01", "0.02"]))
        drive = random.choice([Cycles(size, length), GaussianSteps(size, 2 * length)])
        found.append(creep(chain, drive, seed=seed, record=()))
    return found


@pytest.mark.filterwarnings("ignore:a static coefficient was drawn below mu_d")
@pytest.mark.parametrize("count", [60, pytest.param(2000, marks=pytest.mark.slow)])
def test_no_level_run_says_that_it_creeps(count: int) -> None:
    outcomes = [run.outcome for run in runs(count)]
    assert set(outcomes) <= {Outcome.AT_REST, Outcome.CYCLING}
    assert outcomes.count(Outcome.CYCLING) > 0.7 * count
