"""At every extreme of the model a solver is right, or says by itself that it may not be."""

from __future__ import annotations

import math
import tracemalloc
import warnings
from collections.abc import Iterator
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from exactcreep import (
    Chain,
    Creep,
    Cycles,
    Drive,
    Experiment,
    InputError,
    State,
    Targets,
    compare,
    creep,
)
from exactcreep.model.enclosure import exact_value
from exactcreep.model.numbers import nearest_float
from exactcreep.quasistatic.creep import PhysicsWarning

pytestmark = [
    pytest.mark.xdist_group("extremes"),
    pytest.mark.filterwarnings("ignore::exactcreep.quasistatic.creep.PhysicsWarning"),
]
PAIR = Chain(2, 1000, "0.5", "0.6", tan_alpha="0.25")
START = State.prepared(PAIR, [Fraction(1, 32)])


def chain_of(n: int = 3, l0: Any = 1000, **changed: Any) -> Chain:
    usual: dict[str, Any] = {"mu_d": "0.5", "mu_s": "0.6", "sigma_mu": "0.01", "tan_alpha": "0.25"}
    return Chain(n, l0, **usual | changed)


def cycles(chain: Chain, reach: Any) -> Cycles:
    """Return a cycle of the amplitude at which ``l0 A = reach``."""
    return Cycles(Fraction(reach) / chain.l0, 1)


def hard() -> Iterator[tuple[str, Chain, Drive]]:
    """Yield for each quantity experiments that take it to its end, by what is extreme in them."""
    for n, reach in ((2, "1.5"), (3, "1.5"), (30, "2")):
        chain = chain_of(n)
        yield f"N = {n}", chain, cycles(chain, reach)
    for l0 in ("1e-6", "1", "1e6", "1e15"):
        chain = chain_of(3, l0)
        yield f"l0 = {l0}", chain, cycles(chain, 2)
        chain = chain_of(2, l0)
        yield f"l0 A = 20, l0 = {l0}", chain, Targets([Fraction(20) / chain.l0])
    yield "A = 2e-15", chain_of(3, "1e15"), Cycles("2e-15", 2)
    for gap in ("1e-12", "1e-9", "1e-6", "1e-3", "1", "10"):
        for n in (2, 3):
            chain = chain_of(n, mu_s=Fraction(1, 2) + Fraction(gap), sigma_mu=0)
            onset = Fraction(chain.times_cosine(chain.mu_s - chain.tan_alpha))
            theta = (onset + (6 * n + Fraction(1, 3)) * Fraction(chain.excess)) / chain.l0
            yield f"mu_s - mu_d = {gap}, N = {n}", chain, Targets([theta, -theta])
    yield "mu_s = mu_d, sigma_mu = 0.01", chain_of(3, mu_s="0.5"), Targets(["0.001"])
    for steep, sigma in (("0", "0"), ("0.05", "0.01")):
        chain = chain_of(2, mu_d=0, mu_s="0.1", sigma_mu=sigma, tan_alpha=steep)
        yield f"mu_d = 0, tan_alpha = {steep}", chain, cycles(chain, "0.2")
    for sigma in ("0", "1e-12", "0.1", "0.3", "1", "10"):
        chain = chain_of(3, sigma_mu=sigma)
        yield f"sigma_mu = {sigma}", chain, cycles(chain, 2)
    beside = {"mu_d - 1e-12": "-1e-12", "mu_d": "0", "mu_d + 0.05": "0.05"}
    slopes = {"0": Fraction(0), "1e-15": Fraction("1e-15")}
    slopes |= {name: Fraction(1, 2) + Fraction(off) for name, off in beside.items()}
    for name, slope in slopes.items():
        for sigma in ("0", "0.01"):
            chain = chain_of(2, sigma_mu=sigma, tan_alpha=slope)
            # near mu_d one avalanche is long enough
            drive = Targets([Fraction("0.3") / chain.l0]) if name in beside else cycles(chain, 1)
            yield f"tan_alpha = {name}, sigma_mu = {sigma}", chain, drive
    repeated = Targets(["0.001", "0.001", "0.002", "0.002", "0.002", "-0.001", "-0.001", 0, 0])
    yield "repeated targets", chain_of(3), repeated
    for n in (3, 4, 6):
        chain = chain_of(n, sigma_mu=0, tan_alpha=0)
        yield f"tie by symmetry, N = {n}", chain, cycles(chain, 1)
    chain = chain_of(3, sigma_mu=0, tan_alpha="0.2")
    yield "tie by numbers", chain, cycles(chain, 1)


with warnings.catch_warnings(action="ignore", category=PhysicsWarning):
    HARD = {
        name: Experiment(chain, drive, seed=1, start=State.relaxed(chain, 1), record=())
        for name, chain, drive in hard()
    }
ENDLESS = {"mu_d = 0, tan_alpha = 0.05"} | {
    f"tan_alpha = mu_d + 0.05, sigma_mu = {sigma}" for sigma in ("0", "0.01")
}
EVENTS = 250
ROUNDING = 32 * 2.0**-52
"""What float64 may be off at a rest, over the largest force, for each event: errors add up."""


def remainder_error(result: Creep) -> float:
    """Return how far ``(x_2 - x_1 - l0) mod 2D`` is from where it began, of two sliders."""
    chain, state, begin = result.chain, result.state, result.experiment.initial
    stretched = Fraction(float(state.tensions[0])) + chain.l0 * exact_value(state.theta)
    before = Fraction(begin.tensions[0]) + chain.l0 * exact_value(begin.theta)
    period = 2 * Fraction(chain.excess)
    left = (stretched - before) / period
    return nearest_float(abs(left - round(left)) * period)


def largest_force(chain: Chain) -> float:
    force = nearest_float((chain.mu_s + abs(chain.tan_alpha)) * Fraction(chain.cos_alpha))
    return force + 10 * nearest_float(chain.sigma_mu)


@pytest.mark.parametrize("name", sorted(HARD.keys() - ENDLESS))
def test_no_event_is_wrong_unless_the_solver_calls_itself_undecided(name: str) -> None:
    data, chain = compare(HARD[name], [HARD[name]], seeds=1, events=EVENTS), HARD[name].chain
    assert data.truth_evidence.item() == "proved"
    own = data.isel(method=0, seed=0)
    if own.differs:  # 1e-15 is below the last place of a force of order one
        assert (own.evidence, name) == ("undecided", "tan_alpha = 1e-15, sigma_mu = 0")
    else:
        assert own.rests > 0
        assert own.error <= (1 + int(own.agreed)) * ROUNDING * largest_force(chain)


@pytest.mark.parametrize("name", sorted(ENDLESS))
def test_what_never_comes_to_rest_is_refused(name: str) -> None:
    with pytest.raises(InputError, match="must come to rest once"):
        compare(HARD[name], [HARD[name]], seeds=1, events=EVENTS)


def test_the_ends_of_a_long_chain_move_like_those_of_a_short_one() -> None:
    long, short = (chain_of(n, sigma_mu=0) for n in (100_000, 30))
    drive = Cycles(Fraction(2) / long.l0, 2)
    moved, half = creep(long, drive, record=()).state.displacements.tolist(), 15
    proved = creep(short, drive, record=(), solver="certified", digits=20).state.displacements
    assert not any(moved[half:-half])
    assert np.allclose(moved[:half] + moved[-half:], [float(x) for x in proved.tolist()],
                       rtol=0, atol=1e-12)  # fmt: skip


def test_lone_slips_lose_what_the_law_says() -> None:
    run = creep(PAIR, Cycles(Fraction(PAIR.excess) / 10, 50), start=START, record="rearrangements")
    assert run.slip_count > 9000
    # each of the slips is 2 D long, against the friction mu_d c
    law = 2 * PAIR.excess * PAIR.friction * run.slip_count
    lost = math.fsum(run.recorded["rearrangement_dissipation"])
    assert lost == pytest.approx(law, rel=1e-15, abs=0)
    assert remainder_error(run) < 1e-12


def test_without_columns_the_memory_of_a_run_does_not_grow_with_its_length() -> None:
    def peak(cycles: int) -> int:
        tracemalloc.start()
        creep(PAIR, Cycles("0.01", cycles), record=())
        _, most = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        return most

    peak(10)  # loads what is loaded once
    assert peak(500_000) < 1.4 * peak(200_000)  # a column more would make it 2.5
