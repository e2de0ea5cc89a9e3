"""Draws made eight at a time are those of the model, bit for bit."""

from __future__ import annotations

import numpy as np
import pytest
from numba import njit
from numpy.typing import NDArray

from exactcreep.model import deviates, disorder
from exactcreep.solvers.exact.draws import BATCH, KEPT, fill, write_deviates
from exactcreep.solvers.exact.simd import load

FIRST = 0.5 - 2.0**-54
"""The largest probability of a word, minus 1/2."""


@njit(error_model="numpy")
def by_eights(q, out):
    for column in range(0, q.shape[1], BATCH):
        write_deviates(load(q, 0, column), out, 0, column)


@njit(error_model="numpy")
def one_by_one(words, centred, out):
    for j in range(words.size):
        centred[j] = deviates.centred(words[j])
        out[j] = deviates.normal_deviate(words[j])


def differing(words: NDArray[np.uint64]) -> int:
    """Return how many words give other bits in lanes than one by one."""
    q = np.empty((1, words.size))
    expected = np.empty(words.size)
    one_by_one(words, q[0], expected)
    found = np.full_like(q, -7.25)
    by_eights(q, found)
    return int(np.sum(found[0].view(np.int64) != expected.view(np.int64)))


def words_of(cells: NDArray[np.int64]) -> NDArray[np.uint64]:
    """Return a word for each of the 2**53 cells, and for its mirror image."""
    both = np.concatenate([cells, 2**53 - 1 - cells])
    return both.astype(np.uint64) << np.uint64(11)


def test_a_million_words_give_the_same_deviates_in_lanes():
    words = np.random.default_rng(20110603).integers(0, 2**64, 2**20, dtype=np.uint64)
    assert differing(words) == 0


def test_words_of_the_far_tails_give_the_same_deviates_in_lanes():
    # from the very last cell through the change of formula at exp(-25), in every mixture of lanes
    rng = np.random.default_rng(3)
    cells = np.exp2(rng.uniform(0, 50, 4000)).astype(np.int64) - 1
    words = words_of(cells)
    rng.shuffle(words)
    assert differing(words) == 0
    near = int(np.exp(-25.0) * 2**53)
    assert differing(words_of(np.arange(near - 2000, near + 2000))) == 0
    last = np.full((1, BATCH), FIRST)
    out = np.empty_like(last)
    by_eights(last, out)
    assert (out > 8.2).all()


def test_words_about_the_edge_of_the_central_formula_give_the_same_deviates_in_lanes():
    edge = int((0.5 - deviates.CENTRAL) * 2**53)
    assert differing(words_of(np.arange(edge - 2000, edge + 2000))) == 0


@njit(error_model="numpy")
def fill_rows(rows, seed, slider, batch):
    fill(rows, 1, seed, slider, batch)


@pytest.mark.parametrize("seed", [0, 7, 2**64 - 1])
@pytest.mark.parametrize("batch", [0, 1, 2, 125, 2**58 + 1])
def test_a_batch_fills_its_own_columns_with_the_draws_of_its_slider(seed: int, batch: int):
    rows = np.full((3, KEPT), -1.5)
    expected = rows.copy()
    fill_rows(rows, np.uint64(seed), np.int64(5), np.int64(batch))
    drawn = np.empty(BATCH)
    deviates.deviates(
        np.uint64(seed),
        np.uint64(disorder.STREAM_COEFFICIENT),
        np.int64(5),
        np.int64(BATCH * batch),
        drawn,
    )
    column = BATCH * (batch % 2)
    expected[1, column : column + BATCH] = drawn
    assert np.array_equal(rows, expected)
