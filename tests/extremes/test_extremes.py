"""At every extreme of the model a solver is right, or says by itself that it may not be."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest

from exactcreep import (
    Chain,
    Cycles,
    InputError,
    Method,
    compare,
    creep,
)
from exactcreep.model.numbers import nearest_float
from tests.extremes.hard_experiments import (
    PAIR,
    START,
    chain_of,
    hard_experiments,
    remainder_error,
)

pytestmark = [
    pytest.mark.xdist_group("extremes"),
    pytest.mark.filterwarnings("ignore::exactcreep.quasistatic.creep.PhysicsWarning"),
]
HARD = hard_experiments()
ENDLESS = {"mu_d = 0, tan_alpha = 0.05"} | {
    f"tan_alpha = mu_d + 0.05, sigma_mu = {sigma}" for sigma in ("0", "0.01")
}
METHODS = [Method("exact"), Method("reference"), Method("mpmath", digits=30)]
EVENTS = 250
ROUNDING = 32 * 2.0**-52
"""What float64 may be off at a rest, over the largest force, for each event: errors add up."""


def largest_force(chain: Chain) -> float:
    force = nearest_float((chain.mu_s + abs(chain.tan_alpha)) * Fraction(chain.cos_alpha))
    return force + 10 * nearest_float(chain.sigma_mu)


@pytest.mark.parametrize("name", sorted(HARD.keys() - ENDLESS - {"N = 1000"}))
def test_no_event_is_wrong_unless_the_solver_calls_itself_undecided(name: str) -> None:
    data, chain = compare(HARD[name], METHODS, seeds=1, events=EVENTS), HARD[name].chain
    assert len(HARD) >= 50
    assert data.truth_evidence.item() == "proved"
    for place, method in enumerate(METHODS):
        own = data.isel(method=place, seed=0)
        if own.differs:  # 1e-15 is below the last place of a force of order one
            assert (own.evidence, name) == ("undecided", "tan_alpha = 1e-15, sigma_mu = 0")
            continue
        assert own.rests == np.isfinite(own.errors).sum() > 0
        each = 1e-28 if method.solver == "mpmath" else ROUNDING
        assert own.error <= (1 + int(own.agreed)) * each * largest_force(chain), method.label


@pytest.mark.parametrize("name", sorted(ENDLESS))
def test_what_never_comes_to_rest_is_refused(name: str) -> None:
    with pytest.raises(InputError, match="must come to rest once"):
        compare(HARD[name], METHODS, seeds=1, events=EVENTS)


def test_the_ends_of_a_long_chain_move_like_those_of_a_short_one() -> None:
    for n in (1000, 100_000):
        long, short = (chain_of(k, sigma_mu=0) for k in (n, 30))
        drive = Cycles(Fraction(2) / long.l0, 2)
        result = creep(long, drive, record=())
        proved = creep(short, drive, record=(), solver="certified", digits=20).state.displacements
        moved, half = result.state.displacements.tolist(), 15
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


@pytest.mark.slow
def test_a_thousand_sliders_are_right_too() -> None:
    own = compare(HARD["N = 1000"], METHODS[:1], seeds=1, events=EVENTS).isel(method=0, seed=0)
    assert not own.differs
    assert own.error < 1e-13


@pytest.mark.slow
def test_a_billion_slips_keep_the_remainder() -> None:
    drive = Cycles(Fraction(PAIR.excess) / 10, 5_200_000)
    result = creep(PAIR, drive, start=START, record=(), max_events=3 * 10**9)
    assert result.slip_count > 10**9
    assert remainder_error(result) < 1e-9
