"""Parquet files, made row group by row group; pandas finds units and meanings in them again."""

from __future__ import annotations

import io
import itertools
from collections.abc import Callable, Iterator

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq


def parquet(frames: Iterator[pd.DataFrame]) -> Callable[[io.FileIO], None]:
    """Return what writes a Parquet file with one row group for each frame, at least one.

    All have the columns, types and attributes of the first.
    """

    def write(file: io.FileIO) -> None:
        first = next(frames)
        schema = pa.Schema.from_pandas(first, preserve_index=True)
        for k, field in enumerate(schema):
            if field.name in first.columns:
                told = {"units": "units", "long_name": "meanings"}.items()
                about = {name: first.attrs[known][field.name] for name, known in told}
                schema = schema.set(k, field.with_metadata(about))
        with pq.ParquetWriter(file, schema, compression="zstd") as writer:
            for rows in itertools.chain([first], frames):
                writer.write_table(pa.Table.from_pandas(rows, schema, preserve_index=True))

    return write
