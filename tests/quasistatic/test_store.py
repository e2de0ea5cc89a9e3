"""What a run records beyond its memory: kept in files, the same bits, and never lost unsaid."""

from __future__ import annotations

import errno
import os
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from exactcreep import Creep, Cycles, Outcome, creep, resume
from exactcreep.quasistatic import recorder as stores
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.quasistatic.recorder import Recorder
from tests.paper import paper_chain

CHAIN, DRIVE = paper_chain(3), Cycles("0.01", 20)
RECORDED = ("x", "rearrangements")


def assert_same(one: Creep, other: Creep) -> None:
    assert set(one.recorded) == set(other.recorded)
    for name, values in one.recorded.items():
        assert values.dtype == other.recorded[name].dtype
        assert np.array_equal(values, other.recorded[name]), name


def full_after(calls: int) -> Callable[..., None]:
    """Return what allocates on a disk that is full after so many times."""
    left, allocate = [calls], os.posix_fallocate

    def limited(*where: int) -> None:
        left[0] -= 1
        if left[0] < 0:
            raise OSError(errno.ENOSPC, "No space left on device")
        allocate(*where)

    return limited


def test_memory_holds_no_more_than_the_bound_and_a_block() -> None:
    experiment = Experiment.of(CHAIN, DRIVE, record=("x_G", "slips"))
    recorder, block = Recorder(experiment, memory=10**6), np.arange(10_000.0)
    tracemalloc.start()
    for k in range(200):
        recorder.add({"x_G": block + k, "slips": np.full((10_000, 3), k % 100)})
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert recorder.bytes == 200 * 320_000
    assert peak < 1.5 * 10**6
    columns = recorder.columns()
    assert np.array_equal(columns["x_G"], np.concatenate([block + k for k in range(200)]))
    assert np.array_equal(columns["slips"][::10_000, 1], np.arange(200) % 100)
    recorder.add({"x_G": block})
    assert len(recorder.columns()["x_G"]) == 2_010_000
    assert len(columns["x_G"]) == 2_000_000  # what was handed out stays as it is


@pytest.mark.parametrize("solver", ["exact", "certified"])
def test_a_run_beyond_its_memory_has_the_same_bits(solver: str, tmp_path: Path) -> None:
    drive = DRIVE if solver == "exact" else Cycles("0.0012", 1)
    plain = creep(CHAIN, drive, solver=solver, record=RECORDED)
    spilled = creep(CHAIN, drive, solver=solver, record=RECORDED, memory=1000)
    assert_same(plain, spilled)
    kept = [isinstance(run.recorded["rearrangement_theta"], np.memmap) for run in (plain, spilled)]
    assert kept == [False, True]
    if solver == "exact":
        spilled.save(tmp_path / "run.nc")
        assert_same(plain, Creep.load(tmp_path / "run.nc"))


def test_a_run_beyond_its_memory_is_resumed_bit_for_bit(tmp_path: Path) -> None:
    plain, file = creep(CHAIN, DRIVE, record=RECORDED), tmp_path / "run.ckpt"
    part = creep(
        CHAIN, DRIVE, record=RECORDED, memory=1000, checkpoint=file,
        max_events=plain.event_count // 3,
    )  # fmt: skip
    assert part.outcome is Outcome.LIMIT
    assert_same(plain, resume(file, memory=1000))
    assert_same(plain, resume(file))


@pytest.mark.parametrize("calls", [0, 30])
def test_a_disk_that_fills_up_ends_the_run_with_all_rows_so_far(
    calls: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    drive = Cycles("0.01", 400)
    plain = creep(CHAIN, drive, record=RECORDED)
    monkeypatch.setattr(stores.os, "posix_fallocate", full_after(calls))
    part = creep(CHAIN, drive, record=RECORDED, memory=1000)
    assert part.outcome is Outcome.LIMIT
    assert "No space left on device" in part.reason
    assert 0 < part.half_cycles < plain.half_cycles
    for name, values in part.recorded.items():
        assert np.array_equal(values, plain.recorded[name][: len(values)])
    assert len(part.recorded["rearrangement_theta"]) == part.rearrangements
