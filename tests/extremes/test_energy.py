"""The energy of a whole run: what the drive and gravity put in, friction takes out."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from exactcreep import Chain, Cycles, Evidence, State, creep
from exactcreep.quasistatic.creep import PhysicsWarning
from exactcreep.quasistatic.experiment import Experiment
from tests.extremes.hard_experiments import energy_ledger, remainder_error

PAIR = Chain(2, 1000, "0.5", "0.6", tan_alpha="0.25")
HUNDREDS = Cycles(Fraction(PAIR.excess) / 10, 50)  # of slips in a half-cycle
START = State.prepared(PAIR, [Fraction(1, 32)])


@pytest.mark.parametrize(
    ("n", "sigma_mu", "tan_alpha"),
    [(2, "0", "0"), (2, "0.3", "-0.2"), (3, "0.05", "0.25"), (6, "0.01", "0.45")],
)
@pytest.mark.filterwarnings(f"ignore::{PhysicsWarning.__module__}.PhysicsWarning")
def test_the_drive_and_gravity_pay_for_friction(n: int, sigma_mu: str, tan_alpha: str) -> None:
    chain = Chain(n, 1000, "0.5", "0.6", sigma_mu, tan_alpha=tan_alpha)
    drive = Cycles("0.01", 50)
    ledger, end = energy_ledger(Experiment(chain, drive, seed=3))
    plain = creep(chain, drive, seed=3)
    assert np.array_equal(end.displacements, plain.state.displacements)
    assert ledger.slips == plain.slip_count > 2500
    assert ledger.friction > 100
    assert ledger.drive > 0
    assert ledger.balance < 4e-15
    assert ledger.apart < 1e-15 * ledger.slips
    assert np.sign(ledger.gravity) == np.sign(float(chain.tan_alpha) * plain.x_G)


def test_lone_slips_lose_what_the_law_says() -> None:
    ledger, _ = energy_ledger(Experiment(PAIR, HUNDREDS, start=START))
    # each of the slips is 2 D long, against the friction mu_d c
    friction = 2 * PAIR.excess * PAIR.friction * ledger.slips
    assert ledger.friction == pytest.approx(friction, rel=1e-15, abs=0)


@pytest.mark.slow
def test_a_billion_slips_keep_the_remainder_and_balance_their_energy() -> None:
    drive = Cycles(Fraction(PAIR.excess) / 10, 5_200_000)
    result = creep(PAIR, drive, start=START, record=(), max_events=3 * 10**9)
    assert result.slip_count > 10**9
    assert remainder_error(result) < 1e-9
    assert result.evidence is Evidence.COMPUTED
    ledger, end = energy_ledger(Experiment(PAIR, drive, start=START))
    assert np.array_equal(end.displacements, result.state.displacements)
    assert np.array_equal(end.tensions, result.state.tensions)
    assert ledger.slips == result.slip_count
    assert ledger.friction > 9 * 10**7
    assert ledger.balance < 1e-15
    assert ledger.apart < 1e-15 * ledger.slips
