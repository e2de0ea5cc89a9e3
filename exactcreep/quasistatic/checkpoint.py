"""Checkpoint files: how far runs have come at rest, and what they recorded, added record by record.

A file is a line that names the format and its version, and then records: the length of one, the
SHA-256 of it and of the digest before, and a JSON tree with the bytes of its arrays, little-endian.
The first holds the experiments; each that follows a snapshot of one run, and the rows that it has
recorded since the one before. Nothing is ever written twice, nothing in a file is executed, and
what a program that was killed left unfinished at the end is passed over.
"""

from __future__ import annotations

import hashlib
import json
import math
import mmap
import os
import re
import time
import warnings
from collections.abc import Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from exactcreep import __version__
from exactcreep.model.enclosure import Enclosure
from exactcreep.model.numbers import InputError, nearest_float, number_from_zero
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.quasistatic.files import check_output, file_name, write_file
from exactcreep.quasistatic.run import ObservedRun
from exactcreep.solvers.solver import require

VERSION = 7
_FIRST_LINE = re.compile(rb"exactcreep checkpoint (\d{1,6})\n")
_LINE = b"exactcreep checkpoint %d\n" % VERSION
_HEAD = 8 + 32  # of a record: its length and its digest
_ARRAY = re.compile(r"[<|][fiubU][0-9]{1,6}")
_LARGE = 2**26  # bytes from which an array is read where it stands in the file


class CheckpointWarning(UserWarning):
    """The checkpoint of a run could not be written; the run goes on, and tries again."""


class Checkpoint:
    """The checkpoint file of one or more runs: added to when it is due, and read again.

    Attributes
    ----------
    path : str
    every : float
        Seconds between two writings.
    note : mapping
        What a caller wants to find in it.
    experiments : list of Experiment
    begun : list of int
        Which of them have begun.
    stale : str
        Why the file does not hold how far the run has come; "" if it does.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        every: Any = 60,
        *,
        force: bool = False,
        note: Mapping[str, Any] | None = None,
    ) -> None:
        """Take over where to write, or raise `InputError` if no file can be written there."""
        self.every = nearest_float(number_from_zero(every, "every"))
        check_output(path, "checkpoint", force=force)
        self.path = os.fspath(path)
        self.note = dict(note or {})
        self.experiments: list[Experiment] = []
        self.begun: list[int] = []
        self.stale = ""
        self._force = force
        self._last = -math.inf
        self._size, self._digest = 0, b""  # of what is written
        self._runs: dict[int, tuple[Any, dict[str, list[Any]]]] = {}  # what was read
        self._ready: dict[int, tuple[Any, dict[str, list[Any]]]] = {}  # what is to be written

    @classmethod
    def read(cls, path: str | os.PathLike[str], every: Any = 60) -> Checkpoint:
        """Return the checkpoint in a file, which goes on, or raise `InputError`."""
        found = cls(path, every, force=True)
        records, found._size, found._digest, whole = _records(
            _content(path, found.path), found.path
        )
        try:
            first = records[0]
            found.note = first["note"]
            found.experiments = [Experiment.from_description(one) for one in first["experiments"]]
            for record in records[1:]:
                member = record["member"]
                require(type(member) is int and 0 <= member < len(found.experiments), "whose run?")
                rows = found._runs.setdefault(member, (None, {}))[1]
                for name, block in record["rows"].items():
                    rows.setdefault(name, []).append(block)
                found._runs[member] = record["run"], rows
        except InputError:
            raise
        except Exception as error:
            raise _refusal(found.path, error) from None
        found.begun = sorted(found._runs)
        if not whole:
            said = f"{found.path} ends within a record: the run goes on from the one before"
            warnings.warn(said, CheckpointWarning, stacklevel=3)
        return found

    def begin(self, experiments: Sequence[Experiment]) -> None:
        """Take over the experiments that are to be run, unless they are those of the file."""
        if not self.experiments:
            self.experiments = list(experiments)
            described = [experiment.description() for experiment in experiments]
            try:
                self._add({"version": __version__, "note": self.note, "experiments": described})
            except TypeError as error:
                raise InputError("checkpoint", self.path, f"cannot be written: {error}") from None

    def restore(self, index: int, run: ObservedRun) -> None:
        """Take a run to where it is in the file, if it has begun; or raise `InputError`."""
        run.recorder.unsaved = {}
        if index in self._runs:
            try:
                run.restore(*self._runs.pop(index))
            except Exception as error:  # what can be wrong with numbers that were changed
                raise _refusal(self.path, error) from None
            run.recorder.unsaved = {}

    def take(self, index: int, run: ObservedRun) -> None:
        """Remember how far a run has come, if it is at rest."""
        if run.simulation.at_rest and not run.recorder.begins:
            rows = self._ready.get(index, (None, {}))[1]
            for name, blocks in (run.recorder.unsaved or {}).items():
                rows.setdefault(name, []).extend(blocks)
            run.recorder.unsaved = {}
            self._ready[index] = run.kept(), rows

    def due(self) -> bool:
        """Return whether the file is older than it should be."""
        return time.monotonic() - self._last >= self.every

    def write(self) -> None:
        """Add what was remembered; if that fails, warn, and be due again."""
        self._last = time.monotonic()
        for index, (run, blocks) in list(self._ready.items()):
            rows = {name: np.concatenate(parts) for name, parts in blocks.items()}
            try:
                self._add({"member": index, "run": run, "rows": rows})
            except InputError as error:
                if not self.stale:
                    warnings.warn(f"{error}; the run goes on", CheckpointWarning, stacklevel=4)
                self.stale = str(error)
                return
            del self._ready[index]
        self.stale = ""

    def _add(self, content: Mapping[str, Any]) -> None:
        """Add a record at the end of the file, whole or not at all."""
        record, digest = packed(content, self._digest)
        if not self._size:
            write_file(self.path, [_LINE, *record], "checkpoint", force=self._force)
            self._size = len(_LINE)
        else:
            try:
                with open(self.path, "r+b", buffering=0) as file:
                    file.truncate(self._size)
                    try:
                        file.seek(self._size)
                        for piece in record:
                            rest = memoryview(piece)
                            while rest:
                                rest = rest[file.write(rest) :]
                        os.fsync(file.fileno())
                    except OSError:
                        file.truncate(self._size)
                        raise
            except OSError as error:
                reason = f"cannot be written: {error.strerror or error}; resume goes on from what"
                raise InputError("checkpoint", self.path, f"{reason} it holds") from None
        self._size += sum(map(len, record))
        self._digest = digest


def _refusal(path: str, error: Exception) -> InputError:
    reason = " ".join(str(error).split())[:200]
    return InputError("checkpoint", path, f"is not a checkpoint of a run: {reason}")


def packed(content: Mapping[str, Any], before: bytes = b"") -> tuple[list[Any], bytes]:
    """Return the pieces of a record that holds `content`, and its digest.

    It may hold None, truth values, numbers, strings, rationals, enclosures, arrays, and lists,
    tuples and mappings of these; `before` is the digest of the record before.
    """
    blobs: list[bytes | memoryview] = []
    tree = json.dumps(_encoded(content, blobs), separators=(",", ":")).encode()
    body = [len(tree).to_bytes(8, "little"), tree, *blobs]
    digest = hashlib.sha256(before)
    for piece in body:
        digest.update(piece)
    length = sum(map(len, body)).to_bytes(8, "little")
    return [length, digest.digest(), *body], digest.digest()


def _encoded(value: Any, blobs: list[bytes | memoryview]) -> Any:
    if value is None or isinstance(value, (bool, str)):
        return value
    if isinstance(value, int):
        return value if abs(value) < 2**63 else {"$integer": hex(value)}
    if isinstance(value, float):
        return {"$float": value.hex()}
    if isinstance(value, Fraction):
        return {"$fraction": [hex(value.numerator), hex(value.denominator)]}
    if isinstance(value, Enclosure):
        return {"$enclosure": [_encoded(part, blobs) for part in value]}
    if isinstance(value, (np.ndarray, np.generic)):
        array = np.asarray(value)
        if array.dtype.kind == "O":
            return {"$objects": [_encoded(item, blobs) for item in array.tolist()]}
        array = np.asarray(array, array.dtype.newbyteorder("<"), order="C")
        blobs.append(array.reshape(-1).view(np.uint8).data if array.size else b"")
        return {"$array": array.dtype.str, "shape": list(array.shape), "bytes": array.nbytes}
    if isinstance(value, (list, tuple)):
        items = [_encoded(item, blobs) for item in value]
        return items if isinstance(value, list) else {"$tuple": items}
    if isinstance(value, Mapping):
        if not all(isinstance(key, str) and not key.startswith("$") for key in value):
            raise TypeError("a checkpoint's names are strings that do not begin with $")
        return {key: _encoded(item, blobs) for key, item in value.items()}
    raise TypeError(f"a checkpoint cannot hold a {type(value).__name__}")


def _decoded(tree: bytes, body: memoryview) -> Any:
    """Return the value of a JSON tree; arrays are taken from `body` in the order of writing."""
    position = 0

    def decode(item: dict[str, Any]) -> Any:
        """Return what an object stands for, whose parts are decoded."""
        nonlocal position
        if "$integer" in item:
            return int(item["$integer"], 16)
        if "$float" in item:
            return float.fromhex(item["$float"])
        if "$fraction" in item:
            return Fraction(*(int(part, 16) for part in item["$fraction"]))
        if "$enclosure" in item:
            known = Enclosure(*item["$enclosure"])
            require(all(type(part) is Fraction for part in known), "an enclosure is not")
            return known
        if "$tuple" in item:
            return tuple(item["$tuple"])
        if "$objects" in item:
            array = np.empty(len(item["$objects"]), dtype=object)
            array[:] = item["$objects"]
            return array
        if "$array" in item:
            require(bool(_ARRAY.fullmatch(item["$array"])), "an array is of another kind")
            kind = np.dtype(item["$array"])
            data = body[position : position + item["bytes"]]
            position += item["bytes"]
            array = np.frombuffer(data, kind).reshape(item["shape"])
            if array.nbytes < _LARGE or not kind.isnative:
                array = array.astype(kind.newbyteorder("="))  # a copy of its own, writable
            return array
        return item

    return json.loads(tree, object_hook=decode)


def to_bytes(content: Mapping[str, Any]) -> bytes:
    """Return a file of one record; see `packed`."""
    return b"".join([_LINE, *packed(content)[0]])


def from_bytes(data: bytes | memoryview, name: str = "checkpoint") -> dict[str, Any]:
    """Return what the first record of a file holds, or raise `InputError`; `name` is the file's."""
    content: dict[str, Any] = _records(memoryview(data), name)[0][0]
    return content


def read(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Return what the first record of a file holds, or raise `InputError`."""
    return from_bytes(_content(path, os.fspath(path)), os.fspath(path))


def _content(path: str | os.PathLike[str], name: str) -> memoryview:
    """Return the bytes of a file, which stay there until somebody needs them."""
    file_name(path, "checkpoint")
    if not Path(path).is_file():
        raise InputError("checkpoint", name, "must be a file")
    try:
        with open(name, "rb") as file:
            there = os.fstat(file.fileno()).st_size
            return memoryview(
                mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) if there else b""
            )
    except OSError as error:
        raise InputError("checkpoint", name, f"cannot be read: {error.strerror}") from None


def _records(data: memoryview, name: str) -> tuple[list[Any], int, bytes, bool]:
    """Return the records of a file, where they end, their digest, and whether that is the end."""
    line = _FIRST_LINE.match(data)
    if line is None:
        raise InputError("checkpoint", name, "is not a checkpoint of exactcreep")
    if int(line[1]) != VERSION:
        told = f"is of version {int(line[1])}; this program reads version {VERSION}: let the"
        raise InputError("checkpoint", name, f"{told} version that wrote it go on, or begin again")
    place, digest, records = line.end(), b"", []
    while place + _HEAD <= len(data):
        begin = place + _HEAD
        end = begin + int.from_bytes(data[place : place + 8], "little")
        if end > len(data):
            break
        body = data[begin:end]
        made = hashlib.sha256(digest)
        made.update(body)
        if made.digest() != data[place + 8 : begin]:
            raise InputError("checkpoint", name, "is damaged: its checksum does not match")
        split = 8 + int.from_bytes(body[:8], "little")
        try:
            records.append(_decoded(bytes(body[8:split]), body[split:]))
            require(isinstance(records[-1], dict), "it holds no names")
        except (ValueError, TypeError, KeyError, ArithmeticError, RecursionError) as error:
            raise _refusal(name, error) from None
        place, digest = end, made.digest()
    if not records:
        raise InputError("checkpoint", name, f"is truncated or damaged: it holds {len(data)} bytes")
    return records, place, digest, place == len(data)
