"""Draws made eight at a time are those of the model, bit for bit."""

from __future__ import annotations

import numpy as np
import pytest
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


SIZES = np.random.default_rng(3).uniform(0, 50, 4000)
TAILS = np.exp2(SIZES).astype(np.int64) - 1
CELLS = {
    "the far tails, from the very last cell on": TAILS,
    "the change of formula at exp(-25)": cells(int(np.exp(-25.0) * 2**53) - 2000, 4000),
    "the edge of the central formula": cells(int((0.5 - deviates.CENTRAL) * 2**53) - 2000, 4000),
}
"""Of the 2**53 cells of a probability; their mirror images are taken, too, in every mixture."""


@pytest.mark.parametrize("where", ["a million words", *CELLS])
def test_words_give_the_same_deviates_in_lanes(where: str):
    rng = np.random.default_rng(20110603)
    if where in CELLS:
        words = np.concatenate([CELLS[where], 2**53 - 1 - CELLS[where]]).astype(np.uint64)
        words <<= np.uint64(11)
        rng.shuffle(words)
    else:
        words = rng.integers(0, 2**64, 2**20, dtype=np.uint64)
    found = np.full((1, words.size), -7.25)
    told = np.empty(words.size)
    in_lanes_and_one_by_one(words, found, told)
    assert np.array_equal(found[0].view(np.int64), told.view(np.int64))
