"""Data of runs as JSON texts, exactly: numbers of any kind, arrays, tuples, and back."""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exactcreep.model.enclosure import Enclosure, enclosure

_MOST_PARTS, _PART = 10**6, 30  # lists and objects in a text; bytes for each further one


def text_of(value: Any) -> str:
    """Return data as a JSON text, or raise `TypeError`."""
    return json.dumps(_encoded(value), separators=(",", ":"))


def value_of(text: bytes | str) -> Any:
    """Return the data in a text of `text_of`, or raise any exception."""
    begins = ("[", "{") if isinstance(text, str) else (b"[", b"{")
    if sum(map(text.count, begins)) > _MOST_PARTS + len(text) // _PART:  # type: ignore[arg-type]
        raise ValueError("it consists of too many parts")
    return json.loads(text, object_hook=_decoded)


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
            raise TypeError("names in a file are strings that do not begin with $")
        return {key: _encoded(item) for key, item in value.items()}
    number = enclosure(value)  # raises TypeError if it is no number
    return _encoded(number if number.radius else number.middle)


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
        return Enclosure(*map(Fraction, parts))
    if kind == "$objects":
        objects: NDArray[Any] = np.empty(len(parts), dtype=object)
        objects[:] = parts
        return objects
    name, shape, data = parts
    held = np.frombuffer(base64.b64decode(data), np.dtype(name)).reshape(shape)
    return held.astype(held.dtype.newbyteorder("="))  # a writable copy
