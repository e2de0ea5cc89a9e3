"""The energy of a whole run: what the drive and gravity put in, friction takes out."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest

from exactcreep import Chain, Cycles, Evidence, State, creep
from exactcreep.model.enclosure import floats
from exactcreep.quasistatic.creep import PhysicsWarning
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.solvers.interface import Stretch, advance
from exactcreep.watch.limits import Stop
from tests.extremes.hard_experiments import PAIR, START, remainder_error


class Ledger(dict[str, float]):
    """Energies of a run, unit ``m g**2 tau_dyn**2``: drive, gravity, elastic, friction, left.

    Also ``apart``, how far x_G is from the sum over all rearrangements, and ``slips``.
    """

    __getattr__ = dict.__getitem__

    @property
    def balance(self) -> float:
        """What is left over, relative to the energy that friction took."""
        return abs(self["left"]) / (self["friction"] or 1.0)


def energy_ledger(experiment: Experiment) -> tuple[Ledger, State]:
    """Return where the energy of a run came from and went, and the state at its end.

    Between rearrangements theta alone moves and works against the springs; during one it is frozen,
    and gravity and the springs work against friction. Every line of the table of rearrangements is
    on its own: a slider that was stopped in motion, or too far, leaves a rest.
    """
    drive, begin = experiment.drive, experiment.initial
    simulation = experiment.algorithm.simulation(
        experiment.chain, begin, experiment.seed, ("rearrangements",)
    )
    sums: list[tuple[float, ...]] = []  # of gravity, friction, what is left, the displacement

    def take(stretch: Stretch) -> None:
        names = ("elastic_before", "elastic_after", "gravity", "dissipation", "displacement")
        before, after, gravity, friction, moved = (
            floats(stretch.recorded[f"rearrangement_{name}"]) for name in names
        )
        terms = gravity, friction, gravity - friction - (after - before), moved
        sums.append(tuple(float(term.sum()) for term in terms))

    stretch = advance(simulation, drive, drive.half_cycles, take=take)
    assert stretch.stop is Stop.DONE, stretch.reason
    end = simulation.state()
    gravity, friction, left, moved = map(math.fsum, zip(*sums, strict=True))
    gained = (floats(end.tensions) ** 2).sum() - (floats(begin.tensions) ** 2).sum()
    elastic = float(gained) / 2
    travelled = float(np.mean(floats(end.displacements) - floats(begin.displacements)))
    drive_work = elastic + left + friction - gravity
    ledger = Ledger(drive=drive_work, gravity=gravity, elastic=elastic, friction=friction)
    ledger.update(left=left, apart=abs(moved - travelled), slips=simulation.tally.slips)
    return ledger, end


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
