"""The laws of the paper against its own text, the derivations, and exact rational chains."""

from __future__ import annotations

import math
from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path
from random import Random
from typing import Any

import pytest
import sympy as sp

from derivations.chain import NotUnique, RationalChain
from derivations.ledger import entries
from derivations.notation import read, symbol
from exactcreep import laws
from exactcreep.laws import LAWS
from tests.laws.parameters import (
    CONTEXT,
    SLOPES,
    F,
    agree,
    in_context,
    random_parameters,
)

ROOT = Path(__file__).parents[2]
BY_NAME = {entry.name: entry for entry in entries()}


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
    return CONTEXT.mpf(str(number))


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
            expected = max(expected, CONTEXT.mpf(0))
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
            chain = RationalChain(n, tan, mu_d)
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


def test_the_exact_random_law_is_positive_where_the_printed_one_is_negative() -> None:
    law = LAWS["vitesse_seuil_random"]
    assert law.exact is not None
    p = {"n": 30, "l0": 1000, "mu_d": 0.5, "tan_alpha": 0.25, "sigma_theta": 0.002}
    assert law.printed(**p) < 0 < law.exact(**p)
    big = p | {"sigma_theta": 10.0}
    assert law.exact(**big) == pytest.approx(law.printed(**big), rel=1e-6)
