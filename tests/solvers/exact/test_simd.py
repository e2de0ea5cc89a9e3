"""Every operation on eight lanes against NumPy, lane by lane."""

from __future__ import annotations

import itertools
import math
import sys
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from numba import njit
from numpy.typing import NDArray

from exactcreep.solvers.exact.simd import (
    WIDTH,
    choose,
    from_left,
    from_right,
    fused,
    largest,
    least,
    load,
    spread,
    store,
)  # fmt: skip
from tests.processes import finished

EIGHT = 8
SPECIAL = [0.0, 1.0, 1 + 2.0**-52, 1 - 2.0**-53, 0.1, 3.5, 2.0**-1022, 5e-324, math.inf]
SPECIAL += [sys.float_info.max, *(-x for x in SPECIAL), math.nan]
kernel = njit(error_model="numpy")


def triples() -> NDArray[np.float64]:
    """Return operands a, b, c, shape (3, m): special values in all pairs, then random ones.

    The random ones include products that `c` nearly cancels, where rounding twice would show.
    """
    rng = np.random.default_rng(20110603)
    pairs = list(itertools.product(SPECIAL, SPECIAL))
    special = np.array([(a, b, rng.choice(SPECIAL)) for a, b in pairs]).T
    wide = rng.choice([-1.0, 1.0], (3, 1600)) * np.exp2(rng.uniform(-300, 300, (3, 1600)))
    near = rng.uniform(-4, 4, (3, 1600))
    near[2, :800] = -near[0, :800] * near[1, :800]
    rows = np.concatenate([special, wide, near], axis=1)
    return np.ascontiguousarray(rows[:, : rows.shape[1] // EIGHT * EIGHT])


OPERANDS = triples()
A, B, C = OPERANDS
ONE, OTHER, THIRD = (row.reshape(-1, EIGHT) for row in OPERANDS)
CHOICES = np.random.default_rng(7).integers(-(2**62), 2**62, len(ONE))
"""Masks whose bits above the eighth belong to no lane."""
CHOSEN = (CHOICES[:, None] >> np.arange(EIGHT)) & 1 == 1


@kernel
def operate(operands, choices, vectors, numbers):
    """Apply every operation to every strip of eight columns."""
    for s in range(choices.size):
        j = 8 * s
        a, b, c = load(operands, 0, j), load(operands, 1, j), load(operands, 2, j)
        store(vectors, 0, j, a + b)
        store(vectors, 1, j, a - b)
        store(vectors, 2, j, a * b)
        store(vectors, 3, j, a / b)
        store(vectors, 4, j, abs(a))
        store(vectors, 5, j, math.sqrt(a))
        store(vectors, 6, j, min(a, b))
        store(vectors, 7, j, max(a, b))
        store(vectors, 8, j, min(a, b, c))
        store(vectors, 9, j, from_left(b, a))
        store(vectors, 10, j, from_right(a, b))
        store(vectors, 11, j, choose(choices[s], a, b))
        store(vectors, 12, j, spread(operands[2, j]))
        store(vectors, 13, j, fused(a, b, c))
        for k in range(8):
            vectors[14, j + k] = fused(operands[0, j + k], operands[1, j + k], operands[2, j + k])
        numbers[0, s] = a < b
        numbers[1, s] = a <= b
        numbers[2, s] = a > b
        numbers[3, s] = a >= b
        numbers[4, s] = least(a)
        numbers[5, s] = largest(a)


@pytest.fixture(scope="module")
def outcome() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    vectors = np.full((15, A.size), -7.25)
    numbers = np.full((6, CHOICES.size), -7.25)
    operate(OPERANDS, CHOICES, vectors, numbers)
    return vectors, numbers


def same_bits(found: NDArray[np.float64], expected: NDArray[np.float64]) -> bool:
    """Return whether all floats are the same, signs of zeros included; one NaN is like another."""
    both_nan = np.isnan(found) & np.isnan(expected)
    return bool(np.all(both_nan | (found.view(np.int64) == expected.view(np.int64))))


def test_every_lane_has_the_bits_of_numpy(outcome):
    assert WIDTH == EIGHT
    with np.errstate(all="ignore"):
        smaller, larger = np.where(A < B, A, B), np.where(A > B, A, B)
        expected = [A + B, A - B, A * B, A / B, np.abs(A), np.sqrt(A), smaller, larger]
    expected += [
        np.where(smaller < C, smaller, C),
        np.concatenate([OTHER[:, -1:], ONE[:, :-1]], axis=1).ravel(),
        np.concatenate([ONE[:, 1:], OTHER[:, :1]], axis=1).ravel(),
        np.where(CHOSEN.ravel(), A, B),
        np.repeat(C[::EIGHT], EIGHT),
    ]
    for row, values in enumerate(expected):
        assert same_bits(outcome[0][row], values), row


def test_a_comparison_has_a_bit_for_each_lane_and_extremes_are_found_in_any_lane(outcome):
    for row, lanes in enumerate((ONE < OTHER, ONE <= OTHER, ONE > OTHER, ONE >= OTHER)):
        assert np.array_equal(outcome[1][row], lanes @ (1 << np.arange(EIGHT)))
    numbers = ~np.isnan(ONE).any(axis=1)
    strips = ONE[numbers]
    assert np.array_equal(outcome[1][4][numbers], strips.min(axis=1))
    assert np.array_equal(outcome[1][5][numbers], strips.max(axis=1))


def test_fused_rounds_the_exact_sum_of_product_and_addend_once(outcome):
    assert same_bits(outcome[0][14], outcome[0][13])  # one by one
    twice = 0
    for (a, b, c), found in zip(OPERANDS.T.tolist(), outcome[0][13].tolist(), strict=True):
        exact = Fraction(a) * Fraction(b) + Fraction(c) if np.isfinite([a, b, c]).all() else None
        if exact is not None and abs(exact) <= sys.float_info.max:
            assert found == float(exact)
            twice += a * b + c != found
        elif exact is None:  # an infinity or no number
            assert not math.isfinite(found)
    assert twice > 500


@pytest.mark.slow
@pytest.mark.parametrize("processor", ["haswell", "skylake-avx512"])
def test_the_lanes_are_the_same_on_narrower_registers(processor):
    known = Path("/proc/cpuinfo")
    if processor == "skylake-avx512" and not (known.exists() and "avx512f" in known.read_text()):
        pytest.skip("this machine has no registers of 512 bits")
    features = "+avx2,+fma,-avx512f" if processor == "haswell" else ""
    done = finished(
        sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", __file__,
        NUMBA_CPU_NAME=processor, NUMBA_CPU_FEATURES=features,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout
    assert "passed" in done.stdout
