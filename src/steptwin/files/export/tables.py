"""Sampled tables: time, position and velocity of every axis, level of every pin, once in every period.

Columns: ``time_s``; ``CONTROLLER.AXIS_position_UNIT``, ``CONTROLLER.AXIS_velocity_UNIT_s``, both as commanded; where mechanics
can be elsewhere ``CONTROLLER.NAME_true_position_UNIT``; of what axes move ``CONTROLLER.ELEMENT_position_UNIT``, of shafts
``CONTROLLER.ELEMENT_angle_degree``; ``CONTROLLER.PIN``, 0 or 1, volts on analog pins. A sample has everything that
happened up to its moment. A level that is not known yet is empty.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from typing import IO, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from steptwin.controller import SECOND, Nanos
from steptwin.files.export.progress import TimeProgress
from steptwin.files.export.tracetracks import TraceTracks
from steptwin.files.export.tracks import AxisTrack, PinTrack
from steptwin.motion.divisions import profile_of
from steptwin.motion.pulses import PulseTimes, Reals, positions, velocities

_ROWS = 1 << 15
"""Rows in memory at a time."""

Columns: TypeAlias = dict[str, NDArray[Any]]


def samples(tracks: TraceTracks, period: Nanos) -> Iterator[tuple[Nanos, Columns]]:
    """The table in parts: the moment of the last row, and the columns. There is at least one row."""
    at = tracks.begin
    others = [(axis.coordinate(), axis.true()) for axis in tracks.axes]
    while at <= tracks.until:
        rows = min((tracks.until - at) // period + 1, _ROWS)
        times = at + period * np.arange(rows, dtype=np.int64)
        columns: Columns = {"time_s": times / SECOND}
        for axis, (coordinate, load) in zip(tracks.axes, others, strict=True):
            view = axis.view
            moved = _motion(coordinate or axis, times)
            columns[f"{axis.controller}.{view.position_name}"], columns[f"{axis.controller}.{view.velocity_name}"] = moved
            if coordinate is not None:
                columns[f"{axis.controller}.{view.counted_name}"], _ = _motion(axis, times)
            if load is not None and view.mechanics is not None:
                columns[f"{axis.controller}.{view.mechanics.position_name}"], _ = _motion(load, times)
        for track in tracks.moved:
            columns[f"{track.controller}.{track.plain_name}"], _ = _motion(track, times)
        columns |= {pin.name: _levels(pin, times) for pin in tracks.pins}
        yield int(times[-1]), columns
        at += period * rows


def _motion(track: AxisTrack, times: PulseTimes) -> tuple[Reals, Reals]:
    first = max(bisect_right(track.times, int(times[0])) - 1, 0)
    last = bisect_right(track.times, int(times[-1]))
    cuts = np.searchsorted(times, track.times[first + 1 : last]).tolist()
    position, velocity = np.empty(len(times)), np.empty(len(times))
    for plan, begin, end in zip(track.plans[first:last], [0, *cuts], [*cuts, len(times)], strict=True):
        if begin < end:
            profile = profile_of(plan)
            moments = np.maximum(times[begin:end], profile.start)
            position[begin:end] = positions(profile, moments)
            velocity[begin:end] = velocities(profile, moments)
    scale = track.view.pulses_per_unit
    return position / scale, velocity / scale


def _levels(pin: PinTrack, times: PulseTimes) -> NDArray[Any]:
    before = pin.level(pin.times[0] - 1)
    levels = np.array([np.nan if before is None else before, *pin.levels], dtype=np.float64 if pin.analog else np.int8)
    return levels[np.searchsorted(pin.times, times, side="right")]


def write_csv(tracks: TraceTracks, file: IO[str], period: Nanos, progress: TimeProgress) -> None:
    """Numbers have as many digits as give them back exactly."""
    names: list[str] | None = None
    for done, columns in samples(tracks, period):
        if names is None:
            names = list(columns)
            file.write(",".join(names) + "\n")
        texts = [["" if value != value else repr(value) for value in column.tolist()] for column in columns.values()]  # noqa: PLR0124
        file.writelines([",".join(row) + "\n" for row in zip(*texts, strict=True)])
        progress(done)


def write_parquet(tracks: TraceTracks, file: IO[bytes], period: Nanos, progress: TimeProgress) -> None:
    import pyarrow as pa
    from pyarrow import parquet

    writer: parquet.ParquetWriter | None = None
    try:
        for done, columns in samples(tracks, period):
            table = pa.table({name: pa.array(column, from_pandas=True) for name, column in columns.items()})
            if writer is None:
                writer = parquet.ParquetWriter(file, table.schema, compression="zstd")
            writer.write_table(table)
            progress(done)
    finally:
        if writer is not None:
            writer.close()
