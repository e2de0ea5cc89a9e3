"""The energy of two sliders over a whole run: what the drive puts in, friction takes out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from exactcreep import Chain, Cycles, Evidence, InputError, State, creep
from exactcreep.model.contacts import Contacts
from exactcreep.motion.replay import Replay
from exactcreep.quasistatic.creep import PhysicsWarning
from exactcreep.solvers.exact.solver import ExactSimulation
from exactcreep.solvers.solver import Stretch
from exactcreep.studies.energy import two_slider_ledger
from exactcreep.studies.envelope import remainder_error
from exactcreep.studies.eventlog import rearrangements

PAIR = Chain(2, 1000, "0.5", "0.6", tan_alpha="0.25")
HUNDREDS = Cycles(Fraction(PAIR.excess) / 10, 50)  # of slips in a half-cycle
START = State.prepared(PAIR, [Fraction(1, 32)])


@pytest.mark.parametrize(
    ("sigma_mu", "tan_alpha"),
    [("0", "0.25"), ("0", "0"), ("0.05", "0.25"), ("0.1", "0.45"), ("0.3", "-0.2")],
)
@pytest.mark.filterwarnings(f"ignore::{PhysicsWarning.__module__}.PhysicsWarning")
def test_the_drive_and_gravity_pay_for_friction(sigma_mu: str, tan_alpha: str) -> None:
    chain = Chain(2, 1000, "0.5", "0.6", sigma_mu, tan_alpha=tan_alpha)
    drive = Cycles("0.01", 50)
    ledger, end = two_slider_ledger(chain, drive, seed=3)
    plain = creep(chain, drive, seed=3)
    assert np.array_equal(end.displacements, plain.state.displacements)
    assert ledger.slips == plain.slip_count > 2500
    assert ledger.energies.friction > 100
    assert ledger.balance < 4e-15
    assert ledger.apart < 1e-15 * ledger.slips
    assert ledger.energies.lost < 1e-20
    assert np.sign(float(ledger.energies.gravity)) == np.sign(float(chain.tan_alpha) * plain.x_G)


@pytest.mark.parametrize(("sigma_mu", "tan_alpha"), [("0", "0.25"), ("0.01", "0.45")])
def test_the_ledger_is_the_sum_over_all_rearrangements(sigma_mu: str, tan_alpha: str) -> None:
    chain = Chain(2, 1000, "0.5", "0.6", sigma_mu, tan_alpha=tan_alpha)
    drive = Cycles("0.002", 10)
    ledger, _ = two_slider_ledger(chain, drive, seed=3)
    run = creep(chain, drive, seed=3, record=("events",))
    state, contacts = run.experiment.initial, Contacts(chain, 3)
    friction, gravity, lost = 0.0, 0.0, 0.0
    for one in rearrangements(run.recorded):
        tensions = state.tensions - 1000 * (one.theta - state.theta)
        begin = replace(state, tensions=tensions, theta=one.theta)
        replay = Replay(chain, begin, one.events, contacts=contacts)
        for phase in replay:
            phase.finish()
        state = replay.state()
        energies = replay.energies()
        friction += energies.friction
        gravity += energies.gravity
        lost += energies.lost
    assert friction > 1
    assert float(ledger.energies.friction) == pytest.approx(friction, rel=1e-11, abs=0)
    assert float(ledger.energies.gravity) == pytest.approx(gravity, rel=1e-10, abs=0)
    assert lost < 1e-20


def test_lone_slips_lose_what_the_law_says() -> None:
    ledger, _ = two_slider_ledger(PAIR, HUNDREDS, start=START)
    # each of the slips is 2 D long, against the friction mu_d c
    friction = 2 * PAIR.excess * PAIR.friction * ledger.slips
    assert float(ledger.energies.friction) == pytest.approx(friction, rel=1e-15, abs=0)


def spoiled(monkeypatch: pytest.MonkeyPatch, **changes: Any) -> None:
    """Let every log of the exact solver be another one than what happened."""
    follow = ExactSimulation.follow

    def changed(self: ExactSimulation, *given: Any, **more: Any) -> Stretch:
        stretch = follow(self, *given, **more)
        log: Mapping[str, NDArray[Any]] = stretch.recorded
        columns = {name: changes[name](log) for name in changes}
        return Stretch(stretch.completed, {**log, **columns}, stretch.stop, stretch.reason)

    monkeypatch.setattr(ExactSimulation, "follow", changed)


def test_a_slip_that_lasted_a_millionth_longer_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    spoiled(monkeypatch, event_time=lambda log: log["event_time"] * (1 + 1e-6))
    ledger, _ = two_slider_ledger(PAIR, HUNDREDS, start=START)
    assert ledger.energies.lost > 1e-10  # it is stopped at a velocity


def test_a_slip_at_another_theta_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    def shifted(log: Mapping[str, NDArray[Any]]) -> NDArray[Any]:
        theta = log["event_theta"].copy()
        theta[log["event_rearrangement"] == 70] += 1e-9 / 1000
        return theta

    spoiled(monkeypatch, event_theta=shifted)
    ledger, _ = two_slider_ledger(PAIR, HUNDREDS, start=START)
    assert ledger.apart > 1e-10
    assert abs(ledger.left) > 1e-12


def test_a_slip_of_the_other_slider_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    def swapped(log: Mapping[str, NDArray[Any]]) -> NDArray[Any]:
        slider = log["event_slider"].copy()
        there = log["event_rearrangement"] == 70
        slider[there] = 3 - slider[there]
        return slider

    spoiled(monkeypatch, event_slider=swapped)
    ledger, _ = two_slider_ledger(PAIR, HUNDREDS, start=START)
    assert ledger.apart > 0.1


def test_the_ledger_is_for_two_sliders_that_come_to_rest() -> None:
    with pytest.raises(InputError, match="n = 3"):
        two_slider_ledger(Chain(3, 1, "0.5", "0.6", tan_alpha=0), HUNDREDS)
    with pytest.raises(InputError, match="must end at rest"):
        two_slider_ledger(Chain(2, 1000, "0.5", "0.6", tan_alpha="0.55"), Cycles("0.01", 2))


@pytest.mark.slow
def test_a_billion_slips_keep_the_remainder_and_balance_their_energy() -> None:
    drive = Cycles(Fraction(PAIR.excess) / 10, 5_200_000)
    result = creep(PAIR, drive, start=START, record=(), max_events=3 * 10**9)
    assert result.slip_count > 10**9
    assert remainder_error(result) < 1e-9
    assert result.evidence is Evidence.COMPUTED
    ledger, end = two_slider_ledger(PAIR, drive, start=START)
    assert np.array_equal(end.displacements, result.state.displacements)
    assert np.array_equal(end.tensions, result.state.tensions)
    assert ledger.slips == result.slip_count
    assert ledger.energies.friction > 9 * 10**7
    assert ledger.balance < 1e-15
    assert ledger.energies.lost < 1e-15
    assert ledger.apart < 1e-15 * ledger.slips
