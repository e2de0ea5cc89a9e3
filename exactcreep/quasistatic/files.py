"""Write files in one piece or not at all: a part beside the target, fsync, rename."""

from __future__ import annotations

import io
import itertools
import os
import secrets
from collections.abc import Callable
from pathlib import Path
from typing import Any

from exactcreep.model.numbers import InputError

PICTURES = (".png", ".pdf", ".svg")
Content = bytes | memoryview | Callable[[io.FileIO], None]


class Occupied(InputError):
    def __init__(self, field: str, value: str, allowed: str = "") -> None:
        super().__init__(field, value, allowed or "exists and is not overwritten without force")


def file_name(value: Any, field: str) -> str:
    """Return `value` as the name of a file, or raise `InputError` if no file can have it."""
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
    """Return `path` if a file can be written there, else raise `InputError`."""
    if _regular_file(path, field).exists() and not force:
        raise Occupied(field, os.fspath(path))
    return Path(path)


def _regular_file(path: str | os.PathLike[str], field: str) -> Path:
    """Return the file, there or not yet, to which links at `path` lead, if it can be written."""
    name = file_name(path, field)
    target = Path(os.path.realpath(name))
    there, irregular = target.exists(), "must be a regular file, not a device, a pipe or a socket"
    for wrong, allowed in (
        (target.is_dir(), "must be a file, not a directory"),
        (there and not target.is_file(), irregular),
        (Path(name).is_symlink() and not there, "must not be a link to a file that does not exist"),
        (not target.parent.is_dir(), "must lie in a directory that exists"),
        (not os.access(target.parent, os.W_OK), "must lie in a directory that can be written"),
    ):
        if wrong:
            raise InputError(field, name, allowed)
    return target


def free_name(path: str | os.PathLike[str]) -> Path:
    """Return ``run-2.nc``, ``run-3.nc``, ... for ``run.nc``: the first that does not exist."""
    taken = Path(path)
    names = (taken.with_name(f"{taken.stem}-{k}{taken.suffix}") for k in itertools.count(2))
    return next(name for name in names if not os.path.lexists(name))


def output_directory(path: str | os.PathLike[str], field: str) -> Path:
    """Return `path` as a directory for output, made if it does not exist, or raise `InputError`."""
    target = Path(file_name(path, field))
    try:
        target.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise InputError(field, str(target), "must be a directory") from None
    except OSError as error:
        raise InputError(field, str(target), f"cannot be made: {error.strerror}") from None
    return target


def check_picture(path: Path) -> None:
    if path.suffix.lower() not in PICTURES:
        raise InputError("plot", str(path), "must end in " + ", ".join(PICTURES))


class _Part(io.FileIO):
    """A new file beside its target, for libraries that must not see a disk fill up.

    Once writing has failed nothing more is written, and `failed` holds the error.
    """

    def __init__(self, target: Path) -> None:
        self.path = target.with_name(f".{target.name}.{secrets.token_hex(4)}.part")
        # made, as any file, with the permissions that the user's mask leaves
        flags = os.O_RDWR | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0)
        super().__init__(os.open(self.path, flags, 0o666), "r+")
        self.failed: OSError | None = None

    def write(self, data: Any) -> int:
        rest = memoryview(data).cast("B")
        length = len(rest)
        try:
            while len(rest) and self.failed is None:
                rest = rest[super().write(rest) :]
        except OSError as error:
            self.failed = error
        self.seek(len(rest), io.SEEK_CUR)
        return length

    def truncate(self, size: int | None = None) -> int:
        try:
            return super().truncate(size)
        except OSError as error:
            self.failed = self.failed or error
            return self.tell() if size is None else size


def _name(part: Path, target: Path, *, force: bool) -> None:
    """Give a part its name, or raise `FileExistsError` if that is taken."""
    if not force:
        try:
            os.link(part, target)
            return
        except FileExistsError:
            raise
        except OSError:  # a file system without links
            os.close(os.open(target, os.O_WRONLY | os.O_CREAT | os.O_EXCL))
    os.replace(part, target)


def write_file(
    path: str | os.PathLike[str], content: Content, field: str, *, force: bool = True
) -> None:
    """Make `content` that of a file, in one piece or not at all, even if the power fails.

    Links are followed. Raises `Occupied` if the file exists, perhaps since a moment ago, without
    `force`; `InputError`, with the name `field`, if it cannot be written.
    """
    target = _regular_file(path, field)
    try:
        with _Part(target) as part:
            try:
                if callable(content):
                    content(part)
                else:
                    part.write(content)
                if part.failed is not None:
                    raise part.failed
                os.fsync(part.fileno())
                _name(part.path, target, force=force)
            finally:
                part.path.unlink(missing_ok=True)
        if os.name == "posix":  # the new name, too, must be on the disk
            folder = os.open(target.parent, os.O_RDONLY)
            try:
                os.fsync(folder)
            finally:
                os.close(folder)
    except FileExistsError:
        raise Occupied(field, os.fspath(path)) from None
    except OSError as error:
        reason = f"cannot be written: {error.strerror or error}"
        raise InputError(field, os.fspath(path), reason) from None
