"""The chain and its state: exact parameters, exact forces."""

import math
import pickle
from dataclasses import FrozenInstanceError
from fractions import Fraction

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from exactcreep import Chain, State
from exactcreep.model.chain import surplus
from tests.paper import captions, paper_chain

CHAIN = paper_chain(30)
THREE = captions(3)


def test_decimal_strings_are_kept_as_rationals_and_a_chain_cannot_be_changed():
    assert list(CHAIN.parameters()) == ["n", "l0", "mu_d", "mu_s", "sigma_mu", "tan_alpha"]
    assert (CHAIN.mu_s, CHAIN.sigma_mu) == (Fraction(3, 5), Fraction(1, 100))
    for again in (Chain(**CHAIN.parameters()), pickle.loads(pickle.dumps(CHAIN))):
        assert (again, hash(again)) == (CHAIN, hash(CHAIN))
    with pytest.raises(FrozenInstanceError):
        again.n = 2


@given(tangent=st.fractions(min_value=-50, max_value=50, max_denominator=10**6))
@settings(max_examples=100, deadline=None)
@pytest.mark.filterwarnings("ignore::exactcreep.results.PhysicsWarning")
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


@pytest.mark.parametrize(
    ("push", "tan_alpha", "down", "up", "heading"),
    [
        (Fraction(3, 2), 0, 0, -1, 1),
        (Fraction(3, 2) + Fraction(1, 10**40), 0, 1, -1, 1),
        (Fraction(-3, 2), 0, -1, 0, -1),
        (0, 0, -1, -1, 0),
        (0, "0.49999999999999999999", -1, -1, 1),
        (0, "0.5", 0, -1, 1),
        (0, "-0.5", -1, 0, -1),
    ],
)
def test_whether_friction_holds_a_chain_is_decided_exactly(push, tan_alpha, down, up, heading):
    """Three sliders are held by 3 mu_d = 3/2."""
    chain = captions(3, tan_alpha=tan_alpha, end_forces=(push, 0))
    assert (surplus(chain, 1), surplus(chain, -1), chain.heading) == (down, up, heading)
    assert chain.may_run_away is (max(down, up) >= 0)
    mirrored = chain.mirrored()
    pulls = [[one.pull(slider) for slider in range(3)] for one in (chain, mirrored)]
    assert pulls == [[push, 0, 0], [0, 0, -push]]
    assert (mirrored.mirrored(), mirrored.sin_alpha) == (chain, -chain.sin_alpha)


def test_the_arrays_of_a_state_cannot_be_written_and_are_its_own():
    tensions = np.array([0.1, 0.2])
    prepared = State.prepared(THREE, tensions)
    tensions[0] = 9.0
    assert prepared.tensions[0] == 0.1
    for array in (prepared.tensions, prepared.displacements, prepared.coefficients, prepared.draws):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1


def test_a_seeded_start_is_reproducible_bounded_and_keyed_by_its_own_seed():
    one, same, other = (
        State.perturbed(CHAIN, "1e-6", start_seed=start, seed=seed)
        for start, seed in ((1, 4), (1, 5), (2, 4))
    )
    assert (one.tensions == same.tensions).all()
    assert (one.coefficients != same.coefficients).all()
    assert (one.tensions != other.tensions).all()
    assert 5e-7 < np.abs(one.tensions).max() <= 1e-6


def test_the_force_on_a_slider_is_the_difference_of_its_tensions_and_its_weight():
    relaxed = State.relaxed(CHAIN, seed=1)
    assert (relaxed.forces(CHAIN) == CHAIN.sin_alpha).all()
    assert (relaxed.n, relaxed.theta, relaxed.displacements.any()) == (30, 0, False)
    state, weight = State.prepared(THREE, ["0.25", "-0.5"]), THREE.sin_alpha
    assert state.forces(THREE).tolist() == [0.25 + weight, -0.75 + weight, 0.5 + weight]
    pulled = captions(3, end_forces=("0.3", "-0.1"))
    assert state.forces(pulled) - state.forces(THREE) == pytest.approx([0.3, 0, -0.1])
