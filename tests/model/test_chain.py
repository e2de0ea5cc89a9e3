"""The chain and its state: exact parameters, exact forces."""

import math
from dataclasses import FrozenInstanceError
from fractions import Fraction

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from exactcreep.model.chain import Chain
from exactcreep.model.state import State

PAPER = {"n": 30, "l0": 1000, "mu_d": "0.5", "mu_s": "0.6", "sigma_mu": "0.01", "tan_alpha": "0.25"}


def test_decimal_strings_are_kept_as_rationals():
    chain = Chain(**PAPER)
    assert chain.parameters() == {
        "n": 30,
        "l0": Fraction(1000),
        "mu_d": Fraction(1, 2),
        "mu_s": Fraction(3, 5),
        "sigma_mu": Fraction(1, 100),
        "tan_alpha": Fraction(1, 4),
    }
    assert Chain(**chain.parameters()) == chain
    assert Chain(**{**PAPER, "mu_s": 0.6}).mu_s == Fraction(0.6) != Fraction(3, 5)


def test_a_chain_cannot_be_changed():
    chain = Chain(**PAPER)
    with pytest.raises(FrozenInstanceError):
        chain.n = 2
    assert hash(chain) == hash(Chain(**PAPER))


@given(tangent=st.fractions(min_value=-50, max_value=50, max_denominator=10**6))
@settings(max_examples=100, deadline=None)
def test_sine_and_cosine_are_the_nearest_floats(tangent):
    chain = Chain(2, 1, "0.3", "0.7", tan_alpha=tangent)
    context = mpmath.mp.clone()
    context.dps = 60
    exact = context.mpf(tangent.numerator) / tangent.denominator
    cosine = 1 / context.sqrt(1 + exact**2)
    for value, true in (
        (chain.cos_alpha, cosine),
        (chain.sin_alpha, exact * cosine),
        (chain.friction, 3 * cosine / 10),
        (chain.excess, 4 * cosine / 10),
    ):
        assert abs(value - true) <= 0.5000001 * math.ulp(value)


def test_a_pythagorean_slope_has_rational_sine_and_cosine():
    chain = Chain(2, 1, "0.5", "0.6", tan_alpha="3/4")
    assert (chain.cos_alpha, chain.sin_alpha) == (0.8, 0.6)


@pytest.mark.parametrize(
    ("tan_alpha", "runs"),
    [("0.49999999999999999999", False), ("0.5", True), ("-0.5", True), ("0", False), ("1", True)],
)
def test_whether_a_chain_may_run_away_is_decided_between_rationals(tan_alpha, runs):
    assert Chain(2, 1, "0.5", "0.6", tan_alpha=tan_alpha).may_run_away is runs


def test_the_mirror_image_of_the_mirror_image_is_the_chain():
    chain = Chain(**PAPER)
    assert chain.mirrored() != chain
    assert chain.mirrored().mirrored() == chain
    assert chain.mirrored().sin_alpha == -chain.sin_alpha
    assert chain.mirrored().cos_alpha == chain.cos_alpha


def test_the_relaxed_chain_bears_its_weight_only():
    chain = Chain(**PAPER)
    state = State.relaxed(chain, seed=1)
    assert (state.forces(chain) == chain.sin_alpha).all()
    assert state.theta == 0
    assert state.n == 30
    assert (state.displacements == 0).all()


def test_the_force_on_a_slider_is_the_difference_of_its_tensions_and_its_weight():
    chain = Chain(3, 1000, "0.5", "0.6", tan_alpha="0.25")
    state = State.prepared(chain, ["0.25", "-0.5"])
    weight = chain.sin_alpha
    assert state.forces(chain).tolist() == [0.25 + weight, -0.75 + weight, 0.5 + weight]


def test_tensions_that_are_no_floats_are_kept_as_rationals():
    chain = Chain(3, 1000, "0.5", "0.6", tan_alpha="0.25")
    kept = State.prepared(chain, ["0.1", Fraction(1, 3)], theta="1/3")
    assert kept.tensions.tolist() == [Fraction(1, 10), Fraction(1, 3)]
    assert kept.theta == Fraction(1, 3)
    floats = State.prepared(chain, [0.1, 0.5], theta="0.5")
    assert floats.tensions.dtype == np.float64
    assert floats.theta == 0.5


def test_floats_are_kept_with_the_bits_that_their_rationals_have():
    values = [0.1, -0.0, -5e-324, 1.7e308, -1 / 3]
    chain = Chain(len(values) + 1, 1000, "0.5", "0.6", tan_alpha="0.25")
    slowly = State.prepared(chain, [Fraction(value) for value in values]).tensions
    for tensions in (values, tuple(values), np.array(values)):
        kept = State.prepared(chain, tensions).tensions
        assert kept.dtype == np.float64
        assert kept.tobytes() == slowly.tobytes()


def test_the_arrays_of_a_state_are_its_own_and_cannot_be_written():
    chain = Chain(3, 1000, "0.5", "0.6", tan_alpha="0.25")
    tensions = np.array([0.1, 0.2])
    state = State.prepared(chain, tensions)
    tensions[0] = 9.0
    assert state.tensions[0] == 0.1
    with pytest.raises(ValueError, match="read-only"):
        state.tensions[0] = 1.0


def test_a_solver_s_own_arrays_become_read_only_with_the_state_that_takes_them():
    arrays = np.zeros(2), np.zeros(3), np.full(3, 0.6), np.ones(3, dtype=np.int64)
    state = State.owning(*arrays, 0.0)
    for array, kept in zip(
        arrays, (state.tensions, state.displacements, state.coefficients, state.draws), strict=True
    ):
        assert kept is array
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1


def test_a_seeded_start_is_reproducible_bounded_and_keyed_by_its_own_seed():
    chain = Chain(30, 1000, "0.5", "0.6", "0.01", tan_alpha="0.25")
    one = State.perturbed(chain, "1e-6", start_seed=1, seed=4)
    same = State.perturbed(chain, "1e-6", start_seed=1, seed=5)
    other = State.perturbed(chain, "1e-6", start_seed=2, seed=4)
    assert (one.tensions == same.tensions).all()
    assert (one.coefficients != same.coefficients).all()
    assert (one.tensions != other.tensions).all()
    assert np.abs(one.tensions.astype(float)).max() <= 1e-6
    assert np.abs(one.tensions.astype(float)).max() > 5e-7
