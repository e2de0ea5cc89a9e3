"""NetCDF files of datasets, sealed with a digest.

HDF5 brings its process down when a disk is full, and can search a damaged file for ever. It
therefore works in memory, and a file ends with the SHA-256 of itself (behind the end that HDF5
knows of); one that does not is refused.
"""

from __future__ import annotations

import hashlib
import io
import os
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5netcdf
import h5py
import numpy as np
import xarray as xr
from numpy.typing import NDArray
from xarray.backends import H5NetCDFStore

from exactcreep.model.numbers import InputError
from exactcreep.quasistatic.writing import file_name

_SEAL = re.compile(rb"\nexactcreep sha256 ([0-9a-f]{64})\n")
_SEAL_LENGTH = 84


def netcdf(groups: Mapping[str | None, xr.Dataset]) -> memoryview:
    """Return the content of a NetCDF file that holds datasets in groups; None is the root."""
    file = io.BytesIO()
    with h5netcdf.File(file, "w") as made:
        for group, dataset in groups.items():
            dataset.dump_to_store(H5NetCDFStore(made, group=group, mode="a"))
    digest = hashlib.sha256(file.getbuffer()).hexdigest()
    file.seek(0, io.SEEK_END)
    file.write(b"\nexactcreep sha256 %s\n" % digest.encode())
    return file.getbuffer()


class Group(Mapping[str, NDArray[Any]]):
    """A dataset in an open file: its attributes, and its arrays by name, read when asked for.

    What labels the arrays, their units and dimensions, is left in the file: that takes most of the
    time in which xarray opens one, and a result is made again without it.
    """

    def __init__(self, group: h5py.Group) -> None:
        self._group = group
        self.attributes = {
            name: value[0] if isinstance(value, np.ndarray) and value.shape == (1,) else value
            for name, value in group.attrs.items()
            if name != "_NCProperties"  # what wrote the file
        }

    def __getitem__(self, name: str) -> NDArray[Any]:
        held = self._group[name]
        if h5py.check_string_dtype(held.dtype) is not None:
            return np.asarray(held.asstr()[()], str)
        return np.asarray(held[()])

    def __iter__(self) -> Iterator[str]:
        return iter(self._group)

    def __len__(self) -> int:
        return len(self._group)

    def __contains__(self, name: object) -> bool:
        return name in self._group


@contextmanager
def opened_groups(path: str | os.PathLike[str], field: str) -> Iterator[dict[str | None, Group]]:
    """Yield the groups of a NetCDF file, None the root; what fails meanwhile is an `InputError`."""
    name = file_name(path, field)
    if not Path(path).is_file():
        raise InputError(field, name, "must be a file")
    try:
        with h5py.File(io.BytesIO(_sealed(name)), "r") as file:
            groups = {key: item for key, item in file.items() if isinstance(item, h5py.Group)}
            yield {key: Group(item) for key, item in ({None: file} | groups).items()}
    except InputError:
        raise
    except Exception as error:  # what a damaged file, or changed numbers, can raise has no end
        reason = " ".join(str(error).split())[:200]
        raise InputError(field, name, f"cannot be read: {reason}") from None


def _sealed(name: str) -> memoryview:
    """Return what a file holds before its digest; raise `ValueError` unless it ends with one."""
    data = memoryview(Path(name).read_bytes())
    seal = _SEAL.fullmatch(data[-_SEAL_LENGTH:])
    if seal is None:
        told = "it does not end with a checksum, as results since version 0.2.0 do: read it"
        raise ValueError(f"{told} with the version that wrote it, or run its experiment again")
    if hashlib.sha256(data[:-_SEAL_LENGTH]).hexdigest().encode() != seal[1]:
        raise ValueError("its checksum does not match")
    return data[:-_SEAL_LENGTH]
