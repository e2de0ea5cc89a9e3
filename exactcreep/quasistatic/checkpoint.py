"""Checkpoint files: snapshots of a run at rest and its recorded rows, appended line by line.

The first line names the format and its version. Every other line is an entry: a SHA-256 digest of
the previous digest and the rest of the line, then JSON in which arrays are base64. The first entry
holds the experiment; each later one holds a snapshot of the run and its rows since the previous
snapshot. Nothing is written twice, nothing in a file is executed, and only one process at a time
writes. If a file is damaged, the run continues from the last entry before the damage.
"""

from __future__ import annotations

import hashlib
import math
import os
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from typing import Any

from exactcreep import __version__
from exactcreep.model.numbers import InputError, nearest_float, number_from_zero
from exactcreep.model.remarks import warn
from exactcreep.model.user_files import content_of, difference, refused
from exactcreep.quasistatic.observed_run import ObservedRun
from exactcreep.quasistatic.plain import text_of, value_of
from exactcreep.quasistatic.writing import check_output, locked, write_file
from exactcreep.solvers.registry import SOLVERS

VERSION = 18
MOST_BYTES = 2**31
"""Largest size of a checkpoint."""
LINE = b"exactcreep checkpoint %d\n" % VERSION
_NO_RUN = "is not a checkpoint of a run"
_ANEW = "name another file, or begin anew with force"
_AFTER_FAILURE = 60.0  # seconds until the next try


class CheckpointWarning(UserWarning):
    """A run goes on from its checkpoint, or a checkpoint is damaged or could not be written."""


class Checkpoint:
    """The checkpoint file of a run. `stale`: why it is not up to date, or ""."""

    def __init__(
        self, path: str | os.PathLike[str], every: Any = 60, *, force: bool = False
    ) -> None:
        self.every = nearest_float(number_from_zero(every, "every"))
        check_output(path, "checkpoint", force=True)
        self.path, self.force, self.stale = os.fspath(path), force, ""
        self._last, self._wait = -math.inf, self.every  # seconds between two writes
        self._size, self._digest = 0, ""  # of the written part
        self._counts: dict[str, int] = {}  # its rows
        self._ready: dict[str, Any] | None = None  # the snapshot to be written

    @contextmanager
    def writing(self, run: ObservedRun) -> Iterator[None]:
        """Lock the file during a block; set the run to its last snapshot, or begin the file.

        Raises `InputError` if the file is not a checkpoint of the run's experiment.
        """
        self.run = run
        if not (solver := run.experiment.algorithm).on_file:
            kept = ", ".join(name for name, known in SOLVERS.items() if known().on_file)
            raise InputError("checkpoint", self.path, f"keeps runs of {kept}, not of {solver.name}")
        run.kept_up_to_date = True
        with locked(self.path, "checkpoint"):
            if os.path.exists(self.path) and not self.force:
                self._read()
            else:
                described = run.experiment.description()
                try:
                    self._add({"version": __version__, "experiment": described})
                except TypeError as error:
                    said = f"cannot be written: {error}"
                    raise InputError("checkpoint", self.path, said) from None
            yield

    def _read(self) -> None:
        """Set the run to the last snapshot in the file, if there is any."""
        content, run = content_of(self.path, "checkpoint", MOST_BYTES), self.run
        (first, *others), self._size, self._digest = _entries(content, self.path)
        with refused("checkpoint", self.path, _NO_RUN):
            differs = difference(first["experiment"], run.experiment.description(), text_of)
        if differs:
            allowed = f"holds another experiment: {differs}; {_ANEW}"
            raise InputError("checkpoint", self.path, allowed)
        if lost := len(content) - self._size:
            said = f"{self.path} ends within an entry, or is damaged: its last {lost} bytes"
            said += " are passed over, and the run goes on from the entry before"
            warn(said, CheckpointWarning)
        if others:
            with refused("checkpoint", self.path, _NO_RUN):
                rows: dict[str, list[Any]] = {}
                for entry in others:
                    for name, block in entry["rows"].items():
                        rows.setdefault(name, []).append(block)
                run.restore(others[-1]["run"], rows)
                run.result()  # fails if the snapshot is not valid
            self._counts = run.recorder.counts()
        per = "half-cycles" if run.experiment.drive.cyclic else "targets"
        goes = "has ended" if run.ended else "goes on"
        said = f"{self.path} holds {run.done} of {run.total} {per}: the run {goes}"
        warn(said, CheckpointWarning)

    def take(self) -> None:
        """Note a snapshot of the run if it is at rest; write it if the time has come."""
        if self.run.simulation.at_rest and not self.run.recorder.partial:
            self._ready = self.run.kept()
        if time.monotonic() - self._last >= self._wait:
            self.write()

    def write(self) -> None:
        """Append the noted snapshot; after a failure, warn once and wait for the next try."""
        self._last, ready = time.monotonic(), self._ready
        if ready is not None:
            rows = self.run.recorder.rows(self._counts, ready["rows"])
            try:
                self._add({"run": ready, "rows": rows})
            except InputError as error:
                if not self.stale:
                    warn(f"{error}; the run goes on", CheckpointWarning)
                self.stale = str(error)
                # each attempt packs everything recorded since the last successful one
                self._wait, self._last = max(self.every, _AFTER_FAILURE), time.monotonic()
                return
            self._counts, self._ready = ready["rows"], None
        self.stale, self._wait = "", self.every

    def _add(self, content: Mapping[str, Any]) -> None:
        """Append an entry to the file, completely or not at all."""
        entry, digest = packed(content, self._digest)
        if not self._size:
            entry = LINE + entry
            write_file(self.path, entry, "checkpoint")
        else:
            try:
                with open(self.path, "r+b") as file:
                    file.truncate(self._size)
                    file.seek(self._size)
                    file.write(entry)
                    file.flush()
                    os.fsync(file.fileno())
            except OSError as error:
                with suppress(OSError):
                    os.truncate(self.path, self._size)
                reason = f"cannot be written: {error.strerror or error}; the same call goes on"
                raise InputError("checkpoint", self.path, f"{reason} from what it holds") from None
        self._size += len(entry)
        self._digest = digest


def packed(content: Mapping[str, Any], before: str = "") -> tuple[bytes, str]:
    """Return the line of an entry, and its digest; `before` is the digest of the entry before."""
    tree = text_of(content)
    digest = hashlib.sha256(f"{before}{tree}".encode()).hexdigest()
    return f"{digest} {tree}\n".encode(), digest


def _entries(data: bytes, name: str) -> tuple[list[Any], int, str]:
    digest, entries, end = "", [], len(LINE)
    if not data.startswith(LINE):
        told = (
            f"is not a checkpoint of version {VERSION}, which this program reads: let the version"
        )
        raise InputError("checkpoint", name, f"{told} that wrote it go on, {_ANEW}")
    for entry in data[end:].splitlines(keepends=True):
        sealed, _, tree = entry.removesuffix(b"\n").partition(b" ")
        sum_of_both = hashlib.sha256(digest.encode() + tree).hexdigest()
        if sealed != sum_of_both.encode() or not entry.endswith(b"\n"):
            break
        with refused("checkpoint", name, _NO_RUN):
            entries.append(value_of(tree))
        digest, end = sum_of_both, end + len(entry)
    if not entries:
        allowed = f"is truncated or damaged: no run can go on from its {len(data)} bytes; {_ANEW}"
        raise InputError("checkpoint", name, allowed)
    return entries, end, digest
