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
    across,
    align_stack,
    choose,
    element,
    exponent,
    from_left,
    from_right,
    fused,
    inner,
    lane_of,
    largest,
    least,
    load,
    lowest_bit,
    mantissa,
    put,
    put_across,
    spread,
    store,
    take,
    together,
    upper_bits,
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
    wide = rng.choice([-1.0, 1.0], (3, 1600)) * np.exp2(rng.uniform(-300, 300, (3, 1600)))
    near = rng.uniform(-4, 4, (3, 1600))
    near[2, :800] = -near[0, :800] * near[1, :800]
    rows = np.concatenate([special, wide, near], axis=1)
    return np.ascontiguousarray(rows[:, : rows.shape[1] // EIGHT * EIGHT])


OPERANDS = triples()
A, B, C = OPERANDS
STRIPS = [row.reshape(-1, EIGHT) for row in OPERANDS]
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
        store(vectors, 9, j, max(a, b, c))
        store(vectors, 10, j, from_left(b, a))
        store(vectors, 11, j, from_right(a, b))
        store(vectors, 12, j, choose(choices[s], a, b))
        store(vectors, 13, j, spread(operands[2, j]))
        store(vectors, 14, j, fused(a, b, c))
        store(vectors, 15, j, fused(a, operands[1, j], 0.5) - operands[2, j])
        for k in range(8):
            vectors[16, j + k] = fused(operands[0, j + k], operands[1, j + k], operands[2, j + k])
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
        "add": A + B, "subtract": A - B, "multiply": A * B, "divide": A / B, "magnitude": np.abs(A),
        "root": np.sqrt(A), "smaller": SMALLER, "larger": LARGER,
        "smallest": np.where(SMALLER < C, SMALLER, C), "greatest": np.where(LARGER > C, LARGER, C),
        "from the left": beside(STRIPS[1][:, -1:], STRIPS[0][:, :-1]),
        "from the right": beside(STRIPS[0][:, 1:], STRIPS[1][:, :1]),
        "chosen": np.where(CHOSEN.ravel(), A, B), "spread": np.repeat(C[::EIGHT], EIGHT),
    }  # fmt: skip
COMPARED = {"<": A < B, "<=": A <= B, ">": A > B, ">=": A >= B}


@pytest.fixture(scope="module")
def outcome() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    vectors, numbers = np.full((17, A.size), -7.25), np.full((6, CHOICES.size), -7.25)
    operate(OPERANDS, CHOICES, vectors, numbers)
    return vectors, numbers


def same_bits(found: NDArray[np.float64], expected: NDArray[np.float64]) -> bool:
    """Return whether all floats are the same, signs of zeros included; one NaN is like another."""
    both_nan = np.isnan(found) & np.isnan(expected)
    return bool(np.all(both_nan | (found.view(np.int64) == expected.view(np.int64))))


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
    lanes, expected = outcome[0][14], np.array([fused_once(*abc) for abc in OPERANDS.T.tolist()])
    nan = np.isnan(expected)
    assert np.array_equal(np.isnan(lanes), nan)
    assert np.array_equal(lanes[~nan], expected[~nan])
    with np.errstate(all="ignore"):
        assert np.sum((expected != A * B + C) & np.isfinite(expected)) > 500  # twice, it differs
    assert same_bits(outcome[0][16], lanes)  # one by one
    ones, b, c = A[-800:], *(np.repeat(row[-800::EIGHT], EIGHT) for row in (B, C))
    pairs = zip(ones.tolist(), b.tolist(), strict=True)
    products = [rounded(Fraction(x) * Fraction(y) + Fraction(1, 2)) for x, y in pairs]
    assert same_bits(outcome[0][15, -800:], products - c)


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


@kernel
def within_rows(source, row, lane, target):
    put(target, row + 1, take(source, row) + element(source, row, lane))
    return element(source, row, lane)


def test_rows_of_eight_are_taken_put_and_read_lane_by_lane():
    source = np.random.default_rng(4).normal(size=(5, EIGHT))
    for row, lane in itertools.product(range(5), range(EIGHT)):
        target = np.full((7, EIGHT), -1.5)
        expected = target.copy()
        expected[row + 1] = source[row] + source[row, lane]
        assert within_rows(source, row, lane, target) == source[row, lane]
        assert np.array_equal(target, expected)


@kernel
def three_at_a_time(source, target, mask):
    """Do everything that several strips can do; return a mask and two numbers."""
    a = across(source, 1, 4, spread(0.0, 0.0, 0.0))
    b = across(source, 2, 4, a)
    put_across(target, 0, 6, from_left(0.0, a))
    put_across(target, 1, 6, from_right(a, b))
    put_across(target, 2, 6, choose(mask, a, 2.0))
    put_across(target, 3, 6, from_left(b, a) * b)
    put_across(target, 4, 6, inner(a))
    put_across(target, 5, 6, spread(7.0, take(source, 0), element(source, 0, 3)))
    return a < b, least(a), largest(a)


def test_strips_side_by_side_act_as_one_long_vector():
    source, target = np.random.default_rng(5).normal(size=(12, EIGHT)), np.full((18, EIGHT), -1.5)
    mask = 0b1010_0110_0000_1111_0001_1001
    below, smallest, greatest = three_at_a_time(source, target, mask)
    a, b = source[1::4].ravel(), source[2::4].ravel()
    chosen = np.array([mask >> j & 1 for j in range(24)], dtype=bool)
    expected = [
        np.append(0.0, a[:-1]), np.append(a[1:], b[0]), np.where(chosen, a, 2.0),
        np.append(b[-1], a[:-1]) * b, np.append(a[8:16], [-1.5] * 16),
        np.r_[[7.0] * 8, source[0], [source[0, 3]] * 8],
    ]  # fmt: skip
    assert np.array_equal(target.reshape(3, 6, EIGHT).transpose(1, 0, 2).reshape(6, 24), expected)
    assert below == sum(1 << j for j in range(24) if a[j] < b[j])
    assert (smallest, greatest) == (a.min(), a.max())


@kernel
def take_apart(operands, mantissas, exponents, turned):
    """Split every strip into mantissas and exponents; turn its lanes round one by one."""
    for s in range(operands.size // EIGHT):
        a = load(operands, 0, EIGHT * s)
        store(mantissas, 0, EIGHT * s, mantissa(a))
        store(exponents, 0, EIGHT * s, exponent(a))
        back = together(
            lane_of(a, 7), lane_of(a, 6), lane_of(a, 5), lane_of(a, 4), lane_of(a, 3), lane_of(a, 2)
        )
        store(turned, 0, EIGHT * s, back)


def test_positive_normal_numbers_come_apart_as_in_numpy_and_lanes_one_by_one():
    normal = np.sort(A[(A >= TINY) & np.isfinite(A)])
    operands = normal[: normal.size // EIGHT * EIGHT].reshape(1, -1)
    mantissas, exponents, turned = (np.empty_like(operands) for _ in range(3))
    take_apart(operands, mantissas, exponents, turned)
    m, e = np.frexp(operands)
    assert operands.size > 500
    assert same_bits(mantissas, m)
    assert same_bits(exponents, e.astype(float))
    back = operands.reshape(-1, EIGHT)[:, ::-1].copy()
    back[:, 6:] = 0.0  # lanes that are not given
    assert same_bits(turned.reshape(-1, EIGHT), back)


@kernel
def of_masks_and_words(masks, lowest, w, upper):
    for k in range(masks.size):
        lowest[k] = lowest_bit(masks[k])
    for k in range(0, w.size, 8):
        bits = upper_bits(
            w[k], w[k + 1], w[k + 2], w[k + 3], w[k + 4], w[k + 5], w[k + 6], w[k + 7]
        )
        store(upper, 0, k, bits)


def test_the_lowest_bit_of_masks_and_the_upper_ones_of_words_are_found():
    masks = np.array([*range(1, 256), *(1 << k for k in range(63)), -(2**63), -1, 3 << 40])
    ends = [0, 1, 2**11 - 1, 2**11, 2**63 - 1, 2**63, 2**64 - 1, 2**64 - 2**11]
    some = np.random.default_rng(11).integers(0, 2**64, 80, dtype=np.uint64)
    words = np.append(np.array(ends, np.uint64), some)
    lowest, upper = np.empty(masks.size, dtype=np.int64), np.empty((1, words.size))
    of_masks_and_words(masks, lowest, words, upper)
    assert lowest.tolist() == [(m & -m).bit_length() - 1 for m in masks.tolist()]
    assert upper[0].tolist() == [w >> 11 for w in words.tolist()]


@kernel
def store_then_load(array, column):
    """Return how far eight cells have come that were raised by 1, then read one column later."""
    store(array, 0, column, load(array, 0, column) + spread(1.0))
    return largest(load(array, 0, column + 1))


def test_what_is_stored_is_seen_by_an_overlapping_load():
    array = np.arange(20.0).reshape(1, 20)
    assert store_then_load(array, 3) == 11.0  # cells 4 .. 10 raised, cell 11 not
    assert array[0].tolist() == [0, 1, 2, *range(4, 12), *range(11, 20)]


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
