"""NetCDF files of datasets, sealed with a digest.

HDF5 crashes its process when a disk is full, and may search a damaged file for ever. So HDF5 works
in memory, and a file ends with its own SHA-256, after the end that HDF5 knows. Of a stranger's file
an array is read only if its bytes lie in the file itself: no link, external storage or filter.
"""

from __future__ import annotations

import hashlib
import io
import math
import os
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any, BinaryIO

import h5netcdf
import h5py
import numpy as np
import xarray as xr
from numpy.typing import NDArray
from xarray.backends import H5NetCDFStore

from exactcreep.model.user_files import opened, refused
from exactcreep.quasistatic.writing import file_name

MOST_BYTES = 2**33
"""Largest size of a file of results."""
_SEAL = re.compile(rb"\nexactcreep sha256 ([0-9a-f]{64})\n")
_SEAL_LENGTH = 84
_BLOCK = 2**24  # bytes per update of a digest
_TEXTS = 2**29  # bytes of texts that are read at once
_KINDS = (h5py.h5t.INTEGER, h5py.h5t.FLOAT, h5py.h5t.STRING)


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


class Room:
    """The number of bytes that may still be read of a file: at first somewhat above its size."""

    def __init__(self, size: int) -> None:
        self.size, self.left = size, 4 * size

    def take(self, name: str, count: int) -> None:
        self.left -= count
        if self.left < 0:
            raise ValueError(f"{name} claims more than the file holds")


class Group(Mapping[str, NDArray[Any]]):
    """A dataset in an open file, read on demand: attributes, and arrays by name, without labels."""

    def __init__(self, group: h5py.Group, room: Room) -> None:
        self._group, self._room, self._read = group, room, dict[str, NDArray[Any]]()
        self._names = dict.fromkeys(group)
        self.attributes = {
            name: self._attribute(name)
            for name in group.attrs
            if name != "_NCProperties"  # the program that wrote the file
        }

    def _attribute(self, name: str) -> Any:
        held = self._group.attrs.get_id(name)
        if held.get_type().get_class() not in _KINDS or math.prod(held.shape) != 1:
            raise ValueError(f"{name} must be a number or a text")
        value = self._group.attrs[name]
        self._room.take(name, len(value) if isinstance(value, (str, bytes)) else 8)
        return value[0] if isinstance(value, np.ndarray) and value.shape == (1,) else value

    def __getitem__(self, name: str) -> NDArray[Any]:
        if name not in self._names:
            raise KeyError(name)
        if name not in self._read:
            self._read[name] = self._array(name)
        return self._read[name]

    def _array(self, name: str) -> NDArray[Any]:
        held = _own_object(self._group, name)
        if not isinstance(held, h5py.Dataset) or held.id.get_type().get_class() not in _KINDS:
            raise ValueError(f"{name} must be an array of numbers or texts")
        made = held.id.get_create_plist()
        apart = made.get_layout() == h5py.h5d.VIRTUAL or made.get_external_count()
        claimed = math.prod(held.shape) * held.id.get_type().get_size()
        if apart or made.get_nfilters() or held.id.get_storage_size() < claimed:
            raise ValueError(f"{name} does not lie in the file as it is")
        self._room.take(name, claimed)
        if h5py.check_string_dtype(held.dtype) is None:
            return np.asarray(held[()])
        texts = np.empty(held.shape, object)
        for place in self._places(held.shape):
            texts[place] = block = held.asstr()[place]
            self._room.take(name, sum(map(len, np.ravel(block))))
        longest = max(map(len, texts.ravel()), default=0)
        self._room.take(name, longest * texts.size)  # every text takes as much as the longest
        return np.asarray(texts, str)

    def _places(self, shape: tuple[int, ...]) -> Iterator[Any]:
        """Yield slices of texts that can be read at once; a text may be as long as the file."""
        each = self._room.size * math.prod(shape[1:])
        if not shape or each > _TEXTS:
            yield from np.ndindex(shape)
            return
        step = max(_TEXTS // max(each, 1), 1)
        yield from (slice(k, k + step) for k in range(0, shape[0], step))

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)

    def __contains__(self, name: object) -> bool:
        return name in self._names


def _own_object(group: h5py.Group, name: str) -> Any:
    """Return the object of a name in a group, unless the name is a link."""
    if group.id.links.get_info(name.encode()).type != h5py.h5l.TYPE_HARD:
        raise ValueError(f"{name} is a link, and is not followed")
    return group[name]


@contextmanager
def opened_dataset(path: str | os.PathLike[str], field: str) -> Iterator[Group]:
    """Yield the dataset in a NetCDF file; every error is an `InputError`."""
    name = file_name(path, field)
    with opened(name, field, MOST_BYTES) as file, refused(field, name):
        room = Room(_sealed(file))
        with h5py.File(file, "r") as root:
            yield Group(root, room)


def _sealed(file: BinaryIO) -> int:
    """Return the length of a file without its digest; raise `ValueError` if it has none."""
    size = file.seek(0, io.SEEK_END) - _SEAL_LENGTH
    file.seek(max(size, 0))
    seal = _SEAL.fullmatch(file.read())
    if seal is None:
        told = "it does not end with a checksum, as results since version 0.2.0 do: read it"
        raise ValueError(f"{told} with the version that wrote it, or run its experiment again")
    digest = hashlib.sha256()
    file.seek(0)
    for at in range(0, size, _BLOCK):
        digest.update(file.read(min(_BLOCK, size - at)))
    if digest.hexdigest().encode() != seal[1]:
        raise ValueError("its checksum does not match")
    return size
