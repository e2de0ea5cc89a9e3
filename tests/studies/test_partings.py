"""Where trajectories part over many seeds: each seed is a comparison, and intervals are sound."""

from __future__ import annotations

import json
import math
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from exactcreep import Chain, Cycles, GaussianSteps, InputError, Partings, cli, compare, creep
from exactcreep.figures.comparison import draw_partings
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.studies.contest import Contestant, mean_velocity
from exactcreep.studies.partings import Followed, Parting, interval_of_mean

CHAIN = Chain(3, 1000, "0.5", "0.6", "0.01", tan_alpha="0.25")
DRIVE = Cycles("0.01", 12)
STEPS = ("0.1", "0.03", "0.01")


@cache
def found() -> Partings:
    return compare(CHAIN, DRIVE, seed=4, seeds=6, dts=STEPS, events=120, digits=20)


def test_every_seed_is_the_comparison_of_that_seed() -> None:
    assert found().seeds == (4, 5, 6, 7, 8, 9)
    for place, locate in ((2, False), (5, True)):
        alone = compare(CHAIN, DRIVE, seed=6, dt="0.03", locate=locate, events=120, digits=20)
        standing, followed = alone.contestants[1], found().contestants[place].courses[2]
        assert found().contestants[place].contestant == standing.contestant
        assert (followed.agreed, followed.differs) == (standing.agreed, standing.differs)
        assert followed.errors.tolist() == standing.errors[: standing.compared].tolist()


def test_the_bias_is_that_of_the_runs_of_each_seed() -> None:
    for place, options in ((1, {"dt": "0.1"}), (6, {"dt": "0.01", "locate": True})):
        parting = found().contestants[place]
        means = [
            [
                mean_velocity(
                    creep(CHAIN, DRIVE, seed=seed, solver=solver, **given).recorded["x_G"],
                    Experiment.of(CHAIN, DRIVE),
                )
                for seed in found().seeds
            ]
            for solver, given in (("exact", {}), ("verlet", options))
        ]
        assert [one.exact for one in parting.courses] == means[0]
        assert [one.velocity for one in parting.courses] == means[1]
        gaps = (np.array(means[1]) - means[0]) / abs(np.mean(means[0]))
        assert parting.bias.value == pytest.approx(gaps.mean(), rel=1e-9, abs=1e-15)
    assert found().half_cycles == 24


def test_exact_never_parts_and_located_events_part_later() -> None:
    exact, *others = found().contestants
    assert exact.parted == 0
    assert (exact.agreed.value, exact.rate.value) == (math.inf, 0)
    assert exact.error.upper < 1e-12
    assert exact.bias == (0, 0, 0)
    assert len(others) == 2 * len(STEPS)
    plain, located = (found().family(locate=locate) for locate in (False, True))
    assert [one.dt for one in plain] == [one.dt for one in located] == [0.1, 0.03, 0.01]
    assert sum(one.parted for one in plain) > sum(one.parted for one in located)
    assert plain[0].rate.value > plain[-1].rate.value


def test_the_fitted_order_is_two_with_located_events_and_less_without() -> None:
    plain, located = (found().order(locate=locate) for locate in (False, True))
    assert located.lower < 2 < located.upper
    assert located.upper - located.lower < 0.6
    assert plain.upper < located.lower


def parted(dt: str, *, locate: bool, errors: list[list[float]]) -> Parting:
    """Return a parting whose seeds have these errors at their rests."""
    contestant = Contestant("verlet", {"dt": dt, **({"locate": True} if locate else {})})
    courses = [
        Followed(seed, 10 * (seed + 1), seed != 2, np.array(values), 1.0 + seed, 1.0)
        for seed, values in enumerate(errors)
    ]
    return Parting(contestant, tuple(courses))


@pytest.mark.parametrize("order", [1.0, 2.5])
def test_errors_that_are_a_power_of_the_step_have_that_order(order: float) -> None:
    """Also where a coarse step parts so early that it has fewer rests, and one seed has none."""
    rests = {"0.2": 2, "0.1": 5, "0.03": 9}
    family = [
        parted(dt, locate=True, errors=[
            [(1 + seed) * (1 + k) * float(dt) ** order for k in range(rests[dt])]
            for seed in range(3)
        ] + [[]])
        for dt in rests
    ]  # fmt: skip
    whole = Partings(Experiment.of(CHAIN, DRIVE), (0, 1, 2, 3), 30, 1, 0, 2, tuple(family))
    assert whole.order(locate=True) == pytest.approx((order, order, order), rel=1e-12, abs=0)
    assert math.isnan(whole.order(locate=False).value)


def test_rates_quartiles_and_biases_of_known_courses() -> None:
    one = parted("0.1", locate=False, errors=[[1.0, 3.0], [2.0], [5.0], []])
    assert one.parted == 3
    assert one.agreed == (20, 10, 40)  # the third, of 30 events, never parted
    assert one.rate.value == 3 / 100
    # a Poisson count of 3 lies between .6187 and 8.7673 (F. Garwood, Biometrika 28, 437 (1936))
    assert (100 * one.rate.lower, 100 * one.rate.upper) == pytest.approx((0.6187, 8.7673), abs=1e-4)
    assert one.error.value == 3
    assert one.bias.value == pytest.approx(1.5, rel=1e-15)
    assert interval_of_mean([1, 2, 3]) == pytest.approx((2, 2 - 2.48414, 2 + 2.48414), rel=1e-5)
    assert all(math.isnan(part) for part in interval_of_mean([1]))
    never = Parting(one.contestant, one.courses[2:3])
    assert never.agreed.value == math.inf
    assert never.rate.lower == 0
    assert 30 * never.rate.upper == pytest.approx(3.6889, abs=1e-4)


@pytest.mark.parametrize(
    ("changed", "field"),
    [
        ({"seeds": 1}, "seeds"),
        ({"seeds": [3, 3]}, "seeds"),
        ({"seeds": [3, -1]}, "seed"),
        ({"seeds": "many"}, "seeds"),
        ({"dts": []}, "dts"),
        ({"dts": ["0.1", "1/10"]}, "dts"),
        ({"dts": ["0.1", "0"]}, "dt"),
        ({"events": 0, "seeds": 2}, "events"),
    ],
)
def test_an_argument_out_of_range_is_refused(changed: dict[str, Any], field: str) -> None:
    with pytest.raises(InputError) as refused:
        compare(CHAIN, DRIVE, **changed)
    assert refused.value.field == field


def test_seeds_that_change_nothing_are_refused_and_random_dilations_need_no_disorder() -> None:
    ordered = Chain(3, 1000, "0.5", "0.6", tan_alpha="0.25")
    with pytest.raises(InputError, match="all runs are the same"):
        compare(ordered, DRIVE, seeds=3)
    random = compare(ordered, GaussianSteps("0.01", 4), seeds=[7, 2], dts=["0.1"], events=10)
    assert random.seeds == (7, 2)
    followed = [one.exact for one in random.contestants[0].courses]
    assert followed[0] != followed[1]


def test_the_command_prints_and_draws_what_the_partings_hold(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = "compare two-sliders-cycles --set drive.cycles=3 --events 20 --seeds 3,1 --dts 0.1,0.01"
    picture = tmp_path / "partings.png"
    assert cli.status([*words.split(), "--json", "--plot", str(picture)]) == 0
    out = json.loads(capsys.readouterr().out)
    assert out["seeds"] == [3, 1]
    assert [one["label"] for one in out["contestants"]][:2] == ["exact", "verlet, dt = 0.1"]
    assert picture.stat().st_size > 20_000
    assert cli.status(words.split()) == 0
    printed = capsys.readouterr().out
    assert "verlet 0.01 loc." in printed
    assert "…" not in printed
    draw_partings([found(), found()], tmp_path / "two.png")
    assert (tmp_path / "two.png").stat().st_size > 20_000
