"""What a chain without disorder does in the end, as float64 finds it."""

from collections import Counter
from fractions import Fraction

import numpy as np
import pytest

from exactcreep import Chain, Cycles, Evidence, Outcome, State, creep, fate, survival
from exactcreep.laws import law_values, threshold_amplitude
from exactcreep.studies.fates.survival import start_of
from tests.paper import captions


@pytest.mark.parametrize(
    ("n", "amplitude"), [(3, "0.00085"), (4, "0.0011"), (5, "0.000759"), (6, "0.000969")]
)
def test_tensions_repeat_from_settled_after_on_and_not_before(n: int, amplitude: str) -> None:
    found = fate(captions(n), amplitude, solver="exact")
    assert found.evidence is Evidence.COMPUTED
    settled, period = found.settled_after, found.period
    drive = Cycles(amplitude, settled + 2 * period)
    run = creep(found.chain, drive, record=("tension", "x_G", "slips")).recorded
    at_ends, x_g = run["tension"][1::2], run["x_G"][1::2]
    assert np.array_equal(at_ends[settled - 1 : -period], at_ends[settled - 1 + period :])
    if settled > 1:
        assert not np.array_equal(at_ends[settled - 2], at_ends[settled - 2 + period])
    for shorter in range(1, period):
        assert not np.array_equal(at_ends[settled - 1], at_ends[settled - 1 + shorter])
    advances = np.diff(x_g, prepend=0.0)[:settled]
    assert found.advanced_until == np.flatnonzero(advances > 1e-12)[-1] + 1
    advance = x_g[settled + period - 1] - x_g[settled - 1]
    assert found.advance == pytest.approx(advance, rel=1e-12, abs=1e-12)
    assert found.velocity == found.advance / (2 * period)
    kinds = Counter(kind for _, events in found.itinerary for kind, *_ in events)
    assert kinds["stop"] == kinds["start"] == run["slips"][2 * settled : -2 * period].sum()


def test_forces_that_return_to_within_rounding_tell_the_proved_period_undecided() -> None:
    """Five sliders come to their cycle from either side, so that two periods return first."""
    found, proved = (fate(captions(5), "0.000765", solver=s) for s in ("exact", "certified"))
    assert (found.evidence, proved.evidence) == (Evidence.UNDECIDED, Evidence.PROVED)
    assert "not bit for bit" in found.reason
    assert (found.outcome, found.period) == (proved.outcome, proved.period)
    assert found.velocity == pytest.approx(proved.velocity, rel=1e-12)


@pytest.mark.parametrize(
    ("n", "amplitude", "evidence", "found", "said"),
    [
        (5, "0.00079", Evidence.COMPUTED, "cycling, settled after 21 cycles (computed)", ""),
        (6, "0.00098", Evidence.COMPUTED, "cycling (computed)", "settle after"),
        (5, "0.000784", Evidence.UNDECIDED, "cycling", "end otherwise (creeping downhill, settled"),
    ],
)
def test_what_rounding_decides_of_a_fate_is_not_called_computed(
    n: int, amplitude: str, evidence: Evidence, found: str, said: str
) -> None:
    """Among nearly identical starts some take other times, and some have other fates."""
    of_float64 = fate(captions(n), amplitude, solver="exact")
    assert (of_float64.evidence, of_float64.finding) == (evidence, found)
    assert of_float64.by_rounding == bool(said)
    assert said in of_float64.reason


@pytest.mark.parametrize("solver", ["certified", "exact"])
def test_a_chain_with_hardly_any_friction_advances_as_others_do(solver: str) -> None:
    for scale in (1, Fraction(1, 10**12), Fraction(1, 10**40)):
        chain = Chain(2, 1000, scale / 2, scale * 3 / 5, tan_alpha=scale / 4)
        assert fate(chain, scale * Fraction("0.0004"), solver=solver).advanced_until == 1


@pytest.mark.parametrize(
    ("n", "tan_alpha", "amplitude", "outcome", "settled", "said"),
    [
        (30, "0.25", "0.0045", Outcome.LIMIT, None, "60 cycles"),
        (4, "0.25", "0", Outcome.AT_REST, 0, ""),
        (4, "0", "0.001", Outcome.CYCLING, 1, ""),
        (3, "0.55", "0.001", Outcome.RUNAWAY, None, "stop ever again"),
    ],
)
def test_chains_that_rest_lock_run_away_and_do_not_settle(
    n: int, tan_alpha: str, amplitude: str, outcome: Outcome, settled: int | None, said: str
) -> None:
    found = fate(captions(n, tan_alpha=tan_alpha), amplitude, cycles=60, solver="exact")
    assert found.outcome is outcome
    assert found.settled_after == settled
    assert (found.advance == 0) == (settled is not None)
    assert said in found.reason


def test_a_start_that_is_not_at_rest_is_first_rearranged() -> None:
    chain = captions(2)
    found = fate(chain, 0, start=State.prepared(chain, ["1.5"]), solver="exact")
    assert (found.outcome, found.settled_after, found.advanced_until) == (Outcome.AT_REST, 1, 1)
    assert found.report["events"] > 0


EIGHT = captions(8)
LAW = Fraction(*law_values(threshold_amplitude, EIGHT.parameters()))
AMPLITUDE = LAW * Fraction("1.225")


def test_every_start_of_eight_sliders_is_locked_and_its_life_ends_at_its_last_advance() -> None:
    found = survival(EIGHT, AMPLITUDE, starts=16, cycles=1600)
    marginal = np.array([life.marginal for life in found.lives])
    assert found.summary()["marginal"] == marginal.sum() >= 6
    assert found.fractions["locked"].starts == 16
    assert found.evidence is Evidence.UNDECIDED
    later = survival(EIGHT, AMPLITUDE, starts=16, cycles=2400)
    assert np.array_equal(later.lifetimes, found.lifetimes)
    assert later.rate == found.rate  # it does not narrow with the horizon


def test_forces_that_change_ever_less_lock_in_the_limit() -> None:
    start, drive = start_of(EIGHT, Fraction("1e-3"), 0, 12)[0], Cycles(AMPLITUDE, 4000)
    found = fate(EIGHT, AMPLITUDE, start=start, cycles=4000, solver="exact")
    assert (found.outcome, found.evidence) == (Outcome.CYCLING, Evidence.UNDECIDED)
    assert (found.marginal, found.period, found.advance) == (True, 1, 0.0)
    assert found.advanced_until <= found.settled_after
    assert found.reason.startswith("locked in the limit: forces that change by ")
    assert {half for half, _ in found.itinerary} == {1, 2}
    run = creep(EIGHT, drive, start=start, record=("slips",))
    assert (run.outcome, run.velocity, run.velocity_error) == (Outcome.CYCLING, 0, 0)
    assert run.direction == "none"
    slips = run.recorded["slips"][2 * found.settled_after :]
    assert not slips[:, 2:6].any()
    assert (slips[2:] == slips[:-2]).all()


def test_only_an_approach_is_marginal() -> None:
    assert not fate(captions(5), "0.000759", solver="exact").marginal  # returns bit for bit
    assert not fate(captions(4), "0.00095", solver="exact").marginal  # to within rounding
    begin = start_of(captions(30), Fraction("1e-3"), 0, 1)[0]  # chaos without advance
    bounded = fate(captions(30), "0.003383", start=begin, cycles=3000, solver="exact")
    assert (bounded.outcome, bounded.marginal) == (Outcome.LIMIT, False)
