"""The Gaussian integral against quadrature, the staircase slip by slip, and which law holds."""

from __future__ import annotations

import math
from fractions import Fraction
from functools import partial
from random import Random
from typing import Any

import pytest

from derivations.chain import RationalChain
from exactcreep import laws
from exactcreep.laws import gaussian_integral, law_values, prediction, staircase_two_sliders
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles, Drive, GaussianSteps
from exactcreep.model.path import Path as Dilations
from exactcreep.model.state import State
from tests.laws.parameters import SLOPES, F, context
from tests.paper import captions

ABOUT = {"l0": 1000, "mu_d": F(1, 2), "tan_alpha": F(23, 100)}
ROUGH = partial(captions, sigma_mu="0.01")
EXACT, MEASURED, UNKNOWN = 0.0, "measured", math.nan
"""Deviations: the law is exact, it was measured, it is not known how far chains are off."""
STICK = "sliders that stick and slip, measured"


@pytest.mark.parametrize("h", ["0", "0.3", "6"])
def test_the_gaussian_integral_agrees_with_quadrature(h: str) -> None:
    ctx = context(30)
    half = ctx.mpf(h)

    def integrand(place: Any) -> Any:
        below, above = ctx.ncdf(place - half), ctx.ncdf(-place - half)
        return below * above / (below + above)

    expected = ctx.quad(integrand, [-16, -2, -0.5, 0, 0.5, 2, 16])
    assert abs(gaussian_integral(half) / expected - 1) < ctx.mpf(10) ** -28
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
    for n in range(2, 11):
        chain = captions(n, tan_alpha="0.23")
        known = ABOUT | size | {"n": n, "i": laws.pivot(n, chain.tan_alpha, chain.mu_d)}
        found, up = prediction(chain, drive), prediction(chain.mirrored(), drive)
        assert found is not None
        assert up is not None
        assert found.label == label
        assert found.printed == (float(printed(**known)),)
        assert found.sliding == (float(exact(**known)),)
        assert (found.sticking is not None) == (n >= 8)
        for name in ("printed", "sliding", "values"):
            assert sorted(getattr(up, name)) == [-v for v in reversed(getattr(found, name))]


@pytest.mark.parametrize(
    ("chain", "size", "steps", "law", "deviation"),
    [
        (captions(1, tan_alpha="0.5"), "0.01", [0], "rest", EXACT),
        (captions(5), "0", [0], "rest", EXACT),
        (captions(6, tan_alpha="0.4"), "0.00016", [0], "rest: no creep lasts, proved", EXACT),
        (captions(4, tan_alpha="0.45"), "0.00012", [0],
         "rest: no end of the relaxed chain starts, proved", EXACT),
        (captions(6, tan_alpha="0.4"), "0.0003", [0],
         "rest: a state at rest exists, and all chains tried lost their creep", UNKNOWN),
        (captions(6, tan_alpha="0.4"), "0.0005", [0, 5], "sliding limit, or locked", UNKNOWN),
        (captions(6, tan_alpha="0.4"), "0.0007", [5], "sliding limit", UNKNOWN),
        (ROUGH(6, tan_alpha="0.4"), "0.0003", [5], "sliding limit", UNKNOWN),
        (captions(3, tan_alpha="0.18"), "0.004", [0, 2],
         "sliding limit of each possible pivot, or locked", UNKNOWN),
        (captions(4), "0.01", [1, 3], "sliding limit of each possible pivot", UNKNOWN),
        (captions(4, tan_alpha="0.274"), "0.01", [1, 3],
         "sliding limit of each possible pivot", UNKNOWN),
        (captions(4, tan_alpha="0.276"), "0.01", [3], "sliding limit", UNKNOWN),
        (captions(9, tan_alpha="0.272"), "0.0012", [4, 6],
         "between the sliding limits of possible pivots", UNKNOWN),
        (captions(2, tan_alpha=0), "0.004", [-1, 1], "sliding limit", UNKNOWN),
        (captions(10, mu_s="0.5"), "0.01", [5], "sliding limit, exact", EXACT),
        (ROUGH(2), "0.004", [1], "sliding limit", UNKNOWN),
        (ROUGH(10), "0.01", [5.004], STICK, MEASURED),
    ],
)  # fmt: skip
def test_a_prediction_names_the_law_that_holds_and_how_far_chains_are_from_it(
    chain: Chain, size: str, steps: list[float], law: str, deviation: float | str
) -> None:
    """A step of the velocity is l0 A - N m/2, on the plateau i there are N + 3 - 2 i of them."""
    found = prediction(chain, Cycles(size, 1))
    assert found is not None
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
    found = prediction(chain, drive)
    assert found is not None
    known = chain.parameters() | {"amplitude": F(4, 1000)}
    del known["n"], known["sigma_mu"]
    assert found.values == (found.staircase,) == (float(laws.staircase_two_sliders(**known)),)
    assert (found.law, found.deviation) == ("staircase, exact", 0)
    stretched = prediction(chain, drive, start=State.prepared(chain, ["0.01"]))
    assert stretched is not None
    assert stretched.staircase is None
    assert stretched.values == stretched.sliding != found.values


def test_theory_says_nothing_of_a_path_and_beyond_mu_d() -> None:
    steep = captions(3, tan_alpha="0.5")
    assert prediction(captions(3), Dilations(["0.01", "0"])) is None
    assert prediction(steep, Cycles("0.01", 1)) is None
    assert not law_values(laws.sliding_velocity, steep.parameters() | {"amplitude": F(1)})


def _case(random: Random) -> dict[str, Fraction]:
    slope = random.choice(SLOPES)
    mu_d = slope * F(random.randint(21, 60), 20)
    return {
        "l0": F(random.randint(1, 400)),
        "mu_d": mu_d,
        "mu_s": mu_d + F(random.randint(1, 40), 50),
        "tan_alpha": slope,
        "amplitude": F(random.randint(1, 300), 10_000),
        "r0": F(random.randint(-40, 40), 41),
    }


def test_the_staircase_is_what_two_sliders_do_slip_by_slip() -> None:
    random, creeping = Random(0), 0
    for _ in range(200):
        p = _case(random)
        slope = p["tan_alpha"]
        cosine = laws.cosine(slope)
        reach = p["l0"] * p["amplitude"] / cosine
        step = p["mu_s"] - p["mu_d"]
        r0 = (p["r0"] / cosine + step) % (2 * step) - step
        forces = [slope + r0, slope - r0]
        pair = RationalChain(2, slope, p["mu_d"], p["mu_s"], forces)
        pair.to(reach)
        pair.to(-reach)
        start = sum(pair.x)
        pair.to(reach)
        pair.to(-reach)
        found = staircase_two_sliders(**p)
        assert sum(pair.x) - start == 4 * found / cosine
        assert (pair.x[1] - pair.x[0]) % (2 * step) == 0
        assert isinstance(found, Fraction | int)
        creeping += found > 0
    assert 40 < creeping < 190


def test_the_staircase_decides_next_to_an_irrational_threshold() -> None:
    ctx, scale = context(80), 10**75
    cosine = 1 / ctx.sqrt(ctx.mpf(17) / 16)
    edge = cosine * ctx.mpf("0.35")
    below = int(ctx.floor(edge * scale))
    chain = {"l0": 1, "mu_d": F(1, 2), "mu_s": F(3, 5), "tan_alpha": F(1, 4)}
    assert staircase_two_sliders(**chain, amplitude=F(below, scale)) == 0
    assert staircase_two_sliders(**chain, amplitude=F(below + 1, scale)) > 0
