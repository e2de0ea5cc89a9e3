"""The Gaussian integral against quadrature, the staircase at an edge, and which law holds."""

from __future__ import annotations

import math
from fractions import Fraction as F
from functools import partial
from typing import Any

import mpmath
import pytest

from exactcreep import laws
from exactcreep.laws import gaussian_integral, law_values, prediction, staircase_two_sliders
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles, Drive, GaussianSteps
from exactcreep.model.state import State
from exactcreep.model.targets import Targets
from tests.paper import captions

ROUGH = partial(captions, sigma_mu="0.01")
EXACT, MEASURED, UNKNOWN = 0.0, "measured", math.nan
"""Deviations: the law is exact, it was measured, it is not known how far chains are off."""
STICK = "sliders that stick and slip, measured"


@pytest.mark.parametrize("h", ["0", "0.3", "6"])
def test_the_gaussian_integral_agrees_with_quadrature(h: str) -> None:
    ctx = mpmath.mp.clone()
    ctx.dps = 30
    half = ctx.mpf(h)

    def integrand(place: Any) -> Any:
        below, above = ctx.ncdf(place - half), ctx.ncdf(-place - half)
        return below * above / (below + above)

    expected = ctx.quad(integrand, [-16, -2, -0.5, 0, 0.5, 2, 16])
    assert abs(gaussian_integral(half) / expected - 1) < ctx.mpf(10) ** -28
    assert gaussian_integral(float(h)) == pytest.approx(float(expected), rel=4e-15)


def predicted(chain: Chain, drive: Drive, start: State | None = None) -> laws.Prediction:
    found = prediction(chain, drive, start=start)
    assert found is not None
    return found


@pytest.mark.parametrize("n", range(2, 11))
def test_a_prediction_is_the_law_at_the_pivot_and_turns_with_the_incline(n: int) -> None:
    chain = captions(n, tan_alpha="0.23")
    about = {"n": n, "l0": 1000, "mu_d": F(1, 2), "tan_alpha": F(23, 100)}
    about["i"] = laws.pivot(n, chain.tan_alpha, chain.mu_d)
    cycles, random = about | {"amplitude": F("0.004")}, about | {"sigma_theta": F("0.003")}
    for drive, label, printed, exact in (
        (Cycles("0.004", 100), "Eq. 23",
         laws.creep_velocity(**cycles), laws.sliding_velocity(**cycles)),
        (GaussianSteps("0.003", 100), "Eq. 24",
         laws.creep_velocity_random(**random), laws.sliding_velocity_random(**random)),
    ):  # fmt: skip
        found, up = predicted(chain, drive), predicted(chain.mirrored(), drive)
        assert (found.label, found.printed) == (label, (float(printed),))
        assert found.sliding == (float(exact),)
        assert (found.sticking is not None) == (n >= 8)
        for name in ("printed", "sliding", "values"):
            assert sorted(getattr(up, name)) == [-v for v in reversed(getattr(found, name))]


@pytest.mark.parametrize(
    ("chain", "size", "steps", "law", "deviation"),
    [
        (captions(1, tan_alpha="0.5"), "0.01", [0], "rest", EXACT),
        (captions(6, tan_alpha="0.4"), "0.00016", [0], "rest: no creep lasts, proved", EXACT),
        (captions(4, tan_alpha="0.45"), "0.00012", [0],
         "rest: no end of the relaxed chain starts, proved", EXACT),
        (captions(6, tan_alpha="0.4"), "0.0003", [0],
         "rest: a state at rest exists, and all chains tried lost their creep", UNKNOWN),
        (captions(6, tan_alpha="0.4"), "0.0005", [0, 5], "sliding limit, or at rest", UNKNOWN),
        (captions(6, tan_alpha="0.4"), "0.0007", [5], "sliding limit", UNKNOWN),
        (ROUGH(6, tan_alpha="0.4"), "0.0007", [4.898], "sliders that stick and slip", UNKNOWN),
        (captions(3, tan_alpha="0.18"), "0.004", [0, 2],
         "sliding limit of each possible pivot, or locked", UNKNOWN),
        (captions(4), "0.01", [1, 3], "sliding limit of each possible pivot", UNKNOWN),
        (captions(2, tan_alpha=0), "0.004", [0], "no mean drift, by symmetry", EXACT),
        (captions(10, mu_s="0.5"), "0.01", [5], "sliding limit, exact", EXACT),
        (ROUGH(10), "0.01", [5.004], STICK, MEASURED),
    ],
)  # fmt: skip
def test_a_prediction_names_the_law_that_holds_and_how_far_chains_are_from_it(
    chain: Chain, size: str, steps: list[float], law: str, deviation: float | str
) -> None:
    """A step of the velocity is l0 A - N m/2, on the plateau i there are N + 3 - 2 i of them."""
    found = predicted(chain, Cycles(size, 1))
    margin = float(chain.mu_d - chain.tan_alpha) * chain.cos_alpha
    step = 1000 * float(size) - chain.n * margin / 2
    assert found.law == law + "; how far it is off is not known here" * (
        deviation is UNKNOWN and not law.startswith("rest")
    )
    assert found.values == pytest.approx([step * number for number in steps], rel=1e-4)
    if deviation is MEASURED:
        assert found.values == (found.sticking,)
        assert 0 < found.deviation < 0.02 * found.values[0]
    else:
        assert found.sticking is None
        assert found.deviation == pytest.approx(deviation, nan_ok=True)


def test_two_relaxed_sliders_without_disorder_are_predicted_by_their_staircase() -> None:
    chain, drive = captions(2), Cycles("0.004", 1)
    found = predicted(chain, drive)
    slope = {"mu_d": chain.mu_d, "mu_s": chain.mu_s, "tan_alpha": chain.tan_alpha}
    law = laws.staircase_two_sliders(l0=1000, amplitude=drive.amplitude, **slope)
    assert found.values == (found.staircase,) == (float(law),)
    assert (found.law, found.deviation) == ("staircase, exact", 0)
    stretched = predicted(chain, drive, State.prepared(chain, ["0.01"]))
    assert stretched.staircase is None
    assert stretched.values == stretched.sliding != found.values


def test_theory_says_nothing_of_a_path_and_beyond_mu_d() -> None:
    steep = captions(3, tan_alpha="0.5")
    assert prediction(captions(3), Targets(["0.01", "0"])) is None
    assert prediction(steep, Cycles("0.01", 1)) is None
    assert not law_values(laws.sliding_velocity, steep.parameters() | {"amplitude": F(1)})


def test_the_staircase_decides_next_to_an_irrational_threshold() -> None:
    ctx, scale = mpmath.mp.clone(), 10**75
    ctx.dps = 80
    below = int(ctx.floor(ctx.mpf("0.35") * 4 / ctx.sqrt(17) * scale))  # 0.35 cos(alpha)
    chain = {"l0": 1, "mu_d": F(1, 2), "mu_s": F(3, 5), "tan_alpha": F(1, 4)}
    assert staircase_two_sliders(**chain, amplitude=F(below, scale)) == 0
    assert staircase_two_sliders(**chain, amplitude=F(below + 1, scale)) > 0


def test_a_printed_law_ends_below_its_threshold_and_holds_on_a_plateau_of_zero() -> None:
    below, above = (predicted(captions(6), Cycles(size, 1)).printed for size in ("0.0005", "0.001"))
    assert below == ()
    assert min(above) > 0
    assert predicted(captions(5, tan_alpha="0.05"), Cycles("0.01", 1)).printed == (0.0,)
