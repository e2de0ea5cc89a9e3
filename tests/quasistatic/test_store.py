"""What a run records beyond its memory: kept in files, the same bits, and never lost unsaid."""

from __future__ import annotations

import errno
import io
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from exactcreep import Creep, Cycles, InputError, Outcome, creep, resume
from exactcreep.quasistatic import netcdf as results
from exactcreep.quasistatic import store as stores
from exactcreep.quasistatic.store import Store
from tests.paper import paper_chain

CHAIN, DRIVE = paper_chain(3), Cycles("0.01", 20)
RECORDED = ("x", "rearrangements")


def assert_same(one: Creep, other: Creep) -> None:
    assert set(one.recorded) == set(other.recorded)
    for name, values in one.recorded.items():
        assert values.dtype == other.recorded[name].dtype
        assert np.array_equal(values, other.recorded[name]), name


def full_after(calls: int) -> Callable[[Any, NDArray[Any]], None]:
    """Return an `append` of columns that finds the disk full after so many calls."""
    append, left = stores._Column.append, [calls]

    def appended(column: Any, rows: NDArray[Any]) -> None:
        left[0] -= 1
        if left[0] < 0:
            raise OSError(errno.ENOSPC, "No space left on device")
        append(column, rows)

    return appended


def test_memory_holds_no_more_than_the_bound_and_a_block() -> None:
    store, block = Store(memory=10**6), np.arange(10_000.0)
    tracemalloc.start()
    for k in range(200):
        store.add("a", block + k)
        store.add("b", np.full((10_000, 2), k % 100, dtype=np.int8))
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert store.bytes == 200 * 100_000
    assert peak < 1.3 * 10**6
    arrays = store.arrays()
    assert np.array_equal(arrays["a"], np.concatenate([block + k for k in range(200)]))
    assert arrays["b"].shape == (2_000_000, 2)
    assert np.array_equal(arrays["b"][::10_000, 1], np.arange(200) % 100)
    store.add("a", block)  # what was handed out stays as it is
    assert len(arrays["a"]) == 2_000_000
    assert len(store.arrays()["a"]) == 2_010_000


@pytest.mark.parametrize("solver", ["exact", "certified"])
def test_a_run_beyond_its_memory_has_the_same_bits(solver: str, tmp_path: Path) -> None:
    drive = DRIVE if solver == "exact" else Cycles("0.002", 1)
    plain = creep(CHAIN, drive, solver=solver, record=RECORDED)
    spilled = creep(CHAIN, drive, solver=solver, record=RECORDED, memory=1000)
    assert_same(plain, spilled)
    assert not spilled.recorded["rearrangement_theta"].flags.owndata
    if solver == "exact":
        spilled.save(tmp_path / "run.nc")
        assert_same(plain, Creep.load(tmp_path / "run.nc"))


def test_a_run_beyond_its_memory_is_resumed_bit_for_bit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("exactcreep.quasistatic.checkpoint._LARGE", 1000)
    plain, file = creep(CHAIN, DRIVE, record=RECORDED), tmp_path / "run.ckpt"
    part = creep(
        CHAIN, DRIVE, record=RECORDED, memory=1000, checkpoint=file,
        max_events=plain.event_count // 3,
    )  # fmt: skip
    assert part.outcome is Outcome.LIMIT
    again = resume(file, memory=1000, max_events=plain.event_count // 2)
    assert again.outcome is Outcome.LIMIT
    assert_same(plain, resume(file, memory=1000))
    assert_same(plain, resume(file))


@pytest.mark.parametrize("calls", [0, 1, 50])
def test_a_disk_that_fills_up_ends_the_run_with_all_rows_so_far(
    calls: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain = creep(CHAIN, DRIVE, record=RECORDED)
    monkeypatch.setattr(stores._Column, "append", full_after(calls))
    part = creep(CHAIN, DRIVE, record=RECORDED, memory=1000)
    assert part.outcome is Outcome.LIMIT
    assert "No space left on device" in part.reason
    assert 0 < part.half_cycles < plain.half_cycles
    for name, values in part.recorded.items():
        assert np.array_equal(values, plain.recorded[name][: len(values)])
    assert len(part.recorded["rearrangement_theta"]) == part.rearrangements


def test_a_large_file_is_made_on_the_disk_and_is_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = creep(CHAIN, DRIVE, record=RECORDED)
    run.save(tmp_path / "small.nc")
    monkeypatch.setattr(results, "MEMORY", 1000)
    run.save(tmp_path / "large.nc")
    assert_same(*(Creep.load(tmp_path / name) for name in ("small.nc", "large.nc")))


class Small:
    """A file on a disk with so little room that a write may stop half-way."""

    def __init__(self, file: Any, room: int) -> None:
        self._file, self._room = file, room

    def __getattr__(self, name: str) -> Any:
        return getattr(self._file, name)

    def write(self, data: Any) -> int:
        left = self._room - self._file.tell()
        if left <= 0:
            raise OSError(errno.ENOSPC, "No space left on device")
        return int(self._file.write(data[:left]))


def test_a_block_that_does_not_fit_is_kept_whole_in_memory() -> None:
    store, block = Store(memory=0), np.arange(1000.0)
    store.add("a", block)
    (column,) = store._columns.values()
    column._file = Small(column._file, 8 * 1500)
    for _ in range(2):
        with pytest.raises(OSError, match="No space left"):
            store.add("a", block)
        assert column._file.tell() == 8 * 1000
    assert store.arrays()["a"].tolist() == 3 * block.tolist()


@pytest.mark.parametrize("room", [0, 3000, 50_000])
def test_a_disk_too_full_for_a_large_file_leaves_what_was_there(
    room: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Disk(io.FileIO):
        def write(self, data: Any) -> int:
            left = room - self.tell()
            if left <= 0:
                raise OSError(errno.ENOSPC, "No space left on device")
            return super().write(data[:left])

    class Full(stores.ScratchFile, Disk):
        """A file on a disk with so little room."""

    run = creep(CHAIN, DRIVE, record=RECORDED)
    target = tmp_path / "run.nc"
    target.write_text("precious")
    monkeypatch.setattr(results, "MEMORY", 1000)
    monkeypatch.setattr(results, "ScratchFile", Full)
    with pytest.raises(InputError, match="No space left"):
        run.save(target, force=True)
    assert target.read_text() == "precious"
    assert [path.name for path in tmp_path.iterdir()] == ["run.nc"]
