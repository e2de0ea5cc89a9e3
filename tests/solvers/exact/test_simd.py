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
)
from tests.processes import finished

EIGHT = 8
SPECIAL = (
    0.0,
    -0.0,
    1.0,
    -1.0,
    1.0 + 2.0**-52,
    1.0 - 2.0**-53,
    0.1,
    -3.5,
    2.0**-1022,
    -(2.0**-1022),
    5e-324,
    -5e-324,
    1.7976931348623157e308,
    -1.7976931348623157e308,
    math.inf,
    -math.inf,
    math.nan,
)


def triples() -> NDArray[np.float64]:
    """Return operands a, b, c, shape (3, m): special values in all pairs, then random ones.

    The random ones include products that `c` nearly cancels, where rounding twice would show.
    """
    pairs = list(itertools.product(SPECIAL, SPECIAL))
    rng = np.random.default_rng(20110603)
    thirds = rng.choice(SPECIAL, len(pairs))
    special = np.array([[a, b, c] for (a, b), c in zip(pairs, thirds, strict=True)]).T
    signs = rng.choice([-1.0, 1.0], (3, 1600))
    wide = signs * np.exp2(rng.uniform(-300, 300, (3, 1600)))
    near = rng.uniform(-4, 4, (3, 1600))
    near[2, :800] = -near[0, :800] * near[1, :800]
    rows = np.concatenate([special, wide, near], axis=1)
    return np.ascontiguousarray(rows[:, : rows.shape[1] // EIGHT * EIGHT])


OPERANDS = triples()
A, B, C = OPERANDS
STRIPS = OPERANDS.shape[1] // EIGHT
CHOICES = np.random.default_rng(7).integers(-(2**62), 2**62, STRIPS)
"""Masks whose bits above the eighth belong to no lane."""

(ADD, SUBTRACT, MULTIPLY, DIVIDE, FUSED, MAGNITUDE, ROOT, SMALLER, LARGER, LEFT, RIGHT, CHOSEN,
 SPREAD, SMALLEST, GREATEST, MIXED) = range(16)  # fmt: skip
LEAST, LARGEST = range(2)
BELOW, NOT_ABOVE, ABOVE, NOT_BELOW = range(4)


@njit(error_model="numpy")
def operate(operands, choices, vectors, numbers, masks):
    """Apply every operation to every strip of eight columns."""
    for s in range(choices.size):
        j = 8 * s
        a = load(operands, 0, j)
        b = load(operands, 1, j)
        c = load(operands, 2, j)
        store(vectors, ADD, j, a + b)
        store(vectors, SUBTRACT, j, a - b)
        store(vectors, MULTIPLY, j, a * b)
        store(vectors, DIVIDE, j, a / b)
        store(vectors, FUSED, j, fused(a, b, c))
        store(vectors, MAGNITUDE, j, abs(a))
        store(vectors, ROOT, j, math.sqrt(a))
        store(vectors, SMALLER, j, min(a, b))
        store(vectors, LARGER, j, max(a, b))
        store(vectors, LEFT, j, from_left(b, a))
        store(vectors, RIGHT, j, from_right(a, b))
        store(vectors, CHOSEN, j, choose(choices[s], a, b))
        store(vectors, SPREAD, j, spread(operands[2, j]))
        numbers[LEAST, s] = least(a)
        numbers[LARGEST, s] = largest(a)
        store(vectors, SMALLEST, j, min(a, b, c))
        store(vectors, GREATEST, j, max(a, b, c))
        store(vectors, MIXED, j, fused(a, operands[1, j], 0.5) - operands[2, j])
        masks[BELOW, s] = a < b
        masks[NOT_ABOVE, s] = a <= b
        masks[ABOVE, s] = a > b
        masks[NOT_BELOW, s] = a >= b


@pytest.fixture(scope="module")
def outcome() -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    vectors = np.full((16, OPERANDS.shape[1]), -7.25)
    numbers = np.full((2, STRIPS), -7.25)
    masks = np.full((4, STRIPS), -1, dtype=np.int64)
    operate(OPERANDS, CHOICES, vectors, numbers, masks)
    return vectors, numbers, masks


def same_bits(found: NDArray[np.float64], expected: NDArray[np.float64]) -> bool:
    """Return whether all floats are the same, signs of zeros included; one NaN is like another."""
    both_nan = np.isnan(found) & np.isnan(expected)
    return bool(np.all(both_nan | (found.view(np.int64) == expected.view(np.int64))))


def test_a_vector_has_as_many_lanes_as_its_tests_assume():
    assert WIDTH == EIGHT


@pytest.mark.parametrize(
    ("row", "operation"),
    [(ADD, np.add), (SUBTRACT, np.subtract), (MULTIPLY, np.multiply), (DIVIDE, np.divide)],
    ids=["add", "subtract", "multiply", "divide"],
)
def test_arithmetic_is_that_of_ieee_in_every_lane(outcome, row, operation):
    with np.errstate(all="ignore"):
        assert same_bits(outcome[0][row], operation(A, B))


def test_magnitude_and_square_root_are_those_of_ieee_in_every_lane(outcome):
    with np.errstate(invalid="ignore"):
        assert same_bits(outcome[0][MAGNITUDE], np.abs(A))
        assert same_bits(outcome[0][ROOT], np.sqrt(A))


def test_smaller_and_larger_choose_in_every_lane(outcome):
    assert same_bits(outcome[0][SMALLER], np.where(A < B, A, B))
    assert same_bits(outcome[0][LARGER], np.where(A > B, A, B))
    smaller, larger = outcome[0][SMALLER], outcome[0][LARGER]
    assert same_bits(outcome[0][SMALLEST], np.where(smaller < C, smaller, C))
    assert same_bits(outcome[0][GREATEST], np.where(larger > C, larger, C))


def test_least_and_largest_are_found_in_whichever_lane_they_stand(outcome):
    strips = A.reshape(STRIPS, EIGHT)
    numbers = ~np.isnan(strips).any(axis=1)
    strips = strips[numbers]
    assert np.array_equal(outcome[1][LEAST][numbers], strips.min(axis=1))
    assert np.array_equal(outcome[1][LARGEST][numbers], strips.max(axis=1))
    for places in (strips.argmin(axis=1), strips.argmax(axis=1)):
        assert set(places.tolist()) == set(range(EIGHT))


def rounded(value: Fraction) -> float:
    try:
        return float(value)
    except OverflowError:
        return math.inf if value > 0 else -math.inf


def test_fused_rounds_the_exact_sum_of_product_and_addend_once(outcome):
    found = outcome[0][FUSED]
    twice = 0
    for a, b, c, value in zip(A.tolist(), B.tolist(), C.tolist(), found.tolist(), strict=True):
        if math.isfinite(a) and math.isfinite(b) and math.isfinite(c):
            assert value == rounded(Fraction(a) * Fraction(b) + Fraction(c))
            twice += value != a * b + c
        else:
            expected = np.float64(math.copysign(1, a) * math.copysign(1, b)) * math.inf
            if math.isfinite(a) and math.isfinite(b):
                expected = c  # infinite or NaN: a finite product changes nothing
            elif math.isnan(a * b) or math.isnan(c) or (math.isinf(c) and c != expected):
                expected = math.nan
            assert value == expected or (math.isnan(value) and math.isnan(expected))
    # the operands tell one rounding from two
    assert twice > 500


def test_shuffles_take_one_lane_from_the_neighbour(outcome):
    a, b = A.reshape(STRIPS, EIGHT), B.reshape(STRIPS, EIGHT)
    left = np.concatenate([b[:, -1:], a[:, :-1]], axis=1)
    right = np.concatenate([a[:, 1:], b[:, :1]], axis=1)
    assert same_bits(outcome[0][LEFT], left.ravel())
    assert same_bits(outcome[0][RIGHT], right.ravel())


def test_choose_takes_the_first_where_the_mask_is_set(outcome):
    bits = (CHOICES[:, None] >> np.arange(EIGHT)) & 1
    assert same_bits(outcome[0][CHOSEN], np.where(bits.ravel() == 1, A, B))
    assert len(np.unique(CHOICES & 0xFF)) > 150


def test_a_number_fills_every_lane(outcome):
    assert same_bits(outcome[0][SPREAD], np.repeat(C[::EIGHT], EIGHT))
    one, *numbers = (row[-800:] for row in OPERANDS)
    b, c = (np.repeat(row[::EIGHT], EIGHT) for row in numbers)
    half = Fraction(1, 2)
    products = [Fraction(x) * Fraction(y) for x, y in zip(one, b, strict=True)]
    exact = [rounded(product + half) for product in products] - c
    assert same_bits(outcome[0][MIXED, -800:], exact)


def test_bit_j_of_a_comparison_belongs_to_lane_j_and_nan_is_not_compared(outcome):
    weights = 1 << np.arange(EIGHT)
    truths = {BELOW: A < B, NOT_ABOVE: A <= B, ABOVE: A > B, NOT_BELOW: A >= B}
    for row, truth in truths.items():
        expected = truth.reshape(STRIPS, EIGHT) @ weights
        assert np.array_equal(outcome[2][row], expected)
        assert len(np.unique(expected)) > 50


@njit(error_model="numpy")
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


@njit(error_model="numpy")
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


@njit(error_model="numpy")
def turned(source, target):
    put(target, 0, from_left(take(source, 0), take(source, 0)))
    put(target, 1, from_right(take(source, 0), take(source, 0)))


def test_a_strip_beside_itself_is_turned_round():
    source = np.arange(8.0).reshape(1, EIGHT)
    target = np.empty((2, EIGHT))
    turned(source, target)
    assert target[0].tolist() == [7, 0, 1, 2, 3, 4, 5, 6]
    assert target[1].tolist() == [1, 2, 3, 4, 5, 6, 7, 0]


@njit(error_model="numpy")
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
    source = np.random.default_rng(5).normal(size=(12, EIGHT))
    target = np.full((18, EIGHT), -1.5)
    mask = 0b1010_0110_0000_1111_0001_1001
    below, smallest, greatest = three_at_a_time(source, target, mask)
    a, b = source[1::4].ravel(), source[2::4].ravel()
    chosen = np.array([mask >> j & 1 for j in range(24)], dtype=bool)
    found = target.reshape(3, 6, EIGHT).transpose(1, 0, 2).reshape(6, 24)
    assert np.array_equal(found[0], np.append(0.0, a[:-1]))
    assert np.array_equal(found[1], np.append(a[1:], b[0]))
    assert np.array_equal(found[2], np.where(chosen, a, 2.0))
    assert np.array_equal(found[3], np.append(b[-1], a[:-1]) * b)
    assert np.array_equal(found[4], np.append(a[8:16], [-1.5] * 16))
    assert np.array_equal(found[5], np.r_[[7.0] * 8, source[0], [source[0, 3]] * 8])
    assert [below >> j & 1 for j in range(24)] == (a < b).tolist()
    assert below >> 24 == 0
    assert (smallest, greatest) == (a.min(), a.max())


@njit(error_model="numpy")
def store_then_load(array, column):
    """Return how far eight cells have come that were raised by 1, then read one column later."""
    store(array, 0, column, load(array, 0, column) + spread(1.0))
    return largest(load(array, 0, column + 1))


def test_what_is_stored_is_seen_by_an_overlapping_load():
    array = np.arange(20.0).reshape(1, 20)
    assert store_then_load(array, 3) == 11.0  # cells 4 .. 10 raised, cell 11 not
    assert array[0].tolist() == [0, 1, 2, *range(4, 12), *range(11, 20)]


@njit(error_model="numpy")
def fused_scalars(operands, out):
    for j in range(out.size):
        out[j] = fused(operands[0, j], operands[1, j], operands[2, j])


def test_the_scalar_fused_operation_is_the_one_of_the_lanes(outcome):
    out = np.empty(OPERANDS.shape[1])
    fused_scalars(OPERANDS, out)
    assert same_bits(out, outcome[0][FUSED])


@njit(error_model="numpy")
def take_apart(operands, mantissas, exponents, turned):
    """Split every strip into mantissas and exponents; turn its lanes round one by one."""
    for s in range(operands.size // EIGHT):
        a = load(operands, 0, EIGHT * s)
        store(mantissas, 0, EIGHT * s, mantissa(a))
        store(exponents, 0, EIGHT * s, exponent(a))
        back = together(
            lane_of(a, 7), lane_of(a, 6), lane_of(a, 5), lane_of(a, 4),
            lane_of(a, 3), lane_of(a, 2), lane_of(a, 1), lane_of(a, 0),
        )  # fmt: skip
        store(turned, 0, EIGHT * s, back)


def test_positive_normal_numbers_come_apart_as_in_numpy_and_lanes_one_by_one():
    normal = np.sort(A[(A >= 2.0**-1022) & np.isfinite(A)])
    operands = normal[: normal.size // EIGHT * EIGHT].reshape(1, -1)
    assert operands.size > 500
    mantissas, exponents, turned = (np.empty_like(operands) for _ in range(3))
    take_apart(operands, mantissas, exponents, turned)
    m, e = np.frexp(operands)
    assert same_bits(mantissas, m)
    assert same_bits(exponents, e.astype(float))
    assert same_bits(turned.reshape(-1, EIGHT), operands.reshape(-1, EIGHT)[:, ::-1])


@njit(error_model="numpy")
def few_together(values, out):
    store(out, 0, 0, together(values[0], values[1], values[2]))


def test_lanes_that_are_not_given_are_zero():
    out = np.full((1, EIGHT), -1.5)
    few_together(np.array([1.0, -2.0, 3.0]), out)
    assert out[0].tolist() == [1.0, -2.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0]


@njit(error_model="numpy")
def eight_upper_bits(w, out):
    store(out, 0, 0, upper_bits(w[0], w[1], w[2], w[3], w[4], w[5], w[6], w[7]))


def test_the_upper_bits_of_words_become_whole_numbers():
    rng = np.random.default_rng(11)
    some = rng.integers(0, 2**64, 80, dtype=np.uint64)
    ends = np.array([0, 1, 2**11 - 1, 2**11, 2**63 - 1, 2**63, 2**64 - 1, 2**64 - 2**11], np.uint64)
    for words in (ends, *some.reshape(-1, EIGHT)):
        out = np.empty((1, EIGHT))
        eight_upper_bits(words, out)
        assert out[0].tolist() == [w >> 11 for w in words.tolist()]


def test_the_stack_is_aligned_where_that_was_asked_for():
    def raised(array):
        align_stack()
        store(array, 0, 0, load(array, 0, 0) + spread(1.0))

    def as_it_comes(array):
        store(array, 0, 0, load(array, 0, 0) + spread(1.0))

    for function, count in ((raised, 1), (as_it_comes, 0)):
        compiled = njit(function)
        array = np.zeros((1, EIGHT))
        compiled(array)
        assert (array == 1.0).all()
        (code,) = compiled.inspect_llvm().values()
        assert code.count("alignstack=64") == count


@njit(error_model="numpy")
def lowest_bits(masks, out):
    for k in range(masks.size):
        out[k] = lowest_bit(masks[k])


def test_the_lowest_bit_of_every_mask_is_found():
    masks = np.array([*range(1, 256), *(1 << k for k in range(63)), -(2**63), -1, 3 << 40])
    out = np.empty(masks.size, dtype=np.int64)
    lowest_bits(masks, out)
    expected = [(m & -m).bit_length() - 1 for m in masks.tolist()]
    assert out.tolist() == expected


@pytest.mark.slow
@pytest.mark.parametrize("processor", ["haswell", "skylake-avx512"])
def test_the_lanes_are_the_same_on_narrower_registers(processor):
    if processor == "skylake-avx512" and "avx512f" not in _flags():
        pytest.skip("this machine has no registers of 512 bits")
    features = "+avx2,+fma,-avx512f" if processor == "haswell" else ""
    done = finished(
        sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", __file__,
        NUMBA_CPU_NAME=processor, NUMBA_CPU_FEATURES=features,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout
    assert "passed" in done.stdout


def _flags() -> str:
    try:
        return Path("/proc/cpuinfo").read_text(encoding="utf-8")
    except OSError:
        return ""
