"""Read a file from somebody else: with a bounded size, or refused in a sentence with its name."""

from __future__ import annotations

import gzip
import io
import os
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

from exactcreep.model.numbers import InputError, shown

_GZIP = b"\x1f\x8b"
_LONGEST_REASON = 200
_WORDS: dict[type[Exception], str] = {
    RecursionError: "it is nested too deeply",
    MemoryError: "it claims more than the memory holds",
    KeyError: "it lacks {}",
    ZeroDivisionError: "it holds a division by zero",
    TypeError: "it is damaged, or another program has made it",
    AttributeError: "it is damaged, or another program has made it",
}
"""Explanations of errors whose own text is too short."""


@contextmanager
def refused(name: str, shown: str, why: str = "cannot be read") -> Iterator[None]:
    """Turn every error of a block that reads a file into an `InputError` that names the file."""
    try:
        yield
    except Exception as error:
        said = _WORDS.get(type(error), "{}").format(error)
        if isinstance(error, InputError) and isinstance(error.value, str) and error.value == shown:
            if error.name == name:
                raise
            said = error.allowed
        reason = " ".join(said.split()) or type(error).__name__
        raise InputError(name, shown, f"{why}: {reason[:_LONGEST_REASON]}") from error


@contextmanager
def opened(path: str | os.PathLike[str], name: str, most: int) -> Iterator[BinaryIO]:
    """Open a regular file of at most so many bytes, or raise `InputError`."""
    shown, place = os.fspath(path), Path(path)
    try:
        file = place.open("rb") if place.is_file() else None
    except OSError as error:
        raise InputError(name, shown, f"cannot be read: {error.strerror}") from None
    if file is None:
        raise InputError(name, shown, "must be an existing file, and no directory or device")
    with file:
        if os.fstat(file.fileno()).st_size > most:
            raise InputError(name, shown, f"must have at most {most // 2**20} MiB")
        yield file


def content_of(path: str | os.PathLike[str], name: str, most: int) -> bytes:
    """Return the content of a regular file of at most so many bytes, or raise `InputError`."""
    with opened(path, name, most) as file, refused(name, os.fspath(path)):
        return file.read(os.fstat(file.fileno()).st_size)


def unpacked(content: bytes, name: str, shown: str, most: int) -> bytes:
    """Return gzip's content unpacked, or any other content; at most so many bytes."""
    if not content.startswith(_GZIP):
        return content
    with refused(name, shown, "must be packed by gzip"):
        data = gzip.GzipFile(fileobj=io.BytesIO(content)).read(most + 1)
    if len(data) > most:
        raise InputError(name, shown, f"must have at most {most // 2**20} MiB when unpacked")
    return data


def text_of(content: bytes, name: str, shown: str) -> str:
    """Return bytes as UTF-8 text, or raise `InputError`."""
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        allowed = f"must be UTF-8 text; line {line} holds another byte"
        raise InputError(name, shown, allowed) from None


def difference(
    known: Mapping[str, Any], wanted: Mapping[str, Any], text: Callable[[Any], str]
) -> str:
    """Say the first dotted key whose values differ in their texts; "" if there is none."""
    there, here = dict(leaves(known)), dict(leaves(wanted))
    for key in {**here, **there}:
        if text(there.get(key)) != text(here.get(key)):
            return f"{key} is {shown(there.get(key))} there, and {shown(here.get(key))} here"
    return ""


def leaves(
    table: Mapping[str, Any], prefix: str = "", whole: Collection[str] = ()
) -> Iterator[tuple[str, Any]]:
    """Yield dotted keys and values; a table with a key among `whole` is itself a value."""
    for key, value in table.items():
        if isinstance(value, Mapping) and not {*whole} & {*value}:
            yield from leaves(value, f"{prefix}{key}.", whole)
        else:
            yield f"{prefix}{key}", value
