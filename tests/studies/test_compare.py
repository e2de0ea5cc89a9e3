"""Solvers held against the certified one: what is not the same is found, what is silent is not."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

from exactcreep import Cycles, Event, Evidence, Experiment, Method, compare, creep
from exactcreep import Path as ThetaPath
from exactcreep.studies.compare import ladder
from exactcreep.studies.comparison import advice, interval_of_mean, order, rate_of, spread, table
from exactcreep.studies.trajectory import Trajectory, agree, drive_with_rests, trajectory
from exactcreep.watch.limits import Limits
from tests.conftest import Command
from tests.paper import captions, paper_chain

CHAIN = paper_chain(3)
EXPERIMENT = Experiment(CHAIN, ThetaPath(["0.001", "-0.001", "0.001"]), seed=5)
PLACE = 9
"""A rearrangement on the way to the second target."""


@cache
def own() -> Trajectory:
    return trajectory(Method("exact"), EXPERIMENT, 3)


@cache
def known() -> Trajectory:
    return trajectory(Method("certified"), EXPERIMENT, 3)


def with_events(place: int, events: Sequence[Event]) -> Trajectory:
    """Return the trajectory of `exact` with other events in one rearrangement."""
    log = list(own().log)
    log[place] = log[place]._replace(events=tuple(events))
    return replace(own(), log=log)


def before(place: int) -> int:
    return sum(len(one.events) for one in own().log[:place])


def test_good_trajectories_agree_in_all_events_and_to_rounding_at_every_rest() -> None:
    found = agree(own(), known())
    assert not found.differs
    assert found.agreed == len(known().events) == before(len(own().log)) > 50
    assert found.compared == found.errors.size == known().reached == 3
    assert 0 < found.errors.max() < 1e-13
    assert (known().evidence, own().evidence) == (Evidence.PROVED, Evidence.COMPUTED)
    x = own().x.copy()
    x[1, 2] += 1e-9
    wrong = agree(replace(own(), x=x), known()).errors
    assert wrong[1] == pytest.approx(1e-9, rel=1e-4, abs=0)
    assert np.delete(wrong, 1).max() < 1e-13


@pytest.mark.parametrize("place", [0, PLACE, -1])
def test_an_event_that_differs_is_found_where_it_is_unless_its_time_alone_does(place: int) -> None:
    place %= len(own().log)
    events = own().log[place].events
    for k, event in enumerate(events):
        late = replace(event, time=2 * event.time)
        turned = replace(event, signs=tuple(-sign for sign in event.signs))
        other = with_events(place, [*events[:k], turned, *events[k + 1 :]])
        shared = before(place) + k
        for one in (agree(other, known()), agree(known(), other)):
            assert (one.differs, one.agreed, one.errors.size) == (True, shared, 3)
            assert one.compared == own().log[place].half_cycle - 1
            assert {one.own, one.known} == {other.events[shared], known().events[shared]}
        assert not agree(with_events(place, [*events[:k], late, *events[k + 1 :]]), known()).differs


def test_what_a_trajectory_that_was_cut_short_does_not_tell_is_no_difference() -> None:
    log = [*own().log[:PLACE], own().log[PLACE]._replace(events=own().log[PLACE].events[:1])]
    short = replace(own(), log=log, x=own().x[:1], ended=False)
    for silent in (agree(short, known()), agree(known(), short)):
        assert not silent.differs
        assert silent.agreed == before(PLACE) + 1
        assert silent.compared == silent.errors.size == 1
    gave_up = agree(replace(short, ended=True), known())  # although it could have gone on
    assert (gave_up.agreed, gave_up.own) == (before(PLACE) + 1, None)


SEEDS = (4, 5, 6, 7, 8, 9)
GIVEN = Experiment(CHAIN, Cycles("0.01", 12))
TRUTH = Method("certified", digits=20)


@cache
def data() -> xr.Dataset:
    return compare(GIVEN, truth=TRUTH, seeds=SEEDS, events=120)


def test_every_method_is_the_agreement_of_its_trajectory_and_the_velocity_of_its_run() -> None:
    member = replace(GIVEN, seed=6)
    path, _ = drive_with_rests(member, 120)
    broken = replace(member, drive=path)
    truth = trajectory(TRUTH, broken, path.half_cycles, enough=120)
    exact = creep(CHAIN, GIVEN.drive, seed=6, record=())
    most = Limits(2 * len(truth.events) + 100)
    for method in ladder(CHAIN)[2:-1]:
        found = agree(trajectory(method, broken, truth.reached, limits=most), truth)
        there = data().loc[{"method": method.label, "seed": 6}]
        errors = there.errors.values[~np.isnan(there.errors.values)]
        assert (there.agreed, there.differs, there.rests) == (
            found.agreed, found.differs, found.compared,
        )  # fmt: skip
        assert errors.tolist() == found.errors.tolist()
        assert there.error == found.errors[: found.compared].max()
        run = creep(CHAIN, GIVEN.drive, seed=6, solver=method.solver, record=(), **method.options)
        assert (there.velocity, there.bias) == (run.velocity, run.velocity - exact.velocity)
    assert data().truth_evidence.values.tolist() == ["proved"] * len(SEEDS)
    radii = data().truth_radius.values
    assert 0 < radii.min() <= radii.max() < 1e-15


def test_exact_never_parts_and_located_events_part_later_and_are_of_order_two() -> None:
    rows = table(data())
    assert rows.parted["exact"] == rows.bias["exact"] == 0
    assert rows.agreed["exact"] == math.inf
    assert rows.error["exact"] < 1e-12 < rows.error["verlet, dt = 0.01, located"]
    parted = rows.parted[data().dt.values > 0]
    located = parted.index.str.endswith("located")
    assert parted[~located].sum() > parted[located].sum()
    assert math.isnan(rows.agreed["sliding"])
    assert rows.error["sliding"] > 0.01
    fitted, second = (order(data(), locate=locate) for locate in (False, True))
    assert second.lower < 2 < second.upper < second.lower + 0.6
    assert fitted.upper < second.lower
    assert "exact" in advice(data())
    assert "trajectories" not in advice(data().assign(differs=data().differs | True))


def test_rates_quartiles_and_biases_of_known_numbers() -> None:
    values = {
        "agreed": [10.0, 20, 30, 40],
        "differs": [True, True, False, True],
        "error": [3.0, 2, 5, math.nan],
        "velocity": [1.0, 2, 3, 4],
        "bias": [0.0, 1, 2, 3],
    }
    known = xr.Dataset({name: (("method", "seed"), [row]) for name, row in values.items()})
    known = known.assign_coords(method=["one"], rest=[0])
    found = {name: part.values[0].tolist() for name, part in spread(known).items()}
    assert found["agreed"] == [20, 10, 40]  # the third, of 30 events, never parted
    # a Poisson count of 3 lies between .6187 and 8.7673 (F. Garwood, Biometrika 28, 437 (1936))
    assert np.multiply(100, found["rate"]) == pytest.approx((3, 0.6187, 8.7673), abs=1e-4)
    assert found["error"][0] == 3
    assert found["bias"][0] == pytest.approx(1.5, rel=1e-15)
    assert interval_of_mean([1, 2, 3]) == pytest.approx((2, 2 - 2.48414, 2 + 2.48414), rel=1e-5)
    assert all(math.isnan(part) for part in interval_of_mean([1]))
    assert 30 * rate_of(0, 30).upper == pytest.approx(3.6889, abs=1e-4)


def test_without_slips_the_sliding_limit_is_all_there_is() -> None:
    slides = Experiment(captions(3, mu_s="0.5"), Cycles("0.01", 4))
    found = compare(slides, events=5)
    assert found.method.values.tolist() == ["sliding"]
    assert (found.error.item(), found.rests.item()) == (0.0, 5)


def test_the_command_draws_the_errors_that_it_writes(command: Command, drawn: list[Figure]) -> None:
    words = ("compare", "two-sliders-cycles", "--set", "drive.cycles=3", "--events", "20")
    printed = command(*words, "--json", "--plot", "a.png", "--out", "a.nc", "--seeds", "3,1").json
    assert [row["seed"] for row in printed["rows"][:2]] == [3, 1]
    kept = xr.load_dataset("a.nc", engine="h5netcdf")
    lines = {line.get_label().removesuffix(": no error"): line for line in drawn[0].axes[0].lines}
    for name in set(kept.method.values.tolist()) - {kept.truth}:
        first = kept.loc[{"method": name}].isel(seed=0)
        shown = first.errors.values[: int(first.rests)]
        shown = np.where(shown == 0, np.nan, shown)
        assert np.array_equal(lines[name].get_ydata(), shown, equal_nan=True)
