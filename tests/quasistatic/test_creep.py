"""The quasi-static loop: what it measures, what it claims, and that stopping changes nothing."""

import math
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from exactcreep import (
    Chain,
    Creep,
    Cycles,
    Evidence,
    InputError,
    Outcome,
    State,
    creep,
)
from exactcreep import Path as ThetaPath
from exactcreep.limits import Limits
from exactcreep.model.enclosure import floats
from exactcreep.progress import Progress
from exactcreep.quasistatic import creep as loop
from exactcreep.quasistatic.creep import PhysicsWarning, resume
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.quasistatic.result import load_members, save_members
from tests.conftest import Command
from tests.quasistatic.runs import RECORDS, SIX, TWO, TWO_SURE, same


def test_two_sliders_creep_on_the_staircase_with_no_error() -> None:
    c = 4 / math.sqrt(17)
    step, onset = 2 * 0.1 * c, (0.6 - 0.25) * c
    for amplitude in (0.0005, 0.002, 0.00731):
        result = creep(TWO_SURE, Cycles(str(amplitude), 400))
        stairs = step * max(0, math.ceil((1000 * amplitude - onset) / step))
        assert result.velocity == pytest.approx(stairs, rel=1e-12, abs=0)
        assert result.velocity_error < 1e-12
        assert result.outcome is Outcome.CREEPING


def test_a_chain_below_its_threshold_is_at_rest() -> None:
    result = creep(TWO_SURE, Cycles("0.0003", 10))
    assert result.outcome is Outcome.AT_REST
    assert (result.velocity, result.slip_count, result.event_count) == (0.0, 0, 0)


def test_a_chain_on_the_level_slips_in_every_cycle_without_net_displacement() -> None:
    level = Chain(2, 1000, "0.5", "0.6", tan_alpha=0)
    result = creep(level, Cycles("0.01", 20))
    assert result.outcome is Outcome.CYCLING
    assert result.slip_count > 20
    assert result.velocity == 0


def test_a_chain_that_returns_to_its_tensions_cycles_for_ever_whatever_it_did_before() -> None:
    six = Chain(6, 1000, "0.5", "0.6", tan_alpha="0.2")
    result = creep(six, Cycles("0.001", 50))
    x = result.recorded["x_G"]
    assert result.outcome is Outcome.CYCLING
    assert x[-1] == x[-3] == x[-5]
    assert x[result.burn_in - 1] < x[-1]
    assert (result.velocity, result.velocity_error) == (0, 0)
    assert "transient" in result.reason
    at_ends = x[1::2]
    assert (at_ends[result.since - 1 :] == x[-1]).all()
    assert at_ends[result.since - 2] < x[-1]
    longer = creep(six, Cycles("0.001", 500)).recorded["x_G"]
    assert longer[-1] == x[-1]


def test_creep_is_the_advance_of_every_slider() -> None:
    for amplitude, outcome in (("0.004", Outcome.CREEPING), ("0.002", Outcome.CYCLING)):
        result = creep(Chain(30, 1000, "0.5", "0.6", tan_alpha="0.25"), Cycles(amplitude, 30),
                       record=("x", "slips"))  # fmt: skip
        change = result.recorded["x"][-1] - result.recorded["x"][result.burn_in - 1]
        assert result.outcome is outcome
        assert (change > 0).all() == (outcome is Outcome.CREEPING)
        assert result.recorded["slips"][-2:].sum() > 0


def test_a_single_cycle_with_slips_is_not_called_rest() -> None:
    chain = Chain(3, 1000, "0.5", "0.6", tan_alpha=0)
    found = creep(chain, Cycles("0.001", 1))
    assert found.slip_count > 0
    assert found.outcome is Outcome.CYCLING


def test_a_single_cycle_cannot_tell_creep_from_a_transient() -> None:
    chain = Chain(6, 1000, "0.5", "0.6", tan_alpha="0.25")
    one, many = (creep(chain, Cycles("0.00095", cycles)) for cycles in (1, 50))
    assert many.outcome is Outcome.CYCLING
    assert (one.outcome, one.evidence) == (Outcome.CREEPING, Evidence.UNDECIDED)
    assert "transient" in one.reason


def test_a_single_slider_rests() -> None:
    result = creep(Chain(1, 1, "0.5", "0.6", tan_alpha="0.25"), Cycles("0.01", 3))
    assert result.outcome is Outcome.AT_REST
    assert result.dataset.sizes["spring"] == 0


@pytest.mark.parametrize("solver", ["exact", "verlet"])
def test_what_is_recorded_changes_no_bit(solver: str) -> None:
    options = {"dt": "0.05"} if solver == "verlet" else {}
    everything = creep(SIX, Cycles("0.005", 10), solver=solver, record=RECORDS, **options)
    nothing = creep(SIX, Cycles("0.005", 10), solver=solver, record=(), **options)
    assert np.array_equal(everything.state.displacements, nothing.state.displacements)
    assert everything.velocity == nothing.velocity
    assert np.array_equal(everything.velocity_error, nothing.velocity_error, equal_nan=True)
    assert nothing.recorded == {}
    assert "half_cycle" not in nothing.dataset.sizes


def test_the_records_agree_with_each_other() -> None:
    result = creep(SIX, Cycles("0.005", 10), record=RECORDS)
    data = result.dataset
    assert np.allclose(data.x.mean("slider"), data.x_G, rtol=1e-14, atol=0)
    assert int(data.slips.sum()) == result.slip_count
    starts = data.event_kind == 0
    assert int(starts.sum()) == int((~starts).sum()) == result.slip_count
    length = 1000 * (1 + data.theta)
    # T_n = x_(n+1) - x_n - theta l0, with x_n the displacements
    gap = data.x.diff("slider").values - (length - 1000).values[:, None]
    assert np.allclose(gap, data.tension, rtol=0, atol=1e-11)
    assert data.slider.values.tolist() == [1, 2, 3, 4, 5, 6]
    assert data.spring.values.tolist() == [1, 2, 3, 4, 5]
    assert data.x_G.attrs["units"] == "g tau_dyn^2"


def test_a_result_survives_its_file(tmp_path: Path) -> None:
    start = State.prepared(SIX, [Fraction(1, 3), 0, "0.1", 0, 0], theta="0.001", seed=2**64 - 1)
    drive = ThetaPath(["0.01", "-1/300", 0.002, 0.01])
    result = creep(
        SIX, drive, seed=2**64 - 1, start=start, record=RECORDS, solver="verlet", dt="1/20"
    )
    result.save(tmp_path / "a.nc")
    loaded = Creep.load(tmp_path / "a.nc")
    assert loaded.dataset.identical(result.dataset)
    assert loaded.experiment.chain == SIX
    assert loaded.experiment.drive == drive
    assert loaded.experiment.initial.tensions[0] == Fraction(1, 3)
    assert loaded.summary() == result.summary()
    again = creep(
        loaded.chain,
        loaded.drive,
        seed=loaded.seed,
        start=loaded.experiment.start,
        record=loaded.experiment.record,
        solver=loaded.solver,
        **loaded.experiment.options,
    )
    assert same(again, result)


def test_members_survive_their_file(tmp_path: Path) -> None:
    results = [creep(TWO, Cycles("0.01", 5), seed=seed) for seed in range(3)]
    save_members(results, tmp_path / "a.nc")
    loaded = load_members(tmp_path / "a.nc")
    assert [r.summary() for r in loaded] == [r.summary() for r in results]
    with pytest.raises(InputError, match="holds 3 members"):
        Creep.load(tmp_path / "a.nc")


def test_a_file_that_exists_is_not_overwritten_without_force(tmp_path: Path) -> None:
    result = creep(TWO, Cycles("0.01", 5))
    target = tmp_path / "a.nc"
    target.write_text("precious")
    with pytest.raises(InputError, match="exists"):
        result.save(target)
    assert target.read_text() == "precious"
    result.save(target, force=True)
    assert Creep.load(target).velocity == result.velocity
    assert [path.name for path in tmp_path.iterdir()] == ["a.nc"]


def test_a_foreign_file_is_no_result(tmp_path: Path) -> None:
    target = tmp_path / "a.nc"
    target.write_bytes(b"CDF\x01 or something else")
    for path in (target, tmp_path, tmp_path / "none.nc"):
        with pytest.raises(InputError):
            Creep.load(path)


@pytest.mark.parametrize(
    ("limit", "told"),
    [({"max_events": 500}, "max_events = 500"), ({"max_seconds": 0.05}, "max_seconds = 0.05"),
     ({"max_bytes": 4000}, "max_bytes = 4000"), ({"max_seconds": 0}, "max_seconds = 0")],
)  # fmt: skip
def test_a_limit_is_an_outcome_with_the_partial_result(limit: dict, told: str) -> None:
    result = creep(TWO, Cycles("0.01", 10**9), **limit)
    assert result.outcome is Outcome.LIMIT
    assert told in result.reason
    assert result.recorded["x_G"].size == result.half_cycles < 10**9
    if result.half_cycles:
        assert result.recorded["x_G"][-1] > 0
        whole = creep(TWO, Cycles("0.01", result.half_cycles))
        reached = result.recorded["x_G"]
        assert np.array_equal(whole.recorded["x_G"][: reached.size], reached)


def test_the_time_begins_when_the_first_run_is_ready(monkeypatch: pytest.MonkeyPatch) -> None:
    moment, compilations = [0.0], [0.0, 1e6]

    def passes(*_: object) -> float:
        moment[0] += 1e6
        return compilations.pop(0)

    # the private name stands for all that happens before the first half-cycle
    monkeypatch.setattr(loop, "_warm_up", passes)
    monkeypatch.setattr(loop.time, "perf_counter", lambda: moment[0])
    members = [Experiment.of(TWO, Cycles("0.01", 10), seed=seed) for seed in (1, 2)]
    results = loop.run_members(members, limits=Limits.of(max_seconds=1))
    assert [result.half_cycles for result in results] == [20, 20]


def test_members_for_which_no_time_is_left_are_not_begun(command: Command, tmp_path: Path) -> None:
    words = ("run", "two-sliders-cycles", "--set", "vary.run.seed=[1, 2]", "--out", "a.nc")
    done = command(*words, "--checkpoint", "a.ckpt", "--max-seconds", "0")
    assert done.code == 3
    assert "1 members: 1 limit; 1 not run" in done.out
    assert len(load_members(tmp_path / "a.nc")) == 1
    done = command("resume", "a.ckpt", "--json", "--max-events", "100")
    assert [member["events"] for member in done.json["members"]] == [100, 100]


def test_a_runaway_has_no_mean_velocity() -> None:
    steep = Chain(4, 1000, "0.5", "0.6", "0.01", tan_alpha="0.55")
    result = creep(steep, Cycles("0.01", 1000))
    assert result.outcome is Outcome.RUNAWAY
    assert result.velocity == math.inf
    assert result.summary()["velocity"] is None
    assert result.half_cycles < 2000
    assert creep(steep.mirrored(), Cycles("0.01", 1000)).velocity == -math.inf


def test_a_chain_at_the_angle_of_friction_that_neither_rests_nor_runs_away_is_given_up() -> None:
    edge = Chain(3, 1000, "0.5", "0.6", tan_alpha="0.5")
    result = creep(edge, Cycles("0.01", 1000))
    assert result.outcome is Outcome.LIMIT
    assert "proved to run away" in result.reason


def test_limits_that_are_not_numbers_are_refused() -> None:
    for limit in ({"max_events": -1}, {"max_seconds": "soon"}, {"max_bytes": 1.5}):
        with pytest.raises(InputError, match=next(iter(limit))):
            creep(TWO, Cycles("0.01", 5), **limit)


def test_an_option_that_the_solver_does_not_take_is_an_error() -> None:
    with pytest.raises(InputError, match=r"'dt'.*'exact' does not take it"):
        creep(TWO, Cycles("0.01", 5), dt=0.01)
    with pytest.raises(InputError, match="must be among x_G"):
        creep(TWO, Cycles("0.01", 5), record=("velocity",))
    with pytest.raises(InputError, match="start"):
        creep(TWO, Cycles("0.01", 5), start=State.relaxed(SIX))
    with pytest.raises(InputError, match=r"burn_in = 11: .* at most 10"):
        creep(TWO, Cycles("0.01", 5), burn_in=11)
    with pytest.raises(InputError, match="twin = 'yes': must be true or false"):
        creep(TWO, Cycles("0.01", 5), twin="yes")


def test_a_result_shows_its_outcome_whatever_it_recorded() -> None:
    for record in (("x_G",), ()):
        result = creep(TWO_SURE, Cycles("0.001", 5), record=record)
        assert repr(result).startswith("Creep(n=2, solver='exact', outcome='creeping', evidence=")
        assert "g tau_dyn^2 per half-cycle" in repr(result)


def test_progress_reaches_the_last_half_cycle() -> None:
    seen: list[Progress] = []
    creep(TWO, Cycles("0.01", 2000), progress=seen.append)
    running = [progress for progress in seen if progress.phase == "running"]
    counts = [progress.half_cycles for progress in running]
    assert counts == sorted(counts)
    assert counts[-1] == running[-1].total == 4000


def test_physics_out_of_range_is_warned_of_once_and_counted() -> None:
    wild = Chain(3, 1000, "0.5", "0.6", "0.3", tan_alpha="0.25")
    with pytest.warns(PhysicsWarning, match="drawn below mu_d") as caught:
        result = creep(wild, Cycles("0.01", 5))
    assert [warning.filename for warning in caught] == [__file__]  # where the caller stands
    assert result.warnings == {"draws_below_mu_d": result.draws_below_mu_d}
    assert result.draws_below_mu_d > 10
    short = Chain(3, "0.001", "0.5", "0.6", tan_alpha="0.25")
    with pytest.warns(PhysicsWarning, match=r"\|theta\| reached 1"):
        assert creep(short, Cycles(1, 5)).warnings["theta_beyond_one"] == 10


def test_sliders_that_would_cross_are_counted() -> None:
    close = Chain(3, "0.5", "0.5", "0.6", tan_alpha="0.25")
    pressed = State.prepared(close, ["-0.55", "-0.3"])
    with pytest.warns(PhysicsWarning, match="crossed"):
        result = creep(close, Cycles("0.001", 5), start=pressed)
    assert result.warnings["crossings"] == 10


def test_rearrangements_too_long_for_the_promise_are_counted(tmp_path: Path) -> None:
    chain = Chain(8, 1, "1/1000", "101/1000", tan_alpha="-3/5000")
    tensions = [Fraction(t, 100) for t in (-3, 18, -18, -14, -2, 0, -2)]
    start = State.prepared(chain, tensions)
    result = creep(chain, ThetaPath(["0"]), start=start, checkpoint=tmp_path / "run.ckpt")
    assert (result.rearrangements, result.event_count) == (1, 672)
    assert result.evidence is Evidence.UNDECIDED
    assert result.long_rearrangements == result.summary()["long_rearrangements"] == 1
    result.save(tmp_path / "run.nc")
    assert Creep.load(tmp_path / "run.nc").long_rearrangements == 1
    assert resume(tmp_path / "run.ckpt").long_rearrangements == 1
    short = creep(TWO, Cycles("0.01", 3))
    assert short.rearrangements > 100
    assert short.long_rearrangements == 0


@pytest.mark.parametrize(("old", "new"), [("events", "event_count"), ("slips", "slip_count")])
def test_the_old_name_of_a_count_warns_and_names_the_new_one(old: str, new: str) -> None:
    result = creep(TWO, Cycles("0.01", 5))
    with pytest.warns(DeprecationWarning, match=f"use Creep.{new}"):
        count = getattr(result, old)
    assert count == getattr(result, new) == result.summary()[old] > 0


def test_first_coefficients_hold_until_a_slider_slips_and_a_very_large_one_is_a_nail() -> None:
    chain = Chain(4, 1000, "0.5", "0.6", tan_alpha="0.25")
    start = replace(State.relaxed(chain), coefficients=[0.9, 0.6, 0.7, 50.0])
    for solver in ("exact", "reference", "certified", "verlet"):
        once = creep(chain, ThetaPath(["0.002"]), solver=solver, start=start)
        assert (once.state.draws > 1).tolist() == [True, True, False, False]
        assert floats(once.state.coefficients).tolist() == [0.6, 0.6, 0.7, 50.0]
        run = creep(chain, Cycles("0.002", 2), solver=solver, start=start, record="x")
        assert (run.state.draws > 1).tolist() == [True, True, True, False]
        assert floats(run.state.coefficients).tolist() == [0.6, 0.6, 0.6, 50.0]
        assert not floats(run.recorded["x"])[:, 3].any()
    sliding = creep(chain, Cycles("0.002", 2), solver="sliding", start=start, record="x")
    assert sliding.recorded["x"][:, 3].any()
