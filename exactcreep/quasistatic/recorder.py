"""What a run records: in memory up to a bound, beyond it in flat files until the run is over.

The files have no names: the system takes them away with the process, however that ends.
"""

from __future__ import annotations

import tempfile
import weakref
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exactcreep.limits import MEMORY
from exactcreep.model.enclosure import as_written, quantity
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.solvers.solver import Simulation, Stretch, require
from exactcreep.solvers.tables import COLUMNS, record_arrays

Columns = Mapping[str, NDArray[Any]]


class Recorder:
    """Keeps the columns that an experiment records, block by block.

    Parameters
    ----------
    experiment : Experiment
    memory : int
        Bytes that are kept in memory at most, but for the last block, and for texts: the decimals
        of a solver with digits have no fixed size.

    Attributes
    ----------
    bytes : int
        Of all that was recorded.
    failed : str
        Why it has no room left; "" if it has.
    """

    def __init__(self, experiment: Experiment, memory: int = MEMORY) -> None:
        self.needs = experiment.record
        self.bytes = 0
        self.failed = ""
        self._digits, self._n = experiment.digits, experiment.chain.n
        self._nothing = record_arrays(dict.fromkeys(experiment.record, ()), self._n)
        self._columns = {name: _Column(values) for name, values in self._nothing.items()}
        self._memory = memory
        self._begun: Columns = {}  # since the last target, to come once more
        self.unsaved: dict[str, list[NDArray[Any]]] | None = None  # blocks that no file has yet

    def take(self, stretch: Stretch, first: int, simulation: Simulation) -> None:
        """Take over what was recorded on the way to the targets from `first` on."""
        self._begun = stretch.begun
        self.add(stretch.recorded)

    def add(self, rows: Columns) -> None:
        """Add rows to the columns that are recorded."""
        for name, values in rows.items():
            if name in self._nothing and len(values):
                self.extend(as_written(name, values, self._digits))

    def extend(self, written: Columns) -> None:
        """Add rows as they are written: floats, and perhaps decimals and radii beside them."""
        for name, rows in written.items():
            column = self._columns.setdefault(name, _Column(rows[:0]))
            column.blocks.append(rows)
            self.bytes += rows.nbytes
            if self.unsaved is not None:
                self.unsaved.setdefault(name, []).append(rows)
        if self.bytes > self._memory:
            self._spill()

    def _spill(self) -> None:
        held = sum(rows.nbytes for column in self._columns.values() for rows in column.blocks)
        if held <= self._memory:
            return
        try:
            for column in self._columns.values():
                column.spill()
        except OSError as error:
            folder = tempfile.gettempdir()
            self.failed = f"what is recorded cannot be kept in {folder}: {error.strerror}"

    @property
    def begins(self) -> bool:
        """Whether rows have begun that the next target brings once more."""
        return bool(self._begun)

    def counts(self) -> dict[str, int]:
        """Return how many rows each column has, without those since the last target."""
        return {name: column.rows for name, column in self._columns.items()}

    def columns(self) -> dict[str, NDArray[Any]]:
        """Return the columns whole, with what has begun since the last target."""
        ends: dict[str, NDArray[Any]] = {}
        for name, values in self._begun.items():
            if name in self._nothing:
                ends |= as_written(name, values, self._digits)
        made = {name: column.array() for name, column in self._columns.items()}
        for name, rows in ends.items():
            made[name] = np.concatenate([made[name], rows]) if name in made else rows
        return {
            name: values.astype(_typed(name, values), copy=False) for name, values in made.items()
        }

    def restore(self, blocks: Mapping[str, list[NDArray[Any]]], counts: Mapping[str, int]) -> None:
        """Take over what files hold, or raise `ValueError`."""
        require(blocks.keys() <= counts.keys() >= self._nothing.keys(), "a column is missing")
        for name, parts in blocks.items():
            like = self._nothing.get(quantity(name))
            require(like is not None, f"{name[:40]} was not recorded")
            assert like is not None
            for part in parts:
                own = (
                    part.dtype == like.dtype if name == quantity(name) else part.dtype.kind in "Uf"
                )
                require(own and part.shape[1:] == like.shape[1:], f"{name} has another shape")
                self.extend({name: part})
        require(self.counts() == dict(counts), "rows are missing")


def _typed(name: str, values: NDArray[Any]) -> Any:
    return COLUMNS[name].dtype if name in COLUMNS else values.dtype


class _Column:
    """Rows of one column: in a flat file without a name, if there are many, then in memory."""

    def __init__(self, nothing: NDArray[Any]) -> None:
        self.blocks: list[NDArray[Any]] = []
        self._nothing, self._spilt = nothing, 0
        self._file: Any = None

    @property
    def rows(self) -> int:
        """How many there are."""
        return self._spilt + sum(map(len, self.blocks))

    def spill(self) -> None:
        """Write the blocks in memory to the file, each whole or not at all."""
        while self.blocks and self.blocks[0].dtype.kind != "U":
            if self._file is None:
                self._file = tempfile.TemporaryFile(buffering=0)  # noqa: SIM115 - lives as long
                weakref.finalize(self, self._file.close)
            rows, file = np.ascontiguousarray(self.blocks[0]), self._file
            begin, data = file.seek(0, 2), rows.reshape(-1).view(np.uint8).data
            try:
                while data:
                    data = data[file.write(data) :]
            except OSError:
                file.truncate(begin)
                raise
            self._spilt += len(self.blocks.pop(0))

    def array(self) -> NDArray[Any]:
        """Return all rows, those in the file as they stand there."""
        like = self.blocks[0] if self.blocks else self._nothing
        if self._spilt:
            shape = (self._spilt, *like.shape[1:])
            there = np.memmap(self._file, dtype=like.dtype, mode="r", shape=shape)
            return np.concatenate([there, *self.blocks]) if self.blocks else np.asarray(there)
        if len(self.blocks) > 1:
            self.blocks = [np.concatenate(self.blocks)]
        return self.blocks[0] if self.blocks else self._nothing
