"""Checkpoint files: plain data, checksummed, written in one piece or not at all.

A file is a line that names the format and its version, the length and the SHA-256 of what
follows, and then that: a JSON tree and the bytes of its arrays, little-endian. Nothing in it
is ever executed.
"""

from __future__ import annotations

import hashlib
import json
import mmap
import os
import re
from collections.abc import Mapping
from enum import Enum
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from exactcreep.model.numbers import InputError
from exactcreep.model.outcome import Outcome
from exactcreep.quasistatic.decimals import Enclosure
from exactcreep.quasistatic.files import file_name, write_file
from exactcreep.quasistatic.march import Course, Mark, Samples
from exactcreep.solvers.solver import Tally

VERSION = 6
"""Of the solvers' arrays, too: it steps when a row or a cell of theirs is added."""
_FIRST_LINE = re.compile(rb"exactcreep checkpoint (\d{1,6})\n")
_LINE = b"exactcreep checkpoint %d\n"
_HEADER = 8 + 32  # length and SHA-256 of the body
_LARGE = 2**26  # bytes from which an array is read where it stands in the file
_KINDS = "biufUS"  # array types that are plain bytes
_TYPES = {kind.__name__: kind for kind in (Outcome, Enclosure, Tally, Mark, Course, Samples)}
"""What is kept by its name and its parts."""


def _encoded(value: Any, blobs: list[bytes | memoryview]) -> Any:
    if value is None or isinstance(value, (bool, str)):
        return value
    name = type(value).__name__
    if isinstance(value, _TYPES.get(name, ())):
        return {"$is": name, "of": _encoded(_parts(value), blobs)}
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
        if array.dtype.kind not in _KINDS:
            raise TypeError(f"a checkpoint cannot hold an array of {array.dtype}")
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


def _decoded(value: Any, body: memoryview) -> Any:
    """Return the value of a JSON tree; arrays are taken from `body` in the order of writing."""
    position = 0

    def decode(item: Any) -> Any:
        nonlocal position
        if isinstance(item, list):
            return [decode(part) for part in item]
        if not isinstance(item, dict):
            return item
        if "$integer" in item:
            return int(item["$integer"], 16)
        if "$float" in item:
            return float.fromhex(item["$float"])
        if "$fraction" in item:
            numerator, denominator = item["$fraction"]
            return Fraction(int(numerator, 16), int(denominator, 16))
        if "$tuple" in item:
            return tuple(decode(part) for part in item["$tuple"])
        if "$is" in item:
            return _TYPES[item["$is"]](**decode(item["of"]))
        if "$objects" in item:
            parts = [decode(part) for part in item["$objects"]]
            array = np.empty(len(parts), dtype=object)
            for k, part in enumerate(parts):  # tuples, too, are one item each
                array[k] = part
            return array.reshape(item["shape"])
        if "$array" in item:
            kind = np.dtype(item["$array"])
            if kind.kind not in _KINDS:
                raise ValueError("an array of an unknown kind")
            data = body[position : position + item["bytes"]]
            position += item["bytes"]
            array = np.frombuffer(data, kind).reshape(item["shape"])
            if array.nbytes < _LARGE or not kind.isnative:
                array = array.astype(kind.newbyteorder("="))  # a copy of its own, writable
            return array[()] if item.get("scalar") else array
        return {key: decode(part) for key, part in item.items()}

    return decode(value)


def to_bytes(content: Mapping[str, Any]) -> bytes:
    """Return the checkpoint that holds `content`; see `pieces`."""
    return b"".join(pieces(content))


def pieces(content: Mapping[str, Any]) -> list[bytes | memoryview]:
    """Return the checkpoint that holds `content`, arrays as they stand in memory or in files.

    Parameters
    ----------
    content : mapping
        Of names to None, truth values, numbers, strings, rationals, arrays, and lists, tuples
        and mappings of them.
    """
    blobs: list[bytes | memoryview] = []
    tree = json.dumps(_encoded(content, blobs), separators=(",", ":")).encode()
    body = [len(tree).to_bytes(8, "little"), tree, *blobs]
    digest, length = hashlib.sha256(), sum(map(len, body))
    for piece in body:
        digest.update(piece)
    return [_LINE % VERSION, length.to_bytes(8, "little"), digest.digest(), *body]


def from_bytes(data: bytes | memoryview, name: str = "checkpoint") -> dict[str, Any]:
    """Return what the checkpoint `data` holds; `name` is the file's, for the message.

    Raises
    ------
    InputError
        If it is no checkpoint, or a damaged or truncated one, or of another version.
    """
    line = _FIRST_LINE.match(data)
    if line is None:
        raise InputError("checkpoint", name, "is not a checkpoint of exactcreep")
    if int(line[1]) != VERSION:
        raise InputError(
            "checkpoint",
            name,
            f"is of version {int(line[1])}; this program reads version {VERSION}: let the version"
            " that wrote it go on, or begin again",
        )
    start = line.end() + _HEADER
    length = int.from_bytes(data[line.end() : line.end() + 8], "little")
    if len(data) < start + length or len(data) < start:
        raise InputError(
            "checkpoint",
            name,
            f"is truncated or damaged: it holds {len(data)} of {start + length} bytes",
        )
    body = memoryview(data)[start:]
    if len(body) != length or hashlib.sha256(body).digest() != data[line.end() + 8 : start]:
        raise InputError("checkpoint", name, "is damaged: its checksum does not match")
    try:
        end = 8 + int.from_bytes(body[:8], "little")
        content = _decoded(json.loads(bytes(body[8:end])), body[end:])
    except (ValueError, TypeError, KeyError, RecursionError) as error:
        raise InputError("checkpoint", name, f"cannot be understood: {error}") from None
    if not isinstance(content, dict):
        raise InputError("checkpoint", name, "cannot be understood: it holds no names")
    return content


def write(
    path: str | os.PathLike[str], content: Mapping[str, Any], *, force: bool = True
) -> None:
    """Write a checkpoint; whatever happens, `path` holds the previous one or the new one.

    Parameters
    ----------
    path : path
    content : mapping
    force : bool
        Whether a file that exists is replaced.

    Raises
    ------
    InputError
        If it cannot be written.
    TypeError
        If it would hold what a checkpoint cannot hold.
    """
    write_file(path, pieces(content), "checkpoint", force=force)


def read(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Return what the checkpoint file `path` holds.

    Raises
    ------
    InputError
        If it cannot be read, is no checkpoint, a damaged or truncated one, or of another version.
    """
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
