"""Parquet files, made row group by row group; pandas finds units and meanings in them again."""

from __future__ import annotations

import io
import itertools
from collections.abc import Iterator

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq


class _Sink(io.RawIOBase):
    """A file that keeps what was written until somebody takes it."""

    def __init__(self) -> None:
        self.written: list[bytes] = []
        self._size = 0

    def writable(self) -> bool:
        return True

    def tell(self) -> int:
        return self._size

    def write(self, data: bytes) -> int:  # type: ignore[override]
        self.written.append(bytes(data))
        self._size += len(data)
        return len(data)

    def taken(self) -> Iterator[bytes]:
        """Yield what was written since the last time."""
        written, self.written = self.written, []
        yield from written


def parquet(frames: Iterator[pd.DataFrame]) -> Iterator[bytes]:
    """Yield the pieces of a Parquet file with one row group for each frame.

    Parameters
    ----------
    frames : iterator of DataFrame
        At least one; all with the columns, types and attributes of the first.
    """
    first = next(frames)
    schema = pa.Schema.from_pandas(first, preserve_index=True)
    units, meanings = first.attrs["units"], first.attrs["meanings"]
    fields = [
        field.with_metadata({"units": units[field.name], "long_name": meanings[field.name]})
        if field.name in units
        else field
        for field in schema
    ]
    schema = pa.schema(fields, metadata=schema.metadata)
    sink = _Sink()
    with pq.ParquetWriter(sink, schema, compression="zstd") as writer:
        for rows in itertools.chain([first], frames):
            writer.write_table(pa.Table.from_pandas(rows, schema, preserve_index=True))
            yield from sink.taken()
    yield from sink.taken()
