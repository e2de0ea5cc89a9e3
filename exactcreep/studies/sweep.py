"""Sweeps: run every member of a scene as one cell of a labelled grid, on threads or many machines.

Each finished cell is saved at once in a small file whose name is the digest of its experiment. So a
sweep that was stopped can continue, and a larger grid reuses the cells of a smaller one.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from contextlib import contextmanager, suppress
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from exactcreep import __version__
from exactcreep.model.chain import Chain
from exactcreep.model.drive import Drive
from exactcreep.model.numbers import InputError, exact_number, nearest_float
from exactcreep.model.remarks import warn
from exactcreep.model.user_files import content_of, refused
from exactcreep.quasistatic import checkpoint
from exactcreep.quasistatic.checkpoint import MOST_BYTES
from exactcreep.quasistatic.creep import PHYSICS, run_alone
from exactcreep.quasistatic.dataset import attribute
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.quasistatic.netcdf import netcdf, opened_groups
from exactcreep.quasistatic.recorder import Recorder
from exactcreep.quasistatic.statistics import mean_over_seeds
from exactcreep.quasistatic.summary import RUN, TYPES, Place, attribute_of, names
from exactcreep.quasistatic.writing import locked, output_directory, write_file
from exactcreep.scene import Scene, load_scene
from exactcreep.solvers.interface import require_like
from exactcreep.solvers.tables import HALF_CYCLE_TABLE, LOGS
from exactcreep.studies.pool import Pool, Signals, pool_of, reason_of
from exactcreep.watch import interrupts
from exactcreep.watch.display import shows_progress
from exactcreep.watch.progress import Hearer, Progress, reporter

FORMAT = "exactcreep sweep 1"
SEED = "run.seed"
_CELL_FORMAT = "exactcreep cell 1"
_CELL = names(Place.CELL)
_TAKEN = {*_CELL, "half_cycle", "slider", "spring", "warnings"}
"""Names in a grid that no dimension may have."""
_BETWEEN = 1000  # experiments that are made before they are counted anew
_MOST_FAILURES = 10  # cells that may fail before one succeeds
Cell = dict[str, Any]


@shows_progress
def sweep(
    scene: Scene | str | os.PathLike[str] | Sequence[Experiment | tuple[Chain, Drive]],
    *,
    executor: Executor | None = None,
    workers: int | None = None,
    out: str | os.PathLike[str] | None = None,
    resume: bool = False,
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
        Computes the cells: threads, processes, or a cluster (see
        `exactcreep.studies.dask_cluster`). It is not shut down.
    workers : int, optional
        Number of threads if there is no executor. Default: one for each processor.
    out : path, optional
        Directory, created if missing, for every finished cell, and for the grid ``sweep.nc``, which
        is written at the end or after Ctrl-C. Default: nothing is saved.
    resume : bool
        Reuse the cells in `out` instead of computing them again.
    progress : bool or callable, optional
        A callable is called with a `Progress` about four times a second; else as for `creep`.

    Returns
    -------
    Dataset
        One dimension for each varied key, named by its last part (``chain.n`` is ``n``): velocity,
        velocity_error, x_G, the counts, outcome, direction and evidence of every cell. If
        ``run.seed`` varies, velocity_mean is the mean over the seeds, and velocity_mean_error its
        standard error: from their scatter if there are six or more, else from velocity_error.

        Recorded quantities follow as ``recorded_x_G`` etc. along ``half_cycle``, padded with nan
        (or -1), with ``recorded_theta`` unless the drive is cyclic.

    Raises
    ------
    InputError
        If a member is out of range; if `out` is in use, has damaged cells or files of another
        scene, or has cells and ``resume`` is false; if a worker has another version, the executor
        is lost, or cells fail. With `out` the other cells are finished first.
    KeyboardInterrupt
        After Ctrl-C; finished cells are saved.

    Notes
    -----
    Guarantee: a cell depends only on its experiment: a sweep that was stopped and resumed gives the
    same dataset bit for bit, on machines with the same mathematics libraries.

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
    cells = _Cells(scene, progress)
    with cell_folder(out, scene, resume=resume) as folder:
        cells.keep_in(folder)
        try:
            with pool_of(executor, workers) as pool:
                cells.compute(pool, progress)
        except (KeyboardInterrupt, CellsFailed):
            cells.finished()
            raise
        dataset = cells.finished()
    if left := Counter(name for value in cells.values if value for name in value["warnings"]):
        counts = "; ".join(f"{PHYSICS[name]}, in {count}" for name, count in left.items())
        warn(f"{counts} of {len(cells.values)} cells")
    return dataset


class _Listed(Scene):
    """A list of experiments, as a scene that varies their number."""

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
        vars(self)["listed"] = experiments

    def experiment(self, settings: Mapping[str, Any] | None = None) -> Experiment:
        listed: list[Experiment] = vars(self)["listed"]
        return listed[int((settings or {}).get("experiment", 0))]


class CellsFailed(InputError):
    """Some cells failed; all others have been computed and saved."""


class _Cells:
    """The cells of a sweep: the experiment of each, and its result or None."""

    def __init__(self, scene: Scene, progress: Hearer) -> None:
        self.scene, self.settings = scene, scene.settings()
        self.experiments = list[Experiment]()
        say, total = reporter(progress), len(self.settings)
        for made, setting in enumerate(self.settings):
            if made and made % _BETWEEN == 0:
                say("preparing", made, total, "cells", text="prepared")
            self.experiments.append(_experiment(scene, setting))
        self.values: list[Cell | None] = [None] * len(self.experiments)
        self.folder: CellFolder | None = None

    def keep_in(self, folder: CellFolder | None) -> None:
        """Read the cells in a folder, and save all others there."""
        self.folder = folder
        if folder is not None:
            self.values = [folder.load(experiment) for experiment in self.experiments]

    def compute(self, pool: Pool, progress: Hearer) -> None:
        """Compute and save the missing cells; with a folder, errors are raised after all others."""
        todo = {k: self.experiments[k] for k, value in enumerate(self.values) if value is None}
        # each slider costs about the same in every half-cycle
        weights = {k: member.drive.half_cycles * member.chain.n for k, member in todo.items()}
        say, total, whole = reporter(progress), len(self.values), sum(weights.values())
        loaded, failed = total - len(todo), dict[int, CellsFailed]()
        made = events = worked = 0

        def tell() -> None:
            compiling = pool.signals is not None and pool.signals.compiling
            say("compiling" if compiling else "running", loaded + made, total, "cells",
                events=events, found=loaded, work=worked / whole if whole else 1.0)  # fmt: skip

        tell()
        with interrupts.deferred() as interrupted:
            for ended in pool.completed(finished_cell, todo.items()):
                if ended is not None:
                    index, future = ended
                    try:
                        cell = self._value(pool, future, index)
                    except CellsFailed as error:
                        failed[index] = error
                        hopeless = not loaded + made and len(failed) >= _MOST_FAILURES
                        if self.folder is None or hopeless:
                            raise
                    except KeyboardInterrupt:
                        if not interrupted():  # Ctrl-C reached only a worker process
                            raise
                    else:
                        self.keep(index, cell)
                        made, events = made + 1, events + cell["events"]
                        worked += weights[index]
                tell()
            if interrupted():
                raise KeyboardInterrupt
        if failed:
            first = failed[min(failed)]
            count = f"{len(failed)} of {total} cells failed, and all others are computed"
            raise CellsFailed(first.field, first.value, f"{first.allowed}; {count}")

    def keep(self, index: int, cell: Cell) -> None:
        """Store the result of a cell, and save it if there is a folder."""
        if self.folder is not None:
            self.folder.save(self.experiments[index], cell)
        self.values[index] = cell

    def _value(self, pool: Pool, future: Future[Cell], index: int) -> Cell:
        """Return the result of a cell; an error in it names the cell."""
        where = ", ".join(f"{key} = {text}" for key, text in self.settings[index].items())
        try:
            value = future.result()
        except InputError as error:
            allowed = f"{error.allowed} (in the cell {where})" if where else error.allowed
            raise CellsFailed(error.field, error.value, allowed) from None
        except (CancelledError, BrokenExecutor) as error:
            raise pool.lost(error) from None
        except Exception as error:  # a worker's: it crashed, or had too little memory
            raise CellsFailed("cell", where, f"failed: {reason_of(error)}") from error
        if value["version"] != __version__:
            allowed = f"must run the same version as this program, {__version__}"
            raise InputError("worker", value["version"], allowed)
        return value

    def finished(self) -> xr.Dataset:
        """Return the grid of the computed cells, and save it if there is a folder."""
        dataset = _assembled(self.scene, self.experiments, self.values)
        if self.folder is not None:
            self.folder.write(dataset)
        return dataset


def finished_cell(experiment: Experiment, signals: Signals | None = None) -> Cell:
    """Return the cell of one experiment; `signals` belong to a sweep in the same process."""

    def glance(progress: Progress) -> None:
        if signals is not None:
            signals.compiling = progress.phase == "compiling"
            if signals.stop:
                raise KeyboardInterrupt

    if signals is not None and signals.stop:
        raise KeyboardInterrupt
    result = run_alone(experiment, progress=glance)
    recorded = {name: result.recorded[name] for name in experiment.record}
    drive = experiment.drive
    if experiment.record and not (drive.cyclic or drive.springs):
        recorded["theta"] = drive.targets(1, result.half_cycles, experiment.seed)
    value: Cell = {"version": __version__, "warnings": dict(result.warnings), "recorded": recorded}
    entries = {name: getattr(result, attribute_of(name)) for name in _CELL}
    value |= {name: getattr(entry, "value", entry) for name, entry in entries.items()}
    if result.velocity_text is not None:
        value["velocity_decimal"] = result.velocity_text
    return value


@contextmanager
def cell_folder(
    out: str | os.PathLike[str] | None, scene: Scene, *, resume: bool
) -> Iterator[CellFolder | None]:
    """Yield the directory of a sweep, locked against other processes, or None."""
    if out is None:
        yield None
        return
    path = output_directory(out, "out")
    if not os.access(path, os.W_OK):
        raise InputError("out", os.fspath(out), "must be a directory that can be written")
    with locked(path / "sweep.nc", "out"):
        yield CellFolder(path, scene, resume=resume)


class CellFolder:
    """The directory of a sweep: one file for each cell, the grid, and the settings of its scene."""

    def __init__(self, path: Path, scene: Scene, *, resume: bool) -> None:
        self.path, self.cells, self.grid = path, path / "cells", path / "sweep.nc"
        self.tables = _tables(scene)
        of_another = f"holds a sweep of another scene than {scene.name}; name another directory"
        known = self.cells / "scene.json"
        if known.exists() and content_of(known, "out", MOST_BYTES) != self.tables.encode():
            raise InputError("out", os.fspath(path), of_another)
        if not resume and self.cells.is_dir() and any(self.cells.glob("*.cell")):
            allowed = "holds the cells of an earlier sweep; resume it, or name another"
            raise InputError("out", os.fspath(path), allowed)
        self._require_own_grid()
        output_directory(self.cells, "out")
        write_file(known, self.tables.encode(), "out")

    def _require_own_grid(self) -> None:
        """Raise `InputError` if there is a ``sweep.nc`` that is no grid of this scene."""
        if not self.grid.exists():
            return
        about: Mapping[str, Any] = {}
        with suppress(InputError), opened_groups(self.grid, "out") as groups:
            about = groups[None].attributes
        if (about.get("format"), about.get("tables")) != (FORMAT, self.tables):
            allowed = "holds a sweep.nc that is not of this scene; name another directory"
            raise InputError("out", os.fspath(self.path), allowed)

    def write(self, dataset: xr.Dataset) -> None:
        """Write the grid; replace an earlier grid of this scene, but no other file."""
        self._require_own_grid()
        write_file(self.grid, netcdf({None: dataset}), "out")

    def load(self, experiment: Experiment) -> Cell | None:
        name = _digest(experiment)
        path = self.cells / f"{name}.cell"
        if not path.exists():
            return None
        with refused("cell", os.fspath(path), "cannot be used; delete it to compute it again"):
            content = checkpoint.read(path)
            if (content["format"], content["name"]) != (_CELL_FORMAT, name):
                raise ValueError("it is not this cell")
            return _cell(experiment, content["value"])

    def save(self, experiment: Experiment, value: Cell) -> None:
        name = _digest(experiment)
        content = {"format": _CELL_FORMAT, "name": name, "value": value}
        write_file(self.cells / f"{name}.cell", checkpoint.to_bytes(content), "out")


def _cell(experiment: Experiment, held: Mapping[str, Any]) -> Cell:
    """Return the cell in a file; raise an error if the file holds another experiment."""
    value, recorded = dict(held), dict(held["recorded"])
    for name in _CELL:
        entry = TYPES[name](value[name])
        value[name] = getattr(entry, "value", entry)
    require_like(np.zeros(0), recorded.pop("theta", np.zeros(0)), "theta")
    Recorder(experiment).restore({name: [rows] for name, rows in recorded.items()})
    return value | {"warnings": {str(name): int(n) for name, n in held["warnings"].items()}}


def _experiment(scene: Scene, setting: Mapping[str, Any]) -> Experiment:
    """Return one member; it records only quantities that the scene names."""
    record = setting.get("run.record", scene.tables["run"].get("record", []))
    experiment = scene.experiment({**setting, "run.record": record})
    if logs := LOGS.keys() & experiment.record:
        allowed = "are too many for a sweep; record them in a single run"
        raise InputError("run.record", ", ".join(sorted(logs)), allowed)
    return experiment


def _digest(experiment: Experiment) -> str:
    description = {"version": __version__, "experiment": experiment.description()}
    return hashlib.sha256(checkpoint.to_bytes(description)).hexdigest()[:32]


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
    if all(number.denominator == 1 and abs(number) < 2**63 for number in numbers):
        return np.array([int(number) for number in numbers], dtype=np.int64)
    return np.array([nearest_float(number) for number in numbers])


def _text(value: Any) -> str:
    return json.dumps(value, default=str)


def _tables(scene: Scene) -> str:
    return _text({name: dict(table) for name, table in scene.tables.items()})


def _assembled(
    scene: Scene, experiments: list[Experiment], values: Sequence[Cell | None]
) -> xr.Dataset:
    """Return the cells as one dataset; ``finished`` is false for cells not computed."""
    dimension_of = dimensions(scene.vary)
    shape = tuple(len(options) for options in scene.vary.values())
    dims, cells = tuple(dimension_of.values()), [value or {} for value in values]
    per = " or ".join(dict.fromkeys(experiment.drive.per for experiment in experiments))
    columns: dict[str, tuple[Any, dict[str, str]]] = {}  # value if missing, and attributes
    for name, column in ((name, RUN.fields[name]) for name in _CELL):
        about = {key: text.format(per=per) for key, text in column.attributes.items() if text}
        columns[name] = column.missing, about
    if any("velocity_decimal" in cell for cell in cells):
        columns["velocity_decimal"] = "", {}
    variables: dict[str, Any] = {
        name: (dims, np.array([cell.get(name, missing) for cell in cells]).reshape(shape), about)
        for name, (missing, about) in columns.items()
    }
    if SEED in scene.vary:
        variables |= _means(variables, dims.index(dimension_of[SEED]))
    finished = np.array([value is not None for value in values]).reshape(shape)
    variables["finished"] = (dims, finished, {"long_name": "the cell has been computed"})
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
        "tables": _tables(scene),
        "vary": _text(dict(scene.vary)),
    }
    coordinates = {name: (name, _coordinate(scene.vary[key])) for key, name in dimension_of.items()}
    if isinstance(scene, _Listed):
        coordinates |= _differing(experiments)
    return xr.Dataset(variables, coordinates, attributes | _shared(experiments))


def _means(variables: Mapping[str, Any], seeds: int) -> dict[str, Any]:
    """Return the mean velocities over the dimension of the seeds, and their standard errors."""
    dims, _, about = variables["velocity"]
    mean, error = mean_over_seeds(
        *(np.moveaxis(variables[name][1], seeds, -1) for name in ("velocity", "velocity_error"))
    )
    across = dims[:seeds] + dims[seeds + 1 :]
    said = "mean of velocity over the seeds", "standard error of velocity_mean"
    return {
        "velocity_mean": (across, mean, {**about, "long_name": said[0]}),
        "velocity_mean_error": (across, error, {**about, "long_name": said[1]}),
    }


def _differing(experiments: list[Experiment]) -> dict[str, Any]:
    """Return the numbers in which listed experiments differ, along their dimension."""
    every = [one.chain.parameters() | one.drive.parameters() for one in experiments]
    columns = {name: [each.get(name) for each in every] for name in every[0]}
    return {
        name: ("experiment", _coordinate(values))
        for name, values in columns.items()
        if all(isinstance(value, (int, Fraction)) for value in values) and len({*values}) > 1
    }


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
