"""What runs, fates, survivals, sweeps and thresholds say of one chain is the same."""

from __future__ import annotations

from fractions import Fraction

import pytest

from exactcreep import (
    Cycles,
    Evidence,
    GaussianSteps,
    Outcome,
    creep,
    fate,
    survival,
)
from tests.paper import captions

SHALLOW = captions(4, mu_s="0.612", tan_alpha="0.0058")
UPHILL = "0.002701"
"""An amplitude at which the shallow chain creeps against its slope."""


def test_a_drift_below_two_standard_errors_is_not_called_creep() -> None:
    result = creep(captions(30), Cycles(Fraction("0.00338337"), 1500), record=())
    assert abs(result.velocity) < 2 * result.velocity_error
    assert (result.outcome, result.outcome_evidence) == (Outcome.CYCLING, Evidence.UNDECIDED)
    bound = float(result.reason.rpartition(" ")[2])
    assert bound == pytest.approx(abs(result.velocity) + 2 * result.velocity_error, rel=0.1)
    level = creep(captions(6, "0.01", tan_alpha="0"), GaussianSteps("0.01", 400), seed=3)
    assert (level.outcome, level.outcome_evidence) == (Outcome.CYCLING, Evidence.UNDECIDED)


def test_a_chain_that_creeps_uphill_and_its_mirror_image_say_so() -> None:
    run, image = (creep(chain, Cycles(UPHILL, 200)) for chain in (SHALLOW, SHALLOW.mirrored()))
    assert run.direction == image.direction == fate(SHALLOW, UPHILL).direction == "uphill"
    assert image.velocity == -run.velocity > 0
    lives = survival(SHALLOW, UPHILL, starts=12, cycles=300)
    ways = [record.direction for record in lives.records if record.outcome == "creeping"]
    assert len(ways) == lives.creeping.starts
    assert ways.count("uphill") == lives.directions["uphill"].starts > 0


@pytest.mark.parametrize(
    ("n", "tan_alpha", "amplitude", "cycles", "direction"),
    [
        (3, "0.25", "0.001", 50, "downhill"),
        (3, "0.25", "0.001", 1, "downhill"),  # too short for a velocity
        (3, "0.25", "0.0001", 50, "none"),
        (5, "0.25", "0.0008", 200, "none"),  # locked
        (3, "-0.7", "0.001", 3, "downhill"),  # a runaway
        (4, "0", "0.004", 50, "none"),  # slips for ever in avalanches, as its mirror image does
    ],
)
def test_creep_downhill_rest_and_locked_chains_say_so(
    n: int, tan_alpha: str, amplitude: str, cycles: int, direction: str
) -> None:
    found = creep(captions(n, tan_alpha=tan_alpha), Cycles(amplitude, cycles))
    assert found.direction == direction
