"""How long creep lives, and what the statistics of lives are worth."""

import pickle
from concurrent.futures import ThreadPoolExecutor
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from scipy import stats

from exactcreep import Chain, Cycles, Evidence, InputError, Outcome, State, creep, fate, survival
from exactcreep.studies.fates import survival as study
from exactcreep.studies.fates.survival import Life, Survival
from tests.conftest import Command
from tests.paper import captions

SIX = captions(6)
HORIZON = Fraction("0.00096428272")
"""The threshold of six sliders by horizon."""


@pytest.fixture(scope="module")
def six() -> Survival:
    return survival(SIX, HORIZON * Fraction("1.005"), starts=60, cycles=2000)


def made(lifetimes: np.ndarray, censored: np.ndarray) -> Survival:
    """Return a survival of invented lives."""

    def life(outcome: Outcome, cycles: int) -> Life:
        return Life(
            outcome.value, "computed", cycles, cycles, cycles, -1, 0, -1, dormant=False, over=False
        )

    lives = [life(Outcome.CYCLING, int(cycles)) for cycles in lifetimes]
    lives += [life(Outcome.LIMIT, int(cycles)) for cycles in censored]
    return Survival(SIX, Fraction(1), Fraction(1), len(lives), 10**6, 0, 500, tuple(lives))


@pytest.mark.parametrize("share", ["0.15", "0.6", "1.1"])
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
    assert found.fractions["undecided"].starts == 0


def test_six_sliders_lock_at_a_constant_rate(six: Survival) -> None:
    """Forty starts of an earlier study lived 910 cycles in the mean."""
    low, high = (stats.chi2.ppf(p, 2 * 40) / 2 / (40 * 910) for p in (0.025, 0.975))
    assert six.rate.low < high
    assert six.rate.high > low
    assert six.exponential > 0.01
    fractions = six.fractions
    assert fractions["locked"].starts + fractions["creeping"].starts == 60
    assert six.lifetimes.size > 40


@pytest.mark.slow
@pytest.mark.parametrize(
    ("over", "mean"),
    [
        ("1.0005", 470),
        ("1.002", 740),
        ("1.005", 910),
        ("1.01", 970),
        ("1.015", 2300),
        ("1.02", 3400),
    ],
)
def test_lifetimes_of_six_sliders_are_those_of_an_earlier_study(over: str, mean: int) -> None:
    """It had forty starts; where lifetimes are longest, two hundred are followed here."""
    found = survival(SIX, HORIZON * Fraction(over), starts=200, cycles=60_000)
    assert found.fractions["locked"].starts == 200
    low, high = (stats.chi2.ppf(p, 2 * 40) / 2 / (40 * mean) for p in (0.025, 0.975))
    assert found.rate.low < high
    assert found.rate.high > low


def test_creep_that_is_periodic_counts_as_seen_up_to_the_horizon() -> None:
    chain = captions(3)
    found = survival(chain, "0.00085", starts=5, cycles=10**6)
    assert found.fractions["creeping"].starts == 5
    assert found.censored.tolist() == [10**6] * 5
    assert max(life.cycles for life in found.lives) < 1000
    assert found.rate.high == pytest.approx(-np.log(0.025) / (5 * 10**6))


def test_where_all_starts_do_alike_the_interval_ends_at_its_closed_form() -> None:
    found = made(np.array([]), np.full(20, 30))
    bound = 0.025 ** (1 / 20)  # a share with which all twenty do alike in one case of forty
    assert found.fractions["locked"] == pytest.approx((0, 0, 0, 1 - bound))
    assert found.alive == pytest.approx((20, 1, bound, 1))


def test_a_life_is_that_of_its_start_followed_alone(six: Survival) -> None:
    for number in (1, 2, 7):
        start, key = study.start_of(SIX, six.size, 0, number)
        assert start == State.perturbed(SIX, "1e-3", start_seed=key)
        found = fate(SIX, six.amplitude, start=start, cycles=2000, solver="exact")
        life = six.lives[number - 1]
        assert (life.outcome, life.last_advance) == (found.outcome.value, found.last_advance)
        assert life.settled_after == (-1 if found.settled_after is None else found.settled_after)
        x_g = creep(SIX, Cycles(six.amplitude, found.cycles), start=start).recorded["x_G"][1::2]
        moves = np.diff(x_g, prepend=0.0)[: found.settled_after]
        assert life.last_advance == np.flatnonzero(moves > 1e-12)[-1] + 1


def test_lives_do_not_depend_on_who_follows_them(six: Survival) -> None:
    given = {"starts": 10, "cycles": 2000}
    with ThreadPoolExecutor(3) as pool:
        elsewhere = survival(SIX, six.amplitude, executor=pool, **given)
    assert elsewhere.lives == six.lives[:10]
    assert survival(SIX, six.amplitude, workers=1, **given).lives == six.lives[:10]
    task = study._Task(six, range(5, 7), None)
    assert study.lives_of(pickle.loads(pickle.dumps(task))) == list(six.lives[4:6])
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


def test_the_interval_of_the_rate_holds_the_rate_as_often_as_it_says() -> None:
    random = np.random.default_rng(7)
    held = 0
    for _ in range(400):
        times = random.exponential(300, 40)
        found = made(times[times < 400], np.full((times >= 400).sum(), 400)).rate
        held += found.low <= 1 / 300 <= found.high
    assert 0.93 < held / 400 <= 1.0


def test_without_a_death_the_rate_has_an_upper_bound() -> None:
    found = made(np.array([]), np.full(100, 10_000))
    assert found.rate.rate == found.rate.low == 0
    assert found.rate.high == pytest.approx(-np.log(0.025) / 10**6)
    assert np.array_equal(found.curve.alive, [1.0])
    assert np.isnan(found.exponential)


def test_starts_that_rest_from_the_beginning_die_at_no_finite_rate() -> None:
    found = survival(SIX, 0, starts=3, cycles=5)
    assert found.lifetimes.tolist() == [0, 0, 0]
    assert found.rate == (np.inf, 0, np.inf)


def test_the_curve_steps_down_at_deaths_and_forgets_the_censored() -> None:
    found = made(np.array([10, 20, 20, 50]), np.array([15, 60]))
    assert found.curve.cycles.tolist() == [10, 15, 20, 50, 60]
    steps = [5 / 6, 5 / 6, 5 / 6 * 2 / 4, 5 / 6 * 2 / 4 / 2, 5 / 6 * 2 / 4 / 2]
    assert found.curve.alive == pytest.approx(steps)


def test_lifetimes_at_a_constant_rate_pass_for_exponential_and_others_do_not() -> None:
    random = np.random.default_rng(3)

    def passes(times: np.ndarray, horizon: float) -> float:
        return made(times[times < horizon], np.full((times >= horizon).sum(), horizon)).exponential

    found = [passes(random.exponential(1e4, 60), 2e4) for _ in range(300)]
    assert 0.01 < np.mean(np.array(found) < 0.05) < 0.1
    assert passes(random.exponential(1e4, 60), np.inf) > 0.05
    assert passes(random.uniform(9e3, 1.1e4, 60), 2e4) < 1e-6
    assert passes(random.exponential(1e4, 200) ** 2 / 1e4, 2e4) < 1e-3


def test_the_time_limit_censors_what_it_cut_short() -> None:
    chain = captions(30)
    found = survival(chain, "0.0045", starts=6, cycles=10**9, max_seconds=0.3)
    assert found.reason == "max_seconds = 0.3 was reached"
    assert found.lifetimes.size == 0
    assert found.censored.size == 6
    assert found.censored.max() > 0
    assert found.evidence in (Evidence.COMPUTED, Evidence.UNDECIDED)


def test_the_dataset_holds_every_start_and_how_to_make_it_again(six: Survival) -> None:
    data = six.dataset()
    assert data.sizes["start"] == 60
    assert np.array_equal(data["last_advance"].values[six.dead], six.lifetimes)
    again = survival(
        Chain(**{name: data.attrs[name] for name in SIX.parameters()}),
        data.attrs["amplitude"], starts=3, size=data.attrs["size"], cycles=data.attrs["cycles"],
        seed=data.attrs["seed"],
    )  # fmt: skip
    assert again.lives == six.lives[:3]


@pytest.mark.parametrize(
    ("field", "given"),
    [
        ("starts", {"starts": 0}),
        ("size", {"size": -1}),
        ("seed", {"seed": 2**32}),
        ("dormant", {"dormant": 0}),
        ("cycles", {"cycles": 0}),
        ("max_seconds", {"max_seconds": -1}),
        ("workers", {"workers": 0}),
    ],
)
def test_an_argument_out_of_range_is_refused(field: str, given: dict[str, int]) -> None:
    with pytest.raises(InputError) as error:
        survival(SIX, "0.001", **given)  # type: ignore[arg-type]
    assert error.value.field == field


def test_a_chain_without_slips_is_refused() -> None:
    sliding = Chain(6, 1000, "0.5", "0.5", tan_alpha="0.25")
    with pytest.raises(InputError, match="sliding"):
        survival(sliding, "0.001")


def test_one_slider_rests_or_runs_away() -> None:
    for slope, kind in (("0.25", "at_rest"), ("0.7", "runaway")):
        chain = Chain(1, 1000, "0.5", "0.6", tan_alpha=slope)
        assert survival(chain, "0.001", starts=3, cycles=5).fractions[kind].starts == 3


def test_the_command_prints_draws_and_writes_what_the_function_returns(
    command: Command, tmp_path: Path
) -> None:
    plot, out = tmp_path / "lives.png", tmp_path / "lives.nc"
    words = ["survival", "--n", "6", "--amplitude", "0.000969", "--starts", "8", "--cycles", "600"]
    told = command(*words, "--plot", str(plot), "--out", str(out), "--json")
    assert told.code == 0
    found = survival(SIX, "0.000969", starts=8, cycles=600)
    assert told.json["lifetimes"] == found.lifetimes.tolist()
    assert told.json["rate"]["high"] == found.rate.high
    assert told.json["fractions"]["locked"]["starts"] == found.lifetimes.size
    assert plot.stat().st_size > 10_000
    with xr.open_dataset(out) as written:
        assert np.array_equal(written["last_advance"], found.dataset()["last_advance"])
    shown = command(*words).out
    assert f"deaths {found.lifetimes.size} " in " ".join(shown.split())
    assert command(*words, "--max-seconds", "0").code == 3
