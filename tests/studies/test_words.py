"""What creep, fate and survival say of one chain is the same, in the same words."""

from fractions import Fraction

import pytest

from exactcreep import (
    Cycles,
    Evidence,
    GaussianSteps,
    Outcome,
    creep,
    fate,
)
from tests.paper import captions


@pytest.mark.parametrize("solver", ["exact", "certified", "reference", "mpmath", "verlet"])
def test_a_chain_that_locked_early_is_cycling_since_then_in_every_solver(solver: str) -> None:
    """Its ends go on slipping in every cycle; no solver sees it move after the third."""
    chain, amplitude = captions(4, tan_alpha="0.212"), "0.00061107"
    settled = fate(chain, amplitude)
    assert (settled.outcome, settled.evidence) == (Outcome.CYCLING, Evidence.PROVED)
    assert settled.last_advance == 3
    options = {"dt": "0.001"} if solver == "verlet" else {}
    result = creep(chain, Cycles(amplitude, 9), solver=solver, **options)
    assert (result.outcome, result.since) == (Outcome.CYCLING, settled.settled_after)
    assert result.velocity == 0
    assert result.settled
    if result.outcome_evidence is not Evidence.UNDECIDED:  # its tensions return exactly
        assert result.velocity_error == 0
        assert f"up to cycle {result.since}" in result.reason
    worth = {"exact": Evidence.COMPUTED, "certified": Evidence.PROVED}
    assert result.outcome_evidence is worth.get(solver, result.outcome_evidence)


def test_a_drift_below_two_standard_errors_is_not_called_creep() -> None:
    result = creep(captions(30), Cycles(Fraction("0.00338337"), 1500), record=())
    assert abs(result.velocity) < 2 * result.velocity_error
    assert (result.outcome, result.outcome_evidence) == (Outcome.CYCLING, Evidence.UNDECIDED)
    bound = float(result.reason.rpartition(" ")[2])
    assert bound == pytest.approx(abs(result.velocity) + 2 * result.velocity_error, rel=0.1)
    level = creep(captions(6, "0.01", tan_alpha="0"), GaussianSteps("0.01", 400), seed=3)
    assert (level.outcome, level.outcome_evidence) == (Outcome.CYCLING, Evidence.UNDECIDED)
