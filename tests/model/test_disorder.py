"""Keyed disorder: the same numbers for everybody, in whatever order they are asked for."""

import math
from fractions import Fraction

import mpmath
import numpy as np
import pytest
from numba import njit

from exactcreep import disorder
from exactcreep.model import deviates
from exactcreep.model.drive import GaussianSteps
from exactcreep.model.state import State
from tests.paper import captions, paper_chain

CHAIN = paper_chain(10**6)
DRIVE = GaussianSteps("0.1", 100)

COEFFICIENTS = {  # by seed, slider and draw
    (0, 1, 0): 0.617528026117885, (0, 1, 4): 0.5947656572083874, (0, 2, 0): 0.6220799427996372,
    (2011, 1000, 0): 0.5890762690417656, (2**32, 5, 2): 0.6152022040011726,
    (2**64 - 1, 10**6, 2**40): 0.6009779194824655, (123456789, 17, 2**62): 0.5898768546271564,
}  # fmt: skip
DILATIONS = {(0, 1): -0.01517785383410103, (7, 100): 0.10279528356652932}
"""By seed and target."""
TENSIONS = {
    0: (-0.04968167928960476, -0.02415650922802437),
    2**64 - 1: (-0.16519868027393592, -0.12463293351828753),
}
"""Of the first two springs, by seed."""


def word_of(seed: int, stream: int, n: int, k: int) -> int:
    """Return word k of (seed, stream, n) by NumPy's own generator."""
    key = np.array([seed, stream], dtype=np.uint64)
    generator = np.random.Philox(key=key, counter=[k // 4, n, 0, 0])
    return int(generator.random_raw(4)[k % 4])


def normal_of(word: int) -> mpmath.mpf:
    """Return the normal deviate of a word, to 40 digits: the centre of its cell, inverted."""
    context = mpmath.mp.clone()
    context.dps = 50
    probability = (context.mpf(word >> 11) + context.mpf(1) / 2) / 2**53
    return context.sqrt(2) * context.erfinv(2 * probability - 1)


def test_what_is_drawn_is_what_it_always_was():
    for (seed, n, k), value in COEFFICIENTS.items():
        assert disorder.static_coefficient(CHAIN, seed, n, k) == value
    for (seed, q), value in DILATIONS.items():
        assert disorder.dilations(DRIVE, seed, q, 1) == value
        assert DRIVE.exact_target(q, seed) == Fraction(value)
        assert DRIVE.targets(1, 100, seed)[q - 1] == value
    for seed, tensions in TENSIONS.items():
        assert tuple(disorder.uniform_tensions(seed, 2)) == tensions


@njit
def words_of(seed, stream, n, block):
    return deviates.philox(seed, stream, n, block)


@njit
def deviate_of(word):
    return deviates.normal_deviate(word)


def test_the_compiled_words_are_those_of_numpy_and_deviates_are_accurate_into_both_tails() -> None:
    drawn = [0, 1 << 11, 2**63 - 1, 2**64 - 2**12, 2**52, 3 << 40, 2**62]
    for key in np.random.default_rng(4).integers(0, 2**63, (20, 4)).tolist():
        words = [int(word) for word in words_of(*map(np.uint64, key))]
        assert words == [word_of(*key[:3], 4 * key[3] + k) for k in range(4)]
        drawn += words
    for word in drawn:
        deviate = float(deviate_of(np.uint64(word)))
        assert deviate == -float(deviate_of(np.uint64(~word % 2**64)))
        expected = normal_of(word)
        assert abs(deviate - expected) <= 6 * math.ulp(abs(float(expected)))


@pytest.mark.parametrize("seed", [0, 2**64 - 1])
@pytest.mark.parametrize(("first", "count"), [(0, 30), (3, 1), (998, 7)])
def test_a_coefficient_does_not_depend_on_what_was_asked_before(seed, first, count):
    block = disorder.static_coefficients(CHAIN, seed, 17, first, count)
    draws = reversed(range(first, first + count))
    alone = [disorder.static_coefficient(CHAIN, seed, 17, k) for k in draws]
    assert block.tolist() == alone[::-1]


def test_without_disorder_a_coefficient_is_the_rational_mu_s():
    chain = captions(3)
    assert disorder.static_coefficient(chain, 8, 2, 77) == Fraction(3, 5)
    assert State.relaxed(chain).coefficients.tolist() == [0.6, 0.6, 0.6]
    state = State.relaxed(paper_chain(12), seed=5)  # has draw 0 of every slider
    keyed = [disorder.static_coefficient(paper_chain(12), 5, n, 0) for n in range(1, 13)]
    assert state.coefficients.tolist() == keyed
    assert (state.draws == 1).all()
