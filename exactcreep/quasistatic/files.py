"""Files for output: may one be written there, and written in one piece or not at all."""

from __future__ import annotations

import os
import secrets
from pathlib import Path
from typing import Any

from exactcreep.model.numbers import InputError

PICTURES = (".png", ".pdf", ".svg")


def file_name(value: Any, field: str) -> str:
    """Return `value` as the name of a file.

    Raises
    ------
    InputError
        If it is neither a string nor a path, is empty or too long, or holds a null character.
    """
    if not isinstance(value, (str, os.PathLike)):
        raise InputError(field, value, "must be the name of a file")
    name = os.fspath(value)
    if not isinstance(name, str) or not name or "\0" in name:
        raise InputError(field, value, "must be a file, named without null characters")
    try:
        os.lstat(name)
    except FileNotFoundError:
        pass
    except (OSError, UnicodeError) as error:
        reason = getattr(error, "strerror", None) or "no such name can be"
        raise InputError(field, name, f"must be the name of a file: {reason}") from None
    return name


def check_output(path: str | os.PathLike[str], field: str, *, force: bool) -> Path:
    """Return `path` if a file can be written there.

    Raises
    ------
    InputError
        If it is a directory, exists and `force` is not given, or its directory cannot be written.
    """
    name = file_name(path, field)
    target = Path(name)
    if target.is_dir():
        raise InputError(field, name, "must be a file, not a directory")
    if target.exists() and not force:
        raise InputError(field, name, "exists and is not overwritten without force")
    if not target.parent.is_dir():
        raise InputError(field, name, "must lie in a directory that exists")
    if not os.access(target.parent, os.W_OK):
        raise InputError(field, name, "must lie in a directory that can be written")
    return target


def output_directory(path: str | os.PathLike[str], field: str) -> Path:
    """Return `path` as a directory for output, made if it does not exist.

    Raises
    ------
    InputError
        If it is a file, or cannot be made.
    """
    name = file_name(path, field)
    target = Path(name)
    if target.exists() and not target.is_dir():
        raise InputError(field, name, "must be a directory")
    try:
        target.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(field, name, f"cannot be made: {error.strerror}") from None
    return target


def check_picture(path: Path) -> None:
    """Raise `InputError` unless the name ends like that of a picture."""
    if path.suffix.lower() not in PICTURES:
        raise InputError("plot", str(path), "must end in " + ", ".join(PICTURES))


def check_plot(path: str | os.PathLike[str], *, force: bool) -> None:
    """Raise `InputError` unless a picture can be written there, and its name ends like one."""
    check_picture(check_output(path, "plot", force=force))


def write_file(path: str | os.PathLike[str], data: bytes | memoryview, field: str) -> None:
    """Make `data` the content of a file, in one piece or not at all, even if the power fails.

    Parameters
    ----------
    path : path
    data : bytes
    field : str
        The name used in the error message.

    Raises
    ------
    InputError
        If it cannot be written, on a full disk for instance; what was there before is still there.
    """
    target = Path(path)
    part = target.with_name(f".{target.name}.{secrets.token_hex(4)}.part")
    try:
        try:
            # made, as any file, with the permissions that the user's mask leaves
            with open(os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666), "wb") as file:
                file.write(data)
                file.flush()
                os.fsync(file.fileno())
            os.replace(part, target)
        except BaseException:
            part.unlink(missing_ok=True)
            raise
        if os.name == "posix":  # the new name, too, must be on the disk
            folder = os.open(target.parent, os.O_RDONLY)
            try:
                os.fsync(folder)
            finally:
                os.close(folder)
    except OSError as error:
        reason = f"cannot be written: {error.strerror or error}"
        raise InputError(field, os.fspath(path), reason) from None
