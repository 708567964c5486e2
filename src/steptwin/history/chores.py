"""Work on what has been kept: summaries of minutes, and removal of what is old, in small transactions."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from sqlalchemy import Connection, Engine, delete, func, insert, select, update
from sqlalchemy.engine import Row

from steptwin.history.schema import CHORE, EVENT, PLAN, POINT, SAMPLE, SUMMARY

SECOND_US = 1_000_000
MINUTE_US = 60 * SECOND_US
DAY_US = 24 * 60 * MINUTE_US
MOST_MINUTES = 10
"""Most minutes in a transaction."""
SUMMARIES = "summaries"


class Minute(NamedTuple):
    """A number in the minute that begins at ``at_us``; None where it was not known in it."""

    at_us: int
    changes: int
    least: float | None
    mean: float | None
    most: float | None


def minutes(before: float | None, changes: list[tuple[int, float | None]], begin: int, end: int) -> Iterator[Minute]:
    """The minutes from ``begin`` to ``end`` with changes (moment, value); ``before``: the value at ``begin``."""
    value, place = before, 0
    for minute in range(begin, end, MINUTE_US):
        at, found = minute, [] if value is None else [value]
        weight = total = 0.0
        first = place
        while place < len(changes) and changes[place][0] < minute + MINUTE_US:
            moment, following = changes[place]
            if value is not None:
                weight += moment - at
                total += value * (moment - at)
            at, value, place = moment, following, place + 1
            if value is not None:
                found.append(value)
        if place == first:
            continue
        if value is not None:
            weight += minute + MINUTE_US - at
            total += value * (minute + MINUTE_US - at)
        mean = total / weight if weight else (found[-1] if found else None)
        yield Minute(minute, place - first, min(found, default=None), mean, max(found, default=None))


def begin_anew(connection: Connection, moment_us: int) -> None:
    """Rows have come that are older than the summaries: make these again from their minute on."""
    minute = moment_us - moment_us % MINUTE_US
    connection.execute(update(CHORE).where(CHORE.c.name == SUMMARIES, CHORE.c.done_us > minute).values(done_us=minute))


def summarise(engine: Engine, now_us: int) -> bool:
    """Summaries of the next minutes that are over for a minute; False where there are none."""
    limit = now_us - now_us % MINUTE_US - MINUTE_US
    with engine.begin() as connection:
        done = connection.execute(select(CHORE.c.done_us).where(CHORE.c.name == SUMMARIES)).scalar_one_or_none()
        if done is None:
            first = connection.execute(select(func.min(SAMPLE.c.at_us))).scalar_one()
            if first is None:
                return False
            done = first - first % MINUTE_US
            connection.execute(insert(CHORE).values(name=SUMMARIES, done_us=done))
        begin = connection.execute(select(func.min(SAMPLE.c.at_us)).where(SAMPLE.c.at_us >= done)).scalar_one()
        if begin is None or begin >= limit:
            return False
        begin -= begin % MINUTE_US
        end = min(limit, begin + MOST_MINUTES * MINUTE_US)
        _summarise(connection, begin, end)
        connection.execute(update(CHORE).where(CHORE.c.name == SUMMARIES).values(done_us=end))
    return end < limit


def _summarise(connection: Connection, begin: int, end: int) -> None:
    connection.execute(delete(SUMMARY).where(SUMMARY.c.at_us >= begin, SUMMARY.c.at_us < end))
    s = SAMPLE.c
    wanted = (
        select(s.point_id, s.at_us, s.value)
        .where(s.at_us >= begin, s.at_us < end, s.text_id.is_(None))
        .order_by(s.point_id, s.at_us, s.id)
    )
    by_point: dict[int, list[tuple[int, float | None]]] = {}
    for point, at_us, value in connection.execute(wanted):
        by_point.setdefault(point, []).append((at_us, value))
    rows: list[dict[str, object]] = []
    for point, changes in by_point.items():
        before = _value_before(connection, point, begin)
        value = None if before is None else before.value
        rows += [{"point_id": point, **one._asdict()} for one in minutes(value, changes, begin, end)]
    if rows:
        connection.execute(insert(SUMMARY), rows)


def _value_before(connection: Connection, point: int, moment: int) -> Row[tuple[float | None]] | None:
    s = SAMPLE.c
    wanted = select(s.value).where(s.point_id == point, s.at_us < moment).order_by(s.at_us.desc(), s.id.desc()).limit(1)
    return connection.execute(wanted).one_or_none()


def remove_old(engine: Engine, limit_us: int) -> Iterator[None]:
    """Remove values from before ``limit_us``, a point at a time; of each point what held then stays."""
    with engine.connect() as connection:
        points = list(connection.execute(select(POINT.c.id)).scalars())
    for point in points:
        for table in (SAMPLE, PLAN):
            with engine.begin() as connection:
                held = select(func.max(table.c.at_us)).where(table.c.point_id == point, table.c.at_us <= limit_us)
                kept = connection.execute(held).scalar_one()
                if kept is not None:
                    connection.execute(delete(table).where(table.c.point_id == point, table.c.at_us < kept))
        yield
    with engine.begin() as connection:
        connection.execute(delete(EVENT).where(EVENT.c.at_us < limit_us))
