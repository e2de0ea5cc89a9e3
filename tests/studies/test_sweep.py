"""A sweep gives the same grid wherever, in whatever order and however often it is computed."""

from __future__ import annotations

import math
import os
import signal
import statistics
import sys
from concurrent.futures import BrokenExecutor, ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose, assert_equal

from exactcreep import Creep, Cycles, InputError, Scene, creep, load_scene, sweep
from exactcreep.quasistatic.checkpoint import CheckpointWarning
from exactcreep.results import Progress
from exactcreep.studies.sweep import swept
from exactcreep.watch.limits import Limits
from tests.paper import paper_chain
from tests.processes import finished

pytestmark = pytest.mark.filterwarnings("ignore:.* were computed before")
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
    return {file: file.stat().st_mtime_ns for file in (folder / "cells").glob("*.nc")}


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
    sweep(pairs[:2], out=tmp_path)
    assert sweep(pairs[::-1], out=tmp_path).velocity.values.tolist() == alone[::-1]
    with pytest.raises(InputError, match=r"scene\[1\] = 3: must be an Experiment, or a pair"):
        sweep([pairs[0], 3])


# --- saved, stopped and continued ----------------------------------------------------------------


def test_a_folder_holds_runs_and_grid_and_the_same_call_computes_what_is_missing(
    grid: xr.Dataset, tmp_path: Path
) -> None:
    sweep(SCENE, out=tmp_path)
    assert xr.load_dataset(tmp_path / "sweep.nc", engine="h5netcdf").identical(grid)
    files = sorted(cells_in(tmp_path))
    assert {str(tmp_path / name) for name in grid.file.values.flat} == {*map(str, files)}
    with pytest.raises(InputError, match="whole sweep: read it with xarray"):
        Creep.load(tmp_path / "sweep.nc")
    run = Creep.load(tmp_path / grid.file.sel(n=6, amplitude=0.01, seed=3).item())
    assert (run.chain.n, run.seed) == (6, 3)
    assert run == creep(run.chain, run.drive, seed=3, record=())
    for path in files[::3]:
        path.unlink()
    kept = cells_in(tmp_path)
    with pytest.warns(CheckpointWarning, match="goes on: 8 of 12 cells were computed before"):
        assert sweep(SCENE, out=tmp_path).identical(grid)
    assert kept.items() <= cells_in(tmp_path).items()
    seen: list[Progress] = []
    larger = SCENE.with_settings({"vary.run.seed": [1, 2, 3, 4]})
    grown = sweep(larger, out=tmp_path, progress=seen.append)
    assert (seen[-1].done, seen[-1].total, seen[-1].found) == (16, 16, COUNT)
    assert seen[-1].seconds_left == 0
    assert grown.identical(sweep(larger))
    anew = cells_in(tmp_path)
    assert sweep(SCENE, out=tmp_path, force=True).identical(grid)
    assert not {anew[path] for path in files} & {cells_in(tmp_path)[path] for path in files}
    files[0].write_bytes(files[0].read_bytes()[:-1])
    with pytest.raises(InputError, match=r"delete it to compute it again: .* does not end with"):
        sweep(SCENE, out=tmp_path)
    files[0].write_bytes(files[1].read_bytes())
    with pytest.raises(InputError, match=r"delete it to compute it again: .*it is not this cell"):
        sweep(SCENE, out=tmp_path)


def test_a_grid_of_something_else_is_never_overwritten_without_force(tmp_path: Path) -> None:
    small = SCENE.with_settings({"chain.n": 2, "drive.amplitude": "0.01"})
    changed = small.with_settings({"chain.tan_alpha": "0.2"})
    sweep(small, out=tmp_path / "other")
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "sweep.nc").write_text("mine")
    there = r"another scene: chain.tan_alpha is '0.25' there, and '0.2' here"
    for name, said in (("other", there), ("mine", "checksum")):
        kept = (tmp_path / name / "sweep.nc").read_bytes()
        with pytest.raises(InputError, match=said):
            sweep(changed, out=tmp_path / name)
        assert (tmp_path / name / "sweep.nc").read_bytes() == kept
        assert sweep(changed, out=tmp_path / name, force=True).attrs["tan_alpha"] == "1/5"


def test_tables_of_events_are_in_the_files_of_cells_alone(tmp_path: Path) -> None:
    wanted = SCENE.with_settings({"run.record": ["x_G", "events"], "vary.chain.n": [2]})
    with pytest.raises(
        InputError, match=r"'events': are too many for a grid; out = DIR keeps them"
    ):
        sweep(wanted)
    grid = sweep(wanted, out=tmp_path)
    assert "recorded_x_G" in grid
    name = grid.file.sel(amplitude=0.005, seed=2).item()
    assert Creep.load(tmp_path / name).to_pandas("events").shape[0] == grid.events.sel(
        amplitude=0.005, seed=2
    )


STOPPED = """
import os, signal, sys
from exactcreep import sweep

path, out = sys.argv[1:]
stop = lambda told: told.done == 3 and os.kill(os.getpid(), signal.SIGINT)
sweep(path, out=out, workers=1, progress=stop)
"""
"""A process in which Ctrl-C is pressed after its third cell, however fast the machine is."""


@pytest.mark.usefixtures("hears_ctrl_c")
def test_a_sweep_that_is_interrupted_saves_its_grid_and_goes_on_where_it_was(
    grid: xr.Dataset, tmp_path: Path
) -> None:
    path, out = written(tmp_path, cycles=10), tmp_path / "out"
    assert finished(sys.executable, "-c", STOPPED, str(path), str(out)).returncode != 0
    kept = cells_in(out)
    assert 3 <= len(kept) < COUNT  # with those that were given out ahead
    partial = xr.load_dataset(out / "sweep.nc", engine="h5netcdf")
    assert int(partial["finished"].sum()) == len(kept)
    assert partial["velocity"].isnull().sum() == COUNT - len(kept)
    assert sweep(path, out=out).identical(grid)
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
         r"MemoryError.*chain.n = 6, .*amplitude = 0.005, run.seed = 2\); 2 of 12", 10),
        (BrokenExecutor("a process was killed"), {1, 2, 3}, r"'Faulty': was lost .* same call", 6),
    ],
)  # fmt: skip
def test_a_sweep_that_fails_says_where_keeps_its_cells_and_goes_on(
    error: Exception, seeds: set[int], said: str, cells: int, grid: xr.Dataset, tmp_path: Path
) -> None:
    with Faulty(error, seeds) as executor, pytest.raises(InputError, match=said):
        sweep(SCENE, executor=executor, out=tmp_path)
    assert len(cells_in(tmp_path)) == cells
    if cells == 10:
        partial = xr.load_dataset(tmp_path / "sweep.nc", engine="h5netcdf")
        assert int(partial["finished"].sum()) == cells
    assert sweep(SCENE, out=tmp_path).identical(grid)


def test_limits_reach_the_cells_and_what_they_end_is_computed_again(
    grid: xr.Dataset, tmp_path: Path
) -> None:
    least, most = (int(getattr(grid.events, name)()) for name in ("min", "max"))
    part = swept(SCENE, out=tmp_path, limits=Limits.of(max_events=(least + most) // 2))
    ended = part.outcome == "limit"
    assert 0 < ended.sum() < COUNT
    assert (part.finished == ~ended).all()
    assert (part.events <= (least + most) // 2 + 10).all()
    assert len(cells_in(tmp_path)) == (~ended).sum()
    assert sweep(SCENE, out=tmp_path).identical(grid)


def test_cells_for_which_no_time_is_left_are_not_even_made(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made, known = [], Scene.experiment
    monkeypatch.setattr(Scene, "experiment", lambda *given: made.append(1) or known(*given))
    many = SCENE.with_settings({"vary.run.seed": [*range(10**5)]})
    part = swept(many, limits=Limits.of(max_seconds=0))
    assert part.outcome.size == 4 * 10**5
    assert (part.outcome != "").sum() == 1
    assert len(made) < 300


@pytest.mark.slow
def test_a_killed_worker_of_a_cluster_loses_nothing(tmp_path: Path) -> None:
    dask, distributed = pytest.importorskip("dask"), pytest.importorskip("distributed")
    scene, killed = load_scene(written(tmp_path, cycles=300)), []
    with (
        dask.config.set({"distributed.worker.multiprocessing-method": "forkserver"}),
        distributed.LocalCluster(2, threads_per_worker=1, dashboard_address=None) as crowd,
        distributed.Client(crowd) as client,
    ):

        def watch(progress: Progress) -> None:
            if progress.done >= 3 and not killed:
                killed.append(crowd.workers[0].pid)
                os.kill(killed[0], signal.SIGKILL)

        executor = client.get_executor(pure=False)
        grid = sweep(scene, executor=executor, out=tmp_path / "out", progress=watch)
        assert killed
    assert grid.identical(sweep(scene))
