"""Quiescent cycles and waiting times, held against runs whose rests are known by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from exactcreep import Chain, Creep, Cycles, GaussianSteps, InputError, State, creep, quiescent

SIX = Chain(6, 1000, "0.5", "0.6", "0.01", tan_alpha="0.25")


@pytest.fixture(scope="module")
def run() -> Creep:
    return creep(SIX, Cycles("0.0008", 400), seed=6, record=("x_G",))


def test_jumps_and_rests_are_those_of_the_displacement(run: Creep) -> None:
    rests = quiescent(run)
    ends = run.dataset.x_G.values[1::2]
    assert rests.jump == SIX.excess * 6 / 4
    first, cycles = run.burn_in // 2, ends.size - run.burn_in // 2
    moved = [abs(ends[k] - ends[k - 1]) > rests.jump for k in range(first, ends.size)]
    assert 10 < sum(moved) == rests.jumps == len(rests.table) < cycles - 10
    assert rests.cycles == cycles
    assert rests.fraction == 1 - sum(moved) / cycles
    assert rests.waiting.sum() + rests.open_ends.sum() == cycles - 1
    assert rests.waiting_mean == rests.waiting.mean()
    table = rests.table
    assert table.cycle.tolist() == [first + 1 + k for k, jumped in enumerate(moved) if jumped]
    assert table.waited.tolist() == [-1, *rests.waiting]
    assert np.allclose(table.advance, [ends[k - 1] - ends[k - 2] for k in table.cycle], rtol=1e-12)


def test_a_larger_jump_leaves_more_rest(run: Creep) -> None:
    assert quiescent(run, jump=10**6).fraction == 1
    assert quiescent(run, jump=0).fraction <= quiescent(run).fraction
    never = quiescent(run, jump=10**6)
    assert never.jumps == 0 == len(never.table)
    assert math.isnan(never.waiting_mean)
    assert never.open_ends.tolist() == [[never.cycles, never.cycles]]


def test_runs_are_pooled_without_a_wait_from_one_to_the_next() -> None:
    starts = [State.perturbed(SIX, "0.01", start_seed=k, seed=k) for k in (1, 2)]
    runs = [
        creep(SIX, Cycles("0.0008", 200), start=start, seed=k, record=("x_G",))
        for k, start in zip((1, 2), starts, strict=True)
    ]
    both, alone = quiescent(runs), [quiescent(each) for each in runs]
    assert both.jumps == sum(each.jumps for each in alone)
    assert both.waiting.tolist() == [wait for each in alone for wait in each.waiting]
    assert set(both.table.run) == {0, 1}
    assert 0 < both.fraction_error < 0.5


def test_the_error_of_the_fraction_is_the_scatter_of_pools() -> None:
    runs = [creep(SIX, Cycles("0.0008", 100), seed=seed) for seed in range(240)]
    pools = [quiescent(runs[k : k + 8]) for k in range(0, 240, 8)]
    scatter = np.std([pool.fraction for pool in pools], ddof=1)
    said = np.sqrt(np.mean([pool.fraction_error**2 for pool in pools]))
    assert 0.7 < scatter / said < 1.4
    assert math.isnan(quiescent(runs[0]).fraction_error)


def test_the_first_advance_is_counted_from_where_the_chain_began() -> None:
    first = creep(SIX, Cycles("0.0009", 100), seed=1, record=("x_G",))
    later = creep(SIX, Cycles("0.0009", 5), seed=1, start=first.state, record=("x_G",), burn_in=0)
    assert abs(float(first.x_G)) > 20
    assert (quiescent(later, jump=0).table.advance.abs() < 5).all()


def test_what_has_no_cycles_or_no_displacement_is_refused(run: Creep) -> None:
    with pytest.raises(InputError, match=r"x_G not recorded"):
        quiescent(creep(SIX, Cycles("0.0008", 10), record=()))
    with pytest.raises(InputError, match=r"Cycles"):
        quiescent(creep(SIX, GaussianSteps("0.001", 10), record=("x_G",)))
    with pytest.raises(InputError, match=r"at least one"):
        quiescent([])
    with pytest.raises(InputError, match=r"jump"):
        quiescent(run, jump=-1)
    other = creep(
        Chain(3, 1000, "0.5", "0.6", tan_alpha="0.25"), Cycles("0.001", 9), record=("x_G",)
    )
    with pytest.raises(InputError, match=r"must be given"):
        quiescent([run, other])
    assert quiescent([run, other], jump="0.01").cycles > run.half_cycles // 2 - run.burn_in
