"""Opening of databases: with their tables, or an explanation."""

from __future__ import annotations

import sqlite3
import time
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from alembic import command
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from alembic.util import CommandError
from sqlalchemy import Connection, Engine, Table, create_engine, event
from sqlalchemy.engine import URL, make_url
from sqlalchemy.exc import ArgumentError, DBAPIError, NoSuchModuleError, OperationalError

from steptwin.errors import DatabaseFailure, Misuse
from steptwin.extras import missing

SQLITE, POSTGRESQL = "sqlite", "postgresql"
BUSY_S = 10
"""For another process that writes to the same file."""
CONNECT_S = 5
RETRY_S = 0.01


def read_url(text: str, folder: Path) -> URL:
    """The address of a database; a file of SQLite is relative to ``folder``. Raises `Misuse`."""
    permitted = "permitted are sqlite:///FILE and postgresql://USER@HOST/NAME"
    try:
        url = make_url(text)
    except ArgumentError:
        raise Misuse(f"database = {text!r}: {permitted}") from None
    if url.drivername in {"postgresql", "postgres", "postgresql+psycopg"}:
        return url.set(drivername="postgresql+psycopg")
    if url.drivername != SQLITE:
        raise Misuse(f"database = {text!r}: {permitted}")
    if not url.database or url.database == ":memory:":
        raise Misuse(f"database = {text!r}: a file is missing; {permitted}")
    return url.set(database=str(folder / url.database))


def format_url(url: URL) -> str:
    """Without its password."""
    return url.render_as_string(hide_password=True).replace("+psycopg", "")


def engine_of(url: URL) -> Engine:
    """Connects when it is used first. Raises `Misuse` where the driver is missing."""
    try:
        if url.get_backend_name() == POSTGRESQL:
            return create_engine(url, connect_args={"connect_timeout": CONNECT_S}, pool_pre_ping=True)
        engine = create_engine(url, connect_args={"timeout": BUSY_S})
    except (ImportError, NoSuchModuleError):
        raise missing(format_url(url), "history") from None
    event.listen(engine, "connect", _set_up)
    return engine


def _set_up(connection: Any, _: object) -> None:
    try:
        _write_ahead(connection)
        for pragma in ("synchronous=NORMAL", "foreign_keys=ON"):
            connection.execute(f"PRAGMA {pragma}")
    except BaseException:  # of a file that is no database; nobody else closes it then
        connection.close()
        raise


def _write_ahead(connection: Any) -> None:
    """The first connection of a file changes its journal. SQLite does not wait for others that do so at the same moment."""
    end = time.monotonic() + BUSY_S
    while True:
        try:
            connection.execute("PRAGMA journal_mode=WAL")
        except sqlite3.OperationalError as error:
            if error.sqlite_errorcode != sqlite3.SQLITE_BUSY or time.monotonic() >= end:
                raise
            time.sleep(RETRY_S)
        else:
            return


_REMEDIES = {
    sqlite3.SQLITE_CORRUPT: "the file is damaged: put a copy in its place, or move it away to begin anew",
    sqlite3.SQLITE_NOTADB: "the file is damaged, or was never a database: put a copy in its place, or move it away to begin anew",
    sqlite3.SQLITE_FULL: "make room and run it again: what was written before stays",
    sqlite3.SQLITE_IOERR: "see that the disk is there, and run it again: what was written before stays",
    sqlite3.SQLITE_READONLY: "the file must be writable",
}
"""By the low byte of the error code of SQLite."""
_NO_SERVER = "see that the server runs and can be reached, and run it again: what was written before stays"


def failure(url: URL, error: DBAPIError) -> DatabaseFailure:
    """Which database it is, and what to do, in one line."""
    lines = str(error.orig).strip().splitlines()
    text = f"{format_url(url)}: {lines[0] if lines else type(error.orig).__name__}"
    remedy = _NO_SERVER if url.get_backend_name() == POSTGRESQL and isinstance(error, OperationalError) else None
    if isinstance(error.orig, sqlite3.Error) and error.orig.sqlite_errorcode is not None:
        remedy = _REMEDIES.get(error.orig.sqlite_errorcode & 0xFF)
    return DatabaseFailure(text if remedy is None else f"{text}; {remedy}")


# ---------------------------------------------------------------------- the schema


def _config(connection: Connection) -> Config:
    config = Config()
    config.set_main_option("script_location", str(Path(__file__).with_name("migrations")).replace("%", "%%"))
    config.attributes["connection"] = connection
    return config


def upgrade(connection: Connection, url: URL) -> None:
    """Bring the tables to the present version. Raises `Misuse` for a database of a later one."""
    try:
        command.upgrade(_config(connection), "head")
    except CommandError as error:
        raise Misuse(f"{format_url(url)} was written by a later steptwin: {error}") from None


def check_version(connection: Connection, url: URL) -> None:
    """Raises `Misuse` where the tables are not those of this version."""
    found = MigrationContext.configure(connection).get_current_revision()
    wanted = ScriptDirectory.from_config(_config(connection)).get_current_head()
    if found is None:
        raise Misuse(f"{format_url(url)} has no history")
    if found != wanted:
        raise Misuse(
            f"{format_url(url)} has tables of version {found}, expected {wanted}: 'steptwin up' brings an older one to it"
        )


# ---------------------------------------------------------------------- many rows


def insert_all(connection: Connection, table: Table, columns: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """The quickest way of each database: COPY of PostgreSQL, prepared statements of SQLite."""
    if connection.dialect.name == POSTGRESQL:
        cursor: Any = connection.connection.cursor()
        with cursor, cursor.copy(f"COPY {table.name} ({', '.join(columns)}) FROM STDIN") as copy:
            for row in rows:
                copy.write_row(row)
        return
    found = [tuple(row) for row in rows]
    if found:
        names, places = ", ".join(columns), ", ".join("?" * len(columns))
        connection.exec_driver_sql(f'INSERT INTO "{table.name}" ({names}) VALUES ({places})', found)
