"""What theory predicts for a chain and a drive."""

from __future__ import annotations

from typing import Any

import pytest

from exactcreep import laws
from exactcreep.laws import LAWS, law_values, prediction
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles, GaussianSteps
from exactcreep.model.drive import Path as Dilations
from exactcreep.model.state import State
from tests.laws.parameters import (
    F,
    chain_of,
    in_context,
)


@pytest.mark.parametrize("drive", [Cycles("0.004", 100), GaussianSteps("0.003", 100)])
def test_a_prediction_is_the_law_at_the_pivot_and_turns_with_the_incline(drive: Any) -> None:
    label = "vitesse_seuil" if drive.cyclic else "vitesse_seuil_random"
    for n in range(2, 9):
        chain = chain_of(n, "0.23")
        size = {"amplitude": F(4, 1000)} if drive.cyclic else {"sigma_theta": F(3, 1000)}
        described = chain.parameters() | size
        i = laws.pivot(n, F(23, 100), F(1, 2))
        found = prediction(chain, drive)
        assert found is not None
        assert found.label == label
        known = {name: described[name] for name in LAWS[label].printed.required}
        assert found.printed == (float(LAWS[label].printed(**known, i=i)),)
        exact = LAWS[label].exact
        assert exact is not None
        assert found.sliding == (float(exact(**known, i=i)),)
        up = prediction(chain.mirrored(), drive)
        assert up is not None
        assert up.printed == tuple(-value for value in found.printed)
        assert up.sliding == tuple(-value for value in found.sliding)


def test_a_prediction_has_two_values_where_two_pivots_are_possible() -> None:
    found = prediction(chain_of(4, "1/4"), Cycles("0.01", 1))
    assert found is not None
    low, high = found.sliding
    assert high == 3 * low > 0
    assert len(found.printed) == 2
    below = prediction(chain_of(4, "1/4"), Cycles("1e-5", 1))
    assert below is not None
    assert below.sliding == (0.0,)


def test_two_relaxed_sliders_are_predicted_by_their_staircase_and_others_by_the_limit() -> None:
    chain, drive = chain_of(2, "0.25"), Cycles("0.004", 1)
    found = prediction(chain, drive)
    assert found is not None
    exact = laws.staircase_two_sliders(1000, F(1, 2), F(3, 5), F(1, 4), F(4, 1000))
    assert found.values == (found.staircase,) == (float(exact),)
    assert found.values != found.sliding
    for other, start in (
        (chain, State.prepared(chain, ["0.01"])),
        (Chain(2, 1000, "0.5", "0.6", "0.01", tan_alpha="0.25"), None),
        (chain_of(3, "0.24"), None),
    ):
        limit = prediction(other, drive, start)
        assert limit is not None
        assert limit.staircase is None
        assert limit.values == limit.sliding


def test_theory_says_rest_for_one_slider_and_without_dilations() -> None:
    for chain, drive in (
        (chain_of(1, "0.5"), Cycles("0.01", 1)),
        (chain_of(1, "0.25"), GaussianSteps("0.01", 1)),
        (chain_of(5, "0.25"), Cycles(0, 1)),
        (chain_of(5, "0.25"), GaussianSteps(0, 1)),
    ):
        found = prediction(chain, drive)
        assert found is not None
        assert (found.printed, found.values) == ((), (0.0,))


def test_theory_is_silent_on_a_path_and_where_the_chain_may_run_away() -> None:
    assert prediction(chain_of(3, "0.25"), Dilations(["0.01", "0"])) is None
    for slope in ("0.5", "0.55", "-0.5"):
        assert prediction(chain_of(3, slope), Cycles("0.01", 1)) is None
        assert law_values(LAWS["vitesse_seuil"].exact, chain_of(3, slope).parameters()) == ()
    assert law_values(LAWS["vitesse"].corrected, {}) == ()


def test_more_bits_give_the_float_nearest_to_the_law() -> None:
    # a hair above the threshold, where the difference of two floats loses digits
    slope, hair = F(23, 100), F(1, 10**9)
    chain = chain_of(3, slope)
    star = 3 * (F(1, 2) - slope) * F(chain.cos_alpha) / 2000
    drive = Cycles(star * (1 + hair), 1)
    found, plain = prediction(chain, drive, bits=300), prediction(chain, drive)
    assert found is not None
    assert plain is not None
    described = chain.parameters() | {"amplitude": drive.amplitude}
    exact = LAWS["vitesse_seuil"].exact
    assert exact is not None
    precise = float(exact(**in_context({k: v for k, v in described.items() if k != "n"}), n=3))
    assert found.sliding == (precise,)
    assert plain.sliding != found.sliding
    assert plain.sliding == pytest.approx(found.sliding, rel=1e-6, abs=0)
