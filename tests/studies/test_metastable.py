"""Creep that a run shows and the long run does not: drawn coefficients stop the chain for ever."""

import numpy as np
import pytest

from exactcreep import Chain, Outcome
from exactcreep.laws.stopping import stopping_time
from tests.conftest import Command
from tests.paper import captions
from tests.questions import creep, survival

TWO = captions(2, sigma_mu="0.01")
THREE = Chain(3, 1000, "0.5", "0.727", "0.01", tan_alpha="0.14")
CASES = {2: (TWO, "0.000356"), 3: (THREE, "0.00073624")}


def test_creep_of_two_sliders_says_that_it_is_metastable_and_how_long_it_lives(
    command: Command,
) -> None:
    runs = [creep(TWO, "0.000356", 300, seed=seed) for seed in range(12)]
    assert sum(run.outcome is Outcome.CREEPING for run in runs) > 5
    life = stopping_time(TWO, "0.000356").cycles
    for run in runs:
        if run.outcome is not Outcome.CREEPING:
            assert (run.metastable, run.velocity) == ("", 0)
            continue
        assert f"after some {life:.2g} cycles in the mean" in run.metastable
        assert run.metastable in repr(run)
        assert run.velocity_of == "this run: the mean over half-cycles 61 to 600"
        told = run.summary()
        assert (told["metastable"], told["velocity_of"]) == (run.metastable, run.velocity_of)
    words = ["run", "two-sliders-cycles", "--set", "chain.sigma_mu=0.01", "--set"]
    words += ["drive.amplitude=0.000356", "--set", "drive.cycles=300", "--seed", "1"]
    shown = " ".join(command(*words).out.split())
    assert "this run: the mean over half-cycles" in shown
    assert "metastable" in shown


def test_creep_of_three_sliders_says_that_it_is_metastable() -> None:
    run = creep(*CASES[3], 2000, seed=1)
    assert run.outcome is Outcome.CREEPING
    assert run.metastable.startswith("metastable: drawn coefficients stop the chain for ever after")
    assert "order of magnitude" in run.metastable


@pytest.mark.parametrize(
    ("n", "sigma_mu", "amplitude"), [(6, "0.01", "0.01"), (2, "0.01", "0.001"), (3, "0", "0.0009")]
)
def test_creep_that_no_draw_stops_is_not_called_metastable(
    n: int, sigma_mu: str, amplitude: str
) -> None:
    run = creep(captions(n, sigma_mu=sigma_mu), amplitude, 200)
    assert (run.outcome, run.metastable) == (Outcome.CREEPING, "")
    assert stopping_time(run.chain, amplitude).cycles > 1e12
    settled = run.velocity_error == 0
    assert run.velocity_of.startswith("the cycle in which" if settled else "this run: the mean")


@pytest.mark.parametrize(
    ("chain", "amplitude"),
    [
        (TWO, "0.000352"),
        (TWO, "0.000354"),
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


def test_draws_that_hardly_change_the_phase_leave_an_estimate() -> None:
    chain, amplitude = Chain(2, 1000, "0.2", "0.3", "0.001", tan_alpha="0.1"), "0.0001991"
    life = stopping_time(chain, amplitude)
    found = survival(chain, amplitude, starts=100, size="0.1", cycles=40_000)
    assert not life.computed
    assert found.rate.low / 3 < 1 / life.cycles < found.rate.high * 3


@pytest.mark.slow
@pytest.mark.parametrize("n", [2, 3])
def test_forty_seeds_followed_to_twenty_thousand_cycles(n: int) -> None:
    chain, amplitude = CASES[n]
    early = [creep(chain, amplitude, 300, seed=seed) for seed in range(40)]
    late = [creep(chain, amplitude, 20_000, seed=seed, record=()) for seed in range(40)]
    for before, after in zip(early, late, strict=True):
        if before.outcome is Outcome.AT_REST:  # for ever
            assert after.outcome is Outcome.AT_REST
        for run in (before, after):
            assert bool(run.metastable) == (run.outcome is Outcome.CREEPING)
    stopped = np.array([run.outcome is Outcome.AT_REST for run in late])
    if n == 2:
        assert stopped.sum() >= 36
        share = 1 - np.exp(-20_000 / stopping_time(chain, amplitude).cycles)
        assert share == pytest.approx(stopped.mean(), abs=0.08)
    else:
        assert 0 < stopped.sum() < 20  # of one in some 1e5 cycles
        moving = [run.velocity for run, over in zip(late, stopped, strict=True) if not over]
        assert np.mean(moving) == pytest.approx(0.02, rel=0.2)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("chain", "amplitude", "starts", "cycles"),
    [
        (TWO, "0.000352", 600, 30_000),
        (TWO, "0.000356", 600, 120_000),
        (TWO, "0.00036", 600, 800_000),
        (THREE, "0.00073624", 24, 100_000),
        (THREE, "0.00073", 24, 40_000),
        (captions(4, "0.01"), "0.00059", 24, 20_000),
        (captions(6, "0.01"), "0.00059", 24, 20_000),
    ],
)
def test_mean_lives_are_computed_to_a_tenth_of_two_sliders_and_estimated_of_more(
    chain: Chain, amplitude: str, starts: int, cycles: int
) -> None:
    size = "0.1" if chain is TWO else "1e-3"
    found = survival(chain, amplitude, starts=starts, size=size, cycles=cycles)
    mean, life = found.durations.sum() / found.lifetimes.size, stopping_time(chain, amplitude)
    assert life.computed == (chain is TWO)
    if life.computed:
        assert mean == pytest.approx(life.cycles, rel=0.12)
    else:
        assert life.cycles / 10 < mean < life.cycles * 10
