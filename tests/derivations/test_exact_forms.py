"""Each exact form that the ledger states, at numbers, against the function of the package."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from inspect import signature
from random import Random
from typing import Any

import mpmath
import pytest
import sympy as sp

from derivations import gaussian, thresholds, two_sliders
from derivations.ledger import entries
from derivations.notation import CAPTIONS, c, evaluated, read, s, symbol
from exactcreep import Chain, Cycles, GaussianSteps, laws

NAMED = {entry.name: entry for entry in entries()}
EXACT = [entry.name for entry in entries() if "exact" in entry.law]
SYMBOLS = {
    "n": "N", "i": "i", "l0": "l_0", "mu_d": "mu_d", "mu_s": "mu_s", "amplitude": "A_theta",
    "sigma_theta": "sigma_theta",
}  # fmt: skip


def integral(h: sp.Expr) -> sp.Expr:
    """Return I(h) by quadrature of the integrand that the chapter on random dilations derives."""

    def integrand(place: Any) -> Any:
        below, above = mpmath.ncdf(place - h), mpmath.ncdf(-place - h)
        return below * above / (below + above)

    half = float(h)
    assert half >= 0
    return sp.Float(mpmath.quad(integrand, [-12 - half, -2, 0, 2, 12 + half]))


@pytest.mark.parametrize("half", [0, 0.01, 0.3, 1, 2.5])
def test_the_mean_advance_of_a_play_is_the_integral_that_is_derived(half: float) -> None:
    assert float(laws.gaussian_integral(half)) == pytest.approx(float(integral(half)), rel=1e-12)
    if half == 0.01:
        proof = gaussian.derive()
        series = proof.mean_step + proof.slope * half + proof.curvature * half**2
        assert float(laws.gaussian_integral(half)) == pytest.approx(float(series), rel=1e-6)


@pytest.mark.parametrize("kind", ["amplitude", "sigma_theta"])
def test_a_prediction_gives_the_laws_that_the_ledger_names(kind: str) -> None:
    random = Random(8)
    for _ in range(12):
        given = chain(random, two=False) | {"sigma_mu": Fraction(1, 100)}
        made = Chain(**{name: given[name] for name in Chain.__dataclass_fields__ if name in given})
        drive = Cycles(given[kind], 1) if kind == "amplitude" else GaussianSteps(given[kind], 1)
        predicted = laws.prediction(made, drive)
        assert predicted is not None
        laws_of = {f"Eq. {entry.number}": entry.law for entry in NAMED.values() if entry.law}
        named = laws_of[predicted.label]
        for function, values in (("printed", predicted.printed), ("exact", predicted.sliding)):
            law = getattr(laws, named[function])
            assert values == pytest.approx(laws.law_values(law, made.parameters() | given))


def chain(random: Random, two: bool) -> dict[str, Any]:
    n = 2 if two else random.randint(4, 12)
    mu_d = Fraction(random.randint(20, 60), 80)
    tan = mu_d * Fraction(random.randint(1, 96), 97)
    return {
        "n": n,
        "i": laws.pivot(n, tan, mu_d),
        "l0": Fraction(random.randint(100, 2000)),
        "mu_d": mu_d,
        "mu_s": mu_d + Fraction(random.randint(1, 30), 70),
        "tan_alpha": tan,
        "amplitude": Fraction(random.randint(1, 100), 10**4),
        "sigma_theta": Fraction(random.randint(1, 100), 10**4),
    }


def value_of(expression: sp.Expr, given: Mapping[str, Any]) -> float:
    tan = sp.Rational(given["tan_alpha"])
    values = {symbol(name): sp.Rational(given[key]) for key, name in SYMBOLS.items()}
    values |= {c: 1 / sp.sqrt(1 + tan**2), s: tan / sp.sqrt(1 + tan**2)}
    number = evaluated(expression).subs(values)
    return float(number.replace(sp.Function("I"), lambda h: integral(sp.N(h))).evalf(30))


@pytest.mark.parametrize("name", EXACT)
def test_an_exact_form_of_the_ledger_is_the_function_that_it_names(name: str) -> None:
    entry, random, positive = NAMED[name], Random(name), 0
    law = getattr(laws, entry.law["exact"])
    formulas = [f for f in entry.corrected_formulas if not f.startswith("h =")]
    right = read(formulas[-1] if formulas else entry.formula or "").bound({}).right
    with_h = [f for f in entry.corrected_formulas if f.startswith("h =")]
    if with_h:
        right = right.subs(symbol("h"), read(with_h[0]).bound({}).right)
    for _ in range(6):
        given = chain(random, two="_th_2_" in name)
        if (
            name == "locked_ends"
            and given["n"] * (given["mu_s"] - given["tan_alpha"]) <= 2 * given["mu_s"]
        ):
            continue  # no locked cycle of the ends
        known = dict(given) | {"coefficients": [given["mu_s"]] * given["n"]}
        if entry.chapter == "continuum":
            continue  # a limit of long chains: test_paper
        found = float(law(**{key: known[key] for key in signature(law).parameters if key in known}))
        assert found == pytest.approx(value_of(right, given), rel=1e-9, abs=1e-12), given
        positive += found > 0
    assert positive > 1 or entry.chapter == "continuum"


def test_ends_of_the_plateau_and_edges_of_fates_are_those_of_the_ledger() -> None:
    ends = laws.plateau_ends(mu_d=Fraction(1, 2), sigma_mu=Fraction(1, 100))
    for label, found in zip(("alpha_c_minus", "alpha_c_plus"), ends, strict=True):
        right = read(NAMED[label].formula or "").right
        assert found == pytest.approx(float(right.subs(CAPTIONS)))
    known = chain(Random(5), two=False)
    made = Chain(
        known["n"], known["l0"], known["mu_d"], known["mu_s"], 0, tan_alpha=known["tan_alpha"]
    )
    edges = laws.edges(made)
    for name in ("at_rest", "no_lasting_creep"):
        right = read(NAMED[name].formula or "").bound({}).right
        assert edges[name] == pytest.approx(value_of(right, known))


def test_onset_and_staircase_of_the_package_meet_as_the_derivation_says_at_two_sliders() -> None:
    below = two_sliders.derive().decisions["threshold_th_2_cycle_corrected"]
    assert below.standing == "proved"
    less = thresholds.derive().decisions["seuil"].said["less"]
    given = {
        "l0": 1000,
        "mu_d": Fraction(1, 2),
        "mu_s": Fraction(3, 5),
        "tan_alpha": Fraction(1, 4),
    }
    onset = laws.onset_amplitude(n=2, **given)
    number = float(less.subs(CAPTIONS))
    for share, creeps in ((0.999, False), (1.001, True)):
        amplitude = share * (float(onset) + number)
        assert (laws.staircase_two_sliders(**given, amplitude=amplitude) > 0) is creeps
