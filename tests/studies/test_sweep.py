"""A sweep gives the same grid wherever, in whatever order and however often it is computed."""

from __future__ import annotations

import math
import os
import signal
import statistics
import sys
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor, ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose, assert_equal

from exactcreep import Cycles, Experiment, InputError, Progress, Scene, creep, load_scene, sweep
from exactcreep.quasistatic.checkpoint import Checkpoint
from exactcreep.quasistatic.creep import run_alone
from exactcreep.studies.members import run_members
from exactcreep.watch.limits import Limits
from tests.paper import captions, paper_chain
from tests.processes import PATIENCE, finished

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


def test_a_cell_is_the_run_of_its_member(grid: xr.Dataset) -> None:
    assert dict(grid.sizes) == {"n": 2, "amplitude": 2, "seed": 3}
    assert grid.attrs.items() >= {"l0": "1000", "tan_alpha": "1/4", "cycles": 10}.items()
    for member in SCENE.members():
        own = member.experiment
        run = creep(own.chain, own.drive, seed=own.seed)
        cell = grid.sel(n=own.chain.n, amplitude=float(own.drive.amplitude), seed=own.seed)
        for name in ("velocity", "velocity_error", "x_G", "direction"):
            assert_equal(cell[name].item(), getattr(run, name))
        assert int(cell["events"]) == run.event_count
        assert cell["outcome"].item() == run.outcome.value


def test_a_grid_over_seeds_has_their_mean_and_its_standard_error(grid: xr.Dataset) -> None:
    assert grid.velocity_mean.dims == grid.velocity_mean_error.dims == ("n", "amplitude")
    assert_allclose(grid.velocity_mean, grid.velocity.mean("seed"), rtol=1e-14)
    alone = {"chain.n": 6, "drive.amplitude": "0.005", "drive.cycles": 100}
    few, many = (
        sweep(SCENE.with_settings({**alone, "vary.run.seed": [*range(count)]})) for count in (3, 8)
    )
    own = math.hypot(*few.velocity_error.values.tolist()) / 3
    scatter = statistics.stdev(many.velocity.values.tolist()) / math.sqrt(8)
    assert few.velocity_mean_error.item() == pytest.approx(own, rel=1e-12)
    assert many.velocity_mean_error.item() == pytest.approx(scatter, rel=1e-12)


def test_threads_and_processes_change_no_bit(grid: xr.Dataset) -> None:
    assert sweep(SCENE, workers=1).identical(grid)
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


def test_pairs_of_a_chain_and_a_drive_are_cells_of_their_own(tmp_path: Path) -> None:
    pairs = [(paper_chain(n), Cycles(a, 10)) for n in (2, 3) for a in ("0.005", "0.01")]
    grid = sweep(pairs)
    alone = [creep(*pair).velocity for pair in pairs]
    assert grid.velocity.dims == ("experiment",)
    assert grid.velocity.values.tolist() == alone
    assert {*grid.coords} == {"experiment", "n", "amplitude"}  # what differs
    assert grid.n.values.tolist() == [2, 2, 3, 3]
    assert grid.amplitude.values.tolist() == [0.005, 0.01, 0.005, 0.01]
    sweep(pairs[:2], out=tmp_path)
    assert sweep(pairs[::-1], out=tmp_path, resume=True).velocity.values.tolist() == alone[::-1]
    with pytest.raises(InputError, match=r"scene\[1\] = 3: must be an Experiment, or a pair"):
        sweep([pairs[0], 3])


# --- saved, stopped and resumed ---------------------------------------------------------------


def test_a_folder_holds_the_grid_and_a_resumed_or_larger_sweep_computes_what_is_missing(
    grid: xr.Dataset, tmp_path: Path
) -> None:
    sweep(SCENE, out=tmp_path)
    assert xr.load_dataset(tmp_path / "sweep.nc", engine="h5netcdf").identical(grid)
    with pytest.raises(InputError, match="holds the cells of an earlier sweep"):
        sweep(SCENE, out=tmp_path)
    files = sorted(cells_in(tmp_path))
    assert len(files) == COUNT
    for path in files[::3]:
        path.unlink()
    kept = cells_in(tmp_path)
    assert sweep(SCENE, out=tmp_path, resume=True).identical(grid)
    assert kept.items() <= cells_in(tmp_path).items()
    seen: list[Progress] = []
    larger = SCENE.with_settings({"vary.run.seed": [1, 2, 3, 4]})
    grown = sweep(larger, out=tmp_path, resume=True, progress=seen.append)
    assert (seen[0].done, seen[0].total, seen[0].found) == (COUNT, 16, COUNT)
    assert (seen[-1].done, seen[-1].seconds_left) == (16, 0)
    assert grown.identical(sweep(larger))
    files[0].write_bytes(files[0].read_bytes()[:-1])
    with pytest.raises(InputError, match=r"delete it to compute it again: is truncated"):
        sweep(SCENE, out=tmp_path, resume=True)


def test_a_grid_of_something_else_is_never_overwritten(tmp_path: Path) -> None:
    small = SCENE.with_settings({"chain.n": 2, "drive.amplitude": "0.01"})
    changed = small.with_settings({"chain.tan_alpha": "0.2"})
    sweep(small, out=tmp_path / "other")
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "sweep.nc").write_text("mine")
    for name, said in (("other", "sweep of another scene"), ("mine", "not of this scene")):
        kept = (tmp_path / name / "sweep.nc").read_bytes()
        for resume in (True, False):
            with pytest.raises(InputError, match=said):
                sweep(changed, out=tmp_path / name, resume=resume)
        assert (tmp_path / name / "sweep.nc").read_bytes() == kept


STOPPED = """
import os, sys
from exactcreep import sweep

path, out, number = sys.argv[1:]
stop = lambda told: told.done == 3 and os.kill(os.getpid(), int(number))
sweep(path, out=out, workers=1, progress=stop)
"""
"""A process that is sent a signal after its third cell, however fast the machine is."""


@pytest.mark.usefixtures("hears_ctrl_c")
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT])
def test_a_sweep_that_is_killed_goes_on_where_it_was(
    grid: xr.Dataset, tmp_path: Path, number: int
) -> None:
    path, out = written(tmp_path, cycles=10), tmp_path / "out"
    told = finished(sys.executable, "-c", STOPPED, str(path), str(out), str(int(number)))
    assert told.returncode != 0
    kept = cells_in(out)
    assert 3 <= len(kept) < COUNT  # with those that were given out ahead
    if number == signal.SIGINT:
        partial = xr.load_dataset(out / "sweep.nc", engine="h5netcdf")
        assert int(partial["finished"].sum()) == len(kept)
        assert partial["velocity"].isnull().sum() == COUNT - len(kept)
    assert sweep(path, out=out, resume=True).identical(grid)
    assert kept.items() <= cells_in(out).items()


# --- what fails -------------------------------------------------------------------------------


class Faulty(ThreadPoolExecutor):
    """An executor in which an error ends the cells of six sliders with these seeds."""

    def __init__(self, error: Exception, seeds: set[int]) -> None:
        super().__init__(1)
        self.error, self.seeds = error, seeds

    def submit(self, function, /, experiment, *signals):
        def computed():
            if experiment.chain.n == 6 and experiment.seed in self.seeds:
                raise self.error
            return function(experiment)

        return super().submit(computed)


@pytest.mark.parametrize(
    ("error", "seeds", "said", "cells"),
    [
        (MemoryError("of this worker"), {2},
         r"n = 6, .*amplitude = 0.005, run.seed = 2.*MemoryError.*2 of 12", 10),
        (BrokenExecutor("a process was killed"), {1, 2, 3}, r"'Faulty': was lost .*resume", 6),
    ],
)  # fmt: skip
def test_a_sweep_that_fails_says_where_keeps_its_cells_and_is_resumed(
    error: Exception, seeds: set[int], said: str, cells: int, grid: xr.Dataset, tmp_path: Path
) -> None:
    with Faulty(error, seeds) as executor, pytest.raises(InputError, match=said):
        sweep(SCENE, executor=executor, out=tmp_path)
    assert len(cells_in(tmp_path)) == cells
    if cells == 10:
        partial = xr.load_dataset(tmp_path / "sweep.nc", engine="h5netcdf")
        assert int(partial["finished"].sum()) == cells
    assert sweep(SCENE, out=tmp_path, resume=True).identical(grid)


LENGTHS = ((6, 80, "exact"), (2, 5, "exact"), (3, 40, "sliding"), (4, 9, "exact"))
MEMBERS = [
    Experiment(captions(n), Cycles("0.003", cycles), solver=solver) for n, cycles, solver in LENGTHS
]


def test_members_side_by_side_are_what_each_is_alone_through_a_checkpoint_too(
    tmp_path: Path,
) -> None:
    alone = [run_alone(member) for member in MEMBERS]
    assert run_members(MEMBERS, len(MEMBERS)) == alone
    file = tmp_path / "run.ckpt"
    few = Limits.of(max_events=100)
    part = run_members(MEMBERS, len(MEMBERS), limits=few, checkpoint=Checkpoint(file, 0))
    assert sum(run.half_cycles for run in part) < sum(run.half_cycles for run in alone)
    kept = Checkpoint.read(file)
    assert run_members(kept.experiments, len(MEMBERS), checkpoint=kept) == alone


def test_members_for_which_no_time_is_left_are_not_even_made() -> None:
    made = []

    def members() -> Iterator[Experiment]:
        for seed in range(1000):
            made.append(seed)
            yield Experiment(captions(2), Cycles("0.01", 2), seed=seed)

    assert len(run_members(members(), 1000, limits=Limits.of(max_seconds=0))) == 1
    assert made == [0, 1]


def test_a_killed_worker_of_a_cluster_loses_nothing(tmp_path: Path) -> None:
    dask, distributed = pytest.importorskip("dask"), pytest.importorskip("distributed")
    from exactcreep.studies.dask_cluster import cluster

    scene, killed = load_scene(written(tmp_path, cycles=300)), []
    with (
        dask.config.set({"distributed.worker.multiprocessing-method": "forkserver"}),
        distributed.LocalCluster(2, threads_per_worker=1, dashboard_address=None) as crowd,
        cluster(crowd.scheduler_address, timeout=PATIENCE) as executor,
    ):

        def watch(progress: Progress) -> None:
            if progress.done >= 3 and not killed:
                killed.append(crowd.workers[0].pid)
                os.kill(killed[0], signal.SIGKILL)

        grid = sweep(scene, executor=executor, out=tmp_path / "out", progress=watch)
        assert killed
    assert grid.identical(sweep(scene))
