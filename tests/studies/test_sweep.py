"""A sweep gives the same grid wherever, in whatever order and however often it is computed."""

from __future__ import annotations

import errno
import itertools
import math
import os
import signal
import sys
from collections.abc import Callable
from concurrent.futures import (
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
)
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from exactcreep import PhysicsWarning, creep
from exactcreep.model.numbers import InputError
from exactcreep.progress import Progress
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.scene import Scene, load_scene
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


@pytest.fixture
def scene(tmp_path: Path) -> Scene:
    return load_scene(written(tmp_path, cycles=10))


def written(folder: Path, *, cycles: int) -> Path:
    path = folder / "grid.toml"
    path.write_text(TEXT.format(cycles=cycles))
    return path


class Backwards(Executor):
    """Computes what it is given last first, when it is asked for a result."""

    def __init__(self) -> None:
        self.waiting: list[tuple[Future, object, tuple]] = []

    def submit(self, function, /, *args, **kwargs):
        future: Future = Future()
        self.waiting.append((future, function, args))
        if len(self.waiting) == 12:
            for future_, function_, args_ in reversed(self.waiting):
                future_.set_result(function_(*args_))
        return future


def test_a_cell_is_the_run_of_its_member(scene: Scene) -> None:
    grid = sweep(scene)
    assert dict(grid.sizes) == {"n": 2, "amplitude": 2, "seed": 3}
    for member in scene.members():
        experiment = member.experiment
        alone = creep(experiment.chain, experiment.drive, seed=experiment.seed)
        cell = grid.sel(
            n=experiment.chain.n, amplitude=float(experiment.drive.amplitude), seed=experiment.seed
        )
        assert float(cell["velocity"]) == alone.velocity
        error = float(cell["velocity_error"])
        assert error == alone.velocity_error or (
            math.isnan(error) and math.isnan(alone.velocity_error)
        )
        assert float(cell["x_G"]) == alone.x_G
        assert int(cell["events"]) == alone.event_count
        assert str(cell["outcome"].item()) == alone.outcome.value


def test_threads_and_the_order_of_cells_change_no_bit(scene: Scene) -> None:
    grid = sweep(scene, workers=1)
    assert sweep(scene, workers=3).identical(grid)
    assert sweep(scene, executor=Backwards()).identical(grid)


def test_processes_give_the_same_bits_as_threads(scene: Scene) -> None:
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as processes:
        assert sweep(scene, executor=processes).identical(sweep(scene))


def test_the_file_holds_the_grid_bit_for_bit(scene: Scene, tmp_path: Path) -> None:
    grid = sweep(scene, out=tmp_path / "out")
    loaded = xr.load_dataset(tmp_path / "out" / "sweep.nc", engine="h5netcdf")
    assert loaded.identical(grid)


def test_what_a_scene_records_is_stacked_along_the_grid(scene: Scene) -> None:
    wanted = scene.with_settings({"run.record": ["x_G", "slips"]})
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


def test_nothing_is_recorded_that_the_scene_does_not_ask_for(scene: Scene) -> None:
    assert not [name for name in sweep(scene) if str(name).startswith("recorded")]


def test_a_cell_whose_velocity_is_not_known_says_why(tmp_path: Path) -> None:
    scene = load_scene(written(tmp_path, cycles=3)).with_settings({"vary.drive.cycles": [1, 100]})
    grid = sweep(scene)
    unknown = grid["velocity"].isnull() | grid["velocity_error"].isnull()
    assert unknown.sel(cycles=1).all()
    assert not unknown.sel(cycles=100).isel(amplitude=1).any()
    assert ((grid["velocity_reason"] != "") == unknown).all()


def test_cells_that_leave_the_physical_range_are_counted_in_one_warning(scene: Scene) -> None:
    wide = scene.with_settings({"chain.sigma_mu": "0.3", "drive.amplitude": "0.01"})
    with pytest.warns(PhysicsWarning, match=r"^of 6 cells: draws_below_mu_d in 6 ") as told:
        sweep(wide)
    assert len(told) == 1


def test_progress_counts_cells_and_ends_complete(scene: Scene) -> None:
    seen: list[Progress] = []
    grid = sweep(scene, progress=seen.append)
    assert [a.done <= b.done for a, b in itertools.pairwise(seen)] == [True] * (len(seen) - 1)
    last = seen[-1]
    assert (last.done, last.total, last.found) == (12, 12, 0)
    assert last.events == int(grid["events"].sum())
    assert last.events_per_second > 0
    assert last.seconds_left == 0


def test_a_resumed_sweep_computes_only_what_is_missing(
    scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = sweep(scene, out=tmp_path / "out")
    files = sorted((tmp_path / "out" / "cells").glob("*.cell"))
    assert len(files) == 12
    for path in files[::3]:
        path.unlink()
    kept = {path: path.stat().st_mtime_ns for path in files if path.exists()}
    computed = []

    def counted(*args):
        computed.append(args[0])
        return finished_cell(*args)

    monkeypatch.setattr(sweeps, "finished_cell", counted)
    assert sweep(scene, out=tmp_path / "out", resume=True).identical(whole)
    assert len(computed) == 4
    assert {path: path.stat().st_mtime_ns for path in kept} == kept


def test_a_grid_that_grows_keeps_its_cells(scene: Scene, tmp_path: Path) -> None:
    sweep(scene, out=tmp_path)
    seen: list[Progress] = []
    larger = scene.with_settings({"vary.run.seed": [1, 2, 3, 4]})
    grown = sweep(larger, out=tmp_path, resume=True, progress=seen.append)
    assert seen[-1].found == 12
    assert grown.identical(sweep(larger))


def test_a_full_disk_loses_no_finished_cell(
    scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
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
            sweep(scene, out=tmp_path / "out")
    saved = list((tmp_path / "out" / "cells").iterdir())
    assert 0 < len(saved) < 12
    assert all(path.suffix == ".cell" for path in saved)  # no half-written file is left
    assert sweep(scene, out=tmp_path / "out", resume=True).identical(sweep(scene))


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
def test_a_sweep_that_is_killed_goes_on_where_it_was(tmp_path: Path, number: int) -> None:
    path = written(tmp_path, cycles=10)
    out = tmp_path / "out"
    words = ("sweep", str(path), "--workers", "1", "--out", str(out))
    told = finished(sys.executable, "-c", _STOPPED, str(int(number)), *words)
    kept = {file: file.stat().st_mtime_ns for file in (out / "cells").glob("*.cell")}
    if number == signal.SIGKILL:
        assert told.returncode == -number
        assert len(kept) == 3
    else:  # the cells that were done by then are kept, too: no more than were given out ahead
        assert told.returncode == 130
        assert 3 <= len(kept) < 12
        assert "--resume goes on" in told.stderr
        partial = xr.load_dataset(out / "sweep.nc", engine="h5netcdf")
        assert int(partial["finished"].sum()) == len(kept)
        assert partial["velocity"].isnull().sum() == 12 - len(kept)
    scene = load_scene(path)
    seen: list[Progress] = []
    resumed = sweep(scene, out=out, resume=True, progress=seen.append)
    assert seen[0].found == len(kept)
    assert resumed.identical(sweep(scene))
    assert {file: file.stat().st_mtime_ns for file in kept} == kept


def test_an_error_in_a_cell_names_the_cell(scene: Scene) -> None:
    odd = scene.with_settings(
        {"chain.sigma_mu": 0, "vary.chain.mu_s": ["0.6", "0.5"], "vary.run.seed": [1]}
    )
    with pytest.raises(InputError, match=r"mu_s .*sliding.*in the cell .*chain.mu_s = 0.5"):
        sweep(odd)


class Faulty(ThreadPoolExecutor):
    """An executor on which some cells do not come to their end."""

    def __init__(self, fault: Callable[[Experiment], dict[str, object]]) -> None:
        super().__init__(1)
        self.fault = fault

    def submit(self, function, /, *args, **kwargs):
        return super().submit(self.fault, *args)


def test_a_cell_that_always_fails_is_told_and_the_others_are_saved(
    scene: Scene, tmp_path: Path
) -> None:
    def fault(experiment: Experiment) -> dict[str, object]:
        if (experiment.chain.n, experiment.seed) == (6, 2):
            raise MemoryError("of this worker")
        return finished_cell(experiment)

    for resumed in (False, True):
        with Faulty(fault) as executor, pytest.raises(InputError) as told:
            sweep(scene, executor=executor, out=tmp_path, resume=resumed)
        assert "chain.n = 6, drive.amplitude = 0.005, run.seed = 2" in str(told.value)
        assert "failed: MemoryError: of this worker; 2 of 12 cells" in str(told.value)
        assert len(list((tmp_path / "cells").glob("*.cell"))) == 10
        with xr.open_dataset(tmp_path / "sweep.nc", engine="h5netcdf") as grid:
            assert int(grid["finished"].sum()) == 10
    assert sweep(scene, out=tmp_path, resume=True).identical(sweep(scene))


def test_a_sweep_all_of_whose_cells_fail_ends_early(scene: Scene, tmp_path: Path) -> None:
    tried: list[int] = []

    def fault(experiment: Experiment) -> dict[str, object]:
        tried.append(experiment.seed)
        raise ModuleNotFoundError("No module named 'exactcreep'")

    many = scene.with_settings({"vary.run.seed": list(range(200))})
    with Faulty(fault) as executor, pytest.raises(InputError, match="No module named"):
        sweep(many, executor=executor, out=tmp_path)
    assert len(tried) < 800


@pytest.mark.parametrize("error", [CancelledError(), BrokenExecutor("a process was killed")])
def test_an_executor_that_is_lost_ends_the_sweep_in_a_sentence_and_resume_goes_on(
    scene: Scene, tmp_path: Path, error: Exception
) -> None:
    done: list[int] = []

    def fault(experiment: Experiment) -> dict[str, object]:
        if len(done) == 5:
            raise error
        done.append(experiment.seed)
        return finished_cell(experiment)

    with Faulty(fault) as executor, pytest.raises(InputError, match=r"'Faulty': was lost .*resume"):
        sweep(scene, executor=executor, out=tmp_path)
    assert len(list((tmp_path / "cells").glob("*.cell"))) == 5
    assert sweep(scene, out=tmp_path, resume=True).identical(sweep(scene))


def test_a_worker_of_another_version_is_refused(scene: Scene, tmp_path: Path) -> None:
    with Faulty(lambda e: finished_cell(e) | {"version": "0.0.9"}) as executor, pytest.raises(
        InputError, match=r"worker = '0.0.9': must run the same version"
    ):
        sweep(scene, executor=executor, out=tmp_path)
    assert not list((tmp_path / "cells").glob("*.cell"))


def test_cells_are_not_taken_over_unasked(scene: Scene, tmp_path: Path) -> None:
    sweep(scene, out=tmp_path)
    with pytest.raises(InputError, match="holds the cells of an earlier sweep"):
        sweep(scene, out=tmp_path)


def test_a_damaged_cell_is_refused(scene: Scene, tmp_path: Path) -> None:
    sweep(scene, out=tmp_path)
    path = min((tmp_path / "cells").iterdir())
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(InputError, match=r"truncated.*delete the file to compute it again"):
        sweep(scene, out=tmp_path, resume=True)


def test_events_and_workers_of_an_executor_are_refused(scene: Scene, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="too many for a sweep"):
        sweep(scene.with_settings({"run.record": ["events"]}), out=tmp_path / "refused")
    assert not (tmp_path / "refused").exists()
    with ThreadPoolExecutor(1) as threads, pytest.raises(InputError, match="belongs to the"):
        sweep(scene, executor=threads, workers=2)
    with pytest.raises(InputError, match="workers"):
        sweep(scene, workers=0)
