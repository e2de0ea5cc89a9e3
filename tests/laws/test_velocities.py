"""The Gaussian integral against quadrature, and what theory predicts for a chain and a drive."""

from __future__ import annotations

from typing import Any

import pytest

from exactcreep import laws
from exactcreep.laws import gaussian_integral, law_values, prediction
from exactcreep.laws.predictions import Prediction
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles, Drive, GaussianSteps
from exactcreep.model.drive import Path as Dilations
from exactcreep.model.state import State
from tests.laws.parameters import CONTEXT, F, agree
from tests.paper import captions

ABOUT = {"l0": 1000, "mu_d": F(1, 2), "tan_alpha": F(23, 100)}
DISORDERED = captions(2, "0.01")


def predicted(chain: Chain, drive: Drive, **options: Any) -> Prediction:
    found = prediction(chain, drive, **options)
    assert found is not None
    return found


@pytest.mark.parametrize("h", ["0", "0.3", "6"])
def test_the_gaussian_integral_agrees_with_quadrature(h: str) -> None:
    ctx, half = CONTEXT, CONTEXT.mpf(h)

    def integrand(place: Any) -> Any:
        below, above = ctx.ncdf(place - half), ctx.ncdf(-place - half)
        return below * above / (below + above)

    expected = ctx.quad(integrand, [-16, -2, -0.5, 0, 0.5, 2, 16])
    assert agree(gaussian_integral(half), expected, 44)
    assert gaussian_integral(float(h)) == pytest.approx(float(expected), rel=4e-15)


@pytest.mark.parametrize(
    ("drive", "size", "label", "printed", "exact"),
    [
        (Cycles("0.004", 100), {"amplitude": F(4, 1000)}, "Eq. 23",
         laws.creep_velocity, laws.sliding_velocity),
        (GaussianSteps("0.003", 100), {"sigma_theta": F(3, 1000)}, "Eq. 24",
         laws.creep_velocity_random, laws.sliding_velocity_random),
    ],
)  # fmt: skip
def test_a_prediction_is_the_law_at_the_pivot_and_turns_with_the_incline(
    drive: Drive, size: dict[str, F], label: str, printed: Any, exact: Any
) -> None:
    for n in range(2, 9):
        chain = captions(n, tan_alpha="0.23")
        pivot = laws.pivot(n, chain.tan_alpha, chain.mu_d)
        known = ABOUT | size | {"n": n, "i": pivot}
        found, up = predicted(chain, drive), predicted(chain.mirrored(), drive)
        assert found.label == label
        assert found.printed == (float(printed(**known)),)
        assert found.sliding == (float(exact(**known)),)
        assert up.printed == tuple(-value for value in found.printed)
        assert up.sliding == tuple(-value for value in found.sliding)


def test_a_prediction_has_two_values_where_two_pivots_are_possible() -> None:
    found = predicted(captions(4), Cycles("0.01", 1))
    low, high = found.sliding
    assert high == 3 * low > 0
    assert len(found.printed) == 2
    assert predicted(captions(4), Cycles("1e-5", 1)).sliding == (0.0,)


def test_two_relaxed_sliders_are_predicted_by_their_staircase_and_others_by_the_limit() -> None:
    chain, drive = captions(2), Cycles("0.004", 1)
    found = predicted(chain, drive)
    known = chain.parameters() | {"amplitude": F(4, 1000)}
    del known["n"], known["sigma_mu"]
    exact = laws.staircase_two_sliders(**known)
    assert found.values == (found.staircase,) == (float(exact),)
    assert found.values != found.sliding
    for other, start in (
        (chain, State.prepared(chain, ["0.01"])),
        (DISORDERED, None),
        (captions(3, tan_alpha="0.24"), None),
    ):
        limit = predicted(other, drive, start=start)
        assert limit.staircase is None
        assert limit.values == limit.sliding


@pytest.mark.parametrize(
    ("chain", "drive", "values"),
    [
        (captions(1, tan_alpha="0.5"), Cycles("0.01", 1), (0.0,)),
        (captions(1), GaussianSteps("0.01", 1), (0.0,)),
        (captions(5), Cycles(0, 1), (0.0,)),
        (captions(3), Dilations(["0.01", "0"]), None),
        (captions(3, tan_alpha="0.5"), Cycles("0.01", 1), None),
        (captions(3, tan_alpha="-0.5"), Cycles("0.01", 1), None),
    ],
)
def test_theory_says_rest_where_nothing_slips_and_nothing_on_a_path_or_beyond_mu_d(
    chain: Chain, drive: Drive, values: tuple[float, ...] | None
) -> None:
    found = prediction(chain, drive)
    assert (found and (found.printed, found.values)) == (values and ((), values))
    about = chain.parameters() | {"amplitude": F(1)}
    assert bool(law_values(laws.sliding_velocity, about)) is (abs(chain.tan_alpha) < chain.mu_d)
