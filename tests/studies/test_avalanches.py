"""Distributions of avalanches, held against counts of the table and samples of known laws."""

from __future__ import annotations

import numpy as np
import pytest

from exactcreep import Chain, Creep, Cycles, InputError, creep
from exactcreep.studies import avalanches
from exactcreep.studies.avalanches import MEASURES, Avalanches

CHAIN = Chain(8, 1000, "0.5", "0.6", "0.01", tan_alpha="0.25")


@pytest.fixture(scope="module")
def run() -> Creep:
    return creep(CHAIN, Cycles("0.003", 40), seed=2, record=("x_G", "slips", "rearrangements"))


def drawn(values: np.ndarray, blocks: int = 16) -> Avalanches:
    """Return numbers as if they were avalanches, in equal blocks one after the other."""
    block = np.arange(values.size) * blocks // values.size
    return Avalanches(block, blocks, values.astype(float))


def test_the_avalanches_of_a_run_are_those_of_whole_cycles_after_its_burn_in(run: Creep) -> None:
    assert run.burn_in % 2 == 0 < run.burn_in
    for measure in MEASURES:
        found = avalanches.avalanches_of(run, measure)
        assert set(found.block.tolist()) == set(range(avalanches.BLOCKS))
        part = avalanches.distribution(found, measure)
        assert (part.density * part.width).sum() == pytest.approx(1, rel=1e-12)
        assert part.zeros == 0
    assert 1 <= found.values.min() <= found.values.max() <= CHAIN.n
    sizes = avalanches.avalanches_of(run, "size").values
    assert sizes.sum() == run.recorded["slips"][run.burn_in :].sum() > 1000


def test_errors_are_the_scatter_of_independent_runs_and_not_smaller_for_copies() -> None:
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
    often = avalanches.distribution(drawn(np.repeat(values, 100)), "energy", edges)
    assert often.error == pytest.approx(part.error, rel=1e-9)


def test_a_picture_of_what_was_not_recorded_or_is_empty_is_refused(run: Creep) -> None:
    bare = creep(CHAIN, Cycles("0.003", 1), record=())
    still = creep(CHAIN, Cycles("0.0001", 4), record=("rearrangements",))
    for plot, of in ((bare.plot.avalanches, "size"), (still.plot.avalanches, "size"),
                     (run.plot.avalanches, "undecided")):  # fmt: skip
        with pytest.raises(InputError):
            plot(of)
