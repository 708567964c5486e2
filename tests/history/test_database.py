"""Addresses of databases, and their tables, which are those of the migrations."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import pytest
from alembic.autogenerate import compare_metadata
from alembic.runtime.migration import MigrationContext
from sqlalchemy import Engine, select, text

from steptwin.errors import Misuse
from steptwin.history.database import check_version, engine_of, format_url, insert_all, read_url, upgrade
from steptwin.history.reading import HistoryDatabase
from steptwin.history.schema import METADATA, RUN, SAMPLE, TEXT

RELEASED = sorted((Path(__file__).parent / "schemas").glob("*.sql"))


@pytest.mark.parametrize(
    ("given", "found"),
    [
        ("sqlite:///h.db", "sqlite:////plant/h.db"),
        ("sqlite:////data/h.db", "sqlite:////data/h.db"),
        ("postgresql://hall@db/plant", "postgresql://hall@db/plant"),
        ("postgres://hall@db/plant", "postgresql://hall@db/plant"),
        ("postgresql+psycopg://db:5433/plant", "postgresql://db:5433/plant"),
        ("postgresql://hall:secret@db/plant", "postgresql://hall:***@db/plant"),
    ],
)
def test_addresses(given: str, found: str) -> None:
    assert format_url(read_url(given, Path("/plant"))) == found


@pytest.mark.parametrize("given", ["h.db", "", "mysql://db/plant", "sqlite://", "sqlite:///:memory:", "sqlite+pysqlite:///x"])
def test_other_addresses_are_refused(given: str) -> None:
    with pytest.raises(Misuse, match=r"permitted are sqlite:///FILE and postgresql://USER@HOST/NAME"):
        read_url(given, Path())


def test_the_migrations_make_the_tables_of_the_schema(engine: Engine) -> None:
    with engine.connect() as connection:
        assert compare_metadata(MigrationContext.configure(connection, opts={"compare_type": True}), METADATA) == []


def test_a_second_upgrade_changes_nothing(engine: Engine, database: str) -> None:
    with engine.begin() as connection:
        connection.execute(text("INSERT INTO text (text) VALUES ('kept')"))
        upgrade(connection, read_url(database, Path()))
        assert connection.execute(select(TEXT.c.text)).scalars().all() == ["kept"]


def test_a_database_of_a_later_version_is_refused(engine: Engine, database: str) -> None:
    url = read_url(database, Path())
    with engine.begin() as connection:
        connection.execute(text("UPDATE alembic_version SET version_num = '9999'"))
        with pytest.raises(Misuse, match="was written by a later steptwin"):
            upgrade(connection, url)
        with pytest.raises(Misuse, match="has tables of version 9999, expected 0001"):
            check_version(connection, url)


def test_a_database_without_a_history_is_refused(tmp_path: Path) -> None:
    sqlite3.connect(tmp_path / "other.db").execute("CREATE TABLE other (x)").connection.close()
    with pytest.raises(Misuse, match=r"other\.db has no history"):
        HistoryDatabase("sqlite:///other.db", tmp_path)


@pytest.mark.parametrize("released", RELEASED, ids=lambda path: path.stem)
def test_databases_of_released_versions_are_upgraded(released: Path, tmp_path: Path) -> None:
    """Each file is a dump of a database that a version has written."""
    file = sqlite3.connect(tmp_path / "h.db")
    file.executescript(released.read_text())
    file.close()
    url = read_url("sqlite:///h.db", tmp_path)
    made = engine_of(url)
    with made.begin() as connection:
        upgrade(connection, url)
    made.dispose()
    with HistoryDatabase("sqlite:///h.db", tmp_path) as past:
        # 1000 pulses/s² up to 1000 pulses/s, from 2.758 s on
        position = past.series("table.M1.position", every_s=1.0)
        assert [int(value) for value in position.values] == [0, 0, 0, 29, 741, 1712]
        assert past.series("table.M1.status").values.tolist()[-1] == "position reached"


def test_rows_are_inserted_as_they_are(engine: Engine) -> None:
    with engine.begin() as connection:
        run = {"key": "k", "subject": "s", "virtual": True, "began_ns": 0, "began_us": 0, "last_ns": 0, "last_us": 0}
        connection.execute(RUN.insert().values(id=1, ended=False, batches=0, **run))
        connection.execute(text("INSERT INTO point (id, subject, name, unit, type) VALUES (1, 's', 'n', '', 'number')"))
        rows = [(1, 1, 2**62, 5, -0.1, None), (1, 1, 7, 2**62, None, 3)]
        insert_all(connection, SAMPLE, ("run_id", "point_id", "t_ns", "at_us", "value", "text_id"), rows)
        insert_all(connection, TEXT, ("text",), [("tab\tnew\nline \\N \\ ' \" ü 位",)])
        insert_all(connection, TEXT, ("text",), [])
    with engine.connect() as connection:
        s = SAMPLE.c
        found = connection.execute(select(s.run_id, s.point_id, s.t_ns, s.at_us, s.value, s.text_id).order_by(s.id)).all()
        assert [tuple(row) for row in found] == rows
        assert connection.execute(select(TEXT.c.text)).scalar_one() == "tab\tnew\nline \\N \\ ' \" ü 位"
