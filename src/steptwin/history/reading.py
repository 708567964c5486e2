"""Reading of a history: runs, points, values as arrays of numpy, events.

with HistoryDatabase("sqlite:///h.db") as history:
    run = history.runs()[-1]
    series = history.series("table.M1.position", begin=run.began, end=run.ended, every_s=0.01)
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from fnmatch import fnmatchcase
from itertools import zip_longest
from operator import attrgetter
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple, Self, TypeAlias

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import Column, Select, Table, func, select
from sqlalchemy.exc import DBAPIError

from steptwin.controller import MICROSECOND, SECOND, Nanos
from steptwin.errors import Misuse
from steptwin.history.chores import MINUTE_US
from steptwin.history.database import SQLITE, check_version, engine_of, failure, format_url, read_url
from steptwin.history.motions import KeptMotion
from steptwin.history.schema import EVENT, PLAN, POINT, RUN, SAMPLE, SUMMARY, TEXT
from steptwin.messages import Message
from steptwin.motion.planjson import read_plan
from steptwin.nearmiss import NearMiss

TEXTS = "text"
MOST_VALUES = 2_000_000
"""Most values of a series."""
EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


@dataclass(frozen=True, slots=True)
class KeptRun:
    """A recording: from a start of a process, or from where its time went back, to its end."""

    number: int
    subject: str
    is_virtual: bool
    """Whether its moments are virtual ones, of twins."""
    began: datetime
    ended: datetime
    """Up to when it is kept, so far."""
    began_ns: Nanos
    ended_ns: Nanos
    is_over: bool
    """False while it goes on, and where its process was killed."""


class KeptPoint(NamedTuple):
    subject: str
    name: str
    unit: str
    type: str


WRITTEN = ("write", "command")
"""Kinds of events: what programs have written, and what clients have commanded."""


class KeptEvent(NamedTuple):
    run: int
    at: datetime
    time: Nanos
    machine: str
    kind: str
    text: str
    number: int
    cause: int | None
    content: dict[str, Any]


@dataclass(frozen=True, slots=True)
class PointSeries:
    """Values of a point in order of time; each holds until the next one.

    ``at``: UTC, as ``datetime64[us]``; ``seconds``: time of the subject (virtual, of twins); ``runs``: numbers of runs.
    ``values``: numbers, NaN where they are not known; or texts, None where they are not known.
    """

    point: str
    unit: str
    at: NDArray[np.datetime64]
    seconds: NDArray[np.float64]
    runs: NDArray[np.int64]
    values: NDArray[Any]
    is_motion: bool = False
    """Whether values between these moments are between these values; otherwise each holds until the next one."""

    def __len__(self) -> int:
        return len(self.at)

    @property
    def is_text(self) -> bool:
        return self.values.dtype == object


Query: TypeAlias = "Select[*tuple[Any, ...]]"
Moment: TypeAlias = datetime | float | None
"""A date with time (local without an offset), or seconds since the begin of a run."""


@dataclass(frozen=True, slots=True)
class _Bounds:
    """Bounds in moments of the wall clock, us, or of the time of the subject, ns."""

    is_wall: bool
    first: int | None
    last: int | None

    def column(self, table: Table) -> Column[int]:
        return table.c.at_us if self.is_wall else table.c.t_ns

    def within(self, wanted: Query, table: Table) -> Query:
        column = self.column(table)
        if self.first is not None:
            wanted = wanted.where(column >= self.first)
        return wanted if self.last is None else wanted.where(column <= self.last)

    def of_subject(self, time: Nanos, at_us: int) -> tuple[Nanos | None, Nanos | None]:
        """In the time of the subject, where ``time`` and ``at_us`` are the same moment, and both clocks go alike."""
        if not self.is_wall:
            return self.first, self.last
        first = None if self.first is None else time + (self.first - at_us) * MICROSECOND
        return first, None if self.last is None else time + (self.last - at_us) * MICROSECOND


class _Row(NamedTuple):
    run: int
    time: Nanos
    at_us: int
    value: Any


DOES_NOT_EXIST = Message("history.does-not-exist", "{database} does not exist")
NO_SUCH_RUN = Message("history.no-such-run", "run {number}: {there}, and -1 is the last one")
DATES_OR_SECONDS = Message(
    "history.dates-or-seconds", "begin and end are two dates, or seconds since the begin of the run that 'run' names"
)
NO_SUCH_POINT = Message("history.no-such-point", "no point {name!r} has been kept{hint}")


class HistoryDatabase:
    """The history at ``url``: ``sqlite:///FILE`` or the address of a PostgreSQL database.

    Raises `Misuse` where there is none, `LineFailure` where it does not answer.
    """

    def __init__(self, url: str, folder: Path = Path()) -> None:
        self._url = read_url(url, folder)
        if self._url.get_backend_name() == SQLITE and not Path(str(self._url.database)).is_file():
            raise Misuse(DOES_NOT_EXIST(database=self._url.database))
        self._engine = engine_of(self._url)
        try:
            with self._engine.connect() as connection:
                check_version(connection, self._url)
        except BaseException as error:
            self._engine.dispose()
            if isinstance(error, DBAPIError):
                raise failure(self._url, error) from None
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        self._engine.dispose()

    def _rows(self, wanted: Query) -> Sequence[Any]:
        """All of them; the transaction ends, because an open one hinders the writer."""
        try:
            with self._engine.connect() as connection:
                return connection.execute(wanted).all()
        except DBAPIError as error:
            raise failure(self._url, error) from None

    # ------------------------------------------------------------------ what there is

    def runs(self, subject: str | None = None) -> list[KeptRun]:
        """In the order in which they began: that of their numbers, because the wall clock may be set back."""
        wanted = select(RUN).order_by(RUN.c.id)
        if subject is not None:
            wanted = wanted.where(RUN.c.subject == subject)
        return [
            KeptRun(
                row.id,
                row.subject,
                row.virtual,
                _datetime(row.began_us),
                _datetime(row.last_us),
                row.began_ns,
                row.last_ns,
                row.ended,
            )
            for row in self._rows(wanted)
        ]

    def run(self, number: int) -> KeptRun:
        """Negative numbers count from the last one: -1. Raises `Misuse`."""
        runs = self.runs()
        found = runs[number:][:1] if number < 0 else [run for run in runs if run.number == number]
        if not found or -number > len(runs):
            there = f"there are {runs[0].number} to {runs[-1].number}" if runs else "there is none"
            raise Misuse(NO_SUCH_RUN(number=number, there=there))
        return found[0]

    def points(self, pattern: str = "*") -> list[KeptPoint]:
        """Those that have been kept, by name; ``*`` and ``?`` stand for characters."""
        rows = self._rows(select(POINT.c.subject, POINT.c.name, POINT.c.unit, POINT.c.type).order_by(POINT.c.name))
        return [KeptPoint(*row) for row in rows if fnmatchcase(row.name, pattern)]

    # ------------------------------------------------------------------ values

    def series(
        self,
        point: str,
        begin: Moment = None,
        end: Moment = None,
        *,
        every_s: float | None = None,
        moving_s: float | None = None,
        run: int | None = None,
        most: int | None = None,
    ) -> PointSeries:
        """The values of a point between two moments, of one ``run`` or of all.

        Without ``every_s``: as they were kept, and of motions the ends of their parts. With it: one in so many seconds of the
        time of the subject, of motions exactly. With ``moving_s`` only while the axis of a twin moves. ``most``: the first ones.
        Velocities of twins follow from their positions. Raises `Misuse` for a point that is not there.
        """
        bounds = self._bounds(begin, end, run)
        ids, kind, unit, is_velocity = self._point(point)
        runs = {one.number: one for one in self.runs() if run is None or one.number == run}
        motions = self._motions(ids, bounds, runs, most)
        if motions or is_velocity:
            rows = _of_motions(point, motions, bounds, runs, every_s, moving_s, speeds=is_velocity)
        else:
            kept = self._samples(ids, kind, bounds, runs, most)
            rows = kept if every_s is None else _of_samples(point, kept, runs, bounds, every_s)
        is_motion = bool(motions) or is_velocity
        return _arrays(point, unit, rows[:most], is_text=kind == TEXTS, is_motion=is_motion)

    def _bounds(self, begin: Moment, end: Moment, run: int | None) -> _Bounds:
        if not isinstance(begin, int | float) and not isinstance(end, int | float):
            return _Bounds(True, _micros(begin), _micros(end))
        if run is None or isinstance(begin, datetime) or isinstance(end, datetime):
            raise Misuse(DATES_OR_SECONDS())
        origin = self.run(run).began_ns
        return _Bounds(False, *(None if at is None else origin + round(at * SECOND) for at in (begin, end)))

    def _point(self, name: str) -> tuple[list[int], str, str, bool]:
        """Ids, type and unit of a point, and whether it is the velocity of one with positions. It has several ids where several
        subjects have it. Raises `Misuse`."""
        c = POINT.c
        for searched, is_velocity in ((name, False), (f"{name.removesuffix('.velocity')}.position", True)):
            rows = self._rows(select(c.id, c.unit, c.type).where(c.name == searched).order_by(c.id))
            if rows and (not is_velocity or name.endswith(".velocity")):
                unit = rows[-1].unit
                return [row.id for row in rows], rows[-1].type, f"{unit}/s" if is_velocity else unit, is_velocity
        names = sorted({point.name for point in self.points()})
        raise Misuse(NO_SUCH_POINT(name=name, hint=NearMiss().hint(name, names)))

    def _samples(self, ids: list[int], kind: str, bounds: _Bounds, runs: Mapping[int, KeptRun], most: int | None) -> list[_Row]:
        s = SAMPLE.c
        value = TEXT.c.text if kind == TEXTS else s.value
        wanted = select(s.run_id, s.t_ns, s.at_us, value.label("value")).where(s.point_id.in_(ids), s.run_id.in_(runs))
        if kind == TEXTS:
            wanted = wanted.select_from(SAMPLE).outerjoin(TEXT, TEXT.c.id == s.text_id)
        before, rest = self._before(wanted, SAMPLE, bounds), self._rows(_ordered(wanted, SAMPLE, bounds).limit(most))
        rows = _in_order(_Row(*row) for row in (*before, *rest))
        is_whole = kind == TEXTS or not bounds.is_wall
        return rows if is_whole else [*self._summaries(ids, bounds, rows, runs), *rows]

    def _before(self, wanted: Query, table: Table, bounds: _Bounds) -> Sequence[Any]:
        """The row that holds where the bounds begin."""
        if bounds.first is None:
            return ()
        column = bounds.column(table)
        return self._rows(
            wanted.where(column < bounds.first).order_by(column.desc(), table.c.t_ns.desc(), table.c.id.desc()).limit(1)
        )

    def _summaries(self, ids: list[int], bounds: _Bounds, rows: list[_Row], runs: Mapping[int, KeptRun]) -> list[_Row]:
        """Means of minutes from before the oldest sample, where the samples have been removed."""
        oldest = self._rows(select(func.min(SAMPLE.c.at_us)).where(SAMPLE.c.point_id.in_(ids)))[0][0]
        if oldest is None or (bounds.first is not None and bounds.first >= oldest):
            return []
        m = SUMMARY.c
        limit = oldest if bounds.last is None else min(oldest, bounds.last)
        wanted = select(m.at_us, m.mean).where(m.point_id.in_(ids), m.at_us + MINUTE_US <= limit).order_by(m.at_us)
        if bounds.first is not None:
            wanted = wanted.where(m.at_us >= bounds.first)
        found: list[_Row] = []
        for at_us, mean in self._rows(wanted):
            at = _datetime(at_us)
            of = next((run for run in runs.values() if run.began - timedelta(minutes=1) <= at <= run.ended), None)
            if of is not None:
                time = of.began_ns + round((at - of.began) / timedelta(microseconds=1)) * MICROSECOND
                found.append(_Row(of.number, max(0, time), at_us, mean))
        return found

    def _motions(self, ids: list[int], bounds: _Bounds, runs: Mapping[int, KeptRun], most: int | None) -> list[KeptMotion]:
        """At least ``most`` of them, if there are so many."""
        p = PLAN.c
        columns = (p.run_id, p.t_ns, p.at_us, p.plan, p.origin, p.scale, p.round_p)
        wanted = select(*columns).where(p.point_id.in_(ids), p.run_id.in_(runs))
        limit = None if most is None else most + 1
        following = self._rows(_ordered(wanted, PLAN, bounds).limit(limit))
        rows = sorted((*self._before(wanted, PLAN, bounds), *following), key=attrgetter("run_id", "t_ns"))
        found: list[KeptMotion] = []
        for row, after in zip_longest(rows, rows[1:]):
            if after is not None and after.run_id == row.run_id:
                end, end_us = after.t_ns, after.at_us
            else:
                over = runs[row.run_id]
                end, end_us = over.ended_ns, _micros(over.ended) or 0
            motion = read_plan(json.loads(row.plan))
            found.append(KeptMotion(row.run_id, row.t_ns, row.at_us, end, end_us, motion, row.origin, row.scale, row.round_p))
        # of the last one the end is not known where others follow that have not been read
        return found[:-1] if limit is not None and len(following) == limit else found

    # ------------------------------------------------------------------ events

    def events(
        self,
        begin: Moment = None,
        end: Moment = None,
        *,
        run: int | None = None,
        machine: str | None = None,
        kinds: Sequence[str] | None = None,
        most: int | None = None,
    ) -> list[KeptEvent]:
        """In order of time; the last ``most`` of them. ``kinds``: only these, such as ``write`` and ``command``."""
        e = EVENT.c
        wanted = select(e.run_id, e.at_us, e.t_ns, e.machine, e.kind, e.text, e.number, e.cause, e.content)
        for condition, column in ((run, e.run_id), (machine, e.machine)):
            if condition is not None:
                wanted = wanted.where(column == condition)
        if kinds is not None:
            wanted = wanted.where(e.kind.in_(kinds))
        wanted = self._bounds(begin, end, run).within(wanted, EVENT)
        rows = self._rows(wanted.order_by(e.at_us.desc(), e.id.desc()).limit(most))
        return [
            KeptEvent(run_id, _datetime(at), time, where, kind, text, number, cause, json.loads(content))
            for run_id, at, time, where, kind, text, number, cause, content in reversed(rows)
        ]

    def counts(self) -> dict[str, int]:
        """Numbers of rows."""
        tables = {"samples": SAMPLE, "motions": PLAN, "events": EVENT, "summaries": SUMMARY}
        parts = [select(func.count()).select_from(table) for table in tables.values()]
        return dict(zip(tables, (self._rows(part)[0][0] for part in parts), strict=True))

    @property
    def address(self) -> str:
        """Its address, without its password."""
        return format_url(self._url)


def _ordered(wanted: Query, table: Table, bounds: _Bounds) -> Query:
    """By the time of the subject: the wall clock may be set back."""
    return bounds.within(wanted, table).order_by(table.c.run_id, table.c.t_ns, table.c.id)


def _in_order(rows: Iterable[_Row]) -> list[_Row]:
    """Where the wall clock was set back, what held at a moment of it may be later than others after it."""
    return sorted(rows, key=attrgetter("run", "time"))


def _of_motions(
    point: str,
    motions: list[KeptMotion],
    bounds: _Bounds,
    runs: Mapping[int, KeptRun],
    every_s: float | None,
    moving_s: float | None,
    *,
    speeds: bool,
) -> list[_Row]:
    rows: list[_Row] = []
    for motion in motions:
        begin, end = motion.time, motion.end
        if bounds.first is not None:
            begin = motion.moment(bounds.first) if bounds.is_wall else bounds.first
        if bounds.last is not None:
            end = min(end, motion.moment(bounds.last) if bounds.is_wall else bounds.last)
        grid = None if every_s is None else (runs[motion.run].began_ns, every_s)
        _check_size(point, len(rows), (min(end, motion.end) - max(begin, motion.time)) / SECOND, every_s)
        for moment in motion.moments(begin, end, grid) if grid is not None else motion.ends(begin, end, moving_s):
            value = motion.velocity(moment) if speeds else motion.position(moment)
            rows.append(_Row(motion.run, moment, motion.wall_us(moment), value))
    return rows


def _of_samples(point: str, rows: list[_Row], runs: Mapping[int, KeptRun], bounds: _Bounds, every_s: float) -> list[_Row]:
    found: list[_Row] = []
    step = max(1, round(every_s * SECOND))
    for row, after in zip_longest(rows, rows[1:]):
        of = runs[row.run]
        end = after.time if after is not None and after.run == row.run else of.ended_ns
        first, last = bounds.of_subject(row.time, row.at_us)
        begin = row.time if first is None else max(row.time, first)
        end = end if last is None else min(end, last + 1)
        _check_size(point, len(found), (end - begin) / SECOND, every_s)
        for moment in range(of.began_ns + -(-(begin - of.began_ns) // step) * step, end, step):
            found.append(_Row(row.run, moment, row.at_us + (moment - row.time) // MICROSECOND, row.value))  # noqa: PERF401  counted
    return found


TOO_MANY_VALUES = Message(
    "history.too-many-values", "{point} has more than {most} values here: take a shorter interval, or one value in a longer time"
)


def _check_size(point: str, found: int, length_s: float, every_s: float | None) -> None:
    """Check the number of the values that are found and those of another length. Raises `Misuse`."""
    if found + (0.0 if every_s is None else length_s / every_s) > MOST_VALUES:
        raise Misuse(TOO_MANY_VALUES(point=point, most=MOST_VALUES))


def _arrays(point: str, unit: str, rows: list[_Row], *, is_text: bool, is_motion: bool) -> PointSeries:
    return PointSeries(
        point,
        unit,
        np.array([row.at_us for row in rows], dtype="datetime64[us]"),
        np.array([row.time / SECOND for row in rows], dtype=np.float64),
        np.array([row.run for row in rows], dtype=np.int64),
        np.array([row.value for row in rows], dtype=object if is_text else np.float64),
        is_motion,
    )


def _datetime(at_us: int) -> datetime:
    return EPOCH + timedelta(microseconds=at_us)


def _micros(moment: datetime | None) -> int | None:
    return None if moment is None else (moment.astimezone(UTC) - EPOCH) // timedelta(microseconds=1)
