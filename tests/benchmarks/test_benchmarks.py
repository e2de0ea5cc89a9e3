"""Timings against what a user would pick instead: ``pytest -m benchmark tests/benchmarks``."""

from __future__ import annotations

import pytest
import xarray as xr

from exactcreep.studies.comparison import table
from tests.benchmarks.measurements import (
    long_chain_ratio,
    long_run_memory,
    start_up_seconds,
    thread_speed_ups,
)
from tests.benchmarks.run import AMPLITUDES, contest

FASTER = {2: 15.0, 6: 2.0, 30: 2.0}
"""Than our own Verlet at dt = 0.01: what must not be lost, not what was reached."""


@pytest.fixture(scope="module", params=AMPLITUDES)
def data(request: pytest.FixtureRequest) -> xr.Dataset:
    return contest(request.param, seeds=2, events=200)


def test_integrators_that_know_nothing_of_us_make_the_certified_events() -> None:
    """Written independently, SciPy (and heyoka) take the same turns to the same places."""
    rows = table(contest(6, seeds=1, events=60))
    for name, row in rows.iterrows():
        if not str(name).startswith("verlet"):
            assert row.parted == 0, name
            assert row.error < 1e-6, name
    assert rows.error["exact"] < 1e-12 < rows.error["scipy"]


@pytest.mark.benchmark
def test_exact_is_faster_than_everything_else(
    data: xr.Dataset, request: pytest.FixtureRequest
) -> None:
    rows = table(data)
    print(rows.to_string())
    size = request.node.callspec.params["data"]
    assert rows.ratio["verlet, dt = 0.01"] >= FASTER[size]
    for name in rows.index:
        if str(name).startswith(("scipy", "heyoka")):
            assert rows.ratio[name] > 20, name


@pytest.mark.benchmark
def test_an_event_costs_the_same_in_a_chain_a_thousand_times_longer() -> None:
    assert long_chain_ratio(turns=9, half_cycles=40) <= 1.5


@pytest.mark.benchmark
def test_two_threads_are_worth_as_much_as_to_a_loop_that_only_counts() -> None:
    exact, spin, ratio = thread_speed_ups(turns=15, half_cycles=400)
    print(f"speed-up {exact:.2f}, of a spinning loop {spin:.2f}")
    assert ratio >= 0.9


@pytest.mark.benchmark
def test_a_million_half_cycles_take_no_more_memory_than_ten_thousand() -> None:
    took, peak, _ = long_run_memory(10**6)
    _, shorter, _ = long_run_memory(10**4)
    print(f"{took:.2f} s, {peak} bytes; 10^4: {shorter} bytes")
    assert peak < min(2**20, shorter + 10**6)


@pytest.mark.benchmark
def test_the_kernel_is_compiled_within_40_s_once() -> None:
    first, second = start_up_seconds()
    print(f"{first:.1f} s of processor time with compilation, {second:.1f} s afterwards")
    assert first < 40
    assert second < first / 3
