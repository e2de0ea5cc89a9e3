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
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import h5netcdf
import h5py
import numpy as np
import xarray as xr
from xarray.backends import H5NetCDFStore

from exactcreep.model.numbers import InputError
from exactcreep.quasistatic.writing import file_name

_SEAL = re.compile(rb"\nexactcreep sha256 ([0-9a-f]{64})\n")
_SEAL_LENGTH = 84
_NO_VARIABLE = b"This is a netCDF dimension but not a netCDF variable"
_OF_HDF5 = {"CLASS", "NAME", "DIMENSION_LIST", "REFERENCE_LIST", "_Netcdf4Dimid",
            "_Netcdf4Coordinates", "_NCProperties"}  # fmt: skip
"""Attributes by which NetCDF tells dimensions, and what wrote a file."""


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


def read_groups(path: str | os.PathLike[str], field: str) -> dict[str | None, xr.Dataset]:
    """Return the datasets of a NetCDF file by groups, None the root, or raise `InputError`."""
    name = file_name(path, field)
    if not Path(path).is_file():
        raise InputError(field, name, "must be a file")
    try:
        with h5py.File(io.BytesIO(_sealed(name)), "r") as file:
            groups = {key: item for key, item in file.items() if isinstance(item, h5py.Group)}
            return {key: _dataset(item) for key, item in ({None: file} | groups).items()}
    except Exception as error:  # what a damaged HDF5 file can raise is not written down
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


def _dataset(group: h5py.Group) -> xr.Dataset:
    """Return the dataset in a group, as xarray wrote it.

    By addresses of dimensions: their names, which xarray asks for, HDF5 looks for in all groups.
    """
    held = {name: item for name, item in group.items() if isinstance(item, h5py.Dataset)}
    scales = {_address(item): name for name, item in held.items() if "CLASS" in item.attrs}
    variables: dict[str, Any] = {}
    for name, item in held.items():
        about = dict(item.attrs)
        if about.get("NAME", b"").startswith(_NO_VARIABLE):
            continue
        dimensions = [scales[_address(group[to[0]])] for to in about.get("DIMENSION_LIST", ())]
        if "CLASS" in about:
            dimensions = [name]
        texts = h5py.check_string_dtype(item.dtype) is not None
        values = np.asarray(item.asstr()[()], str) if texts else item[()]
        variables[name] = (dimensions, values, _attributes(about))
    return xr.decode_cf(xr.Dataset(variables, attrs=_attributes(group.attrs)))


def _address(item: h5py.Dataset) -> int:
    address: int = h5py.h5o.get_info(item.id).addr
    return address


def _attributes(held: Mapping[str, Any]) -> dict[str, Any]:
    """Return the attributes that are not HDF5's own; lists of one are single numbers."""
    about = {name: value for name, value in held.items() if name not in _OF_HDF5}
    return {
        name: value[0] if isinstance(value, np.ndarray) and value.shape == (1,) else value
        for name, value in about.items()
    }
