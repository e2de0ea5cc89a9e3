"""Read a file that the user names, whole, or refuse it in a sentence."""

from __future__ import annotations

import os
from pathlib import Path

from exactcreep.model.numbers import InputError


def content_of(path: Path, field: str, most: int) -> bytes:
    """Return the content of a regular file of at most so many bytes, or raise `InputError`."""
    shown = os.fspath(path)
    try:
        if path.is_dir():
            raise InputError(field, shown, "is a directory, and must be a file")
        if not path.exists():
            raise InputError(field, shown, "must be an existing file")
        if not path.is_file():
            raise InputError(field, shown, "must be a regular file")
        with path.open("rb") as stream:
            content = stream.read(most + 1)
    except OSError as error:
        reason = error.strerror or type(error).__name__
        raise InputError(field, shown, f"cannot be read: {reason}") from None
    if len(content) > most:
        raise InputError(field, shown, f"must have at most {most // 2**20} MiB")
    return content


def text_of(content: bytes, field: str, shown: str) -> str:
    """Return bytes as the text that they are in UTF-8, or raise `InputError`."""
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        allowed = f"must be UTF-8 text; line {line} holds another byte"
        raise InputError(field, shown, allowed) from None
