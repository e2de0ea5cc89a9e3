"""The staircase of two sliders against an exact rational chain, every slip followed."""

from __future__ import annotations

from fractions import Fraction
from random import Random

from derivations.chain import RationalChain
from exactcreep import laws
from exactcreep.laws import staircase_two_sliders
from tests.laws.parameters import SLOPES, F, context


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
