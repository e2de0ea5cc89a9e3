"""Distributions of avalanches: their bins, errors, and the pictures of them."""

from __future__ import annotations

from collections.abc import Iterator

import matplotlib.pyplot as plt
import numpy as np
import pytest

from exactcreep import Chain, Creep, Cycles, InputError, creep
from exactcreep.studies import avalanches
from exactcreep.studies.avalanches import MEASURES, Avalanches

CHAIN = Chain(8, 1000, "0.5", "0.6", "0.01", tan_alpha="0.25")


@pytest.fixture(scope="module")
def run() -> Creep:
    return creep(CHAIN, Cycles("0.003", 40), seed=2, record=("x_G", "slips", "rearrangements"))


@pytest.fixture(autouse=True)
def _closed() -> Iterator[None]:
    yield
    plt.close("all")


def drawn(values: np.ndarray, blocks: int = 16) -> Avalanches:
    """Return numbers as if they were avalanches, in equal blocks one after the other."""
    block = np.arange(values.size) * blocks // values.size
    return Avalanches(block, blocks, dict.fromkeys(MEASURES, values.astype(float)))


def test_the_avalanches_of_a_run_are_those_of_whole_cycles_after_its_burn_in(run: Creep) -> None:
    found = avalanches.avalanches_of(run)
    slips = run.recorded["slips"][run.burn_in :].sum()
    assert run.burn_in % 2 == 0 < run.burn_in
    assert found.values["size"].sum() == slips > 1000
    assert set(found.block.tolist()) == set(range(avalanches.BLOCKS))
    assert 1 <= found.values["extent"].min() <= found.values["extent"].max() <= CHAIN.n
    for measure in MEASURES:
        part = avalanches.distribution(found, measure)
        assert (part.density * part.width).sum() == pytest.approx(1, rel=1e-12)


def test_bins_of_whole_numbers_know_how_many_they_hold() -> None:
    """Else a flat distribution would look like a comb."""
    values = np.tile(np.arange(1, 101), 32)
    part = avalanches.distribution(drawn(values), "size", avalanches.edges_of("size", 1, 100)[:-1])
    full = part.middle < 70
    assert part.width[0] == 1 < part.width[full][-1]
    assert part.middle[0] == 1
    assert np.ptp(part.density[full]) < 1e-12 * part.density[0]
    assert np.median(part.error) == 0  # all blocks are alike


def test_errors_are_the_scatter_of_independent_runs() -> None:
    """Pareto's law with a density known in every bin, 200 samples of 1600 numbers."""
    edges = 10.0 ** np.arange(0, 1.3, 0.25)
    known = (edges[:-1] ** -1.5 - edges[1:] ** -1.5) / (1 - edges[-1] ** -1.5)
    off = []
    for seed in range(200):
        values = np.random.default_rng(seed).pareto(1.5, 1600) + 1
        part = avalanches.distribution(drawn(values), "energy", edges)
        off.append((part.density * part.width - known) / (part.error * part.width))
    scatter = np.array(off).std(axis=0)
    assert 0.85 < scatter.min() <= scatter.max() < 1.25


def test_blocks_see_what_neighbours_have_in_common() -> None:
    """Each number a hundred times in a row is worth no more than once."""
    values, edges = np.random.default_rng(1).pareto(3.0, 160) + 1, 10.0 ** np.arange(0, 1, 0.2)
    once, often = (
        avalanches.distribution(drawn(known), "energy", edges).error
        for known in (values, np.repeat(values, 100))
    )
    assert (once > 0).any()
    assert often == pytest.approx(once, rel=1e-9)


def test_a_run_draws_its_avalanches_on_axes_that_it_is_given(run: Creep) -> None:
    _, given = plt.subplots()
    assert run.plot.avalanches("extent", ax=given) is given
    part = avalanches.distribution(avalanches.avalanches_of(run), "extent")
    assert (given.lines[-1].get_ydata() == part.density[part.density > 0]).all()
    assert (given.get_xscale(), given.get_yscale()) == ("log", "log")


def test_a_picture_of_what_was_not_recorded_is_refused(run: Creep) -> None:
    bare = creep(CHAIN, Cycles("0.003", 1), record=())
    still = creep(CHAIN, Cycles("0.0001", 4), record=("rearrangements",))
    for call, said in (
        (bare.plot, "was not recorded"),
        (bare.plot.avalanches, "rearrangements"),
        (still.plot.avalanches, "none in a whole cycle after the burn-in"),
        (lambda: run.plot.avalanches("mass"), "must be one of size, duration"),
    ):
        with pytest.raises(InputError, match=said):
            call()
