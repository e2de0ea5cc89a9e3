"""How long creep lives, and what the statistics of lives are worth."""

from fractions import Fraction

import numpy as np
import pytest

from exactcreep import Chain, Cycles, Outcome, State, creep, fate, survival
from exactcreep.results import Survival
from exactcreep.studies.fates import survival as study
from tests.paper import captions

SIX = captions(6)
HORIZON = Fraction("0.00096428272")
"""The threshold of six sliders by horizon."""


@pytest.fixture(scope="module")
def six() -> Survival:
    return survival(SIX, HORIZON * Fraction("1.005"), starts=60, cycles=2000)


@pytest.mark.parametrize("share", ["0.6", "1.1"])
def test_two_sliders_creep_from_the_starts_that_their_law_says(share: str) -> None:
    """From r0 in (-size, size) they creep if l0 A > a - |r0|: 1 - (a - l0 A)/size of all starts."""
    chain = Chain(2, 1000, "0.5", "0.6", tan_alpha="0.25")
    size, expected = 0.05, min(float(share), 1.0)
    a = float(chain.mu_s) * chain.cos_alpha - chain.sin_alpha
    load = a - (1 - float(share)) * size
    found = survival(chain, Fraction(load / 1000), starts=200, size=size, cycles=50)
    for number, life in enumerate(found.lives, 1):
        state, _ = study.start_of(chain, Fraction(size), 0, number)
        creeps = load > a - abs(state.tensions[0])
        assert (life.outcome == Outcome.CREEPING.value) == creeps
    creeping = found.fractions["creeping"]
    assert creeping.low <= expected <= creeping.high
    assert found.fractions["unsettled"].starts == 0


def test_creep_that_is_periodic_counts_as_seen_up_to_the_horizon() -> None:
    chain = captions(3)
    found = survival(chain, "0.00085", starts=5, cycles=10**6)
    assert found.fractions["creeping"].starts == 5
    assert found.censored.tolist() == [10**6] * 5
    assert max(life.cycles for life in found.lives) < 1000
    assert found.rate.rate == found.rate.low == 0
    assert found.rate.high == pytest.approx(-np.log(0.025) / (5 * 10**6), rel=1e-6)
    assert np.isnan(found.rate.exponential)


def test_a_record_is_that_of_its_start_followed_alone(six: Survival) -> None:
    assert f"{1 / six.rate.rate:.3g} cycles" in six.finding
    assert "any number" not in six.finding
    assert six.reason == ""
    for number in (2, 7):
        start, key = study.start_of(SIX, six.size, 0, number)
        assert start == State.perturbed(SIX, "1e-3", start_seed=key)
        found = fate(SIX, six.amplitude, start=start, cycles=2000, solver="exact")
        life = six.lives[number - 1]
        assert life.outcome == found.outcome.value
        assert life.advanced_until == found.advanced_until
        assert life.settled_after == (-1 if found.settled_after is None else found.settled_after)


def test_records_do_not_depend_on_who_follows_them(six: Survival) -> None:
    given = {"starts": 10, "cycles": 2000, "workers": 1}
    assert survival(SIX, six.amplitude, **given).lives == six.lives[:10]
    others = survival(SIX, six.amplitude, seed=1, **given)
    assert not set(others.lives) & set(six.lives)


def test_with_disorder_rest_alone_is_death_and_dormancy_is_reported_apart() -> None:
    chain = Chain(10, 1000, "0.5", "0.6", "0.01", tan_alpha="0.25")
    found = survival(chain, "0.0006063", starts=8, cycles=1500)
    fractions = found.fractions
    assert fractions["locked"].starts == fractions["creeping"].starts == 0
    assert fractions["dormant"].starts > 0
    assert fractions["at_rest"].starts > 0
    for number, life in enumerate(found.lives, 1):
        start, key = study.start_of(chain, found.size, 0, number)
        run = creep(chain, Cycles(found.amplitude, life.cycles), seed=key, start=start,
                    record=("slips",)).recorded["slips"]  # fmt: skip
        slips = run[0::2] + run[1::2]
        assert (life.outcome == Outcome.AT_REST.value) == (slips[-1].sum() == 0)
        inner = np.flatnonzero(slips[:, 1:-1].sum(axis=1)) + 1
        if life.dormant:
            assert life.cycles - inner.max(initial=0) >= 500
        if life.dormant_after >= 0:
            pauses = np.diff([0, *inner, life.cycles + 1]) - 1
            assert life.dormant_after == [0, *inner][np.flatnonzero(pauses >= 500)[0]]


@pytest.mark.filterwarnings("ignore::exactcreep.results.PhysicsWarning")
def test_starts_that_rest_run_away_or_are_not_begun_are_counted_as_that() -> None:
    assert survival(SIX, 0, starts=3, cycles=5).lifetimes.tolist() == [0, 0, 0]
    steep = survival(captions(1, tan_alpha="0.7"), "0.001", starts=3, cycles=5)
    assert steep.fractions["runaway"].starts == steep.directions["downhill"].starts == 3
    late = survival(captions(30), "0.0045", starts=10**9, cycles=10**9, max_seconds=0)
    assert late.dataset["start"].values.tolist() == [1]
    assert late.censored.size == late.moving.starts == late.moving.share == 1
    assert late.summary().items() >= {"followed": 1, "starts": 10**9}.items()
    assert late.reason == "max_seconds = 0 was reached"


TWO = captions(2, sigma_mu="0.01")


def test_creep_says_that_it_is_metastable() -> None:
    runs = [creep(TWO, Cycles("0.000356", 300), seed=seed) for seed in range(12)]
    creeping = [run for run in runs if run.outcome is Outcome.CREEPING]
    assert len(creeping) > 5
    for run in creeping:
        assert "survival tells for how long" in run.metastable
        assert run.metastable in repr(run)
        assert "half-cycles 61 to 600" in run.finding
    assert not any(run.metastable or run.velocity for run in runs if run not in creeping)
