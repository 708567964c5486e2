"""The way into the database: what waits while it is away, and what a crash of it leaves."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path

import pytest
from history_rig import BEGAN_US, head
from postgres import postgres_server, programs
from sqlalchemy import func, select, text
from tests.conftest import until

from steptwin.errors import Misuse
from steptwin.history import writer as module
from steptwin.history.chores import DAY_US
from steptwin.history.database import engine_of, read_url, upgrade
from steptwin.history.reading import HistoryDatabase
from steptwin.history.rows import RowBatch, SampleRow
from steptwin.history.schema import SAMPLE
from steptwin.history.spool import Spool
from steptwin.history.writer import HistoryWriter


def batch(number: int, rows: int = 1) -> RowBatch:
    """Values that count on from batch to batch."""
    first = (number - 1) * rows
    samples = [SampleRow(0, row, BEGAN_US + row, float(row)) for row in range(first, first + rows)]
    return RowBatch(run="one", number=number, time=first + rows, at_us=BEGAN_US + first + rows, samples=samples)


def start(url: str, spool: Spool, notices: list[str], folder: Path = Path(), keep_days: int | None = None) -> HistoryWriter:
    writer = HistoryWriter(read_url(url, folder), spool, notices.append, keep_days=keep_days)
    writer.start()
    return writer


def test_batches_come_into_the_database(database: str, tmp_path: Path) -> None:
    notices: list[str] = []
    spool = Spool(tmp_path / "spool")
    spool.begin(head())
    writer = start(database, spool, notices)
    for number in range(1, 101):
        spool.append(batch(number, rows=10))
    writer.close()
    assert (spool.waiting, notices) == (0, [])
    spool.close()
    with HistoryDatabase(database) as past:
        assert past.series("table.p0").values.tolist() == list(map(float, range(1000)))
    assert not (tmp_path / "spool").exists()


def test_a_database_that_is_not_there_yet(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The folder of the file is missing at first; then it is there."""
    monkeypatch.setattr(module, "PAUSE_S", (0.01, 0.02))
    notices: list[str] = []
    spool = Spool(tmp_path / "spool")
    spool.begin(head())
    url = f"sqlite:///{tmp_path / 'later' / 'h.db'}"
    writer = start(url, spool, notices)
    spool.append(batch(1))
    assert notices == [f"history: {url}: unable to open database file; rows are buffered on this disk"]
    (tmp_path / "later").mkdir()
    until(lambda: len(notices) == 2, "the database has been found")
    assert notices[1] == f"history: {url} answers again"
    writer.close()
    spool.close()
    with HistoryDatabase(url) as past:
        assert past.series("table.p0").values.tolist() == [0.0]


def test_what_is_left_at_the_end_comes_at_the_next_start(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "PAUSE_S", (0.01, 0.02))
    spool = Spool(tmp_path / "spool")
    spool.begin(head())
    url = f"sqlite:///{tmp_path / 'later' / 'h.db'}"
    writer = start(url, spool, [])
    spool.append(batch(1))
    writer.close()
    spool.close()
    (tmp_path / "later").mkdir()
    again = Spool(tmp_path / "spool")
    writer = start(url, again, [])
    again.begin(head("two"))
    writer.close()
    again.close()
    with HistoryDatabase(url) as past:
        assert past.series("table.p0").values.tolist() == [0.0]


@pytest.mark.parametrize("database", ["postgresql"], indirect=True)  # SQLite takes texts of any length
def test_rows_that_no_database_takes_are_set_apart(tmp_path: Path, database: str) -> None:
    notices: list[str] = []
    spool = Spool(tmp_path / "spool")
    wrong = head("long")
    object.__setattr__(wrong, "subject", "s" * 300)  # longer than its column
    spool.begin(wrong)
    spool.append(batch(1))
    spool.begin(head())
    spool.append(batch(1))
    writer = start(database, spool, notices)
    until(lambda: spool.waiting == 0, "all is done")
    writer.close()
    spool.close()
    assert len(notices) == 1
    assert "1 batches cannot be written (" in notices[0]
    assert notices[0].endswith(f"; they are in {tmp_path / 'spool' / 'refused'}")
    with HistoryDatabase(database) as past:
        assert [run.subject for run in past.runs()] == ["cell"]


def test_a_database_of_a_later_version_ends_the_start(tmp_path: Path) -> None:
    url = read_url(f"sqlite:///{tmp_path / 'h.db'}", Path())
    engine = engine_of(url)
    with engine.begin() as connection:
        upgrade(connection, url)
        connection.execute(text("UPDATE alembic_version SET version_num = '9999'"))
    engine.dispose()
    spool = Spool(tmp_path / "spool")
    with pytest.raises(Misuse, match="was written by a later steptwin"):
        HistoryWriter(url, spool, lambda _: None).start()
    spool.close()


def test_old_values_are_removed(database: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "CHORES_S", 0.0)
    monkeypatch.setattr(module.time, "time_ns", lambda: (BEGAN_US + 3 * DAY_US) * 1000)
    spool = Spool(tmp_path / "spool")
    spool.begin(head())
    spool.append(batch(1, rows=5))
    late = SampleRow(0, 9, BEGAN_US + 3 * DAY_US, 9.0)
    spool.append(RowBatch(run="one", number=2, time=9, at_us=late.at_us, samples=[late]))
    writer = start(database, spool, [], keep_days=1)
    engine = engine_of(read_url(database, Path()))

    def values() -> list[float]:
        with engine.connect() as connection:
            return list(connection.execute(select(SAMPLE.c.value).order_by(SAMPLE.c.at_us)).scalars())

    until(lambda: values() == [4.0, 9.0], "what is old is gone")
    writer.close()
    assert values() == [4.0, 9.0], "what held then stays"
    engine.dispose()
    spool.close()


def test_a_server_that_crashes_under_load_loses_nothing_and_takes_nothing_twice(
    require_peer: Callable[[str], str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "PAUSE_S", (0.05, 0.2))
    where = programs()
    require_peer("postgresql: initdb" if where is None else str(where / "initdb"))
    assert where is not None
    notices: list[str] = []
    with postgres_server(where) as server:
        spool = Spool(tmp_path / "spool")
        spool.begin(head())
        writer = start(server.url, spool, notices)
        sent, enough = 0, threading.Event()

        def load() -> None:
            nonlocal sent
            while not enough.is_set():
                sent += 1
                assert spool.append(batch(sent, rows=200))
                enough.wait(0.01)

        source = threading.Thread(target=load)
        source.start()
        for crash in range(3):
            before = sent
            until(lambda before=before: sent > before + 30, "there is load")
            server.crash()
            until(lambda crash=crash: len(notices) == 2 * crash + 1, "the failure was noticed")
            server.start()
            until(lambda crash=crash: len(notices) == 2 * crash + 2, "it answers again")
        enough.set()
        source.join()
        until(lambda: spool.waiting == 0, "all is in the database")
        writer.close()
        spool.close()
        engine = engine_of(read_url(server.url, Path()))
        with engine.connect() as connection:
            s = SAMPLE.c
            wanted = select(func.count(), func.count(s.value.distinct()), func.min(s.value), func.max(s.value))
            found = tuple(connection.execute(wanted).one())
            ordered = connection.execute(
                text("SELECT count(*) FROM (SELECT value - lag(value) OVER (ORDER BY id) AS step FROM sample) s WHERE step <> 1")
            ).scalar_one()
        engine.dispose()
    rows = sent * 200
    assert found == (rows, rows, 0.0, float(rows - 1))
    assert ordered == 0
    assert [notice.endswith("rows are buffered on this disk") for notice in notices] == [True, False] * 3
