"""The cases of a campaign as a file of Parquet: a row for each, with columns for values, measures and properties."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from itertools import islice
from typing import IO, Any

import pyarrow as pa
from pyarrow import parquet

from steptwin.campaign.results import StoredCase, export_rows

_ROWS = 10_000
"""Rows in a group."""


def write_cases(results: Callable[[], Iterable[StoredCase]], file: IO[bytes]) -> None:
    """``results`` is called twice: columns have the types of all values in them, which are text where they differ."""
    types: dict[str, Any] = {}
    for row in export_rows(results()):
        for name, value in row.items():
            found = _type(value)
            if found is not None and types.setdefault(name, found) != found:
                types[name] = pa.float64() if {types[name], found} <= {pa.float64(), pa.int64()} else pa.string()
            types.setdefault(name, None)
    schema = pa.schema([(name, pa.string() if found is None else found) for name, found in types.items()])
    rows = export_rows(results())
    with parquet.ParquetWriter(file, schema, compression="zstd") as writer:
        for group in _groups(rows):
            columns = {name: [_fitting(row.get(name), schema.field(name).type) for row in group] for name in schema.names}
            writer.write_table(pa.table(columns, schema=schema))


def _groups(rows: Iterator[dict[str, Any]]) -> Iterator[list[dict[str, Any]]]:
    while group := list(islice(rows, _ROWS)):
        yield group


def _type(value: Any) -> Any:
    if value is None:
        return None
    kinds = {bool: pa.bool_(), int: pa.int64(), float: pa.float64()}
    return kinds.get(type(value), pa.string())


def _fitting(value: Any, wanted: Any) -> Any:
    if value is None:
        return None
    if wanted == pa.string():
        return str(value)
    return float(value) if wanted == pa.float64() else value
