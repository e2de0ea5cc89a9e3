"""Timings against what a user would pick instead: ``pytest -m benchmark tests/benchmarks``.

What `compare` does not measure stands here: long chains, long runs and the first start. Clocks read
the processor time of the measuring thread, so that other programs on the machine do not count, and
ratios are formed turn by turn.
"""

from __future__ import annotations

import json
import os
import statistics
import tracemalloc
from pathlib import Path

import pytest

from exactcreep.model.drive import Cycles
from exactcreep.quasistatic.creep import creep
from exactcreep.studies.comparison import table
from tests.benchmarks.half_cycles import Exact
from tests.benchmarks.run import AMPLITUDES, contest
from tests.paper import paper_chain
from tests.processes import PROGRAM, finished

FASTER = {2: 15.0, 6: 2.0, 30: 2.0}
"""Than our own Verlet at dt = 0.01: what must not be lost, not what was reached."""
SHORT = ("run", "six-sliders-cycles", "--set", "drive.cycles=2", "--json")


def test_integrators_that_know_nothing_of_us_make_the_certified_events() -> None:
    """Written independently, SciPy (and heyoka) take the same turns to the same places."""
    rows = table(contest(6, seeds=1, events=60))
    for name, row in rows.iterrows():
        if not str(name).startswith("verlet"):
            assert row.parted == 0, name
            assert row.error < 1e-6, name
    assert rows.error["exact"] < 1e-12 < rows.error["scipy"]


@pytest.mark.benchmark
@pytest.mark.parametrize("size", AMPLITUDES)
def test_exact_is_faster_than_everything_else(size: int) -> None:
    rows = table(contest(size, seeds=2, events=200))
    print(rows.to_string())
    assert rows.ratio["verlet, dt = 0.01"] >= FASTER[size]
    assert (rows.ratio[rows.index.str.startswith(("scipy", "heyoka"))] > 20).all()


@pytest.mark.benchmark
def test_an_event_costs_the_same_in_a_chain_a_thousand_times_longer() -> None:
    """At A = 0.005 only the outer twenty sliders at either end ever move, in both chains."""
    short, long = (Exact(n, "0.005", "0.01") for n in (100, 100_000))
    ratios = (long.per_event(20_000) / short.per_event(20_000) for _ in range(9))
    assert statistics.median(ratios) <= 1.5


@pytest.mark.benchmark
def test_a_million_half_cycles_take_no_more_memory_than_ten_thousand() -> None:
    chain, peaks = paper_chain(2), []
    creep(chain, Cycles("0.01", 4), record=())
    for half_cycles in (10**4, 10**6):
        tracemalloc.start()
        creep(chain, Cycles("0.01", half_cycles // 2), record=())
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < min(2**20, peaks[0] + 10**6)


@pytest.mark.benchmark
def test_the_kernel_is_compiled_within_40_s_once(tmp_path: Path) -> None:
    spent = []
    for _ in range(2):
        before = os.times()
        done = finished(*PROGRAM, *SHORT, NUMBA_CACHE_DIR=str(tmp_path))
        after = os.times()
        assert json.loads(done.stdout)["half_cycles"] == 4
        spent.append(sum(after[2:4]) - sum(before[2:4]))  # of children
    assert spent[0] < 40
    assert spent[1] < spent[0] / 3
