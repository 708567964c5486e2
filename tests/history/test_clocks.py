"""A wall clock that is set while a history is kept, and time zones: rows stay in order, and nothing is lost or twice."""

from __future__ import annotations

import time
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from history_rig import BEGAN_US, RecordedWorld
from sqlalchemy import Engine

from steptwin.cli.history import _local
from steptwin.errors import Misuse
from steptwin.history import writer as writing
from steptwin.history.intervals import read_interval
from steptwin.history.reading import HistoryDatabase
from steptwin.history.spool import Spool
from steptwin.simulation.script.steps import Set
from steptwin.subject.commands import Enable, Move

CELL = """
[world]
name = "cell"
[[mic488]]
name = "table"
"""
HOUR_US = 3_600_000_000


def wall(us: int) -> datetime:
    return datetime.fromtimestamp(us // 1_000_000, UTC) + timedelta(microseconds=us % 1_000_000)


@pytest.mark.parametrize("by_us", [-HOUR_US, HOUR_US])
def test_a_clock_that_is_set_during_a_motion(by_us: int, database: str) -> None:
    """A move of 20 s at 1 unit/s from 1 s on; the clock is set at 10 s, an input changes before and after."""
    made = RecordedWorld(CELL)
    made.run(1.0)
    subject = made.subject.inner
    subject.do(Enable("table", 1, on=True))
    subject.do(Move("table", 1, to=20_000.0))
    made.run(4.0)
    subject.do(Set((("table", "IN2", 1.0),)))
    made.run(5.0)
    before = made.wall_us()
    made.set_us += by_us
    made.run(5.0)
    subject.do(Set((("table", "IN2", 0.0),)))
    made.run(2.0)
    made.end()
    made.written(database)
    with HistoryDatabase(database) as past:
        run = past.run(-1)
        assert (run.ended - run.began).total_seconds() == pytest.approx(17.0 + by_us / 1e6)
        # by the time of the subject nothing is to be seen of it
        motion = past.series("table.M1.position", 0.0, 17.0, every_s=0.1, run=run.number)
        assert len(motion) == len(set(motion.seconds.tolist())) == 170
        assert bool(np.all(np.diff(motion.values) >= 0))
        levels = past.series("table.pins.IN2", run=run.number)
        changes = [value for value, last in zip(levels.values, [None, *levels.values[:-1]], strict=True) if value != last]
        assert changes == [0.0, 1.0, 0.0]
        assert bool(np.all(np.diff(levels.seconds) >= 0))
        # each moment has the wall clock that there was then
        at = [BEGAN_US + round(s * 1e6) + (by_us if s > 10.0 else 0) for s in motion.seconds.tolist()]
        off = np.abs(motion.at.astype(np.int64) - np.array(at))
        assert int(np.max(np.delete(off, 100))) <= 1000  # at 10 s it is both
        # an interval of the wall clock after it
        begin, end = wall(made.wall_us() - 2_000_000), wall(made.wall_us())
        late = past.series("table.M1.position", begin, end, every_s=0.5)
        assert late.seconds.tolist() == [15.0, 15.5, 16.0, 16.5]
        assert late.values.tolist() == [motion.values[round(10 * s)] for s in late.seconds.tolist()]
        (event,) = past.events(kinds=["clock"])
        assert (
            event.text
            == f"the wall clock went {'forward' if by_us > 0 else 'back'} by 3600.000 s: it was set, or this computer slept"
        )
        assert event.at == wall(before + by_us) + timedelta(seconds=0.1)


def test_a_clock_that_is_corrected_slowly_has_not_been_set() -> None:
    made = RecordedWorld(CELL)
    for _ in range(100):
        made.set_us += 50_000
        made.run(0.1)
    assert [event for batch in made.batches for event in batch.events] == []


def test_a_run_at_rest_goes_on_while_the_clock_is_set_back() -> None:
    made = RecordedWorld(CELL)
    made.run(1.0)
    made.set_us -= HOUR_US
    made.run(130.0, every_s=10.0)
    assert [len(batch) > 0 for batch in made.batches] == [True, True, False, False]


def test_runs_are_in_the_order_in_which_they_were_kept(database: str) -> None:
    """The clock was set back before the second one."""
    for set_us in (0, -HOUR_US):
        made = RecordedWorld(CELL)
        made.set_us = set_us
        made.recorder._batch.at_us = made.wall_us()
        made.heads[0] = made.recorder._begin_run(0, made.wall_us())
        made.end()
        made.written(database)
    with HistoryDatabase(database) as past:
        assert past.run(-1).began == wall(BEGAN_US - HOUR_US)
        assert [run.number for run in past.runs()] == sorted(run.number for run in past.runs())


def test_a_clock_that_is_set_forward_removes_nothing(
    database: str, engine: Engine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    del engine
    spool = Spool(tmp_path / "spool")
    from steptwin.history.database import read_url

    writer = writing.HistoryWriter(read_url(database, tmp_path), spool, print, keep_days=30)
    before = writer._safe_us(time.monotonic())
    monkeypatch.setattr(writing.time, "time_ns", lambda: (before + 24 * 365 * HOUR_US) * 1000)
    assert writer._safe_us(time.monotonic()) - before < HOUR_US
    monkeypatch.setattr(writing.time, "time_ns", lambda: (before - 24 * HOUR_US) * 1000)
    assert writer._safe_us(time.monotonic()) == before - 24 * HOUR_US
    writer._engine.dispose()
    spool.close()


@pytest.fixture
def warsaw(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Local time is that of Poland."""
    monkeypatch.setenv("TZ", "Europe/Warsaw")
    time.tzset()
    yield
    monkeypatch.undo()
    time.tzset()


@pytest.mark.usefixtures("warsaw")
@pytest.mark.parametrize(
    ("text", "moment"),
    [
        ("2026-01-15 12:00", "2026-01-15T11:00:00+00:00"),
        ("2026-07-15 12:00", "2026-07-15T10:00:00+00:00"),
        ("2026-07-15 12:00Z", "2026-07-15T12:00:00+00:00"),
        ("2026-07-15T12:00:00-05:00", "2026-07-15T17:00:00+00:00"),
        ("2026-10-25 02:30", "2026-10-25T00:30:00+00:00"),  # of two the first: summer time
        ("2026-10-25 02:30+01:00", "2026-10-25T01:30:00+00:00"),
    ],
)
def test_dates_of_an_interval(text: str, moment: str, database: str) -> None:
    made = RecordedWorld(CELL)
    made.end()
    made.written(database)
    with HistoryDatabase(database) as past:
        interval = read_interval(past, None, text, None)
        assert isinstance(interval.begin, datetime)
        assert interval.begin.astimezone(UTC).isoformat() == moment
        with pytest.raises(Misuse, match="this is before"):
            read_interval(past, None, "2026-10-25 02:30+01:00", "2026-10-25 02:30+02:00")


@pytest.mark.usefixtures("warsaw")
def test_what_is_printed_has_its_offset() -> None:
    """In the night in which summer time ends an hour comes twice: only the offset tells them apart."""
    first = datetime(2026, 10, 25, 0, 30, tzinfo=UTC)
    assert [_local(first + timedelta(hours=hours)) for hours in (0, 1)] == [
        "2026-10-25 02:30:00.000+02:00",
        "2026-10-25 02:30:00.000+01:00",
    ]
    assert _local(np.datetime64("2026-01-15T11:00:00.000000")) == "2026-01-15 12:00:00.000+01:00"
