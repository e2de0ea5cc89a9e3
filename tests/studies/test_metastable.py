"""Creep that a run shows and the long run does not: drawn coefficients stop the chain for ever."""

import pytest

from exactcreep import Chain, Cycles, Outcome, creep, survival
from exactcreep.laws.stopping import stopping_time
from tests.paper import captions

TWO = captions(2, sigma_mu="0.01")
THREE = Chain(3, 1000, "0.5", "0.727", "0.01", tan_alpha="0.14")


def test_creep_says_that_it_is_metastable_and_how_long_it_lives() -> None:
    drive = Cycles("0.000356", 300)
    runs = [creep(TWO, drive, seed=seed) for seed in range(12)]
    creeping = [run for run in runs if run.outcome is Outcome.CREEPING]
    assert len(creeping) > 5
    life = stopping_time(TWO, "0.000356").cycles
    for run in creeping:
        assert f"after some {life:.2g} cycles in the mean" in run.metastable
        assert run.metastable in repr(run)
        assert run.velocity_of == "this run: the mean over half-cycles 61 to 600"
    assert not any(run.metastable or run.velocity for run in runs if run not in creeping)
    three = creep(THREE, Cycles("0.00073624", 2000), seed=1)
    assert three.metastable.startswith("metastable: a draw exists that stops the chain for ever")
    assert "survival tells for how long" in three.metastable
    assert "cycles" not in three.metastable  # no number is known


@pytest.mark.parametrize(
    ("chain", "amplitude"),
    [
        (TWO, "0.000352"),
        (TWO, "0.000356"),
        (captions(2, sigma_mu="0.003"), "0.00033"),  # those that still live have other phases
    ],
)
def test_the_mean_life_of_two_sliders_is_that_of_many_starts(chain: Chain, amplitude: str) -> None:
    """The relays are held against the solver: what is left of lives after half of the arrests."""
    found = survival(chain, amplitude, starts=150, size="0.1", cycles=40_000)
    life = stopping_time(chain, amplitude)
    assert life.computed
    assert found.fractions["at_rest"].starts == 150
    assert found.rate.low < 1 / life.cycles < found.rate.high
