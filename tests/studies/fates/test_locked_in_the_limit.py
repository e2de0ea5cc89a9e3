"""Starts that approach a locked cycle for ever, without reaching it: their creep is over, too."""

from fractions import Fraction

import numpy as np
import pytest

from exactcreep import Cycles, Evidence, Outcome, State, creep, fate, survival
from exactcreep.laws import law_values, threshold_amplitude
from exactcreep.studies.fates.survival import start_of
from tests.paper import captions

EIGHT = captions(8)
LAW = Fraction(*law_values(threshold_amplitude, EIGHT.parameters()))
AMPLITUDE = LAW * Fraction("1.225")


def start(number: int) -> State:
    return start_of(EIGHT, Fraction("1e-3"), 0, number)[0]


def test_every_start_of_eight_sliders_is_locked_and_its_life_ends_at_its_last_advance() -> None:
    found = survival(EIGHT, AMPLITUDE, starts=16, cycles=1600)
    marginal = np.array([record.marginal for record in found.records])
    assert found.summary()["marginal"] == marginal.sum() >= 6
    assert found.fractions["locked"].starts == 16
    assert found.evidence is Evidence.UNDECIDED
    later = survival(EIGHT, AMPLITUDE, starts=16, cycles=2400)
    assert np.array_equal(later.lifetimes, found.lifetimes)
    assert later.rate == found.rate  # it does not narrow with the horizon


@pytest.mark.parametrize("number", [12])
def test_the_forces_change_by_one_and_a_half_d_over_the_square_of_cycles(number: int) -> None:
    """A slip that begins y before the end's neighbour stops leaves y - y^2/(6 D) for the next."""
    found = fate(EIGHT, AMPLITUDE, start=start(number), cycles=4000, solver="exact")
    assert (found.outcome, found.evidence) == (Outcome.CYCLING, Evidence.UNDECIDED)
    assert (found.marginal, found.period, found.advance) == (True, 1, 0.0)
    assert found.last_advance <= found.settled_after
    assert found.reason.startswith("locked in the limit: forces that change by ")
    assert {half for half, _ in found.itinerary} == {1, 2}
    drive = Cycles(AMPLITUDE, 4000)
    run = creep(EIGHT, drive, start=start(number), record=("tension", "slips"))
    assert (run.outcome, run.velocity, run.velocity_error) == (Outcome.CYCLING, 0, 0)
    assert run.direction == "none"
    tensions = run.recorded["tension"][1::2]
    cycles = np.array([1000, 2000, 3900])
    steps = np.abs(tensions[cycles, 0] - tensions[cycles - 1, 0])
    growth = np.diff(steps**-0.5) / np.diff(cycles)  # whatever it began with
    assert growth == pytest.approx((1.5 * EIGHT.excess) ** -0.5, rel=0.01)
    slips = run.recorded["slips"][2 * found.settled_after :]
    assert not slips[:, 2:6].any()
    assert (slips[2:] == slips[:-2]).all()


def test_only_an_approach_is_marginal() -> None:
    assert not fate(captions(5), "0.000759", solver="exact").marginal  # returns bit for bit
    assert not fate(captions(4), "0.00095", solver="exact").marginal  # to within rounding
    begin = start_of(captions(30), Fraction("1e-3"), 0, 1)[0]  # chaos without advance
    bounded = fate(captions(30), "0.003383", start=begin, cycles=3000, solver="exact")
    assert (bounded.outcome, bounded.marginal) == (Outcome.LIMIT, False)
