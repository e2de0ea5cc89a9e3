"""NetCDF files of datasets, sealed with a digest.

HDF5 brings its process down when a disk is full, and can search a damaged file for ever. It is
therefore given a file that never fails, and that ends with the SHA-256 of itself (behind the end
that HDF5 knows of); one that does not is refused.
"""

from __future__ import annotations

import hashlib
import io
import mmap
import os
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import h5netcdf
import h5py
import xarray as xr
from xarray.backends import H5NetCDFStore

from exactcreep.model.numbers import InputError
from exactcreep.quasistatic.files import file_name

_SEAL = re.compile(rb"\nexactcreep sha256 ([0-9a-f]{64})\n")
_SEAL_LENGTH = 84
_INFLATED = 1000
"""Bytes of values for each byte of a file: beyond what compression makes of true numbers."""


def netcdf(groups: Mapping[str | None, xr.Dataset]) -> Callable[[io.FileIO], None]:
    """Return what writes a NetCDF file that holds datasets in groups; None is the root."""

    def write(file: io.FileIO) -> None:
        with h5netcdf.File(file, "w") as made:
            for group, dataset in groups.items():
                dataset.dump_to_store(H5NetCDFStore(made, group=group, mode="a"))
        file.seek(0)
        digest = hashlib.file_digest(file, "sha256")
        file.seek(0, io.SEEK_END)
        file.write(b"\nexactcreep sha256 %s\n" % digest.hexdigest().encode())

    return write


def read_groups(path: str | os.PathLike[str], field: str) -> dict[str | None, xr.Dataset]:
    """Return the datasets of a NetCDF file by groups, None the root, or raise `InputError`."""
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
        size = os.fstat(file.fileno()).st_size
        data = memoryview(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) if size else b"")
    seal = _SEAL.fullmatch(data[-_SEAL_LENGTH:])
    if seal is None:
        told = "it does not end with a checksum, as results since version 0.2.0 do: read it"
        raise ValueError(f"{told} with the version that wrote it, or run its experiment again")
    if hashlib.sha256(data[:-_SEAL_LENGTH]).hexdigest().encode() != seal[1]:
        raise ValueError("its checksum does not match")


def _read(name: str) -> dict[str | None, xr.Dataset]:
    groups: list[str | None] = [None]
    most = _INFLATED * Path(name).stat().st_size

    def look(path: str, item: Any) -> None:
        if isinstance(item, h5py.Group):
            groups.append(path)
        elif isinstance(item, h5py.Dataset) and item.nbytes > most:
            raise ValueError(f"it is too short for the {item.size} values of {path}")

    # h5netcdf complains, when it is collected, about a file that it could not open
    with h5py.File(name, "r") as file:
        file.visititems(look)
    return {group: xr.load_dataset(name, group=group, engine="h5netcdf") for group in groups}
