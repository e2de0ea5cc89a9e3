"""Checkpoint files: plain data, checksummed, written in one piece or not at all.

A file is a line that names the format and its version, the length and the SHA-256 of what
follows, and then that: a JSON tree and the bytes of its arrays, little-endian. Nothing in it
is ever executed.
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
from enum import Enum
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from exactcreep import __version__
from exactcreep.model.enclosure import Enclosure
from exactcreep.model.numbers import InputError, nearest_float, number_from_zero
from exactcreep.model.outcome import Outcome
from exactcreep.quasistatic.experiment import Experiment
from exactcreep.quasistatic.files import check_output, file_name, write_file
from exactcreep.quasistatic.history import CycleEnds, Mark, Samples
from exactcreep.solvers.solver import Tally

VERSION = 6
"""Of the solvers' arrays, too: it steps when a row or a cell of theirs is added."""
_FIRST_LINE = re.compile(rb"exactcreep checkpoint (\d{1,6})\n")
_LINE = b"exactcreep checkpoint %d\n"
_HEADER = 8 + 32  # length and SHA-256 of the body
_LARGE = 2**26  # bytes from which an array is read where it stands in the file
_TYPES: dict[str, Any] = {
    "Outcome": Outcome,
    "Enclosure": Enclosure,
    "Tally": Tally,
    "Mark": Mark,
    "Course": CycleEnds,
    "Samples": Samples,
}
"""What is kept by a name and its parts."""
_NAMES = {kind: name for name, kind in _TYPES.items()}


class CheckpointWarning(UserWarning):
    """The checkpoint of a run could not be written; the run goes on, and tries again."""


class Checkpoint:
    """The checkpoint file of one or more runs: written when it is due, and read again.

    Attributes
    ----------
    path : str
    every : float
        Seconds between two writings.
    note : mapping
        What a caller wants to find in it.
    experiments : list of Experiment
    captured : list of mapping
        How far each of them has come, None of those that have not begun.
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
        self.note = note or {}
        self.experiments: list[Experiment] = []
        self.captured: list[Mapping[str, Any] | None] = []
        self.stale = ""
        self._force = force
        self._last = -math.inf

    @classmethod
    def read(cls, path: str | os.PathLike[str], every: Any = 60) -> Checkpoint:
        """Return the checkpoint in a file, which will be overwritten, or raise `InputError`."""
        content = read(path)
        found = cls(path, every, force=True)
        try:
            members, found.note = content["members"], content["note"]
            for member in members:
                found.experiments.append(Experiment.from_description(member["experiment"]))
                found.captured.append(member["captured"])
        except InputError:
            raise
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            allowed = f"is not a checkpoint of a run: {error}"
            raise InputError("checkpoint", found.path, allowed) from None
        return found

    def begin(self, experiments: Sequence[Experiment]) -> None:
        """Take over the experiments that are to be run, unless they are those of the file."""
        if not self.experiments:
            self.experiments, self.captured = list(experiments), [None] * len(experiments)

    def due(self) -> bool:
        """Return whether the file is older than it should be."""
        return time.monotonic() - self._last >= self.every

    def write(self) -> None:
        """Write the file; if that fails now, but did not at first, warn, and be due again."""
        members = [
            {"experiment": experiment.description(), "captured": captured}
            for experiment, captured in zip(self.experiments, self.captured, strict=True)
        ]
        content = {"version": __version__, "note": dict(self.note), "members": members}
        started = math.isfinite(self._last)
        self._last = time.monotonic()
        try:
            write_file(self.path, pieces(content), "checkpoint", force=self._force or started)
        except TypeError as error:
            raise InputError("checkpoint", self.path, f"cannot be written: {error}") from None
        except InputError as error:
            if not started:
                raise
            if not self.stale:
                warnings.warn(f"{error}; the run goes on", CheckpointWarning, stacklevel=4)
            self.stale = str(error)
        else:
            self.stale = ""


def _encoded(value: Any, blobs: list[bytes | memoryview]) -> Any:
    if value is None or isinstance(value, (bool, str)):
        return value
    if type(value) in _NAMES:
        return {"$is": _NAMES[type(value)], "of": _encoded(_parts(value), blobs)}
    if isinstance(value, int):
        return value if abs(value) < 2**63 else {"$integer": hex(value)}
    if isinstance(value, float):
        return {"$float": value.hex()}
    if isinstance(value, Fraction):
        return {"$fraction": [hex(value.numerator), hex(value.denominator)]}
    if isinstance(value, (np.ndarray, np.generic)):
        array = np.asarray(value)
        if array.dtype.kind == "O":
            items = [_encoded(item, blobs) for item in array.ravel().tolist()]
            return {"$objects": items, "shape": list(array.shape)}
        array = np.asarray(array, array.dtype.newbyteorder("<"), order="C")
        blobs.append(array.reshape(-1).view(np.uint8).data if array.size else b"")
        kept = {"$array": array.dtype.str, "shape": list(array.shape), "bytes": array.nbytes}
        return kept | ({"scalar": True} if isinstance(value, np.generic) else {})
    if isinstance(value, (list, tuple)):
        items = [_encoded(item, blobs) for item in value]
        return items if isinstance(value, list) else {"$tuple": items}
    if isinstance(value, Mapping):
        if not all(isinstance(key, str) and not key.startswith("$") for key in value):
            raise TypeError("a checkpoint's names are strings that do not begin with $")
        return {key: _encoded(item, blobs) for key, item in value.items()}
    raise TypeError(f"a checkpoint cannot hold a {type(value).__name__}")


def _parts(value: Any) -> dict[str, Any]:
    """Return what makes a value of `_TYPES` again."""
    if isinstance(value, Enum):
        return {"value": value.value}
    return value._asdict() if isinstance(value, Enclosure) else dict(vars(value))


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
        if "$tuple" in item:
            return tuple(item["$tuple"])
        if "$is" in item:
            return _TYPES[item["$is"]](**item["of"])
        if "$objects" in item:
            array = np.empty(len(item["$objects"]), dtype=object)
            for k, part in enumerate(item["$objects"]):  # tuples, too, are one item each
                array[k] = part
            return array.reshape(item["shape"])
        if "$array" in item:
            kind = np.dtype(item["$array"])
            data = body[position : position + item["bytes"]]
            position += item["bytes"]
            array = np.frombuffer(data, kind).reshape(item["shape"])
            if array.nbytes < _LARGE or not kind.isnative:
                array = array.astype(kind.newbyteorder("="))  # a copy of its own, writable
            return array[()] if item.get("scalar") else array
        return item

    return json.loads(tree, object_hook=decode)


def to_bytes(content: Mapping[str, Any]) -> bytes:
    """Return the checkpoint that holds `content`; see `pieces`."""
    return b"".join(pieces(content))


def pieces(content: Mapping[str, Any]) -> list[bytes | memoryview]:
    """Return the checkpoint that holds `content`, arrays as they stand in memory or in files.

    It may hold None, truth values, numbers, strings, rationals, arrays, values of `_TYPES`, and
    lists, tuples and mappings of these.
    """
    blobs: list[bytes | memoryview] = []
    tree = json.dumps(_encoded(content, blobs), separators=(",", ":")).encode()
    body = [len(tree).to_bytes(8, "little"), tree, *blobs]
    digest, length = hashlib.sha256(), sum(map(len, body))
    for piece in body:
        digest.update(piece)
    return [_LINE % VERSION, length.to_bytes(8, "little"), digest.digest(), *body]


def from_bytes(data: bytes | memoryview, name: str = "checkpoint") -> dict[str, Any]:
    """Return what the checkpoint `data` holds, or raise `InputError`; `name` is the file's."""
    refusal = partial(InputError, "checkpoint", name)
    line = _FIRST_LINE.match(data)
    if line is None:
        raise refusal("is not a checkpoint of exactcreep")
    if int(line[1]) != VERSION:
        raise refusal(
            f"is of version {int(line[1])}; this program reads version {VERSION}: let the version"
            " that wrote it go on, or begin again"
        )
    start = line.end() + _HEADER
    whole = start + int.from_bytes(data[line.end() : line.end() + 8], "little")
    if len(data) < whole:
        raise refusal(f"is truncated or damaged: it holds {len(data)} of {whole} bytes")
    body = memoryview(data)[start:]
    if len(data) > whole or hashlib.sha256(body).digest() != data[line.end() + 8 : start]:
        raise refusal("is damaged: its checksum does not match")
    try:
        end = 8 + int.from_bytes(body[:8], "little")
        content = _decoded(bytes(body[8:end]), body[end:])
    except (ValueError, TypeError, KeyError, RecursionError) as error:
        raise refusal(f"cannot be understood: {error}") from None
    if not isinstance(content, dict):
        raise refusal("cannot be understood: it holds no names")
    return content


def read(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Return what the checkpoint file `path` holds, or raise `InputError`."""
    name = file_name(path, "checkpoint")
    if not Path(path).is_file():
        raise InputError("checkpoint", name, "must be a file")
    try:
        with open(name, "rb") as file:
            there = os.fstat(file.fileno()).st_size
            # large arrays stay in the file until somebody needs them
            data = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) if there else b""
    except OSError as error:
        raise InputError("checkpoint", name, f"cannot be read: {error.strerror}") from None
    return from_bytes(memoryview(data), name)
