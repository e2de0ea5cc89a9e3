"""NetCDF files of datasets: made in memory and sealed with a digest, and read with suspicion.

HDF5 brings its process down when a disk is full, and can search a damaged file for ever. A file is
therefore made in memory, and ends with the SHA-256 of itself (behind the end that HDF5 knows of);
one that does not is first read through by another process, whose time is limited.
"""

from __future__ import annotations

import contextlib
import hashlib
import importlib
import io
import math
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import h5netcdf
import h5py
import xarray as xr
from xarray.backends import H5NetCDFStore

from exactcreep.limits import MEMORY
from exactcreep.model.numbers import InputError
from exactcreep.quasistatic.files import file_name
from exactcreep.quasistatic.store import ScratchFile

_SEAL = re.compile(rb"\nexactcreep sha256 ([0-9a-f]{64})\n")
_SEAL_LENGTH = 84
_INFLATED = 1000
"""Bytes of values for each byte of a file: beyond what compression makes of true numbers."""
_CPU_SECONDS = 4.0
"""For a small file without a seal; a process needs one of them to begin."""
_BYTES_PER_SECOND = 20e6
_WALL_SECONDS = 60.0
"""For the same on a busy machine, or where the processor's time cannot be limited."""


def netcdf(groups: Mapping[str | None, xr.Dataset]) -> Iterator[bytes | memoryview]:
    """Yield the pieces of a NetCDF file that holds datasets in groups; None is the root.

    It is made in memory, and beyond `MEMORY` in a file without a name, which is read back.

    Raises
    ------
    InputError
        If that file cannot be written.
    """
    large = sum(dataset.nbytes for dataset in groups.values()) > MEMORY
    buffer = ScratchFile() if large else io.BytesIO()
    try:
        with h5netcdf.File(buffer, "w") as file:
            for group, dataset in groups.items():
                dataset.dump_to_store(H5NetCDFStore(file, group=group, mode="a"))
    finally:
        if isinstance(buffer, ScratchFile) and buffer.failed is not None:
            reason = f"cannot hold the file that is made: {buffer.failed.strerror}"
            raise InputError("TMPDIR", tempfile.gettempdir(), reason)
    digest = hashlib.sha256()
    for piece in buffer.pieces() if isinstance(buffer, ScratchFile) else [buffer.getbuffer()]:
        digest.update(piece)
        yield piece
    yield b"\nexactcreep sha256 %s\n" % digest.hexdigest().encode()


def read_groups(path: str | os.PathLike[str], field: str) -> dict[str | None, xr.Dataset]:
    """Return the datasets of a NetCDF file by their groups; None is the root.

    `InputError` names `field` if it is no file, or is damaged, or too short for what it claims.
    """
    name = file_name(path, field)
    if not Path(path).is_file():
        raise InputError(field, name, "must be a file")
    try:
        if not _sealed(name):
            _read_elsewhere(name)
        return _read(name)
    except Exception as error:  # what a damaged HDF5 file can raise is not written down
        reason = " ".join(str(error).split())[:200]
        raise InputError(field, name, f"cannot be read: {reason}") from None


def _sealed(name: str) -> bool:
    """Return whether a file ends with its digest; raise `ValueError` if with that of another."""
    with open(name, "rb") as file:
        size = file.seek(0, io.SEEK_END)
        file.seek(max(0, size - _SEAL_LENGTH))
        seal = _SEAL.fullmatch(file.read())
        if seal is None:
            return False
        file.seek(0)
        digest, left = hashlib.sha256(), size - _SEAL_LENGTH
        while left > 0:
            part = file.read(min(left, 1 << 20))
            digest.update(part)
            left -= len(part)
    if digest.hexdigest().encode() != seal[1]:
        raise ValueError("its checksum does not match")
    return True


def _read_elsewhere(name: str) -> None:
    """Have another process read a file; raise `ValueError` if it cannot, or takes too long."""
    seconds = Path(name).stat().st_size / _BYTES_PER_SECOND
    begin = f"from {__name__} import main; main()"
    words = [sys.executable, "-P", "-c", begin, name, str(_CPU_SECONDS + seconds)]
    paths = os.pathsep.join(path for path in sys.path if path)
    try:
        done = subprocess.run(
            words,
            env=os.environ | {"PYTHONPATH": paths},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=_WALL_SECONDS + 20 * seconds,
            check=False,
        )
    except subprocess.TimeoutExpired:
        reason = ""
    else:
        if done.returncode == 0:
            return
        reason = done.stdout.strip()
    raise ValueError(reason or "it is damaged so that reading it does not end")


def main() -> None:
    """Read the file that the command line names within so many seconds of the processor's time.

    What is wrong with it is printed.
    """
    name, seconds = sys.argv[1:]
    with contextlib.suppress(ImportError, ValueError):
        resource = importlib.import_module("resource")
        limit = math.ceil(float(seconds))
        resource.setrlimit(resource.RLIMIT_CPU, (limit, limit))
    try:
        _read(name)
    except Exception as error:
        print(error)
        sys.exit(1)


def _read(name: str) -> dict[str | None, xr.Dataset]:
    most = _INFLATED * Path(name).stat().st_size
    groups: list[str | None] = [None]

    def look(path: str, item: Any) -> None:
        if isinstance(item, h5py.Group):
            groups.append(path)
        elif isinstance(item, h5py.Dataset) and item.nbytes > most:
            raise ValueError(f"it is too short for the {item.size} values of {path}")

    # h5netcdf complains, when it is collected, about a file that it could not open
    with h5py.File(name, "r") as file:
        file.visititems(look)
    return {group: xr.load_dataset(name, group=group, engine="h5netcdf") for group in groups}
