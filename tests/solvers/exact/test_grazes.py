"""Margins that come within their rounding bound and turn: noticed, however steeply they fall."""

from __future__ import annotations

import math
from typing import Any

import pytest

from exactcreep import Chain, Cycles, Evidence, State, creep, rearrange

GRAZING = Chain(3, 1000, "0.5", "0.5100", "0", tan_alpha="0.473")
"""The speed of slider 3 has a minimum of a few 1e-17 while slider 2 moves; then both stop."""
TENSIONS = [-0.0038935232465282786, 0.015485941569594042]
SHIFTS = [0.0, *(-(10.0**-k) for k in range(18, 12, -1))]
ELSEWHERE = [
    (4, "0.5100", "0.387", [-0.09797908730571969, -0.1437237953022194, -0.03244114934483819], 1),
    (3, "0.5020", "0.260", [-0.10940149938972067, 0.12179929780962939], 1),
    (
        8, "0.5020", "0.4850",
        [
            -0.007714123945909906, 0.003982763633974318, 0.005285501659782643, 0.007771670072986625,
            0.004277598977719288, 0.001135376550640943, 0.0022741975199433995,
        ],
        -1,
    ),
]  # fmt: skip


def require_true(chain: Chain, tensions: list[float], direction: int, solver: str) -> Evidence:
    """Require that what is said to be computed is what is proved; return what is said."""
    state = State.prepared(chain, tensions)
    result, truth = (
        rearrange(chain, state, direction=direction, solver=name) for name in (solver, "certified")
    )
    assert truth.evidence is Evidence.PROVED
    off = abs(result.state.tensions.astype(float) - truth.state.tensions.astype(float)).max()
    if result.evidence is Evidence.COMPUTED:
        assert result.itinerary == truth.itinerary
    assert off < result.error
    return result.evidence


@pytest.mark.parametrize("solver", ["exact", "reference"])
@pytest.mark.parametrize("shift", SHIFTS)
def test_a_speed_that_turns_just_above_zero_is_no_stop(shift: float, solver: str) -> None:
    said = require_true(GRAZING, [TENSIONS[0] + shift, TENSIONS[1]], 1, solver)
    if solver == "exact":  # not all is in doubt
        assert (said is Evidence.COMPUTED) == (shift <= -1e-14)


@pytest.mark.parametrize("solver", ["exact", "reference"])
def test_a_speed_that_touches_zero_within_rounding_is_a_stop_that_is_counted(solver: str) -> None:
    result = rearrange(GRAZING, State.prepared(GRAZING, TENSIONS), direction=1, solver=solver)
    stops = [event for event in result.events if event.kind.value == "stop"]
    assert stops[0].sliders == (3,)
    assert stops[0].time == pytest.approx(3.7262, abs=1e-4)
    assert result.undecided > 0
    assert result.error == math.inf


@pytest.mark.parametrize("solver", ["exact", "reference"])
@pytest.mark.parametrize(("n", "mu_s", "tan_alpha", "tensions", "direction"), ELSEWHERE)
def test_other_grazes_are_undecided_or_right(
    n: int, mu_s: str, tan_alpha: str, tensions: list[float], direction: int, solver: str
) -> None:
    chain = Chain(n, 1000, "0.5", mu_s, "0", tan_alpha=tan_alpha)
    assert require_true(chain, tensions, direction, solver) is Evidence.UNDECIDED


def test_a_run_that_begins_with_a_graze_is_undecided() -> None:
    start = State.prepared(GRAZING, TENSIONS)

    def run(start: State, **options: Any) -> Any:
        return creep(GRAZING, Cycles("0.0005", 1), start=start, burn_in=0, **options)

    truth = run(start, solver="certified")
    assert truth.evidence is Evidence.PROVED
    assert float(truth.x_G) == pytest.approx(1.3847790433, abs=1e-10)
    for solver in ("exact", "reference"):
        assert run(start, solver=solver).evidence is Evidence.UNDECIDED
    aside = State.prepared(GRAZING, [TENSIONS[0] - 1e-12, TENSIONS[1]])
    far = run(aside)
    assert far.evidence is Evidence.COMPUTED
    assert float(far.x_G) == pytest.approx(1.3847790433, abs=1e-9)


def test_a_run_whose_first_avalanche_passes_a_margin_closely_is_undecided() -> None:
    """Events before have amplified rounding so far that each copy passes it on either side."""
    chain = Chain(6, 1000, "1/2", "559/1000", "0.01", tan_alpha="99/200")
    tensions = [
        0.3782726047244666, 0.5718766579910404, 0.2487798085006198, -0.2571279363009996,
        -0.1673001804562964,
    ]  # fmt: skip
    start = State.prepared(chain, tensions, seed=513175)
    run = creep(chain, Cycles("0.0005", 1), start=start, seed=513175, burn_in=0, record=("slips",))
    true_slips = [12, 16, 20, 19, 15, 17]  # of the first half-cycle, by `certified`
    assert run.recorded["slips"][0].tolist() == true_slips or run.undecided_from == 1


def test_a_slider_that_may_turn_round_at_its_last_stop_is_in_doubt() -> None:
    chain = Chain(6, 1000, "1/200", "37/500", tan_alpha="-51/20000")
    tensions = [
        -0.02392694361992819, -0.04381441226216315, -0.039077258307385294, -0.018808107295286747,
        0.027379586010454728,
    ]  # fmt: skip
    result = rearrange(chain, State.prepared(chain, tensions), direction=1, seed=834296)
    assert len(result.events) == 46  # by `certified` two more: the last that stops turns round
    assert result.evidence is Evidence.UNDECIDED
    assert result.doubt.endswith("at event 46, the stop of slider 4")


def test_what_a_slow_slider_has_left_to_go_at_its_stop_is_in_the_error_of_reference() -> None:
    chain = Chain(3, 1000, "1/2", "289/200", tan_alpha="-1/200")
    state = State.prepared(chain, [0.6173793705833505, 1.067373745688812])
    result, truth = (
        rearrange(chain, state, direction=1, solver=name) for name in ("reference", "certified")
    )
    off = abs(result.state.tensions.astype(float) - truth.state.tensions.astype(float)).max()
    assert 3e-15 < off < result.error < 1e-13
