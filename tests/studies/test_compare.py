"""Solvers held against the certified one: what is not the same is found, what is silent is not."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

from exactcreep import (
    Cycles,
    Evidence,
    Experiment,
    GaussianSteps,
    InputError,
    Method,
    State,
    compare,
    creep,
)  # fmt: skip
from exactcreep import Path as ThetaPath
from exactcreep.model.contacts import Event
from exactcreep.studies.compare import TIME_STEPS, ladder
from exactcreep.studies.comparison import advice, interval_of_mean, order, rate_of, spread, table
from exactcreep.studies.event_log import LoggedRearrangement
from exactcreep.studies.trajectory import Trajectory, agree, apart, drive_with_rests, trajectory
from exactcreep.watch.limits import Limits
from tests.conftest import Command
from tests.paper import captions, paper_chain

CHAIN = paper_chain(3)
DRIVE = ThetaPath(["0.001", "-0.001", "0.001"])
EXPERIMENT = Experiment(CHAIN, DRIVE, seed=5)


@cache
def own() -> Trajectory:
    return trajectory(Method("exact"), EXPERIMENT, 3)


@cache
def known() -> Trajectory:
    return trajectory(Method("certified"), EXPERIMENT, 3)


def middle() -> int:
    """Return the first rearrangement on the way to the second target."""
    return next(r for r, one in enumerate(own().log) if one.half_cycle == 2)


def with_events(place: int, events: Sequence[Event]) -> Trajectory:
    """Return the trajectory of `exact` with other events in one rearrangement."""
    log = list(own().log)
    log[place] = log[place]._replace(events=tuple(events))
    return replace(own(), log=log)


def before(place: int) -> int:
    return sum(len(one.events) for one in own().log[:place])


def cut(whole: Trajectory, targets: int, events: int, *, ended: bool = False) -> Trajectory:
    """Return a trajectory that has so many targets and events and no more."""
    log: list[LoggedRearrangement] = []
    for one in whole.log:
        kept = one.events[: max(events, 0)]
        events -= len(one.events)
        if kept:
            log.append(one._replace(events=kept))
    return replace(whole, log=log, x=whole.x[:targets], ended=ended)


def test_good_trajectories_agree_in_all_events_and_to_rounding_at_every_rest() -> None:
    found = agree(own(), known())
    assert not found.differs
    assert found.agreed == len(known().events) == before(len(own().log)) > 50
    assert found.compared == found.errors.size == known().reached == 3
    assert 0 < found.errors.max() < 1e-13
    assert (known().evidence, own().evidence) == (Evidence.PROVED, Evidence.COMPUTED)
    late = [replace(event, time=2 * event.time) for event in own().log[middle()].events]
    assert not agree(with_events(middle(), late), known()).differs  # a time is no difference


def test_a_wrong_position_is_found_at_its_rest() -> None:
    x = own().x.copy()
    x[1, 2] += 1e-9
    errors = agree(replace(own(), x=x), known()).errors
    assert errors[1] == pytest.approx(1e-9, rel=1e-4, abs=0)
    assert np.delete(errors, 1).max() < 1e-13


@pytest.mark.parametrize("change", ["missing", "too many", "turned", "another slider"])
def test_an_event_that_differs_is_found_where_it_is(change: str) -> None:
    events = own().log[middle()].events
    first, *others = events
    changed = {
        "missing": others,
        "too many": [*events, first],
        "turned": [replace(first, signs=tuple(-sign for sign in first.signs)), *others],
        "another slider": [replace(first, sliders=(2,)), *others],
    }
    found = agree(with_events(middle(), changed[change]), known())
    shared = len(events) if change == "too many" else 0
    assert found.agreed == before(middle()) + shared
    assert found.known == known().events[found.agreed]
    assert found.own.signature != found.known.signature
    assert (found.compared, found.errors.size) == (1, 3)


def test_what_is_missing_at_the_end_is_a_difference_unless_the_trajectory_was_cut_short() -> None:
    end, last = len(own().log) - 1, len(known().events) - 1
    less = with_events(end, own().log[end].events[:-1])
    missing, turned = agree(less, known()), agree(known(), less)
    assert missing.agreed == turned.agreed == last
    assert missing.own is turned.known is None
    assert missing.known == turned.own == known().events[last]
    events = before(middle()) + 1
    short = cut(own(), 1, events)
    for silent in (agree(short, known()), agree(known(), short)):
        assert not silent.differs
        assert silent.agreed == events
        assert silent.compared == silent.errors.size == 1


def test_what_ended_by_itself_misses_the_events_up_to_a_target_that_the_other_reached() -> None:
    events = before(middle()) + 1
    gave_up = cut(own(), 1, events, ended=True)
    found = agree(gave_up, known())
    assert (found.agreed, found.own) == (events, None)
    assert found.known == known().events[events]
    for ended in (False, True):  # the other one does not reach it, either: a runaway
        assert not agree(gave_up, cut(known(), 1, events + 1, ended=ended)).differs


def test_distances_are_exact_and_rounded_once() -> None:
    third = Fraction(1, 3)
    assert apart([third, 1.0], [third + Fraction(1, 10**40), 1]) == 1e-40


def test_targets_between_rearrangements_change_no_event() -> None:
    path, ends = drive_with_rests(EXPERIMENT, 1000)
    broken = trajectory(Method("exact"), replace(EXPERIMENT, drive=path), path.half_cycles)
    places = [(one.half_cycle, one.itinerary) for one in own().log]
    assert [(ends[one.half_cycle - 1], one.itinerary) for one in broken.log] == places
    assert broken.reached == len(ends) == len(own().log) > 15


SEEDS = (4, 5, 6, 7, 8, 9)
GIVEN = Experiment(CHAIN, Cycles("0.01", 12))
TRUTH = Method("certified", digits=20)


@cache
def data() -> xr.Dataset:
    return compare(GIVEN, truth=TRUTH, seeds=SEEDS, events=120)


def of(name: str) -> xr.Dataset:
    return data().loc[{"method": name}]


def test_every_method_and_seed_is_the_agreement_of_its_trajectory() -> None:
    member = replace(GIVEN, seed=6)
    path, _ = drive_with_rests(member, 120)
    broken = replace(member, drive=path)
    truth = trajectory(TRUTH, broken, path.half_cycles, enough=120)
    for method in ladder(CHAIN)[2:-1]:
        most = Limits(2 * len(truth.events) + 100)
        found = agree(trajectory(method, broken, truth.reached, limits=most), truth)
        there = of(method.label).loc[{"seed": 6}]
        errors = there.errors.values[~np.isnan(there.errors.values)]
        assert (there.agreed, there.differs) == (found.agreed, found.differs)
        assert there.rests == found.compared
        assert errors.tolist() == found.errors.tolist()
        assert there.error == found.errors[: found.compared].max()
        assert (there.own_event == there.true_event) == (not found.differs)
    assert data().truth_evidence.values.tolist() == ["proved"] * len(SEEDS)
    assert data().velocity.attrs["units"] == "g tau_dyn^2"
    assert data().seconds.attrs["units"] == "s"


def test_velocities_are_those_of_creep_with_its_burn_in() -> None:
    start = State.prepared(CHAIN, [Fraction(1, 8), 0], seed=3)
    own_start = Experiment(CHAIN, DRIVE, seed=3, start=start)
    found = compare(own_start, [Method("exact")], seeds=1)
    assert found.velocity == creep(CHAIN, DRIVE, seed=3, start=start).velocity
    exact = creep(CHAIN, GIVEN.drive, seed=SEEDS[1], record=())
    for one in [Method("exact"), *ladder(CHAIN)[2:]]:
        there = of(one.label).loc[{"seed": SEEDS[1]}]
        run = creep(CHAIN, GIVEN.drive, seed=SEEDS[1], solver=one.solver, record=(), **one.options)
        assert (there.velocity, there.half_cycles) == (run.velocity, 24)
        assert there.bias == run.velocity - exact.velocity


def test_exact_never_parts_and_located_events_part_later_and_are_of_order_two() -> None:
    rows = table(data())
    assert rows.parted["exact"] == rows.bias["exact"] == 0
    ends = spread(data()).bias
    width = (ends.sel(interval="upper") - ends.sel(interval="lower")).to_numpy()
    assert rows.bias_error.to_numpy() == pytest.approx(width / 2, nan_ok=True)
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


def test_the_advice_names_a_step_and_the_quantity() -> None:
    said = advice(data())
    assert said.startswith("For trajectories take exact")
    assert f"all {int(data().events.sum())} events" in said
    assert "mean velocity" in said
    assert any(f"dt = {dt}" in said for dt in TIME_STEPS)
    wrong = data().assign(differs=data().differs | True)
    assert "trajectories" not in advice(wrong)


def test_without_slips_the_sliding_limit_is_all_there_is() -> None:
    slides = Experiment(captions(3, mu_s="0.5"), Cycles("0.01", 4))
    found = compare(slides, events=5)
    assert found.method.values.tolist() == ["sliding"]
    assert (found.error.item(), found.rests.item()) == (0.0, 5)
    assert advice(found).startswith("Take sliding")


def test_half_cycles_are_as_many_for_all_where_a_run_is_too_long() -> None:
    long = replace(GIVEN, drive=Cycles("0.01", 10**5))
    found = compare(long, ladder(CHAIN, ["0.1"])[::2], seeds=1, events=20)
    (half_cycles,) = set(found.half_cycles.values.ravel())
    assert 100 < half_cycles < 2 * 10**5
    assert abs(float(found.bias[1, 0])) < 0.1 * abs(float(found.velocity[0, 0]))


@pytest.mark.parametrize(
    ("changed", "field"),
    [
        ({"seeds": [3, -1]}, "seed"),
        ({"events": 0}, "events"),
        ({"methods": ["exact"]}, "methods"),
        ({"methods": [Method("verlet", dt="0")]}, "dt"),
        ({"experiment": CHAIN}, "experiment"),
        ({"experiment": Experiment(CHAIN, Cycles("0.00001", 2))}, "scene"),
        ({"experiment": Experiment(captions(3), Cycles("0.01", 2)), "seeds": 3}, "seeds"),
    ],
)
def test_an_argument_out_of_range_is_refused(changed: dict[str, Any], field: str) -> None:
    with pytest.raises(InputError) as refused:
        compare(**{"experiment": GIVEN} | changed)
    assert refused.value.field == field


def test_random_dilations_need_no_disorder_and_keys_of_seeds_go_round() -> None:
    given = Experiment(captions(3), GaussianSteps("0.01", 4))
    random = compare(given, [Method("exact")], seeds=[7, 2], events=10)
    assert random.seed.values.tolist() == [7, 2]
    assert random.velocity.values[0, 0] != random.velocity.values[0, 1]
    last = compare(replace(GIVEN, seed=2**64 - 1), [Method("exact")], events=1)
    assert last.seed.values.tolist() == [2**64 - 1, 0, 1, 2]


def test_the_command_prints_draws_and_writes_the_dataset(
    command: Command, drawn: list[Figure]
) -> None:
    words = ("compare", "two-sliders-cycles", "--set", "drive.cycles=3", "--events", "20")
    printed = command(*words, "--json", "--plot", "a.png", "--out", "a.nc", "--seeds", "3,1").json
    assert [row["seed"] for row in printed["rows"][:2]] == [3, 1]
    assert {"advice", "orders", "intervals", "truth"} <= printed.keys()
    assert "verlet 0.01 loc." in command(*words).out
    left, right = drawn[0].axes
    kept = xr.load_dataset("a.nc", engine="h5netcdf")
    names, first = kept.method.values.tolist(), kept.isel(seed=0)
    lines = {line.get_label(): line for line in left.lines}
    for k, name in enumerate(names):
        shown = first.errors.values[k][: int(first.rests[k])]
        if name == kept.truth:
            assert name.startswith("certified")
            assert f"{name}: proved" in lines
            continue
        shown = np.where(shown == 0, np.nan, shown)
        label = name if np.nanmax(first.errors.values[k]) > 0 else f"{name}: no error"
        assert np.array_equal(lines[label].get_ydata(), shown, equal_nan=True)
    # besides the zero, one point for each method whose bias is known, in the ink of its line
    has_bias = np.isfinite(kept.bias.mean("seed").values)
    points = [line.get_color() for line in right.lines if line.get_marker() == "o"]
    inks = [line.get_color() for label, line in lines.items() if not label.startswith("_")]
    assert len(set(inks)) == len(names) == 9
    assert points == [ink for ink, has_point in zip(inks, has_bias, strict=True) if has_point]
    assert len(points) > 3
