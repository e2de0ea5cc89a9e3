"""What a run records: in memory up to a bound, beyond it in flat files until the run is over.

The files have no names: the system takes them away with the process, however that ends.
"""

from __future__ import annotations

import contextlib
import io
import mmap
import os
import tempfile
import weakref
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exactcreep.limits import MEMORY

_PIECE = 2**20  # bytes


class Store:
    """Arrays by name that grow by blocks of rows.

    Parameters
    ----------
    memory : int
        Bytes that are kept in memory at most, but for the last block, and for texts: the decimals
        of a solver with digits have no fixed size.

    Attributes
    ----------
    bytes : int
        Of all that was added.
    """

    def __init__(self, memory: int = MEMORY) -> None:
        self.memory = memory
        self.bytes = 0
        self._held = 0  # of these, in memory
        self._blocks: dict[str, list[NDArray[Any]]] = {}
        self._columns: dict[str, _Column] = {}

    def add(self, name: str, rows: NDArray[Any]) -> None:
        """Add rows to an array.

        Raises
        ------
        OSError
            If the memory is used up and a file cannot be written; the rows are added all the same.
        """
        self._blocks.setdefault(name, []).append(rows)
        self.bytes += rows.nbytes
        self._held += rows.nbytes
        if self._held > self.memory:
            self._spill()

    def _spill(self) -> None:
        for name, blocks in self._blocks.items():
            if blocks and blocks[0].dtype.kind != "U":
                if name not in self._columns:
                    self._columns[name] = _Column(blocks[0])
                while blocks:
                    self._columns[name].append(blocks[0])
                    self._held -= blocks.pop(0).nbytes

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return what was added, one array for each name: those in files are read from there."""
        if self._columns:
            with contextlib.suppress(OSError):  # what has no room there is still in memory
                self._spill()
        out: dict[str, NDArray[Any]] = {}
        for name, blocks in self._blocks.items():
            if name in self._columns:
                there = self._columns[name].array()
                out[name] = np.concatenate([there, *blocks]) if blocks else there
                continue
            if len(blocks) > 1:
                self._blocks[name] = [np.concatenate(blocks)]
            out[name] = self._blocks[name][0]
        return out

    def restore(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Take over what `arrays` returned."""
        for name, rows in arrays.items():
            self.add(name, rows)


class _Column:
    """Rows of one array in a flat file without a name."""

    def __init__(self, like: NDArray[Any]) -> None:
        self._dtype, self._tail = like.dtype, like.shape[1:]
        self._file = tempfile.TemporaryFile(buffering=0)  # noqa: SIM115 - it lives as long as this
        weakref.finalize(self, self._file.close)
        self._size = 0

    def append(self, rows: NDArray[Any]) -> None:
        """Add rows at the end, all of them or none."""
        if not rows.size:
            return
        data = np.ascontiguousarray(rows).reshape(-1).view(np.uint8).data
        try:
            written = 0
            while written < len(data):
                written += self._file.write(data[written:])
        except OSError:
            self._file.seek(self._size)
            self._file.truncate()
            raise
        self._size += len(data)

    def array(self) -> NDArray[Any]:
        """Return all rows, as they stand in the file."""
        if not self._size:
            return np.empty((0, *self._tail), dtype=self._dtype)
        there = mmap.mmap(self._file.fileno(), self._size, access=mmap.ACCESS_READ)
        return np.frombuffer(there, dtype=self._dtype).reshape(-1, *self._tail)


class ScratchFile(io.FileIO):
    """A file without a name for a library that must never see a disk fill up.

    Once writing has failed, nothing more is written, and `failed` holds the error.
    """

    def __init__(self) -> None:
        with tempfile.TemporaryFile(buffering=0) as file:
            super().__init__(os.dup(file.fileno()), "r+")
        self.failed: OSError | None = None

    def write(self, data: Any) -> int:
        """Write all of `data`, unless an error has come before."""
        rest = memoryview(data).cast("B")
        length = len(rest)
        try:
            while len(rest) and self.failed is None:
                rest = rest[super().write(rest) :]
        except OSError as error:
            self.failed = error
        self.seek(len(rest), io.SEEK_CUR)
        return length

    def pieces(self) -> Iterator[bytes]:
        """Yield what was written, piece by piece."""
        self.seek(0)
        while piece := self.read(_PIECE):
            yield piece

    def __del__(self) -> None:
        self.close()  # without Python's warning of a file that was left open
