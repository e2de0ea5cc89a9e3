"""What a form takes and gives: any arithmetic, and no parameter that it does not know."""

from __future__ import annotations

import dataclasses
from fractions import Fraction

import mpmath
import numpy as np
import pytest

from exactcreep import laws
from exactcreep.laws import LAWS, VOCABULARY, law_values
from tests.laws.parameters import (
    F,
    context,
)


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


def test_a_list_of_rationals_is_an_array_and_mixes_with_no_mpmath_number() -> None:
    form, given = LAWS["seuil"].printed, {"n": 3, "l0": 1000, "mu_d": F(1, 2)}
    slopes = [F(1, 4), F(1, 3)]
    both = form(tan_alpha=slopes, **given).tolist()
    assert both == pytest.approx([float(form(tan_alpha=one, **given)) for one in slopes], rel=1e-15)
    with pytest.raises(TypeError, match="do not mix"):
        form(tan_alpha=slopes, **given | {"mu_d": context(20).mpf("0.5")})


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


def test_laws_are_frozen_and_their_vocabulary_is_read_only() -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        LAWS["seuil"].label = "other"  # type: ignore[misc]
    with pytest.raises(TypeError):
        LAWS["other"] = LAWS["seuil"]  # type: ignore[index]
    for law in LAWS.values():
        for form in (law.printed, law.corrected, law.exact):
            if form is not None:
                assert set(form.required + form.optional) <= set(VOCABULARY)


def test_a_plateau_that_is_named_counts_instead_of_the_pivot() -> None:
    given = {"n": F(6), "l0": F(1000), "mu_d": F(1, 2), "tan_alpha": F(1, 5)}
    given["amplitude"] = F(1, 100)
    form = LAWS["vitesse"].printed
    assert law_values(form, given) == law_values(form, given | {"i": F(3)}) == (30.0,)
    assert law_values(form, given | {"i": F(2)}) == (50.0,)
