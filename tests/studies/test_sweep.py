"""A sweep gives the same grid wherever, in whatever order and however often it is computed."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable
from concurrent.futures import (
    BrokenExecutor,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
)
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_equal

from exactcreep import PhysicsWarning, creep
from exactcreep.model.numbers import InputError
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.scene import Scene
from exactcreep.studies import sweep as sweeps
from exactcreep.studies.sweep import finished_cell, sweep
from exactcreep.watch.progress import Progress
from tests.processes import PATIENCE, begun, finished

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
            assert_equal(cell[name].item(), getattr(run, name))
        assert int(cell["events"]) == run.event_count
        assert cell["outcome"].item() == run.outcome.value


def test_threads_processes_and_the_order_of_cells_change_no_bit(grid: xr.Dataset) -> None:
    assert sweep(SCENE, workers=1).identical(grid)
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
    two, none = np.split(grid["recorded_slips"].sel(n=2), [2], axis=-1)
    assert (none == -1).all()  # there is no third slider
    assert np.array_equal(two.sum(["half_cycle", "slider"]), grid["slips"].sel(n=2))
    single = sweep(wanted.with_settings({"chain.n": 2, "drive.amplitude": "0.01", "run.seed": 1}))
    assert np.array_equal(single["recorded_slips"], two.sel(amplitude=0.01, seed=1))


def test_cells_that_leave_the_physical_range_are_counted_in_one_warning() -> None:
    wide = SCENE.with_settings({"chain.sigma_mu": "0.3", "drive.amplitude": "0.01"})
    with pytest.warns(PhysicsWarning, match=r"^of 6 cells: draws_below_mu_d in 6 ") as told:
        sweep(wide)
    assert len(told) == 1


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
    assert [(heard.done, heard.total, heard.found) for heard in seen[:1]] == [(COUNT, 16, COUNT)]
    assert (seen[-1].done, seen[-1].seconds_left, len(computed)) == (16, 0, COUNT - 4)
    assert grown.identical(sweep(larger))
    files[0].write_bytes(files[0].read_bytes()[:-1])
    with pytest.raises(InputError, match=r"delete it to compute it again: is truncated"):
        sweep(SCENE, out=tmp_path, resume=True)


def test_a_folder_knows_its_scene_and_nothing_in_it_is_overwritten_unasked(tmp_path: Path) -> None:
    small = SCENE.with_settings({"chain.n": 2, "drive.amplitude": "0.01"})
    other = small.with_settings({"chain.tan_alpha": "0.2"})
    sweep(small, out=tmp_path)
    grid = (tmp_path / "sweep.nc").read_bytes()
    for resume in (False, True):
        with pytest.raises(InputError, match=r"sweep of another scene than grid; name another"):
            sweep(other, out=tmp_path, resume=resume)
    (tmp_path / "cells" / "scene.json").unlink()
    with pytest.raises(InputError, match=r"sweep.nc that is not of this scene"):
        sweep(other, out=tmp_path, resume=True)
    assert (tmp_path / "sweep.nc").read_bytes() == grid
    taken = tmp_path / "taken"
    taken.mkdir()
    (taken / "sweep.nc").write_text("mine")
    with pytest.raises(InputError, match=r"sweep.nc that is not of this scene"):
        sweep(small, out=taken)
    assert (taken / "sweep.nc").read_text() == "mine"


# Each begins when both are ready, and goes on until the other has been refused
AT_ONCE = """
import sys, time
from pathlib import Path
from exactcreep import cli
from exactcreep.studies.sweep import CellFolder

here, other = Path(sys.argv.pop(1)), Path(sys.argv.pop(1))


def wait(found):
    while not found():
        time.sleep(0.01)


def save(folder, experiment, value, honest=CellFolder.save):
    wait(other.with_suffix(".done").exists)
    honest(folder, experiment, value)


CellFolder.save = save
here.touch()
wait(other.exists)
code = cli.status(sys.argv[1:])
here.with_suffix(".done").touch()
sys.exit(code)
"""


def test_of_two_sweeps_of_different_scenes_at_once_one_is_written_and_the_other_says_so(
    tmp_path: Path,
) -> None:
    out, ready = tmp_path / "out", (tmp_path / "one", tmp_path / "other")
    path = written(tmp_path, cycles=2)
    few = ("--set", "chain.n=2", "--set", "drive.amplitude=0.01", "--workers", "1")
    sweeping = (sys.executable, "-c", AT_ONCE)
    one, other = (
        (str(here), str(there), "sweep", str(path), *few, "--set", f"chain.tan_alpha={tangent}",
         "--out", str(out))
        for tangent, here, there in (("0.25", *ready), ("0.3", *ready[::-1]))
    )  # fmt: skip
    with begun(*sweeping, *one) as process:
        told = finished(*sweeping, *other)
        _, err = process.communicate(timeout=PATIENCE)
    tangents = {process.returncode: "0.25", told.returncode: "0.3"}
    assert set(tangents) == {0, 2}, err + told.stderr
    assert "is being written by process" in (told.stderr if told.returncode else err)
    kept = xr.load_dataset(out / "sweep.nc", engine="h5netcdf")
    assert tangents[0] in kept.attrs["tables"]
    assert kept["finished"].all()


# After the third cell, however fast the machine is
STOPPED = """
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
    told = finished(sys.executable, "-c", STOPPED, str(int(number)), *words)
    kept = cells_in(out)
    assert 3 <= len(kept) < COUNT  # with those that were given out ahead
    if number == signal.SIGINT:
        assert told.returncode == 130
        assert "--resume goes on" in told.stderr
        partial = xr.load_dataset(out / "sweep.nc", engine="h5netcdf")
        assert int(partial["finished"].sum()) == len(kept)
        assert partial["velocity"].isnull().sum() == COUNT - len(kept)
    assert sweep(path, out=out, resume=True).identical(grid)
    assert kept.items() <= cells_in(out).items()


# --- what fails -------------------------------------------------------------------------------


class Faulty(ThreadPoolExecutor):
    """An executor whose cells are computed by a function that may fail."""

    def __init__(self, compute: Callable[[Experiment], Any]) -> None:
        super().__init__(1)
        self.compute = compute

    def submit(self, function, /, *args, **kwargs):
        return super().submit(self.compute, *args)


def refused(folder: Path, compute: Callable[[Experiment], Any], match: str, **given: Any) -> None:
    with Faulty(compute) as executor, pytest.raises(InputError, match=match):
        sweep(SCENE, executor=executor, out=folder, **given)


def test_a_cell_that_always_fails_is_told_and_the_others_are_saved(
    grid: xr.Dataset, tmp_path: Path
) -> None:
    def compute(experiment: Experiment) -> dict[str, object]:
        if (experiment.chain.n, experiment.seed) == (6, 2):
            raise MemoryError("of this worker")
        return finished_cell(experiment)

    said = r"chain.n = 6, drive.amplitude = 0.005, run.seed = 2"
    said += r".*failed: MemoryError: of this worker; 2 of 12 cells"
    for resume in (False, True):
        refused(tmp_path, compute, said, resume=resume)
        assert len(cells_in(tmp_path)) == 10
        partial = xr.load_dataset(tmp_path / "sweep.nc", engine="h5netcdf")
        assert int(partial["finished"].sum()) == 10
    assert sweep(SCENE, out=tmp_path, resume=True).identical(grid)


def test_an_executor_that_is_lost_ends_the_sweep_in_a_sentence_and_resume_goes_on(
    grid: xr.Dataset, tmp_path: Path
) -> None:
    done: list[int] = []

    def compute(experiment: Experiment) -> dict[str, object]:
        if len(done) == 5:
            raise BrokenExecutor("a process was killed")
        done.append(experiment.seed)
        return finished_cell(experiment)

    refused(tmp_path, compute, r"'Faulty': was lost .*resume")
    assert len(cells_in(tmp_path)) == 5
    assert sweep(SCENE, out=tmp_path, resume=True).identical(grid)


def test_workers_of_another_version_and_of_an_executor_and_events_are_refused(
    tmp_path: Path,
) -> None:
    other = r"worker = '0.0.9': must run the same version"
    refused(tmp_path, lambda one: finished_cell(one) | {"version": "0.0.9"}, other)
    assert not cells_in(tmp_path)
    with pytest.raises(InputError, match="too many for a sweep"):
        sweep(SCENE.with_settings({"run.record": ["events"]}), out=tmp_path / "refused")
    assert not (tmp_path / "refused").exists()
    with ThreadPoolExecutor(1) as threads, pytest.raises(InputError, match="belongs to the"):
        sweep(SCENE, executor=threads, workers=2)
    odd = {"chain.sigma_mu": 0, "vary.chain.mu_s": ["0.6", "0.5"], "vary.run.seed": [1]}
    with pytest.raises(InputError, match=r"mu_s .*sliding.*in the cell .*chain.mu_s = 0.5"):
        sweep(SCENE.with_settings(odd))
