"""Quiescent cycles and waiting times, held against the displacements of the runs."""

from __future__ import annotations

import math

import numpy as np
import pytest

from exactcreep import Chain, Creep, Cycles, creep, quiescent

SIX = Chain(6, 1000, "0.5", "0.6", "0.01", tan_alpha="0.25")


def under(cycles: int, seed: int, amplitude: str = "0.0008", **given: object) -> Creep:
    return creep(SIX, Cycles(amplitude, cycles), seed=seed, record=("x_G",), **given)


@pytest.fixture(scope="module")
def run() -> Creep:
    return under(400, 6)


@pytest.mark.parametrize("jump", [None, "0.02", 0, 10**6])
def test_jumps_and_rests_are_those_of_the_displacement(run: Creep, jump: str | None) -> None:
    rests = quiescent(run, jump)
    assert rests.jump == (SIX.excess * 6 / 4 if jump is None else float(jump))
    first = run.burn_in // 2
    advance = np.diff(run.dataset.x_G.values[1::2])[first - 1 :]
    at = np.flatnonzero(abs(advance) > rests.jump)
    assert (rests.cycles, rests.jumps) == (200 * 2 - first, at.size)
    assert rests.fraction == 1 - at.size / rests.cycles
    assert rests.waiting.tolist() == np.diff(at).tolist()
    table = rests.table
    assert table.cycle.tolist() == (first + 1 + at).tolist()
    assert np.allclose(table.advance, advance[at], rtol=1e-12)
    if at.size:
        assert table.waited.tolist() == [-1, *rests.waiting]
        assert rests.open_ends.tolist() == [[at[0], rests.cycles - 1 - at[-1]]]
        assert rests.waiting_mean == np.diff(at).mean()
        assert rests.waiting_ratio == pytest.approx(np.diff(at).std(ddof=1) / np.diff(at).mean())
    else:
        assert rests.open_ends.tolist() == [[rests.cycles] * 2]
        assert math.isnan(rests.waiting_mean)


def test_runs_are_pooled_without_a_wait_between_them_and_their_scatter_is_the_error() -> None:
    runs = [under(100, seed) for seed in range(240)]
    pools = [quiescent(runs[k : k + 8]) for k in range(0, 240, 8)]
    alone = [quiescent(each) for each in runs[:8]]
    assert pools[0].jumps == sum(each.jumps for each in alone)
    assert pools[0].waiting.tolist() == [wait for each in alone for wait in each.waiting]
    assert set(pools[0].table.run) == {k for k in range(8) if alone[k].jumps}
    scatter = np.std([pool.fraction for pool in pools], ddof=1)
    said = np.sqrt(np.mean([pool.fraction_error**2 for pool in pools]))
    assert 0.7 < scatter / said < 1.4
    assert math.isnan(alone[0].fraction_error)


def test_the_first_advance_is_counted_from_where_the_chain_began() -> None:
    first = under(100, 1, "0.0009")
    assert abs(float(first.x_G)) > 20
    later = under(5, 1, "0.0009", start=first.state, burn_in=0)
    assert (quiescent(later, jump=0).table.advance.abs() < 5).all()
