"""Databases for the tests of histories: SQLite, and a PostgreSQL server of their own."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from postgres import PostgresServer, postgres_server, programs
from sqlalchemy import Engine

from steptwin.history.database import engine_of, read_url, upgrade


@pytest.fixture(scope="session")
def postgres(require_peer: Callable[[str], str]) -> Iterator[PostgresServer]:
    where = programs()
    require_peer("postgresql: initdb" if where is None else str(where / "initdb"))
    assert where is not None
    with postgres_server(where) as server:
        yield server


@pytest.fixture(params=["sqlite", "postgresql"])
def database(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """The address of an empty database."""
    if request.param == "sqlite":
        return f"sqlite:///{tmp_path / 'h.db'}"
    server: PostgresServer = request.getfixturevalue("postgres")
    name = f"t{abs(hash(str(tmp_path))):x}"
    server.query(f"CREATE DATABASE {name}")
    return server.url.removesuffix("postgres") + name


@pytest.fixture
def engine(database: str) -> Iterator[Engine]:
    """Connected to a database with its tables."""
    url = read_url(database, Path())
    made = engine_of(url)
    with made.begin() as connection:
        upgrade(connection, url)
    yield made
    made.dispose()
