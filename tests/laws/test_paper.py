"""The laws of the paper against the ledger's LaTeX, rational chains, and what they refuse."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction as F
from functools import partial
from inspect import signature
from random import Random
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy as sp

from derivations.ledger import entries
from derivations.notation import evaluated, read, symbol
from exactcreep import laws
from exactcreep.laws import creep_velocity, pivots, threshold_amplitude
from exactcreep.model.numbers import InputError

BY_NAME = {entry.name: entry for entry in entries()}
CODE = {entry.name: entry.law for entry in entries() if entry.law}
"""The names in the code of the forms of each law."""
LIMIT = "vitessecontinue"
"""The law of a solid, exact in the limit of long chains."""
NAMES = {name for forms in CODE.values() for name in forms.values()}
LAWS = sorted(name for name in NAMES if not name.startswith("at_rest") and "(" not in name)
SEUIL = {"n": 3, "l0": 1, "mu_d": 0.5, "tan_alpha": 0.1}
HAIR = F(1, 10**50)
TIE = {"n": 4, "l0": 1, "mu_d": F(1, 2), "tan_alpha": F(1, 4), "amplitude": 3}


def context(digits: int) -> Any:
    fresh = mpmath.mp.clone()
    fresh.dps = digits
    return fresh


CONTEXT = context(60)


def random_parameters(random: Random) -> dict[str, F | int]:
    """Return a random chain and drive, all rational; i is an index of its plateau."""
    n, mu_d = random.randint(2, 40), F(random.randint(1, 300), 200)
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
    }


def value_of(expression: Any, p: Mapping[str, F | int]) -> Any:
    """Return a derived expression at the parameters, to 60 digits; of I(h) to 15."""
    known = {name: sp.Rational(value) for name, value in p.items()}
    tan, length = known["tan_alpha"], known["n"] * known["l0"]
    cosine = 1 / sp.sqrt(1 + tan**2)
    names = {
        "N": known["n"], "i": known["i"], "l_0": known["l0"], "A_theta": known["amplitude"],
        "mu_d": known["mu_d"], "mu_s": known["mu_s"], "Delta_mu": known["mu_s"] - known["mu_d"],
        "sigma_mu": known["sigma_mu"], "sigma_theta": known["sigma_theta"],
        "c": cosine, "s": tan * cosine,
        "g": 1, "rho": 1, "L": length, "Y": known["l0"] ** 2,  # the solid: g rho L/Y = N/l0
    }  # fmt: skip
    number = evaluated(expression).subs({symbol(name): value for name, value in names.items()})
    integral = sp.Function("I")
    number = sp.N(number.replace(integral, lambda h: laws.gaussian_integral(float(h))), 70)
    assert number.is_number, expression
    return CONTEXT.mpf(str(number))


def stated(label: str, form: str) -> Any:
    """Return the right-hand side of a formula of the ledger, for the quantity it is about."""
    entry = BY_NAME[label]
    place = {"corrected": 0, "exact": -1}
    corrected = [text for text in entry.corrected_formulas if not text.startswith("h =")]
    text = corrected[place[form]] if corrected and form in place else entry.formula
    formula = read(text or "").bound({})
    force = sp.Function("f")(symbol("i") - 1, symbol("i"))
    if formula.left.has(force):
        return sp.solve(formula.left - formula.right, force)[0]
    for half in (text for text in entry.corrected_formulas if text.startswith("h =")):
        formula = formula.bound({symbol("h"): read(half).bound({}).right})
    seuil = read(BY_NAME["seuil"].formula or "").bound({}).right
    return formula.right.subs(symbol("A_theta_star"), seuil)


def coded(label: str, form: str, p: Mapping[str, F | int], number: Callable[[F], Any]) -> Any:
    """Return what the function gives that the ledger names, for numbers of a type."""
    name, _, replaced = CODE[label][form].partition("(")
    law, given = getattr(laws, name), dict(p)
    if replaced:
        assert replaced == "mu_d=mu_s)"
        given["mu_d"] = given["mu_s"]
    values = {key: x if key in ("n", "i") else number(F(x)) for key, x in given.items()}
    values["coefficients"] = [values["mu_s"]] * int(given["n"])
    return law(**{key: values[key] for key in signature(law).parameters if key in values})


@pytest.mark.parametrize(
    ("label", "form"),
    [(label, form) for label, forms in CODE.items() for form in forms if label != LIMIT
     or form != "exact"],
)  # fmt: skip
def test_a_law_is_its_formula_in_the_ledger(label: str, form: str) -> None:
    """As printed, as the derivations correct it, and in its exact form."""
    right, random, positive = stated(label, form), Random(label + form), 0
    integral = right.has(sp.Function("I"))
    digits, number = (12, float) if integral else (50, CONTEXT.convert)
    for _ in range(4):
        p = random_parameters(random) | ({"n": 2, "i": 2} if "_th_2_" in label else {})
        if label == "locked_ends" and p["n"] * (p["mu_s"] - p["tan_alpha"]) <= 2 * p["mu_s"]:
            continue  # no locked cycle of the ends
        expected = value_of(right, p)
        found = coded(label, form, p, number)
        assert abs(found - expected) <= max(1, abs(expected)) * CONTEXT.mpf(10) ** -digits, p
        positive += expected > 0
    assert positive > 1


@pytest.mark.parametrize(
    ("n", "mu_s"), [(3, F(3, 5)), (4, F(3, 5)), (9, F(3, 5)), (4, 1), (4, F(5, 4))]
)
def test_a_plateau_lies_between_its_critical_angles_and_shares_windows_with_its_neighbours(
    n: int, mu_s: F
) -> None:
    """A window has the width 2 (mu_s - mu_d)/N, and its printed angle above."""
    about = {"mu_d": F(1, 2), "mu_s": mu_s}
    width = 2 * (mu_s - F(1, 2)) / n
    upper = F(1, 2) + width / 2
    for i in range(2, n + 1):
        printed = laws.critical_angle(n=n, i=i, **about)
        alone = (printed, upper - width) if printed <= upper - width else (None, None)
        assert laws.pivot_window(n, i, **about) == (printed - width, *alone, upper)
        upper = printed


@pytest.mark.parametrize(
    ("n", "tan", "mu_d", "expected"),
    [
        (4, F(1, 4), F(1, 2), (2, 3)),
        (4, F(1, 4) + HAIR, F(1, 2), (2,)),
        (4, F(1, 4) - HAIR, F(1, 2), (3,)),
        (3, F(1, 10), F(3, 10), (2, 3)),
        (3, 0.1, 0.3, (2,)),  # a tenth in floats is not a tenth: the binary values decide
    ],
)
def test_ties_of_the_pivot_are_decided_exactly(n: int, tan: Any, mu_d: Any, expected: Any) -> None:
    assert pivots(n, tan, mu_d) == expected


@pytest.mark.parametrize("digits", [20, 90])
def test_precision_comes_from_the_operands_alone(digits: int) -> None:
    ctx, before = context(digits), (mpmath.mp.prec, mpmath.mp.dps)
    given = {"n": 30, "l0": 1000, "mu_d": ctx.mpf("0.5"), "tan_alpha": ctx.mpf("0.25")}
    found = threshold_amplitude(**given)
    assert found.context is ctx
    wide = context(digits + 20)
    expected = wide.mpf(30) / 2000 / 4 / wide.sqrt(wide.mpf(17) / 16)
    share = wide.mpf(found._mpf_) / expected
    assert abs(share - 1) < wide.mpf(10) ** (2 - digits)
    assert (mpmath.mp.prec, mpmath.mp.dps) == before


@pytest.mark.parametrize("name", LAWS)
def test_arrays_broadcast_to_the_scalar_values(name: str) -> None:
    law = getattr(laws, name)
    sizes, lengths = np.array([3.0, 7.0, 30.0]), np.array([[600.0], [800.0]])
    p = {
        "n": sizes, "i": 2, "l0": lengths, "mu_d": 0.5, "mu_s": 0.6, "r0": 0.0,
        "tan_alpha": 0.21, "amplitude": 0.004, "sigma_theta": 0.003,
    }  # fmt: skip
    given = {key: value for key, value in p.items() if key in signature(law).parameters}
    found = np.broadcast_to(np.asarray(law(**given)), (2, 3))
    for (row, column), value in np.ndenumerate(found):
        at = {"n": sizes[column], "l0": float(lengths[row, 0])}
        scalar = law(**given | {key: at[key] for key in at if key in given})
        assert value == pytest.approx(scalar, rel=1e-14, abs=1e-300)


@pytest.mark.parametrize(
    ("call", "error", "match"),
    [
        (partial(threshold_amplitude, **SEUIL | {"mu_d": "0.5"}), InputError, "mu_d"),
        (partial(threshold_amplitude, **SEUIL, mu=0.5), TypeError, "argument 'mu'"),
        (partial(threshold_amplitude, **SEUIL | {"mu_d": context(20).mpf(1), "l0": [1, 2]}),
         InputError, "do not mix"),
        (partial(threshold_amplitude, **SEUIL | {"l0": [1, 0]}), ValueError, "l0 must be positive"),
        (partial(laws.solid_velocity, **SEUIL | {"mu_d": 0}, amplitude=1), ValueError, "mu_d must"),
        (partial(creep_velocity, **TIE), ValueError, "i = 2 or i = 3"),
        (partial(laws.pivot_window, 5, 7, 0.5, 0.6), ValueError, "i must be between"),
        (partial(pivots, 5, -0.5, 0.5), ValueError, "tan_alpha"),
        (partial(laws.staircase_two_sliders, 1000, 0.5, 0.6, 0.5, 0.01), ValueError, "tan_alpha"),
        (partial(laws.locked_ends_amplitude, n=4, l0=1, mu_d=0.5, mu_s=0.4, tan_alpha=0),
         ValueError, "mu_s must not be below mu_d"),
        (partial(laws.sliding_velocity_random, **SEUIL, sigma_theta=0), ValueError, "sigma_theta"),
        (partial(laws.differing_velocity, l0=1, mu_d=[0.5] * 3, tan_alpha=0),
         ValueError, "amplitude or as sigma_theta"),
        (partial(laws.sticking_velocity, SEUIL | {"n": 3, "mu_s": 0.6, "sigma_mu": 0,
         "amplitude": 1}), ValueError, "n between 4"),
        (partial(laws.pivot_sliders, [0.5] * 3, 0, (1.5, 0)), ValueError, "friction must hold"),
        (partial(laws.differing_slope, [0.5] * 3, 0.1, [1]), ValueError, "2 positive weights"),
    ],
)  # fmt: skip
def test_what_a_law_does_not_describe_is_refused(
    call: Callable[[], Any], error: type[Exception], match: str
) -> None:
    with pytest.raises(error, match=match):
        call()
