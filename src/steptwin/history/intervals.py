"""Intervals of a history as users name them, and the comparison of two."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import NamedTuple

import numpy as np

from steptwin.controller import SECOND
from steptwin.durations import duration
from steptwin.errors import Misuse
from steptwin.history.reading import HistoryDatabase, KeptRun, Moment, PointSeries

GRID = 1000
"""Moments at which two intervals are compared where nothing else was asked for."""


@dataclass(frozen=True, slots=True)
class Interval:
    """Part of a history, between two dates; or of one ``run`` of it, between two times since its begin, s."""

    begin: Moment
    end: Moment
    run: KeptRun | None

    @property
    def number(self) -> int | None:
        return None if self.run is None else self.run.number


def read_interval(past: HistoryDatabase, run: int | None, begin: str | None, end: str | None) -> Interval:
    """``begin`` and ``end``: times since the begin of the run (``10 s``), or dates with time (ISO 8601; local without an offset).

    Times without a run are of the last one. Raises `Misuse`.
    """
    moments = _moment(begin), _moment(end)
    dates = [moment for moment in moments if isinstance(moment, datetime)]
    times = [moment for moment in moments if isinstance(moment, float)]
    if dates and times:
        raise Misuse(f"{begin!r} and {end!r}: give two dates, or two times since the begin of a run")
    if dates != sorted(dates) or times != sorted(times):
        raise Misuse(f"--to {end}: this is before --from {begin}")
    found = past.run(-1 if run is None else run) if times or run is not None else None
    return Interval(*moments, found)


def _moment(text: str | None) -> Moment:
    if text is None:
        return None
    try:
        return datetime.fromisoformat(text).astimezone()
    except ValueError:
        pass
    try:
        return duration(text) / SECOND
    except Misuse:
        expected = "a time since the begin of the run, such as '10 s', or a date such as '2026-03-01 14:30'"
        raise Misuse(f"{text!r}: expected {expected}") from None


class Difference(NamedTuple):
    """How far two intervals of a point are apart at most, and how long after their begin. ``values``: one of each there."""

    point: str
    unit: str
    most: float
    at_s: float
    values: tuple[object, object]


def compare(
    past: HistoryDatabase, points: Sequence[str], one: Interval, other: Interval, every_s: float | None = None
) -> list[Difference]:
    """The points that differ between two intervals of runs, most first. Texts differ by infinity. Raises `Misuse`."""
    lengths = [_length_s(interval) for interval in (one, other)]
    step = every_s or max(min(lengths) / GRID, 1e-6)
    found: list[Difference] = []
    for point in points:
        pair = [_on_grid(past, point, interval, step) for interval in (one, other)]
        shared = min(len(series) for series in pair)
        if not shared:
            continue
        a, b = (series.values[:shared] for series in pair)
        if pair[0].is_text:
            apart = np.where(a != b, np.inf, 0.0)
        else:
            apart = np.where(np.isnan(a) & np.isnan(b), 0.0, np.abs(a - b))
            apart[np.isnan(apart)] = np.inf
        place = int(np.argmax(apart))
        if apart[place] > 0:
            found.append(Difference(point, pair[0].unit, float(apart[place]), place * step, (a[place], b[place])))
    return sorted(found, key=lambda difference: -difference.most)


def _on_grid(past: HistoryDatabase, point: str, interval: Interval, step: float) -> PointSeries:
    return past.series(point, interval.begin, interval.end, every_s=step, run=interval.number)


def _length_s(interval: Interval) -> float:
    if interval.run is None or isinstance(interval.begin, datetime) or isinstance(interval.end, datetime):
        raise Misuse("intervals of runs can be compared: --run and --with, from and to a time since their begin")
    whole = (interval.run.ended_ns - interval.run.began_ns) / SECOND
    return min(whole, whole if interval.end is None else interval.end) - (interval.begin or 0.0)
