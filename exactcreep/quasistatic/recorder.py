"""What a run records: in memory up to a bound, beyond it in files until the run is over.

The files have no names: the system takes them away with the process, however that ends.
"""

from __future__ import annotations

import math
import os
import tempfile
import weakref
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exactcreep.limits import MEMORY
from exactcreep.model.enclosure import as_written, quantity
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.solvers.solver import Stretch, require
from exactcreep.solvers.tables import COLUMNS, record_arrays

Columns = Mapping[str, NDArray[Any]]


class Recorder:
    """Keeps the columns that an experiment records.

    At most `memory` bytes are kept in memory, but for texts: decimals have no fixed size. `failed`
    says why there is no room left; `begun` are rows since the last target, which the next one
    brings once more.
    """

    def __init__(self, experiment: Experiment, memory: int = MEMORY) -> None:
        self.needs = experiment.record
        self.bytes = 0
        self.failed = ""
        self.begun: Columns = {}
        self._digits, self._memory = experiment.digits, memory
        self._nothing = record_arrays(dict.fromkeys(experiment.record, ()), experiment.chain.n)
        self._columns = {name: _Column(values) for name, values in self._nothing.items()}

    def take(self, stretch: Stretch) -> None:
        self.begun = self._written(stretch.begun)
        self.add(stretch.recorded)

    def add(self, rows: Columns) -> None:
        self._extend(self._written(rows))

    def _written(self, rows: Columns) -> Columns:
        """Return rows as files hold them: floats, and perhaps decimals and radii beside them."""
        written: dict[str, NDArray[Any]] = {}
        for name, values in rows.items():
            if name in self._nothing and len(values):
                written |= as_written(name, values, self._digits)
        return written

    def _extend(self, written: Columns) -> None:
        for name, rows in written.items():
            column = self._columns.setdefault(name, _Column(rows[:0]))
            held = sum(one.data.nbytes for one in self._columns.values() if one.file is None)
            self.bytes += rows.nbytes
            try:
                column.append(rows, self._memory - held)
            except OSError as error:
                column.append(rows, math.inf)
                folder = tempfile.gettempdir()
                self.failed = f"what is recorded cannot be kept in {folder}: {error.strerror}"

    def counts(self) -> dict[str, int]:
        """Return how many rows each column has, without those since the last target."""
        return {name: column.rows for name, column in self._columns.items()}

    def rows(self, begin: Mapping[str, int], end: Mapping[str, int]) -> dict[str, NDArray[Any]]:
        """Return the rows of columns between two `counts`."""
        return {name: self._columns[name].data[begin.get(name, 0) : end[name]] for name in end}

    def columns(self) -> dict[str, NDArray[Any]]:
        """Return the columns whole, with what has begun since the last target."""
        made = self.rows({}, self.counts())
        for name, rows in self.begun.items():
            made[name] = np.concatenate([made[name], rows]) if name in made else rows
        types = {name: COLUMNS[name].dtype for name in made.keys() & COLUMNS.keys()}
        return {
            name: values.astype(types.get(name, values.dtype), copy=False)
            for name, values in made.items()
        }

    def restore(self, blocks: Mapping[str, list[NDArray[Any]]], counts: Mapping[str, int]) -> None:
        """Take over what a file holds, or raise `ValueError`."""
        require(blocks.keys() <= counts.keys() >= self._nothing.keys(), "a column is missing")
        for name, parts in blocks.items():
            require(quantity(name) in self._nothing, f"{name[:40]} was not recorded")
            like = self._nothing[quantity(name)]
            for part in parts:
                known = part.dtype.kind in "Uf" and name != quantity(name)
                fits = (known or part.dtype == like.dtype) and part.shape[1:] == like.shape[1:]
                require(fits, f"{name} has another shape")
                self._extend({name: part})
        require(self.counts() == dict(counts), "rows are missing")


class _Column:
    """Rows of one column, in memory or in a file, with room for as many again."""

    def __init__(self, nothing: NDArray[Any]) -> None:
        self.data, self.rows = nothing, 0
        self.file: Any = None

    def append(self, rows: NDArray[Any], memory: float) -> None:
        """Add rows at the end; in a file, if they need more than so many bytes of memory."""
        end, kind = self.rows + len(rows), self.data.dtype
        if rows.dtype != kind:
            kind = np.result_type(self.data, rows)
        if end > len(self.data) or kind != self.data.dtype:
            before, shape = self.data[: self.rows], (end + end // 4, *rows.shape[1:])
            size, moved = math.prod(shape) * kind.itemsize, True
            if memory == math.inf or kind.kind == "U" or (self.file is None and size <= memory):
                self.data, self.file = np.empty(shape, kind), None
            else:
                moved = self.file is None
                if self.file is None:
                    self.file = tempfile.TemporaryFile()  # noqa: SIM115 - lives as long
                    weakref.finalize(self, self.file.close)
                if allocate := getattr(os, "posix_fallocate", None):
                    # on a full disk it fails, where writing to a map would end the process
                    allocate(self.file.fileno(), 0, size)
                self.data = np.memmap(self.file, kind, "r+", shape=shape)
            if moved:
                self.data[: self.rows] = before
        self.data[self.rows : end] = rows
        self.rows = end
