"""Checkpoint files: snapshots of runs at rest and their recorded rows, appended line by line.

The first line names the format and its version. Every other line is a record: a SHA-256 digest of
the previous digest and the rest of the line, then JSON in which arrays are base64. The first record
holds the experiments; each later one holds a snapshot of a run and its rows since the previous
snapshot. Nothing is written twice, nothing in a file is executed, and only one process at a time
writes. If a file is damaged, the run continues from the last record before the damage.
"""

from __future__ import annotations

import base64
import hashlib
import json
import math
import os
import re
import threading
import time
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exactcreep import __version__
from exactcreep.model.enclosure import Enclosure
from exactcreep.model.numbers import InputError, nearest_float, number_from_zero
from exactcreep.model.remarks import warn
from exactcreep.model.user_files import content_of, opened, refused
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.quasistatic.observed_run import ObservedRun
from exactcreep.quasistatic.recorder import Recorder
from exactcreep.quasistatic.writing import check_output, locked, write_file
from exactcreep.solvers.registry import SOLVERS

VERSION = 14
MOST_BYTES = 2**31
"""Largest size of a checkpoint."""
_FIRST_LINE = re.compile(rb"exactcreep checkpoint (\d{1,6})\n")
LINE = b"exactcreep checkpoint %d\n" % VERSION
_LONGEST_LINE = 40  # bytes in the first line
_MOST_PARTS, _PART = 10**6, 30  # lists and objects in a record; bytes for each further one
_NO_RUN = "is not a checkpoint of a run"
_FIRST_WAIT, _LONGEST_WAIT = 0.1, 600.0  # seconds after one failed write, and after many


class CheckpointWarning(UserWarning):
    """A checkpoint could not be written; the run continues, and tries again."""


class Checkpoint:
    """The checkpoint file of one or more runs.

    `runs`: the snapshot and the blocks of rows read from the file for each of the `experiments`
    that has begun; `note`: data that the caller wants to find in the file; `stale`: why the file is
    not up to date, or "".
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        every: Any = 60,
        *,
        force: bool = False,
        note: Mapping[str, Any] | None = None,
    ) -> None:
        self.every = nearest_float(number_from_zero(every, "every"))
        check_output(path, "checkpoint", force=force)
        self.path = os.fspath(path)
        self.note = dict(note or {})
        self.experiments: list[Experiment] = []
        self.runs: dict[int, tuple[Any, dict[str, list[Any]]]] = {}
        self.stale = ""
        self._force, self._last = force, -math.inf
        self._wait = self.every  # seconds until the next write
        self._size, self._digest = 0, ""  # of the written part
        self._seen: tuple[int, ...] = ()  # the file that was read
        self._counts: dict[int, dict[str, int]] = defaultdict(dict)  # its rows, by members
        self._ready: dict[int, tuple[dict[str, Any], Recorder]] = {}  # to be written
        self._lock = threading.Lock()

    @classmethod
    def read(cls, path: str | os.PathLike[str], every: Any = 60) -> Checkpoint:
        """Return the checkpoint in a file to continue from, or raise `InputError`."""
        checkpoint = cls(path, every, force=True)
        # a file that begins otherwise is refused before a lock appears beside it
        with opened(checkpoint.path, "checkpoint", MOST_BYTES) as file:
            _begin_of(file.read(_LONGEST_LINE), checkpoint.path)
        with locked(path, "checkpoint"):
            content = content_of(path, "checkpoint", MOST_BYTES)
            checkpoint._seen = _identity(path)
        (first, *others), checkpoint._size, checkpoint._digest = _records(content, checkpoint.path)
        with checkpoint.refused():
            checkpoint.note = dict(first["note"])
            described = first["experiments"]
            checkpoint.experiments = [Experiment.from_description(each) for each in described]
            for record in others:
                member = record["member"]
                _, rows = checkpoint.runs.get(member, (None, defaultdict(list)))
                for name, block in record["rows"].items():
                    rows[name].append(block)
                checkpoint.runs[member] = record["run"], rows
        if lost := len(content) - checkpoint._size:
            said = f"{checkpoint.path} ends within a record, or is damaged: its last {lost} bytes"
            said += " are passed over, and the run goes on from the record before"
            warn(said, CheckpointWarning)
        return checkpoint

    def refused(self) -> AbstractContextManager[None]:
        """Turn every error of a block into an `InputError`: the file holds no valid run."""
        return refused("checkpoint", self.path, _NO_RUN)

    @contextmanager
    def writing(self, experiments: Sequence[Experiment]) -> Iterator[None]:
        """Lock the file during a block, and write the experiments into it if it is new."""
        for solver in (experiment.algorithm for experiment in experiments):
            if not solver.on_file:
                kept = ", ".join(name for name, known in SOLVERS.items() if known().on_file)
                allowed = f"keeps runs of {kept}, not of {solver.name}"
                raise InputError("checkpoint", self.path, allowed)
        with locked(self.path, "checkpoint"):
            if self._size:
                if _identity(self.path) != self._seen:
                    allowed = "was written by another process since it was read: resume it again"
                    raise InputError("checkpoint", self.path, allowed)
            else:
                self._begin(experiments)
            yield

    def _begin(self, experiments: Sequence[Experiment]) -> None:
        self.experiments = list(experiments)
        described = [experiment.description() for experiment in experiments]
        try:
            self._add({"version": __version__, "note": self.note, "experiments": described})
        except TypeError as error:
            raise InputError("checkpoint", self.path, f"cannot be written: {error}") from None

    def restore(self, index: int, run: ObservedRun) -> None:
        """Set a run to its last snapshot in the file, if it has any, or raise `InputError`."""
        run.kept_up_to_date = True
        if index in self.runs:
            with self.refused():
                run.restore(*self.runs.pop(index))
                run.result()  # fails if the snapshot is not valid
            self._counts[index] = run.recorder.counts()

    def take(self, index: int, run: ObservedRun) -> None:
        """Note a snapshot of a run that is at rest; write it if the time has come."""
        with self._lock:  # runs are in parallel threads
            if run.simulation.at_rest and not run.recorder.partial:
                self._ready[index] = run.kept(), run.recorder
            if time.monotonic() - self._last >= self._wait:
                self.write()

    def write(self) -> None:
        """Append the noted snapshots; after a failure, warn and double the time to the next try."""
        self._last = time.monotonic()
        for index, (run, recorder) in list(self._ready.items()):
            rows = recorder.rows(self._counts[index], run["rows"])
            try:
                self._add({"member": index, "run": run, "rows": rows})
            except InputError as error:
                if not self.stale:
                    warn(f"{error}; the run goes on", CheckpointWarning)
                self.stale = str(error)
                # each attempt packs everything recorded since the last successful one
                self._wait = min(max(2 * self._wait, _FIRST_WAIT), max(self.every, _LONGEST_WAIT))
                self._last = time.monotonic()
                return
            self._counts[index] = run["rows"]
            del self._ready[index]
        self.stale, self._wait = "", self.every

    def _add(self, content: Mapping[str, Any]) -> None:
        """Append a record to the file, completely or not at all."""
        record, digest = packed(content, self._digest)
        if not self._size:
            record = LINE + record
            write_file(self.path, record, "checkpoint", force=self._force)
        else:
            try:
                with open(self.path, "r+b") as file:
                    file.truncate(self._size)
                    file.seek(self._size)
                    file.write(record)
                    file.flush()
                    os.fsync(file.fileno())
            except OSError as error:
                with suppress(OSError):
                    os.truncate(self.path, self._size)
                reason = f"cannot be written: {error.strerror or error}; resume goes on from what"
                raise InputError("checkpoint", self.path, f"{reason} it holds") from None
        self._size += len(record)
        self._digest = digest


def packed(content: Mapping[str, Any], before: str = "") -> tuple[bytes, str]:
    """Return the line of a record, and its digest; `before` is the digest of the record before."""
    tree = json.dumps(_encoded(content), separators=(",", ":"))
    digest = hashlib.sha256(f"{before}{tree}".encode()).hexdigest()
    return f"{digest} {tree}\n".encode(), digest


def _encoded(value: Any) -> Any:
    """Return a JSON tree; a type unknown to JSON is an object whose only name begins with $."""
    if value is None or isinstance(value, (bool, str, int, float)):
        return value
    if isinstance(value, Fraction):
        return {"$fraction": [hex(value.numerator), hex(value.denominator)]}
    if isinstance(value, (np.ndarray, np.generic)):
        array = np.asarray(value)
        if array.dtype.kind == "O":
            return {"$objects": [_encoded(item) for item in array.tolist()]}
        array = np.asarray(array, array.dtype.newbyteorder("<"), order="C")
        return {"$array": [array.dtype.str, array.shape, base64.b64encode(array.data).decode()]}
    if isinstance(value, (list, tuple)):
        items = [_encoded(item) for item in value]
        kind = "$enclosure" if isinstance(value, Enclosure) else "$tuple"
        return items if isinstance(value, list) else {kind: items}
    if isinstance(value, Mapping):
        if not all(isinstance(key, str) and not key.startswith("$") for key in value):
            raise TypeError("a checkpoint's names are strings that do not begin with $")
        return {key: _encoded(item) for key, item in value.items()}
    raise TypeError(f"a checkpoint cannot hold a {type(value).__name__}")


def _decoded(item: dict[str, Any]) -> Any:
    """Return the value of a JSON object whose parts are decoded."""
    kind, parts = next(iter(item.items()), ("", None))
    if not (parts is not None and len(item) == 1 and kind.startswith("$")):
        return item
    if kind == "$fraction":
        return Fraction(*(int(part, 16) for part in parts))
    if kind == "$tuple":
        return tuple(parts)
    if kind == "$enclosure":
        return Enclosure(*parts)
    if kind == "$objects":
        objects: NDArray[Any] = np.empty(len(parts), dtype=object)
        objects[:] = parts
        return objects
    name, shape, data = parts
    held = np.frombuffer(base64.b64decode(data), np.dtype(name)).reshape(shape)
    return held.astype(held.dtype.newbyteorder("="))  # a writable copy


def to_bytes(content: Mapping[str, Any]) -> bytes:
    return LINE + packed(content)[0]


def read(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Return the content of the first record of a file, or raise `InputError`."""
    records, _, _ = _records(content_of(path, "checkpoint", MOST_BYTES), os.fspath(path))
    content: dict[str, Any] = records[0]
    return content


def _identity(path: str | os.PathLike[str]) -> tuple[int, ...]:
    """Return numbers that change if a file is written or replaced; () if there is no file."""
    try:
        about = os.stat(path)
    except OSError:
        return ()
    return about.st_dev, about.st_ino, about.st_size


def _begin_of(data: bytes, name: str) -> int:
    line = _FIRST_LINE.match(data)
    if line is None:
        raise InputError("checkpoint", name, "is not a checkpoint of exactcreep")
    if int(line[1]) != VERSION:
        told = f"is of version {int(line[1])}; this program reads version {VERSION}: let the"
        raise InputError("checkpoint", name, f"{told} version that wrote it go on, or begin again")
    return line.end()


def _records(data: bytes, name: str) -> tuple[list[Any], int, str]:
    digest, records, end = "", [], _begin_of(data, name)
    for record in data[end:].splitlines(keepends=True):
        sealed, _, tree = record.removesuffix(b"\n").partition(b" ")
        sum_of_both = hashlib.sha256(digest.encode() + tree).hexdigest()
        if sealed != sum_of_both.encode() or not record.endswith(b"\n"):
            break
        if tree.count(b"[") + tree.count(b"{") > _MOST_PARTS + len(tree) // _PART:
            raise InputError("checkpoint", name, f"{_NO_RUN}: it consists of too many parts")
        with refused("checkpoint", name, _NO_RUN):
            records.append(json.loads(tree, object_hook=_decoded))
        digest, end = sum_of_both, end + len(record)
    if not records:
        allowed = f"is truncated or damaged: of its {len(data)} bytes none can be gone on from"
        raise InputError("checkpoint", name, allowed)
    return records, end, digest
