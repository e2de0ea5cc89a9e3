"""Parquet files, made row group by row group; pandas finds units and meanings in them again."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from exactcreep.quasistatic.files import ScratchFile


def parquet(frames: Iterator[pd.DataFrame]) -> Iterator[bytes]:
    """Yield the pieces of a Parquet file with one row group for each frame, at least one.

    All have the columns, types and attributes of the first.
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
    with ScratchFile() as file:
        with pq.ParquetWriter(file, schema, compression="zstd") as writer:
            for rows in itertools.chain([first], frames):
                writer.write_table(pa.Table.from_pandas(rows, schema, preserve_index=True))
        if file.failed is not None:
            raise file.failed
        yield from file.pieces()
