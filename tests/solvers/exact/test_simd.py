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
    align_stack,
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
TINY, HUGE = 2.0**-1022, sys.float_info.max
SPECIAL = [0.0, 1.0, 1 + 2.0**-52, 1 - 2.0**-53, 0.1, 3.5, TINY, 5e-324, HUGE, math.inf]
SPECIAL += [-x for x in SPECIAL] + [math.nan]
kernel = njit(error_model="numpy")


def triples() -> NDArray[np.float64]:
    """Return operands a, b, c, shape (3, m): special values in all pairs, then random ones.

    The random ones include products that `c` nearly cancels, where rounding twice would show.
    """
    rng = np.random.default_rng(20110603)
    pairs = list(itertools.product(SPECIAL, SPECIAL))
    special = np.array([(a, b, rng.choice(SPECIAL)) for a, b in pairs]).T
    sizes = np.exp2(rng.uniform(-300, 300, (3, 1600)))
    wide = rng.choice([-1.0, 1.0], (3, 1600)) * sizes
    near = rng.uniform(-4, 4, (3, 1600))
    near[2, :800] = -near[0, :800] * near[1, :800]
    rows = np.concatenate([special, wide, near], axis=1)
    return np.ascontiguousarray(rows[:, : rows.shape[1] // EIGHT * EIGHT])


OPERANDS = triples()
A, B, C = OPERANDS
STRIPS = [row.reshape(-1, EIGHT) for row in OPERANDS]
ONE, OTHER, _ = STRIPS
CHOICES = np.random.default_rng(7).integers(-(2**62), 2**62, len(STRIPS[0]))
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


def beside(*parts: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.concatenate(parts, axis=1).ravel()


with np.errstate(all="ignore"):
    SMALLER, LARGER = np.where(A < B, A, B), np.where(A > B, A, B)
    EXPECTED = {
        "add": A + B,
        "subtract": A - B,
        "multiply": A * B,
        "divide": A / B,
        "magnitude": np.abs(A),
        "root": np.sqrt(A),
        "smaller": SMALLER,
        "larger": LARGER,
        "smallest": np.where(SMALLER < C, SMALLER, C),
        "from the left": beside(OTHER[:, -1:], ONE[:, :-1]),
        "from the right": beside(ONE[:, 1:], OTHER[:, :1]),
        "chosen": np.where(CHOSEN.ravel(), A, B),
        "spread": np.repeat(C[::EIGHT], EIGHT),
    }
COMPARED = {"<": A < B, "<=": A <= B, ">": A > B, ">=": A >= B}


@pytest.fixture(scope="module")
def outcome() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    vectors = np.full((15, A.size), -7.25)
    numbers = np.full((6, CHOICES.size), -7.25)
    operate(OPERANDS, CHOICES, vectors, numbers)
    return vectors, numbers


def same_bits(found: NDArray[np.float64], expected: NDArray[np.float64]) -> bool:
    """Return whether all floats are the same, signs of zeros included; one NaN is like another."""
    both_nan = np.isnan(found) & np.isnan(expected)
    alike = found.view(np.int64) == expected.view(np.int64)
    return bool(np.all(both_nan | alike))


@pytest.mark.parametrize(("row", "name"), [*enumerate(EXPECTED)])
def test_every_lane_has_the_bits_of_numpy(outcome, row, name):
    assert WIDTH == EIGHT
    assert same_bits(outcome[0][row], EXPECTED[name])


@pytest.mark.parametrize(("row", "name"), [*enumerate(COMPARED)])
def test_bit_j_of_a_comparison_belongs_to_lane_j_and_nan_is_not_compared(outcome, row, name):
    expected = COMPARED[name].reshape(-1, EIGHT) @ (1 << np.arange(EIGHT))
    assert np.array_equal(outcome[1][row], expected)
    assert len(np.unique(expected)) > 50


def test_least_and_largest_are_found_in_whichever_lane_they_stand(outcome):
    numbers = ~np.isnan(STRIPS[0]).any(axis=1)
    strips = STRIPS[0][numbers]
    assert np.array_equal(outcome[1][4][numbers], strips.min(axis=1))
    assert np.array_equal(outcome[1][5][numbers], strips.max(axis=1))
    for places in (strips.argmin(axis=1), strips.argmax(axis=1)):
        assert set(places.tolist()) == set(range(EIGHT))


def rounded(value: Fraction) -> float:
    try:
        return float(value)
    except OverflowError:
        return math.inf if value > 0 else -math.inf


def fused_once(a: float, b: float, c: float) -> float:
    if math.isfinite(a) and math.isfinite(b):
        return rounded(Fraction(a) * Fraction(b) + Fraction(c)) if math.isfinite(c) else c
    sign = math.copysign(1, a) * math.copysign(1, b)
    return math.nan if math.isnan(a * b) else sign * math.inf + c


def test_fused_rounds_the_exact_sum_of_product_and_addend_once(outcome):
    lanes = outcome[0][13]
    expected = np.array([fused_once(*abc) for abc in OPERANDS.T.tolist()])
    nan = np.isnan(expected)
    assert np.array_equal(np.isnan(lanes), nan)
    assert np.array_equal(lanes[~nan], expected[~nan])
    with np.errstate(all="ignore"):
        assert np.sum((expected != A * B + C) & np.isfinite(expected)) > 500  # twice, it differs
    assert same_bits(outcome[0][14], lanes)  # one by one


@kernel
def copy_eight(source, row, column, target, to_row, to_column):
    store(target, to_row, to_column, load(source, row, column))


def test_load_and_store_reach_eight_cells_at_any_column_and_no_other():
    rng = np.random.default_rng(3)
    for skip in range(4):  # arrays that begin at any multiple of eight bytes
        source = rng.normal(size=3 * 27 + skip)[skip:].reshape(3, 27)
        for row, column, to_row, to_column in itertools.product((0, 2), range(20), (0, 1), (0, 5)):
            target = np.full(2 * 21 + skip, -1.5)[skip:].reshape(2, 21)
            expected = target.copy()
            expected[to_row, to_column : to_column + EIGHT] = source[row, column : column + EIGHT]
            copy_eight(source, row, column, target, to_row, to_column)
            assert np.array_equal(target, expected)


def test_the_stack_is_aligned_where_that_was_asked_for():
    @njit
    def raised(array):
        align_stack()
        store(array, 0, 0, load(array, 0, 0) + spread(1.0))

    array = np.zeros((1, EIGHT))
    raised(array)
    assert (array == 1.0).all()
    (code,) = raised.inspect_llvm().values()
    assert code.count("alignstack=64") == 1


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
