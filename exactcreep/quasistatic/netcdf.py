"""NetCDF files of datasets: made in memory, and sealed with a digest.

HDF5 brings its process down when a disk is full, and can search a damaged file for ever. A file is
therefore made in memory, and ends with the SHA-256 of itself (behind the end that HDF5 knows of);
one that does not is refused.
"""

from __future__ import annotations

import hashlib
import io
import os
import re
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
from exactcreep.quasistatic.files import ScratchFile, file_name

_SEAL = re.compile(rb"\nexactcreep sha256 ([0-9a-f]{64})\n")
_SEAL_LENGTH = 84
_INFLATED = 1000
"""Bytes of values for each byte of a file: beyond what compression makes of true numbers."""


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
        _require_seal(name)
        return _read(name)
    except Exception as error:  # what a damaged HDF5 file can raise is not written down
        reason = " ".join(str(error).split())[:200]
        raise InputError(field, name, f"cannot be read: {reason}") from None


def _require_seal(name: str) -> None:
    """Raise `ValueError` unless a file ends with its digest."""
    with open(name, "rb") as file:
        size = file.seek(0, io.SEEK_END)
        file.seek(max(0, size - _SEAL_LENGTH))
        seal = _SEAL.fullmatch(file.read())
        if seal is None:
            told = "it does not end with a checksum, as results since version 0.2.0 do: read it"
            raise ValueError(f"{told} with the version that wrote it, or run its experiment again")
        file.seek(0)
        digest, left = hashlib.sha256(), size - _SEAL_LENGTH
        while left > 0:
            part = file.read(min(left, 1 << 20))
            digest.update(part)
            left -= len(part)
    if digest.hexdigest().encode() != seal[1]:
        raise ValueError("its checksum does not match")


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
