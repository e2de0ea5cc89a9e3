"""What accuracy costs: wrong events are found where they are, and times are times."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from functools import cache
from itertools import groupby
from typing import Any

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

from exactcreep import (
    Chain,
    Cycles,
    Drive,
    Experiment,
    GaussianSteps,
    InputError,
    Targets,
    compare,
    creep,
)
from exactcreep.studies import compare as studied
from exactcreep.studies.compare import Track, agreement, label, ladder, track
from exactcreep.studies.comparison import sentence, table, unresolved
from exactcreep.studies.needs import needs
from tests.conftest import Command
from tests.paper import captions, paper_chain

CHAIN = paper_chain(3)
EXPERIMENT = Experiment(CHAIN, Targets(["0.001", "-0.001", "0.001"]), seed=5)


@cache
def followed(solver: str, events: int = 10_000) -> Track:
    return track(replace(EXPERIMENT, solver=solver), events)[0]


@pytest.mark.parametrize("place", [0, 60, -1])
def test_an_event_that_differs_is_found_where_it_is(place: int) -> None:
    own, known = followed("exact"), followed("certified")
    place %= len(own.events)
    half_cycle, rest, number, kind, sliders, signs = there = own.events[place]
    turned = (half_cycle, rest, number, kind, sliders, tuple(-sign for sign in signs))
    other = own._replace(events=[turned if one is there else one for one in own.events])
    for pair in ((other, known), (known, other)):
        found = agreement(*pair)
        assert (found["differs"], found["agreed"], found["rests"]) == (True, place, rest)
        assert f"in half-cycle {half_cycle} instead of" in found["wrong"]


@pytest.mark.parametrize("events", [2, 25, 40])
def test_events_beyond_a_limit_are_no_difference_and_an_early_end_is_one(events: int) -> None:
    own, known = followed("exact", events + 1), followed("certified", events)
    found = agreement(own, known)
    assert (found["differs"], found["agreed"]) == (False, events)
    assert found["rests"] == known.events[-1][1]  # the last rearrangement may not have ended
    more = agreement(own, known._replace(done=True))
    less = agreement(own._replace(events=own.events[: events - 1]), known)
    assert more["wrong"].endswith("instead of no further event")
    assert (more["differs"], more["agreed"]) == (True, events)
    assert less["wrong"].startswith("no further event instead of")
    assert (less["differs"], less["agreed"]) == (True, events - 1)


SEEDS = (4, 5, 6, 7)
GIVEN = Experiment(CHAIN, Cycles("0.01", 12))


@cache
def data() -> xr.Dataset:
    return compare(GIVEN, ladder(GIVEN, ["0.1", "0.01"], [20]), seeds=SEEDS, events=120)


def test_every_method_is_the_agreement_of_its_trajectory_and_the_velocity_of_its_run() -> None:
    exact, methods = creep(CHAIN, GIVEN.drive, seed=6), ladder(GIVEN, ["0.1", "0.01"], [20])
    truth = track(replace(methods[1], seed=6), 120)[0]
    at_rest = truth.moved[0].cumsum(axis=0).astype(float)
    for method in methods[2:-1]:
        mine = track(replace(method, seed=6), 121)[0]
        there = data().loc[{"method": label(method), "seed": 6}]
        for name, value in agreement(mine, truth).items():
            assert there[name] == value
        rests = int(there.rests)
        errors = abs(mine.moved[0].cumsum(axis=0)[:rests].astype(float) - at_rest[:rests])
        assert there.error == pytest.approx(errors.max(), rel=1e-9)
        run = creep(CHAIN, GIVEN.drive, seed=6, solver="verlet", **method.options)
        assert there.velocity == pytest.approx(run.velocity, rel=1e-12)
    assert data().velocity.loc["exact", 6] == pytest.approx(exact.velocity, rel=1e-12)
    velocities = data().velocity.values
    biases = velocities.mean(axis=1) / velocities[0].mean() - 1
    assert np.allclose(biases, data().bias, rtol=1e-9, atol=1e-15, equal_nan=True)


def test_the_certified_events_are_as_many_as_asked_and_proved() -> None:
    assert data().truth == "certified, 20 digits"
    assert data().truth_evidence.values.tolist() == ["proved"] * len(SEEDS)
    assert data().events.values.tolist() == [120] * len(SEEDS)
    assert data().agreed.loc["certified, 20 digits"].values.tolist() == [120] * len(SEEDS)
    assert 0 < data().error.loc["certified, 20 digits"].values.max() < 1e-20
    precise = replace(EXPERIMENT, solver="certified", options={"digits": 100})
    assert 0 < track(precise, 100)[0].moved[1].sum(axis=0).max() < 1e-100


def test_exact_never_parts_and_small_steps_part_later() -> None:
    rows = table(data())
    assert rows.parted["exact"] == rows.bias["exact"] == 0
    assert rows.agreed["exact"] == math.inf
    assert rows.error["exact"] < 1e-12 < rows.error["verlet, dt = 0.01"] < 0.1
    assert rows.agreed["verlet, dt = 0.1"] < rows.agreed["verlet, dt = 0.01"]
    assert math.isnan(rows.agreed["sliding"])
    assert rows.error["sliding"] > 0.001
    assert sentence(data()).startswith("For trajectories take exact: all")
    assert "no method" in sentence(data().assign(differs=data().differs | True))


def test_seconds_are_processor_times_of_runs_that_take_turns_and_not_of_their_starts(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now, turns = [0.0], list[str]()
    simulate, simulation = studied.simulate, Experiment.simulation

    def driven(*given: Any, **about: Any) -> Any:
        now[0] += 3.0
        return simulate(*given, **about)

    def begun(method: Experiment, *given: Any) -> Any:
        now[0] += 100.0
        turns.append(method.solver)
        return simulation(method, *given)

    monkeypatch.setattr(studied, "process_time", lambda: now[0])
    monkeypatch.setattr(studied, "simulate", driven)
    monkeypatch.setattr(Experiment, "simulation", begun)
    certified = replace(GIVEN, solver="certified", options={"digits": 20})
    found = compare(GIVEN, [GIVEN, certified], seeds=1, events=20)
    assert [solver for solver, _ in groupby(turns)] == [*["exact", "certified"] * 5, "exact"]
    assert set(found.seconds.values[0]) == {3.0 / 24}  # of 24 half-cycles
    events = creep(CHAIN, GIVEN.drive, record=()).event_count / 24
    assert found.seconds.values[1] == pytest.approx([3.0 / found.events.item() * events] * 5)


def test_the_table_has_medians_and_ranges() -> None:
    for name, row in table(data()).iterrows():
        own = data().sel({"method": name})
        seconds, errors = sorted(own.seconds.values), sorted(own.shared_error.values)
        assert [row.fastest, row.seconds, row.slowest] == [seconds[k] for k in (0, 2, 4)]
        middle = (errors[1] + errors[2]) / 2
        assert [row.error_low, row.error, row.error_high] == [errors[0], middle, errors[3]]
        lives = own.agreed.where(own.differs | own.agreed.isnull(), math.inf)
        assert row.parted == own.differs.sum()
        assert np.array_equal(row.agreed, sorted(lives.values)[1], equal_nan=True)


def test_a_bias_is_told_only_where_its_interval_is_below_ten_percent() -> None:
    known = data().assign(bias=("method", [0.05] * 5), bias_error=("method", [0.049] * 5))
    wide = known.assign(bias_error=("method", [0.051] * 5))
    assert table(known).bias.tolist() == [0.05] * 5
    assert table(wide).bias.isna().all()
    assert unresolved(wide) == "not resolved by 96 half-cycles"
    assert sentence(wide).endswith("within 1 % the bias of none is known to be so small.")


def test_without_slips_the_sliding_limit_is_all_there_is() -> None:
    slides = Experiment(captions(3, mu_s="0.5"), Cycles("0.01", 4))
    found = compare(slides, events=5)
    assert found.method.values.tolist() == ["sliding"]
    assert (found.error.item(), found.rests.item()) == (0.0, 5)
    assert sentence(found).startswith("Take sliding")


def test_methods_of_another_chain_are_refused() -> None:
    with pytest.raises(InputError, match="another chain or drive"):
        compare(GIVEN, [replace(GIVEN, chain=paper_chain(4))])


# --- what a scene needs ---------------------------------------------------------------------------

SIX, CYCLES, PAIR = paper_chain(6, tan_alpha="0.23"), Cycles("0.01", 100), captions(2)
ONSET = Fraction(float(PAIR.mu_s - PAIR.tan_alpha) * PAIR.cos_alpha) / PAIR.l0


def needed(experiment: Experiment) -> Sequence[str]:
    return [name for name, why in needs(experiment).items() if why.startswith("needed: ")]


@pytest.mark.parametrize(
    ("chain", "drive", "features", "law"),
    [
        (captions(1), CYCLES, [], "is the answer: 0 "),
        (PAIR, CYCLES, [], "is the answer: "),
        (PAIR, Cycles(ONSET * Fraction(99, 100), 60), [], "is the answer: 0 "),
        (captions(6, mu_s="0.5"), CYCLES, [], "is the answer: "),
        (SIX, CYCLES, ["disorder", "inertia"], "to compare with: "),
        (captions(2, tan_alpha="0.55"), CYCLES, ["inertia"], ""),
        (PAIR, GaussianSteps("0.01", 9), ["inertia", "random dilations"], "to compare with: "),
    ],
)
def test_a_scene_needs_what_no_law_answers(
    chain: Chain, drive: Drive, features: Sequence[str], law: str
) -> None:
    given = Experiment(chain, drive)
    assert needed(given) == features
    assert needs(given).get("law", "").startswith(law)
    recorded = replace(given, record=("x",), solver="certified", options={"digits": 16})
    assert {"digits", "trajectories"} <= {*needed(recorded)}


def test_the_command_draws_what_it_writes(command: Command, drawn: list[Figure]) -> None:
    words = ("compare", "two-sliders-cycles", "--set", "drive.cycles=3", "--events", "20")
    more = ("--set", "chain.sigma_mu=0.01", "--seeds", "3,1", "--dts", "0.1", "--digits", "20")
    printed = command(*words, *more, "--json", "--plot", "a.png", "--out", "a.nc").json
    assert [row["seed"] for row in printed["rows"][:2]] == [3, 1]
    assert printed["needs"]["disorder"].startswith("needed")
    rows = table(xr.load_dataset("a.nc", engine="h5netcdf"))
    shown = [bars for axes in drawn[0].axes for bars in axes.containers]
    for bars in shown:
        row = rows.loc[bars.get_label().partition(":")[0]]
        seconds, error = bars.lines[0].get_xydata()[0]
        assert seconds == row.seconds
        assert (error == row.error) == (row.solver != "certified")
    assert len(shown) >= 4


def test_the_command_says_first_what_the_scene_needs(command: Command) -> None:
    out = command("compare", "two-sliders-cycles", "--events", "20", "--dts", "0.1").out
    assert out.index("disorder") < out.index("law") < out.index("parted")
    assert out.rstrip().splitlines()[-1].startswith("For trajectories take")
