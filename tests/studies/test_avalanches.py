"""Distributions of avalanches: their bins, errors, and the pictures of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
import pytest

from exactcreep import Chain, Creep, Cycles, InputError, creep
from exactcreep.solvers.tables import REARRANGEMENT_TABLE
from exactcreep.studies import avalanches
from exactcreep.studies.avalanches import MEASURES, Avalanches
from tests.pictures import assert_shows_data

CHAIN = Chain(8, 1000, "0.5", "0.6", "0.01", tan_alpha="0.25")


@pytest.fixture(scope="module")
def run() -> Creep:
    return creep(CHAIN, Cycles("0.003", 40), seed=2, record=("x_G", "slips", "rearrangements"))


ZERO = {"undecided", "end_forces"}
"""Measures that are zero of all avalanches of this run."""


@pytest.fixture(autouse=True)
def _closed() -> Iterator[None]:
    yield
    plt.close("all")


def drawn(values: np.ndarray, blocks: int = 16) -> Avalanches:
    """Return numbers as if they were avalanches, in equal blocks one after the other."""
    block = np.arange(values.size) * blocks // values.size
    return Avalanches(block, blocks, dict.fromkeys(MEASURES, values.astype(float)))


def test_the_avalanches_of_a_run_are_those_of_whole_cycles_after_its_burn_in(run: Creep) -> None:
    found = avalanches.avalanches_of(run, MEASURES)
    slips = run.recorded["slips"][run.burn_in :].sum()
    assert run.burn_in % 2 == 0 < run.burn_in
    assert found.values["size"].sum() == slips > 1000
    assert set(found.block.tolist()) == set(range(avalanches.BLOCKS))
    assert 1 <= found.values["extent"].min() <= found.values["extent"].max() <= CHAIN.n
    assert (found.values["undecided"] == 0).all()
    for measure in MEASURES.keys() - ZERO:
        part = avalanches.distribution(found, measure)
        assert (part.density * part.width).sum() == pytest.approx(1, rel=1e-12)
        assert part.zeros == 0


@pytest.mark.parametrize("name", [name for name in REARRANGEMENT_TABLE.fields if name not in ZERO])
def test_any_column_of_the_table_is_drawn_as_it_is_distributed(run: Creep, name: str) -> None:
    values = run.to_pandas("rearrangements").query(f"half_cycle > {run.burn_in}")[name]
    axes = run.plot.avalanches(name)
    assert_shows_data(axes.figure)
    x, density = axes.containers[0].lines[0].get_data()
    edges = avalanches.edges_of(name, values.min(), values.max())
    shares, _ = np.histogram(values, edges, density=True)
    assert density == pytest.approx(shares[shares > 0])
    within = np.transpose([edges[:-1], edges[1:]])[shares > 0]
    assert ((within[:, 0] < x) & (x < within[:, 1])).all()
    if name in ("direction", "first"):  # few whole numbers, each in a bin of its own
        assert x.tolist() == sorted(set(values))
    places = ("half_cycle", "began_first", "began_last", "first", "last")
    linear = (values < 0).any() or name in places
    assert axes.get_xscale() == ("linear" if linear else "log")


def test_values_of_zero_are_counted_where_they_cannot_be_drawn(run: Creep) -> None:
    counted = run.recorded["rearrangement_undecided"].copy()
    with pytest.raises(InputError, match="'undecided': is zero of all 4704 avalanches"):
        run.plot.avalanches("undecided")
    counted[-3:] = 1, 2, 2
    rare = replace(run, recorded={**run.recorded, "rearrangement_undecided": counted})
    axes = rare.plot.avalanches("rearrangement_undecided")
    assert axes.get_ylabel() == "density of undecided, without 4701 of 0"
    assert axes.containers[0].lines[0].get_ydata() == pytest.approx([1 / 3, 2 / 3])


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
