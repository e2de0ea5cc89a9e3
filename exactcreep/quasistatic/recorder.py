"""Record the columns of a run in memory, and limit the memory of all runs together."""

from __future__ import annotations

import weakref
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.enclosure import as_written, quantity
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.solvers.interface import Stretch, require
from exactcreep.solvers.tables import COLUMNS, record_arrays
from exactcreep.watch.limits import free_memory

Columns = Mapping[str, NDArray[Any]]
_WORTH_A_LOOK = 2**20  # bytes recorded between two checks of the free memory


class Recorder:
    """Stores the columns that an experiment records.

    `full` says why a run has to end, "" while there is memory. `partial` holds rows since the last
    target, which the next block delivers again.
    """

    def __init__(self, experiment: Experiment) -> None:
        self.needs = experiment.record
        self.full = ""
        self.partial: Columns = {}
        self._digits = experiment.digits
        self._nothing = record_arrays(dict.fromkeys(experiment.record, ()), experiment.chain.n)
        self._columns = {name: _Column(values) for name, values in self._nothing.items()}

    def take(self, stretch: Stretch) -> None:
        self.partial = self._written(stretch.partial)
        self.add(stretch.recorded)

    def add(self, rows: Columns) -> None:
        self._extend(self._written(rows))

    def _written(self, rows: Columns) -> Columns:
        """Return rows as files hold them: floats, and for some solvers decimals and radii."""
        written: dict[str, NDArray[Any]] = {}
        for name, values in rows.items():
            if name in self._nothing and len(values):
                written |= as_written(name, values, self._digits)
        return written

    def _extend(self, written: Columns) -> None:
        for name, rows in written.items():
            if not self._columns.setdefault(name, _Column(rows[:0])).append(rows):
                self.full = "what this process has recorded takes half of the free memory"

    def counts(self) -> dict[str, int]:
        """Return the number of rows of each column, without rows since the last target."""
        return {name: column.rows for name, column in self._columns.items()}

    def rows(self, begin: Mapping[str, int], end: Mapping[str, int]) -> dict[str, NDArray[Any]]:
        """Return the rows of columns between two `counts`."""
        return {name: self._columns[name].data[begin.get(name, 0) : end[name]] for name in end}

    def columns(self) -> dict[str, NDArray[Any]]:
        """Return the whole columns, with the rows since the last target."""
        made = self.rows({}, self.counts())
        for name, rows in self.partial.items():
            made[name] = np.concatenate([made[name], rows]) if name in made else rows
        types = {name: COLUMNS[name].dtype for name in made.keys() & COLUMNS.keys()}
        return {
            name: values.astype(types.get(name, values.dtype), copy=False)
            for name, values in made.items()
        }

    def restore(self, blocks: Mapping[str, list[NDArray[Any]]]) -> None:
        """Restore the columns in a file, or raise `ValueError`."""
        for name, parts in blocks.items():
            require(quantity(name) in self._nothing, f"{name} was not recorded")
            like = self._nothing[quantity(name)]
            for part in parts:
                fits = part.dtype == like.dtype or name != quantity(name)
                require(fits and part.shape[1:] == like.shape[1:], f"{name} has another shape")
                self._extend({name: part})


class _Column:
    """Rows of one column, with room for some more."""

    held: ClassVar[int] = 0
    """Bytes of the columns of all runs of this process, including those in results."""
    seen: ClassVar[int] = 0
    """The same at the last check of the free memory, which takes as long as a short run."""

    def __init__(self, nothing: NDArray[Any]) -> None:
        self.data, self.rows = nothing, 0

    def append(self, rows: NDArray[Any]) -> bool:
        """Add rows at the end; return whether all columns take less than half of the memory."""
        end, kind, enough = self.rows + len(rows), np.result_type(self.data, rows), True
        if end > len(self.data) or kind != self.data.dtype:
            grown = np.empty((end + end // 4, *rows.shape[1:]), kind)
            grown[: self.rows] = self.data[: self.rows]
            self.data = grown
            # results share the rows; they are freed when the user drops the results
            weakref.finalize(grown, _let_go, grown.nbytes).atexit = False
            _Column.held += grown.nbytes
            if abs(self.held - self.seen) >= _WORTH_A_LOOK:
                _Column.seen, enough = self.held, self.held <= free_memory()
        self.data[self.rows : end] = rows
        self.rows = end
        return enough


def _let_go(size: int) -> None:
    _Column.held -= size
