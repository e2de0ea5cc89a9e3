"""A sweep gives the same grid wherever, in whatever order and however often it is computed."""

from __future__ import annotations

import errno
import itertools
import os
import signal
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import (
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
)
from contextlib import contextmanager
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from exactcreep import PhysicsWarning, creep
from exactcreep.model.numbers import InputError
from exactcreep.progress import Progress
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.scene import Scene
from exactcreep.studies import sweep as sweeps
from exactcreep.studies.sweep import finished_cell, sweep
from tests.processes import finished

TEXT = """
[chain]
l0 = 1000
mu_d = 0.5
mu_s = 0.6
sigma_mu = 0.01
tan_alpha = 0.25

[drive]
kind = "cycles"
cycles = {cycles}

[vary]
chain.n = [2, 6]
drive.amplitude = [0.005, 0.01]
run.seed = [1, 2, 3]
"""
SCENE = Scene.from_text(TEXT.format(cycles=10), name="grid")
COUNT = 12


@pytest.fixture(scope="module")
def grid() -> xr.Dataset:
    return sweep(SCENE)


def written(folder: Path, *, cycles: int) -> Path:
    path = folder / "grid.toml"
    path.write_text(TEXT.format(cycles=cycles))
    return path


def cells_in(folder: Path) -> dict[Path, int]:
    """Return the files of the cells in a directory, and when they were written."""
    return {file: file.stat().st_mtime_ns for file in (folder / "cells").glob("*.cell")}


class Backwards(Executor):
    """Computes what it is given last first, when it is asked for a result."""

    def __init__(self) -> None:
        self.waiting: list[tuple[Future, Callable, tuple]] = []

    def submit(self, function, /, *args, **kwargs):
        self.waiting.append((Future(), function, args))
        if len(self.waiting) == COUNT:
            for future, call, given in reversed(self.waiting):
                future.set_result(call(*given))
        return self.waiting[-1][0]


def test_a_cell_is_the_run_of_its_member(grid: xr.Dataset) -> None:
    assert dict(grid.sizes) == {"n": 2, "amplitude": 2, "seed": 3}
    assert not [name for name in grid if str(name).startswith("recorded")]
    for member in SCENE.members():
        own = member.experiment
        run = creep(own.chain, own.drive, seed=own.seed)
        cell = grid.sel(n=own.chain.n, amplitude=float(own.drive.amplitude), seed=own.seed)
        for name in ("velocity", "velocity_error", "x_G", "direction"):
            np.testing.assert_equal(cell[name].item(), getattr(run, name))
        assert int(cell["events"]) == run.event_count
        assert cell["outcome"].item() == run.outcome.value


def test_threads_processes_and_the_order_of_cells_change_no_bit(grid: xr.Dataset) -> None:
    for workers in (1, 3):
        assert sweep(SCENE, workers=workers).identical(grid)
    assert sweep(SCENE, executor=Backwards()).identical(grid)
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as processes:
        assert sweep(SCENE, executor=processes).identical(grid)


def test_what_a_scene_records_is_stacked_along_the_grid() -> None:
    wanted = SCENE.with_settings({"run.record": ["x_G", "slips"]})
    grid = sweep(wanted)
    assert grid["recorded_x_G"].dims == ("n", "amplitude", "seed", "half_cycle")
    experiment = wanted.experiment({"chain.n": 6, "drive.amplitude": "0.005", "run.seed": 2})
    alone = creep(experiment.chain, experiment.drive, seed=2)
    cell = grid.sel(n=6, amplitude=0.005, seed=2)
    assert np.array_equal(cell["recorded_x_G"], alone.recorded["x_G"])
    two = grid["recorded_slips"].sel(n=2)
    assert (two.isel(slider=slice(2, None)) == -1).all()  # there is no third slider
    assert np.array_equal(two.isel(slider=slice(0, 2)).sum(["half_cycle", "slider"]),
                          grid["slips"].sel(n=2))  # fmt: skip
    single = wanted.with_settings({"chain.n": 2, "drive.amplitude": "0.01", "run.seed": 1})
    assert np.array_equal(sweep(single)["recorded_slips"],
                          two.sel(amplitude=0.01, seed=1).isel(slider=slice(0, 2)))  # fmt: skip


def test_a_cell_whose_velocity_is_not_known_says_why() -> None:
    grid = sweep(SCENE.with_settings({"vary.drive.cycles": [1, 100]}))
    unknown = grid["velocity"].isnull() | grid["velocity_error"].isnull()
    assert unknown.sel(cycles=1).all()
    assert not unknown.sel(cycles=100).isel(amplitude=1).any()
    assert ((grid["velocity_reason"] != "") == unknown).all()


def test_cells_that_leave_the_physical_range_are_counted_in_one_warning() -> None:
    wide = SCENE.with_settings({"chain.sigma_mu": "0.3", "drive.amplitude": "0.01"})
    with pytest.warns(PhysicsWarning, match=r"^of 6 cells: draws_below_mu_d in 6 ") as told:
        sweep(wide)
    assert len(told) == 1


def test_progress_counts_cells_and_ends_complete(grid: xr.Dataset) -> None:
    seen: list[Progress] = []
    sweep(SCENE, progress=seen.append)
    assert all(a.done <= b.done for a, b in itertools.pairwise(seen))
    last = seen[-1]
    assert (last.done, last.total, last.found, last.seconds_left) == (COUNT, COUNT, 0, 0)
    assert last.events == int(grid["events"].sum())
    assert last.events_per_second > 0


# --- saved, stopped and resumed ---------------------------------------------------------------


def test_a_folder_holds_the_grid_and_a_resumed_or_larger_sweep_computes_what_is_missing(
    grid: xr.Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sweep(SCENE, out=tmp_path)
    assert xr.load_dataset(tmp_path / "sweep.nc", engine="h5netcdf").identical(grid)
    with pytest.raises(InputError, match="holds the cells of an earlier sweep"):
        sweep(SCENE, out=tmp_path)
    files = sorted(cells_in(tmp_path))
    assert len(files) == COUNT
    for path in files[::3]:
        path.unlink()
    kept, computed = cells_in(tmp_path), []

    def counted(*args):
        computed.append(args[0])
        return finished_cell(*args)

    monkeypatch.setattr(sweeps, "finished_cell", counted)
    assert sweep(SCENE, out=tmp_path, resume=True).identical(grid)
    assert len(computed) == 4
    assert kept.items() <= cells_in(tmp_path).items()
    seen: list[Progress] = []
    larger = SCENE.with_settings({"vary.run.seed": [1, 2, 3, 4]})
    grown = sweep(larger, out=tmp_path, resume=True, progress=seen.append)
    assert (seen[-1].found, len(computed)) == (COUNT, COUNT - 4)
    assert grown.identical(sweep(larger))
    path = files[0]
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(InputError, match=r"truncated.*delete the file to compute it again"):
        sweep(SCENE, out=tmp_path, resume=True)


def test_a_full_disk_loses_no_finished_cell(
    grid: xr.Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real, written_files = os.fsync, []

    def full(handle: int) -> None:
        written_files.append(handle)
        if len(written_files) > 8:
            raise OSError(errno.ENOSPC, "No space left on device")
        real(handle)

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        with pytest.raises(InputError, match="No space left"):
            sweep(SCENE, out=tmp_path)
    saved = list((tmp_path / "cells").iterdir())
    assert 0 < len(saved) < COUNT
    assert all(path.suffix == ".cell" for path in saved)  # no half-written file is left
    assert sweep(SCENE, out=tmp_path, resume=True).identical(grid)


# After the third cell, however fast the machine is
_STOPPED = """
import os, sys
from exactcreep.cli import main
from exactcreep.studies.sweep import CellFolder

number = int(sys.argv.pop(1))
saved = []


def save(folder, experiment, value, honest=CellFolder.save):
    honest(folder, experiment, value)
    saved.append(experiment)
    if len(saved) == 3:
        os.kill(os.getpid(), number)


CellFolder.save = save
main()
"""


@pytest.mark.usefixtures("hears_ctrl_c")
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT])
def test_a_sweep_that_is_killed_goes_on_where_it_was(
    grid: xr.Dataset, tmp_path: Path, number: int
) -> None:
    path, out = written(tmp_path, cycles=10), tmp_path / "out"
    words = ("sweep", str(path), "--workers", "1", "--out", str(out))
    told = finished(sys.executable, "-c", _STOPPED, str(int(number)), *words)
    kept = cells_in(out)
    if number == signal.SIGKILL:
        assert told.returncode == -number
        assert len(kept) == 3
    else:  # the cells that were done by then are kept, too: no more than were given out ahead
        assert told.returncode == 130
        assert 3 <= len(kept) < COUNT
        assert "--resume goes on" in told.stderr
        partial = xr.load_dataset(out / "sweep.nc", engine="h5netcdf")
        assert int(partial["finished"].sum()) == len(kept)
        assert partial["velocity"].isnull().sum() == COUNT - len(kept)
    seen: list[Progress] = []
    resumed = sweep(path, out=out, resume=True, progress=seen.append)
    assert seen[0].found == len(kept)
    assert resumed.identical(grid)
    assert kept.items() <= cells_in(out).items()


# --- what fails -------------------------------------------------------------------------------


class Faulty(ThreadPoolExecutor):
    """An executor on which some cells do not come to their end."""

    def __init__(self, fault: Callable[[Experiment], Any]) -> None:
        super().__init__(1)
        self.fault = fault

    def submit(self, function, /, *args, **kwargs):
        return super().submit(self.fault, *args)


@contextmanager
def refused(fault: Callable[[Experiment], Any], match: str) -> Iterator[Faulty]:
    with Faulty(fault) as executor, pytest.raises(InputError, match=match):
        yield executor


def test_an_error_in_a_cell_names_the_cell() -> None:
    odd = {"chain.sigma_mu": 0, "vary.chain.mu_s": ["0.6", "0.5"], "vary.run.seed": [1]}
    with pytest.raises(InputError, match=r"mu_s .*sliding.*in the cell .*chain.mu_s = 0.5"):
        sweep(SCENE.with_settings(odd))


def test_a_cell_that_always_fails_is_told_and_the_others_are_saved(
    grid: xr.Dataset, tmp_path: Path
) -> None:
    def fault(experiment: Experiment) -> dict[str, object]:
        if (experiment.chain.n, experiment.seed) == (6, 2):
            raise MemoryError("of this worker")
        return finished_cell(experiment)

    said = r"chain.n = 6, drive.amplitude = 0.005, run.seed = 2"
    said += r".*failed: MemoryError: of this worker; 2 of 12 cells"
    for resumed in (False, True):
        with refused(fault, said) as executor:
            sweep(SCENE, executor=executor, out=tmp_path, resume=resumed)
        assert len(cells_in(tmp_path)) == 10
        with xr.open_dataset(tmp_path / "sweep.nc", engine="h5netcdf") as partial:
            assert int(partial["finished"].sum()) == 10
    assert sweep(SCENE, out=tmp_path, resume=True).identical(grid)


def test_a_sweep_all_of_whose_cells_fail_ends_early(tmp_path: Path) -> None:
    tried: list[int] = []

    def fault(experiment: Experiment) -> None:
        tried.append(experiment.seed)
        raise ModuleNotFoundError("No module named 'exactcreep'")

    many = SCENE.with_settings({"vary.run.seed": list(range(60))})
    with refused(fault, "No module named") as executor:
        sweep(many, executor=executor, out=tmp_path)
    assert len(tried) < 240


@pytest.mark.parametrize("error", [CancelledError(), BrokenExecutor("a process was killed")])
def test_an_executor_that_is_lost_ends_the_sweep_in_a_sentence_and_resume_goes_on(
    grid: xr.Dataset, tmp_path: Path, error: Exception
) -> None:
    done: list[int] = []

    def fault(experiment: Experiment) -> dict[str, object]:
        if len(done) == 5:
            raise error
        done.append(experiment.seed)
        return finished_cell(experiment)

    with refused(fault, r"'Faulty': was lost .*resume") as executor:
        sweep(SCENE, executor=executor, out=tmp_path)
    assert len(cells_in(tmp_path)) == 5
    assert sweep(SCENE, out=tmp_path, resume=True).identical(grid)


def test_workers_of_another_version_and_of_an_executor_and_events_are_refused(
    tmp_path: Path,
) -> None:
    other = r"worker = '0.0.9': must run the same version"
    with refused(lambda e: finished_cell(e) | {"version": "0.0.9"}, other) as executor:
        sweep(SCENE, executor=executor, out=tmp_path)
    assert not cells_in(tmp_path)
    with pytest.raises(InputError, match="too many for a sweep"):
        sweep(SCENE.with_settings({"run.record": ["events"]}), out=tmp_path / "refused")
    assert not (tmp_path / "refused").exists()
    with ThreadPoolExecutor(1) as threads, pytest.raises(InputError, match="belongs to the"):
        sweep(SCENE, executor=threads, workers=2)
    with pytest.raises(InputError, match="workers"):
        sweep(SCENE, workers=0)
