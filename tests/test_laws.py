"""The laws against their derivations, the paper's own text, and exact rational chains."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path
from random import Random
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy as sp
from mpmath.ctx_mp import MPContext

from derivations import gaussian, pivots, two_sliders
from derivations.ledger import entries
from derivations.notation import read, symbol
from derivations.play import NotUnique, SlidingChain
from exactcreep import laws
from exactcreep.laws import LAWS, VOCABULARY, law_values, prediction
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Cycles, GaussianSteps
from exactcreep.model.drive import Path as Dilations
from exactcreep.model.state import State

ROOT = Path(__file__).parents[1]
F = Fraction
BY_NAME = {entry.name: entry for entry in entries()}
SLOPES = (F(3, 4), F(5, 12), F(8, 15), F(7, 24), F(20, 21), F(9, 40))
"""Slopes with a rational cosine."""


def context(digits: int) -> MPContext:
    fresh = MPContext()
    fresh.dps = digits
    return fresh


def random_parameters(random: Random) -> dict[str, Fraction | int]:
    """Return a random chain and drive, all rational; i is an index of its plateau."""
    n = random.randint(2, 40)
    mu_d = F(random.randint(1, 300), 200)
    tan = mu_d * F(random.randint(1, 996), 997)
    return {
        "n": n,
        "i": laws.pivot(n, tan, mu_d),
        "l0": F(random.randint(1, 10**6), random.randint(1, 999)),
        "mu_d": mu_d,
        "mu_s": mu_d + F(random.randint(1, 300), 700),
        "sigma_mu": F(random.randint(0, 100), 1001),
        "tan_alpha": tan,
        "amplitude": F(random.randint(1, 10**4), 10**6),
        "sigma_theta": F(random.randint(1, 10**4), 10**6),
        "kappa": F(random.randint(1, 99), 10**7),
    }


_CONTEXT = context(60)


def in_context(p: Mapping[str, Fraction | int]) -> dict[str, Any]:
    return {
        name: value if name in ("n", "i") else _CONTEXT.mpf(value.numerator) / value.denominator
        for name, value in p.items()
    }


def value_of(expression: Any, p: Mapping[str, Fraction | int]) -> Any:
    """Return a derived expression at the parameters, to 60 digits."""
    tan = sp.Rational(p["tan_alpha"].numerator, p["tan_alpha"].denominator)
    cosine = 1 / sp.sqrt(1 + tan**2)
    names = {
        "n": "N", "i": "i", "l0": "l_0", "mu_d": "mu_d", "mu_s": "mu_s", "sigma_mu": "sigma_mu",
        "amplitude": "A_theta", "sigma_theta": "sigma_theta", "kappa": "kappa",
    }  # fmt: skip
    values = {
        symbol(name): sp.Rational(p[key].numerator, p[key].denominator)
        for key, name in names.items()
    }
    values |= {symbol("c"): cosine, symbol("s"): tan * cosine}
    expression = expression.subs({symbol("Delta_mu"): symbol("mu_s") - symbol("mu_d")})
    # the solid in the chain's units: L = N l0, g rho L/Y = N/l0
    chain_length = symbol("N") * symbol("l_0")
    expression = expression.subs(
        symbol("Y"), symbol("g") * symbol("rho") * symbol("L") * symbol("l_0") / symbol("N")
    ).subs(symbol("L"), chain_length)
    number = sp.N(sp.cancel(expression).subs(values), 70)
    assert number.is_number, expression
    return _CONTEXT.mpf(str(number))


def agree(one: Any, other: Any, digits: int = 50) -> bool:
    scale = max(abs(one), abs(other), _CONTEXT.mpf(10) ** -30)
    return bool(abs(one - other) <= scale * _CONTEXT.mpf(10) ** -digits)


def stated(text: str) -> Any:
    """Return the right-hand side of a formula of the ledger, for the quantity it is about."""
    formula = read(text).bound({})
    force = sp.Function("f")(symbol("i") - 1, symbol("i"))
    if formula.left.has(force):
        return sp.solve(formula.left - formula.right, force)[0]
    seuil = read(BY_NAME["seuil"].formula or "").bound({}).right
    return formula.right.subs(symbol("A_theta_star"), seuil)


@pytest.mark.parametrize("label", LAWS)
def test_a_printed_law_is_what_the_paper_prints(label: str) -> None:
    formula = BY_NAME[label].formula
    assert formula is not None
    right, random = stated(formula), Random(label)
    for _ in range(12):
        p = random_parameters(random)
        two = "_th_2_" in label
        given = in_context(p | ({"n": 2, "i": 2} if two else {}))
        expected = value_of(right, p | ({"n": 2, "i": 2} if two else {}))
        assert agree(LAWS[label].printed(**given), expected), (label, p)


@pytest.mark.parametrize("label", [label for label in LAWS if LAWS[label].corrected is not None])
def test_a_corrected_law_is_what_the_derivations_prove(label: str) -> None:
    entry, form = BY_NAME[label], LAWS[label].corrected
    assert form is not None
    text = entry.corrected_formula or (entry.formula if entry.verdict == "exact" else None)
    if label == "delta_T_star":
        text = BY_NAME["seuil"].corrected_formula  # divided by kappa
    assert text is not None
    right, random = stated(text), Random(label)
    tested = 0
    while tested < 12:
        p = random_parameters(random)
        if "_th_2_" in label:
            p |= {"n": 2, "i": 2}
        expected = value_of(right, p)
        if label == "delta_T_star":
            expected /= in_context(p)["kappa"]
        if (expected < 0 and "cycle" in label) or label == "vitesse_seuil":
            expected = max(expected, _CONTEXT.mpf(0))
        tested += expected > 0 or tested > 8
        assert agree(form(**in_context(p)), expected), (label, p)


def test_laws_carry_the_verdict_of_the_ledger_and_name_their_derivation() -> None:
    for label, law in LAWS.items():
        assert law.label == label
        assert law.verdict == BY_NAME[label].verdict, label
        file = law.derivation.split(",")[0]
        assert (ROOT / file).is_file(), law.derivation
        assert file == f"derivations/{BY_NAME[label].how.split(':')[0].split(';')[0]}.py", label
        assert law.latex
        assert law.units
        assert law.place


def test_every_evaluable_labelled_equation_is_a_law() -> None:
    not_numbers = {
        "spring_force", "static_friction", "dynamical_friction", "dynamic_eq1", "dynamic_eq",
        "dynamic_eqN", "static_eq1", "static_eq", "static_eqN", "dist_mud", "dist_theta",
    }  # fmt: skip
    labels = {entry.label for entry in entries()} - {None}
    assert labels - not_numbers <= set(LAWS)


def test_the_critical_angle_is_the_derived_one_for_symbolic_indices() -> None:
    random = Random(4)
    for _ in range(20):
        p = random_parameters(random)
        derived = value_of(pivots.critical(symbol("i")), p)
        assert agree(LAWS["critical_angle"].printed(**in_context(p)), derived)


def _staircase_case(random: Random) -> dict[str, Fraction]:
    slope = random.choice(SLOPES)
    mu_d = slope * F(random.randint(21, 60), 20)
    mu_s = mu_d + F(random.randint(1, 40), 50)
    return {
        "l0": F(random.randint(1, 400)),
        "mu_d": mu_d,
        "mu_s": mu_s,
        "tan_alpha": slope,
        "amplitude": F(random.randint(1, 300), 10_000),
        "r0": F(random.randint(-40, 40), 41),
    }


def test_the_staircase_is_the_count_of_relays_in_rational_arithmetic() -> None:
    random, creeping = Random(8), 0
    for _ in range(500):
        p = _staircase_case(random)
        cosine = laws.cosine(p["tan_alpha"])
        expected = cosine * two_sliders.staircase(
            p["tan_alpha"],
            p["mu_d"],
            p["mu_s"],
            p["l0"] * p["amplitude"] / cosine,
            p["r0"] / cosine,
        )
        found = laws.staircase_two_sliders(**p)
        assert found == expected
        assert isinstance(found, Fraction | int)
        creeping += found > 0
    assert 100 < creeping < 480


def test_the_staircase_rests_exactly_at_its_threshold_and_creeps_above() -> None:
    tan, mu_d, mu_s = F(3, 4), F(1), F(6, 5)
    threshold = LAWS["threshold_th_2_cycle_corrected"].exact
    assert threshold is not None
    edge = threshold(l0=7, mu_s=mu_s, tan_alpha=tan)
    assert isinstance(edge, Fraction)
    exact = LAWS["velocity_th_2_cycle_corrected"].exact
    assert exact is not None
    chain: dict[str, Any] = {"l0": 7, "mu_d": mu_d, "mu_s": mu_s, "tan_alpha": tan}
    assert exact(**chain, amplitude=edge) == 0
    assert exact(**chain, amplitude=edge + F(1, 10**60)) == 2 * (mu_s - mu_d) * F(4, 5)


def test_the_staircase_decides_next_to_an_irrational_threshold() -> None:
    ctx = context(80)
    edge = (ctx.mpf(6) / 10 - ctx.mpf(1) / 4) / ctx.sqrt(ctx.mpf(17) / 16)
    chain: dict[str, Any] = {"l0": 1, "mu_d": F(1, 2), "mu_s": F(3, 5), "tan_alpha": F(1, 4)}
    scale = 10**75
    below, above = int(ctx.floor(edge * scale)), int(ctx.floor(edge * scale)) + 1
    assert laws.staircase_two_sliders(**chain, amplitude=F(below, scale)) == 0
    assert laws.staircase_two_sliders(**chain, amplitude=F(above, scale)) > 0


def test_the_mean_of_the_staircase_over_its_phase_is_the_corrected_law() -> None:
    mean = LAWS["velocity_th_2_cycle_corrected"].corrected
    assert mean is not None
    random = Random(12)
    for _ in range(20):
        p = _staircase_case(random)
        excess = (p["mu_s"] - p["mu_d"]) * laws.cosine(p["tan_alpha"])
        count = 400
        total = F(0)
        for k in range(count):
            p["r0"] = excess * (F(2 * k + 1, count) - 1)
            total += laws.staircase_two_sliders(**p)
        del p["r0"]
        expected = mean(**{name: value for name, value in p.items() if name != "mu_s"})
        assert abs(total / count - expected) <= 2 * excess / count * 2


def test_without_a_static_excess_two_sliders_slide() -> None:
    chain: dict[str, Any] = {"l0": 10, "mu_d": F(1), "mu_s": F(1), "tan_alpha": F(3, 4)}
    assert laws.staircase_two_sliders(**chain, amplitude=F(1, 10)) == 1 - F(1, 5)
    assert laws.staircase_two_sliders(**chain, amplitude=F(1, 50)) == 0


@pytest.mark.parametrize("label", ["velocity_th_2_cycle", "velocity_th_2_cycle_corrected"])
def test_a_two_slider_law_refuses_other_chains(label: str) -> None:
    p = {"l0": 1000, "mu_d": 0.5, "mu_s": 0.6, "tan_alpha": 0.25, "amplitude": 0.01}
    exact = LAWS[label].exact
    assert exact is not None
    assert exact(**p) == exact(**p, n=2, sigma_mu=0)
    for form in (LAWS[label].printed, LAWS[label].corrected, exact):
        assert form is not None
        with pytest.raises(ValueError, match="n must be 2"):
            form(**p, n=3)
    with pytest.raises(ValueError, match="sigma_mu"):
        exact(**p, sigma_mu=0.01)
    with pytest.raises(ValueError, match="tan_alpha"):
        exact(**(p | {"tan_alpha": 0.5}))


def test_the_sliding_law_is_the_exact_rational_chain() -> None:
    random, cases, resting = Random(31), 0, 0
    form = LAWS["vitesse_seuil"].exact
    assert form is not None
    for n in range(2, 13):
        for tan in SLOPES[:4]:
            mu_d = tan * F(random.randint(21, 80), 20)
            cosine = laws.cosine(tan)
            reach = n * (mu_d - tan) * F(random.randint(10, 90), 60)
            chain = SlidingChain(n, tan, mu_d)
            try:
                chain.ramp(reach)
                for _ in range(4 * n):
                    chain.ramp(-2 * reach)
                    chain.ramp(2 * reach)
            except NotUnique:
                with pytest.raises(ValueError, match="not unique"):
                    form(n=n, l0=1, mu_d=mu_d, tan_alpha=tan, amplitude=reach * cosine)
                continue
            before = list(chain.x)
            chain.ramp(-2 * reach)
            chain.ramp(2 * reach)
            found = form(n=n, l0=1, mu_d=mu_d, tan_alpha=tan, amplitude=reach * cosine)
            assert {(b - a) * cosine for a, b in zip(before, chain.x, strict=True)} == {2 * found}
            cases, resting = cases + 1, resting + (found == 0)
    assert cases > 40
    assert 5 < resting < 35


def test_the_corrected_threshold_exceeds_the_printed_one_by_the_dropped_term() -> None:
    seuil = LAWS["seuil"]
    assert seuil.corrected is not None
    p = {"n": 30, "l0": 1000, "mu_d": F(1, 2), "mu_s": F(3, 5), "tan_alpha": F(1, 4)}
    printed, corrected = seuil.printed(**p), seuil.corrected(**p)
    assert corrected / printed == pytest.approx(1 + 4 / 300, rel=1e-15)
    assert math.isclose(0.99 * printed, 0.00360165403178954466, rel_tol=1e-15)
    assert 1.01 * printed < corrected


@pytest.mark.parametrize("h", ["0", "0.001", "0.3", "1.7", "6"])
def test_the_gaussian_integral_agrees_with_quadrature(h: str) -> None:
    half = _CONTEXT.mpf(h)
    expected = _CONTEXT.mpf(gaussian.integral(h, 48)._mpf_)
    assert agree(laws.gaussian_integral(half), expected, 44)
    assert laws.gaussian_integral(float(h)) == pytest.approx(float(expected), rel=4e-15)


def test_the_gaussian_integral_has_the_derived_series() -> None:
    zeroth, first, second = (_CONTEXT.mpf(str(sp.N(term, 60))) for term in gaussian.series())
    h = _CONTEXT.mpf(10) ** -8
    rest = laws.gaussian_integral(h) - zeroth - first * h - second * h**2
    assert abs(rest) < h**3
    assert agree(laws.gaussian_integral(_CONTEXT.mpf(0)), 1 / _CONTEXT.sqrt(_CONTEXT.pi), 58)


def test_the_exact_random_law_is_positive_where_the_printed_one_is_negative() -> None:
    law = LAWS["vitesse_seuil_random"]
    assert law.exact is not None
    p = {"n": 30, "l0": 1000, "mu_d": 0.5, "tan_alpha": 0.25, "sigma_theta": 0.002}
    assert law.printed(**p) < 0 < law.exact(**p)
    big = p | {"sigma_theta": 10.0}
    assert law.exact(**big) == pytest.approx(law.printed(**big), rel=1e-6)


def test_the_pivot_is_where_the_sliding_chain_pivots() -> None:
    random = Random(77)
    for n in range(2, 20):
        for _ in range(6):
            mu_d = F(random.randint(1, 40), 20)
            tan = mu_d * F(random.randint(-59, 59), 60)
            chain = SlidingChain(n, tan, mu_d)
            try:
                chain.ramp(4 * n * mu_d)
            except NotUnique:
                low, high = laws.pivots(n, tan, mu_d)
                assert high == low + 1
                continue
            assert laws.pivots(n, tan, mu_d) == (chain.pivot + 1,)


def test_ties_of_the_pivot_are_decided_exactly() -> None:
    assert laws.pivots(4, F(1, 4), F(1, 2)) == (2, 3)
    assert laws.pivots(4, 0.25, 0.5) == (2, 3)
    assert laws.pivots(4, F(1, 4) + F(1, 10**50), F(1, 2)) == (2,)
    assert laws.pivots(4, F(1, 4) - F(1, 10**50), F(1, 2)) == (3,)
    assert laws.pivots(4, 0.3, 0.6) == (2, 3)
    # a tenth in floats is not a tenth: the binary values decide
    assert laws.pivots(3, F(1, 10), F(3, 10)) == (2, 3)
    assert laws.pivots(3, 0.1, 0.3) == (2,)
    with pytest.raises(ValueError, match="i = 2 or i = 3"):
        LAWS["vitesse_seuil"].printed(n=4, l0=1, mu_d=F(1, 2), tan_alpha=F(1, 4), amplitude=3)
    both = [LAWS["vitesse"].printed(n=4, l0=1, amplitude=1, i=i) for i in laws.pivots(4, 0.25, 0.5)]
    assert both == [3, 1]


def test_pivot_windows_overlap_by_the_derived_width() -> None:
    mu_d, mu_s = F(1, 2), F(3, 5)
    for n in range(2, 13):
        for i in range(2, n + 1):
            upper, lower = (
                laws.pivot_window(n, i, mu_d, mu_s),
                laws.pivot_window(n, i + 1, mu_d, mu_s),
            )
            assert lower.upper - upper.lower == 2 * (mu_s - mu_d) / n
            assert lower.upper == upper.lower_alone
            printed = LAWS["critical_angle"].printed(n=n, i=i, mu_d=mu_d, mu_s=mu_s)
            assert printed == lower.upper
    with pytest.raises(ValueError, match="i must be between"):
        laws.pivot_window(5, 1, mu_d, mu_s)


def test_rationals_stay_rational_on_slopes_with_a_rational_cosine() -> None:
    p = {"n": 30, "l0": 1000, "mu_d": F(1, 2), "tan_alpha": F(7, 24), "amplitude": F(1, 100)}
    assert LAWS["seuil"].printed(**{k: v for k, v in p.items() if k != "amplitude"}) == F(3, 1000)
    velocity = LAWS["vitesse_seuil"].printed(**p)
    assert isinstance(velocity, Fraction)
    assert velocity == (30 + 3 - 2 * laws.pivot(30, F(7, 24), F(1, 2))) * (10 - 3)


@pytest.mark.parametrize("digits", [20, 50, 90])
def test_precision_comes_from_the_operands_alone(digits: int) -> None:
    ctx, before = context(digits), (mpmath.mp.prec, mpmath.mp.dps)
    found = LAWS["seuil"].printed(n=30, l0=1000, mu_d=ctx.mpf("0.5"), tan_alpha=ctx.mpf("0.25"))
    assert found.context is ctx
    wide = context(digits + 20)
    expected = wide.mpf(30) / 2000 / 4 / wide.sqrt(wide.mpf(17) / 16)
    assert abs(wide.mpf(found._mpf_) - expected) < expected * wide.mpf(10) ** (2 - digits)
    value = laws.gaussian_integral(ctx.mpf("0.25"))
    assert value.context is ctx
    assert abs(wide.mpf(value._mpf_) - laws.gaussian_integral(wide.mpf("0.25"))) < wide.mpf(10) ** (
        1 - digits
    )
    assert (mpmath.mp.prec, mpmath.mp.dps) == before


@pytest.mark.parametrize("label", LAWS)
def test_arrays_broadcast_to_the_scalar_values(label: str) -> None:
    law = LAWS[label]
    tans = np.array([0.07, 0.21, 0.29, 0.43])[:, None]
    sizes = np.array([3.0, 7.0, 30.0]) if "_th_2_" not in label else np.array([2.0, 2.0, 2.0])
    p = {
        "n": sizes, "i": 2, "l0": 800.0, "mu_d": 0.5, "mu_s": 0.6, "sigma_mu": 0.0,
        "tan_alpha": tans, "amplitude": 0.004, "sigma_theta": 0.003, "kappa": 1e-5,
    }  # fmt: skip
    for form in (law.printed, law.corrected, law.exact):
        if form is None:
            continue
        found = np.broadcast_to(np.asarray(form(**p)), (4, 3))
        for row in range(4):
            for column in range(3):
                scalar = form(**(p | {"n": sizes[column], "tan_alpha": float(tans[row, 0])}))
                assert found[row, column] == pytest.approx(scalar, rel=1e-14, abs=1e-300)


def test_the_pivot_of_an_array_is_found_elementwise() -> None:
    tans = np.linspace(0.01, 0.49, 25)
    found = LAWS["vitesse"].printed(n=6, l0=1, mu_d=0.5, tan_alpha=tans, amplitude=1)
    assert found.tolist() == [9 - 2 * laws.pivot(6, tan, 0.5) for tan in tans.tolist()]


def test_an_unknown_parameter_is_named() -> None:
    with pytest.raises(TypeError, match=r"unknown parameter mu; a law knows n, l0, mu_d"):
        LAWS["seuil"].printed(n=3, l0=1, mu=0.5, tan_alpha=0.1)


def test_a_missing_parameter_is_named() -> None:
    with pytest.raises(TypeError, match=r"missing parameter mu_d"):
        LAWS["seuil"].printed(n=3, l0=1, tan_alpha=0.1)
    with pytest.raises(TypeError, match=r"missing parameter i"):
        LAWS["vitesse"].printed(n=3, l0=1, amplitude=0.1)
    with pytest.raises(TypeError, match=r"missing parameter mu_s"):
        LAWS["seuil"].corrected(n=3, l0=1, mu_d=0.5, tan_alpha=0.1)  # type: ignore[misc]


@pytest.mark.parametrize("value", ["0.5", None, True, 1j, [None], ["a"], np.array(["a"])])
def test_a_value_that_is_no_number_is_refused_by_name(value: object) -> None:
    with pytest.raises((TypeError, ValueError), match="mu_d"):
        LAWS["seuil"].printed(n=3, l0=1, mu_d=value, tan_alpha=0.1)


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_a_pivot_of_no_finite_number_is_refused(value: float) -> None:
    with pytest.raises(ValueError, match="finite"):
        laws.pivot(3, value, 0.5)


@pytest.mark.parametrize("h", [-0.1, math.nan, math.inf])
def test_the_gaussian_integral_refuses_what_it_cannot_integrate(h: float) -> None:
    with pytest.raises(ValueError, match="h must be finite"):
        laws.gaussian_integral(h)


def test_a_pivot_needs_a_slope_below_mu_d_and_a_whole_number_of_sliders() -> None:
    for tan in (F(1, 2), F(3, 5), F(-1, 2)):
        with pytest.raises(ValueError, match="tan_alpha"):
            laws.pivots(5, tan, F(1, 2))
    with pytest.raises(ValueError, match="n must be"):
        laws.pivots(0, F(1, 4), F(1, 2))


def test_laws_are_frozen_and_their_vocabulary_is_read_only() -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        LAWS["seuil"].label = "other"  # type: ignore[misc]
    with pytest.raises(TypeError):
        LAWS["other"] = LAWS["seuil"]  # type: ignore[index]
    for law in LAWS.values():
        for form in (law.printed, law.corrected, law.exact):
            if form is not None:
                assert set(form.required + form.optional) <= set(VOCABULARY)


def chain_of(n: int, tan_alpha: Any, mu_s: Any = "0.6") -> Chain:
    return Chain(n, 1000, "0.5", mu_s, tan_alpha=tan_alpha)


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
