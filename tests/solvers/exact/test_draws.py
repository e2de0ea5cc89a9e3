"""Draws made eight at a time are those of the model, bit for bit."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from exactcreep.model import deviates
from exactcreep.solvers.exact.draws import BATCH, write_deviates
from exactcreep.solvers.exact.simd import load


@njit(error_model="numpy")
def in_lanes_and_one_by_one(words, found, told):
    q = np.empty((1, words.size))
    for j in range(words.size):
        q[0, j] = deviates.centred(words[j])
        told[j] = deviates.normal_deviate(words[j])
    for column in range(0, words.size, BATCH):
        write_deviates(load(q, 0, column), found, 0, column)


def cells(first: int, count: int) -> NDArray[np.int64]:
    return np.arange(first, first + count)


TAILS = np.exp2(np.random.default_rng(3).uniform(0, 50, 4000)).astype(np.int64) - 1
CELLS = np.concatenate(
    [
        TAILS,  # from the very last cell on
        cells(int(np.exp(-25.0) * 2**53) - 2000, 4000),  # a change of formula
        cells(int((0.5 - deviates.CENTRAL) * 2**53) - 2000, 4000),  # edge of the central formula
    ]
)
"""Of the 2**53 cells of a probability."""


def test_words_give_the_same_deviates_in_lanes() -> None:
    rng = np.random.default_rng(20110603)
    words = np.concatenate([CELLS, 2**53 - 1 - CELLS]).astype(np.uint64) << np.uint64(11)
    rng.shuffle(words)  # so that formulas meet in one vector
    words = np.concatenate([words, rng.integers(0, 2**64, 2**20, dtype=np.uint64)])
    found, told = np.full((1, words.size), -7.25), np.empty(words.size)
    in_lanes_and_one_by_one(words, found, told)
    assert np.array_equal(found[0].view(np.int64), told.view(np.int64))
