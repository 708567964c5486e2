"""Summaries, compared with a sum over every microsecond that matters; removal keeps what holds."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import pytest
from history_rig import BEGAN_US, head
from hypothesis import given
from hypothesis import strategies as st
from sqlalchemy import Engine, select

from steptwin.history.chores import DAY_US, MINUTE_US, Minute, begin_anew, minutes, remove_old, summarise
from steptwin.history.reading import HistoryDatabase
from steptwin.history.rows import EventRow, PlanRow, RowBatch, SampleRow
from steptwin.history.schema import EVENT, PLAN, SAMPLE, SUMMARY
from steptwin.history.writing import TableWriter

START = BEGAN_US - BEGAN_US % MINUTE_US
known = st.none() | st.integers(-5, 5).map(float)
changes = st.lists(st.tuples(st.integers(0, 3 * MINUTE_US - 1), known), max_size=12).map(
    lambda found: sorted(found, key=lambda change: change[0])
)


def slow(before: float | None, given: list[tuple[int, float | None]], minute: int) -> Minute | None:
    """A minute from the pieces in which a value held, with exact fractions."""
    inside = [(at, value) for at, value in given if minute <= at < minute + MINUTE_US]
    if not inside:
        return None
    held = [value for at, value in given if at < minute]
    pieces = [(minute, held[-1] if held else before), *inside]
    ends = [*(at for at, _ in inside), minute + MINUTE_US]
    total, weight = Fraction(0), 0
    for (begin, value), end in zip(pieces, ends, strict=True):
        if value is not None:
            total, weight = total + Fraction(value) * (end - begin), weight + end - begin
    values = [value for _, value in pieces if value is not None]
    mean = float(total / weight) if weight else (values[-1] if values else None)
    return Minute(minute, len(inside), min(values, default=None), mean, max(values, default=None))


@given(known, changes)
def test_minutes_against_their_definition(before: float | None, given: list[tuple[int, float | None]]) -> None:
    found = list(minutes(before, given, 0, 3 * MINUTE_US))
    expected = [one for minute in range(3) if (one := slow(before, given, minute * MINUTE_US)) is not None]
    assert [one._replace(mean=None) for one in found] == [one._replace(mean=None) for one in expected]
    assert [one.mean for one in found] == pytest.approx([one.mean for one in expected])


def write(engine: Engine, number: int, *samples: tuple[int, float | str | None], plans: tuple[int, ...] = ()) -> None:
    rows = [SampleRow(0, 0, at, value) for at, value in samples]
    kept = [PlanRow(1, 0, at, "{}", 0, 1.0, None) for at in plans]
    events = [EventRow(0, at, 1, "table", "note", None, "note", "{}") for at, _ in samples]
    last = max([at for at, _ in samples] + list(plans))
    batch = RowBatch(run="one", number=number, time=0, at_us=last, samples=rows, plans=kept, events=events)
    with engine.begin() as connection:
        first = TableWriter().write(connection, head(), [batch])
        if first is not None:
            begin_anew(connection, first)


def summaries(engine: Engine) -> list[tuple[int, int, float, float, float]]:
    """(minute, changes, least, mean, most)."""
    with engine.connect() as connection:
        rows = connection.execute(select(SUMMARY).order_by(SUMMARY.c.at_us)).all()
    return [((row.at_us - START) // MINUTE_US, row.changes, row.least, row.mean, row.most) for row in rows]


def test_summaries_of_minutes_that_are_over(engine: Engine) -> None:
    assert not summarise(engine, START + DAY_US)  # nothing there
    half = MINUTE_US // 2
    write(engine, 1, (START, 2.0), (START + half, 4.0), (START + 30 * MINUTE_US + half, 0.0), (START + 40 * MINUTE_US, 9.0))
    while summarise(engine, START + 41 * MINUTE_US):
        pass
    assert summaries(engine) == [(0, 2, 2.0, 3.0, 4.0), (30, 1, 0.0, 2.0, 4.0)]  # 40 may still grow
    while summarise(engine, START + 43 * MINUTE_US):
        pass
    assert summaries(engine)[2:] == [(40, 1, 0.0, 9.0, 9.0)]


def test_rows_that_come_late_change_their_minute(engine: Engine) -> None:
    write(engine, 1, (START, 2.0), (START + 5 * MINUTE_US, 4.0))
    while summarise(engine, START + DAY_US):
        pass
    write(engine, 2, (START + MINUTE_US, 3.0))
    while summarise(engine, START + DAY_US):
        pass
    assert summaries(engine) == [(0, 1, 2.0, 2.0, 2.0), (1, 1, 2.0, 3.0, 3.0), (5, 1, 3.0, 4.0, 4.0)]


def test_texts_have_no_summaries(engine: Engine) -> None:
    write(engine, 1, (START, "moving"), (START + MINUTE_US, 1.0))
    while summarise(engine, START + DAY_US):
        pass
    assert summaries(engine) == [(1, 1, 1.0, 1.0, 1.0)]


def test_removal_keeps_what_holds_and_what_is_newer(engine: Engine) -> None:
    old = [START + minute * MINUTE_US for minute in range(5)]
    write(engine, 1, *((at, float(place)) for place, at in enumerate(old)), plans=(old[0], old[1]))
    write(engine, 2, (START + DAY_US, 9.0))
    for _ in remove_old(engine, old[3] + 1):
        pass
    with engine.connect() as connection:
        assert connection.execute(select(SAMPLE.c.value).order_by(SAMPLE.c.at_us)).scalars().all() == [3.0, 4.0, 9.0]
        assert connection.execute(select(PLAN.c.at_us)).scalars().all() == [old[1]]
        assert connection.execute(select(EVENT.c.at_us).order_by(EVENT.c.at_us)).scalars().all() == [old[4], START + DAY_US]


def test_means_stand_for_values_that_were_removed(engine: Engine, database: str) -> None:
    half = MINUTE_US // 2
    write(engine, 1, (START, 2.0), (START + half, 4.0), (START + 3 * MINUTE_US, 5.0), (START + 9 * MINUTE_US, 6.0))
    while summarise(engine, START + DAY_US):
        pass
    for _ in remove_old(engine, START + 8 * MINUTE_US):
        pass
    with HistoryDatabase(database, Path()) as past:
        found = past.series("table.p0")
        assert found.values.tolist() == [3.0, 5.0, 6.0]
        assert [(int(at) - START) // MINUTE_US for at in found.at.astype("int64")] == [0, 3, 9]
