"""The fused operation against exact sums, and eight lanes on other processors."""

from __future__ import annotations

import sys
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from numba import njit
from numpy.typing import NDArray

from exactcreep.solvers.exact.simd import fused, load, store
from tests.processes import finished

DRAWS = str(Path(__file__).with_name("test_draws.py"))


def triples() -> NDArray[np.float64]:
    """Return operands a, b, c, shape (3, m), of all sizes, and where c nearly cancels a b."""
    rng = np.random.default_rng(20110603)
    wide = rng.choice([-1.0, 1.0], (3, 1600)) * np.exp2(rng.uniform(-300, 300, (3, 1600)))
    near = rng.uniform(-4, 4, (3, 1600))
    near[2, :800] = -near[0, :800] * near[1, :800]
    return np.concatenate([wide, near], axis=1)


OPERANDS = triples()


@njit(error_model="numpy")
def fuse(operands, found):
    """Fuse every strip of eight columns, in lanes and one by one."""
    for j in range(0, operands.shape[1], 8):
        a, b, c = load(operands, 0, j), load(operands, 1, j), load(operands, 2, j)
        store(found, 0, j, fused(a, b, c))
        for k in range(j, j + 8):
            found[1, k] = fused(operands[0, k], operands[1, k], operands[2, k])


def test_fused_rounds_the_exact_sum_of_product_and_addend_once():
    lanes, alone = found = np.full((2, OPERANDS.shape[1]), -7.25)
    fuse(OPERANDS, found)
    assert np.array_equal(lanes.view(np.int64), alone.view(np.int64))
    twice = 0
    for (a, b, c), once in zip(OPERANDS.T.tolist(), lanes.tolist(), strict=True):
        assert once == float(Fraction(a) * Fraction(b) + Fraction(c))
        twice += a * b + c != once
    assert twice > 500


@pytest.mark.slow
@pytest.mark.parametrize("processor", ["haswell", "skylake-avx512"])
def test_the_lanes_are_the_same_on_narrower_registers(processor):
    known = Path("/proc/cpuinfo")
    if processor == "skylake-avx512" and not (known.exists() and "avx512f" in known.read_text()):
        pytest.skip("this machine has no registers of 512 bits")
    features = "+avx2,+fma,-avx512f" if processor == "haswell" else ""
    done = finished(
        sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", __file__, DRAWS,
        NUMBA_CPU_NAME=processor, NUMBA_CPU_FEATURES=features,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout
    assert "passed" in done.stdout
