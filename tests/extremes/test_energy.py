"""The energy of a whole run: what the drive and gravity put in, friction takes out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from exactcreep import Chain, Cycles, Evidence, State, creep
from exactcreep.model.contacts import Contacts
from exactcreep.motion.replay import Replay
from exactcreep.quasistatic.creep import PhysicsWarning
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.solvers.exact.solver import ExactSimulation
from exactcreep.solvers.interface import Stretch
from exactcreep.studies.event_log import rearrangements
from tests.extremes.hard_experiments import chain_of, energy_ledger, remainder_error

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


@pytest.mark.parametrize("n", [2, 3])
def test_the_ledger_is_the_sum_over_all_replayed_rearrangements(n: int) -> None:
    chain, drive = chain_of(n), Cycles("0.002", 10)
    ledger, _ = energy_ledger(Experiment(chain, drive, seed=3))
    run = creep(chain, drive, seed=3, record=("events",))
    state, contacts = run.experiment.initial, Contacts(chain, 3)
    driven = friction = gravity = 0.0

    def ramped(to: float) -> None:
        """Take theta to `to`: its work against the springs is that of their mean tension."""
        nonlocal state, driven
        step = 1000 * (to - state.theta)
        tensions = state.tensions - step
        driven -= step * float((state.tensions + tensions).sum()) / 2
        state = replace(state, tensions=tensions, theta=to)

    for one in rearrangements(run.recorded):
        ramped(one.theta)
        replay = Replay(chain, state, one.events, contacts=contacts)
        for phase in replay:
            phase.finish()
        state = replay.state()
        energies = replay.energies()
        friction += energies.friction
        gravity += energies.gravity
    ramped(run.state.theta)
    assert friction > 1
    assert ledger.friction == pytest.approx(friction, rel=1e-11, abs=0)
    assert ledger.gravity == pytest.approx(gravity, rel=1e-10, abs=0)
    assert ledger.drive == pytest.approx(driven, rel=1e-10, abs=0)


def test_lone_slips_lose_what_the_law_says() -> None:
    ledger, _ = energy_ledger(Experiment(PAIR, HUNDREDS, start=START))
    # each of the slips is 2 D long, against the friction mu_d c
    friction = 2 * PAIR.excess * PAIR.friction * ledger.slips
    assert ledger.friction == pytest.approx(friction, rel=1e-15, abs=0)


def test_a_slip_a_billionth_too_long_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """As if one slider had not stopped where its velocity is zero."""
    follow, longer = ExactSimulation.follow, 1e-9
    more = {"displacement": longer / 2, "gravity": PAIR.sin_alpha * longer,
            "dissipation": PAIR.friction * longer}  # fmt: skip

    def changed(self: ExactSimulation, *given: Any, **options: Any) -> Stretch:
        stretch = follow(self, *given, **options)
        log: Mapping[str, NDArray[Any]] = stretch.recorded
        for name, by in more.items():
            log[f"rearrangement_{name}"][:1] += by
        return stretch

    honest, _ = energy_ledger(Experiment(PAIR, HUNDREDS, start=START))
    monkeypatch.setattr(ExactSimulation, "follow", changed)
    ledger, _ = energy_ledger(Experiment(PAIR, HUNDREDS, start=START))
    assert ledger.apart > 1e-10 > 100 * honest.apart
    assert abs(ledger.left) > 1e-10 > 100 * abs(honest.left)


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
