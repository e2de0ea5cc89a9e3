"""Write files completely or not at all, and lock growing files for one process at a time."""

from __future__ import annotations

import os
import secrets
import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib import import_module
from pathlib import Path
from typing import Any, BinaryIO

from exactcreep.model.numbers import InputError

PICTURES = (".png", ".pdf", ".svg")
_EXISTS = "exists and is not overwritten without force"
_PATIENCE = 0.2  # seconds to wait for another process that is about to end


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
        raise InputError(field, os.fspath(path), _EXISTS)
    return Path(path)


def _regular_file(path: str | os.PathLike[str], field: str) -> Path:
    """Return the writable regular file, existing or not, to which links at `path` lead."""
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


def output_directory(path: str | os.PathLike[str], field: str) -> Path:
    """Return `path` as an existing or new directory for output, or raise `InputError`."""
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


def _lock(file: BinaryIO) -> None:
    """Lock an open part for this process; raise OSError or ImportError if that is not possible."""
    import_module("fcntl").flock(file.fileno(), 6)  # LOCK_EX | LOCK_NB


def _new_part(target: Path) -> BinaryIO:
    """Return an open part beside the file; it replaces a part that a killed process left."""
    part = target.with_name(f".{target.name}.part")
    with suppress(OSError, ImportError), open(part, "rb") as left:
        _lock(left)
        part.unlink()
    if part.exists():  # another process writes it, or the file system has no locks
        part = target.with_name(f".{target.name}.{secrets.token_hex(4)}.part")
    file = open(part, "xb")  # noqa: SIM115
    with suppress(OSError, ImportError):
        _lock(file)
    return file


def write_file(
    path: str | os.PathLike[str], content: bytes | memoryview, field: str, *, force: bool = True
) -> None:
    """Write `content` to a file, completely or not at all, even if the power fails.

    The content is written to a part beside the file, which then takes its name; links are followed.
    Raises `InputError` with the name `field` if the file exists and `force` is false, or it cannot
    be written.
    """
    target = _regular_file(path, field)
    try:
        with _new_part(target) as file:
            try:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
                if target.exists() and not force:
                    raise InputError(field, os.fspath(path), _EXISTS)
                if os.name != "posix":  # here an open file cannot be renamed
                    file.close()
                os.replace(file.name, target)
            except BaseException:
                os.unlink(file.name)
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


@contextmanager
def locked(path: str | os.PathLike[str], field: str) -> Iterator[None]:
    """Lock a file or a folder during a block; `InputError` names the process that has the lock.

    The lock belongs to the operating system, and is on a hidden file beside it. A hidden file that
    a killed process left behind locks nothing.
    """
    target = Path(os.path.realpath(path))
    beside = target.with_name(f".{target.name}.lock")
    filelock = import_module("filelock")  # imported late: only writers need it
    # a lock without the operating system's would outlive a killed process
    lock = filelock.FileLock(beside, fallback_to_soft=False, on_acquired=_say_who_holds)
    holder = _holder(beside)
    while not lock.is_locked:
        try:
            beside.touch()  # fails where no file can be made; then no other process is to blame
            lock.acquire(timeout=_PATIENCE)
        except _RemovedMeanwhile:
            pass
        except filelock.Timeout:
            allowed = f"is being written by {holder or _holder(beside) or 'another process'}"
            raise InputError(field, os.fspath(path), f"{allowed}: wait for its end") from None
        except OSError as error:
            reason = f"cannot be locked: {error.strerror or error}"
            raise InputError(field, os.fspath(path), reason) from None
    try:
        yield
    finally:
        with suppress(OSError):
            beside.unlink()
        lock.release()


class _RemovedMeanwhile(Exception):
    """The previous holder removed the locked file: lock the next one."""


def _say_who_holds(descriptor: int) -> None:
    if os.fstat(descriptor).st_nlink == 0:
        raise _RemovedMeanwhile
    with suppress(OSError):  # the lock holds without this text, too
        os.ftruncate(descriptor, 0)
        os.write(descriptor, f"process {os.getpid()} on {socket.gethostname()}".encode())


def _holder(lock: Path) -> str:
    """Return the text of the process that holds a lock; "" if that cannot be read."""
    with suppress(OSError, UnicodeDecodeError):
        return lock.read_text("utf-8")[:200]
    return ""
