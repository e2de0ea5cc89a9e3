"""Sweeps: run every member of a scene as one cell of a labelled grid, on threads or an executor.

With a directory each finished run is saved in a file whose name is the digest of its experiment. So
the same call continues a sweep that was stopped, and a larger grid reuses the runs of a smaller
one. Cells are made shortly before they are computed.
"""

from __future__ import annotations

import json
import math
import os
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, Future
from contextlib import closing, contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from exactcreep import __version__
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Drive
from exactcreep.model.numbers import InputError, exact_number, nearest_float
from exactcreep.model.outcome import Outcome
from exactcreep.model.remarks import warn
from exactcreep.model.user_files import difference, refused
from exactcreep.quasistatic.checkpoint import CheckpointWarning, packed
from exactcreep.quasistatic.creep import PHYSICS, Interrupted, advanced
from exactcreep.quasistatic.creep_result import Creep
from exactcreep.quasistatic.dataset import attribute, content_of_file, fields_of
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.quasistatic.netcdf import netcdf, opened_dataset
from exactcreep.quasistatic.observed_run import ObservedRun
from exactcreep.quasistatic.statistics import mean_over_seeds
from exactcreep.quasistatic.summary import RUN, Place, attribute_of, names
from exactcreep.quasistatic.writing import locked, output_directory, write_file
from exactcreep.scene import Scene, load_scene
from exactcreep.solvers.interface import compile_for
from exactcreep.solvers.tables import HALF_CYCLE_TABLE, LOGS
from exactcreep.studies.pool import in_parallel, reason_of
from exactcreep.watch import interrupts
from exactcreep.watch.display import shows_progress
from exactcreep.watch.limits import NO_LIMITS, Limits
from exactcreep.watch.progress import Hearer, Progress, reporter

FORMAT = "exactcreep sweep 1"
SEED = "run.seed"
_CELL = names(Place.CELL)
_TAKEN = {*_CELL, "half_cycle", "slider", "spring", "warnings", "finished", "file"}
"""Names in a grid that no dimension may have."""
_AHEAD = 256  # values of each key whose members are checked before the first cell is computed
_MOST_FAILURES = 10  # cells that may fail before one succeeds


@shows_progress
def sweep(
    scene: Scene | str | os.PathLike[str] | Sequence[Experiment | tuple[Chain, Drive]],
    *,
    executor: Executor | None = None,
    workers: int | None = None,
    out: str | os.PathLike[str] | None = None,
    force: bool = False,
    progress: Hearer = None,
) -> xr.Dataset:
    """Run every member of a scene and return the results as one labelled grid.

    Parameters
    ----------
    scene : Scene, name of a built-in scene, path, or list
        The table `[vary]` of the scene lists values of its keys, e.g. of ``run.seed``. Each
        combination is a member of the scene, and its run is a cell of the grid. A list of
        experiments, or of pairs of a chain and a drive, is numbered along ``experiment``.
    executor : concurrent.futures.Executor, optional
        Computes the cells: threads, processes, or a cluster, e.g. of dask:
        ``client.get_executor(pure=False)``. It is not shut down.
    workers : int, optional
        Number of threads if there is no executor. Default: one for each processor.
    out : path, optional
        Directory, created if missing, for the run of every finished cell (`Creep.load` reads it),
        and for the grid ``sweep.nc``, which is written at the end or after Ctrl-C. The same call
        goes on: it computes only the missing cells, and a `CheckpointWarning` counts the others.
        Default: nothing is saved.
    force : bool
        Compute the cells in `out` again, and replace the grid of another scene there.
    progress : bool or callable, optional
        A callable is called with a `Progress` about four times a second; else as for `creep`.

    Returns
    -------
    Dataset
        One dimension for each varied key, named by its last part (``chain.n`` is ``n``): velocity,
        velocity_error, x_G, the counts, outcome, direction and evidence of every cell, whether it
        is ``finished``, and the ``file`` of its run in `out`. If ``run.seed`` varies, velocity_mean
        is the mean over the seeds, and velocity_mean_error its standard error: from their scatter
        if there are six or more, else from velocity_error.

        Recorded quantities follow as ``recorded_x_G`` etc. along ``half_cycle``, padded with nan
        (or -1), with ``recorded_theta`` unless the drive is cyclic. The tables of events,
        rearrangements and slips are only in the files in `out`.

    Raises
    ------
    InputError
        If a member is out of range; if `out` is in use, has damaged cells or the grid of another
        scene (the message names the first key that differs); if a worker has another version, the
        executor is lost, or cells fail. With `out` the other cells are finished first.
    Interrupted
        At Ctrl-C: a KeyboardInterrupt that holds the grid so far; finished cells are saved.

    Notes
    -----
    Guarantee: a cell depends only on its experiment: a sweep that was stopped and continued gives
    the same dataset bit for bit, on machines with the same mathematics libraries.

    Examples
    --------
    >>> scene = load_scene("two-sliders-cycles").with_settings({"drive.cycles": 10})
    >>> varied = {"vary.chain.tan_alpha": ["0.1", "0.2"], "vary.run.seed": [1, 2, 3]}
    >>> grid = sweep(scene.with_settings(varied))
    >>> dict(grid.sizes), grid.velocity_mean.dims
    ({'tan_alpha': 2, 'seed': 3}, ('tan_alpha',))

    A list of chains and drives instead of a scene (`plot_sweep` draws a grid):

    >>> sweep([(pair, Cycles(size, 50)) for size in ("0.001", "0.002")]).velocity.round(4).values
    array([0.7761, 1.7463])
    """
    if isinstance(scene, (list, tuple)):
        scene = _Listed(scene)
    elif not isinstance(scene, Scene):
        scene = load_scene(scene)  # type: ignore[arg-type]
    return swept(
        scene, executor=executor, workers=workers, out=out, force=force, progress=progress
    )  # fmt: skip


def swept(
    scene: Scene,
    *,
    executor: Executor | None = None,
    workers: int | None = None,
    out: str | os.PathLike[str] | None = None,
    force: bool = False,
    progress: Hearer = None,
    limits: Limits = NO_LIMITS,
    take: Callable[[int, Creep], object] | None = None,
) -> xr.Dataset:
    """Return the grid of `sweep`. `take` receives the number and the run of each computed cell.

    The `limits` hold in threads: the events for each cell, the time for all. A cell that a limit
    ended is in the grid, but not finished, and not saved. When the time is over no further cell
    begins, but the first always does.
    """
    cells = _Cells(scene, limits, take)
    with _folder(out, scene, force=force) as folder:
        try:
            with interrupts.deferred() as interrupted:
                cells.compute(folder, executor, workers, progress)
                stopped = interrupted()
        finally:
            grid = _assembled(scene, cells.probes, cells.entries)
            if folder is not None:
                write_file(folder.path / "sweep.nc", netcdf({None: grid}), "out")
    if cells.found:
        told = f"{cells.found} of {len(cells.entries)} cells were computed before"
        warn(f"{os.fspath(out or '')} goes on: {told}", CheckpointWarning)
    if cells.warned:
        counts = "; ".join(f"{PHYSICS[name]}, in {count}" for name, count in cells.warned.items())
        warn(f"{counts} of {len(cells.entries)} cells")
    if stopped:
        raise Interrupted(grid)
    return grid


class _Cells:
    """The cells of a sweep: the entries of those that are computed, and the running ones."""

    def __init__(
        self, scene: Scene, limits: Limits, take: Callable[[int, Creep], object] | None
    ) -> None:
        self.scene, self.limits, self.take = scene, limits, take
        self.settings, self.probes = scene.settings(), _probes(scene)
        self.entries: list[dict[str, Any]] = [{} for _ in self.settings]
        self.running: dict[int, Experiment] = {}
        self.heard: dict[Experiment, Progress] = {}  # of the running cells, in threads
        self.failed: dict[int, InputError] = {}
        self.warned = Counter[str]()
        self.done = self.found = self.events = 0
        self.folder: _Folder | None = None

    def compute(
        self, folder: _Folder | None, executor: Executor | None, workers: int | None,
        progress: Hearer,
    ) -> None:  # fmt: skip
        """Compute and save the missing cells; with a folder, errors are raised after all others."""
        self.folder, say = folder, reporter(progress)

        def tell(phase: str = "running") -> None:
            # a copy, made in one step: threads add to what is heard
            now, total = [*self.heard.copy().values()], len(self.entries)
            say(phase, self.done, total, "cells", found=self.found,
                events=self.events + sum(one.events for one in now),
                work=(self.done + sum(one.share for one in now)) / total)  # fmt: skip

        def tasks() -> Iterator[tuple[int, Experiment]]:
            for index, experiment in self._missing():
                if executor is None:  # threads must not compile at the same time
                    compile_for(experiment.algorithm, experiment.chain, experiment.record,
                                partial(tell, "compiling"))  # fmt: skip
                yield index, experiment

        function = self._here if executor is None else partial(computed, version=__version__)
        with closing(in_parallel(function, tasks(), executor, workers)) as ended:
            for one in ended:
                if one is not None:
                    self._keep(*one)
                tell()
        if self.failed:
            first = self.failed[min(self.failed)]
            count = f"{len(self.failed)} of {len(self.entries)} cells failed"
            allowed = f"{first.allowed}; {count}, and all others are computed"
            raise InputError(first.name, first.value, allowed)

    def _missing(self) -> Iterator[tuple[int, Experiment]]:
        """Yield the number and the experiment of each cell that is not in the folder."""
        for index, setting in enumerate(self.settings):
            if index and self.limits.passed():
                return
            try:
                experiment = _experiment(self.scene, setting)
                if (logs := LOGS.keys() & experiment.record) and self.folder is None:
                    allowed = "are too many for a grid; out = DIR keeps them in the files of cells"
                    raise InputError("run.record", ", ".join(sorted(logs)), allowed)
            except InputError as error:
                self._fail(index, error)
                continue
            result = self.folder.load(experiment) if self.folder else None
            if result is None:
                self.running[index] = experiment
                yield index, experiment
            else:
                self.found += 1
                self._enter(index, result)

    def _here(self, experiment: Experiment, stopped: Callable[[], bool]) -> Creep | None:
        """Return the run of a cell, in a thread; None if it was interrupted, or has no time."""
        if experiment is not self.running.get(0) and (stopped() or self.limits.passed()):
            return None
        own = replace(self.limits, interrupted=stopped)

        def hear(progress: Progress) -> None:
            self.heard[experiment] = progress

        result = advanced(ObservedRun(experiment), own, hear)
        return None if stopped() else result

    def _keep(self, index: int, future: Future[Creep | None]) -> None:
        """Take the result of a cell, and save it if it is whole; an error in it names the cell."""
        experiment = self.running.pop(index)
        self.heard.pop(experiment, None)
        try:
            result = future.result()
        except InputError as error:
            self._fail(index, error)
        except KeyboardInterrupt:
            if not interrupts.waiting():  # Ctrl-C reached only a worker process
                raise
        except Exception as error:  # a worker's: it crashed, or had too little memory
            self._fail(index, InputError("cell", index + 1, f"failed: {reason_of(error)}"))
        else:
            if result is not None:
                if self.folder is not None and result.outcome is not Outcome.LIMIT:
                    self.folder.save(result)
                self._enter(index, result)

    def _enter(self, index: int, result: Creep) -> None:
        self.done, self.events = self.done + 1, self.events + result.event_count
        self.entries[index] = _entries(result)
        self.warned.update(result.warnings.keys())
        if self.take is not None:
            self.take(index, result)

    def _fail(self, index: int, error: InputError) -> None:
        """Note an error in a cell; raise it if no other cell could be saved."""
        where = ", ".join(f"{key} = {text}" for key, text in self.settings[index].items())
        allowed = f"{error.allowed} (in the cell {where})" if where else error.allowed
        self.failed[index] = InputError(error.name, error.value, allowed)
        if self.folder is None or (not self.done and len(self.failed) >= _MOST_FAILURES):
            raise self.failed[index] from error


def computed(experiment: Experiment, version: str) -> Creep:
    """Return the run of a cell, in a worker of an executor that has this version of the program."""
    if version != __version__:
        allowed = f"must run the same version as this program, {version}"
        raise InputError("worker", __version__, allowed)
    return advanced(ObservedRun(experiment), NO_LIMITS)


class _Folder(NamedTuple):
    """The directory of a sweep: a file for the run of each cell, and the grid."""

    path: Path
    force: bool

    def load(self, experiment: Experiment) -> Creep | None:
        """Return the saved run of an experiment; None if there is none."""
        path = self.path / file_of(experiment)
        if self.force or not path.exists():
            return None
        with (
            refused("cell", os.fspath(path), "cannot be used; delete it to compute it again"),
            opened_dataset(path, "result") as held,
        ):
            if held.attributes.get("cell") != path.stem:
                raise ValueError("it is not this cell")
            result = Creep(**fields_of(held))
            _entries(result)  # fails if the file is not valid
            for name in dict(result.warnings):
                PHYSICS[name]
        return result

    def save(self, result: Creep) -> None:
        path = self.path / file_of(result.experiment)
        write_file(path, content_of_file(result, cell=path.stem), "out")


@contextmanager
def _folder(
    out: str | os.PathLike[str] | None, scene: Scene, *, force: bool
) -> Iterator[_Folder | None]:
    """Yield the directory of a sweep, locked against other processes, or None.

    Raises `InputError` if it holds a ``sweep.nc`` that is no grid of this scene.
    """
    if out is None:
        yield None
        return
    path, name = output_directory(out, "out"), os.fspath(out)
    if not os.access(path, os.W_OK):
        raise InputError("out", name, "must be a directory that can be written")
    with locked(grid := path / "sweep.nc", "out"):
        if grid.exists() and not force:
            with opened_dataset(grid, "out") as held, refused("out", name, "holds no grid"):
                tables = json.loads(held.attributes["tables"])
                differs = difference(tables, scene.tables, _text)
            if differs:
                allowed = f"holds a sweep of another scene: {differs}; name another directory, or"
                raise InputError("out", name, f"{allowed} begin anew with force")
        output_directory(path / "cells", "out")
        yield _Folder(path, force)


def file_of(experiment: Experiment) -> str:
    """Return the name of the file of a cell within the directory of its sweep."""
    about = {"version": __version__, "experiment": experiment.description()}
    return f"cells/{packed(about)[1][:32]}.nc"


def _entries(result: Creep) -> dict[str, Any]:
    """Return the entries of a cell."""
    experiment = result.experiment
    drive, columns = experiment.drive, experiment.record
    recorded = {name: result.recorded[name] for name in columns if name not in LOGS}
    if recorded and not (drive.cyclic or drive.springs):
        recorded["theta"] = drive.targets(1, result.half_cycles, experiment.seed)
    entries = {name: getattr(result, attribute_of(name)) for name in _CELL}
    cell = {name: getattr(entry, "value", entry) for name, entry in entries.items()}
    decimal = {} if result.velocity_text is None else {"velocity_decimal": result.velocity_text}
    whole = result.outcome is not Outcome.LIMIT
    return cell | decimal | {"recorded": recorded, "finished": whole, "file": file_of(experiment)}


class _Listed(Scene):
    """A list of experiments, as a scene that varies their number."""

    listed: list[Experiment]

    def __init__(self, listed: Sequence[Any]) -> None:
        experiments = []
        for k, one in enumerate(listed):
            if not isinstance(one, Experiment) and not (isinstance(one, tuple) and len(one) == 2):
                allowed = "must be an Experiment, or a pair of a chain and a drive"
                raise InputError(f"scene[{k}]", one, allowed)
            made = one if isinstance(one, Experiment) else Experiment(*one, record=())
            experiments.append(made)
        if not experiments:
            raise InputError("scene", listed, "must hold at least one experiment")
        vary = {"experiment": list(range(len(experiments)))}
        super().__init__("experiments", "", {"run": {}}, vary, Path())
        vars(self).update(listed=experiments)

    def experiment(self, settings: Mapping[str, Any] | None = None) -> Experiment:
        return self.listed[int((settings or {}).get("experiment", 0))]


def _experiment(scene: Scene, setting: Mapping[str, Any]) -> Experiment:
    """Return one member; it records only quantities that the scene names."""
    record = setting.get("run.record", scene.tables["run"].get("record", []))
    return scene.experiment({**setting, "run.record": record})


def _probes(scene: Scene) -> list[Experiment]:
    """Return the members in which one key at a time varies, so that a bad value is found early."""
    if isinstance(scene, _Listed):
        return scene.listed
    first = {key: values[0] for key, values in scene.vary.items()}
    varied = [{key: value} for key, values in scene.vary.items() for value in values[1:_AHEAD]]
    return [_experiment(scene, {**first, **setting}) for setting in ({}, *varied)]


def dimensions(vary: Mapping[str, list[Any]]) -> dict[str, str]:
    """Return the dimension of each varied key: its last part, or the whole key if ambiguous."""
    short = [key.rpartition(".")[2] for key in vary]
    return {
        key: name if short.count(name) == 1 and name not in _TAKEN else key.replace(".", "_")
        for key, name in zip(vary, short, strict=True)
    }


def _coordinate(values: list[Any]) -> NDArray[Any]:
    """Return the values of a varied key, as numbers if all of them are, else as text."""
    try:
        numbers = [exact_number(value, "value") for value in values]
    except InputError:
        return np.array([value if isinstance(value, str) else _text(value) for value in values])
    whole = all(number.denominator == 1 and abs(number) < 2**63 for number in numbers)
    return np.array([int(number) if whole else nearest_float(number) for number in numbers])


def _text(value: Any) -> str:
    return json.dumps(value, default=str)


def _assembled(
    scene: Scene, experiments: list[Experiment], cells: Sequence[Mapping[str, Any]]
) -> xr.Dataset:
    """Return the entries of cells as one dataset; ``finished`` is false for cells not computed.

    A parameter is shared by all cells if the given experiments share it.
    """
    dimension_of = dimensions(scene.vary)
    shape = tuple(len(options) for options in scene.vary.values())
    dims = tuple(dimension_of.values())
    per = " or ".join(dict.fromkeys(experiment.drive.per for experiment in experiments))
    columns: dict[str, tuple[Any, dict[str, str]]] = {}  # value if missing, and attributes
    for name, column in ((name, RUN.fields[name]) for name in _CELL):
        about = {key: text.format(per=per) for key, text in column.attributes.items() if text}
        columns[name] = column.missing, about
    columns["finished"] = False, {"long_name": "the cell has been computed to its end"}
    columns["file"] = "", {"long_name": "the file of its run in the directory of the sweep"}
    if any("velocity_decimal" in cell for cell in cells):
        columns["velocity_decimal"] = "", {}
    variables: dict[str, Any] = {
        name: (dims, np.array([cell.get(name, missing) for cell in cells]).reshape(shape), about)
        for name, (missing, about) in columns.items()
    }
    for name, quantity in HALF_CYCLE_TABLE.columns.items():
        recorded = [cell.get("recorded", {}).get(name) for cell in cells]
        if any(array is not None for array in recorded):
            across = (*dims, HALF_CYCLE_TABLE.dimension, *quantity.across)
            stacked = _stacked(recorded)
            stacked = stacked.reshape(*shape, *stacked.shape[1:])
            variables[f"recorded_{name}"] = (across, stacked, quantity.attributes)
    attributes = {
        "format": FORMAT,
        "version": __version__,
        "scene": scene.name,
        "tables": _text({name: dict(table) for name, table in scene.tables.items()}),
        "vary": _text(dict(scene.vary)),
    }
    coordinates = {name: (name, _coordinate(scene.vary[key])) for key, name in dimension_of.items()}
    grid = xr.Dataset(variables, coordinates, attributes | _shared(experiments))
    if SEED in scene.vary:
        seeds, names = dimension_of[SEED], ("velocity", "velocity_error")
        own = [grid[name].transpose(..., seeds) for name in names]
        mean, error = mean_over_seeds(*(each.values for each in own))
        (*others, _), about = own[0].dims, own[0].attrs
        named = {"long_name": "mean of velocity over the seeds"}
        grid["velocity_mean"] = others, mean, about | named
        named = {"long_name": "standard error of velocity_mean"}
        grid["velocity_mean_error"] = others, error, about | named
    return grid


def _stacked(found: list[NDArray[Any] | None]) -> NDArray[Any]:
    arrays = [array for array in found if array is not None]
    missing = -1 if arrays[0].dtype.kind == "i" else math.nan
    size = np.max([array.shape for array in arrays], axis=0)
    stacked = np.full((len(found), *size), missing, arrays[0].dtype)
    for cell, array in zip(stacked, found, strict=True):
        if array is not None:
            cell[tuple(map(slice, array.shape))] = array
    return stacked


def _shared(experiments: list[Experiment]) -> dict[str, Any]:
    """Return the parameters that all experiments share, as files hold them, without lists."""
    described = []
    for one in experiments:
        drive = one.drive.parameters()
        about = one.chain.parameters() | {"drive": drive.pop("kind"), "solver": one.solver}
        about |= {name: value for name, value in drive.items() if not isinstance(value, list)}
        described.append(about | {"seed": np.uint64(one.seed)})
    return {
        name: attribute(value)
        for name, value in described[0].items()
        if all(other.get(name) == value for other in described)
    }
