"""Series as a file of Parquet: a row for each value, with numbers and texts in columns of their own."""

from __future__ import annotations

from collections.abc import Sequence
from typing import IO

import numpy as np
import pyarrow as pa
from pyarrow import parquet

from steptwin.history.reading import PointSeries

SCHEMA = pa.schema(
    [
        ("run", pa.int64()),
        ("time", pa.timestamp("us", tz="UTC")),
        ("seconds", pa.float64()),
        ("point", pa.dictionary(pa.int32(), pa.string())),
        ("unit", pa.dictionary(pa.int32(), pa.string())),
        ("value", pa.float64()),
        ("text", pa.string()),
    ]
)


def write_parquet(found: Sequence[PointSeries], file: IO[bytes]) -> None:
    with parquet.ParquetWriter(file, SCHEMA, compression="zstd") as writer:
        for series in found:
            size = len(series)
            nothing = np.full(size, None, dtype=object)
            columns = {
                "run": series.runs,
                "time": pa.array(series.at).cast(pa.timestamp("us", tz="UTC")),
                "seconds": series.seconds,
                "point": pa.array([series.point] * size).dictionary_encode(),
                "unit": pa.array([series.unit] * size).dictionary_encode(),
                "value": pa.array(nothing, pa.float64()) if series.is_text else pa.array(series.values, from_pandas=True),
                "text": pa.array(series.values if series.is_text else nothing, pa.string()),
            }
            writer.write_table(pa.table(columns, schema=SCHEMA))
